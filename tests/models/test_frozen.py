"""`dr.freeze`: what a model is made of is found, and takes part in what was recorded."""

import asperity  # noqa: F401  isort: skip
import gc

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from helpers import directions

from asperity.models import MODELS


@pytest.fixture(autouse=True)
def collected():
    """A scene that Python's collector frees while a frozen function records aborts the process (Dr.Jit 1.5).

    Errors keep scenes, in circles of their own.
    """
    gc.collect()


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


TABLES = {"interfacedlambertian", "cavities", "twoscale", "diffracting"}
"""Made from what moves."""


@pytest.mark.parametrize("case", CASES)
def test_frozen_rendering_follows_updates(rgb, case):
    """The same samples: equal but for the order of sums. Recorded once, or once more for the first update."""
    (description, key), frozen, pictures = CASES[case], dr.freeze(render), []
    ball = scene(description)
    for value in (0.3, 0.4, 0.5):
        pictures.append(np.array(moved(ball, key, value)))
        np.testing.assert_allclose(np.array(frozen(ball)), pictures[-1], rtol=1e-4, atol=1e-6)
    assert np.abs(pictures[0] - pictures[2]).max() > 1e-3 and frozen.n_recordings < 3


@pytest.mark.parametrize("case", [case for case in CASES if case not in TABLES])
def test_frozen_rendering_follows_updates_inside(rgb, case):
    """Of a scene that nothing else updates; twice more recorded: without what was made of numbers that were known.

    Exact forms take the place of fits and fitted rules, which are good to some .1 %.
    """
    (description, key), frozen = CASES[case], dr.freeze(moved)
    ball, other = scene(description), scene(description)
    for value in (0.3, 0.4, 0.5):
        expected = np.array(moved(ball, key, value))
        found = frozen(other, key, dr.opaque(mi.Float, value))
        np.testing.assert_allclose(np.array(found), expected, rtol=2e-3, atol=1e-6)
    assert frozen.n_recordings < 4


@pytest.mark.parametrize("case", sorted(TABLES))
def test_tables_are_not_made_in_frozen_functions(rgb, case):
    """Which would replay old ones, or abort the process."""
    (description, key), frozen = CASES[case], dr.freeze(moved)
    with pytest.raises(RuntimeError) as error:
        frozen(scene(description), key, dr.opaque(mi.Float, 0.35))
    assert "update it outside" in str(error.value.__cause__)


@pytest.mark.parametrize("inside", [False, True], ids=["outside", "inside"])
@pytest.mark.parametrize("symmetric", [True, False], ids=["symmetric", "non-symmetric"])
def test_frozen_densities_follow_from_few_bounces_to_many(rgb, symmetric, inside):
    """The sum's form depends on the roughness, which a picture in a furnace hardly tells. To the table's errors."""
    grooves, other = (mi.load_dict({"type": "vgroove", "symmetric": symmetric, "alpha": 0.01}) for _ in range(2))
    wi, wo = (mi.Vector3f(directions(np.random.default_rng(n), 500, lowest=0.1)) for n in (1, 2))
    si = dr.zeros(mi.SurfaceInteraction3f, 500)
    si.wi = wi
    dr.eval(si, wo)

    def densities(bsdf, si, wo):
        return bsdf.pdf(mi.BSDFContext(), si, wo)

    def changed(bsdf, si, wo, alpha):
        params = mi.traverse(bsdf)
        params["alpha.value"] = alpha
        params.update()
        return densities(bsdf, si, wo)

    frozen = dr.freeze(changed if inside else densities)
    for value in (0.02, 0.5, 1.0, 20.0, 0.1):
        alpha = dr.opaque(mi.Float, value)
        expected = np.array(changed(grooves, si, wo, alpha))
        found = frozen(other, si, wo, alpha) if inside else frozen(grooves, si, wo)
        np.testing.assert_allclose(np.array(found), expected, rtol=0.03 if inside else 1e-4, atol=1e-4)


def test_one_frozen_function_takes_several_scenes(rgb):
    """Kept alive: of scenes that are freed in between, frozen functions draw Mitsuba's own BSDFs wrongly, too."""
    names = ("settled", "vgroove", "lambertsphere", "orennayar")
    balls, frozen = [scene(CASES[name][0]) for name in names], dr.freeze(render)
    for ball in balls * 2:
        np.testing.assert_allclose(np.array(frozen(ball)), np.array(render(ball)), rtol=1e-4, atol=1e-6)
