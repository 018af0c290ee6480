import json
import signal
from importlib.util import find_spec

import mitsuba as mi
import numpy as np
import pytest

from asperity.cli.passes import pass_size
from asperity.cli.render import NEXT
from asperity.scenes import denoise, presets

TINY = ("--size", "32", "--spp", "4")
SCENE = {
    "type": "scene",
    "integrator": {"type": "path"},
    "sensor": {
        "type": "perspective",
        "to_world": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, -4], [0, 0, 0, 1]],
        "film": {"type": "hdrfilm", "width": 24, "height": 16},
        "sampler": {"type": "independent", "sample_count": 6},
    },
    "light": {"type": "constant"},
    "ball": {"type": "sphere", "bsdf": {"type": "micrograin", "tau_0": {"type": "bitmap", "filename": "tau.exr"}}},
}
XML = """<scene version="3.0.0">
  <integrator type="aov"><string name="aovs" value="distance:depth,base:albedo"/><integrator type="path"/></integrator>
  <sensor type="perspective">
    <transform name="to_world"><translate z="-4"/></transform>
    <film type="hdrfilm"><integer name="width" value="24"/><integer name="height" value="16"/></film>
  </sensor>
  <emitter type="constant"/>
  <shape type="sphere"><bsdf type="micrograin"><float name="tau_0" value="0.4"/><bsdf type="diffuse"/></bsdf></shape>
</scene>"""


def pixels(path):
    return np.array(mi.Bitmap(str(path)))


def files(folder):
    return sorted(path.name for path in folder.iterdir())


def test_the_default_writes_two_files_and_says_what_next(asperity, tmp_path):
    result = asperity("render", *TINY)
    assert result.exit_code == 0, result.output
    assert files(tmp_path) == ["asperity.exr", "asperity.png"]
    assert pixels("asperity.png").shape == (32, 32, 3) and pixels("asperity.png").dtype == np.uint8
    assert pixels("asperity.exr").min() > 0
    assert all(command in result.output for command in NEXT)


@pytest.mark.parametrize("command", NEXT)
def test_what_it_proposes_works(asperity, command):
    arguments = command.split()[1:]
    result = asperity(*arguments, *(TINY if arguments[0] == "render" else ()))
    assert result.exit_code == 0, result.output


