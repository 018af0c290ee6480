"""How a model declares its parameters, once.

A declaration is a class attribute of the model. From it come parsing, error messages, ``mi.traverse``, the tables of
``asperity show`` and the documentation. On a model that a scene has loaded, the attribute holds the parsed value: a
``mi.Texture``, a nested ``mi.BSDF``, or a plain Python value.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from copy import copy
from dataclasses import dataclass, field
from typing import Any, ClassVar, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from .errors import ParameterError, suggestion
from .microfacet.numerics import clamp


class Row(NamedTuple):
    """One line of a model's parameter table."""

    name: str
    kind: str
    default: str
    allowed: str
    usual: str
    unit: str
    meaning: str


class Usual(NamedTuple):
    """Where the values of a parameter usually are, and whether they vary by factors rather than by sums."""

    low: float
    high: float
    logarithmic: bool = False

    def __str__(self) -> str:
        return f"{self.low:g} to {self.high:g}{', log' if self.logarithmic else ''}"


@dataclass(frozen=True)
class Parameter:
    """A declared parameter; ``meaning`` is its one-line documentation, ``name`` that of the class attribute.

    ``when`` says when it counts: the name of a choice or flag, and its values then. Where it does not, giving it is an
    error, and its value is None.
    """

    meaning: str
    default: Any = None
    name: str = field(default="", init=False)
    when: tuple[Any, ...] = field(default=(), kw_only=True)
    kind: ClassVar[str] = ""
    unit: ClassVar[str] = ""

    def __set_name__(self, owner: type, name: str) -> None:
        if self.name in ("", name):
            object.__setattr__(self, "name", name)
        else:  # another class's parameter under a new name
            setattr(owner, name, self.named(name))

    def named(self, name: str) -> Any:
        """The same parameter with another name."""
        other = copy(self)
        object.__setattr__(other, "name", name)
        return other

    def __get__(self, model: Any, owner: type) -> Any:
        return self  # on the class; a loaded model's own attribute, the parsed value, comes first

    def names(self) -> tuple[str, ...]:
        """Names that a scene may give for this parameter."""
        return (self.name,)

    def allowed(self) -> str:
        """Range or set of values, for tables and messages."""
        return ""

    def parse(self, props: mi.Properties) -> Any:
        """Value from a scene's properties, or the default; raises ParameterError."""
        raise NotImplementedError

    def at(self, value: Any, si: Any, active: Any) -> Any:
        """The parsed value at a surface point."""
        return value

    def update(self, value: Any) -> None:
        """Bring up to date what is made from the parsed value once for all points, if it is `settled`."""

    def counts(self, model: Declared) -> bool:
        """Whether this means anything to ``model``, with its choices and flags."""
        return not self.when or getattr(model, self.when[0]) in self.when[1:]

    def unused(self, name: str) -> ParameterError:
        """An error that says when the parameter would count."""
        choice, *values = self.when
        return ParameterError(f"{name}: needs {choice} = {' or '.join(map(json.dumps, values))}.")

    def children(self, value: Any) -> Mapping[str, Any]:
        """What ``mi.traverse`` shall find in the parsed value: textures and nested BSDFs by name."""
        return {self.name: value} if isinstance(value, mi.Object) else {}

    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """(least, greatest) of what `children` returns, by name: where values and derivatives are finite."""
        return {}

    def usual(self) -> Mapping[str, Usual]:
        """Where values of what `children` returns usually are, by name: for sliders, fits and sweeps."""
        return {}

    def check(self, value: Any) -> None:
        """Raise ParameterError if the parsed value, perhaps updated since, is out of range."""

    def rows(self) -> Iterable[Row]:
        """Lines of the parameter table."""
        default = "-" if self.default is None else str(self.default)
        usual = str(self.usual().get(self.name, ""))
        yield Row(self.name, self.kind, default, self.allowed(), usual, self.unit, self.meaning)

    def wrong(self, name: str, given: str, where: str = "") -> ParameterError:
        """An error that names the parameter, what was given, and what is allowed."""
        within = f" in {self.allowed()}" if self.allowed() else ""
        return ParameterError(f"{name} = {given}{where}: expected a {self.kind}{within}.")


