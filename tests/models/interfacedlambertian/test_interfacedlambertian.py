"""The model: its limits, its samples, what it refuses."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import helpers
import mitsuba as mi
import numpy as np
import pytest
import scipy.integrate

from asperity.errors import ParameterError
from asperity.lab import evaluate
from asperity.models.interfacedlambertian import body

MODEL = {"type": "interfacedlambertian"}
KINDS = [("beckmann", "smith"), ("ggx", "smith"), ("beckmann", "vcavity"), ("ggx", "vcavity"), ("gaussian", "vcavity")]
KIND = pytest.mark.parametrize("distribution, masking", KINDS, ids=["-".join(kind) for kind in KINDS])
SMOOTH = {"int_ior": 1.5, "ext_ior": 1.0}


def random_pairs(lowest=0.05, n=2000):
    return [mi.Vector3f(helpers.directions(np.random.default_rng(seed), n, lowest)) for seed in (1, 2)]


def component(description, wi, wo, n):
    return helpers.values(mi.load_dict({**MODEL, **description}), wi, wo, n)


def gaussian_density(m, sigma):
    """Eq. 14, normalised by quadrature."""
    theta = np.arccos(np.clip(m[2], 0, 1))
    area, _ = scipy.integrate.quad(lambda t: 2 * np.pi * np.exp(-(t**2) / (2 * sigma**2)) * np.sin(t), 0, np.pi / 2)
    return np.exp(-(theta**2) / (2 * sigma**2)) / (area * np.cos(theta))


@KIND
def test_a_black_body_is_cook_and_torrances(rgb, distribution, masking):
    """F D G / (4 cos_i), by Mitsuba's distributions, its separable masking and Fresnel term; of cavities Eq. 15."""
    wi, wo = random_pairs()
    given = {**SMOOTH, "distribution": distribution, "masking": masking, "alpha": 0.4, "diffuse_reflectance": 0.0}
    whole, mirrored = component(given, wi, wo, 0xFFFFFFFF), component(given, wi, wo, 0)
    np.testing.assert_array_equal(whole, mirrored)
    h = dr.normalize(wi + wo)
    facing = np.array(dr.dot(wi, h))
    known = mi.MicrofacetDistribution(getattr(mi.MicrofacetType, {"ggx": "GGX"}.get(distribution, "Beckmann")), 0.4)
    D = gaussian_density(h.numpy(), 0.4) if distribution == "gaussian" else np.array(known.eval(h))
    G = np.array(known.G(wi, wo, h))
    if masking == "vcavity":
        G = np.minimum(1, 2 * np.array(h.z) * np.minimum(wi.z, wo.z) / facing)
    expected = np.array(mi.fresnel(mi.Float(facing), 1.5)[0]) * D * G / (4 * np.array(wi.z))
    np.testing.assert_allclose(mirrored[0], expected, rtol=0.01, atol=1e-5)  # Mitsuba's masking is a fit, .35 % each


@KIND
def test_flat_is_one_facet(rgb, distribution, masking):
    """f = Q T(i) T(o) / pi; the table is linear between 32 nodes, to .3 %."""
    wi, wo = random_pairs(lowest=0.1)
    given = {**SMOOTH, "distribution": distribution, "masking": masking, "alpha": 1e-3, "diffuse_reflectance": 0.7}
    found = component(given, wi, wo, 1)[0]
    scale = body.body_albedo(0.7, 1.5) / np.pi
    expected = scale * np.array(body.transmitted_twice(wi.z, wo.z, mi.Float(1.5)) * wo.z)
    np.testing.assert_allclose(found, expected, rtol=5e-3)


@pytest.mark.parametrize("sigma", [0.1, 0.3, 0.6])
def test_without_an_interface_it_is_rough_diffuse(rgb, sigma):
    """Oren and Nayar's fit, of Gaussian slopes in cavities: 7 % RMS of the integral, as they printed it in pictures."""
    wi, wo = random_pairs(lowest=0.2)
    given = {"int_ior": 1.0, "ext_ior": 1.0, "distribution": "gaussian", "masking": "vcavity", "alpha": sigma}
    found = component(given | {"diffuse_reflectance": 1.0}, wi, wo, 1)[0]
    assert (component(given, wi, wo, 0) == 0).all()
    # the fit without its second bounce: rho -> 0
    theirs = {"type": "orennayar", "sigma": float(np.degrees(sigma)), "reflectance": 1e-3}
    expected = 1e3 * helpers.values(mi.load_dict(theirs), wi, wo)[0]
    error = found / expected - 1
    assert np.sqrt((error**2).mean()) < 0.08


