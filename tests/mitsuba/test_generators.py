"""Generator matrices: SciPy's Sobol' points, and the nets that they promise, counted box by box."""

from __future__ import annotations

import itertools

import mitsuba as mi
import numpy as np
import pytest
from scipy.stats import qmc

from voroquad.mitsuba.generators import BITS, HALF, KINDS, SOBOL, crossed, joe_kuo, pair_tables, sz, upper_digits


def numbers(columns, indices):
    """Coordinates (len(columns), len(indices)) of points, as numbers below 2^32."""
    found = np.zeros((len(columns), len(indices)), np.uint64)
    for k in range(BITS):
        found ^= columns[:, k, None].astype(np.uint64) * ((indices >> k) & 1).astype(np.uint64)
    return found


def is_net(points, base_bits):
    """Has every elementary box in base 2^base_bits of the volume of a point one point?"""
    d, n = points.shape
    bits = int(n - 1).bit_length()
    for split in itertools.product(range(0, bits + 1, base_bits), repeat=d):
        if sum(split) == bits:
            box = np.zeros(n, np.uint64)
            for row, digits in zip(points, split, strict=True):
                box = box << np.uint64(digits) | row >> np.uint64(BITS - digits)
            if len(set(box.tolist())) < n:
                return False
    return True


def test_joe_and_kuo_are_scipys():
    indices = np.arange(64, dtype=np.uint64)
    gray = indices ^ indices >> np.uint64(1)  # SciPy goes through the indices in this order
    expected = qmc.Sobol(SOBOL, scramble=False, bits=BITS).random(64).T
    np.testing.assert_array_equal(numbers(joe_kuo(SOBOL), gray) / 2.0**BITS, expected)


@pytest.mark.parametrize("start", [0, 4096])
@pytest.mark.parametrize("bits_of_set", [0, 1, 4, 5, 8])
def test_quads_are_nets(start, bits_of_set):
    """Any aligned block: in base 4 all four coordinates, in base 2 each pair; crossed or not, of sets of any size."""
    columns = crossed(sz(), bits_of_set)
    for bits in (2, 4, 6):
        assert is_net(numbers(columns, np.arange(start, start + (1 << bits), dtype=np.uint64)), 2)
    for bits in range(1, 9):
        points = numbers(columns, np.arange(start, start + (1 << bits), dtype=np.uint64))
        assert is_net(points[:2], 1)
        assert is_net(points[2:], 1)


@pytest.mark.parametrize(("start", "bits_of_set"), [(0, 8), (3 << 12, 9)])
def test_sixteen_coordinates_are_nets(start, bits_of_set):
    """In base 16 any of them, in base 4 quads, and in base 2 pairs."""
    columns = crossed(sz(16), bits_of_set)
    points = {bits: numbers(columns, np.arange(start, start + (1 << bits), dtype=np.uint64)) for bits in range(1, 13)}
    assert all(is_net(points[8][list(pair)], 4) for pair in itertools.combinations(range(16), 2))
    assert all(is_net(points[12][list(some)], 4) for some in list(itertools.combinations(range(16), 3))[::29])
    for bits in (2, 4, 6, 8):
        assert all(is_net(points[bits][k : k + 4], 2) for k in range(0, 16, 4))
    for own in points.values():
        assert all(is_net(own[k : k + 2], 1) for k in range(0, 16, 2))


