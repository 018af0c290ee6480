"""Bad input: an exit code, a line that names the culprit, no traceback, no file."""

import pytest

RENDER = ("render", "--size", "16", "--spp", "1")
FILES = {
    "null.json": '{"type": "micrograin", "tau_0": null}',
    "comma.json": '{"type": "scene",\n "light": {"type": "constant",}}',
    "nullscene.json": '{"type": "scene", "ball": {"type": "sphere", "radius": null}}',
    "misspelt.json": '{"type": "scene", "ball": {"type": "sphere", "bsdf": {"type": "micrograin", "tau0": 1}}}',
    "list.json": "[1, 2]",
    "tag.xml": '<scene version="3.0.0">\n<shape type="sphere">\n</scene>',
    "misspelt.xml": '<scene version="3.0.0">\n<bsdf type="micrograin"><float name="tau0" value="1"/></bsdf></scene>',
    "plugin.xml": '<scene version="3.0.0"><shape type="sphre"/></scene>',
    "blind.xml": '<scene version="3.0.0"><shape type="sphere"/></scene>',
    "blind.json": '{"type": "scene", "sensor": {"type": "perspective"}}',
    "spectral.json": '{"type": "scene", "integrator": {"type": "aov", "aovs": "d:depth"}, "sensor": {"type": '
    '"perspective", "film": {"type": "specfilm", "red": {"type": "regular", "wavelength_min": 500, '
    '"wavelength_max": 600, "values": "1, 1"}}}}',
    "binary.png": "",
}
BAD = [
    ((*RENDER, "--set", "tau0=0.4"), "micrograin has no parameter 'tau0'. Did you mean 'tau_0'?"),
    ((*RENDER, "--set", "tau_0=4"), "tau_0 = 4: expected a number or texture in [0, 1]"),
    ((*RENDER, "--set", "tau_0=NaN"), "tau_0 = nan"),
    ((*RENDER, "--set", "tau_0=much"), "tau_0 = 'much'"),
    ((*RENDER, "--set", "tau_0=[1, 2]"), "tau_0"),
    ((*RENDER, "--set", "tau_0=null"), "tau_0 is null"),
    ((*RENDER, "--set", 'tau_0={"type": 5}'), "tau_0.type = 5"),
    ((*RENDER, "--set", "tau_0"), "expected NAME=VALUE"),
    ((*RENDER, "--set", "bse.alpha=1"), "Did you mean 'base'?"),
    ((*RENDER, "--set", "type=micrgrain"), "no plugin 'micrgrain'. Did you mean 'micrograin'?"),
    ((*RENDER, "--set", "type=sphere"), "sphere"),
    ((*RENDER, "--preset", "gilded", "--set", "material=Gold"), "material = 'Gold'"),
    ((*RENDER, "--preset", "gilded", "--set", "eta=1.2"), "material and eta exclude each other"),
    ((*RENDER, "--preset", "satin-clay", "--set", "beta=1", "--set", "beta_x=1"), "beta and beta_x exclude each other"),
    ((*RENDER, "--preset", "glided"), "Did you mean 'gilded'?"),
    ((*RENDER, "--compare", "glided"), "Did you mean 'gilded'?"),
    ((*RENDER, "--object", "pwan"), "Did you mean 'pawn'?"),
    ((*RENDER, "--object", "none.ply"), "'none.ply': there is no such file"),
    ((*RENDER, "--env", "studoi"), "Did you mean 'studio'?"),
    ((*RENDER, "--env", "none.exr"), "'none.exr': there is no such file"),
    ((*RENDER, "--variant", "llvm_rgb"), "Did you mean 'llvm_ad_rgb'?"),
    ((*RENDER, "--material", "none.json"), "'none.json': there is no such file"),
    ((*RENDER, "--material", "null.json"), "tau_0 is null"),
    ((*RENDER, "--material", "null.json", "--preset", "gilded"), "exclude each other"),
    (("render", "--size", "0"), "'0': expected 512 or 640x360"),
    (("render", "--size", "12x"), "'12x': expected 512 or 640x360"),
    (("render", "--size", "32768"), "'32768': expected 512 or 640x360"),
    (("render", "--spp", "0"), "--spp"),
    (("render", "--seed", "-1"), "--seed"),
    (("render", "-o", "none/out.png"), "cannot write into the folder 'none'"),
    (("render", "-o", "null.json/out.png"), "cannot write into the folder 'null.json'"),
    (("render", "-o", "out.jpg"), "'.jpg'. Allowed: .png, .exr"),
    (("render", "glided"), "unknown material 'glided'. Did you mean 'gilded'?"),
    (("render", "gilded", "--preset", "gilded"), "give one of them"),
    (("render", "none.xml"), "'none.xml': there is no such file"),
    (("render", "binary.png"), "its ending is '.png'"),
    (("render", "comma.json"), "'comma.json': line 2, column"),
    (("render", "nullscene.json"), "'nullscene.json': ball.radius is null"),
    (("render", "misspelt.json"), "ball.bsdf: micrograin has no parameter 'tau0'"),
    (("render", "list.json"), "no object in braces"),
    (("render", "tag.xml"), "line 3"),
    (("render", "misspelt.xml"), "misspelt.xml (line 2, col 2): micrograin has no parameter 'tau0'"),
    (("render", "plugin.xml"), "no plugin 'sphre'. Did you mean 'sphere'?"),
    (("render", "blind.xml"), "no scene with a sensor"),
    (("render", "blind.xml", "--preset", "gilded"), "--preset: a scene file has its own materials"),
    (("render", "blind.json"), "it has no integrator"),
    (("render", "-m", "llvm_ad_spectral", "spectral.json"), "the film is spectral, and has no colours for a PNG"),
    (
        ("render", "-m", "llvm_ad_spectral", "spectral.json", "-o", "x.exr"),
        "the film is spectral, and cannot hold AOVs",
    ),
    (("render", "blind.json", "-D", "x"), "--define x: expected NAME=VALUE"),
    (("render", "-D", "x=1"), "they are for scene files"),
    (("render", "-s", "1"), "they are for scene files"),
    (("show", "micrograin", "--json"), "micrograin is no preset"),
    (("measure", "--preset", "worn-gold"), "error: alpha = {'type': 'bitmap'"),
    (
        ("measure", "vgroove", "--set", "distribution=phong", "--set", 'exponent={"type": "checkerboard"}'),
        "exponent = ",
    ),
    (("measure", "micrograin", "--set", 'beta={"type": "checkerboard"}'), "error: beta = {"),
    (("check",), "give one of"),
    (("check", "difuse"), "Did you mean 'diffuse'?"),
    (("check", "sphere"), "'sphere' is not a material"),
    (("check", "diffuse", "--set", "reflectanc=1"), "reflectanc"),
]


