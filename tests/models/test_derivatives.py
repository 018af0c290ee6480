"""Derivatives where renders take them: through calls of BSDFs that are told apart by a pointer.

There, Dr.Jit drops what a recorded loop takes from around it, and stops with an error, or aborts the process, if
derivatives of a loop's state meet those of others. Direct calls show none of that.
"""

import asperity  # noqa: F401  isort: skip
from itertools import product

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from asperity.lab import evaluate

N = 200
ROUGH = {"type": "roughconductor", "alpha": 0.3}
CASES = {  # description and parameters
    "vgroove": ({"type": "vgroove", "material": "Cu", "alpha": 0.4}, ["alpha.value", "k.value"]),
    "non-symmetric": (
        {"type": "vgroove", "material": "Cu", "alpha": 0.4, "symmetric": False},
        ["alpha.value", "eta.value"],
    ),
    "grooves, stretched": ({"type": "vgroove", "material": "Cu", "alpha_u": 0.2, "alpha_v": 0.5}, ["alpha_u.value"]),
    "steep grooves": ({"type": "vgroove", "eta": 0.5, "k": 3.0, "alpha": 2.0}, ["alpha.value", "eta.value"]),
    "two bounces": ({"type": "vgroove", "reflectivity": 0.8, "max_bounces": 2}, ["alpha.value", "reflectivity.value"]),
    "Phong": ({"type": "vgroove", "distribution": "phong", "exponent": 20.0}, ["exponent.value"]),
    "Phong, non-symmetric": (
        {"type": "vgroove", "distribution": "phong", "alpha_u": 0.4, "alpha_v": 0.3, "symmetric": False},
        ["alpha_u.value"],
    ),
    "metal grains": ({"type": "micrograin", "eta": 0.5, "k": 3.0}, ["tau_0.value", "beta.value", "k.value"]),
    "diffuse": (
        {"type": "micrograin", "specular": False, "base": {"type": "diffuse"}},
        ["tau_0.value", "beta.value", "diffuse_reflectance.value", "base.reflectance.value"],
    ),
    "by height": (
        {"type": "micrograin", "specular": False, "variation": "height", "diffuse_reflectance_2": 0.9},
        ["beta.value", "diffuse_reflectance_2.value"],
    ),
    "coated": ({"type": "micrograin", "int_ior": 1.5}, ["tau_0.value", "beta.value", "int_ior.value"]),
    "coated, stretched": (
        {"type": "micrograin", "int_ior": 1.5, "beta_x": 0.4, "beta_y": 1.0},
        ["tau_0.value", "beta_x.value", "int_ior.value"],
    ),
    "diffuse, stretched": (
        {"type": "micrograin", "specular": False, "beta_x": 0.4, "beta_y": 1.0},
        ["tau_0.value", "beta_x.value", "diffuse_reflectance.value"],
    ),
    "by normal": (
        {"type": "micrograin", "specular": False, "variation": "normal", "diffuse_reflectance_2": 0.9},
        ["beta.value", "variation_azimuth.value", "diffuse_reflectance_2.value"],
    ),
    "smith": ({"type": "micrograin", "masking": "smith", "base": {"type": "diffuse"}}, ["tau_0.value", "beta.value"]),
    "multiple": (
        {"type": "micrograin", "scattering": "multiple", "tau_0": 0.4, "base": ROUGH},
        ["tau_0.value", "beta.value", "base.alpha.value"],
    ),
    "interfacedlambertian": (
        {"type": "interfacedlambertian", "alpha": 0.4},
        ["alpha.value", "int_ior.value", "diffuse_reflectance.value"],
    ),
    "interfaced cavities": (
        {"type": "interfacedlambertian", "masking": "vcavity", "distribution": "ggx"},
        ["alpha.value", "int_ior.value"],
    ),
    "double": (
        {"type": "interfacedlambertian", "scattering": "double", "alpha": 0.6},
        ["alpha.value", "int_ior.value", "diffuse_reflectance.value"],
    ),
    "bouncing": (
        {"type": "interfacedlambertian", "scattering": "multiple", "alpha": 0.6},
        ["alpha.value", "int_ior.value", "diffuse_reflectance.value"],
    ),
    "double, stretched": (
        {"type": "interfacedlambertian", "scattering": "double", "alpha_u": 0.2, "alpha_v": 0.5},
        ["alpha_u.value", "int_ior.value"],
    ),
    "double by one of its alphas": (  # whose table carries no derivatives, beside what does
        {"type": "interfacedlambertian", "scattering": "double", "alpha_u": 0.2, "alpha_v": 0.5},
        ["alpha_u.value"],
    ),
    "stretched": ({"type": "interfacedlambertian", "alpha_u": 0.2, "alpha_v": 0.5}, ["alpha_u.value", "int_ior.value"]),
    "twoscale": (
        {"type": "twoscale", "material": "Cu", "sigma_s": 0.05},
        ["alpha.value", "sigma_s.value", "p.value", "b.value", "c.value"],
    ),
    "conserving": (
        {"type": "twoscale", "energy": "conserving", "sigma_s": 0.05},
        ["sigma_s.value", "b.value", "c.value"],
    ),
    "diffracting, stretched": ({"type": "twoscale", "alpha_u": 0.2, "alpha_v": 0.08}, ["alpha_u.value", "p.value"]),
    "multiple over vgroove": (
        {"type": "micrograin", "scattering": "multiple", "tau_0": 0.4, "base": {"type": "vgroove", "material": "Cu"}},
        ["base.eta.value"],  # by alpha, a difference is also of the directions that the base's albedo is sampled in
    ),
}
SLOW = {"multiple over vgroove", "diffracting, stretched", "steep grooves", "Phong", "Phong, non-symmetric"}
parametrised = pytest.mark.parametrize(
    "case", [pytest.param(case, marks=[pytest.mark.slow] if case in SLOW else []) for case in CASES]
)


