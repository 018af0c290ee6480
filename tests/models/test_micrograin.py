"""The micrograin model against exact identities, and against numbers traced through explicit grains.

The traced numbers come from ray-traced Poisson half-ellipsoids, periodic tiles of 2 to 4 10^5 grains. A tile's own
randomness moves an albedo by up to 0.003; issue 3's goniophotometer will replace these constants.
"""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import drjit.scalar as scalar
import mitsuba as mi
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from asperity.models.micrograin import diffuse
from asperity.models.micrograin.diffuse import lambertian
from asperity.models.micrograin.grains import (
    density,
    exposure,
    normal_in_sphere_space,
    sample_visible_normal,
    visible_fraction,
)
from asperity.models.micrograin.shadows import Shadows, shadow, to_sphere

N = 1 << 17
WHITE = {"type": "diffuse", "reflectance": 1.0}
GRAINS = [(0.37, 1.0, 1.0), (0.62, 0.8, 1.7), (0.2, 2.5, 0.6), (0.85, 0.35, 0.35), (0.05, 0.3, 3.0)]


def directions(rng, n, lowest=0.01):
    z, azimuth = rng.uniform(lowest, 1, n), rng.uniform(0, 2 * np.pi, n)
    sin = np.sqrt(1 - z * z)
    return np.stack([sin * np.cos(azimuth), sin * np.sin(azimuth), z])


def unit(w):
    return w / np.linalg.norm(w, axis=0)


def families(rng, n):
    """Pairs of directions, most of them awkward; unit vectors after rounding to float32."""
    i = directions(rng, n)
    o = directions(rng, n)
    upright = np.array([[0], [0], [1]]) + 0 * i
    pairs = {
        "random": (i, o),
        "same": (i, i),
        "opposite": (i, i * np.array([[-1], [-1], [1]])),
        "o upright": (i, upright),
        "both upright": (upright, upright),
        **{f"apart by {d:g}": (i, unit(i + d * rng.normal(size=i.shape))) for d in (1e-1, 1e-2, 1e-3, 1e-4, 1e-6)},
        "apart in z alone": (i, i + np.array([[0], [0], [3e-7]])),
    }
    return {name: tuple(np.float32(w).astype(float) for w in pair) for name, pair in pairs.items()}


def area_by_counting(i, o, h, n=1500):
    """Area of the union of the shadows, by ray casting from a grid on the plane: the definition, not the formula.

    A point outside the disc is shaded along w if the ray from it in direction w hits the unit sphere.
    """
    half = 1 + max(abs(np.r_[i[:2] / i[2], o[:2] / o[2]]))
    x = (np.arange(n) + 0.5) / n * 2 * half - half
    p = np.stack(np.broadcast_arrays(x[:, None], x[None, :], h))
    free = (p * p).sum(0) > 1
    shaded = np.zeros_like(free)
    for w in (i, o):
        along = -np.tensordot(w, p, 1)  # distance to the closest approach
        shaded |= (along > 0) & ((p * p).sum(0) - along**2 < 1)
    return (free & shaded).sum() * (2 * half / n) ** 2


def test_union_of_shadows_is_what_rays_see():
    """1500² points resolve an area to about its outline times a cell's width over the root of the cells it crosses."""
    rng = np.random.default_rng(3)
    for i, o, h in zip(directions(rng, 12, 0.3).T, directions(rng, 12, 0.3).T, rng.uniform(0, 0.9, 12)):
        union = Shadows(llvm.Array3f64(*map(float, i)), llvm.Array3f64(*map(float, o))).union(llvm.Float64(h))
        assert float(union[0]) == pytest.approx(area_by_counting(i, o, h), abs=0.01)


def directions_of_floats():
    """Unit vectors above the horizon, as plain floats in double precision."""
    angles = st.tuples(st.floats(0, 1.55), st.floats(-3.2, 3.2))
    return angles.map(lambda a: np.array([np.sin(a[0]) * np.cos(a[1]), np.sin(a[0]) * np.sin(a[1]), np.cos(a[0])]))


@given(i=directions_of_floats(), o=directions_of_floats(), h=st.floats(0, 1))
def test_a_union_is_between_the_larger_shadow_and_the_sum(i, o, h):
    """On plain floats: the formulas ask for no array type."""
    i, o = (scalar.Array3f64(*map(float, w)) for w in (i, o))
    sigma_i, sigma_o, union = shadow(i, h), shadow(o, h), Shadows(i, o).union(h)
    rounding = 1e-6 * (1 + sigma_i + sigma_o)
    assert max(sigma_i, sigma_o) - rounding <= union <= sigma_i + sigma_o + rounding


