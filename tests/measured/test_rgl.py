"""RGL's files: values that agree with what Mitsuba renders, where the file has its own."""

import asperity  # noqa: F401  isort: skip
import contextlib
import io
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from data import real
from mitsuba.python import tensor_io

from asperity import loading
from asperity.errors import ParameterError, UnreadableFileError
from asperity.measured import rgl

THETA, SIZE = np.radians([0, 40, 80]), 8


def fields(phi=(0.0,), channels=3, **changed):
    """Tables of random numbers; ``vndf`` is not constant."""
    random = np.random.default_rng(1)
    name = "rgb" if channels == 3 else "spectra"
    shape = (len(phi), len(THETA))
    tables = {
        "phi_i": np.array(phi),
        "theta_i": THETA,
        "ndf": np.full((2, 2), 4),
        "sigma": np.ones((2, 2)),
        "vndf": random.uniform(0.5, 1.5, (*shape, 6, 6)),
        "luminance": np.ones((*shape, SIZE, SIZE)),
        name: random.uniform(0.1, 1, (*shape, channels, SIZE, SIZE)),
    }
    if channels != 3:
        tables["wavelengths"] = np.linspace(450, 650, channels)
    single = {name: np.float32(table) for name, table in tables.items()}
    return single | {"description": "a test", "jacobian": np.ones(1, dtype=np.uint8)} | changed


def written(path, **tables):
    with contextlib.redirect_stdout(io.StringIO()):
        tensor_io.write(path, **{name: table for name, table in tables.items() if table is not None})
    return path


@pytest.mark.parametrize("phi", [(0.0,), tuple(np.radians([-180, -60, 60, 180]))])
@pytest.mark.parametrize("variant, channels", [("llvm_ad_rgb", 3), ("llvm_ad_spectral", 5)])
def test_values_are_those_of_the_table_at_its_vertices(tmp_path, phi, variant, channels):
    """By the plugin's formula spectra(m) ndf(m) / (4 sigma), here spectra(m), in single precision. A random table has
    several values where the azimuth of m has no meaning, at θ_m = 0, and at the seam; θ_i = 0 is left out, too: there
    the plugin has other azimuths."""
    mi.set_variant(variant)
    tables = fields(phi, channels)
    found = rgl.load(written(tmp_path / "x.bsdf", **tables))
    table = np.moveaxis(tables["rgb" if channels == 3 else "spectra"], 2, -1).reshape(-1, channels)
    wi, wo = rgl._vertices(tables)
    above = (wi[:, 2] > rgl.LEAST) & (wo[:, 2] > rgl.LEAST)
    azimuth, theta, y, x = np.unravel_index(np.flatnonzero(above), (len(phi), len(THETA), SIZE, SIZE))
    inside = (theta > 0) & (x > 0) & (y > 0) & (y < SIZE - 1)
    inside &= (azimuth == 1) | (azimuth == 2) | (len(phi) == 1)  # -180 and 180 degrees are the same
    assert inside.sum() > 30 and np.abs(found.values * found.wo[:, 2:] - table[above])[inside].max() < 1e-3
    assert found.isotropic == (len(phi) == 1) and found.source == "a test"
    assert found.left_out["below the horizon"] == (~above).sum()


def test_another_variant_is_refused(rgb, tmp_path):
    with pytest.raises(ParameterError, match="such as llvm_ad_spectral"):
        rgl.load(written(tmp_path / "x.bsdf", **fields(channels=4)))
    mi.set_variant("llvm_ad_spectral")
    with pytest.raises(ParameterError, match="such as llvm_ad_rgb"):
        rgl.load(written(tmp_path / "x.bsdf", **fields()))


@pytest.mark.parametrize(
    "changed, words",
    [
        ({"rgb": None}, "its 'wavelengths' is missing|its 'spectra' is missing"),
        ({"vndf": None}, "its 'vndf' is missing"),
        ({"vndf": np.ones((1, 2, 6, 6), "f4")}, "its 'vndf' is of shape"),
        ({"rgb": np.ones((1, 3, 2, 8, 8), "f4")}, "has 2 channels, not 3"),
        ({"rgb": np.full((1, 3, 3, 8, 8), np.nan, "f4")}, "its 'rgb' is not finite"),
        ({"theta_i": np.float32([0, 1, 3])}, "out of range"),
        ({"theta_i": np.float64([0, 1, 1.2])}, "type float64"),
        ({"jacobian": np.ones(0, "u1")}, "its 'jacobian' is of shape"),
        ({"ndf": np.ones(4, "f4")}, "its 'ndf' is of shape"),
    ],
)
def test_tables_that_do_not_go_together_are_refused(rgb, tmp_path, changed, words):
    with pytest.raises(UnreadableFileError, match=words):
        rgl.load(written(tmp_path / "x.bsdf", **fields() | changed))


@pytest.mark.parametrize("name", ["aurora_white_rgb", "chm_orange_rgb", "irid_flake_paint1_fine_rgb"])
def test_colours_of_real_files_are_those_of_their_tables(rgb, name):
    """ndf and sigma are the same for all channels. A tenth of the points is where the table is steep."""
    path = Path(real(f"rgl/{name}.bsdf"))
    tables = loading.tensors(path)
    found, (wi, wo) = rgl.load(path), rgl._vertices(tables)
    table = np.moveaxis(tables["rgb"], 2, -1).reshape(-1, 3)[(wi[:, 2] > rgl.LEAST) & (wo[:, 2] > rgl.LEAST)]
    assert len(found) == len(table)
    shares = [x / np.abs(x).sum(axis=1, keepdims=True) for x in (found.values, table)]
    assert np.quantile(np.abs(shares[0] - shares[1]).max(axis=1), 0.9) < 0.01
