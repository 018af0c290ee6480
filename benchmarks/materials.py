"""Measured materials for the studies, by name: ``merl/chrome``, ``rgl/vch_silk_blue_rgb``, ``nist/PTFE``.

They lie in the folder ``ASPERITY_MEASURED``, by default ../shared/data/measured beside the checkout, whose README says
where they come from; nothing of them is in this package.
"""

from __future__ import annotations

import json
import os
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.fitting.fit import GRAZING
from asperity.measured import BRDF, merl

FOLDER = Path(os.environ.get("ASPERITY_MEASURED", Path(__file__).parents[2] / "shared/data/measured"))
SETS = ("merl", "rgl", "nist")


def names(of: str) -> list[str]:
    """All materials of a set."""
    if of == "merl":
        return [f"merl/{name}" for name in networks()["names"]]
    endings = {"rgl": "*.bsdf", "nist": "*.csv"}
    return [f"{of}/{path.stem}" for path in sorted((FOLDER / of).glob(endings[of]))]


def load(name: str) -> BRDF:
    """A material's pairs within `GRAZING` degrees, which all errors are taken over."""
    from asperity import fitting

    of, _, material = name.partition("/")
    if of == "merl":
        return within(network(material))
    path = next((FOLDER / of).glob(f"{material}.*"))
    found = within(fitting.data(path))
    return replace(found, weights=solid_angles(path, found)) if of == "rgl" else found


def within(brdf: BRDF) -> BRDF:
    """Its pairs within `GRAZING` degrees."""
    least = np.cos(np.radians(GRAZING)) - 1e-9
    return brdf.subset(np.flatnonzero((brdf.wi[:, 2] >= least) & (brdf.wo[:, 2] >= least)))


def solid_angles(path: Path, brdf: BRDF) -> NDArray[np.float64]:
    """dω_i dω_o of vertices of RGL (n,), up to a factor: the file's samples are as dense as the plugin draws them.

    None stands for more than a hundredth of the hemisphere: where hardly anything is drawn, the density says nothing.
    """
    import mitsuba as mi

    from asperity.lab import evaluate

    si, wo = evaluate.interaction(evaluate.vectors(brdf.wi), len(brdf)), evaluate.vectors(brdf.wo)
    density = np.array(evaluate.load({"type": "measured", "filename": str(path)}).pdf(mi.BSDFContext(), si, wo))
    rings, ring, count = np.unique(np.radians(brdf.incident[:, 0]).round(4), return_inverse=True, return_counts=True)
    width = np.gradient(rings)
    incident = np.sin(np.maximum(rings, width / 4)) * width
    return incident[ring] / count[ring] / np.maximum(density, 100 / (2 * np.pi * count[ring]))


@cache
def networks() -> dict[str, Any]:
    """The networks that Sztrajman et al. 2021 trained to MERL's tables."""
    with np.load(FOLDER / "merl/nets.npz") as file:
        return {name: file[name] for name in file.files}


@cache
def published() -> dict[str, Any]:
    """Published fits, by list and material."""
    return dict(json.loads((FOLDER / "merl/published_fits.json").read_text()))


def network(material: str, every: int = 1) -> BRDF:
    """A network at the nodes of MERL's grid, as a file of MERL has them, or at one of so many."""
    nets = networks()
    number = list(nets["names"]).index(material)
    h, d, p = (np.arange(n) / n for n in merl.COUNTS)
    grid = np.meshgrid(h**2 * np.pi / 2, d * np.pi / 2, p * np.pi, indexing="ij")
    theta_h, theta_d, phi_d = (angle.ravel() for angle in grid)
    wi, wo = merl.directions(theta_h, theta_d, phi_d)
    once = (theta_d > 0) | (phi_d == 0)  # at θ_d = 0 all φ_d are the same pair
    kept = np.flatnonzero((wi[:, 2] > 0) & (wo[:, 2] > 0) & once)[::every]
    theta_h, theta_d, phi_d = theta_h[kept], theta_d[kept], phi_d[kept]
    half = [np.sin(theta_h), np.zeros_like(theta_h), np.cos(theta_h)]
    difference = [np.sin(theta_d) * np.cos(phi_d), np.sin(theta_d) * np.sin(phi_d), np.cos(theta_d)]
    x = np.stack(half + difference, axis=1)
    for layer in (1, 2):
        x = np.maximum(x @ nets[f"weight_{layer}"][number] + nets[f"bias_{layer}"][number], 0)
    values = np.maximum(np.exp(x @ nets["weight_3"][number] + nets["bias_3"][number]) - 1, 0)
    weights = merl.solid_angles()[kept]
    return BRDF(wi[kept], wo[kept], values, merl.CHANNELS, source=f"MERL, {material}", weights=weights)
