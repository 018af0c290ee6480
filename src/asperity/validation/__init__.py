"""One file a paper: its claims, figures and tables, measured against the ground truth.

>>> validate("micrograin", "report", quick=True).passed
"""

from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from ..errors import UnknownNameError
from ..lab import evaluate
from . import interfacedlambertian, lambertsphere, micrograin, twoscale, vgroove
from .report import FULL, QUICK, Effort, Report, Section

Sections = dict[str, Callable[[Effort], Section]]
"""What makes the sections of a report, by short names, in their order."""

PAPERS: dict[str, Sections] = {
    "micrograin": micrograin.SECTIONS,
    "vgroove": vgroove.SECTIONS,
    "lambertsphere": lambertsphere.SECTIONS,
    "interfacedlambertian": interfacedlambertian.SECTIONS,
    "twoscale": twoscale.SECTIONS,
}
"""The reports, by the model's name."""


def paper(model: str) -> Sections:
    """What makes the sections of a model's report; raises UnknownNameError if there is none."""
    if model not in PAPERS:
        raise UnknownNameError("model with a validation", model, PAPERS)
    return PAPERS[model]


class StoppedError(Exception):
    """Somebody wants to stop; what is being measured is left out."""


def efforts(quick: bool, seed: int, stop: Callable[[], bool]) -> Effort:
    """How long to measure; it ends by StoppedError as soon as ``stop()`` is true.

    Raises ParameterError in variants without arrays.
    """
    evaluate.require_arrays("measuring")

    def tick(*_: object) -> None:
        if stop():
            raise StoppedError

    return (QUICK if quick else FULL)._replace(seed=seed, tick=tick)


def validate(
    model: str,
    folder: str | Path,
    *,
    quick: bool = False,
    seed: int = 0,
    stop: Callable[[], bool] = lambda: False,
    done: Callable[[Section], None] = lambda section: None,
) -> Report:
    """Compare a model with light traced through its microgeometry; write ``report.md`` and its pictures.

    Parameters
    ----------
    model : a name in `PAPERS`
    folder : where to write to, after each section; it is made, and a report in it overwritten
    quick : a tenth of the paths
    seed : another seed, other tiles
    stop() : asked every second or so; True ends the report with the sections that are done
    done(section) : called after each section
    """
    sections, effort = paper(model), efforts(quick, seed, stop)
    report = Report(model, effort, Path(folder), quick)
    with suppress(StoppedError):
        for make in sections.values():
            section = make(effort)
            report.add(section)
            done(section)
            effort.tick()
        report.finished = True
    report.close()
    return report
