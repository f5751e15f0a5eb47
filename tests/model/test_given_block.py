from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import least_squares
from scipy.signal import lfilter

from hwid_cli.model.candidates import FitData
from hwid_cli.model.fit import fit
from hwid_cli.model.initial_candidates import block_starts
from hwid_cli.model.scores import fit_percent
from hwid_cli.model.simulate import simulate
from hwid_cli.records.model import FitOptions, LinearBlock, Orders
from hwid_cli.records.recordings import Recording
from tests.model.plants import ORDERS, level_input, measured, options, plant

PAIRS = [
    ("dead_zone", "piecewise_linear"),
    ("piecewise_linear", "none"),
    ("piecewise_linear", "polynomial"),
    ("saturation", "none"),
    ("none", "none"),
    ("sigmoid_network", "cubic_spline"),
]


def block_of(model, **others):
    return LinearBlock(
        tuple(model.numerator), tuple(model.denominator), model.delay, **others
    )


@pytest.mark.parametrize("initial_state", ["zero", "steady", "estimated"])
@pytest.mark.parametrize(("input_map", "output_map"), PAIRS)
def test_a_frozen_block_is_bit_identical_after_the_fit(
    input_map, output_map, initial_state
):
    true = plant(input_map, output_map, initial_state)
    recording = measured(true, noise=0.01)
    given = replace(
        options(input_map, output_map, initial_state),
        units=6,
        linear_block=block_of(true, frozen=True),
    )
    result = fit([recording], ORDERS, given)
    np.testing.assert_array_equal(result.model.numerator, true.numerator)
    np.testing.assert_array_equal(result.model.denominator, true.denominator)
    assert result.status != "failed"
    assert result.orders == ORDERS
    # What is described is the model that is given back, not one with another gain.
    residual = recording.output - simulate(result.model, recording.input)
    assert result.rmsd == pytest.approx(np.sqrt(np.mean(residual**2)), rel=1e-9)


@pytest.mark.parametrize("scale", [(1.0, 1.0), (1e-3, 1e5)])
def test_maps_around_a_frozen_block_are_found_in_any_units(scale):
    true = plant("dead_zone", "polynomial")
    recording = measured(true, noise=0.01)
    recording = replace(
        recording, input=scale[0] * recording.input, output=scale[1] * recording.output
    )
    # The output map takes up the gain, so that the block's own is free.
    gain = 2.5 * true.numerator
    block = replace(block_of(true, frozen=True), numerator=tuple(gain))
    given = FitOptions(linear_block=block, initial_state="zero")
    result = fit([recording], ORDERS, given)
    y = simulate(result.model, recording.input)
    np.testing.assert_array_equal(result.model.numerator, gain)
    assert fit_percent(recording.output, y) > 98.8
    # One gain is shared by the maps: the mean slope of the input map is one.
    low, high = result.model.input_map.domain
    values = result.model.input_map.parameters[12:]
    assert np.ptp(values) / (high - low) == pytest.approx(1.0, rel=1e-9)


@pytest.mark.thorough
def test_without_a_gain_in_the_maps_the_given_gain_counts():
    true = plant("saturation", "none")
    recording = measured(true)
    half = replace(block_of(true, frozen=True), numerator=tuple(0.5 * true.numerator))
    given = options("saturation", "none")
    right = fit([recording], ORDERS, replace(given, linear_block=block_of(true)))
    wrong = fit([recording], ORDERS, replace(given, linear_block=half))
    assert right.rmsd < 1e-6
    assert wrong.rmsd > 0.1
    np.testing.assert_array_equal(wrong.model.numerator, half.numerator)


def test_frozen_coefficients_are_no_parameters():
    true = plant("dead_zone", "piecewise_linear")
    recording = measured(true, noise=0.01)
    given = options("dead_zone", "piecewise_linear")
    free = fit([recording], ORDERS, given)
    frozen = fit(
        [recording],
        ORDERS,
        replace(given, linear_block=block_of(true, frozen=True)),
    )
    names = frozen.uncertainty.names
    assert names
    assert not any(name.startswith(("b[", "f[")) for name in names)
    assert np.isfinite(frozen.uncertainty.standard_errors).sum() > 4
    # Two coefficients each of B and F, but the gain between block and output map is
    # no longer shared.
    fewer = free.information.n_parameters - frozen.information.n_parameters
    assert fewer == 3


