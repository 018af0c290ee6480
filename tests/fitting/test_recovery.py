"""Parameters of each model are found again from its own values with noise, or the fit says that it cannot."""

import importlib
from pathlib import Path

import pytest

QUICK = ("lambertsphere", "interfacedlambertian")
MODELS = ("micrograin", "lambertsphere", "interfacedlambertian", "twoscale", "vgroove")


@pytest.fixture
def recovery(rgb, monkeypatch):
    monkeypatch.syspath_prepend(Path(__file__).parents[2] / "benchmarks")
    return importlib.import_module("recovery")


@pytest.mark.parametrize("seed", (1, 2))
@pytest.mark.parametrize(
    "model", [pytest.param(model, marks=() if model in QUICK else pytest.mark.slow) for model in MODELS]
)
def test_parameters_are_found_or_said_to_be_undetermined(recovery, model, seed):
    """One of ten numbers is beyond three standard errors with a chance of 3 %: as in set 0 of twoscale, by 3.1."""
    found, numbers = recovery.recovered(model, seed)
    assert recovery.is_found(numbers), [one for one in numbers if one.off >= recovery.SIGMAS]
    assert found.errors.log_cosine < recovery.NOISE  # what is relative to f cosθ is less than that of 1 + f cosθ
    moved = [one._replace(truth=one.truth + 4 * one.found.error) for one in numbers if one.determined]
    assert not moved or not recovery.is_found(moved)


def test_all_models_are_there(recovery):
    assert set(MODELS) == recovery.MODELS.keys()
