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


def test_a_material_file(asperity, tmp_path):
    (tmp_path / "gold.json").write_text('{"type": "conductor", "material": "Au"}')
    result = asperity("check", "--material", "gold.json", "--set", "material=Ag")
    assert result.exit_code == 0, result.output
    assert "skipped" in result.output


def test_one_check_only(asperity):
    result = asperity("check", "diffuse", "--only", "determinism")
    assert result.exit_code == 0 and "determinism" in result.output and "furnace" not in result.output
