"""The papers, a file each: their figures and tables in words, and which sections of a validation tell about them."""

from ..results import Paper
from . import interfacedlambertian, lambertsphere, micrograin, twoscale, vgroove

PAPERS: dict[str, Paper] = {
    "micrograin": micrograin.PAPER,
    "vgroove": vgroove.PAPER,
    "lambertsphere": lambertsphere.PAPER,
    "interfacedlambertian": interfacedlambertian.PAPER,
    "twoscale": twoscale.PAPER,
}
"""By the model's name."""
