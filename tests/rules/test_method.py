import numpy as np
import pytest

from voroquad.rules.method import KRIGING, ORDER_ZERO, highest_order, local, read_order


def test_orders_name_methods():
    assert read_order(0) == ORDER_ZERO
    assert read_order(np.int64(3)) == (local(3),)
    assert read_order("kriging") == (KRIGING,)
    assert read_order("auto") == ()


def test_methods_are_named_by_orders():
    for order in (*range(9), "kriging"):
        assert read_order(order)[0].order == order


@pytest.mark.parametrize("d", [1, 3, 4, 8, 9])
def test_the_highest_order_is_one_and_the_next_is_none(d):
    highest = highest_order(d)
    assert highest == {1: 8, 3: 8, 4: 3, 8: 3, 9: 0}[d]
    assert read_order(highest, d)
    with pytest.raises(ValueError, match=f"order must be .*0.* for d = {d}, 'kriging' or 'auto', got {highest + 1}"):
        read_order(highest + 1, d)


@pytest.mark.parametrize("order", [-1, 9, 1.0, True, None, "3", "cubic", [1]])
def test_what_is_no_order_is_refused(order):
    with pytest.raises(ValueError, match="order must be a whole number from 0 to 8, 'kriging' or 'auto', got"):
        read_order(order)


def test_names_may_be_left_out():
    with pytest.raises(ValueError, match=r"^order must be a whole number from 0 to 8, got 'kriging'$"):
        read_order("kriging", names=())
