import subprocess
import sys

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from helpers import use
from matplotlib.text import Text

import asperity as asp
from asperity import validation
from asperity.goniophotometer import Hemisphere, tensor_file
from asperity.lab import evaluate
from asperity.lobes import ByCosine, LobeModel, diffuse
from asperity.parameters import Colour

GREY = {"type": "diffuse", "reflectance": 0.25}
SLOPE = {"type": "diffuse", "reflectance": {"type": "spectrum", "value": [(400, 0.1), (700, 0.7)]}}
NM = [400, 450, 500, 600, 650, 700]
TRIANGLES = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n"


def test_the_face_is_lazy():
    """It knows its names, and imports what they need when one is used; then it sets a variant, and keeps it."""
    code = (
        "import sys, asperity as asp; assert {*asp.LAZY} <= {*dir(asp)} & {*asp.__all__};"
        "assert not {'mitsuba', 'numpy', 'matplotlib', 'scipy', 'asperity.api'} & {*sys.modules};"
        "asp.evaluate('diffuse', (0, 0), (0, 0), wavelengths=[500]); import mitsuba as mi; print(mi.variant())"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=120)
    assert result.stdout == "llvm_ad_rgb\n", result.stderr


def test_there_is_nothing_else():
    with pytest.raises(AttributeError, match="module 'asperity' has no attribute 'evalute'"):
        asp.evalute  # noqa: B018


@pytest.mark.parametrize("material", [GREY, "loaded"])
def test_lambert(rgb, material):
    """Values and densities in closed form, of any shape."""
    material = evaluate.load(GREY) if material == "loaded" else material
    theta = np.array([0, 30, 60])
    cosine = np.cos(np.radians(theta)) / np.pi
    wo = np.stack([theta, 40 * theta], axis=-1)
    assert asp.evaluate(material, (20, 5), wo) == pytest.approx(0.25 * cosine[:, None] * [1, 1, 1], rel=1e-6)
    assert asp.evaluate(material, np.zeros((4, 1, 2)), wo)[2, :, 0] == pytest.approx(0.25 * cosine, rel=1e-6)
    assert asp.pdf(material, [0, 0, 1], wo) == pytest.approx(cosine, rel=1e-6)
    assert asp.albedo(material, [[0, 50]]) == pytest.approx(np.full((1, 2, 3), 0.25), rel=1e-6)


def test_chunks_change_nothing(rgb, tmp_path):
    rng, options = np.random.default_rng(3), {"chunk": 97}
    wi, wo = (np.stack([rng.uniform(0, 90, 500), rng.uniform(0, 360, 500)], axis=-1) for _ in range(2))
    whole = asp.evaluate("gilded", wi, wo)
    assert np.array_equal(asp.evaluate("gilded", wi, wo, **options), whole)
    assert np.array_equal(asp.pdf("gilded", wi, wo, **options), asp.pdf("gilded", wi, wo))
    for one, other in zip(asp.sample("gilded", wi[:3], 90, **options), asp.sample("gilded", wi[:3], 90)):
        assert np.array_equal(one, other)
    out = np.lib.format.open_memmap(tmp_path / "f.npy", "w+", np.float32, whole.shape)
    assert asp.evaluate("gilded", wi, wo, out=out, **options) is out
    density = np.empty(500)
    asp.pdf("gilded", wi, wo, out=density)
    out.flush()
    assert np.array_equal(np.load(tmp_path / "f.npy"), whole)
    assert np.array_equal(density, asp.pdf("gilded", wi, wo))


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral", "scalar_rgb"])
def test_wavelengths(variant):
    """As many as one likes, though the variant has four; and the variant stays."""
    variant = use(variant)
    reflectance = 0.1 + 0.6 * (np.array(NM) - 400) / 300
    found = asp.evaluate(SLOPE, (0, 0), [[0, 0], [60, 0]], wavelengths=NM)
    assert found == pytest.approx(np.outer([1, 0.5], reflectance) / np.pi, rel=1e-5)
    assert asp.albedo(SLOPE, 30, wavelengths=NM) == pytest.approx(reflectance, rel=1e-5)
    assert asp.sample(SLOPE, (0, 0), 2, wavelengths=NM[:2]).weight == pytest.approx(reflectance[[[0, 1]] * 2], rel=1e-5)
    assert asp.pdf(SLOPE, (0, 0), (0, 0)) == pytest.approx(1 / np.pi, rel=1e-6)
    assert mi.variant() == variant


