"""Finds an LLVM that Dr.Jit can work with, before Dr.Jit looks for one itself.

Dr.Jit reads ``DRJIT_LIBLLVM_PATH`` when it is first imported, and never again. With LLVM 16 or older, Mitsuba 3.9
renders until the code generator meets ``llvm.minimum``, then LLVM aborts the process ("Cannot select: fminimum").
This module imports neither Dr.Jit nor Mitsuba at its top: it has to run before them.
"""

from __future__ import annotations

import ctypes
import importlib.util
import os
import re
import site
import struct
import sys
import sysconfig
from pathlib import Path

from .errors import AsperityError

OLDEST_WORKING = 17
"""LLVM 15 and 16 abort; 19 and 23 were measured to work. X86 learned to lower ``fminimum`` in 17."""
WHEEL = "karellen_llvm_core"
"""The dependency that carries a libLLVM, as its metadata are named."""
LIBRARY = re.compile(r"^(.*/libLLVM\.so\.[\d.]+),", re.MULTILINE)
"""In the wheel's list of files."""


class LLVMError(AsperityError, ImportError):
    """Dr.Jit has no LLVM, or one so old that rendering would abort the process."""


def bundled() -> Path | None:
    """Path of the libLLVM that came with ``pip install asperity``, or None where there is none that is whole."""
    return next((path for path in candidates() if flaw(path) is None), None)


def candidates() -> list[Path]:
    """Every libLLVM of this environment, the best first: those of the wheel, then others, the newest before older."""
    # By its list of files, which it has where Python imports from; importlib.metadata would take 25 ms to import.
    records = [record for folder in sys.path for record in Path(folder).glob(f"{WHEEL}-*.dist-info/RECORD")]
    wheels = [(r.parents[1] / name).resolve() for r in records[:1] for name in LIBRARY.findall(r.read_text("utf-8"))]
    folders = [sysconfig.get_path("data"), *([site.getuserbase()] if site.ENABLE_USER_SITE else [])]
    others = [
        path.resolve()
        for folder in folders
        for path in sorted(Path(folder, "lib").glob("libLLVM.so.*"), key=version, reverse=True)
        if version(path) >= (OLDEST_WORKING,)
    ]
    return list(dict.fromkeys(wheels + others))


def damages() -> list[str]:
    """What is passed over, and why."""
    return [f"{path}: {fault}" for path in candidates() if (fault := flaw(path))]


def version(library: Path) -> tuple[int, ...]:
    """Version of a libLLVM, by its name."""
    return tuple(map(int, re.findall(r"\d+", library.name)))


def flaw(library: Path) -> str | None:
    """Why a file cannot be loaded, or None. To load one that was cut short would kill the process (SIGBUS)."""
    try:
        with library.open("rb") as file:
            header, size = file.read(64), os.fstat(file.fileno()).st_size
    except OSError as error:
        return error.strerror
    if sys.platform != "linux":
        return None
    if len(header) < 64 or header[:5] != b"\x7fELF\x02":
        return "it is no 64-bit library"
    # The table of sections is what an ELF file ends with.
    (table,), (entry, entries) = struct.unpack_from("<Q", header, 40), struct.unpack_from("<HH", header, 58)
    return None if table + entry * entries <= size else f"it is cut short, at {size / 1e6:.1f} MB"


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
    """What is wrong with the LLVM that Dr.Jit loaded, or that it loaded none, and the cure; None if all is well."""
    import drjit as dr

    found, chosen = loaded_version(), os.environ.get("DRJIT_LIBLLVM_PATH")
    if not dr.has_backend(dr.JitBackend.LLVM):
        problem = f"Dr.Jit cannot load {chosen}: {reason(Path(chosen))}." if chosen else "Dr.Jit found no LLVM."
    elif found is None or found[0] >= OLDEST_WORKING:
        return None
    else:
        number = ".".join(map(str, found))
        problem = f"Dr.Jit loaded LLVM {number}, with which Mitsuba aborts the process as soon as it renders."
    return f"{problem} {cure()} `asperity doctor` checks the result."


def reason(library: Path) -> str:
    """Why a file cannot be loaded, in the system's words if need be."""
    if fault := flaw(library):
        return fault
    try:
        ctypes.CDLL(str(library))
    except OSError as error:
        return str(error)
    return "it is no LLVM, or one that Dr.Jit does not know"


def cure() -> str:
    """What to do about an LLVM that does not work."""
    chosen, path = os.environ.get("DRJIT_LIBLLVM_PATH"), bundled()
    if chosen is not None and chosen != str(path):
        return (
            f"DRJIT_LIBLLVM_PATH is {chosen!r}: unset it, or let it name LLVM {OLDEST_WORKING} or newer, "
            "and start Python again."
        )
    if chosen is None and path is not None:
        return (
            "asperity brought a newer one, but drjit or mitsuba was imported first. Import asperity before them, "
            f"or set DRJIT_LIBLLVM_PATH={path} before starting Python."
        )
    damaged = f"Reinstall karellen-llvm-core ({'; '.join(found)}). Or: " if (found := damages()) else ""
    return (
        f"{damaged}Install LLVM {OLDEST_WORKING} or newer, set DRJIT_LIBLLVM_PATH to its libLLVM, and start Python "
        "again. The scalar_* variants need no LLVM, but for tables, as of scattering: multiple."
    )


def guard(variant: str | None) -> None:
    """Raise LLVMError if ``variant`` would run on an LLVM that aborts."""
    if variant is not None and variant.startswith("llvm_") and (problem := complaint()):
        raise LLVMError(problem)
