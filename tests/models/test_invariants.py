"""Every check of the lab on every model, over a spread of parameters. A new model adds its lines to SPREAD."""

import asperity  # noqa: F401  isort: skip
import pytest

from asperity.lab import checks
from asperity.models import MODELS

WHITE = {"type": "diffuse", "reflectance": 0.9}
GLASS = {"type": "roughdielectric", "alpha": 0.2, "distribution": "ggx"}
ROUGH = {"type": "roughconductor", "alpha": 0.3, "distribution": "ggx"}
SHEET = {"type": "mask", "opacity": 0.4, "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse"}}}
SPREAD = {
    "micrograin": {
        "default": {},
        "gold": {"material": "Au", "tau_0": 0.4, "beta": 0.5},
        "flat": {"material": "Au", "tau_0": 0.2, "beta": 0.1, "base": WHITE},
        "tall": {"tau_0": 0.8, "beta": 3.0},
        "anisotropic": {"material": "Al", "tau_0": 0.62, "beta_x": 0.8, "beta_y": 1.7},
        "height": {"masking": "height", "material": "Au", "base": WHITE},
        "smith": {"masking": "smith", "tau_0": 0.5, "base": WHITE},
        "diffuse": {"specular": False, "tau_0": 0.5},
        "diffuse anisotropic": {"specular": False, "beta_x": 0.3, "base": WHITE},
        "coated": {"int_ior": 1.5, "beta": 0.6},
        "glass base": {"specular": False, "base": GLASS},
        "sheet": {"base": SHEET},
        "mirror base": {"base": {"type": "conductor", "material": "Ag"}},
        "crossed": {"beta_x": 1.0, "beta_y": 0.2, "base": {"type": "micrograin", "beta_x": 0.2, "beta_y": 1.0}},
        "by height": {"specular": False, "variation": "height", "diffuse_reflectance_2": 0.9},
        "by normal": {"material": "Au", "variation": "normal", "material_2": "Ag"},
        "multiple": {"scattering": "multiple", "tau_0": 0.5, "base": WHITE, "material": "Au"},
        "multiple diffuse": {"scattering": "multiple", "tau_0": 0.5, "specular": False, "diffuse_reflectance": 0.9},
    },
    "merillou": {
        "white": {"base": WHITE},
        "deep": {"material": "Au", "tau_0": 0.6, "beta_x": 0.2, "beta_y": 0.8, "depth": 4.0, "base": ROUGH},
        "tiles": {"tau_0": 0.9, "beta": 0.5, "depth": 0.2},
    },
    "deon": {
        "white": {"base": WHITE},
        "dense": {"material": "Au", "tau_0": 0.95, "beta": 2.0},
        "sparse": {"tau_0": 0.02, "beta_x": 0.2, "beta_y": 0.8, "base": ROUGH},
    },
    "lambertsphere": {
        "default": {},
        "colour": {"reflectance": {"type": "rgb", "value": [0.05, 0.4, 0.9]}},
        "white": {"albedo": 1.0},
        "black": {"reflectance": 0.0},
        "dark": {"albedo": 0.05},
        "published": {"variant": "published", "reflectance": 0.8},
        "fast": {"variant": "fast"},
    },
    "chandrasekhar": {"default": {}, "white": {"reflectance": 1.0}, "dark": {"albedo": 0.05}},
    "orennayar": {
        "default": {},
        "rough": {"reflectance": 0.9, "sigma": 60.0},
        "qualitative": {"variant": "qualitative", "sigma": 40.0},
    },
    "interfacedlambertian": {
        "default": {},
        "rough": {"alpha": 0.9, "distribution": "ggx", "diffuse_reflectance": 0.9},
        "cavities": {"masking": "vcavity", "alpha": 0.6, "diffuse_reflectance": 1.0},
        "gaussian": {"masking": "vcavity", "distribution": "gaussian", "alpha_u": 0.2, "alpha_v": 0.6},
        "gaussian smith": {"distribution": "gaussian", "alpha": 0.3},
        "anisotropic": {"alpha_u": 0.1, "alpha_v": 0.6, "distribution": "ggx"},
        "anisotropic cavities": {"alpha_u": 0.5, "alpha_v": 0.2, "masking": "vcavity"},
        "matched": {"int_ior": 1.0, "diffuse_reflectance": 0.8, "alpha": 0.5},
        "black": {"diffuse_reflectance": 0.0},
        "dense": {"int_ior": 2.4, "alpha": 0.1, "masking": "vcavity", "distribution": "ggx"},
        "textured": {"alpha": {"type": "checkerboard", "color0": 0.1, "color1": 0.5}},
        "textured index": {"int_ior": {"type": "checkerboard", "color0": 1.2, "color1": 1.8}, "alpha": 0.4},
        "approximate": {"approximate": True, "alpha": 0.4},
        "double": {"scattering": "double", "alpha": 0.5, "diffuse_reflectance": 0.9},
        "double gaussian": {"scattering": "double", "distribution": "gaussian", "alpha_u": 0.2, "alpha_v": 0.5},
        "multiple": {"scattering": "multiple", "distribution": "ggx", "alpha": 0.7, "diffuse_reflectance": 1.0},
        "multiple anisotropic": {"scattering": "multiple", "alpha_u": 0.3, "alpha_v": 0.7},
    },
    "twoscale": {
        "default": {},
        "gold": {"material": "Au", "sigma_s": 0.05},
        # As published, mirrors may return more than they get, here .4 and 2.2 %.
        "smooth": {"alpha": 0.01, "p": 1.0, "sigma_s": 0.01, "material": "Al"},
        "tails": {"alpha": 0.04, "p": 0.3, "b": 4.0},
        "flat": {"alpha": 0.08, "p": 3.0, "b": 0.4, "sigma_s": 0.03, "masking": "height", "material": "Cu"},
        "rough": {"alpha": 0.3, "p": 1.0, "c": 1.5, "masking": "separable"},
        "conserving": {"energy": "conserving", "sigma_s": 0.08, "b": 0.6, "material": "Al"},
        "anisotropic": {"alpha_u": 0.2, "alpha_v": 0.05, "material": "Al"},
        "textured": {"sigma_s": {"type": "checkerboard", "color0": 0.0, "color1": 0.05}, "energy": "conserving"},
    },
    "vgroove": {
        "default": {},
        "gold": {"material": "Au", "alpha": 0.5},
        "rough": {"material": "Cu", "alpha": 1.0},
        "beckmann": {"distribution": "beckmann", "alpha": 0.6, "material": "Al"},
        "phong": {"distribution": "phong", "exponent": 2.0, "material": "Au"},
        "elliptic": {"distribution": "beckmann", "alpha_u": 0.2, "alpha_v": 0.6, "material": "Cu"},
        "elliptic phong": {"distribution": "phong", "alpha_u": 0.3, "alpha_v": 0.9},
        "single bounce": {"max_bounces": 1, "alpha": 0.5, "material": "Au"},
        "textured": {
            "alpha_u": {"type": "checkerboard", "color0": 0.2, "color1": 0.4},
            "alpha_v": 0.3,
            "eta": {"type": "checkerboard", "color0": 0.2, "color1": 2.0},
            "k": 3.0,
        },
        "non-symmetric": {"symmetric": False, "alpha": 0.5, "material": "Au"},
        "non-symmetric beckmann": {"symmetric": False, "distribution": "beckmann", "alpha": 1.0},
        "non-symmetric phong": {"symmetric": False, "distribution": "phong", "alpha_u": 0.3, "alpha_v": 0.8},
    },
}

