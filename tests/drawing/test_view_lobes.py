"""Polar plots."""

from known import GLASS, lambertian, longest  # isort: skip
import numpy as np
import pytest

from asperity.drawing import plot
from asperity.drawing.lobes import Radius


def test_a_lambertian_is_a_circle(rgb):
    """f cos θ = ρ/π cos θ: of diameter 1 in units of its largest value, touching the surface; f32 rounds."""
    for theta in (0, 70):
        x, y = longest(plot([lambertian(0.8)], theta=(theta,)).axes[0]).get_data()
        assert x**2 + (y - 0.5) ** 2 == pytest.approx(np.full(len(x), 0.25), abs=1e-6)


def test_without_the_cosine_it_is_half_a_circle(rgb):
    x, y = longest(plot([lambertian(0.8)], cosine=False).axes[0]).get_data()
    assert np.hypot(x, y) == pytest.approx(np.ones(len(x)), abs=1e-4)  # divided by cosines down to 1e-3


def test_rings_have_the_values_they_name(rgb):
    figure = plot([lambertian(0.8)], theta=(0,))
    rings = {text.get_text(): text.get_position()[0] for text in figure.axes[0].texts}
    assert rings["0.2"] == pytest.approx(0.2 / (0.8 / np.pi))


def test_logarithms():
    """The radius of a value: 0 three to four decades below the largest, and 1 there."""
    radius = Radius(5.0, "log")
    assert radius(np.array([5.0, 1e-3, 0.0])) == pytest.approx([1, 0, 0])
    assert radius(0.1) - radius(0.01) == pytest.approx(radius(1) - radius(0.1))
    assert radius.ticks() == pytest.approx([0.01, 0.1, 1])


def test_what_is_transmitted_is_drawn_below(rgb):
    glass, matte = (longest(plot([one], theta=(20,)).axes[0]).get_ydata().min() for one in (GLASS, lambertian()))
    assert glass < -0.9 and matte > -1e-6


def test_measured_points_and_their_errors(rgb, measured):
    """On the circle, at the cells' centres; a bar along the radius from value - error to value + error."""
    from known import ERROR

    axes = plot([measured], theta=(30,)).axes[0]
    (points,) = (line for line in axes.lines if line.get_marker() == "o")
    x, y = points.get_data()
    cosine = 1 - (np.arange(16) + 0.5) / 16
    top = cosine[0]
    assert np.sort(np.hypot(x, y))[::2] == pytest.approx(np.sort(cosine) / top, rel=1e-4)
    bars = [np.hypot(*line.get_data()) for line in axes.lines if len(line.get_xdata()) == 2 and line.zorder == 3]
    assert len(bars) == 32
    assert [(b - a) / (a + b) for a, b in bars] == pytest.approx([ERROR] * 32, rel=1e-2)
