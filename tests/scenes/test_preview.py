import asperity  # noqa: F401, I001  (before mitsuba: it finds a working LLVM)
import mitsuba as mi
import numpy as np
import pytest

from asperity.errors import ParameterError, UnknownNameError, UnreadableFileError
from asperity.scenes.objects import OBJECTS
from asperity.scenes.preview import ENVIRONMENTS, LIGHTS, ROOM, WHITE, irradiance, lit_by, preview

GREY = {"type": "twosided", "bsdf": {"type": "diffuse"}}
GLASS = {"type": "roughdielectric", "alpha": 0.1}


@pytest.fixture
def variant(request):
    before = mi.variant()
    mi.set_variant(getattr(request, "param", "llvm_ad_rgb"))
    yield mi.variant()
    if before:
        mi.set_variant(before)


def render(description, **options):
    return np.array(mi.render(mi.load_dict(description), **options))


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
        ({"object": 3}, ["object", "'3'", "FILE.ply"]),
        ({"env": 3}, ["environment", "'3'", "FILE.exr"]),
        ({"light": "frnt"}, ["light", "'frnt'", "Did you mean 'front'", "key", "rim"]),
        ({"floor": "tile"}, ["floor", "'tile'", "Did you mean 'tiles'", "paper"]),
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


def test_a_crease_is_for_mesh_files(variant):
    with pytest.raises(ParameterError, match="crease = 30: the pawn has normals of its own"):
        preview(GREY, crease=30)


@pytest.mark.parametrize("light", LIGHTS)
def test_light_comes_from_where_it_says(variant, light):
    """White paper that faces a lamp gets its light, and that of the dim room."""
    for place in LIGHTS[light]:
        scene = preview(GREY, env="constant", light=light, size=(8, 8), spp=64)
        scene["ground"] = {"type": "sphere", "radius": 1e-3, "center": [0, 0, -9]}
        paper = {"type": "diffuse", "reflectance": {"type": "rgb", "value": 1.0}}
        facing = mi.ScalarTransform4f().look_at([0, 0, 1], [*np.add(place, [0, 0, 1])], [0, 0, 1])
        scene["object"] = {"type": "rectangle", "to_world": facing, "bsdf": paper}
        scene["sensor"]["to_world"] = mi.ScalarTransform4f().look_at(
            [*(np.add(place, [0, 0, 1]))], [0, 0, 1], [0, 0, 1]
        )
        scene["sensor"]["fov"] = 20
        picture = render(scene, seed=1)[2:6, 2:6].mean()
        # The lamp is a disc of 6 degrees at a distance of 40, seen from 1 beside its own origin: 3%. A second
        # lamp, where there are two, adds the cosine of the angle between them, if that is positive.
        others = [np.dot(place, other) / np.linalg.norm(place) / np.linalg.norm(other) for other in LIGHTS[light]]
        assert picture == pytest.approx(WHITE * (ROOM + sum(max(cosine, 0) for cosine in others)), rel=0.05)


def test_grains_send_light_back_and_lambert_does_not(variant):
    """What the front light is for: the outline of a ball of dust is as bright as its middle."""
    moon = {"type": "lambertsphere", "reflectance": 0.12}
    rows = [render(preview(one, object="sphere", light="front", size=(64, 64), spp=64))[..., 1] for one in (moon, GREY)]
    # Across the ball, whose radius is 22 of 64 pixels: its middle, and 19 pixels to the left.
    limb = [picture[31:33, 12:14].mean() / picture[31:33, 30:34].mean() for picture in rows]
    assert limb[0] > 0.9
    # Lambert's cosine is .5 there; the ground adds to it, and so does the room.
    assert 0.5 < limb[1] < 0.75


def test_a_turn_goes_all_the_way_round(variant):
    def picture(turn):
        return render(preview(GREY, object="knot", env="constant", turn=turn, size=(32, 32), spp=16))

    start, quarter, whole = (picture(turn) for turn in (0, 90, 360))
    noise, change = np.abs(start - whole).mean(), np.abs(start - quarter).mean()
    assert noise < 0.01 and change > 0.03
