import pytest

from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import Orders
from hwid_cli.stages.order_grid import candidate_orders


def test_the_default_grid_is_the_published_one():
    grid = candidate_orders(OrdersOptions())

    assert len(grid) == 100
    assert grid[0] == (1, 1, Orders(1, 1, 1))
    # The second axis counts poles, the delay is 1.
    assert grid[26] == (3, 7, Orders(nb=3, nf=7, nk=1))


def test_in_the_delay_reading_the_second_axis_is_the_delay():
    grid = candidate_orders(OrdersOptions(nb=(2, 3), nk=(0, 5), nk_role="delay", nf=4))

    assert grid == (
        (2, 0, Orders(2, 4, 0)),
        (2, 5, Orders(2, 4, 5)),
        (3, 0, Orders(3, 4, 0)),
        (3, 5, Orders(3, 4, 5)),
    )


def test_the_delay_reading_needs_the_number_of_poles():
    with pytest.raises(ConfigError, match=r"orders\.nf: missing"):
        candidate_orders(OrdersOptions(nk_role="delay"))
