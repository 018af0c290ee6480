"""Weights, signs, and the albedo that Mitsuba's AOV shows."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import numpy as np
import pytest

from asperity.lab import evaluate
from asperity.models import MODELS

BASE = {"type": "diffuse", "reflectance": 0.8}
CASES = {
    "mirror": {"type": "micrograin", "base": BASE},
    "diffuse": {"type": "micrograin", "specular": False, "beta_x": 0.4, "base": BASE},
    "multiple": {"type": "micrograin", "material": "Au", "scattering": "multiple", "base": BASE},
    "vgroove": {"type": "vgroove", "material": "Cu", "alpha": 0.6},
    "non-symmetric": {"type": "vgroove", "material": "Cu", "alpha": 0.6, "symmetric": False},
    "lambertsphere": {"type": "lambertsphere", "reflectance": 0.8},
    "published": {"type": "lambertsphere", "variant": "published"},
    "fast": {"type": "lambertsphere", "variant": "fast"},
    "chandrasekhar": {"type": "chandrasekhar"},
    "cavities": {"type": "interfacedlambertian", "alpha": 0.6, "diffuse_reflectance": 0.9, "scattering": "multiple"},
    "interfacedlambertian": {"type": "interfacedlambertian", "alpha": 0.4, "diffuse_reflectance": 0.9},
    "orennayar": {"type": "orennayar", "sigma": 50.0},
    "twoscale": {"type": "twoscale", "material": "Cu", "sigma_s": 0.06},
    "deon": {"type": "deon", "material": "Au", "base": BASE},
    "merillou": {"type": "merillou", "material": "Au", "base": BASE},
}


@pytest.mark.parametrize("description", CASES.values(), ids=CASES)
def test_the_albedo_is_the_mean_weight(rgb, description):
    """Straight down, aslant and low. Of 256 samples, against 2^17: 1 % of strata, but for the diffuse grains' fourth
    number, which is not one: its share of the deviation, .2, is that of random numbers, .013."""
    bsdf = mi.load_dict(description)
    wi = np.array([[0, 0, 1], [0.6, 0, 0.8], [0.1, 0.97, 0.222]])
    wi = wi / np.linalg.norm(wi, axis=1, keepdims=True)
    found = np.array(bsdf.eval_diffuse_reflectance(evaluate.interaction(evaluate.vectors(wi))))
    np.testing.assert_allclose(
        found, evaluate.albedo(bsdf, wi, 2**17), atol=0.02 if "specular" in description else 0.01
    )


def test_every_model_is_here():
    assert {description["type"] for description in CASES.values()} == set(MODELS)


@pytest.mark.parametrize("base", [{}, {"base": {"type": "diffuse", "reflectance": 1.0}}], ids=["black", "white"])
@pytest.mark.parametrize("tau_0", [1e-3, 0.3, 0.9, 0.999, 1.0])
@pytest.mark.parametrize("beta", [(0.01, 0.01), (0.01, 100.0), (0.3, 20.0), (5.0, 5.0), (100.0, 100.0)], ids=str)
def test_mirror_grains_never_return_more_than_they_get(rgb, base, tau_0, beta):
    """Needles, and cosines down to 1e-6, included: a thousandth is float32's share."""
    n, rng = 1 << 15, np.random.default_rng(0)
    z, azimuth = 10 ** rng.uniform(-6, 0, n), rng.uniform(0, 2 * np.pi, n)
    sin = np.sqrt(1 - z * z)
    wi = evaluate.vectors(np.stack([sin * np.cos(azimuth), sin * np.sin(azimuth), z], axis=1))
    bsdf = mi.load_dict({"type": "micrograin", "tau_0": tau_0, "beta_x": beta[0], "beta_y": beta[1], **base})
    weight = np.array(evaluate.sample(bsdf, wi, *evaluate.variates(n, 1))[1].x)
    assert np.isfinite(weight).all() and weight.min() >= 0 and weight.max() < 1 + 1e-3


@pytest.mark.parametrize("sigma", [0.0, 30.0, 45.0, 60.0, 75.0, 90.0])
@pytest.mark.parametrize("reflectance", [0.0, 0.1, 1.0])
def test_oren_nayar_is_never_negative(rgb, sigma, reflectance):
    """Its fit is, from 45 degrees on, down to -9e-4."""
    bsdf = mi.load_dict({"type": "orennayar", "sigma": sigma, "reflectance": reflectance})
    value = np.array(evaluate.eval(bsdf, *(evaluate.uniform_hemisphere(1 << 17, seed) for seed in (1, 2))))
    assert value.min() >= 0 and (value.max() > 0) == (reflectance > 0)
