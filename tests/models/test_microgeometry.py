"""The microgeometries of models: what they stand for, and what they refuse to stand for."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import pytest

from asperity.errors import ParameterError
from asperity.goniophotometer import measure
from asperity.models import MODELS
from asperity.models.micrograin import ExplicitGrains
from asperity.validation import micrograin

TEXTURE = {"type": "checkerboard", "color0": 0.2, "color1": 0.4}
ATTRIBUTE = {"type": "mesh_attribute", "name": "vertex_tau"}
COATED = {"int_ior": 1.5, "ext_ior": 1.0, "diffuse_reflectance": 0.5}


@pytest.mark.parametrize(
    ("model", "given", "complaint"),
    [
        ("micrograin", {"tau_0": TEXTURE}, "tau_0 = .*alike everywhere"),
        ("micrograin", {"beta": TEXTURE}, "beta = .*alike everywhere"),
        ("micrograin", {"beta_y": TEXTURE}, "beta_y = .*alike everywhere"),
        ("micrograin", {"tau_0": 1.0}, r"tau_0 = 1: .*\[0, 1\)"),
        ("micrograin", {"reflectivity": 0.9}, "reflectivity: not simulated.*material"),
        ("micrograin", {"reflectivity": 0.9, "edge_tint": 0.8}, "reflectivity: not simulated"),
        (
            "micrograin",
            {"variation": "height", "specular": False, "diffuse_reflectance_2": 0.1},
            "variation: not simulated.*one colour",
        ),
        (
            "micrograin",
            {"variation": "normal", "material": "Au", "material_2": "Cu"},
            "variation: not simulated.*one colour",
        ),
        ("vgroove", {"alpha": TEXTURE}, "alpha = .*alike everywhere"),
        ("vgroove", {"alpha_u": 0.2, "alpha_v": TEXTURE}, "alpha_v = .*alike everywhere"),
        ("vgroove", {"reflectivity": 0.9}, "reflectivity: not simulated.*material"),
        ("vgroove", {"reflectivity": 0.9, "edge_tint": 0.8}, "(reflectivity|edge_tint): not simulated"),
        ("lambertsphere", {"albedo": TEXTURE}, "albedo = .*not simulated.*one number"),
        ("lambertsphere", {"reflectance": TEXTURE}, "reflectance = .*not simulated.*one number"),
        ("lambertsphere", {"albedo": {"type": "uniform", "value": 0.5}}, "albedo = .*not simulated"),
        ("interfacedlambertian", {}, 'masking = "smith": no explicit surface has it; measure "vcavity"'),
        ("interfacedlambertian", {"scattering": "double", "alpha": TEXTURE}, "alpha = .*alike everywhere"),
        ("interfacedlambertian", {"scattering": "double", "alpha_v": TEXTURE}, "alpha_v = .*alike everywhere"),
        ("interfacedlambertian", {"masking": "vcavity", "diffuse_reflectance": TEXTURE}, "diffuse_reflectance = .*not"),
        (
            "interfacedlambertian",
            {"masking": "vcavity", "int_ior": {**TEXTURE, "color0": 1.2, "color1": 1.5}},
            "int_ior = .*alike everywhere",
        ),
    ],
)
def test_what_is_not_simulated_is_refused(rgb, model, given, complaint):
    """Never ignored: the truth would be that of something else."""
    with pytest.raises(ParameterError, match=complaint):
        MODELS[model].microgeometry({"type": model} | given)


def inner(albedo):
    """Light in the coat is weaker by eta², and returned to the grain in part, at any colour."""
    returned = float(mi.fresnel_diffuse_reflectance(mi.Float(1 / 1.5))[0])
    return 1 / (1.5**2 * (1 - albedo * returned))


@pytest.mark.parametrize(
    ("facets", "excess"),
    [
        (lambda: {"diffuse_reflectance": 0.5 / inner(1)}, lambda: 1),
        (lambda: {}, lambda: inner(1)),
        (lambda: {"nonlinear": True}, lambda: inner(0.5)),
    ],
    ids=["without inner reflections", "plastic", "plastic, nonlinear"],
)
def test_coated_grains(rgb, facets, excess):
    """Facets with the model's own (1 - F_i) (1 - F_o) R / π; and Mitsuba's `plastic`, which is 1.10 times as bright.

    That has inner reflections, for which the model has none, or .63 times if it is ``nonlinear``; a constant factor in
    either case, so there is nothing to tolerate but the model's quadrature. Five percent of it would show.
    """
    description = {"type": "micrograin", "tau_0": 0.5, "beta_x": 1.5, "beta_y": 0.7} | COATED
    traced = MODELS["micrograin"].microgeometry(description)
    traced = ExplicitGrains(0.5, 1.5, 0.7, traced.grain | facets())
    measured = measure(traced, [(20, 40), (70, 250)], orders=1, paths=2e6, tiles=16, sensor=micrograin.COARSE)
    whole, mirror = (
        micrograin.modelled(description | change, measured)[..., 0] for change in ({}, {"diffuse_reflectance": 0.0})
    )
    found = micrograin.judge("", measured, mirror + excess() * (whole - mirror), micrograin.QUADRATURE)
    wrong = micrograin.judge("", measured, mirror + 1.05 * excess() * (whole - mirror), micrograin.QUADRATURE)
    assert found.passed and not wrong.passed
