"""Micrograins: half-ellipsoidal grains on any base, for dust, rust, mold and patina.

Lucas, Ribardière, Pacanowski and Barla, "A Fully-correlated Anisotropic Micrograin BSDF Model", 2024.
"""

from .microgeometry import ExplicitGrains as ExplicitGrains
from .model import Micrograin as Micrograin
