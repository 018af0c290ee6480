"""Which numbers of a description a fit may change: from the models' declarations, with bounds, scales and starts."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import loading
from ..errors import ParameterError, suggestion
from ..materials import changed
from ..models import MODELS
from ..parameters import Axes, Ior, Spectrum, Usual

Array = NDArray[np.float64]
Description = dict[str, Any]
SHARE = Usual(0.0, 1.0)

MITSUBA: dict[str, dict[str, tuple[Usual, tuple[float, float], bool]]] = {
    "diffuse": {"reflectance": (SHARE, (0, 1), True)},
    "roughconductor": {
        "alpha": (Usual(0.01, 1, logarithmic=True), (1e-3, 1), False),
        "eta": (Usual(0.1, 10, logarithmic=True), (1e-2, 100), True),
        "k": (Usual(0.1, 10, logarithmic=True), (1e-2, 100), True),
    },
    "roughplastic": {
        "alpha": (Usual(0.02, 1, logarithmic=True), (1e-2, 1), False),
        "int_ior": (Usual(1.1, 2), (1.01, 5), False),
        "diffuse_reflectance": (SHARE, (0, 0.999), True),
    },
    "principled": {
        "base_color": (SHARE, (0, 1), True),
        "roughness": (Usual(0.1, 1), (0.05, 1), False),
        "metallic": (SHARE, (0, 1), False),
        "specular": (Usual(0.01, 1), (0.01, 1), False),
        "spec_tint": (SHARE, (0, 1), False),
        "sheen": (SHARE, (0, 1), False),
        "sheen_tint": (SHARE, (0, 1), False),
        "clearcoat": (SHARE, (0, 1), False),
        "clearcoat_gloss": (SHARE, (0, 1), False),
        "flatness": (SHARE, (0, 1), False),
        "anisotropic": (SHARE, (0, 1), False),
    },
    "blendbsdf": {"weight": (SHARE, (0, 1), False)},
}
"""Mitsuba's plugins do not declare what is usual: usual and allowed range, and whether it is a colour, by parameter."""
BEYOND = 10
"""Of usual values, which a fit may leave; but a roughness of 700 explains nothing."""
DENSER = 1.001
"""Than air: indices of refraction of what is measured."""
ALONG = {"roughconductor": {"alpha": ("alpha_u", "alpha_v")}}
"""What data that are not isotropic have instead of a parameter; `principled` has ``anisotropic`` beside."""
NEVER = ("ext_ior",)
"""Of two indices of refraction only the ratio matters."""
ASKED = ("wavelengths", "variation_azimuth", "clearcoat_gloss", "sheen_tint", "spec_tint", "flatness", "sheen")
"""Free only if somebody asks for them: what they do is hardly seen in one material's BRDF."""


@dataclass(frozen=True)
class Free:
    """A parameter to fit: its ``path`` in the description, as in ``--set``; a colour has a number in each channel."""

    path: str
    usual: Usual
    low: float
    high: float
    colour: bool
    start: float | None = None  # what the description says

    @property
    def logarithmic(self) -> bool:
        """Whether steps are factors."""
        return self.usual.logarithmic

    def unit(self, value: Any) -> Array:
        """Where values are between the usual ends: 0 to 1, beyond if they are unusual."""
        low, high, value = self._scaled(self.usual.low), self._scaled(self.usual.high), self._scaled(value)
        return np.asarray((value - low) / (high - low))

    def value(self, unit: Any) -> Array:
        """The inverse of `unit`, within the allowed range."""
        low, high = self._scaled(self.usual.low), self._scaled(self.usual.high)
        found = low + np.asarray(unit) * (high - low)
        return np.clip(np.exp(found) if self.logarithmic else found, self.low, self.high)

    def slope(self, value: Array) -> Array:
        """The derivative of `value` by the unit."""
        width = self._scaled(self.usual.high) - self._scaled(self.usual.low)
        return width * (value if self.logarithmic else np.ones_like(value))

    def _scaled(self, value: Any) -> Any:
        return np.log(value) if self.logarithmic else np.asarray(value, dtype=np.float64)


def parameters(description: Description, isotropic: bool = True) -> list[Free]:
    """All that may be fitted, in the order of the declarations, nested BSDFs last; needs a variant to be set."""
    return list(_of(description, "", isotropic))


def _of(node: Description, prefix: str, isotropic: bool) -> Iterator[Free]:
    for free in (_declared if node["type"] in MODELS else _known)(node, isotropic):
        yield replace(free, path=prefix + free.path)
    for name, part in node.items():
        if isinstance(part, dict) and "type" in part:
            yield from _of(part, f"{prefix}{name}.", isotropic)


