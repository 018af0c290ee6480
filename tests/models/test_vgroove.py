"""The V-groove model against exact identities, published tables, and rays traced through grooves.

The albedos of single bounces and the energies per bounce come from Monte Carlo simulation of explicit facets, good to
.001 and .002.
"""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import drjit.llvm.ad as llvm
import mitsuba as mi
import numpy as np
import pytest

from asperity.lab.evaluate import variates
from asperity.microfacet.distributions import DISTRIBUTIONS, GGX, Beckmann, Profile
from asperity.microfacet.fresnel import conductor
from asperity.models.vgroove import fresnel, kaleidoscope, nonsymmetric
from asperity.models.vgroove.bounces import needed_bounces_nonsymmetric
from asperity.models.vgroove.kaleidoscope import Groove, Pair, bounces, exit_angle, leaving_share, symmetric_bounces
from asperity.models.vgroove.model import VGroove, _more_numbers
from asperity.models.vgroove.symmetric import symmetric

N = 1 << 17


def directions(rng, n):
    """Cosine-distributed, the horizon left out."""
    radius, azimuth = np.sqrt(rng.uniform(0, 0.999, n)), rng.uniform(0, 2 * np.pi, n)
    return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), np.sqrt(1 - radius**2)])


def interaction(w, n=N):
    si = dr.zeros(mi.SurfaceInteraction3f, n)
    si.wi = mi.Vector3f(*(mi.Float(x.astype(np.float32)) for x in np.broadcast_to(w.reshape(3, -1), (3, n))))
    return si


def towards(theta, phi=0.3):
    theta = np.radians(theta)
    return np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def draw(bsdf, w):
    rng = mi.PCG32(size=N)
    numbers = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    return bsdf.sample(mi.BSDFContext(), interaction(w), *numbers)


def albedo(theta, **parameters):
    """(mean weight, its standard error, largest weight)."""
    weight = np.asarray(draw(mi.load_dict({"type": "vgroove", **parameters}), towards(theta))[1].x, dtype=float)
    return weight.mean(), weight.std() / N**0.5, weight.max()


def evaluate(i, o, **parameters):
    bsdf = mi.load_dict({"type": "vgroove", **parameters})
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), interaction(i, i.shape[1]), interaction(o, o.shape[1]).wi)
    return np.asarray(value.x, dtype=float), np.asarray(pdf, dtype=float)


def trace(tilt_l, tilt_r, psi, rays=1000):
    """Bounces and exit angles of rays that meet the left facet first, by reflecting them between two line segments.

    Stratified over the part of the facet that the other one does not shade.
    """
    along = np.array([[-np.cos(tilt_l), np.cos(tilt_r)], [np.sin(tilt_l), np.sin(tilt_r)]])  # from the apex upwards
    lengths, normals = 1 / along[1], np.array([[np.sin(tilt_l), -np.sin(tilt_r)], [np.cos(tilt_l), np.cos(tilt_r)]])
    offset = (np.arange(rays) + 0.5) / rays * lengths[0]
    place, to = along[:, :1] * offset, -np.tile([[np.sin(psi)], [np.cos(psi)]], rays)
    lit = np.full(rays, to[:, 0] @ normals[:, 0] < -1e-9)  # not along it, but for rounding
    lit &= ~(_distance(place, -to, along[:, 1], lengths[1]) < np.inf)
    count, facet = np.zeros(rays, int), np.zeros(rays, int)
    going = lit.copy()
    while going.any():
        n = normals[:, facet]
        to = np.where(going, to - 2 * (to * n).sum(0) * n, to)
        count = count + going
        facet = np.where(going, 1 - facet, facet)
        distance = np.where(facet == 0, *(_distance(place, to, along[:, m], lengths[m]) for m in (0, 1)))
        going &= distance < np.inf
        place = np.where(going, place + np.where(going, distance, 0) * to, place)
    return count, np.arctan2(to[0], to[1])


