"""Two scales of roughness: facets that mirror light, and finer roughness on them that diffracts it.

Holzschuch and Pacanowski, "A Two-Scale Microfacet Reflectance Model Combining Reflection and Diffraction", 2017.
"""

from .model import TwoScale as TwoScale
