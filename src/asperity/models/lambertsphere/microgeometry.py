"""Lambertian spheres, as a random walk between them and as spheres one can hit: the ground truth of the model."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from ...errors import ParameterError
from ...goniophotometer.medium import SparseMedium
from ...goniophotometer.tile import Tile
from .transport import root


class Sphere:
    """A Lambertian sphere far away, as a particle of a `SparseMedium`; ``albedo`` is a spectrum.

    Nothing of the model's is used: light meets a disc that faces it, evenly, and leaves the sphere there by the cosine.
    """

    def __init__(self, albedo: Any):
        self.albedo = mi.UnpolarizedSpectrum(albedo)

    def flags(self) -> int:
        """None of a BSDF's."""
        return 0

    def sample(self, ctx: Any, si: Any, sample1: mi.Float, sample2: mi.Point2f, active: Any) -> tuple[Any, Any]:
        """Another direction, in a frame whose z is the direction of flight."""
        # Four numbers are needed: the coarse and the fine part of one serve as two.
        coarse = dr.floor(sample1 * 2048)
        square = (coarse + 0.5) / 2048  # of the distance from the middle of the disc
        normal = mi.Vector3f(dr.sqrt(square), 0, -dr.sqrt(1 - square))
        w = mi.Frame3f(normal).to_world(mi.warp.square_to_cosine_hemisphere(sample2))
        sin, cos = dr.sincos(2 * dr.pi * (sample1 * 2048 - coarse))
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.Vector3f(cos * w.x - sin * w.y, sin * w.x + cos * w.y, w.z)
        return bs, self.albedo

    def eval(self, ctx: Any, si: Any, wo: mi.Vector3f, active: Any) -> Any:
        """Albedo times the phase function (d'Eon 2021, Eq. 1)."""
        u = dr.clip(wo.z, -1, 1)
        return self.albedo * (2 / (3 * dr.square(dr.pi)) * (dr.safe_sqrt(1 - u * u) - u * dr.safe_acos(u)))


@dataclass(frozen=True)
class RandomWalk:
    """A half space of Lambertian spheres of this albedo, infinitely far apart: what the model models.

    The walk is endless for albedo 1: more than half a percent of the light is left after 10 000 scatterings.
    """

    albedo: float | tuple[float, float, float] = 0.8

    def __post_init__(self) -> None:
        _check_albedo(self.albedo)

    @classmethod
    def of(cls, model: dict[str, Any], given: set[str]) -> RandomWalk:
        """The half space that a ``lambertsphere`` BSDF models; of its parameters the scene has ``given`` some."""
        name = "albedo" if "albedo" in given else "reflectance"
        colour = model[name]
        if isinstance(colour, dict) and colour.get("type") == "rgb":
            colour = colour["value"]
        values = np.atleast_1d(colour)
        if values.dtype.kind not in "fi":
            raise ParameterError(f"{name} = {model[name]!r}: not simulated; give one number, or an RGB colour.")
        if name == "reflectance":
            values = np.array([1 - root(float(value)) ** 2 for value in values])
        first, *others = map(float, values)
        return cls((first, *others) if others else first)  # type: ignore[arg-type]  # three of them, as is checked

    @property
    def description(self) -> dict[str, Any]:
        """All of it."""
        return {"type": "random walk"} | asdict(self)

    def piece(self, rng: np.random.Generator) -> SparseMedium:
        """Always the same: the places of the spheres are drawn with the rays."""
        return SparseMedium(Sphere(self.albedo))


@dataclass(frozen=True)
class ExplicitSpheres:
    """Lambertian spheres of radius 1 at independent places in a slab; they may overlap.

    ``fraction`` is the share of the slab's volume that they fill, but for overlaps; ``depth`` and ``width`` are in mean
    free paths, 4 / (3 fraction).
    """

    albedo: float | tuple[float, float, float] = 0.8
    fraction: float = 0.07
    depth: float = 12.0
    width: float = 6.0

    def __post_init__(self) -> None:
        _check_albedo(self.albedo)
        for name, high in (("fraction", 0.5), ("depth", 100), ("width", 100)):
            if not 0 < getattr(self, name) <= high:
                raise ParameterError(f"{name} = {getattr(self, name)}: expected a number in (0, {high}].")

    @property
    def description(self) -> dict[str, Any]:
        """All of it."""
        return {"type": "spheres"} | asdict(self)

    def piece(self, rng: np.random.Generator) -> Tile:
        """A slab with spheres of its own."""
        path = 4 / (3 * self.fraction)
        width, depth = self.width * path, self.depth * path
        count = rng.poisson(self.fraction * width**2 * depth / (4 / 3 * np.pi))
        centres = rng.uniform([-width / 2, -width / 2, -depth], [width / 2, width / 2, 0], (count, 3))
        centres = np.concatenate([centres + np.array([i, j, 0]) * width for i in (-1, 0, 1) for j in (-1, 0, 1)])
        centres = centres[np.all(np.abs(centres[:, :2]) < width / 2 + 1, axis=1)]
        reflectance = (
            self.albedo if isinstance(self.albedo, int | float) else {"type": "rgb", "value": list(self.albedo)}
        )
        spheres = sphere_cloud(centres) | {"bsdf": {"type": "diffuse", "reflectance": reflectance}}
        scene = mi.load_dict({"type": "scene", "spheres": spheres}, parallel=False)
        return Tile(scene, width, width, -depth - 1.001, 1.001, True)


def sphere_cloud(centres: np.ndarray) -> dict[str, Any]:
    """A shape: spheres of radius 1 about ``centres`` (n, 3)."""
    n = len(centres)
    return {
        "type": "ellipsoids",
        "centers": mi.TensorXf(np.float32(centres)),
        "scales": mi.TensorXf(np.ones((n, 3), dtype=np.float32)),
        "quaternions": mi.TensorXf(np.tile(np.array([0, 0, 0, 1], dtype=np.float32), (n, 1))),
        "extent": 1.0,
        "extent_adaptive_clamping": False,
    }


def _check_albedo(albedo: Any) -> None:
    values = np.atleast_1d(albedo)
    if not (values.dtype.kind in "fi" and values.shape in ((1,), (3,)) and np.all((values >= 0) & (values <= 1))):
        raise ParameterError(f"albedo = {albedo!r}: expected one number in [0, 1], or three.")
