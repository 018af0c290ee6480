"""What the micrograin model's competitors have in common: rough metal, and a base that shows its share."""

import asperity  # noqa: F401  isort: skip
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest
from helpers import float64, values

from asperity.lab import evaluate
from asperity.microfacet.ggx import normal_in_sphere_space, smith_lambda, to_sphere
from asperity.models.baselines.mixture import equivalent_roughness
from asperity.models.micrograin.grains import density

N = 1 << 14
WHITE = {"type": "diffuse", "reflectance": 1.0}
FLOAT32 = 1e-5
"""Relative: a hundred roundings."""


def test_lambda_follows_from_the_normals():
    """cos (1 + Lambda) = int D (w.m)+ dm. The midpoint rule with 1000² polar angles is that good."""
    alpha_x, alpha_y, n = 0.3, 0.8, 1000
    theta, phi = np.meshgrid((np.arange(n) + 0.5) / n * np.pi / 2, (np.arange(n) + 0.5) / n * 2 * np.pi)
    m = np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)]).reshape(3, -1)
    _, ndf = normal_in_sphere_space(llvm.Array3f64(m), alpha_x, alpha_y)
    ndf = np.array(ndf) * np.sin(theta).ravel() * (np.pi / 2 / n) * (2 * np.pi / n)
    for angle, azimuth in ((0, 0), (0.6, 1.0), (1.2, 2.5), (1.5, 0.3)):
        w = np.array([np.sin(angle) * np.cos(azimuth), np.sin(angle) * np.sin(azimuth), np.cos(angle)])
        measured = (ndf * np.maximum(w @ m, 0)).sum() / w[2]
        expected = 1 + smith_lambda(to_sphere(llvm.Array3f64(*map(float, w)), alpha_x, alpha_y))[0]
        assert measured == pytest.approx(expected, rel=1e-5)


def test_equivalent_roughness_matches_the_grains_at_the_normal():
    """tau_0 D(n) of Lucas 2024, Eq. 12 is r / beta^2; that of GGX, tau_0 / (pi alpha^2)."""
    tau_0, beta = float64([0.01, 0.3, 0.8, 0.99]), 0.7
    alpha = equivalent_roughness(tau_0, beta)
    # below 0.03, log1p is a series good to float32
    assert np.allclose(tau_0 / (np.pi * alpha * alpha), density(tau_0) / beta**2, rtol=1e-6)


@pytest.mark.parametrize("tau_0, relative", [(0.0, 1.0), (1e-8, 1.0), (1.0, 0.269)])
def test_equivalent_roughness_has_limits(tau_0, relative):
    for number in (llvm.Float, llvm.Float64):
        assert equivalent_roughness(number(tau_0), 2.0)[0] == pytest.approx(2 * relative, rel=1e-3)


@pytest.mark.parametrize("model, tau_0", [("merillou", 0.3), ("merillou", 1.0), ("deon", 1.0)])
def test_metal_is_that_of_roughconductor_with_correlated_heights(rgb, model, tau_0):
    """Mitsuba's masking-shadowing is separable, G1 G1. tau_0 = 1 stands for 1 - 1e-6 in d'Eon's."""
    wi, wo = (evaluate.uniform_hemisphere(N, seed) for seed in (1, 2))
    beta_x, beta_y = 0.5, 1.2
    alphas = [float(equivalent_roughness(mi.Float(tau_0), beta)[0]) for beta in (beta_x, beta_y)]
    names = {"material": "Au", "alpha_u": alphas[0], "alpha_v": alphas[1]}
    plain = values({"type": "roughconductor", "distribution": "ggx", **names}, wi, wo)
    i, o = (np.array(smith_lambda(to_sphere(w, *alphas))) for w in (wi, wo))
    ours = values({"type": model, "material": "Au", "tau_0": tau_0, "beta_x": beta_x, "beta_y": beta_y}, wi, wo)
    expected = plain * tau_0 * (1 + i) * (1 + o) / (1 + i + o)
    # below GRAZING, directions are lifted
    high = (np.array(wi.z) > 0.01) & (np.array(wo.z) > 0.01)
    assert np.allclose(ours[:, high], expected[:, high], rtol=1e-3, atol=1e-5)


@pytest.mark.parametrize("model", ["merillou", "deon"])
def test_all_are_alike_at_normal_incidence(rgb, model):
    """What Eq. 28 is for: tau_0 D(n) F / 4."""
    n, bsdf = mi.Vector3f(0, 0, 1), {"material": "Au", "tau_0": 0.6, "beta": 0.8, "base": WHITE}
    assert np.allclose(
        values({"type": model, **bsdf}, n, n), values({"type": "micrograin", **bsdf}, n, n), rtol=FLOAT32
    )


@pytest.mark.parametrize("tau_0", [0.0, 0.1, 0.8, 1.0])
@pytest.mark.parametrize("model", ["merillou", "deon"])
def test_base_shows_its_share_at_normal_incidence(rgb, model, tau_0):
    n = mi.Vector3f(0, 0, 1)
    base = values({"type": model, "tau_0": tau_0, "base": WHITE}, n, n, component=1)
    assert np.allclose(base, (1 - tau_0) / np.pi, atol=1e-6)


@pytest.mark.parametrize("model", ["merillou", "deon"])
def test_components_add_up(rgb, model):
    wi, wo = (evaluate.uniform_hemisphere(N, seed) for seed in (5, 6))
    bsdf = {"type": model, "beta": 0.5, "base": WHITE}
    parts = sum(values(bsdf, wi, wo, component) for component in (0, 1))
    assert np.allclose(values(bsdf, wi, wo), parts, rtol=FLOAT32, atol=1e-6)


@pytest.mark.parametrize("base", ["conductor", "dielectric", "roughdielectric", "plastic", "mask"])
@pytest.mark.parametrize("model", ["merillou", "deon"])
def test_mirrors_and_glass_are_refused_as_a_base(rgb, model, base):
    nested = {"bsdf": {"type": "diffuse"}} if base == "mask" else {}
    with pytest.raises(RuntimeError, match=r"base = .*expected an opaque BSDF"):
        mi.load_dict({"type": model, "base": {"type": base, **nested}})
