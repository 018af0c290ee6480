"""The ground truth of the model, against published and recomputed numbers, and Mitsuba's facets."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import numpy as np
import pytest
from helpers import gauss, towards

from asperity.errors import ParameterError
from asperity.goniophotometer import Hemisphere, Points, measure
from asperity.lab import evaluate
from asperity.models.interfacedlambertian.microgeometry import ExplicitCavities, InterfacedFacet

FIG_7 = {
    0.1: (0.9947, 0.9991),
    0.3: (0.9587, 0.9972),
    0.7: (0.8418, 0.9649),
    1.5: (0.6458, 0.8404),
}
"""Hemispherical reflectance after one bounce and after two, of a white body under an interface of index 1.5.

As in the paper's Fig. 7, by an independent tracer, with a standard error of 3e-4."""


@pytest.mark.parametrize(("alpha", "published"), FIG_7.items())
def test_reflectance_of_rough_surfaces(rgb, alpha, published):
    """All bounces return all light: nothing is lost, at any angle."""
    cos, weight = gauss(12)
    incident = [(float(np.degrees(np.arccos(c))), 0.0) for c in cos]
    cavities = ExplicitCavities("beckmann", alpha, alpha, albedo=1.0)
    measured = measure(cavities, incident, apart=3, paths=2**18, tiles=16, sensor=Hemisphere(1, 1))
    weight = 2 * cos * weight
    mean = np.cumsum(weight @ measured.albedo.value[..., 0])
    error = np.sqrt(np.cumsum(np.square(weight) @ np.square(measured.albedo.error[..., 0])))
    assert np.all(np.abs(mean[:2] - published) < 5 * np.hypot(error[:2], 3e-4)), mean
    total = measured.total_albedo
    assert np.all(np.abs(total.value - 1) < 5 * total.error)
    assert total.error.max() < 5e-4


@pytest.mark.parametrize("eta", [1.2, 1.5, 1.9])
def test_a_facet_is_nonlinear_plastic(rgb, eta):
    """But for the inner reflectance, of which Mitsuba has a fit: .1 % for a white body and these indices."""
    plastic = {"type": "plastic", "int_ior": eta, "ext_ior": 1.0, "diffuse_reflectance": 0.9, "nonlinear": True}
    ours, si = InterfacedFacet(0.9, eta), evaluate.interaction(evaluate.vectors(towards(50)[None]), 3)
    wo = evaluate.vectors(np.stack([towards(theta, 80) for theta in (5, 40, 80)]))
    found, expected = (np.array(bsdf.eval(mi.BSDFContext(), si, wo, True)) for bsdf in (ours, mi.load_dict(plastic)))
    assert found == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize(
    ("wrong", "complaint"),
    [
        ({"alpha_u": 0}, "alpha_u = 0: expected a number above 0"),
        ({"alpha_v": {"type": "bitmap"}}, "alpha_v = .*alike everywhere"),
        ({"albedo": 1.2}, r"albedo = 1.2: expected one number in \[0, 1\]"),
        ({"albedo": (0.1, 0.2)}, "or three"),
        ({"eta": 0.9}, r"eta = 0.9: expected a relative index in \[1, 5\]"),
    ],
)
def test_wrong_cavities_are_refused(wrong, complaint):
    with pytest.raises(ParameterError, match=complaint):
        ExplicitCavities(**wrong)


def test_mirrors_cannot_be_aimed_at(rgb):
    """They are in these facets, which are none of Mitsuba's BSDFs."""
    with pytest.raises(ParameterError, match=r"'facets' are mirrors \(InterfacedFacet\)"):
        measure(ExplicitCavities(), [(30, 0)], sensor=Points(((30, 0),)), paths=1)
