"""The instrument: energy, errors, seeds, and what it refuses."""

import sys

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

import asperity  # noqa: F401
from asperity.errors import AsperityError, ParameterError, UnknownNameError
from asperity.goniophotometer import Hemisphere, Measurement, Points, Window, measure, merge
from asperity.goniophotometer.sensors import by_name, directions, from_description
from asperity.lab import evaluate
from asperity.models.lambertsphere import RandomWalk
from asperity.models.micrograin import ExplicitGrains

pytestmark = pytest.mark.usefixtures("rgb")
WHITE = {"type": "diffuse", "reflectance": 1.0}
GREY = {"type": "diffuse", "reflectance": 0.4}
FEW = {"paths": 2**16, "tiles": 8}


def t_limit(numbers, tiles):
    """Student's t that the largest of so many deviations exceeds in 0.1 % of all cases: errors come from tiles."""
    return stats.t.isf(0.0005 / numbers, tiles - 1)


@pytest.mark.filterwarnings("ignore:theta = 89.9")  # a furnace is white however often its tile repeats
@pytest.mark.parametrize("theta", [0.0, 60.0, 89.9])
def test_white_furnace_is_exact(theta):
    # All facets return all light, and energy is counted in integers: not a unit may be missing. But a GPU's division,
    # of which weights are made, is off by up to two roundings, 2.4e-7; few paths meet more than eight facets.
    measured = measure(ExplicitGrains(0.5, 1.5, 0.7, base=WHITE), [(theta, 10)], **FEW)
    every = measured.total_albedo.value + measured.cut.value
    rounding = 2e-6 if mi.variant().startswith("cuda") else 0
    assert np.all(np.abs(every - 1) <= rounding)
    assert np.all(measured.transmitted.value == 0) and measured.cut.value.max() < 1e-4


def test_a_flat_mirror_sends_all_light_to_one_cell():
    flat = ExplicitGrains(0.0, base={"type": "conductor", "material": "none"})
    measured = measure(flat, [(50, 30)], **FEW)
    cells = measured.summed.value[0, :, 0] * measured.sensor.solid_angle
    towards = measured.sensor.directions(measured.wi[0])[np.argmax(cells), 0]
    mirrored = directions([(50, 210)])[0]
    assert cells.max() == 1 and np.degrees(np.arccos(towards @ mirrored)) < 4


@pytest.mark.parametrize("sensor", [Hemisphere(8, 16), Window("mirror", 20, 4), Window("normal", 40, 8)])
def test_a_lambertian_plane_is_lambertian(sensor):
    measured = measure(ExplicitGrains(0.0, base=GREY), [(50, 30)], sensor=sensor, paths=2**20, tiles=16)
    cos = sensor.directions(measured.wi[0], 8)[..., 2].mean(axis=1)
    value, error = (part[0, :, 0] for part in measured.summed)
    assert np.max(np.abs(value - 0.4 * cos / np.pi) / error) < t_limit(sensor.cells, 16)
    assert measured.total_albedo.value[0, 0] == pytest.approx(0.4, abs=1e-6)


def test_points_agree_with_cells():
    geometry = ExplicitGrains(0.5, grain=GREY, base=GREY)
    cells = measure(geometry, [(60, 0)], sensor=Window("retro", 4, 1), apart=2, paths=2**20)
    point = measure(geometry, [(60, 0)], sensor=Points(((60.0, 0.0),)), apart=2, paths=2**18)
    average = evaluate.cell_means  # the retro peak is a cusp: a window of 4 degrees is lower than its middle
    bsdf = mi.load_dict({"type": "micrograin", "tau_0": 0.5, "specular": False, "diffuse_reflectance": 0.4,
                         "base": GREY})  # fmt: skip
    ratio = float(average(bsdf, cells.wi[0], cells.sensor.directions(cells.wi[0], 32))[0, 0])
    ratio /= float(average(bsdf, point.wi[0], point.sensor.directions(point.wi[0]))[0, 0])
    (a, da), (b, db) = ((m.values.value[0, 0, 0, 0], m.values.error[0, 0, 0, 0]) for m in (cells, point))
    assert abs(a - b * ratio) < 4 * np.hypot(da, db * ratio) and db < 0.002 * b
    assert np.allclose(point.total_albedo.value, cells.total_albedo.value, atol=5 * cells.total_albedo.error.max())


