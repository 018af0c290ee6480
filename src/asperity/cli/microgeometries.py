"""The microgeometry that the arguments and options of `asperity measure` describe."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import typer

from asperity.errors import ParameterError, UnknownNameError, refuse_unused
from asperity.materials import resolve

from . import materials

if TYPE_CHECKING:
    from asperity.goniophotometer import Microgeometry


class Wanted(NamedTuple):
    """What is to be measured: a model by its name, a preset or a material; or a surface in a file, by its kind."""

    target: str | None
    """A model, or a kind of surface."""
    file: Path | None
    preset: str | None
    material: Path | None
    settings: list[str] | None
    shape: dict[str, Any]
    """Options of surfaces in files; None is the default."""

    @property
    def name(self) -> str:
        """What to call it; raises ParameterError if nothing is named, or several things are."""
        if sum(way is not None for way in (self.target, self.preset, self.material)) != 1:
            raise ParameterError("give one of: the name of a model, mesh, heightfield, --preset, --material.")
        return self.preset or (self.file or self.material or Path(self.target or "")).stem

    def microgeometry(self) -> tuple[Microgeometry, dict[str, Any]]:
        """The microgeometry, and what to note about it; needs a variant."""
        from asperity import models
        from asperity.goniophotometer.mesh import FROM_FILE

        if self.target in FROM_FILE:
            return self._from_file(), {}
        if self.target is not None and self.target not in models.MODELS:
            raise UnknownNameError("microgeometry", self.target, [*models.with_microgeometry(), *FROM_FILE])
        description = self._description()
        refuse_unused({"file": self.file, **self.shape}, (), self.name)
        return models.microgeometry(description), {"model": description}

    def _description(self) -> dict[str, Any]:
        """That of the model, checked."""
        if self.target is None:
            found = materials.chosen(self.preset, self.material, self.settings)
        else:
            found = resolve({"type": self.target}, self.settings or [])
        found.load()
        return found.description or {}  # a measurement has none, and no microgeometry

    def _from_file(self) -> Microgeometry:
        """The mesh or height field; says how the latter was made periodic."""
        from asperity import goniophotometer

        refuse_unused({"set": self.settings or None}, (), f"a {self.target}")
        if self.target is None or self.file is None:
            raise ParameterError(f"{self.target}: expected a file after it.")
        bsdf = self.shape["bsdf"]
        shape = self.shape | {"bsdf": None if bsdf is None else facets(bsdf)}
        surface = goniophotometer.from_file(self.target, self.file, **shape)
        if isinstance(surface, goniophotometer.HeightField):
            typer.echo(f"{self.file}: {surface.account}")
        return surface


def facets(text: str) -> dict[str, Any]:
    """The BSDF in ``text``, checked."""
    try:
        description = json.loads(text)
    except json.JSONDecodeError as error:
        raise ParameterError(f"--bsdf {text}: no JSON; column {error.colno}: {error.msg}.") from error
    if not (isinstance(description, dict) and "type" in description):
        raise ParameterError(f'--bsdf {text}: expected an object in braces, such as {{"type": "diffuse"}}.')
    resolve(description).load()
    return description