@pytest.mark.parametrize("arguments, culprit", BAD, ids=[" ".join(arguments) for arguments, _ in BAD])
def test_bad_input(asperity, tmp_path, arguments, culprit):
    for name, content in FILES.items():
        (tmp_path / name).write_text(content)
    result = asperity(*arguments)
    assert result.exit_code == 2
    assert isinstance(result.exception, SystemExit)  # anything else would have been a traceback
    assert culprit in result.output and "Traceback" not in result.output
    assert "Usage:" in result.output or len(result.stderr.strip().splitlines()) == 1
    assert {path.name for path in tmp_path.iterdir()} == set(FILES)


def test_the_cause_of_an_error_of_dr_jit_is_said(asperity, monkeypatch):
    def fail(*_):
        raise RuntimeError("while rendering (see above).") from RuntimeError("the cause")

    monkeypatch.setattr("asperity.cli.render.previews", fail)
    assert asperity("render").stderr == "error: the cause\n"


def test_a_machine_that_is_too_small(asperity, monkeypatch):
    def fail(*_):
        raise MemoryError

    monkeypatch.setattr("asperity.cli.render.previews", fail)
    assert asperity("render").stderr == "error: out of memory\n"


def test_debug_shows_the_traceback(asperity):
    result = asperity("render", "--preset", "glided", "--debug")
    assert "UnknownNameError" in repr(result.exception)


def test_a_picture_that_cannot_be_finished_leaves_nothing(tmp_path):
    from asperity.cli.output import atomically

    (tmp_path / "out.png").write_text("old")
    with pytest.raises(KeyboardInterrupt), atomically(tmp_path / "out.png") as part:
        part.write_text("half")
        raise KeyboardInterrupt
    assert [path.read_text() for path in tmp_path.iterdir()] == ["old"]
