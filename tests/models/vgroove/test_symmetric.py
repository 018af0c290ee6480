"""The sum over bounces without a loop against its terms, and how these are numbered."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest
from helpers import cosine_directions

from asperity.microfacet.distributions import GGX, Beckmann, Phong
from asperity.microfacet.fresnel import Metal
from asperity.models.vgroove.fresnel import Reflectance, fit
from asperity.models.vgroove.kaleidoscope import Pair
from asperity.models.vgroove.symmetric import POLE, WRITTEN, cook_torrance_share, symmetric
from asperity.models.vgroove.terms import by_terms, numbered
from asperity.models.vgroove.tilts import TILTS

KINDS = ((True, 1), (True, -1), (False, 1), (False, -1))


@pytest.mark.parametrize("first_even", [2, 4])
@pytest.mark.parametrize("limits", [(9.5, 3.0, 2.0, 40.0), (1.0, 2.0, 0.5, 1.5), (3.1, 5.0, 4.1, 6.0)], ids=str)
def test_terms_are_numbered_without_gaps(limits, first_even):
    """Every k of its kind below the limit, up to the most, once."""
    most = 12
    count, term = numbered([llvm.Float(limit) for limit in limits], llvm.UInt(most), first_even)
    found = zip(*(np.array(part) for part in term(dr.arange(llvm.UInt, 40))))
    expected = [
        (k, odd, tau)
        for (odd, tau), limit in zip(KINDS, limits)
        for k in range(3 if odd else first_even, most + 1, 2)
        if k < limit
    ]
    assert list(found)[: count[0]] == expected


CASES = [(GGX, 0.05), (GGX, 0.3), (GGX, 1.0), (GGX, 1.5), (Beckmann, 0.4), (Beckmann, 1.5), (Phong, 0.5), (Phong, 1.0)]
"""Distribution and roughness."""
each_case = pytest.mark.parametrize("kind, alpha", CASES, ids=[f"{kind.__name__} {alpha}" for kind, alpha in CASES])


def pairs(n=40_000, precision=llvm.Float64):
    """Half of all by the cosine, others near the mirror direction, some retro and at normal incidence; and cos_i."""
    rng, wi, wo = np.random.default_rng(0), *(by_cosine(seed, n) for seed in (1, 2))
    wo[:, ::2] = wi[:, ::2] * [[-1], [-1], [1]] + rng.normal(size=(3, n // 2)) * 10 ** rng.uniform(-5, -1, n // 2)
    wo[:, 1::8], wi[:, 3::80], wo[:, 3::160] = wi[:, 1::8], [[0], [0], [1]], [[0], [0], [1]]
    wo[2] = np.maximum(np.abs(wo[2]), 1e-4)
    vector = dr.replace_shape_t(precision, (3, -1))
    wi, wo = (vector(w / np.linalg.norm(w, axis=0)) for w in (wi, wo))
    return Pair.of(wi, wo), wi.z


def by_cosine(seed, n):
    u, v = np.random.default_rng(seed).random((2, n))
    return np.stack([np.sqrt(u) * np.cos(2 * np.pi * v), np.sqrt(u) * np.sin(2 * np.pi * v), np.sqrt(1 - u)])


def tilts(kind, alpha):
    return TILTS[kind](llvm.Float64(alpha))


@pytest.mark.parametrize("most", [1, 2, 3, 4, 5, 6, 7, 9, 30])
@each_case
def test_mirrors_reflect_the_sum_of_the_terms(kind, alpha, most):
    """To rounding where all are written out, else to 1 %, which is promised: .9 % at GGX 1.5, .4 % at 1."""
    found = [
        np.array(brdf(*pairs(), tilts(kind, alpha), llvm.UInt(most), None, **few)[1])
        for brdf, few in ((symmetric, {"few": min(most, WRITTEN + 1)}), (by_terms, {}))
    ]
    error = np.abs(found[0] - found[1]) / np.maximum(found[1], 1e-3)
    assert error.max() < (0.01 if most > WRITTEN else 1e-5) and np.median(error) < 2e-3


@each_case
def test_derivatives_are_those_of_the_terms(kind, alpha):
    """By the roughness; of Beckmann's steep one, that of one or two terms by an integral is 4 % off."""
    slopes = []
    for brdf in (symmetric, by_terms):
        roughness = llvm.Float64(alpha)
        dr.enable_grad(roughness)
        _, value = brdf(*pairs(), TILTS[kind](roughness), llvm.UInt(30), None)
        dr.forward(roughness)
        slopes.append(np.array(dr.grad(value)))
    scale = np.abs(slopes[1]) + np.array(dr.detach(value)) / alpha
    assert np.percentile(np.abs(slopes[0] - slopes[1]) / np.maximum(scale, 1e-3), 99) < 0.05


