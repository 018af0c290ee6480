"""MERL's files: what they hold, and what is refused."""

import asperity  # noqa: F401  isort: skip
import os

import numpy as np
import pytest
from data import SMALL, glossy, merl_file

from asperity.errors import UnreadableFileError
from asperity.measured import merl
from asperity.measured.brdf import ABOVE


def pairs(n, lowest=0.02):
    """Random pairs of directions, not quite down to the horizon."""
    random = np.random.default_rng(3)
    z, phi = random.uniform(lowest, 1, (2, n)), random.uniform(0, 2 * np.pi, (2, n))
    return np.stack([np.sqrt(1 - z**2) * np.cos(phi), np.sqrt(1 - z**2) * np.sin(phi), z], axis=-1)


def test_a_file_is_as_published(tmp_path):
    """By hand: φ_d fastest, one channel after the other, each with its scale."""
    values = np.arange(1, 25, dtype="<f8")
    path = tmp_path / "x.binary"
    path.write_bytes(np.array([2, 2, 2], "<i4").tobytes() + values.tobytes())
    table = merl.read(path)
    assert table[1, 1, 1] == pytest.approx([8 / 1500, 16 * 1.15 / 1500, 24 * 1.66 / 1500])
    assert table[0, 1, 0, 0] == pytest.approx(3 / 1500)
    assert table[0, 0, 0, 0] == table[0, 0, 1, 0] == pytest.approx(1.5 / 1500)  # the same pair of directions


def test_angles_are_rusinkiewiczs():
    """Those of a node give its directions, and its directions its angles, however they are turned about the normal."""
    wanted = np.array([(0.3, 0.4, 0.5), (1.2, 0.2, 3.0), (0.0, 0.7, 2.0), (0.5, 0.0, 0.0)])
    wi, wo = merl.directions(*wanted.T)
    assert np.allclose(np.linalg.norm(wi, axis=1), 1)
    turn = np.array([[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]])
    found = merl.angles(wi, wo)
    assert np.allclose(found[:, :2], wanted[:, :2], atol=1e-7) and np.allclose(found[:3, 2], wanted[:3, 2])
    assert np.allclose(merl.angles(wi @ turn, wo @ turn)[[0, 1]], wanted[[0, 1]])
    assert np.allclose(merl.angles(wo, wi)[:3, 2], (wanted[:3, 2] + np.pi) % (2 * np.pi))  # by reciprocity


def test_pairs_below_the_horizon_and_negative_ones_are_counted(tmp_path):
    def f(wi, wo):
        return np.where(wi[:, :1] > 0.5, np.nan, glossy(wi, wo))

    found = merl.load(merl_file(tmp_path / "x.binary", f))
    wi, wo = merl.nodes(SMALL)
    above = (wi[:, 2] > ABOVE) & (wo[:, 2] > ABOVE)
    assert found.left_out == {
        "below the horizon": (~above).sum(),
        "negative": (above & (wi[:, 0] > 0.5)).sum(),
    }
    assert np.allclose(found.values, glossy(found.wi, found.wo), rtol=1e-12)
    assert found.source == "MERL, x" and found.isotropic and found.channels == ("R", "G", "B")


def test_a_file_comes_back_as_it_was(tmp_path):
    path, again = merl_file(tmp_path / "x.binary"), tmp_path / "y.binary"
    merl.write(merl.table(merl.load(path), SMALL), again)
    assert np.allclose(merl.read(again), merl.read(path), rtol=1e-12)
    assert merl.table(merl.load(path), (9, 6, 10)) is None  # it lies on other nodes


def test_interpolation_is_exact_at_nodes_and_of_second_order_between(tmp_path):
    """Near the horizon, where some nodes around have no value, it is of lower order."""
    wi, wo = pairs(2000, lowest=0.4)
    errors = []
    for n in (1, 2):
        table = merl.read(merl_file(tmp_path / f"{n}.binary", counts=(30 * n, 20 * n, 24 * n)))
        found = merl.load(tmp_path / f"{n}.binary")
        assert np.allclose(merl.interpolate(table, found.wi, found.wo), found.values, rtol=1e-6)
        errors.append(np.abs(merl.interpolate(table, wi, wo) / glossy(wi, wo) - 1).mean())
    assert errors[0] < 0.005 and 3 < errors[0] / errors[1] < 5
    assert np.allclose(merl.interpolate(table, wo, wi), merl.interpolate(table, wi, wo), rtol=1e-6)


def header(*counts, order="<"):
    return np.array(counts, dtype=f"{order}i4").tobytes()


VALUES = np.ones(24, dtype="<f8").tobytes()
FLAWED = {
    "empty": (b"", "it is empty"),
    "half a header": (b"\2\0\0\0\2", "ends in its header, after 5 bytes"),
    "cut short": (header(2, 2, 2) + VALUES[:-1], "dimensions are 2 x 2 x 2, which takes 204 bytes, and it has 203"),
    "too long": (header(2, 2, 2) + VALUES + b"x", "it has 205"),
    "10^27 values": (header(10**9, 10**9, 10**9) + VALUES, "dimensions are 1000000000 x"),
    "that overflow to 0": (header(2**16, 2**16, 2**30), "dimensions are 65536 x"),
    "no values": (header(0, 2, 2), "dimensions are 0 x"),
    "below 0": (header(-2, -2, 2) + VALUES, "dimensions are -2 x"),
    "big-endian": (header(2, 2, 2, order=">") + VALUES, "big-endian"),
    "NaN": (
        header(2, 2, 2) + VALUES[:-8] + np.float64(np.nan).tobytes(),
        "1 of its values are not finite",
    ),
    "huge": (header(2, 2, 2) + VALUES[:-8] + np.float64(1e300).tobytes(), "as large as"),
    "all negative": (header(2, 2, 2) + (-np.ones(24)).tobytes(), "empty"),
}


@pytest.mark.parametrize("name", FLAWED)
def test_what_is_damaged_is_refused_by_name(tmp_path, name):
    content, words = FLAWED[name]
    path = tmp_path / "flawed.binary"
    path.write_bytes(content)
    with pytest.raises(UnreadableFileError, match=words) as refusal:
        merl.load(path)
    assert "flawed.binary" in str(refusal.value)


def test_what_is_no_file_is_refused(tmp_path):
    os.mkfifo(tmp_path / "pipe.binary")
    (tmp_path / "folder.binary").mkdir()
    reasons = {"pipe": "no ordinary file", "folder": "a folder", "none": "no such file", "x" * 999: "no such file"}
    for name, reason in reasons.items():
        with pytest.raises(UnreadableFileError, match=reason):
            merl.load(tmp_path / f"{name}.binary")
    with pytest.raises(UnreadableFileError, match="its ending is"):
        merl.load(tmp_path / "x.txt")


def test_weights_are_solid_angles():
    """Pairs of directions, each even over the hemisphere, have a mean cosine of 1/2, and a mean product of 1/4."""
    wi, wo = merl.nodes()
    weights = merl.solid_angles() * ((wi[:, 2] > 0) & (wo[:, 2] > 0))
    means = [np.average(z, weights=weights) for z in (wi[:, 2], wo[:, 2], wi[:, 2] * wo[:, 2])]
    assert means == pytest.approx([1 / 2, 1 / 2, 1 / 4], rel=5e-3)  # sums over steps of 1 degree, not integrals
