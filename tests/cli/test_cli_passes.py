"""Signals that ask for an end, and pictures that are kept."""

import signal
import subprocess
import sys
import time

import mitsuba as mi
import pytest

from asperity.cli import passes

SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]


@pytest.mark.parametrize("end", SIGNALS)
def test_a_signal_keeps_the_picture(asperity, tmp_path, monkeypatch, end):
    render = mi.render

    def interrupted(*arguments, **options):
        signal.raise_signal(end)
        return render(*arguments, **options)

    monkeypatch.setattr(mi, "render", interrupted)
    before = [signal.getsignal(one) for one in SIGNALS]
    result = asperity("render", "--size", "8", "--spp", "640", "-o", "out.exr")
    assert result.exit_code == 0 and "stopped early: out.exr: 16 samples per pixel" in result.output
    assert [path.name for path in tmp_path.iterdir()] == ["out.exr"]
    assert [signal.getsignal(one) for one in SIGNALS] == before


@pytest.mark.parametrize("end", SIGNALS)
def test_only_a_second_ctrl_c_is_the_usual_one(end):
    """Terminals and schedulers repeat themselves, and that is no reason to lose what is being written."""
    with passes.interruptible() as interrupted, pytest.raises(KeyboardInterrupt):
        for one in (end, *SIGNALS[1:], *SIGNALS[1:]):
            signal.raise_signal(one)
        assert len(interrupted) == 1 + 2 * len(SIGNALS[1:])
        signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("end", SIGNALS)
def test_what_is_ignored_stays_so(end):
    """By nohup, or by a shell script for what it runs in the background."""
    before = signal.signal(end, signal.SIG_IGN)
    with passes.interruptible() as interrupted:
        signal.raise_signal(end)
        assert not interrupted
    assert signal.signal(end, before) is signal.SIG_IGN


def test_one_pass_is_rendered_however_early_the_signal():
    mi.set_variant("scalar_rgb")
    sensor = {"type": "perspective", "film": {"type": "hdrfilm", "width": 4, "height": 4}}
    scene = mi.load_dict(
        {"type": "scene", "integrator": {"type": "path"}, "light": {"type": "constant"}, "sensor": sensor}
    )
    [image], done = passes.average([scene], 4, 0, interrupted=[signal.SIGTERM])
    assert done == 4 and image.min() > 0


@pytest.mark.skipif(not hasattr(signal, "SIGHUP"), reason="Windows has no such signal")
def test_a_closed_terminal_keeps_the_picture(tmp_path):
    """The job is hung up, and all that it prints from then on fails."""
    render = ("render", "--size", "64", "--spp", "1000000", "-o", "out.exr")
    in_a_terminal = ("-c", "import pty, sys; pty.spawn(sys.argv[1:])", sys.executable, "-m", "asperity", *render)
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "cwd": tmp_path}
    with subprocess.Popen([sys.executable, *in_a_terminal], **pipes) as terminal:
        seen = b""
        while b"rendering" not in seen:
            seen += (more := terminal.stdout.read1())
            assert more, seen
        terminal.kill()
    end = time.monotonic() + 60
    while [path.name for path in tmp_path.iterdir()] != ["out.exr"]:
        assert time.monotonic() < end
        time.sleep(0.05)
