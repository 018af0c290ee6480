import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
import pytest

from asperity.microfacet import numerics

X = np.r_[0, 10.0 ** np.arange(-8, 0, 0.25), 0.029, 0.031, 0.9]
CASES = {
    "log1p": (numerics.log1p, np.log1p, -X, lambda x: 1 / (1 + x)),
    "one_minus_exp": (numerics.one_minus_exp, lambda x: -np.expm1(-x), 10 * X, lambda x: np.exp(-x)),
}


@pytest.mark.parametrize("ours, exact, x, slope", CASES.values(), ids=CASES)
def test_float32_value_and_gradient(ours, exact, x, slope):
    """Relative to float64, 5e-6 is some forty units in the last place: 1 + x loses that many where the series ends."""
    argument = llvm.Float(x)
    x = np.asarray(argument, dtype=float)
    dr.enable_grad(argument)
    value = ours(argument)
    dr.backward(value)
    np.testing.assert_allclose(np.asarray(dr.detach(value)), exact(x), rtol=5e-6)
    np.testing.assert_allclose(np.asarray(dr.grad(argument)), slope(x), rtol=1e-5)


@pytest.mark.parametrize("number", [llvm.Float, llvm.Float64])
def test_the_ends_of_a_range_are_within(number):
    """An optimiser that starts at one, or was clipped to it, must be able to leave."""
    x = number(-1, 0, 0.5, 1, 2)
    dr.enable_grad(x)
    clamped = numerics.clamp(x, 0, 1)
    dr.backward(clamped)
    assert list(dr.detach(clamped)) == [0, 0, 0.5, 1, 1] and list(dr.grad(x)) == [0, 1, 1, 1, 0]
    assert numerics.clamp(1.5, 0, 1) == 1 and numerics.clamp(-0.5, 0, 1) == 0  # plain floats


def test_what_is_kept_where_it_is_finite_has_the_derivative_of_what_was_given():
    x = llvm.Float(-1, 0, 0.5, 2)
    dr.enable_grad(x)
    kept = numerics.keep(x, 0.1, 1)
    dr.backward(kept)
    assert np.allclose(dr.detach(kept), [0.1, 0.1, 0.5, 1]) and list(dr.grad(x)) == [1] * 4
    assert numerics.keep(-1.0, 0.1, 1) == 0.1


def test_a_heading_is_of_length_one_or_the_other_one():
    x, y = llvm.Float(3, 0, -1e-3, 1e-8), llvm.Float(4, 0, 0, 0)
    dr.enable_grad(x, y)
    there = numerics.heading(x, y, (0, 1))
    dr.backward(there[0] + there[1])
    assert np.allclose(dr.detach(there), [[0.6, 0, -1, 0], [0.8, 1, 0, 1]])
    assert np.isfinite(dr.grad(x)).all() and np.isfinite(dr.grad(y)).all()
    assert numerics.heading(3.0, 4.0) == pytest.approx((0.6, 0.8)) and numerics.heading(0.0, 0.0) == (1, 0)
