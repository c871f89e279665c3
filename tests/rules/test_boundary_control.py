import numpy as np
import pytest
from scipy.integrate import dblquad
from scipy.spatial import cKDTree

import voroquad as vq
from voroquad.rules import boundary_control as module
from voroquad.rules import exchange

DESIGNS = ("uniform", "stratified")


def control(s, **options):
    return vq.weights(s, debias="leave-one-out", **options)


# Integrands on [0, 1]^d that do not vanish at the border, and their integrals
def smooth(x):
    return np.exp(x).prod(axis=-1)


def jump(x):
    """The half-space Σ x_a < 0.7 and a slope."""
    return x[..., 0] + 2 * (x.sum(axis=-1) < 0.7)


INTEGRALS = {
    smooth: {d: (np.e - 1) ** d for d in (1, 2, 3)},
    jump: {d: 0.5 + 2 * 0.7**d / [1, 1, 2, 6][d] for d in (1, 2, 3)},
}


# ---------------------------------------------------------------------- what holds for every set


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize(("d", "sizes"), [(1, (1, 2, 3, 50, 10_000)), (2, (1, 2, 6, 64, 10_000)), (3, (1, 2, 8, 27))])
def test_weights_sum_to_one(design, d, sizes):
    for n in sizes:
        w = control(vq.sample(design, n=n, d=d, rng=n))
        assert w.shape == (n,)
        assert abs(w.sum() - 1) < 1e-12
        assert n * w.min() > -1.5  # a sample can lose its cell to others, hardly more


def test_coincident_samples():
    points = np.random.default_rng(1).random((20, 2))
    points[5:9] = points[0]
    assert abs(control(points, design="uniform").sum() - 1) < 1e-12
    assert abs(control(np.full((7, 2), 0.3), design="uniform").sum() - 1) < 1e-12


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize(("d", "n"), [(1, 12), (2, 30), (3, 27)])
def test_against_the_formula_written_out(design, d, n):
    s = vq.sample(design, n=n, d=d, rng=3)
    f = np.random.default_rng(1).random(n)
    excess = module.bias_at(s.points, n, s.strata) - 1
    lattice = module.bias_lattice(n, d, s.strata)
    grid = [np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, d) for axes in (
        [axis.position for axis in lattice.axes], [axis.weight for axis in lattice.axes],
        [axis.node_class for axis in lattice.axes],
    )]  # fmt: skip
    y, value = grid[0], grid[1].prod(axis=1) * lattice.excess[tuple(grid[2].astype(int).T)]

    estimate = vq.weights(s) @ f
    home = None if s.strata is None else (y * s.strata).astype(int)
    for i in range(n):
        others = np.arange(n) != i
        tree = cKDTree(s.points[others])
        estimate -= excess[i] / n * (f[i] - f[others][tree.query(s.points[i])[1]])
        if home is None:
            mine, share = slice(None), 1 / n
        else:
            mine, share = (home == (s.points[i] * s.strata).astype(int)).all(axis=1), 1
        estimate -= share * value[mine] @ f[others][tree.query(y[mine])[1]]
    assert control(s) @ f == pytest.approx(estimate, abs=1e-12)


@pytest.mark.parametrize("design", DESIGNS)
def test_threads_and_batches_do_not_change_a_bit(design):
    for d, n in ((1, 40), (2, 36), (2, 2500), (3, 64)):
        s = vq.sample(design, n=n, d=d, sets=3, rng=2)
        one_by_one = np.stack([control(points, design=design, threads=1) for points in s.points])
        for threads in (1, 5):
            np.testing.assert_array_equal(control(s, threads=threads), one_by_one)


@pytest.mark.parametrize("design", DESIGNS)
def test_points_may_come_in_any_order(design):
    s = vq.sample(design, n=30, d=2, rng=2)
    shuffle = np.random.default_rng(0).permutation(30)
    np.testing.assert_allclose(control(s.points[shuffle], design=design), control(s)[shuffle], atol=1e-15)


def test_auto_takes_it_where_there_is_no_exchange_rule():
    s = vq.sample("uniform", n=30, d=2, rng=1)
    np.testing.assert_array_equal(vq.weights(s, debias="auto"), control(s))


def test_other_designs_are_refused():
    with pytest.raises(ValueError, match=r"no rule for .*debias='leave-one-out' with order 0, d = 1 to 3"):
        control(vq.sample("sobol", n=16, d=2, rng=1))


@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize(("d", "n"), [(1, 16), (2, 16), (2, 256), (3, 27)])
def test_a_finer_quadrature_changes_little(design, d, n, monkeypatch):
    s = vq.sample(design, n=n, d=d, sets=100, rng=4)
    f = smooth(s.points)
    estimates = (control(s) * f).sum(axis=1)
    module.bias_lattice.cache_clear()
    for panels in ("UNIFORM_PANELS", "STRATA_PANELS"):
        monkeypatch.setattr(module, panels, {1: 8, 2: 4, 3: 4})
    change = (control(s) * f).sum(axis=1) - estimates
    module.bias_lattice.cache_clear()
    assert abs(change.mean()) < 0.03 * estimates.std()


