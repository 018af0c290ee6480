import json
import re

import mitsuba as mi
import pytest

from asperity.cli import scene_files
from asperity.errors import AsperityError

SCENE = {
    "type": "scene",
    "integrator": {"type": "path"},
    "first": {"type": "perspective", "film": {"type": "hdrfilm", "width": 4, "height": 4}},
    "second": {"type": "perspective", "film": {"type": "hdrfilm", "width": "$wide", "height": 4}},
    "light": {"type": "constant"},
    "ball": {"type": "sphere", "bsdf": {"type": "roughconductor", "material": "$metal", "alpha": "$alpha"}},
}
XML = """<scene version="3.0.0"><integrator type="path"/><default name="alpha" value="0.5"/>
<sensor type="perspective"/>
<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="$wide"/></film></sensor>
<shape type="sphere"><bsdf type="roughconductor"><string name="material" value="$metal"/>
<float name="alpha" value="$alpha"/></bsdf></shape></scene>"""
DEFINES = {"wide": "7", "metal": "Au", "alpha": ".25"}


@pytest.fixture
def files(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "scene.json").write_text(json.dumps(SCENE))
    (tmp_path / "scene.xml").write_text(XML)
    return tmp_path


@pytest.mark.parametrize("name", ["scene.json", "scene.xml"])
def test_definitions_are_put_in(rgb, files, name):
    scene = scene_files.load(files / name, defines=DEFINES)
    assert scene.sensors()[1].film().size()[0] == 7
    bsdf = mi.traverse(scene.shapes()[0].bsdf())
    assert bsdf["alpha.value"][0] == 0.25
    assert bsdf["eta.value"][0][0] == pytest.approx(0.143, abs=0.01)  # gold, in red


def test_definitions_within_a_word(files):
    (files / "scene.json").write_text('{"type": "$kind", "id": "maps/$name-$part.png", "costs": "$"}')
    found = scene_files.description(files / "scene.json", {"kind": "diffuse", "name": "wood", "part": "1"})
    assert found == {"type": "diffuse", "id": "maps/wood-1.png", "costs": "$"}


BAD = [
    ("scene.json", {"wide": "7", "metal": "Au"}, "ball.bsdf.alpha: $alpha is not defined; give it by -D alpha=VALUE"),
    ("scene.json", DEFINES | {"height": "4"}, "--define height: there is no $height"),
    ("scene.xml", {"wide": "7"}, "undefined parameter: $metal"),
    ("scene.xml", DEFINES | {"height": "4"}, "$height=4"),
]


@pytest.mark.parametrize("name, defines, words", BAD)
def test_wrong_definitions_are_named(rgb, files, name, defines, words):
    with pytest.raises((AsperityError, RuntimeError), match=re.escape(words)):
        scene_files.load(files / name, defines=defines)


@pytest.mark.parametrize("text", ["wide", "wide-angle=3", "=3", "path=x"])
def test_definitions_that_none_can_mean(text):
    with pytest.raises(AsperityError, match="--define"):
        scene_files.parse_defines([text])


def test_a_sensor_can_be_chosen_and_resized(rgb, files):
    scene = scene_files.load(files / "scene.json", size=(3, 2), sensor=1, defines=DEFINES)
    assert [tuple(sensor.film().size()) for sensor in scene.sensors()] == [(4, 4), (3, 2)]
    with pytest.raises(AsperityError, match=r"--sensor 2: .*scene.json has 2, counted from 0"):
        scene_files.load(files / "scene.json", sensor=2, defines=DEFINES)


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-32"])
def test_other_encodings_of_unicode(files, encoding):
    """Windows' editors and shells write them."""
    (files / "scene.json").write_text('{"type": "ä"}', encoding=encoding)
    assert scene_files.description(files / "scene.json", {}) == {"type": "ä"}


ROWS = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]


@pytest.mark.parametrize("wrong", ["1", None, [1], {}])
def test_a_matrix_is_of_numbers(rgb, files, wrong):
    rows = [[wrong, 0, 0, 0], *ROWS[1:]]
    (files / "scene.json").write_text(json.dumps({"type": "sphere", "to_world": rows}))
    with pytest.raises(AsperityError, match=r"'.*scene.json': to_world is \[\[.*, not a matrix of numbers"):
        scene_files.description(files / "scene.json", {})