ALBEDO = {  # single scattering in V-cavities, n = 1.5, K_d = 1: specular and body, hemispherical, traced (3e-4)
    "beckmann": {0.1: 0.9947, 0.3: 0.9587, 0.5: 0.9028, 1.0: 0.7576},
    "ggx": {0.1: 0.979, 0.3: 0.905, 0.5: 0.828, 1.0: 0.678},
    "gaussian": {0.1: 0.990, 0.3: 0.915, 0.5: 0.794},
}


@pytest.mark.parametrize("distribution, alpha", [(name, alpha) for name, known in ALBEDO.items() for alpha in known])
def test_traced_albedos(rgb, distribution, alpha):
    """Of 2^17 samples in cosine-distributed directions: 5 standard errors; 6e-4 of the last digit and the table."""
    given = {**MODEL, **SMOOTH, "distribution": distribution, "masking": "vcavity", "alpha": alpha}
    bsdf, w = (
        mi.load_dict({**given, "diffuse_reflectance": 1.0}),
        helpers.cosine_directions(np.random.default_rng(3), 1 << 17),
    )
    weight = np.array(evaluate.sample(bsdf, mi.Vector3f(w), *evaluate.variates(1 << 17, 1))[1].x, dtype=float)
    expected, error = ALBEDO[distribution][alpha], weight.std() / weight.size**0.5
    assert weight.mean() == pytest.approx(expected, abs=5 * error + 1e-3)


def check_weights(given):
    """At 87 degrees they are below 2, and their mean is no more than all light."""
    mean, error, largest = helpers.albedo({**MODEL, **given, "ext_ior": 1.0, "diffuse_reflectance": 1.0}, 87)
    assert mean < 1 + 5 * error + 1e-3 and largest < 2


@KIND
@pytest.mark.parametrize("alpha", [0.03, 0.3, 1.2])
@pytest.mark.parametrize("n", [1.0, 1.5, 2.5])
def test_weights_at_87_degrees(rgb, distribution, masking, alpha, n):
    check_weights({"int_ior": n, "distribution": distribution, "masking": masking, "alpha": alpha})


@pytest.mark.parametrize("distribution", ["beckmann", "gaussian"])
@pytest.mark.parametrize("alpha", [0.3, 1.2])
@pytest.mark.parametrize("scattering", ["double", "multiple"])
def test_weights_of_several_bounces(rgb, distribution, alpha, scattering):
    """Where those of one bounce are largest."""
    check_weights({"int_ior": 1.5, "distribution": distribution, "alpha": alpha, "scattering": scattering})


@pytest.mark.parametrize("masking", ["smith", "vcavity"])
@pytest.mark.parametrize("key", ["alpha.value", "int_ior.value"])
def test_the_table_carries_derivatives(rgb, masking, key):
    """Those of tables made anew, and of the integral, by a mean over directions: the table's error is .2 % of it."""
    wi, wo = random_pairs(lowest=0.1)

    def mean(bsdf, by):
        params = mi.traverse(bsdf)
        params[key] = type(params[key])(0.4 if key[0] == "a" else 1.4) + by
        params.update()
        return dr.mean(
            bsdf.eval(mi.BSDFContext(mi.TransportMode.Radiance, 0xFFFFFFFF, 1), evaluate.interaction(wi), wo).x
        )

    table = mi.load_dict({**MODEL, "alpha": 0.4, "masking": masking})
    by, step = dr.opaque(mi.Float, 0), 1e-2
    dr.enable_grad(by)
    value = mean(table, by)
    dr.backward(value)
    found, difference = dr.grad(by)[0], (mean(table, mi.Float(step))[0] - mean(table, mi.Float(-step))[0]) / (2 * step)
    assert found == pytest.approx(difference, rel=0.01)


def test_tables_are_made_when_they_must(rgb):
    bsdf = mi.load_dict(MODEL)
    params, before = mi.traverse(bsdf), bsdf.model.known.result
    params["diffuse_reflectance.value"] = type(params["diffuse_reflectance.value"])(0.9)
    params.update()
    assert bsdf.model.known.result is before
    params["alpha.value"] = 0.4
    params.update()
    assert bsdf.model.known.result is not before


CHECKED = {"type": "checkerboard", "color0": 0.1, "color1": 0.5}


