"""`asperity bench`, with numbers that are not measured."""

import json
import signal

import pytest

from asperity import peers
from asperity.lab import bench

QUARTILES = [0.5, 1.0, 1.25]


@pytest.fixture
def measured(monkeypatch):
    """What was asked to be measured; somebody may stop it at a group."""
    groups = []

    def put(stop_at=None):
        def measure(materials, effort, tick):
            groups.append(list(materials))
            if len(groups) == stop_at:
                signal.raise_signal(signal.SIGINT)
            tick("bare")
            row = {"time": QUARTILES, "value": QUARTILES, "ratio": QUARTILES, "noise": QUARTILES, "work": QUARTILES}
            columns = dict.fromkeys((*bench.CALLS, *bench.FRAMES, "first", "memory"), row)
            return {name: {"against": next(iter(materials)), **columns} for name in materials}

        monkeypatch.setattr(bench, "measure", measure)
        return groups

    return put


def test_all_models_and_the_file(asperity, measured, tmp_path):
    groups = measured()
    result = asperity("bench", "--json", "speed.json")
    report = json.loads((tmp_path / "speed.json").read_text())
    assert result.exit_code == 0 and groups == [list(group) for group in peers.GROUPS]
    assert list(report["rows"]) == [name for group in groups for name in group]
    assert report.keys() >= {
        "machine",
        "threads",
        "load",
        "commit",
        "mitsuba",
        "drjit",
        "llvm",
        "size",
        "rounds",
        "lanes",
    }
    assert report["machine"] in result.stdout and "1.00±0.38" in result.stdout


@pytest.mark.parametrize(
    ("arguments", "groups"),
    [
        (("chandrasekhar",), [["diffuse", "chandrasekhar"]]),
        (("twoscale", "--quick"), [["roughconductor, Beckmann", "twoscale"]]),
        (("nickel",), [["roughconductor, Beckmann", "nickel"]]),
        (("plastic", "--set", "int_ior=1.3"), [["diffuse", "plastic, int_ior=1.3"]]),
        (("plastic", "--against", "roughplastic"), [["roughplastic", "plastic"]]),
        (("diffuse", "--against", "diffuse"), [["diffuse, reference", "diffuse"]]),
        (("chandrasekhar", "nickel"), [["diffuse", "chandrasekhar"], ["roughconductor, Beckmann", "nickel"]]),
    ],
)
def test_what_is_timed(asperity, measured, arguments, groups):
    found = measured()
    assert asperity("bench", *arguments).exit_code == 0 and found == groups


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("chandrasekar",), "Did you mean 'chandrasekhar'?"),
        (("--against", "diffuse"), "name a material"),
        (("nickel", "--against", "difuse"), "Did you mean 'diffuse'?"),
        (("nickel", "--set", "alfa=1"), "Did you mean 'alpha'?"),
        (("nickel", "--json", "speed.txt"), "--json speed.txt: the ending is '.txt'"),
        (("nickel", "--json", "taken.json"), "--json taken.json: it exists"),
    ],
)
def test_what_is_wrong_is_told(asperity, measured, tmp_path, arguments, message):
    found = measured()
    (tmp_path / "taken.json").write_text("mine")
    result = asperity("bench", *arguments)
    assert result.exit_code == 2 and message in result.stderr and not found
    assert (tmp_path / "taken.json").read_text() == "mine"


def test_ctrl_c_keeps_the_groups_that_are_done(asperity, measured, tmp_path):
    measured(stop_at=2)
    result = asperity("bench", "--json", "speed.json")
    rows = json.loads((tmp_path / "speed.json").read_text())["rows"]
    assert result.exit_code == 1 and "stopped early" in result.stdout and list(rows) == list(peers.METALS)
