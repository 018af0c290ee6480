"""Writes a BRDF as a file of any format, and says how far off is what is read from it.

- ``.binary`` holds MERL's grid; other programs read no other counts than MERL's own.
- ``.bsdf`` holds tables for Mitsuba's plugin ``measured`` (`goniophotometer.tensor_file`).
- ``.csv`` and ``.npz`` hold pairs of directions: those of the data, or else nodes of a grid of half vectors and angles
  from them, which is linear in between when an isotropic one is read (`functions.of_brdf`).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..errors import ParameterError, whole
from ..goniophotometer import tensor_file
from . import archive, functions, goniometer, merl
from .brdf import ABOVE, BRDF, Array
from .functions import Function

FORMATS = (".binary", ".bsdf", ".csv", ".npz")
RESOLUTIONS = {".binary": 90, ".bsdf": 90, ".csv": 30, ".npz": 60}
"""Steps of θ_h from 0 to 90 degrees, by default."""
ANISOTROPIC = {".bsdf": 60, ".csv": 20, ".npz": 24}
"""The same, where the azimuth of the half vector counts."""
MOST = 360
"""Steps that may be asked for."""
LAST = 89.0
"""Degrees of the last angle of incidence of tables."""
TESTED = 20_000
"""Random pairs that errors are measured at, at most 85 degrees from the normal."""
FAINT = 0.01
"""Relative errors are of f, or of this share of its mean where f is less."""
QUANTILES = (0.5, 0.95, 1.0)

Progress = Callable[[str, int, int], None]


@dataclass(frozen=True)
class Converted:
    """A file that was written, and how far its values are from those that it was made of.

    Errors are those of `TESTED` random pairs of directions that are no nodes (`functions.random_pairs`), the mean over
    the channels: the median, what 95% of them stay below, and the largest.
    """

    path: Path
    relative: tuple[float, float, float]
    log_cosine: tuple[float, float, float]
    """Of ln(1 + f cosθ_o)."""
    scattered: tuple[float, float, float] | None = None
    """Relative, of data that lie on no grid: of pairs of theirs, interpolated from the others; or None."""


def convert(
    f: Function,
    path: str | Path,
    pairs: BRDF | None = None,
    *,
    resolution: int | None = None,
    progress: Progress = lambda name, done, total: None,
) -> Converted:
    """Write a BRDF as what the ending of ``path`` says: .binary, .bsdf, .csv or .npz.

    ``resolution`` counts the steps of θ_h in 90 degrees; that of MERL, 90, is the default for ``.binary`` and
    ``.bsdf``. Without it, the ``pairs`` that were measured come into ``.csv`` and ``.npz`` as they are. For ``.bsdf``,
    a variant of Mitsuba with the channels has to be set. Raises ParameterError.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in FORMATS:
        raise ParameterError(f"{path}: the ending is {path.suffix!r}. Allowed: {', '.join(FORMATS)}.")
    if resolution is not None:
        whole("resolution", resolution, 4, MOST)
    kept = pairs if resolution is None else None
    steps = resolution or _steps(f, ending)
    if ending == ".bsdf":
        return _checked(f, table(f, path, steps, progress), path)
    progress("writing", 0, 2)
    if ending == ".binary":
        merl.write(_grid(kept, f, steps), path)
    else:
        (goniometer if ending == ".csv" else archive).save(kept or nodes(f, steps), path)
    progress("checking", 1, 2)
    read = {".binary": merl.load, ".csv": goniometer.load, ".npz": archive.load}[ending](path)
    return _checked(f, functions.of_brdf(read), path)


def _checked(f: Function, written: Function, path: Path) -> Converted:
    wi, wo = functions.random_pairs(TESTED)
    wanted, found = f(wi, wo), written(wi, wo)  # of Y, in R, G and B, all three
    logs = (np.log1p(np.maximum(x, 0) * wo[:, 2:]) for x in (wanted, found))
    scattered = None
    if isinstance(f.f, functions.Scattered):
        chosen, between = f.f.cross_validation()
        scattered = quantiles(relative(f.f.brdf.values[chosen], between)) if len(chosen) else None
    return Converted(path, quantiles(relative(wanted, found)), quantiles(np.abs(np.subtract(*logs))), scattered)


def relative(wanted: Array, found: Array) -> Array:
    """Relative errors (n, channels)."""
    return np.abs(found - wanted) / np.maximum(wanted, np.maximum(FAINT * wanted.mean(axis=0), 1e-12))