def test_pairs_of_sixteen_coordinates_have_few_empty_boxes():
    """The choice of the maps, as the comment has it: another one for a quad makes more."""
    points = (numbers(sz(16), np.arange(256, dtype=np.uint64)) >> np.uint64(BITS - 8)).astype(int)
    defects = {}
    for i, j in itertools.combinations(range(16), 2):
        cells = [points[i] >> 8 - k << 8 - k | points[j] >> k for k in range(1, 8)]
        defects[i // 4, j // 4] = defects.get((i // 4, j // 4), 0) + sum(len(set(c.tolist())) < 256 for c in cells)
    assert sum(defects[k, m] for k, m in itertools.combinations(range(4), 2)) == 146
    assert [defects[k, k + 1] for k in range(3)] == [18, 18, 18]


def test_other_coordinates_are_not_such_nets():
    """The control: four coordinates of Sobol' in base 4, and a pair of a quad's two pairs in base 2."""
    indices = np.arange(64, dtype=np.uint64)
    assert not is_net(numbers(joe_kuo(4), indices), 2)
    assert not is_net(numbers(sz()[[1, 2]], indices), 1)
    assert not is_net(numbers(sz(16)[[1, 2]], indices), 1)
    assert not is_net(numbers(sz(16)[2:6], indices), 2)
    assert not is_net(numbers(joe_kuo(6)[3:], np.arange(256, dtype=np.uint64)), 4)


def places(columns, bits, start):
    """For each coordinate of a pair, the different places in the cells of a row (of the partner's), at most."""
    points = (numbers(columns, np.arange(start, start + (1 << bits), dtype=np.uint64)) >> (BITS - bits)).astype(int)
    upper = upper_digits(bits)
    found = []
    for axis in (0, 1):
        place = points[axis] & (1 << bits - upper[axis]) - 1
        row = points[1 - axis] >> bits - upper[1 - axis]
        found.append(max(len(set(place[row == k])) for k in range(1 << upper[1 - axis])))
    return found


@pytest.mark.parametrize("start", [0, 3 << 10])
@pytest.mark.parametrize("bits", [2, 3, 4, 5, 6, 10])
@pytest.mark.parametrize(
    "columns", [sz()[:2], sz()[2:], sz(16)[14:], joe_kuo(2)], ids=["first", "second", "last", "sobol"]
)
def test_points_of_a_row_of_cells_are_evenly_spaced_if_crossed(columns, bits, start):
    assert places(crossed(columns, bits), bits, start) == [1, 1]
    assert max(places(columns, bits, start)) > 1


def test_pairs_that_are_no_nets_stay_as_they_are():
    pair = joe_kuo(8)[6:]
    np.testing.assert_array_equal(crossed(pair, 6), pair)


@pytest.mark.parametrize("index_bits", [0, 5, 12, 17, 32])
@pytest.mark.parametrize(
    ("kind", "size", "columns"), [("joe-kuo", 64, joe_kuo(SOBOL)), ("sz", 255, sz()), ("sz", 256, sz(16))]
)
def test_tables_give_the_same_coordinates(kind, size, columns, index_bits):
    """As many of their digits as an index has, or more."""
    tables, bits = pair_tables(kind, size, index_bits), (size - 1).bit_length()
    assert tables.joint == len(columns)
    entries = tables.entries.reshape(tables.joint // 2, tables.words, tables.parts, 1 << tables.part_bits)
    indices = np.array([0, 1, 0x12345678, 0xFFFFFFFF, 0x80000000], np.uint64) & np.uint64((1 << index_bits) - 1)
    digits = HALF * tables.words
    assert index_bits <= digits <= BITS
    expected = numbers(crossed(columns, bits), indices).astype(np.uint64) >> np.uint64(BITS - digits)
    for point, index in enumerate(indices.tolist()):
        words = np.zeros((tables.joint // 2, tables.words), np.uint64)
        for part in range(tables.parts):
            read = index >> part * tables.part_bits & (1 << tables.part_bits) - 1
            words ^= entries[:, :, part, int(f"{read:0{tables.part_bits}b}"[::-1], 2)]
        for axis in (0, 1):
            halves = (words >> np.uint64(HALF * axis)) & np.uint64((1 << HALF) - 1)
            found = ["".join(f"{int(half):0{HALF}b}"[::-1] for half in pair) for pair in halves]
            wanted = [f"{int(x):0{digits}b}" if digits else "" for x in expected[axis::2, point]]
            assert found == wanted


@pytest.mark.parametrize("generators", KINDS)
@pytest.mark.parametrize(("order", "spp"), [("morton", 2**24 + 1), ("morton", 2**26), ("none", 2**30 + 1)])
def test_indices_may_have_as_many_bits_as_a_word(generators, order, spp):
    size = {"width": 8, "height": 8}
    own = mi.load_dict({"type": "owensobol", "sample_count": spp, "order": order, "generators": generators} | size)
    own.seed(0, 64)
    samples = []
    for _ in range(2):
        samples.append(np.array([np.array(axis) for axis in own.next_2d()]))
        own.advance()
    assert all(((values >= 0) & (values < 1)).all() for values in samples)
    assert ((samples[0] < 0.5) != (samples[1] < 0.5)).all()  # the first two of a net
