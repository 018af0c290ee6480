"""What a person may call data: a file, a measurement, a container."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from .. import measured, variants
from ..errors import ParameterError
from ..goniophotometer import Measurement
from ..measured import BRDF

MODES = ("rgb", "spectral")
"""Of files of RGL, which Mitsuba reads in a variant with their channels only."""


def data(what: Any, **options: Any) -> BRDF:
    """A `BRDF` of a file that `measured.load` reads, of what the goniophotometer measured, or itself.

    ``options`` are those of `measured.load`. Raises UnreadableFileError, ParameterError.
    """
    if isinstance(what, BRDF):
        return what
    if isinstance(what, Measurement):
        return measured.from_measurement(what)
    if not isinstance(what, (str, os.PathLike)):
        raise ParameterError(f"data: expected a file or a measurement, not a {type(what).__name__}.")
    path = Path(what)
    if path.suffix.lower() not in measured.rgl.FORMATS:
        return measured.load(path, **options)
    for mode in MODES:
        with variants.switched(variants.with_channels(variants.of_arrays(), mode)):
            try:
                return measured.load(path, **options)
            except ParameterError as error:
                failed = error
                if not str(error).startswith("variant "):
                    raise
    raise failed