def _distance(place, to, along, length):
    """Distance to a segment from the origin, infinite where it is missed."""
    across = to[0] * along[1] - to[1] * along[0]
    distance = (along[0] * place[1] - along[1] * place[0]) / np.where(across == 0, 1e-300, across)
    met = place + distance * to
    s = met[0] * along[0] + met[1] * along[1]
    return np.where((distance > 1e-12) & (s > 0) & (s < length), distance, np.inf)


@pytest.mark.parametrize("tilts", [(20, 20), (46, 46), (62, 62), (75, 75), (84, 84), (15, 50), (70, 35), (80, 60)])
def test_kaleidoscope_equals_traced_rays(tilts):
    """Table 1 found .003 at most. 1000 strata miss each limit of a share by .0005 at most, and those add up."""
    left, right = np.radians(tilts)
    groove = Groove(llvm.Float64(left), llvm.Float64(right))
    for psi in np.radians(np.arange(-85.0, 86.0, 10.0)):
        count, exits = trace(left, right, psi)
        if np.cos(psi - left) < 1e-9:
            assert not count.any()
            continue
        shares = [float(leaving_share(groove, llvm.Float64(psi), k)[0]) for k in range(1, 40)]
        assert np.abs(np.bincount(count, minlength=40)[1:40] / count.size - shares).sum() < 3e-3
        for k in set(count) - {0}:
            exact = float(exit_angle(groove, llvm.Float64(psi), llvm.UInt(int(k)))[0])
            assert np.abs(exits[count == k] - exact).max() < 1e-9
        assert sum(shares) == pytest.approx(masking(left, right, psi), abs=1e-12)
        lit = count > 0
        distance = (np.arange(count.size) + 0.5) / count.size / np.sin(left)  # from the apex, along the facet
        offset = llvm.Float64((distance * np.cos(psi - left))[lit])
        psis = llvm.Float64(np.full(lit.sum(), psi))
        for count_bounces in [bounces, symmetric_bounces] if left == right else [bounces]:
            k = np.asarray(count_bounces(groove, psis, offset, llvm.UInt(60)))
            assert (k != count[lit]).mean() < 2e-3  # rays that meet a rim


def test_the_kaleidoscope_needs_its_clamps(monkeypatch):
    """Eq. 6 as printed lets an image reflect that the ray runs away from, at a negative offset."""

    def as_printed(groove, psi, m):
        tilt = dr.select(m % 2 == 1, groove.tilt_l, groove.tilt_r)
        return dr.sin(kaleidoscope.meeting_angle(groove, psi, m)) / dr.sin(tilt)

    left, right = np.radians((80, 60))
    groove, psis = Groove(llvm.Float64(left), llvm.Float64(right)), np.radians(np.arange(-85.0, 86.0, 10.0))

    def error():
        traced = [np.bincount(trace(left, right, psi)[0], minlength=40)[1:40] / 1000 for psi in psis]
        shares = [[float(leaving_share(groove, llvm.Float64(psi), k)[0]) for k in range(1, 40)] for psi in psis]
        return np.abs(np.subtract(traced, shares)).sum(1).max()

    assert error() < 3e-3
    monkeypatch.setattr(kaleidoscope, "reach", as_printed)
    assert error() > 0.1


def masking(left, right, psi):
    """G1: share of the left facet that the right one does not shade, of equal depth."""
    shaded = max(0.0, np.sin(psi + right - np.pi / 2) / np.sin(right))
    return max(0.0, 1 - shaded * np.sin(left) / np.cos(psi - left))


