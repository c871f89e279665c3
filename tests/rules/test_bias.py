import multiprocessing

import numpy as np
import pytest

import voroquad as vq
from voroquad.designs.grids import grid_shape
from voroquad.rules import bias_tables
from voroquad.rules.bias import FEW, bias_at


@pytest.mark.parametrize(
    ("x", "expected", "digits"),
    [
        ((0.5, 0.5), 1.0, 1e-3),
        ((0.02, 0.5), 0.76205, 1e-5),
        ((0.01, 0.01), 0.44346, 1e-5),
        ((0.1, 0.1), 1.16790, 1e-5),
        ((0, 0.5), 0.611, 5e-4),
        ((0, 0), 0.36351, 1e-5),
    ],
)
def test_values_known_from_an_independent_prototype(x, expected, digits):
    assert vq.bias_function([x], n=64)[0] == pytest.approx(expected, abs=digits)


def test_two_samples_by_hand():
    # In [0,1] the cell of a sample at 0 reaches half the way to the other: E = ∫ z/2 dz = 1/4
    np.testing.assert_allclose(vq.bias_function([0.0, 1.0], n=2), 0.5, atol=1e-15)
    # In the square, G at a corner is 2 P(a uniform y is nearer to the corner than to a uniform z)
    y, z = np.random.default_rng(1).random((2, 400_000, 2))
    nearer = (np.hypot(*y.T) < np.hypot(*(y - z).T)).mean()
    assert vq.bias_function([[0, 0]], n=2)[0] == pytest.approx(2 * nearer, abs=2 * 5.5 * 0.5 / np.sqrt(400_000))


# ---------------------------------------------------------------------- against simulation


def simulated(x, n, design, sets, rng, periodic=False):
    """n times the mean measure of the cell of a sample that is put at x, and its standard error."""
    s = vq.sample(design, n=n, d=len(x), sets=sets, rng=rng)
    points = s.points.copy()
    k = np.array(s.strata or (1,) * len(x))
    own = int(np.ravel_multi_index(tuple((np.array(x) * k).astype(int)), k)) if s.strata else 0
    points[:, own] = x
    measures = n * vq.cells(points, periodic=periodic).measures[:, own]
    return measures.mean(), measures.std() / np.sqrt(sets)


# 15 checks at 5.5 standard errors of about 0.005
@pytest.mark.statistical
@pytest.mark.parametrize(
    ("design", "n", "x"),
    [
        ("uniform", 9, (0.3, 0.05)),
        ("uniform", 64, (0.02, 0.5)),
        ("uniform", 64, (0.01, 0.01)),
        ("uniform", 64, (0.1, 0.1)),
        ("stratified", 7, (0.05,)),
        ("stratified", 4, (0.1, 0.3)),
        ("stratified", 64, (0.01, 0.01)),
        ("stratified", 64, (0.3, 0.02)),
        ("stratified", 64, (0.4375, 0.5625)),
        ("stratified", 64, (0.5, 0.375)),
        ("stratified", 20, (0.49, 0.45)),
        ("uniform", 27, (0.5, 0.5, 0.5)),
        ("uniform", 27, (0.02, 0.05, 0.01)),
        ("stratified", 27, (0.4, 0.5, 0.6)),
        ("stratified", 27, (0.1, 0.02, 0.3)),
    ],
)
def test_against_simulation(design, n, x):
    mean, error = simulated(x, n, design, 10_000, rng=n)
    assert abs(vq.bias_function([x], n=n, design=design)[0] - mean) < 5.5 * error


# 5.5 standard errors of about 0.0007: three digits
@pytest.mark.slow
@pytest.mark.statistical
@pytest.mark.parametrize(
    ("design", "n", "x"),
    [
        ("uniform", 64, (0.02, 0.5)),
        ("uniform", 64, (0.01, 0.01)),
        ("stratified", 64, (0.3, 0.02)),
        ("uniform", 27, (0.02, 0.05, 0.01)),
        ("stratified", 27, (0.1, 0.02, 0.3)),
    ],
)
def test_three_digits_against_simulation(design, n, x):
    batches = [simulated(x, n, design, 25_000, rng=seed) for seed in range(16)]
    mean = np.mean([m for m, _ in batches])
    error = np.sqrt(np.mean([e**2 for _, e in batches]) / len(batches))
    assert error < 1e-3
    assert abs(vq.bias_function([x], n=n, design=design)[0] - mean) < 5.5 * error


