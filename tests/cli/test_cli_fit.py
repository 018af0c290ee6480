"""``asperity fit``."""

import json
from pathlib import Path

import numpy as np
import pytest

from asperity.materials import resolve

PAINT = """{"type": "roughplastic", "distribution": "ggx", "alpha": 0.3, "diffuse_reflectance": 0.3,
            "int_ior": 1.5, "ext_ior": 1.0, "nonlinear": true}"""
FIXED = ("--fix", "int_ior=1.5", "--pairs", "500")


def worked(result):
    assert result.exit_code == 0, result.output
    return result.output


def files():
    return sorted(path.name for path in Path().iterdir())


@pytest.fixture
def paint(asperity):
    worked(asperity("convert", PAINT, "paint.npz", "--resolution", "16"))
    return "paint.npz"


def test_a_fit_is_a_material_and_a_figure(asperity, paint):
    output = worked(asperity("fit", paint, "--model", "roughplastic", *FIXED))
    assert "log-cosine RMS" in output and "alpha" in output
    assert files() == ["paint-roughplastic.json", "paint-roughplastic.png", "paint.npz"]
    found = resolve("paint-roughplastic.json")
    assert found.description["alpha"] == pytest.approx(0.3, rel=0.03)
    assert np.allclose(found.description["diffuse_reflectance"]["value"], 0.3, rtol=0.05)
    worked(asperity("plot", "paint-roughplastic.json", "-o", "lobes.png"))


def test_numbers_as_json_and_no_figure(asperity, paint):
    options = ("--model", "diffuse", "--no-plot", "--json", "-o", "out.json", "--loss", "linear")
    found = json.loads(worked(asperity("fit", paint, *options)))
    assert found["model"] == "diffuse" and found["loss"] == "linear" and len(found["parameters"]) == 3
    assert files() == ["out.json", "paint.npz"]


def test_all_are_ranked(asperity, paint, monkeypatch):
    import asperity as asp
    from asperity import fitting

    few = ("diffuse", "roughplastic")
    monkeypatch.setattr(fitting.rank, "__defaults__", (few,))
    output = worked(asperity("fit", paint, *FIXED[2:], "--no-preview"))
    assert output.index("roughplastic") < output.index("diffuse ") and "paint-all.json" in output
    ranked = asp.fit(paint, models=few, pairs=500)
    assert [one.name for one in ranked] == ["roughplastic", "diffuse"]


def test_any_material_may_be_fitted_by_another(asperity):
    output = worked(asperity("fit", "orennayar", "--model", "diffuse", "--no-plot", "--pairs", "500"))
    assert "orennayar-diffuse.json" in output and resolve("orennayar-diffuse.json").description["type"] == "diffuse"


@pytest.mark.parametrize(
    "options, words",
    [
        (("--model", "roughplastik"), "Did you mean 'roughplastic'"),
        (("--model", "diffuse", "--free", "albedo"), "no 'albedo' to fit"),
        (("--free", "alpha"), "--plus and --free are of one model"),
        (("--model", "diffuse", "--loss", "errors"), "no standard errors"),
        (("--model", "diffuse", "--fix", "reflectance"), "expected NAME=VALUE"),
        (("--model", "diffuse", "-o", "x.txt"), "Allowed: .json"),
        (("--model", "paint.npz"), "has no parameters to fit"),
    ],
)
def test_what_makes_no_sense_is_refused(asperity, paint, options, words):
    result = asperity("fit", paint, *options)
    assert result.exit_code == 2 and words in " ".join(result.output.split()), result.output
    assert files() == ["paint.npz"]
