"""A user's own BSDF comes from a file that knows nothing of variants."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import pytest

from asperity.errors import AsperityError
from asperity.lab import checks, plugins

MINE = """
import mitsuba as mi

mi.set_variant("llvm_ad_rgb")


class Black(mi.BSDF):
    def __init__(self, props):
        mi.BSDF.__init__(self, props)

    def eval(self, ctx, si, wo, active=True):
        return mi.Spectrum(0)

    def pdf(self, ctx, si, wo, active=True):
        return mi.Float(0)

    def sample(self, ctx, si, sample1, sample2, active=True):
        return mi.BSDFSample3f(), mi.Spectrum(0)


mi.register_bsdf("black", Black)
"""


@pytest.fixture
def mine(tmp_path):
    (tmp_path / "black.py").write_text(MINE)
    yield tmp_path / "black.py"
    plugins.forget(tmp_path / "black.py")


def test_a_file_is_run_in_every_variant(rgb, mine):
    plugins.load(mine)
    (result,) = checks.check({"type": "black"}, only=["variants"])
    assert result.passed, result
    assert mi.variant() == rgb


def test_the_variant_that_a_file_sets_is_ignored(mine):
    plugins.load(mine)
    mi.set_variant("scalar_spectral")
    assert mi.variant() == "scalar_spectral"
    assert isinstance(mi.load_dict({"type": "black"}), mi.BSDF)


def test_loaded_again_it_is_read_again(rgb, mine):
    for name in ("first", "second"):
        mine.write_text(MINE.replace('"black"', f'"{name}"'))
        plugins.load(mine)
    mi.set_variant("scalar_rgb")
    mi.load_dict({"type": "second"})
    with pytest.raises(RuntimeError, match="first"):
        mi.load_dict({"type": "first"})


def test_what_is_beside_it_can_be_imported(rgb, mine):
    (mine.parent / "blackness.py").write_text("name = 'black_as_pitch'")
    mine.write_text("from blackness import name\n" + MINE.replace('"black"', "name"))
    plugins.load(mine)
    mi.load_dict({"type": "black_as_pitch"})


def test_a_class_beside_it_is_defined_anew_in_every_variant(rgb, mine):
    definition, registration = MINE.split("mi.register_bsdf")
    (mine.parent / "definition.py").write_text(definition)
    mine.write_text(f"import mitsuba as mi\nfrom definition import Black\nmi.register_bsdf{registration}")
    plugins.load(mine)
    (result,) = checks.check({"type": "black"}, only=["variants"])
    assert result.passed, result


@pytest.mark.parametrize(
    "name, text, message",
    [
        ("none.py", None, "no such file"),
        ("black.txt", MINE, "its ending is '.txt'"),
        ("fails.py", "1 / 0", "fails.py fails: ZeroDivisionError"),
        ("syntax.py", "class", "syntax.py fails: SyntaxError"),
    ],
)
def test_what_is_wrong_is_said(rgb, mine, name, text, message):
    if text is not None:
        (mine.parent / name).write_text(text)
    with pytest.raises(AsperityError, match=message):
        plugins.load(mine.parent / name)
