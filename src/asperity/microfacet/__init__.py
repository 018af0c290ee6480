"""What several models share: float32-safe elementary functions, quadrature, Fresnel terms."""