@pytest.mark.parametrize("family", families(np.random.default_rng(0), 2))
@pytest.mark.parametrize("height", ["random", 0.0, 1.0])
def test_float32_masking_and_its_gradients(family, height):
    """Measured at most 6e-5 (pairs 1e-3 apart, at cosines of 0.01); gradients finite everywhere."""
    rng = np.random.default_rng(0)
    i, o = families(rng, 20_000)[family]
    above = o[2] >= 0.01
    h = np.float32(rng.uniform(0, 1, i.shape[1]) if height == "random" else np.full(i.shape[1], height))
    exact = dr.exp(-0.3 * Shadows(llvm.Array3f64(i), llvm.Array3f64(o)).union(llvm.Float64(h)))
    i, o, h = llvm.Array3f(i), llvm.Array3f(o), llvm.Float(h)
    dr.enable_grad(i, o, h)
    masking = dr.exp(-0.3 * Shadows(i, o).union(h))
    dr.backward(dr.sum(masking))
    assert np.abs(np.asarray(masking) - np.asarray(exact))[above].max() < 1e-4
    assert all(np.isfinite(np.asarray(dr.grad(x))).all() for x in (i, o, h))


def test_identities_of_the_masking_function():
    rng = np.random.default_rng(1)
    i, o = (llvm.Array3f64(directions(rng, 1000, 0.05)) for _ in range(2))
    h, n = llvm.Float64(rng.uniform(0, 1, 1000)), llvm.Array3f64(0, 0, 1)
    both, one = Shadows(i, o), shadow(i, h)
    assert dr.allclose(both.union(h), Shadows(o, i).union(h), atol=1e-9)  # reciprocity
    assert dr.allclose(Shadows(i, i).union(h), one, atol=1e-6)  # retro-reflection: the shadows coincide
    assert dr.allclose(Shadows(i, n).union(h), one, atol=1e-6)  # along n there is none
    assert dr.allclose(both.union(llvm.Float64(1)), 0, atol=1e-9)  # nor is there at the top
    assert dr.all(both.union(h) <= both.sum(h) + 1e-9)  # Eq. 18 is at least Eq. 17
    across = llvm.Array3f64(-i.x, -i.y, i.z)
    assert dr.allclose(Shadows(i, across).union(h), Shadows(i, across).sum(h), atol=1e-6)  # disjoint


@pytest.mark.parametrize("tau_0, beta_x, beta_y", GRAINS)
def test_visible_areas_add_up_to_one(tau_0, beta_x, beta_y):
    """tau_0 int D G1 (i.m)+ / cos_i dm = tau_i: what is seen is grain or base, exactly. Midpoint rule, good to 1e-4."""
    h, azimuth = np.meshgrid((np.arange(1000) + 0.5) / 1000, (np.arange(1000) + 0.5) / 1000 * 2 * np.pi, indexing="ij")
    r, radius = density(llvm.Float64(tau_0)), np.sqrt(1 - h * h)
    m = llvm.Array3f64((radius * np.cos(azimuth)).ravel(), (radius * np.sin(azimuth)).ravel(), h.ravel())
    for theta in np.radians([0.1, 20, 60, 85]):
        i = to_sphere(
            llvm.Array3f64(float(np.sin(theta)) * 0.8, float(np.sin(theta)) * 0.6, float(np.cos(theta))), beta_x, beta_y
        )
        seen = exposure(r, m.z, shadow(i, m.z)) * dr.maximum(dr.dot(i, m), 0) / i.z
        assert float((r * dr.mean(seen) * 2 * dr.pi)[0]) == pytest.approx(float(visible_fraction(r, i)[0]), abs=2e-4)


@pytest.mark.parametrize("tau_0, beta_x, beta_y", GRAINS)
def test_ndf_is_normalised(tau_0, beta_x, beta_y):
    """int D cos dm = 1 (Eq. 12), over the hemisphere in Gauss-Legendre squares of cos² and azimuth."""
    x, w = np.polynomial.legendre.leggauss(200)
    z = np.sqrt((x + 1) / 2)[:, None]
    azimuth = (np.arange(400) + 0.5) / 400 * 2 * np.pi
    m = np.stack(np.broadcast_arrays(np.sqrt(1 - z * z) * np.cos(azimuth), np.sqrt(1 - z * z) * np.sin(azimuth), z))
    h, d_ggx = normal_in_sphere_space(llvm.Array3f64(m.reshape(3, -1)), beta_x, beta_y)
    r = density(llvm.Float64(tau_0))
    projected = np.asarray(dr.pi * r * d_ggx * exposure(r, h, 0)).reshape(200, 400).mean(1)
    assert (w / 2 * projected).sum() * np.pi == pytest.approx(tau_0, rel=2e-3)


