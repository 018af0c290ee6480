"""Pictures of reports."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from ..goniophotometer import Estimate, Hemisphere
from ..goniophotometer.sensors import Sensor


def axes(x: str, y: str, title: str) -> tuple[Figure, Axes]:
    """An empty diagram."""
    figure = _figure(7, 4.5)
    found = figure.subplots()
    found.set(xlabel=x, ylabel=y, title=title)
    found.grid(alpha=0.3)
    return figure, found


def panels(rows: int, columns: int, x: str, y: str, title: str, width: float = 3.1) -> tuple[Figure, np.ndarray]:
    """Empty diagrams (rows, columns), each so many inches wide."""
    figure = _figure(width * columns, 2.2 * rows + 0.6)
    figure.suptitle(title)
    figure.supxlabel(x, fontsize=9)
    figure.supylabel(y, fontsize=9)
    return figure, figure.subplots(rows, columns, squeeze=False)


def slices(title: str, sensor: Sensor, truth: Estimate, models: dict[str, np.ndarray]) -> Figure:
    """The hemisphere as traced and as models have it, and the models' relative errors (Lucas 2024, Fig. 7 to 9).

    Rows are directions of incidence (the first is drawn); columns of the pictures are azimuths, their rows cosines.
    Errors are left out where the traced value is not known to a tenth.
    """
    assert isinstance(sensor, Hemisphere)
    figure = _figure(3.2 * (1 + len(models)), 5.6)
    figure.suptitle(title)
    value, error = truth.value[0], truth.error[0]
    known = error < 0.1 * value
    low, high = (value[known].min(), value[known].max()) if known.any() else (1e-3, 1.0)
    grid = figure.subplots(2, 1 + len(models), sharex=True, sharey=True)
    extent = (0, 360, 0, 1)

    def show(place, values, name, **options):
        place.set_title(name, fontsize=9)
        return place.imshow(
            values.reshape(sensor.rows, sensor.columns),
            extent=extent,
            aspect="auto",
            interpolation="nearest",
            **options,
        )

    def log(values):
        return np.log10(np.maximum(values, low))

    for place, name, values in zip(grid[0], ("traced", *models), (value, *(model[0] for model in models.values()))):
        brightness = show(place, log(values), name, cmap="viridis", vmin=np.log10(low), vmax=np.log10(high))
    figure.colorbar(brightness, ax=grid[0], label="log₁₀ f cos θₒ [1/sr]")
    show(
        grid[1, 0],
        np.where(known, error / np.maximum(value, 1e-30), np.nan),
        "σ / value",
        cmap="RdGy_r",
        vmin=-0.2,
        vmax=0.2,
    )
    for place, model in zip(grid[1, 1:], models.values()):
        relative = np.where(known, model[0] / np.where(known, value, 1) - 1, np.nan)
        errors = show(
            place,
            relative,
            f"relative error, mean {np.abs(relative[known]).mean():.1%}" if known.any() else "too few paths",
            cmap="RdGy_r",
            vmin=-0.2,
            vmax=0.2,
        )
    figure.colorbar(errors, ax=grid[1], label="model / traced - 1")
    for place in grid[1]:
        place.set_xlabel("φₒ [°]")
    for place in grid[:, 0]:
        place.set_ylabel("cos θₒ")
    return figure


def _figure(width: float, height: float) -> Figure:
    figure = Figure(figsize=(width, height), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    return figure