@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_single_bounce_is_cook_torrance(rgb, name):
    """f cos_o = D G / (4 cos_i) with the V-cavity's G: an identity; float32 leaves 3e-5 of D's exponential."""
    rng = np.random.default_rng(0)
    i, o = directions(rng, 10_000), directions(rng, 10_000)
    h = (i + o) / np.linalg.norm(i + o, axis=0)
    d = Profile.along(
        DISTRIBUTIONS[name],
        llvm.Float64(h[0] / np.hypot(*h[:2])), llvm.Float64(h[1] / np.hypot(*h[:2])),
        llvm.Float64(0.4), llvm.Float64(0.6),
    ).density(llvm.Float64(np.hypot(*h[:2])), llvm.Float64(h[2]))  # fmt: skip
    g = np.minimum(1, 2 * h[2] * np.minimum(i[2], o[2]) / (i * h).sum(0))
    value, _ = evaluate(i, o, distribution=name, alpha_u=0.4, alpha_v=0.6, max_bounces=1)
    np.testing.assert_allclose(value, np.asarray(d) * g / (4 * i[2]), rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("symmetric", [True, False])
@pytest.mark.parametrize("name", DISTRIBUTIONS)
@pytest.mark.parametrize("alpha", [0.2, 0.7, 1.0])
def test_furnace(rgb, name, alpha, symmetric):
    """The default number of bounces misses .1 % at most; 3 standard errors, and 1e-5 for float32."""
    for theta in (0, 30, 60, 85):
        mean, error, largest = albedo(theta, distribution=name, alpha=alpha, symmetric=symmetric)
        assert 1 - 1e-3 - 3 * error < mean <= largest < 1 + 1e-5


SINGLE = {  # (distribution, alpha, symmetric): albedo of one bounce at 0, 30, 60, 80 degrees
    ("ggx", 0.5, True): (0.699, 0.717, 0.814, 0.931),
    ("ggx", 0.5, False): (0.649, 0.669, 0.746, 0.876),
    ("ggx", 1.0, True): (0.375, 0.427, 0.654, 0.879),
    ("ggx", 1.0, False): (0.307, 0.358, 0.542, 0.785),
    ("beckmann", 0.5, True): (0.892, 0.875, 0.887, 0.955),
    ("beckmann", 0.5, False): (0.909, 0.880, 0.878, 0.950),
    ("beckmann", 1.0, True): (0.454, 0.530, 0.792, 0.938),
    ("beckmann", 1.0, False): (0.419, 0.507, 0.778, 0.934),
}


@pytest.mark.parametrize("case, traced", SINGLE.items())
def test_single_scattering_albedo(rgb, case, traced):
    name, alpha, symmetric = case
    for theta, expected in zip((0, 30, 60, 80), traced):
        mean, error, _ = albedo(theta, distribution=name, alpha=alpha, symmetric=symmetric, max_bounces=1)
        assert mean == pytest.approx(expected, abs=0.0015 + 3 * error)


ENERGIES = {  # at normal incidence, symmetric: shares of the light that leave after 1, 2, ... bounces
    ("ggx", 0.1): (0.983, 0.013, 0.002),
    ("ggx", 0.5): (0.699, 0.206, 0.048, 0.019),
    ("ggx", 1.0): (0.375, 0.329, 0.130, 0.061),
    ("beckmann", 0.5): (0.892, 0.108, 1e-4),
    ("beckmann", 1.0): (0.453, 0.453, 0.087, 0.007),
}


@pytest.mark.parametrize("case, traced", ENERGIES.items())
def test_energy_by_bounces(rgb, case, traced):
    """By the number of bounces drawn, to 4 standard errors and .001."""
    name, alpha = case
    model = mi.load_dict({"type": "vgroove", "distribution": name, "alpha": alpha}).model
    si, rng = interaction(towards(0)), mi.PCG32(size=N)
    numbers = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    _, k = model.draw(si, si.wi, *numbers, True)
    drawn = np.bincount(np.asarray(k), minlength=5)[1:] / N
    np.testing.assert_allclose(drawn[: len(traced)], traced, atol=0.001 + 4 * (0.25 / N) ** 0.5)


@pytest.mark.parametrize("symmetric", [True, False])
def test_constant_reflectance_multiplies_by_bounces(rgb, monkeypatch, symmetric):
    """Albedo = sum_k E_k rho^k for facets that reflect rho at any angle, and weights in [rho^N, rho]."""
    rho, most = 0.5, 8
    monkeypatch.setattr("asperity.models.vgroove.model.conductor", lambda cos, eta, k: 0 * eta + rho)
    # A constant is no polynomial without a constant term, as reflectances are, which are 1 at grazing angles.
    for module in ("symmetric", "nonsymmetric"):
        monkeypatch.setattr(
            f"asperity.models.vgroove.{module}.product", lambda e, k, *_: mi.Color3f(rho ** mi.Float(k))
        )
    given = {"alpha": 0.7, "symmetric": symmetric}
    mean, _, largest = albedo(20, material="Au", max_bounces=most, **given)
    model = mi.load_dict({"type": "vgroove", **given, "max_bounces": most}).model
    si, rng = interaction(towards(20)), mi.PCG32(size=N)
    _, k = model.draw(si, si.wi, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32()), True)
    k = np.asarray(k)
    assert mean == pytest.approx(np.where(k <= most, rho**k, 0).mean(), abs=3e-3)  # 5 standard errors of the latter
    assert largest < rho * (1 + 1e-5)


