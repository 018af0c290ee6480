"""Tables of docs/fitting-results.md, from what `benchmarks/merl.py` wrote into `fits.json`."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from statistics import median
from typing import Any

RESULTS = Path(__file__).parent / "fits.json"
GEOMETRIES = RESULTS.with_name("geometries.json")
"""What `benchmarks/geometries.py` found."""
PUBLISHED = {"Ngan 2005": 8, "Löw 2012": 9, "Bagher 2012": 18}
"""Fits by others, and how many numbers each has."""
Fits = dict[str, dict[str, Any]]


def ours() -> list[str]:
    """The candidates that have one of this package's models."""
    from asperity.fitting import CANDIDATES
    from asperity.models import MODELS

    return [name for name, given in CANDIDATES.items() if given.get("bsdf_0", given)["type"] in MODELS]


def of(results: dict[str, Fits], group: str) -> dict[str, Fits]:
    """The materials of a set, by their own names, with the fits that did not fail."""
    found = {name.partition("/")[2]: fits for name, fits in results.items() if name.startswith(f"{group}/")}
    return {name: {m: fit for m, fit in fits.items() if "error" in fit} for name, fits in found.items()}


def best(fits: Fits, models: Iterable[str]) -> tuple[str, float] | None:
    """The name and the log-cosine error of the nearest of these models."""
    return min(((m, fits[m]["error"]) for m in models if m in fits), key=lambda one: one[1], default=None)


def table(heads: list[str], rows: list[list[str]]) -> str:
    """In Markdown."""
    return "\n".join("| " + " | ".join(row) + " |" for row in [heads, ["---"] * len(heads), *rows])


def shown(fits: Fits, models: Iterable[str]) -> list[str]:
    """Two cells: the nearest of the models, and its error."""
    found = best(fits, models)
    return [found[0], f"{found[1]:.4f}"] if found else ["", ""]


def mitsubas(fits: Fits) -> list[str]:
    """The candidates of Mitsuba alone that were fitted."""
    return [m for m in fits if m not in ours() and m not in PUBLISHED]


def materials(results: dict[str, Fits]) -> str:
    """A row a material of MERL."""
    rows = []
    for name, fits in sorted(of(results, "merl").items()):
        theirs = [f"{fits[m]['error']:.4f}" if m in fits else "" for m in PUBLISHED]
        rows.append([name, *shown(fits, ours()), *shown(fits, mitsubas(fits)), *theirs])
    return table(["material", "best of ours", "error", "best of Mitsuba's", "error", *PUBLISHED], rows)


def models(results: dict[str, Fits]) -> str:
    """A row a model: how near it is to the materials that all were fitted to, and to all that it was fitted to."""
    found = of(results, "merl")
    names = list(dict.fromkeys(m for fits in found.values() for m in fits))
    candidates = [m for m in names if m not in PUBLISHED]
    winners = [won[0] for fits in found.values() if (won := best(fits, candidates))]
    common = [fits for fits in found.values() if set(candidates) <= fits.keys()]
    rows = []
    for model in names:
        fits, few = ([one[model] for one in group if model in one] for group in (found.values(), common))
        numbers = PUBLISHED.get(model) or fits[0]["numbers"]
        medians = [f"{median(fit['error'] for fit in group):.4f}" if group else "" for group in (few, fits)]
        first = "" if model in PUBLISHED else str(winners.count(model))
        rows.append([model, str(numbers), *medians, str(len(fits)), first])
    rows.sort(key=lambda row: row[2])
    heads = ["model", "numbers", f"median error, of {len(common)}", "of all", "materials", "nearest"]
    return table(heads, rows)


def goals(results: dict[str, Fits]) -> str:
    """On how many of the materials the best of ours is at or below each published fit."""
    lines = []
    for theirs in PUBLISHED:
        both = [fits for fits in of(results, "merl").values() if theirs in fits and best(fits, ours())]
        won = sum(best(fits, ours())[1] <= fits[theirs]["error"] for fits in both)  # type: ignore[index]
        lines.append(f"* {theirs}: the best of ours is at or below it on {won} of {len(both)} materials.")
    return "\n".join(lines)


def paints(results: dict[str, Fits]) -> str:
    """A row a paint of RGL."""
    rows = [[name, *shown(fits, ours()), *shown(fits, mitsubas(fits))] for name, fits in of(results, "rgl").items()]
    return table(["material", "best of ours", "error", "best of Mitsuba's", "error"], sorted(rows))


def ptfe(results: dict[str, Fits]) -> str:
    """A row a model."""
    fits = of(results, "nist").get("PTFE", {})
    order = sorted(fits, key=lambda m: fits[m]["f"])
    rows = [[m, str(fits[m]["numbers"]), f"{fits[m]['f']:.4f}", f"{100 * fits[m]['relative']:.1f} %"] for m in order]
    return table(["model", "numbers", "RMS of f, 1/sr", "relative"], rows)


def geometries(results: dict[str, Fits]) -> str:
    """A row a geometry: which candidates come nearest, and the parameters of the one that is the geometry's."""
    rows = []
    for name, found in json.loads(GEOMETRIES.read_text(encoding="utf-8")).items():
        errors = {model: error for model, error, _ in found["ranked"]}
        first, second = sorted(errors, key=errors.__getitem__)[:2]
        said = [f"`{n}` {value:.4f} ± {error:.4f}, is {truth:g}" for n, truth, value, error in found["parameters"]]
        nearest = [f"{model}, {errors[model]:.4f}" for model in (first, second)]
        rows.append([name, *nearest, f"{found['noise']:.4f}", "; ".join(said)])
    return table(["geometry", "nearest", "next", "noise", "parameters"], rows)


TABLES = {
    "geometries": geometries,
    "materials": materials,
    "models": models,
    "goals": goals,
    "paints": paints,
    "ptfe": ptfe,
}
"""By the names that the page's marks have."""


def filled(page: str) -> str:
    """The page with the tables between the marks."""
    results = json.loads(RESULTS.read_text(encoding="utf-8"))
    for name, made in TABLES.items():
        begin, end = f"<!-- {name}: made by docs/build.py -->", f"<!-- end of {name} -->"
        before, rest = page.split(begin)
        page = f"{before}{begin}\n{made(results)}\n{end}{rest.split(end)[1]}"
    return page
