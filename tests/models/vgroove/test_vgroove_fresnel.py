"""The product of a path's Fresnel terms in closed form."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest

from asperity.models.vgroove import fresnel


@pytest.mark.parametrize("material, accuracy", [("Au", 2e-3), ("Cu", 2e-3), ("Cr", 1.1e-2), ("W", 5e-3)])
def test_closed_fresnel_product(rgb, material, accuracy):
    """Against the product term by term: wrong by the fit of ln F in each of k bounces, and by float32 (1e-3)."""
    metal = mi.load_dict({"type": "vgroove", "material": material}).model.metal
    once = metal.reflectance(dr.zeros(mi.SurfaceInteraction3f), True)
    logarithm = fresnel.fit(once)
    cosines = mi.Float(np.linspace(0, 1, 1000, dtype=np.float32))
    fitted = dr.exp(sum(a * cosines ** (n + 1) for n, a in enumerate(logarithm)))
    fit_error = np.abs(np.asarray(fitted / once(cosines)) - 1).max()
    assert fit_error < accuracy
    rng, n = np.random.default_rng(5), 5000
    for count in (2, 3, 5, 12):
        first, last = np.sort(rng.uniform(0, np.pi, (2, n)), axis=0)
        b, phi = (last - first) / 2 / (count - 1), (first + last) / 2
        exact = 1
        for j in range(1, count + 1):
            angle = phi + (2 * j - count - 1) * b
            exact = exact * np.asarray(once(mi.Float(0.9 * np.maximum(np.sin(angle), 0))))
        u, w, b = (fresnel.multiples(*dr.sincos(mi.Float(x))) for x in (phi - np.pi / 2, np.pi / 2 - count * b, b))
        cos_u = [cos for _, cos in u]
        fan = fresnel.Fan(mi.UInt32(count), mi.Bool(count % 2 == 1), fresnel.numerators(u, w), cos_u, b)
        closed = fresnel.product(fresnel.waves(logarithm, mi.Float(0.9)), fan)
        assert np.abs(np.asarray(closed) - exact).max() < count * fit_error + 1e-3


def cosines(first, last, count):
    """Sines of ``count`` angles: the first, the last, evenly spaced ones between."""
    return [np.sin(first + (last - first) * j / (count - 1)) for j in range(count)]


def test_two_bounces_by_their_mean():
    rng = np.random.default_rng(0)
    one, other = llvm.Float64(rng.random(100)), llvm.Float64(rng.random(100))
    for n, found in enumerate(fresnel.with_partner((one + other) / 2, (one - other) / 2), 1):
        np.testing.assert_allclose(found, one**n + other**n, rtol=1e-12)


@pytest.mark.parametrize("count, accuracy", [(6, 4e-3), (8, 1e-3), (12, 2e-4), (30, 1e-5)])
def test_long_paths(rgb, count, accuracy):
    """Against the sum of gold's ln F, fitted: the less bounces, the farther apart, and the coarser the rule."""
    fits = mi.load_dict({"type": "vgroove", "material": "Au"}).model.fits
    logarithm, rng, n = fits.result[0], np.random.default_rng(1), 2000
    x, y = rng.uniform(0, 0.5, (2, n))
    b, length = (np.pi - x - y) / (2 * count), 0.9
    exact = [0, 0, 0]
    for cos in cosines(x + b, np.pi - y - b, count):
        exact = [
            e + sum(float(a[c][0]) * (length * cos) ** (m + 1) for m, a in enumerate(logarithm))
            for c, e in enumerate(exact)
        ]
    ends = [dr.sincos(mi.Float(angle)) for angle in (x, y)]
    path = fresnel.Path.of(logarithm, mi.Float(length), *ends, mi.Float(np.pi - x - y))
    found = np.array(path(mi.Float(b), mi.Float(1 / b)))
    assert np.abs(found - np.exp(exact)).max() < accuracy
