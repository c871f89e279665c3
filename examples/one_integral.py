"""One integral, 1024 evaluations, more and more help.

python examples/one_integral.py
"""

import numpy as np

import voroquad as vq


def f(x):
    """Values (n,) at points (n, 2)."""
    return np.exp(x[:, 0] + x[:, 1] / 2) * (1 + np.sin(5 * x[:, 0] * x[:, 1]))


exact = 3.2474765678772517
n = 1024

uniform = vq.sample("uniform", n=n, d=2, rng=1)
stratified = vq.sample("stratified", n=n, d=2, rng=1)
estimates = {
    "plain Monte Carlo": f(uniform.points).mean(),
    "the same samples, Voronoi cells": vq.weights(uniform) @ f(uniform.points),
    "the same, without bias": vq.weights(uniform, debias="leave-one-out") @ f(uniform.points),
    "stratified samples": f(stratified.points).mean(),
    "stratified, cubic fits": vq.weights(stratified, order=3, debias="leave-one-out") @ f(stratified.points),
}
for name, estimate in estimates.items():
    print(f"{name:33} {estimate:.12f}   error {estimate - exact:+.1e}")

result = vq.quad(lambda x: f(x.T), [0, 0], [1, 1], n_points=n, rng=1)
print(f"{'vq.quad':33} {result}")
