"""Whole scenes from files: Mitsuba's XML, or its dictionaries as JSON."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

from asperity.errors import ParameterError, UnreadableFileError, readable
from asperity.materials import value

FORMATS = (".xml", ".json")
NAME = r"[A-Za-z_]\w*"
"""Of what ``$name`` stands for."""
TAKEN = ("path", "parallel", "optimize")
"""Names that ``mi.load_file`` has for itself."""


def load(
    path: Path, size: tuple[int, int] | None = None, sensor: int = 0, defines: dict[str, str] | None = None
) -> Any:
    """The scene in a file, each ``$name`` in it replaced as ``defines`` says, and the sensor's picture resized."""
    import mitsuba as mi

    from asperity import loading

    readable("scene", path, FORMATS)
    if path.suffix.lower() == ".xml":
        scene = loading.load_file(path, **(defines or {}))
    else:
        mi.file_resolver().prepend(str(path.parent.resolve()))
        scene = loading.load(description(path, defines or {}))
    if not isinstance(scene, mi.Scene) or not scene.sensors():
        raise UnreadableFileError("scene", path, FORMATS, "it is no scene with a sensor; --material takes materials")
    if scene.integrator() is None:
        raise UnreadableFileError("scene", path, FORMATS, 'it has no integrator, such as {"type": "path"}')
    if sensor >= len(scene.sensors()):
        raise ParameterError(f"--sensor {sensor}: {path} has {len(scene.sensors())}, counted from 0.")
    if size is not None:
        resize(scene.sensors()[sensor], size)
    return scene


def parse_defines(texts: list[str]) -> dict[str, str]:
    """Names and values from ``name=value``."""
    pairs = [text.partition("=") for text in texts]
    for (name, equals, _), text in zip(pairs, texts):
        if not (equals and re.fullmatch(NAME, name)):
            raise ParameterError(f"--define {text}: expected NAME=VALUE, for the $NAME in the scene.")
        if name in TAKEN:
            raise ParameterError(f"--define {name}: Mitsuba has this name for itself; rename ${name} in the scene.")
    return {name: text for name, _, text in pairs}


def description(path: Path, defines: dict[str, str]) -> dict[str, Any]:
    """The dictionary in a JSON file, ready for Mitsuba."""
    from asperity import loading

    used: set[str] = set()

    def finished(value: Any, name: str) -> Any:
        """With definitions and matrices in place."""
        if isinstance(value, dict):
            return {key: finished(child, f"{name}.{key}".lstrip(".")) for key, child in value.items()}
        if isinstance(value, str):
            return defined(name, value, defines, used)
        return matrix(name, value) if isinstance(value, list) else value

    try:
        content = json.loads(path.read_bytes())  # in UTF-8, or UTF-16 or 32 with a byte order mark
        if not isinstance(content, dict):
            raise ParameterError("it is no object in braces")
        content = finished(content, "")
        loading.check(content)
    except json.JSONDecodeError as error:
        reason = f"line {error.lineno}, column {error.colno}: {error.msg}"
    except (ParameterError, UnicodeDecodeError, RecursionError) as error:
        reason = str(error)
    else:
        if unused := defines.keys() - used:
            raise ParameterError(f"--define {min(unused)}: there is no ${min(unused)} in {path}.")
        return content
    raise UnreadableFileError("scene", path, FORMATS, reason)


def defined(name: str, text: str, defines: dict[str, str], used: set[str]) -> Any:
    """A word with each ``$name`` replaced; as in ``--set``, what is nothing but a ``$name`` may become a number."""
    wanted = re.findall(rf"\$({NAME})", text)
    for one in wanted:
        if one not in defines:
            raise ParameterError(f"{name}: ${one} is not defined; give it by -D {one}=VALUE")
    used.update(wanted)
    if len(wanted) == 1 and text == f"${wanted[0]}":
        return value(defines[wanted[0]])
    return re.sub(rf"\$({NAME})", lambda found: defines[found[1]], text)


def matrix(name: str, rows: list[Any]) -> Any:
    """A list of three or four rows as the transformation that Mitsuba expects; other lists as they are."""
    import mitsuba as mi

    kinds = {3: mi.ScalarTransform3f, 4: mi.ScalarTransform4f}
    if len(rows) not in kinds or not all(isinstance(row, list) and len(row) == len(rows) for row in rows):
        return rows
    try:
        return kinds[len(rows)](rows)
    except TypeError:
        raise ParameterError(f"{name} is {json.dumps(rows)[:60]}, not a matrix of numbers") from None


def resize(sensor: Any, size: tuple[int, int]) -> None:
    """Change the size of the picture, which undoes a crop."""
    import mitsuba as mi

    parameters = mi.traverse(sensor)
    parameters["film.size"] = parameters["film.crop_size"] = list(size)
    parameters["film.crop_offset"] = [0, 0]
    parameters.update()
