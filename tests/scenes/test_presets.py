import asperity  # noqa: F401, I001  (before mitsuba: it finds a working LLVM)
import json
import subprocess
import sys

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from asperity.errors import UnknownNameError, UnreadableFileError
from asperity.lab import evaluate
from asperity.scenes import presets
from asperity.scenes.preview import ENVIRONMENTS, FLOORS, LIGHTS, preview
from asperity.scenes.objects import OBJECTS

DIFFUSE = {"type": "diffuse"}


@pytest.fixture(autouse=True)
def variant(request):
    before = mi.variant()
    mi.set_variant(getattr(request, "param", "llvm_ad_rgb"))
    yield
    if before:
        mi.set_variant(before)


def written(folder, content):
    path = folder / "material.json"
    path.write_bytes(content if isinstance(content, bytes) else json.dumps(content).encode())
    return path


def picture_of(name):
    preset = presets.load(name)
    return np.array(mi.render(mi.load_dict(preview(preset.material, **preset.preview, size=(24, 24), spp=2))))


@pytest.mark.parametrize("name", presets.names())
def test_renders(name):
    picture = picture_of(name)
    assert np.isfinite(picture).all()
    # A black object sends nothing; the darkest preset, oxidized steel, reflects 2 % and comes to .014.
    assert picture[8:16, 8:16].mean() > 0.005, "the object in the middle is black"


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_spectral"], indirect=True)
def test_the_default_renders_in_other_variants(variant):
    assert np.isfinite(picture := picture_of(presets.DEFAULT)).all()
    assert picture.mean() > 0.1


@pytest.mark.parametrize("name", presets.names())
def test_never_returns_more_than_it_gets(name):
    bsdf, per_angle = mi.load_dict(presets.load(name).material), 1 << 12
    cosines = np.repeat([1, 0.7, 0.3, 0.05], per_angle)
    azimuth = np.random.default_rng(1).uniform(0, 2 * np.pi, len(cosines))
    sines = np.sqrt(1 - cosines**2)
    si = evaluate.interaction(mi.Vector3f(sines * np.cos(azimuth), sines * np.sin(azimuth), cosines), len(cosines))
    choice, si.uv = evaluate.variates(len(cosines), 2)
    _, weight = bsdf.sample(mi.BSDFContext(), si, choice, evaluate.variates(len(cosines), 3)[1])
    weight = np.array(weight).reshape(3, 4, per_angle)
    assert np.isfinite(weight).all()
    assert weight.min() >= 0
    error = weight.std(axis=2) / np.sqrt(per_angle)
    # 4 standard errors: one in 30000, for 12 means of each preset; and rounding.
    assert (weight.mean(axis=2) <= 1 + 4 * error + 1e-4).all()
    assert weight[:, 0].mean() > 0.02


@pytest.mark.parametrize("name", presets.names())
def test_says_what_it_is_and_shows_itself(name):
    preset = presets.load(name)
    assert preset.name == name
    assert preset.title
    assert preset.source
    assert 40 < len(preset.about) < 200
    assert {"object", "env"} <= preset.preview.keys()
    names = {"object": OBJECTS, "env": ENVIRONMENTS, "light": LIGHTS, "floor": FLOORS}
    assert [key for key, value in preset.preview.items() if value not in names[key]] == []


def test_the_default_is_a_preset():
    assert presets.DEFAULT in presets.names()


def test_an_unknown_preset_gets_a_suggestion():
    with pytest.raises(UnknownNameError, match=r"preset 'dusty-wod'.*Did you mean 'dusty-wood'.*verdigris"):
        presets.load("dusty-wod")


def test_presets_are_read_without_mitsuba():
    code = "import sys; from asperity.scenes import presets; [presets.load(n) for n in presets.names()]"
    subprocess.run([sys.executable, "-c", f"{code}; assert 'mitsuba' not in sys.modules"], check=True)


@pytest.mark.parametrize("form", [lambda bsdf: bsdf, lambda bsdf: {"material": bsdf, "preview": {"env": "sky"}}])
def test_a_file_is_a_description_or_a_preset(tmp_path, form):
    preset = presets.read(written(tmp_path, form(DIFFUSE)))
    assert preset.name == preset.title == "material"
    assert preset.material == DIFFUSE
    assert mi.load_dict(preview(preset.material, **preset.preview, size=(8, 8), spp=1))


def test_a_byte_order_mark_does_no_harm(tmp_path):
    assert presets.read(written(tmp_path, b"\xef\xbb\xbf" + json.dumps(DIFFUSE).encode())).material == DIFFUSE


