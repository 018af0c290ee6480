"""Meshes of the user's: what their files hold is kept, and what they lack is made."""

import asperity  # noqa: F401  isort: skip
import warnings

import mitsuba as mi
import numpy as np
import pytest
from geometry import area_vectors, cube, cylinder, icosphere, tangents, uv_areas

from asperity.errors import ParameterError, UnreadableFileError
from asperity.scenes.meshes import from_file, to_mitsuba
from asperity.scenes.objects import sphere
from asperity.scenes.preview import preview

pytestmark = pytest.mark.usefixtures("rgb")

GREY = {"type": "diffuse"}


def written(path, vertices, faces, normals=None, uvs=None):
    """An OBJ file, its corners as ``v``, ``v/vt``, ``v//vn`` or ``v/vt/vn``."""
    rows = [("v", vertices), ("vt", () if uvs is None else uvs), ("vn", () if normals is None else normals)]
    lines = [" ".join([name, *map(repr, map(float, row))]) for name, table in rows for row in table]
    end = {(0, 0): "", (1, 0): "/{0}", (0, 1): "//{0}", (1, 1): "/{0}/{0}"}[uvs is not None, normals is not None]
    lines += ["f " + " ".join(f"{i}{end.format(i)}" for i in face) for face in np.array(faces) + 1]
    path.write_text("\n".join(lines) + "\n")
    return path


def read(path, words, **options):
    with pytest.warns(UserWarning, match=words):
        return from_file(path, **options)


def unit(vectors):
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


@pytest.fixture(params=["welded", "soup"])
def bare(request, tmp_path):
    """Writes a mesh without normals and texture coordinates; a soup has three vertices of its own for every face."""

    def write(vertices, faces):
        if request.param == "soup":
            vertices, faces = vertices[faces].reshape(-1, 3), np.arange(faces.size).reshape(-1, 3)
        return written(tmp_path / "mesh.obj", vertices, faces)

    return write


BOTH = r"mesh.obj got normals, smooth .* up to 40 degrees .* and texture coordinates, projected from a box\.$"


def test_a_cube_gets_flat_sides_and_one_direction_on_each(bare):
    mesh = read(bare(*cube()), BOTH)
    flat = unit(area_vectors(mesh))
    assert np.allclose(mesh.normals[mesh.faces], flat[:, None], atol=1e-6)
    along = tangents(mesh)
    sides = abs(flat[:, 2]) < 0.5
    assert np.allclose(along[sides], unit(np.cross([0, 0, 1], flat[sides])), atol=1e-5), "not counterclockwise"
    assert np.allclose(along[~sides], [1, 0, 0], atol=1e-5)


def test_a_sphere_becomes_smooth_with_u_along_the_parallels(bare):
    mesh = read(bare(*icosphere()), "texture coordinates, spherical")
    centred = mesh.vertices - [0, 0, 1.1]
    # Normals of the facets around a vertex lean a little to where the facets are larger.
    assert np.einsum("vi,vi->v", mesh.normals, unit(centred)).min() > np.cos(np.radians(1))
    middle = centred[mesh.faces].mean(axis=1)
    away = np.hypot(*middle[:, :2].T) > 0.15  # at a pole there is no such direction
    around = unit(np.cross([0, 0, 1], middle[away]))
    # A facet is flat, and as wide as 9 degrees; its own azimuth is that of its middle.
    assert np.einsum("fi,fi->f", tangents(mesh)[away], around).min() > np.cos(np.radians(15))


def test_a_cylinder_is_smooth_around_and_sharp_at_its_rims(bare):
    mesh = read(bare(*cylinder()), BOTH)
    flat = unit(area_vectors(mesh))
    caps = abs(flat[:, 2]) > 0.5
    normals, positions = mesh.normals[mesh.faces], mesh.vertices[mesh.faces]
    assert np.allclose(normals[caps], flat[caps, None], atol=1e-6)
    radial = positions[~caps] * [1, 1, 0]
    assert np.allclose(normals[~caps], unit(radial), atol=1e-5)
    assert np.allclose(tangents(mesh)[~caps], unit(np.cross([0, 0, 1], flat[~caps])), atol=1e-5)


