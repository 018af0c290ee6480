"""Presets, ``presets/*.json``, and the user's material files: JSON descriptions of BSDFs, read without Mitsuba."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from asperity.errors import UnknownNameError, UnreadableFileError, readable, suggestion

FOLDER = Path(__file__).with_name("presets")
FORMATS = (".json",)
DEFAULT = "dusty-wood"
VIEW = ("object", "env", "light", "floor")
"""What ``preview`` may hold."""
IGNORED = ("fit",)
"""What a file may hold beside: how good `asperity fit` found it to be."""


class Preset(NamedTuple):
    """A material, where it comes from, and how to look at it: ``preview`` holds arguments of `preview.preview`."""

    name: str
    title: str
    source: str
    about: str
    preview: dict[str, Any]
    material: dict[str, Any]


def names() -> list[str]:
    """The presets, in alphabetical order."""
    return sorted(path.stem for path in FOLDER.glob("*.json"))


def load(name: str) -> Preset:
    """A preset by its name."""
    if name not in names():
        raise UnknownNameError("preset", name, names())
    return read(FOLDER / f"{name}.json")


def read(path: str | Path) -> Preset:
    """A material file: the description of a BSDF, or a preset with the BSDF as its ``material``.

    A relative ``filename``, or a file in ``preview``, starts at the folder of the file; ``to_uv``, which scales a
    texture, is a 3x3 matrix.
    """
    path = readable("material", path, FORMATS)
    try:
        return parse(path.read_bytes(), path)
    except (OSError, ValueError) as error:
        raise UnreadableFileError("material", path, FORMATS, str(error)) from error


def parse(text: str | bytes, path: Path) -> Preset:
    """What `read` reads, from JSON (in any UTF) of a file that lies, or might lie, at ``path``; raises ValueError."""
    try:
        return _preset(path, json.loads(text, object_pairs_hook=_distinct))
    except json.JSONDecodeError as error:
        raise ValueError(f"line {error.lineno}, column {error.colno}: {error.msg}") from error
    except RecursionError:
        raise ValueError("it is nested too deep") from None


def _preset(path: Path, content: Any) -> Preset:
    """The preset in a parsed file; ValueError says what is wrong with it."""
    content = _object("it", content)
    if "type" in content:
        content = {"material": content}
    _known(content, (*Preset._fields[1:], *IGNORED))
    material = _object("material", content.get("material"))
    if not isinstance(material.get("type"), str):
        raise ValueError('it has no BSDF: expected {"type": ...}, or {"material": {"type": ...}}')
    _complete(material, "material", path.parent)
    view = _object("preview", content.get("preview", {}))
    _known(view, VIEW)
    for key, value in view.items():
        if not isinstance(value, str):
            raise ValueError(f"preview.{key} is {_short(value)}, not a name or the path of a file")
        view[key] = str(path.parent / value) if Path(value).suffix else value
    title, source, about = (str(content.get(key, "")) for key in ("title", "source", "about"))
    return Preset(path.stem, title or path.stem, source, about, view, material)


def _object(name: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        raise ValueError(f"{name} is {_short(value)}, not an object in braces")
    return value


def _short(value: Any) -> str:
    return json.dumps(value)[:40]


def _known(given: dict[str, Any], allowed: tuple[str, ...]) -> None:
    for key in given.keys() - allowed:
        raise ValueError(f"unknown key {key!r}. {suggestion(key, allowed)}")


def _distinct(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """An object whose keys differ; JSON would silently let the last one win."""
    found: dict[str, Any] = {}
    for key, value in pairs:
        if key in found:
            raise ValueError(f"{key!r} is given twice")
        found[key] = value
    return found


def _complete(node: dict[str, Any], where: str, folder: Path) -> None:
    """Resolve file names and matrices, in place, and refuse nulls, on which Mitsuba dies, and what is not finite."""
    for key, value in node.items():
        name = f"{where}.{key}"
        if isinstance(value, dict):
            _complete(value, name, folder)
            continue
        for x in _leaves(value):
            if x is None:
                raise ValueError(f"{name} is {_short(value)}: leave null out, for the default")
            if isinstance(x, float) and not math.isfinite(x):
                raise ValueError(f"{name} is {_short(value)}: numbers have to be finite")
        if key == "filename":
            node[key] = str((folder / str(value)).resolve())  # so that `asperity show --json` may be read elsewhere
            if not Path(node[key]).is_file():
                raise ValueError(f"{name}: there is no file {node[key]!r}")
        elif key == "to_uv":
            node[key] = _matrix(name, value)


def _leaves(value: Any) -> Iterator[Any]:
    """The values in lists nested in each other."""
    if isinstance(value, list):
        for x in value:
            yield from _leaves(x)
    else:
        yield value


def _matrix(name: str, value: Any) -> Any:
    """A transformation of texture coordinates; Mitsuba's own class would need a variant."""
    from drjit.scalar import Matrix3f64

    try:
        (a, b, c), (d, e, f), (g, h, i) = value
        if any(type(x) not in (int, float) for x in (a, b, c, d, e, f, g, h, i)):
            raise TypeError
        return Matrix3f64(a, b, c, d, e, f, g, h, i)
    except (TypeError, ValueError):
        raise ValueError(f"{name} is {_short(value)}, not a matrix of three rows of three numbers") from None
