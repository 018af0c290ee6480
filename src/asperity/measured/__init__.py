"""Measured BRDFs from files, one file a format; all become a `BRDF`.

>>> chrome = load("chrome.binary")
>>> chrome.values[:, 0]
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ..errors import UnreadableFileError
from . import archive, goniometer, merl, rgl
from .brdf import BRDF as BRDF
from .brdf import from_measurement as from_measurement
from .conversion import convert as convert

LOADERS = {format: module.load for module in (merl, rgl, goniometer, archive) for format in module.FORMATS}  # type: ignore[attr-defined]
"""What reads a file, by its ending."""


def load(path: str | Path, **options: Any) -> BRDF:
    """The BRDF in a file, by its ending; ``options`` are those of `goniometer.load`. Raises UnreadableFileError."""
    ending = Path(path).suffix.lower()
    if ending not in LOADERS:
        raise UnreadableFileError("measurement", Path(path), list(LOADERS), f"its ending is {ending!r}")
    return LOADERS[ending](path, **options)
