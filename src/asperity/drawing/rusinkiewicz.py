"""Maps over the angles of the half vector and the difference: highlights at the left, Fresnel above, retro below.

S. Rusinkiewicz, A New Change of Variables for Efficient BRDF Representation, 1998.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from asperity.errors import ParameterError
from asperity.materials import Material

from . import style, values

SIZE = 256
"""Values along each side."""
HORIZON = 1e-2
"""Of cosines; below, there is nothing to see."""


def figure(
    materials: Sequence[Material],
    *,
    phi: float = 0.0,
    phi_d: float = 90.0,
    scale: str = "log",
    channel: str = "mean",
    wavelengths: Sequence[float] | None = None,
) -> Figure:
    """f over the half vector's angle θ_h and the difference's θ_d."""
    style.check_scale(scale)
    for name, angle in (("phi", phi), ("phi_d", phi_d)):
        if not np.isfinite(angle):
            raise ParameterError(f"{name} = {angle}: expected a finite angle in degrees.")
    index = values.single(values.channels(materials, wavelengths), channel)
    found = [values.one(over_angles(material, phi, phi_d, wavelengths), index) for material in materials]
    norm = style.norm(found, scale, 0.99)  # f has no bound at the horizon
    made, places = style.panels(len(materials), 2.6, sharey=True)
    for axes, material, map in zip(places, materials, found):
        image = axes.imshow(style.visible(map, norm), origin="lower", extent=(0, 90, 0, 90), norm=norm, cmap=style.MAP)
        ticks = {"xticks": range(0, 91, 30), "yticks": range(0, 91, 30), "facecolor": "0.85"}
        axes.set(title=style.wrapped(material.name), xlabel=r"$\theta_h$ [°]", **ticks)
    places[0].set_ylabel(r"$\theta_d$ [°]")
    made.colorbar(image, ax=places, label=style.quantity(False), fraction=0.05, pad=0.02, extend="max")
    return made


def over_angles(
    material: Material, phi_h: float = 0.0, phi_d: float = 90.0, wavelengths: Sequence[float] | None = None
) -> np.ndarray:
    """f (channels, SIZE, SIZE), rows of equal θ_d, at azimuths of half vector and difference; NaN below the surface."""
    angles = (np.arange(SIZE) + 0.5) / SIZE * 90
    wi, wo = pair(*np.meshgrid(angles, angles), phi_h, phi_d)
    seen = (wi[..., 2] > HORIZON) & (wo[..., 2] > HORIZON)
    found = values.at(material, wi[seen], wo[seen], wavelengths)
    result = np.full((len(found), SIZE, SIZE), np.nan)
    result[:, seen] = found / wo[seen][:, 2]
    return result


def pair(theta_h: Any, theta_d: Any, phi_h: Any, phi_d: Any) -> tuple[np.ndarray, np.ndarray]:
    """The directions (..., 3) of these angles in degrees."""
    th, td, ph, pd = (np.radians(angle) for angle in np.broadcast_arrays(theta_h, theta_d, phi_h, phi_d))

    def turned(sign: int) -> np.ndarray:
        x, y, z = sign * np.sin(td) * np.cos(pd), sign * np.sin(td) * np.sin(pd), np.cos(td)
        x, z = x * np.cos(th) + z * np.sin(th), z * np.cos(th) - x * np.sin(th)
        return np.stack([x * np.cos(ph) - y * np.sin(ph), x * np.sin(ph) + y * np.cos(ph), z], axis=-1)

    return turned(1), turned(-1)