def pairs():
    return [mi.warp.square_to_uniform_hemisphere(evaluate.variates(N, seed)[1]) for seed in (1, 2)]


class Two:
    """Two instances of a BSDF whose parameters all move by one number, called as one or through pointers."""

    def __init__(self, case):
        description, self.keys = CASES[case]
        self.bsdfs = [mi.load_dict(description) for _ in range(2)]
        self.params = [mi.traverse(bsdf) for bsdf in self.bsdfs]
        self.before = {key: type(self.params[0][key])(self.params[0][key]) for key in self.keys}
        self.si, self.wo = evaluate.interaction(pairs()[0]), pairs()[1]

    def move(self, by):
        for params in self.params:
            for scale, (key, value) in enumerate(self.before.items(), 1):
                params[key] = value + scale * by
            params.update()

    def value(self, by, pointer=True):
        self.move(by)
        odd = dr.arange(mi.UInt32, N) % 2 == 1
        bsdf = dr.select(odd, *map(mi.BSDFPtr, self.bsdfs)) if pointer else self.bsdfs[0]
        value, pdf = bsdf.eval_pdf(mi.BSDFContext(), self.si, self.wo)
        return value.x, pdf

    def difference(self, step=1e-3):
        values = [np.array(self.value(dr.opaque(mi.Float, h), False)[0], dtype=float) for h in (step, -step)]
        return (values[0] - values[1]) / (2 * step)


@parametrised
def test_forward_through_pointers(rgb, case):
    """Finite differences of float32 at a step of 1e-3 are good to 1e-7 / 1e-3 of the value, and to the step squared."""
    two = Two(case)
    expected, by = two.difference(), dr.opaque(mi.Float, 0)
    dr.enable_grad(by)
    value, pdf = two.value(by)  # both stay alive
    dr.forward(by)
    found = np.array(dr.grad(value))
    assert np.abs(found - expected).mean() < 0.01 * np.abs(expected).mean()
    assert dr.width(pdf) == N


@parametrised
def test_backward_through_pointers(rgb, case):
    two = Two(case)
    expected, by = two.difference().sum(), dr.opaque(mi.Float, 0)
    dr.enable_grad(by)
    dr.backward(dr.sum(two.value(by)[0]))
    assert dr.grad(by)[0] == pytest.approx(expected, rel=0.01)


