"""What `scattering: multiple` returns."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import helpers
import mitsuba as mi
import pytest

SLOW, MORE = pytest.mark.slow, [("correlated", 0.01), ("height", 0.5), ("correlated", 0.97)]
WHITE = {"type": "diffuse", "reflectance": 1.0}


def albedo(theta, phi=0.3, **parameters):
    return helpers.albedo({"type": "micrograin", **parameters}, theta, phi)


@pytest.mark.parametrize(
    "diffuse_grains", [{}, {"specular": False, "diffuse_reflectance": 1.0}], ids=["mirror", "diffuse"]
)
@pytest.mark.parametrize("beta", [(0.1, 0.1), (1.0, 1.0), (5.0, 5.0), pytest.param((0.1, 3.0), marks=SLOW)])
@pytest.mark.parametrize("masking, tau_0", [("correlated", 0.2), *(pytest.param(*case, marks=SLOW) for case in MORE)])
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
