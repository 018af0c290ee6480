"""Whether triangles are one surface that may be repeated: no holes, no folds, and borders that match."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from ..errors import ParameterError

TOLERANCE = 2e-6
"""Borders match within this share of the largest coordinate: the rounding of two numbers of six digits in a text file,
and far more than that of two float32."""


class Triangles(NamedTuple):
    """One period of a surface, or a quarter of one that is mirrored; its bounding box is centred on the origin."""

    vertices: np.ndarray  # (n, 3)
    faces: np.ndarray  # (m, 3): indices of vertices, counter-clockwise from outside
    uv: np.ndarray  # (n, 2)
    size: np.ndarray  # (3,): of the bounding box


def normals(vertices: np.ndarray, faces: np.ndarray) -> np.ndarray:
    """Normals (faces, 3), as long as twice the faces' areas."""
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    return np.cross(b - a, c - a)


def centred(vertices: np.ndarray, faces: np.ndarray, uv: np.ndarray | None, wrapped: bool) -> Triangles:
    """A mesh moved to the middle, if it is a surface that may be repeated."""
    used, faces = np.unique(faces, return_inverse=True)
    original, vertices, faces = vertices, vertices[used], faces.reshape(-1, 3)
    wrong = np.flatnonzero(~np.all(np.isfinite(vertices), axis=1))
    if len(wrong):
        raise ParameterError(
            f"mesh: vertex {used[wrong[0]]} is at {_where(original[used[wrong[0]]])}: expected finite coordinates; "
            f"{len(wrong)} such vertices."
        )
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    size = high - low
    tolerance = TOLERANCE * max(np.abs(vertices).max(), size.max())
    if min(size[:2]) <= 4 * tolerance:
        raise ParameterError(
            f"mesh: it spans {_where(size)} in x, y and z: expected a width and a depth above {4 * tolerance:g}. "
            "Heights must be along z; many programs export y up."
        )
    at_border = np.stack([np.abs(vertices - low) <= tolerance, np.abs(vertices - high) <= tolerance])[..., :2]
    open_edges, owners = _open_edges(vertices, faces)
    sides = at_border[:, open_edges].all(axis=2)  # (low or high, edges, x or y)
    holes = np.flatnonzero(~sides.reshape(2, -1, 2).any(axis=2).any(axis=0))
    if len(holes):
        a, b = vertices[open_edges[holes[0]]]
        raise ParameterError(
            f"mesh: a hole. Face {owners[holes[0]]} has no neighbour across the edge from {_where(a)} to {_where(b)}, "
            f"which is not on the tile's border, x = {low[0]:g} or {high[0]:g}, y = {low[1]:g} or {high[1]:g}; "
            f"{len(holes)} such edges. Fill holes, join edges that meet, and cut the mesh to a rectangle."
        )
    _check_cover(vertices, faces, size)
    if wrapped:
        _check_borders(vertices, open_edges, sides, tolerance)
    vertices = vertices - (low + high) / 2
    vertices[:, :2] = np.where(at_border[0], -size[:2] / 2, np.where(at_border[1], size[:2] / 2, vertices[:, :2]))
    uv = vertices[:, :2] / size[:2] + 0.5 if uv is None else uv[used]
    return Triangles(vertices, faces[np.any(normals(vertices, faces) != 0, axis=-1)], uv, size)


def _open_edges(vertices: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges (n, 2) of only one face, and that face; each other edge must be of two, once in each direction.

    Vertices at the same place count as one: files repeat them along the seams of textures, say.
    """
    _, first, place = np.unique(vertices + 0.0, axis=0, return_index=True, return_inverse=True)
    corners = place.reshape(-1)[faces]
    edges = np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2)
    real = np.repeat(np.all(corners != np.roll(corners, -1, axis=1), axis=1), 3)  # not of faces that are mere lines
    owners, edges = np.flatnonzero(real) // 3, edges[real]
    low, high = edges.min(axis=1), edges.max(axis=1)
    _, edge, counts = np.unique(low * len(first) + high, return_inverse=True, return_counts=True)
    turns = np.bincount(edge, np.where(edges[:, 0] == low, 1, -1), len(counts))
    for wrong, what in (
        (counts > 2, "more than one neighbour"),
        ((counts == 2) & (turns != 0), "a neighbour of opposite orientation"),
    ):
        if wrong.any():
            k = np.argmax(wrong[edge])
            a, b = vertices[first[edges[k]]]
            raise ParameterError(
                f"mesh: face {owners[k]} has {what} across the edge from {_where(a)} to {_where(b)}; "
                f"{np.count_nonzero(wrong)} such edges. Expected one surface of faces counter-clockwise from above."
            )
    open_ones = counts[edge] == 1
    return first[edges[open_ones]], owners[open_ones]


def _check_cover(vertices: np.ndarray, faces: np.ndarray, size: np.ndarray) -> None:
    """A surface whose border is that of the tile covers it once: what looks up less what looks down is its area."""
    cover = normals(vertices, faces)[:, 2].sum() / 2 / np.prod(size[:2])
    if cover < -0.5:
        raise ParameterError(
            "mesh: it is upside down: its faces are clockwise from above. Flip them, or reverse the order of each "
            "face's vertices."
        )
    if abs(cover - 1) > 1e-3:
        raise ParameterError(
            f"mesh: seen from above, its faces cover {cover:g} of its bounding box, {_where(size[:2])}, less "
            "those that look down: expected 1. A closed body covers 0: leave its bottom and sides away."
        )


def _check_borders(vertices: np.ndarray, edges: np.ndarray, sides: Any, tolerance: float) -> None:
    """Opposite borders are the same lines."""
    for axis, name in enumerate("xy"):
        plane = [1 - axis, 2]
        low, high = (vertices[edges[side]][..., plane] for side in sides[..., axis])
        for one, other in ((low, high), (high, low)):
            points = one.reshape(-1, 2)
            apart = _distances(points, other)
            worst = np.argmax(apart)
            if apart[worst] > tolerance:
                y, z = points[worst]
                raise ParameterError(
                    f"mesh: its borders in {name} do not match. At {'yx'[axis]} = {y:g}, z = {z:g} they are "
                    f"{apart[worst]:g} apart; {np.count_nonzero(apart > tolerance)} of {len(apart)} ends of the "
                    f'border\'s edges are more than {tolerance:g} apart. Use periodic="mirror", or mend the mesh.'
                )


def _distances(points: np.ndarray, segments: np.ndarray) -> np.ndarray:
    """From each of the points (n, 2) to the nearest of the segments (m, 2, 2)."""
    start, along = segments[:, 0], segments[:, 1] - segments[:, 0]
    square = np.maximum(np.sum(along**2, axis=1), np.finfo(float).tiny)

    def nearest(some: np.ndarray) -> np.ndarray:
        to = some[:, None] - start
        share = np.clip(np.sum(to * along, axis=-1) / square, 0, 1)
        return np.linalg.norm(to - share[..., None] * along, axis=-1).min(axis=1)

    pieces = np.array_split(points, 1 + len(points) * len(segments) // 2**20)  # never much memory
    return np.concatenate([nearest(some) for some in pieces if len(some)])


def _where(point: np.ndarray) -> str:
    return "(" + ", ".join(f"{x:g}" for x in point) + ")"