def test_files_of_the_preview_are_found_beside_it_too(tmp_path):
    view = presets.read(written(tmp_path, {"material": DIFFUSE, "preview": {"object": "a.ply", "env": "sky"}})).preview
    assert view == {"object": str(tmp_path / "a.ply"), "env": "sky"}


def test_files_are_found_beside_the_description_and_matrices_scale_them(tmp_path):
    mi.Bitmap(np.eye(2, dtype=np.float32)[:, :, None]).write(str(tmp_path / "map.exr"))
    texture = {"type": "bitmap", "filename": "map.exr", "to_uv": [[1, 0, 0], [0, 2, 0], [0, 0, 1]]}
    material = presets.read(written(tmp_path, {"type": "diffuse", "reflectance": texture})).material
    assert material["reflectance"]["filename"] == str(tmp_path / "map.exr")
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.uv = mi.Point2f(0.25, [0.125, 0.375])
    values = np.array(mi.load_dict(material["reflectance"]).eval_1(si)).tolist()
    assert sorted(values) == [0, 1], "the tile does not repeat twice along v"


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"", "line 1, column 1: Expecting value"),
        (b'{"type": "diffuse",\n  "reflectance": }', "line 2, column 18: Expecting value"),
        (b"\xff", "utf-8"),
        (b'{"type": "diffuse", "type": "plastic"}', "'type' is given twice"),
        ([DIFFUSE], "not an object in braces"),
        ({"material": "diffuse"}, 'material is "diffuse", not an object in braces'),
        ({"title": "Nothing"}, "material is null"),
        ({"material": {"reflectance": 0.5}}, "it has no BSDF"),
        ({"type": 3}, "it has no BSDF"),
        ({"material": DIFFUSE, "previw": {}}, "unknown key 'previw'. Did you mean 'preview'"),
        (
            {"material": DIFFUSE, "preview": {"enviroment": "sky"}},
            r"unknown key 'enviroment'.*Allowed: object, env, [a-z, ]*\. Formats",
        ),
        ({"material": DIFFUSE, "preview": {"object": 3}}, "preview.object is 3, not a name or the path of a file"),
        ({"material": DIFFUSE, "preview": {"env": None}}, "preview.env is null, not a name"),
        (b"[" * 100_000, "nested too deep"),
        (b'{"type": "diffuse", "reflectance": NaN}', "material.reflectance is NaN: numbers have to be finite"),
        (b'{"type": "diffuse", "reflectance": [1e999, 0, 0]}', "material.reflectance is .Infinity, 0, 0.: numbers"),
        (
            {"type": "diffuse", "reflectance": {"value": [[1, None]]}},
            r"material.reflectance.value is \[\[1, null\]\]: ",
        ),
        ({"type": "diffuse", "reflectance": None}, "material.reflectance is null"),
        ({"type": "mask", "bsdf": {"type": "diffuse", "reflectance": None}}, "material.bsdf.reflectance is null"),
        ({"type": "diffuse", "reflectance": {"type": "bitmap", "filename": "no.png"}}, "there is no file.*no.png"),
        ({"type": "diffuse", "reflectance": {"to_uv": [[1, 0], [0, 1]]}}, "reflectance.to_uv is .*not a matrix"),
        ({"type": "diffuse", "reflectance": {"to_uv": [[1, 0, "a"]] * 3}}, "reflectance.to_uv is .*not a matrix"),
        ({"type": "diffuse", "reflectance": {"to_uv": [["1", 0, 0]] * 3}}, "reflectance.to_uv is .*not a matrix"),
        ({"type": "diffuse", "reflectance": {"to_uv": ["100", "010", "001"]}}, "reflectance.to_uv is .*not a matrix"),
        ({"type": "diffuse", "reflectance": {"to_uv": [[True, 0, 0]] * 3}}, "reflectance.to_uv is .*not a matrix"),
    ],
)
def test_bad_files_are_named(tmp_path, content, words):
    with pytest.raises(UnreadableFileError, match=words) as error:
        presets.read(path := written(tmp_path, content))
    assert str(path) in str(error.value)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
def test_what_windows_writes_is_read(tmp_path, encoding):
    text = '{"title": "Grün", "material": {"type": "diffuse"}}'
    assert presets.read(written(tmp_path, text.encode(encoding))).title == "Grün"


@pytest.mark.parametrize(("name", "words"), [("none.json", "no such file"), ("material.yaml", "ending is '.yaml'")])
def test_missing_and_foreign_files_are_named(tmp_path, name, words):
    with pytest.raises(UnreadableFileError, match=words):
        presets.read(tmp_path / name)
