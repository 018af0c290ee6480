"""The ground truth itself, where it is known otherwise."""

import numpy as np
import pytest
import references

from asperity.errors import ParameterError
from asperity.models.twoscale.microgeometry import Facets, RandomHeights, far_field

SURFACE = RandomHeights(0.05, 1.2, 2.3, 40.0, 128)


def test_heights_have_their_spectrum():
    """Variance and slopes along x, over 200 surfaces; independent ones to 4 standard errors."""
    surfaces = np.stack([SURFACE.heights(np.random.default_rng(seed)) for seed in range(200)])
    turn = 2 - 2 * np.cos(2 * np.pi * SURFACE.orders[0] * SURFACE.side / SURFACE.cells)
    steps = (SURFACE.spectrum * turn).sum() / SURFACE.side**2
    for values, expected in ((surfaces, SURFACE.variance), (surfaces - np.roll(surfaces, 1, axis=1), steps)):
        found = np.square(values).mean(axis=(1, 2))
        assert found.mean() == pytest.approx(expected, abs=4 * found.std() / 200**0.5)


@pytest.mark.parametrize("b, c", [(1.2, 2.3), (0.6, 1.5), (2, 3)])
@pytest.mark.parametrize("wavelength", [0.45, 0.65])
def test_of_the_spectrum_light_sees_its_share(b, c, wavelength):
    """R at normal incidence: a square of 60 b lacks the longest waves, (c - 1) / 2 pi / 60^2 of all."""
    surface = RandomHeights(0.1, b, c, 60 * b, 512, 1 / wavelength)
    share = Facets(0.1, 1, 0.1, b, c).propagating(0.0, wavelength)
    assert surface.variance / 0.1**2 == pytest.approx(share, rel=3e-3)


def test_all_light_goes_somewhere_and_the_mean_phase_stays():
    heights = SURFACE.heights(np.random.default_rng(1))
    sent = far_field(heights, 20.0)
    assert sent.sum() == pytest.approx(1, rel=1e-5) and sent.min() >= 0
    assert sent[0, 0] == pytest.approx(abs(np.exp(20j * heights).mean()) ** 2, rel=1e-4)
    assert far_field(0 * heights, 20.0)[0, 0] == pytest.approx(1)


@pytest.mark.parametrize("seed", range(6))
def test_facets_are_integrated_as_elsewhere(seed):
    """By two rules, which a kink where h.m is 0 leaves 1e-4 of; 1 + Lambda over the projected area of facets; R."""
    rng = np.random.default_rng(seed)
    alpha, p, b, c = references.material(rng)
    theta, u = references.tilts(rng, 8, alpha)[seed], b * rng.uniform(0.05, 2)
    facets, h = Facets(alpha, p, 0.05, b, c), np.array([np.sin(theta), 0, np.cos(theta)])
    assert facets.convolution(h, u) == pytest.approx(references.convolution(theta, u, c, alpha, alpha, p), rel=3e-4)
    m, weight = facets.normals(h, u)
    w = np.array([np.sin(1.5), 0, np.cos(1.5)])
    facing = np.sum(weight * np.maximum(np.tensordot(w, m, 1), 0)) / w[2]
    assert 1 + facets.smith_lambda(w) == pytest.approx(facing, rel=1e-3)
    assert facets.propagating(0.8, 0.5) == pytest.approx(references.propagating(0.8, b / 0.5, c), rel=1e-5)


def test_smooth_facets_are_integrated_as_elsewhere():
    """sigma .05, b 1.2, c 2.3, lambda .55 at normal incidence: .9275, by hand (notes of the model)."""
    assert sum(Facets(0.1, 1, 0.05, 1.2, 2.3).smooth_albedo(0.0, 0.55)) == pytest.approx(0.9275, abs=1e-4)


def test_without_slopes_facets_one_by_one_are_the_separated_integral():
    i, o = np.array([0.6, 0, 0.8]), np.array([-0.28, 0.0, 0.96])
    separated, truth = Facets(1e-3, 1, 1e-3, 1.2, 2.3).diffracted(i, o, 0.55)
    assert truth == pytest.approx(separated, rel=1e-3)


@pytest.mark.parametrize(
    "wrong", [{"b": 0}, {"c": 1.0}, {"sigma_s": -1}, {"side": 0}, {"cells": 1}, {"highest": np.nan}]
)
def test_what_is_refused(wrong):
    given = {"sigma_s": 0.05, "b": 1.2, "c": 2.3, "side": 40.0} | wrong
    with pytest.raises(ParameterError, match=next(iter(wrong))):
        RandomHeights(**given)
