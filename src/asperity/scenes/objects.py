"""The objects a material is shown on: a turned chess pawn, a torus knot, a sphere, a ball on a plinth.

They fit a box of about 2.4 units, stand on z = 0 and are centred on the z axis. The meshes are made by formula, in
plain NumPy, with exact normals and with texture coordinates that anisotropic materials can follow.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray
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

BALL_RADIUS, BALL_FACE, BOWL_RADIUS = 0.86, np.radians(46), 0.43
PEARL_RADIUS, PEARL_CENTRE = 0.19, 0.43
BALL_POSE = Rotation.from_euler("xz", [46, -10], degrees=True).as_matrix()
"""Turns the face of the ball up, where it mirrors none of the main lights into the camera."""
SEAM = np.array([75, 73, 71.5, 70.5, 69.5, 68, 66, 61, 56, 51]), np.array([1, 1, 0.985, 0.95, 0.95, 0.985, 1, 1, 1, 1])
"""Angles from the axis, and parts of the ball's radius, of control points of a groove around it and of what follows."""
BALL_RIM = [(0.633, -0.045), (0.625, -0.018), (0.608, 0.002), (0.58, 0.002), (0.53, 0.002), (0.48, 0.002)]
BALL_RIM += [(0.455, 0.002), (0.44, -0.004), (0.431, -0.02)]
"""Control points of the flat ring: radius, and height over the face."""
PLINTH_PROFILE = {
    "underside": [(0, 0), (0.3, 0), (0.6, 0), (0.86, 0), (0.96, 0), (0.985, 0.005), (1.0, 0.02)],
    "side": [(1.01, 0.05), (1.01, 0.1), (1.01, 0.16), (1.01, 0.2), (1.008, 0.225)],
    "edge": [(0.998, 0.245), (0.98, 0.255)],
    "ledge": [(0.95, 0.257), (0.9, 0.257), (0.84, 0.257), (0.79, 0.257), (0.76, 0.262)],
    "cove": [(0.71, 0.28), (0.665, 0.32), (0.64, 0.37)],
    "lip": [(0.63, 0.42), (0.625, 0.45), (0.61, 0.468), (0.585, 0.472), (0.56, 0.468), (0.545, 0.455)],
}
PLINTH_HEIGHT, CUP_RIM, CUP_GAP = 0.46, 0.54, 0.008
"""Where the cup begins, and its distance from the ball: solids that overlap would be no glass."""
EDGE, CHIP_DEPTH, CHIP_REACH = (1.0, 0.245), 0.025, 0.07
"""The edge (radius, height) of the plinth that is chipped, how deep, and how far from it."""

KNOT_RADIUS, KNOT_WINDING, TUBE_RADIUS = 0.70, 0.32, 0.21
"""Of the torus the knot winds on, large and small, and of its tube."""
KNOT_POSE = Rotation.from_euler("zxz", [90, 90, 25], degrees=True).as_matrix()
"""Stands the knot up, one lobe on top, turned a little away from the camera."""


def pawn(columns: int = 512, rows: int = 400) -> ShadedMesh:
    """A turned chess pawn; u follows the turning, v runs up the profile by arc length."""
    head = arc(HEAD_RADIUS, np.linspace(0.74, 0, 12) * np.pi) + np.array([0, HEAD_CENTRE])
    return revolve(*smooth([*PAWN_PROFILE.values(), head], rows), columns)


def ball(columns: int = 384, rows: int = 400) -> ShadedMesh:
    """A ball in the cup of a plinth: its face is a flat ring around a bowl with a pearl; u follows each turning."""
    angles = np.radians([178, 166, 154, 142, 130, 118, 106, 94, 84, 78])
    face = BALL_RADIUS * np.cos(BALL_FACE)
    bowl = arc(BOWL_RADIUS, np.radians([102, 112, 122, 132, 142, 152, 161])) + np.array([0, face + 0.06])
    pearl = arc(PEARL_RADIUS, np.radians(np.arange(135, -1, -15))) + np.array([0, PEARL_CENTRE])
    profile = [(0, -BALL_RADIUS), *arc(BALL_RADIUS, angles)[1:]]
    profile += [(x * np.sin(a), x * np.cos(a)) for x, a in zip(BALL_RADIUS * SEAM[1], np.radians(SEAM[0]))]
    profile += [(rim, face + dip) for rim, dip in BALL_RIM]
    turned = revolve(*smooth([profile, bowl, pearl], rows), columns)
    turned = turned._replace(vertices=turned.vertices @ BALL_POSE.T, normals=turned.normals @ BALL_POSE.T)
    centre = np.array([0, 0, PLINTH_HEIGHT + np.sqrt((BALL_RADIUS + CUP_GAP) ** 2 - CUP_RIM**2)])
    cup = arc(BALL_RADIUS + CUP_GAP, np.radians(np.arange(144, 181, 9))) + centre[1:]
    plinth = worn(revolve(*smooth([*PLINTH_PROFILE.values(), cup], rows), columns), rows, columns)
    return together(plinth, turned._replace(vertices=turned.vertices + centre))


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


