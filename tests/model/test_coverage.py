"""Do 95 % intervals of a fit's parameters hold what a fit without noise has?"""

import warnings
from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.model import static_map
from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate
from hwid_cli.records.recordings import Recording
from tests.model.plants import level_input, options, plant

N_SAMPLES, LEAD_IN, NOISE = 1500, 100, 0.01
# Kinds whose plants a fit with as many units has exactly, at both sides.
KINDS = ("piecewise_linear", "polynomial", "saturation", "dead_zone", "own_function")


def listed(model):
    """Parameters in the order in which a fit lists their errors."""
    return np.concatenate(
        [
            model.input_map.parameters,
            model.output_map.parameters,
            model.numerator,
            model.denominator[1:],
        ]
    )


def spread(kinds, state, runs):
    """Coverage, standard deviation over the runs, and median standard error."""
    truth = plant(*kinds, "zero" if state == "zero" else "estimated")
    lead_in = 0 if state == "zero" else LEAD_IN
    u = level_input(N_SAMPLES + lead_in, 1)
    y = simulate(truth, u, initial_state=np.zeros(truth.orders.n_state))
    asked = options(*kinds, state)
    recording = Recording("r", u[lead_in:], y[lead_in:], 1e-3)
    true = fit([recording], truth.orders, asked)
    found, errors = [], []
    for seed in range(runs):
        noise = np.random.default_rng([seed, 99]).standard_normal(N_SAMPLES)
        noisy = replace(recording, output=recording.output + NOISE * np.std(y) * noise)
        one = fit([noisy], truth.orders, asked)
        found.append(listed(one.model))
        errors.append(one.uncertainty.standard_errors)
    found, errors = np.array(found), np.array(errors)
    inside = np.abs(found - listed(true.model)) <= 1.96 * errors
    told = ~np.isnan(errors)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        coverage = np.nanmean(np.where(told, inside, np.nan), axis=0)
        median = np.nanmedian(errors, axis=0)
    return one.uncertainty, coverage, np.std(found, axis=0), median


@pytest.mark.thorough
@pytest.mark.parametrize("state", ["zero", "estimated"])
@pytest.mark.parametrize(
    "kinds",
    [
        ("piecewise_linear", "none"),
        ("none", "piecewise_linear"),
        ("piecewise_linear", "piecewise_linear"),
    ],
)
def test_piecewise_linear_maps_scatter_as_their_standard_errors_say(kinds, state):
    said, coverage, scatter, error = spread(kinds, state, 24)
    told = ~np.isnan(coverage)
    # 24 runs of a dozen parameters that hang together: 95 % within three of their errors.
    assert 0.88 < np.mean(coverage[told]) < 0.99
    # A standard deviation of 24 numbers is known to 15 %; three of these.
    assert np.all(scatter[told] < 1.5 * error[told])
    assert np.all(scatter[told] > 0.6 * error[told])
    names = np.array(said.names)[~told]
    assert [one.split(".")[1] for one in names] == [
        "break_point[0]",
        "break_point[3]",
    ] * (2 - kinds.count("none"))
    assert "no parameter" in said.reason


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_intervals_of_every_kind_cover(kind):
    coverages = []
    for kinds in ((kind, "none"), ("none", kind)):
        _, coverage, _, _ = spread(kinds, "estimated", 100)
        coverages.append(coverage[~np.isnan(coverage)])
    # Binomial of 100 runs: 0.022 for one parameter; they hang together.
    assert 0.90 < np.mean(np.concatenate(coverages)) < 0.98


def test_input_maps_are_zero_at_zero_where_a_constant_is_shared():
    truth = plant("piecewise_linear", "piecewise_linear", "estimated")
    u = level_input(800, 3)
    y = simulate(truth, u, initial_state=np.zeros(3))
    recording = Recording("r", u, y, 1e-3)
    kinds = ("piecewise_linear", "piecewise_linear")
    found = fit([recording], truth.orders, options(*kinds, "estimated"))
    at_zero = static_map.evaluate(found.model.input_map, np.zeros(1))
    # Subtracted once: rounding of the values.
    assert abs(at_zero[0]) < 1e-12
    again = simulate(found.model, u)
    assert np.sqrt(np.mean((again - y) ** 2)) == pytest.approx(found.rmsd, rel=1e-6)
