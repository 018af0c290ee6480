"""Maps of heights: read as they are stored, levelled, and refused where repeating them would make a cliff."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter
from surfaces import COARSE, run, waves

from asperity.errors import ParameterError, UnknownNameError
from asperity.goniophotometer import HeightField
from asperity.goniophotometer.heightmap import cliff, levelled, read, slopes

SEEDS = st.integers(0, 2**32 - 1)
MIRROR = {"type": "conductor", "material": "none"}


def noise(seed, rows, columns, width=0.0):
    """Periodic heights of deviation 1, correlated over that many samples."""
    z = gaussian_filter(np.random.default_rng(seed).standard_normal((rows, columns)), width, mode="wrap")
    return z / z.std()


def tilted(seed, rows, columns, span, turn):
    """A plane that rises by ``span`` along x (turn 0) or y (turn 1), over white noise of deviation 1."""
    return np.rot90(np.linspace(0, span, columns) + noise(seed, rows, columns), turn)


@settings(max_examples=200, deadline=None)
@given(SEEDS, st.integers(5, 70), st.integers(8, 70), st.sampled_from([0, 1, 3]))
def test_random_periodic_maps_are_left_alone(seed, rows, columns, width):
    assert cliff(noise(seed, rows, columns, width), (1, 1)) is None


@settings(max_examples=200, deadline=None)
@given(SEEDS, st.integers(16, 70), st.integers(16, 70), st.floats(10, 1e6), st.booleans())
def test_tilts_are_found_and_levelled(seed, rows, columns, span, turn):
    z = tilted(seed, rows, columns, span, turn)
    found = cliff(z, (1, 1))
    assert found is not None and found[0] == "xy"[turn]
    assert cliff(levelled(z, (1, 1)), (1, 1)) is None


GROOVES = np.tile(np.repeat([0.0, 1.0], 8), (16, 1))
TEETH = np.tile(np.linspace(0, 1, 8), (16, 2))


@pytest.mark.parametrize("shift", range(0, 16, 3))
@pytest.mark.parametrize("z", [GROOVES, TEETH, np.pad([[1.0]], 8), np.zeros((9, 9)), waves()])
def test_cliffs_that_are_meant_are_left_alone(z, shift):
    """Walls of grooves, teeth and a spike, wherever the border is."""
    for axis in (0, 1):
        assert cliff(np.roll(z, shift, axis), (1, 1)) is None


def test_rounding_is_no_cliff():
    plane = np.linspace(0, 1e6, 64) + np.zeros((64, 1))
    assert cliff(plane, (1, 1)) is not None
    assert cliff(levelled(plane, (1, 1)), (1, 1)) is None
    assert cliff(np.linspace(0, 1e-7, 64) + np.zeros((64, 1)), (1, 1)) is None


def test_slopes_are_those_of_the_plane():
    y, x = np.mgrid[:20, :30] * np.array([0.5, 0.1])[:, None, None]
    z = 3 + 0.7 * x - 0.2 * y
    assert slopes(z, (0.1, 0.5)) == pytest.approx((0.7, -0.2))
    assert np.abs(levelled(z, (0.1, 0.5))).max() < 1e-12
    both = slopes(levelled(noise(1, 20, 30), (0.1, 0.5)), (0.1, 0.5))
    assert np.abs(both).max() < 1e-12


def test_a_cliff_is_refused_with_what_would_help(rgb):
    """Levelling does not join the ends of a crop of a smooth map, so that is not proposed there."""
    with pytest.raises(ParameterError, match=r"in y do not match.*slopes 0 and 0.1 .*--level.*--periodic mirror"):
        HeightField(np.linspace(0, 6.3, 64)[:, None] + np.zeros(8), 1)
    with pytest.raises(ParameterError, match=r"in x do not match.*: mirror them .*--periodic mirror"):
        HeightField(noise(1, 64, 64, 5)[:, :20], 1)
    assert HeightField(noise(1, 64, 64, 5)[:, :20], 1, periodic="mirror").account == "64 x 20 heights, mirrored"


def test_a_levelled_mirror_is_a_mirror(rgb):
    """Repeated with its cliff, every second ray would meet two facets."""
    plane = np.linspace(0, 1, 32) + np.zeros((8, 1))
    field = HeightField(plane, 1 / 32, MIRROR, level=True)
    assert "slopes 1.03 and 0 in x and y taken away, repeated" in field.account
    assert field.description["level"] is True and "level" not in HeightField(0 * plane, 1).description
    result = run(field, (50, 20), apart=2)
    cell, _ = COARSE.locate(mi.Vector3f(*map(float, result.wi[0] * (-1, -1, 1))))
    assert result.albedo.value[0, 0, 0] == 1 and result.values.value[0, 0, int(cell[0]), 0] > 0


def image(path, **channels):
    """Write an image of these channels (rows, columns)."""
    values = np.float32(np.stack(list(channels.values()), axis=-1))
    kind = mi.Bitmap.PixelFormat.MultiChannel
    mi.Bitmap(values, kind, [name.replace("_", ".") for name in channels]).write(str(path))
    return path


Z = np.random.default_rng(0).random((4, 6))


@pytest.mark.parametrize("ending", [".npy", ".png", ".exr"])
def test_heights_are_read_as_stored(rgb, tmp_path, ending):
    """No sRGB curve: a .png of 16 bits is good to half of 2^-16."""
    path = tmp_path / f"heights{ending}"
    if ending == ".npy":
        np.save(path, Z)
    elif ending == ".exr":
        image(path, Y=Z)
    else:
        grey = mi.Bitmap(np.float32(np.stack([Z] * 3, axis=-1)))
        grey.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt16, srgb_gamma=False).write(str(path))
    field = HeightField.load(path, 0.1, scale=3, periodic="mirror")
    assert np.allclose(field.heights, 3 * Z, atol=3e-5)
    assert field.description["source"]["path"] == str(path.resolve()) and field.description["source"]["scale"] == 3


@pytest.mark.parametrize(
    "channels, name",
    [
        ({"height": Z}, None),
        ({"R": Z, "G": Z, "B": Z, "A": 1 + 0 * Z}, None),
        ({"depth_Z": Z, "depth_A": 0 * Z}, None),
        ({"R": 0 * Z, "G": Z, "B": 0 * Z}, "G"),
        ({"N_X": 0 * Z, "height": Z, "mask": 1 + 0 * Z, "N_Y": 2 + 0 * Z, "A": 0 * Z}, "height"),
    ],
)
def test_channels(rgb, tmp_path, channels, name):
    assert np.allclose(read(image(tmp_path / "x.exr", **channels), name), Z)


def test_no_channel_is_guessed(rgb, tmp_path):
    path = image(tmp_path / "x.exr", R=Z, G=0 * Z, B=Z)
    with pytest.raises(ParameterError, match="they differ; choose one of R, G, B"):
        HeightField.load(path, 1)
    with pytest.raises(UnknownNameError, match=r"unknown channel 'r'. .*R, G, B"):
        HeightField.load(path, 1, channel="r")
    np.save(tmp_path / "x.npy", Z)
    with pytest.raises(ParameterError, match="channel = 'R': an array has none"):
        HeightField.load(tmp_path / "x.npy", 1, channel="R")
    assert HeightField.load(path, 1, periodic="mirror", channel="B").description["source"]["channel"] == "B"