@pytest.mark.parametrize("shape", [cube, icosphere, cylinder])
def test_texture_is_nowhere_mirrored_or_degenerate(bare, shape):
    assert uv_areas(read(bare(*shape()), "texture")).min() > 1e-6


@pytest.mark.parametrize(("crease", "smooth"), [(89, False), (91, True), (0, False), (180, True)])
def test_the_crease_decides_what_is_an_edge(bare, crease, smooth):
    mesh = read(bare(*cube()), f"up to {crease} degrees", crease=crease)
    lean = np.einsum("fci,fi->fc", mesh.normals[mesh.faces], unit(area_vectors(mesh)))
    # All corners are alike: weights by angle make the normal of each the diagonal.
    assert np.allclose(lean, 1 / np.sqrt(3) if smooth else 1, atol=1e-5)


def test_a_file_with_everything_is_used_unchanged(tmp_path):
    mesh = sphere(16, 8)
    to_mitsuba(mesh, GREY).write_ply(str(path := tmp_path / "sphere.ply"))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        found = from_file(path)
    assert np.allclose(mesh.vertices * 1.1, found.vertices, atol=1e-6)  # from 2 units to 2.2
    for given, kept in zip(mesh[1:4], found[1:4]):
        assert np.allclose(given, kept, atol=1e-6)
    with pytest.warns(UserWarning, match="normals, smooth .* 0 degrees"):
        assert not np.allclose(from_file(path, crease=0).normals[0], found.normals[0], atol=1e-3)


@pytest.mark.parametrize("has", ["normals", "uvs"])
def test_half_of_what_is_needed_is_kept(tmp_path, has):
    vertices, faces = icosphere(1)
    own = unit(np.random.default_rng(1).normal(size=vertices.shape))
    own = {"normals": own, "uvs": own[:, :2]}[has]
    lacking = {"normals": "^x.obj got texture", "uvs": "^x.obj got normals, [^,]*$"}[has]
    mesh = read(written(tmp_path / "x.obj", vertices, faces, **{has: own}), lacking)
    found = getattr(mesh, has)[mesh.faces]
    # OBJ files and Mitsuba count v from opposite ends.
    expected = own[faces] if has == "normals" else own[faces] * [1, -1] + [0, 1]
    assert np.allclose(found, expected, atol=1e-6)


def serialized(path, vertices, faces, normals):
    import struct
    import zlib

    table = struct.pack("<I", 0x1000 | (normals is not None)) + b"\0" + struct.pack("<QQ", len(vertices), len(faces))
    arrays = [vertices] if normals is None else [vertices, normals]
    table += b"".join(np.float32(x).tobytes() for x in arrays) + np.uint32(faces).tobytes()
    path.write_bytes(struct.pack("<HH", 0x041C, 4) + zlib.compress(table) + struct.pack("<QI", 0, 1))
    return path


@pytest.mark.parametrize("suffix", [".obj", ".ply", ".serialized"])
@pytest.mark.parametrize("has_normals", [True, False])
def test_mitsuba_does_not_hide_that_normals_are_missing(tmp_path, suffix, has_normals):
    vertices, faces = cube()
    normals = unit(vertices) if has_normals else None
    path = tmp_path / f"x{suffix}"
    if suffix == ".obj":
        written(path, vertices, faces, normals)
    elif suffix == ".serialized":
        serialized(path, vertices, faces, normals)
    else:
        shape = mi.Mesh("x", len(vertices), len(faces), has_vertex_normals=has_normals)
        parameters = mi.traverse(shape)
        parameters["vertex_positions"], parameters["faces"] = np.float32(vertices).ravel(), np.uint32(faces).ravel()
        if has_normals:
            parameters["vertex_normals"] = np.float32(normals).ravel()
        parameters.update()
        shape.write_ply(str(path))
    mesh = read(path, "got texture" if has_normals else "got normals")
    assert (abs(mesh.normals).max() < 0.99) == has_normals  # diagonals, not the sides' own


