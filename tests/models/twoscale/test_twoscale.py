"""The model: its limits, its energy, its samples, its wavelengths, what it refuses."""

import asperity  # noqa: F401  isort: skip
import helpers
import mitsuba as mi
import numpy as np
import pytest
import references
from helpers import float64
from scipy.special import gamma

from asperity.errors import ParameterError
from asperity.lab import evaluate
from asperity.microfacet import epd

MODEL = {"type": "twoscale"}
KNOWN = {"alpha": 0.1, "p": 0.7, "sigma_s": 0.05, "b": 1.2, "c": 2.3}
GREEN = {"wavelengths": [0.55, 0.55, 0.55]}


def pairs(n=2000, lowest=0.02):
    return [mi.Vector3f(helpers.directions(np.random.default_rng(seed), n, lowest)) for seed in (1, 2)]


@pytest.mark.parametrize("alpha", [0.05, 0.2, 0.5])
def test_without_the_finer_roughness_it_is_rough_metal(rgb, alpha):
    """Mitsuba's `roughconductor`, whose masking is a fit, good to .35 % a direction; ours is a table, to .08 %."""
    metal = {"eta": 0.2, "k": 3.4}
    ours = {**MODEL, **metal, "alpha": alpha, "p": 1.0, "sigma_s": 0.0, "masking": "separable"}
    theirs = {"type": "roughconductor", **metal, "alpha": alpha, "distribution": "beckmann"}
    found, expected = (helpers.values(one, *pairs(20_000))[0] for one in (ours, theirs))
    seen = expected > 1e-6
    np.testing.assert_allclose(found[seen], expected[seen], rtol=9e-3)


def exact(i, o, alpha, p, sigma, b, c, wavelength):
    """(f, f of what is mirrored) of a mirror with the masking "height", by quadrature and formulas of its own."""
    h = (i + o) / np.linalg.norm(i + o)
    cos_d, theta = i @ h, np.arctan2(np.hypot(*h[:2]), h[2])
    B, sin_d = b / wavelength, np.linalg.norm(i - o) / 2
    R = references.propagating(min(sin_d, 1 - 1e-12), B, c)
    share = -np.expm1(-((4 * np.pi * sigma * cos_d / wavelength) ** 2) * R)
    slopes = alpha * np.array([np.hypot(*w[:2]) / w[2] for w in (i, o)])
    G = 1 / (1 + np.array(epd.smith_lambda(float64(p), float64(slopes))).sum())
    x = np.tan(theta) ** 2 / alpha**2
    D = p / (np.pi * alpha**2 * gamma(1 / p)) * np.exp(-(x**p)) / h[2] ** 4
    convolved = B * B * (c - 1) / (2 * np.pi * R) * references.convolution(theta, B * cos_d, c, alpha, alpha, p)
    mirrored = (1 - share) * D * G / (4 * i[2] * o[2])
    return mirrored + share * G * convolved, mirrored


@pytest.mark.parametrize(
    "p, alpha, b, c", [(0.7, 0.1, 1.2, 2.3), (1, 0.3, 4.0, 1.5), (0.4, 0.1, 0.5, 2.9), (3, 0.05, 9, 2)]
)
def test_values_are_those_of_the_formulas(rgb, p, alpha, b, c):
    """In float32, to the .3 % of tables: masking .05 %, R .01 %, the convolution .2 %; 25 pairs, some grazing."""
    rng, sigma = np.random.default_rng(7), 0.03
    i, o = (helpers.directions(rng, 25, 0.01) for _ in range(2))
    o[:, :8] = helpers.unit(i[:, :8] * [[-1], [-1], [1]] + 0.05 * rng.normal(size=(3, 8)))
    o[2] = np.abs(o[2])
    given = {
        **MODEL,
        "alpha": alpha,
        "p": float(p),
        "sigma_s": sigma,
        "b": float(b),
        "c": float(c),
        "masking": "height",
    }
    bsdf = mi.load_dict(given)
    found = [helpers.values(bsdf, mi.Vector3f(i), mi.Vector3f(o), n) / o[2] for n in (0xFFFFFFFF, 0)]
    for channel, wavelength in enumerate((0.653, 0.546, 0.444)):
        expected = np.array([exact(a, b_, alpha, p, sigma, b, c, wavelength) for a, b_ in zip(i.T, o.T)]).T
        for value, right in zip(found, expected):
            np.testing.assert_allclose(value[channel], right, rtol=4e-3, atol=1e-6)


