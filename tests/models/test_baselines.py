"""The micrograin model's competitors against the definitions that they follow from."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest

from asperity.lab import evaluate
from asperity.microfacet.ggx import smith_lambda
from asperity.models.baselines.deon import base_share, grain_share
from asperity.models.baselines.merillou import SHALLOW, lit_and_visible
from asperity.models.baselines.mixture import equivalent_roughness
from asperity.models.micrograin.grains import density, normal_in_sphere_space
from asperity.models.micrograin.shadows import GRAZING, to_sphere

N = 1 << 14
WHITE = {"type": "diffuse", "reflectance": 1.0}
FLOAT32 = 1e-5
"""Relative: a hundred roundings."""


def values(bsdf, wi, wo, component=0xFFFFFFFF):
    context = mi.BSDFContext(mi.TransportMode.Radiance, int(mi.BSDFFlags.All), component)
    return np.array(evaluate.load(bsdf).eval(context, evaluate.interaction(wi), wo))


NODES = np.polynomial.legendre.leggauss(400)


def float64(values):
    return llvm.Float64(np.asarray(values, dtype=float))


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


def lit_by_counting(a, b, n=2000):
    x = (np.arange(n) + 0.5) / n * 2 - 1
    within = [(x[:, None] - c[0]) ** 2 + (x[None, :] - c[1]) ** 2 <= 1 for c in ((0, 0), a, b)]
    return np.logical_and.reduce(within).sum() * (2 / n) ** 2 / np.pi


@pytest.mark.parametrize("vector", [llvm.Array2f, llvm.Array2f64])
def test_lit_and_visible_part_of_a_pore_is_what_points_count(vector):
    """2000² points: the outline crosses 10^4 cells at most; if each errs by half at random, that is 1.6e-5 of pi."""
    rng = np.random.default_rng(2)
    pairs = [scale * rng.normal(size=(2, 2)) for scale in (0.1, 0.4, 0.7, 1.0, 3.0) for _ in range(6)]
    a, b = np.array([0.4, -0.7]), np.array([0.9, 0.0])
    pairs += [(a, a), (0 * a, a), (0 * a, 0 * a), (a, -a), (a, 1.2 * a), (b, -b), (2.47 * a, a), (a, a + 1e-7)]
    for i, o in pairs:
        one, other = (vector(*map(float, w)) for w in (i, o))
        area = lit_and_visible(one, other)[0]
        assert area == pytest.approx(lit_by_counting(i, o), abs=6e-5)
        assert area == pytest.approx(lit_and_visible(other, one)[0], abs=1e-6)


@pytest.mark.parametrize("slopes", [0.0, 0.3, 5.0, 400.0])
@pytest.mark.parametrize("tau_0", [1e-6, 0.01, 0.3, 0.97])
def test_shares_are_integrals_over_heights(tau_0, slopes):
    """Quantiles u above 1 - tau_0 belong to grains; what blocks the base's light is above w = 1 - tau_0."""
    nodes, weights = NODES
    u = 1 - tau_0 * (1 - nodes) / 2
    grains, base = (weights * u**slopes).sum() / 2 * tau_0, (1 - tau_0) ** (1 + slopes)
    for number in (llvm.Float, llvm.Float64):
        depth = dr.pi * density(number(tau_0))
        # exp(-depth slopes) amplifies the rounding of depth
        tolerance = FLOAT32 * (1 + slopes * -np.log1p(-tau_0))
        assert grain_share(depth, number(slopes))[0] == pytest.approx(grains, rel=tolerance)
        assert base_share(depth, number(slopes))[0] == pytest.approx(base, rel=tolerance, abs=1e-37)


@pytest.mark.parametrize("tau_0", [0.0, 1e-5, 0.4, 1.0])
def test_grains_and_base_are_all_that_is_seen(tau_0):
    """d'Eon's shares, along one direction and without masking among the grains, sum to 1."""
    depth, slopes = dr.pi * density(llvm.Float(tau_0)), llvm.Float(0, 0.5, 30, 500)
    seen = (1 + slopes) * grain_share(depth, slopes) + base_share(depth, slopes)
    assert np.allclose(seen, 1, atol=1e-6)


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


def test_shallow_pores_hide_nothing(rgb):
    wi, wo = (evaluate.uniform_hemisphere(N, seed) for seed in (3, 4))
    pores = {"type": "merillou", "tau_0": 0.4, "base": WHITE}
    shallow = values({**pores, "depth": 0.0}, wi, wo, component=1)
    # Depth 0 stands for SHALLOW: discs apart by d have 1 - 2 d / pi in common. Directions are lifted to the cosine
    # GRAZING alpha, with an alpha of .88 here.
    hidden = 2 / np.pi * SHALLOW * sum(1 / np.maximum(np.array(w.z), 0.88 * GRAZING) for w in (wi, wo))
    flat = 0.6 * values(WHITE, wi, wo)
    assert (np.abs(shallow - flat) <= (hidden + FLOAT32) * flat + 1e-6).all()


def test_deep_pores_hide_all(rgb):
    wi, wo = (evaluate.uniform_hemisphere(N, seed) for seed in (3, 4))
    deep = values({"type": "merillou", "tau_0": 0.4, "depth": 1000.0, "base": WHITE}, wi, wo, component=1)
    assert not deep[:, np.array(wi.z) < 0.999].any()


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