@pytest.mark.statistical
@pytest.mark.parametrize("x", [(0.01, 0.01), (0.02, 0.5, 0.99)])
def test_the_torus_has_no_bias(x):
    mean, error = simulated(x, 27, "uniform", 2_000, rng=1, periodic=True)
    assert abs(mean - 1) < 5.5 * error
    on_the_box, box_error = simulated(x, 27, "uniform", 2_000, rng=1)
    assert abs(on_the_box - 1) > 20 * box_error


# ---------------------------------------------------------------------- integral, symmetry, accuracy


def gauss_points(d, n, strata):
    """Nodes (m, d) and weights of a rule that is exact for the polynomials of the tables."""
    x, w = np.polynomial.legendre.leggauss(20)
    axes = []
    for axis in bias_tables.table_plan(n, d, strata).axes:
        layers = [0, axis.depth, 1 - axis.depth, 1] if strata is None else np.arange(axis.k + 1) / axis.k
        breaks = np.unique(layers)
        low, width = breaks[:-1, None], np.diff(breaks)[:, None]
        axes.append(((low + width * (x + 1) / 2).ravel(), (width * w / 2).ravel()))
    nodes = np.stack(np.meshgrid(*(a[0] for a in axes), indexing="ij"), axis=-1).reshape(-1, d)
    weights = np.prod(np.stack(np.meshgrid(*(a[1] for a in axes), indexing="ij"), axis=-1).reshape(-1, d), axis=1)
    return nodes, weights


CASES = [
    (2, 2, None), (2, 16, None), (2, 256, None), (2, 10_000, None),
    (2, 4, (2, 2)), (2, 6, (2, 3)), (2, 64, (8, 8)), (2, 1024, (32, 32)),
    (3, 64, None),
]  # fmt: skip


@pytest.mark.parametrize(("d", "n", "strata"), CASES)
def test_the_integral_is_one(d, n, strata):
    x, w = gauss_points(d, n, strata)
    assert w @ bias_at(x, n, strata) == pytest.approx(1, abs=1e-6)
    # and nearly so before the table is scaled to it: for d = 2 uniform sets to 1e-6 as well
    raw = bias_tables.table(n, d, strata).raw_integral
    assert raw == pytest.approx(1, abs=2e-6 if d == 2 and strata is None else 2e-5)


@pytest.mark.parametrize(("d", "n", "strata"), CASES)
def test_the_table_agrees_with_the_quadrature(d, n, strata):
    x = np.random.default_rng(n).random((40, d))
    x[::2] **= 3  # many near the border
    error = np.abs(bias_at(x, n, strata) - bias_tables.directly(x, n, strata))
    assert error.max() < (1e-4 if d == 2 else 1e-3)
    assert error.mean() < (2e-5 if d == 2 else 1e-4)


@pytest.mark.parametrize(("design", "n"), [("uniform", 50), ("stratified", 49), ("stratified", 42)])
def test_symmetries(design, n):
    x = np.random.default_rng(1).random((FEW + 1, 2))
    g = vq.bias_function(x, n=n, design=design)
    np.testing.assert_allclose(vq.bias_function(1 - x, n=n, design=design), g, atol=1e-12)
    np.testing.assert_allclose(vq.bias_function(np.c_[x[:, 0], 1 - x[:, 1]], n=n, design=design), g, atol=1e-12)
    if n != 42:  # 6 × 7 strata are not symmetric in the axes
        np.testing.assert_allclose(vq.bias_function(x[:, ::-1], n=n, design=design), g, atol=1e-12)


def test_inside_the_box_uniform_sets_have_no_bias_and_stratified_ones_their_period():
    x = np.array([[0.5, 0.5], [0.45, 0.55]])
    np.testing.assert_allclose(vq.bias_function(x, n=10_000), 1, atol=1e-8)
    k = 20
    corner, centre = np.array([[8, 8]]) / k, np.array([[8.5, 8.5]]) / k
    g_corner, g_centre = (vq.bias_function(x, n=k**2, design="stratified")[0] for x in (corner, centre))
    assert g_corner < 0.9 < 1.03 < g_centre
    shifted = vq.bias_function(centre + np.array([3, 1]) / k, n=k**2, design="stratified")[0]
    assert shifted == pytest.approx(g_centre, abs=1e-9)


def test_one_sample_stands_for_the_box():
    for d in (1, 2, 3):
        for design in ("uniform", "stratified"):
            np.testing.assert_array_equal(vq.bias_function(np.full((2, d), 0.3), n=1, design=design), 1)


