"""The product of a path's Fresnel terms in closed form."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
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
