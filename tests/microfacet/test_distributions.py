"""Distributions of normals: their normalisation, their samples, Smith's Lambda."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest
from helpers import directions
from normals import AZIMUTHS, hemisphere, mean

from asperity.microfacet.distributions import DISTRIBUTIONS, EPD, GGX, Beckmann, Gaussian
from asperity.microfacet.epd import Power

N = 1 << 17


def epd(p):
    """The distribution of this exponent, as a function of the roughness."""
    power = Power.of(llvm.Float64(p))
    return lambda alpha_u, alpha_v: EPD(alpha_u, alpha_v, power)


POWERS = {f"epd {p}": epd(p) for p in (0.4, 1, 2)}
CLASSES = {kind.__name__: kind for kind in (*DISTRIBUTIONS.values(), Gaussian)}
KINDS = pytest.mark.parametrize("kind", (CLASSES | POWERS).values(), ids=CLASSES | POWERS)
ROUGHNESS = pytest.mark.parametrize("alphas", [(0.02, 0.02), (0.1, 0.4), (0.9, 0.3)], ids=str)


@KINDS
@ROUGHNESS
def test_facets_project_to_the_surface(kind, alphas):
    """By 2000 rings, evenly spaced: 1e-6. What normalises the Gaussian is a fit, and a rule of four nodes."""
    (m, angle), distribution = hemisphere(*alphas), kind(*alphas)
    tolerance = (5e-6 if alphas[0] == alphas[1] else 2e-4) if kind is Gaussian else 1e-6
    assert mean(distribution.density(m) * m.z, angle) == pytest.approx(1, abs=tolerance)
    assert mean(distribution.sample_density(m), angle) == pytest.approx(1, abs=1e-6)


@KINDS
@ROUGHNESS
def test_samples_follow_the_density(kind, alphas):
    """Moments of z and the azimuth, by their standard errors, and the extremes of random numbers."""
    rng, distribution = np.random.default_rng(8), kind(*alphas)
    drawn = np.array(distribution.sample(*(llvm.Float64(rng.random(N)) for _ in range(2))))
    m, angle = hemisphere(*alphas)
    weight = np.asarray(distribution.sample_density(m)) * angle
    for moment in (lambda x, y, z: x * x, lambda x, y, z: y * y, lambda x, y, z: x * y, lambda x, y, z: z**4):
        found, expected = moment(*drawn), (moment(*np.asarray(m)) * weight).sum()
        assert found.mean() == pytest.approx(expected, abs=5 * found.std() / N**0.5)
    ends = np.array(distribution.sample(llvm.Float(0, 1 - 2**-24), llvm.Float(0, 1 - 2**-24)))
    assert np.isfinite(ends).all() and np.allclose(np.linalg.norm(ends, axis=0), 1) and (ends[2] > 0).all()


@pytest.mark.parametrize("kind", CLASSES.values(), ids=CLASSES)
def test_plain_floats_are_as_good(kind):
    distribution, m = kind(0.2, 0.5), dr.normalize(dr.scalar.Array3f64(0.3, -0.1, 0.9))
    assert distribution.density(m) == pytest.approx(distribution.density(llvm.Array3f64(m))[0], rel=1e-12)
    assert list(distribution.sample(0.3, 0.6)) == pytest.approx(
        np.ravel(distribution.sample(llvm.Float64(0.3), llvm.Float64(0.6))), rel=1e-12
    )


@KINDS
def test_derivatives_are_finite_at_the_normal(kind):
    alpha, m = llvm.Float(0.3, 0.3), llvm.Array3f([0, 0.6], [0, 0], [1, 0.8])
    dr.enable_grad(alpha, m)
    dr.backward(kind(alpha, 0.2).density(m))
    assert np.isfinite(dr.grad(m)).all() and (np.abs(dr.grad(alpha)) > 0).all()


@pytest.mark.parametrize("kind", [GGX, Beckmann])
@ROUGHNESS
def test_smiths_condition(kind, alphas):
    """(1 + Lambda) cos = int D <w.m> dm, what is seen without neighbours.

    On a ring <w.m> is half a wave, at worst, of which the midpoint rule misses step^2 / 8 for its two kinks.
    """
    w = directions(np.random.default_rng(3), 12)
    w = np.c_[w, [0, 0, 1], [0.9999, 0, 0.0141], [0, 0.9999, 0.0141], [0.99, 0.14, 0.001]]
    w /= np.linalg.norm(w, axis=0)
    (m, angle), distribution = hemisphere(*alphas), kind(*alphas)
    density = np.asarray(distribution.density(m)) * angle
    seen = [(density * np.maximum(direction @ np.asarray(m), 0)).sum() for direction in w.T]
    lambdas = np.asarray(distribution.smith_lambda(llvm.Array3f64(w)))
    np.testing.assert_allclose((1 + lambdas) * w[2], seen, rtol=(2 * np.pi / AZIMUTHS) ** 2 / 8)


def test_lambda_of_beckmann():
    """Of the closed form, where alpha tan theta = 1.3366 (Holzschuch and Pacanowski 2017, by quadrature)."""
    w = dr.normalize(dr.scalar.Array3f64(1.3366 / 0.2, 0, 1))
    assert Beckmann(0.2, 0.7).smith_lambda(w) == pytest.approx(0.07041396, rel=1e-6)


@pytest.mark.parametrize("name, tolerance", [("ggx", 1e-4), ("beckmann", 4e-3)])
@ROUGHNESS
def test_mitsuba_agrees(rgb, name, tolerance, alphas):
    """Where float32 leaves digits; Mitsuba's masking of Beckmann is a rational fit, good to .35 % (Walter 2007)."""
    rng, ours = np.random.default_rng(5), DISTRIBUTIONS[name](*map(mi.Float, alphas))
    theirs = mi.MicrofacetDistribution(getattr(mi.MicrofacetType, {"ggx": "GGX"}.get(name, "Beckmann")), *alphas, False)
    m = mi.Normal3f(ours.sample(mi.Float(rng.random(1000)), mi.Float(rng.random(1000))))
    np.testing.assert_allclose(ours.density(m), theirs.eval(m), rtol=2e-4)
    w = mi.Vector3f(directions(rng, 1000))
    masking = np.array(1 / (1 + ours.smith_lambda(w)))
    np.testing.assert_allclose(masking, theirs.smith_g1(w, mi.Vector3f(0, 0, 1)), rtol=tolerance)


