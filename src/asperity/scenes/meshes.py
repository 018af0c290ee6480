"""Triangle meshes to show a material on: arrays of them, the user's files, and what those files leave out."""

from __future__ import annotations

import re
import warnings
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from asperity import loading
from asperity.errors import ParameterError, UnreadableFileError, readable

FORMATS = (".ply", ".obj", ".serialized")
BUFFERS = ("vertex_positions", "vertex_normals", "vertex_texcoords")
"""Names under which Mitsuba keeps what `ShadedMesh` names first."""
FITTED_SIZE = 2.2
"""Longest edge of the bounding box of a user's object, in scene units."""
CREASE = 40.0
"""Angle between faces, in degrees: an icosahedron's (42), a cube's or a cylinder's rim is an edge; coarse spheres are
smooth."""
STAR_SHAPED = 0.3
"""Cosine between a face's normal and its direction from the centre, above which spherical coordinates suit it."""

Array = NDArray[np.float64]


class ShadedMesh(NamedTuple):
    """Arrays (N, 3), (N, 3), (N, 2), and vertex indices (M, 3) of triangles, counterclockwise seen from outside.

    ``attributes`` are more arrays of one row a vertex or face, as ``vertex_...`` and ``face_...``.
    """

    vertices: Array
    normals: Array
    uvs: Array
    faces: NDArray[np.uint32]
    attributes: Mapping[str, Array] = MappingProxyType({})


def to_mitsuba(mesh: ShadedMesh, bsdf: dict[str, Any] | mi.BSDF) -> mi.Mesh:
    """The mesh as a shape of the current variant."""
    properties = mi.Properties()
    properties["mesh_bsdf"] = loading.load(bsdf) if isinstance(bsdf, dict) else bsdf
    shape = mi.Mesh(
        "object",
        vertex_count=len(mesh.vertices),
        face_count=len(mesh.faces),
        has_vertex_normals=True,
        has_vertex_texcoords=True,
        props=properties,
    )
    parameters = mi.traverse(shape)
    arrays: dict[str, Any] = dict(zip((*BUFFERS, "faces"), mesh[:4]))
    for name, array in arrays.items():
        buffer = type(parameters[name])  # differs between the variants
        parameters[name] = buffer(array.ravel())
    parameters.update()
    for name, array in mesh.attributes.items():
        shape.add_attribute(name, array.shape[1], type(parameters["vertex_positions"])(array.ravel()))
    return shape


def from_file(path: str | Path, crease: float | None = None) -> ShadedMesh:
    """A user's object (z up), scaled to the preview, centred, and standing on z = 0.

    Normals and texture coordinates in the file are kept. Where there are no normals, faces that meet at up to CREASE
    degrees are smoothed, and others get an edge; a ``crease`` makes normals in any case. Where there are no texture
    coordinates, they are projected. A warning says what was made.
    """
    path = readable("object", path, FORMATS)
    if crease is not None and not 0 <= crease <= 180:
        raise ParameterError(f"crease = {crease}: expected an angle in [0, 180] degrees.")
    content = _read(path)
    if crease is not None:
        content = content._replace(normals=None)
    mesh, made = completed(content, CREASE if crease is None else crease)
    if made:
        warnings.warn(f"{path.name} got {' and '.join(made)}.", stacklevel=2)
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    foot = np.array([*(low + high)[:2] / 2, low[2]])
    return mesh._replace(vertices=(mesh.vertices - foot) * (FITTED_SIZE / (high - low).max()))


