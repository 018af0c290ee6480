"""How a model declares a metal: by name, by complex index of refraction, or by colour."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, ClassVar

import drjit as dr
import mitsuba as mi

from .errors import ParameterError, suggestion
from .parameters import Colour, Parameter, Row, Texture


@dataclass(frozen=True)
class Complex:
    """A conductor's complex index of refraction, per wavelength; ``mirror`` reflects everything instead."""

    eta: Any = None
    k: Any = None
    reflectivity: Any = None
    edge_tint: Any = None

    @property
    def mirror(self) -> bool:
        """Whether this is Mitsuba's ``material: "none"``."""
        return self.eta is None and self.reflectivity is None

    def eval(self, si: mi.SurfaceInteraction3f, active: Any) -> tuple[Any, Any]:
        """(eta, k) at a surface point."""
        if self.eta is not None:
            return self.eta.eval(si, active), self.k.eval(si, active)
        return artist_friendly(self.reflectivity.eval(si, active), self.edge_tint.eval(si, active))


def artist_friendly(reflectivity: Any, edge_tint: Any) -> tuple[Any, Any]:
    """(eta, k) of the metal that reflects ``reflectivity`` at normal incidence (Gulbrandsen 2014, Eq. 1 to 4).

    ``edge_tint`` in [0, 1] biases the colour at grazing angles. Reflectivity is kept within [0, 0.9999]: at 1, k would
    be infinite.
    """
    r = dr.clip(reflectivity, 0, 0.9999)
    low, high = (1 - r) / (1 + r), (1 + dr.sqrt(r)) / (1 - dr.sqrt(r))
    eta = edge_tint * low + (1 - edge_tint) * high
    return eta, dr.safe_sqrt((r * dr.square(eta + 1) - dr.square(eta - 1)) / (1 - r))


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
            return Complex(*(_index(name, low).texture(props, name) for name, low in ((eta, 1e-3), (k, 0.0))))
        if reflectivity not in props:
            raise ParameterError(f"{edge_tint} is given without {reflectivity}.")
        tint = props.get_texture(edge_tint, 0.0) if edge_tint not in props else None
        return Complex(
            reflectivity=_colour(reflectivity).texture(props, reflectivity),
            edge_tint=tint or _colour(edge_tint).texture(props, edge_tint),
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

    def children(self, value: Any) -> Mapping[str, Any]:
        """The textures of the chosen way."""
        parts = {} if value is None else vars(value)
        return {name + self.suffix: texture for name, texture in parts.items() if texture is not None}

    def check(self, value: Any) -> None:
        """Check the textures of the chosen way."""
        for name, texture in self.children(value).items():
            tint = name.startswith(("reflectivity", "edge_tint"))
            (_colour(name) if tint else _index(name, 0.0)).check(texture)

    def rows(self) -> Iterable[Row]:
        """A line for each name."""
        material, eta, k, reflectivity, edge_tint = self.names()
        default = "-" if self.default is None else self.default
        yield Row(
            material, "name", default, 'Mitsuba\'s, or "none"', "", f"{self.meaning}: by name; 'none' is a mirror"
        )
        yield Row(eta, "spectrum or texture", "-", "> 0", "", f"{self.meaning}: real part of the index, with {k}")
        yield Row(k, "spectrum or texture", "-", "[0, inf)", "", f"{self.meaning}: extinction, with {eta}")
        yield Row(
            reflectivity, "colour or texture", "-", "[0, 1]", "", f"{self.meaning}: by colour at normal incidence"
        )
        yield Row(edge_tint, "colour or texture", "0", "[0, 1]", "", f"colour bias at grazing, with {reflectivity}")


def _index(name: str, low: float) -> Texture:
    part = Texture("", low=low, high=100.0)
    part.__set_name__(Texture, name)
    return part


def _colour(name: str) -> Colour:
    part = Colour("")
    part.__set_name__(Colour, name)
    return part


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
