import json

import mitsuba as mi
import numpy as np
import pytest
from helpers import use

from asperity import materials
from asperity.errors import AsperityError, ParameterError, UnknownNameError, UnreadableFileError
from asperity.goniophotometer import HeightField, Hemisphere, measure
from asperity.lab import evaluate
from asperity.materials import resolve
from asperity.measured import BRDF, convert
from asperity.measured import load as measured_load
from asperity.measured.functions import Function

GREY = {"type": "diffuse", "reflectance": 0.25}
XML = '<bsdf version="3.0.0" type="diffuse"><spectrum name="reflectance" value="0.25"/></bsdf>'
MANY = '<scene version="3.0.0"><bsdf type="diffuse" id="a"/><bsdf type="twosided"><ref id="a"/></bsdf></scene>'
VALUES = {
    "0.4": 0.4, ".4": 0.4, "-.4": -0.4, "+4.": 4.0, "1.e-3": 0.001, "4": 4, "false": False, '"4"': "4",
    "Au": "Au", "4x": "4x", ".": ".", "1_0": "1_0", "[1, 0, .5]": "[1, 0, .5]",
    "[1, 0, 0.5]": {"type": "rgb", "value": [1, 0, 0.5]}, '{"type": "diffuse"}': {"type": "diffuse"},
}  # fmt: skip


@pytest.mark.parametrize("text", VALUES)
def test_what_is_typed_after_set(text):
    found = materials.value(text)
    assert found == VALUES[text] and type(found) is type(VALUES[text])


def normal_value(material):
    """f at normal incidence and exitance."""
    up = evaluate.vectors(np.array([[0, 0, 1]]))
    return np.array(evaluate.eval(material.load(), up, up))[:, 0]


def files(folder):
    """The grey material in every kind of file, and as text."""
    (folder / "grey.json").write_text(json.dumps(GREY))
    (folder / "grey.xml").write_text(XML)
    (folder / "scene.xml").write_text(f'<scene version="3.0.0">{XML.replace(" version=", " name=")}</scene>')
    return [folder / "grey.json", str(folder / "grey.xml"), folder / "scene.xml", json.dumps(GREY), f"\n{XML}"]


def test_all_that_describes_a_material(rgb, tmp_path):
    """They are the same one, to the last bit."""
    loaded = evaluate.load(GREY)
    for what in (GREY, loaded, *files(tmp_path), resolve(GREY)):
        assert normal_value(resolve(what)) == pytest.approx(0.25 / np.pi, rel=1e-6), what


def test_names(rgb):
    gilded, diffuse = resolve("gilded"), resolve("diffuse")
    assert gilded.description["type"] == "micrograin" and "object" in gilded.preview
    assert (diffuse.name, diffuse.description) == ("diffuse", {"type": "diffuse"})
    assert normal_value(diffuse) == pytest.approx(0.5 / np.pi, rel=1e-6)


def test_a_plugin_that_somebody_else_registered(rgb):
    mi.register_bsdf("somebody_elses", lambda props: mi.load_dict(GREY))
    assert normal_value(resolve("somebody_elses")) == pytest.approx(0.25 / np.pi, rel=1e-6)


def test_a_name_comes_before_a_file(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "gilded").mkdir()
    assert resolve("gilded").description["type"] == "micrograin"


