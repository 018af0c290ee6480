"""The virtual goniophotometer: measures the BSDF of any microgeometry by tracing light through it.

>>> measure(ExplicitGrains(tau_0=0.5), [(30, 0), (60, 0)], orders=1).save("grains.npz")
"""

from .measure import measure as measure
from .measurement import Estimate as Estimate
from .measurement import Measurement as Measurement
from .measurement import merge as merge
from .mesh import HeightField as HeightField
from .mesh import Mesh as Mesh
from .mesh import from_file as from_file
from .microgeometry import Microgeometry as Microgeometry
from .sensors import Hemisphere as Hemisphere
from .sensors import Points as Points
from .sensors import Window as Window
from .tile import Tile as Tile
