"""Values in spectral and polarised variants: against those in RGB, and at each wavelength against analytic ones."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import numpy as np
import pytest

from asperity.lab import evaluate
from asperity.models import MODELS

WAVELENGTHS = [450.0, 500, 550, 640]
SPECTRUM = {"type": "irregular", "wavelengths": "400, 500, 600, 700", "values": "0.2, 0.8, 0.4, 0.6"}
AT = np.interp(WAVELENGTHS, [400, 500, 600, 700], [0.2, 0.8, 0.4, 0.6])
METALS = {"micrograin": {}, "vgroove": {"max_bounces": 1}, "deon": {}, "merillou": {}, "twoscale": {"sigma_s": 0.0}}
COLOURS = {
    "diffuse": ({"type": "micrograin", "specular": False}, "diffuse_reflectance"),
    "coated": ({"type": "micrograin", "int_ior": 1.5}, "diffuse_reflectance"),
    "smith": ({"type": "micrograin", "specular": False, "masking": "smith"}, "diffuse_reflectance"),
    "second colour": (
        {"type": "micrograin", "specular": False, "variation": "height", "diffuse_reflectance": 0.3},
        "diffuse_reflectance_2",
    ),
    "multiple": ({"type": "micrograin", "specular": False, "scattering": "multiple"}, "diffuse_reflectance"),
    "tinted metal": ({"type": "micrograin", "edge_tint": 0.3}, "reflectivity"),
    "edge tint": ({"type": "micrograin", "reflectivity": 0.6}, "edge_tint"),
    "tinted grooves": ({"type": "vgroove", "edge_tint": 0.3}, "reflectivity"),
    "soft grooves": ({"type": "vgroove", "symmetric": False, "alpha_u": 0.3, "alpha_v": 0.31}, "reflectivity"),
    "deon": ({"type": "deon"}, "reflectivity"),
    "merillou": ({"type": "merillou"}, "reflectivity"),
    "lambertsphere": ({"type": "lambertsphere"}, "reflectance"),
    "particles": ({"type": "lambertsphere"}, "albedo"),
    "published": ({"type": "lambertsphere", "variant": "published"}, "reflectance"),
    "fast": ({"type": "lambertsphere", "variant": "fast"}, "reflectance"),
    "chandrasekhar": ({"type": "chandrasekhar"}, "reflectance"),
    "interfacedlambertian": ({"type": "interfacedlambertian"}, "diffuse_reflectance"),
    "cavities": ({"type": "interfacedlambertian", "scattering": "multiple"}, "diffuse_reflectance"),
    "orennayar": ({"type": "orennayar"}, "reflectance"),
    "twoscale": ({"type": "twoscale", "sigma_s": 0.0}, "reflectivity"),  # what is diffracted differs by wavelength
}


def fresnel_at_normal(eta, k):
    return ((eta - 1) ** 2 + k**2) / ((eta + 1) ** 2 + k**2)


def values(description, wavelengths=WAVELENGTHS):
    """(wavelengths or channels, pairs)."""
    wi, wo = (evaluate.uniform_hemisphere(50, seed) for seed in (1, 2))
    bsdf = mi.load_dict(description)
    value = bsdf.eval(mi.BSDFContext(), evaluate.interaction(wi, 50, wavelengths), wo)
    return np.array(mi.unpolarized_spectrum(value))


def test_every_model_is_here():
    assert {description["type"] for description, _ in COLOURS.values()} == set(MODELS)


@pytest.mark.parametrize("model, given", METALS.items(), ids=METALS)
def test_metals_of_ones_own(model, given):
    """eta and k as spectra beyond 1: at normal incidence, what a mirror would reflect times Fresnel."""
    mi.set_variant("llvm_ad_spectral")
    eta = {"type": "irregular", "wavelengths": "400, 450, 700", "values": "1.2, 1.3, 1.5"}
    k = {"type": "regular", "wavelength_min": 400.0, "wavelength_max": 700.0, "values": "1.95, 1.95"}
    si, n = evaluate.interaction(mi.Vector3f(0, 0, 1), 1, WAVELENGTHS), mi.Vector3f(0, 0, 1)
    metal, mirror = (
        np.array(mi.load_dict({"type": model, **given, **more}).eval(mi.BSDFContext(), si, n)).ravel()
        for more in ({"eta": eta, "k": k}, {})
    )
    expected = fresnel_at_normal(np.interp(WAVELENGTHS, [400, 450, 700], [1.2, 1.3, 1.5]), 1.95)
    assert expected[0] == pytest.approx(0.4281, abs=1e-4)
    np.testing.assert_allclose(metal / mirror, expected, rtol=1e-5)


@pytest.mark.parametrize("description, name", COLOURS.values(), ids=COLOURS)
def test_each_wavelength_has_its_own_value(description, name):
    """A spectrum gives at each wavelength what a grey of its value gives in RGB. V-grooves fit ln F: 1e-4."""
    mi.set_variant("llvm_ad_spectral")
    spectral = values({**description, name: SPECTRUM})
    mi.set_variant("llvm_ad_rgb")
    for row, grey in zip(spectral, AT):
        np.testing.assert_allclose(row, values({**description, name: float(grey)})[0], rtol=1e-4, atol=1e-6)


@pytest.mark.parametrize("variant", [pytest.param("llvm_ad_mono", marks=pytest.mark.slow), "llvm_ad_mono_polarized"])
@pytest.mark.parametrize("description, name", COLOURS.values(), ids=COLOURS)
def test_greys_are_the_same_in_every_variant(variant, description, name):
    """Unpolarised light in polarised variants too; to a few roundings."""
    mi.set_variant("llvm_ad_rgb")
    expected = values({**description, name: 0.4})[0]
    mi.set_variant(variant)
    for row in values({**description, name: 0.4}):
        np.testing.assert_allclose(row, expected, rtol=1e-5, atol=1e-7)


@pytest.mark.parametrize(
    "given, message",
    [
        ({"eta": {"type": "irregular", "wavelengths": "400, 700", "values": "0, 1"}, "k": 1.0}, "eta = 0 "),
        ({"eta": 1.0, "k": {"type": "irregular", "wavelengths": "400, 500, 700", "values": "0.1, inf, 1"}}, "k = inf"),
        ({"diffuse_reflectance": {"type": "irregular", "wavelengths": "400, 700", "values": "0.1, 1.4"}}, "= 1.4 "),
        ({"tau_0": SPECTRUM}, "tau_0: a colour or spectrum, where one number is expected"),
    ],
    ids=["eta", "k", "reflectance", "number"],
)
def test_spectra_have_ranges(given, message):
    mi.set_variant("llvm_ad_spectral")
    with pytest.raises(RuntimeError, match=message):
        mi.load_dict({"type": "micrograin", **given})
