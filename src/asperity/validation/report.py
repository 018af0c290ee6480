"""What a validation says: findings with bounds, tables and pictures, as a Markdown report."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy import stats

from .. import files
from ..files import atomically
from ..goniophotometer import Estimate
from ..version import __version__

SIGNIFICANCE, CLAIMS = 0.01, 64
"""Probability that a right model fails a report which judges that many claims, over all numbers compared (Šidák)."""


@dataclass(frozen=True)
class Finding:
    """A claim and what was measured. ``passed`` is None for what is reported and not judged."""

    claim: str
    measured: str
    bound: str = ""
    passed: bool | None = None

    @property
    def verdict(self) -> str:
        """In a word."""
        return {True: "passed", False: "**failed**", None: ""}[self.passed]


@dataclass(frozen=True)
class Table:
    """A table; cells are words or numbers."""

    head: Sequence[str]
    rows: Sequence[Sequence[Any]]

    def in_words(self) -> Table:
        """The same with numbers as they are printed."""
        return Table([_cell(cell) for cell in self.head], [[_cell(cell) for cell in row] for row in self.rows])

    def markdown(self) -> str:
        """The table in Markdown."""
        words = self.in_words()
        rows = [words.head, ["---"] * len(words.head), *words.rows]
        return "\n".join("| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |" for row in rows)


@dataclass(frozen=True)
class Section:
    """A part of a report."""

    title: str
    text: str
    findings: Sequence[Finding] = ()
    tables: Sequence[Table] = ()
    figures: dict[str, Figure] = field(default_factory=dict)


class Effort(NamedTuple):
    """How long to measure: paths per direction, and tiles, which give the standard error.

    ``tick`` is called every second or so; what it raises ends the section.
    """

    paths: float
    tiles: int
    seed: int = 0
    tick: Callable[..., None] = lambda *_: None

    def at_least(self, paths: float) -> Effort:
        """As many, or these where fewer would tell nothing."""
        return self._replace(paths=max(self.paths, paths))


QUICK, FULL = Effort(4e5, 16), Effort(4e6, 32)


def agreement(claim: str, truth: Estimate, model: np.ndarray, tiles: int, tolerance: float) -> Finding:
    """Whether all numbers of a model lie within the truth's standard errors, and a relative ``tolerance`` of its own.

    Standard errors come from ``tiles`` tiles, so deviations follow Student's t with one degree of freedom less.
    Numbers that were measured to worse than a tenth are too few hits for that: they are compared as one, by their sum.
    If there are no others the claim cannot be judged. It has not passed then: a report must not vouch for it.
    """
    value, error, model = (np.ravel(a).astype(float) for a in (*truth, np.broadcast_to(model, truth.value.shape)))
    allowed = tolerance * np.abs(model)
    good = error < 0.1 * np.abs(value)
    if not good.any():
        return Finding(claim, "too few paths to judge", "one number known to a tenth", False)
    gap = np.maximum(np.abs(value - model) - allowed, 0)[good]
    limit = float(stats.t.isf((1 - (1 - SIGNIFICANCE) ** (1 / (CLAIMS * good.sum()))) / 2, tiles - 1))
    worst = float(np.max(np.where(gap == 0, 0, gap / np.maximum(error[good], 1e-30))))  # tiles may all agree
    # Errors of cells are all but independent; if they were not, their sum's would be at most the sum of theirs.
    rest = abs(value[~good].sum() - model[~good].sum()) - allowed[~good].sum()
    rest_limit = limit * np.sqrt(np.square(error[~good]).sum()) + 1e-4 * model.sum()
    mean = np.abs(value - model)[good].sum() / value[good].sum()
    return Finding(
        claim,
        f"mean error {mean:.2%} in {good.sum()} numbers; worst {worst:.1f} standard errors",
        f"{limit:.1f} standard errors beyond {tolerance:.2%}",
        bool(worst <= limit and rest <= rest_limit),
    )


def told_apart(claim: str, ours: Finding, rival: Finding) -> Finding:
    """That bounds within which a model is right refuse a rival. If not, too few paths were traced to tell the two."""
    return Finding(claim, rival.measured, f"more than {rival.bound}", bool(ours.passed and rival.passed is False))


def passed(sections: Iterable[Section]) -> bool:
    """Whether no finding failed."""
    return all(finding.passed is None or finding.passed for section in sections for finding in section.findings)


class Report:
    """The report on a model, ``report.md`` in ``folder``, as far as its ``sections`` are done."""

    def __init__(self, model: str, effort: Effort, folder: Path, quick: bool = False):
        self.model, self.effort, self.folder, self.quick = model, effort, folder, quick
        self.sections: list[Section] = []
        self.finished = False
        self.path, self.seconds = folder / "report.md", 0.0
        self.start = time.perf_counter()
        files.folder(folder, "folder")  # now, not after minutes of tracing

    @property
    def passed(self) -> bool:
        """Whether it is finished, and no finding failed."""
        return self.finished and passed(self.sections)

    def add(self, section: Section) -> None:
        """Add a section, and write what there is."""
        self.sections.append(section)
        self._write("Not finished. ", new=1)

    def close(self) -> None:
        """Write it for the last time."""
        self._write("" if self.finished else "Stopped early. ", new=0)

    def _write(self, early: str, new: int) -> None:
        """Write it; only the last sections, if they are ``new``, have pictures that are not there yet."""
        self.seconds = time.perf_counter() - self.start
        preface = (
            f"{early}Made by `asperity validate {self.model}{' --quick' if self.quick else ''}`, asperity "
            f"{__version__}, in {self.seconds:.0f} s: {self.effort.paths:g} paths per direction (some sections take a "
            f"quarter or eight times that) in {self.effort.tiles} groups, seed {self.effort.seed}. Each group has a "
            "tile of its own, where the surface is random. Errors are standard errors over the groups. The bounds are "
            f"such that a right model fails a report with a probability of {100 * SIGNIFICANCE:g} %."
        )
        title = f"`{self.model}` against its microgeometry"
        write(title, preface, self.sections, self.folder, len(self.sections) - new)


def write(title: str, preface: str, sections: Sequence[Section], folder: Path, drawn: int = 0) -> Path:
    """Write ``report.md`` and its pictures into ``folder``, but for the first sections; return the report's path."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = [f"# {title}", preface]
    for k, section in enumerate(sections):
        lines += [f"## {section.title}", section.text]
        if section.findings:
            rows = [(f.claim, f.measured, f.bound, f.verdict) for f in section.findings]
            lines.append(Table(("claim", "measured", "bound", ""), rows).markdown())
        lines += [table.markdown() for table in section.tables]
        for name, figure in section.figures.items():
            if k >= drawn:
                with atomically(folder / f"{name}.png") as part:
                    figure.savefig(part, format="png")
            lines.append(f"![{name}]({name}.png)")
    report = folder / "report.md"
    with atomically(report) as part:
        part.write_text("\n\n".join(lines) + "\n", encoding="utf-8")
    return report


def _cell(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
