"""A few seconds of what `run.py` does for minutes; and that it would notice."""

import pytest
import run


@pytest.mark.parametrize(
    ("kind", "variant", "count"), [("descriptions", "scalar_rgb", 120), ("files", "scalar_rgb", 42)]
)
def test_nothing_crashes_hangs_or_passes_in_silence(kind, variant, count):
    outcomes = list(run.batch(kind, variant, 3, 0, count, patience=60))
    assert [outcome.index for outcome in outcomes] == list(range(count))
    assert [str(outcome) for outcome in outcomes if outcome.result not in run.GOOD] == []
    assert {outcome.result for outcome in outcomes} == set(run.GOOD)


@pytest.mark.parametrize("count", [300, pytest.param(50_000, marks=pytest.mark.slow)])
def test_damaged_measurements_are_read_or_refused(count):
    """A fifth of the files each are of MERL, RGL, CSV, our own, and RGL's as they are rendered."""
    outcomes = list(run.batch("measured", "llvm_ad_rgb", 3, 0, count, patience=60))
    assert [outcome.index for outcome in outcomes] == list(range(count))
    assert [str(outcome) for outcome in outcomes if outcome.result not in run.GOOD] == []
    for kind in range(5):
        assert {outcome.result for outcome in outcomes[kind::5]} == set(run.GOOD)


WORKER = """
import json, os, sys, time
for index in range(int(sys.argv[4]), int(sys.argv[5])):
    print(json.dumps({"trying": index, "what": ""}), flush=True)
    if index == 1:
        os.abort()
    if index == 2:
        time.sleep(60)
    print(json.dumps({"index": index, "result": "fine", "what": ""}), flush=True)
"""


def test_a_child_that_dies_or_waits_is_noticed_and_replaced(tmp_path, monkeypatch):
    (tmp_path / "worker.py").write_text(WORKER)
    monkeypatch.setattr(run, "HERE", tmp_path)
    results = [outcome.result for outcome in run.batch("descriptions", "scalar_rgb", 1, 0, 4, patience=2)]
    # SIGABRT, and SIGKILL from the watch
    assert results == ["fine", "hung or crashed, status -6: ", "hung or crashed, status -9: ", "fine"]


def test_a_child_that_does_not_start_ends_the_run(tmp_path, monkeypatch):
    (tmp_path / "worker.py").write_text("raise ImportError('nothing there')")
    monkeypatch.setattr(run, "HERE", tmp_path)
    with pytest.raises(RuntimeError, match=r"does not start:(.|\n)*nothing there"):
        list(run.batch("descriptions", "scalar_rgb", 1, 0, 4, patience=2))