KNOWN = {
    ("interfacedlambertian", "textured"): {"bounds"},
    ("interfacedlambertian", "multiple"): {"bounds"},
}
"""Checks that fail, as the models' pages say. Derivatives by a textured alpha are those of a table that is linear
between roughnesses, and jump from one cell to the next; those of light that is mirrored into a cavity, at grazing
angles, are of a sum over steps, and jump by 1.5 % of all at alpha 1.5 (bound: 1 %)."""
QUICK = {"micrograin-gold", "vgroove-gold", "merillou-tiles", "deon-dense", "orennayar-default"}
QUICK |= {"lambertsphere-default", "chandrasekhar-default", "interfacedlambertian-default", "twoscale-gold"}
CASES = [
    pytest.param(model, case, id=name, marks=[] if name in QUICK else [pytest.mark.slow])
    for model, cases in SPREAD.items()
    for case in cases
    for name in [f"{model}-{case}"]
]


def test_every_model_is_here():
    assert set(SPREAD) == set(MODELS) == {name.split("-")[0] for name in QUICK}


@pytest.mark.parametrize("model, case", CASES)
def test_invariants(rgb, model, case):
    # A check rejects a right BSDF once in 100; this whole suite of them may do so once in 100, too.
    significance = 0.01 / len(CASES)
    found = checks.check({"type": model, **SPREAD[model][case]}, significance=significance)
    failed = {r.name: f"{r.name}: {r.measured} (bound: {r.bound})" for r in found if r.passed is False}
    assert failed.keys() == KNOWN.get((model, case), set()), "\n".join(failed.values())
