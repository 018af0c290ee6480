"""Every parameter of every model at both ends of its range: constant, as texels, in value, density and derivative."""

import asperity  # noqa: F401  isort: skip
import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from asperity.conductors import PARTS, Conductor
from asperity.lab import evaluate
from asperity.models import MODELS
from asperity.parameters import Texture

BASE = {"type": "diffuse", "reflectance": 0.7}
METAL, TINT = {"eta": 0.2, "k": 3.0}, {"reflectivity": 0.5, "edge_tint": 0.3}
SECOND, TINT_2 = {"eta_2": 1.0, "k_2": 2.0}, {"reflectivity_2": 0.2, "edge_tint_2": 0.5}
USED = {  # descriptions that use all parameters between them
    "micrograin": {
        "metal": {**METAL, "base": BASE},
        "by height": {**METAL, **SECOND, "variation": "height", "masking": "height"},
        "by normal": {
            **TINT,
            "reflectivity_2": 0.2,
            "edge_tint_2": 0.5,
            "variation": "normal",
            "beta_x": 0.5,
            "beta_y": 0.4,
        },
        "diffuse": {"specular": False, "base": BASE},
        "two colours": {"specular": False, "diffuse_reflectance_2": 0.9, "variation": "height"},
        "coated": {"int_ior": 1.5, "ext_ior": 1.1, "beta_x": 0.8, "beta_y": 2.0},
        "smith": {"masking": "smith", "int_ior": 1.5, "base": BASE},
        "multiple": {**METAL, "scattering": "multiple", "base": BASE},
        "multiple diffuse": {"specular": False, "scattering": "multiple", "base": BASE},
    },
    "vgroove": {
        "metal": {**METAL, "alpha": 0.4},
        "tint": {**TINT, "alpha_u": 0.2, "alpha_v": 0.3},
        "beckmann": {**METAL, "distribution": "beckmann"},
        "phong": {"distribution": "phong"},
        "exponent": {"distribution": "phong", "exponent": 3.0},
        "non-symmetric": {**METAL, "symmetric": False},
        "non-symmetric beckmann": {"symmetric": False, "distribution": "beckmann"},
        "non-symmetric phong": {"symmetric": False, "distribution": "phong"},
    },
    "merillou": {"metal": {**METAL, "base": BASE}, "tint": {**TINT, "beta_x": 0.5, "beta_y": 0.6, "base": BASE}},
    "deon": {"metal": {**METAL, "base": BASE}, "tint": {**TINT, "beta_x": 0.5, "beta_y": 0.6, "base": BASE}},
    "lambertsphere": {
        "default": {},
        "albedo": {"albedo": 0.5},
        "fast": {"variant": "fast"},
        "published": {"variant": "published"},
    },
    "chandrasekhar": {"default": {}, "albedo": {"albedo": 0.5}},
    "interfacedlambertian": {
        "beckmann": {},
        "ggx": {"distribution": "ggx", "alpha_u": 0.2, "alpha_v": 0.5},
        "gaussian": {"distribution": "gaussian", "masking": "vcavity"},
        "double": {"scattering": "double"},
        "ill-posed": {"distribution": "gaussian", "alpha": 0.2},
    },
    "orennayar": {"default": {}, "qualitative": {"variant": "qualitative"}},
    "twoscale": {
        "diffracting": METAL,
        "conserving": {**TINT, "energy": "conserving", "masking": "height"},
        "stretched": {"alpha_u": 0.2, "alpha_v": 0.05, "masking": "separable"},
    },
}
FITS = [("lambertsphere", "fast"), ("lambertsphere", "published")]
"""Published fits, which are clamped to a constant where little is reflected: there is no derivative to be had."""
CONSTANT = {
    "micrograin": {"beta", "beta_x", "beta_y"},
    "interfacedlambertian": {"int_ior", "ext_ior"},
    "twoscale": {"alpha", "alpha_u", "alpha_v", "p", "b", "c"},
}
"""What does not vary over the surface, in the first two if light scatters several times."""
SLOW = {"conserving", "stretched", "coated", "non-symmetric", "non-symmetric beckmann", "non-symmetric phong"}
CASES = [
    pytest.param(model, case, id=f"{model}-{case}", marks=[pytest.mark.slow] if case in SLOW else [])
    for model, cases in USED.items()
    for case in cases
]
parametrised = pytest.mark.parametrize("model, case", CASES)
pytestmark = pytest.mark.filterwarnings("ignore:alpha = .* bounces over")  # which is tested elsewhere


def load(model, case, **more):
    return mi.load_dict({"type": model, **USED[model][case], **more})


def ends(bsdf):
    """(least, greatest) that is allowed, by name; Phong's own, too."""
    declared = bsdf.model.declarations()
    found = {
        parameter.name: (parameter.low, parameter.high) for parameter in declared if isinstance(parameter, Texture)
    }
    for suffix in (parameter.suffix for parameter in declared if isinstance(parameter, Conductor)):
        found |= {name + suffix: (part.low, part.high) for name, part in PARTS.items()}
    return found | {name: both for name, both in bsdf.ranges().items() if np.isfinite(both).all()}