def test_the_error_covers_the_tiles():
    # 60 measurements of few tiles: their deviations from the truth in standard errors must follow Student's t. Ray
    # noise alone would be a quarter of this error.
    truth = 0.33677  # of the model, which is exact here: see test_micrograin.py
    geometry = ExplicitGrains(0.5, grains=256)
    found = [measure(geometry, [(45, 0)], orders=1, paths=2**18, tiles=4, seed=seed) for seed in range(60)]
    values, errors = (np.array([getattr(m.total_albedo, name)[0, 0] for m in found]) for name in ("value", "error"))
    rays = np.sqrt(truth * (1 - truth) / 2**18)
    assert np.median(errors) > 3 * rays
    assert stats.kstest((values - truth) / errors, stats.t(3).cdf).pvalue > 0.001


def test_orders_add_up_and_the_limit_cuts():
    geometry = ExplicitGrains(0.5, base=WHITE)
    every = measure(geometry, [(30, 0)], apart=3, **FEW)
    first = measure(geometry, [(30, 0)], orders=1, **FEW)
    assert np.allclose(every.albedo.value.sum(axis=1), every.total_albedo.value)
    assert np.allclose(every.albedo.value[:, 0], first.total_albedo.value)  # the same paths, cut short
    assert np.allclose(first.total_albedo.value + first.cut.value, 1)
    assert np.allclose(every.values.value.sum(axis=1), every.summed.value)


def test_the_same_seed_gives_the_same_bits_and_another_does_not():
    one, same, other = (measure(ExplicitGrains(0.4), [(30, 0)], seed=seed, **FEW) for seed in (1, 1, 2))
    assert np.array_equal(one.energy, same.energy) and not np.array_equal(one.energy, other.energy)


def test_merging_and_continuing():
    geometry = ExplicitGrains(0.4)
    a, b = (measure(geometry, [(30, 0), (60, 0)], seed=seed, **FEW) for seed in (1, 2))
    both = merge([a, b])
    assert np.array_equal(both.energy, merge([b, a]).energy)
    assert np.array_equal(both.energy.sum(axis=0), a.energy.sum(axis=0) + b.energy.sum(axis=0))
    more = measure(geometry, [(30, 0), (60, 0)], seed=1, before=a, **FEW)
    assert more.total_paths == 2 * a.total_paths and np.all(more.energy >= a.energy)
    assert a.total_paths == 2 * FEW["paths"]  # untouched
    with pytest.raises(ParameterError, match="seed 1 is there twice"):
        merge([a, a])
    with pytest.raises(ParameterError, match="geometry differs"):
        merge([a, measure(ExplicitGrains(0.5), [(30, 0), (60, 0)], seed=3, **FEW)])
    with pytest.raises(ParameterError, match="directions of incidence differ"):
        measure(geometry, [(31, 0), (60, 0)], before=a, **FEW)


def test_stopping_keeps_what_there_is():
    seen = []
    measured = measure(
        ExplicitGrains(0.4, base=WHITE),
        [(30, 0)],
        progress=lambda done, total: seen.append((done, total)),
        stop=lambda: len(seen) == 3,
        **FEW,
    )
    assert seen[-1] == (3 * 2**13, 2**16) and measured.total_paths == 3 * 2**13
    assert measured.total_albedo.value[0, 0] == pytest.approx(1, abs=1e-4)
    assert not measured.finished


@pytest.mark.parametrize("sensor", [None, Points(((10.0, 0.0), (40.0, 90.0), (70.0, 180.0)))])
def test_where_it_was_stopped_does_not_matter(monkeypatch, tmp_path, sensor):
    # Three batches for each of two directions on each of two tiles; the last ones are smaller.
    monkeypatch.setattr(sys.modules["asperity.goniophotometer.measure"], "BATCH", 1000)
    geometry, incident = ExplicitGrains(0.4, grain=GREY, base=GREY), [(30, 0), (60, 0)]
    few = {"sensor": sensor, "paths": 5000, "tiles": 2, "interval": 0}
    parts = []
    once = measure(geometry, incident, checkpoint=parts.append, **few)
    assert once.finished and [part.total_paths for part in parts] == sorted({part.total_paths for part in parts})
    for k, part in enumerate(parts[:-1]):
        assert not part.finished
        part.save(tmp_path / f"{k}.npz")
        rest = measure(geometry, incident, sensor=sensor, before=Measurement.load(tmp_path / f"{k}.npz"))
        assert np.array_equal(rest.paths, once.paths) and np.array_equal(rest.energy, once.energy)
    assert np.array_equal(measure(geometry, incident, before=once, **few).paths, 2 * once.paths)


