"""Pictures of measurements: what is drawn is named, and has the channels that were measured."""

import asperity  # noqa: F401  isort: skip
import numpy as np
import pytest
from helpers import use

from asperity.errors import ParameterError
from asperity.goniophotometer import Hemisphere, Points, Window, measure, plots
from asperity.models.micrograin import ExplicitGrains

GREY = {"type": "diffuse", "reflectance": 0.4}
SENSORS = (Hemisphere(4, 8), Window("retro", 10, 4), Points(((30.0, 0.0), (60.0, 90.0))))


def seen(sensor=SENSORS[0], **about):
    """A few paths, measured from Python."""
    grains = ExplicitGrains(0.5, grain=GREY, base=GREY, grains=16)
    return measure(grains, [(0, 0), (30, 0)], sensor=sensor, paths=2**10, tiles=4, about=about)


def labels(figure):
    """What the lines of all diagrams are called."""
    every = [axes.get_legend_handles_labels()[1] for part in figure.subfigs for axes in part.axes]
    return {label for each in every for label in each}


@pytest.mark.parametrize("sensor", SENSORS, ids=lambda sensor: sensor.kind)
def test_any_model_is_drawn_beside_what_was_measured(rgb, sensor):
    """By its own name, whether or not the measurement says that it was of a model."""
    assert "model: diffuse" in labels(plots.figure(seen(sensor), GREY))
    assert "model: diffuse" in labels(plots.figure(seen(sensor, model={"type": "micrograin"}), GREY))
    assert not any("model" in label for label in labels(plots.figure(seen(sensor))))


@pytest.mark.parametrize("variant", ["llvm_ad_spectral", "llvm_ad_mono"])
def test_a_model_needs_the_channels_that_were_measured(rgb, variant):
    measured = seen()
    variant = use(variant)
    with pytest.raises(ParameterError, match=f"variant {variant}.*R, G, B were measured"):
        plots.figure(measured, GREY)


@pytest.mark.parametrize("sensor", SENSORS, ids=lambda sensor: sensor.kind)
@pytest.mark.parametrize("model", [GREY, None], ids=["model", "alone"])
def test_many_directions_are_drawn_small(rgb, sensor, model):
    """In three diagrams, not three for each: 144 took over a minute, and more than Matplotlib's 2^16 pixels."""
    angles = [(theta, phi) for theta in (0, 20, 40, 60) for phi in (0, 90, 180, 270)]
    grains = ExplicitGrains(0.5, grain=GREY, base=GREY, grains=16)
    measured = measure(grains, angles, sensor=sensor, paths=2**10, tiles=4)
    figure = plots.figure(measured, model)
    diagrams = [axes for part in figure.subfigs for axes in part.axes if axes.get_label() != "<colorbar>"]
    assert len(diagrams) == 3 and [len(axes.images) for axes in diagrams] == [1, 1, 0]
    assert [text.get_text() for text in diagrams[0].get_yticklabels()] == ["0°", "20°", "40°", "60°"]
    assert [text.get_text() for text in diagrams[0].get_xticklabels()] == ["0°", "90°", "180°", "270°"]


def test_small_discs_show_the_cells_from_above():
    """Each cell's number, where its direction is: x to the right, y up."""
    sensor = Hemisphere(4, 8)
    disc = plots.small(sensor, np.arange(32.0), np.array([0, 0, 1.0]))
    for cell, (x, y, z) in enumerate(sensor.directions(np.array([0, 0, 1.0]))[:, 0]):
        r = np.sqrt(1 - z) / np.hypot(x, y)
        row, column = ((1 - side * r * w) / 2 * plots.SMALL for side, w in ((1, y), (-1, x)))
        assert disc[int(row), int(column)] == cell