@dataclass(frozen=True)
class Texture(Parameter):
    """A number in a range, both ends included, constant or from a texture; ``unit`` says what it counts."""

    low: float = 0.0
    high: float = math.inf
    unit: str = ""  # type: ignore[misc]
    steep: bool = False  # whether derivatives are infinite at the upper end
    usually: Usual | None = None
    kind: ClassVar[str] = "number or texture"

    def allowed(self) -> str:
        """The range as an interval."""
        return f"[{self.low:g}, {self.high:g}{')' if math.isinf(self.high) else ']'}"

    def parse(self, props: mi.Properties) -> Any:
        """A ``mi.Texture``, or None if none is given and there is no default."""
        if self.name in props:
            return self.texture(props, self.name)
        return None if self.default is None else props.get_unbounded_texture(self.name, self.default)

    def texture(self, props: mi.Properties, name: str) -> Any:
        """The texture that the scene gives under ``name``, its range checked."""
        given = props[name]
        if isinstance(given, (bool, str)) or (isinstance(given, (int, float)) and not self.holds(given)):
            raise self.wrong(name, repr(given))
        try:
            texture = self.get(props, name)
        except RuntimeError as error:
            raise self.wrong(name, props.as_string(name)) from error
        # Mitsuba would take any colour by its luminance.
        spectrum = not varies(texture) and texture.class_name() != "UniformSpectrum"
        if not isinstance(self, Spectrum) and (spectrum or any(_coloured(found) for _, found in numbers(texture))):
            raise ParameterError(f"{name}: a colour or spectrum, where one number is expected.")
        self.check(texture)
        return texture

    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """Both ends, but not one at which derivatives are infinite."""
        return {self.name: (self.low, math.inf if self.steep else self.high)}

    def get(self, props: mi.Properties, name: str) -> Any:
        """Ask Mitsuba for the texture; unbounded, since a reflectance would be limited to [0, 1]."""
        return props.get_unbounded_texture(name)

    def holds(self, value: float) -> bool:
        """Whether a number is in range, as arrays hold it; NaN and infinity never are."""
        with np.errstate(over="ignore"):
            low, value, high = np.array([self.low, value, self.high], dtype=np.float32)
        return bool(np.isfinite(value) and low <= value <= high)

    def usual(self) -> Mapping[str, Usual]:
        """As declared, or all that is allowed, if that ends."""
        finite = math.isfinite(self.low) and math.isfinite(self.high)
        usual = self.usually or (Usual(self.low, self.high) if finite else None)
        return {} if usual is None else {self.name: usual}

    def at(self, value: Any, si: Any, active: Any) -> Any:
        """The number, within the range."""
        return self.clamp(value.eval_1(si, active))

    def clamp(self, value: Any) -> Any:
        """Values moved into the range: vertex attributes, which no check sees, and optimisers' steps may leave it."""
        return clamp(value, self.low, self.high)

    def check(self, value: Any) -> None:
        """Check every constant and texel that Mitsuba shows."""
        for key, data in numbers(value):
            low, high = data.min(), data.max()
            if not (self.holds(low) and self.holds(high)):
                raise self.wrong(self.name, f"{high if self.holds(low) else low:g}", where=f" (in its {key!r})")


@dataclass(frozen=True)
class Constant(Texture):
    """A number in a range, the same everywhere: what tables are made from. It has derivatives like any other."""

    kind: ClassVar[str] = "number"

    def parse(self, props: mi.Properties) -> Any:
        """A ``mi.Texture`` that does not vary."""
        texture = super().parse(props)
        if texture is not None:
            constant(self.name, texture)
        return texture

    def at(self, value: Any, si: Any = None, active: Any = True) -> Any:
        """The number, within the range, wherever the point is."""
        return self.clamp(constant(self.name, value))


@dataclass(frozen=True)
class Along:
    """The value of `Axes`: a texture along x and one along y, which are one for an isotropic material."""

    textures: Mapping[str, Any]  # one or two, by name

    @property
    def isotropic(self) -> bool:
        """Whether there is one number for both."""
        return len(self.textures) == 1

    @property
    def both(self) -> tuple[tuple[str, Any], tuple[str, Any]]:
        """(name, texture) along x and along y."""
        first, *rest = self.textures.items()
        return first, rest[0] if rest else first