@pytest.mark.parametrize("given", [{"symmetric": True}, {"symmetric": False}], ids=str)
def test_axes_swap(rgb, given):
    rng = np.random.default_rng(2)
    i, o = directions(rng, 10_000), directions(rng, 10_000)
    one, _ = evaluate(i, o, alpha_u=0.2, alpha_v=0.7, material="Cu", **given)
    other, _ = evaluate(i[[1, 0, 2]], o[[1, 0, 2]], alpha_u=0.7, alpha_v=0.2, material="Cu", **given)
    np.testing.assert_allclose(one, other, rtol=2e-3, atol=1e-5)  # float32, near the pole


def test_ggx_of_alpha_one_is_phong_of_exponent_zero(rgb):
    rng = np.random.default_rng(3)
    i, o = directions(rng, 10_000), directions(rng, 10_000)
    ggx, _ = evaluate(i, o, alpha=1.0)
    phong, _ = evaluate(i, o, distribution="phong", exponent=0.0)
    np.testing.assert_allclose(ggx, phong, rtol=1e-4, atol=1e-6)


def test_default_number_of_bounces(rgb):
    def most(**given):
        return int(np.asarray(mi.load_dict({"type": "vgroove", **given}).model.most).item())

    assert [most(alpha=alpha) for alpha in (0.1, 0.3, 0.5, 1.0)] == [6, 15, 25, 50]
    assert [most(alpha=alpha, distribution="beckmann") for alpha in (0.5, 1.0)] == [3, 5]
    assert [most(exponent=exponent, distribution="phong") for exponent in (2.0, 6.0)] == [9, 4]
    assert most(alpha=0.3, symmetric=False) == needed_bounces_nonsymmetric(GGX, 0.3) < 15
    bitmap = {"type": "bitmap", "raw": True, "data": mi.TensorXf([0.1, 0.5] * 8, (4, 4, 1))}
    assert most(alpha=bitmap) == most(alpha=0.5)
    assert most(alpha_u=0.1, alpha_v=0.5) == most(alpha=0.5)
    assert most(alpha=0.5, max_bounces=4) == 4
    bsdf = mi.load_dict({"type": "vgroove", "alpha": 0.1})
    params = mi.traverse(bsdf)
    params["alpha.value"] = 0.5
    params.update()
    assert int(np.asarray(bsdf.model.most).item()) == 25


