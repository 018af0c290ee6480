"""The micrograin model against numbers traced through explicit grains.

They come from ray-traced Poisson half-ellipsoids, periodic tiles of 2 to 4 10^5 grains. A tile's own randomness moves
an albedo by up to 0.003.
"""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import helpers
import mitsuba as mi
import pytest

WHITE = {"type": "diffuse", "reflectance": 1.0}


def albedo(theta, phi=0.3, **parameters):
    return helpers.albedo({"type": "micrograin", **parameters}, theta, phi)


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
