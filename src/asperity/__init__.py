"""asperity: BSDF models from explicit microgeometry, as Mitsuba 3 plugins, and a laboratory for any BSDF.

``import asperity`` makes every model available to ``mi.load_dict`` and to XML scenes, in every variant, whether
``import mitsuba`` and ``mi.set_variant`` come before or after, and after every later switch. It sets no variant, and
imports neither Mitsuba nor NumPy: the functions below do, when they are first used.

>>> import asperity as asp
>>> asp.evaluate("gilded", (30, 0), (45, 180))  # f |cos θo| from θi = 30°, φi = 0° to θo = 45°, φo = 180°
"""

import sys
from typing import TYPE_CHECKING, Any

from . import llvm, on_import
from .errors import AsperityError, ParameterError, UnknownNameError, UnreadableFileError
from .version import __version__

if TYPE_CHECKING:
    from .api import (
        albedo,
        check,
        compare,
        evaluate,
        fit,
        material,
        measure,
        pdf,
        plot,
        presets,
        register,
        render,
        sample,
        validate,
    )

LAZY = (
    "evaluate",
    "pdf",
    "albedo",
    "sample",
    "check",
    "measure",
    "validate",
    "render",
    "plot",
    "compare",
    "fit",
    "presets",
    "material",
    "register",
)
"""Functions of `api`, imported when they are first asked for."""

__all__ = [
    "AsperityError",
    "ParameterError",
    "UnknownNameError",
    "UnreadableFileError",
    "__version__",
    "albedo",
    "check",
    "compare",
    "evaluate",
    "fit",
    "llvm",
    "material",
    "measure",
    "pdf",
    "plot",
    "presets",
    "register",
    "render",
    "sample",
    "validate",
]


def __getattr__(name: str) -> Any:
    if name not in LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from . import api

    return getattr(api, name)


def __dir__() -> list[str]:
    return sorted({*globals(), *LAZY})


llvm.choose()

if "mitsuba" in sys.modules:
    on_import.follow()
else:
    on_import.follow_once_imported()
