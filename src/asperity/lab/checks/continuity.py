"""No jump at directions that formulas treat apart: normal, coplanar, retro, mirror, along an axis."""

from __future__ import annotations

import mitsuba as mi
import numpy as np

from asperity.lab import evaluate

from .results import Result, Violations, named
from .samples import sides

BREADTHS = (1e-3, 0.05)
"""A hair's breadth: the distance, in degrees, at which the nearer neighbours lie; the farther ones are twice as far.
The second is what it takes where formulas see a cosine: in float32 it is 1 up to 0.014 degrees from the normal. But a
narrow lobe may end before that: there the centre must only not be lower."""

NEIGHBOURS = 16
"""At each distance: the half vector goes in as many directions, also opposite ones, to see both sides of a kink."""

REACH = 4.0
"""Times the change between the two distances: what is left to change on the way to the centre. |x|^p needs
1 / (2^p - 1), which is 1 for a kink, 2.4 for a root; a jump changes nothing between them."""

POLE = 1.3
"""Where neighbours grow by more than this as the distance halves, or all round, there may be a pole, and of any
strength in a direction between them: the centre may be any higher, but no lower."""

TOLERANCE = (1e-2, 1e-5)
"""Relative and absolute: steps as small as this are no jumps that anybody sees, but may be rounding errors."""


def excess(centre: np.ndarray, near: np.ndarray, far: np.ndarray, lobes: bool) -> np.ndarray:
    """By how much values (rows, n) leave what their neighbours (rows, n, k) lead up to; 1 is just allowed.

    ``lobes`` tells that a lobe may be narrower than the neighbours' distance.
    """
    low, high, size = near.min(axis=-1), near.max(axis=-1), np.abs(near).max(axis=-1)
    # A limit may depend on the way there: of that spread, too, only a part was seen.
    change = np.abs(near - far).max(axis=-1) + high - low
    allowed = REACH * change + TOLERANCE[0] * size + TOLERANCE[1]
    pole = (near.mean(axis=-1) > POLE * far.mean(axis=-1)) | (high > POLE * low)
    beyond = np.maximum(low - centre, np.where(pole | lobes, 0, centre - high))
    with np.errstate(invalid="ignore"):
        return np.nan_to_num(np.where(np.isfinite(centre), beyond / allowed, np.inf), nan=np.inf)


def offsets(n: int, breadth: float) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (n, NEIGHBOURS, 3) of wi and wo: those of the half vector go all round, those between are random."""
    rng = np.random.default_rng(22)
    half_turn = np.pi * (np.arange(NEIGHBOURS // 2) + rng.random((n, 1))) / (NEIGHBOURS // 2)
    both = np.radians(breadth) * np.stack([np.cos(half_turn), np.sin(half_turn), np.zeros_like(half_turn)], axis=-1)
    apart = np.radians(breadth) * rng.normal(size=both.shape)
    i, o = both + apart, both - apart
    return np.concatenate([i, -i], axis=1), np.concatenate([o, -o], axis=1)


def neighbours(special: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Unit directions (n, 2 k + 1, 3): the special ones (n, 3), and those moved by ``moves`` (n, k, 3) and twice."""
    moved = special[:, None] + np.concatenate([0 * moves[:, :1], moves, 2 * moves], axis=1)
    moved[:, 1:] /= np.linalg.norm(moved[:, 1:], axis=-1, keepdims=True)  # the centre stays exact
    return moved


def around(bsdf: mi.BSDF, wi: np.ndarray, wo: np.ndarray, breadth: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Values of all channels, and the pdf, at pairs (rows, n), and at their nearer and farther neighbours."""
    i, o = (neighbours(w, moves).reshape(-1, 3) for w, moves in zip((wi, wo), offsets(len(wi), breadth)))
    # The same wavelengths in all lanes: neighbours are to differ by their directions only.
    values = evaluate.at_pairs(bsdf, i, o, (450, 525, 575, 650)).reshape(-1, len(wi), 2 * NEIGHBOURS + 1)
    return values[..., 0], values[..., 1 : NEIGHBOURS + 1], values[..., NEIGHBOURS + 1 :]


def continuity(bsdf: mi.BSDF) -> Result:
    """Compare value and pdf at special pairs of directions with those a hair's breadth off."""
    wi, wo = evaluate.special_pairs(both_sides=sides(bsdf) != (1,))
    found = [around(bsdf, wi, wo, breadth) for breadth in BREADTHS]
    if not any(values.any() for values in found[0]):
        return Result("continuity", None, "has only delta lobes")
    by = np.array([excess(*values, lobes=breadth > BREADTHS[0]) for values, breadth in zip(found, BREADTHS)])
    scale, row, worst = np.unravel_index(np.argmax(by), by.shape)
    bad = by.max(axis=(0, 1)) > 1
    centre, near, _ = found[scale]
    example = (
        f"; {'pdf' if row == len(centre) - 1 else 'eval'} {centre[row, worst]:.3g}, "
        f"but {near[row, worst].mean():.3g} {BREADTHS[scale]}° off, "
        f"at wi {named(angles(wi[worst]))}, wo {named(angles(wo[worst]))}"
    )
    return Result(
        "continuity",
        not bad.any(),
        f"{bad.sum()} jumps at {len(wi)} special pairs of directions" + (example if bad.any() else ""),
        f"0: eval and pdf within {TOLERANCE[0]:.0%} of what {NEIGHBOURS} neighbours, 0.001° and 0.05° off, lead up to",
        Violations(wi[bad], wo[bad], by.max(axis=(0, 1))[bad], "jump"),
    )


def angles(w: np.ndarray) -> tuple[float, float]:
    """Elevation from the normal and azimuth of a direction, in degrees."""
    return float(np.degrees(np.arccos(np.clip(w[2], -1, 1)))), float(np.degrees(np.arctan2(w[1], w[0])))
