"""`lab.bench`: what is measured, in small."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import numpy as np
import pytest

from asperity.errors import ParameterError
from asperity.lab import bench
from asperity.lab.bench import first, timing

pytestmark = pytest.mark.usefixtures("rgb")
TINY = bench.Effort(size=24, spp=16, rounds=3, lanes=1 << 10, fresh=2)
METAL = {"type": "roughconductor", "alpha": 0.5}


def test_tasks_take_turns():
    called = []
    tasks = {name: lambda name=name: called.append(name) or len(called) for name in "ab"}
    seconds, results = timing.turns(tasks, 3)
    assert "".join(called) == "ab" + "ba" + "ab" + "ba"
    assert [len(times) for times in seconds.values()] == [3, 3] and results == {"a": [4, 5, 8], "b": [3, 6, 7]}


def test_quartiles_of_what_is_known():
    assert timing.quartiles(np.arange(5)) == [1, 2, 3]


def test_variance_of_known_noise():
    """A standard deviation of a tenth of the mean, by 3 x 10^4 numbers a pair: its square is known to 1 %."""
    pictures = list(5 + 0.5 * np.random.default_rng(0).normal(size=(4, 100, 100, 4)))
    assert bench.relative_variance(pictures) == pytest.approx(0.01, rel=0.04)
    assert len(bench.relative_variance(pictures)) == 3


def test_black_pictures_have_no_noise():
    assert list(bench.relative_variance([np.zeros((2, 2, 3))] * 3)) == [0, 0]


def test_a_group(monkeypatch):
    """All columns, against the first; of new processes only what is made of their numbers.

    Both are the same metal. The second samples normals that are not seen, and so its noise is more.
    """
    given = iter([first.First(2, 3, 100), first.First(4, 5, 150), first.First(2, 3, 100), first.First(8, 9, 150)])
    monkeypatch.setattr(bench, "first_picture", lambda material, variant: next(given))
    ticks = []
    rows = bench.measure({"seen": METAL, "all": METAL | {"sample_visible": False}}, TINY, ticks.append)
    assert list(rows) == ["seen", "all"] and len(ticks) == bench.steps(rows, TINY)
    columns = {"against", *bench.CALLS, *bench.FRAMES, "first", "memory"}
    assert all(row.keys() == columns and row["against"] == "seen" for row in rows.values())
    for column in columns - {"against"}:
        ratios = [rows["seen"][column][name] for name in ("ratio", "noise", "work") if name in rows["seen"][column]]
        assert ratios == [[1, 1, 1]] * len(ratios) and len(ratios) == (3 if column in bench.FRAMES else 1)
        numbers = [quartiles for name, quartiles in rows["all"][column].items()]
        assert all(0 < low <= middle <= high for low, middle, high in numbers), column
    assert rows["all"]["filled"]["noise"][0] > 1.1
    assert rows["all"]["first"]["ratio"] == [2.5, 3, 3.5] and rows["all"]["memory"]["value"][1] == 150


def test_the_first_picture_of_a_new_process():
    """Its memory is its own: Linux counts the parent's to a child, until that runs a program of its own."""
    ballast = np.ones(2**27)  # 1 GiB
    found = first.first_picture(METAL, "scalar_rgb")
    assert 0 < found.wall < 120 and found.cpu > 0 and 50 < found.memory < ballast.nbytes / 2**20


@pytest.mark.parametrize("size", [3, 4])
def test_transformations_reach_a_new_process(size):
    turn = {3: mi.ScalarTransform3f().rotate(30), 4: mi.ScalarTransform4f().rotate([0, 0, 1], 30)}[size]
    (heard,) = first.heard(first.told({"to_uv": turn})).values()
    assert type(heard) is type(turn) and np.allclose(heard.matrix, turn.matrix)


def test_what_cannot_be_told():
    with pytest.raises(ParameterError, match="a Bitmap"):
        first.told({"texture": {"bitmap": mi.Bitmap(np.zeros((2, 2, 3), np.float32))}})


def test_a_picture_that_cannot_be_made_is_told():
    with pytest.raises(RuntimeError, match="no picture of 'nothing'"):
        first.first_picture({"type": "nothing"}, "scalar_rgb")


def test_the_machine_is_named():
    about = bench.circumstances()
    assert about["machine"] and about["threads"] > 0 and about["variant"] == mi.variant()
