"""What a check returns: verdict, numbers and evidence that can be drawn; and how sure it has to be."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from asperity.lab import evaluate

SIGNIFICANCE = 0.01
"""Probability that a statistical check rejects a right BSDF, over all its directions together (Šidák), by default."""


@dataclass(frozen=True)
class Histogram:
    """Samples counted in cells of equal solid angle: rows from cos θ = 1 to -1, columns from φ = -π to π."""

    incident: tuple[float, float]
    observed: np.ndarray
    expected: np.ndarray


@dataclass(frozen=True)
class Violations:
    """Pairs of directions (n, 3), by how much they violate the bound (1 is just allowed), and what is violated."""

    wi: np.ndarray
    wo: np.ndarray
    excess: np.ndarray
    quantity: str


@dataclass(frozen=True)
class Curves:
    """Named curves over common labelled abscissae, and the largest value allowed, where there is one."""

    labels: Sequence[str]
    curves: dict[str, np.ndarray]
    quantity: str
    limit: float | None = None


@dataclass(frozen=True)
class Result:
    """Outcome of a check. ``passed`` is None if it was skipped, and ``measured`` says why."""

    name: str
    passed: bool | None
    measured: str
    bound: str = ""
    evidence: Histogram | Violations | Curves | None = None


def sidak(comparisons: int, significance: float) -> float:
    """Return the significance of one comparison for which all together have ``significance``."""
    return float(1 - (1 - significance) ** (1 / comparisons))


def violations(wi: mi.Vector3f, wo: mi.Vector3f, bad: np.ndarray, quantity: str) -> Violations:
    """Return the pairs that ``bad`` selects."""
    i, o = (evaluate.to_numpy(w, bad.size)[:, bad].T for w in (wi, wo))
    return Violations(i, o, np.full(int(bad.sum()), np.inf), quantity)


def named(angles: tuple[float, float]) -> str:
    """Return the text of a direction."""
    return f"θ {angles[0]:g}°, φ {angles[1]:g}°"


def complaint(error: Exception) -> str:
    """Return the kind of an exception and its first line: Dr.Jit's go on with every overload of a function."""
    return f"{type(error).__name__}: {str(error).partition(chr(10))[0]}"
