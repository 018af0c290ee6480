"""The lobe in space: a surface whose distance from the centre is the value towards that direction."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.colors import LightSource
from matplotlib.figure import Figure

from asperity.goniophotometer.sensors import check_angles, directions
from asperity.materials import Material

from . import style, values
from .lobes import Radius

NEAR, STEP, FINE = 12.0, 3.0, 0.75
"""Degrees about the mirrored direction in which the mesh is finer; its steps without and within."""
VIEW = (22, 110)
"""From where one looks, elevation and azimuth relative to the light's, which comes from the left."""


def figure(
    materials: Sequence[Material],
    *,
    theta: Sequence[float] | None = None,
    phi: float = 0.0,
    scale: str = "linear",
    cosine: bool = True,
    channel: str = "mean",
    wavelengths: Sequence[float] | None = None,
) -> Figure:
    """The lobe as a surface in space, one for each material and angle of incidence."""
    style.check_scale(scale)
    index = values.single(values.channels(materials, wavelengths), channel)
    angles = (45.0,) if theta is None else tuple(theta)
    check_angles([(angle, phi) for angle in angles])
    shown = [(material, angle) for material in materials for angle in angles]
    made, places = style.panels(len(shown), 2.5, subplot_kw={"projection": "3d", "computed_zorder": False})
    for axes, (material, angle) in zip(places, shown):
        wo = mesh(angle, phi)
        f = values.one(values.at(material, directions([(angle, phi)]), wo, wavelengths), index)
        surface(axes, wo, f if cosine else f / wo[..., 2], scale, (angle, phi))
        axes.set_title(style.wrapped(rf"{material.name}, {style.THETA_I} = {angle:g}°"), y=0.97)
    return made


def mesh(theta: float, phi: float) -> np.ndarray:
    """Directions (rings, sectors, 3) over the hemisphere, closed in azimuth, closer about the mirrored one."""
    fine = np.arange(-NEAR, NEAR + FINE / 2, FINE)
    rings = np.concatenate([np.arange(0, 90, STEP), [values.HORIZON], theta + fine])
    rings = np.unique(np.clip(rings, 90 - values.HORIZON, values.HORIZON))  # without the pole, which has no normal
    turn = np.unique(np.concatenate([np.arange(-180, 181, STEP), fine]))[::-1]  # so that normals point outwards
    t, p = np.meshgrid(rings, turn + phi + 180, indexing="ij")
    return directions(np.stack([t.ravel(), p.ravel()], axis=1)).reshape(*t.shape, 3)


def surface(axes: Any, wo: np.ndarray, f: np.ndarray, scale: str, incident: tuple[float, float]) -> None:
    """Draw values ``f`` (rings, sectors) towards ``wo``, the ground, the normal, and where light comes from."""
    phi, radius = incident[1], Radius(float(f.max()), scale)
    r = radius(f)
    around = np.radians(np.linspace(0, 360, 121))
    faint = {"color": "0.6", "linewidth": 0.5, "zorder": 0}
    axes.plot(np.cos(around), np.sin(around), 0 * around, **faint)
    for azimuth in (0, 90):
        x, y = np.cos(np.radians(azimuth)), np.sin(np.radians(azimuth))
        axes.plot([-x, x], [-y, y], [0, 0], **faint)
        axes.text(1.2 * x, 1.2 * y, 0, f"{azimuth}°", fontsize=6, color="0.35", ha="center", va="center")
    colours = mpl.colormaps[style.MAP](r)
    x, y, z = np.moveaxis(wo * r[..., None], -1, 0)
    looks = {"facecolors": colours, "lightsource": LightSource(90 - phi - VIEW[1] + 30, 50), "rasterized": True}
    axes.plot_surface(x, y, z, rstride=1, cstride=1, linewidth=0, antialiased=False, **looks).set_zorder(2)
    w = directions([incident])[0]
    axes.quiver(*(1.15 * w), *(-w), length=0.35, color=style.LIGHT, linewidth=1, arrow_length_ratio=0.3, zorder=3)
    axes.plot([0, 0], [0, 0], [0, 1.05], color="0.3", linewidth=0.6, linestyle=":", zorder=1)
    axes.set(xlim=(-1, 1), ylim=(-1, 1), zlim=(0, 1.05))
    axes.set_box_aspect((2, 2, 1.05), zoom=1.3)
    axes.view_init(VIEW[0], phi + VIEW[1])
    axes.set_axis_off()
    axes.text2D(
        0.98, 0.04, f"radius of the circle: {radius.top:.3g}/sr", transform=axes.transAxes, fontsize=6, ha="right"
    )