@pytest.mark.parametrize("index, accuracy", [((1.45, 1.8), 0.005), ((1.66, 9.2), 0.012)], ids=["gold", "aluminium"])
def test_metals_reflect_what_every_bounce_leaves(index, accuracy):
    """Fresnel terms multiplied one by one: .4 % as of mirrors, and what the fits of ln F leave, 1 % of aluminium."""
    kind, alpha, (pair, cos_i) = GGX, 1.0, pairs(4_000)
    metal, most = Metal(*map(llvm.Float64, index)), 12
    found = symmetric(pair, cos_i, tilts(kind, alpha), llvm.UInt(most), Reflectance(metal, fit(metal)))[0]
    theta, delta, half = pair.theta, pair.delta, dr.pi / 2
    density = tilts(kind, alpha).density
    exact = density(pair.sin_theta, pair.cos_theta) * cook_torrance_share(pair) * metal(pair.length * pair.cos_delta)
    for k in range(2, most + 1):
        p, q = (theta, delta) if k % 2 else (delta, theta)
        for tau in (1, -1):
            b = (half - tau * p) / k
            g = dr.maximum(dr.minimum(dr.sin(b + tau * p - q), 2 * dr.cos(p) * dr.sin(b - q)), 0)
            term = density(dr.cos(b), dr.sin(b)) * g * dr.cos(b) / (k * dr.maximum(pair.sin_theta, POLE))
            for j in range(1 - k, k, 2):
                term = term * metal(dr.maximum(pair.length * dr.cos(q + j * b), 0))
            exact = exact + term
            dr.eval(exact)
    exact = np.array(exact / (4 * cos_i * pair.cos_delta))
    error = np.abs(np.array(found) - exact) / np.maximum(exact, 1e-3)
    assert error.max() < accuracy


@pytest.mark.parametrize("most", [1, 2, 3, 4, 5, 6, 7, 12])
def test_the_last_bounce_counts_and_no_more(most):
    """Light of all numbers of bounces adds up, in the integrals as well: sums differ by what a term is."""
    pair, cos_i = pairs(4_000)
    alike = [symmetric(pair, cos_i, tilts(GGX, 1.0), llvm.UInt(n), None, few=min(n, 6))[1] for n in (most, most + 1)]
    more = by_terms(pair, cos_i, tilts(GGX, 1.0), llvm.UInt(most + 1), None)[1]
    term = more - by_terms(pair, cos_i, tilts(GGX, 1.0), llvm.UInt(most), None)[1]
    error = np.abs(np.array(alike[1] - alike[0] - term)) / np.maximum(np.array(more), 1e-3)
    assert error.max() < 0.01  # twice .4 %


@each_case
def test_densities_are_the_density(kind, alpha):
    angles = np.random.default_rng(0).uniform(0.01, 1.55, (6, 1000))
    points = [dr.sincos(llvm.Float64(x)) for x in angles]
    of = TILTS[kind](llvm.Float64(alpha), 0.7)
    for found, point in zip(of.densities(points), points):
        np.testing.assert_allclose(found, of.density(*point), rtol=1e-12)


@each_case
def test_steepness_is_a_logarithmic_derivative(kind, alpha):
    """Near .28, where GGX's is a fraction that is good for small angles; Beckmann's, -4 and what grows as 1 / b^2."""
    near = [
        np.log(tilts(kind, alpha).density(dr.cos(b), dr.sin(b))[0]) for b in (llvm.Float64(x) for x in (0.27, 0.29))
    ]
    slope = (near[1] - near[0]) / np.log(0.29 / 0.27)
    assert float(tilts(kind, alpha).steepness()[0]) == pytest.approx(slope, abs=0.2, rel=0.08)


def test_metals_that_reflect_nothing_at_normal_incidence(rgb):
    """eta = 1 and k = 0 are allowed; a path of no weight then met a reflectance of 0 / 0."""
    grooves = mi.load_dict({"type": "vgroove", "eta": 1.0, "k": 0.0, "alpha": 0.6})
    wi, wo = (mi.Vector3f(cosine_directions(np.random.default_rng(n), 1000)) for n in (3, 4))
    si = dr.zeros(mi.SurfaceInteraction3f, 1000)
    si.wi = wi
    assert np.isfinite(np.array(grooves.eval(mi.BSDFContext(), si, wo))).all()
