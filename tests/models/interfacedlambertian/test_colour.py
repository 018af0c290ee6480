"""Colour, which deepens with the index (Meneveaux et al. 2018, Fig. 5), and is the same by wavelength as in RGB."""

import asperity  # noqa: F401  isort: skip
import helpers
import mitsuba as mi
import numpy as np
import pytest

from asperity.lab import evaluate

PATCHES = {"orange": [0.672, 0.209, 0.025], "blue flower": [0.235, 0.216, 0.440], "bluish green": [0.136, 0.509, 0.402]}
"""Of the ColorChecker, in linear RGB: those that the documentation shows."""
INDICES = 1.0, 1.2, 1.33, 1.5


def paint(colour, n=1.5, **others):
    given = {"int_ior": n, "ext_ior": 1.0, "alpha": 0.3, "diffuse_reflectance": colour}
    return {"type": "interfacedlambertian", **given, **others}


def saturation(colour, n, **others):
    """1 - least / greatest channel of the body's light, far from the mirror direction."""
    wi, wo = (evaluate.vectors(helpers.towards(*angles)[None]) for angles in ((20, 0), (40, 90)))
    value = helpers.values(paint({"type": "rgb", "value": colour}, n, **others), wi, wo, 1).ravel()
    return 1 - value.min() / value.max()


@pytest.mark.parametrize("scattering", ["single", "multiple"])
@pytest.mark.parametrize("patch", PATCHES)
def test_saturation_grows_with_the_index(rgb, patch, scattering):
    found = [saturation(PATCHES[patch], n, scattering=scattering, alpha=0.6) for n in INDICES]
    assert np.all(np.diff(found) > 2e-3)
    if scattering == "single":
        assert found[0] == pytest.approx(1 - min(PATCHES[patch]) / max(PATCHES[patch]), abs=1e-5)


def test_saturation_grows_with_bounces(rgb):
    """What meets two bodies has the square of their colour; without an interface, too."""
    colour = PATCHES["orange"]
    single, multiple = (
        saturation(colour, 1.0, scattering=s, masking="vcavity", alpha=0.8) for s in ("single", "multiple")
    )
    assert multiple > single + 1e-3


@pytest.mark.parametrize("scattering", ["single", "double", "multiple"])
def test_each_wavelength_is_a_grey_of_its_own(scattering):
    """All colour is in Q: what a spectrum has at a wavelength is what a grey of that reflectance has, in any variant.

    To the rounding of tables that are made anew: 1e-5.
    """
    rng = np.random.default_rng(0)
    wi, wo = helpers.directions(rng, 64, lowest=0.1), helpers.directions(rng, 64, lowest=0.1)
    wavelengths, greys = (450.0, 500.0, 550.0, 600.0), (0.05, 0.3, 0.7, 1.0)

    def values(colour, **options):
        bsdf = evaluate.load(paint(colour, scattering=scattering))
        return evaluate.at_pairs(bsdf, wi.T, wo.T, **options)[:-1]

    mi.set_variant("llvm_ad_spectral")
    spectrum = {
        "type": "irregular",
        "wavelengths": ", ".join(map(str, wavelengths)),
        "values": ", ".join(map(str, greys)),
    }
    by_wavelength, grey = (values(colour, wavelengths=wavelengths) for colour in (spectrum, 0.3))
    mi.set_variant("llvm_ad_rgb")
    for k, reflectance in enumerate(greys):
        expected = values({"type": "rgb", "value": [reflectance] * 3})[0]
        np.testing.assert_allclose(by_wavelength[k], expected, rtol=1e-5)
        if reflectance == 0.3:
            np.testing.assert_allclose(grey, np.broadcast_to(expected, grey.shape), rtol=1e-5)