ALBEDOS = {  # theta in radians: mirrored, diffracted, both if energy is conserved; by quadrature, to 2e-4
    0.0: (0.42144, 0.49719, 0.9904),
    0.5: (0.54315, 0.39639, None),
    1.0: (0.82942, 0.18264, 0.9924),
    1.3: (0.90464, 0.09097, 0.9476),
    1.45: (0.89402, 0.05925, None),
}


@pytest.mark.parametrize("theta", ALBEDOS)
def test_known_albedos(rgb, theta):
    """Of 2^18 samples, by standard errors. What conserves energy was known to a table's .001."""
    bsdf, conserving = (
        mi.load_dict({**MODEL, **KNOWN, **GREEN, "energy": energy}) for energy in ("published", "conserving")
    )
    w = np.array([np.sin(theta), 0, np.cos(theta)])
    mirrored, diffracted, total = ALBEDOS[theta]
    for one, component, expected in ((bsdf, 0, mirrored), (bsdf, 1, diffracted), (conserving, 0xFFFFFFFF, total)):
        context = mi.BSDFContext(mi.TransportMode.Radiance, 0xFFFFFFFF, component)
        si = evaluate.interaction(evaluate.vectors(w[None]), 1 << 18)
        weight = np.array(one.sample(context, si, *evaluate.variates(1 << 18, 1))[1].x, dtype=float)
        if expected is not None:
            tolerance = 5 * weight.std() / 2**9 + (2e-4 if component < 2 else 1e-3)
            assert weight.mean() == pytest.approx(expected, abs=tolerance)


@pytest.mark.parametrize("seed", range(8))
def test_energy_is_conserved(rgb, seed):
    """Of mirrors, in which nothing else is lost: at most 1.005, where heights are below a quarter of the wavelength."""
    alpha, p, b, c = map(float, references.material(np.random.default_rng(seed)))
    sigma = float(np.random.default_rng(seed).uniform(0.01, 0.11))
    given = {"alpha": alpha, "p": p, "b": b, "c": c, "sigma_s": sigma, "energy": "conserving"}
    bsdf = mi.load_dict({**MODEL, **given})
    for theta in (0, 30, 60, 75, 86):
        weight = np.asarray(helpers.draw(bsdf, helpers.towards(theta), 1 << 16)[1], dtype=float)
        error = weight.std(axis=1) / 2**8
        assert (weight.mean(axis=1) < 1.005 + 4 * error).all() and (weight.mean(axis=1) > 0.85).all()


MATERIALS = [
    {"alpha": 0.09, "p": 0.7, "sigma_s": 0.02, "b": 1.3},
    {"alpha": 0.05, "p": 1.4, "sigma_s": 0.06, "b": 0.8},
    {"alpha": 0.3, "p": 1.0, "sigma_s": 0.03, "b": 0.5},
    {"alpha": 0.05, "p": 0.35, "sigma_s": 0.04, "b": 2.0},
    {"alpha": 0.1, "p": 0.7, "sigma_s": 0.05, "b": 20.0},
    {"alpha_u": 0.3, "alpha_v": 0.06, "p": 1.0, "sigma_s": 0.04},
]
MATERIAL = pytest.mark.parametrize("given", MATERIALS, ids=str)


@MATERIAL
def test_weights_at_87_degrees(rgb, given):
    """Bounded, of mirrors; 2.7 of the longest tails."""
    for phi in (0, 90):
        assert helpers.draw(mi.load_dict({**MODEL, **given}), helpers.towards(87, phi))[1].x.numpy().max() < 3


