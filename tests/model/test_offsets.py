"""Offsets of any size: what is subtracted before a fit comes back in its model."""

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.model.fit import fit
from hwid_cli.model.normalise import displaced
from hwid_cli.model.simulate import simulate
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from tests.benchmarks.plants import random_plant
from tests.model.plants import MAPS, measured, plant

CONSTANTS = ("piecewise_linear", "polynomial", "cubic_spline", "sigmoid_network")
KINDS = [
    ("piecewise_linear", "piecewise_linear"),
    ("none", "piecewise_linear"),
    ("piecewise_linear", "none"),
    ("saturation", "polynomial"),
    ("dead_zone", "cubic_spline"),
]


def test_a_displaced_model_gives_the_same_at_another_zero():
    u = measured(plant(), 200).input
    found = 0
    for before in MAPS:
        for after in MAPS:
            for state in ("zero", "steady", "estimated"):
                model = plant(before, after, state)
                other = displaced(model, 40.0, -30.0)
                if other is None:
                    continue
                found += 1
                # Forty times the signals' size: their rounding, through a resonance.
                np.testing.assert_allclose(
                    simulate(other, u + 40.0),
                    simulate(model, u) - 30.0,
                    atol=1e-9,
                    err_msg=f"{before}, {after}, {state}",
                )
    # Five kinds have constants of their own at both sides, whatever the start.
    assert found >= 75


@pytest.mark.thorough
@pytest.mark.parametrize("kinds", KINDS)
def test_an_offset_of_any_size_costs_nothing(kinds):
    orders, u, y, *_ = random_plant(1, 800)
    options = FitOptions(input_map=kinds[0], output_map=kinds[1])
    plain = fit([Recording("r", u, y, 1.0)], orders, options)
    for at_input, at_output in ((1e3, 0.0), (0.0, 1e3), (1e5, 1e5), (-1e7, 1e7)):
        offset = Recording("r", u + at_input, y + at_output, 1.0)
        found = fit([offset], orders, options)
        # Another path to another minimum may differ by this; an offset cost 20 points.
        assert found.fit_percent > plain.fit_percent - 1.0, (at_input, at_output)
        again = simulate(found.model, offset.input)
        # Seven digits of sixteen are the offset's.
        assert np.std(again - offset.output) < 1.001 * found.rmsd


def test_fits_that_begin_with_models_know_their_offsets():
    orders, u, y, *_ = random_plant(1, 800)
    far = Recording("r", u + 1e5, y - 1e5, 1.0)
    first = fit([far], orders)
    started = fit([far], orders, starts=[first.model])
    contained = fit(
        [far],
        Orders(orders.nb + 1, orders.nf, orders.nk),
        contained=[first.model],
        search_anew=False,
    )
    # Continuation stops at gains of a thousandth.
    assert started.rmsd < 1.05 * first.rmsd
    assert contained.rmsd <= first.rmsd * (1.0 + 1e-6)


def test_an_offset_that_no_map_takes_is_said():
    rng = np.random.default_rng(0)
    u = np.repeat(rng.uniform(-1.0, 1.0, 60), 10)
    y = lfilter([0.0, 0.2], [1.0, -0.8], u)
    linear = FitOptions(input_map="none", output_map="none")
    found = fit([Recording("r", u, y + 1e4, 1.0)], Orders(1, 1, 1), linear)
    assert "the output stays near 1e+04" in found.message
    assert (
        "far from zero"
        not in fit([Recording("r", u, y, 1.0)], Orders(1, 1, 1), linear).message
    )


@pytest.mark.thorough
def test_a_start_in_equilibrium_far_from_zero_is_no_exception():
    orders, u, y, *_ = random_plant(0, 600)
    far = Recording("r", u + 1e7, y + 1e7, 1.0)
    found = fit([far], orders, FitOptions(initial_state="steady"))
    assert found.status != "failed"


def test_an_integrator_behind_an_offset_input_is_fitted_as_it_is():
    rng = np.random.default_rng(3)
    u = np.repeat(rng.uniform(-1.0, 1.0, 80), 10) + 50.0
    x = lfilter([0.0, 0.1], [1.0, -1.0], u)
    size = 1e-3 * np.std(x)
    y = x + size * rng.standard_normal(x.size)
    options = FitOptions(input_map="none", output_map="polynomial", degree=2)
    found = fit([Recording("r", u, y, 1.0)], Orders(1, 1, 1), options)
    # No constant of the input is left out: it is the ramp that the output shows.
    assert found.rmsd < 1.1 * size
