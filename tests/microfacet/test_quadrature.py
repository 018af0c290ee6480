import asperity  # noqa: F401  isort: skip
from dataclasses import dataclass
from typing import Any

import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
import pytest
from helpers import directions

from asperity.microfacet.distributions import GGX, Beckmann, Gaussian, Phong
from asperity.microfacet.masking import cavity_visible, cavity_visible_and_lit
from asperity.microfacet.quadrature import (
    RULES,
    Lanes,
    accumulate,
    by_grazing,
    gauss_legendre,
    integrate,
    over_normals,
)


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


def test_nodes_side_by_side():
    """int a x^2 dx + int 3 a x dx, in two parts, for three numbers at once; with derivatives."""
    a = llvm.Float64(1, 2, 3)
    dr.enable_grad(a)
    lanes = Lanes(a, 4, 2)
    found = lanes.sum(lanes.repeat(a) * lanes.pick([lanes.node, 3]) * lanes.node)
    np.testing.assert_allclose(found, np.array([1, 2, 3]) * (1 / 3 + 3 / 2))
    dr.backward(found)
    np.testing.assert_allclose(dr.grad(a), 1 / 3 + 3 / 2)


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


@pytest.mark.parametrize("n", [n for n in RULES if isinstance(n, int)])
def test_rules_are_gausss(n):
    """Exact up to degree 2 n - 1."""
    x, w = map(np.array, gauss_legendre(n))
    assert (w * x ** (2 * n - 1)).sum() == pytest.approx(1 / (2 * n), rel=1e-12)


def seen(m, w):
    """Of a facet, over its share of the ground."""
    return (dr.maximum(dr.dot(m, w), 0),)


@pytest.mark.parametrize("rings, azimuths, worst", [(8, 8, 1.5e-3), (16, 12, 2.5e-4), (32, 32, 4e-5)])
@pytest.mark.parametrize("alphas", [(0.3, 0.3), (0.8, 0.1)], ids=str)
@pytest.mark.parametrize("kind", [GGX, Beckmann])
def test_normals_project_to_what_is_seen(kind, alphas, rings, azimuths, worst):
    """(1 + Lambda) cos, by Smith's condition: as good as measured, but for a third."""
    w, distribution = llvm.Array3f64(directions(np.random.default_rng(1), 2000, lowest=0.05)), kind(*alphas)
    (total,) = over_normals(seen, distribution, w, w, rings, azimuths)
    error = np.array(total / ((1 + distribution.smith_lambda(w)) * w.z) - 1)
    assert np.abs(error).max() < worst


@pytest.mark.parametrize("alphas", [(0.3, 0.3), (0.8, 0.1)], ids=str)
@pytest.mark.parametrize("kind", [GGX, Beckmann, Gaussian, Phong])
def test_cavities_are_seen_by_their_openings(kind, alphas):
    """Whose cosine is cos: all of a ring is found that faces w, of rings that are no ellipses too; to .05 %."""
    w = llvm.Array3f64(directions(np.random.default_rng(2), 2000, lowest=0.05))
    (total,) = over_normals(lambda m, w: (cavity_visible(dr.dot(m, w), w.z, 1),), kind(*alphas), w, w, 32, 32)
    np.testing.assert_allclose(total, w.z, rtol=5e-4)


def test_few_nodes_are_reciprocal_and_know_no_azimuth():
    """From the more grazing direction, in float64: in the mirror direction, where both are, too."""
    i, o = (directions(np.random.default_rng(n), 200) for n in (3, 4))
    o[:, :50] = i[:, :50] * [[-1], [-1], [1]]

    def lit(i, o, turn=0.0):
        turned = [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
        i, o = (llvm.Array3f64(turned @ w) for w in (i, o))

        def term(m, pair):
            i, o = pair
            return (cavity_visible_and_lit(dr.dot(i, m), dr.dot(o, m), i.z, o.z, 1),)

        normals = GGX(0.5, 0.5)
        return np.array(over_normals(term, normals, by_grazing(normals, i, o)[0], (i, o), 4, 8)[0])

    np.testing.assert_allclose(lit(o, i), lit(i, o), rtol=1e-11)
    np.testing.assert_allclose(lit(i, o, turn=1.0), lit(i, o), rtol=1e-11)


@pytest.mark.parametrize("forward", [True, False], ids=["forward", "backward"])
def test_integrals_over_normals_have_derivatives(forward):
    """By the roughness and by what is captured, against differences of plain floats.

    Forward from one of them alone: Dr.Jit 1.5 refuses if the other, which a loop takes too, may have derivatives.
    """
    alpha, scale, w = 0.4, 1.5, dr.normalize(dr.scalar.Array3f64(0.6, 0.3, 0.5))

    def term(m, captured):
        return (captured[0] * seen(m, captured[1])[0] ** 2,)

    def total(alpha, scale, w):
        return over_normals(term, Beckmann(alpha, 0.2), w, (scale, w), 4, 8)[0]

    def slope(f):
        return (f(1e-5) - f(-1e-5)) / 2e-5

    expected = [slope(lambda d: total(alpha + d, scale, w)), slope(lambda d: total(alpha, scale + d, w))]
    parameters = llvm.Float64(alpha), llvm.Float64(scale)
    dr.enable_grad(*parameters[: 1 if forward else 2])
    value = total(*parameters, llvm.Array3f64(w))
    assert value[0] == pytest.approx(total(alpha, scale, w), rel=1e-12)
    if forward:
        dr.forward(parameters[0])
        assert dr.grad(value)[0] == pytest.approx(expected[0], rel=1e-7)
    else:
        dr.backward(value)
        assert [dr.grad(x)[0] for x in parameters] == pytest.approx(expected, rel=1e-7)
