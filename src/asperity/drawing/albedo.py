"""Directional albedo against the angle of incidence, whole and by lobe; of measurements, by order of scattering."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import mitsuba as mi
import numpy as np
from matplotlib.figure import Figure

from asperity.goniophotometer.sensors import check_angles, directions
from asperity.lab import evaluate
from asperity.materials import Material

from . import curves, style, values
from .values import Curve

GRID = np.append(np.arange(0, 89, 2.0), [89.0, 89.7])
"""θi of the curves, in degrees."""
SAMPLES = 2**13
"""For each value."""


def figure(
    materials: Sequence[Material],
    *,
    phi: float = 0.0,
    parts: bool | None = None,
    channel: str = "mean",
    wavelengths: Sequence[float] | None = None,
) -> Figure:
    """Directional albedo against the angle of incidence; with its parts: lobes, orders, what is transmitted."""
    check_angles([(0, phi)])
    channels = values.pick(values.channels(materials, wavelengths), channel)
    made, (axes,) = style.panels(1, 2.4)
    single = len(materials) == len(channels) == 1
    panel = curves.arrange([material.name for material in materials], ["all"], channels)[0]
    for line in panel.lines:
        material, look = materials[line.material], line.look | ({"color": "black"} if single else {})
        curves.draw(axes, over_incidence(material, phi, wavelengths), line._replace(look=look))
        if single if parts is None else parts:
            for n, (name, curve) in enumerate(parts_of(material, phi, wavelengths).items()):
                colour = style.MATERIALS[n % len(style.MATERIALS)] if single else look["color"]
                label = name if single else f"{look['label']}, {name}"
                part = {"label": label, "color": colour, "linestyle": style.DASHES[1 + n % 3]}
                curves.draw(axes, curve, line._replace(look=part))
    top = max(np.max(line.get_ydata(), initial=0) for line in axes.lines)
    axes.set(xlim=(-1.5, 90), xticks=range(0, 91, 15), ylim=(0, max(1.05 * top, 1e-3)))
    axes.set(xlabel=rf"{style.THETA_I} [°]", ylabel="directional albedo")
    axes.grid()
    return curves.finish(made, [axes], [panel._replace(title=materials[0].name if len(materials) == 1 else "")])


def over_incidence(material: Material, phi: float, wavelengths: Sequence[float] | None = None) -> Curve:
    """The share of the light that is reflected upwards."""
    if material.measured is not None:
        return _measured(material, phi, *material.measured.total_albedo)
    return Curve(GRID, _sampled(material, phi, wavelengths))


def parts_of(material: Material, phi: float, wavelengths: Sequence[float] | None = None) -> dict[str, Curve]:
    """What the albedo consists of, and what is transmitted, by name; nothing if it is all one."""
    if material.measured is not None:
        value, error = material.measured.albedo
        names = material.measured.order_names if material.measured.orders > 1 else []
        return {name: _measured(material, phi, value[:, n], error[:, n]) for n, name in enumerate(names)}
    bsdf = material.load()
    lobes: dict[str, Curve] = {}
    if bsdf.component_count() > 1:
        for n in range(bsdf.component_count()):
            value = _sampled(material, phi, wavelengths, component=n)
            if value.any():
                lobes[f"lobe {n + 1}: {kind(bsdf.flags(n))}"] = Curve(GRID, value)
    found = lobes if len(lobes) > 1 else {}
    if values.transmits(material):
        found["transmitted"] = Curve(GRID, _sampled(material, phi, wavelengths, below=True))
    return found


def kind(flags: Any) -> str:
    """What a lobe is called."""
    kinds = {"diffuse": mi.BSDFFlags.Diffuse, "glossy": mi.BSDFFlags.Glossy, "mirror": mi.BSDFFlags.Delta}
    return next((name for name, flag in kinds.items() if mi.has_flag(flags, flag)), "straight through")


def _sampled(material: Material, phi: float, wavelengths: Sequence[float] | None, **which: Any) -> np.ndarray:
    """Albedos (channels, angles)."""
    wi = directions([(theta, phi) for theta in GRID])
    if not mi.is_spectral:
        return evaluate.albedo(material.load(), wi, SAMPLES, **which)
    wanted = list(values.spread() if wavelengths is None else wavelengths)
    count = len(values.spread())
    groups = [(wanted[n : n + count] + [wanted[-1]] * count)[:count] for n in range(0, len(wanted), count)]
    found = [evaluate.albedo(material.load(), wi, SAMPLES, group, **which) for group in groups]
    return np.concatenate(found)[: len(wanted)]


def _measured(material: Material, phi: float, value: np.ndarray, error: np.ndarray) -> Curve:
    """Of numbers (directions, channels), those for light of this azimuth."""
    incident = values.incidence([material], None, phi, (), most=len(value))
    rows = [values.row(material, tuple(one)) for one in incident]
    return Curve(incident[:, 0], value[rows].T, error[rows].T)
