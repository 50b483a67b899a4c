"""Furniture from meshes: read, set upright, cut into convex hulls, looked at for places, kept."""
