"""What a page says of a paper: its figures and tables, what it claims of each, and which of our measurements tell."""

from __future__ import annotations

from collections.abc import Sequence
from fnmatch import fnmatchcase
from typing import NamedTuple

from ..errors import UnknownNameError
from ..validation import Sections
from ..validation.report import Finding, Table
from .kept import Kept


class Result(NamedTuple):
    """A figure or a table of a paper, what it claims, and where our number stands.

    ``findings`` and ``pictures`` are patterns of the names that they have in the ``section``; ``tables`` are the
    places of tables in it. ``why`` says where ours differs from the paper, and why.
    """

    label: str
    shows: str
    claim: str
    section: str
    why: str
    findings: Sequence[str] = ("*",)
    pictures: Sequence[str] = ("*",)
    tables: slice = slice(None)


class Absent(NamedTuple):
    """A figure or a table that is not made, and why."""

    label: str
    shows: str
    why: str


class Paper(NamedTuple):
    """A paper: what makes the sections, by their names, and what they tell about it."""

    model: str
    sections: Sections
    results: Sequence[Result]
    absent: Sequence[Absent]

    def needed(self, labels: Sequence[str] = ()) -> list[str]:
        """The sections that these figures need, in their order; without labels, all that there are.

        Raises UnknownNameError for a label that no figure has.
        """
        known = [result.label for result in self.results]
        for label in labels:
            if label not in known:
                raise UnknownNameError(f"figure or table of {self.model}'s paper", label, known)
        wanted = {result.section for result in self.results if result.label in labels}
        return [name for name in self.sections if name in wanted or not labels]


def findings(result: Result, kept: Kept) -> list[Finding]:
    """Those of a section that tell about a figure, in their order; raises LookupError if one is asked for in vain."""
    named = {finding.claim: finding for finding in kept.section.findings}
    return [named[claim] for claim in matching(result, list(named), result.findings)]


def pictures(result: Result, kept: Kept) -> list[str]:
    """The names of a section's pictures that show a figure."""
    return matching(result, kept.pictures, result.pictures)


def tables(result: Result, kept: Kept) -> Sequence[Table]:
    """Those of a section that belong to a figure."""
    return kept.section.tables[result.tables]


def matching(result: Result, names: Sequence[str], patterns: Sequence[str]) -> list[str]:
    """Names that fit a pattern; raises LookupError if one fits none, unless all are asked for, of none."""
    for pattern in patterns:
        if pattern != "*" and not any(fnmatchcase(name, pattern) for name in names):
            raise LookupError(f"{result.label}: {result.section!r} has nothing like {pattern!r}, but {list(names)}")
    return [name for name in names if any(fnmatchcase(name, pattern) for pattern in patterns)]