def _declared(node: Description, isotropic: bool) -> Iterator[Free]:
    """Those that one of our models declares, and that count."""
    model: Any = loading.load(node).model  # type: ignore[attr-defined]
    for parameter in model.declarations():
        value = getattr(model, parameter.name)
        if value is None or ("material" in node and parameter.kind == "conductor"):
            continue
        usual, ranges = parameter.usual(), parameter.ranges()
        names = list(parameter.children(value))
        if not isotropic and isinstance(parameter, Axes) and len(names) == 1 and names[0] not in node:
            names = list(parameter.names()[1:])
        for name in names:
            if name not in usual or name in NEVER or _textured(node.get(name)):
                continue
            low, high = ranges[name]
            high = min(high, getattr(parameter, "high", math.inf))
            inner = 1e-3 * (usual[name].high - usual[name].low)
            # Where derivatives are infinite at an end, or a factor would not do, the end itself is left out.
            steep = getattr(parameter, "steep", False)
            low = max(low, 1e-4) if usual[name].logarithmic else low
            low = max(low, DENSER) if isinstance(parameter, Ior) else low
            low, high = max(low, unusual(usual[name])[0]), min(high, unusual(usual[name])[1])
            colour = isinstance(parameter, Spectrum) or parameter.kind == "conductor"
            yield Free(name, usual[name], low, high - inner * steep, colour, _start(node.get(name)))


def unusual(usual: Usual) -> tuple[float, float]:
    """How far from what is usual a fit may go: as far again, or by a factor of `BEYOND`."""
    if usual.logarithmic:
        return usual.low / BEYOND, usual.high * BEYOND
    width = usual.high - usual.low
    return usual.low - width, usual.high + width


def _known(node: Description, isotropic: bool) -> Iterator[Free]:
    """Those of Mitsuba's plugins."""
    plugin = node["type"]
    given_metal = plugin == "roughconductor" and "eta" not in node
    for parameter, (usual, (low, high), colour) in MITSUBA.get(plugin, {}).items():
        if (given_metal and parameter in ("eta", "k")) or (isotropic and parameter == "anisotropic"):
            continue
        along = ALONG.get(plugin, {}) if not isotropic and parameter not in node else {}
        for name in along.get(parameter, (parameter,)):
            if not _textured(node.get(name)):
                yield Free(name, usual, low, high, colour, _start(node.get(name)))


def _textured(given: Any) -> bool:
    """Whether a description has a texture or a spectrum there, not a number or colour."""
    return isinstance(given, dict) and given.get("type") not in ("rgb", "uniform")


def _start(given: Any) -> float | None:
    """The number that a description has; of a colour its mean."""
    value = given.get("value") if isinstance(given, dict) else given
    return (
        float(np.mean(value)) if isinstance(value, (int, float, list, tuple)) and not isinstance(value, bool) else None
    )


def chosen(everything: list[Free], free: Collection[str] | None, fixed: Collection[str]) -> list[Free]:
    """Those that are to be fitted: all but the fixed ones, or those named ``free``; raises ParameterError."""
    names = [one.path for one in everything]
    for name in [*(free or ()), *fixed]:
        if name not in names and name not in fixed:
            raise ParameterError(f"free: the model has no {name!r} to fit. {suggestion(name, names)}")
    found = [
        one
        for one in everything
        if one.path not in fixed and (one.path in free if free is not None else one.path.split(".")[-1] not in ASKED)
    ]
    if not found:
        raise ParameterError(f"free: nothing is left to fit. {suggestion('', names)}")
    return found


def described(description: Description, values: Mapping[str, Array], channels: tuple[str, ...]) -> Description:
    """The description with these values, a colour's for each of the channels."""
    return changed(description, {path: _literal(value, channels) for path, value in values.items()})


def _literal(value: Array, channels: tuple[str, ...]) -> Any:
    """A number, a colour, or a spectrum, as descriptions have them."""
    if value.size == 1:
        return float(value.ravel()[0])
    if channels == ("R", "G", "B"):
        return {"type": "rgb", "value": [float(x) for x in value]}
    waves = [float(name.split()[0]) for name in channels]
    return {
        "type": "irregular",
        "wavelengths": ", ".join(f"{nm:.9g}" for nm in waves),
        "values": ", ".join(f"{x:.9g}" for x in value),
    }
