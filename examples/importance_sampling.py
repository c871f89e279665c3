"""An expectation and an integral over the whole line, by inverse distribution functions.

python examples/importance_sampling.py
"""

import numpy as np
import scipy.stats

import voroquad as vq

samples = vq.sample("stratified", n=256, d=1, rng=1)
w = vq.weights(samples, debias="exchange")  # made in the unit interval, where the samples are uniform

normal = vq.ProductMeasure(scipy.stats.norm())
x = normal.transform(samples.points)[:, 0]
print(f"E[cos X] of a normal X   {w @ np.cos(x):.6f}   exact {np.exp(-0.5):.6f}")

heavy = vq.ProductMeasure(scipy.stats.logistic())  # tails above those of the integrand
x = heavy.transform(samples.points)
f = 1 / np.cosh(x[:, 0])
print(f"integral of 1/cosh(x)    {w @ (f / heavy.density(x)):.6f}   exact {np.pi:.6f}")
