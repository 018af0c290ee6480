"""Files of measurements: what comes back, and that damaged ones are refused."""

import json
import random

import mitsuba as mi
import numpy as np
import pytest

import asperity  # noqa: F401
from asperity.errors import UnreadableFileError
from asperity.goniophotometer import HeightField, Measurement, Window, measure
from asperity.goniophotometer.measurement import with_error
from asperity.models.micrograin import ExplicitGrains

pytestmark = pytest.mark.usefixtures("rgb")
FEW = {"paths": 2**16, "tiles": 8}


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A small one."""
    mi.set_variant("llvm_ad_rgb")
    path = tmp_path_factory.mktemp("measured") / "grains.npz"
    measure(ExplicitGrains(0.4), [(30, 0)], sensor=Window("retro", 5, 2), paths=1000, tiles=2).save(path)
    return path


def test_files(tmp_path):
    path = tmp_path / "grains.npz"
    measured = measure(ExplicitGrains(0.4), [(30, 0), (60, 20)], sensor=Window("retro", 5, 4), apart=2, **FEW)
    measured.save(path)
    loaded = Measurement.load(path)
    assert loaded.about == measured.about and loaded.sensor == measured.sensor
    assert all(np.array_equal(getattr(loaded, n), getattr(measured, n)) for n in ("energy", "paths", "labels"))
    with np.load(path) as file:
        assert file["values"].shape == file["errors"].shape == (2, 2, 16, 3)
        assert file["wo"].shape == (2, 16, 3) and list(file["orders"]) == [1, 2]
    assert [p.name for p in tmp_path.iterdir()] == ["grains.npz"]


def test_where_the_light_went():
    glass = HeightField(np.zeros((2, 2)), 1, {"type": "dielectric"})
    measured = measure(glass, [(30, 0)], apart=2, **FEW)
    assert list(measured.balance) == ["albedo", "order 1", "order 2 and more", "transmitted"]
    assert sum(measured.balance[name].value for name in ("albedo", "transmitted")) == pytest.approx(1)
    assert measured.mode == "rgb" and not measured.colourful and measured.channels == ["R", "G", "B"]
    mirrors = measure(ExplicitGrains(0.5, base={"type": "conductor"}), [(30, 0)], orders=1, **FEW)
    assert list(mirrors.balance) == ["albedo", "cut"]


@pytest.mark.parametrize(("grains", "few"), [(16, True), (2**14, False)])
def test_tiles_of_few_grains_differ_by_more_than_noise(grains, few):
    """In all of them together: 128 grains leave 9 % of doubt, and 2^16 paths 0.2 %."""
    assert measure(ExplicitGrains(0.5, grains=grains), [(30, 0)], orders=1, **FEW).wants_tiles is few


@pytest.mark.parametrize(
    ("value", "error", "text"),
    [
        (0.123456, 0.00123, "0.1235 ± 0.0012"),
        (0.5, 0.0, "0.5 ± 0"),
        (0.5, np.nan, "0.5 ± ?"),
        (np.nan, 0.1, "not measured"),
    ],
)
def test_digits_follow_the_error(value, error, text):
    assert with_error(value, error) == text


@pytest.mark.parametrize("content", [b"", b"no archive", None])
def test_unreadable_files(tmp_path, content):
    path = tmp_path / "x.npz"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(UnreadableFileError, match=r"x\.npz"):
        Measurement.load(path)


def test_archives_of_others_are_refused(tmp_path):
    np.savez(tmp_path / "x.npz", a=1)
    with pytest.raises(UnreadableFileError, match="not written by asperity"):
        Measurement.load(tmp_path / "x.npz")


def test_damaged_files_are_refused(tmp_path, file):
    """Bits flipped, bytes overwritten, pieces cut out or doubled, ends cut off: anywhere, or in the archive's index."""
    whole, path, found = file.read_bytes(), tmp_path / "x.npz", {True: 0, False: 0}
    for seed in range(300):
        draw, damaged = random.Random(seed), bytearray(whole)
        where = draw.randrange(len(whole)) if seed % 2 else len(whole) - 1 - draw.randrange(1200)
        there = slice(where, where + draw.choice((1, 4, 40)))
        match draw.randrange(5):
            case 0:
                damaged[where] ^= 1 << draw.randrange(8)
            case 1:
                damaged[there] = draw.randbytes(len(damaged[there]))
            case 2:
                del damaged[there]
            case 3:
                damaged[there] = damaged[there] * 2
            case 4:
                del damaged[where:]
        path.write_bytes(damaged)
        try:
            read, before = (Measurement.load(name) for name in (path, file))
            # What is not checksummed does not matter: dates, say.
            assert all(np.array_equal(getattr(read, n), getattr(before, n)) for n in ("energy", "paths", "incident"))
            assert read.about == before.about
            found[True] += 1
        except UnreadableFileError:
            found[False] += 1
    assert found[False] > 200


NONE = {"light where no path was": {"paths": np.zeros((2, 1), int)}}
WRONG = {
    "paths is of type float64": {"paths": np.full((2, 1), 500.0)},
    "paths is of type int64 and shape (3, 1)": {"paths": np.ones((3, 1), int)},
    "counts below zero": {"paths": np.full((2, 1), -1)},
    "goal is of type int64 and shape (3,)": {"goal": np.ones(3, int)},
    "energy is of type int64": {"energy": np.ones((2, 1, 1, 7, 3), int)},
    "energy is of type uint64 and shape (2, 1, 1, 8, 3)": {"energy": np.ones((2, 1, 1, 8, 3), np.uint64)},
    "theta = nan": {"incident": np.array([[np.nan, 0]])},
    "theta = 95": {"incident": np.array([[95.0, 0]])},
    "incident is of type object": {"incident": np.array([[None, 0]])},
    "labels is of type <U1": {"labels": np.array([["a", "b"], ["c", "d"]])},
    "'orders'": {"about": '{"sensor": {"kind": "window"}}'},
    "n = -1": {"about": {"sensor": {"kind": "window", "n": -1}}},
    "'dome'": {"about": {"sensor": {"kind": "dome"}}},
    "of what it is": {"about": {"geometry": None}},
}


@pytest.mark.parametrize("reason, change", (WRONG | NONE).items(), ids=(WRONG | NONE).keys())
def test_files_at_odds_with_themselves_are_refused(tmp_path, file, reason, change):
    with np.load(file) as old:
        content = {name: old[name] for name in old.files}
    if isinstance(change.get("about"), dict):
        change = {"about": json.dumps(json.loads(str(content["about"])) | change["about"])}
    np.savez(tmp_path / "x.npz", **content | change)
    with pytest.raises(UnreadableFileError) as caught:
        Measurement.load(tmp_path / "x.npz")
    assert reason in str(caught.value) or "pickle" in str(caught.value)
