"""Are a model's parameters found again? Fits to values of each model at random parameters, with noise of 2 %.

`python benchmarks/recovery.py [--sets 20] [MODEL ...]` prints a table for the docs. Parameters are drawn from their
usual ranges. A set is found if each of its numbers lies within three standard errors, or the fit says that the data do
not determine it.
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import asperity  # noqa: F401  isort: skip  (before mitsuba)
import mitsuba as mi
import numpy as np

from asperity import fitting
from asperity.fitting import free
from asperity.fitting.candidates import CANDIDATES, METAL
from asperity.lab import evaluate
from asperity.measured import BRDF

MODELS = {name: CANDIDATES[name] for name in ("micrograin", "lambertsphere", "interfacedlambertian", "twoscale")}
MODELS |= {"vgroove": {"type": "vgroove", **METAL}}  # symmetric: the other one takes minutes a fit
NOISE, PAIRS, SIGMAS = 0.02, 2000, 3
RGB = ("R", "G", "B")


class Number(NamedTuple):
    """A number of a set: what it was, and what the fit says."""

    name: str
    truth: float
    found: fitting.result.Parameter

    @property
    def off(self) -> float:
        """Standard errors."""
        return abs(self.found.value - self.truth) / self.found.error if self.found.error else np.inf

    @property
    def determined(self) -> bool:
        return not self.found.remark.startswith("not determined")


def directions(random: np.random.Generator, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Pairs above the surface, up to 84 degrees: a third of them near each other's mirrored direction."""
    cos, azimuth = np.sqrt(random.uniform(0.01, 1, (2, 4 * count))), random.uniform(0, 2 * np.pi, (2, 4 * count))
    sin = np.sqrt(1 - cos**2)
    wi, wo = np.stack([sin * np.cos(azimuth), sin * np.sin(azimuth), cos], axis=-1)
    wo[::3] = wi[::3] * [-1, -1, 1] + 0.1 * random.normal(size=wi[::3].shape)
    wo = wo / np.linalg.norm(wo, axis=1, keepdims=True)
    kept = np.flatnonzero(wo[:, 2] > 0.1)[:count]
    return wi[kept], wo[kept]


def recovered(model: str, seed: int, noise: float = NOISE) -> tuple[fitting.Fit, list[Number]]:
    """A fit of a model to itself at random parameters, beside these."""
    mi.set_variant("llvm_ad_rgb")
    random = np.random.default_rng(seed)
    parameters = free.chosen(free.parameters(MODELS[model]), None, ())
    truth = {one.path: one.value(random.random(3 if one.colour else 1)) for one in parameters}
    wi, wo = directions(random, PAIRS)
    material = evaluate.load(free.described(MODELS[model], truth, RGB))
    f = evaluate.at_pairs(material, wi, wo)[:-1].T / wo[:, 2:]
    data = BRDF(wi, wo, f * (1 + noise * random.normal(size=f.shape)), RGB, source=f"{model}, set {seed}")
    found = fitting.fit(data, MODELS[model], seed=seed)
    values = np.concatenate(list(truth.values()))
    return found, [Number(one.name, float(value), one) for one, value in zip(found.parameters, values)]


def is_found(numbers: list[Number]) -> bool:
    """Whether a set is."""
    return all(one.off < SIGMAS or not one.determined for one in numbers)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("models", nargs="*", default=MODELS)
    parser.add_argument("--sets", type=int, default=20)
    arguments = parser.parse_args()
    print("| model | sets found | numbers | not determined | beyond 3 standard errors | seconds a fit |")
    print("|---|---|---|---|---|---|")
    for model in arguments.models:
        sets = [recovered(model, seed) for seed in range(arguments.sets)]
        numbers = [one for _, one in sets for one in one]
        told = sum(not one.determined for one in numbers)
        far = sum(one.determined and one.off >= SIGMAS for one in numbers)
        found = f"{sum(is_found(one) for _, one in sets)} of {len(sets)}"
        seconds = np.median([fit.seconds for fit, _ in sets])
        print(f"| `{model}` | {found} | {len(numbers)} | {told} | {far} | {seconds:.0f} |", flush=True)


if __name__ == "__main__":
    main()
