"""What the tests of meshes measure on them."""

import numpy as np
from scipy.spatial import ConvexHull


def corners(mesh):
    return np.moveaxis(mesh.vertices[mesh.faces], 1, 0)


def area_vectors(mesh):
    a, b, c = corners(mesh)
    return np.cross(b - a, c - a) / 2


def uv_edges(mesh):
    """Differences of u and of v, (faces, 3) each, of the corners of a face to its first corner."""
    u, v = np.moveaxis(mesh.uvs[mesh.faces], 2, 0)
    return u - u[:, :1], v - v[:, :1]


def uv_areas(mesh):
    u, v = uv_edges(mesh)
    return u[:, 1] * v[:, 2] - u[:, 2] * v[:, 1]


def tangents(mesh):
    """Direction of dp/du on every face, as Mitsuba derives it from positions and texture coordinates."""
    a, b, c = corners(mesh)
    _, v = uv_edges(mesh)
    dp_du = ((b - a) * v[:, 2:] - (c - a) * v[:, 1:2]) / uv_areas(mesh)[:, None]
    return dp_du / np.linalg.norm(dp_du, axis=1, keepdims=True)


def cube(turn=0.5):
    """The cube of side 2, turned about the vertical by ``turn`` radians."""
    vertices = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], dtype=float)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    c, s = np.cos(turn), np.sin(turn)
    faces = np.array([face for a, b, c, d in sides for face in ((a, b, c), (a, c, d))])
    return vertices @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]]), faces


def icosphere(splits=3):
    """A unit sphere of triangles of nearly one size, whose edges run in all directions."""
    g = (1 + 5**0.5) / 2
    vertices = np.array([[0, a, b * g] for a in (-1, 1) for b in (-1, 1)])
    vertices = np.concatenate([np.roll(vertices, k, axis=1) for k in range(3)])
    faces = ConvexHull(vertices).simplices
    for _ in range(splits):
        edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
        edges, middle = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
        ab, bc, ca = middle.reshape(3, -1) + len(vertices)
        vertices, (a, b, c) = np.concatenate([vertices, vertices[edges].mean(axis=1)]), faces.T
        faces = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (b, bc, ab), (c, ca, bc), (ab, bc, ca))])
    vertices /= np.linalg.norm(vertices, axis=1, keepdims=True)
    inward = np.linalg.det(vertices[faces]) < 0
    faces[inward] = faces[inward, ::-1]
    return vertices, faces


def cylinder(sides=48):
    """Of radius 1 and height 2, upright, with caps."""
    i, angle = np.arange(sides), np.arange(sides) * 2 * np.pi / sides
    ring = np.stack([np.cos(angle), np.sin(angle), np.ones(sides)], axis=1)
    vertices = np.concatenate([ring * [1, 1, -1], ring, [[0, 0, -1], [0, 0, 1]]])
    j, up, centre = (i + 1) % sides, sides, np.full(sides, 2 * sides)
    faces = [(i, j, j + up), (i, j + up, i + up), (j, i, centre), (i + up, j + up, centre + 1)]
    return vertices, np.concatenate([np.stack(face, axis=1) for face in faces])
