"""No jump at directions that formulas treat apart: normal, coplanar, retro, mirror, along an axis."""

from __future__ import annotations

import numpy as np

from asperity.lab import evaluate

from .results import Result, Violations, named
from .samples import sides

BREADTH = np.radians(1e-3)
"""A hair's breadth: the distance, in radians, at which the nearer neighbours lie; the farther ones are twice as far."""

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


def excess(centre: np.ndarray, near: np.ndarray, far: np.ndarray) -> np.ndarray:
    """By how much values (rows, n) leave what their neighbours (rows, n, k) lead up to; 1 is just allowed."""
    low, high, size = near.min(axis=-1), near.max(axis=-1), np.abs(near).max(axis=-1)
    # A limit may depend on the way there: of that spread, too, only a part was seen.
    change = np.abs(near - far).max(axis=-1) + high - low
    allowed = REACH * change + TOLERANCE[0] * size + TOLERANCE[1]
    pole = (near.mean(axis=-1) > POLE * far.mean(axis=-1)) | (high > POLE * low)
    beyond = np.maximum(low - centre, np.where(pole, 0, centre - high))
    with np.errstate(invalid="ignore"):
        return np.nan_to_num(np.where(np.isfinite(centre), beyond / allowed, np.inf), nan=np.inf)


def offsets(n: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Offsets (n, NEIGHBOURS, 3) of wi and wo: those of the half vector go all round, those between are random."""
    rng = np.random.default_rng(seed)
    half_turn = np.pi * (np.arange(NEIGHBOURS // 2) + rng.random((n, 1))) / (NEIGHBOURS // 2)
    both = BREADTH * np.stack([np.cos(half_turn), np.sin(half_turn), np.zeros_like(half_turn)], axis=-1)
    apart = BREADTH * rng.normal(size=both.shape)
    return tuple(np.concatenate([move, -move], axis=1) for move in (both + apart, both - apart))


def neighbours(special: np.ndarray, moves: np.ndarray) -> np.ndarray:
    """Unit directions (n, 2 k + 1, 3): the special ones (n, 3), and those moved by ``moves`` (n, k, 3) and twice."""
    moved = special[:, None] + np.concatenate([0 * moves[:, :1], moves, 2 * moves], axis=1)
    moved[:, 1:] /= np.linalg.norm(moved[:, 1:], axis=-1, keepdims=True)  # the centre stays exact
    return moved


def continuity(bsdf) -> Result:
    """Compare value and pdf at special pairs of directions with those a hair's breadth off."""
    wi, wo = evaluate.special_pairs(both_sides=sides(bsdf) != (1,))
    pairs = [neighbours(w, moves).reshape(-1, 3) for w, moves in zip((wi, wo), offsets(len(wi), seed=22))]
    # The same wavelengths in all lanes: neighbours are to differ by their directions only.
    values = evaluate.at_pairs(bsdf, *pairs, wavelengths=(450, 525, 575, 650)).reshape(-1, len(wi), 2 * NEIGHBOURS + 1)
    if not values.any():
        return Result("continuity", None, "has only delta lobes")
    centre, near, far = values[..., 0], values[..., 1 : NEIGHBOURS + 1], values[..., NEIGHBOURS + 1 :]
    by = excess(centre, near, far)
    row, worst = np.unravel_index(np.argmax(by), by.shape)
    by, bad = by.max(axis=0), by.max(axis=0) > 1
    what = "pdf" if row == len(values) - 1 else "eval"
    example = (
        f"; {what} {centre[row, worst]:.3g}, but {near[row, worst].mean():.3g} nearby, "
        f"at wi {named(angles(wi[worst]))}, wo {named(angles(wo[worst]))}"
    )
    return Result(
        "continuity",
        not bad.any(),
        f"{bad.sum()} jumps at {len(wi)} special pairs of directions" + (example if bad.any() else ""),
        f"0: eval and pdf within {TOLERANCE[0]:.0%} of what {NEIGHBOURS} neighbours 0.001° and 0.002° off lead up to",
        Violations(wi[bad], wo[bad], by[bad], "jump"),
    )


def angles(w: np.ndarray) -> tuple[float, float]:
    """Elevation from the normal and azimuth of a direction, in degrees."""
    return float(np.degrees(np.arccos(np.clip(w[2], -1, 1)))), float(np.degrees(np.arctan2(w[1], w[0])))