def test_the_exr_is_linear_and_the_png_srgb(asperity):
    asperity("render", "--no-denoise", *TINY)
    linear = np.clip(pixels("asperity.exr"), 0, 1)
    srgb = np.where(linear < 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    assert np.abs(255 * srgb - pixels("asperity.png")).max() <= 1


def test_same_seed_same_picture_and_set_changes_it(asperity):
    common = ("render", "--preset", "gilded", *TINY)
    for name, more in {"a": (), "b": (), "seed": ("--seed", "1"), "set": ("--set", "base.alpha=0.6")}.items():
        assert asperity(*common, *more, "-o", f"{name}.exr").exit_code == 0
    a, b, seed, changed = (pixels(f"{name}.exr") for name in ("a", "b", "seed", "set"))
    assert np.allclose(a, b, rtol=1e-5)  # the film sums in any order
    assert not np.allclose(a, seed, rtol=1e-3)
    assert not np.allclose(a, changed, rtol=1e-3)


def test_compare_with_itself_shows_no_difference(asperity):
    result = asperity("render", "--preset", "gilded", "--compare", "gilded", *TINY, "-o", "out.exr")
    assert "or 0.00% of the mean" in result.output
    left, right, difference = np.split(pixels("out.exr"), 3, axis=1)
    assert np.allclose(left, right, rtol=1e-5) and difference.max() < 0.01  # the film sums in any order


def test_compare_scales_the_difference_by_the_factor_it_prints(asperity):
    result = asperity(
        "render", "--preset", "gilded", "--compare", "gilded", "--set", "tau_0=0.19", *TINY, "-o", "o.exr"
    )
    factor = float(result.output.split("shown times ")[1].split(",")[0])
    left, right, difference = np.split(pixels("o.exr"), 3, axis=1)
    assert factor > 1
    assert np.allclose(difference, factor * np.abs(left - right), rtol=1e-3, atol=1e-5 * factor)


def test_material_file_and_colour(asperity, tmp_path):
    (tmp_path / "red.json").write_text('{"type": "diffuse", "reflectance": 0.5}')
    result = asperity("render", "--material", "red.json", "--set", "reflectance=[0.9, 0, 0]", *TINY, "-o", "out.exr")
    assert result.exit_code == 0, result.output
    red, green, _ = pixels("out.exr")[12:20, 14:18].mean(axis=(0, 1))
    assert red > 2 * green


def test_json_scene_finds_files_beside_it_and_keeps_its_size(asperity, tmp_path):
    (tmp_path / "scenes").mkdir()
    mi.set_variant("scalar_rgb")
    mi.Bitmap(np.full((2, 2, 1), 0.5, np.float32)).write("scenes/tau.exr")
    (tmp_path / "scenes" / "scene.json").write_text(json.dumps(SCENE))
    result = asperity("render", "scenes/scene.json", "-o", "out.exr")
    assert result.exit_code == 0, result.output
    assert "6 samples per pixel" in result.output
    assert pixels("out.exr").shape == (16, 24, 3)


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_spectral"])
def test_xml_scene_with_aovs_resized(asperity, tmp_path, variant):
    (tmp_path / "scene.xml").write_text(XML)
    result = asperity("render", "scene.xml", "--size", "20x10", "--spp", "1", "--variant", variant, "-o", "out")
    assert result.exit_code == 0, result.output
    assert pixels("out.png").shape == (10, 20, 3)
    channels = [field.name for field in mi.Bitmap("out.exr").struct_()]
    assert pixels("out.exr").shape == (10, 20, 7)
    assert set(channels) == {"R", "G", "B", "distance.T", "base.R", "base.G", "base.B"}


def test_a_render_that_is_not_finite_says_so(asperity, tmp_path, monkeypatch):
    render = mi.render

    def broken(*arguments, **options):
        image = np.array(render(*arguments, **options))
        image[3, 5] = np.nan
        image[2, 7, 1] = np.inf
        return image

    monkeypatch.setattr(mi, "render", broken)
    result = asperity("render", *TINY, "--compare", "gilded", "-o", "out")
    assert result.exit_code == 1
    line = "warning: 2 of 1024 pixels are not finite (NaN or infinite); the first is in row 2, column 7"
    assert result.stderr.count(line) == 2 and "mean difference: 0." in result.stdout
    assert files(tmp_path) == ["out.exr", "out.png"]


def test_what_people_use_of_the_mitsuba_command(asperity, tmp_path):
    (tmp_path / "scene.json").write_text(
        json.dumps(
            {
                "type": "scene",
                "integrator": {"type": "path"},
                "a": {"type": "perspective", "film": {"type": "hdrfilm", "width": 2, "height": 2}},
                "b": {"type": "perspective", "film": {"type": "hdrfilm", "width": "$wide", "height": 2,
                                                      "pixel_format": "luminance"}},
                "light": {"type": "constant"},
            }
        )
    )  # fmt: skip
    result = asperity("render", "scene.json", "-m", "scalar_rgb", "-D", "wide=5", "-s", "1", "-o", "out.exr")
    assert result.exit_code == 0, result.output
    assert mi.variant() == "scalar_rgb" and pixels("out.exr").shape == (2, 5)


def test_passes_are_squares_and_fit_into_memory():
    assert [pass_size(n, 1000) for n in (100, 16, 15, 4, 3, 1)] == [16, 16, 4, 4, 1, 1]
    assert pass_size(100, 640 * 640) == 4
    assert pass_size(100, 8000 * 8000) == 1


def test_ctrl_c_keeps_the_picture(asperity, tmp_path, monkeypatch):
    render = mi.render

    def interrupted(*arguments, **options):
        signal.raise_signal(signal.SIGINT)
        return render(*arguments, **options)

    monkeypatch.setattr(mi, "render", interrupted)
    result = asperity("render", "--size", "32", "--spp", "640", "-o", "out")
    assert result.exit_code == 0
    assert "stopped early: out.png and out.exr: 16 samples per pixel" in result.output
    assert files(tmp_path) == ["out.exr", "out.png"]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


@pytest.mark.parametrize("material", ["diffuse", '{"type": "diffuse", "reflectance": 0.9}'])
def test_a_material_by_its_name_or_text(asperity, tmp_path, material):
    result = asperity("render", material, "--set", "reflectance=0.2", *TINY, "-o", "out.png")
    assert result.exit_code == 0 and (tmp_path / "out.png").is_file(), result.output


def test_a_turntable_is_a_folder_of_frames(asperity, tmp_path):
    result = asperity("render", "--preset", "gilded", "--object", "knot", "--turntable", "3", *TINY)
    assert result.exit_code == 0, result.output
    assert files(tmp_path / "turntable") == ["1.png", "2.png", "3.png"]
    one, two = (pixels(f"turntable/{n}.png").astype(float) for n in (1, 2))
    assert np.abs(one - two).mean() > 2
    assert "not empty" in asperity("render", "--turntable", "2", "-o", "turntable", *TINY).output


@pytest.fixture
def three_presets(monkeypatch):
    monkeypatch.setattr(presets, "names", lambda: ["chalk", "gilded", "soot"])


def test_all_on_a_contact_sheet_goes_on_where_it_stopped(asperity, tmp_path, monkeypatch, three_presets):
    render, count = mi.render, []

    def interrupted(*arguments, **options):
        count.append(1)
        if len(count) == 2:
            signal.raise_signal(signal.SIGINT)
        return render(*arguments, **options)

    monkeypatch.setattr(mi, "render", interrupted)
    command = ("render", "--all", "--contact-sheet", "--size", "16", "--spp", "4")
    result = asperity(*command)
    assert result.exit_code == 1 and "stopped early: 2 of 3 pictures" in result.output, result.output
    assert files(tmp_path / "presets") == ["chalk.png", "gilded.png"]
    before = (tmp_path / "presets" / "chalk.png").stat().st_mtime_ns
    assert "presets/contact-sheet.png: 3 pictures" in asperity(*command).output
    assert files(tmp_path / "presets") == ["chalk.png", "contact-sheet.png", "gilded.png", "soot.png"]
    assert (tmp_path / "presets" / "chalk.png").stat().st_mtime_ns == before
    asperity(*command, "--force")
    assert (tmp_path / "presets" / "chalk.png").stat().st_mtime_ns > before


@pytest.mark.skipif(find_spec("pyoidn") is None, reason="an extra: pyoidn")
def test_denoising_changes_the_png_and_only_adds_to_the_exr(asperity):
    for name, more in {"default": (), "on": ("--denoise",), "off": ("--no-denoise",)}.items():
        assert asperity("render", "--preset", "gilded", *TINY, *more, "-o", name).exit_code == 0
    raw, default, layered = (pixels(f"{name}.exr") for name in ("off", "default", "on"))
    assert np.allclose(raw, default, rtol=1e-5) and np.allclose(raw, layered[..., :3], rtol=1e-5)
    assert {field.name for field in mi.Bitmap("on.exr").struct_()} >= {"R", "denoised.R", "denoised.B"}
    assert (pixels("default.png") == pixels("on.png")).mean() > 0.99  # the film sums in any order
    assert (pixels("default.png") != pixels("off.png")).mean() > 0.3


def test_a_missing_denoiser_is_an_error_only_if_asked_for(asperity, tmp_path, monkeypatch):
    monkeypatch.setattr(denoise, "find_spec", lambda name: None)
    assert asperity("render", *TINY, "-o", "a.png").exit_code == 0
    result = asperity("render", *TINY, "--denoise", "-o", "b.png")
    assert result.exit_code == 2 and "there is no pyoidn; python -m pip install" in result.output
    assert files(tmp_path) == ["a.png"]


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--light", "frnt"), "unknown light 'frnt'. Did you mean 'front'?"),
        (("--floor", "tile"), "unknown floor 'tile'. Did you mean 'tiles'?"),
        (("--turntable", "0"), "greater than or equal to 1"),
        (("--turntable", "2", "--compare", "gilded"), "--compare: not with --turntable"),
        (("--all", "--preset", "gilded", "--set", "a=1"), "--preset, --set: not with --all"),
        (("--contact-sheet",), "--contact-sheet: it is for --all"),
        (("--all", "-o", "file"), "-o file: it is a file, not a folder"),
        (("--turntable", "2", "-o", "no/where"), "cannot write into the folder 'no'"),
        (("scene.json", "--light", "key"), "--light: a scene file has its own"),
    ],
)
def test_what_makes_no_sense_is_refused(asperity, tmp_path, arguments, words):
    (tmp_path / "file").touch()
    result = asperity("render", *arguments, *TINY)
    assert result.exit_code != 0 and words in " ".join(result.output.split()), result.output
    assert files(tmp_path) == ["file"]
