import asperity  # noqa: F401  isort: skip
from dataclasses import dataclass
from typing import Any

import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
import pytest

from asperity.microfacet.quadrature import RULES, accumulate, gauss_legendre, integrate


@dataclass
class Power:
    """What a model captures: arrays in a dataclass."""

    scale: Any

    def __call__(self, x):
        return self.scale * x * x


@pytest.mark.parametrize("like", [1.0, llvm.Float(1.0), llvm.Float64(1.0)], ids=["float", "float32", "float64"])
@pytest.mark.parametrize("nested", [False, True])
def test_integrate_is_exact_for_polynomials(like, nested):
    found = integrate(lambda x, power: (x * power(x), 0 * x + 2), 4, Power(3 * like), like, nested)
    assert [np.asarray(value).item() for value in found] == pytest.approx([0.75, 2], rel=1e-6)


@pytest.mark.parametrize("nested", [False, True], ids=["loop", "copies"])
@pytest.mark.parametrize("forward", [True, False], ids=["forward", "backward"])
def test_the_derivative_of_an_integral_is_that_of_its_terms(nested, forward):
    """d/da int a^2 x^2 dx = 2 a / 3: what is captured in a tuple of dataclasses, and twice, carries it."""
    a = llvm.Float(1, 2, 3)
    dr.enable_grad(a)
    (value,) = integrate(lambda x, c: (c[0](x) * c[1],), 4, (Power(a), a), dr.detach(a), nested)
    (dr.forward if forward else dr.backward)(a if forward else value)
    np.testing.assert_allclose(dr.grad(value if forward else a), 2 * np.array([1, 2, 3]) / 3, rtol=1e-6)


@pytest.mark.parametrize("forward", [True, False], ids=["forward", "backward"])
def test_accumulate_sums_from_its_start(forward):
    a, start = llvm.Float(0.5, 2), llvm.Float(7, 9)
    dr.enable_grad(a, start)
    (total,) = accumulate(lambda n, a: (a * a * llvm.Float(n),), llvm.UInt(4), (start,), a)  # 7 + (0 + 1 + 2 + 3) a^2
    np.testing.assert_allclose(dr.detach(total), [7 + 6 / 4, 9 + 24])
    if forward:
        dr.forward(a)
        np.testing.assert_allclose(dr.grad(total), [6, 24])
    else:
        dr.backward(total)
        np.testing.assert_allclose(dr.grad(a), [6, 24])
        np.testing.assert_allclose(dr.grad(start), [1, 1])


@pytest.mark.parametrize("n", RULES)
def test_rules_are_gausss(n):
    """Exact up to degree 2 n - 1."""
    x, w = map(np.array, gauss_legendre(n))
    assert (w * x ** (2 * n - 1)).sum() == pytest.approx(1 / (2 * n), rel=1e-12)