@pytest.mark.parametrize("r", [1e-4, 0.03, 0.3, 1.0, 2.0, 4.0])
def test_the_visible_height_is_inverted(r):
    """The CDF at the sampled height returns the random number to 1e-4, for all cosines and its extremes."""
    rng = np.random.default_rng(5)
    cos, azimuth = np.exp(rng.uniform(np.log(0.003), 0, N)), rng.uniform(0, 2 * np.pi, N)
    u = np.float32(
        np.clip(
            np.r_[rng.uniform(0, 1, N - 2000), 10.0 ** rng.uniform(-7, -2, 1000), np.linspace(0.999, 1, 1000)],
            0,
            1 - 6e-8,
        )
    )
    sin = np.sqrt(1 - cos * cos)
    w = llvm.Array3f(sin * np.cos(azimuth), sin * np.sin(azimuth), cos)
    h = llvm.Float64(sample_visible_normal(llvm.Float(r), w, llvm.Float(u), llvm.Float(rng.uniform(0, 1, N))).z)
    w = llvm.Array3f64(w)
    cdf = (1 - exposure(llvm.Float64(r), h, shadow(w, h))) / visible_fraction(llvm.Float64(r), w)
    assert np.abs(np.asarray(cdf) - u).max() < 1e-4


@pytest.mark.parametrize("closed", [True, False], ids=["isotropic", "anisotropic"])
def test_diffuse_quadrature_is_within_half_a_percent(monkeypatch, closed):
    """Against 128 heights and 32 azimuths: 99.8 % of random inputs, and all that are brighter than 0.05."""
    rng, n = np.random.default_rng(7), 4000
    i, o = directions(rng, n, 0.03), directions(rng, n, 0.03)
    o[:, : n // 3] = unit(i + 0.05 * rng.normal(size=i.shape))[:, : n // 3]
    o[2] = np.maximum(np.abs(o[2]), 0.03)
    o, beta = unit(o), np.exp(rng.uniform(np.log(0.1), np.log(3.2), (2, n)))
    beta_x, beta_y = (llvm.Float64(b) for b in (beta[[0, 0]] if closed else beta))
    arguments = density(llvm.Float64(rng.uniform(0.03, 0.95, n))), beta_x, beta_y, llvm.Array3f64(i), llvm.Array3f64(o)

    def value():
        return np.asarray(lambertian(*arguments, Shadows.union, closed=closed).first)

    ours = value()
    monkeypatch.setattr(diffuse, "HEIGHTS", 128)
    monkeypatch.setattr(diffuse, "AZIMUTHS", (32, 32))
    exact = value()
    error = np.abs(ours / exact - 1)
    assert np.quantile(error, 0.998) < 5e-3 and error[exact > 0.05].max() < 5e-3 and error.mean() < 5e-4


def albedo(theta, phi=0.3, **parameters):
    """(mean weight, its standard error, largest weight) of 2^17 samples at the angles in degrees."""
    bsdf, rng = mi.load_dict({"type": "micrograin", **parameters}), mi.PCG32(size=N)
    theta, phi = np.radians([theta, phi])
    si = dr.zeros(mi.SurfaceInteraction3f, N)
    si.wi = mi.Vector3f(*map(float, (np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta))))
    _, weight = bsdf.sample(
        mi.BSDFContext(), si, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    )
    weight = np.asarray(weight.x, dtype=float)
    return weight.mean(), weight.std() / N**0.5, weight.max()


TRACED = {  # (tau_0, beta_x, beta_y): single-scattering albedo at 5, 45, 70, 85 degrees, mirror grains on a white base
    (0.2, 0.1, 0.1): (0.996, 0.995, 0.993, 0.988),
    (0.2, 2.0, 2.0): (0.692, 0.662, 0.653, 0.821),
    (0.5, 0.5, 0.5): (0.864, 0.866, 0.883, 0.950),
    (0.5, 1.0, 1.0): (0.664, 0.687, 0.762, 0.942),
    (0.5, 2.0, 2.0): (0.420, 0.420, 0.574, 0.931),
    (0.8, 1.0, 1.0): (0.627, 0.668, 0.810, 0.973),
    (0.8, 2.0, 2.0): (0.324, 0.412, 0.713, 0.965),
    (0.5, 0.2, 2.0): (0.596, 0.596, 0.595, 0.611),
    (0.5, 2.0, 0.2): (0.596, 0.615, 0.792, 0.995),
}


