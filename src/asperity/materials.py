"""What a person may call "a material", and the one place that finds out which of these it is.

A material is one of:

- the name of a preset, ``gilded``, or of a model or a Mitsuba plugin, ``roughplastic``, with its default parameters;
- a file: a description in JSON, or Mitsuba's XML; a measurement, ``.npz`` of ours, ``.bsdf`` of RGL's, ``.binary`` of
  MERL's, or a goniometer's ``.csv``;
- a text, the JSON or XML itself;
- in Python, also a dictionary, a `Measurement`, a `measured.BRDF`, or a loaded ``mi.BSDF``.

Commands import this before they run, so that it imports nothing heavy itself.
"""

from __future__ import annotations

import json
import os
import re
import tempfile
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from .errors import ParameterError, UnknownNameError, UnreadableFileError, readable, suggestion
from .scenes import presets

if TYPE_CHECKING:
    from .goniophotometer import Measurement
    from .measured import BRDF
    from .measured.functions import Function

Description = dict[str, Any]

TENSORS = {".bsdf": "measured", ".pbsdf": "measured_polarized"}
"""Mitsuba's plugins for measurements, by the endings of their files."""
PAIRS = (".npz", ".binary", ".csv")
"""Endings of files that hold measured values in pairs of directions."""
FORMATS = (".json", ".xml", *PAIRS, *TENSORS)
WAVELENGTHS = [float(nm) for nm in range(400, 701, 20)]
"""In nm, at which a BSDF is tabulated in spectral variants, if none are asked for."""
ABOVE = (0.0, 90.0)
"""θ, in degrees, of all directions above a surface."""
TRIED = (
    f"Tried: presets, models, Mitsuba's BSDFs, and files ({', '.join(FORMATS)}). `asperity list` shows presets and "
    "models."
)


@dataclass(frozen=True)
class Material:
    """A material under its name: a description, or else a BSDF that is loaded already, or a measurement.

    What the virtual goniophotometer ``measured`` has cells, and noise; a ``brdf`` is values in pairs of directions.
    ``preview`` holds arguments of `scenes.preview.preview`, which say how to look at it.
    """

    name: str
    description: Description | None = None
    bsdf: Any = None
    preview: dict[str, Any] = field(default_factory=dict)
    measured: Measurement | None = None
    brdf: BRDF | None = None

    @property
    def mode(self) -> str:
        """The kind of Mitsuba's variants that have its channels: ``rgb``, ``mono`` or ``spectral``; empty if all do."""
        if self.measured is not None:
            return self.measured.mode
        if self.brdf is not None:  # Mitsuba renders tables of one channel in RGB only
            return "spectral" if self.brdf.wavelengths else "rgb"
        fields = self._tensors("measured")
        return "" if not fields else "rgb" if "rgb" in fields else "spectral"

    @property
    def wavelengths(self) -> list[float] | None:
        """In nm, of the channels of a measurement; None in RGB, and of what has none of its own."""
        if self.measured is not None or self.brdf is not None:
            return (self.measured or self.brdf).wavelengths  # type: ignore[union-attr]
        found = self._tensors("measured").get("wavelengths")
        return None if found is None else [float(nm) for nm in found]

    @property
    def pairs(self) -> BRDF | None:
        """What was measured, in pairs of directions; None of what is no measurement."""
        from .measured import from_measurement

        return self.brdf if self.measured is None else from_measurement(self.measured)

    def function(self, wavelengths: Sequence[float] | None = None) -> Function:
        """f of two directions, for `measured.convert`: what pairs are interpolated to; or what the BSDF reflects.

        A BSDF is that of the active variant; ``wavelengths`` are for spectral ones, by default its own, or a few.
        """
        import mitsuba as mi

        from .measured import functions

        if self.brdf is not None and wavelengths:
            raise ParameterError(f"wavelengths: {self.name} has its own channels, {', '.join(self.brdf.channels)}.")
        if self.brdf is not None:
            return functions.of_brdf(self.brdf)
        bsdf = self.load()
        if mi.is_spectral:
            wavelengths = wavelengths or self.wavelengths or WAVELENGTHS
        return functions.of_bsdf(bsdf, wavelengths, self.name)

    @property
    def incidence(self) -> tuple[float, float]:
        """The range of θi, in degrees, that was measured; beyond it Mitsuba would repeat the last values."""
        import numpy as np

        if self.measured is not None:
            theta = self.measured.incident[:, 0]
        elif self.brdf is not None:  # by reciprocity
            theta = np.array([0, max(self.brdf.incident[:, 0].max(), self.brdf.outgoing[:, 0].max())])
        elif fields := self._tensors(*TENSORS.values()):
            theta = np.degrees(fields["theta_i"])
        else:
            return ABOVE
        return float(theta.min()), float(theta.max())

    def _tensors(self, *plugins: str) -> dict[str, Any]:
        """What is in the file of one of Mitsuba's plugins for measurements; nothing of another material."""
        from . import loading

        given = self.description or {}
        file = given.get("filename")
        readable = given.get("type") in plugins and isinstance(file, str) and os.path.isfile(file)
        return loading.tensors(Path(str(file))) if readable else {}

    def load(self) -> Any:
        """The ``mi.BSDF`` of the active variant; raises ParameterError if there is none.

        A measurement is interpolated by Mitsuba's plugin ``measured``, as `goniophotometer.tensor_file` says; pairs of
        directions, first to what its table needs, as `measured.functions` says.
        """
        import mitsuba as mi

        from . import loading
        from .lab.evaluate import active_variant

        active_variant()
        if self.measured is not None or self.brdf is not None:
            return _interpolated(self.measured, self.brdf)
        found = self.bsdf if self.description is None else loading.load(self.description)
        if isinstance(found, mi.BSDF):
            return found
        if self.bsdf is not None:
            raise ParameterError(
                f"{self.name} is a BSDF of variant {found.variant_name()}, and {mi.variant()} is set: load it again, "
                "or give its description."
            )
        kind = getattr(found, "class_name", lambda: type(found).__name__)()
        raise ParameterError(f"{self.name!r} is not a material: Mitsuba makes a {kind} of it.")