def turned(mesh: ShadedMesh, degrees: float) -> ShadedMesh:
    """The mesh, turned counterclockwise about the z axis."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    return mesh._replace(vertices=mesh.vertices @ turn, normals=mesh.normals @ turn)


class Content(NamedTuple):
    """What a file holds: as a `ShadedMesh`, but None for what it lacks; faces without area are left out."""

    vertices: Array
    normals: Array | None
    uvs: Array | None
    faces: NDArray[np.uint32]
    attributes: Mapping[str, Array]


def completed(content: Content, crease: float) -> tuple[ShadedMesh, list[str]]:
    """The mesh with what the content lacks, and what was made, in words."""
    vertices, normals, uvs, faces, attributes = content
    if normals is not None and uvs is not None:
        return ShadedMesh(vertices, normals, uvs, faces, attributes), []
    made, corners = [], faces.ravel()  # every corner gets a vertex of its own
    new_normals, smooth = creased(vertices, faces, crease)
    if normals is None:
        made.append(f"normals, smooth where faces meet at up to {crease:g} degrees (--crease)")
    if uvs is None:
        new_uvs, how = projected(vertices, faces, smooth)
        made.append(f"texture coordinates, {how}")
    attributes = {name: x[corners] if name.startswith("vertex_") else x for name, x in attributes.items()}
    mesh = ShadedMesh(
        vertices[corners],
        new_normals if normals is None else normals[corners],
        new_uvs if uvs is None else uvs[corners],
        np.arange(len(corners), dtype=np.uint32).reshape(-1, 3),
        attributes,
    )
    return mesh, made


def _read(path: Path) -> Content:
    shape = loading.mesh(path)
    found = mi.traverse(shape)
    vertices, normals, uvs = (np.array(found[name], dtype=float).reshape(shape.vertex_count(), -1) for name in BUFFERS)
    faces = np.array(found["faces"], dtype=np.uint32).reshape(-1, 3)
    seen = np.linalg.norm(area_vectors(vertices, faces), axis=1) > 0
    if not seen.any():
        raise UnreadableFileError("object", path, FORMATS, "it has no extent")
    attributes = {}
    for name, value in found.items():
        if name.startswith(("vertex_", "face_")) and name not in BUFFERS:
            rows = np.array(value, dtype=float).reshape(len(vertices) if name.startswith("vertex_") else len(faces), -1)
            attributes[name] = rows if name.startswith("vertex_") else rows[seen]
    own_normals, own_uvs = normals if _has_normals(path) else None, uvs if uvs.size else None
    return Content(vertices, own_normals, own_uvs, faces[seen], attributes)


def _has_normals(path: Path) -> bool:
    """Whether a file brings normals; where it does not, Mitsuba makes some, and does not tell."""
    if path.suffix.lower() == ".serialized":
        return loading.serialized_flags(path.read_bytes()) & 1 == 1
    with path.open("rb") as file:
        if path.suffix.lower() == ".obj":
            return any(line.startswith(b"vn") for line in file)
        header = file.read(1 << 16).partition(b"end_header")[0]
        return re.search(rb"\sproperty \w+ nx\s", header) is not None


def area_vectors(vertices: Array, faces: NDArray[np.uint32]) -> Array:
    """Normals (M, 3) of faces, as long as their area."""
    a, b, c = np.moveaxis(vertices[faces], 1, 0)
    return np.cross(b - a, c - a) / 2


def creased(vertices: Array, faces: NDArray[np.uint32], degrees: float) -> tuple[Array, bool]:
    """Normals (3 M, 3) of all corners of the faces, and whether no edge is sharp.

    Around a vertex, faces are smoothed together if they are neighbours that meet at up to ``degrees``, or are
    connected by such ones; the mean is weighted by their angles there (Thürmer and Wüthrich 1998).
    """
    _, welded = np.unique(vertices, axis=0, return_inverse=True)  # files repeat vertices at seams of texture
    start = welded.reshape(-1)[faces]
    end = np.roll(start, -1, axis=1)
    normals = area_vectors(vertices, faces)
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)

    # Edge i of a face runs from its corner i to the next one; both faces at an edge have it, in opposite directions.
    edge = (np.minimum(start, end).astype(np.int64) * len(vertices) + np.maximum(start, end)).ravel()
    order = np.argsort(edge, kind="stable")
    one, other = order[:-1], order[1:]
    met = (edge[one] == edge[other]) & (start.ravel()[one] == end.ravel()[other])
    one, other = one[met], other[met]
    smooth = np.einsum("ei,ei->e", normals[one // 3], normals[other // 3]) >= np.cos(np.radians(degrees)) - 1e-6
    following = np.arange(start.size).reshape(-1, 3)[:, [1, 2, 0]].ravel()
    joined = np.concatenate([[one[smooth], following[other[smooth]]], [following[one[smooth]], other[smooth]]], axis=1)
    graph = coo_array((np.ones(joined.shape[1], dtype=bool), joined), shape=(start.size, start.size))
    group = connected_components(graph, directed=False)[1]

    corners = vertices[faces]
    to_next, to_last = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    sine = np.linalg.norm(np.cross(to_next, to_last), axis=2)
    angle = np.arctan2(sine, np.einsum("fci,fci->fc", to_next, to_last))
    weighted = (angle[..., None] * normals[:, None]).reshape(-1, 3)
    sums = np.stack([np.bincount(group, weights=column) for column in weighted.T], axis=1)
    length = np.linalg.norm(sums, axis=1, keepdims=True)
    flat = np.repeat(normals, 3, axis=0)
    return np.where(length[group] > 1e-6, (sums / np.maximum(length, 1e-6))[group], flat), bool(smooth.all())


def projected(vertices: Array, faces: NDArray[np.uint32], smooth: bool) -> tuple[Array, str]:
    """Texture coordinates (3 M, 2) of all corners of the faces, and what was done, in words.

    A smooth body that is seen from its centre gets spherical ones: u along the parallels, v up the meridians. All
    else is projected from the sides of its box: u runs horizontally, counterclockwise seen from above, v up; on top
    they follow x and y. So dp/du, which brushed materials follow, is continuous around a sphere and a cylinder.
    The whole height is one unit of v; one of u is twice as long, as it is on the objects of the preview.
    """
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    corners = vertices[faces] - (low + high) / 2
    normals = area_vectors(vertices, faces)
    normals = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    middle = corners.mean(axis=1)
    outward = np.einsum("fi,fi->f", normals, middle) > STAR_SHAPED * np.linalg.norm(middle, axis=1)
    if smooth and outward.all():
        return _spherical(corners, middle).reshape(-1, 2), "spherical"
    # Rounding shall not decide where a face is as much to the side as to the front.
    axis = np.argmax(np.abs(normals).round(6), axis=1)
    side = np.sign(normals[np.arange(len(faces)), axis])[:, None]
    x, y, z = np.moveaxis(corners, 2, 0)
    u = np.choose(axis[:, None], [side * y, -side * x, x])
    v = np.choose(axis[:, None], [z, z, side * y])
    return (np.stack([u / 2, v], axis=-1) / (high - low).max() + 0.5).reshape(-1, 2), "projected from a box"


def _spherical(corners: Array, middle: Array) -> Array:
    """Texture coordinates (M, 3, 2) of corners (M, 3, 3) seen from the origin; ``middle`` is that of the faces."""
    radius = np.hypot(corners[..., 0], corners[..., 1])
    u = np.arctan2(corners[..., 1], corners[..., 0]) / (2 * np.pi)
    own = np.arctan2(middle[:, 1], middle[:, 0])[:, None] / (2 * np.pi)
    u = own + (u - own + 0.5) % 1 - 0.5  # the seam is between faces
    at_pole = radius < 1e-6 * np.linalg.norm(corners, axis=-1)
    return np.stack([np.where(at_pole, own, u), np.arctan2(radius, -corners[..., 2]) / np.pi], axis=-1)