@dataclass(frozen=True)
class Axes(Texture):
    """A number as NAME, or along the axes as NAME_u and NAME_v; an axis that is not given has NAME's default."""

    suffixes: tuple[str, str] = ("_u", "_v")

    def names(self) -> tuple[str, ...]:
        """NAME, and NAME with either suffix."""
        return self.name, *(self.name + suffix for suffix in self.suffixes)

    def one(self, name: str) -> Texture:
        """The parameter of one of these names."""
        return Texture(self.meaning, self.default, low=self.low, high=self.high, unit=self.unit).named(name)

    def parse(self, props: mi.Properties) -> Along:
        """The value by the names that the scene gives, or by NAME."""
        name, *axes = self.names()
        conflict({name} & set(props.keys()), set(axes) & set(props.keys()))
        given = [axis if axis in props else name for axis in axes]
        return Along({name: self.one(name).parse(props) for name in dict.fromkeys(given)})

    def at(self, value: Along, si: Any, active: Any) -> tuple[Any, Any]:
        """The numbers along x and along y."""
        u, v = (self.clamp(texture.eval_1(si, active)) for _, texture in value.both)
        return u, v

    def children(self, value: Any) -> Mapping[str, Any]:
        """One texture or two."""
        return {} if value is None else value.textures

    def check(self, value: Any) -> None:
        """Check what is there."""
        for name, texture in self.children(value).items():
            self.one(name).check(texture)

    def ranges(self) -> Mapping[str, tuple[float, float]]:
        """The same for all names."""
        return {name: both for both in super().ranges().values() for name in self.names()}

    def usual(self) -> Mapping[str, Usual]:
        """The same for all names."""
        return {name: usual for usual in super().usual().values() for name in self.names()}

    def rows(self) -> Iterable[Row]:
        """A line for each name."""
        (row,) = super().rows()
        yield row
        for axis, name in zip("xy", self.names()[1:]):
            yield row._replace(name=name, default="-", meaning=f"{self.name} along {axis}, instead of {self.name}")


@dataclass(frozen=True)
class ConstantAxes(Axes):
    """`Axes` of numbers that are the same everywhere."""

    kind: ClassVar[str] = "number"

    def one(self, name: str) -> Texture:
        """The parameter of one of these names."""
        return Constant(self.meaning, self.default, low=self.low, high=self.high, unit=self.unit).named(name)


@dataclass(frozen=True)
class Spectrum(Texture):
    """A number in a range at each wavelength."""

    kind: ClassVar[str] = "spectrum or texture"

    def at(self, value: Any, si: Any, active: Any) -> Any:
        """The spectrum, within the range."""
        return self.clamp(value.eval(si, active))


@dataclass(frozen=True)
class Colour(Spectrum):
    """A reflectance in [0, 1] at each wavelength: number, colour, spectrum or texture."""

    high: float = 1.0
    kind: ClassVar[str] = "colour or texture"

    def get(self, props: mi.Properties, name: str) -> Any:
        """Ask Mitsuba for a reflectance."""
        return props.get_texture(name)


@dataclass(frozen=True)
class Ior(Texture):
    """A dielectric's index of refraction: a name that Mitsuba knows (``"bk7"``), a number or a texture."""

    low: float = 0.5
    high: float = 5.0
    usually: Usual | None = field(default_factory=lambda: Usual(1, 2))
    kind: ClassVar[str] = "name, number or texture"

    def parse(self, props: mi.Properties) -> Any:
        """Names are looked up by Mitsuba."""
        if isinstance(props.get(self.name, self.default), str):
            try:
                props[self.name] = mi.lookup_ior(props, self.name, self.default)
            except RuntimeError as error:
                raise ParameterError(f"{self.name} = {props[self.name]!r}: {error}") from error
        return super().parse(props)


@dataclass(frozen=True)
class Choice(Parameter):
    """One of a few words; the first is the default."""

    options: tuple[str, ...] = ()
    kind: ClassVar[str] = "choice"

    def __post_init__(self) -> None:
        object.__setattr__(self, "default", self.options[0])

    def allowed(self) -> str:
        """The words."""
        return ", ".join(self.options)

    def parse(self, props: mi.Properties) -> str:
        """The word, if it is one of the options."""
        given = props.get(self.name, self.default)
        if given not in self.options:
            raise ParameterError(f"{self.name} = {given!r}. {suggestion(str(given), self.options)}")
        return given


@dataclass(frozen=True)
class Direction(Parameter):
    """A direction in the scene: a vector of any length but zero, which is normalised."""

    kind: ClassVar[str] = "vector"

    def parse(self, props: mi.Properties) -> tuple[float, float, float]:
        """The unit vector."""
        given = props.get(self.name, self.default)
        try:
            x, y, z = (float(part) for part in given)
        except (TypeError, ValueError) as error:
            raise self.wrong(self.name, _short(given)) from error
        length = math.hypot(x, y, z)
        if not 0 < length < math.inf:  # nor NaN
            raise self.wrong(self.name, repr([x, y, z]), where=", which has no direction")
        return x / length, y / length, z / length


