"""Times that can be compared on a machine that is never quite quiet: tasks take turns."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any

import drjit as dr
import numpy as np


def finish(result: Any) -> Any:
    """Compute what was recorded, and wait for it."""
    dr.eval(result)
    dr.sync_thread()
    return result


def turns(
    tasks: Mapping[str, Callable[[], Any]], rounds: int, tick: Callable[[], None] = lambda: None
) -> tuple[dict[str, np.ndarray], dict[str, list[Any]]]:
    """Seconds of each task in each round, and what it returned; the tasks take turns, back and forth."""
    for task in tasks.values():
        task()  # compiles
        tick()
    seconds: dict[str, list[float]] = {name: [] for name in tasks}
    results: dict[str, list[Any]] = {name: [] for name in tasks}
    for turn in range(rounds):
        for name, task in list(tasks.items())[:: 1 if turn % 2 else -1]:
            start = time.perf_counter()
            result = task()
            seconds[name].append(time.perf_counter() - start)
            results[name].append(result)
            tick()
    return {name: np.array(times) for name, times in seconds.items()}, results


def medians(tasks: Mapping[str, Callable[[], Any]], rounds: int) -> dict[str, float]:
    """Median seconds of each task."""
    return {name: float(np.median(times)) for name, times in turns(tasks, rounds)[0].items()}


def quartiles(values: Any) -> list[float]:
    """The three of them, to four digits."""
    return [float(f"{x:.4g}") for x in np.percentile(values, (25, 50, 75))]
