"""`dr.freeze`: what a model is made of is found, and takes part in what was recorded."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from asperity.models import MODELS

BASE = {"type": "diffuse"}
CASES = {  # description, and a parameter to move
    "metal": ({"type": "micrograin", "material": "Au", "base": BASE}, "tau_0.value"),
    "fitted": ({"type": "micrograin", "eta": 0.5, "k": 3.0}, "eta.value"),
    "diffuse": ({"type": "micrograin", "specular": False, "base": BASE}, "tau_0.value"),
    "coated": ({"type": "micrograin", "int_ior": 1.5}, "tau_0.value"),
    "multiple": ({"type": "micrograin", "scattering": "multiple", "base": BASE}, "tau_0.value"),
    "settled": ({"type": "micrograin", "tau_0": {"type": "settled"}, "specular": False}, "tau_0.top.value"),
    "vgroove": ({"type": "vgroove", "material": "Cu"}, "alpha.value"),
    "non-symmetric": ({"type": "vgroove", "symmetric": False}, "alpha.value"),
    "lambertsphere": ({"type": "lambertsphere"}, "reflectance.value"),
    "chandrasekhar": ({"type": "chandrasekhar"}, "reflectance.value"),
    "interfacedlambertian": ({"type": "interfacedlambertian"}, "alpha.value"),
    "cavities": ({"type": "interfacedlambertian", "scattering": "multiple"}, "alpha.value"),
    "stretched": ({"type": "interfacedlambertian", "alpha_u": 0.2, "alpha_v": 0.5}, "alpha_u.value"),
    "orennayar": ({"type": "orennayar"}, "reflectance.value"),
    "twoscale": ({"type": "twoscale", "energy": "conserving"}, "alpha.value"),
    "diffracting": ({"type": "twoscale", "alpha_u": 0.2, "alpha_v": 0.1}, "p.value"),
    "deon": ({"type": "deon", "base": BASE}, "tau_0.value"),
    "merillou": ({"type": "merillou", "base": BASE}, "tau_0.value"),
}


def scene(bsdf):
    to_world = mi.ScalarTransform4f().look_at([0, -5, 3], [0, 0, 0], [0, 0, 1])
    sensor = {"type": "perspective", "to_world": to_world, "film": {"type": "hdrfilm", "width": 8, "height": 8}}
    parts = {"integrator": {"type": "path", "max_depth": 3}, "light": {"type": "constant"}, "sensor": sensor}
    return mi.load_dict({"type": "scene", **parts, "ball": {"type": "sphere", "bsdf": bsdf}}, parallel=False)


def render(scene):
    return mi.render(scene, spp=4, seed=1)


def moved(scene, key, value):
    params = mi.traverse(scene)
    params[f"ball.bsdf.{key}"] = type(params[f"ball.bsdf.{key}"])(value)
    params.update()
    return render(scene)


def test_every_model_is_here():
    assert {description["type"] for description, _ in CASES.values()} == set(MODELS)


@pytest.mark.parametrize("inside", [False, True], ids=["outside", "inside"])
@pytest.mark.parametrize("description, key", CASES.values(), ids=CASES)
def test_frozen_rendering_follows_updates(rgb, description, key, inside):
    """The same samples: equal but for the order of sums. Recorded once, or once more for the first update."""
    ball, frozen, pictures = scene(description), dr.freeze(moved if inside else render), []
    for value in (0.3, 0.4, 0.5):
        pictures.append(np.array(moved(ball, key, value)))
        found = frozen(ball, key, dr.opaque(mi.Float, value)) if inside else frozen(ball)
        np.testing.assert_allclose(np.array(found), pictures[-1], rtol=1e-4, atol=1e-6)
    assert np.abs(pictures[0] - pictures[2]).max() > 1e-3 and frozen.n_recordings < 3


def test_one_frozen_function_takes_several_scenes(rgb):
    """Kept alive: of scenes that are freed in between, frozen functions draw Mitsuba's own BSDFs wrongly, too."""
    names = ("settled", "vgroove", "lambertsphere", "orennayar")
    balls, frozen = [scene(CASES[name][0]) for name in names], dr.freeze(render)
    for ball in balls * 2:
        np.testing.assert_allclose(np.array(frozen(ball)), np.array(render(ball)), rtol=1e-4, atol=1e-6)