@pytest.mark.thorough
def test_standard_errors_around_a_frozen_block_are_those_of_the_estimates():
    true = plant("dead_zone", "piecewise_linear")
    given = replace(
        options("dead_zone", "piecewise_linear"),
        linear_block=block_of(true, frozen=True),
    )
    deviations = []
    for seed in range(10):
        result = fit([measured(true, seed=seed, noise=0.05)], ORDERS, given)
        found = result.model.input_map.parameters
        deviations.append(
            (found - true.input_map.parameters) / result.uncertainty.standard_errors[:2]
        )
    # Twenty numbers tell a standard deviation to 16 %.
    assert 0.5 < np.sqrt(np.mean(np.square(deviations))) < 1.6


@pytest.mark.thorough
def test_a_given_block_is_one_more_start():
    true = plant("dead_zone", "polynomial")
    recording = measured(true, noise=0.01)
    alone = fit([recording], ORDERS, FitOptions(starts=1))
    given = FitOptions(starts=1, linear_block=block_of(true))
    result = fit([recording], ORDERS, given)
    assert result.rmsd <= 1.01 * alone.rmsd
    assert not np.array_equal(result.model.numerator, true.numerator)
    # Orders that do not contain the block do without it.
    small = fit([recording], Orders(1, 1, 2), given)
    same = fit([recording], Orders(1, 1, 2), FitOptions(starts=1))
    assert small.rmsd == same.rmsd


@pytest.mark.parametrize("frozen", [False, True])
def test_the_start_of_a_given_block_has_the_gain_and_offset_of_the_data(frozen):
    true = plant()
    u = level_input(400, 1)
    one = FitData(u, 3.0 * simulate(true, u) + 2.0)
    given = FitOptions(linear_block=block_of(true, frozen=frozen))
    larger = Orders(3, 3, 1)
    start = block_starts([one], ORDERS if frozen else larger, given)[-1]
    assert start.is_given
    assert start.offset == pytest.approx(2.0, rel=1e-9)
    assert start.cost < 1e-18 * one.output.size
    if frozen:
        np.testing.assert_array_equal(start.numerator, true.numerator)
        np.testing.assert_allclose(start.input_values, 3.0 * start.input_points)
    else:
        np.testing.assert_allclose(start.numerator, 3.0 * np.r_[0, true.numerator])
        np.testing.assert_array_equal(start.denominator, np.r_[true.denominator, 0])


@pytest.mark.thorough
def test_member_models_of_a_group_take_over_the_frozen_block():
    true = plant("dead_zone", "polynomial")
    pair = [measured(true, seed=seed, noise=0.01) for seed in (1, 2)]
    given = FitOptions(
        join="experiments", linear_block=block_of(true, frozen=True), units=6
    )
    # Even where the members were fitted without it.
    alone = replace(given, linear_block=None)
    members = [fit([one], ORDERS, alone).model for one in pair]
    result = fit(pair, ORDERS, given, starts=members)
    np.testing.assert_array_equal(result.model.numerator, true.numerator)
    np.testing.assert_array_equal(result.model.denominator, true.denominator)
    assert result.fit_percent > 98.0


def test_a_frozen_block_of_other_orders_is_refused():
    true = plant("none", "none")
    given = FitOptions(linear_block=block_of(true, frozen=True))
    with pytest.raises(ValueError, match=r"frozen linear block has the orders .*nk=2"):
        fit([measured(true)], Orders(2, 2, 1), given)


def test_a_frozen_block_that_is_unstable_fails_with_a_reason():
    given = FitOptions(linear_block=LinearBlock((1.0,), (1.0, -1.01), 1, frozen=True))
    result = fit([measured(plant())], Orders(1, 1, 1), given)
    assert result.status == "failed"
    assert result.message == "the frozen linear block has a pole at or beyond radius 1"


@pytest.mark.parametrize(
    ("values", "message"),
    [
        (((1.0,), (2.0, -0.5)), "denominator must start with 1"),
        (((0.0, 0.0), (1.0, -0.5)), "numerator must have a coefficient other than 0"),
        (((float("nan"),), (1.0,)), "numerator must be finite"),
        (((1.0,), (1.0,), -1), "delay must be an integer >= 0, got -1"),
    ],
)
def test_numbers_that_are_no_block_are_refused(values, message):
    with pytest.raises(ValueError, match=message):
        LinearBlock(*values)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("radius", "output_map"),
    [
        (0.85, "polynomial"),
        (0.6, "none"),
        pytest.param(0.85, "none", marks=pytest.mark.slow),
        pytest.param(0.6, "polynomial", marks=pytest.mark.slow),
    ],
)
def test_no_pole_lies_beyond_the_bound(radius, output_map):
    true = plant("dead_zone", output_map)
    recording = measured(true, noise=0.01)
    # The plant's poles have radius 0.9: they press against the bound.
    for given in (FitOptions(), FitOptions(linear_block=block_of(true))):
        bound = replace(given, largest_pole_radius=radius)
        result = fit([recording], ORDERS, bound)
        assert np.max(np.abs(result.poles)) < radius
        assert np.max(np.abs(result.poles)) > radius - 0.1
        assert result.fit_percent > 40.0