@MATERIAL
@pytest.mark.parametrize("theta", [0, 45, 75])
def test_less_noise_than_by_facets_or_by_the_cosine_alone(rgb, given, theta):
    """Deviation of the weight over its mean, int f^2 / pdf, by one set of samples: others hardly meet what weighs most.

    Ours was .44 at most in a prototype. Facets alone do a little better where they are as wide as all that is
    diffracted; where they are not, weights go into the thousands.
    """
    bsdf, n = mi.load_dict({**MODEL, **given}), 1 << 16
    si, numbers = evaluate.interaction(evaluate.vectors(helpers.towards(theta)[None]), n), evaluate.variates(n, 1)
    wo = bsdf.sample(mi.BSDFContext(), si, *numbers)[0].wo
    value, pdf = (
        np.array(x, dtype=float) for x in (bsdf.eval(mi.BSDFContext(), si, wo).x, bsdf.pdf(mi.BSDFContext(), si, wo))
    )
    facets = bsdf.pdf(mi.BSDFContext(mi.TransportMode.Radiance, 0xFFFFFFFF, 0), si, wo)
    drawn = pdf > 0

    def deviation(density):
        density = np.maximum(np.array(density, dtype=float), 1e-30)[drawn]
        square = (value[drawn] ** 2 / (density * pdf[drawn])).sum() / n
        return np.sqrt(square / ((value[drawn] / pdf[drawn]).sum() / n) ** 2 - 1)

    ours = deviation(pdf)
    assert ours < 0.5 and ours < 0.5 * deviation(wo.z / np.pi) and ours < deviation(facets) + 0.05
    assert deviation(facets) > 2 or given not in MATERIALS[:2]


@pytest.mark.parametrize("energy", ["published", "conserving"])
def test_every_wavelength_is_diffracted_as_in_rgb(energy):
    """Of a spectral variant's four, against three channels at those: tables of different nodes, .3 % each."""
    sampled, given = [430.0, 500.0, 560.0, 680.0], {**MODEL, **KNOWN, "energy": energy}
    mi.set_variant("llvm_ad_spectral")
    bsdf, (wi, wo) = mi.load_dict(given), pairs(500, 0.1)
    spectral = np.array(bsdf.eval(mi.BSDFContext(), evaluate.interaction(wi, 500, sampled), wo))
    assert (np.diff(spectral, axis=0) != 0).any(axis=1).all()
    mi.set_variant("llvm_ad_rgb")
    for three in (slice(0, 3), slice(1, 4)):
        wavelengths = [one / 1000 for one in sampled[three]]
        found = helpers.values({**given, "wavelengths": wavelengths}, *pairs(500, 0.1))
        np.testing.assert_allclose(spectral[three], found, rtol=6e-3, atol=1e-6)


def test_mono_is_the_middle_wavelength():
    found = []
    for variant in ("llvm_ad_mono", "llvm_ad_rgb"):
        mi.set_variant(variant)
        found.append(helpers.values({**MODEL, **KNOWN, "wavelengths": [0.7, 0.5, 0.4]}, *pairs(500)))
    np.testing.assert_allclose(found[0][0], found[1][1], rtol=5e-3, atol=1e-6)


def test_short_waves_are_diffracted_more_and_less_far(rgb):
    """The haze is blue, its far end red: the lobe of the frequency, by the wavelength."""
    bsdf = mi.load_dict({**MODEL, **KNOWN, "b": 3.0})
    haze = helpers.values(bsdf, mi.Vector3f(0, 0, 1), mi.Vector3f(0.2, 0, 0.98), 1).ravel()
    kept = helpers.values(bsdf, mi.Vector3f(0, 0, 1), mi.Vector3f(0, 0, 1), 0).ravel()
    assert (np.diff(haze) > 0).all() and (np.diff(kept) < 0).all()


def test_two_roughnesses_turn_with_the_axes_and_meet_one(rgb):
    """Tables of one roughness have three channels, of two one: .3 % each."""
    wi, wo = pairs()
    turned = [mi.Vector3f(-w.y, w.x, w.z) for w in (wi, wo)]
    along, across = ({**MODEL, "alpha_u": u, "alpha_v": v, "sigma_s": 0.05} for u, v in ((0.2, 0.05), (0.05, 0.2)))
    np.testing.assert_allclose(helpers.values(along, wi, wo), helpers.values(across, *turned), rtol=1e-3, atol=1e-5)
    same, one = {**MODEL, "alpha_u": 0.1, "alpha_v": 0.1, "sigma_s": 0.05}, {**MODEL, "sigma_s": 0.05}
    np.testing.assert_allclose(helpers.values(same, wi, wo), helpers.values(one, wi, wo), rtol=6e-3, atol=1e-5)


