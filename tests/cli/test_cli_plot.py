"""`asperity plot` and `asperity compare`."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from asperity.cli import compare

GREY, WHITE = (f'{{"type": "diffuse", "reflectance": {reflectance}}}' for reflectance in (0.5, 0.6))
MEASURE = ("measure", "micrograin", "--theta", "30", "--paths", "2e4", "--tiles", "4", "--cells", "4x8", "-o", "dust")


def works(result):
    assert result.exit_code == 0, result.output
    return result.output


def files():
    return sorted(path.name for path in Path().iterdir())


@pytest.mark.parametrize(
    "arguments, written",
    [
        (("gilded",), "gilded-lobes.png"),
        (("gilded", "roughconductor", "--view", "slices", "--theta", "20,50", "--scale", "log"), "gilded-slices.png"),
        ((GREY, "--view", "albedo", "-o", "out.svg"), "out.svg"),
        (("roughplastic", "--view", "hemisphere", "--isolines", "--theta", "30", "-o", "out.pdf"), "out.pdf"),
        (("roughconductor", "--set", "material=Cu", "--view", "spectrum"), "roughconductor-spectrum.png"),
        (("diffuse", "--view", "slices", "--wavelengths", "450,650", "--channel", "each"), "diffuse-slices.png"),
    ],
    ids=lambda one: " ".join(one) if isinstance(one, tuple) else one,
)
def test_plot_writes_one_picture(asperity, arguments, written):
    assert works(asperity("plot", *arguments)) == f"{written}\n"
    assert files() == [written] and Path(written).stat().st_size > 5000


def test_svg_holds_names_and_units_as_text(asperity):
    works(asperity("plot", GREY, WHITE, "--view", "slices", "-o", "out.svg"))
    text = Path("out.svg").read_text()
    assert "diffuse, reflectance = 0.5" in text and "diffuse, reflectance = 0.6" in text and "[1/sr]" in text


def test_a_material_beside_itself_with_other_parameters(asperity):
    works(asperity("plot", "gilded", "gilded", "--set", "tau_0=0.7", "--view", "slices", "-o", "out.svg"))
    text = Path("out.svg").read_text()
    assert "gilded, tau_0 = 0.7" in text and "gilded, tau_0 = 0.2" in text


def test_a_measurement_alone_and_beside_its_model(asperity):
    works(asperity(*MEASURE))
    assert works(asperity("plot", "dust.npz")) == "dust.png\n"
    assert works(asperity("plot", "dust.npz", "micrograin", "--view", "slices")) == "dust-slices.png\n"
    assert works(asperity("plot", "micrograin", "dust.npz", "--view", "hemisphere")) == "micrograin-hemisphere.png\n"


BAD = [
    (("plot", "gilden"), "unknown material 'gilden'. Did you mean 'gilded'?"),
    (("plot", "diffuse", "--view", "polar"), "unknown view 'polar'"),
    (("plot", "diffuse", "--theta", "30,x"), "--theta '30,x': expected numbers, such as 0,30,60"),
    (("plot", "diffuse", "--theta", "95"), "theta = 95"),
    (("plot", "diffuse", "--theta", "nan"), "theta = nan"),
    (("plot", "diffuse", "--isolines"), "isolines: makes no sense with view lobes"),
    (("plot", "diffuse", "--no-model"), "model: makes no sense with a view"),
    (("plot", "conductor"), "conductor is all mirror"),
    (("plot", "diffuse", "-o", "none/out.png"), "cannot write into the folder 'none'"),
    (("plot", "diffuse", "-o", "out.jpg"), "'.jpg'. Allowed: .png, .pdf, .svg"),
    (("plot", "dust.npz", "--theta", "30"), "theta: makes no sense with a whole measurement: choose a --view"),
    (("plot", "dust.npz", "--view", "slices", "--theta", "45"), "dust: not measured at θ_i = 45°"),
    (("plot", "dust.npz", "diffuse", "--variant", "llvm_ad_spectral"), "other channels there than dust"),
    (("compare", "diffuse", "difuse"), "unknown material 'difuse'. Did you mean 'diffuse'?"),
    (("compare", "diffuse", "plastic", "-o", "out.exr"), "'.exr'. Allowed: .png, .pdf, .svg"),
    (("compare", "diffuse", "plastic", "--variant", "scalar_rgb"), "variant scalar_rgb"),
]


@pytest.mark.parametrize("arguments, culprit", BAD, ids=[" ".join(arguments) for arguments, _ in BAD])
def test_bad_input_writes_nothing(asperity, arguments, culprit):
    if "dust.npz" in arguments:
        works(asperity(*MEASURE))
    before = files()
    result = asperity(*arguments)
    assert result.exit_code == 2 and isinstance(result.exception, SystemExit), result.output
    assert culprit in result.output
    assert "Usage:" in result.output or len(result.stderr.strip().splitlines()) == 1
    assert files() == before


def test_a_picture_that_cannot_be_written_is_not_half_there(asperity, monkeypatch):
    from matplotlib.figure import Figure

    def full(self, path, **options):
        Path(path).write_bytes(b"half")
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Figure, "savefig", full)
    result = asperity("plot", "diffuse")
    assert result.exit_code == 2 and "No space left" in result.stderr and files() == []


def test_compare_prints_what_two_lambertians_differ_by(asperity):
    """Of 0.5 and 0.6: a fifth, everywhere."""
    output = works(asperity("compare", GREY, WHITE, "--no-preview"))
    assert output.count("20.00%") == 2 and "+0.1000" in output and "FLIP" not in output
    assert files() == ["material-material.png"]
    numbers = json.loads(works(asperity("compare", GREY, WHITE, "--no-preview", "--json")))
    assert numbers["a"] == "diffuse, reflectance = 0.5" and numbers["mean_relative_error"] == pytest.approx(0.2)


def test_compare_renders_previews(asperity, monkeypatch):
    """With FLIP, if its package is there; without, the plain difference and a line that says so."""
    monkeypatch.setattr(compare, "SIZE", 16)
    monkeypatch.setattr(compare, "SPP", 1)
    monkeypatch.setitem(sys.modules, "flip_evaluator", None)
    result = asperity("compare", GREY, WHITE, "--json", "-o", "out.png")
    numbers = json.loads(result.stdout)
    assert numbers["preview_difference"] > 0 and "preview_flip" not in numbers
    assert result.stderr == f"{compare.NO_FLIP}\n"


def test_flip_of_known_pictures():
    """0 for the same; 1, its largest, for black and green in a whole picture (Andersson et al. 2020, section 4.1)."""
    pytest.importorskip("flip_evaluator")
    black, green = np.zeros((32, 32, 3)), np.broadcast_to([0.0, 1.0, 0.0], (32, 32, 3))
    assert not compare.flip(green, green).any()
    error = compare.flip(green, black)
    assert error.shape == (32, 32) and 0.9 < error.mean() <= 1