def test_what_xml_may_hold(rgb, tmp_path):
    """References, colours, spectra, vectors, transformations, and files beside it."""
    mi.Bitmap(np.full((2, 2, 3), 0.5, dtype=np.float32)).write(str(tmp_path / "grey.exr"))
    (tmp_path / "m.xml").write_text("""<scene version="3.0.0"><bsdf type="blendbsdf"><float name="weight" value="0.5"/>
        <bsdf type="diffuse"><texture type="bitmap" name="reflectance"><string name="filename" value="grey.exr"/>
            <transform name="to_uv"><scale x="2" y="3"/></transform></texture></bsdf>
        <bsdf type="diffuse"><rgb name="reflectance" value="0.1 0.2 0.3"/></bsdf></bsdf></scene>""")
    assert normal_value(resolve(tmp_path / "m.xml")) == pytest.approx(np.array([0.3, 0.35, 0.4]) / np.pi, rel=1e-5)
    spectrum = XML.replace('value="0.25"', 'value="400:0.1 700:0.9"')
    assert resolve(spectrum).description["reflectance"]["value"] == [(400, 0.1), (700, 0.9)]
    assert resolve(MANY.replace('<bsdf type="diffuse" id="a"/>', '<texture type="checkerboard" id="a"/>'))


def test_settings():
    found = resolve("gilded", ["tau_0=0.4", "base.reflectance=[1, 0, 0]"]).description
    assert found["tau_0"] == 0.4 and found["base"]["reflectance"]["value"] == [1, 0, 0]
    inside = {"type": "twosided", "inside": GREY}
    assert resolve(inside, {"inside.reflectance": 1}).description["inside"]["reflectance"] == 1
    assert resolve(GREY, "reflectance=.5").description["reflectance"] == 0.5
    assert inside["inside"] is GREY and GREY["reflectance"] == 0.25


@pytest.fixture(scope="module")
def measured():
    mi.set_variant("llvm_ad_rgb")
    flat = HeightField(np.zeros((2, 2)), 1.0, GREY)
    return measure(flat, [(0, 0), (40, 0), (80, 0)], sensor=Hemisphere(8, 16), paths=2**17, tiles=2)


def test_a_measurement(rgb, measured, tmp_path):
    """A cell gets 1000 paths: a standard error of 3%."""
    measured.save(tmp_path / "flat.npz")
    for what in (measured, tmp_path / "flat.npz"):
        material = resolve(what)
        assert material.measured.total_paths == measured.total_paths
        assert normal_value(material) == pytest.approx(0.25 / np.pi, rel=0.12)
    from asperity.goniophotometer import tensor_file

    tensor_file.write(measured, tmp_path / "flat.bsdf")
    assert normal_value(resolve(tmp_path / "flat.bsdf")) == pytest.approx(normal_value(resolve(measured)), rel=1e-6)


@pytest.mark.parametrize("ending", [".binary", ".csv", ".npz"])
def test_measured_pairs(rgb, tmp_path, ending):
    """A constant 0.25; the table is f cosθ_i cosθ_o, linear in between θ_i that are some degrees apart."""
    f = Function(lambda wi, wo: np.full((len(wi), 3), 0.25), ("R", "G", "B"))
    path = tmp_path / f"flat{ending}"
    convert(f, path, resolution=10)
    for what in (path, str(path), measured_load(path)):
        material = resolve(what)
        assert material.brdf is not None and material.mode == "rgb" and 85 < material.incidence[1] < 90
        assert normal_value(material) == pytest.approx(0.25, rel=1e-3)
    with pytest.raises(ParameterError, match="this is a measurement"):
        resolve(path, {"alpha": 1})


def test_measured_pairs_at_wavelengths_need_a_variant_with_them(rgb):
    wi = np.array([[0, 0, 1.0], [0.6, 0, 0.8]])
    material = resolve(BRDF(wi, wi, np.full((2, 2), 0.25), ("450 nm", "550 nm"), source="a lab"))
    assert material.name == "a lab" and material.mode == "spectral" and material.wavelengths == [450, 550]
    with pytest.raises(ParameterError, match="such as llvm_ad_spectral"):
        material.load()


@pytest.mark.parametrize("description", [{"type": "measured"}, {"type": "measured", "filename": "none.bsdf"}])
def test_a_measurement_without_its_file_is_refused_when_it_is_loaded(rgb, description):
    material = resolve(description)
    assert material.mode == "" and material.wavelengths is None
    with pytest.raises(ParameterError, match="filename"):
        material.load()