@pytest.mark.parametrize(
    "case, key",
    [
        ("vgroove", "k.value"),
        ("non-symmetric", "alpha.value"),
        ("coated", "int_ior.value"),
        ("metal grains", "k.value"),
    ],
)
def test_derivatives_need_no_update(rgb, case, key):
    """What was made once for parameters without derivatives is not used for those that have some."""
    found = []
    for update in (True, False):
        bsdf = mi.load_dict(CASES[case][0])
        params = mi.traverse(bsdf)
        dr.enable_grad(params[key])
        if update:
            params.update()
        value = dr.mean(bsdf.eval(mi.BSDFContext(), evaluate.interaction(pairs()[0]), pairs()[1]).x)
        dr.backward(value)
        found.append(np.array(dr.grad(params[key])))
    np.testing.assert_allclose(found[0], found[1], rtol=1e-5)
    assert np.abs(found[0]).max() > 0


RENDERED = {
    "vgroove": 0,
    "non-symmetric": 0,
    "diffuse": 0,
    "multiple": 0,
    "bouncing": 2,
    "multiple, by what makes its table": 1,
    "twoscale, by what makes its tables": 0,
    "twoscale": 1,
}
# Forwards, Dr.Jit 1.5 comes to a picture before it comes to what else is made of its only parameter; `lab.check` tests
# such tables with `render_forward`.
TOO_EARLY = [(case, True) for case in RENDERED if "makes" in case]


@pytest.mark.parametrize("case, forward", [pair for pair in product(RENDERED, [True, False]) if pair not in TOO_EARLY])
def test_through_a_render(rgb, case, forward):
    """By prb, against finite differences with the same samples: a mean over 64 pixels, whose paths never change."""
    description, keys = CASES[case.partition(",")[0]]
    sensor = {
        "type": "perspective",
        "to_world": mi.ScalarTransform4f().look_at([0, -5, 3], [0, 0, 0], [0, 0, 1]),
        "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
    }
    light = {"type": "point", "position": [1, -3, 5.0], "intensity": 30.0}
    plate = {"type": "rectangle", "bsdf": {"type": "diffuse"}}  # else there is but one BSDF, and no pointer
    integrator = {"type": "prb", "max_depth": 2}  # direct light alone: differences are not of sampled directions
    scene = {"type": "scene", "integrator": integrator, "sensor": sensor, "light": light, "plate": plate}
    scene = mi.load_dict(scene | {"ball": {"type": "sphere", "bsdf": description}}, parallel=False)
    params = mi.traverse(scene)
    name = f"ball.bsdf.{keys[RENDERED[case]]}"
    before = type(params[name])(params[name])

    def picture(by, **seeds):
        params[name] = before + by
        params.update()
        return dr.mean(mi.render(scene, params, spp=16, **seeds), axis=None).array

    step, by = 2e-3, mi.Float(0)
    difference = (picture(mi.Float(step), seed=2)[0] - picture(mi.Float(-step), seed=2)[0]) / (2 * step)
    dr.enable_grad(by)
    mean = picture(by, seed=1, seed_grad=2)
    (dr.forward if forward else dr.backward)(by if forward else mean)
    assert dr.grad(mean if forward else by)[0] == pytest.approx(difference, rel=0.01)


@pytest.mark.parametrize("pointer", [False, True], ids=["direct", "pointer"])
@pytest.mark.parametrize("forward", [True, False], ids=["forward", "backward"])
@pytest.mark.parametrize("case, key", [("vgroove", "k.value"), ("diffuse", "diffuse_reflectance.value")])
def test_the_albedo_has_derivatives(rgb, case, key, pointer, forward):
    """By parameters that do not move its samples."""
    bsdfs = [mi.load_dict(CASES[case][0]) for _ in range(2)]

    def albedo(by):
        for bsdf in bsdfs:
            params = mi.traverse(bsdf)
            params[key] = type(params[key])(0.4 + by)
            params.update()
        bsdf = dr.select(dr.arange(mi.UInt32, N) % 2 == 1, *map(mi.BSDFPtr, bsdfs)) if pointer else bsdfs[0]
        return dr.mean(bsdf.eval_diffuse_reflectance(evaluate.interaction(pairs()[0])).x)

    step, by = 1e-2, dr.opaque(mi.Float, 0)
    difference = (albedo(mi.Float(step))[0] - albedo(mi.Float(-step))[0]) / (2 * step)
    dr.enable_grad(by)
    mean = albedo(by)
    (dr.forward if forward else dr.backward)(by if forward else mean)
    assert dr.grad(mean if forward else by)[0] == pytest.approx(difference, rel=0.02)
