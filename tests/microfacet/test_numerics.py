import asperity  # noqa: F401  isort: skip
import drjit.llvm.ad as llvm
import numpy as np
import pytest

from asperity.microfacet import numerics
from asperity.microfacet.quadrature import integrate

X = np.r_[0, 10.0 ** np.arange(-8, 0, 0.25), 0.029, 0.031, 0.9]
CASES = {
    "log1p": (numerics.log1p, np.log1p, -X, lambda x: 1 / (1 + x)),
    "one_minus_exp": (numerics.one_minus_exp, lambda x: -np.expm1(-x), 10 * X, lambda x: np.exp(-x)),
}


@pytest.mark.parametrize("ours, exact, x, slope", CASES.values(), ids=CASES)
def test_float32_value_and_gradient(ours, exact, x, slope):
    """Relative to float64, 5e-6 is some forty units in the last place: 1 + x loses that many where the series ends."""
    import drjit as dr

    argument = llvm.Float(x)
    x = np.asarray(argument, dtype=float)
    dr.enable_grad(argument)
    value = ours(argument)
    dr.backward(value)
    np.testing.assert_allclose(np.asarray(dr.detach(value)), exact(x), rtol=5e-6)
    np.testing.assert_allclose(np.asarray(dr.grad(argument)), slope(x), rtol=1e-5)


@pytest.mark.parametrize("like", [1.0, llvm.Float(1.0)], ids=["scalar", "array"])
def test_integrate_is_exact_for_polynomials(like):
    cubic, constant = integrate(lambda x: (x * x * x, 0 * x + 2), 2, like)
    assert np.allclose([np.asarray(cubic).item(), np.asarray(constant).item()], [0.25, 2], rtol=1e-6)