TRUE_BLOCK = ([0.0, 0.0, 0.0, 0.05, 0.03], [1.0, -1.6, 0.68])


def gun_like(u, block, edges, limits):
    """Dead zone, block, saturation, from rest."""
    return np.clip(lfilter(*block, u - np.clip(u, *edges)), *limits)


# Each bound once.
IN_SHORT = ((11, 0.7), (12, 0.8), (13, 0.82))


def rmsd_on_the_bound(recording, radius):
    """Second way: the pair of poles lies on the bound, its angle and the rest are free."""

    def residuals(p):
        f = [1.0, -2.0 * radius * np.cos(p[0]), radius**2]
        block = ([0.0, 0.0, 0.0, *p[1:3]], f)
        return gun_like(recording.input, block, p[3:5], p[5:7]) - recording.output

    angle = float(np.angle(np.roots(TRUE_BLOCK[1])[0]))
    begin = (angle, 0.05, 0.03, -0.4, 0.4, -1.2, 1.2)
    return float(np.sqrt(np.mean(least_squares(residuals, begin).fun ** 2)))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("seed", "radius"),
    [
        pytest.param(
            seed,
            radius,
            marks=() if (seed, radius) in IN_SHORT else pytest.mark.slow,
        )
        for seed in (10, 11, 12, 13)
        for radius in (0.7, 0.8, 0.82)
    ],
)
def test_the_best_model_that_lies_on_the_bound_is_found(radius, seed):
    # A search that only refuses to cross the bound stops 2 to 15 times as far off.
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-2.5, 2.5, 60), rng.integers(3, 30, 60))
    y = gun_like(u, TRUE_BLOCK, (-0.4, 0.4), (-1.2, 1.2))
    noisy = y + 0.01 * rng.standard_normal(u.size)
    recording = Recording("r", u, noisy, 1e-3)
    bound = FitOptions(
        input_map="dead_zone", output_map="saturation", largest_pole_radius=radius
    )
    result = fit([recording], Orders(2, 2, 3), bound)
    assert result.rmsd < 1.01 * rmsd_on_the_bound(recording, radius)


def test_the_bound_holds_for_models_of_other_fits_too():
    true = plant("dead_zone", "polynomial")
    recording = measured(true, noise=0.01)
    free = fit([recording], ORDERS, FitOptions())
    bound = FitOptions(largest_pole_radius=0.85)
    for how in ({"starts": [free.model]}, {"contained": [free.model]}):
        result = fit([recording], ORDERS, bound, **how)
        assert np.max(np.abs(result.poles)) < 0.85
        assert result.fit_percent > 40.0


def test_a_bound_far_out_changes_nothing():
    recording = measured(plant("dead_zone", "polynomial"), noise=0.01)
    free = fit([recording], ORDERS, FitOptions())
    bound = fit([recording], ORDERS, FitOptions(largest_pole_radius=0.98))
    assert bound.rmsd == pytest.approx(free.rmsd, rel=1e-3)


def test_a_frozen_block_is_compared_with_the_free_linear_model():
    # With maps of free gains a block of any unit will do; the linear model has none.
    true = plant("dead_zone", "polynomial")
    recording = measured(true, noise=0.01)
    large = replace(true, numerator=100.0 * true.numerator)
    frozen = FitOptions(linear_block=block_of(large, frozen=True))
    result = fit([recording], ORDERS, frozen)
    linear = fit([recording], ORDERS, FitOptions(input_map="none", output_map="none"))
    assert result.linear_rmsd == pytest.approx(linear.rmsd, rel=1e-2)
    assert result.rmsd < 0.5 * linear.rmsd


@pytest.mark.parametrize("radius", [0.0, 1.1, float("nan")])
def test_a_radius_that_is_none_is_refused(radius):
    with pytest.raises(ValueError, match="largest_pole_radius must be"):
        FitOptions(largest_pole_radius=radius)
