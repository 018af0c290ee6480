"""V-grooves: multiple scattering between the facets of symmetric and non-symmetric grooves, without noise.

Lee, Jarabo, Jeon, Gutierrez and Kim, "Practical Multiple Scattering for Rough Surfaces", 2018.
"""

from .microgeometry import ExplicitGrooves as ExplicitGrooves
from .model import VGroove as VGroove
