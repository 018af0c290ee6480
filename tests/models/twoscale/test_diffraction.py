"""R, and the albedo of smooth facets, by quadrature that takes nothing from the package."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import numpy as np
import pytest
import references
from drjit.llvm.ad import Float
from helpers import float64

from asperity.models.twoscale import diffraction


@pytest.mark.parametrize("seed", range(12))
def test_what_propagates(seed):
    """Evenly in angle, with 256 nodes, of which a kink at grazing incidence leaves 1e-4."""
    rng = np.random.default_rng(seed)
    s = 1 - 1e-4 * rng.random() if seed % 4 == 0 else np.sqrt(1 - rng.random() ** 2)
    B, c = np.exp(rng.uniform(*np.log([0.02, 60]))), rng.uniform(1.02, 5)
    found = diffraction.propagating(float64(s), float64(B), float64(c))[0]
    assert found == pytest.approx(references.propagating(s, B, c), rel=1e-4)


def test_what_propagates_in_float32():
    """Of little roughness little, as B^2; of much, all."""
    B, c, s = (x.ravel() for x in np.meshgrid([0.02, 1, 80], [1.02, 2, 5], [0, 0.6, 0.999], indexing="ij"))
    exact = np.array(diffraction.propagating(*map(float64, (s, B, c))))
    np.testing.assert_allclose(np.array(diffraction.propagating(*map(Float, (s, B, c)))), exact, rtol=3e-6)
    assert (exact > 0).all() and (exact < 1).all()


CASES = [(0.05, 1.2, 2.3, 0.55), (0.01, 0.3, 1.5, 0.45), (0.1, 3.0, 2.8, 0.65), (0.3, 0.5, 1.1, 0.55)]


@pytest.mark.parametrize("sigma, b, c, wavelength", CASES)
@pytest.mark.parametrize("cos", [1.0, 0.8, 0.3, 0.05])
def test_what_smooth_facets_diffract(sigma, b, c, wavelength, cos):
    """By 32 circles, half of which leave the disc: 1e-4; and R of the reference, linear between 2000 nodes."""
    B, k, sin = b / wavelength, 4 * np.pi * sigma / wavelength, np.sqrt(1 - cos * cos)
    grid = np.linspace(0, 1, 2001)
    R = np.array(diffraction.propagating(float64(np.sqrt(1 - grid**2)), float64(B), float64(c)))
    expected = references.smooth_albedo(sin, B, c, k, lambda x: np.interp(x, grid, R))

    def share(cos_d):
        fraction = diffraction.propagating(dr.sqrt(1 - dr.square(cos_d)), float64(B), float64(c))
        return (1 - dr.exp(-k * k * dr.square(cos_d) * fraction)) / fraction

    found = diffraction.smooth_albedo(share, float64(sin), float64(cos), float64(B), float64(c))[0]
    assert found == pytest.approx(expected, rel=3e-4)


def test_a_smooth_facet_and_what_it_diffracts():
    """What is kept and what is diffracted, for sigma .05, b 1.2, c 2.3, lambda .55 at normal incidence: .9275."""
    B, c, k = 1.2 / 0.55, 2.3, 4 * np.pi * 0.05 / 0.55
    R = diffraction.propagating(float64(0), float64(B), float64(c))[0]
    grid = np.linspace(0, 1, 2001)
    table = np.array(diffraction.propagating(float64(np.sqrt(1 - grid**2)), float64(B), float64(c)))
    total = np.exp(-k * k * R) + references.smooth_albedo(0, B, c, k, lambda x: np.interp(x, grid, table))
    assert total == pytest.approx(0.9275, abs=1e-4)


def test_draws_stay_in_the_disc_and_follow_their_density():
    """Mean distances, by their standard errors; at grazing incidence most of a circle is beyond the rim."""
    rng, n = np.random.default_rng(4), 1 << 16
    for sin, B, c in ((0, 3, 2), (0.7, 1, 1.3), (0.999, 5, 2.5)):
        disc = diffraction.Disc(*map(float64, (sin, B, c)))
        r = disc.radius(float64(rng.random(n)))
        psi = (2 * float64(rng.random(n)) - 1) * disc.reach(r)
        x, y = np.array(r * dr.cos(psi)) - sin, np.array(r * dr.sin(psi))
        assert (np.hypot(x, y) < 1 + 1e-7).all()
        radius, weight = references.panels(0, 1 + sin, [(0, 0.1 / B), (1 - sin, 1e-4)])
        area = np.array(disc.density(float64(radius)) * 2 * disc.reach(float64(radius))) * radius * weight
        assert area.sum() == pytest.approx(1, abs=1e-5)
        assert np.array(r).mean() == pytest.approx((area * radius).sum(), abs=5 * np.array(r).std() / n**0.5)
