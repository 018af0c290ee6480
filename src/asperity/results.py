"""What the functions of `api` give back where arrays would not say it all: each can be drawn, and saved."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from . import drawing, files, variants
from .errors import ParameterError
from .lab import pictures
from .lab.checks import Result
from .lab.compare import Comparison
from .materials import Material

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Array = NDArray[np.float64]
PICTURES = (".png", ".exr")
FIGURES = (".png", ".pdf", ".svg", ".json")


class Samples(NamedTuple):
    """Directions (..., n, 3) that a BSDF drew, their weights f |cos θo| / pdf (..., n, channels), and pdfs (..., n).

    A sample that failed has weight 0. That of a mirror has the pdf that Mitsuba gives it, 1.
    """

    wo: Array
    weight: Array
    pdf: Array


@dataclass(frozen=True)
class Checks:
    """What the checks of a BSDF found."""

    name: str
    results: tuple[Result, ...]

    @property
    def passed(self) -> bool:
        """Whether none failed; one that does not apply is skipped, and does not count."""
        return not self.failed

    @property
    def failed(self) -> list[Result]:
        """Those that failed."""
        return [result for result in self.results if result.passed is False]

    def __iter__(self) -> Iterator[Result]:
        return iter(self.results)

    def __str__(self) -> str:
        verdict = {True: "passed", False: "FAILED", None: "skipped"}
        return "\n".join(f"{r.name:13} {verdict[r.passed]:8} {r.measured}" for r in self.results)

    def plot(self) -> list[Figure]:
        """A figure of each failure that measured something."""
        return [pictures.figure(result) for result in self.failed if result.evidence is not None]

    def save(self, folder: str | Path) -> list[Path]:
        """Write these figures as PNG into a folder, which is made; return their paths."""
        folder = files.folder(folder, "folder")
        drawn = [result for result in self.failed if result.evidence is not None]
        paths = [folder / f"{self.name}-{result.name}.png" for result in drawn]
        for result, path in zip(drawn, paths):
            with files.atomically(path) as part:
                pictures.write(result, part)
        return paths


@dataclass(frozen=True)
class Compared:
    """Two materials, the first of which is the reference, and what was found; ``found`` holds values, by direction."""

    a: Material
    b: Material
    found: Comparison

    @property
    def numbers(self) -> dict[str, Any]:
        """Mean and worst relative error and where, difference of albedos, RMS of log-cosine errors, by name."""
        return self.found.numbers()

    def plot(self) -> Figure:
        """A figure: maps, their relative difference, slices, albedos."""
        with variants.switched(variants.of([self.a, self.b])):
            return drawing.compared(self.a, self.b, self.found)

    def save(self, path: str | Path) -> None:
        """Write the figure, as PNG, PDF or SVG, or the numbers, as JSON; by the ending."""
        path = _writable(path, FIGURES)
        if path.suffix.lower() != ".json":
            return drawing.style.save(self.plot(), path)
        with files.atomically(path) as part:
            part.write_text(json.dumps(self.numbers, indent=2) + "\n", encoding="utf-8")


@dataclass(frozen=True)
class Picture:
    """A rendered image: linear radiance, float32 (height, width, 3), of R, G and B."""

    image: NDArray[np.float32]

    def plot(self) -> Figure:
        """A figure that shows it, in sRGB."""
        from matplotlib.figure import Figure

        height, width = self.image.shape[:2]
        figure = Figure(figsize=(width / 100, height / 100), dpi=100)
        axes = figure.add_axes((0, 0, 1, 1))
        axes.imshow(np.array(self._bitmap(".png")))
        axes.set_axis_off()
        return figure

    def save(self, path: str | Path) -> None:
        """Write a PNG, in sRGB and clipped at 1, or an EXR, of what there is; by the ending."""
        path = _writable(path, PICTURES)
        with files.atomically(path) as part:
            self._bitmap(path.suffix.lower()).write(str(part))

    def _bitmap(self, ending: str) -> Any:
        bitmap = mi.Bitmap(self.image)
        if ending == ".exr":
            return bitmap
        return bitmap.convert(mi.Bitmap.PixelFormat.RGB, mi.Struct.Type.UInt8, srgb_gamma=True)


def _writable(path: str | Path, formats: tuple[str, ...]) -> Path:
    """The path of a file that may be written; raises ParameterError."""
    path = Path(path)
    if path.suffix.lower() not in formats:
        raise ParameterError(f"path = {str(path)!r}: its ending has to be one of {', '.join(formats)}.")
    files.check_folder(path, "path")
    return path
