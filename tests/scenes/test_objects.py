import numpy as np
import pytest
from geometry import area_vectors, corners, tangents, uv_areas
from scipy.spatial.transform import Rotation

from asperity.scenes.objects import BALL_POSE, BALL_RADIUS, OBJECTS, ball, knot, pawn, sphere


@pytest.fixture(params=OBJECTS)
def mesh(request):
    return OBJECTS[request.param]()


def test_normals_are_of_unit_length_and_on_the_outside_of_their_faces(mesh):
    assert np.allclose(np.linalg.norm(mesh.normals, axis=1), 1)
    faces = area_vectors(mesh)
    faces /= np.linalg.norm(faces, axis=1, keepdims=True)
    # The tightest bend, at the foot of the pawn, turns by less than 18 degrees within a face.
    assert np.einsum("fi,fvi->fv", faces, mesh.normals[mesh.faces]).min() > np.cos(np.radians(18))


def test_no_face_is_degenerate_in_space_or_in_texture(mesh):
    assert np.linalg.norm(area_vectors(mesh), axis=1).min() > 1e-9
    assert uv_areas(mesh).min() > 1e-9


def test_stands_on_the_ground_and_fits_the_picture(mesh):
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    assert low[2] == pytest.approx(0, abs=1e-9)
    assert 1.9 < high[2] < 2.5
    assert np.abs([low[:2], high[:2]]).max() < 1.2


@pytest.mark.parametrize("mesh", [pawn(24, 90), sphere(24, 12), knot(90, 12), ball(96, 240)])
def test_is_closed_and_faces_outwards(mesh):
    _, welded = np.unique(mesh.vertices.round(7) + 0.0, axis=0, return_inverse=True)
    faces = welded.ravel()[mesh.faces]
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    directed = set(map(tuple, edges))
    assert len(directed) == len(edges), "an edge is passed twice in one direction"
    assert directed == {(b, a) for a, b in directed}, "an edge has a face on one side only"
    a, b, c = corners(mesh)
    assert np.einsum("fi,fi->f", a, np.cross(b, c)).sum() > 0


@pytest.mark.parametrize("turned", [pawn(), sphere()])
def test_u_follows_the_turning(turned):
    a, b, c = corners(turned)
    x, y, _ = ((a + b + c) / 3).T
    around = np.stack([-y, x, np.zeros_like(x)], axis=1) / np.hypot(x, y)[:, None]
    assert np.einsum("fi,fi->f", tangents(turned), around).min() > 0.9999


def test_the_pawn_has_parts_that_catch_dust_and_parts_that_hide_from_it():
    mesh = pawn()
    foot, collar = mesh.vertices[:, 2] < 0.5, abs(mesh.vertices[:, 2] - 1.41) < 0.06
    assert mesh.normals[foot, 2].max() > 0.9
    assert mesh.normals[collar, 2].max() > 0.95
    assert mesh.normals[collar, 2].min() < -0.9


def test_the_ball_has_flat_hollow_and_round_parts_and_a_chipped_edge():
    mesh = ball()
    face = Rotation.from_matrix(BALL_POSE).apply([0, 0, 1])
    flat = np.einsum("vi,i->v", mesh.normals, face) > 0.99999
    height = mesh.vertices[flat] @ face
    assert flat.sum() > 5_000 and np.quantile(height, 0.9) - np.quantile(height, 0.1) < 1e-3, "the flat ring"
    upper = mesh.vertices[:, 2] > 0.6
    centre = np.array([0, 0, mesh.vertices[upper, 2].max() - BALL_RADIUS])
    outward = np.einsum("vi,vi->v", mesh.normals, mesh.vertices - centre)
    assert (outward[upper] < -0.1).mean() > 0.02, "the bowl faces its own middle"
    rim = np.abs(mesh.vertices[:, 2] - 0.24) < 0.004
    radius = np.hypot(*mesh.vertices[rim, :2].T)
    assert radius.max() == pytest.approx(1.0, abs=0.01) and radius.min() < 0.985, "chips"


def test_u_of_the_plinth_follows_its_turning():
    mesh = ball()
    below = mesh.vertices[mesh.faces][..., 2].max(axis=1) < 0.17  # below the chips
    a, b, c = corners(mesh)
    x, y, _ = ((a + b + c) / 3)[below].T
    around = np.stack([-y, x, np.zeros_like(x)], axis=1) / np.hypot(x, y)[:, None]
    assert np.einsum("fi,fi->f", tangents(mesh)[below], around).min() > 0.9999
