"""Voronoi cells of the box, the torus and the sphere, and density compensation from them."""
