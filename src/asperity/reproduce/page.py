"""A paper's page, in Markdown."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from ..models import MODELS
from ..validation.report import Finding, Table
from .kept import Kept
from .results import Absent, Paper, Result, findings, pictures, tables

FEW = 8
"""Findings that are shown at once; more are folded."""


def field(citation: str, name: str) -> str:
    """A field of a BibTeX entry, in plain text."""
    found = re.search(rf"^\s*{name}\s*=\s*\{{(.*?)\}},?$", citation, re.MULTILINE | re.DOTALL)
    text = re.sub(r"\\[`'\"^~]", "", found[1]) if found else ""  # accents, of whose letters the plain ones are left
    return re.sub(r"\s+", " ", re.sub(r"[{}]", "", text))


def authors(model: str) -> list[str]:
    """Last names of a model's authors."""
    return [author.split(",")[0] for author in field(MODELS[model].citation, "author").split(" and ")]


def name(model: str) -> str:
    """A paper, as one speaks of it."""
    first, *others = authors(model)
    year = field(MODELS[model].citation, "year")
    return f"{first} and {others[0]} {year}" if len(others) == 1 else f"{first}{' et al.' if others else ''} {year}"


def page(paper: Paper, kept: Mapping[str, Kept], command: str, folder: str) -> str:
    """The page; sections that are not kept yet are said not to be. Pictures are in ``folder``."""
    citation = MODELS[paper.model].citation
    title, doi = field(citation, "title"), field(citation, "doi")
    lines = [
        f"# {name(paper.model)}",
        f"*{title}*, [doi](https://doi.org/{doi}); the plugin `{paper.model}`.",
        made(kept, command),
        overview(paper, kept),
    ]
    for result in paper.results:
        lines += part(result, kept.get(result.section), command, folder)
    return "\n\n".join([*lines, *absences(paper.absent)]) + "\n"


def made(kept: Mapping[str, Kept], command: str) -> str:
    """By what, and how."""
    if not kept:
        return "Nothing is made yet."
    stamped = next(iter(kept.values())).stamp
    seconds = sum(one.seconds for one in kept.values())
    return (
        f"Made by `{command}`, asperity {stamped['asperity']} (code {stamped['code']}), Mitsuba {stamped['mitsuba']}, "
        f"{stamped['variant']}, in {seconds:.0f} s: {stamped['paths']:g} paths per direction where nothing else is "
        f"said, in {stamped['tiles']} groups, seed {stamped['seed']}. Errors are standard errors over groups."
    )


def overview(paper: Paper, kept: Mapping[str, Kept]) -> str:
    """A line for each figure."""
    rows = []
    for result in paper.results:
        one = kept.get(result.section)
        verdict = tally(findings(result, one)) if one else "not made yet"
        rows.append((result.label, result.shows, verdict))
    return Table(("", "what it shows", "our claims"), rows).markdown()


def part(result: Result, kept: Kept | None, command: str, folder: str) -> list[str]:
    """A figure's part of the page."""
    lines = [f"## {heading(result)}", f"**The paper:** {result.claim}"]
    if kept is None:
        return [*lines, "**Here:** not made yet."]
    found = findings(result, kept)
    lines += [f"**Here:** {kept.section.text}", *listed(found)]
    lines += [table.markdown() for table in tables(result, kept)]
    lines += [f"![{result.label}: {result.shows}]({folder}/{name}.png)" for name in pictures(result, kept)]
    lines += [f"**Where it differs, and why:** {result.why}", f"**Command:** `{command} --only '{result.label}'`"]
    return lines


def heading(result: Result) -> str:
    """Of a figure's part."""
    return f"{result.label}: {result.shows}"


def listed(found: Sequence[Finding]) -> list[str]:
    """Findings as a table; folded if there are many."""
    if not found:
        return []
    rows = [(finding.claim, finding.measured, finding.bound, finding.verdict) for finding in found]
    table = Table(("claim", "measured", "bound", ""), rows).markdown()
    if len(found) <= FEW:
        return [table]
    return [f"<details><summary>{tally(found)}</summary>", table, "</details>"]


def tally(found: Sequence[Finding]) -> str:
    """How many hold."""
    judged = [finding.passed for finding in found if finding.passed is not None]
    if not judged:
        return "shown, not judged"
    return f"{sum(judged)} of {len(judged)} hold" if all(judged) else f"**{judged.count(False)} of {len(judged)} fail**"


def absences(absent: Sequence[Absent]) -> list[str]:
    """What is not made."""
    if not absent:
        return []
    return ["## Not reproduced", Table(("", "what it shows", "why not"), absent).markdown()]


def index(pages: Sequence[str]) -> str:
    """The page of all pages."""
    rows = [(f"[{name(model)}]({model}.md)", f"`{model}`", field(MODELS[model].citation, "title")) for model in pages]
    toctree = "\n".join(["```{toctree}", ":hidden:", "", *pages, "```"])
    lines = ["# Reproduction", "Figures and tables of the papers, made anew by `asperity reproduce`."]
    return "\n\n".join([*lines, Table(("paper", "model", "title"), rows).markdown(), toctree]) + "\n"
