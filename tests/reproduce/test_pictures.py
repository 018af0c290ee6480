"""Figures that are renders."""

import numpy as np
import pytest

from asperity.reproduce import pictures
from asperity.reproduce.papers import PAPERS
from asperity.scenes import presets
from asperity.validation.report import Effort

pytestmark = pytest.mark.usefixtures("rgb")
LEAST = Effort(1, 2)
WHITE, BLACK = ({"type": "diffuse", "reflectance": reflectance} for reflectance in (1.0, 0.0))


def test_materials_side_by_side(monkeypatch):
    """On spheres or in a view of their own; what they differ by is told, and is not judged."""
    monkeypatch.setattr(pictures, "SIZE", 24)
    make = pictures.materials("A title (Fig. 1)", "", {"r": {"a": WHITE, "b": WHITE, "c": BLACK}}, compared=True)
    section = make(LEAST)
    same, other = section.findings
    assert (same.claim, other.claim) == ("r: b against a", "r: c against a")
    assert same.measured.startswith("mean difference 0.0%") and not other.measured.startswith("mean difference 0.0%")
    assert same.passed is other.passed is None and list(section.figures) == ["a-title-fig-1"]
    assert [axes.get_title() for axes in section.figures["a-title-fig-1"].axes] == ["r: a", "r: b", "r: c"]


def test_presets_after_a_figure(monkeypatch):
    """Of Fig. 1a to 1e, not of Fig. 10 to 16, each as its preset has it."""
    views = []
    monkeypatch.setattr(pictures, "rendered", lambda _, effort, **view: views.append(view) or np.ones((2, 2, 3)))
    (figure,) = pictures.of_presets("t", "", "Lucas 2024, Fig. 1")(LEAST).figures.values()
    names = [axes.get_title() for axes in figure.axes if axes.get_title()]
    assert len(names) == 5 and {"gilded", "dusty-wood"} < set(names)
    assert views == [presets.load(name).preview for name in names]


@pytest.mark.parametrize(("linear", "srgb"), [(0, 0), (0.18, 0.4614), (1, 1), (7, 1), (0.002, 0.02584)])
def test_srgb(linear, srgb):
    assert pictures.encoded(np.array(linear)) == pytest.approx(srgb, rel=1e-3)


@pytest.mark.parametrize("model", PAPERS)
def test_all_that_is_drawn_are_materials(model, monkeypatch):
    """They load; with nothing rendered."""
    from asperity.lab import evaluate

    shown = []
    monkeypatch.setattr(pictures, "rendered", lambda material, *_, **view: shown.append(material) or np.ones((1, 1, 3)))
    for name, make in PAPERS[model].sections.items():
        if name.startswith("fig"):
            make(LEAST)
    for material in shown:
        evaluate.load(material)
    assert len(shown) > 20 or model in ("lambertsphere", "twoscale")