def quantiles(errors: Array) -> tuple[float, float, float]:
    """`QUANTILES` of the means over channels of errors (n, channels)."""
    median, most, worst = np.quantile(errors.mean(axis=1), QUANTILES)
    return float(median), float(most), float(worst)


def _grid(kept: BRDF | None, f: Function, steps: int) -> Array:
    """Values of MERL's file; those that data on the same grid lack stay out."""
    if f.channels not in (merl.CHANNELS, ("Y",)):
        raise ParameterError(f"channels are {', '.join(f.channels)}: .binary holds R, G and B. .bsdf has wavelengths.")
    if not f.isotropic:
        raise ParameterError(f"{f.source or 'the BRDF'} is anisotropic, which .binary cannot hold. .bsdf can.")
    counts = (steps, steps, 2 * steps)
    values = merl.table(kept, counts) if kept is not None and merl.counts(kept) == counts else None
    if values is None:
        wi, wo = merl.nodes(counts)
        above = (wi[:, 2] > ABOVE) & (wo[:, 2] > ABOVE)
        values = np.full((len(wi), len(f.channels)), np.nan)
        values[above] = np.maximum(f(wi[above], wo[above]), 0)
        values = values.reshape(*counts, -1)
    return np.broadcast_to(values, (*counts, 3))


def _steps(f: Function, ending: str) -> int:
    """The resolution that there is by default; tables of scattered pairs need no more than these resolve."""
    steps = (RESOLUTIONS if f.isotropic else RESOLUTIONS | ANISOTROPIC)[ending]
    if ending != ".bsdf" or not isinstance(f.f, functions.Scattered):
        return steps
    finest = 5 * len(f.f.values) ** (1 / 3) if f.isotropic else 2 * len(f.f.values) ** (1 / 4)
    return int(np.clip(finest, 12, steps))


def table(f: Function, path: str | Path, steps: int | None = None, progress: Progress = lambda *_: None) -> Function:
    """Write the table of Mitsuba's plugin ``measured``, and give back the function that the plugin has.

    Raises ParameterError if the active variant has other channels.
    """
    from .. import loading
    from ..lab import evaluate

    _check_variant(f)
    steps = steps or _steps(f, ".bsdf")
    theta = [*np.linspace(0, LAST - 1, max(steps // 2, 4)), LAST]
    phi = [0.0] if f.isotropic else list(np.arange(-180.0, 180, 22.5))
    tensor_file.tabulate(
        lambda wi, wo: np.maximum(f(wi, wo), 0), path, theta, phi, steps + 1, f.channels, f.source,
        lambda done, total: progress("tabulating", done, total),
    )  # fmt: skip
    bsdf = loading.load({"type": "measured", "filename": str(Path(path).resolve())})
    waves = [float(name.removesuffix(" nm")) for name in f.channels] if f.channels[0].endswith(" nm") else None

    def read(wi: Array, wo: Array) -> Array:
        return np.asarray(evaluate.spectra(bsdf, wi, wo, waves).T[:, : len(f.channels)] / wo[:, 2:])

    return replace(f, f=read)


def _check_variant(f: Function) -> None:
    import mitsuba as mi

    from ..lab import evaluate

    spectral = f.channels[0].endswith(" nm")
    evaluate.active_variant()
    if mi.is_spectral != spectral or mi.is_monochromatic:
        suited = "spectral" if spectral else "rgb"
        raise ParameterError(
            f"variant {mi.variant()}: {', '.join(f.channels)} need one with such channels, such as llvm_ad_{suited}."
        )


def nodes(f: Function, steps: int) -> BRDF:
    """Values at nodes of a grid: MERL's; of an anisotropic BRDF with azimuths of the half vector, and half the θ_d."""
    if f.isotropic:
        counts = (steps, steps, 2 * steps)
        wi, wo = merl.nodes(counts)
        weights = merl.solid_angles(counts)
        first = (np.arange(len(wi)) % (steps * 2 * steps) >= 2 * steps) | (np.arange(len(wi)) % (2 * steps) == 0)
    else:
        counts = (steps, steps // 2, steps)
        wi, wo = (np.repeat(w, steps, axis=0) for w in merl.nodes(counts))
        turn = np.tile(np.arange(steps) * 2 * np.pi / steps, len(wi) // steps)
        wi, wo = (functions.turned(w, turn) for w in (wi, wo))
        weights = np.repeat(merl.solid_angles(counts), steps)
        first = weights > 0
    above = (wi[:, 2] > merl.NEAR) & (wo[:, 2] > merl.NEAR) & first
    wi, wo = wi[above], wo[above]
    return BRDF(wi, wo, f(wi, wo), f.channels, None, f.isotropic, f.source, weights=weights[above])
