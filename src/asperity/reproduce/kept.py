"""Sections on disk: what was measured, by which code and effort; so that nothing is measured twice."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cache
from hashlib import sha256
from pathlib import Path
from typing import Any, NamedTuple

import mitsuba as mi

from ..errors import ParameterError, UnreadableFileError
from ..files import atomically
from ..validation.report import Effort, Finding, Section, Table
from ..version import __version__

PACKAGE = Path(__file__).parents[1]
WORDS = PACKAGE / "cli", PACKAGE / "reproduce" / "papers"
"""Code that no number depends on."""


class Kept(NamedTuple):
    """A section without its figures, and the names of their files; what made it, and in how many seconds."""

    section: Section
    pictures: Sequence[str]
    stamp: Mapping[str, Any]
    seconds: float


def stamp(effort: Effort) -> dict[str, Any]:
    """What a number depends on."""
    code = {"asperity": __version__, "code": code_digest(), "mitsuba": mi.__version__, "variant": mi.variant()}
    return code | {"paths": effort.paths, "tiles": effort.tiles, "seed": effort.seed}


@cache
def code_digest() -> str:
    """Of all code that numbers may depend on, and of the presets, textures and lights that renders do."""
    digest = sha256()
    for path in sorted(PACKAGE.rglob("*")):
        if path.is_file() and path.suffix != ".pyc" and not any(words in path.parents for words in WORDS):
            digest.update(path.read_bytes())
    return digest.hexdigest()[:12]


def keep(file: Path, section: Section, stamped: Mapping[str, Any], seconds: float) -> Kept:
    """Write a section, and its pictures before it: where there is a file, all is there."""
    for name, figure in section.figures.items():
        with atomically(file.with_name(f"{name}.png")) as part:
            figure.savefig(part, format="png")
    without = Section(
        section.title, section.text, section.findings, [table.in_words() for table in section.tables], figures={}
    )
    kept = Kept(without, list(section.figures), stamped, seconds)
    with atomically(file) as part:
        part.write_text(json.dumps(kept._asdict() | {"section": asdict(without)}, indent=1) + "\n", encoding="utf-8")
    return kept


def read(file: Path) -> Kept | None:
    """What was kept, if anything."""
    if not file.exists():
        return None
    try:
        found = json.loads(file.read_text(encoding="utf-8"))
        given = found["section"]
        findings = [Finding(**finding) for finding in given["findings"]]
        section = Section(given["title"], given["text"], findings, [Table(**table) for table in given["tables"]])
        kept = Kept(section, found["pictures"], found["stamp"], float(found["seconds"]))
    except (OSError, ValueError, KeyError, TypeError) as error:
        reason = f"{error}; remove it, and it is made anew"
        raise UnreadableFileError("section", file, (".json of asperity reproduce",), reason) from error
    return kept if all(file.with_name(f"{name}.png").is_file() for name in kept.pictures) else None


def same(file: Path, kept: Kept, stamped: Mapping[str, Any]) -> Kept:
    """What was kept, if it was made in the same way; else raise ParameterError, for it is not to be lost."""
    for name, value in stamped.items():
        if kept.stamp.get(name) != value:
            was = kept.stamp.get(name)
            raise ParameterError(f"{file} was made with {name} {was}, not {value}. Take another folder, or --force.")
    return kept
