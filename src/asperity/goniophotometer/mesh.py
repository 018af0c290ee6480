"""Surfaces of the user's own: triangle meshes and height fields, made periodic."""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable
from dataclasses import dataclass, field, fields
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import mitsuba as mi
import numpy as np

from .. import loading
from ..errors import ParameterError, UnknownNameError, readable, refuse_unused
from . import heightmap
from .periodic import Triangles, centred, normals
from .tile import Tile

MESHES = (".ply", ".obj")
PERIODIC = ("wrap", "mirror")
DIFFUSE = {"type": "diffuse"}
MARGIN = 1e-3
"""Between the surface and the top and bottom of its tile, as a share of the extent."""
STEEPEST = 100
"""Heights may span that many widths of the tile; more is a mistake about units, and too coarse for float32."""


class Triangulated:
    """What meshes and height fields have in common: triangles of one BSDF, repeated by ``periodic``."""

    bsdf: dict[str, Any]
    periodic: str
    triangles: Triangles

    def __getstate__(self) -> dict[str, Any]:
        """What makes it: not the scene, which belongs to a process and a variant, nor what else can be made again."""
        return {each.name: getattr(self, each.name) for each in fields(self)}  # type: ignore[arg-type]  # dataclasses

    @cached_property
    def overhangs(self) -> int:
        """How many faces do not look up; there are none in a height field."""
        return int(np.count_nonzero(normals(*self.triangles[:2])[:, 2] <= 0))

    def piece(self, rng: np.random.Generator) -> Tile:
        """Always the same tile, built when it is first asked for, of the variant that is then in use.

        It is scaled by a power of two, so that the unit of length cannot matter: its larger side is in [1, 2). Rays
        were seen to miss triangles with edges of 3e-10.
        """
        return self._piece

    @cached_property
    def _piece(self) -> Tile:
        vertices, faces, uv, (width, depth, height) = self.triangles
        if self.periodic == "mirror":
            vertices, faces, uv = _mirrored(self.triangles)
            width, depth = 2 * width, 2 * depth
        scale = 2.0 ** -np.floor(np.log2(max(width, depth)))
        vertices, width, depth, height = vertices * scale, width * scale, depth * scale, height * scale
        properties = mi.Properties()
        properties["face_normals"] = True
        properties["bsdf"] = _bsdf(self.bsdf)
        mesh = mi.Mesh("surface", len(vertices), len(faces), has_vertex_texcoords=True, props=properties)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = mi.Float(np.float32(vertices).ravel())
        parameters["vertex_texcoords"] = mi.Float(np.float32(uv).ravel())
        parameters["faces"] = mi.UInt32(np.uint32(faces).ravel())
        parameters.update()
        # Without robust intersections, a few in a million rays slip through an edge that they meet exactly.
        robust = {"embree_use_robust_intersections": True}
        scene = mi.load_dict({"type": "scene", "surface": mesh} | robust, parallel=False)
        top = height / 2 + MARGIN * max(width, depth, height)
        return Tile(scene, float(width), float(depth), -float(top), float(top))

    def _check(self) -> None:
        """Find mistakes early: when a geometry is described, not when light is traced."""
        if mi.variant() is None:
            raise ParameterError('variant: none is set. Call mitsuba.set_variant("llvm_ad_rgb"), say, first.')
        if self.periodic not in PERIODIC:
            raise UnknownNameError("value of periodic", self.periodic, PERIODIC)
        _bsdf(self.bsdf)
        width, depth, height = self.triangles.size
        if height > STEEPEST * max(width, depth):
            raise ParameterError(
                f"heights span {height:g}, and the tile is {width:g} x {depth:g}: expected at most {STEEPEST} times "
                "the larger side. Are heights and widths in the same unit of length?"
            )


@dataclass(frozen=True)
class Mesh(Triangulated):
    """A triangle mesh in a file, .ply or .obj, z up; its bounding box in x and y is one period.

    The mesh must cover its bounding box without holes, once, with faces that are counter-clockwise from above; it may
    overhang. Faces are flat: normals in the file are ignored, since shading normals break energy.

    Parameters
    ----------
    path : the file; any unit of length
    bsdf : of all facets, as a dictionary for ``mi.load_dict``
    periodic : ``wrap`` repeats the mesh, whose opposite borders must match; ``mirror`` reflects it at its borders, so
        that the tile is twice as wide and deep

    Raises ParameterError or UnreadableFileError, which say what is wrong and where; indices count from 0.
    """

    path: str | Path
    bsdf: dict[str, Any] = field(default_factory=DIFFUSE.copy)
    periodic: str = "wrap"
    kind: ClassVar[str] = "mesh"

    def __post_init__(self):
        readable("mesh", self.path, MESHES)
        self._check()

    @cached_property
    def description(self) -> dict[str, Any]:
        """The resolved path, the SHA-256 of the file, the BSDF and how the mesh repeats."""
        return {"type": self.kind, **_content(self.path), "periodic": self.periodic, "bsdf": _plain(self.bsdf)}

    @cached_property
    def triangles(self) -> Triangles:  # type: ignore[override]
        """What the file holds, checked; faces without any area are left out."""
        return centred(*_read(Path(self.path)), wrapped=self.periodic == "wrap")


