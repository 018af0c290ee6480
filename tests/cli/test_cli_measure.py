import errno
import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest
from typer.testing import CliRunner

from asperity.cli import app, console
from asperity.files import locked
from asperity.goniophotometer import Measurement

QUICK = ("--paths", "2e4", "--tiles", "4")
GRAINS = ("measure", "micrograin", "--set", "tau_0=0.5", *QUICK)
ROOF = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv .5 .5 .5\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n"
GOLD = '{"type": "conductor", "material": "Au"}'
ENDINGS = (".png", ".pdf", ".svg")


def works(result):
    assert result.exit_code == 0, result.output
    return result.output


def files(folder):
    return sorted(path.name for path in folder.iterdir())


def test_measure_plots_and_says_what_next(asperity, tmp_path):
    output = works(asperity(*GRAINS, "--theta", "30,60", "--phi", "0,45", "--orders", "3", "--apart", "2"))
    assert "order 2 and more" in output and "cut" in output and "transmitted" not in output and "channel" not in output
    assert "micrograin.npz: 8e+04 paths" in output and "Try next: asperity plot micrograin.npz" in output
    with np.load("micrograin.npz") as file:
        assert file["incident"].tolist() == [[30, 0], [30, 45], [60, 0], [60, 45]]
        assert file["orders"].tolist() == [1, 2]
        assert file["wi"].shape == (4, 3) and file["wo"].shape == (4, 2048, 3)
        assert file["values"].shape == file["errors"].shape == (4, 2, 2048, 3)
        assert np.mean(file["errors"][file["values"] > 0] > 0) > 0.9  # few paths may hit each tile equally often
    measured = Measurement.load("micrograin.npz")
    assert measured.about["model"] == {"type": "micrograin", "tau_0": 0.5}
    value, error = measured.total_albedo
    assert f"{value[0, 0]:.4f} ± {error[0, 0]:.4f}" in output
    assert works(asperity("plot", "micrograin.npz")) == "micrograin.png\n"
    assert files(tmp_path) == ["micrograin.npz", "micrograin.png"]


@pytest.mark.parametrize(
    "options, shape",
    [
        (("--cells", "4x8", "--set", "material=Au"), (1, 32, 3)),
        (("--sensor", "mirror", "--cells", "6", "--radius", "30"), (1, 36, 3)),
        (("--towards", "60:0,30:180", "--set", "specular=false"), (1, 2, 3)),
        (("--variant", "llvm_ad_spectral", "--wavelengths", "450,500,550,600", "--set", "material=Au"), (1, 2048, 4)),
    ],
)
def test_sensors_and_their_plots(asperity, tmp_path, options, shape):
    output = works(asperity(*GRAINS, "--theta", "40", "--orders", "1", *options, "-o", "out"))
    assert ("channel" in output) == ("material=Au" in options)
    assert Measurement.load("out.npz").values.value[0].shape == shape
    for ending in ENDINGS if "4x8" in options else ENDINGS[:1]:
        works(asperity("plot", "out.npz", "-o", f"out{ending}"))
        assert (tmp_path / f"out{ending}").stat().st_size > 10_000


def test_the_plotted_model_is_the_mean_over_the_same_cells(rgb):
    """All cells of the hemisphere together hold the model's albedo."""
    from asperity.goniophotometer import measure, plots
    from asperity.lab import evaluate
    from asperity.models import MODELS

    model = {"type": "micrograin", "tau_0": 0.5, "beta": 2}
    geometry = MODELS["micrograin"].microgeometry(model)
    measured = measure(geometry, [(40, 10)], orders=1, paths=2e4, tiles=4, about={"model": model})
    bsdf, (cells, weights) = mi.load_dict(model), plots.each(measured.sensor)
    albedo = plots.model_means(measured, 0, bsdf, cells, weights).sum(axis=0) * measured.sensor.solid_angle
    assert albedo == pytest.approx(evaluate.albedo(bsdf, measured.wi)[:, 0], rel=1e-3)
    error = measured.albedo.error[0, 0]
    assert np.all(np.abs(measured.albedo.value[0, 0] - albedo) < 5 * error)
    whole = plots.curve(measured, 0, cells, weights, plots.ALL)
    assert np.allclose(whole.value, measured.summed.value[0, :, 0])
    assert np.allclose(whole.error, measured.summed.error[0, :, 0])


