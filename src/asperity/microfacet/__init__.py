"""What several models share: distributions of normals, masking, Fresnel terms, sampling, quadrature, numerics."""
