"""Renders of Meneveaux et al. 2018."""

from typing import Any

from ...validation import Sections
from . import materials, of_presets

SOURCE = "Meneveaux 2018, Fig. "


def facets(reflectance: Any = 0.6, **others: Any) -> dict[str, Any]:
    """Beckmann facets with Smith's masking."""
    body = {"diffuse_reflectance": reflectance, "distribution": "beckmann", "masking": "smith", "ext_ior": 1.0}
    return {"type": "interfacedlambertian"} | body | others


def beside(alpha: float) -> dict[str, dict[str, Any]]:
    """What Fig. 16 compares, but for the model's coarse sum."""
    plastic = {"type": "roughplastic", "diffuse_reflectance": 0.6, "alpha": alpha, "int_ior": 1.5, "ext_ior": 1.0}
    cavities = facets(alpha=alpha, int_ior=1.5, masking="vcavity")
    return {
        "single": facets(alpha=alpha, int_ior=1.5),
        "double": cavities | {"scattering": "double"},
        "multiple": cavities | {"scattering": "multiple"},
        "roughplastic": plastic | {"distribution": "beckmann"},
        "nonlinear": plastic | {"distribution": "beckmann", "nonlinear": True},
    }


PICTURES: Sections = {
    "fig12": of_presets("Elephants' materials (Fig. 12, 13)", "The presets that follow the figures.", f"{SOURCE}12"),
    "fig13": materials(
        "By index and roughness (Fig. 13)",
        "K_d .6; the bottom row has no interface. Indices and roughnesses of the figure are not in the text.",
        {
            f"n {n}": {f"σ {alpha}": facets(alpha=alpha, int_ior=n) for alpha in (0.05, 0.3, 1.0)}
            for n in (1.5, 1.2, 1.0)
        },
    ),
    "fig16": materials(
        "Beside Mitsuba's plastics (Fig. 16)",
        "Index 1.5, K_d .6, Beckmann: one bounce, two and all, and `roughplastic`, linear and not.",
        {f"σ {alpha}": beside(alpha) for alpha in (0.1, 0.3, 1.5)},
        compared=True,
    ),
}