@pytest.mark.parametrize("variant, channels", [("scalar_rgb", 3), ("llvm_ad_mono", 1), ("llvm_ad_mono_polarized", 1)])
def test_other_variants(variant, channels):
    variant = use(variant)
    assert asp.evaluate(GREY, (0, 0), (0, 0)) == pytest.approx([0.25 / np.pi] * channels, rel=1e-6)
    assert mi.variant() == variant


def test_samples(rgb):
    """Cosine-distributed: of 2^14 samples, the mean of the cosine, 2/3, has a standard error of 0.0018."""
    drawn = asp.sample(GREY, [(0, 0), (70, 10)], np.int64(2**14), seed=4)
    assert drawn.wo.shape == (2, 2**14, 3) and drawn.pdf.shape == (2, 2**14)
    assert drawn.weight == pytest.approx(np.full((2, 2**14, 3), 0.25), rel=1e-6)
    assert drawn.pdf == pytest.approx(drawn.wo[..., 2] / np.pi, rel=1e-5)
    assert drawn.wo[..., 2].mean(axis=1) == pytest.approx([2 / 3] * 2, abs=0.0018 * 5)
    assert not np.array_equal(asp.sample(GREY, (0, 0), 9).wo, asp.sample(GREY, (0, 0), 9, seed=1).wo)


def test_glass_has_values_below(rgb):
    """All that is not reflected is transmitted; so a sheet of `roughdielectric` has values on both sides."""
    glass = {"type": "roughdielectric", "alpha": 0.3}
    assert asp.evaluate(glass, (10, 0), (170, 180)).min() > 0 < asp.evaluate(glass, (170, 0), (170, 180)).min()
    drawn = asp.sample(glass, (0, 0), 1000)
    assert 0 < (drawn.wo[..., 2] > 0).mean() < 0.2


@pytest.fixture(scope="module")
def measured():
    mi.set_variant("llvm_ad_rgb")
    return asp.measure(np.zeros((2, 2)), [10, 40, 80], bsdf=GREY, spacing=1.0, sensor=Hemisphere(8, 16), paths=2**16)


def test_a_measurement_has_values_where_it_was_measured(rgb, measured, tmp_path):
    """65536 paths over 128 cells: 1000 a cell at 40 degrees, of which a quarter comes back; a standard error of 3%."""
    assert measured.total_albedo.value == pytest.approx(np.full((3, 3), 0.25), rel=1e-6)
    assert asp.evaluate(measured, (40, 0), (30, 90)) == pytest.approx([0.25 * 0.75**0.5 / np.pi] * 3, rel=0.15)
    with pytest.raises(asp.ParameterError, match=r"wi\[0\] = \(85, 0\): expected θ within \[10, 80\] degrees"):
        asp.evaluate(measured, (85, 0), (30, 90))
    tensor_file.write(measured, tmp_path / "flat.bsdf")
    with pytest.raises(asp.ParameterError, match=r"expected θ within \[10, 80\] degrees: there flat was measured"):
        asp.evaluate(tmp_path / "flat.bsdf", (85, 0), (30, 90))
    with pytest.raises(asp.ParameterError, match="require the use of a RGB variant"):
        asp.evaluate(measured, (40, 0), (30, 90), wavelengths=[500])


