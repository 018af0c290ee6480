"""Our own ``.npz``: a `BRDF` as it is, or what the virtual goniophotometer measured."""

from __future__ import annotations

import json
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from ..errors import ParameterError
from ..files import atomically
from ..goniophotometer import Measurement
from .brdf import BRDF, from_measurement
from .files import MOST, reading

FORMATS = (".npz",)
ARRAYS = ("wi", "wo", "values", "errors", "weights")
ABOUT = ("channels", "isotropic", "source", "left_out")
MARK = "brdf"
"""The array of such a file that says, in JSON, all that is no number; a `Measurement` has none."""


def save(brdf: BRDF, path: str | Path) -> None:
    """Write a NumPy archive."""
    arrays: dict[str, Any] = {name: getattr(brdf, name) for name in ARRAYS if getattr(brdf, name) is not None}
    about = {name: getattr(brdf, name) for name in ABOUT} | {"left_out": dict(brdf.left_out)}
    with atomically(Path(path)) as part:
        np.savez_compressed(part, **arrays | {MARK: np.array(json.dumps(about))})


def load(path: str | Path) -> BRDF:
    """Read what `save` wrote, or `Measurement.save`; raises UnreadableFileError."""
    with reading(path, FORMATS) as path:
        if MARK not in _names(path):
            return from_measurement(Measurement.load(path))
        try:
            with np.load(path, allow_pickle=False) as file:
                about = json.loads(str(file[MARK]))
                arrays = {name: file[name] for name in ARRAYS if name in file.files}
            if wrong := [name for name, array in arrays.items() if array.dtype.kind != "f"]:
                raise ParameterError(f"{wrong[0]} is not of floating-point numbers")
            channels = tuple(str(name) for name in about["channels"])
            left_out = {str(why): int(n) for why, n in about["left_out"].items()}
            isotropic, source = bool(about["isotropic"]), str(about["source"])
            return BRDF(**arrays, channels=channels, isotropic=isotropic, source=source, left_out=left_out)
        except (ParameterError, MemoryError):
            raise
        except Exception as error:  # of zipfile, zlib, NumPy and json: damage shows in any way
            raise ParameterError(f"not written by asperity ({error})") from error


def is_brdf(path: Path) -> bool:
    """Whether a file holds a `BRDF`, and no `Measurement`; raises UnreadableFileError if it is no archive."""
    with reading(path, FORMATS) as path:
        return MARK in _names(path)


def _names(path: Path) -> list[str]:
    """Of the arrays in an archive, which together are not larger than allowed."""
    try:
        with zipfile.ZipFile(path) as archive:
            size = sum(member.file_size for member in archive.infolist())
            names = [member.filename.removesuffix(".npy") for member in archive.infolist()]
    except Exception as error:
        raise ParameterError(f"it is no NumPy archive ({error})") from error
    if size > MOST:
        raise ParameterError(f"it unpacks to {size} bytes, more than {MOST}")
    return names
