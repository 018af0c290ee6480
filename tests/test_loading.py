"""What Mitsuba dies of, waits for, or takes in silence is refused in one line that says where."""

import asperity  # noqa: F401  isort: skip
import contextlib
import io

import drjit.scalar as scalar
import mitsuba as mi
import numpy as np
import pytest

from asperity import loading
from asperity.errors import ParameterError, UnreadableFileError
from asperity.scenes import presets

pytestmark = pytest.mark.usefixtures("rgb")

NAN = float("nan")
GREY = {"type": "diffuse"}
PAIRS = {"type": "spectrum", "value": [(400, 0.1), (700, 0.5)]}


def textured(texture):
    return {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": texture}}


def nested(depth):
    return {"type": "mask", "bsdf": nested(depth - 1)} if depth else GREY


def circular():
    description = {"type": "mask"}
    description["bsdf"] = description
    return description


def image(values, **given):
    return {"type": "bitmap", "bitmap": mi.Bitmap(np.full((2, 2, 3), values, dtype=np.float32)), **given}


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_spectral"])
def test_presets_pass(variant):
    mi.set_variant(variant)
    for name in presets.names():
        assert isinstance(loading.load(presets.load(name).material), mi.BSDF)


@pytest.mark.parametrize(
    "good",
    [
        PAIRS,
        {"type": "spectrum", "value": 0.5},
        {"type": "rgb", "value": 0.5},
        {"type": "rgb", "value": (0.1, 0.2, 0.3)},
        np.float32(0.5),
        1,
    ],
)
def test_ways_to_give_a_colour_pass(good):
    assert loading.load(textured(good))


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (None, "reflectance is null: leave it out"),
        (NAN, "reflectance = nan: expected a number, finite"),
        (10**400, "reflectance = 1000.*: expected a number, finite"),
        ([0.1, 0.2], "reflectance = .0.1, 0.2.: expected one word or number, or three"),
        ([0.1, None, 0.2], "reflectance = .0.1, None, 0.2.: expected .* three numbers, finite"),
        ({}, "reflectance.type is missing"),
        ({"type": None}, "reflectance.type = null: expected a name"),
        ({"type": "ref", "id": 3}, "reflectance.id = 3: expected a name"),
        ({"type": "rgb", "value": 0.5, 3: 4}, "reflectance.3: expected a word"),
        (
            {"type": "rgb", "value": [0.1, 0.2, NAN]},
            "reflectance.value = .*nan.*: expected one number or three, finite",
        ),
        ({"type": "rgb", "value": [1, 2]}, "reflectance.value = .1, 2.: expected one number or three"),
        ({"type": "uniform", "value": None}, "reflectance.value is null"),
        ({"type": "spectrum", "value": []}, "reflectance.value = ..: expected pairs"),
        ({"type": "spectrum", "value": [(400, 0.5), (700, 3)]}, "reflectance.value has 3: a reflectance is within"),
        (
            {"type": "irregular", "wavelengths": "400, 700", "values": ".1, .2"},
            "reflectance.type is 'irregular', which",
        ),
        (
            {"type": "checkerboard", "color0": PAIRS, "color1": {**PAIRS, "value": [(400, 7), (700, 0)]}},
            "reflectance.color1.value has 7",
        ),
        ({"type": "bitmap"}, "reflectance.filename is missing: bitmap needs filename or bitmap or data"),
        (
            {"type": "bitmap", "file": "a.png"},
            "reflectance.file: a bitmap has no such parameter. Did you mean 'filename'",
        ),
        ({"type": "bitmap", "filename": 3}, "reflectance.filename = 3: expected the path"),
        ({"type": "bitmap", "filename": "no.png"}, "reflectance.filename: there is no file 'no.png'"),
        ({"type": "bitmap", "filename": "/dev/zero"}, "reflectance.filename: there is no file"),
        ({"type": "bitmap", "data": scalar.TensorXf(np.zeros((0, 2, 3)))}, "reflectance.data is empty"),
        ({"type": "bitmap", "data": None}, "reflectance.data is null"),
        ({"type": "checkerboard", "to_uv": scalar.Matrix3f64(0)}, "reflectance.to_uv has no inverse"),
    ],
)
def test_bad_values_are_named_by_their_path(bad, words):
    with pytest.raises(ParameterError, match=rf"^bsdf\.{words}"):
        loading.load(textured(bad))


