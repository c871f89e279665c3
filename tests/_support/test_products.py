"""Products whose rows have the same bits, whatever rows are beside them."""

import numpy as np

from voroquad._support.products import rows_times


def test_rows_are_those_of_the_product_and_do_not_depend_on_one_another():
    rng = np.random.default_rng(2)
    for k, m in ((1, 1), (2, 5), (7, 3), (20, 20)):
        rows, matrix = rng.normal(size=(53, k)), rng.normal(size=(k, m))
        product = rows_times(rows, matrix)
        np.testing.assert_allclose(product, rows @ matrix, rtol=0, atol=1e-14 * k)
        for size in (1, 2, 3, 8):
            parts = [rows_times(rows[i : i + size], matrix) for i in range(0, 53, size)]
            np.testing.assert_array_equal(np.concatenate(parts), product)
