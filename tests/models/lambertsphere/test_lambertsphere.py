"""The plugins of half spaces, and of their phase function in a medium.

"Notes" are our own (shared/notes/lambertsphere.md); so are the sections that are cited.
"""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from helpers import gauss, pair, root

from asperity.lab import evaluate
from asperity.models.lambertsphere import transport

N = 1 << 18
FLOAT32 = 1e-5
"""Relative: a hundred roundings."""


def draw(bsdf, cosine, n=N):
    """Samples along one direction: weights (3, n) and cosines."""
    wi = mi.Vector3f(float(np.sqrt(1 - cosine**2)), 0, float(cosine))
    rng = mi.PCG32(size=n)
    u = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    bs, weight = mi.load_dict(bsdf).sample(mi.BSDFContext(), evaluate.interaction(wi, n), *u)
    return np.array(weight), np.array(bs.wo.z)


@pytest.mark.parametrize("model", ["lambertsphere", "chandrasekhar"])
@pytest.mark.parametrize("cosine", [1.0, 0.5, 0.1, 0.01, 1e-3])
def test_white_furnace(rgb, model, cosine):
    """The fit's 1e-3, and 4 standard errors of 2^18 weights of deviation < .2: 1.6e-3. Together below .3 %."""
    weight, _ = draw({"type": model, "albedo": 1.0}, cosine)
    assert weight.mean() == pytest.approx(1, abs=0.003)


@pytest.mark.parametrize("model", ["lambertsphere", "chandrasekhar"])
@pytest.mark.parametrize("reflectance", [0.05, 0.5, 0.95])
def test_reflectance_is_what_uniform_light_shows(rgb, model, reflectance):
    """The mean of `eval_diffuse_reflectance` over cosines: 3e-4 by 7(d), .5 standard for isotropic H: 5e-4."""
    t, weights = gauss(16)
    si = dr.zeros(mi.SurfaceInteraction3f, 16)
    si.wi = mi.Vector3f(mi.Float(np.sqrt(1 - t * t)), 0, mi.Float(t))
    shown = np.array(mi.load_dict({"type": model, "reflectance": reflectance}).eval_diffuse_reflectance(si))
    assert (shown * 2 * t * weights).sum(axis=1) == pytest.approx(np.full(3, reflectance), abs=5e-4)


def test_closed_albedo_is_that_of_samples(rgb):
    """Fits 1.2e-3 apart at most; 4 standard errors of 2^18 weights of relative deviation < .35 are .3 %."""
    for variant in ("accurate", "published", "fast"):
        bsdf = {"type": "lambertsphere", "albedo": 0.7, "variant": variant}
        for cosine in (1.0, 0.2):
            si = dr.zeros(mi.SurfaceInteraction3f)
            si.wi = mi.Vector3f(float(np.sqrt(1 - cosine**2)), 0, cosine)
            shown = float(mi.load_dict(bsdf).eval_diffuse_reflectance(si)[0][0])
            # the sampled kind takes 256 stratified samples: 1 %
            tolerance = 1.2e-3 + 0.003 * shown if variant == "accurate" else 0.01 * shown
            assert draw(bsdf, cosine)[0].mean() == pytest.approx(shown, abs=tolerance)


@pytest.mark.parametrize(
    "c, degrees, deviation, cosine_sampling",
    [(0.05, 75, 0.30, 0.78), (0.05, 86, 0.21, 1.13), (0.6, 86, 0.17, 0.85), (0.95, 86, 0.15, 0.60)],
)
def test_weights_hardly_vary(rgb, c, degrees, deviation, cosine_sampling):
    """Deviation over mean (section 8), to 3 %: of weights for our mixture, and for sampling by cosine."""
    cosine = np.cos(np.radians(degrees))
    weight, _ = draw({"type": "lambertsphere", "albedo": c}, cosine)
    assert weight[0].std() / weight[0].mean() < deviation * 1.03
    rng = np.random.default_rng(5)
    v, phi = np.sqrt(rng.random(N)), 2 * np.pi * rng.random(N)
    by_cosine = np.array(transport.accurate(pair(cosine, v, phi), root(c))) * np.pi
    assert by_cosine.std() / by_cosine.mean() == pytest.approx(cosine_sampling, rel=0.03)


def test_limits(rgb):
    wi, wo = (evaluate.uniform_hemisphere(N, seed) for seed in (1, 2))

    def values(**parameters):
        bsdf = mi.load_dict({"type": "lambertsphere", **parameters})
        return np.array(bsdf.eval(mi.BSDFContext(), evaluate.interaction(wi), wo))

    for name in ("reflectance", "albedo"):
        assert not values(**{name: 0.0}).any()
        assert np.isfinite(values(**{name: 1.0})).all()
        assert values(**{name: 0.0}, variant="published").max() < 2e-4
    assert np.allclose(values(albedo=1.0), values(reflectance=1.0), rtol=2e-3)  # s = 3e-4 keeps derivatives finite


@pytest.mark.parametrize("reflectance", [0.0, 1.0])
def test_derivatives_live_at_the_ends(rgb, reflectance):
    bsdf = mi.load_dict({"type": "lambertsphere", "reflectance": {"type": "rgb", "value": reflectance}})
    params, wo = mi.traverse(bsdf), mi.Vector3f(0.6, 0, 0.8)
    dr.enable_grad(params["reflectance.value"])
    params.update()
    dr.backward(dr.sum(bsdf.eval(mi.BSDFContext(), evaluate.interaction(wo), wo)))
    assert (np.array(dr.grad(params["reflectance.value"])) > 0.1).all()


