"""Oren-Nayar against its definition."""

import asperity  # noqa: F401  isort: skip
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest

from asperity.lab import evaluate
from asperity.models.baselines import orennayar

N = 1 << 18
FLOAT32 = 1e-5
"""Relative: a hundred roundings."""


@pytest.mark.parametrize("variant", ["full", "qualitative"])
def test_smooth_is_lambertian(rgb, variant):
    wi, wo = (evaluate.uniform_hemisphere(N, seed) for seed in (6, 7))
    ours, lambert = (
        np.array(mi.load_dict(bsdf).eval(mi.BSDFContext(), evaluate.interaction(wi), wo))
        for bsdf in (
            {"type": "orennayar", "sigma": 0.0, "variant": variant, "reflectance": 0.6},
            {"type": "diffuse", "reflectance": 0.6},
        )
    )
    assert np.allclose(ours, lambert, rtol=FLOAT32, atol=1e-7)


def test_full_differs_from_qualitative_by_the_second_bounce(rgb):
    """Where light comes from the normal, and at retro-reflection, C3 is idle: what is left is L2."""
    variance, albedo = mi.Float(0.2), mi.Float(0.8)
    wo = mi.Vector3f(0.6, 0, 0.8)
    for wi, turned in ((mi.Vector3f(0, 0, 1), 0.0), (wo, 1.0)):
        beta = 2 / np.pi * np.arccos(0.8) * turned
        twice = 0.17 * 0.8**2 / np.pi * 0.2 / (0.2 + 0.13) * (1 - beta**2)
        once = orennayar.qualitative(wi, wo, variance, albedo)[0]
        assert orennayar.full(wi, wo, variance, albedo)[0] == pytest.approx(once + twice, rel=FLOAT32)


def test_full_is_the_formula_with_angles(rgb):
    """Written again with the angles of the paper, at random pairs."""
    rng = np.random.default_rng(8)
    theta, phi, sigma, rho = rng.random((2, 500)) * 1.5, rng.random(500) * np.pi, 0.5, 0.7
    alpha, beta = theta.max(axis=0), theta.min(axis=0)
    k = sigma**2 / (sigma**2 + 0.09)
    c2 = 0.45 * k * np.where(np.cos(phi) >= 0, np.sin(alpha), np.sin(alpha) - (2 * beta / np.pi) ** 3)
    c3 = 0.125 * k * (4 * alpha * beta / np.pi**2) ** 2
    once = 1 - 0.5 * sigma**2 / (sigma**2 + 0.33) + np.cos(phi) * c2 * np.tan(beta)
    once = once + (1 - np.abs(np.cos(phi))) * c3 * np.tan((alpha + beta) / 2)
    twice = 0.17 * sigma**2 / (sigma**2 + 0.13) * (1 - np.cos(phi) * (2 * beta / np.pi) ** 2)
    expected = rho / np.pi * once + rho**2 / np.pi * twice
    vectors = [
        llvm.Array3f64(np.stack([np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)]))
        for t, p in ((theta[0], 0 * phi), (theta[1], phi))
    ]
    assert np.allclose(np.array(orennayar.full(*vectors, sigma**2, rho)), expected, rtol=1e-9)