BAD = {
    "nonexistent": ("glided", UnknownNameError, "unknown material 'glided'. Did you mean 'gilded'? Tried: presets, "),
    "a model's name": ("micrograim", UnknownNameError, "Did you mean 'micrograin'?"),
    "Mitsuba's name": ("roughplasic", UnknownNameError, "Did you mean 'roughplastic'?"),
    "empty": ("", UnknownNameError, "unknown material ''. Tried"),
    "no file": ("none.json", UnreadableFileError, "there is no such file"),
    "a folder": ("folder", UnreadableFileError, "'folder': it is a folder"),
    "another ending": ("picture.png", UnreadableFileError, "its ending is '.png'"),
    "a long name": ("x/" * 3000, UnreadableFileError, "its ending is ''"),
    "a far folder": ("./x/y", UnreadableFileError, "its ending is ''"),
    "broken JSON": ('{"type": ', ParameterError, "material '{\"type\":': line 1, column 9"),
    "JSON, no BSDF": ("[1]", ParameterError, "it is [1], not an object"),
    "broken XML": ("<bsdf", ParameterError, "material '<bsdf': XML parsing failed"),
    "XML, no BSDF": ('<scene version="3.0.0"/>', ParameterError, "it has 0 BSDFs"),
    "XML, two BSDFs": (MANY, ParameterError, "it has 2 BSDFs"),
    "XML, dangling": (XML.replace("<spectrum", '<ref id="a"/><spectrum'), ParameterError, "nothing has the id 'a'"),
    "an XML file": ("bad.xml", UnreadableFileError, "'bad.xml': it has 0 BSDFs"),
    "no measurement": ("bad.npz", UnreadableFileError, "not written by asperity"),
    "no tensors": ("bad.bsdf", AsperityError, "cut short, or damaged"),
    "a number": (5, ParameterError, "not a int"),
    "a texture": ("checkerboard", ParameterError, "Mitsuba makes a Checkerboard of it"),
    "a scene's part": ({"type": "sphere"}, ParameterError, "'sphere' is not a material: Mitsuba makes a Sphere"),
    "no type": ({"reflectance": 1}, ParameterError, "type is missing"),
}  # fmt: skip


@pytest.mark.parametrize("name", BAD)
def test_bad_input(rgb, tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    for file in ("picture.png", "bad.bsdf"):
        (tmp_path / file).write_bytes(b"")
    (tmp_path / "bad.xml").write_text('<scene version="3.0.0"/>')
    np.savez(tmp_path / "bad.npz", x=1)
    what, kind, message = BAD[name]
    with pytest.raises(kind) as error:
        resolve(what).load()
    assert message in str(error.value) and "\n" not in str(error.value)


def test_a_bsdf_of_another_variant(rgb):
    bsdf = resolve(evaluate.load(GREY))
    other = use("llvm_ad_spectral")
    with pytest.raises(ParameterError, match=f"is a BSDF of variant {rgb}, and {other} is set"):
        bsdf.load()


@pytest.mark.parametrize(
    "what, settings, message",
    [
        ("gilded", ["tau_0"], "--set tau_0: expected NAME=VALUE"),
        ("gilded", ["bse.alpha=1"], "nothing is nested as 'bse'. Did you mean 'base'?"),
        (None, ["a=1"], "settings change a description, and this is a BSDF that is loaded"),
    ],
)
def test_bad_settings(rgb, what, settings, message):
    with pytest.raises(ParameterError, match=message.replace("?", r"\?")):
        resolve(evaluate.load(GREY) if what is None else what, settings)


def test_a_measurement_of_one_incidence_is_no_material(rgb, measured):
    flat = HeightField(np.zeros((2, 2)), 1.0, GREY)
    once = measure(flat, [(0, 0)], sensor=Hemisphere(4, 8), paths=256, tiles=2)
    with pytest.raises(ParameterError, match="expected at least two θ_i"):
        resolve(once).load()