@pytest.mark.parametrize("model", ["lambertsphere", "chandrasekhar"])
def test_reflectance_excludes_albedo(rgb, model):
    with pytest.raises(RuntimeError, match="reflectance and albedo exclude each other"):
        mi.load_dict({"type": model, "reflectance": 0.5, "albedo": 0.5})


# The phase function in a medium.


def medium_interaction(wi, n=1):
    mei = dr.zeros(mi.MediumInteraction3f, n)
    mei.wi, mei.sh_frame = wi, mi.Frame3f(wi)
    return mei


def test_phase_plugin_samples_its_density(rgb):
    """Mitsuba's own chi^2 test, for an oblique direction; seeds are fixed, and 1 % is its threshold."""
    wi = mi.ScalarVector3f(0.6, 0, 0.8)
    functors = mi.chi2.PhaseFunctionAdapter("lambertsphere_phase", "", wi=wi, ctx=mi.PhaseFunctionContext(None))
    test = mi.chi2.ChiSquareTest(mi.chi2.SphericalDomain(), *functors, sample_dim=3, sample_count=10**6, res=101)
    assert test.run(), test.messages


def test_phase_plugin_follows_mitsubas_conventions(rgb):
    """Like `hg`, it is brightest for wo = wi if it scatters back; 4 standard errors of the mean cosine."""
    wi, context = mi.Vector3f(0.6, 0, 0.8), mi.PhaseFunctionContext(None)
    hg, ours = (mi.load_dict(d) for d in ({"type": "hg", "g": -4 / 9}, {"type": "lambertsphere_phase"}))
    for bsdf in (hg, ours):
        back, forth = (bsdf.eval_pdf(context, medium_interaction(wi), wo)[1][0] for wo in (wi, -wi))
        assert back > 3 * forth
    assert ours.eval_pdf(context, medium_interaction(wi), wi)[1][0] == pytest.approx(2 / (3 * np.pi), rel=FLOAT32)
    rng = mi.PCG32(size=N)
    u = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    wo, weight, pdf = ours.sample(context, medium_interaction(wi, N), *u)
    cosine = -np.array(dr.dot(wi, wo))
    assert cosine.mean() == pytest.approx(-4 / 9, abs=4 * cosine.std() / np.sqrt(N))
    assert np.all(np.array(weight) == 1)
    assert np.allclose(np.array(ours.eval_pdf(context, medium_interaction(wi, N), wo)[1]), np.array(pdf), rtol=FLOAT32)


def test_phase_plugin_in_every_variant(any_variant):
    phase = mi.load_dict({"type": "lambertsphere_phase"})
    mei = dr.zeros(mi.MediumInteraction3f)
    mei.wi = mi.Vector3f(0, 0, 1)
    value, pdf = phase.eval_pdf(mi.PhaseFunctionContext(None), mei, mi.Vector3f(0, 0, 1))
    assert float(np.array(pdf).ravel()[0]) == pytest.approx(2 / (3 * np.pi), rel=FLOAT32)
    wo, _, _ = phase.sample(mi.PhaseFunctionContext(None), mei, 0.5, mi.Point2f(0.3, 0.3))
    assert float(np.array(dr.norm(wo)).ravel()[0]) == pytest.approx(1, rel=FLOAT32)
    if mi.is_polarized:
        assert not np.array(value)[1:].any()


def test_half_space_of_the_phase_function_is_the_bsdf(rgb):
    """Radiance of a slab of the medium, 20 optical depths deep, path traced, against the BSDF.

    4 standard errors of 2^16 paths, whose deviation is about the mean.
    """
    c, angle = 0.7, np.radians(40)
    scene = {
        "type": "scene",
        "integrator": {"type": "volpath", "max_depth": -1, "rr_depth": 30},
        "light": {"type": "directional", "direction": [0.5, 0, -np.sqrt(0.75).item()], "irradiance": 1.0},
        "slab": {
            "type": "cube",
            "to_world": mi.ScalarTransform4f().scale([40, 40, 10]).translate([0, 0, -1]),
            "bsdf": {"type": "null"},
            "interior": {"type": "homogeneous", "sigma_t": 1.0, "albedo": c, "phase": {"type": "lambertsphere_phase"}},
        },
        "sensor": {
            "type": "distant",
            "direction": [-np.sin(angle).item(), 0, -np.cos(angle).item()],
            "target": [0.0, 0.0, 0.0],
            "film": {"type": "hdrfilm", "width": 1, "height": 1, "rfilter": {"type": "box"}},
        },
    }
    traced = np.array(mi.render(mi.load_dict(scene), spp=1 << 16)).ravel()[0]
    wi, wo = mi.Vector3f(np.sin(angle).item(), 0, np.cos(angle).item()), mi.Vector3f(-0.5, 0, np.sqrt(0.75).item())
    bsdf = mi.load_dict({"type": "lambertsphere", "albedo": c})
    assert traced == pytest.approx(bsdf.eval(mi.BSDFContext(), evaluate.interaction(wi), wo)[0][0], rel=0.016)
