import zlib
from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.records.recordings import RawRecording
from hwid_cli.stages.proposal import propose


def raw(name, input_):
    output = np.convolve(input_, np.ones(8) / 8)[: input_.size]
    # No reading of a sensor comes twice.
    noise = np.random.default_rng(zlib.crc32(name.encode())).standard_normal(
        output.size
    )
    return RawRecording(name, input_, output + 1e-6 * noise, 1e-3)


def levels(seed, size=600):
    return np.repeat(np.random.default_rng(seed).uniform(-1, 1, size // 20), 20)


def held_out(*recordings):
    found = propose(recordings)
    return found.held_out, found.held_out_reason


def test_names_say_what_is_for_the_test():
    names = ("train_1", "train_2", "val_1", "run_test")
    recordings = [raw(name, levels(seed)) for seed, name in enumerate(names)]
    assert held_out(*recordings) == (("val_1", "run_test"), "named so")


def test_words_inside_of_other_words_are_no_names_of_tests():
    names = ("fastest_1", "interval_2", "slow_3", "slow_4")
    recordings = [raw(name, levels(seed)) for seed, name in enumerate(names)]
    assert held_out(*recordings)[1] != "named so"


def test_of_repeats_of_an_input_the_last_one_is_for_the_test():
    recordings = [
        raw(f"{name}{number}", levels(seed))
        for seed, name in enumerate(("a", "b"))
        for number in (1, 2, 3)
    ]
    assert held_out(*recordings) == (("a3", "b3"), "the last repeat of each input")


def test_a_copy_is_neither_for_the_test_nor_for_the_fit():
    one, other = raw("run_1", levels(1)), raw("run_2", levels(2))
    found = propose(
        [one, other, replace(other, name="run_2_old"), raw("run_3", levels(3))]
    )
    assert found.exclude == ("run_2_old",)
    assert found.problems == ("run_2_old: holds the same numbers as run_2",)
    assert found.names == ("run_1", "run_2", "run_3")


def test_a_measured_input_is_never_the_same_and_its_repeats_are_known():
    rng = np.random.default_rng(1)
    recordings = [
        raw(f"{name}_{number}", level + 0.02 * rng.standard_normal(600))
        for name, level in (("low", 0.1), ("high", 0.3))
        for number in (1, 2)
    ]
    assert held_out(*recordings)[0] == ("low_2", "high_2")


def test_steps_of_other_sizes_are_no_repeats():
    step = np.where(np.arange(600) > 100, 1.0, 0.0)
    recordings = [raw(f"step_{size}", size * step) for size in (1, 2, 3, 4)]
    found = held_out(*recordings)
    reason = "about a quarter of each kind; none goes beyond what the others reach"
    assert found == (("step_2",), reason)


def test_what_alone_reaches_an_extreme_is_not_held_out():
    step = np.where(np.arange(600) > 100, 1.0, 0.0)
    sizes = {"a": 4.0, "b": 1.0, "c": 9.0, "d": -2.0}
    recordings = [raw(f"step_{name}", size * step) for name, size in sizes.items()]
    assert held_out(*recordings)[0] == ("step_a",)
    # Two that reach nothing but what the other one does: the last one judges.
    assert held_out(*recordings[2:])[0] == ("step_d",)


def test_what_is_named_for_training_is_not_held_out():
    names = ("train_1", "train_2", "train_3", "other")
    recordings = [raw(name, levels(seed)) for seed, name in enumerate(names)]
    assert held_out(*recordings)[0] == ("other",)


def after_a_rest(values, size=70):
    return np.concatenate([np.zeros(size), values])


def step_and_prbs():
    """After rests as long as a level of the second one."""
    signs = np.repeat(np.random.default_rng(3).choice([-1.0, 1.0], 9), 70)
    return {"step_1": after_a_rest(np.ones(600)), "prbs_1": after_a_rest(signs)}


def test_what_is_said_of_rests_and_how_a_diagnosis_starts_agree():
    found = propose([raw(name, one) for name, one in step_and_prbs().items()])
    assert found.recipe_reason == (
        "tried: step recordings begin with a rest; random ones are left whole: a cut "
        "may begin in mid-motion"
    )
    assert found.recipes["step"] == ("cut", "output_offset")
    assert found.recipes["random"] == ()
    # The second one stood still as well, which its output tells.
    assert found.initial_state == "rest"


def test_a_random_recording_after_a_rest_is_not_cut():
    noise = np.random.default_rng(5).standard_normal((2, 600))
    found = propose(
        [raw(f"noise_{n}", after_a_rest(one)) for n, one in enumerate(noise)]
    )
    assert found.recipes == {"random": ()}
    assert found.initial_state == "rest"


def test_a_drive_that_moves_before_its_input_does_not_begin_with_a_rest():
    recordings = []
    for name, values in step_and_prbs().items():
        swing = 0.2 * np.cos(0.2 * np.arange(values.size))
        still = raw(name, values)
        recordings.append(RawRecording(name, values, still.output + swing, 1e-3))
    found = propose(recordings)
    assert found.recipe_reason == "no rest is cut: not all recordings begin with one"
    assert set(found.recipes.values()) == {()}
    assert found.initial_state == "estimated"


def test_a_rest_that_is_not_cut_is_no_missing_rest():
    recordings = [raw("prbs_1", step_and_prbs()["prbs_1"])]
    recordings.append(raw("prbs_2", -recordings[0].input))
    found = propose(recordings)
    assert found.recipes == {"random": ()}
    assert found.recipe_reason.startswith("nothing is cut: the rest before")
    assert found.initial_state == "rest"


def test_sines_of_other_frequencies_are_no_repeats_and_multisines_of_other_phases_are():
    time = 1e-3 * np.arange(600)
    sines = [
        raw(f"sine_{number}", size * np.sin(2 * np.pi * frequency * time))
        for number, (size, frequency) in enumerate(
            ((1.5, 10.0), (2.5, 14.0), (2.3, 12.0))
        )
    ]
    assert held_out(*sines)[1].startswith("about a quarter of each kind")
    rng = np.random.default_rng(2)
    several = [
        raw(
            f"multi_{number}",
            sum(
                np.cos(2 * np.pi * (line / 0.6 * time + rng.uniform()))
                for line in range(1, 40)
            ),
        )
        for number in (1, 2, 3)
    ]
    assert held_out(*several) == (("multi_3",), "the last of the inputs that are alike")


def around(level, name, values):
    """A recording of a room that is so warm before anything happens."""
    found = raw(name, values)
    return RawRecording(name, values, found.output + level, 1e-3)


@pytest.mark.parametrize(
    ("other_level", "recipe"),
    [
        (21.01, ("cut",)),
        # A zero of its own in each recording.
        (17.0, ("cut", "output_offset")),
    ],
)
def test_a_level_at_which_all_rest_stays_in_all_of_them(other_level, recipe):
    step = after_a_rest(np.ones(600))
    found = propose(
        [
            around(21.0, "step_1", step),
            around(other_level, "step_2", -step),
            around(21.0, "noise_1", after_a_rest(levels(4, 600))),
        ]
    )
    assert found.recipes["step"] == recipe
    is_kept = "the level at which the output rests, 21 m, stays" in found.recipe_reason
    assert is_kept == (recipe == ("cut",))


def motor_under_speed_control(slope, seed):
    """A slow ramp of the speed after 60 ms, and a stop; noise hides where it begins."""
    rng = np.random.default_rng(seed)
    wanted = slope * np.clip(np.arange(2500) - 60, 0, 700)
    wanted[2000:] = 0.0
    current, speed, found = 0.0, 0.0, []
    for one in wanted:
        read = speed + 0.1 * rng.standard_normal()
        current = 0.3 * (one - read)
        speed += 0.15 * current - 0.002 * speed
        found.append((current, read))
    return np.array(found).T


@pytest.mark.parametrize(
    ("slope", "recipe"), [(0.03, ()), (0.1, ("cut", "output_offset"))]
)
def test_a_ramp_under_a_controller_is_not_cut_where_it_moves_already(slope, recipe):
    ramps = []
    for name, seed in (("ramp_a", 4), ("ramp_b", 5)):
        current, speed = motor_under_speed_control(slope, seed)
        ramps.append(RawRecording(name, current, speed, 1e-3))
    assert propose(ramps).recipes["step"] == recipe


def at_a_level(name, before, after, gain=1.4):
    """A heater that rests where its input holds it, and warms or cools from there."""
    u = np.r_[np.full(80, before), np.full(300, after)]
    y = np.full(u.size, 293.0 + gain * before)
    for k in range(1, u.size):
        y[k] = y[k - 1] + 0.03 * (293.0 + gain * u[k - 1] - y[k - 1])
    noise = 0.05 * np.random.default_rng(len(name)).standard_normal(u.size)
    return RawRecording(name, u, y + noise, 1.0)


def test_levels_that_go_with_the_input_stay_beside_recordings_that_begin_in_motion():
    steps = [at_a_level("step_cold", 0.0, 200.0), at_a_level("step_hot", 250.0, 60.0)]
    found = propose([*steps, raw("random_1", 100.0 * levels(3))])
    assert found.recipes["step"] == ("cut",)
    assert "goes with the input, and stays" in found.recipe_reason


def test_a_level_that_is_another_one_every_day_still_goes_with_the_input():
    # An oven at 50 % is warmer on one day than on another; at 45 % it is colder.
    runs = [
        at_a_level("step_up", 50.0, 70.0),
        at_a_level("step_down", 50.0, 30.0),
        at_a_level("step_large", 40.0, 75.0),
        at_a_level("noise_1", 50.0, 65.0),
    ]
    shifted = [
        replace(one, output=one.output + shift)
        for one, shift in zip(runs, (1.0, -1.0, 0.4, -0.9), strict=True)
    ]
    found = propose(shifted)
    assert not any("output_offset" in recipe for recipe in found.recipes.values())
    assert found.fit_start == (
        "steady",
        "all recordings begin with a rest, so 'steady': nothing is fitted to their starts",
    )


@pytest.mark.parametrize(
    ("other", "own"),
    [
        # A sine would lose the mean over a period instead.
        ("sine_1", set()),
        ("other_1", {"step", "other"}),
    ],
)
def test_the_zero_of_a_sensor_is_subtracted_from_all_kinds_or_from_none(other, own):
    step = after_a_rest(np.ones(600))
    bent = after_a_rest(np.linspace(0.0, 1.0, 600) ** 2)
    several = [raw("step_1", step), raw("step_2", -step), raw(other, bent)]
    zero = 0.03 * np.ptp(several[0].output)
    found = propose([replace(one, output=one.output + zero) for one in several])
    lose = {kind for kind, one in found.recipes.items() if "output_offset" in one}
    assert lose == own


def battery(name, charge, seed):
    """Pulses of a current after a rest, and a cell's voltage, which depends on its charge."""
    rng = np.random.default_rng(seed)
    current = np.r_[np.zeros(60), np.repeat(rng.uniform(-5.0, 8.0, 12), 40)]
    voltage = 3.2 + charge - 0.03 * current - 1e-5 * np.cumsum(current)
    return RawRecording(name, current, voltage + 1e-3 * rng.normal(size=540), 1.0)


@pytest.mark.parametrize(
    ("charges", "is_own"), [((0.2, 0.5, 0.7, 0.9), True), ((0.5,) * 4, False)]
)
def test_a_level_that_the_input_does_not_say_is_subtracted(charges, is_own):
    found = propose([battery(f"run_{n}", one, n) for n, one in enumerate(charges)])
    subtracts = {"output_offset" in recipe for recipe in found.recipes.values()}
    assert subtracts == {is_own}
    assert ("other levels under one input" in found.recipe_reason) is is_own


def test_levels_stay_where_some_rest_under_another_input():
    apart = [battery(f"run_{n}", one, n) for n, one in enumerate((0.2, 0.5, 0.7))]
    driven = battery("run_3", 0.5, 3)
    driven = replace(driven, input=driven.input + 4.0)
    found = propose([*apart, driven])
    assert not any("output_offset" in recipe for recipe in found.recipes.values())


def test_recipes_that_subtract_levels_already_say_so_themselves():
    steps = []
    for row, level in enumerate((0.0, 0.4, 0.9)):
        current = np.r_[np.zeros(100), np.full(400, 1.0 + row)]
        output = level + np.convolve(current, np.ones(20) / 20)[:500]
        steps.append(RawRecording(f"step_{row}", current, output, 1e-3))
    found = propose(steps)
    assert "output_offset" in found.recipes["step"]
    assert found.recipe_reason.startswith("tried: step")
