"""Finds an LLVM that Dr.Jit can work with, before Dr.Jit looks for one itself.

Dr.Jit reads ``DRJIT_LIBLLVM_PATH`` when it is first imported, and never again. With LLVM 16 or older, Mitsuba 3.9
renders until the code generator meets ``llvm.minimum``, then LLVM aborts the process ("Cannot select: fminimum").
This module imports neither Dr.Jit nor Mitsuba at its top: it has to run before them.
"""

from __future__ import annotations

import ctypes
import importlib.util
import os
import site
import sys
import sysconfig
from pathlib import Path

OLDEST_WORKING = 17
"""LLVM 15 and 16 abort; 19 and 23 were measured to work. X86 learned to lower ``fminimum`` in 17."""


class LLVMError(ImportError):
    """The LLVM that Dr.Jit loaded is too old: rendering would abort the process."""


def bundled() -> Path | None:
    """Path of the libLLVM that came with ``pip install asperity``, or None where there is no such wheel."""
    # The wheel puts it into <prefix>/lib; asking importlib.metadata would read a list of 6000 headers first.
    folders = {Path(sysconfig.get_path("data")), Path(site.USER_BASE or sys.prefix)}
    found = (path for folder in folders for path in sorted((folder / "lib").glob("libLLVM.so.*")))
    return next(found, None)


def choose() -> None:
    """Point Dr.Jit at the bundled LLVM, unless the user chose one or Dr.Jit is already loaded."""
    if "drjit" not in sys.modules and "DRJIT_LIBLLVM_PATH" not in os.environ and (path := bundled()):
        os.environ["DRJIT_LIBLLVM_PATH"] = str(path)


def loaded_version() -> tuple[int, int, int] | None:
    """Version of the LLVM that Dr.Jit loaded: None if it loaded none, or if this platform does not let us ask."""
    spec = importlib.util.find_spec("drjit")
    if spec is None or spec.origin is None:
        return None
    core = Path(spec.origin).with_name("libdrjit-core.dylib" if sys.platform == "darwin" else "libdrjit-core.so")
    try:
        # Dr.Jit has no Python binding for this; the symbol is jit_llvm_version(int*, int*, int*).
        query = ctypes.CDLL(str(core))._Z16jit_llvm_versionPiS_S_
    except (OSError, AttributeError):
        return None
    numbers = [ctypes.c_int(-1) for _ in range(3)]
    query(*map(ctypes.byref, numbers))
    major, minor, patch = (n.value for n in numbers)
    return (major, minor, patch) if major > 0 else None


def complaint() -> str | None:
    """What is wrong with the loaded LLVM and the cure, or None if it is fine (or absent: Dr.Jit then says so)."""
    version = loaded_version()
    if version is None or version[0] >= OLDEST_WORKING:
        return None
    number = ".".join(map(str, version))
    problem = f"Dr.Jit loaded LLVM {number}, with which Mitsuba aborts the process as soon as it renders."
    if "DRJIT_LIBLLVM_PATH" in os.environ and os.environ["DRJIT_LIBLLVM_PATH"] != str(bundled()):
        chosen = os.environ["DRJIT_LIBLLVM_PATH"]
        cure = (
            f"DRJIT_LIBLLVM_PATH is {chosen!r}: unset it, or let it name LLVM {OLDEST_WORKING} or newer, "
            "and start Python again."
        )
    elif path := bundled():
        cure = (
            "asperity brought a newer one, but drjit or mitsuba was imported first. Import asperity before them, "
            f"or set DRJIT_LIBLLVM_PATH={path} before starting Python."
        )
    else:
        cure = (
            f"Install LLVM {OLDEST_WORKING} or newer, set DRJIT_LIBLLVM_PATH to its libLLVM, and start Python again. "
            "The scalar_* variants need no LLVM."
        )
    return f"{problem} {cure} `asperity doctor` checks the result."


def guard(variant: str | None) -> None:
    """Raise LLVMError if ``variant`` would run on an LLVM that aborts."""
    if variant is not None and variant.startswith("llvm_") and (problem := complaint()):
        raise LLVMError(problem)
