"""Masking alone: identities of any height field, and what it refuses."""

import numpy as np
import pytest

import asperity  # noqa: F401  isort: skip
import mitsuba as mi

from asperity.errors import ParameterError
from asperity.goniophotometer import Hemisphere
from asperity.goniophotometer.masking import measure_masking
from asperity.models.micrograin import ExplicitGrains

pytestmark = pytest.mark.usefixtures("rgb")
WHOLE = {"sensor": Hemisphere(1, 1), "points": 2**19, "tiles": 16}


def test_everything_exposed_is_seen_from_above():
    measured = measure_masking(ExplicitGrains(0.4, 0.5, 2.0), [(0, 0)], **WHOLE)
    assert np.array_equal(measured.exposed, measured.seen)
    grains, base = (measured.visible(part) for part in ("grains", "base"))
    assert abs(grains.value[0] - 0.4) < 5 * grains.error[0] and grains.error[0] < 0.002
    assert grains.value + base.value == pytest.approx(1)


def test_of_a_flat_surface_nothing_is_hidden():
    measured = measure_masking(ExplicitGrains(0.0), [(89, 10)], [(80, 200)], **WHOLE)
    assert measured.parts[-1] == "base" and measured.visible("base").value[0] == 1


def test_masking_is_local_times_distant_and_ends_at_the_local_horizon():
    sensor = Hemisphere(8, 16)
    measured = measure_masking(ExplicitGrains(0.5), [(70, 0)], sensor=sensor, points=2**20, tiles=8)
    grains = measured.parts.index("grains")
    local, distant, masking = (getattr(measured, name).value[0, grains] for name in ("local", "distant", "masking"))
    both = ~np.isnan(distant)
    assert np.allclose(masking[both], (local * distant)[both])
    cos = sensor.grid(8) @ np.array([np.sin(np.radians(70)), 0, np.cos(np.radians(70))])  # eight steps from a corner
    assert np.all(local[(cos > 0.1).all(axis=1)] == 1) and np.all(local[(cos < -0.1).all(axis=1)] == 0)


def test_pairs_are_symmetric_and_retro_is_masking_alone():
    geometry, pairs = ExplicitGrains(0.5, 1.5, 0.5), ([(60, 0), (30, 90), (60, 0)], [(30, 90), (60, 0), (60, 0)])
    there, back, retro = measure_masking(geometry, *pairs, **WHOLE).visible("base").value
    alone = measure_masking(geometry, [(60, 0)], **WHOLE).visible("base")
    assert there == pytest.approx(back, abs=6 * alone.error[0])
    assert retro == pytest.approx(alone.value[0], abs=6 * alone.error[0]) and retro > there


@pytest.mark.parametrize(
    ("directions", "complaint"),
    [
        (([],), "at least one direction"),
        (([(95, 0)],), "theta = 95"),
        (([(5, 0)], [(5, 0), (6, 0)]), "as many directions"),
    ],
)
def test_clear_errors(directions, complaint):
    with pytest.raises(ParameterError, match=complaint):
        measure_masking(ExplicitGrains(0.5), *directions, **WHOLE)


def test_overhangs_are_refused():
    geometry = ExplicitGrains(0.5)
    object.__setattr__(geometry, "overhangs", 3)
    with pytest.raises(ParameterError, match="3 faces overhang"):
        measure_masking(geometry, [(5, 0)], **WHOLE)


def test_spectral_variants_count_the_same():
    mi.set_variant("llvm_ad_spectral")
    assert measure_masking(ExplicitGrains(0.4), [(0, 0)], **WHOLE).seen.sum() == 2**19


@pytest.mark.parametrize("wrong", [{"points": 0}, {"points": np.nan}, {"tiles": 0}, {"seed": -1}])
def test_impossible_efforts(wrong):
    with pytest.raises(ParameterError, match="expected a"):
        measure_masking(ExplicitGrains(0.5), [(5, 0)], **WHOLE | wrong)
