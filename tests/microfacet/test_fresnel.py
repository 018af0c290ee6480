"""The conductor's Fresnel term against its complex formula, over the whole range that the parameters allow."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import numpy as np
import pytest

from asperity.conductors import ETA, K
from asperity.microfacet.fresnel import conductor


def cases(n=100_000):
    """Cosine, eta, k, as float32: normal, grazing, total reflection (k = 0), no interface (eta = 1) among them."""
    rng = np.random.default_rng(0)
    cos, eta = rng.random(n), 10 ** rng.uniform(np.log10(ETA.low), np.log10(ETA.high), n)
    k = 10 ** rng.uniform(-4, np.log10(K.high), n)
    cos[::7], cos[::11], cos[1::13] = 1, 0, 10 ** rng.uniform(-6, 0, cos[1::13].size)
    eta[5::17], eta[6::17], eta[7::17], k[::10], k[1::10] = 1, ETA.low, ETA.high, 0, K.high
    return (x.astype(np.float32).astype(float) for x in (cos, eta, k))


def exact(cos, eta, k):
    cos, index = np.maximum(cos, 1e-30), eta + 1j * k  # 0/0 without an interface
    root = np.sqrt(index**2 - (1 - cos * cos) + 0j)
    perpendicular, parallel = (cos - root) / (cos + root), (index**2 * cos - root) / (index**2 * cos + root)
    return (np.abs(perpendicular) ** 2 + np.abs(parallel) ** 2) / 2


def test_conductor_is_the_complex_formula():
    """float32 rounds sin^2 by 6e-8; where that is all there is of a root, 2.5e-4. In double, TINY^(1/4) = 1e-6."""
    cos, eta, k = cases()
    ours = np.array(conductor(*map(llvm.Float, (cos, eta, k))), dtype=float)
    assert (ours >= 0).all() and (ours <= 1 + 2**-22).all()
    error = np.abs(ours - exact(cos, eta, k))
    assert error.max() < 2.5e-4 and np.quantile(error, 0.999) < 1e-6
    double = np.array(conductor(*map(llvm.Float64, (cos, eta, k))))
    assert np.abs(double - exact(cos, eta, k)).max() < 1e-6


def test_derivatives_are_finite_and_alive_without_absorption():
    arguments = [llvm.Float(x) for x in cases()]
    dr.enable_grad(*arguments)
    dr.backward(dr.sum(conductor(*arguments)))
    assert all(np.isfinite(np.array(dr.grad(x))).all() for x in arguments)
    # Total reflection (sin > eta): 1 - 2 c k is what absorption leaves, so the derivative at k = 0 is not 0.
    k = llvm.Float64(0)
    dr.enable_grad(k)
    dr.backward(conductor(llvm.Float64(0.3), llvm.Float64(0.5), k))
    slope = (exact(0.3, 0.5, 1e-6) - exact(0.3, 0.5, 0)) / 1e-6
    assert dr.grad(k)[0] == pytest.approx(slope, rel=1e-3) and slope < -0.1
