"""What the channels of a rendered image are, which of them a PNG can show, and whether their values are sound."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any

from asperity.errors import ParameterError

if TYPE_CHECKING:
    import numpy as np

COLOURS = {"RGBA": "RGBA", "RGB": "RGB", "XYZA": "RGBA", "XYZ": "RGB", "YA": "YA", "Y": "Y", "rgb": "RGB"}
"""What an image may begin with, and what a PNG shows of it; small letters are those of an AOV, such as an albedo."""


def check(scene: Any, sensor: int, formats: Collection[str]) -> None:
    """Raise ParameterError if a spectral film is to become what it cannot be: a PNG; or is to hold AOVs."""
    import mitsuba as mi

    if not mi.has_flag(scene.sensors()[sensor].film().flags(), mi.FilmFlags.Spectral):
        return
    if ".png" in formats:
        raise ParameterError("the film is spectral, and has no colours for a PNG: give -o FILE.exr.")
    if scene.integrator().aov_names():  # Mitsuba 3.9 would abort the process
        raise ParameterError("the film is spectral, and cannot hold AOVs: take another integrator, or an hdrfilm.")


def names(scene: Any, channels: int, sensor: int = 0) -> list[str]:
    """Names of the channels of an image that a sensor of the scene has rendered, colours first.

    Mitsuba does not tell: its film has its own colours and then what the integrator names, which includes R, G, B, A
    for every integrator in an ``aov``. In the image these have the film's format, and the film's own are missing.
    """
    own = scene.integrator().aov_names()
    film = [channel.name for channel in scene.sensors()[sensor].film().bitmap().struct_()]
    colours = film[: len(film) - len(own)]
    if channels == len(colours) + len(own):
        return film
    nested: list[str] = []
    while [name[-2:] for name in own[:4]] == [".R", ".G", ".B", ".A"]:
        nested, own = [*nested, own[0][:-2]], own[4:]
    found = [f"{prefix}.{colour}" for prefix in nested for colour in colours] + own
    if nested:
        found[: len(colours)] = colours
    # Integrators with AOVs of their own within an aov integrator: they come twice, some of them empty.
    return found if len(found) == channels else colours + [f"channel {n}" for n in range(len(colours), channels)]


def kind(names: list[str]) -> str:
    """The key of COLOURS for what the names begin with; Y if they are no colours."""
    # XYZ are colours if the film names them so; those of an AOV are a position or a normal.
    letters = "".join(name if len(name) == 1 else name[-1].lower() for name in names)
    return next((kind for kind in COLOURS if letters.startswith(kind)), "Y")


def png(image: np.ndarray, names: list[str]) -> Any:
    """The ``mi.Bitmap`` for a PNG: the colours in sRGB, clipped at 1; the first channel in grey if they are none."""
    import mitsuba as mi
    import numpy as np

    formats, transforms = mi.Bitmap.PixelFormat, mi.Bitmap.AlphaTransform
    found = kind(names)
    bitmap = mi.Bitmap(np.ascontiguousarray(image[..., : len(found)]), getattr(formats, found.upper()))
    return bitmap.convert(
        pixel_format=getattr(formats, COLOURS[found]),
        component_format=mi.Struct.Type.UInt8,
        srgb_gamma=True,
        alpha_transform=transforms.Unpremultiply if found.endswith("A") else transforms.Empty,
    )


def fault(image: np.ndarray) -> str | None:
    """How many pixels hold no number, and where the first is, or None."""
    import numpy as np

    wrong = ~np.isfinite(image).all(axis=-1)
    if not wrong.any():
        return None
    row, column = np.argwhere(wrong)[0]
    return (
        f"{wrong.sum()} of {wrong.size} pixels are not finite (NaN or infinite); the first is in row {row}, "
        f"column {column}, counted from 0."
    )
