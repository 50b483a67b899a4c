"""Furniture from meshes: reading, normalisation, decomposition into hulls, targets, storage."""
