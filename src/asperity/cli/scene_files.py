"""Whole scenes from files: Mitsuba's XML, or its dictionaries as JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from asperity.errors import ParameterError, UnreadableFileError, readable

from .materials import check_json

FORMATS = (".xml", ".json")


def load(path: Path, size: tuple[int, int] | None) -> Any:
    """The scene in a file, its picture resized if ``size`` is given."""
    import mitsuba as mi

    from asperity.scenes import presets

    if path.name in presets.names():
        raise ParameterError(f"{path.name} is a preset, not a scene file: asperity render --preset {path.name}")
    readable("scene", path, FORMATS)
    # Mitsuba's advice for scenes with plugins in Python: it would construct them from several threads.
    if path.suffix.lower() == ".xml":
        scene = mi.load_file(str(path), parallel=False)
    else:
        mi.file_resolver().prepend(str(path.parent.resolve()))
        scene = mi.load_dict(description(path), parallel=False)
    if not isinstance(scene, mi.Scene) or not scene.sensors():
        raise UnreadableFileError("scene", path, FORMATS, "it is no scene with a sensor")
    if size is not None:
        resize(scene.sensors()[0], size)
    return scene


def description(path: Path) -> dict[str, Any]:
    """The dictionary in a JSON file, ready for Mitsuba."""
    try:
        content = json.loads(path.read_text(encoding="utf-8"), object_hook=with_matrices)
        if isinstance(content, dict):
            check_json(content)
            return content
        reason = "it is no object in braces"
    except json.JSONDecodeError as error:
        reason = f"line {error.lineno}, column {error.colno}: {error.msg}"
    except (ParameterError, UnicodeDecodeError) as error:
        reason = str(error)
    raise UnreadableFileError("scene", path, FORMATS, reason)


def with_matrices(node: dict[str, Any]) -> dict[str, Any]:
    """Lists of three or four rows as the transformations that Mitsuba expects."""
    import mitsuba as mi

    kinds = {3: mi.ScalarTransform3f, 4: mi.ScalarTransform4f}
    for key, rows in node.items():
        if isinstance(rows, list) and all(isinstance(row, list) and len(row) == len(rows) for row in rows):
            node[key] = kinds[len(rows)](rows) if len(rows) in kinds else rows
    return node


def resize(sensor: Any, size: tuple[int, int]) -> None:
    """Change the size of the picture, which undoes a crop."""
    import mitsuba as mi

    parameters = mi.traverse(sensor)
    parameters["film.size"] = parameters["film.crop_size"] = list(size)
    parameters["film.crop_offset"] = [0, 0]
    parameters.update()


def channel_names(scene: Any, channels: int) -> list[str]:
    """Names of the channels of a rendered image, colours first.

    The film does not tell: it counts the colours twice if an ``aov`` integrator holds another one, which names its
    colours too, and it counts some if there is none, where the image has only what the integrator names.
    """
    own = scene.integrator().aov_names()
    if channels == len(own):
        return own
    every = [channel.name for channel in scene.sensors()[0].film().bitmap().struct_()]
    colours = len(every) - len(own)
    return every[:colours] + own[len(own) - (channels - colours) :]
