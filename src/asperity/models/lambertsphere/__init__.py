"""Half spaces of sparse particles: Lambertian spheres, for dust, soot, chalk and regolith, and isotropic scatterers.

d'Eon, "An analytic BRDF for materials with spherical Lambertian scatterers", 2021; Chandrasekhar, "Radiative
Transfer", 1960.
"""

from .microgeometry import ExplicitSpheres as ExplicitSpheres
from .microgeometry import RandomWalk as RandomWalk
from .model import Chandrasekhar as Chandrasekhar
from .model import LambertSphere as LambertSphere
from .model import LambertSpherePhase as LambertSpherePhase
