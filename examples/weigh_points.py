"""Points that somebody else drew, in a box of any size: a weight for each.

python examples/weigh_points.py
"""

import numpy as np

import voroquad as vq

rng = np.random.default_rng(1)
low, high = np.array([0.0, -1.0]), np.array([2.0, 3.0])
points = low + (high - low) * rng.beta(2, 2, size=(500, 2))  # crowded in the middle: whose density need not be known
values = np.cos(points[:, 0]) * np.exp(-points[:, 1])

w = vq.weights((points - low) / (high - low))  # areas of the Voronoi cells in the unit square
area = np.prod(high - low)
exact = np.sin(2) * (np.exp(1) - np.exp(-3))
print(f"mean of the values   {area * values.mean():.4f}")
print(f"weighted by cells    {area * (w @ values):.4f}")
print(f"exact                {exact:.4f}")