@dataclass(frozen=True)
class Integer(Parameter):
    """A whole number from ``low`` to ``high``."""

    low: int = 0
    high: int = 2**31 - 1
    kind: ClassVar[str] = "whole number"

    def allowed(self) -> str:
        """The range as an interval."""
        return f"[{self.low}, {self.high}]"

    def parse(self, props: mi.Properties) -> int | None:
        """The number, or the default; flags and fractions are not accepted."""
        given = props.get(self.name, self.default)
        if self.name in props and (type(given) is not int or not self.low <= given <= self.high):
            raise self.wrong(self.name, repr(given))
        return given


@dataclass(frozen=True)
class Flag(Parameter):
    """True or false."""

    kind: ClassVar[str] = "true or false"

    def parse(self, props: mi.Properties) -> bool:
        """The flag; numbers and words are not accepted."""
        given = props.get(self.name, self.default)
        if not isinstance(given, bool):
            raise self.wrong(self.name, repr(given))
        return given


@dataclass(frozen=True)
class BSDF(Parameter):
    """A nested BSDF; in XML it may be unnamed."""

    kind: ClassVar[str] = "BSDF"

    def parse(self, props: mi.Properties) -> Any:
        """The nested plugin, or None."""
        unnamed = [name for name in props.keys() if is_unnamed(name) and isinstance(props[name], mi.BSDF)]  # noqa: SIM118
        names = [self.name] * (self.name in props) + unnamed
        if len(names) > 1:
            raise ParameterError(f"{self.name}: {len(names)} nested BSDFs are given, one is allowed.")
        if not names:
            return None
        given = props[names[0]]
        if not isinstance(given, mi.BSDF):
            raise self.wrong(self.name, _short(given))
        return given


def _short(given: Any) -> str:
    """What was given, in a word."""
    return given.class_name() if isinstance(given, mi.Object) else repr(given)


def conflict(first: set[str], second: set[str], why: str = "give one or the other") -> None:
    """Raise ParameterError if both sets have members."""
    if first and second:
        raise ParameterError(f"{min(first)} and {min(second)} exclude each other: {why}.")


def is_unnamed(name: str) -> bool:
    """Whether Mitsuba made up ``name`` for a nested object that has none in the XML."""
    return name.startswith("_arg_")


class Declared:
    """What reads the declarations of a class; the base of every model.

    A model may define ``configure(given)`` to settle parameters that depend on each other; ``given`` holds the names
    that the scene gave. ``between`` names, for a texture, the parameters that its values lie between. ``geometry`` is
    the class of the microgeometry that it models, if there is one: see `microgeometry`.
    """

    between: ClassVar[tuple[str, ...]] = ()
    geometry: ClassVar[Any] = None

    @classmethod
    def declarations(cls) -> list[Parameter]:
        """The parameters, in the order in which class bodies name them; those of base classes come first."""
        found: dict[str, Parameter] = {}
        for name, value in (pair for base in reversed(cls.__mro__) for pair in vars(base).items()):
            if isinstance(value, Parameter):
                found[name] = value
            else:
                found.pop(name, None)
        return list(found.values())

    @classmethod
    def defaults(cls) -> dict[str, Any]:
        """The default of each parameter, by name."""
        return {parameter.name: parameter.default for parameter in cls.declarations()}

    @classmethod
    def rows(cls) -> list[Row]:
        """The parameter table."""
        return [row for parameter in cls.declarations() for row in parameter.rows()]

    @classmethod
    def parse(cls, props: mi.Properties) -> Declared:
        """A model with the scene's parameters; raises ParameterError."""
        declarations = cls.declarations()
        names = {name for parameter in declarations for name in parameter.names()}
        given = {name for name in props.keys() if not is_unnamed(name)}  # noqa: SIM118  (Properties is no dict)
        for name in sorted(given - names):
            raise ParameterError(f"{props.plugin_name()} has no parameter {name!r}. {suggestion(name, sorted(names))}")
        nests = any(isinstance(parameter, BSDF) for parameter in declarations)
        for name in props.keys():  # noqa: SIM118
            if is_unnamed(name) and not (nests and isinstance(props[name], mi.BSDF)):
                raise ParameterError(f"{_short(props[name])} has no name. Allowed: {', '.join(sorted(names))}.")
        model = cls()
        for parameter in declarations:
            setattr(model, parameter.name, parameter.parse(props))
            for name in parameter.names():
                props.mark_queried(name)
        model.configure(given)
        for parameter in declarations:
            if not parameter.counts(model):
                for name in sorted(given.intersection(parameter.names())):
                    raise parameter.unused(name)
                setattr(model, parameter.name, None)
        model.refresh()
        return model

    def configure(self, given: set[str]) -> None:
        """Settle parameters that depend on each other."""

    def refresh(self) -> None:
        """Bring everything up to date, at first and whenever ``mi.traverse`` changed a parameter."""
        for parameter in self.declarations():
            parameter.update(getattr(self, parameter.name))
        self.update()

    def update(self) -> None:
        """Bring up to date what is made from the parameters; part of `refresh`."""

    def at(self, name: str, si: Any, active: Any) -> Any:
        """The parameter ``name`` at a surface point: what its kind's ``at`` returns."""
        return getattr(type(self), name).at(getattr(self, name), si, active)

    @classmethod
    def microgeometry(cls, description: dict[str, Any]) -> Any:
        """The explicit microgeometry that a scene's description of this model stands for; raises ParameterError."""
        from .loading import load

        if cls.geometry is None:
            raise ParameterError(f"{cls.__name__} has no microgeometry to measure.")
        load(description)  # complains of what is wrong with it
        return cls.geometry.of(cls.defaults() | description, set(description))

    def ranges(self) -> dict[str, tuple[float, float]]:
        """(least, greatest) by the name of a texture."""
        return {name: limits for parameter in self.declarations() for name, limits in parameter.ranges().items()}

    @classmethod
    def usual(cls) -> dict[str, Usual]:
        """Usual values by the name of a texture."""
        return {name: usual for parameter in cls.declarations() for name, usual in parameter.usual().items()}

    def children(self) -> dict[str, Any]:
        """Textures and nested BSDFs by name, for ``mi.traverse``."""
        return {
            name: child
            for parameter in self.declarations()
            for name, child in parameter.children(getattr(self, parameter.name)).items()
        }

    def check(self) -> None:
        """Check values that may have been updated through ``mi.traverse``."""
        for parameter in self.declarations():
            parameter.check(getattr(self, parameter.name))


