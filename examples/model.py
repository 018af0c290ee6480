"""A model of one's own: the law of Lommel and Seeliger, for the Moon, as a plugin that all tools take."""

import asperity as asp  # isort: skip  (before drjit: it chooses an LLVM that works)
import math

import drjit as dr

from asperity.lobes import ByCosine, LobeModel, diffuse
from asperity.parameters import Colour


@asp.register
class LommelSeeliger(LobeModel):
    """Lommel 1889, Seeliger 1887: light that dust scatters once, evenly in all directions."""

    albedo = Colour("albedo of the particles", 0.3)

    def flags(self):
        """One diffuse lobe."""
        return [diffuse()]

    def lobes(self, si, active):
        """The law, drawn by cosine."""
        albedo = self.at("albedo", si, active)
        return [ByCosine(lambda wi, wo: albedo / (4 * dr.pi * (wi.z + wo.z)))]


asp.render("lommelseeliger", size=128, spp=16, object="sphere").save("moon.png")

checks = asp.check("lommelseeliger", only=["chi2", "reciprocity", "energy", "finiteness", "gradients"])
print(checks)
assert checks.passed

reflected = asp.albedo({"type": "lommelseeliger", "albedo": 0.8}, theta=0)[0]
print(f"Of light from above, {reflected:.4f} come back.")
assert abs(reflected - 0.4 * (1 - math.log(2))) < 1e-4