@dataclass(frozen=True, eq=False)
class HeightField(Triangulated):
    """Heights over a grid; rows go along y and columns along x, and each cell of the grid is two triangles.

    Parameters
    ----------
    heights : (rows, columns), at least 2 x 2
    spacing : of columns and rows, (dx, dy), or one number for both; in the unit of the heights
    bsdf : of all facets, as a dictionary for ``mi.load_dict``; its textures span the given heights once
    periodic : ``wrap`` joins the last row to the first and the last column to the first, so that the tile is
        columns · dx x rows · dy; ``mirror`` reflects the field at its outermost rows and columns, so that it is
        2 (columns - 1) dx x 2 (rows - 1) dy
    source : where the heights come from, for the description
    level : take the plane nearest to the heights away, by least squares

    Raises ParameterError for what is out of range, for masked heights, and where the borders of a ``wrap`` are a cliff
    among the steps of the map (`heightmap.cliff`).
    """

    heights: np.ndarray
    spacing: tuple[float, float] | float
    bsdf: dict[str, Any] = field(default_factory=DIFFUSE.copy)
    periodic: str = "wrap"
    source: Any = None
    level: bool = False
    kind: ClassVar[str] = "height field"

    def __post_init__(self):
        object.__setattr__(self, "heights", heightmap.checked(self.heights))
        object.__setattr__(self, "spacing", _spacing(self.spacing))
        if not isinstance(self.level, bool):
            raise ParameterError(f"level = {self.level!r}: expected True or False.")
        self._check()
        if self.periodic == "wrap":
            heightmap.check_borders(self.surface, self.spacing)

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self.heights.setflags(write=False)  # a copy forgets

    @staticmethod
    def load(
        path: str | Path,
        spacing: tuple[float, float] | float,
        scale: float = 1.0,
        bsdf: dict[str, Any] = DIFFUSE,
        periodic: str = "wrap",
        level: bool = False,
        channel: str | None = None,
    ) -> HeightField:
        """Read heights from an array, .npy, or from a channel of an image, .png or .exr.

        ``scale`` multiplies what the file holds. In a .png that is 0 to 1, proportional to the stored whole numbers:
        nothing is taken for sRGB. An image's first row, its upper one, is the row of lowest y. An image whose channels
        differ needs the name of the ``channel``.
        """
        if not np.isfinite(scale):
            raise ParameterError(f"scale = {scale}: expected a finite number.")
        values = heightmap.checked(heightmap.read(path, channel)) * scale
        source = _content(path) | {"scale": scale} | ({} if channel is None else {"channel": channel})
        return HeightField(values, spacing, bsdf, periodic, source, level)

    @cached_property
    def surface(self) -> np.ndarray:
        """The heights, levelled if that is asked for."""
        return heightmap.levelled(self.heights, self.spacing) if self.level else self.heights  # type: ignore[arg-type]

    @property
    def account(self) -> str:
        """In a line, how the heights were made a surface without end."""
        rows, columns = self.heights.shape
        plane = ""
        if self.level:
            a, b = heightmap.slopes(self.heights, self.spacing)  # type: ignore[arg-type]
            plane = f"the plane of slopes {a:.3g} and {b:.3g} in x and y taken away, "
        return f"{rows} x {columns} heights, {plane}{'repeated' if self.periodic == 'wrap' else 'mirrored'}"

    @cached_property
    def description(self) -> dict[str, Any]:
        """Shape and SHA-256 of the heights (float64, row by row), spacing, BSDF, how they repeat, and the source.

        That they are levelled is said only if they are: so files of former versions go on.
        """
        return {
            "type": self.kind,
            "shape": list(self.heights.shape),
            "sha256": hashlib.sha256(self.heights.tobytes()).hexdigest(),
            "spacing": _plain(self.spacing),
            "periodic": self.periodic,
            "bsdf": _plain(self.bsdf),
            "source": _plain(self.source),
        } | ({"level": True} if self.level else {})

    @cached_property
    def triangles(self) -> Triangles:  # type: ignore[override]
        """The grid; if it wraps, with the first row and column once more at its end."""
        z = np.pad(self.surface, (0, 1), mode="wrap") if self.periodic == "wrap" else self.surface
        rows, columns = z.shape
        step = np.asarray(self.spacing)
        size = np.array([*(step * (columns - 1, rows - 1)), np.ptp(z)])
        u, v = np.meshgrid(np.linspace(0, 1, columns), np.linspace(0, 1, rows))
        uv = np.stack([u, v], axis=-1).reshape(-1, 2)
        vertices = np.c_[(uv - 0.5) * size[:2], z.ravel() - (z.min() + size[2] / 2)]
        corner = np.arange(rows * columns).reshape(rows, columns)[:-1, :-1].reshape(-1, 1)
        here, right, back, across = corner, corner + 1, corner + columns, corner + columns + 1
        return Triangles(vertices, np.c_[here, right, across, here, across, back].reshape(-1, 3), uv, size)


