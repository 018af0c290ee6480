"""Mitsuba's own ``measured`` plugin renders what the goniophotometer measured."""

import asperity  # noqa: F401  isort: skip
from dataclasses import replace

import mitsuba as mi
import numpy as np
import pytest

from asperity.errors import ParameterError
from asperity.goniophotometer import Hemisphere, Measurement, Window, measure
from asperity.goniophotometer.sensors import directions
from asperity.goniophotometer.tensor_file import write
from asperity.goniophotometer.tracer import EXTRA, UNIT
from asperity.lab import evaluate
from asperity.models.micrograin.microgeometry import ExplicitGrains
from asperity.scenes.preview import preview

THETA = (0, 15, 30, 45, 60, 75, 85)
ROUGH = {"type": "roughconductor", "distribution": "ggx", "alpha": 0.4, "material": "none"}
BRUSHED = {"type": "roughconductor", "distribution": "ggx", "alpha_u": 0.3, "alpha_v": 0.6, "material": "Au"}
MATTE = {"type": "diffuse", "reflectance": {"type": "rgb", "value": [0.8, 0.4, 0.1]}}
PATHS = 1 << 20


def values(bsdf, wi, wo):
    wi, wo = (evaluate.vectors(np.array(w)) for w in np.broadcast_arrays(wi, wo))
    return np.array(evaluate.eval(bsdf, wi, wo), dtype=float).T


def measured(bsdf, incident, sensor=None, channels=("R", "G", "B"), seen=None):
    """A measurement without noise: means over 4 x 4 directions in each cell."""
    sensor = sensor or Hemisphere()
    wi, grid = directions(incident), sensor.grid(4)
    seen = seen or (lambda wi, wo: values(bsdf, wi, wo))
    means = np.array([seen(w, grid.reshape(-1, 3)).reshape(sensor.cells, 16, -1).mean(axis=1) for w in wi])
    energy = np.zeros((2, len(wi), 1, sensor.cells + EXTRA, len(channels)), dtype=np.uint64)
    energy[:, :, 0, :-EXTRA] = means * sensor.solid_angle * PATHS / UNIT + 0.5
    about = {"sensor": sensor.describe(), "channels": list(channels)}
    labels, paths = np.array([[0, 0], [0, 1]]), np.full((2, len(wi)), PATHS)
    return Measurement(about, np.array(incident, dtype=float), labels, paths, energy, paths[:, 0])


def written(measurement, folder):
    write(measurement, folder / "x.bsdf")
    return mi.load_dict({"type": "measured", "filename": str(folder / "x.bsdf")})