@pytest.mark.parametrize(
    "given, kilobytes",
    [
        ({}, 32),
        ({"masking": "vcavity"}, 64),
        ({"scattering": "double"}, 128),
        ({"alpha": CHECKED}, 32 * 9),
        ({"alpha": {**CHECKED, "color0": 0.001, "color1": 1.5}, "masking": "vcavity"}, 768),
        ({"alpha_u": 0.1, "alpha_v": 0.2}, 0),
        ({"int_ior": {**CHECKED, "color0": 1.2, "color1": 1.5}}, 0),
        ({"approximate": True}, 0),
        ({"alpha": {"type": "mesh_attribute", "name": "vertex_alpha"}}, 0),
    ],
    ids=str,
)
def test_sizes_of_tables(rgb, given, kilobytes):
    known = mi.load_dict({**MODEL, **given}).model.known.result
    tables = [one for one in (known.once, known.mixed, known.twice) if one is not None]
    assert sum(dr.width(one.table.entries) for one in tables) * 4 / 1024 == kilobytes


HIDDEN = {"type": "mesh_attribute", "name": "vertex_alpha"}


@pytest.mark.parametrize(
    "alpha, tabulated",
    [
        ({**CHECKED, "color1": HIDDEN}, False),
        ({**CHECKED, "color1": {**CHECKED, "color0": HIDDEN}}, False),
        ({"type": "settled", "top": HIDDEN, "bottom": 0.1}, False),
        ({**CHECKED, "color1": CHECKED}, True),
        ({"type": "settled", "top": 0.4, "bottom": 0.1}, True),
    ],
    ids=str,
)
def test_tables_end_where_textures_do(rgb, alpha, tabulated):
    """Where a texture hides some of its numbers, nothing is known of its ends: facets are summed."""
    assert (mi.load_dict({**MODEL, "alpha": alpha}).model.known.result.once is not None) is tabulated


BAD = {
    "indices": ({"int_ior": 1.2, "ext_ior": 1.5}, "int_ior = 1.2: expected at least ext_ior = 1.5"),
    "smooth": ({"alpha": 0.0}, r"alpha = 0.0: expected a number or texture in \[0.001, 1.5\]"),
    "wide": (
        {"alpha": 0.5, "distribution": "gaussian"},
        'alpha = 0.5: masking = "smith" of "gaussian" ends at 0.35; use',
    ),
    "texels": ({"alpha": CHECKED, "distribution": "gaussian"}, "alpha = 0.5: masking"),
    "stretched": ({"alpha_u": 0.2, "distribution": "gaussian"}, "needs one alpha; use masking"),
    "both": ({"alpha": 0.2, "alpha_u": 0.2}, "alpha and alpha_u exclude each other"),
    "smith": (
        {"scattering": "double", "masking": "smith"},
        'scattering = "double" is in V-cavities; use masking',
    ),
    "textured double": (
        {"scattering": "double", "int_ior": {**CHECKED, "color0": 1.2, "color1": 2.0}},
        'int_ior: a texture, where one number for the whole surface is expected by scattering = "double"',
    ),
    "textured multiple": (
        {"scattering": "multiple", "alpha": CHECKED},
        'alpha: a texture, where one number for the whole surface is expected by scattering = "multiple"',
    ),
    "textured indices": (
        {"int_ior": {**CHECKED, "color0": 1.0, "color1": 1.1}, "ext_ior": 1.5},
        "int_ior = 1: expected at least ext_ior = 1.5",
    ),
    "phong": ({"distribution": "phong"}, "distribution = 'phong'"),
}


@pytest.mark.parametrize("given, message", BAD.values(), ids=BAD)
def test_what_does_not_go_together_is_refused(rgb, given, message):
    with pytest.raises(RuntimeError, match=f"ParameterError: .*{message}"):
        mi.load_dict({**MODEL, **given})


def test_air_is_as_thin_as_a_vacuum(rgb):
    """An index of 1 in air, 1.00028, is meant to be no interface."""
    wi, wo = random_pairs()
    assert (component({"int_ior": 1.0}, wi, wo, 0) == 0).all()


def test_updates_are_checked(rgb):
    params = mi.traverse(mi.load_dict(MODEL))
    params["ext_ior.value"] = 2.0
    with pytest.raises(ParameterError, match=r"int_ior = 1\.5046: expected at least ext_ior = 2"):
        params.update()
