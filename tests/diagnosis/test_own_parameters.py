"""Fit of the parameters of a user's own simulation."""

from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis.own_parameters import fit_beside, fit_parameters
from hwid_cli.diagnosis.simulator import DIFFERENCE, difference_for
from hwid_cli.records.programs import FreeParameter, SimulatorRun

FREE = {
    "a": FreeParameter(-1.2, (-5.0, 5.0)),
    "b": FreeParameter(1.0, (-5.0, 5.0)),
}


class Valley:
    """A simulation whose gap is a bent valley (Rosenbrock, 1960), with its end at 1, 1."""

    def __init__(self, floor=0.0, n_floor=1):
        self.asked = []
        self.floor = np.full(n_floor, floor / np.sqrt(n_floor))

    def __call__(self, signals, values):
        a, b = values["a"], values["b"]
        self.asked.append((a, b))
        output = np.r_[10 * (b - a**2), 1 - a, self.floor]
        return [SimulatorRun(output, np.zeros(0)) for _ in signals]


def signals(size=3):
    return [
        SimpleNamespace(
            name="one", compared=np.zeros(size), evaluated=slice(None),
            n_evaluated=size, is_held_out=False,
        )
    ]  # fmt: skip


def fitted(valley, noise_rms=0.0):
    values = {name: one.value for name, one in FREE.items()}
    of = signals(2 + valley.floor.size)
    return fit_parameters(valley, of, FREE, values, noise_rms)


def test_a_search_that_still_leaves_less_goes_on_to_its_end():
    # Eight evaluations end half way along the valley.
    valley = Valley()
    found = fitted(valley)
    assert found == pytest.approx({"a": 1.0, "b": 1.0}, abs=1e-3)


@pytest.mark.parametrize(("noise_rms", "is_followed"), [(0.1, True), (0.03, False)])
def test_near_the_noise_a_search_goes_on_while_slopes_promise_more(
    noise_rms, is_followed
):
    # The last of eight evaluations leave 97 % of those before them, half way along: 0.13
    # of each sample. At 0.5, slopes promise 5 % of what is left.
    found = fitted(Valley(floor=2.0, n_floor=300), noise_rms)
    assert (found["a"] > 0.5) is is_followed


def test_a_search_that_hardly_leaves_less_ends_where_it_began():
    # Beside a far larger gap, which no parameter closes, the valley is nothing.
    valley = Valley(floor=100.0)
    found = fitted(valley)
    assert found == pytest.approx({"a": -1.2, "b": 1.0}, abs=0.3)
    assert len(valley.asked) <= 2 * 8 * 3 + 1


class Rope:
    """A stretch of 1/k beside a gap that goes a little with it, and a gain that is told.

    Without the gap k is 1; a stiff rope takes a hundredth of it away.
    """

    def __init__(self, gap):
        self.gap, self.asked = gap, 0

    def __call__(self, signals, values):
        self.asked += 1
        stretch = 0.01 * (1.0 / values["k"] - 1.0)
        left = [stretch + 0.001 * self.gap, 10 * (values["gain"] - 3 - 0.1 * self.gap)]
        output = np.r_[left, np.full(8, self.gap)]
        return [SimulatorRun(output, np.zeros(0)) for _ in signals]


@pytest.mark.parametrize("gap", [0.0, 10.0])
def test_far_from_the_noise_a_parameter_that_hardly_matters_stays_near(gap):
    free = {
        "k": FreeParameter(1.2, (0.1, 100.0)),
        "gain": FreeParameter(2.0, (0.1, 100.0)),
    }
    values = {name: one.value for name, one in free.items()}
    found = fit_parameters(Rope(gap), signals(10), free, values, 1e-4)
    # One that matters moves by more than it was stated as.
    assert found["gain"] == pytest.approx(3.0 + 0.1 * gap, rel=0.01)
    if gap:
        assert found["k"] == pytest.approx(1.2, rel=0.2)
    else:
        assert found["k"] == pytest.approx(1.0, rel=0.02)


@pytest.mark.parametrize("is_rough", [False, True])
def test_far_from_the_noise_a_rough_search_spares_the_last_digits(is_rough):
    valley = Valley(floor=100.0)
    values = {name: one.value for name, one in FREE.items()}
    fit_parameters(valley, signals(), FREE, values, 0.1, is_rough=is_rough)
    assert (len(valley.asked) <= 8) is is_rough


@pytest.mark.parametrize("floor", [0.0, 100.0])
def test_a_search_beside_a_rival_is_given_up_early_or_goes_to_its_end(floor):
    valley = Valley(floor)
    values = {name: one.value for name, one in FREE.items()}
    found = fit_beside(valley, signals(), FREE, values, {"one": 100.0}, 0.0)
    if floor:
        assert found is None
        assert len(valley.asked) <= 4 * 3 + 1
    else:
        assert found == pytest.approx({"a": 1.0, "b": 1.0}, abs=1e-3)


def test_no_run_is_asked_for_twice_in_a_search():
    valley = Valley()
    fitted(valley)
    assert len(set(valley.asked)) == len(valley.asked)


def test_a_difference_is_as_wide_as_a_rough_simulation_needs():
    """Outputs to two decimals: a thousandth of the parameter changes none of them."""
    measured = 1.3 * np.linspace(0.0, 2.0, 200)

    def rough(_signals, values):
        return [SimulatorRun(np.round(values["a"] * measured / 1.3, 2), np.zeros(0))]

    one = SimpleNamespace(
        compared=measured, evaluated=slice(None), n_evaluated=200, is_held_out=False
    )
    free = {"a": FreeParameter(1.0, (0.1, 5.0))}
    found = fit_parameters(rough, [one], free, {"a": 1.0})
    assert found["a"] == pytest.approx(1.3, rel=5e-3)


def test_differences_go_from_a_thousandth_to_a_twentieth():
    slope = np.ones(50)
    assert difference_for(slope, 1e-9) == DIFFERENCE
    assert difference_for(slope, 0.1) == pytest.approx(0.01)
    assert difference_for(slope, 1e9) == pytest.approx(0.05)
    assert difference_for(0.0 * slope, 1.0) == pytest.approx(0.05)
    assert difference_for(np.inf * slope, 1.0) == DIFFERENCE


def test_beside_a_rival_a_search_far_from_the_noise_ends_sooner():
    values = {name: one.value for name, one in FREE.items()}

    def searched(noise_rms):
        valley = Valley(floor=1.0)
        found = fit_beside(valley, signals(), FREE, values, {"one": 100.0}, noise_rms)
        return found, len(valley.asked)

    far, of_far = searched(0.0)
    near, of_near = searched(10.0)
    assert near == pytest.approx({"a": 1.0, "b": 1.0}, abs=1e-2)
    assert of_far < of_near
    # What is left is hardly more: the last steps took less than 1 % of it each.
    left = 100 * (far["b"] - far["a"] ** 2) ** 2 + (1 - far["a"]) ** 2
    assert left < 0.1