@pytest.mark.parametrize("grains, traced", TRACED.items())
def test_albedo_equals_traced_mirror_grains(rgb, grains, traced):
    tau_0, beta_x, beta_y = grains
    for theta, expected in zip((5, 45, 70, 85), traced):
        mean, error, largest = albedo(theta, tau_0=tau_0, beta_x=beta_x, beta_y=beta_y, base=WHITE)
        assert mean == pytest.approx(expected, abs=0.003 + 3 * error) and largest < 1 + 1e-5  # never above Fresnel


@pytest.mark.parametrize(
    "tau_0, beta, traced", [(0.5, 1.0, (0.792, 0.778, 0.756, 0.815)), (0.8, 2.0, (0.597, 0.603, 0.678, 0.825))]
)
def test_albedo_equals_traced_diffuse_grains(rgb, tau_0, beta, traced):
    for theta, expected in zip((5, 45, 70, 85), traced):
        mean, error, largest = albedo(
            theta, tau_0=tau_0, beta=beta, base=WHITE, specular=False, diffuse_reflectance=1.0
        )
        assert mean == pytest.approx(expected, abs=0.003 + 3 * error) and largest < 1.01  # the pdf's own quadrature


@pytest.mark.parametrize(
    "diffuse_grains", [{}, {"specular": False, "diffuse_reflectance": 1.0}], ids=["mirror", "diffuse"]
)
@pytest.mark.parametrize("beta", [(0.1, 0.1), (1.0, 1.0), (5.0, 5.0), (0.1, 3.0)])
@pytest.mark.parametrize(
    "masking, tau_0", [("correlated", 0.01), ("correlated", 0.2), ("height", 0.5), ("correlated", 0.97)]
)
def test_multiple_scattering_closes_the_furnace(rgb, diffuse_grains, beta, tau_0, masking):
    """To 0.8 %: the tables' interpolation, most of it across the seven azimuths, and 4096 points a node."""
    grains = {"tau_0": tau_0, "beta_x": beta[0], "beta_y": beta[1], "masking": masking, **diffuse_grains}
    for theta, phi in ((1, 0), (45, 30), (75, 7), (85, 20)):
        mean, error, _ = albedo(theta, phi, **grains, base=WHITE, scattering="multiple")
        assert mean == pytest.approx(1, abs=0.008 + 3 * error)


def test_multiple_scattering_over_grains_is_reciprocal(rgb):
    """The base's albedo may not depend on the direction it is seen from."""
    bsdf = mi.load_dict(
        {"type": "micrograin", "scattering": "multiple", "base": {"type": "micrograin", "specular": False}}
    )
    rng = mi.PCG32(size=1000)
    i, o = (mi.warp.square_to_cosine_hemisphere(mi.Point2f(rng.next_float32(), rng.next_float32())) for _ in range(2))
    si = dr.zeros(mi.SurfaceInteraction3f, 1000)
    si.wi = i
    there = bsdf.eval(mi.BSDFContext(), si, o).x / o.z
    si.wi = o
    assert dr.allclose(there, bsdf.eval(mi.BSDFContext(), si, i).x / i.z, rtol=1e-3, atol=1e-4)


def test_common_mistakes_would_show(rgb):
    """beta is not 1/beta, the second layer's axes are its own, and masking matters where it should."""
    assert albedo(5, tau_0=0.5, beta=0.5)[0] > albedo(5, tau_0=0.5, beta=2.0)[0]
    turned = albedo(70, 90.3, tau_0=0.5, beta_x=2.0, beta_y=0.2)[0]
    assert turned == pytest.approx(albedo(70, 0.3, tau_0=0.5, beta_x=0.2, beta_y=2.0)[0], abs=0.005)


def test_retro_reflection_needs_the_correlation(rgb):
    """At exact retro the two shadows are one: G = G1, and height-only masking loses G1 once more."""
    si = dr.zeros(mi.SurfaceInteraction3f)
    si.wi = dr.normalize(mi.Vector3f(0.9, 0.3, 0.15))
    values = {}
    for masking in ("correlated", "height", "smith"):
        bsdf = mi.load_dict({"type": "micrograin", "tau_0": 0.4, "specular": False, "masking": masking})
        values[masking] = bsdf.eval(mi.BSDFContext(), si, si.wi).x[0]
    assert values["correlated"] > 1.3 * values["height"]