def turn(w, degrees):
    """Turn directions about the normal."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return w @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def flat(phi=0.0):
    return [(theta, phi) for theta in THETA]


def error(plugin, bsdf, theta, phi, turned=0):
    """Mean difference of f cos over the hemisphere, relative to its mean."""
    wi, wo = directions([(theta, phi)]), np.array(evaluate.uniform_hemisphere(1 << 14, 1)).T
    one, two = values(plugin, wi, wo), values(bsdf, turn(wi, turned), turn(wo, turned))
    return np.abs(one - two).sum() / two.sum()


@pytest.mark.parametrize(
    "description, at, between",
    [
        (ROUGH, (0.006, 0.008, 0.011, 0.025), (0.016, 0.03, 0.1)),
        (MATTE, (0.003, 0.003, 0.003, 0.005), (0.03, 0.04, 0.06)),
    ],
)
def test_the_plugin_returns_what_was_measured(rgb, tmp_path, description, at, between):
    """Error at measured θ_i: that of the cells; half-way between: of linear interpolation, 10 to 15 degrees apart."""
    bsdf = mi.load_dict(description)
    plugin = written(measured(bsdf, flat(20)), tmp_path)
    for theta, most in zip((0.1, 30, 60, 85, 22, 52, 80), at + between):
        assert error(plugin, bsdf, theta, 70) < most, theta


def test_anisotropic(rgb, tmp_path):
    """Turned out of all symmetry: mirrored, it errs by 0.5. φ_i in any order and from anywhere; at the seam, too."""
    bsdf = mi.load_dict(BRUSHED)
    incident = [(theta, phi) for phi in range(330, -30, -30) for theta in THETA]
    seen = measured(bsdf, incident, seen=lambda wi, wo: values(bsdf, turn(wi, 25), turn(wo, 25)))
    plugin = written(seen, tmp_path)
    assert error(plugin, bsdf, 30, 30, -25) > 0.1
    for phi in (0, 150, 180, -90, 30):
        assert error(plugin, bsdf, 30, phi, 25) < 0.015, phi
    for phi in (165, -165, 195, 15):
        assert error(plugin, bsdf, 30, phi, 25) < 0.04, phi


@pytest.mark.parametrize("description", [ROUGH, MATTE])
def test_samples_have_the_density_and_the_albedo(rgb, tmp_path, description):
    measurement = measured(mi.load_dict(description), flat())
    plugin = written(measurement, tmp_path)
    for row in (1, 2, 4, 6):
        wi = evaluate.direction(THETA[row], 200)
        drawn, weight = evaluate.sample(plugin, wi, *evaluate.variates(1 << 16, 0))
        weight, z = np.array(weight, dtype=float).T, np.array(drawn.wo.z)
        value, density = (np.array(x, dtype=float) for x in evaluate.eval_pdf(plugin, wi, drawn.wo))
        up = z > 0.01
        assert np.allclose(density[up], np.array(drawn.pdf)[up], rtol=0.01)
        assert np.allclose(weight[up], value.T[up] / density[up, None], rtol=0.01, atol=1e-4)
        assert weight[:, 0].max() < 2 * weight[:, 0].mean()
        # Measured: 0.03%, and 0.3% at 85 degrees, where the table is coarse for what is near the horizon.
        assert weight.mean(axis=0) == pytest.approx(measurement.total_albedo.value[row], rel=0.005)


def test_wavelengths(tmp_path):
    """In any order; linear between them."""
    mi.set_variant("llvm_ad_spectral")
    channels = ("650 nm", "450 nm")
    measurement = measured(None, flat(), channels=channels, seen=lambda wi, wo: wo[:, 2:] / np.pi * [[0.65, 0.45]])
    plugin = written(measurement, tmp_path)
    wi, wo = evaluate.direction(30, 0), evaluate.direction(40, 100)
    si = evaluate.interaction(wi)
    si.wavelengths = [460, 500, 600, 640]
    f = np.array(plugin.eval(mi.BSDFContext(), si, wo)).ravel() * np.pi / np.cos(np.radians(40))
    assert f == pytest.approx([0.46, 0.5, 0.6, 0.64], rel=0.005)


def test_a_simulated_material_is_rendered(rgb, tmp_path):
    """Grains that scatter once, traced, against the model: measured -0.9% in the whole picture, +1.9% in the middle.

    A tile of 1024 grains has its own randomness, of some percent.
    """
    traced = measure(ExplicitGrains(tau_0=0.5, grains=1024), flat(), orders=1, paths=1 << 18, tiles=4)
    write(traced, tmp_path / "grains.bsdf")
    model = {"type": "micrograin", "tau_0": 0.5, "base": {"type": "diffuse", "reflectance": 0.0}}
    materials = {"type": "measured", "filename": str(tmp_path / "grains.bsdf")}, model
    a, b = (np.array(mi.render(mi.load_dict(preview(m, object="sphere", size=(32, 32), spp=16)))) for m in materials)
    assert a.mean() == pytest.approx(b.mean(), rel=0.02)
    middle = np.s_[12:20, 12:20]
    assert a[middle].mean() == pytest.approx(b[middle].mean(), rel=0.04)


def test_nothing_reflected(rgb, tmp_path):
    """No light is no sampling density: the file has one all the same."""
    plugin = written(measured(None, flat(), seen=lambda wi, wo: 0 * wo), tmp_path)
    _, weight = evaluate.sample(plugin, evaluate.direction(30, 0), *evaluate.variates(100, 0))
    assert np.all(np.array(weight) == 0)


def test_errors(rgb, tmp_path):
    good = measured(None, flat(), Hemisphere(2, 4), seen=lambda wi, wo: wo)
    angles = {
        "increasing": [[0, 0]] + [[85 - t, 0] for t in range(6)],
        "two": [[30, phi] for phi in range(0, 350, 50)],
        "evenly": [[t, phi] for t in (0, 30) for phi in (0, 90, 180)] + [[0, 270]],
        "each": [[t, phi] for t, phi in zip((0, 30, 60, 0, 30, 60, 0), (0, 0, 0, 180, 180, 180, 0))],
    }
    bad = {word: replace(good, incident=np.array(incident, dtype=float)) for word, incident in angles.items()}
    bad["sensor"] = replace(good, about=good.about | {"sensor": Window().describe()})
    bad["finite"] = replace(good, paths=0 * good.paths)
    for word, measurement in bad.items():
        with pytest.raises(ParameterError, match=word):
            write(measurement, tmp_path / "x.bsdf")
    assert not list(tmp_path.iterdir())


def test_nothing_half_written(rgb, tmp_path, monkeypatch):
    """A disk that is full leaves the old file."""
    from mitsuba.python import tensor_io

    good = measured(None, flat(), Hemisphere(2, 4), seen=lambda wi, wo: np.abs(wo))
    (tmp_path / "x.bsdf").write_text("old")

    def full(path, **fields):
        with open(path, "w") as file:
            file.write("half")
        raise OSError("no space left")

    monkeypatch.setattr(tensor_io, "write", full)
    with pytest.raises(OSError):
        write(good, tmp_path / "x.bsdf")
    assert [file.read_text() for file in tmp_path.iterdir()] == ["old"]
