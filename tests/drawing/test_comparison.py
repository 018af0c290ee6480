"""Two materials side by side."""

from known import ERROR, REFLECTANCE, lambertian, measurement  # isort: skip
import numpy as np
import pytest

from asperity import drawing
from asperity.drawing import hemisphere
from asperity.drawing.comparison import Previews, compare
from asperity.errors import ParameterError
from asperity.goniophotometer import Window
from asperity.materials import Material


def drawn(a, b, previews=None):
    return drawing.compared(a, b, compare(a, b, ("a", "b")), previews)


def test_the_relative_difference_of_two_lambertians(rgb):
    """Is that of their reflectances, but at the horizon, where values are below a percent of their mean, 1/2 ρ/π."""
    figure = drawn(lambertian(0.5), lambertian(0.6))
    maps = [axes for axes in figure.axes if axes.images]
    relative = np.ma.filled(maps[2].images[0].get_array(), np.nan)
    assert relative[hemisphere.pixels()[..., 2] > 0.01] == pytest.approx(0.2, rel=1e-4)
    titles = [axes.get_title() for axes in maps]
    assert titles[0].startswith("matte, reflectance = 0.5") and titles[1].startswith("matte, reflectance = 0.6")


def test_a_measurement_is_compared_in_its_own_cells(rgb, measured):
    """A model that is right differs by nothing here, where the tiles' mean is exact; their scatter is the noise."""
    found = compare(measured, lambertian(REFLECTANCE), ("a", "b"))
    assert found.mean_relative < 1e-5 and np.abs(found.albedo_difference).max() < 1e-5
    assert found.noise == pytest.approx(np.sqrt(2 / np.pi) * ERROR, rel=1e-4)
    other = compare(lambertian(0.3), measured, ("a", "b"))
    assert other.mean_relative == pytest.approx(1, rel=1e-5) and other.albedo_difference == pytest.approx([0.3] * 3)
    assert drawn(measured, lambertian(0.3))


def test_a_window_has_no_maps(rgb):
    window = Material("window", measured=measurement(sensor=Window("retro", 10, 6), angles=((30, 0),)))
    found = compare(window, lambertian(REFLECTANCE), ("a", "b"))
    assert found.mean_relative < 1e-5 and found.outgoing.shape == (1, 36, 2)
    assert not any(axes.images for axes in drawn(window, lambertian(0.3)).axes)


def test_two_measurements(rgb, measured):
    found = compare(measured, Material("other", measured=measurement(0.3)), ("a", "b"))
    assert found.mean_relative == pytest.approx(0.5, rel=1e-6)
    assert found.noise == pytest.approx(np.sqrt(2 / np.pi) * ERROR * np.hypot(1, 0.5), rel=1e-4)
    with pytest.raises(ParameterError, match="directions of incidence differ"):
        compare(measured, Material("other", measured=measurement(angles=((10, 0),))), ("a", "b"))


def test_previews_are_shown_with_their_differences(rgb):
    a = np.zeros((8, 8, 3))
    previews = Previews(a, a + 0.25, np.full((8, 8), 0.25), np.full((8, 8), 0.125))
    titles = {axes.get_title() for axes in drawn(lambertian(0.5), lambertian(0.6), previews).axes}
    assert {"difference, mean 0.25", "FLIP, mean 0.125"} <= titles
    titles = {axes.get_title() for axes in drawn(lambertian(), lambertian(), previews._replace(flip=None)).axes}
    assert not any("FLIP" in title for title in titles)
