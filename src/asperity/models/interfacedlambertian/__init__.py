"""Interfaced Lambertian microfacets: a rough dielectric over a diffuse body.

Meneveaux, Bringier, Tauzia, Ribardière and Simonot, "Rendering Rough Opaque Materials with Interfaced Lambertian
Microfacets", 2018.
"""

from .model import InterfacedLambertian as InterfacedLambertian
