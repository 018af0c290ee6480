"""How a model declares a metal: by name, by complex index of refraction, or by colour."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import drjit as dr
import mitsuba as mi

from .errors import ParameterError, suggestion
from .microfacet.fresnel import Metal, fitted, mirror
from .microfacet.numerics import clamp, keep
from .microfacet.tables import Made
from .parameters import Colour, Parameter, Row, Spectrum, Usual, settled

ETA = Spectrum("", low=1e-3, high=100.0, usually=Usual(0.1, 10, logarithmic=True))
K, TINT = Spectrum("", high=100.0, usually=Usual(0.1, 10, logarithmic=True)), Colour("")
PARTS = {"eta": ETA, "k": K, "reflectivity": TINT, "edge_tint": TINT}
"""What a metal is given by, and the allowed ranges."""


@dataclass(frozen=True)
class Complex:
    """A conductor's complex index of refraction, per wavelength; ``mirror`` reflects everything instead."""

    eta: Any = None
    k: Any = None
    reflectivity: Any = None
    edge_tint: Any = None
    fit: Made = field(default_factory=Made)  # a `FittedMetal`, if it is the same everywhere

    def textures(self) -> dict[str, Any]:
        """Those of the chosen way, by name."""
        return {name: getattr(self, name) for name in PARTS if getattr(self, name) is not None}

    def remake(self, made: Made, make: Callable[[Metal], Any]) -> None:
        """Let ``made`` be what ``make`` makes of the metal, if that is the same everywhere, for good: else nothing."""
        if self.mirror or not settled(*self.textures().values()):
            made.clear()
            return
        metal = self._metal(dr.zeros(mi.SurfaceInteraction3f), True)
        made.update(lambda *_: make(metal), *metal.eta, *metal.k)

    @property
    def mirror(self) -> bool:
        """Whether this is Mitsuba's ``material: "none"``."""
        return self.eta is None and self.reflectivity is None

    def reflectance(self, si: Any, active: Any) -> Metal | Callable[[Any], Any]:
        """Fresnel's reflectance at a surface point, a function of the cosine of incidence; 1 of a mirror."""
        if self.mirror:
            return mirror
        metal = self._metal(si, active)  # has derivatives, perhaps, that were not asked for at the last update
        return metal if self.fit.result is None or dr.grad_enabled(metal) else self.fit.result

    def _metal(self, si: Any, active: Any) -> Metal:
        if self.eta is not None:
            return Metal(ETA.at(self.eta, si, active), K.at(self.k, si, active))
        return Metal(*artist_friendly(self.reflectivity.eval(si, active), self.edge_tint.eval(si, active)))


def artist_friendly(reflectivity: Any, edge_tint: Any) -> tuple[Any, Any]:
    """(eta, k) of the metal that reflects ``reflectivity`` at normal incidence (Gulbrandsen 2014, Eq. 1 to 4).

    ``edge_tint`` in [0, 1] biases the colour at grazing angles. Reflectivity is kept within [1e-6, 0.9999]: at 1, k
    would be infinite, and at 0 the derivative of eta.
    """
    r, edge_tint = keep(clamp(reflectivity, 0, 1), 1e-6, 0.9999), clamp(edge_tint, 0, 1)
    low, high = (1 - r) / (1 + r), (1 + dr.sqrt(r)) / (1 - dr.sqrt(r))
    eta = edge_tint * low + (1 - edge_tint) * high
    k2 = (r * dr.square(eta + 1) - dr.square(eta - 1)) / (1 - r)
    return eta, dr.sqrt(keep(k2, 1e-6, dr.inf))


