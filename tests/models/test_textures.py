"""`settled`: where up is."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from asperity.lab import evaluate

TOP, BOTTOM, THRESHOLD, SOFTNESS = 0.9, 0.2, 0.3, 0.6
DUST = {"type": "micrograin", "specular": False, "diffuse_reflectance": 1.0}


def settled(**given):
    return {"type": "settled", "top": TOP, "bottom": BOTTOM, "threshold": THRESHOLD, "softness": SOFTNESS, **given}


def expected(component):
    t = np.clip((component - THRESHOLD) / SOFTNESS / 2 + 0.5, 0, 1)
    return BOTTOM + (TOP - BOTTOM) * t * t * (3 - 2 * t)


@pytest.mark.parametrize(
    "up, axis", [([0, 0, 1], 2), ([0, 1, 0], 1), ([0, 7.5, 0], 1), ([0, -1e-3, 0], 1), ([3, 0, 0], 0)]
)
@pytest.mark.parametrize("cos", [1, -0.4], ids=["from above", "from below"])
def test_values_follow_the_normal_whoever_looks(rgb, up, axis, cos):
    normals = evaluate.uniform_sphere(200, 1)
    si = evaluate.interaction(mi.Vector3f(0.3, 0, cos), 200)
    si.sh_frame = mi.Frame3f(normals)
    component = np.array(normals)[axis] * np.sign(sum(up))
    found = np.array(mi.load_dict(settled(up=up)).eval_1(si))
    np.testing.assert_allclose(found, expected(component), atol=1e-5)
    assert found.min() == pytest.approx(BOTTOM) and found.max() == pytest.approx(TOP)


def test_up_is_z_if_nothing_is_said(rgb):
    si = evaluate.interaction(mi.Vector3f(0, 0, 1))
    assert mi.load_dict(settled()).eval_1(si)[0] == pytest.approx(TOP)


@pytest.mark.parametrize("up, lit", [([0, 1, 0], TOP), ([0, -1, 0], BOTTOM)])
@pytest.mark.parametrize("turned", [False, True], ids=["up", "down"])
def test_the_winding_of_a_plate_does_not_matter(rgb, up, lit, turned):
    """A plate seen from above (+y); `twosided` says nothing of the side, hence its second BSDF's opposite up."""
    opposite = [-x for x in up]
    sides = [{**DUST, "tau_0": settled(up=direction)} for direction in (up, opposite)]
    look = mi.ScalarTransform4f().look_at
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 2},
            "light": {"type": "constant"},
            "sensor": {
                "type": "perspective",
                "fov": 1,
                "to_world": look([0, 9, 0], [0, 0, 0], [0, 0, 1]),
                "film": {"type": "hdrfilm", "width": 8, "height": 8},
            },
            "plate": {
                "type": "rectangle",
                "to_world": look([0, 0, 0], [0, -1 if turned else 1, 0], [0, 0, 1]),
                "bsdf": {"type": "twosided", "front": sides[0], "back": sides[1]},
            },
        },
        parallel=False,
    )
    bsdf = mi.load_dict({**DUST, "tau_0": lit})
    si, u = evaluate.interaction(mi.Vector3f(0, 0, 1), 1 << 14), evaluate.variates(1 << 14, 1)
    albedo = dr.mean(bsdf.sample(mi.BSDFContext(), si, *u)[1].x)[0]
    picture = np.array(mi.render(scene, spp=256, seed=1))
    assert picture.mean() == pytest.approx(albedo, abs=0.01)  # 16384 weights each, of deviation .3 at most


def test_what_has_settled_on_glass_is_reciprocal(rgb):
    """Light that goes through meets as many grains as light that comes back; radiance grows by eta²."""
    glass = {"type": "roughdielectric", "alpha": 0.3, "int_ior": 1.5}
    bsdf = mi.load_dict({**DUST, "tau_0": settled(), "base": glass})
    above, below = dr.normalize(mi.Vector3f(0.3, 0, 0.9)), dr.normalize(mi.Vector3f(-0.2, 0.1, -0.9))
    down, up = evaluate.eval(bsdf, above, below).x / -below.z, evaluate.eval(bsdf, below, above).x / above.z
    assert dr.all(down > 0) and dr.allclose(down * 1.5**2, up, rtol=1e-3)  # float32, and a narrow lobe


BAD = {
    "zero": ([0, 0, 0], r"up = \[0.0, 0.0, 0.0\], which has no direction: expected a vector"),
    "NaN": ([0, float("nan"), 1], "up = .*has no direction"),
    "infinite": ([0, float("inf"), 1], "up = .*has no direction"),
    "number": (1.0, "up = 1.0: expected a vector"),
    "word": ("y", "up = 'y': expected a vector"),
    "flag": (True, "up = True: expected a vector"),
}


@pytest.mark.parametrize("up, message", BAD.values(), ids=BAD)
def test_what_is_no_direction_is_refused(rgb, up, message):
    with pytest.raises(RuntimeError, match=f"ParameterError: {message}"):
        mi.load_dict(settled(up=up))


def test_the_mean_lies_between(rgb):
    assert np.array(mi.load_dict(settled()).mean()).item() == pytest.approx((TOP + BOTTOM) / 2)
