"""What every BSDF must obey, and a test of each on any ``mi.BSDF``.

Each check returns a ``Result`` that says what was measured and what was allowed, and why. Bounds follow from float32
or from the statistics of the samples: seeds are fixed, so that a BSDF passes always or never.

>>> asperity.lab.plugins.load("my_bsdf.py")  # runs it in every variant; not needed for Mitsuba's BSDFs and ours
>>> check({"type": "my_bsdf"})

``bounds`` knows that reflectances are in [0, 1]. Of other parameters a BSDF, or a texture, tells the ranges by a method

>>> def ranges(self):
>>>     return {"roughness": (0.001, 1.0), "absorption": (0.0, math.inf)}

with the least and the greatest value by the name that `traverse` uses; an infinite one is not tested, nor one that the
range does not contain.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Callable, Sequence
from typing import Any

import mitsuba as mi
import numpy as np

from asperity.errors import ParameterError, UnknownNameError
from asperity.lab import evaluate

from . import bounds, consistency, continuity, density, energy, finiteness, gradients, variants
from .results import SIGNIFICANCE, Curves, Histogram, Result, Violations, complaint

__all__ = ["CHECKS", "NAMES", "Curves", "Histogram", "Result", "Violations", "canonical", "check"]

CHECKS: dict[str, Callable[..., Result]] = {
    "chi2": density.chi_square,
    "pdf-integral": density.pdf_integral,
    "weight": consistency.weights,
    "sampled-pdf": consistency.sampled_pdf,
    "eval-pdf": consistency.eval_pdf,
    "determinism": consistency.determinism,
    "reciprocity": consistency.reciprocity,
    "continuity": continuity.continuity,
    "finiteness": finiteness.finiteness,
    "bounds": bounds.bounds,
    "energy": energy.energy,
    "furnace": energy.furnace,
    "gradients": gradients.gradients,
}
"""The checks that take a BSDF; ``variants`` takes its description."""

STATISTICAL = ("chi2", "energy", "furnace")
"""Those that also take a significance."""

NAMES = (*CHECKS, "variants")


def canonical(given: str) -> str:
    """Return the name of a check, however it is spelt: ``chi²`` or ``pdf integral``, say."""
    name = re.sub(r"[\s_]+", "-", unicodedata.normalize("NFKD", given).strip().lower())
    if name not in NAMES:
        raise UnknownNameError("check", given, NAMES)
    return name


def quiet(name: str, done: int, total: int) -> None:
    """Show no progress."""


def array_variant(description: dict[str, Any] | mi.BSDF) -> str:
    """Return the variant to check in: the active one, or if that is scalar, the one that vectorises it."""
    active = evaluate.active_variant()
    if active.startswith("scalar_") and not isinstance(description, dict):
        raise ParameterError(
            f"{active} evaluates one direction at a time: pass the BSDF's dictionary, or use an llvm variant"
        )
    return active.replace("scalar_", "llvm_ad_")


def check(
    description: dict[str, Any] | mi.BSDF,
    progress: Callable[[str, int, int], None] = quiet,
    only: Sequence[str] = NAMES,
    significance: float = SIGNIFICANCE,
) -> list[Result]:
    """Run the checks named in ``only`` on a BSDF, or on the dictionary of one.

    ``significance``, in (0, 1), is the probability with which each statistical check rejects a right BSDF.

    ``progress(name, done, total)`` is called before each check. Dictionaries must hold no Mitsuba objects: they are
    loaded in other variants too. In a scalar variant the checks run in its LLVM counterpart. Raises ParameterError or
    UnknownNameError for what cannot be checked; a BSDF that raises anything while it is checked fails.
    """
    if not 0 < significance < 1:
        raise ParameterError(f"significance = {significance}: expected a number in (0, 1).")
    only = [canonical(name) for name in only]
    active, vectorised = evaluate.active_variant(), array_variant(description)
    results = []
    try:
        mi.set_variant(vectorised)
        bsdf = evaluate.load(description)
        for done, name in enumerate(only):
            progress(name, done, len(only))
            results.append(attempt(name, bsdf, description, significance))
    finally:
        mi.set_variant(active)
    if vectorised != active:
        results.append(Result("scalar", None, f"{active} evaluates one direction at a time: checked in {vectorised}"))
    return results


def attempt(name: str, bsdf: mi.BSDF, description: dict[str, Any] | mi.BSDF, significance: float) -> Result:
    """Run one check; a BSDF that raises an exception fails it."""
    try:
        with np.errstate(all="ignore"):  # NaN is found, and told in the result
            if name == "variants":
                return variants.variants(description)
            return CHECKS[name](bsdf, significance) if name in STATISTICAL else CHECKS[name](bsdf)
    except Exception as error:  # whatever a plugin raises is its failure, and is reported
        return Result(name, False, complaint(error), "raises no exception")
