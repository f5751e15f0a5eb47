import numpy as np
import pytest

from hwid_cli.model.fit import fit
from hwid_cli.model.initial_candidates import enlarged
from hwid_cli.model.simulate import simulate
from hwid_cli.records.model import Orders
from tests.model.plants import level_input, measured, options, plant


@pytest.mark.parametrize(
    ("orders", "smaller", "expected"),
    [
        (Orders(2, 2, 1), Orders(2, 2, 1), True),
        (Orders(2, 3, 1), Orders(2, 2, 1), True),
        (Orders(2, 2, 1), Orders(2, 3, 1), False),
        (Orders(3, 2, 1), Orders(2, 2, 2), True),
        (Orders(2, 2, 1), Orders(2, 2, 2), False),
        (Orders(3, 2, 2), Orders(3, 2, 1), False),
    ],
)
def test_orders_contain_those_whose_coefficients_they_have(orders, smaller, expected):
    assert orders.contains(smaller) is expected


@pytest.mark.parametrize("initial_state", ["zero", "steady", "estimated"])
def test_an_enlarged_model_is_the_same_model(initial_state):
    model = plant("dead_zone", "saturation", initial_state)
    larger = enlarged(model, Orders(4, 5, 1))
    assert larger.orders == Orders(4, 5, 1)
    u = level_input(300, 4)
    np.testing.assert_allclose(simulate(larger, u), simulate(model, u), atol=1e-13)


@pytest.mark.parametrize("initial_state", ["zero", "estimated"])
def test_a_fit_is_never_worse_than_the_models_it_contains(initial_state):
    recording = measured(
        plant("piecewise_linear", "saturation", initial_state), noise=0.02
    )
    how = options("piecewise_linear", "saturation", initial_state)
    small = fit([recording], Orders(2, 2, 2), how)
    # Few iterations and starts: alone, the larger fit may well end worse.
    hasty = options(
        "piecewise_linear", "saturation", initial_state, max_iterations=1, starts=1
    )
    large = fit([recording], Orders(4, 4, 1), hasty, contained=[small.model])
    assert large.rmsd <= small.rmsd * (1.0 + 1e-9)


def test_a_linear_fit_is_never_worse_than_the_models_it_contains():
    recording = measured(plant("none", "saturation"), noise=0.02)
    small = fit([recording], Orders(2, 2, 2), options("none", "none", "estimated"))
    hasty = options("none", "none", "estimated", max_iterations=1, starts=1)
    alone = fit([recording], Orders(4, 6, 1), hasty)
    large = fit([recording], Orders(4, 6, 1), hasty, contained=[small.model])
    assert large.rmsd <= small.rmsd * (1.0 + 1e-9)
    assert large.rmsd <= alone.rmsd * (1.0 + 1e-9)


@pytest.mark.thorough
@pytest.mark.parametrize("starts", ["none", "members"])
def test_a_fit_that_only_goes_on_keeps_the_best_of_the_models_it_contains(starts):
    recording = measured(plant("piecewise_linear", "saturation"), noise=0.02)
    how = options("piecewise_linear", "saturation")
    narrow = fit([recording], Orders(1, 1, 1), how)
    small = fit([recording], Orders(2, 2, 1), how)
    orders = Orders(3, 3, 1)
    members = [fit([recording], orders, how).model] if starts == "members" else []
    contained = [narrow.model, small.model]
    large = fit(
        [recording],
        orders,
        how,
        starts=members,
        contained=contained,
        search_anew=False,
    )
    # The plant has two poles: one is too few, so going on from two is the only way here.
    assert narrow.rmsd > 2.0 * small.rmsd
    assert large.rmsd <= small.rmsd * (1.0 + 1e-9)
    assert large.iterations <= 5


def test_without_models_to_go_on_from_a_fit_is_searched_anyway():
    recording = measured(plant("piecewise_linear", "saturation"), noise=0.02)
    how = options("piecewise_linear", "saturation")
    anyway = fit([recording], Orders(2, 2, 1), how, search_anew=False)
    assert anyway.rmsd == fit([recording], Orders(2, 2, 1), how).rmsd
