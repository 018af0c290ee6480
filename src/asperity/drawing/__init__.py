"""Pictures of BSDFs: one file a view. Values come from `lab.evaluate`, or were measured; `style` says how all look."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from asperity.errors import ParameterError, UnknownNameError, suggestion

from . import style
from .albedo import albedo
from .hemisphere import hemisphere
from .lobe3d import lobe3d
from .lobes import lobes
from .rusinkiewicz import rusinkiewicz
from .sampling import sampling
from .slices import slices
from .spectrum import spectrum

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from asperity.materials import Material

VIEWS: dict[str, Callable[..., Figure]] = {
    view.__name__: view for view in (lobes, slices, hemisphere, rusinkiewicz, albedo, lobe3d, spectrum, sampling)
}
"""Each takes materials and options by name, and gives a figure; the first line of its docstring says what it shows."""
MEASURED = ("lobes", "slices", "hemisphere", "albedo")
"""Views that draw what was measured itself; the others draw a BSDF that interpolates it."""


def plot(materials: Sequence[Material], view: str = "lobes", **options: Any) -> Figure:
    """A Matplotlib figure of materials, together, in the variant of Mitsuba that is in use.

    Parameters
    ----------
    materials : what `materials.resolve` gives; measurements have error bars where curves are drawn
    view : a name in `VIEWS`
    options : those that the view has, of
        ``theta``, angles of incidence in degrees, in [0, 90); ``phi``, their azimuth; ``scale``, ``linear`` or ``log``;
        ``cosine``, false for f instead of f cos θo; ``channel``, ``mean``, ``each`` or a name; ``wavelengths`` in nm;
        ``isolines``; ``parts`` of the albedo; ``theta_o``, signed angles towards which a spectrum is drawn; ``phi_d``

    Raises UnknownNameError for a view, ParameterError for an option or value that makes no sense, or a BSDF that is
    not finite.
    """
    if view not in VIEWS:
        raise UnknownNameError("view", view, VIEWS)
    if not materials:
        raise ParameterError("materials: expected at least one.")
    known = option_names(view)
    for name in options.keys() - set(known):
        raise ParameterError(f"{name}: makes no sense with view {view}. {suggestion(name, known)}")
    with style.applied():
        return VIEWS[view]([_loaded(material, view) for material in materials], **options)


def option_names(view: str) -> list[str]:
    """The options that a view has."""
    return [name for name in inspect.signature(VIEWS[view]).parameters if name != "materials"]


def _loaded(material: Material, view: str) -> Material:
    """The material, loaded once; a measurement as it is, for views that draw such."""
    if material.measured is None:
        return _drawable(replace(material, description=None, bsdf=material.load()), view)
    if view in MEASURED:
        return material
    return replace(material, name=f"{material.name}, interpolated", bsdf=material.load(), measured=None)


def _drawable(material: Material, view: str) -> Material:
    """The material, whose name says if part of it is not in the picture; raises ParameterError if nothing would be."""
    import mitsuba as mi

    flags = material.bsdf.flags()
    if view == "albedo" or not mi.has_flag(flags, mi.BSDFFlags.Delta):
        return material
    if not mi.has_flag(flags, mi.BSDFFlags.Smooth):
        raise ParameterError(f"{material.name} is all mirror, or clear glass: its values are 0, and view albedo shows it.")
    return replace(material, name=f"{material.name} without its mirror")