def test_meshes_and_height_fields(asperity, tmp_path):
    (tmp_path / "roof.obj").write_text(ROOF)
    np.save("waves.npy", np.sin(np.arange(16) / 16 * 2 * np.pi)[:, None] * np.ones(8))
    works(asperity("measure", "mesh", "roof.obj", "--bsdf", GOLD, "--periodic", "mirror", *QUICK))
    about = Measurement.load("roof.npz").about
    assert about["geometry"]["periodic"] == "mirror" and about["geometry"]["bsdf"]["material"] == "Au"
    works(asperity("measure", "heightfield", "waves.npy", "--spacing", "0.1", "--scale", "0.5", *QUICK))
    assert Measurement.load("waves.npz").about["geometry"]["spacing"] == [0.1, 0.1]


def test_a_tilted_height_field_is_levelled_if_asked(asperity):
    np.save("plane.npy", np.arange(16.0)[:, None] * np.ones(8))
    tilted = ("measure", "heightfield", "plane.npy", "--spacing", "1", *QUICK)
    refused = asperity(*tilted)
    assert refused.exit_code != 0 and "--level" in refused.output and "--periodic mirror" in refused.output
    assert "plane.npy: 16 x 8 heights, the plane of slopes 0 and 1 " in works(asperity(*tilted, "--level"))
    assert Measurement.load("plane.npz").about["geometry"]["level"] is True


def test_a_preset_and_a_tensor_file(asperity):
    works(asperity("measure", "--preset", "gold-dust", "--set", "tau_0=0.2", *QUICK, "--tensor", "gold"))
    assert Measurement.load("gold-dust.npz").about["model"]["tau_0"] == 0.2
    mi.load_dict({"type": "measured", "filename": "gold.bsdf"})


def test_continue_adds_paths_to_a_finished_file(asperity):
    works(asperity(*GRAINS, "-o", "grains"))
    works(asperity(*GRAINS, "--continue", "grains.npz"))
    works(asperity(*GRAINS, "--paths", "4e4", "-o", "once"))
    twice, once = Measurement.load("grains.npz"), Measurement.load("once.npz")
    assert np.array_equal(twice.paths, once.paths)
    assert np.allclose(twice.albedo.value, once.albedo.value, atol=6 * once.albedo.error.max())
    works(asperity(*GRAINS, "--continue", "grains.npz", "-o", "more"))
    assert Measurement.load("more.npz").total_paths == 18e4 and Measurement.load("grains.npz").total_paths == 12e4


def test_merge_is_exact(asperity):
    for seed in "12":
        works(asperity(*GRAINS, "--seed", seed, "-o", f"{seed}.npz"))
    assert "8 tiles" in works(asperity("merge", "1.npz", "2.npz", "-o", "both"))
    one, two, both = (Measurement.load(f"{name}.npz") for name in ("1", "2", "both"))
    assert np.array_equal(both.energy.sum(axis=0), one.energy.sum(axis=0) + two.energy.sum(axis=0))
    assert np.array_equal(both.paths, np.concatenate([one.paths, two.paths]))


def test_ctrl_c_keeps_what_was_measured(asperity, tmp_path, monkeypatch):
    module = sys.modules["asperity.goniophotometer.measure"]
    trace, calls = module.trace, []

    def interrupted(*arguments):
        calls.append(arguments)
        if len(calls) == 2:
            signal.raise_signal(signal.SIGINT)
        return trace(*arguments)

    monkeypatch.setattr(module, "trace", interrupted)
    assert "stopped early: micrograin.npz: 1e+04 paths" in works(asperity(*GRAINS, "--theta", "30"))
    assert files(tmp_path) == ["micrograin.npz"]
    assert Measurement.load("micrograin.npz").paths.tolist() == [[5000], [5000], [0], [0]]
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    works(asperity("plot", "micrograin.npz"))


JOB = ("measure", "micrograin", "--set", "tau_0=0.5", "--theta", "30", "--paths", "3e5", "--tiles", "60")
COMMAND = (sys.executable, "-m", "asperity", *JOB, "-o", "job.npz", "--checkpoint", "0")
IN_A_TERMINAL = (sys.executable, "-c", "import pty, sys; pty.spawn(sys.argv[1:])", *COMMAND)


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    """The file of the job."""
    path = tmp_path_factory.mktemp("job") / "whole.npz"
    works(CliRunner().invoke(app, [*JOB, "-o", str(path)]))
    return Measurement.load(path)


