import pytest

from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import Orders
from hwid_cli.stages.order_grid import candidate_orders, growth


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


@pytest.mark.parametrize(
    "options",
    [
        OrdersOptions(),
        OrdersOptions(nb=(3, 1), nk=(2, 7, 1)),
        OrdersOptions(nb=(2, 3, 4), nk=(0, 1, 2, 5), nk_role="delay", nf=3),
    ],
)
def test_models_grow_out_of_the_largest_ones_that_they_contain(options):
    grid = [one for _, _, one in candidate_orders(options)]
    rounds = growth(options)
    assert sorted(place for one in rounds for place, _ in one) == list(range(len(grid)))
    done = set()
    for places in rounds:
        for place, largest in places:
            below = {
                j
                for j, one in enumerate(grid)
                if j != place and grid[place].contains(one)
            }
            assert set(largest) == {
                j
                for j in below
                if not any(grid[k].contains(grid[j]) for k in below - {j})
            }
            assert below <= done
        done |= {place for place, _ in places}


def test_a_wide_grid_is_put_in_order_at_once():
    # It took minutes from here on.
    rounds = growth(OrdersOptions(nb=tuple(range(1, 26)), nk=tuple(range(1, 26))))
    assert (len(rounds), sum(map(len, rounds))) == (49, 625)