@pytest.mark.parametrize("alpha", [0.15, 0.5, 1.0])
@pytest.mark.parametrize("kind", [GGX, Beckmann])
def test_nonsymmetric_quadrature(monkeypatch, kind, alpha):
    """Mean error of the default under .2 %, and convergence: many nodes are exact to 1e-4."""
    rng, most = np.random.default_rng(4), llvm.UInt(needed_bounces_nonsymmetric(kind, alpha))
    i, o = (llvm.Array3f64(directions(rng, 4000)) for _ in range(2))
    pair, a = Pair.of(i, o), llvm.Float64(alpha)
    profile = Profile.along(kind, pair.cos_azimuth, pair.sin_azimuth, a, a)

    def value(nodes):
        monkeypatch.setitem(nonsymmetric.NODES, kind, nodes)
        return np.asarray(nonsymmetric.nonsymmetric(pair, i.z, profile, most, None)[1])

    default, fine, exact = value(nonsymmetric.NODES[kind]), value((32, 16, 48)), value((64, 32, 200))
    default, fine, exact = (one[exact > 1e-3] for one in (default, fine, exact))
    assert np.abs(fine / exact - 1).mean() < 1e-4
    error = np.abs(default / exact - 1)
    assert error.mean() < 2e-3 and np.quantile(error, 0.95) < 1e-2


@pytest.mark.parametrize("material, accuracy", [("Au", 2e-3), ("Cu", 2e-3), ("Cr", 1.1e-2), ("W", 5e-3)])
def test_closed_fresnel_product(rgb, material, accuracy):
    """Against the product term by term: wrong by the fit of ln F in each of k bounces, and by float32 (1e-3)."""
    metal = mi.load_dict({"type": "vgroove", "material": material}).model.metal
    eta, k = metal.eval(dr.zeros(mi.SurfaceInteraction3f), True)
    logarithm = fresnel.fit(lambda cos: conductor(mi.Float(cos), eta, k))
    cosines = mi.Float(np.linspace(0, 1, 1000, dtype=np.float32))
    fitted = dr.exp(sum(a * cosines ** (n + 1) for n, a in enumerate(logarithm)))
    fit_error = np.abs(np.asarray(fitted / conductor(cosines, eta, k)) - 1).max()
    assert fit_error < accuracy
    rng, n = np.random.default_rng(5), 5000
    for count in (2, 3, 5, 12):
        first, last = np.sort(rng.uniform(0, np.pi, (2, n)), axis=0)
        b, phi = (last - first) / 2 / (count - 1), (first + last) / 2
        exact = 1
        for j in range(1, count + 1):
            angle = phi + (2 * j - count - 1) * b
            exact = exact * np.asarray(conductor(mi.Float(0.9 * np.maximum(np.sin(angle), 0)), eta, k))
        u, w, b = (fresnel.multiples(*dr.sincos(mi.Float(x))) for x in (phi - np.pi / 2, np.pi / 2 - count * b, b))
        bends = [c * d if m % 2 else -c * z for m, ((_, c), (z, d)) in enumerate(zip(u, w), 1)]
        e = fresnel.waves(logarithm, mi.Float(0.9))
        closed = fresnel.product(e, mi.UInt32(count), mi.Bool(count % 2 == 1), bends, [c for _, c in u], b)
        assert np.abs(np.asarray(closed) - exact).max() < count * fit_error + 1e-3


def test_metal_is_reciprocal_and_loses_at_most_what_mirrors_do(rgb):
    rng = np.random.default_rng(6)
    i, o = directions(rng, 20_000), directions(rng, 20_000)
    for given in ({"alpha": 0.5}, {"alpha": 0.5, "symmetric": False}):
        there, pdf = evaluate(i, o, material="Cu", **given)
        back, _ = evaluate(o, i, material="Cu", **given)
        np.testing.assert_allclose(there * i[2], back * o[2], rtol=1e-3, atol=1e-5)
        assert (there <= pdf * (1 + 1e-5)).all()


def test_double_precision_symmetric_value_is_reciprocal():
    """To rounding: the closed form is symmetric term by term."""
    rng = np.random.default_rng(7)
    i, o = (llvm.Array3f64(directions(rng, 20_000)) for _ in range(2))

    def value(i, o):
        pair = Pair.of(i, o)
        profile = Profile.along(GGX, pair.cos_azimuth, pair.sin_azimuth, llvm.Float64(0.3), llvm.Float64(0.5))
        return np.asarray(symmetric(pair, i.z, profile, llvm.UInt(20), None)[1] * i.z)

    np.testing.assert_allclose(value(i, o), value(o, i), rtol=1e-9)


