"""Values against the wavelength, towards chosen directions."""

from __future__ import annotations

from collections.abc import Sequence

import mitsuba as mi
import numpy as np
from matplotlib.figure import Figure

from asperity.errors import ParameterError
from asperity.goniophotometer.sensors import check_angles, directions
from asperity.lab import evaluate
from asperity.materials import Material

from . import curves, style, values
from .values import Curve

STEP = 5.0
"""nm."""


def figure(
    materials: Sequence[Material],
    *,
    theta: Sequence[float] | None = None,
    phi: float = 0.0,
    theta_o: Sequence[float] | None = None,
    cosine: bool = True,
    scale: str = "linear",
) -> Figure:
    """Values against the wavelength, towards θ_o in the plane of incidence: mirror, normal, light if left out."""
    style.check_scale(scale)
    evaluate.active_variant()
    if not mi.is_spectral:
        raise ParameterError(f"variant {mi.variant()}: it has no spectra. Choose llvm_ad_spectral, say.")
    (incident,) = (45.0,) if theta is None else theta if len(theta) == 1 else (None,)
    if incident is None:
        raise ParameterError(f"theta: a spectrum is of one angle of incidence; {len(theta or ())} were given.")
    check_angles([(incident, phi)])
    outgoing = np.array([incident, 0, -incident] if theta_o is None else theta_o, dtype=float)
    if not (np.abs(outgoing) < 90).all():
        raise ParameterError(f"theta_o = {outgoing.tolist()}: expected signed angles in (-90, 90) degrees.")
    x = np.arange(evaluate.SHORTEST, evaluate.LONGEST + STEP / 2, STEP)
    wi, wo = directions([(incident, phi)]), values.in_azimuth(outgoing, phi)
    found = [values.at(material, wi, wo, x) / (1 if cosine else wo[:, 2]) for material in materials]
    cases = [rf"{style.THETA_O} = {angle:g}°" for angle in outgoing]
    panels = curves.arrange([material.name for material in materials], cases, [("", 0)])
    made, places = style.panels(len(panels), 2.2)
    for axes, panel in zip(places, panels):
        for line in panel.lines:
            curves.draw(axes, Curve(x, found[line.material][None, :, line.case]), line)
        axes.set(xlim=(x[0], x[-1]), xlabel=r"$\lambda$ [nm]", ylabel=style.quantity(cosine), yscale=scale)
        if scale == "linear":
            axes.set_ylim(0, None)
        axes.grid()
    for n, panel in enumerate(panels):
        panels[n] = panel._replace(title=rf"{panel.title}, {style.THETA_I} = {incident:g}°")
    return curves.finish(made, places, panels)
