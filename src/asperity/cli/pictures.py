"""A picture from a scene: rendered in passes, and perhaps denoised."""

from __future__ import annotations

from collections.abc import Collection
from typing import TYPE_CHECKING, Any, NamedTuple

from asperity.errors import ParameterError

from . import channels, passes

if TYPE_CHECKING:
    import numpy as np


class Quality(NamedTuple):
    """What options say about how to render: None is the default."""

    size: tuple[int, int] | None
    samples: int | None
    seed: int
    sensor: int
    denoise: bool | None

    @property
    def spp(self) -> int:
        """Samples per pixel, once they are settled."""
        return self.samples or 0

    def settled(self, scene: Any, *, denoise: bool) -> Quality:
        """With the samples of the scene's sensor; ``denoise`` is the default, where that can be.

        ParameterError if it is asked for and cannot be.
        """
        import mitsuba as mi

        from asperity.scenes.denoise import available, require

        sensor = scene.sensors()[self.sensor]
        clean = denoise and available() if self.denoise is None else self.denoise
        if self.denoise:
            require()
            if mi.has_flag(sensor.film().flags(), mi.FilmFlags.Spectral):
                raise ParameterError("--denoise: the film is spectral, and has no colours.")
        return self._replace(samples=self.samples or sensor.sampler().sample_count(), denoise=clean)


class Picture(NamedTuple):
    """What was rendered, (height, width, channels); the same to look at; names of channels; samples per pixel."""

    image: np.ndarray
    shown: np.ndarray
    names: list[str]
    samples: int

    def channels(self, ending: str, *, layers: bool) -> tuple[np.ndarray, list[str]]:
        """What goes into a PNG; or into an EXR: what was rendered, and if asked, the denoised colours after it."""
        import numpy as np

        if ending == ".png":
            return self.shown, self.names
        if not layers:
            return self.image, self.names
        n = colours(self.names)
        names = [*self.names, *(f"denoised.{name}" for name in self.names[:n])]
        return np.concatenate([self.image, self.shown[..., :n]], axis=-1), names


def paint(scenes: list[Any], quality: Quality, interrupted: Collection[Any]) -> list[Picture]:
    """Pictures of scenes that differ in a material."""
    sensor = quality.sensor
    images, done = passes.average(scenes, quality.spp, quality.seed, sensor, interrupted)
    found = []
    for scene, image in zip(scenes, images):
        names = channels.names(scene, image.shape[-1], sensor)
        shown = without_noise(scene, image, names, sensor, quality.seed) if quality.denoise else image
        found.append(Picture(image, shown, names, done))
    return found


def colours(names: list[str]) -> int:
    """How many channels, the first ones, are colours."""
    return len(channels.kind(names).rstrip("A"))


def without_noise(scene: Any, image: np.ndarray, names: list[str], sensor: int, seed: int) -> np.ndarray:
    """The image with its colours denoised."""
    import numpy as np

    from asperity.scenes import denoise

    n = colours(names)
    clean = denoise.denoised(image[..., :n], *denoise.features(scene, sensor, seed=seed))
    return np.concatenate([clean, image[..., n:]], axis=-1)
