"""Curves in the plane of incidence."""

from known import ERROR, GOLD, REFLECTANCE, lambertian, longest, measurement  # isort: skip
import mitsuba as mi
import numpy as np
import pytest

from asperity.drawing import plot
from asperity.goniophotometer import Points, Window
from asperity.materials import Material


def test_a_lambertian_is_a_cosine_or_constant(rgb):
    x, y = longest(plot([lambertian(0.8)], "slices").axes[0]).get_data()
    assert (x[0], x[-1]) == (-90, 90)
    assert y == pytest.approx(0.8 / np.pi * np.cos(np.radians(x)), abs=1e-6)
    y = longest(plot([lambertian(0.8)], "slices", cosine=False).axes[0]).get_ydata()
    assert y == pytest.approx(np.full(len(y), 0.8 / np.pi), rel=1e-4)


@pytest.mark.parametrize("phi", [0, 35])
def test_the_peak_is_where_a_mirror_sends_light(rgb, phi):
    """At positive angles; grazing peaks lie beyond, so that the angle is small."""
    x, y = longest(plot([GOLD], "slices", theta=(20,), phi=phi).axes[0]).get_data()
    assert x[y.argmax()] == pytest.approx(20, abs=0.5)


def test_a_steep_lobe_gets_logarithms_unasked(rgb):
    assert plot([GOLD], "slices").axes[0].get_yscale() == "log"
    assert plot([lambertian()], "slices").axes[0].get_yscale() == "linear"
    assert plot([GOLD], "slices", scale="linear").axes[0].get_yscale() == "linear"


def test_error_bars_are_those_of_the_measurement(rgb, measured):
    """Beside a model, a diagram for each angle."""
    figure = plot([lambertian(REFLECTANCE), measured], "slices")
    assert len(figure.axes) == 3
    for axes in figure.axes:
        (bars,) = axes.containers
        x, y = bars[0].get_data()
        cosine = 1 - (np.arange(16) + 0.5) / 16
        assert np.degrees(np.arccos(cosine)) == pytest.approx(x[16:])
        assert y[16:] == pytest.approx(REFLECTANCE / np.pi * cosine, rel=1e-6)
        ends = np.array([segment[:, 1] for segment in bars[2][0].get_segments()])
        assert (ends[:, 1] - ends[:, 0]) / 2 / y == pytest.approx(np.full(32, ERROR), rel=1e-6)


@pytest.mark.parametrize(
    "sensor, expected",
    [
        (Points(((20.0, 0.0), (40.0, 180.0), (30.0, 90.0))), [-20, 40]),
        (Window("mirror", 10, 5), np.linspace(20, 40, 11)[1::2]),
    ],
    ids=lambda one: getattr(one, "kind", ""),
)
def test_other_sensors_show_what_lies_in_the_plane(rgb, sensor, expected):
    material = Material("measured", measured=measurement(sensor=sensor, angles=((30, 0),)))
    x, y = plot([material], "slices").axes[0].containers[0][0].get_data()
    assert x == pytest.approx(expected, abs=0.05)  # rows of equal area: not quite of equal angle
    assert y == pytest.approx(REFLECTANCE / np.pi * np.cos(np.radians(x)), rel=2e-3)  # means over cells


def test_channels_and_wavelengths(rgb):
    paint = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.2, 0.4, 0.6]}}
    axes = plot([Material("paint", paint)], "slices", theta=(0,), channel="each").axes[0]
    peaks = {line.get_label(): line.get_ydata().max() for line in axes.lines if not line.get_label().startswith("_")}
    assert peaks == pytest.approx({"R": 0.2 / np.pi, "G": 0.4 / np.pi, "B": 0.6 / np.pi}, rel=1e-5)
    mi.set_variant("llvm_ad_spectral")
    ramp = {"type": "irregular", "wavelengths": "400, 700", "values": "0.1, 0.7"}
    wavelengths = (450, 500, 550, 600, 650)
    material = Material("ramp", {"type": "diffuse", "reflectance": ramp})
    axes = plot([material], "slices", theta=(0,), channel="each", wavelengths=wavelengths).axes[0]
    peaks = [line.get_ydata().max() * np.pi for line in axes.lines if "nm" in str(line.get_label())]
    assert peaks == pytest.approx([0.2, 0.3, 0.4, 0.5, 0.6], rel=1e-5)