def test_checkpoints_in_a_file_go_on_and_leave_the_result_as_it_is(monkeypatch, tmp_path):
    """A description may hold tuples, and a file has none. What is saved must not fix the values of what is to come."""
    monkeypatch.setattr(sys.modules["asperity.goniophotometer.measure"], "BATCH", 1000)
    geometry, batches = RandomWalk((0.8, 0.5, 0.2)), []
    few = {"paths": 5000, "tiles": 2, "interval": 0, "checkpoint": tmp_path / "part.npz"}
    once = measure(geometry, [(30, 0)], **few)
    assert np.array_equal(once.albedo.value, once.copy().albedo.value)
    part = measure(geometry, [(30, 0)], stop=lambda: batches.append(1) or len(batches) == 3, **few)
    saved = Measurement.load(tmp_path / "part.npz")
    assert 0 < saved.total_paths < part.total_paths < once.total_paths and part.missing.sum() == 5000 - 3000
    rest = measure(geometry, [(30, 0)], before=saved)
    assert np.array_equal(rest.energy, once.energy)


def test_a_checkpoint_that_fails_is_only_a_warning(tmp_path):
    few = {"paths": 100, "tiles": 2, "interval": 0}
    with pytest.warns(UserWarning, match="no checkpoint: cannot write .*none/part.npz: No such file"):
        measured = measure(RandomWalk(), [(30, 0)], checkpoint=tmp_path / "none" / "part.npz", **few)
    assert measured.finished


def test_only_the_same_tiles_go_on():
    before = measure(RandomWalk(), [(30, 0)], paths=100, tiles=2, seed=1)
    for option in ({"tiles": 3}, {"seed": 0}):
        with pytest.raises(ParameterError, match=f"{next(iter(option))} = .*: before has .*merge"):
            measure(RandomWalk(), [(30, 0)], before=before, **option)


def test_what_a_file_cannot_keep_is_refused_at_once():
    with pytest.raises(ParameterError, match=r"note: a measurement cannot keep its description: .*ndarray"):
        measure(RandomWalk(), [(30, 0)], about={"note": np.zeros(3)}, **FEW)


@pytest.mark.parametrize(
    ("options", "sensor"),
    [
        ({}, Hemisphere()),
        ({"cells": (4, 8)}, Hemisphere(4, 8)),
        ({"name": "retro"}, Window("retro")),
        ({"name": "normal", "radius": 5, "cells": [6]}, Window("normal", 5, 6)),
        ({"towards": [(30, 0)]}, Points(((30, 0),))),
    ],
)
def test_sensors_by_name(options, sensor):
    assert by_name(**options) == sensor


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"name": "retor"}, "sensor 'retor'. Did you mean 'retro'"),
        ({"name": "points"}, "towards: "),
        ({"cells": (4,)}, "cells: sensor hemisphere takes ROWSxCOLUMNS"),
        ({"name": "mirror", "cells": (4, 8)}, "cells: sensor mirror takes N"),
        ({"radius": 5}, "radius: makes no sense with sensor hemisphere"),
    ],
)
def test_no_sensor_by_that_name(options, complaint):
    with pytest.raises(AsperityError, match=complaint):
        by_name(**options)


@pytest.mark.parametrize(
    "sensor", [Hemisphere(5, 7), *(Window(about, 12, 6) for about in ("retro", "mirror", "normal"))]
)
def test_cells_hold_their_own_directions_and_equal_solid_angles(sensor):
    wi = directions([(40, 70)])[0]
    local = sensor.grid(4)
    cell, inside = sensor.locate(evaluate.vectors(local.reshape(-1, 3)))
    assert np.all(np.array(inside)) and np.array_equal(np.array(cell), np.repeat(np.arange(sensor.cells), 16))
    everywhere = mi.warp.square_to_uniform_hemisphere(evaluate.variates(2**20, 1)[1])
    cell, inside = (np.array(x) for x in sensor.locate(everywhere))
    counts = np.bincount(np.broadcast_to(cell, 2**20)[np.broadcast_to(inside, 2**20)], minlength=sensor.cells)
    expected = 2**20 * sensor.solid_angle / (2 * np.pi)
    assert stats.chisquare(counts, np.full(sensor.cells, counts.mean())).pvalue > 0.001
    assert abs(counts.mean() - expected) < 4 * np.sqrt(expected / sensor.cells)
    assert from_description(sensor.describe()) == sensor
    assert np.allclose(np.linalg.norm(sensor.directions(wi), axis=-1), 1)


