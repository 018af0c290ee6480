"""Nothing of the user's is overwritten unasked: the same rules for all commands."""

import json
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

RENDER = ("render", "--size", "8", "--spp", "1")
MEASURE = ("measure", "micrograin", "--theta", "30", "--paths", "100", "--tiles", "2", "--cells", "2x4")
SCENE = {
    "type": "scene",
    "integrator": {"type": "path"},
    "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}},
    "light": {"type": "constant"},
    "ball": {"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": {"type": "bitmap", "filename": "map.exr"}}},
}
COMMANDS = {
    RENDER: ["asperity.exr", "asperity.png"],
    MEASURE: ["micrograin.npz"],
    ("plot", "in/a.npz"): ["in/a.png"],
    ("merge", "in/a.npz", "in/b.npz"): ["merged.npz"],
}
BROKEN = ("check", "diffuse", "--only", "energy", "--set", 'reflectance={"type": "uniform", "value": 2}')


@pytest.fixture
def inputs(asperity, tmp_path):
    """Two measurements and a picture in a folder."""
    Path("in").mkdir()
    for seed, name in enumerate("ab"):
        assert asperity(*MEASURE, "--seed", str(seed), "-o", f"in/{name}").exit_code == 0
    mi.set_variant("scalar_rgb")
    mi.Bitmap(np.full((4, 8, 3), 0.5, np.float32)).write("in/map.exr")
    return contents()


def contents():
    return {str(path): path.read_bytes() for path in Path().rglob("*") if path.is_file()}


def numbered(name, n):
    return str(Path(name).with_stem(f"{Path(name).stem}-{n}"))


@pytest.mark.parametrize("command, names", COMMANDS.items(), ids=[command[0] for command in COMMANDS])
def test_default_names_get_numbers_and_own_names_are_refused(asperity, inputs, command, names):
    for expected in (names, [numbered(name, 2) for name in names], [numbered(name, 3) for name in names]):
        before = contents()
        result = asperity(*command)
        assert result.exit_code == 0, result.output
        assert before.items() <= contents().items()  # nothing changed
        assert sorted(contents().keys() - before.keys()) == expected
        assert all(name in result.output for name in expected)
    before = contents()
    result = asperity(*command, "-o", names[0])
    assert result.exit_code == 2 and f"-o {names[0]}: it exists" in result.stderr and contents() == before
    Path(names[0]).write_text("old")
    assert asperity(*command, "-o", names[0], "--force").exit_code == 0
    assert Path(names[0]).read_bytes() != b"old" and contents().keys() == before.keys()


@pytest.mark.parametrize("command, names", COMMANDS.items(), ids=[command[0] for command in COMMANDS])
def test_folders_and_links(asperity, inputs, command, names):
    Path("out").mkdir()
    for _ in range(2):
        assert asperity(*command, "-o", "out").exit_code == 0
    assert len(list(Path("out").iterdir())) == 2 * len(names)
    link = Path(f"link{Path(names[0]).suffix}")
    link.symlink_to(Path("out", link.name))
    assert asperity(*command, "-o", str(link)).exit_code == 0  # it led nowhere
    assert link.is_symlink() and Path("out", link.name).is_file()
    assert "it exists" in asperity(*command, "-o", str(link)).stderr
    assert asperity(*command, "-o", str(link), "--force").exit_code == 0 and link.is_symlink()


@pytest.mark.parametrize(
    "command",
    [
        (*RENDER, "--env", "in/map.exr", "-o", "in/map.exr"),
        (*RENDER, "--env", "in/map.exr", "-o", "link.exr"),
        (*RENDER, "--env", "in/map.exr", "-o", "in/map"),
        ("render", "in/scene.json", "-o", "in/map.exr"),
        ("render", "in/scene.xml", "-o", "in/map.exr"),
        ("render", "in/outer.xml", "-o", "in/map.exr"),
        (*RENDER, "--material", "in/material.json", "-o", "in/map.exr"),
        (*RENDER, "--set", 'reflectance={"type": "bitmap", "filename": "in/map.exr"}', "-o", "in/map.exr"),
        ("merge", "in/a.npz", "in/b.npz", "-o", "in/b.npz"),
        (*MEASURE, "--continue", "in/a.npz", "--tensor", "in/a.bsdf", "--bsdf", '{"filename": "in/a.bsdf"}'),
    ],
)
def test_inputs_are_never_overwritten(asperity, inputs, command):
    Path("link.exr").symlink_to("in/map.exr")
    Path("in/scene.json").write_text(json.dumps(SCENE))
    Path("in/material.json").write_text(json.dumps(SCENE["ball"]["bsdf"]))
    Path("in/scene.xml").write_text("<scene version='3.0.0'><string name='filename' value='map.exr'/></scene>")
    Path("in/outer.xml").write_text("<scene version='3.0.0'><include filename='../in/scene.xml'/></scene>")
    Path("in/a.bsdf").write_text("mine")
    before = contents()
    result = asperity(*command, "--force")
    assert result.exit_code == 2 and "it is an input of this command" in result.stderr
    assert contents() == before


def test_a_file_of_the_same_name_elsewhere_is_no_input(asperity, inputs):
    Path("in/scene.json").write_text(json.dumps(SCENE))
    Path("map.exr").write_text("old")
    assert asperity("render", "in/scene.json", "-o", "map.exr", "--force").exit_code == 0
    assert len(Path("map.exr").read_bytes()) > 100


def test_an_input_may_have_the_default_name(asperity, inputs):
    Path("in/map.exr").rename("asperity.exr")
    before = contents()
    result = asperity(*RENDER, "--env", "asperity.exr", "--force")
    assert result.exit_code == 0 and "asperity-2.png and asperity-2.exr" in result.output
    assert before.items() <= contents().items()


def test_pictures_of_checks_get_numbers(asperity):
    for n, name in enumerate(("diffuse-energy.png", "diffuse-energy-2.png")):
        result = asperity(*BROKEN)
        assert result.exit_code == 1 and f"asperity-check/{name}" in result.output
        assert len(contents()) == n + 1