def wait_for(condition):
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="Windows has no such signals")
@pytest.mark.parametrize("name, command", [*((n, COMMAND) for n in ("TERM", "HUP", "KILL")), ("KILL", IN_A_TERMINAL)])
def test_a_job_that_is_ended_goes_on_to_the_same_bits(asperity, tmp_path, uninterrupted, name, command):
    """Killing the terminal hangs up the job in it."""
    with open("log", "w") as log, subprocess.Popen(command, stdin=subprocess.PIPE, stdout=log, stderr=log) as job:
        wait_for(Path("job.npz").exists)
        job.send_signal(signal.Signals[f"SIG{name}"])
        job.wait(60)
    if name == "KILL" and command is COMMAND:
        assert files(tmp_path) == [".job.npz.lock", "job.npz", "log"]  # a lock that the system has opened
    else:
        assert command is IN_A_TERMINAL or (job.returncode == 0 and "stopped early" in Path("log").read_text())
        wait_for(lambda: files(tmp_path) == ["job.npz", "log"])
    part = Measurement.load("job.npz")
    assert 0 < part.total_paths < 3e5 and not part.finished
    works(asperity(*JOB, "--continue", "job.npz"))
    whole = Measurement.load("job.npz")
    assert whole.finished and files(tmp_path) == ["job.npz", "log"]
    assert all(np.array_equal(getattr(whole, n), getattr(uninterrupted, n)) for n in ("energy", "paths", "goal"))


def test_a_log_gets_lines(asperity, monkeypatch):
    assert asperity(*GRAINS).stderr == ""
    monkeypatch.setattr(console, "INTERVAL", 0)
    lines = asperity(*GRAINS).stderr.splitlines()
    assert len(lines) == 12 and re.fullmatch(r"0\.1/0\.1 million paths, \S+ paths/s, about 0:\d\d:\d\d left", lines[-1])


def test_one_at_a_time(asperity, tmp_path):
    works(asperity(*GRAINS, "-o", "grains"))
    before = Path("grains.npz").read_bytes()
    with locked(Path("grains.npz")), locked(Path("micrograin.npz")):
        for options in (("--continue", "grains.npz"), ("-o", "grains", "--force")):
            assert "another asperity is writing it" in asperity(*GRAINS, *options).stderr
        assert "micrograin-2.npz" in works(asperity(*GRAINS))
    assert Path("grains.npz").read_bytes() == before
    works(asperity(*GRAINS, "--continue", "grains.npz"))
    assert files(tmp_path) == ["grains.npz", "micrograin-2.npz"]