def test_measured_pairs_become_any_file_and_have_values_in_their_channels(rgb, tmp_path):
    """A measurement at wavelengths is answered in a spectral variant; tables of scattered pairs are 2% off at most."""
    wavelengths, seen = [450, 550, 600, 650, 700], []
    told = asp.convert(
        GREY, tmp_path / "a.csv", wavelengths=wavelengths, resolution=10, progress=lambda *x: seen.append(x)
    )
    assert told.relative[2] < 1e-5 and seen == [("writing", 0, 2), ("checking", 1, 2)]
    found = asp.evaluate(tmp_path / "a.csv", (40, 0), [(30, 90), (60, 10)])
    cosines = np.cos(np.radians([[30], [60]]))
    assert found.shape == (2, 5) and found == pytest.approx(0.25 / np.pi * cosines * np.ones(5), rel=0.02)
    assert mi.variant() == "llvm_ad_rgb"
    with pytest.raises(asp.ParameterError, match="has its own channels"):
        asp.convert(tmp_path / "a.csv", tmp_path / "b.npz", wavelengths=[500])


def test_what_is_measured(rgb, tmp_path):
    (tmp_path / "flat.obj").write_text(TRIANGLES)
    effort = {"paths": 1000, "tiles": 2, "sensor": Hemisphere(2, 4)}
    mesh = asp.measure(tmp_path / "flat.obj", 30, [0, 90], bsdf=GREY, **effort)
    assert mesh.total_albedo.value == pytest.approx(np.full((2, 3), 0.25), rel=1e-6)
    assert mesh.incident.tolist() == [[30, 0], [30, 90]]
    model = asp.measure("vgroove", 0, **effort)
    assert model.about["model"]["type"] == "vgroove"
    assert mesh.plot().axes and model.plot().axes
    mi.set_variant("scalar_rgb")
    assert asp.measure(tmp_path / "flat.obj", 30, **effort, wavelengths=[450, 500, 550, 600]).mode == "spectral"
    assert mi.variant() == "scalar_rgb"


def test_checks(rgb, tmp_path):
    white = asp.material(GREY, {"reflectance": {"type": "uniform", "value": 2.0}})
    wrong, right = (asp.check(material, ("energy", "determinism")) for material in (white, GREY))
    assert right.passed and not right.plot() and not right.save(tmp_path)
    assert [result.name for result in wrong.failed] == ["energy"] and len(list(wrong)) == 2
    assert "energy        FAILED   albedo 2.0000" in str(wrong) and len(wrong.plot()) == 1
    assert [path.read_bytes()[1:4] for path in wrong.save(tmp_path / "new")] == [b"PNG"]


def test_a_picture(rgb, tmp_path):
    picture = asp.render("gilded", size=(24, 16), spp=2, object="sphere", env="constant")
    assert picture.image.shape == (16, 24, 3) and 0.1 < picture.image.mean() < 1
    picture.save(tmp_path / "a.exr")
    picture.save(tmp_path / "a.png")
    assert np.array(mi.Bitmap(str(tmp_path / "a.exr"))) == pytest.approx(picture.image, rel=1e-3)  # 16 bits, or more
    assert np.array(mi.Bitmap(str(tmp_path / "a.png"))).dtype == np.uint8
    assert picture.plot().axes[0].images
    for path, message in (
        ("a.jpg", "its ending has to be one of .png, .exr"),
        ("b/a.png", "cannot write into the fold"),
    ):
        with pytest.raises(asp.ParameterError, match=message):
            picture.save(tmp_path / path)


def test_presets():
    found = asp.presets()
    assert found["gilded"].description["type"] == "micrograin" and len(found) >= 40


@pytest.mark.parametrize("materials, theta", [([GREY], 30), ([GREY, "gilded"], np.array([30]))])
def test_plots(rgb, materials, theta, tmp_path):
    figure = asp.plot(*materials, view="slices", theta=theta)
    figure.savefig(tmp_path / "slices.png")
    assert len(figure.axes[0].lines) >= len(materials)


def test_wavelengths_of_numpy(rgb):
    names = [text.get_text() for text in asp.plot(GREY, channel="each", wavelengths=np.array([450, 550])).findobj(Text)]
    assert {"450 nm", "550 nm"} <= {word.strip() for name in names for word in name.split(",")}


