"""Renders in passes, so that one sees progress, and may stop early and keep the picture."""

from __future__ import annotations

import math
import os
import signal
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from . import console

if TYPE_CHECKING:
    import numpy as np

PASSES = (16, 4, 1)
"""Samples per pixel of a pass: squares, which every sampler of Mitsuba can stratify."""
LANES = 2**21
"""Samples of a pass, at most: enough to fill any processor, few enough for its memory."""
SIGNALS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
"""That ask for an end; Windows has fewer."""


def average(
    scenes: list[Any], spp: int, seed: int, sensor: int = 0, interrupted: Collection[Any] = ()
) -> tuple[list[np.ndarray], int]:
    """Images (height, width, channels) from a sensor of the scenes, and how many samples per pixel they got.

    They get fewer than ``spp`` if ``interrupted`` is no longer empty after a pass.
    """
    import mitsuba as mi
    import numpy as np

    film, sampler = scenes[0].sensors()[sensor].film(), scenes[0].sensors()[sensor].sampler()
    pixels = math.prod(film.crop_size())
    seeds, totals, done = np.random.default_rng(seed), [np.zeros(1)] * len(scenes), 0
    with console.progress("spp") as progress:
        task = progress.add_task("compiling", total=spp)
        while not done or (done < spp and not interrupted):
            n, pass_seed = pass_size(spp - done, pixels), int(seeds.integers(2**32))
            images = [
                np.array(mi.render(scene, sensor=sensor, spp=n, seed=pass_seed), dtype=np.float64) for scene in scenes
            ]
            n = sampler.sample_count()  # some samplers round it up
            totals, done = [total + n * image for total, image in zip(totals, images)], done + n
            progress.update(task, completed=done, description="rendering")
    return [total / done for total in totals], done


def pass_size(remaining: int, pixels: int) -> int:
    """The largest pass that is neither too long nor too large."""
    return next(n for n in PASSES if n == 1 or (n <= remaining and n * pixels <= LANES))


@contextmanager
def interruptible() -> Iterator[list[int]]:
    """A list that is empty until Ctrl-C, SIGTERM or SIGHUP; a Ctrl-C after that is the usual one.

    An exception instead would cross Mitsuba's C++ wherever it happens to be. Schedulers send SIGTERM when the time is
    over, and terminals SIGHUP, several times, when they are closed: then nobody reads what is printed.
    """
    interrupted: list[int] = []
    # Signals that are ignored, by nohup or a shell script, stay so.
    before = {s: signal.getsignal(s) for s in SIGNALS if signal.getsignal(s) not in (signal.SIG_IGN, None)}
    terminals = [stream for stream in (1, 2) if os.isatty(stream)]

    def interrupt(number: int, _: Any) -> None:
        interrupted.append(number)
        signal.signal(signal.SIGINT, before.get(signal.SIGINT, signal.SIG_IGN))
        if number == getattr(signal, "SIGHUP", None):
            for terminal in terminals:
                os.dup2(os.open(os.devnull, os.O_WRONLY), terminal)
        elif 2 in terminals:  # not by print(), which may be what was interrupted
            os.write(2, b"\nstopping ...\n")

    try:
        for number in before:
            signal.signal(number, interrupt)
        yield interrupted
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
