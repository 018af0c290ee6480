"""A second thread where there is one core, without which Mitsuba hangs."""

from __future__ import annotations

import drjit as dr


def ensure_worker() -> None:
    """Give Dr.Jit's thread pool a worker if it has none, as on a machine, or in a container, of one core.

    Mitsuba reads and writes EXR files by tasks for that pool, and waits for ever if nobody does them.
    """
    if dr.thread_count() < 2:  # the calling thread counts as one
        dr.set_thread_count(2)
