"""Renders of Lucas et al. 2024."""

from typing import Any

from ...validation import Sections
from . import materials, of_presets

SOURCE = "Lucas 2024, Fig. "


def coloured(red: float, green: float, blue: float) -> dict[str, Any]:
    """A reflectance."""
    return {"type": "rgb", "value": [red, green, blue]}


def grains(tau_0: float, beta: float | tuple[float, float], **others: Any) -> dict[str, Any]:
    """Grains, of one beta or of two."""
    betas = {"beta": beta} if isinstance(beta, float) else dict(zip(("beta_x", "beta_y"), beta))
    return {"type": "micrograin", "tau_0": tau_0, **betas} | others


def grey(reflectance: float) -> dict[str, Any]:
    """A base."""
    return {"type": "diffuse", "reflectance": reflectance}


BEIGE, RED, BLUE = coloured(0.3, 0.2, 0.1), coloured(0.6, 0, 0), coloured(0.1, 0.2, 0.4)
FACTORS = 0.1, 0.4, 0.8
OTHERS: dict[str, dict[str, Any]] = {"micrograin": {}, "d'Eon": {"type": "deon"}, "Mérillou": {"type": "merillou"}}
SOFT: dict[str, Any] = {
    "specular": False,
    "diffuse_reflectance": BLUE,
    "base": {"type": "diffuse", "reflectance": BLUE},
}
GOLD: dict[str, Any] = {"material": "Au", "base": grey(0.2)}
TWO = {"Eq. 18": {}, "Eq. 17": {"masking": "height"}}
PICTURES: Sections = {
    "fig1": of_presets("Five materials (Fig. 1)", "The presets that follow the figure.", f"{SOURCE}1"),
    "fig10": materials(
        "Models of gold grains on black (Fig. 10)",
        "β 1, by our models of the three, under our environment.",
        {
            f"τ₀ {tau}": {name: grains(tau, 1.0, material="Au") | other for name, other in OTHERS.items()}
            for tau in (0.3, 0.7)
        },
        compared=True,
    ),
    "fig12": materials(
        "Material mixtures (Fig. 12)",
        "β .1, by the filling factor.",
        {
            "coated": {
                f"τ₀ {t}": grains(
                    t, 0.1, int_ior=1.6, diffuse_reflectance=BEIGE, base={"type": "diffuse", "reflectance": BEIGE}
                )
                for t in FACTORS
            },
            "gold": {f"τ₀ {t}": grains(t, 0.1, material="Au", base=grey(0.4)) for t in FACTORS},
        },
    ),
    "fig13": materials(
        "Diffuse anisotropy (Fig. 13)",
        "Red diffuse grains on grey. The text has no β: 1, and .3 and 3, are ours.",
        {
            name: {
                f"τ₀ {t}": grains(t, beta, specular=False, diffuse_reflectance=RED, base=grey(0.4))
                for t in (0.05, 0.15, 0.3)
            }
            for name, beta in (("isotropic", 1.0), ("anisotropic", (0.3, 3.0)))
        },
    ),
    "fig14": of_presets("Specular anisotropy (Fig. 14)", "The presets that follow the figure.", f"{SOURCE}14"),
    "fig15": materials(
        "Retro-reflection on a sphere (Fig. 15)",
        "With a lamp from the side, and from behind the camera; with the correlation of directions (Eq. 18), and "
        "without (Eq. 17).",
        {
            f"{name}, {light}": {equation: grains(tau, beta, **kind) | masking for equation, masking in TWO.items()}
            for name, tau, beta, kind in (("diffuse", 0.4, 1.0, SOFT), ("gold", 0.3, 2.0, GOLD))
            for light in ("side", "front")
        },
        {f"{name}, {light}": {"light": light} for name in ("diffuse", "gold") for light in ("side", "front")},
        compared=True,
    ),
    "fig16": of_presets("Correlated colours (Fig. 16)", "The presets that follow the figure.", f"{SOURCE}16"),
}
