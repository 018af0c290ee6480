"""Interfaced Lambertian microfacets."""
