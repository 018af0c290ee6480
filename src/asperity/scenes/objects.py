"""The objects a material is shown on: a turned chess pawn, a torus knot, a sphere.

They fit a box of about 2.4 units, stand on z = 0 and are centred on the z axis. The meshes are made by formula, in
plain NumPy, with exact normals and with texture coordinates that anisotropic materials can follow.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.spatial.transform import Rotation

from asperity.scenes.meshes import Array, ShadedMesh

PAWN_PROFILE = {
    "underside": [(0, 0), (0.25, 0), (0.5, 0), (0.66, 0), (0.73, 0), (0.755, 0.012), (0.765, 0.035)],
    "foot": [(0.77, 0.075), (0.765, 0.115), (0.735, 0.15), (0.69, 0.162), (0.665, 0.168)],
    "bead": [(0.655, 0.185), (0.662, 0.215), (0.675, 0.25), (0.668, 0.29), (0.63, 0.315)],
    "rim": [(0.585, 0.323), (0.565, 0.33), (0.55, 0.35), (0.51, 0.41), (0.42, 0.52)],
    "stem": [(0.33, 0.67), (0.265, 0.86), (0.225, 1.04), (0.21, 1.18), (0.21, 1.25)],
    "ring": [(0.222, 1.275), (0.25, 1.285), (0.272, 1.3), (0.272, 1.325), (0.25, 1.34)],
    "below the collar": [(0.235, 1.352), (0.26, 1.366), (0.33, 1.374), (0.385, 1.38), (0.41, 1.392)],
    "collar": [(0.418, 1.412), (0.41, 1.432), (0.38, 1.444), (0.31, 1.458), (0.25, 1.478), (0.235, 1.5), (0.25, 1.53)],
}
"""Control points (radius, height) of a uniform cubic B-spline, from the middle of the underside up to the head."""

HEAD_RADIUS, HEAD_CENTRE = 0.41, 1.84

KNOT_RADIUS, KNOT_WINDING, TUBE_RADIUS = 0.70, 0.32, 0.21
"""Of the torus the knot winds on, large and small, and of its tube."""
KNOT_POSE = Rotation.from_euler("zxz", [90, 90, 25], degrees=True).as_matrix()
"""Stands the knot up, one lobe on top, turned a little away from the camera."""


def pawn(columns: int = 512, rows: int = 400) -> ShadedMesh:
    """A turned chess pawn; u follows the turning, v runs up the profile by arc length."""
    polar = np.linspace(0.74, 0, 12) * np.pi  # the head, as an angle from the zenith
    step = polar[0] - polar[1]
    # A cubic B-spline runs inside its control polygon; this radius makes it pass through the ball at every knot.
    head = HEAD_RADIUS * 3 / (2 + np.cos(step)) * np.stack([np.sin(polar), np.cos(polar)], axis=1)
    points = np.concatenate([*PAWN_PROFILE.values(), head + np.array([0, HEAD_CENTRE])])
    points[-1, 0] = 0
    # Mirrored neighbours beyond both ends put the curve on the axis there, and make it cross the axis horizontally.
    mirrored = points[[1, -2]] * [-1, 1]
    points = np.concatenate([mirrored[:1], points, mirrored[1:]])
    spline = BSpline(np.arange(len(points) + 4), points, 3)
    t = np.linspace(3, len(points), rows + 1)
    return revolve(spline(t), spline(t, 1), columns)


def sphere(columns: int = 512, rows: int = 256) -> ShadedMesh:
    """The unit sphere; u follows the parallels, v the meridians."""
    angle = np.linspace(0, np.pi, rows + 1)  # from the nadir
    profile = np.stack([np.sin(angle), 1 - np.cos(angle)], axis=1)
    return revolve(profile, np.stack([np.cos(angle), np.sin(angle)], axis=1), columns)


def knot(columns: int = 1200, rows: int = 128) -> ShadedMesh:
    """A (2,3) torus knot standing on two of its three lobes; u runs along the tube, v around it."""
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1))
    toroidal, poloidal, around = 4 * np.pi * u, 6 * np.pi * u, 2 * np.pi * v
    radial = np.stack([np.cos(toroidal), np.sin(toroidal), np.zeros_like(u)], axis=-1)
    up, ring = np.array([0, 0, 1]), np.stack([-radial[..., 1], radial[..., 0], np.zeros_like(u)], axis=-1)
    c, s = np.cos(poloidal)[..., None], np.sin(poloidal)[..., None]

    # The tube's frame follows the normal of the torus that the knot winds on: it closes, and it twists little.
    across = c * radial + s * up
    centre = KNOT_RADIUS * radial + KNOT_WINDING * across
    along = 2 * (KNOT_RADIUS + KNOT_WINDING * c) * ring + 3 * KNOT_WINDING * (c * up - s * radial)
    binormal = np.cross(across, along / np.linalg.norm(along, axis=-1, keepdims=True))
    normals = np.cos(around)[..., None] * across + np.sin(around)[..., None] * binormal
    vertices = centre + TUBE_RADIUS * normals

    vertices, normals = vertices @ KNOT_POSE.T, normals @ KNOT_POSE.T
    vertices[..., 2] -= vertices[..., 2].min()
    faces = np.concatenate(lattice(rows, columns)).reshape(-1, 3)
    return ShadedMesh(vertices.reshape(-1, 3), normals.reshape(-1, 3), np.stack([u, v], axis=-1).reshape(-1, 2), faces)


def revolve(profile: Array, tangents: Array, columns: int) -> ShadedMesh:
    """Turn a profile of (radius, height), from the axis below to the axis above, about the z axis."""
    rows = len(profile) - 1
    tangents = tangents / np.linalg.norm(tangents, axis=1, keepdims=True)
    outward = np.stack([tangents[:, 1], -tangents[:, 0]], axis=1)
    profile = profile.copy()
    profile[[0, -1], 0] = outward[[0, -1], 0] = 0  # on the axis exactly, where rounding left them almost
    length = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])

    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), length / length[-1])
    azimuth = 2 * np.pi * u
    # Each triangle at a pole has a vertex of its own there, in the middle of its u, so that dp/du follows the turning.
    u[0] += 0.5 / columns
    u[-1] -= 0.5 / columns
    below, above = lattice(rows, columns)
    faces = np.concatenate([below[1:], above[:-1]])  # the others have no area: two of their vertices are at a pole

    def turned(curve: Array) -> Array:
        radius, height = curve[:, :1], np.broadcast_to(curve[:, 1:], azimuth.shape)
        return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height], axis=-1).reshape(-1, 3)

    return ShadedMesh(turned(profile), turned(outward), np.stack([u, v], axis=-1).reshape(-1, 2), faces.reshape(-1, 3))


def lattice(rows: int, columns: int) -> tuple[NDArray[np.uint32], NDArray[np.uint32]]:
    """Lower and upper triangles (rows, columns, 3) of the cells of a lattice of (rows + 1, columns + 1) vertices."""
    index = np.arange((rows + 1) * (columns + 1), dtype=np.uint32).reshape(rows + 1, columns + 1)
    a, b, c, d = index[:-1, :-1], index[:-1, 1:], index[1:, 1:], index[1:, :-1]
    return np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)


OBJECTS = {"pawn": pawn, "knot": knot, "sphere": sphere}