@pytest.mark.parametrize("plugin", ["irregular", "regular"])
@pytest.mark.parametrize("values", ["0.1, -2, 0.3", "0.1 7 0.3", "0.1, 0.2, nan"])
def test_spectra_of_reflectances_are_within_range(plugin, values):
    mi.set_variant("scalar_spectral")
    range_ = {"irregular": {"wavelengths": "400, 500, 700"}, "regular": {"wavelength_min": 400, "wavelength_max": 700}}
    with pytest.raises(ParameterError, match=r"^bsdf.reflectance.values (has (-2|7): a reflectance is|.*nan.*finite)"):
        loading.load(textured({"type": plugin, "values": values, **range_[plugin]}))


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        (GREY["type"], "'diffuse': expected a description"),
        (nested(100), "nested more than 64 deep"),
        (circular(), "nested more than 64 deep, or in itself"),
        ({"type": "blendbsdf"}, "expected two nested descriptions, and a weight"),
        ({"type": "blendbsdf", "a": GREY, "b": GREY}, "expected two nested descriptions, and a weight"),
        ({"type": "envmap"}, "filename is missing"),
        ({"type": "hdrfilm", "width": 2**31}, r"width = 2147483648: expected a number in \[1, 65536\]"),
        ({"type": "gaussian", "stddev": -1.0}, r"stddev = -1.0: expected a number in \[0.01, 32.0\]"),
        ({"type": "lanczos", "lobes": 100000}, "lobes = 100000"),
    ],
)
def test_bad_descriptions_are_refused(bad, words):
    with pytest.raises(ParameterError, match=words):
        loading.load(bad)


@pytest.mark.parametrize(("matrix", "words"), [(np.full((4, 4), NAN), "finite"), (np.zeros((4, 4)), "no inverse")])
def test_transformations_have_an_inverse(matrix, words):
    with pytest.raises(ParameterError, match=f"ball.to_world .*{words}"):
        loading.load({"type": "scene", "ball": {"type": "sphere", "to_world": mi.ScalarTransform4f(matrix)}})


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral"])
@pytest.mark.parametrize("value", [50, -5, NAN])
def test_texels_that_mitsuba_clips_are_refused(tmp_path, variant, value):
    mi.set_variant(variant)
    image(value)["bitmap"].write(str(path := tmp_path / "map.exr"))
    given = textured(image(value)), textured({"type": "bitmap", "filename": str(path)})
    for description, name in zip(given, ("bitmap", "filename")):
        # In RGB, finite texels are kept as they are, and the plugin that has them decides.
        expected = (
            contextlib.nullcontext()
            if variant == "llvm_ad_rgb" and np.isfinite(value)
            else pytest.raises(
                ParameterError, match=rf"^bsdf.reflectance.{name}.*({value:g}: a colour.* within|not finite)"
            )
        )
        with expected:
            loading.load(description)


def test_what_a_model_refuses_is_a_parameter_error_that_says_where():
    with pytest.raises(ParameterError, match=r"^bsdf: tau_0 = 3: expected a number or texture in \[0, 1\]\.$"):
        loading.load({"type": "twosided", "bsdf": {"type": "micrograin", "tau_0": 3}})


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ({"type": "difuse"}, "there is no plugin 'difuse'. Did you mean 'diffuse'?"),
        ({"type": "diffuse", "colour": 3}, "diffuse has no parameter 'colour'."),
        (
            {"type": "mask", "bsdf": {**GREY, "reflectance": "red"}},
            'bsdf: The property "reflectance" has the wrong type',
        ),
        (
            {"type": "mask", "bsdf": {**GREY, "reflectance": print}},
            "bsdf.reflectance: expected a number, a word, .*not a",
        ),
    ],
)
def test_what_mitsuba_refuses_is_one_short_line(bad, words):
    with pytest.raises(ParameterError, match=f"^{words}") as error:
        loading.load(bad)
    assert not any(noise in str(error.value) for noise in ("\n", ".cpp", "dictionary node", "instantiate"))