def test_attributes_follow_their_vertices_and_faces(tmp_path):
    shape = mi.load_dict({"type": "cube"})
    positions = np.array(mi.traverse(shape)["vertex_positions"])
    shape.add_attribute("vertex_place", 3, positions)
    shape.add_attribute("face_number", 1, np.arange(12, dtype=np.float32))
    shape.write_ply(str(path := tmp_path / "x.ply"))
    with pytest.warns(UserWarning, match="normals"):
        mesh = from_file(path, crease=10)
    place = mesh.attributes["vertex_place"]
    assert np.allclose(place, (mesh.vertices - [0, 0, 1.1]) / 1.1, atol=1e-6)
    shown = mi.traverse(to_mitsuba(mesh, GREY))
    assert np.allclose(np.array(shown["vertex_place"]), place.ravel(), atol=1e-6)
    assert mesh.attributes["face_number"].ravel().tolist() == list(range(12))


def test_faces_without_area_do_no_harm(bare):
    vertices, faces = cube()
    mesh = read(bare(vertices, np.concatenate([faces, [(0, 0, 1), (2, 2, 2)]])), BOTH)
    assert len(mesh.faces) == 12
    assert all(np.isfinite(array).all() for array in mesh[:3])


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_a_file_is_scaled_centred_and_put_on_the_ground(tmp_path, suffix):
    path = tmp_path / f"triangle{suffix}"
    if suffix == ".ply":
        to_mitsuba(sphere(16, 8), GREY).write_ply(str(path))
    else:
        path.write_text("v 100 0 7\nv 140 0 7\nv 100 20 27\nvt 0 0\nvn 0 -1 1\nf 1/1/1 2/1/1 3/1/1\n")
    vertices = from_file(path).vertices
    low, high = vertices.min(axis=0), vertices.max(axis=0)
    assert max(high - low) == pytest.approx(2.2, rel=1e-5)
    assert np.allclose([*(low + high)[:2], low[2]], 0, atol=1e-5)
    scene = preview(GREY, object=path, env="constant", size=(16, 16), spp=1)
    assert np.isfinite(np.array(mi.render(mi.load_dict(scene)))).all()


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb"])
def test_to_mitsuba_keeps_normals_and_bsdf(variant):
    mi.set_variant(variant)
    mesh = sphere(16, 8)
    shape = to_mitsuba(mesh, {"type": "roughconductor", "id": "metal"})
    parameters = mi.traverse(shape)
    assert shape.bsdf().id() == "metal"
    assert np.allclose(np.array(parameters["vertex_normals"]), mesh.normals.ravel(), atol=1e-6)
    assert np.array_equal(np.array(parameters["faces"]), mesh.faces.ravel())


def test_a_bad_material_is_a_parameter_error():
    with pytest.raises(ParameterError, match=r"^tau_0 = 3"):
        to_mitsuba(sphere(4, 2), {"type": "micrograin", "tau_0": 3})


def test_a_mesh_without_extent_is_refused(tmp_path):
    with pytest.raises(UnreadableFileError, match="it has no extent"):
        from_file(written(tmp_path / "x.obj", np.zeros((3, 3)), [(0, 1, 2)]))


def test_a_crease_is_an_angle(bare):
    with pytest.raises(ParameterError, match=r"crease = -1: expected an angle in \[0, 180\] degrees"):
        from_file(bare(*cube()), crease=-1)


def test_the_top_of_a_cube_is_lit(bare):
    with pytest.warns(UserWarning, match="normals"):
        scene = preview({"type": "diffuse"}, object=bare(*cube()), env="constant", size=(32, 32), spp=16)
    picture = np.array(mi.render(mi.load_dict(scene)))[..., 1]
    # Of reflectance .5 under a radiance of .75, and it sees nothing else. Noise alone would be less than 1%.
    assert picture[9, 12:20].mean() == pytest.approx(0.375, rel=0.02)
