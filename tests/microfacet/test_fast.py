"""Fast elementary functions against NumPy's in double precision: over their whole range, at their ends, and slopes."""

import drjit as dr
import numpy as np
import pytest
from drjit.llvm import ad as llvm

from asperity.microfacet import fast

N = 1_000_001


def found(function, x):
    """(value, slope) in float32, as float64."""
    x = llvm.Float(x)
    dr.enable_grad(x)
    value = function(x)
    dr.forward(x)
    slope = dr.grad(value)
    return np.array(dr.detach(value), dtype=float), np.array(slope, dtype=float)


@pytest.mark.parametrize(("part", "function", "slope"), [(0, np.sin, np.cos), (1, np.cos, lambda x: -np.sin(x))])
def test_sincos(part, function, slope):
    x = np.linspace(-3.5, 3.5, N, dtype=np.float32)
    value, derivative = found(lambda x: fast.sincos(x)[part], x)
    x = x.astype(float)
    assert np.abs(value - function(x)).max() < 8e-7
    assert np.abs(derivative - slope(x)).max() < 5e-6


def test_sine_near_zero_keeps_its_digits():
    x = np.geomspace(1e-20, 1, N, dtype=np.float32)
    assert np.abs(found(lambda x: fast.sincos(x)[0], x)[0] / np.sin(x.astype(float)) - 1).max() < 5e-7


def test_angles():
    x = np.concatenate([np.linspace(0, np.pi, N), np.geomspace(1e-10, 1, N)])
    cos, sin = np.cos(x).astype(np.float32), np.maximum(np.sin(x), 0).astype(np.float32)
    exact = np.arctan2(sin.astype(float), cos.astype(float))
    alone, beside = (fast.angles(*points)[-1].numpy() for points in _once_and_beside(llvm.Float(cos), llvm.Float(sin)))
    assert np.abs(alone - exact).max() < 6e-7
    assert np.abs(alone / np.maximum(exact, 1e-30) - 1)[exact > 0].max() < 4e-7
    np.testing.assert_allclose(beside, alone, rtol=1e-6)


def test_angle():
    x = np.concatenate([np.linspace(0, np.pi, N), np.geomspace(1e-10, 1, N)])
    cos, sin = np.cos(x).astype(np.float32), np.maximum(np.sin(x), 0).astype(np.float32)
    exact = np.arctan2(sin.astype(float), cos.astype(float))
    found = fast.angle(llvm.Float(cos), llvm.Float(sin)).numpy()
    acute = fast.acute_angle(llvm.Float(cos), llvm.Float(sin)).numpy()
    assert np.abs(found / np.maximum(exact, 1e-30) - 1)[exact > 0].max() < 4e-7
    np.testing.assert_array_equal(acute[cos >= 0], found[cos >= 0])
    _, slope = fast_slope(np.linspace(1e-3, np.pi - 1e-3, N, dtype=np.float32))
    assert np.abs(slope - 1).max() < 5e-5


def fast_slope(x):
    return found(lambda x: fast.angle(dr.cos(x), dr.sin(x)), x)


def _once_and_beside(cos, sin):
    return [(cos, sin)], [(llvm.Float(0.6), llvm.Float(0.8)), (cos, sin)]


def test_angles_have_the_slope_of_angles():
    x = np.linspace(1e-3, np.pi - 1e-3, N, dtype=np.float32)
    _, slope = found(lambda x: fast.angles((dr.cos(x), dr.sin(x)))[0], x)
    assert np.abs(slope - 1).max() < 5e-5


def test_the_arc_tangent_is_the_best_of_its_degree():
    """By least squares, weighted again and again until the error is the same everywhere."""
    t = (np.cos(np.pi * (np.arange(400) + 0.5) / 400) + 1) / 2
    exact, weight = 2 * np.arctan(np.sqrt(t)) / np.sqrt(t), np.ones(400)
    powers = t[:, None] ** np.arange(len(fast.TWICE_ARC_TANGENT))
    for _ in range(200):
        fit = np.linalg.lstsq(powers * weight[:, None], exact * weight, rcond=None)[0]
        error = np.abs(powers @ fit / exact - 1)
        weight = weight * (error / error.max() + 0.02) ** 0.3
    np.testing.assert_allclose(fast.TWICE_ARC_TANGENT, fit, rtol=1e-3)
    assert np.abs(powers @ fast.TWICE_ARC_TANGENT / exact - 1).max() < 1.1e-7


def test_exponential():
    x = -np.concatenate([np.linspace(0, 100, N), [1e10, 1e38, np.inf]]).astype(np.float32)
    value, slope = found(fast.exp_of_negative, x)
    exact = np.exp(x.astype(float))
    assert np.abs(value - exact).max() < 2e-6
    assert np.abs(slope - exact).max() < 2e-5
    np.testing.assert_allclose(value[x > -3], exact[x > -3], rtol=4e-6)


@pytest.mark.parametrize("most, tolerance", [(1.5, 3e-6), (2.5, 1.6e-5)])
def test_exponential_of_moderate_numbers(most, tolerance):
    """Left out is 16 (x / 16)^5 / 5!, 1e-6 at 1.5, 1.2e-5 at 2.5; four squarings make 2e-6 of rounding."""
    x = np.linspace(-most, most, N, dtype=np.float32)
    value, slope = found(fast.exp_of_moderate, x)
    exact = np.exp(x.astype(float))
    np.testing.assert_allclose(value, exact, rtol=tolerance)
    np.testing.assert_allclose(slope, exact, rtol=4 * tolerance)


@pytest.mark.parametrize("count", [1, 2, 5])
def test_reciprocals(count):
    x = 10 ** np.random.default_rng(count).uniform(-6, 6, (count, N))
    inverse = fast.reciprocals(*map(llvm.Float, x))
    for one, exact in zip(inverse, 1 / x):
        np.testing.assert_allclose(one.numpy(), exact, rtol=1e-6)


def test_lesser_and_greater_drop_what_is_not_a_number():
    nan = llvm.Float(np.nan)
    assert [f(a, b).numpy()[0] for f in (fast.lesser, fast.greater) for a, b in [(1, llvm.Float(2)), (nan, 3)]] == [
        1, 3, 2, 3,
    ]  # fmt: skip


@pytest.mark.parametrize(("part", "function", "slope"), [(0, np.sin, np.cos), (1, np.cos, lambda x: -np.sin(x))])
def test_acute_sincos(part, function, slope):
    x = np.concatenate([np.linspace(0, 1.1, N), np.geomspace(1e-20, 1, N)]).astype(np.float32)
    value, derivative = found(lambda x: fast.acute_sincos(x)[part], x)
    x = x.astype(float)
    assert np.abs(value / function(x) - 1)[x > 0].max() < 4e-7
    assert np.abs(derivative - slope(x)).max() < 1e-6
