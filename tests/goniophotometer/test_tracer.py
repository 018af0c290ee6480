"""Light that facets refract: all of it is counted, and as much of it as Fresnel says."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import numpy as np
import pytest
from surfaces import FLAT, WHITE, agrees, closed, mesh_file, run, waves

from asperity.goniophotometer import HeightField, Mesh, Points, Tile, Window, measure
from asperity.lab import evaluate
from asperity.models.micrograin import ExplicitGrains

pytestmark = pytest.mark.usefixtures("rgb")
GLASS = {"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0}
ROUGH = {"type": "roughdielectric", "int_ior": 1.5, "ext_ior": 1.0, "alpha": 0.3}
ANGLES = (0, 0), (30, 20), (75, 100)
SURFACES = {
    "pane": lambda folder: HeightField(FLAT, 1, GLASS),
    "wrapped": lambda folder: HeightField(waves(), 1 / 48, GLASS),
    "mirrored": lambda folder: HeightField(waves(), 1 / 48, GLASS, "mirror"),
    "mesh": lambda folder: Mesh(mesh_file(folder / "waves.ply", closed(waves(24))), GLASS),
    "mirrors on glass": lambda folder: ExplicitGrains(0.5, 1.5, 0.7, base=GLASS),
    "mirrors on thin glass": lambda folder: ExplicitGrains(0.5, base={"type": "thindielectric"}),
}


@pytest.mark.parametrize("make", SURFACES.values(), ids=SURFACES)
def test_what_is_not_reflected_is_transmitted(tmp_path, make):
    """Nothing absorbs. A path is reflected or refracted with its whole weight: exact but for float32's rounding."""
    result = run(make(tmp_path), *ANGLES)
    assert np.allclose(result.total_albedo.value + result.transmitted.value + result.cut.value, 1, atol=1e-5)
    assert np.all(result.transmitted.value > 0.05) and result.cut.value.max() < 1e-4


def test_a_pane_obeys_fresnel():
    result = run(SURFACES["pane"](None), *ANGLES, paths=2**17)
    reflected = np.array([mi.fresnel(mi.Float(float(wi[2])), 1.5)[0][0] for wi in result.wi])[:, None]
    assert reflected[0] == pytest.approx(0.04)
    assert agrees(result.total_albedo.value, reflected, result.total_albedo.error)
    assert agrees(result.transmitted.value, 1 - reflected, result.transmitted.error)


def test_a_rough_pane_is_its_bsdf():
    """Mitsuba's weights are for radiance, which refraction into glass makes eta² larger. They lose 9 % at 75°."""
    result = run(HeightField(FLAT, 1, ROUGH), *ANGLES, paths=2**17)
    bsdf, weights = evaluate.load(ROUGH), []
    for wi in result.wi:
        drawn, weight = evaluate.sample(bsdf, mi.Vector3f(*map(float, wi)), *evaluate.variates(2**20, 1))
        up = np.array(drawn.wo.z) > 0
        weights.append((np.where(up, weight, 0).mean(axis=1), 1.5**2 * np.where(up, 0, weight).mean(axis=1)))
    # Eight times the samples have a third of the measurement's noise.
    for part, expected in zip((result.total_albedo, result.transmitted), np.moveaxis(weights, 1, 0)):
        assert agrees(part.value, expected, part.error)


class Varnish:
    """White paint under a layer of rough glass."""

    @property
    def description(self):
        return {"type": "varnish"}

    def piece(self, rng):
        sides = {
            "glass": {"type": "rectangle", "bsdf": ROUGH},
            "paint": {"type": "rectangle", "bsdf": WHITE, "to_world": mi.ScalarTransform4f().translate([0, 0, -0.1])},
        }
        return Tile(mi.load_dict({"type": "scene"} | sides), 2, 2, -0.11, 0.01)


def test_points_see_light_from_within_the_glass():
    """Next-event estimation weighs light as scattering does: the mean over a window is that of points all over it."""
    window, options = Window("normal", 30, 1), {"apart": 2, "paths": 2**18, "tiles": 16}
    cell = measure(Varnish(), [(30, 0)], sensor=window, **options).values
    x, y, z = window.grid(5)[0].T
    angles = np.degrees([np.arccos(z), np.arctan2(y, x)]).T
    points = measure(Varnish(), [(30, 0)], sensor=Points(tuple(map(tuple, angles))), **options).values
    mean, error = points.value[0, ..., 0].mean(axis=1), np.linalg.norm(points.error[0, ..., 0], axis=1) / len(angles)
    assert mean[1] > 10 * mean[0] and agrees(cell.value[0, :, 0, 0], mean, np.hypot(cell.error[0, :, 0, 0], error))