FROM_FILE: dict[str, Callable[..., Mesh | HeightField]] = {"mesh": Mesh, "heightfield": HeightField.load}
"""What makes a surface of a file, by the kind of surface."""


def from_file(kind: str, path: str | Path, **options: Any) -> Mesh | HeightField:
    """The surface in a file, by its kind: ``mesh`` or ``heightfield``.

    ``options`` are those of `Mesh` or `HeightField.load`; None is the default. Raises ParameterError for one that this
    kind does not have, and UnknownNameError for another kind.
    """
    if kind not in FROM_FILE:
        raise UnknownNameError("kind of surface", kind, FROM_FILE)
    refuse_unused(options, inspect.signature(FROM_FILE[kind]).parameters, f"a {kind}")
    given = {option: value for option, value in options.items() if value is not None}
    if kind == "heightfield" and "spacing" not in given:
        raise ParameterError("spacing: a height field needs the distance between its samples.")
    return FROM_FILE[kind](path, **given)


def _bsdf(description: dict[str, Any]) -> Any:
    """The BSDF; Mitsuba's complaints become ours."""
    try:
        bsdf = loading.load(description)
    except Exception as error:  # plugins in Python raise whatever they like
        raise ParameterError(f"bsdf = {description}: {error}") from error
    if not isinstance(bsdf, mi.BSDF):
        raise ParameterError(f"bsdf = {description}: expected a BSDF, and Mitsuba makes a {type(bsdf).__name__} of it.")
    return bsdf


def _plain(value: Any) -> Any:
    """What JSON makes of a value."""
    return json.loads(json.dumps(value, default=str))


def _content(path: str | Path) -> dict[str, Any]:
    """What identifies a file."""
    path = Path(path).resolve()
    return {"path": str(path), "sha256": hashlib.sha256(path.read_bytes()).hexdigest()}


def _mirrored(quarter: Triangles) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices, faces and texture coordinates of a mesh and its reflections, 2 x 2; the seams are the axes, exactly."""
    inner = quarter.vertices - [*quarter.size[:2] / 2, 0]
    signs = [(1, 1), (-1, 1), (1, -1), (-1, -1)]
    vertices = np.concatenate([inner * (x, y, 1) for x, y in signs])
    # A reflection turns faces upside down, unless they are turned as well.
    faces = [quarter.faces[:, :: x * y] + k * len(inner) for k, (x, y) in enumerate(signs)]
    return vertices, np.concatenate(faces), np.tile(quarter.uv, (4, 1))


def _spacing(given: Any) -> tuple[float, float]:
    """Along x and y."""
    try:
        dx, dy = (float(x) for x in np.broadcast_to(given, 2))
    except (TypeError, ValueError) as error:
        raise ParameterError(f"spacing = {given!r}: expected a number, or two of them, (dx, dy).") from error
    if not (0 < dx < np.inf and 0 < dy < np.inf):
        raise ParameterError(f"spacing = {given!r}: expected finite numbers above 0.")
    return dx, dy


def _read(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    """Vertices (n, 3), faces (m, 3) and texture coordinates (n, 2), if there are any, of a mesh that has some."""
    mesh = loading.mesh(path, face_normals=True)
    parameters = mi.traverse(mesh)
    faces = np.array(parameters["faces"], dtype=np.int64).reshape(-1, 3)
    vertices = np.array(parameters["vertex_positions"], dtype=np.float64).reshape(-1, 3)
    uv = np.array(parameters["vertex_texcoords"]).reshape(-1, 2) if mesh.has_vertex_texcoords() else None
    return vertices, faces, uv