def test_spectral_variants_measure_wavelengths():
    mi.set_variant("llvm_ad_spectral")
    gold = ExplicitGrains(0.3, grain={"type": "conductor", "material": "Au"})
    measured = measure(gold, [(30, 0)], orders=1, wavelengths=[450, 500, 600, 700], **FEW)
    blue, _, orange, red = measured.total_albedo.value[0]
    assert red > orange > 1.5 * blue and measured.about["channels"][0] == "450 nm"
    with pytest.raises(ParameterError, match="expected 4 of them"):
        measure(gold, [(30, 0)], wavelengths=[450], **FEW)


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ({"incident": [(90, 0)]}, "theta = 90"),
        ({"incident": [(-1, 0)]}, "theta = -1"),
        ({"incident": [(np.nan, 0)]}, "theta = nan"),
        ({"incident": []}, "at least one direction"),
        ({"orders": 0}, "orders = 0"),
        ({"tiles": 1}, "tiles = 1"),
        ({"paths": 0.5}, "paths = 0.5"),
        ({"paths": np.inf}, "paths = inf"),
        ({"seed": -1}, "seed = -1"),
        ({"wavelengths": [500]}, "wavelengths"),
        ({"sensor": Points(((30.0, 0.0),))}, "'grains' are mirrors"),
    ],
)
def test_clear_errors(options, complaint):
    with pytest.raises(ParameterError, match=complaint):
        measure(ExplicitGrains(0.3), **({"incident": [(30, 0)]} | FEW | options))


@pytest.mark.parametrize(
    "make",
    [
        lambda: Hemisphere(0, 4),
        lambda: Window("sideways"),
        lambda: Window("retro", 100),
        lambda: Points(()),
        lambda: Points(((95.0, 0.0),)),
        lambda: ExplicitGrains(1.0),
        lambda: ExplicitGrains(0.5, beta_x=0),
        lambda: ExplicitGrains(0.5, grains=0),
        lambda: ExplicitGrains({"type": "bitmap"}),
    ],
)
def test_impossible_sensors_and_grains(make):
    with pytest.raises(AsperityError):
        make()


def test_unknown_window_suggests_the_nearest():
    with pytest.raises(UnknownNameError, match="'mirror'"):
        Window("miror")


def test_scalar_variants_are_refused():
    mi.set_variant("scalar_rgb")
    with pytest.raises(ParameterError, match="llvm_ad_rgb"):
        measure(ExplicitGrains(0.3), [(30, 0)], **FEW)


def test_light_along_the_surface_is_given_up():
    # A facet that reflects exactly along the plane: such rays meet neither facets nor the top.
    class Grazing(mi.BSDF):
        def __init__(self, props):
            mi.BSDF.__init__(self, props)
            self.m_components = [int(mi.BSDFFlags.GlossyReflection | mi.BSDFFlags.FrontSide)]
            self.m_flags = self.m_components[0]

        def sample(self, ctx, si, sample1, sample2, active=True):
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo, bs.eta, bs.pdf = mi.Vector3f(1, 0, 0), 1, 1
            return bs, mi.Spectrum(1) & active

    mi.register_bsdf("grazing", Grazing)
    measured = measure(ExplicitGrains(0.0, base={"type": "grazing"}), [(30, 0)], paths=64, tiles=2)
    assert measured.cut.value[0, 0] == 1 and measured.total_albedo.value[0, 0] == 0


def test_every_point_gets_its_share_of_the_paths():
    # 7 points and paths that are no multiple of 7: a flat white plane is known without noise, for order 1.
    sensor = Points(tuple((10.0 * k, 30.0 * k) for k in range(7)))
    flat = ExplicitGrains(0.0, grain=WHITE, base=WHITE)
    measured = measure(flat, [(30, 0)], sensor=sensor, orders=1, paths=1000, tiles=4)
    expected = np.cos(np.radians([10.0 * k for k in range(7)])) / np.pi
    assert np.allclose(measured.summed.value[0, :, 0], expected, rtol=1e-4)


def test_a_batch_of_one_path():
    assert measure(ExplicitGrains(0.0, base=WHITE), [(30, 0)], paths=2, tiles=2).total_albedo.value[0, 0] == 1


def test_a_tile_that_light_crosses_more_than_once():
    with pytest.warns(UserWarning, match="crosses 1"):
        measure(ExplicitGrains(0.5, grains=256), [(88.5, 0)], orders=1, **FEW)
