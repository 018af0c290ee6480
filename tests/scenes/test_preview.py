import asperity  # noqa: F401, I001  (before mitsuba: it finds a working LLVM)
import mitsuba as mi
import numpy as np
import pytest

from asperity.scenes import make_textures
from asperity.errors import UnknownNameError, UnreadableFileError
from asperity.scenes.objects import OBJECTS, from_file, knot, pawn, sphere, to_mitsuba
from asperity.scenes.preview import ENVIRONMENTS, WHITE, irradiance, lit_by, preview

GREY = {"type": "twosided", "bsdf": {"type": "diffuse"}}
GLASS = {"type": "roughdielectric", "alpha": 0.1}


@pytest.fixture
def variant(request):
    before = mi.variant()
    mi.set_variant(getattr(request, "param", "llvm_ad_rgb"))
    yield mi.variant()
    if before:
        mi.set_variant(before)


@pytest.fixture(params=OBJECTS)
def mesh(request):
    return OBJECTS[request.param]()


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


def render(description, **options):
    return np.array(mi.render(mi.load_dict(description), **options))


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


@pytest.mark.parametrize("mesh", [pawn(24, 90), sphere(24, 12), knot(90, 12)])
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


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_rgb"], indirect=True)
def test_to_mitsuba_keeps_normals_and_bsdf(variant):
    mesh = sphere(16, 8)
    shape = to_mitsuba(mesh, {"type": "roughconductor", "id": "metal"})
    parameters = mi.traverse(shape)
    assert shape.bsdf().id() == "metal"
    assert np.allclose(np.array(parameters["vertex_normals"]), mesh.normals.ravel(), atol=1e-6)
    assert np.array_equal(np.array(parameters["faces"]), mesh.faces.ravel())


@pytest.mark.parametrize("env", ENVIRONMENTS)
@pytest.mark.parametrize("object", OBJECTS)
def test_every_object_renders_in_every_environment(variant, object, env):
    picture = render(preview(GLASS, object=object, env=env, size=(32, 32), spp=1))
    assert np.isfinite(picture).all()
    assert picture.mean() > 0.1


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_spectral"], indirect=True)
def test_other_variants_agree_on_the_exposure(variant):
    picture = render(preview(GREY, object="sphere", size=(40, 24), spp=16))
    assert picture.shape == (24, 40, 3)
    # All surfaces reflect 0.18 to 0.58 of at most WHITE, and the shadow is small.
    assert 0.15 < picture.mean() < 0.58 * WHITE


@pytest.mark.parametrize("env", ENVIRONMENTS)
def test_white_paper_has_the_same_radiance_in_every_environment(variant, env):
    scene = preview(GREY, object="sphere", env=env, size=(8, 8), spp=1024)
    scene["object"] = {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}}}
    scene["object"]["to_world"] = mi.ScalarTransform4f().translate([0, 0, 0.01]).scale(50)
    # 2%: the noise of 1024 samples x 64 pixels is below 1%; the rest is the sky, whose exposure has two digits.
    assert render(scene, seed=1).mean() == pytest.approx(WHITE, rel=0.02)


def test_a_map_is_turned_counterclockwise_with_its_zenith_up(variant):
    radiance = np.full((32, 64, 3), 1e-3)
    radiance[8:10, 47:49] = 1  # at 45 degrees, three quarters through the map: on the left
    direction = np.array([[-1, 0, 1], [0, -1, 1], [1, 0, 1]]) / np.sqrt(2)
    seen = []
    for azimuth in (0, 90, 180):
        emitter = mi.load_dict(lit_by(radiance, azimuth))
        si = mi.SurfaceInteraction3f()
        si.wi = -mi.Vector3f(direction.T)
        seen.append(np.array(emitter.eval(si))[0].argmax())
    assert seen == [0, 1, 2]


def test_irradiance_of_a_uniform_map_is_pi_times_its_radiance():
    assert irradiance(np.full((64, 128, 3), 2.0)) == pytest.approx(np.full(3, 2 * np.pi), rel=1e-3)


@pytest.mark.parametrize("suffix", [".ply", ".obj"])
def test_a_file_is_scaled_centred_and_put_on_the_ground(variant, tmp_path, suffix):
    path = tmp_path / f"triangle{suffix}"
    if suffix == ".ply":
        to_mitsuba(sphere(16, 8), GREY).write_ply(str(path))
    else:
        path.write_text("v 100 0 7\nv 140 0 7\nv 100 20 27\nf 1 2 3\n")
    box = mi.load_dict(from_file(path)).bbox()
    assert max(box.extents()) == pytest.approx(2.2, rel=1e-5)
    assert np.allclose([*box.center()][:2], 0, atol=1e-5)
    assert box.min.z == pytest.approx(0, abs=1e-5)
    assert np.isfinite(render(preview(GREY, object=path, env="constant", size=(16, 16), spp=1))).all()


def test_a_map_from_a_file_keeps_its_colour(variant, tmp_path):
    path = tmp_path / "red.exr"
    mi.Bitmap(np.tile(np.float32([1, 0, 0]), (16, 32, 1))).write(str(path))
    picture = render(preview(GREY, object="sphere", env=path, size=(8, 8), spp=16)).mean(axis=(0, 1))
    assert picture[0] > 0.1
    assert picture[1] == picture[2] == 0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"object": "pwan"}, ["object", "'pwan'", "Did you mean 'pawn'", "knot", "sphere", "FILE.ply"]),
        ({"env": "venise"}, ["environment", "'venise'", "Did you mean 'venice'", "constant", "FILE.exr"]),
    ],
)
def test_unknown_names_are_named(variant, options, words):
    with pytest.raises(UnknownNameError) as error:
        preview(GREY, **options)
    assert all(word in str(error.value) for word in words)


@pytest.mark.parametrize("option", ["object", "env"])
@pytest.mark.parametrize("suffix", [".ply", ".obj", ".serialized", ".exr", ".hdr", ".txt"])
@pytest.mark.parametrize("content", [None, b"", b"nonsense\n"])
def test_bad_files_are_named(variant, tmp_path, option, suffix, content):
    path = tmp_path / f"bad{suffix}"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(UnreadableFileError, match="Formats: .ply" if option == "object" else "Formats: .exr") as error:
        preview(GREY, **{option: str(path)})
    assert str(path) in str(error.value)


@pytest.mark.parametrize("pixel", [0, np.nan])
def test_a_map_without_light_is_refused(variant, tmp_path, pixel):
    path = tmp_path / "dark.exr"
    mi.Bitmap(np.full((16, 32, 3), pixel, dtype=np.float32)).write(str(path))
    with pytest.raises(UnreadableFileError, match="light"):
        preview(GREY, env=path)


def test_textures_are_those_the_script_makes(variant):
    textures = {"wood": make_textures.wood(), **make_textures.weave(), "patina": make_textures.patina()}
    for name, image in textures.items():
        path = make_textures.TEXTURES / f"{name}.png"
        assert path.stat().st_size < 150_000
        difference = np.squeeze(np.array(mi.Bitmap(str(path)))).astype(int) - make_textures.encoded(image)
        # Another FFT rounds differently: by one level, save where wood steps from tone to tone.
        assert np.mean(np.abs(difference) > 1) < 1e-3