def test_threads_do_not_change_a_bit(monkeypatch):
    x = np.random.default_rng(1).random((30, 2))
    values = []
    for threads in ("1", "3"):
        monkeypatch.setenv("VOROQUAD_NUM_THREADS", threads)
        values.append(bias_tables.directly(x, 64, None))
    np.testing.assert_array_equal(*values)


# ---------------------------------------------------------------------- the cache


@pytest.fixture
def cache(tmp_path, monkeypatch):
    monkeypatch.setenv("VOROQUAD_CACHE_DIR", str(tmp_path / "cache"))
    bias_tables.table.cache_clear()
    yield tmp_path / "cache"
    bias_tables.table.cache_clear()


def file_of(cache):
    (path,) = cache.rglob("*.npz")
    return path


@pytest.mark.parametrize(("n", "strata"), [(30, (6, 5)), (30, None), (27, (3, 3, 3)), (216, None)])
def test_a_table_is_made_once(cache, monkeypatch, n, strata):
    x = np.random.default_rng(1).random((100, 3 if n in (27, 216) else 2))
    first = bias_at(x, n, strata)
    monkeypatch.setattr(bias_tables, "integrate", lambda *_: pytest.fail("made again"))
    np.testing.assert_array_equal(bias_at(x, n, strata), first)
    bias_tables.table.cache_clear()  # another process has the file only
    np.testing.assert_array_equal(bias_at(x, n, strata), first)


@pytest.mark.parametrize("damage", ["cut", "bit", "empty", "text", "other"])
def test_a_damaged_file_is_made_again(cache, damage):
    x = np.random.default_rng(1).random((100, 2))
    first = bias_at(x, 30, None)
    path = file_of(cache)
    whole = path.read_bytes()
    if damage == "cut":
        path.write_bytes(whole[: len(whole) // 2])
    elif damage == "bit":
        middle = len(whole) // 2
        path.write_bytes(whole[:middle] + bytes([whole[middle] ^ 64]) + whole[middle + 1 :])
    elif damage == "empty":
        path.write_bytes(b"")
    elif damage == "text":
        path.write_text("not a table")
    else:
        np.savez(path, coefficients=np.ones((3, 3)))
    bias_tables.table.cache_clear()
    np.testing.assert_array_equal(bias_at(x, 30, None), first)
    assert path.read_bytes() == whole


def test_a_cache_that_cannot_be_written_costs_time_only(cache):
    cache.write_text("a file where the directory should be")
    x = np.full((100, 2), 0.5)
    assert bias_at(x, 30, None)[0] == pytest.approx(bias_tables.directly(x[:1], 30, None)[0], abs=1e-4)


def _value(directory, start, n):
    import os

    os.environ["VOROQUAD_CACHE_DIR"] = directory
    start.wait()
    return float(bias_at(np.full((100, 2), 0.05), n, None)[0])


def _report(results, *arguments):
    results.put(_value(*arguments))


def test_processes_may_make_a_table_at_once(cache):
    context = multiprocessing.get_context("spawn")
    start, results = context.Barrier(3), context.Queue()
    crew = [context.Process(target=_report, args=(results, str(cache), start, 31)) for _ in range(3)]
    for process in crew:
        process.start()
    values = [results.get(timeout=120) for _ in crew]
    for process in crew:
        process.join()
    assert len(set(values)) == 1
    assert [p.name for p in cache.rglob("*") if p.is_file()] == [file_of(cache).name]


@pytest.mark.parametrize(
    ("x", "options", "message"),
    [
        ([1.5], {"n": 3}, r"x\[0\] = \[1.5\] is not inside \[0, 1\]"),
        ([0.5], {"n": 0}, "n must be a whole number of at least 1"),
        ([0.5], {"n": 3, "design": "sobol"}, "unknown design 'sobol'; choose one of uniform, stratified"),
        ([[0.5] * 4], {"n": 3}, r"d at most 3, got \(1, 4\)"),
        ([[0.5] * 2], {"n": 11, "design": "stratified"}, "n = 11 samples do not fill a near-cubic grid"),
    ],
)
def test_bad_input_is_refused(x, options, message):
    with pytest.raises(ValueError, match=message):
        vq.bias_function(x, **options)


def test_grids_of_cubes_share_a_table(cache):
    x = np.full((100, 2), 0.05)
    for n in (49, 64, 400):
        bias_at(x, n, grid_shape(n, 2))
    assert file_of(cache).stem == "stratified-7x7"
