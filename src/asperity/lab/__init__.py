"""The test bench of any ``mi.BSDF``: evaluation without a scene, checks, and pictures of what they measured."""