def resolve(what: Any, settings: Iterable[str] | Mapping[str, Any] = ()) -> Material:
    """The material that ``what`` names, describes or is, with its parameters changed by ``settings``.

    Settings are texts, ``NAME=VALUE``, or a mapping; a dotted name is that of a nested parameter: ``base.alpha=0.1``.
    No variant needs to be set. Raises UnknownNameError, UnreadableFileError or ParameterError.
    """
    found = _found(what)
    settings = [settings] if isinstance(settings, str) else settings
    if not settings:
        return found
    if found.description is None:
        kind = "BSDF that is loaded already" if found.bsdf is not None else "measurement"
        raise ParameterError(f"{found.name}: settings change a description, and this is a {kind}.")
    return replace(found, description=changed(found.description, settings))


def _found(what: Any) -> Material:
    """The material as it is."""
    if isinstance(what, Material):
        return what
    if isinstance(what, dict):
        return Material(str(what.get("type", "material")), what)
    if isinstance(what, str) and what.lstrip()[:1] in ("{", "[", "<"):
        return _from_text(what.strip())
    if isinstance(what, (str, os.PathLike)):
        return _from_file(Path(what)) if _is_file(what) else _from_name(str(what))
    if _is_bsdf(what):
        return Material(str(what.class_name()), bsdf=what)
    from .goniophotometer import Measurement
    from .measured import BRDF

    if isinstance(what, BRDF):
        return Material(what.source or "measurement", brdf=what)
    if isinstance(what, Measurement):
        return Material(str(what.about["geometry"].get("type", "measurement")), measured=what)
    raise ParameterError(f"material: expected a name, a file, a description or a BSDF, not a {_kind(what)}.")


def _kind(what: Any) -> str:
    return type(what).__name__


def _is_bsdf(what: Any) -> bool:
    """Whether it is a BSDF of any variant: each has a class of its own, and all the same name."""
    return any((kind.__module__, kind.__name__) == ("mitsuba", "BSDF") for kind in type(what).__mro__)


def _is_file(what: str | os.PathLike[str]) -> bool:
    """Whether somebody means a file: it looks like one, or is there and is no name of a preset or plugin."""
    if not isinstance(what, str) or Path(what).suffix.lower() in FORMATS or os.sep in what:
        return True
    return os.path.exists(what) and what not in presets.names() and not _is_plugin(what)


def _from_name(name: str) -> Material:
    """A preset, or a plugin with its default parameters."""
    if name in presets.names():
        found = presets.load(name)
        return Material(name, found.material, preview=found.preview)
    if _is_plugin(name):
        return Material(name, {"type": name})
    raise UnknownNameError("material", name, _names(), TRIED)


