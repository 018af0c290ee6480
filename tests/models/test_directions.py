"""Directions that random ones never meet: exactly normal, coplanar, retro, mirrored, grazing."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import numpy as np
import pytest

from asperity.lab import evaluate

GRAINS = {"type": "micrograin", "tau_0": 0.44, "diffuse_reflectance": 0.8}
COATED = {**GRAINS, "int_ior": 1.5}
CASES = {
    "closed": {**GRAINS, "specular": False},
    "anisotropic": {**GRAINS, "specular": False, "beta_x": 0.5, "beta_y": 2.0},
    "coated": COATED,
    "by normal": {**GRAINS, "specular": False, "variation": "normal", "diffuse_reflectance_2": 0.2},
    "by height": {**COATED, "variation": "height", "diffuse_reflectance_2": 0.2},
    "multiple": {**GRAINS, "specular": False, "beta_x": 0.5, "scattering": "multiple"},
    "metal": {"type": "micrograin", "material": "Au", "beta_y": 0.3},
    "vgroove": {"type": "vgroove", "alpha": 0.5, "material": "Cu", "max_bounces": 3},
    "non-symmetric": {"type": "vgroove", "alpha_u": 0.5, "alpha_v": 0.2, "symmetric": False},
    "lambertsphere": {"type": "lambertsphere"},
    "interfacedlambertian": {"type": "interfacedlambertian", "alpha": 0.4},
    "interfaced cavities": {"type": "interfacedlambertian", "alpha": 0.4, "masking": "vcavity"},
    "interfaced anisotropic": {"type": "interfacedlambertian", "alpha_u": 0.2, "alpha_v": 0.5, "distribution": "ggx"},
    "orennayar": {"type": "orennayar", "sigma": 40.0},
    "twoscale": {"type": "twoscale", "alpha": 0.2, "sigma_s": 0.05},
    "twoscale anisotropic": {"type": "twoscale", "alpha_u": 0.1, "alpha_v": 0.3, "p": 1.0, "sigma_s": 0.05},
    "deon": {"type": "deon", "base": {"type": "diffuse"}},
    "merillou": {"type": "merillou", "base": {"type": "diffuse"}},
}


def special(shift=0.0):
    """Pairs of all directions of a few rings, each moved a little at random by ``shift``."""
    theta, azimuth = np.meshgrid(np.radians([0, 20, 50, 77.1, 88]), np.radians([0, 90, 180, 37]))
    ring = np.stack([np.sin(theta) * np.cos(azimuth), np.sin(theta) * np.sin(azimuth), np.cos(theta)]).reshape(3, -1)
    pairs, rng = (np.repeat(ring, ring.shape[1], axis=1), np.tile(ring, ring.shape[1])), np.random.default_rng(1)
    moved = [w + shift * rng.normal(size=w.shape) for w in pairs]
    return [mi.Vector3f((w / np.linalg.norm(w, axis=0)).astype(np.float32)) for w in moved]


@pytest.mark.parametrize("description", CASES.values(), ids=CASES)
def test_values_are_those_of_directions_nearby(rgb, description):
    """1e-4 radians change no value by more than 2 %: at 88 degrees, the cosine changes by .3 %."""
    bsdf, half = mi.load_dict(description), np.array(sum(special()))
    smooth = np.hypot(half[0], half[1]) > (0.02 if description["type"] == "vgroove" else -1)  # V-grooves glint
    for exact, near in zip(evaluate.eval_pdf(bsdf, *special()), evaluate.eval_pdf(bsdf, *special(1e-4))):
        np.testing.assert_allclose(np.array(exact)[..., smooth], np.array(near)[..., smooth], rtol=0.02, atol=1e-4)


@pytest.mark.parametrize("description", CASES.values(), ids=CASES)
def test_either_order_of_a_pair_has_the_same_value(rgb, description):
    """To the half a percent of the quadrature."""
    bsdf, (wi, wo) = mi.load_dict(description), special()
    there, back = evaluate.eval(bsdf, wi, wo) * wi.z, evaluate.eval(bsdf, wo, wi) * wo.z
    np.testing.assert_allclose(np.array(there), np.array(back), rtol=0.01, atol=1e-4)


def test_the_example(rgb):
    """One thousandth of a degree off, it was right."""
    bsdf = mi.load_dict({**COATED, "beta": 1.0})
    wo = evaluate.direction(77.1, 180)
    assert evaluate.eval(bsdf, mi.Vector3f(0, 0, 1), wo).x[0] == pytest.approx(0.0240, abs=1e-4)
