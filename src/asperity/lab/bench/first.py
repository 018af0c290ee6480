"""How long a user waits for a first picture, and the memory it takes: in a process of its own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi

from ...errors import ParameterError
from ...scenes.preview import preview

MATRIX = "asperity: matrix"
"""The key of a transformation's rows, which JSON has no place for."""
SIZE, SPP = 64, 4
"""Of the picture: nearly all of the time is tracing and compiling."""


class First(NamedTuple):
    """Seconds until there is a picture, once Python has its modules; those of all threads; and the most memory, MiB."""

    wall: float
    cpu: float
    memory: float


def first_picture(material: dict[str, Any], variant: str) -> First:
    """In a new process, whose home is empty, so that Dr.Jit has no kernel yet."""
    with tempfile.TemporaryDirectory() as home:
        paths = [str(Path(__file__).parents[3]), *os.environ.get("PYTHONPATH", "").split(os.pathsep)]
        done = subprocess.run(
            [sys.executable, "-c", f"from {__package__} import first; first.main({variant!r})"],
            env=os.environ | {"HOME": home, "LOCALAPPDATA": home, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
            input=told(material),
            capture_output=True,
            text=True,
            check=False,
            start_new_session=True,  # Ctrl-C is for whoever started it, and waits for the picture
        )
    if done.returncode:
        raise RuntimeError(f"no picture of {material.get('type')!r}: {done.stderr.strip()[-400:]}")
    return First(**json.loads(done.stdout.splitlines()[-1]))


def told(material: dict[str, Any]) -> str:
    """A description as JSON, transformations included; raises ParameterError if it holds other objects of Mitsuba's."""

    def rows(value: Any) -> dict[str, Any]:
        try:
            return {MATRIX: [list(map(float, row)) for row in getattr(value, "matrix", value)]}
        except TypeError:
            raise ParameterError(f"a new process cannot be told of a {type(value).__name__}: name a file.") from None

    return json.dumps(material, default=rows)


def heard(text: str) -> dict[str, Any]:
    """What was told."""
    kinds = {3: mi.ScalarTransform3f, 4: mi.ScalarTransform4f}
    return json.loads(text, object_hook=lambda node: kinds[len(node[MATRIX])](node[MATRIX]) if MATRIX in node else node)


def here(text: str, variant: str) -> First:
    """In this process, which must be a new one."""
    mi.set_variant(variant)
    mi.set_log_level(mi.LogLevel.Error)
    material = heard(text)
    wall, cpu = time.perf_counter(), time.process_time()
    scene = mi.load_dict(preview(material, size=(SIZE, SIZE), spp=SPP), parallel=False)
    dr.eval(mi.render(scene))
    dr.sync_thread()
    return First(time.perf_counter() - wall, time.process_time() - cpu, most_memory())


def most_memory() -> float:
    """The most that this process had, in MiB; 0 on Windows, which does not tell."""
    with suppress(OSError, StopIteration), open("/proc/self/status") as file:
        # Not ru_maxrss, which on Linux counts what the parent had when it started this process.
        return next(int(line.split()[1]) for line in file if line.startswith("VmHWM")) / 2**10
    with suppress(ImportError):
        import resource

        return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20  # in bytes on macOS
    return 0.0


def main(variant: str) -> None:
    """What the new process does: from a description to numbers, as JSON."""
    print(json.dumps(here(sys.stdin.read(), variant)._asdict()))