def test_a_spectrum_needs_no_spectral_variant(rgb):
    assert asp.plot(SLOPE, view="spectrum", theta=[30]).axes and mi.variant() == rgb


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "scalar_rgb"])
def test_a_comparison(variant, tmp_path):
    """Twice the reflectance: 100 % brighter everywhere."""
    variant = use(variant)
    found = asp.compare(GREY, {"type": "diffuse", "reflectance": 0.5})
    assert found.numbers["mean_relative_error"] == pytest.approx(1, rel=1e-6)
    assert found.found.albedo_difference == pytest.approx(np.full(18, 0.25), rel=1e-6)
    found.save(tmp_path / "a.json")
    found.save(tmp_path / "a.png")
    assert {path.name for path in tmp_path.iterdir()} == {"a.json", "a.png"} and mi.variant() == variant
    with pytest.raises(asp.ParameterError, match="its ending has to be one of"):
        found.save(tmp_path / "a.jpg")


class Lambert(LobeModel):
    """A model of one's own."""

    reflectance = Colour("albedo", 0.5)

    def flags(self):
        return [diffuse()]

    def lobes(self, si, active):
        albedo = self.at("reflectance", si, active)
        return [ByCosine(lambda wi, wo: albedo / dr.pi)]


def test_a_model_of_ones_own(rgb, registry):
    assert asp.register(Lambert) is Lambert
    for variant in ("llvm_ad_rgb", "llvm_ad_mono"):
        mi.set_variant(variant)
        assert asp.albedo("lambert", 30) == pytest.approx(0.5, rel=1e-6)

    class Darker(Lambert):
        """What a notebook makes of it when the cell is run again."""

        reflectance = Colour("albedo", 0.1)

    asp.register(Darker, "lambert")
    assert asp.albedo("lambert", 30) == pytest.approx(0.1, rel=1e-6)


def test_a_report(rgb, tmp_path, monkeypatch):
    section = validation.Section("one", "text", [])
    monkeypatch.setitem(validation.PAPERS, "vgroove", {"one": lambda effort: section})
    assert asp.validate("vgroove", tmp_path / "report", quick=True).passed
    assert "--quick" in (tmp_path / "report" / "report.md").read_text()


