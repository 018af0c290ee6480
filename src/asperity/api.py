"""The functions that `import asperity` offers: any material, with NumPy arrays in and out.

**Materials** are what `materials.resolve` takes: a preset's name, a model's or a Mitsuba plugin's, a file or text in
JSON or XML, a dictionary, a loaded ``mi.BSDF``, a measurement.

**Directions** are what `arrays.Directions` takes: arrays whose last axis holds unit vectors (3), or the angles θ and φ
in degrees (2). ``wi`` points to where light comes from, or the camera, ``wo`` to the other; both away from the surface.

**Variants.** The active variant of Mitsuba is used. If none is set, ``llvm_ad_rgb`` is. A scalar variant is replaced by
its LLVM one, and one without wavelengths, if they are asked for, by a spectral one; both for the time of the call,
which then costs half a second more. A BSDF that is loaded already has to be of the variant that is used.

**Channels**, the last axis of values: R, G and B; one in mono variants; or the ``wavelengths``, in nm, asked for.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import drjit as dr
import mitsuba as mi
import numpy as np
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from . import drawing, fitting, goniophotometer, loading, measured, models, plugin, validation, variants
from .arrays import CHUNK, Array, Directions, mapped
from .drawing import comparison
from .errors import ParameterError, listed, refuse_unknown, refuse_unused, whole
from .goniophotometer.mesh import MESHES
from .lab import checks
from .lab import evaluate as lab
from .materials import ABOVE, Material, resolve
from .measured.conversion import Converted
from .parameters import Declared
from .results import Checks, Compared, Picture, Samples
from .scenes import presets as _presets
from .scenes.preview import preview

NM = (360.0, 830.0)
"""Wavelengths that Mitsuba knows."""
SOBOL = 2**14
"""Samples of an albedo: of smooth BSDFs it has four digits then."""
SAMPLES = 2**32 - 1
"""Most of a picture that Mitsuba renders at once."""
MEASURING = [*inspect.signature(goniophotometer.measure).parameters][2:]
VIEWING = [name for name in inspect.signature(preview).parameters if name not in ("material", "size", "spp", "seed")]
FITTING = [*inspect.signature(fitting.fit).parameters][2:]
"""Options that `measure`, `render` and `fit` pass on."""

material = resolve
Model = TypeVar("Model")


def evaluate(
    material: Any,
    wi: ArrayLike,
    wo: ArrayLike,
    *,
    wavelengths: Sequence[float] | None = None,
    out: Any = None,
    chunk: int = CHUNK,
) -> Array:
    """f(wi, wo) |cos θo|, in 1/sr: (..., channels), for directions that are broadcast against each other.

    The cosine belongs to it, as in ``mi.BSDF.eval``. Mirrors and smooth glass have no such values: 0.

    ``chunk`` pairs are computed at a time. With ``out``, an array of the result's shape, such as a ``np.memmap``, and
    directions in one, memory is bounded however many there are. Raises ParameterError, and what `material` raises.
    """
    with _loaded(material, wavelengths) as target:

        def values(i: Array, o: Array) -> Array:
            return target.channels(lambda si: target.bsdf.eval(mi.BSDFContext(), si, lab.vectors(o)), i)

        return mapped(values, [target.incident("wi", wi), target.outgoing("wo", wo)], target.width, out, chunk)


def pdf(material: Any, wi: ArrayLike, wo: ArrayLike, *, out: Any = None, chunk: int = CHUNK) -> Array:
    """The density, in 1/sr, with which the material samples ``wo`` given ``wi``: (...,); ``out`` as in `evaluate`.

    In spectral variants it is that of wavelengths from 450 to 650 nm.
    """
    with _loaded(material, colourless=True) as target:

        def values(i: Array, o: Array) -> Array:
            si = lab.interaction(lab.vectors(i), len(i), target.groups[0])
            return lab.to_numpy(target.bsdf.pdf(mi.BSDFContext(), si, lab.vectors(o)), len(i)).T

        directions = [target.incident("wi", wi), target.outgoing("wo", wo)]
        return mapped(values, directions, 1, out[..., None] if isinstance(out, np.ndarray) else out, chunk)[..., 0]


def albedo(
    material: Any,
    theta: ArrayLike,
    phi: ArrayLike = 0.0,
    *,
    wavelengths: Sequence[float] | None = None,
    samples: int = SOBOL,
) -> Array:
    """The share of the light from θ and φ, in degrees, that is reflected upwards: (..., channels), for any shape.

    It is the mean weight of ``samples`` points of Sobol's sequence, a power of two: the same in every call.
    """
    samples = whole("samples", samples, 1, 2**24)
    if samples & (samples - 1):
        raise ParameterError(f"samples = {samples}: expected a power of two, such as {SOBOL}.")
    with _loaded(material, wavelengths) as target:
        angles = Directions("theta", _angles(theta, phi), *target.incidence)

        def values(i: Array) -> Array:
            found = [lab.albedo(target.bsdf, i, samples, group) for group in target.groups]
            return np.concatenate(found)[: target.width].T

        return mapped(values, [angles], target.width, chunk=max(1, CHUNK // samples))


def sample(
    material: Any,
    wi: ArrayLike,
    n: int,
    *,
    seed: int = 0,
    wavelengths: Sequence[float] | None = None,
    chunk: int = CHUNK,
) -> Samples:
    """Draw ``n`` directions for each of ``wi``: arrays (..., n), and an axis more for components and channels.

    The same ``seed`` gives the same directions, whatever the chunk. All channels share a direction, so there are at
    most as many ``wavelengths`` as a spectral variant has channels.
    """
    n, random = whole("n", n, 1), np.random.default_rng(whole("seed", seed, 0))
    with _loaded(material, wavelengths) as target:
        if len(target.groups) > 1:
            most = dr.size_v(mi.UnpolarizedSpectrum)
            raise ParameterError(f"wavelengths: {target.width} of them, and a sample has at most {most}.")

        def values(i: Array) -> Array:
            u = random.random((len(i), 3), dtype=np.float32).T
            si = lab.interaction(lab.vectors(i), len(i), target.groups[0])
            bs, weight = target.bsdf.sample(mi.BSDFContext(), si, mi.Float(u[0]), mi.Point2f(u[1:]))
            parts = (bs.wo, bs.pdf, mi.unpolarized_spectrum(weight))
            return np.concatenate([lab.to_numpy(part, len(i)) for part in parts])[: 4 + target.width].T

        found = mapped(values, [target.incident("wi", wi).repeated(n)], 4 + target.width, chunk=chunk)
        return Samples(found[..., :3], found[..., 4:], found[..., 3])


def check(
    material: Any,
    only: str | Sequence[str] = checks.NAMES,
    *,
    progress: Callable[[str, int, int], None] = checks.quiet,
) -> Checks:
    """Check what every BSDF must obey: sampling, reciprocity, energy, gradients and more; see `lab.checks`."""
    variants.ensure()
    found = resolve(material)
    bsdf = found.load()
    names = [only] if isinstance(only, str) else list(only)
    if not names:
        raise ParameterError(f"only: expected at least one check. {listed(checks.NAMES)}")
    return Checks(found.name, tuple(checks.check(found.description or bsdf, progress, names)))


def measure(
    what: Any,
    theta: ArrayLike = (0.0, 30.0, 60.0),
    phi: ArrayLike = 0.0,
    *,
    bsdf: dict[str, Any] | None = None,
    spacing: tuple[float, float] | float | None = None,
    periodic: str | None = None,
    **options: Any,
) -> goniophotometer.Measurement:
    """Measure a BSDF by tracing light, from θ and φ in degrees, through a microgeometry.

    ``what`` is a material whose model has a microgeometry; a mesh, .ply or .obj; heights, an array (rows, columns); or
    any `goniophotometer.Microgeometry`. A mesh and heights take the ``bsdf`` of their facets, and whether they go on
    ``periodic``: `goniophotometer.Mesh` says how; heights need the ``spacing`` of their samples. ``options`` are those
    of `goniophotometer.measure`: paths, orders, apart, sensor (or the name of one), tiles, seed, ...
    """
    refuse_unknown(options, MEASURING, "measuring")
    if isinstance(sensor := options.get("sensor"), str):
        options["sensor"] = goniophotometer.sensors.by_name(sensor)
    surface = {"bsdf": bsdf, "spacing": spacing, "periodic": periodic}
    incident = [(float(t), float(p)) for t, p in _angles(theta, phi).reshape(-1, 2)]
    with variants.switched(variants.of_arrays(options.get("wavelengths") is not None)):
        geometry, about = _microgeometry(what, surface)
        return goniophotometer.measure(geometry, incident, **{"about": about} | options)


def _microgeometry(what: Any, surface: dict[str, Any]) -> tuple[Any, dict[str, Any]]:
    """What to trace light through, and what to note about it; ``surface`` holds options of meshes and heights."""
    given: dict[str, Any] = {name: value for name, value in surface.items() if value is not None}
    if isinstance(what, (str, Path)) and Path(what).suffix.lower() in MESHES:
        return goniophotometer.from_file("mesh", what, **given), {}
    if isinstance(what, np.ndarray):
        if "spacing" not in given:
            raise ParameterError("spacing: heights need the distance between them.")
        return goniophotometer.HeightField(what, **given), {}
    refuse_unused(surface, (), "what is neither a mesh nor heights")
    if hasattr(what, "piece"):
        return what, {}
    found = resolve(what)
    found.load()
    return models.microgeometry(found.description or {"type": found.name}), {"model": found.description}


def validate(model: str, folder: str | Path, *, quick: bool = False, **options: Any) -> validation.Report:
    """Compare a model with light traced through its microgeometry; write ``report.md`` into ``folder``.

    It takes minutes, ``quick`` a tenth of them; ``options`` are those of `validation.validate`.
    """
    variants.ensure()
    return validation.validate(model, folder, quick=quick, **options)


def render(
    material: Any,
    *,
    size: int | tuple[int, int] = 512,
    spp: int = 64,
    seed: int = 0,
    **view: Any,
) -> Picture:
    """Render the preview scene: ``size`` is (width, height), or both; ``view`` what `scenes.preview.preview` takes.

    ``object`` and ``env``, say. A preset has its own, which are the default.
    """
    variants.ensure()
    refuse_unknown(view, VIEWING, "the preview scene")
    sides = tuple(size) if isinstance(size, (tuple, list)) else (size, size)
    if len(sides) != 2:
        raise ParameterError(f"size = {loading.short(size)}: expected a whole number, or a width and a height.")
    width, height = (whole(name, side, 1, 2**15) for name, side in zip(("width", "height"), sides))
    whole("spp", spp, 1, SAMPLES // (width * height))
    whole("seed", seed, 0, 2**32 - 1)
    found = resolve(material)
    bsdf = found.load()
    scene = loading.load(preview(found.description or bsdf, size=(width, height), **found.preview | view))
    return Picture(np.array(mi.render(scene, spp=spp, seed=seed), dtype=np.float32))


def plot(*materials: Any, view: str = "lobes", **options: Any) -> Figure:
    """A figure of one or several materials, for its ``savefig``; ``view`` and ``options`` are those of `drawing.plot`.

    The view ``spectrum``, and the option ``wavelengths``, are answered in a spectral variant; measurements, in one with
    their channels.
    """
    found = [resolve(material) for material in materials]
    with variants.switched(variants.of(found, view == "spectrum" or options.get("wavelengths") is not None)):
        return drawing.plot(found, view, **options)


def compare(a: Any, b: Any) -> Compared:
    """How far material ``b`` is from ``a``, the reference: numbers, values over all directions, and a figure.

    Measurements are compared in their own directions, and with the noise that they know of.
    """
    first, second = found = resolve(a), resolve(b)
    with variants.switched(variants.of(found)):
        return Compared(first, second, comparison.compare(first, second, drawing.distinct_names(found)))


def fit(data: Any, model: Any = "all", **options: Any) -> fitting.Fit | list[fitting.Fit]:
    """Fit a model to measured values: its parameters and their errors, a material, a figure; see `fitting.fit`.

    ``data`` is a measured material, a file (.binary, .bsdf, .csv, .npz), say, or a `measured.BRDF`, or any other one;
    ``model`` a name of `fitting.CANDIDATES` or a material, or ``all``: a list of all candidates, the best first.
    ``options`` are those of `fitting.fit`, and ``models`` of `fitting.rank`.
    """
    variants.ensure()
    refuse_unknown(options, FITTING + ["models"] * (model == "all"), "fitting")
    found = fitting.data(data)
    return fitting.rank(found, **options) if model == "all" else fitting.fit(found, model, **options)


def convert(
    material: Any,
    path: str | Path,
    *,
    wavelengths: Sequence[float] | None = None,
    resolution: int | None = None,
    progress: Callable[[str, int, int], None] = lambda name, done, total: None,
) -> Converted:
    """Write any material as .binary (MERL), .bsdf (RGL, Mitsuba), .csv or .npz, and say how far off what is read is.

    ``wavelengths``, in nm, tabulate a model in a spectral variant; ``resolution`` is that of `measured.convert`.
    Whatever is at ``path`` is overwritten.
    """
    found = resolve(material)
    with variants.switched(variants.of_bsdf(found, wavelengths is not None)):
        f = found.function(None if wavelengths is None else _wavelengths(wavelengths, 0))
        return measured.convert(f, path, found.pairs, resolution=resolution, progress=progress)


def presets() -> dict[str, Material]:
    """All presets by name, each a `Material`: its ``description`` is a dictionary for ``mi.load_dict``."""
    return {name: resolve(name) for name in _presets.names()}


def register(model: type[Model], name: str | None = None) -> type[Model]:
    """Make a model of one's own, derived from `lobes.LobeModel`, a plugin; returns it, so that it can decorate.

    It is called ``name``, or as its class in small letters. In every variant, at once and from now on. A model that was
    registered under the name is replaced, but none of asperity's or Mitsuba's.
    """
    if not (isinstance(model, type) and issubclass(model, Declared)):
        raise ParameterError(f"model = {model!r}: expected a class derived from asperity.lobes.LobeModel.")
    name = name or model.__name__.lower()
    known = models.MODELS | models.TEXTURES | models.PHASES
    taken = name in known and not getattr(known[name], "registered", False)
    if taken or mi.PluginManager.instance().plugin_type(name) != mi.ObjectType.Unknown:
        raise ParameterError(f"name = {name!r}: there is such a plugin already. Take another.")
    model.registered = True  # type: ignore[attr-defined]
    models.MODELS[name] = model
    if mi.variant() is not None:
        plugin.register()
    return model


class _Loaded(NamedTuple):
    """A BSDF of the active variant, with what is needed to ask it."""

    name: str
    bsdf: Any
    groups: list[tuple[float, ...] | None]
    """Wavelengths, as many at a time as the variant has channels; one group, None, if it has none."""
    width: int
    """Channels that are asked for."""
    incidence: tuple[float, float]
    """Range of θi, in degrees, where there are values of light from above."""

    def outgoing(self, name: str, given: ArrayLike) -> Directions:
        """Directions, the parameter ``name``, on the sides of the surface where this BSDF has values."""
        sides = mi.BSDFFlags.Transmission, mi.BSDFFlags.BackSide
        if any(mi.has_flag(self.bsdf.flags(), side) for side in sides):
            return Directions(name, given)
        return Directions(name, given, high=90, reason=f": {self.name} has no values below its surface")

    def incident(self, name: str, given: ArrayLike) -> Directions:
        """The same, where it was measured, if it was."""
        if self.incidence == ABOVE:
            return self.outgoing(name, given)
        return Directions(name, given, *self.incidence, f": there {self.name} was measured")

    def channels(self, function: Callable[[Any], Any], wi: Array) -> Array:
        """What ``function`` of the surface interaction gives, (n, channels), at all wavelengths."""
        points = (lab.interaction(lab.vectors(wi), len(wi), group) for group in self.groups)
        found = [lab.to_numpy(mi.unpolarized_spectrum(function(si)), len(wi)) for si in points]
        return np.concatenate(found)[: self.width].T


@contextmanager
def _loaded(material: Any, wavelengths: Sequence[float] | None = None, colourless: bool = False) -> Iterator[_Loaded]:
    """The material, loaded in a variant that computes arrays, and wavelengths if they are asked for.

    In a spectral variant these have to be, unless it has been measured at some, or what is asked for is ``colourless``.
    """
    found = resolve(material)
    with variants.switched(variants.of_bsdf(found, wavelengths is not None)):
        channels = dr.size_v(mi.UnpolarizedSpectrum)
        chosen = _wavelengths(found.wavelengths if wavelengths is None else wavelengths, channels if colourless else 0)
        groups: list[Any] = [_filled(chosen[k : k + channels], channels) for k in range(0, len(chosen), channels)]
        yield _Loaded(found.name, found.load(), groups or [None], len(chosen) or channels, found.incidence)


def _wavelengths(given: Sequence[float] | None, default: int) -> tuple[float, ...]:
    """Wavelengths in nm, none in a variant without; if none are given, ``default`` many, unless that is 0."""
    if not mi.is_spectral:
        return ()
    if given is None and default:
        return tuple(np.linspace(450, 650, default))
    if given is None:
        raise ParameterError(f"wavelengths: variant {mi.variant()} needs them, in nm; [450, 550, 650], say.")
    try:
        array = np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError):
        array = np.zeros(0)
    if array.ndim != 1 or not array.size or not np.all((array >= NM[0]) & (array <= NM[1])):
        raise ParameterError(f"wavelengths = {loading.short(given)}: expected a list of numbers in {list(NM)} nm.")
    return tuple(array.tolist())


def _filled(group: tuple[float, ...], count: int) -> tuple[float, ...]:
    """As many as ``count``, by repeating the last."""
    return group + group[-1:] * (count - len(group))


def _angles(theta: ArrayLike, phi: ArrayLike) -> Array:
    """θ and φ, in degrees, as directions (..., 2)."""
    try:
        return np.stack(np.broadcast_arrays(*(np.asarray(x, dtype=np.float64) for x in (theta, phi))), axis=-1)
    except (TypeError, ValueError):
        raise ParameterError("theta and phi: expected numbers, or arrays that go together.") from None
