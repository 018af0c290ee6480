"""``asperity doctor``."""

from __future__ import annotations

import os
import platform
import signal
import subprocess
import sys
from pathlib import Path

import typer
from rich.table import Table

from asperity import __version__, llvm

from . import console

TRIALS = ("scalar_rgb", "llvm_ad_rgb", "cuda_ad_rgb")
PATIENCE = 15  # seconds for one of them
ADVICE = {
    "scalar_rgb": "Mitsuba itself does not work: reinstall it, `pip install --force-reinstall mitsuba`.",
    "cuda_ad_rgb": "Nothing to do, unless there is an NVIDIA GPU: then update its driver.",
}


def doctor() -> None:
    """Find out which variants work here, and what to do about those that do not."""
    facts = Table("what", "found")
    for row in (versions() | cores() | libraries()).items():
        facts.add_row(*row)
    trials, advice, works = Table("variant", "works", "details"), [], {}
    for variant in TRIALS:
        with console.status(f"trying {variant}"):
            works[variant], details = attempt(variant)
        trials.add_row(variant, "yes" if works[variant] else "no", details)
        if not works[variant]:
            advice.append(f"{variant}: {ADVICE.get(variant) or llvm.cure()}")
    out = console.stdout()
    out.print(facts, trials, *advice, sep="\n")
    raise typer.Exit(0 if works["llvm_ad_rgb"] or works["cuda_ad_rgb"] else 1)


def versions() -> dict[str, str]:
    """Versions of what matters, without importing it."""
    from importlib import metadata  # here, for the sake of `asperity --help`

    found = {"asperity": __version__}
    for package in ("mitsuba", "drjit", "numpy"):
        try:
            found[package] = metadata.version(package)
        except metadata.PackageNotFoundError:
            found[package] = "not installed by pip"
    return {**found, "python": f"{platform.python_version()} ({sys.executable})", "platform": platform.platform()}


def libraries() -> dict[str, str]:
    """The LLVM that asperity brought, what was passed over, and the one that Dr.Jit is told to use."""
    path = os.environ.get("DRJIT_LIBLLVM_PATH")
    # `import asperity` has set the variable by now, unless the user had.
    by = "asperity's choice" if path == str(llvm.bundled()) else "your choice"
    fault = llvm.flaw(Path(path)) if path else None
    told = f"{path} ({by}{f'; {fault}' if fault else ''})" if path else "not set: Dr.Jit searches the system"
    passed_over = {"unusable": "\n".join(damages)} if (damages := llvm.damages()) else {}
    return {"LLVM with asperity": str(llvm.bundled() or "none"), **passed_over, "DRJIT_LIBLLVM_PATH": told}


def cores() -> dict[str, str]:
    """How many cores this process may use, if that is one only."""
    count = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    found = "1; asperity gives Mitsuba a second thread, without which it waits for ever at EXR files"
    return {"cores": found} if count == 1 else {}


def attempt(variant: str) -> tuple[bool, str]:
    """Whether a variant works, tried in a child process, which may die of it; and some details."""
    code = f"from asperity.cli.doctor import trial; trial({variant!r})"
    try:
        child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return False, f"no answer within {PATIENCE} s"
    if child.returncode < 0:
        last_words = child.stderr.strip().rpartition("\n")[2]
        return False, f"aborts ({signal.Signals(-child.returncode).name}): {last_words}"
    from asperity.loading import one_line  # here, for the sake of `asperity --help`

    return child.returncode == 0, one_line(child.stderr if child.returncode else child.stdout)


def trial(variant: str) -> None:
    """Render a micrograin in four by four pixels, write an EXR file to memory, and print which LLVM did it."""
    import mitsuba as mi

    mi.set_variant(variant)
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 3},
            "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 4, "height": 4}},
            "light": {"type": "constant"},
            "grains": {"type": "sphere", "center": [0, 0, 3], "bsdf": {"type": "micrograin", "tau_0": 0.5}},
        },
        parallel=False,
    )
    image = mi.render(scene, spp=1)
    mi.Bitmap(image).write(mi.MemoryStream(), mi.Bitmap.FileFormat.OpenEXR)
    brightness = sum(image.array) / 48
    if not 0 < brightness < 2:
        raise RuntimeError(f"renders, but wrongly: the mean of the picture is {brightness:g}")
    version = llvm.loaded_version() if variant.startswith("llvm_") else None
    print(f"LLVM {'.'.join(map(str, version))} from {loaded_library()}" if version else "")


def loaded_library() -> str:
    """Path of the libLLVM in this process, where the system tells."""
    maps = Path("/proc/self/maps")
    lines = maps.read_text().splitlines() if maps.exists() else []
    return next((line.split()[-1] for line in lines if "libLLVM" in line), os.environ.get("DRJIT_LIBLLVM_PATH", "?"))