UP = (0, 0)
BAD = {
    "below": (lambda: asp.evaluate(GREY, UP, (91, 0)), r"wo\[0\] = \(91, 0\): .* diffuse has no values below"),
    "from below": (lambda: asp.pdf(GREY, (0, 0, -1), UP), r"wi\[0\] = \(0, 0, -1\): .* within \[0, 90\] degrees"),
    "material": (lambda: asp.evaluate("glided", UP, UP), "Did you mean 'gilded'"),
    "NaN": (lambda: asp.sample(GREY, (np.nan, 0), 5), r"wi\[0\] = \(nan, 0\)"),
    "shape": (lambda: asp.evaluate(GREY, [1], UP), r"wi has the shape \(1,\)"),
    "out": (lambda: asp.pdf(GREY, UP, UP, out=np.zeros((2,))), "out has the shape"),
    "no array": (lambda: asp.pdf(GREY, UP, UP, out=[0]), "out: expected an array of floating-point numbers"),
    "integers": (lambda: asp.evaluate(GREY, UP, UP, out=np.zeros(3, int)), "out: expected an array of floating"),
    "seed": (lambda: asp.sample(GREY, UP, 5, seed=-1), "seed = -1: expected a whole number, at least 0"),
    "words": (lambda: asp.evaluate(GREY, UP, UP, wavelengths=["red"]), r"wavelengths = \['red'\]: expected a list"),
    "theta": (lambda: asp.albedo(GREY, 100), r"theta\[0\] = \(100, 0\): .* within \[0, 90\]"),
    "glass": (lambda: asp.albedo({"type": "roughdielectric"}, 100), r"theta\[0\] = \(100, 0\): .* within \[0, 90\]"),
    "word": (lambda: asp.albedo(GREY, "up"), "theta and phi: expected numbers"),
    "samples": (lambda: asp.albedo(GREY, 0, samples=100), "samples = 100: expected a power of two"),
    "n": (lambda: asp.sample(GREY, UP, 0), "n = 0: expected a whole number, at least 1"),
    "nm": (lambda: asp.evaluate(GREY, UP, UP, wavelengths=[300]), r"wavelengths = \[300\]: expected a list of numbers"),
    "no nm": (lambda: asp.evaluate(GREY, UP, UP, wavelengths=[]), r"wavelengths = \[\]"),
    "many nm": (lambda: asp.sample(GREY, UP, 1, wavelengths=NM), "6 of them, and a sample has at most 4"),
    "variant": (
        lambda: asp.evaluate(evaluate.load(GREY), UP, UP, wavelengths=[500]),
        "BSDF of variant [a-z]*_ad_rgb, and [a-z]*_ad_spectral is set",
    ),
    "check": (lambda: asp.check(GREY, ["enrgy"]), "Did you mean 'energy'"),
    "no check": (lambda: asp.check(GREY, []), "only: expected at least one check"),
    "settings": (lambda: asp.material("gilded", 3), "settings = 3: expected a mapping"),
    "memory": (lambda: asp.sample(GREY, UP, 10**14), "GiB for 100000000000000 results"),
    "tracing": (lambda: asp.measure("vgroove", 0, path=3), "path: makes no sense with measuring. Did you mean 'paths'"),
    "paths": (lambda: asp.measure("vgroove", 0, paths="many"), "paths = 'many': expected a number"),
    "sensor": (lambda: asp.measure("vgroove", 0, sensor="retr"), "Did you mean 'retro'"),
    "no geometry": (lambda: asp.measure(GREY), "has no microgeometry to measure"),
    "spacing": (lambda: asp.measure(np.zeros((2, 2))), "spacing: heights need"),
    "unused": (lambda: asp.measure("vgroove", bsdf=GREY), "bsdf: makes no sense"),
    "horizontal": (lambda: asp.measure("vgroove", 90), "theta = 90"),
    "size": (lambda: asp.render(GREY, size=0), "width = 0: expected a whole number"),
    "sides": (lambda: asp.render(GREY, size=(4, 4, 4)), r"size = \(4, 4, 4\): expected a whole number, or a width"),
    "too much": (
        lambda: asp.render(GREY, size=2**15, spp=64),
        "spp = 64: expected a whole number, at least 1 and at mo",
    ),
    "view's": (lambda: asp.render(GREY, lihgt="key"), "lihgt: makes no sense with the preview scene. .* 'light'"),
    "object": (lambda: asp.render(GREY, object="pwan"), "Did you mean 'pawn'"),
    "view": (lambda: asp.plot(GREY, view="lobe"), "Did you mean 'lobes'"),
    "no view": (lambda: asp.plot(GREY, view=None), "unknown view None"),
    "no angles": (lambda: asp.plot(GREY, theta=[]), "theta: expected at least one number"),
    "words of angles": (lambda: asp.plot(GREY, theta="up"), "theta = 'up': expected a number, or a list"),
    "nothing": (lambda: asp.plot(), "expected at least one"),
    "option": (lambda: asp.plot(GREY, theta_i=[3]), "theta_i: makes no sense with view lobes"),
    "paper": (lambda: asp.validate("vgrove", "nowhere"), "Did you mean 'vgroove'"),
    "a file": (lambda: asp.validate("vgroove", __file__), "cannot make this folder: File exists"),
    "no model": (lambda: asp.register(int), "expected a class derived from asperity.lobes.LobeModel"),
    "a texture's": (lambda: asp.register(Lambert, "settled"), "name = 'settled': there is such a plugin already"),
    "our name": (lambda: asp.register(Lambert, "vgroove"), "name = 'vgroove': there is such a plugin already"),
    "Mitsuba's": (lambda: asp.register(Lambert, "diffuse"), "name = 'diffuse': there is such a plugin already"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_input(rgb, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    call, message = BAD[name]
    with pytest.raises(asp.AsperityError, match=message):
        call()
    assert mi.variant() == rgb and not list(tmp_path.iterdir())


def test_a_spectral_variant_needs_wavelengths():
    variant = use("llvm_ad_spectral")
    with pytest.raises(asp.ParameterError, match=f"wavelengths: variant {variant} needs them, in nm"):
        asp.evaluate(GREY, UP, UP)
