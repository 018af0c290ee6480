"""Makes the maps in ``textures/``: ``python -m asperity.scenes.make_textures``.

They tile, and come out the same every time.
"""

from __future__ import annotations

from pathlib import Path

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

TEXTURES = Path(__file__).with_name("textures")
SIZE = 512
THREADS = 8
"""Of the weave, across a tile and along it; even, so that over and under meet again at the seam."""
THREAD_WIDTH = 0.65
"""Of the distance between threads: the rest are the holes."""

Image = NDArray[np.float64]

x, y = np.meshgrid(*[(np.arange(SIZE) + 0.5) / SIZE] * 2)


def noise(seed: int, falloff: float, coarsest: float = 2.0, stretch: float = 1.0) -> Image:
    """Periodic Gaussian noise, mean 0 and deviation 1, amplitude spectrum f^-falloff, ``stretch`` times longer in y."""
    frequency = np.fft.fftfreq(SIZE, 1 / SIZE)
    f = np.hypot(frequency[None, :], frequency[:, None] * stretch)
    spectrum = (
        np.fft.fft2(np.random.default_rng(seed).standard_normal((SIZE, SIZE))) * np.maximum(f, coarsest) ** -falloff
    )
    spectrum[f < coarsest / 2] = 0
    image = np.fft.ifft2(spectrum).real
    return (image - image.mean()) / image.std()


def smoothstep(low: float, high: float, image: Image) -> Image:
    """0 below ``low``, 1 above ``high``, and a soft edge between."""
    t = np.clip((image - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def wood() -> Image:
    """Brown wood, sawn along the grain, which runs up the image: linear reflectance (SIZE, SIZE, 3)."""
    rings = 7 * x + 0.75 * noise(1, 2.2, stretch=5) + 0.05 * noise(2, 1.6, 8, stretch=16)
    year = rings % 1
    late_wood = smoothstep(0.25, 0.93, year) * smoothstep(1, 0.94, year)
    fibres = noise(3, 1, 24, stretch=60)
    pores = smoothstep(1.5, 2.6, noise(4, 0.6, 90, stretch=20)) * (1 - 0.6 * late_wood)
    tone = 0.3 + 0.45 * late_wood + 0.07 * fibres + 0.35 * pores + 0.08 * noise(5, 2, 2, stretch=2)
    tone = np.round(np.clip(tone, 0, 1) * 24) / 24  # few tones keep the file small
    light, dark = np.array([0.47, 0.245, 0.105]), np.array([0.085, 0.029, 0.012])
    return light * (dark / light) ** tone[..., None]


def weave_height() -> tuple[Image, Image, Image]:
    """Height of a plain weave, whether there is a thread, and the position across the visible thread in -1..1."""

    def threads(across: Image, along: Image, first: int) -> tuple[Image, Image]:
        position = (across * THREADS % 1 - 0.5) * 2 / THREAD_WIDTH
        parity = np.floor(across * THREADS) + first
        bulge = 0.35 * np.sqrt(np.clip(1 - position**2, 0, 1)) ** 0.7
        height = 0.5 * np.cos(np.pi * (along * THREADS - 0.5 + parity)) + bulge
        return np.where(np.abs(position) < 1, height, -np.inf), position

    wobble_x, wobble_y = 0.0016 * noise(11, 2.5), 0.0016 * noise(12, 2.5)
    warp, across_warp = threads(x + wobble_x, y + wobble_y, 0)
    weft, across_weft = threads(y + wobble_y, x + wobble_x, 1)
    height = np.maximum(warp, weft)
    return height, np.isfinite(height), np.where(warp > weft, across_warp, across_weft)


def weave() -> dict[str, Image]:
    """Opacity, reflectance and filling factor of the dirt of a plain weave of white plastic, on top of each other."""
    height, thread, across = weave_height()
    solid = np.where(thread, height, -0.6)
    hollow = gaussian_filter(solid, 9, mode="wrap") - solid
    shade = 0.82 - 0.22 * smoothstep(0, 0.5, hollow) - 0.05 * smoothstep(0.7, 1, np.abs(across))
    gathered = hollow + 0.05 * noise(13, 1.3, 6) + 0.08 * noise(14, 1.8, 2)
    return {
        "weave": gaussian_filter(thread.astype(float), 0.6, mode="wrap"),
        "weave_shade": gaussian_filter(shade, 0.6, mode="wrap"),
        "weave_dirt": 0.8 * gaussian_filter(smoothstep(-0.1, 0.3, gathered) * thread, 1.5, mode="wrap"),
    }


def patina() -> Image:
    """Filling factor of something that spreads in blotches: rust, mold."""
    spread = noise(21, 1.9, 3) + 0.22 * noise(22, 1.5, 12)
    return 0.85 * smoothstep(-0.5, 2, spread)


def wear() -> Image:
    """Roughness of a metal that was handled: smooth where it was touched, rough elsewhere, and scratched."""
    rough = smoothstep(-1.2, 1.6, noise(31, 1.8, 3) + 0.25 * noise(32, 1.2, 16))
    scratches = smoothstep(1.6, 2.6, noise(33, 0.7, 40, stretch=30))
    return 0.05 + 0.95 * np.maximum(rough, 0.6 * scratches)


def lint() -> Image:
    """Filling factor of what lies loose: dust, flock, fibres; even from afar, and grainy at hand."""
    loose = noise(41, 0.5, 60) + 0.4 * noise(42, 1.2, 6)
    return np.round(16 * (0.2 + 0.7 * smoothstep(-1.6, 1.6, loose[::2, ::2]))) / 16  # half the size, for the file


def encoded(image: Image) -> NDArray[np.uint8]:
    """8 bits: a colour in sRGB, a grey one, which is data, as it is."""
    if image.ndim == 3:
        image = np.where(image < 0.0031308, 12.92 * image, 1.055 * image ** (1 / 2.4) - 0.055)
    return np.round(255 * image).astype(np.uint8)


if __name__ == "__main__":
    mi.set_variant("scalar_rgb")
    for name, image in {"wood": wood(), **weave(), "patina": patina(), "wear": wear(), "lint": lint()}.items():
        mi.Bitmap(encoded(image)).write(str(TEXTURES / f"{name}.png"), quality=9)