# ---------------------------------------------------------------------- unbiased, and the test can tell

# With R sets a bias of 0.1 standard deviations of one estimate shows as z = 0.1 √R
SIZES = {1: (16, 10_000), 2: (16, 10_000), 3: (27, 6_000)}  # n, R


def z_scores(z_score, design, d, debias, n=None):
    size, sets = SIZES[d]
    s = vq.sample(design, n=n or size, d=d, sets=sets, rng=d)
    w = vq.weights(s, debias=debias)
    return {f.__name__: z_score((w * f(s.points)).sum(axis=1), INTEGRALS[f][d]) for f in INTEGRALS}


# 32 checks at 5.5 standard errors: a correct program exceeds one of them once in 8e5 seeds
@pytest.mark.statistical
@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("debias", ["leave-one-out", "bias-function"])
@pytest.mark.parametrize(("d", "n"), [(1, None), (2, None), (2, 9), (2, 64), (3, None)])
def test_unbiased(z_score, design, d, n, debias):
    z = z_scores(z_score, design, d, debias, n)
    assert max(map(abs, z.values())) < 5.5, z


@pytest.mark.statistical
@pytest.mark.parametrize("design", DESIGNS)
@pytest.mark.parametrize("d", [1, 2, 3])
def test_voronoi_weights_are_found_biased(z_score, design, d):
    z = z_scores(z_score, design, d, "none")
    assert max(map(abs, z.values())) > 8, z


@pytest.mark.statistical
@pytest.mark.parametrize("debias", ["leave-one-out", "bias-function"])
@pytest.mark.parametrize("design", DESIGNS)
def test_a_perturbed_bias_function_is_found(z_score, monkeypatch, design, debias):
    exact = module.bias_at
    for place in (module, exchange):
        monkeypatch.setattr(place, "bias_at", lambda *at: 1 + 0.6 * (exact(*at) - 1))
    module.bias_lattice.cache_clear()
    z = z_scores(z_score, design, 2, debias, n=64)
    module.bias_lattice.cache_clear()
    assert max(map(abs, z.values())) > 8, z


@pytest.mark.statistical
def test_a_reconstruction_with_its_own_sample_is_found_biased(z_score):
    """Without leaving one out, f_i − f̂(x_i) = 0 and the rule is Σ |V_i| f_i − ∫ (G − 1) f̂."""

    def wave(x):
        return np.cos(5 * x[..., 0])

    s = vq.sample("uniform", n=9, d=1, sets=20_000, rng=5)
    lattice = module.bias_lattice(9, 1, None)
    (axis,) = lattice.axes
    value = axis.weight * lattice.excess[axis.node_class]
    f, truth = wave(s.points), np.sin(5) / 5
    nearest = np.abs(axis.position[:, None] - s.points[:, None, :, 0]).argmin(axis=2)
    own = (vq.weights(s) * f).sum(axis=1) - np.take_along_axis(f, nearest, axis=1) @ value
    assert abs(z_score(own, truth)) > 8
    assert abs(z_score((control(s) * f).sum(axis=1), truth)) < 5.5


@pytest.mark.statistical
def test_it_pays_over_the_biased_rule():
    s = vq.sample("uniform", n=256, d=2, sets=1000, rng=1)
    x, y = np.moveaxis(s.points, -1, 0)
    f = np.exp(x + y / 2) * (1 + np.sin(5 * x * y))
    truth = dblquad(lambda y, x: np.exp(x + y / 2) * (1 + np.sin(5 * x * y)), 0, 1, 0, 1)[0]
    square = {rule: ((vq.weights(s, debias=rule) * f).sum(axis=1) - truth) ** 2 for rule in ("none", "leave-one-out")}
    assert square["leave-one-out"].mean() < 0.9 * square["none"].mean()


def test_panels_are_exact_for_linear_factors():
    """∫ g m over panels on each of which m is linear, with g at five points and m at two."""
    panels = module.Panels(0.2, 0.8, 3)
    nodes, weights = np.polynomial.legendre.leggauss(20)
    for power in range(9):  # g m has degree 9: five Gauss points
        on_nodes = panels.onto @ panels.fine**power
        for m in (np.ones_like, lambda x: x, lambda x: np.maximum(x - 0.4, 0) - np.maximum(x - 0.6, 0)):
            exact = 0.0
            for begin in (0.2, 0.4, 0.6):
                x = begin + 0.1 * (nodes + 1)
                exact += 0.1 * weights @ (x**power * m(x))
            assert panels.weights @ (on_nodes * m(panels.nodes)) == pytest.approx(exact, rel=1e-12)