def test_bugs_of_plugins_keep_their_traceback():
    class Buggy(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            raise KeyError("ours")

    mi.register_bsdf("buggy", Buggy)
    with pytest.raises(RuntimeError, match="Traceback"):
        loading.load({"type": "buggy"})


def ply(folder, vertices, faces):
    header = f"element vertex {len(vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
    header += f"element face {len(faces)}\nproperty list uchar int vertex_indices\n"
    rows = np.array([(3, face) for face in faces], dtype=[("n", "u1"), ("face", "<i4", 3)])
    path = folder / "x.ply"
    start = f"ply\nformat binary_little_endian 1.0\n{header}end_header\n".encode()
    path.write_bytes(start + np.array(vertices, dtype="<f4").tobytes() + rows.tobytes())
    return path


TRIANGLE = ((0, 0, 0), (1, 0, 0), (0, 1, 0))


@pytest.mark.parametrize(
    ("vertices", "faces", "words"),
    [
        (TRIANGLE, [(0, 1, 2), (0, 1, 3)], r"face 1 is of vertices \[0, 1, 3\], and there are 3"),
        (TRIANGLE, [(0, 1, 2**31 - 1)], "there are 3"),
        (TRIANGLE, [], "it has no faces"),
        ((*TRIANGLE[:2], (0, NAN, 0)), [(0, 1, 2)], "invalid vertex position"),
    ],
)
@pytest.mark.parametrize("face_normals", [True, False])
def test_meshes_are_looked_at_before_use(tmp_path, vertices, faces, words, face_normals):
    path = ply(tmp_path, vertices, faces)
    with pytest.raises(UnreadableFileError, match=words):
        loading.mesh(path, face_normals=face_normals)
    with pytest.raises(ParameterError, match=rf"^ball.filename: .*{words}"):
        loading.load({"type": "scene", "ball": {"type": "ply", "filename": str(path), "face_normals": face_normals}})


def test_good_meshes_pass(tmp_path):
    assert loading.mesh(ply(tmp_path, TRIANGLE, [(0, 1, 2)])).face_count() == 1


def test_a_serialized_mesh_declares_no_more_than_it_holds(tmp_path):
    import struct
    import zlib

    table = struct.pack("<I", 0x1001) + b"name\0" + struct.pack("<QQ", 1 << 33, 1) + bytes(36)
    path = tmp_path / "x.serialized"
    path.write_bytes(struct.pack("<HH", 0x041C, 4) + zlib.compress(table) + struct.pack("<QI", 0, 1))
    with pytest.raises(UnreadableFileError, match="it declares 8589934592 vertices and 1 faces, and ends before"):
        loading.mesh(path)
    for cut in range(0, path.stat().st_size, 7):
        (short := tmp_path / "short.serialized").write_bytes(path.read_bytes()[:cut])
        with pytest.raises(UnreadableFileError):
            loading.mesh(short)


def radiance(rows, size=(2, 8)):
    return b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y %d +X %d\n" % size + b"".join(rows)


ROW = bytes((2, 2, 0, 8)) + bytes((136, 100)) * 3 + bytes((8, *[129] * 8))


@pytest.mark.parametrize("rows", [[ROW, ROW], [bytes((100, 100, 100, 129)) * 16]])
def test_radiance_pictures_are_read_packed_or_not(tmp_path, rows):
    (path := tmp_path / "x.hdr").write_bytes(radiance(rows))
    assert np.array(loading.image(path)) == pytest.approx(100 / 128, rel=0.01)  # of 8 bits


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([ROW], "row 1 does not begin as"),
        ([ROW, ROW[:-1]], "cut short"),
        ([bytes(63)], "cut short"),
        ([ROW, bytes(4 * 8)], "row 1 does not begin as"),  # Mitsuba writes a whole picture from there
        ([ROW, bytes((2, 2, 0, 9)) + ROW[4:]], "row 1 does not begin as"),
        ([ROW, ROW[:4] + bytes((137, 100)) + ROW[6:]], "runs of row 1 are longer"),
        ([ROW, ROW[:4] + bytes((0, 100)) + ROW[6:]], "runs of row 1 are longer"),
    ],
)
def test_damaged_radiance_pictures_are_refused(tmp_path, rows, words):
    (path := tmp_path / "x.hdr").write_bytes(radiance(rows))
    with pytest.raises(UnreadableFileError, match=words):
        loading.image(path)


@pytest.mark.parametrize("corner", [(7, 905969671), (2**31 - 1, 7), (-3, 7)])
def test_a_picture_has_no_more_rows_than_its_file(tmp_path, corner):
    import struct

    path = tmp_path / "x.exr"
    mi.Bitmap(np.ones((8, 8, 3), np.float32)).write(str(path))
    assert loading.image(path).width() == 8
    window = struct.pack("<4i", 0, 0, 7, 7)
    path.write_bytes(path.read_bytes().replace(window, struct.pack("<4i", 0, 0, *corner), 1))
    with pytest.raises(UnreadableFileError, match="pixels do not fit into its"):
        loading.image(path)


