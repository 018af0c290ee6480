"""Small files of each format, and where the measurements for development are."""

import os
from pathlib import Path

import numpy as np
import pytest

from asperity.measured import merl
from asperity.measured.brdf import ABOVE

FOLDER = Path(os.environ.get("ASPERITY_MEASURED", Path(__file__).parents[3] / "shared/data/measured"))
SMALL = (8, 6, 10)
"""Counts of a MERL file of 12 kB."""


def real(name):
    """The path of a file for development; the test is skipped where it is missing."""
    path = FOLDER / name
    return path if path.exists() else pytest.skip(f"{path} is missing")


def glossy(wi, wo):
    """A reciprocal BRDF in RGB, f (n, 3): matte, and a broad lobe about the mirrored direction."""
    half = wi + wo
    cosine = half[:, 2] / np.maximum(np.linalg.norm(half, axis=1), 1e-30)
    return np.array([0.1, 0.08, 0.02]) + np.clip(cosine, 0, 1)[:, None] ** 20 * np.array([0.5, 0.4, 0.6])


def merl_file(path, f=glossy, counts=SMALL):
    """A file in which ``f`` is tabulated; returns its path."""
    wi, wo = merl.nodes(counts)
    above = (wi[:, 2:] > ABOVE) & (wo[:, 2:] > ABOVE)
    merl.write(np.where(above, f(wi, wo), np.nan).reshape(*counts, 3), path)
    return path
