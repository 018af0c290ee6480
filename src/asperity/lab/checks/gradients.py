"""Automatic derivatives by every parameter, of virtual calls and of a small render, against finite differences."""

from __future__ import annotations

from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

from .bounds import ends
from .derivatives import (
    GRADIENT_ERROR,
    Calls,
    Parameters,
    Quantity,
    Values,
    along,
    difference_error,
    mean_relative,
    pointer,
    weighted_pairs,
)
from .results import Curves, Result, violations

LANES = 10_000


class Render(NamedTuple):
    """A picture of a sphere under point lights, summed over channels.

    Of point lights only: where the BSDF's samples meet a light, finite differences see them move with the parameters,
    and are noisy. Without, the same seed makes them exact, pixel by pixel.
    """

    scene: mi.Scene
    integrator: mi.Integrator
    parameters: mi.SceneParameters

    @classmethod
    def of(cls, bsdf: mi.BSDF, parameters: Parameters) -> Render:
        """Make the scene; a second object makes the sphere's BSDF one of several."""
        to_world = mi.ScalarTransform4f()
        lights = [{"type": "point", "position": p, "intensity": 30.0} for p in ([4, 1, 5], [-3, 2, 4], [0, -5, 1])]
        film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
        film["pixel_format"] = "luminance" if mi.is_monochromatic else "rgb"
        scene = {
            "type": "scene",
            "ball": {"type": "sphere", "bsdf": bsdf},
            "floor": {"type": "rectangle", "to_world": to_world.translate([0, 0, -3]), "bsdf": {"type": "diffuse"}},
            "sensor": {
                "type": "perspective",
                "fov": 28,
                "to_world": to_world.look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
                "film": film,
            },
            **{f"light_{n}": light for n, light in enumerate(lights)},
        }
        # What inverse rendering uses; but it differentiates neither spectra forward nor polarised light (Mitsuba 3.9).
        kind = "path" if mi.is_spectral or mi.is_polarized else "prb"
        integrator = mi.load_dict({"type": kind, "max_depth": 2})
        return cls(mi.load_dict(scene, parallel=False), integrator, parameters.scene)

    @property
    def pixels(self) -> int:
        """Their number."""
        return int(np.prod(self.scene.sensors()[0].film().size()))

    def value(self) -> Any:
        """Pixels."""
        return self.summed(self.integrator.render(self.scene, seed=1, spp=4))

    def derivative(self) -> np.ndarray:
        """Their forward derivatives."""
        image = self.integrator.render_forward(self.scene, self.parameters, self.scene.sensors()[0], seed=1, spp=4)
        return np.array(self.summed(image), dtype=np.float64)

    @staticmethod
    def summed(image: mi.TensorXf) -> mi.Float:
        """Sum over the channels."""
        return dr.sum(image, axis=2).array


def inside(parameters: Parameters) -> tuple[Values, Values]:
    """Return where to differentiate the parameters, and their elements' magnitudes, in which steps are counted.

    0 and 1 often end a range: such elements are moved off, so that both neighbours are inside it; as are those at the
    ends of ranges that are known.
    """
    values, sizes = {}, {}
    for key, numbers in parameters.initial.items():
        sizes[key] = np.where(numbers == 0, np.abs(numbers).mean() or 1, np.abs(numbers))
        values[key] = np.where(numbers == 0, 0.02 * sizes[key], np.where(numbers == 1, 0.98, numbers))
        low, high = ends(parameters, key)
        least, most = low + 0.02 * sizes[key], high - 0.02 * sizes[key]
        values[key] = np.where(least < most, np.clip(values[key], least, most), values[key])
    return values, sizes


def compared(
    parameters: Parameters,
    differentiated: Quantity,
    evaluated: Quantity,
    weight: np.ndarray,
    values: Values,
    sizes: Values,
) -> tuple[dict[str, float], np.ndarray]:
    """Return the error of the derivatives by each parameter, and the derivatives (parameters, lanes)."""
    errors, slopes = {}, []
    for key in parameters.initial:
        slopes.append(parameters.forward(differentiated, values, along(sizes, key)))
        differences = parameters.differences(evaluated, values, along(sizes, key))
        errors[key] = difference_error(slopes[-1], differences, weight)
    return errors, np.array(slopes)


def gradients(bsdf: mi.BSDF) -> Result:
    """Compare automatic with finite differences, a parameter at a time, and look for NaN at hard directions.

    Directions, and the pixels of a render, are compared one by one: the sum over a lobe barely depends on its width.
    Calls are virtual, as renders make them: there Dr.Jit loses derivatives that direct calls keep. Of all parameters
    together, direct calls and backward derivatives have to agree with them.
    """
    parameters = Parameters(bsdf)
    keys = list(parameters.initial)
    if not keys or not dr.is_diff_v(mi.Float):
        return Result("gradients", None, "has no differentiable parameter")
    wi, wo, weight = weighted_pairs(bsdf, LANES)
    direct, virtual = Calls(bsdf, wi, wo), Calls(pointer(bsdf), wi, wo)
    if not np.array(direct.value()).any():
        return Result("gradients", None, "has only delta lobes: eval is 0")
    values, sizes = inside(parameters)
    with parameters.restored():
        errors, slopes = compared(parameters, virtual, direct, weight, values, sizes)
        if slopes.any():  # Mitsuba's prb raises an exception where nothing has a derivative
            render = Render.of(bsdf, parameters)
            rendered, _ = compared(parameters, render, render, np.ones(render.pixels), values, sizes)
            errors |= {f"{key} in a render": error for key, error in rendered.items()}
        together = parameters.forward(direct, values, sizes)
        error, size = np.abs(together - slopes.sum(axis=0)), np.maximum(np.abs(together), np.abs(slopes).sum(axis=0))
        errors["all called directly"] = mean_relative(error, size, weight)
        backward = parameters.backward(virtual, values, sizes, weight)
        error, size = np.abs(backward - slopes @ weight), np.maximum(np.abs(backward), np.abs(slopes) @ weight)
        errors["all backwards"] = mean_relative(error, size, np.ones(len(keys)))
        bad = ~np.isfinite(parameters.forward(virtual, parameters.initial, sizes))
        finite = np.isfinite(parameters.backward(virtual, parameters.initial, sizes, 1 + 0 * weight)).all()
    worst = max(errors, key=lambda key: np.nan_to_num(errors[key], nan=np.inf))
    trouble = "" if finite else "; backward derivatives are not finite"
    found = Curves(list(errors), {"automatic": np.array(list(errors.values()))}, "mean relative error", GRADIENT_ERROR)
    return Result(
        "gradients",
        bool(errors[worst] < GRADIENT_ERROR and finite and not bad.any()),
        f"{errors[worst]:.2g} mean relative error for {worst}, the worst of {len(keys)} parameters; "
        f"{bad.sum()} of {bad.size} not finite{trouble}",
        f"< {GRADIENT_ERROR} against extrapolated central differences, which float32 leaves good to 0.005 or better",
        violations(wi, wo, bad, "gradient") if bad.any() else found,
    )
