"""Renders in passes, so that one sees progress, and may stop early and keep the picture."""

from __future__ import annotations

import math
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from . import console

if TYPE_CHECKING:
    import numpy as np

PASSES = (16, 4, 1)
"""Samples per pixel of a pass: squares, which every sampler of Mitsuba can stratify."""
LANES = 2**21
"""Samples of a pass, at most: enough to fill any processor, few enough for its memory."""


def average(scenes: list[Any], spp: int, seed: int, sensor: int = 0) -> tuple[list[np.ndarray], int]:
    """Images (height, width, channels) from a sensor of the scenes, and how many samples per pixel they got."""
    import mitsuba as mi
    import numpy as np

    film, sampler = scenes[0].sensors()[sensor].film(), scenes[0].sensors()[sensor].sampler()
    pixels = math.prod(film.crop_size())
    seeds, totals, done = np.random.default_rng(seed), [np.zeros(1)] * len(scenes), 0
    with console.progress("spp") as progress, interruptible() as interrupted:
        task = progress.add_task("compiling", total=spp)
        while done < spp and not interrupted:
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
def interruptible() -> Iterator[list[bool]]:
    """A list that is empty until Ctrl-C; the second Ctrl-C is the usual one.

    An exception instead would cross Mitsuba's C++ wherever it happens to be.
    """
    interrupted: list[bool] = []

    def interrupt(*_: Any) -> None:
        interrupted.append(True)
        signal.signal(signal.SIGINT, before)

    before = signal.signal(signal.SIGINT, interrupt)
    try:
        yield interrupted
    finally:
        signal.signal(signal.SIGINT, before)
