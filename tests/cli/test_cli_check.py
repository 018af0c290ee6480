import pytest

from asperity.lab import plugins
from asperity.lab.checks.variants import usable_variants


def test_a_right_bsdf(asperity, tmp_path):
    result = asperity("check", "diffuse")
    assert result.exit_code == 0, result.output
    assert "reciprocity" in result.output and "failed" not in result.output
    assert not list(tmp_path.iterdir())


def test_a_wrong_bsdf(asperity, tmp_path):
    """Reflects twice what it receives."""
    result = asperity("check", "diffuse", "--set", 'reflectance={"type": "uniform", "value": 2}', "--pictures", "wrong")
    assert result.exit_code == 1
    assert "failed" in result.output and "wrong/diffuse-energy.png" in result.output
    assert (tmp_path / "wrong" / "diffuse-energy.png").read_bytes().startswith(b"\x89PNG")


def test_pictures_in_a_file(asperity, tmp_path):
    """Refused before anything is checked."""
    (tmp_path / "wrong").touch()
    result = asperity("check", "diffuse", "--pictures", "wrong")
    assert result.exit_code == 2 and result.output == "error: --pictures wrong: it is a file. Name a folder.\n"


def test_a_material_file(asperity, tmp_path):
    (tmp_path / "gold.json").write_text('{"type": "conductor", "material": "Au"}')
    result = asperity("check", "--material", "gold.json", "--set", "material=Ag")
    assert result.exit_code == 0, result.output
    assert "skipped" in result.output


def test_one_check_only(asperity):
    result = asperity("check", "diffuse", "--only", "determinism")
    assert result.exit_code == 0 and "determinism" in result.output and "furnace" not in result.output


def test_a_bsdf_of_ones_own(asperity, tmp_path):
    mine = tmp_path / "mine.py"
    white = '{"type": "diffuse", "reflectance": {"type": "uniform", "value": 2.0}}'
    mine.write_text(f"import mitsuba as mi\nmi.register_bsdf('too_white', lambda _: mi.load_dict({white}))")
    result = asperity("check", "too_white", "--import", "mine.py", "--only", "energy", "--only", "variants")
    plugins.forget(mine)
    usable = len(usable_variants()[0])
    assert result.exit_code == 1 and "albedo 2.0000" in result.output and f"{usable} variants agree" in result.output


def test_a_file_of_ones_own_that_fails(asperity, tmp_path):
    (tmp_path / "mine.py").write_text("1 / 0")
    result = asperity("check", "mine", "--import", "mine.py")
    plugins.forget(tmp_path / "mine.py")
    assert result.exit_code == 2 and "mine.py fails: ZeroDivisionError: division by zero" in result.stderr


@pytest.mark.parametrize("given", ["chi2", "chi²"])
def test_names_of_checks(asperity, given):
    assert asperity("check", "diffuse", "--only", given).exit_code == 0


def test_the_nearest_name_of_a_check(asperity):
    result = asperity("check", "diffuse", "--only", "chi")
    assert result.exit_code == 2 and "Did you mean 'chi2'?" in result.output