def _from_file(path: Path) -> Material:
    from . import loading, xml

    if os.path.isdir(path):
        raise UnreadableFileError("material", path, FORMATS, "it is a folder")
    ending = path.suffix.lower()
    if ending in PAIRS:
        from . import measured
        from .goniophotometer import Measurement

        if ending == ".npz" and not measured.archive.is_brdf(path):
            return Material(path.stem, measured=Measurement.load(path))
        return Material(path.stem, brdf=measured.load(path))
    readable("material", path, FORMATS)
    if ending in TENSORS:
        description = {"type": TENSORS[ending], "filename": str(path.resolve())}
        loading.check(description)
        return Material(path.stem, description)
    if ending == ".json":
        found = presets.read(path)
        return Material(path.stem, found.material, preview=found.preview)
    try:
        return Material(path.stem, xml.bsdf(path))
    except ValueError as error:
        raise UnreadableFileError("material", path, FORMATS, str(error)) from error


def _from_text(text: str) -> Material:
    """JSON or XML; files that it names are looked for in the current folder."""
    from . import loading, xml

    try:
        if text.startswith("<"):
            description, preview = xml.bsdf(text), {}
        else:
            found = presets.parse(text, Path("material"))
            description, preview = found.material, found.preview
    except ValueError as error:
        raise ParameterError(f"material {loading.short(text)}: {error}.") from error
    return Material(str(description["type"]), description, preview=preview)


def _is_plugin(name: str) -> bool:
    """Whether Mitsuba, or a registration in Python, has such a plugin; whether it is a BSDF is seen when it is loaded.

    Mitsuba does not tell what others registered, but by its error.
    """
    import mitsuba as mi

    from . import loading
    from .models import MODELS

    if name in MODELS or mi.PluginManager.instance().plugin_type(name) != mi.ObjectType.Unknown:
        return True
    if mi.variant() is None or not re.fullmatch(r"\w[\w-]*", name):
        return False
    try:
        loading.load({"type": name})
    except ParameterError as error:
        return not str(error).startswith(f"there is no plugin {name!r}")
    return True


def _names() -> list[str]:
    """All that have a name: presets, models, and Mitsuba's BSDFs, of which each is to be asked what it is."""
    import mitsuba as mi

    from .models import MODELS

    kind = mi.PluginManager.instance().plugin_type
    plugins = (path.stem.removeprefix("lib") for path in (Path(mi.__file__).parent / "plugins").iterdir())
    return [*presets.names(), *MODELS, *(name for name in plugins if kind(name) == mi.ObjectType.BSDF)]


def _interpolated(measured: Measurement | None, brdf: BRDF | None) -> Any:
    """A measurement as a BSDF of the active variant."""
    from . import loading
    from .goniophotometer import tensor_file
    from .measured import conversion, functions

    with tempfile.TemporaryDirectory(prefix="asperity-") as folder:
        path = Path(folder) / "measured.bsdf"
        if measured is not None:
            tensor_file.write(measured, path)
        elif brdf is not None:
            conversion.table(functions.of_brdf(brdf), path)
        return loading.load({"type": "measured", "filename": str(path)})


def changed(description: Description, settings: Iterable[str] | Mapping[str, Any]) -> Description:
    """A description with other parameters. Whether they exist is for the plugin to say; raises ParameterError."""
    from . import loading

    if not isinstance(settings, Iterable):
        raise ParameterError(f"settings = {loading.short(settings)}: expected a mapping, or texts NAME=VALUE.")
    changes = settings.items() if isinstance(settings, Mapping) else map(_setting, settings)
    result = _copied(description)
    for path, new in changes:
        *parents, name = path.split(".")
        node = result
        for parent in parents:
            parts = [key for key, part in node.items() if isinstance(part, dict)]
            if parent not in parts:
                raise ParameterError(
                    f"{path} = {loading.short(new)}: nothing is nested as {parent!r}. {suggestion(parent, parts)}"
                )
            node = node[parent]
        node[name] = new
    return result


def _copied(node: Description) -> Description:
    """With dictionaries of its own, down to the last; a deep copy would fail at Mitsuba's objects."""
    return {key: _copied(part) if isinstance(part, dict) else part for key, part in node.items()}


def _setting(text: str) -> tuple[str, Any]:
    """Name and value from ``NAME=VALUE``."""
    path, equals, word = text.partition("=")
    if not (equals and path.rpartition(".")[2]):
        raise ParameterError(f"--set {text}: expected NAME=VALUE, such as tau_0=0.4.")
    return path, value(word)


def value(text: str) -> Any:
    """JSON, or else a word; three numbers are a colour, and numbers may begin or end with their point."""
    try:
        parsed = json.loads(text)
    except json.JSONDecodeError:
        return float(text) if re.fullmatch(r"[+-]?(\d+\.|\.?\d)\d*(e[+-]?\d+)?", text, re.IGNORECASE) else text
    colour = isinstance(parsed, list) and len(parsed) == 3 and all(isinstance(x, int | float) for x in parsed)
    return {"type": "rgb", "value": parsed} if colour else parsed
