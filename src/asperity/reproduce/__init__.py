"""The papers' figures and tables, made anew: a page a paper, of what it claims and what we find.

>>> reproduce("micrograin", "reproduction", quick=True).passed
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

from ..errors import UnknownNameError
from ..files import atomically
from ..validation import StoppedError, efforts
from ..validation.report import passed
from . import kept, page
from .kept import Kept
from .papers import PAPERS
from .results import Paper


class Reproduction(NamedTuple):
    """A paper's page, as far as its sections are made."""

    paper: Paper
    path: Path
    sections: dict[str, Kept]
    missing: list[str]

    @property
    def passed(self) -> bool:
        """Whether all that was asked for is made, and no finding failed."""
        return not self.missing and passed(one.section for one in self.sections.values())


def find(name: str) -> Paper:
    """The paper of a model, or of a first author; raises UnknownNameError."""
    if name in PAPERS:
        return PAPERS[name]
    firsts = {page.authors(model)[0]: paper for model, paper in PAPERS.items()}
    for first, paper in firsts.items():
        if first.casefold() == name.casefold():
            return paper
    raise UnknownNameError("paper", name, [*PAPERS, *firsts])


def reproduce(
    name: str,
    folder: str | Path,
    *,
    quick: bool = False,
    seed: int = 0,
    only: Sequence[str] = (),
    force: bool = False,
    stop: Callable[[], bool] = lambda: False,
    done: Callable[[str, Kept | None], None] = lambda section, found: None,
) -> Reproduction:
    """Make a paper's figures and tables anew; write ``MODEL.md``, and their numbers and pictures into ``MODEL/``.

    What an earlier call with the same code, effort and seed made is taken as it is.

    Parameters
    ----------
    name : a model's, or the first author's
    folder : where to write to, after each section
    quick : a tenth of the paths
    seed : another seed, other tiles
    only : labels of figures and tables, as "Fig. 7"; all if there are none
    force : make anew what other code or another effort made; without it that raises ParameterError
    stop() : asked every second or so; True ends it with the sections that are done
    done(section, found) : called before each section, with None, and after it
    """
    paper, folder, effort = find(name), Path(folder), efforts(quick, seed, stop)
    needed = paper.needed(only)
    data, stamped = folder / paper.model, kept.stamp(effort)
    files = {section: data / f"{section}.json" for section in paper.sections}
    found = {section: one for section, file in files.items() if (one := kept.read(file)) is not None}
    found = {section: one for section, one in found.items() if not force or one.stamp == stamped}
    for section, one in found.items():
        kept.same(files[section], one, stamped)
    data.mkdir(parents=True, exist_ok=True)
    command = f"asperity reproduce {paper.model}{' --quick' if quick else ''}"
    path = folder / f"{paper.model}.md"

    def write() -> None:
        in_order = {section: found[section] for section in paper.sections if section in found}
        with atomically(path) as part:
            part.write_text(page.page(paper, in_order, command, paper.model), encoding="utf-8")

    write()
    with suppress(StoppedError):
        for section in needed:
            if section not in found:
                effort.tick()
                done(section, None)
                start = time.perf_counter()
                made = paper.sections[section](effort)
                found[section] = kept.keep(files[section], made, stamped, time.perf_counter() - start)
                write()
            done(section, found[section])
    missing = [section for section in needed if section not in found]
    return Reproduction(paper, path, {section: found[section] for section in needed if section in found}, missing)


def write_index(folder: str | Path) -> Path:
    """Write ``index.md``, of all pages that are there."""
    path = Path(folder) / "index.md"
    with atomically(path) as part:
        models = [model for model in PAPERS if path.with_name(f"{model}.md").exists()]
        part.write_text(page.index(models), encoding="utf-8")
    return path
