"""A child of `run.py`: tries cases one after the other, and tells which one before it begins.

A case is its seed: the same one gives the same case, alone or among others.
"""

from __future__ import annotations

import asperity  # noqa: F401  isort: skip
import contextlib
import json
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import descriptions
import files
import mitsuba as mi
import numpy as np

from asperity import loading
from asperity.errors import AsperityError
from asperity.lab import evaluate

OBSCURE = ("Traceback", ".cpp", ".py", "dictionary node", "nanobind", "\n")
"""Not to be found in an error message."""


class Case(NamedTuple):
    """What it is, in words; what to do; and whether that has to be refused."""

    what: str
    act: Callable[[], Any]
    flawed: bool


def tell(**what: Any) -> None:
    print(json.dumps(what), flush=True)


def values(bsdf: Any, rng: np.random.Generator) -> list[float]:
    """Values, densities and weights in a few directions, some of them degenerate."""
    special = [(0, 0, 1), (1, 0, 1e-3), (0.6, 0, 0.8), (-0.6, 0, 0.8), (0, 0.6, -0.8), tuple(rng.normal(size=3))]
    found: list[float] = []
    for _ in range(3):
        wi, wo = (np.array(special[rng.integers(len(special))]) for _ in range(2))
        wi, wo = (mi.Vector3f(*map(float, w / np.linalg.norm(w))) for w in (wi, wo))
        si = evaluate.interaction(wi)
        value, pdf = bsdf.eval_pdf(mi.BSDFContext(), si, wo)
        sampled, weight = bsdf.sample(mi.BSDFContext(), si, float(rng.random()), mi.Point2f(*map(float, rng.random(2))))
        for x in (mi.unpolarized_spectrum(value), pdf, sampled.pdf, mi.unpolarized_spectrum(weight)):
            found += np.array(x, dtype=float).ravel().tolist()
    return found


def nowhere_negative(found: list[float]) -> list[float]:
    """The values, NaN instead of those that are below 0 by more than rounding."""
    return [x if x > -1e-6 else float("nan") for x in found]


def described(seed: int, index: int) -> Case:
    """A random description of a material."""
    rng = np.random.default_rng([seed, index, 0])
    description = descriptions.material(rng)
    flaw = descriptions.flaw(rng, description) if rng.random() < 0.5 else ""
    told = f"{flaw}: {loading.short(description, 600)}"
    return Case(told, lambda: nowhere_negative(values(loading.load(description), rng)), bool(flaw))


def measured(seed: int, index: int, seeds: Path, folder: Path) -> Case:
    """A damaged file of a measured BRDF."""
    rng = np.random.default_rng([seed, index, 2])
    name = sorted(files.MEASURED)[index % len(files.MEASURED)]
    path = folder / name
    path.write_bytes(files.damaged_measurement(name, (seeds / name).read_bytes(), rng))
    return Case(name, lambda: files.quietly(files.MEASURED[name])(path), False)


def damaged(seed: int, index: int, seeds: Path, folder: Path) -> Case:
    """A damaged file."""
    rng = np.random.default_rng([seed, index, 1])
    name = sorted(files.READERS)[index % len(files.READERS)]
    path = folder / name
    (folder / "map.png").write_bytes((seeds / "map.png").read_bytes())  # other files refer to it
    path.write_bytes(files.damaged((seeds / name).read_bytes(), rng))
    return Case(name, lambda: files.quietly(files.READERS[name])(path), False)


def outcome(case: Case) -> str:
    """``fine`` or ``refused``, or what is wrong with it."""
    try:
        found = case.act()
    except AsperityError as error:
        message = str(error)
        clear = len(message) < 500 and not any(noise in message for noise in OBSCURE)
        return "refused" if clear else f"obscure: {message}"
    except Exception as error:
        return f"raised {type(error).__name__}: {error}"
    if case.flawed:
        return "accepted"
    if isinstance(found, list) and not all(np.isfinite(found)):
        return "not finite"
    return "fine"


def limit_memory(gigabytes: int) -> None:
    """What asks for more fails, and does not take the machine down."""
    with contextlib.suppress(ImportError):  # Windows
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (gigabytes << 30, gigabytes << 30))


def main(kind: str, variant: str, seed: int, indices: range) -> None:
    limit_memory(12)
    mi.set_variant("llvm_ad_rgb")
    with tempfile.TemporaryDirectory() as temporary:
        seeds, folder = Path(temporary) / "seeds", Path(temporary) / "damaged"
        seeds.mkdir()
        folder.mkdir()
        if kind != "descriptions":
            {"files": files.write_seeds, "measured": files.write_measured}[kind](seeds)
        mi.set_variant(variant)
        mi.set_log_level(mi.LogLevel.Error)
        for index in indices:
            of_files = {"files": damaged, "measured": measured}
            case = of_files[kind](seed, index, seeds, folder) if kind in of_files else described(seed, index)
            tell(trying=index, what=case.what)
            tell(index=index, result=outcome(case), what=case.what)


if __name__ == "__main__":
    kind, variant, seed, start, stop = sys.argv[1:]
    main(kind, variant, int(seed), range(int(start), int(stop)))