def _coloured(found: np.ndarray) -> bool:
    """Whether constants or texels have three channels, and not the same ones."""
    channels = found if found.ndim == 3 else found.T
    return bool(found.ndim > 1 and channels.shape[-1] == 3 and np.ptp(channels, axis=-1).any())


def varies(texture: Any) -> bool:
    """Whether a texture may differ between points. Not all that do say so (Mitsuba's ``mesh_attribute``)."""
    return texture.is_spatially_varying() or not texture.class_name().endswith("Spectrum")


def settled(*textures: Any) -> bool:
    """Whether what is made from textures now holds everywhere, at all wavelengths, and needs no derivatives.

    Not in a frozen function: it is recorded for the present numbers, and replayed for others.
    """
    if mi.is_spectral or any(map(varies, textures)) or dr.flag(dr.JitFlag.FreezingScope):
        return False
    return not any(dr.grad_enabled(value) for texture in textures for _, value in mi.traverse(texture).items())


def constant(name: str, texture: Any, why: str = "") -> Any:
    """The number of a texture, with its derivatives; raises ParameterError, about ``name``, if it varies."""
    if varies(texture):
        raise ParameterError(f"{name}: a texture, where one number for the whole surface is expected{why}.")
    return texture.eval_1(dr.zeros(mi.SurfaceInteraction3f), True)


def numbers(texture: Any, differentiated: bool = False) -> Iterable[tuple[str, np.ndarray]]:
    """The constants and texels of a texture; those being ``differentiated`` only if asked."""
    if isinstance(ours := getattr(texture, "model", None), Declared):
        for name in ours.between:
            yield from numbers(getattr(ours, name), differentiated)
        return
    for key, data in mi.traverse(texture).items() if isinstance(texture, mi.Texture) else ():
        if key.rsplit(".", 1)[-1] not in ("value", "values", "data") or (dr.grad_enabled(data) and not differentiated):
            continue
        found = np.asarray(dr.detach(data))
        if found.dtype == np.uint8:
            found = found / 255
        # In spectral variants Mitsuba keeps colours as three coefficients, which have no range.
        texels = isinstance(data, mi.TensorXf) and found.ndim == 3 and found.shape[-1] == 3
        if not (mi.is_spectral and (texels or isinstance(data, mi.Color3f))):
            yield key, found


def all_shown(texture: Any) -> bool:
    """Whether `numbers` are all that a texture is made of: attributes of meshes are not, nor spectral colours."""
    if isinstance(ours := getattr(texture, "model", None), Declared):
        return all(all_shown(getattr(ours, name)) for name in ours.between)
    tree = mi.traverse(texture)
    shown = {tree.properties[key][2] for key, _ in numbers(texture, differentiated=True)}
    parents = {parent for parent, _ in tree.hierarchy.values()}
    return all(node in shown for node in tree.hierarchy if node not in parents)
