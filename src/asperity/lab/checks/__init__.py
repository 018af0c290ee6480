"""What every BSDF must obey, and a test of each on any ``mi.BSDF``.

Each check returns a ``Result`` that says what was measured and what was allowed, and why. Bounds follow from float32
or from the statistics of the samples: seeds are fixed, so that a BSDF passes always or never.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import mitsuba as mi

from asperity.lab import evaluate

from . import consistency, continuity, density, energy, finiteness, gradients, variants
from .results import Curves, Histogram, Result, Violations, complaint

__all__ = ["CHECKS", "NAMES", "Curves", "Histogram", "Result", "Violations", "check"]

CHECKS: dict[str, Callable[[mi.BSDF], Result]] = {
    "chi²": density.chi_square,
    "pdf integral": density.pdf_integral,
    "weight": consistency.weights,
    "sampled pdf": consistency.sampled_pdf,
    "eval_pdf": consistency.eval_pdf,
    "determinism": consistency.determinism,
    "reciprocity": consistency.reciprocity,
    "continuity": continuity.continuity,
    "finiteness": finiteness.finiteness,
    "energy": energy.energy,
    "furnace": energy.furnace,
    "gradients": gradients.gradients,
}
"""The checks that take a BSDF; ``variants`` takes its description."""

NAMES = (*CHECKS, "variants")


def quiet(name: str, done: int, total: int) -> None:
    """Show no progress."""


def array_variant(description: dict[str, Any] | mi.BSDF) -> str:
    """Return the variant to check in: the active one, or if that is scalar, the one that vectorises it."""
    active = evaluate.active_variant()
    if active.startswith("scalar_") and not isinstance(description, dict):
        raise ValueError(
            f"{active} evaluates one direction at a time: pass the BSDF's dictionary, or use an llvm variant"
        )
    return active.replace("scalar_", "llvm_ad_")


def check(
    description: dict[str, Any] | mi.BSDF,
    progress: Callable[[str, int, int], None] = quiet,
    only: Sequence[str] = NAMES,
) -> list[Result]:
    """Run the checks named in ``only`` on a BSDF, or on the dictionary of one.

    ``progress(name, done, total)`` is called before each check. Dictionaries must hold no Mitsuba objects: they are
    loaded in other variants too. In a scalar variant the checks run in its LLVM counterpart.
    """
    if unknown := [name for name in only if name not in NAMES]:
        raise ValueError(f"no check is called {unknown[0]!r}: choose from {', '.join(NAMES)}")
    active, vectorised = evaluate.active_variant(), array_variant(description)
    results = []
    try:
        mi.set_variant(vectorised)
        bsdf = evaluate.load(description)
        for done, name in enumerate(only):
            progress(name, done, len(only))
            results.append(attempt(name, bsdf, description))
    finally:
        mi.set_variant(active)
    if vectorised != active:
        results.append(Result("scalar", None, f"{active} evaluates one direction at a time: checked in {vectorised}"))
    return results


def attempt(name: str, bsdf: mi.BSDF, description: dict[str, Any] | mi.BSDF) -> Result:
    """Run one check; a BSDF that raises an exception fails it."""
    try:
        return variants.variants(description) if name == "variants" else CHECKS[name](bsdf)
    except Exception as error:  # whatever a plugin raises is its failure, and is reported
        return Result(name, False, complaint(error), "raises no exception")