@pytest.mark.parametrize("kind", DISTRIBUTIONS.values())
@pytest.mark.parametrize("alpha", [0.1, 0.5, 0.9])
def test_partner_tilts(kind, alpha):
    """The normalisation, by quadrature, and the sampler's distribution (Kolmogorov and Smirnov, 1 in 10 000)."""
    a = (np.arange(200_000) + 0.5) / 200_000 * np.pi / 2
    p = np.asarray(kind.density(llvm.Float64(alpha), llvm.Float64(np.sin(a)), llvm.Float64(np.cos(a)))) * np.sin(a) ** 2
    total = p.mean() * np.pi / 2
    assert total == pytest.approx(float(kind.partner(llvm.Float64(alpha))[0]), rel=1e-6)
    rng = np.random.default_rng(8)
    sin, cos = kind.sample_partner(llvm.Float64(alpha), *(llvm.Float64(rng.random(N)) for _ in range(3)))
    drawn = np.sort(np.arctan2(np.asarray(sin), np.asarray(cos)))
    cdf = np.interp(drawn, a, np.cumsum(p) / p.sum())
    assert np.abs(cdf - (np.arange(N) + 0.5) / N).max() * N**0.5 < 2.23


BAD = {
    "zero": ({"alpha": 0.0}, r"alpha = 0.0: expected a number or texture in \[0.001, 1000\]"),
    "huge": ({"alpha": 1e6}, r"alpha = 1000000.0: expected a number or texture in \[0.001, 1000\]"),
    "negative": ({"alpha_u": -0.1}, "alpha_u = -0.1"),
    "distribution": ({"distribution": "gxx"}, "distribution = 'gxx'. Did you mean 'ggx'"),
    "exponent of GGX": ({"exponent": 3.0}, "exponent: Phong's, but distribution = 'ggx'"),
    "two roughnesses": ({"distribution": "phong", "exponent": 3.0, "alpha": 0.1}, "alpha and exponent exclude"),
    "alpha twice": ({"alpha": 0.1, "alpha_u": 0.1}, "alpha and alpha_u exclude each other"),
    "rough Phong": ({"distribution": "phong", "alpha": 1.2}, r"alpha = 1.2: .*\[0.001, 1\] for Phong"),
    "no bounce": ({"max_bounces": 0}, r"max_bounces = 0: expected a whole number in \[1, 1000\]"),
    "half a bounce": ({"max_bounces": 2.5}, "max_bounces = 2.5: expected a whole number"),
    "metal twice": ({"material": "Au", "eta": 1.0}, "material and eta exclude each other"),
    "word for a flag": ({"symmetric": "yes"}, "symmetric = 'yes'"),
}


@pytest.mark.parametrize("given, message", BAD.values(), ids=BAD)
def test_bad_input_is_named(rgb, given, message):
    with pytest.raises(RuntimeError, match=f"ParameterError: (.*){message}"):
        mi.load_dict({"type": "vgroove", **given})


def test_model_is_documented():
    assert {row.name for row in VGroove.rows()} >= {"alpha", "exponent", "max_bounces", "symmetric", "distribution"}


def test_hashed_numbers_are_uniform_and_independent(rgb):
    # Mitsuba's hash with its 4 rounds had correlations of .006 here, which made a per mille of single bounces double.
    n = 2**21
    given = variates(n, 3)
    every = np.array([given[0], given[1].x, given[1].y, *_more_numbers(*given)], dtype=float)
    limit = 5 / np.sqrt(n)  # 15 pairs: chance exceeds it once in 10^5
    assert np.abs(np.corrcoef(every) - np.eye(6)).max() < limit
    assert np.abs(every.mean(axis=1) - 0.5).max() < limit