@pytest.fixture
def tensors(tmp_path):
    from mitsuba.python import tensor_io

    fields = {"theta_i": np.float32([0, 1.5]), "phi_i": np.float32([0]), "jacobian": np.uint8([0])}
    fields |= {"ndf": np.ones((2, 2), "f4"), "sigma": np.ones((2, 2), "f4"), "description": "made up"}
    fields |= {"vndf": np.ones((1, 2, 4, 4), "f4"), "luminance": np.ones((1, 2, 4, 4), "f4")}
    fields |= {"rgb": np.ones((1, 2, 3, 4, 4), "f4")}

    def written(**changed):
        with contextlib.redirect_stdout(io.StringIO()):
            tensor_io.write(path := tmp_path / "x.bsdf", **fields | changed)
        return path

    return written


def test_a_whole_measurement_passes(tensors):
    assert loading.load({"type": "measured", "filename": str(tensors())})


def test_a_measurement_cut_short_is_refused(tensors):
    content = (path := tensors()).read_bytes()
    for length in np.linspace(0, len(content) - 1, 23, dtype=int):
        path.write_bytes(content[:length])
        with pytest.raises(ParameterError, match=r"^filename: cannot read the measurement.*cut short"):
            loading.load({"type": "measured", "filename": str(path)})


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({"rgb": np.full((1, 2, 3, 4, 4), NAN, "f4")}, "'rgb' is not finite"),
        ({"vndf": -np.ones((1, 2, 4, 4), "f4")}, "'vndf' is below 0"),
        ({"theta_i": np.float32([1.5, 0])}, "'theta_i' does not increase"),
    ],
)
def test_a_measurement_of_nonsense_is_refused(tensors, changed, words):
    with pytest.raises(ParameterError, match=words):
        loading.load({"type": "measured", "filename": str(tensors(**changed))})


SCENE = '<scene version="3.0.0">\n<bsdf type="diffuse" id="b">{}</bsdf>\n</scene>'


def xml(folder, content):
    (path := folder / "scene.xml").write_text(SCENE.format(content))
    return path


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ('<texture name="reflectance" type="bitmap"/>', "line 2, .*filename is missing"),
        ('<texture name="reflectance" type="bitmap"><string name="file" value="a.png"/></texture>', "mean 'filename'"),
        (
            '<texture name="reflectance" type="bitmap"><string name="filename" value="a.png"/></texture>',
            "no file 'a.png'",
        ),
        ('<spectrum name="reflectance" value="400:.1, 500:3, 700:.2"/>', "line 2, .*reflectance has 3: a reflectance"),
        ('<float name="reflectance" value="nan"/>', "line 2, .*reflectance = nan: expected a number"),
        ('<float name="reflectance" value="$r"/>', "r"),
        ("<", "scene.xml"),
    ],
)
def test_xml_is_checked_too(tmp_path, content, words):
    with pytest.raises(ParameterError, match=words):
        loading.load_file(xml(tmp_path, content))


def test_xml_finds_its_files_and_definitions(tmp_path):
    image(0.5)["bitmap"].write(str(tmp_path / "a.exr"))
    texture = '<texture name="reflectance" type="bitmap"><string name="filename" value="$name"/></texture>'
    assert loading.load_file(xml(tmp_path, texture), name="a.exr")


@pytest.mark.parametrize("light", ["area", "point"])
def test_the_name_of_a_shape_or_light_makes_no_reflectance(rgb, light):
    bright = {"type": "spectrum", "value": [(400, 5.0), (700, 5.0)]}
    lamp = {"type": "point", "intensity": bright} if light == "point" else {"type": "area", "radiance": bright}
    loading.check({"type": "scene", "reflector": lamp if light == "point" else {"type": "sphere", "emitter": lamp}})


def test_a_reflectance_in_a_texture_of_textures_is_one(rgb):
    bright = {"type": "spectrum", "value": [(400, 5.0), (700, 5.0)]}
    with pytest.raises(ParameterError, match=r"reflectance\.color0\.value has 5"):
        loading.check({"type": "diffuse", "reflectance": {"type": "checkerboard", "color0": bright}})