def lanes(n=1000):
    """Pairs at random, weighted 1, and awkward ones, weighted 0: of those, only what is not finite is heard."""
    hard = [np.array(w)[:, ::11] for w in evaluate.hard_pairs()]
    plain = [np.array(evaluate.uniform_hemisphere(n, seed)) for seed in (1, 2)]
    wi, wo = (mi.Vector3f(np.concatenate(pair, axis=1)) for pair in zip(plain, hard))
    weight = mi.Float(np.repeat([1 / n, 0], [n, hard[0].shape[1]]).astype(np.float32))
    si = evaluate.interaction(wi)
    si.uv = mi.Point2f(np.random.default_rng(3).random((2, dr.width(wi))).astype(np.float32))
    return si, wo, weight


def total(bsdf, params, keys=()):
    """The weighted sum of values, and its derivatives by what ``keys`` name; all of it finite."""
    si, wo, weight = lanes()
    for key in keys:
        dr.enable_grad(params[key])
    params.update()
    value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, wo)
    found = {"value": value, "pdf": pdf}
    summed = dr.sum(value.x * weight)
    if keys:
        dr.backward(summed)
        found |= {key: dr.grad(params[key]) for key in keys}
        dr.disable_grad([params[key] for key in keys])
        params.update()
        bs, found["weight"] = bsdf.sample(mi.BSDFContext(), si, *evaluate.variates(dr.width(wo), 4))
        found["wo"] = bs.wo
    found = {name: np.array(dr.detach(data)).ravel() for name, data in found.items()}
    assert all(np.isfinite(data).all() for data in found.values())
    assert all((found[name] >= 0).all() for name in ("value", "pdf"))
    return summed[0], found


def at(value, x):
    """``x`` as what ``mi.traverse`` shows, opaque, so that all values share one kernel."""
    return type(value)(dr.opaque(mi.Float, float(x)))


def test_every_parameter_is_used(rgb):
    for model, declared in MODELS.items():
        used = {key.split(".")[0] for case in USED[model] for key in mi.traverse(load(model, case)).keys()}  # noqa: SIM118
        every = {name for parameter in declared.declarations() for name in parameter.ranges()}
        assert every <= used, model


@parametrised
def test_constants_at_both_ends(rgb, model, case):
    """Finite; and where the value changes, so says the derivative: else a clipped optimiser would never leave."""
    bsdf = load(model, case)
    params, ranges = mi.traverse(bsdf), ends(bsdf)
    keys = [key for key in params.keys() if key.split(".")[0] in ranges and key.endswith(".value")]  # noqa: SIM118
    keys = [key for key in keys if not params.flags(key) & int(mi.ParamFlags.NonDifferentiable)]
    before = {key: float(np.ravel(params[key])[0]) for key in keys}
    dead = []
    for name in keys:
        for end, inwards in zip(ranges[name.split(".")[0]], (1, -1)):
            step = inwards * 1e-3 * (abs(end) or 1)
            for key in keys:
                params[key] = at(params[key], before[key] if key != name else end + step)
            near, _ = total(bsdf, params)
            params[name] = at(params[name], end)
            value, _ = total(bsdf, params)  # by the same formulas: with derivatives, exact ones take the place of fits
            _, found = total(bsdf, params, keys)
            difference, derivative = (near - value) / step, found[name].sum()
            rounding = 1e-5 * abs(value / step)
            if abs(difference) > rounding and derivative * np.sign(difference) < 0.01 * abs(difference):
                dead.append((name, end, derivative, difference))
    assert not dead or (model, case) in FITS


@parametrised
def test_texels_at_both_ends(rgb, model, case):
    """All parameters at once, each texel at one end or the other."""
    plain, rng = load(model, case), np.random.default_rng(5)
    # Tables are made from what is the same everywhere.
    constant = CONSTANT.get(model, set()) if getattr(plain.model, "scattering", None) != "single" else set()

    def texels(low, high):
        data = mi.TensorXf(rng.choice([low, high], (8, 8, 1)).astype(np.float32))
        return {"type": "bitmap", "raw": True, "filter_type": "nearest", "data": data}

    shown = {key.split(".")[0] for key in mi.traverse(plain).keys()}  # noqa: SIM118
    given = {name: texels(*both) for name, both in ends(plain).items() if name in shown - constant}
    bsdf = load(model, case, **given)
    params = mi.traverse(bsdf)
    total(bsdf, params, [f"{name}.data" for name in given])


@pytest.mark.parametrize("grains", [{}, {"specular": False}, {"material": "Au"}], ids=["mirror", "diffuse", "metal"])
@pytest.mark.parametrize("texel", [False, True], ids=["number", "texel"])
def test_without_grains_multiple_scattering_is_the_bases(rgb, grains, texel):
    tau_0 = {"type": "bitmap", "raw": True, "data": mi.TensorXf([0.0] * 4, (2, 2, 1))} if texel else 0.0
    bsdf = mi.load_dict({"type": "micrograin", "scattering": "multiple", **grains, "tau_0": tau_0, "base": BASE})
    si, wo, _ = lanes()
    expected = mi.load_dict(BASE).eval(mi.BSDFContext(), si, wo)
    assert np.allclose(bsdf.eval(mi.BSDFContext(), si, wo), expected, atol=1e-6)