@dataclass(frozen=True)
class Conductor(Parameter):
    """A metal in one of three ways: ``material``, or ``eta`` and ``k``, or ``reflectivity`` and ``edge_tint``."""

    suffix: str = ""
    kind: ClassVar[str] = "conductor"

    def names(self) -> tuple[str, ...]:
        """The five names, with this conductor's suffix."""
        return tuple(name + self.suffix for name in ("material", "eta", "k", "reflectivity", "edge_tint"))

    def parse(self, props: mi.Properties) -> Any:
        """A `Complex`, or None if nothing is given and there is no default."""
        material, eta, k, reflectivity, edge_tint = self.names()
        ways = [way for way in ((material,), (eta, k), (reflectivity, edge_tint)) if any(name in props for name in way)]
        if len(ways) > 1:
            raise ParameterError(f"{' and '.join(way[0] for way in ways)} exclude each other: give one metal, one way.")
        if not ways or ways[0] == (material,):
            name = props.get(material, self.default)
            return None if name is None else self._named(name, material)
        if ways[0] == (eta, k):
            for name, other in ((eta, k), (k, eta)):
                if name not in props:
                    raise ParameterError(f"{other} is given without {name}: a metal's index needs both.")
            return Complex(*(part.named(name).texture(props, name) for name, part in ((eta, ETA), (k, K))))
        if reflectivity not in props:
            raise ParameterError(f"{edge_tint} is given without {reflectivity}.")
        tint = props.get_texture(edge_tint, 0.0) if edge_tint not in props else None
        return Complex(
            reflectivity=TINT.named(reflectivity).texture(props, reflectivity),
            edge_tint=tint or TINT.named(edge_tint).texture(props, edge_tint),
        )

    def _named(self, material: Any, name: str) -> Complex:
        if material == "none":
            return Complex()
        if not isinstance(material, str):
            raise ParameterError(f"{name} = {material!r}: expected the name of a metal, such as 'Au'.")
        if material not in materials():
            raise ParameterError(
                f"{name} = {material!r}: not a material that Mitsuba knows. {suggestion(material, materials())}"
            )
        found = _objects(mi.load_dict({"type": "conductor", "material": material}))
        return Complex(found["eta"], found["k"])

    def at(self, value: Any, si: Any, active: Any) -> Any:
        """Reflectance, a function of the cosine of incidence; None if there is no metal."""
        return None if value is None else value.reflectance(si, active)

    def update(self, value: Any) -> None:
        """Bring its fit up to date."""
        if value is not None:
            value.remake(value.fit, fitted)

    def children(self, value: Any) -> Mapping[str, Any]:
        """The textures of the chosen way."""
        parts = {} if value is None else value.textures()
        return {name + self.suffix: texture for name, texture in parts.items()}

    def check(self, value: Any) -> None:
        """Check the textures of the chosen way."""
        for name, texture in self.children(value).items():
            PARTS[name.removesuffix(self.suffix)].named(name).check(texture)

    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Of all four parts, but not k = 0, where derivatives are infinite at the critical angle."""
        ends = {name: (part.low, part.high) for name, part in PARTS.items()} | {"k": (-math.inf, K.high)}
        return {name + self.suffix: both for name, both in ends.items()}

    def usual(self) -> Mapping[str, Usual]:
        """Of all four parts."""
        return {name + self.suffix: part.named(name).usual()[name] for name, part in PARTS.items()}

    def rows(self) -> Iterable[Row]:
        """A line for each name."""
        material, eta, k, reflectivity, edge_tint = self.names()
        default = "-" if self.default is None else self.default
        yield Row(
            material, "name", default, 'Mitsuba\'s, or "none"', "", "", f"{self.meaning}: by name; 'none' is a mirror"
        )
        for name, part, default, meaning in (
            (eta, ETA, "-", f"{self.meaning}: real part of the index, with {k}"),
            (k, K, "-", f"{self.meaning}: extinction, with {eta}"),
            (reflectivity, TINT, "-", f"{self.meaning}: by colour at normal incidence"),
            (edge_tint, TINT, "0", f"colour bias at grazing, with {reflectivity}"),
        ):
            yield Row(name, part.kind, default, part.allowed(), str(self.usual()[name]), "", meaning)


@cache
def materials() -> list[str]:
    """Names of the conductors that come with Mitsuba, and ``none``."""
    folder = Path(mi.__file__).parent / "data" / "ior"
    return ["none", *sorted(path.name.removesuffix(".eta.spd") for path in folder.glob("*.eta.spd"))]


def _objects(parent: Any) -> dict[str, Any]:
    """What a Mitsuba object shows to ``mi.traverse``, by name."""
    found: dict[str, Any] = {}

    class Collect(mi.TraversalCallback):
        def put(self, name: str, value: Any, flags: int) -> None:
            found[name] = value

    parent.traverse(Collect())
    return found
