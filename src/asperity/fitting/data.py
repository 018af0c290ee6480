"""What a person may call data: a measurement, in a file or not; or any other material, at the nodes of a grid."""

from __future__ import annotations

from typing import Any

from .. import measured, variants
from ..materials import resolve
from ..measured import BRDF, conversion

STEPS = 60
"""Of θ_h, at which a material that is no measurement is sampled."""


def data(what: Any) -> BRDF:
    """A `BRDF` of anything that `materials.resolve` takes, or itself; raises what that raises.

    What was measured comes in the pairs of directions in which it was, a file of RGL's at the vertices of its table.
    """
    if isinstance(what, BRDF):
        return what
    material = resolve(what)
    pairs = material.pairs
    if pairs is not None:
        return pairs
    with variants.switched(variants.of_bsdf(material)):
        if (material.description or {}).get("type") == "measured":
            return measured.load(material.description["filename"])  # type: ignore[index]
        return conversion.nodes(material.function(), STEPS)
