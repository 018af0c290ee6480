"""What to time a model beside: what a user of Mitsuba would take instead. Materials are plain descriptions."""

from __future__ import annotations

from typing import Any

Description = dict[str, Any]
Group = dict[str, Description]
"""Materials by their names; the first is Mitsuba's, and the reference. A model's names begin with its own."""

GRAINS: Description = {"tau_0": 0.4, "beta": 0.5}
GOLDEN: Description = {"material": "Au", **GRAINS}
METALS: Group = {
    "roughconductor, GGX": {"type": "roughconductor", "material": "Au", "alpha": 0.3, "distribution": "ggx"},
    "micrograin, metal grains": {"type": "micrograin", **GOLDEN},
    "micrograin, on a diffuse base": {"type": "micrograin", **GOLDEN, "base": {"type": "diffuse"}},
    "micrograin, scattering: multiple": {"type": "micrograin", **GOLDEN, "scattering": "multiple"},
    "micrograin, diffuse grains": {"type": "micrograin", **GRAINS, "specular": False},
    "micrograin, coated grains": {"type": "micrograin", **GRAINS, "int_ior": 1.5},
    "deon": {"type": "deon", **GOLDEN},
    "merillou": {"type": "merillou", **GOLDEN},
    **{f"vgroove, alpha {alpha:g}": {"type": "vgroove", "material": "Au", "alpha": alpha} for alpha in (0.1, 0.3, 1.0)},
    "vgroove, alpha 0.3, non-symmetric": {"type": "vgroove", "material": "Au", "alpha": 0.3, "symmetric": False},
}
COLOUR: Description = {"type": "rgb", "value": [0.58, 0.25, 0.14]}
MATTE: Group = {
    "diffuse": {"type": "diffuse"},
    **{
        f"lambertsphere, {variant}": {"type": "lambertsphere", "variant": variant}
        for variant in ("accurate", "published", "fast")
    },
    "lambertsphere, accurate, coloured": {"type": "lambertsphere", "reflectance": COLOUR},
    "chandrasekhar": {"type": "chandrasekhar"},
    **{f"orennayar, {variant}": {"type": "orennayar", "variant": variant} for variant in ("full", "qualitative")},
}
FACETS: Description = {"type": "interfacedlambertian", "distribution": "ggx"}
ROUGH = FACETS | {"alpha": 0.3}
PLASTICS: Group = {
    "roughplastic, GGX": {"type": "roughplastic", "distribution": "ggx", "alpha": 0.3},
    "interfacedlambertian, GGX": ROUGH,
    "interfacedlambertian, Beckmann": ROUGH | {"distribution": "beckmann"},
    "interfacedlambertian, V-cavities": ROUGH | {"masking": "vcavity"},
    "interfacedlambertian, all bounces": ROUGH | {"masking": "vcavity", "scattering": "multiple"},
    "interfacedlambertian, textured alpha": FACETS | {"alpha": {"type": "checkerboard", "color0": 0.1, "color1": 0.6}},
    "interfacedlambertian, anisotropic": FACETS | {"alpha_u": 0.3, "alpha_v": 0.31},
    "interfacedlambertian, approximate": ROUGH | {"approximate": True},
}
TWO_SCALES: Description = {"type": "twoscale", "material": "Au", "p": 0.7}
DIFFRACTING: Group = {
    # of equal rms slope: alpha sqrt(Gamma(2 / p) / Gamma(1 / p))
    "roughconductor, Beckmann": {"type": "roughconductor", "material": "Au", "alpha": 0.142},
    "twoscale": TWO_SCALES | {"alpha": 0.1},
    "twoscale, conserving": TWO_SCALES | {"alpha": 0.1, "energy": "conserving"},
    "twoscale, anisotropic": TWO_SCALES | {"alpha_u": 0.14, "alpha_v": 0.07},
}
GROUPS: tuple[Group, ...] = (METALS, MATTE, PLASTICS, DIFFRACTING)

EXTRA = {
    *("micrograin, on a diffuse base", "micrograin, scattering: multiple", "micrograin, coated grains"),
    *("vgroove, alpha 0.1", "vgroove, alpha 1"),
    *("deon", "merillou", "lambertsphere, published", "lambertsphere, fast", "lambertsphere, accurate, coloured"),
    *("orennayar, qualitative", "twoscale, conserving", "twoscale, anisotropic"),
    *(
        f"interfacedlambertian, {name}"
        for name in ("Beckmann", "V-cavities", "textured alpha", "approximate", "all bounces")
    ),
}
"""Left out if there is little time: compiling takes most of it."""


def model_of(name: str) -> str:
    """The model that a material in a group is of."""
    return name.split(",")[0]


def groups(quick: bool = False) -> list[Group]:
    """All groups, or what tells most."""
    return [{name: group[name] for name in group if not (quick and name in EXTRA)} for group in GROUPS]


def of_model(model: str) -> Group | None:
    """A model's materials beside their reference; None if there are none."""
    for group in GROUPS:
        mine = {name: description for name, description in group.items() if model_of(name) == model}
        if mine:
            reference = next(iter(group))
            return {reference: group[reference], **mine}
    return None


def beside(name: str, description: Description) -> Group:
    """Any material beside the reference of its plugin's models, or beside Mitsuba's ``diffuse``."""
    reference, *_ = (of_model(str(description.get("type"))) or MATTE).items()
    return dict([reference]) | {name: description}
