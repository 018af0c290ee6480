"""The conductor's Fresnel term against its complex formula, over the whole range that the parameters allow."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest

from asperity.conductors import ETA, Conductor, K, materials
from asperity.microfacet.fresnel import ALLOWED, FittedMetal, Metal, conductor, fitted


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


GLASSY = {"AlSb", "MgO", "SnTe", "ThF4"}
"""Without absorption at some colour, and of a small index there, or with a critical angle."""


def test_metals_are_fitted(rgb):
    """All that Mitsuba has, at all cosines; float32 rounds by another 1e-5 where roots cancel."""
    cos, exact_ones = mi.Float(np.linspace(0, 1, 100_001)), set()
    for name in set(materials()) - {"none"}:
        metal = Conductor("").at(Conductor("", name).parse(mi.Properties("vgroove")).updated(), None, True)
        if not isinstance(metal, FittedMetal):
            exact_ones.add(name.removesuffix("_palik"))
            continue
        exact = np.array(Metal(metal.eta, metal.k)(cos), dtype=float)
        found = np.array(metal(cos), dtype=float)
        assert np.abs(found / exact - 1).max() < ALLOWED + 1e-5 and found.min() > 0 and found.max() < 1 + 2**-22, name
    assert exact_ones == GLASSY


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb", "llvm_ad_mono"])
def test_a_fit_is_a_metal_in_every_variant(variant):
    mi.set_variant(variant)
    spectrum = type(mi.unpolarized_spectrum(mi.Spectrum(0)))
    metal = Metal(spectrum(0.2), spectrum(3.5))
    fit = fitted(metal)
    assert isinstance(fit, FittedMetal)
    np.testing.assert_allclose(fit(mi.Float(0.4)), metal(mi.Float(0.4)), rtol=1e-5)
    np.testing.assert_allclose(fit.mixed(metal, 0.3)(mi.Float(0.4)), metal(mi.Float(0.4)), rtol=1e-5)


@pytest.mark.parametrize("index", [(40_000, 1e-3), (20_000, 20_000), (5, 5), (1e-3, 100)], ids=str)
def test_fits_of_large_indices_do_not_overflow(index):
    """As `artist_friendly` makes them of white; F is that near 1 that float32 rounds it by as much as its error."""
    metal, cos = Metal(*map(llvm.Array3f, index)), llvm.Float(np.linspace(0, 1, 10_001))
    assert isinstance(fitted(metal), FittedMetal)
    np.testing.assert_allclose(fitted(metal)(cos), metal(cos), rtol=5e-6)


def test_glass_is_not_fitted():
    """Total reflection begins with a kink."""
    glass = Metal(llvm.Array3f(0.5), llvm.Array3f(0))
    assert fitted(glass) is glass
