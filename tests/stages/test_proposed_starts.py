"""How models take recordings to start, as ``init`` proposes it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.records.recordings import RawRecording
from hwid_cli.stages.proposal import propose
from hwid_cli.stages.proposed_starts import levels_left, levels_taken_off

REST, N = 100, 900


def settled(name, height, *, before=0.0, offset=0.0, seed=0):
    """A step of a plant that has settled under the level before it."""
    rng = np.random.default_rng(seed)
    u = np.where(np.arange(N) < REST, before, height)
    x = 2.0 * before + lfilter([0.0, 0.1], [1.0, -0.95], u - before)
    y = x + offset + 0.002 * rng.standard_normal(N)
    return RawRecording(name, u + 0.002 * rng.standard_normal(N), y, 1e-3)


def start(*raws):
    return propose(raws).fit_start


@pytest.mark.parametrize("offset", [0.0, 20.0])
def test_where_all_begin_with_a_rest_nothing_is_fitted_to_starts(offset):
    rule, why = start(
        settled("step_1", 1.0, offset=offset), settled("step_2", -2.0, offset=offset)
    )
    assert rule == "zero"
    assert why.startswith("all recordings begin with a rest at zero")


def random_ones(*raws):
    """Recordings of a kind that keeps its level."""
    return [
        RawRecording(f"prbs_{one.name}", one.input, one.output, 1e-3) for one in raws
    ]


def test_rests_under_other_inputs_are_equilibria_too():
    raws = random_ones(settled("a", 1.0), settled("b", 2.0, before=1.0))
    assert start(*raws)[0] == "steady"


def test_a_drive_that_rests_anywhere_has_fitted_starts():
    rule, why = start(*random_ones(settled("a", 1.0), settled("b", 2.0, offset=0.8)))
    assert rule == "estimated"
    assert why.startswith("the drive rests anywhere")


@pytest.mark.parametrize(
    ("pole", "place", "rule"),
    [
        (1.0, 5.0, "estimated"),
        (0.95, 5.0, "steady"),
        (0.998, 5.0, "steady"),
        # From zero nothing drifts, whatever the first sample's noise is.
        (1.0, 0.0, "zero"),
        (0.95, 0.0, "zero"),
    ],
)
def test_what_stays_where_it_was_moved_to_has_a_fitted_start(pole, place, rule):
    u = np.zeros(N)
    u[REST : 2 * REST] = 1.0
    rng = np.random.default_rng(3)
    moved = []
    for name, height in (("prbs_1", 1.0), ("prbs_2", -0.5)):
        y = place + lfilter([0.0, 0.1], [1.0, -pole], height * u)
        y = y + 0.002 * rng.standard_normal(N)
        moved.append(RawRecording(name, height * u, y, 1e-3))
    assert start(*moved)[0] == rule


def test_a_recording_that_begins_in_motion_has_a_fitted_start():
    moving = settled("b", 2.0)
    moving = RawRecording("b", moving.input[REST:], moving.output[REST:], 1e-3)
    rule, why = start(settled("a", 1.0), moving)
    assert rule == "estimated"
    assert why.startswith("not all recordings begin with a rest")


def test_parts_of_one_recording_begin_in_mid_motion():
    u = np.r_[
        np.zeros(REST), np.repeat(np.random.default_rng(1).uniform(-1, 1, 60), 50)
    ]
    only = RawRecording("a", u, lfilter([0.0, 0.1], [1.0, -0.95], u), 1e-3)
    assert start(only)[0] == "estimated"


def recipe(*raws):
    return propose(raws).recipes["step"]


@pytest.mark.parametrize(
    ("before", "offset", "steps"),
    [
        # Held at other inputs, the output is where these hold it.
        ((1.0, 2.0), (0.0, 0.0), ("cut",)),
        # All at one input that is not zero: the level belongs to it.
        ((1.0, 1.0), (20.0, 20.0), ("cut",)),
        # A zero of the sensor, and a drive that rests anywhere.
        ((0.0, 0.0), (20.0, 20.0), ("cut", "output_offset")),
        ((0.0, 0.0), (0.8, 0.0), ("cut", "output_offset")),
        ((1.0, 1.0), (0.8, 0.0), ("cut", "output_offset")),
    ],
)
def test_a_level_that_goes_with_the_input_is_not_subtracted(before, offset, steps):
    raws = [
        settled(f"step_{name}", height, before=level, offset=shift, seed=seed)
        for seed, (name, height, level, shift) in enumerate(
            zip("ab", (3.0, 0.5), before, offset, strict=True)
        )
    ]
    assert recipe(*raws) == steps


@pytest.mark.parametrize(
    ("recipe", "before", "offset", "is_taken_off"),
    [
        (("cut", "output_offset"), (1.0, 2.0), (0.0, 0.0), True),
        # Both levels go, or none; all rest at one; the zero of a sensor.
        (("cut", "output_offset", "input_offset"), (1.0, 2.0), (0.0, 0.0), False),
        (("cut",), (1.0, 2.0), (0.0, 0.0), False),
        (("cut", "output_offset"), (1.0, 1.0), (0.0, 0.0), False),
        (("cut", "output_offset"), (0.0, 0.0), (0.0, 20.0), False),
        (("cut", "output_offset"), (1.0, 1.0), (0.0, 0.8), False),
    ],
)
def test_a_recipe_that_takes_off_where_an_input_holds_the_output(
    recipe, before, offset, is_taken_off
):
    raws = [
        settled(f"step_{name}", height, before=level, offset=shift, seed=seed)
        for seed, (name, height, level, shift) in enumerate(
            zip("ab", (3.0, 0.5), before, offset, strict=True)
        )
    ]
    recipes = {one.kind: recipe for one in raws}
    assert levels_taken_off(raws, recipes) == (raws if is_taken_off else [])


@pytest.mark.parametrize(
    ("recipe", "other", "offset", "is_left"),
    [
        (("cut", "output_offset"), (), 20.0, True),
        # Both lose it, or none; a zero of no size; the input loses its level as well.
        (("cut", "output_offset"), ("output_offset",), 20.0, False),
        (("cut",), (), 20.0, False),
        (("cut", "output_offset"), (), 0.0, False),
        (("cut", "input_offset", "output_offset"), (), 20.0, False),
    ],
)
def test_a_level_that_one_kind_loses_and_another_keeps(recipe, other, offset, is_left):
    a, b = (settled(name, 1.0, offset=offset) for name in ("step_1", "random_1"))
    raws = [replace(a, kind="step"), replace(b, kind="random")]
    found = levels_left(raws, {"step": recipe, "random": other})
    assert [one.name for one in found] == (["random_1"] if is_left else [])
