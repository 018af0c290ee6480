"""Our own archives: a `BRDF` comes back as it was, and what is no such archive is refused."""

import asperity  # noqa: F401  isort: skip
import io
import zipfile

import numpy as np
import pytest
from test_brdf import brdf, traced

from asperity.errors import UnreadableFileError
from asperity.goniophotometer import Hemisphere
from asperity.measured import archive, from_measurement


def test_an_archive_comes_back_as_it_was(tmp_path):
    one = brdf(
        errors=np.full((2, 1), 0.1), weights=np.ones(2), isotropic=False, source="a lab", left_out={"negative": 3}
    )
    archive.save(one, tmp_path / "x.npz")
    assert archive.is_brdf(tmp_path / "x.npz")
    found = archive.load(tmp_path / "x.npz")
    for name in archive.ARRAYS:
        assert np.array_equal(getattr(found, name), getattr(one, name))
    assert [getattr(found, name) for name in archive.ABOUT] == [getattr(one, name) for name in archive.ABOUT]


def test_a_measurement_of_the_virtual_goniophotometer_is_read_too(tmp_path):
    measured = traced(Hemisphere(4, 8), 0.25, [(0, 0), (50, 0)])
    measured.about.update(orders=1, limit=1)
    measured.save(tmp_path / "x.npz")
    assert not archive.is_brdf(tmp_path / "x.npz")
    assert np.array_equal(archive.load(tmp_path / "x.npz").values, from_measurement(measured).values)


def forged(path, header):
    """An archive whose ``values`` says this of its shape."""
    archive.save(brdf(), path)
    with zipfile.ZipFile(path) as file:
        members = {name: file.read(name) for name in file.namelist()}
    members["values.npy"] = members["values.npy"].replace(b"(2, 1), }", header)
    with zipfile.ZipFile(path, "w") as file:
        for name, content in members.items():
            file.writestr(name, content)


def test_dimensions_that_lie_are_refused(tmp_path):
    forged(tmp_path / "x.npz", b"(10**12,1)}")
    with pytest.raises(UnreadableFileError, match=r"x\.npz"):
        archive.load(tmp_path / "x.npz")
    forged(tmp_path / "x.npz", b"(900000000000,1), }")
    with pytest.raises(UnreadableFileError, match=r"x\.npz"):
        archive.load(tmp_path / "x.npz")


def test_what_unpacks_to_too_much_is_refused_before_it_is_unpacked(tmp_path, monkeypatch):
    archive.save(brdf(), tmp_path / "x.npz")
    monkeypatch.setattr(archive, "MOST", 100)
    with pytest.raises(UnreadableFileError, match="unpacks to"):
        archive.load(tmp_path / "x.npz")


@pytest.mark.parametrize(
    "arrays, words",
    [
        ({"values": np.ones((2, 1), dtype=int)}, "values is not of floating-point"),
        ({"values": np.full((2, 1), np.nan)}, "values is not finite"),
        ({"wo": np.ones((3, 3))}, "wo is of shape"),
        ({"brdf": np.array("{")}, "not written by asperity"),
        ({"brdf": np.array("[]")}, "not written by asperity"),
    ],
)
def test_what_is_damaged_is_refused_by_name(tmp_path, arrays, words):
    archive.save(brdf(), tmp_path / "x.npz")
    with np.load(tmp_path / "x.npz") as file:
        held = dict(file)
    np.savez(tmp_path / "x.npz", **held | arrays)
    with pytest.raises(UnreadableFileError, match=words):
        archive.load(tmp_path / "x.npz")


def test_other_archives_and_other_files_are_refused(tmp_path):
    np.savez(tmp_path / "x.npz", a=np.ones(3))
    (tmp_path / "y.npz").write_bytes(b"PK\3\4" + bytes(50))
    buffer = io.BytesIO()
    np.save(buffer, np.ones(3))
    (tmp_path / "z.npz").write_bytes(buffer.getvalue())
    for name, words in {"x": "not written by asperity", "y": "no NumPy archive", "z": "no NumPy archive"}.items():
        with pytest.raises(UnreadableFileError, match=words):
            archive.load(tmp_path / f"{name}.npz")
