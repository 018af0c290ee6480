"""Intel's Open Image Denoise, through the wheel ``pyoidn`` (an extra): pictures without noise, for looking at."""

from __future__ import annotations

from importlib.util import find_spec
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from asperity.errors import ParameterError

Image = NDArray[np.float32]


def available() -> bool:
    """Whether it can be had, here and in this variant."""
    return find_spec("pyoidn") is not None and not mi.variant().startswith("scalar")


def require() -> None:
    """Raise ParameterError, with what to do, if it cannot be had."""
    if find_spec("pyoidn") is None:
        raise ParameterError("--denoise: there is no pyoidn; python -m pip install 'asperity[denoise]'")
    if not available():
        raise ParameterError(f"--denoise: not in the variant {mi.variant()}; take one that starts with llvm or cuda.")


def features(scene: mi.Scene, sensor: int = 0, spp: int = 8, seed: int = 0) -> tuple[Image, Image]:
    """Albedo and normal (height, width, 3) of what a sensor sees first, which guide the denoiser; 0 where it sees none.

    Mitsuba's own AOV asks for the albedo at every sample, which is an integral for most models: slower than the whole
    picture. Here it is the mean weight of one sample of the BSDF each. It is grey outside of the RGB variants.
    """
    # One sample after the other: of a large picture, all at once would take more memory than rendering it.
    total = _seen(scene, sensor, seed)
    for n in range(1, spp):
        total += _seen(scene, sensor, seed + n)
    albedo, normal = total / spp
    return np.clip(albedo, 0, 1), normal


def _seen(scene: mi.Scene, sensor: int, seed: int) -> Image:
    """Albedo and normal (2, height, width, 3), of one sample a pixel."""
    camera = scene.sensors()[sensor]
    width, height = (int(n) for n in camera.film().crop_size())
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(seed, width * height)
    pixel = dr.arange(mi.UInt32, width * height)
    corner = mi.Point2f(mi.Float(pixel % width), mi.Float(pixel // width))
    place = (corner + sampler.next_2d()) / mi.Point2f(width, height)
    ray, _ = camera.sample_ray_differential(sampler.next_1d(), sampler.next_1d(), place, sampler.next_2d())
    si = scene.ray_intersect(ray)
    hit = si.is_valid()
    bsdf = si.bsdf(ray)
    _, weight = bsdf.sample(mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d(), hit)
    values = mi.unpolarized_spectrum(weight)
    if not (mi.is_rgb and len(values) == 3):
        values = mi.Color3f(dr.mean(values))
    albedo = dr.select(hit & (dr.isfinite(dr.sum(values))), mi.Color3f(values), 0)
    normal = dr.select(hit, si.sh_frame.n, 0)
    return np.array([np.array(each, dtype=np.float32).T.reshape(height, width, 3) for each in (albedo, normal)])


def denoised(image: NDArray[Any], albedo: Image, normal: Image) -> Image:
    """An image (height, width, 1 or 3) of linear radiance without its noise; its film should have a box filter.

    Wider filters share samples between pixels: then neighbours err alike, and that looks like no noise.
    """
    import pyoidn

    channels = image.shape[-1]
    colour = np.repeat(image, 3, axis=-1) if channels == 1 else image
    # The filter knows no negative light, and one NaN would spread.
    colour = np.nan_to_num(np.maximum(colour, 0), posinf=0).astype(np.float32)
    return pyoidn.denoise(colour, albedo, normal, hdr=True)[..., :channels]
