"""The exponential power distribution: Smith's Lambda and draws, by SciPy and to known numbers."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest
from scipy import special

from asperity.microfacet import epd
from asperity.microfacet.epd import Power, Profile
from asperity.microfacet.tables import array_types

EXPONENTS = [0.2, 0.35, 0.7, 1, 2, 5]
LAMBDA = {  # (p, t) -> Lambda, by the identity of projected areas
    (0.3, 0.2572): 0.3623516,
    (0.5, 1.3366): 0.4613888,
    (0.7, 1.3366): 0.1705988,
    (1, 1.3366): 0.07041396,
    (2, 1.3366): 0.02040904,
    (5, 1.3366): 0.009909519,
}


def masked(p, t, number=llvm.Float64):
    """1 + Lambda, looked up."""
    cos = 1 / np.sqrt(1 + t * t)
    return 1 + np.array(Power.of(number(p)).smith_lambda(number(t * cos), number(cos)), dtype=float)


@pytest.mark.parametrize("p, t", LAMBDA)
def test_known_lambdas(p, t):
    assert epd.smith_lambda(llvm.Float64(p), llvm.Float64(t))[0] == pytest.approx(LAMBDA[p, t], rel=3e-7)


@pytest.mark.parametrize("number", [llvm.Float64, llvm.Float], ids=["float64", "float32"])
def test_lambdas_that_are_looked_up(number):
    """100 000 of any p and t: 64 nodes leave 5e-4, and .0012 at worst, of 1 + Lambda; beyond t = 30 see the end."""
    rng, errors = np.random.default_rng(1), []
    for p in np.exp(rng.uniform(*np.log([0.2, 5]), 20)):
        t = np.exp(rng.uniform(-9, np.log(30), 5000))
        exact = 1 + np.array(epd.smith_lambda(llvm.Float64(p), llvm.Float64(t)))
        share = np.sqrt(t / (1 + t))
        (g,) = epd.masking_table(number(p)).at(number(share))
        errors.append(np.abs((1 + t) / np.array(g) / exact - 1))
    assert np.percentile(errors, 99) < 5e-4 and np.max(errors) < 1.2e-3


@pytest.mark.parametrize("p", EXPONENTS)
def test_ends_of_lambda(p):
    """Straight down nothing is hidden; towards the horizon Lambda grows like t Gamma(3 / 2p) / (pi Gamma(1 / p))."""
    t, growth = 1e6, special.gamma(1.5 / p) / (np.pi * special.gamma(1 / p))
    assert masked(p, 1e-9)[0] == pytest.approx(1, abs=1e-7)
    # Linear from the last node but one on, where the next term, a half, is not yet.
    assert masked(p, t)[0] == pytest.approx(growth * t, rel=1e-3)


@pytest.mark.parametrize("number, tolerance", [(llvm.Float64, 1e-5), (llvm.Float, 2e-5)], ids=["float64", "float32"])
@pytest.mark.parametrize("p", EXPONENTS)
def test_draws(p, number, tolerance):
    """Squares of slopes are gamma variates to a power; two numbers a node leave 6e-6."""
    u = np.r_[np.random.default_rng(2).random(10_000), 1e-4, 0.5, 1 - 1e-5]
    u = np.array(number(u), dtype=float)
    found = np.array(Power.of(number(p)).sample(number(u)))
    np.testing.assert_allclose(found, special.gammaincinv(1 / p, u) ** (1 / p), rtol=tolerance)


@pytest.mark.parametrize("p", EXPONENTS)
def test_draws_have_their_density(p):
    """du / dx by differences: pi P22, to 1e-4."""
    u, step, power = np.linspace(0.001, 0.999, 2001), 1e-7, Power.of(llvm.Float64(p))
    x, high, low = (np.array(power.sample(llvm.Float64(u + by))) for by in (0, step, -step))
    np.testing.assert_allclose(2 * step / (high - low), np.pi * np.array(power.profile(llvm.Float64(x))), rtol=2e-4)


def test_extreme_random_numbers(any_variant):
    Float, _ = array_types("a test")
    power = Power.of(Float(0.2)).native()
    for u in (0.0, 2.0**-24, 1 - 2.0**-24):
        assert 0 < np.ravel(power.sample(mi.Float(u)))[0] < 1e10
    slope, cos = mi.Float(0.3), mi.Float(0.8)
    expected = Power.of(llvm.Float64(0.2)).smith_lambda(llvm.Float64(0.3), llvm.Float64(0.8))[0]
    assert np.ravel(power.smith_lambda(slope, cos))[0] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("p", EXPONENTS)
def test_derivatives_of_lambda(p):
    """By the exponent, through the table, at ends of its range too; none is lost at either end of t."""
    t = llvm.Float64(np.exp(np.linspace(-6, 6, 50)))
    cos = dr.rsqrt(1 + t * t)

    def total(p):
        return dr.sum(cos * (1 + Power.of(p).smith_lambda(t * cos, cos)))

    exponent, step = llvm.Float64(p), 1e-5
    dr.enable_grad(exponent)
    dr.backward(total(exponent))
    difference = (total(llvm.Float64(p + step))[0] - total(llvm.Float64(p - step))[0]) / (2 * step)
    assert dr.grad(exponent)[0] == pytest.approx(difference, rel=1e-4)


def test_derivatives_of_the_profile_are_finite():
    """Where slopes vanish, and where there are no facets."""
    for p in (0.2, 5):
        x, exponent = llvm.Float(0, 1e-30, 1, 1e20), llvm.Float(p)
        dr.enable_grad(x, exponent)
        dr.backward(dr.sum(Profile.of(exponent)(x)))
        assert np.isfinite(dr.grad(x)).all() and np.isfinite(dr.grad(exponent)).all()