@pytest.mark.parametrize(
    "alpha, inverse", [(0.2, 0.248003), (0.35, 0.738998), (0.5, 1.439713), (0.7, 2.492150), (1, 3.772845)]
)
def test_what_normalises_the_gaussian(alpha, inverse):
    """1 / C by quadrature, to the six digits given; the fit is as good."""
    assert 2 * np.pi * alpha**2 * Gaussian(alpha, alpha).area == pytest.approx(inverse, rel=6e-6)


def test_the_gaussian_is_one_function_of_the_slope_of_its_ellipse():
    """D cos depends on a^2 (cos^2 phi / alpha_u^2 + sin^2 phi / alpha_v^2) alone: all azimuths meet at the normal."""
    distribution, a = Gaussian(0.3, 0.8), 0.4
    found = []
    for phi in np.linspace(0, 2 * np.pi, 9):
        tilt = a / np.hypot(np.cos(phi) / 0.3, np.sin(phi) / 0.8)
        m = dr.scalar.Array3f64(np.sin(tilt) * np.cos(phi), np.sin(tilt) * np.sin(phi), np.cos(tilt))
        found.append(distribution.density(m) * m.z)
    np.testing.assert_allclose(found, found[0], rtol=1e-12)


@pytest.mark.parametrize("alpha", [0.05, 0.2, 0.35])
def test_smiths_masking_of_the_gaussian(alpha):
    """By 2000 rings. At .35, .0012 is of facets steeper than m_z = .01, as much of those that 16 rings leave out."""
    w = directions(np.random.default_rng(3), 20)
    (m, angle), distribution = hemisphere(alpha, alpha), Gaussian(alpha, alpha)
    density = np.asarray(distribution.density(m)) * angle * (np.asarray(m.z) > 0.01)
    seen = [(density * np.maximum(direction @ np.asarray(m), 0)).sum() for direction in w.T]
    found = np.asarray(1 + distribution.smith_lambda(llvm.Array3f64(w))) * w[2]
    np.testing.assert_allclose(found, seen, atol=1e-4 if alpha < 0.3 else 1.2e-3)


@ROUGHNESS
def test_epd_of_exponent_one_is_beckmann(alphas):
    """In density, samples, and Smith's Lambda, whose table is good to 8e-4."""
    rng, ours, theirs = np.random.default_rng(6), epd(1)(*alphas), Beckmann(*alphas)
    m = theirs.sample(*(llvm.Float64(rng.random(1000)) for _ in range(2)))
    np.testing.assert_allclose(ours.density(m), theirs.density(m), rtol=1e-12)
    numbers = [llvm.Float64(rng.random(1000)) for _ in range(2)]
    np.testing.assert_allclose(ours.sample(*numbers), theirs.sample(*numbers), rtol=1e-7)
    w = llvm.Array3f64(directions(rng, 1000, 1e-3))
    np.testing.assert_allclose(1 + ours.smith_lambda(w), 1 + theirs.smith_lambda(w), rtol=8e-4)


@pytest.mark.parametrize("p", [0.3, 0.6, 2, 5])
@pytest.mark.parametrize("alphas", [(0.02, 0.02), (0.1, 0.3)], ids=str)
def test_smiths_condition_of_epd(p, alphas):
    """(1 + Lambda) cos = int D <w.m> dm, to the 8e-4 of the table."""
    w = np.c_[directions(np.random.default_rng(3), 12), [0, 0, 1], [0.9999, 0, 0.0141]]
    w /= np.linalg.norm(w, axis=0)
    (m, angle), distribution = hemisphere(*alphas), epd(p)(*alphas)
    density = np.asarray(distribution.density(m)) * angle
    seen = [(density * np.maximum(direction @ np.asarray(m), 0)).sum() for direction in w.T]
    np.testing.assert_allclose((1 + np.asarray(distribution.smith_lambda(llvm.Array3f64(w)))) * w[2], seen, rtol=8e-4)
