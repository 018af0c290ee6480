"""``asperity cite``."""

from __future__ import annotations

from typing import Annotated

import typer

from . import registry


def cite(
    model: Annotated[str | None, typer.Argument(metavar="MODEL", help="One model; all if it is left out.")] = None,
) -> None:
    """Print the BibTeX of a model's paper: `asperity cite micrograin > asperity.bib`."""
    cited = registry.models().values() if model is None else [registry.model(model)]
    typer.echo("\n\n".join(one.citation for one in cited))
