"""Maps: of the hemisphere, of Rusinkiewicz's angles, and of samples."""

from known import GOLD, GROOVES, REFLECTANCE, lambertian  # isort: skip
import numpy as np
import pytest

from asperity.drawing import hemisphere, plot, rusinkiewicz, sampling
from asperity.goniophotometer.sensors import directions

INCIDENT = np.array([(30.0, 0.0), (30.0, 90.0)])


def image(figure, n=0):
    """Values of a map."""
    return np.ma.filled(figure.axes[n].images[0].get_array(), np.nan)


def test_pixels_are_directions_that_share_the_hemisphere_evenly():
    wo = hemisphere.pixels()
    inside = wo[..., 2] > 0
    assert np.linalg.norm(wo[inside], axis=-1) == pytest.approx(np.ones(inside.sum()))
    cosine = wo[inside][:, 2]
    # The disc's rim cuts pixels: of 320 in a diameter, π 320 of 320² π / 4.
    assert (cosine.mean(), (cosine**2).mean()) == pytest.approx((1 / 2, 1 / 3), rel=4 / 320)


def test_a_lambertian_on_the_hemisphere(rgb):
    """ρ/π cos θ; what is below the scale's end is drawn as that."""
    values = image(plot([lambertian(0.8)], "hemisphere", theta=(30,), scale="linear"))
    wo = hemisphere.pixels()
    inside = wo[..., 2] > 0
    assert values[inside] == pytest.approx(0.8 / np.pi * wo[inside][:, 2], abs=1e-6)
    assert np.isnan(values[~inside]).all()


def test_the_highlight_is_opposite_to_the_light(rgb):
    """For light from both azimuths: the middle of the brightest pixels."""
    for values, (theta, phi) in zip(hemisphere.over_disc(GOLD, INCIDENT)[0], INCIDENT):
        bright = hemisphere.pixels()[values > 0.9 * np.nanmax(values)].mean(axis=0)
        assert bright / np.linalg.norm(bright) == pytest.approx(directions([(theta, phi + 180)])[0], abs=0.02)


def test_anisotropic_grooves_are_wider_across(rgb):
    """The width along x and y of the lobe at normal incidence, alpha_u = 0.1 and alpha_v = 0.4."""
    values = hemisphere.over_disc(GROOVES, np.array([(0.0, 0.0)]))[0, 0]
    wo = hemisphere.pixels()
    weight = np.nan_to_num(values)
    along, across = (np.sqrt((weight * wo[..., axis] ** 2).sum() / weight.sum()) for axis in (0, 1))
    assert across > 1.8 * along


def test_a_measurement_shows_its_cells(rgb, measured):
    values = hemisphere.over_disc(measured, np.array([(30.0, 0.0)]))[0, 0]
    wo = hemisphere.pixels()
    inside = wo[..., 2] > 0
    row = np.minimum(((1 - wo[inside][:, 2]) * 16).astype(int), 15)
    assert values[inside] == pytest.approx(REFLECTANCE / np.pi * (1 - (row + 0.5) / 16), rel=1e-6)


def test_isolines_are_where_the_values_are(rgb):
    """Those of a Lambertian are circles: f cos θ = level at 1 - r² = cos θ."""
    figure = plot([lambertian(0.8)], "hemisphere", theta=(0,), scale="linear", isolines=True)
    (contours,) = (one for one in figure.axes[0].collections if hasattr(one, "levels"))
    for level, path in zip(contours.levels, contours.get_paths()):
        r = np.linalg.norm(path.vertices, axis=1)
        assert 0.8 / np.pi * (1 - r**2) == pytest.approx(np.full(len(r), level), abs=1e-3)


def test_rusinkiewicz_angles():
    """Half vectors and differences of the pairs are those asked for."""
    wi, wo = rusinkiewicz.pair(20.0, 35.0, 50.0, 90.0)
    half = (wi + wo) / np.linalg.norm(wi + wo)
    assert np.degrees(np.arccos(half[2])) == pytest.approx(20)
    assert np.degrees(np.arctan2(half[1], half[0])) == pytest.approx(50)
    assert np.degrees(np.arccos(wi @ half)) == pytest.approx(35)
    assert wi[2] == pytest.approx(np.cos(np.radians(20)) * np.cos(np.radians(35)))  # at φ_d = 90°
    wi, wo = rusinkiewicz.pair(20.0, 0.0, 50.0, 90.0)
    assert wi == pytest.approx(wo)


def test_rusinkiewicz_of_a_lambertian_and_of_gold(rgb):
    """f is constant; gold is brightest on the left, where half vector and normal are the same."""
    values = rusinkiewicz.over_angles(lambertian(0.8))[0]
    seen = np.isfinite(values)
    assert values[seen] == pytest.approx(np.full(seen.sum(), 0.8 / np.pi), rel=1e-4) and seen.mean() > 0.9
    below = np.isnan(rusinkiewicz.over_angles(lambertian(0.8), phi_d=0)[0])
    assert below.mean() == pytest.approx(0.5, abs=0.02)  # θ_h + θ_d > 90°
    assert np.nanargmax(rusinkiewicz.over_angles(GOLD)[0, 128]) == 0


def test_samples_and_pdf_lie_opposite_to_the_light(rgb):
    """The middles of where they are densest; cells are 1.8 degrees wide."""
    for density in sampling.densities(GOLD, (45.0, 30.0))[:2]:
        bright = hemisphere.pixels()[density > 0.8 * np.nanmax(density)].mean(axis=0)
        assert bright / np.linalg.norm(bright) == pytest.approx(directions([(45, 210)])[0], abs=0.04)


@pytest.mark.parametrize("material", [lambertian(), GOLD, GROOVES], ids=lambda material: material.name)
def test_the_histogram_agrees_with_the_pdf(rgb, material):
    """Deviations over their standard deviation scatter by 1, in cells where a hundred or more samples are expected."""
    sampled, expected, deviation = sampling.densities(material, (45.0, 0.0))
    many = expected * sampling.CELL * 1e6 > 100
    assert many.any() and np.std(deviation[many]) == pytest.approx(1, abs=0.1)
    assert np.nanmean(sampled) == pytest.approx(np.nanmean(expected), rel=0.01)


def test_the_pdf_of_a_lambertian_is_that_of_the_cosine(rgb):
    """cos θ / π; means over the cells, of 1/50 in cos θ."""
    _, expected, _ = sampling.densities(lambertian(), (45.0, 0.0))
    wo = hemisphere.pixels()
    inside = wo[..., 2] > 0
    assert expected[inside] == pytest.approx(wo[inside][:, 2] / np.pi, abs=0.011 / np.pi)


def test_what_is_marked_is_named_within_the_picture(rgb):
    figure = plot([lambertian(0.8)], "hemisphere", theta=60)
    figure.canvas.draw()
    box = figure.axes[0].get_legend().get_window_extent()
    assert box.x0 >= 0 and box.y0 >= 0