BAD = [
    (("measure",), "give one of"),
    (("measure", "micrograin", "--preset", "gold-dust"), "give one of"),
    (("measure", "micrgrain"), "Did you mean 'micrograin'?"),
    (("measure", "mseh", "roof.obj"), "Did you mean 'mesh'?"),
    (("measure", "deon"), "'deon' has no microgeometry"),
    (("measure", "--material", "gold.json"), "'conductor' has no microgeometry"),
    ((*GRAINS, "--set", "tau0=1"), "Did you mean 'tau_0'?"),
    ((*GRAINS, "--theta", "95"), "theta = 95"),
    ((*GRAINS, "--theta", "abc"), "'abc': expected numbers"),
    ((*GRAINS, "--orders", "0"), "--orders"),
    ((*GRAINS, "--paths", "0"), "paths = 0"),
    ((*GRAINS, "--sensor", "retor"), "Did you mean 'retro'?"),
    ((*GRAINS, "--sensor", "points"), "towards"),
    ((*GRAINS, "--towards", "30"), "'30': expected directions"),
    ((*GRAINS, "--towards", "30:0"), "are mirrors"),
    ((*GRAINS, "--radius", "5"), "radius: makes no sense with sensor hemisphere"),
    ((*GRAINS, "--cells", "5"), "cells: sensor hemisphere takes ROWSxCOLUMNS"),
    ((*GRAINS, "--cells", "5x"), "'5x': expected"),
    ((*GRAINS, "--wavelengths", "500"), "wavelengths"),
    ((*GRAINS, "--bsdf", GOLD), "bsdf: makes no sense with micrograin"),
    ((*GRAINS, "-o", "none/out.npz"), "cannot write into the folder 'none'"),
    ((*GRAINS, "--tensor", "none/out.bsdf"), "cannot write into the folder 'none'"),
    ((*GRAINS, "-o", "broken.npz"), "-o broken.npz: it exists. Take another name, or --force"),
    ((*GRAINS, "--tensor", "old.bsdf"), "--tensor old.bsdf: it exists"),
    (
        (
            "measure",
            "mesh",
            "roof.obj",
            "--bsdf",
            '{"type": "measured", "filename": "old.bsdf"}',
            "--tensor",
            "old.bsdf",
            "--force",
        ),
        "old.bsdf: it is an input",
    ),
    ((*GRAINS, "--continue", "old.npz", "-o", "broken.npz"), "-o broken.npz: it exists"),
    (("merge", "broken.npz", "-o", "broken.npz", "--force"), "-o broken.npz: it is an input of this command"),
    (
        (*GRAINS, "--tiles", "1000000000"),
        "tiles = 1000000000, 3 directions of incidence, 1 orders apart, 2048 cells",
    ),
    ((*GRAINS, "--cells", "4096x4096", "--apart", "1000"), "GiB of memory, and this machine has"),
    ((*GRAINS, "-o", "out.csv"), "'.csv'. Allowed: .npz"),
    ((*GRAINS, "--continue", "none.npz"), "'none.npz': there is no such file"),
    ((*GRAINS, "--continue", "broken.npz"), "'broken.npz': not written by asperity"),
    (("measure", "mesh"), "expected a file"),
    (("measure", "mesh", "none.obj"), "'none.obj': there is no such file"),
    (("measure", "mesh", "roof.obj", "--bsdf", "gold"), "--bsdf gold: no JSON"),
    (("measure", "mesh", "roof.obj", "--bsdf", "[1]"), "expected an object in braces"),
    (("measure", "mesh", "roof.obj", "--bsdf", '{"type": "difuse"}'), "Did you mean 'diffuse'?"),
    (("measure", "mesh", "roof.obj", "--spacing", "1"), "spacing: makes no sense with a mesh"),
    (("measure", "mesh", "roof.obj", "--set", "tau_0=1"), "set: makes no sense with a mesh"),
    (("measure", "heightfield", "waves.npy"), "spacing"),
    (("plot", "none.npz"), "'none.npz': there is no such file"),
    (("plot", "broken.npz"), "'broken.npz': it is no NumPy archive"),
    (("plot", "broken.npz", "-o", "out.jpg"), "'.jpg'. Allowed: .png, .pdf, .svg"),
    (("merge", "none.npz", "broken.npz"), "'none.npz': there is no such file"),
]


@pytest.mark.parametrize("arguments, culprit", BAD, ids=[" ".join(arguments) for arguments, _ in BAD])
def test_bad_input(asperity, tmp_path, arguments, culprit):
    for name, content in {"roof.obj": ROOF, "gold.json": GOLD, "broken.npz": "no archive", "old.bsdf": ""}.items():
        (tmp_path / name).write_text(content)
    before = files(tmp_path)
    result = asperity(*arguments)
    assert result.exit_code == 2, result.output
    assert isinstance(result.exception, SystemExit)  # anything else would have been a traceback
    assert culprit in result.output
    assert "Usage:" in result.output or len(result.stderr.strip().splitlines()) == 1
    assert files(tmp_path) == before


def test_continue_wants_the_same(asperity):
    works(asperity(*GRAINS, "-o", "grains"))
    for option, value, culprit in (
        ("--set", "tau_0=0.4", "geometry differs"),
        ("--theta", "10", "directions of incidence differ"),
        ("--seed", "3", "seed = 3: grains.npz has 0"),
        ("--tiles", "5", "tiles = 5: grains.npz has 4"),
    ):
        result = asperity(*GRAINS, "--continue", "grains.npz", option, value)
        assert result.exit_code == 2 and culprit in result.stderr
    assert "is there twice" in asperity("merge", "grains.npz", "grains.npz").stderr


def test_a_full_disk_keeps_what_was_measured_elsewhere(asperity, tmp_path, monkeypatch):
    works(asperity(*GRAINS, "--theta", "30", "-o", "full.npz"))
    before = Measurement.load("full.npz")
    replace = os.replace

    def full(source, target):
        if target.name == "full.npz" and target.parent == tmp_path:
            raise OSError(errno.ENOSPC, "No space left on device")
        replace(source, target)

    monkeypatch.setattr("asperity.files.os.replace", full)
    output = works(asperity(*GRAINS, "--theta", "30", "--continue", "full.npz", "--checkpoint", "0"))
    rescued = re.search(r"Kept as (\S+full\.npz)", output)[1]
    assert (
        "no checkpoint: cannot write full.npz: No space left" in output
        and Measurement.load(rescued).total_paths == 2 * before.total_paths
    )
    assert np.array_equal(Measurement.load("full.npz").energy, before.energy) and files(tmp_path) == ["full.npz"]
