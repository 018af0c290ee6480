"""Pictures of measurements: what is drawn is named, and has the channels that were measured."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import pytest

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
    mi.set_variant(variant)
    with pytest.raises(ParameterError, match=f"variant {variant}.*R, G, B were measured"):
        plots.figure(measured, GREY)
