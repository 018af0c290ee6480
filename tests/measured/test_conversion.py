"""Files of all formats from any BRDF: what is read from them is what was written, within the error that is told."""

import asperity  # noqa: F401  isort: skip
import mitsuba as mi
import numpy as np
import pytest
from data import glossy, merl_file
from test_brdf import traced
from test_functions import RGB, streak

from asperity import loading
from asperity.errors import ParameterError
from asperity.goniophotometer import Hemisphere
from asperity.lab import evaluate
from asperity.materials import resolve
from asperity.measured import convert, functions, load, merl
from asperity.measured.conversion import FORMATS
from asperity.measured.functions import Function, of_brdf, random_pairs

SMOOTH = Function(glossy, RGB)


@pytest.mark.parametrize("ending", FORMATS)
@pytest.mark.parametrize("f", [SMOOTH, Function(streak, RGB, isotropic=False)], ids=["isotropic", "anisotropic"])
def test_what_is_read_is_as_told_and_as_written(rgb, tmp_path, f, ending):
    """Steps of 2.5 and 6 degrees and lobes of some 20 degrees: a few per cent, linear in between."""
    path = tmp_path / f"x{ending}"
    if ending == ".binary" and not f.isotropic:
        with pytest.raises(ParameterError, match=r"anisotropic, which \.binary cannot hold"):
            convert(f, path)
        assert not path.exists()
        return
    told = convert(f, path, resolution=36 if f.isotropic else 16)
    found = resolve(path)
    wi, wo = random_pairs(4000, seed=9)
    wanted, got = f(wi, wo), found.function()(wi, wo)
    errors = np.abs(got - wanted).mean(axis=1) / wanted.mean(axis=1)
    assert np.median(errors) < 0.03 and told.relative[0] == pytest.approx(np.median(errors), rel=0.2, abs=1e-3)
    assert told.relative[0] <= told.relative[1] <= told.relative[2]
    assert found.load().class_name() and found.mode == "rgb"


@pytest.mark.parametrize("ending", FORMATS)
def test_a_finer_file_is_better(rgb, tmp_path, ending):
    """Linear in between: half the steps, a quarter of the error; half of it is asked for."""
    coarse, fine = (convert(SMOOTH, tmp_path / f"x{ending}", resolution=n).log_cosine[0] for n in (12, 24))
    assert fine < coarse / 2


@pytest.mark.parametrize("route", [(".csv",), (".npz",), (".csv", ".npz"), (".npz", ".csv")])
def test_a_merl_file_comes_back_from_pairs(tmp_path, route):
    """Values have nine digits in CSV, and every node keeps its own."""
    path = merl_file(tmp_path / "x.binary", counts=(8, 8, 16))
    first, data = merl.read(path), load(path)
    for n, ending in enumerate(route):
        told = convert(of_brdf(data), tmp_path / f"{n}{ending}", data)
        assert told.relative[2] < 1e-6 and told.scattered is None
        data = load(tmp_path / f"{n}{ending}")
    assert convert(of_brdf(data), tmp_path / "y.binary", data, resolution=8).relative[2] < 1e-9
    again = merl.read(tmp_path / "y.binary")
    known = first >= 0
    assert np.allclose(again[known], first[known], rtol=1e-8)
    assert (again[1:][~known[1:]] < 0).all()  # at θ_h = 0 all φ_d are the same pair


def test_a_measurement_of_the_virtual_goniophotometer(rgb, tmp_path):
    """Its cells become pairs as they are, or a table; of a constant, on which interpolation is exact but for cosines
    that are linear between 0, 40 and 80 degrees, in the table that renders it."""
    measured = traced(Hemisphere(8, 16), 0.25, [(0, 0), (40, 0), (80, 0)])
    found = resolve(measured)
    convert(found.function(), tmp_path / "x.csv", found.pairs)
    assert len(load(tmp_path / "x.csv")) == 3 * 128
    told = convert(found.function(), tmp_path / "x.bsdf", resolution=30)
    assert told.relative[0] < 0.02


def test_what_is_not_its_own_mirror_image_stays_so(rgb, tmp_path):
    """Isotropic, and the sense of rotation from wi to wo counts: MERL's φ_d tells it, and so does a table."""

    def f(wi, wo):
        return 0.2 + 0.1 * np.cross(wi, wo)[:, 2:] * np.sign(wi[:, 2:] - wo[:, 2:]) * np.abs(wi - wo)[:, 2:] * np.ones(
            3
        )

    told = [convert(Function(f, RGB), tmp_path / f"x{ending}", resolution=30) for ending in (".binary", ".bsdf")]
    assert max(one.relative[0] for one in told) < 0.005


def test_other_programs_get_the_counts_that_they_read(rgb, tmp_path):
    """90 x 90 x 180, in R, G and B: pbrt and Falcor read no other."""
    diffuse = functions.of_bsdf(evaluate.load({"type": "diffuse"}))
    told = convert(diffuse, tmp_path / "x.binary")
    assert merl.read(tmp_path / "x.binary").shape == (90, 90, 180, 3) and told.relative[2] < 1e-5


def test_a_channel_of_its_own_is_grey_and_wavelengths_are_refused_where_there_are_none(rgb, tmp_path):
    grey = Function(lambda wi, wo: glossy(wi, wo)[:, :1], ("Y",))
    assert convert(grey, tmp_path / "x.binary", resolution=12).relative[0] < 0.1
    assert convert(grey, tmp_path / "x.bsdf", resolution=12).relative[0] < 0.1
    waves = Function(glossy, ("450 nm", "550 nm", "650 nm"))
    for ending, words in ((".binary", "holds R, G and B"), (".bsdf", "such as llvm_ad_spectral"), (".txt", "Allowed")):
        with pytest.raises(ParameterError, match=words):
            convert(waves, tmp_path / f"y{ending}", resolution=12)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["x.binary", "x.bsdf"]


def test_wavelengths_become_a_spectral_table(tmp_path):
    """As pbrt-v4 wants it, too: square tables of `spectra`, and no others."""
    mi.set_variant("llvm_ad_spectral")
    waves = Function(lambda wi, wo: glossy(wi, wo)[:, [0, 1, 2, 0, 1]], tuple(f"{nm} nm" for nm in range(450, 700, 50)))
    assert convert(waves, tmp_path / "x.bsdf", resolution=30).relative[0] < 0.01
    found = resolve(tmp_path / "x.bsdf")
    fields = loading.tensors(tmp_path / "x.bsdf")
    assert fields["spectra"].shape == (1, len(fields["theta_i"]), 5, 31, 31) and "rgb" not in fields
    assert fields["luminance"].shape[2:] == (31, 31) and fields["jacobian"].shape == (1,)
    assert found.mode == "spectral" and found.wavelengths == [450, 500, 550, 600, 650]


@pytest.mark.parametrize("resolution", [3, 361, 4.5])
def test_resolutions_out_of_range_are_refused(tmp_path, resolution):
    with pytest.raises(ParameterError, match="resolution = "):
        convert(SMOOTH, tmp_path / "x.csv", resolution=resolution)
