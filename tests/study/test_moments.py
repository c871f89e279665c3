import numpy as np
import pytest

from voroquad._support.units import tree_sum
from voroquad.study.moments import Moments, add_packed


@pytest.fixture
def errors():
    # A mean far above the spread: sums of squares would cancel
    return 1e6 + np.random.default_rng(2).standard_normal((2, 3, 1000))


def test_moments_are_those_of_numpy(errors):
    moments = Moments.of(errors)
    for k, x in enumerate((errors, errors**2)):
        np.testing.assert_allclose(moments.mean[k], x.mean(-1), rtol=1e-14)
        np.testing.assert_allclose(moments.standard_error[k], x.std(-1, ddof=1) / np.sqrt(1000), rtol=1e-9)


@pytest.mark.parametrize("blocks", [[1000], [1, 999], [300] * 3 + [100], [7] * 142 + [6]])
def test_blocks_join(errors, blocks):
    whole = Moments.of(errors)
    parts = np.split(errors, np.cumsum(blocks)[:-1], axis=-1)
    joined = Moments.unpacked(tree_sum((Moments.of(part).packed() for part in parts), add_packed))
    assert joined.count == 1000
    np.testing.assert_allclose(joined.mean, whole.mean, rtol=1e-14)
    np.testing.assert_allclose(joined.standard_error, whole.standard_error, rtol=1e-8)
