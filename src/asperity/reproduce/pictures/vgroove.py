"""Renders of Lee et al. 2018."""

from typing import Any

from ...validation import Sections
from . import materials, of_presets

SOURCE = "Lee 2018, Fig. "
ALPHAS = 0.1, 0.5, 1.0
ONE = {"max_bounces": 1}


def metal(name: str, **others: Any) -> dict[str, Any]:
    """Grooves of a metal."""
    return {"type": "vgroove", "material": name} | others


PICTURES: Sections = {
    "fig1": of_presets("Worn metals (Fig. 1)", "The presets that follow the figure.", f"{SOURCE}1"),
    "fig6": materials(
        "Three metals by roughness (Fig. 6)",
        "Non-symmetric grooves, GGX; below each metal, one bounce of symmetric ones, the model of Cook and Torrance. "
        "Its metals and roughnesses are not in the text: these are ours.",
        {
            f"{name}, {kind}": {f"α {alpha}": metal(name, alpha=alpha, **options) for alpha in ALPHAS}
            for name in ("Au", "Al", "Cu")
            for kind, options in (("all", {"symmetric": False}), ("one", ONE))
        },
    ),
    "fig7": materials(
        "Anisotropic aluminium (Fig. 7)",
        "Beckmann, α .1 along x; all bounces and one.",
        {
            kind: {
                f"α {alpha}": metal("Al", distribution="beckmann", alpha_u=0.1, alpha_v=alpha, **options)
                for alpha in ALPHAS
            }
            for kind, options in (("all", {}), ("one", ONE))
        },
    ),
    "fig8": materials(
        "Symmetric and non-symmetric grooves (Fig. 8)",
        "GGX; the metal and the roughnesses are ours.",
        {
            kind: {f"α {alpha}": metal("Al", alpha=alpha, symmetric=symmetric) for alpha in ALPHAS}
            for kind, symmetric in (("symmetric", True), ("non-symmetric", False))
        },
    ),
    "fig9": materials(
        "Three distributions (Fig. 9)",
        "Aluminium, α .5.",
        {"0": {name: metal("Al", alpha=0.5, distribution=name) for name in ("ggx", "beckmann", "phong")}},
    ),
    "fig10": of_presets("Chess pieces (Fig. 10)", "The presets that follow the figure.", f"{SOURCE}10"),
}
