"""One file a paper: its claims, figures and tables, measured against the ground truth.

>>> validate("micrograin", "report", quick=True).passed
"""

from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from ..errors import UnknownNameError
from . import interfacedlambertian, lambertsphere, micrograin, twoscale, vgroove
from .report import FULL, QUICK, Effort, Report, Section

PAPERS: dict[str, Callable[[Effort], Iterator[Section]]] = {
    "micrograin": micrograin.sections,
    "vgroove": vgroove.sections,
    "lambertsphere": lambertsphere.sections,
    "interfacedlambertian": interfacedlambertian.sections,
    "twoscale": twoscale.sections,
}
"""What makes the sections of a model's report, by the model's name."""


def paper(model: str) -> Callable[[Effort], Iterator[Section]]:
    """What makes the sections of a model's report; raises UnknownNameError if there is none."""
    if model not in PAPERS:
        raise UnknownNameError("model with a validation", model, PAPERS)
    return PAPERS[model]


class StoppedError(Exception):
    """Somebody wants to stop; what is being measured is left out."""


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
    sections = paper(model)

    def tick(*_: object) -> None:
        if stop():
            raise StoppedError

    effort = (QUICK if quick else FULL)._replace(seed=seed, tick=tick)
    report = Report(model, effort, Path(folder), quick)
    with suppress(StoppedError):
        for section in sections(effort):
            report.add(section)
            done(section)
            tick()
        report.finished = True
    report.close()
    return report
