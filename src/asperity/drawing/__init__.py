"""Pictures of BSDFs: one file a view. Values come from `lab.evaluate`, or were measured; `style` says how all look."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import mitsuba as mi
import numpy as np

from asperity.errors import ParameterError, UnknownNameError, refuse_unknown
from asperity.loading import short

from . import albedo, comparison, hemisphere, lobe3d, lobes, rusinkiewicz, sampling, slices, spectrum, style

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from asperity.lab.compare import Comparison
    from asperity.materials import Material

    from .comparison import Previews

VIEWS: dict[str, Callable[..., Figure]] = {
    "lobes": lobes.figure,
    "slices": slices.figure,
    "hemisphere": hemisphere.figure,
    "rusinkiewicz": rusinkiewicz.figure,
    "albedo": albedo.figure,
    "lobe3d": lobe3d.figure,
    "spectrum": spectrum.figure,
    "sampling": sampling.figure,
}
"""Each takes materials and options by name, and gives a figure; the first line of its docstring says what it shows."""
MEASURED = ("lobes", "slices", "hemisphere", "albedo", "comparison")
"""Views that draw what was measured itself; the others draw a BSDF that interpolates it."""
MOST = 3
"""Parameters in a name that tells materials apart."""
ALL_LIGHT = ("albedo", "comparison")
"""Where mirrors are seen, too."""

NUMBERS = ("theta", "theta_o", "wavelengths")
"""Options that are several numbers, or one."""


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
    refuse_unknown(options, option_names(view), f"view {view}")
    options = {name: _numbers(name, value) if name in NUMBERS else value for name, value in options.items()}
    named = [replace(one, name=name) for one, name in zip(materials, distinct_names(materials))]
    with style.applied():
        return VIEWS[view]([_loaded(material, view) for material in named], **options)


def _numbers(name: str, given: Any) -> list[float] | None:
    """Those of an option, as a list; raises ParameterError."""
    if given is None:
        return None
    try:
        found = np.atleast_1d(np.asarray(given, dtype=float))
    except (TypeError, ValueError):
        found = np.zeros((0, 0))
    if found.ndim != 1:
        raise ParameterError(f"{name} = {short(given)}: expected a number, or a list of numbers.")
    if not found.size:
        raise ParameterError(f"{name}: expected at least one number.")
    return [float(number) for number in found]


def compared(a: Material, b: Material, found: Comparison, previews: Previews | None = None) -> Figure:
    """A figure of two materials side by side, ``a`` the reference, with what `comparison.compare` found of them."""
    names = distinct_names([a, b])
    with style.applied():
        shown = [_loaded(replace(one, name=name), "comparison") for one, name in zip((a, b), names)]
        return comparison.figure(shown, found, previews)


def option_names(view: str) -> list[str]:
    """The options that a view has."""
    return [name for name in inspect.signature(VIEWS[view]).parameters if name != "materials"]


def distinct_names(materials: Sequence[Material]) -> list[str]:
    """What to call them: where names are the same, with the parameters that differ, or else their place."""
    names = [material.name for material in materials]
    result = []
    for n, material in enumerate(materials):
        alike = [one.description for one in materials if one.name == material.name]
        if len(alike) == 1:
            result.append(material.name)
        elif any(one is None for one in alike):
            result.append(f"{material.name} ({names[: n + 1].count(material.name)})")
        else:
            result.append(", ".join([material.name, *_differing(material.description, alike)]))
    return result


def _differing(description: Any, others: Sequence[Any]) -> list[str]:
    """The parameters of a description that others have not, or have otherwise; the first few."""
    leaves, *rest = (dict(_leaves(one)) for one in (description, *others))
    found = [
        f"{key} = {short(value)}" for key, value in leaves.items() if any(one.get(key, ...) != value for one in rest)
    ]
    return found if len(found) <= MOST else [*found[:MOST], "..."]


def _leaves(description: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    """Parameters by their dotted names; a colour is its value."""
    for key, value in description.items():
        if isinstance(value, dict) and value.get("type") == "rgb":
            yield path + key, value.get("value")
        elif isinstance(value, dict):
            yield from _leaves(value, f"{path}{key}.")
        else:
            yield path + key, value


def _loaded(material: Material, view: str) -> Material:
    """The material, loaded once, whose name says what of it is not drawn; a measurement as it is, if views draw such.

    Raises ParameterError if nothing would be in the picture.
    """
    if material.measured is not None and view in MEASURED:
        return material
    note = ", interpolated" if material.measured is not None or material.brdf is not None else ""
    bsdf = material.load()
    flags = bsdf.flags()
    if view not in ALL_LIGHT and mi.has_flag(flags, mi.BSDFFlags.Delta):
        if not mi.has_flag(flags, mi.BSDFFlags.Smooth):
            raise ParameterError(
                f"{material.name} is all mirror, or clear glass: its values are 0, and view albedo shows it."
            )
        note = " without its mirror"
    return replace(material, name=material.name + note, description=None, bsdf=bsdf, measured=None, brdf=None)
