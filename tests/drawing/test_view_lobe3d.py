"""The lobe in space."""

from known import GOLD, lambertian  # isort: skip
import numpy as np
import pytest
from mpl_toolkits.mplot3d import Axes3D

from asperity.drawing import lobe3d, plot
from asperity.goniophotometer.sensors import directions


@pytest.fixture
def surfaces(monkeypatch):
    """The points (3, rings, sectors) of surfaces as they are drawn."""
    found, draw = [], Axes3D.plot_surface

    def record(self, *points, **look):
        found.append(np.stack(points))
        return draw(self, *points, **look)

    monkeypatch.setattr(Axes3D, "plot_surface", record)
    return found


def test_a_lambertian_is_a_sphere_on_the_surface(rgb, surfaces):
    plot([lambertian()], "lobe3d")
    x, y, z = surfaces[0].reshape(3, -1)
    assert x**2 + y**2 + (z - 0.5) ** 2 == pytest.approx(np.full(len(x), 0.25), abs=1e-6)


def test_gold_points_to_the_mirrored_direction(rgb, surfaces):
    """For each of two angles of incidence, a surface."""
    plot([GOLD], "lobe3d", theta=(20, 45), phi=30)
    for points, theta in zip(surfaces, (20, 45)):
        points = points.reshape(3, -1)
        tip = points[:, np.linalg.norm(points, axis=0).argmax()]
        assert tip == pytest.approx(directions([(theta, 210)])[0], abs=0.03)


def test_the_mesh_is_fine_where_a_mirror_sends_light():
    """And reaches all azimuths: within half a step there, and three degrees elsewhere."""
    for azimuth, step in ((250, lobe3d.FINE), (70, lobe3d.STEP)):
        cosine = (lobe3d.mesh(40, 70) @ directions([(40, azimuth)])[0]).max()
        assert np.degrees(np.arccos(min(cosine, 1))) <= step / 2 + 1e-3
    points = np.sort((lobe3d.mesh(40, 70) @ directions([(40, 250)])[0]).ravel())
    assert (np.degrees(np.arccos(np.clip(points, -1, 1))) < 5).sum() > 100
