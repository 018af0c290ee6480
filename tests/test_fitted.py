"""`docs/fitted.py`: the tables of fits are those of `docs/fits.json`."""

import asperity  # noqa: F401  isort: skip
import importlib
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[1] / "docs"
RESULTS = {
    "merl/a": {
        "Löw 2012": {"error": 0.02},
        "twoscale": {"error": 0.01, "numbers": 8},
        "diffuse": {"error": 0.005, "numbers": 3},
    },
    "merl/b": {
        "Löw 2012": {"error": 0.02},
        "Ngan 2005": {"error": 0.04},
        "twoscale": {"error": 0.03, "numbers": 8},
        "vgroove": {"failed": "ParameterError: none"},
    },
    "nist/PTFE": {"diffuse": {"error": 0.1, "numbers": 1, "f": 0.02, "relative": 0.05}},
}


@pytest.fixture
def fitted(monkeypatch):
    monkeypatch.syspath_prepend(DOCS)
    return importlib.import_module("fitted")


def test_tables_are_those_of_the_study(fitted):
    page = (DOCS / "fitting-results.md").read_text()
    assert fitted.filled(page) == page, "run `python docs/build.py`"


def test_ours_are_those_with_a_model_of_ours(fitted):
    assert {"twoscale + diffuse", "lambertsphere"} <= set(fitted.ours())
    assert not {"diffuse", "principled", "roughconductor + diffuse"} & set(fitted.ours())


def test_only_ours_count_for_the_goals(fitted):
    ngan, low, _ = fitted.goals(RESULTS).splitlines()
    assert "1 of 1" in ngan and "1 of 2" in low


def test_rows(fitted):
    assert "| a | twoscale | 0.0100 | diffuse | 0.0050 |  | 0.0200 |  |" in fitted.materials(RESULTS)
    assert "| twoscale | 8 | 0.0100 | 0.0200 | 2 | 1 |" in fitted.models(RESULTS)
    assert "vgroove" not in fitted.models(RESULTS)
    assert "| diffuse | 1 | 0.0200 | 5.0 % |" in fitted.ptfe(RESULTS)
