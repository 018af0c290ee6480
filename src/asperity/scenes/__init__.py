"""The preview scene, made by code: objects, environments, textures. A material is any description."""
