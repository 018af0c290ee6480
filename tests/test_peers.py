"""What models are timed beside."""

import pytest

from asperity import peers
from asperity.models import MODELS

NAMES = [name for group in peers.GROUPS for name in group]


def test_every_model_is_timed_beside_one_of_mitsubas():
    assert {peers.model_of(name) for name in NAMES} >= MODELS.keys() and len(set(NAMES)) == len(NAMES)
    for group in peers.GROUPS:
        reference, *others = group.items()
        assert reference[1]["type"] not in MODELS
        assert all(peers.model_of(name) == one["type"] in MODELS for name, one in others)


def test_little_time_leaves_references_and_most_models():
    short = peers.groups(quick=True)
    assert set(NAMES) > peers.EXTRA and [next(iter(group)) for group in short] == [next(iter(g)) for g in peers.GROUPS]
    left = {peers.model_of(name) for group in short for name in group}
    assert MODELS.keys() - left == {"deon", "merillou"}


def test_a_model_and_any_material():
    assert list(peers.of_model("orennayar")) == ["diffuse", "orennayar, full", "orennayar, qualitative"]
    assert peers.of_model("plastic") is None
    assert list(peers.beside("nickel", {"type": "twoscale"})) == ["roughconductor, Beckmann", "nickel"]
    assert list(peers.beside("mine", {"type": "plastic"})) == ["diffuse", "mine"]


@pytest.mark.parametrize("group", peers.GROUPS, ids=lambda group: next(iter(group)))
def test_all_are_materials(rgb, group):
    from asperity.lab import evaluate

    for description in group.values():
        evaluate.load(description)
