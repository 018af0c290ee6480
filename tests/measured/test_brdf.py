"""The container of measured BRDFs, and what the virtual goniophotometer becomes."""

import asperity  # noqa: F401  isort: skip
import numpy as np
import pytest

from asperity.errors import ParameterError
from asperity.goniophotometer import Hemisphere, Measurement, Window
from asperity.goniophotometer.sensors import directions
from asperity.goniophotometer.tracer import EXTRA, UNIT
from asperity.measured import BRDF, from_measurement
from asperity.measured.brdf import angles

WI, WO = directions([(30, 0), (60, 10)]), directions([(0, 0), (45, 200)])
PATHS = 1 << 20


def brdf(**changed):
    return BRDF(**{"wi": WI, "wo": WO, "values": np.ones((2, 1)), "channels": ("Y",)} | changed)


@pytest.mark.parametrize(
    "changed, words",
    [
        ({"wo": WO[:1]}, "wo is of shape"),
        ({"values": np.ones((2, 3))}, "values is of shape"),
        ({"values": np.array([[1], [np.nan]])}, "values is not finite in 1 of 2 pairs, the first number 1"),
        ({"wi": WI * 2}, "wi holds directions that are not of length 1"),
        ({"wo": WO * [1, 1, -1]}, "wo holds directions that are not above"),
        ({"errors": -np.ones((2, 1))}, "errors has numbers below 0"),
        ({"weights": np.array([1.0, -1.0])}, "weights: expected 2 finite numbers"),
        ({"channels": ("x",)}, "channels are x"),
        ({"channels": ("532 nm", "532 nm"), "values": np.ones((2, 2))}, "different wavelengths"),
        ({"wi": WI[:0], "wo": WO[:0], "values": np.ones((0, 1))}, "empty"),
    ],
)
def test_what_is_at_odds_with_itself_is_refused(changed, words):
    with pytest.raises(ParameterError, match=words):
        brdf(**changed)


def test_channels_say_which_variants_have_them():
    assert brdf().mode == "mono" and brdf().wavelengths is None
    two = brdf(channels=("532 nm", "632.8 nm"), values=np.ones((2, 2)))
    assert two.mode == "spectral" and two.wavelengths == [532, 632.8]


def test_angles_are_those_of_the_directions():
    assert np.allclose(angles(directions([(30, 350), (89.9, 180)])), [(30, 350), (89.9, 180)])


def traced(sensor, f, incident):
    """A measurement in which every cell got what a BRDF ``f`` of constant value sends there."""
    wi = directions(incident)
    cosine = np.stack([sensor.directions(w, 8)[..., 2].clip(0).mean(axis=1) for w in wi])
    energy = np.zeros((2, len(wi), 1, sensor.cells + EXTRA, 1), dtype=np.uint64)
    energy[:, :, 0, :-EXTRA, 0] = f * cosine * sensor.solid_angle * PATHS / UNIT + 0.5
    about = {"sensor": sensor.describe(), "channels": ["Y"], "geometry": {"type": "Tile"}}
    paths = np.full((2, len(wi)), PATHS)
    return Measurement(about, np.array(incident, dtype=float), np.array([[0, 0], [0, 1]]), paths, energy)


def test_a_constant_brdf_measured_by_the_virtual_goniophotometer_is_constant():
    """Counts are whole multiples of UNIT, 2^-20 or so of a path: the rounding is below a ten thousandth."""
    found = from_measurement(traced(Hemisphere(8, 16), 0.25, [(0, 0), (50, 30)]))
    assert len(found) == 2 * 128 and found.isotropic and found.source == "Tile"
    assert np.allclose(found.values, 0.25, rtol=1e-4)
    assert np.allclose(found.errors, 0)
    assert not from_measurement(traced(Hemisphere(2, 4), 0.25, [(50, 0), (50, 30)])).isotropic


def test_cells_below_the_surface_are_left_out_and_counted():
    found = from_measurement(traced(Window("mirror", 20, 8), 0.25, [(80, 0)]))
    assert found.left_out["below the surface"] == 64 - len(found) > 0


def test_a_subset_keeps_all_that_belongs_to_its_pairs():
    found = brdf(errors=np.array([[0.1], [0.2]]), weights=np.array([3.0, 4.0]), source="a lab").subset(np.array([1]))
    assert len(found) == 1 and found.source == "a lab"
    assert np.array_equal(found.wo, WO[1:]) and found.errors == 0.2 and found.weights == 4