CHECKED = {"type": "checkerboard", "color0": 0.1, "color1": 0.5}
BAD = {
    "c": ({"c": 1.0}, r"c = 1.0: expected a number in \[1.02, 5\]"),
    "p": ({"p": 6.0}, r"p = 6.0: expected a number in \[0.2, 5\]"),
    "b": ({"b": 0.0}, r"b = 0.0: expected a number in \[0.02, 30\]"),
    "sigma_s": ({"sigma_s": -0.1}, r"sigma_s = -0.1: expected a number or texture in \[0, 10\]"),
    "nanometres": (
        {"wavelengths": [650.0, 550.0, 450.0]},
        r"wavelengths = 650 µm: expected three numbers in \[0.1, 20\] µm; 650 nm are 0.65 µm",
    ),
    "negative": ({"wavelengths": [0.65, -0.55, 0.45]}, r"wavelengths = -0.55 µm: expected three numbers in"),
    "one": ({"wavelengths": 0.55}, r"wavelengths = 0.55: expected three numbers in \[0.1, 20\] µm"),
    "textured alpha": ({"alpha": CHECKED}, "alpha: a texture, where one number for the whole surface is expected"),
    "textured alpha_u": ({"alpha_u": CHECKED}, "alpha_u: a texture, where one number"),
    "textured p": (
        {"p": {**CHECKED, "color0": 0.7}},
        "p: a texture, where one number for the whole surface is expected",
    ),
    "textured b": ({"b": CHECKED}, "b: a texture, where one number"),
    "textured c": ({"c": {**CHECKED, "color0": 1.5, "color1": 2.0}}, "c: a texture, where one number"),
    "masking": ({"masking": "vcavity"}, "masking = 'vcavity'. Allowed: direction, height, separable"),
    "energy": ({"energy": "conserve"}, "energy = 'conserve'. Did you mean 'conserving'"),
}


@pytest.mark.parametrize("given, message", BAD.values(), ids=BAD)
def test_what_is_refused(rgb, given, message):
    with pytest.raises(RuntimeError, match=f"ParameterError: {message}"):
        mi.load_dict({**MODEL, **given})


def test_updates_are_checked(rgb):
    params = mi.traverse(mi.load_dict(MODEL))
    params["c.value"] = 0.9
    with pytest.raises(ParameterError, match=r"c = 0.9 .*expected a number in \[1.02, 5\]"):
        params.update()


def test_heights_may_be_a_texture(rgb):
    """Each point as if it were everywhere."""
    wi, wo = pairs(500)
    bsdf, si = mi.load_dict({**MODEL, "sigma_s": CHECKED}), evaluate.interaction(wi)
    for x, sigma in ((0.75, 0.1), (0.25, 0.5)):
        si.uv = mi.Point2f(x, 0.25)
        found = np.array(bsdf.eval(mi.BSDFContext(), si, wo))
        np.testing.assert_allclose(found, helpers.values({**MODEL, "sigma_s": sigma}, wi, wo), rtol=1e-4, atol=1e-6)


def test_what_is_stretched_too_far_is_warned_of(rgb):
    with pytest.warns(UserWarning, match="alpha_u : alpha_v = 10 : 1: beyond 5 : 1 the haze is off"):
        mi.load_dict({"type": "twoscale", "alpha_u": 0.3, "alpha_v": 0.03})


def test_long_correlations_conserve_energy(rgb):
    """Where the power spectrum is that steep, shares of it round to 1."""
    bsdf = mi.load_dict(
        {"type": "twoscale", "b": 30.0, "c": 5.0, "energy": "conserving", "wavelengths": [0.4, 0.2, 0.1]}
    )
    assert np.isfinite(np.array(bsdf.model.known.result.lost.table.entries)).all()
