"""The convolution of facets with what each diffracts, by quadrature that takes nothing from the package."""

import asperity  # noqa: F401  isort: skip
import numpy as np
import pytest
import references
from drjit.llvm.ad import Float
from helpers import float64

from asperity.microfacet.epd import Profile
from asperity.models.twoscale import convolution

SPOTS = {  # (theta_h, u, c, alpha, p): by three other quadratures, to eight digits
    (0, 2, 2.3, 0.1, 0.7): 0.71141025,
    (0.1, 2, 2.3, 0.1, 0.7): 0.61361742,
    (0.5, 5, 1.5, 0.2, 1): 0.020518901,
    (1, 3, 2.9, 0.3, 0.5): 0.010606329,
    (0.05, 50, 2, 0.05, 1): 0.025150565,
    (0.2, 50, 2, 0.2, 0.4): 5.7743661e-4,
    (0.06, 10, 2.5, 0.06, 5): 0.24460986,
    (0.02, 90, 1.1, 0.008, 0.25): 0.016311888,
}


def even(theta, u, c, alpha, p, number=float64, **more):
    theta = np.asarray(theta, dtype=float)
    numbers = (number(x) for x in (alpha, c, u, np.sin(theta), np.cos(theta)))
    return np.array(convolution.convolution(Profile.of(number(p)), *numbers, **more), dtype=float)


def stretched(theta, u, c, alpha_u, alpha_v, p, phi):
    alpha, profile = (float64(alpha_u), float64(alpha_v)), Profile.of(float64(p))
    h = (float64(x) for x in (np.sin(theta), np.cos(theta), phi))
    return np.array(convolution.stretched_convolution(profile, alpha, float64(c), float64(u), *h))


@pytest.mark.parametrize("number", [float64, Float], ids=["float64", "float32"])
@pytest.mark.parametrize("spot", SPOTS, ids=str)
def test_the_convolution_at_known_points(spot, number):
    """In either precision eight nodes leave 1e-4, sixteen nothing but float32's roundings."""
    assert even(*spot, number)[0] == pytest.approx(SPOTS[spot], rel=2e-4)
    assert even(*spot, number, nodes=16)[0] == pytest.approx(SPOTS[spot], rel=3e-6)
    theta, u, c, alpha, p = spot
    assert references.convolution(theta, u, c, alpha, alpha, p) == pytest.approx(SPOTS[spot], rel=1e-6)
    assert stretched(theta, u, c, alpha, alpha, p, 0.3)[0] == pytest.approx(SPOTS[spot], rel=2e-4)


@pytest.mark.parametrize("seed", range(20))
def test_the_convolution_of_any_material(seed):
    """At the peak, in the tail, at the horizon; of two roughnesses that are up to 5 : 1."""
    rng = np.random.default_rng(seed)
    (alpha, p, b, c), u = references.material(rng), rng.uniform(0.01, 1) / 0.444
    theta = references.tilts(rng, 8, alpha)[seed % 8]
    expected = references.convolution(theta, b * u, c, alpha, alpha, p)
    assert even(theta, b * u, c, alpha, p)[0] == pytest.approx(expected, rel=5e-4)
    other, phi = alpha * np.exp(rng.uniform(-1.6, 0)), rng.uniform(0, np.pi / 2)
    expected = references.convolution(theta, b * u, c, alpha, other, p, phi)
    assert stretched(theta, b * u, c, alpha, other, p, phi)[0] == pytest.approx(expected, rel=5e-4)


def test_limits_of_the_convolution():
    """S of smooth facets; and of short waves D / (4 cos_d^2): to the digits that are known."""
    theta, u, c = 0.3, 2, 2.3
    S = (1 + 4 * u * u * np.sin(theta) ** 2) ** (-(c + 1) / 2) * np.cos(theta) ** 2
    for alpha, excess in ((0.1, 0.065), (0.01, 7e-4), (0.001, 7e-6)):
        assert even(theta, u, c, alpha, 1)[0] / S - 1 == pytest.approx(excess, rel=0.1)
    D = np.exp(-((np.tan(0.2) / 0.3) ** 2)) / (np.pi * 0.3**2 * np.cos(0.2) ** 4)
    for u, ratio in ((20, 0.975), (100, 0.998), (500, 0.99989)):
        assert u * u * 1.9 / (2 * np.pi) * even(0.2, u, 2.9, 0.3, 1)[0] * 4 / D == pytest.approx(ratio, abs=6e-4)