def arc(radius: float, polar: Array) -> Array:
    """Control points (N, 2) of a circle about the origin, at angles from the zenith that grow or fall evenly."""
    step = np.abs(np.diff(polar)).mean()
    # A cubic B-spline runs inside its control polygon; this radius makes it pass through the circle at every knot.
    return radius * 3 / (2 + np.cos(step)) * np.stack([np.sin(polar), np.cos(polar)], axis=1)


def smooth(pieces: Sequence[ArrayLike], rows: int) -> tuple[Array, Array]:
    """Points and tangents (rows + 1, 2) of the cubic B-spline of control points (radius, height), from axis to axis."""
    points = np.concatenate([np.asarray(piece, dtype=float) for piece in pieces])
    points[[0, -1], 0] = 0
    # Mirrored neighbours beyond both ends put the curve on the axis there, and make it cross the axis horizontally.
    mirrored = points[[1, -2]] * [-1, 1]
    points = np.concatenate([mirrored[:1], points, mirrored[1:]])
    spline = BSpline(np.arange(len(points) + 4), points, 3)
    t = np.linspace(3, len(points), rows + 1)
    return spline(t), spline(t, 1)


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


def worn(mesh: ShadedMesh, rows: int, columns: int) -> ShadedMesh:
    """A turned mesh whose edge at EDGE is chipped: pushed in and down, by up to CHIP_DEPTH."""
    position, normal = (array.reshape(rows + 1, columns + 1, -1) for array in mesh[:2])
    azimuth, edge = 2 * np.pi * np.linspace(0, 1, columns + 1), np.array(EDGE)
    waves, k = np.random.default_rng(7).normal(size=(2, 28)), np.arange(1, 29)[:, None] * azimuth
    noise = (waves[0] @ np.sin(k) + waves[1] @ np.cos(k)) / np.sqrt(28)
    chipped = np.clip((noise - 0.5) / 1.5, 0, 1) ** 1.5
    distance = np.hypot(np.hypot(position[..., 0], position[..., 1]) - edge[0], position[..., 2] - edge[1])
    depth = CHIP_DEPTH * chipped * np.clip(1 - (distance / CHIP_REACH) ** 2, 0, 1) ** 2
    inward = np.stack([np.cos(azimuth), np.sin(azimuth), np.ones_like(azimuth)], axis=-1) / np.sqrt(2)
    moved = position - depth[..., None] * inward
    along_u = np.roll(moved[:, :-1], -1, axis=1) - np.roll(moved[:, :-1], 1, axis=1)
    along_u = np.concatenate([along_u, along_u[:, :1]], axis=1)
    new = np.cross(along_u, np.gradient(moved, axis=0))
    new /= np.maximum(np.linalg.norm(new, axis=-1, keepdims=True), 1e-12)
    normal = np.where((distance < CHIP_REACH)[..., None], new, normal)
    return mesh._replace(vertices=moved.reshape(-1, 3), normals=normal.reshape(-1, 3))


def together(*meshes: ShadedMesh) -> ShadedMesh:
    """Several meshes as one."""
    start = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes)])
    faces = np.concatenate([mesh.faces + first for mesh, first in zip(meshes, start)]).astype(np.uint32)
    vertices, normals, uvs = (np.concatenate(arrays) for arrays in zip(*(mesh[:3] for mesh in meshes)))
    return ShadedMesh(vertices, normals, uvs, faces)


OBJECTS = {"pawn": pawn, "knot": knot, "sphere": sphere, "ball": ball}
