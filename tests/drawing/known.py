"""Materials and measurements whose values are known."""

import asperity  # noqa: F401  isort: skip
import numpy as np

from asperity.goniophotometer import Hemisphere, Measurement
from asperity.goniophotometer.sensors import directions
from asperity.goniophotometer.tracer import BELOW, EXTRA, UNIT
from asperity.materials import Material

REFLECTANCE, ERROR = 0.6, 0.01 / np.sqrt(3)
"""Of the measurement: a Lambertian, with this relative standard error everywhere."""
SENSOR, TILES, PATHS = Hemisphere(16, 32), 4, 2**16


def measurement(reflectance=REFLECTANCE, sensor=SENSOR, angles=((0, 0), (30, 0), (60, 0))):
    """A Lambertian, as if it had been measured: tiles differ from their mean by a percent, up and down in turn."""
    wo = np.stack([sensor.directions(wi, 8) for wi in directions(angles)])
    share = reflectance / np.pi * np.clip(wo[..., 2].mean(axis=-1), 0, None) * sensor.solid_angle
    energy = np.zeros((TILES, len(angles), 1, sensor.cells + EXTRA, 3))
    energy[:, :, 0, : sensor.cells, :] = share[..., None]
    energy[..., sensor.cells + BELOW, :] = 1 - reflectance
    energy *= (1 + 0.01 * np.array([1, -1, 1, -1]))[:, None, None, None, None] * PATHS / UNIT
    about = {
        "geometry": {"type": "flat"},
        "sensor": sensor.describe(),
        "channels": ["R", "G", "B"],
        "orders": 1,
        "limit": 1,
    }
    return Measurement(
        about,
        np.array(angles, dtype=float),
        np.stack([np.zeros(TILES, int), np.arange(TILES)], axis=1),
        np.full((TILES, len(angles)), PATHS),
        energy.round().astype(np.uint64),
    )


def lambertian(reflectance=0.5):
    return Material("matte", {"type": "diffuse", "reflectance": reflectance})


GOLD = Material("gold", {"type": "roughconductor", "material": "Au", "alpha": 0.1, "distribution": "ggx"})
GRAINS = Material("grains", {"type": "micrograin", "tau_0": 0.5})
GROOVES = Material("grooves", {"type": "vgroove", "material": "Al", "alpha_u": 0.1, "alpha_v": 0.4})
GLASS = Material("glass", {"type": "roughdielectric", "alpha": 0.2})


def longest(axes):
    """The line of a diagram with most points: the curve, not the grid."""
    return max(axes.lines, key=lambda line: len(line.get_xdata()))
