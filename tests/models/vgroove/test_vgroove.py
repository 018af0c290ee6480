"""The V-groove model against exact identities and published tables.

The albedos of single bounces and the energies per bounce come from Monte Carlo simulation of explicit facets, good to
.001 and .002.
"""

import asperity  # noqa: F401  isort: skip
import drjit.llvm.ad as llvm
import helpers
import mitsuba as mi
import numpy as np
import pytest
from helpers import N, cosine_directions, towards

from asperity.lab import evaluate as lab
from asperity.microfacet.distributions import DISTRIBUTIONS, GGX
from asperity.models.vgroove.bounces import needed_bounces_nonsymmetric
from asperity.models.vgroove.fresnel import Path
from asperity.models.vgroove.kaleidoscope import Pair
from asperity.models.vgroove.model import VGroove
from asperity.models.vgroove.symmetric import symmetric
from asperity.models.vgroove.tilts import Tilts


def interaction_towards(theta):
    return lab.interaction(lab.vectors(towards(theta)[None]), N)


def albedo(theta, **parameters):
    return helpers.albedo({"type": "vgroove", **parameters}, theta)


def evaluate(i, o, **parameters):
    bsdf = mi.load_dict({"type": "vgroove", **parameters})
    value, pdf = lab.eval_pdf(bsdf, lab.vectors(i.T), lab.vectors(o.T))
    return np.asarray(value.x, dtype=float), np.asarray(pdf, dtype=float)


@pytest.mark.parametrize("name", DISTRIBUTIONS)
def test_single_bounce_is_cook_torrance(rgb, name):
    """f cos_o = D G / (4 cos_i) with the V-cavity's G: an identity; float32 leaves 3e-5 of D's exponential."""
    rng = np.random.default_rng(0)
    i, o = cosine_directions(rng, 10_000), cosine_directions(rng, 10_000)
    h = (i + o) / np.linalg.norm(i + o, axis=0)
    d = DISTRIBUTIONS[name](0.4, 0.6).density(llvm.Array3f64(h))
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
    si, rng = interaction_towards(0), mi.PCG32(size=N)
    numbers = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    _, k = model.lobes(si, True)[0].follow(si.wi, *numbers)
    drawn = np.bincount(np.asarray(k), minlength=5)[1:] / N
    np.testing.assert_allclose(drawn[: len(traced)], traced, atol=0.001 + 4 * (0.25 / N) ** 0.5)


@pytest.mark.parametrize("symmetric", [True, False])
def test_constant_reflectance_multiplies_by_bounces(rgb, monkeypatch, symmetric):
    """Albedo = sum_k E_k rho^k for facets that reflect rho at any angle, and weights in [rho^N, rho]."""
    rho, most = 0.5, 8
    monkeypatch.setattr("asperity.microfacet.fresnel.conductor", lambda cos, eta, k: 0 * eta + rho)
    # A constant is no polynomial without a constant term, as reflectances are, which are 1 at grazing angles.
    grooves = "asperity.models.vgroove"
    monkeypatch.setattr(f"{grooves}.nonsymmetric.product", lambda e, fan: mi.Color3f(rho ** mi.Float(fan.k)))
    monkeypatch.setattr(f"{grooves}.symmetric.through", lambda *_: mi.Color3f(rho**4))  # the middle one of 5 is apart
    monkeypatch.setattr(Path, "of", lambda a, l, x, y, angle: Path(mi.Color3f(float(np.log(rho)) / 2 * angle), 0))
    given = {"alpha": 0.7, "symmetric": symmetric}
    mean, _, largest = albedo(20, material="Au", max_bounces=most, **given)
    model = mi.load_dict({"type": "vgroove", **given, "max_bounces": most}).model
    si, rng = interaction_towards(20), mi.PCG32(size=N)
    _, k = model.lobes(si, True)[0].follow(
        si.wi, rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    )
    k = np.asarray(k)
    assert mean == pytest.approx(np.where(k <= most, rho**k, 0).mean(), abs=3e-3)  # 5 standard errors of the latter
    assert largest < rho * (1 + 1e-5)


@pytest.mark.parametrize("given", [{"symmetric": True}, {"symmetric": False}], ids=str)
def test_axes_swap(rgb, given):
    rng = np.random.default_rng(2)
    i, o = cosine_directions(rng, 10_000), cosine_directions(rng, 10_000)
    one, _ = evaluate(i, o, alpha_u=0.2, alpha_v=0.7, material="Cu", **given)
    other, _ = evaluate(i[[1, 0, 2]], o[[1, 0, 2]], alpha_u=0.7, alpha_v=0.2, material="Cu", **given)
    np.testing.assert_allclose(one, other, rtol=2e-3, atol=1e-5)  # float32, near the pole


def test_ggx_of_alpha_one_is_phong_of_exponent_zero(rgb):
    rng = np.random.default_rng(3)
    i, o = cosine_directions(rng, 10_000), cosine_directions(rng, 10_000)
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


def test_metal_is_reciprocal_and_loses_at_most_what_mirrors_do(rgb):
    rng = np.random.default_rng(6)
    i, o = cosine_directions(rng, 20_000), cosine_directions(rng, 20_000)
    for given in ({"alpha": 0.5}, {"alpha": 0.5, "symmetric": False}):
        there, pdf = evaluate(i, o, material="Cu", **given)
        back, _ = evaluate(o, i, material="Cu", **given)
        np.testing.assert_allclose(there * i[2], back * o[2], rtol=1e-3, atol=1e-5)
        assert (there <= pdf * (1 + 1e-5)).all()


def test_double_precision_symmetric_value_is_reciprocal():
    """To rounding: the closed form is symmetric term by term."""
    rng = np.random.default_rng(7)
    i, o = (llvm.Array3f64(cosine_directions(rng, 20_000)) for _ in range(2))

    def value(i, o):
        pair = Pair.of(i, o)
        tilts = Tilts.along(GGX(0.3, 0.5), pair.cos_azimuth, pair.sin_azimuth)
        return np.asarray(symmetric(pair, i.z, tilts, llvm.UInt(20), None)[1] * i.z)

    np.testing.assert_allclose(value(i, o), value(o, i), rtol=1e-9)


BAD = {
    "zero": ({"alpha": 0.0}, r"alpha = 0.0: expected a number or texture in \[0.001, 1000\]"),
    "huge": ({"alpha": 1e6}, r"alpha = 1000000.0: expected a number or texture in \[0.001, 1000\]"),
    "negative": ({"alpha_u": -0.1}, "alpha_u = -0.1"),
    "distribution": ({"distribution": "gxx"}, "distribution = 'gxx'. Did you mean 'ggx'"),
    "exponent of GGX": ({"exponent": 3.0}, 'exponent: needs distribution = "phong"'),
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
