"""Fits all candidates to measured materials, and takes the errors of published fits to the same: `docs/fits.json`.

    python benchmarks/merl.py --jobs 2 -o docs/fits.json                   # MERL, all candidates: hours on two cores
    python benchmarks/merl.py --of rgl --of nist -o docs/fits.json         # the paints and the PTFE
    python benchmarks/merl.py --materials chrome --models twoscale "vgroove + diffuse" -o chrome.json

What the file has already is not done again, so that it may be interrupted, and it is written every half minute.
`python docs/build.py` makes the tables of docs/fitting-results.md from it.
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import time
from concurrent.futures import FIRST_COMPLETED, ProcessPoolExecutor, wait
from functools import lru_cache
from pathlib import Path
from typing import Any

import materials
import numpy as np
import published

WRITE = 30.0
"""Seconds between two writings of the file."""
DIGITS = 5
"""Of numbers in the file: more than the parameters are sure by."""
Task = tuple[str, str]


@lru_cache(maxsize=2)
def data(name: str) -> Any:
    """The material that a process fits to one after the other."""
    return materials.load(name)


def prepare(variant: str, threads: int) -> None:
    """A process of the pool, of few threads where there are many."""
    os.environ["OMP_NUM_THREADS"] = os.environ["OPENBLAS_NUM_THREADS"] = str(threads)
    import asperity  # noqa: F401  isort: skip
    import drjit as dr
    import mitsuba as mi

    mi.set_variant(variant)
    dr.set_thread_count(threads)


def fitted(task: Task) -> dict[str, Any]:
    """What a candidate's fit to a material comes to."""
    from asperity import fitting

    name, model = task
    found = fitting.fit(data(name), model)
    errors = found.errors
    f = found.values.T / found.data.wo[:, 2:]
    return {
        "error": errors.log_cosine,
        "linear": errors.linear,
        "relative": errors.relative,
        "f": np.sqrt(np.square(f - found.data.values).mean()),
        "bias": errors.bias,
        "aic": found.aic,
        "numbers": len(found.parameters),
        "seconds": found.seconds,
        "material": found.material,
    }


def others(task: Task) -> dict[str, Any]:
    """The error of a published fit to a material, by the same measure."""
    from asperity.fitting import losses

    name, fit = task
    found = data(name)
    fit = materials.published()[published.FITS[fit]][name.partition("/")[2]]
    cosine = found.wo[:, 2:]
    f = published.evaluate(fit, found.wi, found.wo)
    return {"error": losses.log_cosine((f * cosine).T, (found.values * cosine).T, found.weights)}


def done(task: Task) -> dict[str, Any]:
    """Either; a failure is a result too."""
    try:
        return others(task) if task[1] in published.FITS else fitted(task)
    except Exception as error:
        return {"failed": f"{type(error).__name__}: {error}"}


def tasks(asked: argparse.Namespace) -> list[Task]:
    """All fits, of a material one after the other."""
    from asperity.fitting import CANDIDATES

    found = [name for of in asked.of or ["merl"] for name in materials.names(of)]
    if asked.materials:
        found = [name for name in found if name.partition("/")[2] in asked.materials]
    models = asked.models or [*published.FITS, *CANDIDATES]
    return [(name, model) for name in found for model in models if model not in published.FITS or has(name, model)]


def has(name: str, fit: str) -> bool:
    """Whether somebody has published such a fit."""
    of, _, material = name.partition("/")
    return of == "merl" and material in materials.published()[published.FITS[fit]]


def rounded(value: Any) -> Any:
    """The same in few digits."""
    if isinstance(value, dict):
        return {name: rounded(one) for name, one in value.items()}
    if isinstance(value, list):
        return [rounded(one) for one in value]
    return float(f"{value:.{DIGITS}g}") if isinstance(value, (float, np.floating)) else value


def write(found: dict[str, dict[str, Any]], path: Path) -> None:
    """A line a fit, so that changes are seen."""
    from asperity.files import atomically

    blocks = []
    for name, fits in sorted(found.items()):
        lines = (f"  {json.dumps(model)}: {json.dumps(fit)}" for model, fit in sorted(fits.items()))
        blocks.append(f" {json.dumps(name)}: {{\n" + ",\n".join(lines) + "\n }")
    with atomically(path) as part:
        part.write_text("{\n" + ",\n".join(blocks) + "\n}\n", encoding="utf-8")


def study(todo: list[Task], found: dict[str, dict[str, Any]], asked: argparse.Namespace) -> None:
    """Do them all in processes, and write now and then; after ``--for`` seconds no more are begun."""
    end, written, total = time.monotonic() + asked.seconds, time.monotonic(), len(todo)
    context = multiprocessing.get_context("spawn")
    threads = max(1, (os.cpu_count() or 1) // asked.jobs)
    with ProcessPoolExecutor(asked.jobs, context, prepare, (asked.variant, threads)) as pool:
        running: dict[Any, Task] = {}
        try:
            while todo or running:
                while todo and len(running) < asked.jobs and time.monotonic() < end:
                    task = todo.pop(0)
                    running[pool.submit(done, task)] = task
                if not running:
                    break
                for future in wait(running, timeout=WRITE, return_when=FIRST_COMPLETED).done:
                    name, model = running.pop(future)
                    found.setdefault(name, {})[model] = rounded(result := future.result())
                    told = result.get("failed") or f"{result['error']:.5f}, {result.get('seconds', 0):.1f} s"
                    print(f"{total - len(todo) - len(running)} of {total}: {name}, {model}: {told}", flush=True)
                if time.monotonic() - written > WRITE:
                    write(found, asked.output)
                    written = time.monotonic()
        finally:
            write(found, asked.output)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=Path, required=True, help="file with what was done, and will be")
    parser.add_argument("--of", action="append", choices=materials.SETS, help="sets of materials; default: merl")
    parser.add_argument("--materials", nargs="+", help="some of them")
    parser.add_argument("--models", nargs="+", help="some candidates or published fits")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes")
    parser.add_argument("--for", dest="seconds", type=float, default=np.inf, help="seconds, after which none is begun")
    parser.add_argument("--variant", default="llvm_ad_rgb", help="of Mitsuba")
    asked = parser.parse_args()
    found = json.loads(asked.output.read_text()) if asked.output.exists() else {}
    todo = [(name, model) for name, model in tasks(asked) if "error" not in found.get(name, {}).get(model, {})]
    study(todo, found, asked)


if __name__ == "__main__":
    main()
