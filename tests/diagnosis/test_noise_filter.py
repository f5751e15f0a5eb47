"""What noise of the input hides on a free axis, and the filter that shows it."""

from dataclasses import replace

import numpy as np
import pytest
import scipy

from hwid_cli.diagnosis.diagnose import diagnose
from hwid_cli.diagnosis.innovations import answer
from hwid_cli.diagnosis.input_noise import LESS_NOISE, told_input_rms
from hwid_cli.diagnosis.noise_filter import FilteredTasks, with_noise_filter
from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.tasks import DiagnosisTask
from hwid_cli.diagnosis.whitening_filters import straight_drive
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording
from tests.diagnosis.small_drive import DRIVE, in_turn, problem, white

FREE = replace(DRIVE, stiffness_N_per_m=0.0)
STEP_S, N = 2e-3, 2000
STAGE = SimulationOptions(
    mass_kg=95.0,
    damping_N_s_per_m=225.0,
    stiffness_N_per_m=0.0,
    force_constant_N_per_A=33.5,
    hold="zero",
)


def floor(input_rms):
    return replace(white(), input_rms=input_rms)


@pytest.mark.parametrize(
    ("drive", "input_rms", "is_hidden"),
    [
        (FREE, 0.02, True),
        # A spring holds it, a quiet input does not move it, a held command has no noise.
        (DRIVE, 2e-4, False),
        (FREE, 1e-6, False),
        (FREE, 0.0, False),
    ],
)
def test_only_noise_that_adds_up_hides_anything(drive, input_rms, is_hidden):
    of = replace(problem(), drive=drive)
    found = with_noise_filter(of, drive, floor(input_rms))
    assert (found is not None) is is_hidden


def test_behind_the_filter_noise_of_both_is_white_and_as_large_as_that_of_the_output():
    of = replace(problem(), drive=FREE)
    noise = floor(0.02)
    found = with_noise_filter(of, FREE, noise)
    assert found.is_filtered
    assert with_noise_filter(found, FREE, noise) is None
    one = found.signals[0]
    rng = np.random.default_rng(3)
    # By sums: the axis has forgotten nothing but its velocity.
    n, step = 4000, one.sample_time_s
    u = noise.input_rms * rng.standard_normal(n)
    x = v = 0.0
    left = np.zeros(n)
    for k in range(n):
        left[k] = x + noise.rms * rng.standard_normal()
        following = u[min(k + 1, n - 1)]
        for j in range(20):
            force = FREE.force_constant_N_per_A * (
                u[k] + (j + 0.5) / 20 * (following - u[k])
            )
            v += step / 20 * (force - FREE.damping_N_s_per_m * v) / FREE.mass_kg
            x += step / 20 * v
    white_left = one.noise_filter(left).values
    assert np.sqrt(np.mean(left**2)) > 10 * noise.rms
    assert np.sqrt(np.mean(white_left**2)) == pytest.approx(noise.rms, rel=0.06)
    lagged = white_left[1:] @ white_left[:-1] / (white_left @ white_left)
    assert abs(lagged) < 4 / np.sqrt(n)


MAGNETS = {
    "cogging": {
        "amplitude_N": 30.0,
        "period_m": 0.02,
        "phase_rad": 0.4,
        "zero_at": "mean",
    }
}


def over_magnets(seed, input_rms, rms):
    """What noise of the input changes of a slow motion over magnets, by plain small steps.

    Between two magnets it is pushed back, on top of one away: twice a period the axis is
    now a stiff spring, now none.
    """
    rng = np.random.default_rng(seed)
    n, step, fine = 3000, 1e-3, 20
    drive = replace(FREE, mass_kg=2.0, damping_N_s_per_m=60.0, effects=MAGNETS)
    noise = input_rms * rng.standard_normal(n)
    command = 9.0 * np.sin(2 * np.pi * 0.7 * step * np.arange(n))
    ends = []
    for u in (command, command + noise):
        x = v = 0.0
        places = np.zeros(n)
        for k in range(n):
            places[k] = x
            following = u[min(k + 1, n - 1)]
            for j in range(fine):
                pushed = 5.0 * (u[k] + (j + 0.5) / fine * (following - u[k]))
                pushed += 30.0 * np.sin(2 * np.pi * x / 0.02 + 0.4) - 60.0 * v
                v += step / fine * pushed / 2.0
                x += step / fine * v
        ends.append(places)
    left = ends[1] - ends[0] + rms * rng.standard_normal(n)
    return drive, Signals("r", "", command, ends[0], command, ends[0], step), left


@pytest.mark.parametrize("seed", [1, 2])
def test_the_filter_follows_magnets_that_the_simulation_has(seed):
    noise = floor(0.1)
    drive, signals, left = over_magnets(seed, noise.input_rms, noise.rms)
    linked = {}
    for name, of in (("followed", drive), ("straight", replace(drive, effects={}))):
        found = with_noise_filter(
            replace(problem(), signals=(signals,), drive=of), of, noise
        )
        free = found.signals[0].noise_filter(left).values
        linked[name] = abs(free[1:] @ free[:-1]) / (free @ free)
        if of is drive:
            assert np.std(free) == pytest.approx(noise.rms, rel=0.04)

    assert np.std(left) > 4 * noise.rms
    assert linked["followed"] < 2 / np.sqrt(left.size) < 0.1 < linked["straight"]


def test_a_filter_along_a_motion_sees_what_is_not_evaluated():
    noise = floor(0.1)
    drive, signals, left = over_magnets(1, noise.input_rms, noise.rms)
    part = replace(signals, skip=1400, compared=signals.compared + left)
    of = replace(problem(), signals=(part,), drive=drive)
    free = with_noise_filter(of, drive, noise).signals[0].left(signals.output)

    assert free.size == left.size - 1400
    assert np.std(free) == pytest.approx(noise.rms, rel=0.06)
    assert abs(free[1:] @ free[:-1]) < 2.5 * np.sqrt(free.size) * noise.rms**2


def test_a_filter_along_a_motion_leaves_other_motions_to_its_mean():
    noise = floor(0.1)
    drive, signals, left = over_magnets(1, noise.input_rms, noise.rms)
    of = replace(problem(), signals=(signals,), drive=drive)
    found = with_noise_filter(of, drive, noise).signals[0].noise_filter
    shorter = found.elsewhere(left[:700]).values

    assert shorter.size == 700
    assert np.isfinite(shorter).all()
    assert found.numbers.size > left.size


@pytest.fixture(scope="module")
def drifted():
    """Signals of a free axis whose simulation is off by what noise has added up to."""
    rng = np.random.default_rng(4)
    n, step = 6000, 1e-3
    v = 1e-4 * np.convolve(rng.standard_normal(n), 0.998 ** np.arange(n))[:n]
    left = np.cumsum(v) * step + 1e-6 * rng.standard_normal(n)
    drive = replace(FREE, damping_N_s_per_m=FREE.mass_kg * 2.0, hold="zero")
    push = 1e-4 * FREE.mass_kg / step / FREE.force_constant_N_per_A
    one = straight_drive(drive, step)
    nothing = np.zeros(n)
    signals = Signals("r", "", nothing, left, nothing, left, step)
    found = one.whitening((push / 1e-6) ** 2)
    return replace(signals, noise_filter=found)


BLOCKS = np.arange(6000) // 600 % 2 == 0
DAMAGED = np.arange(6000) % 97 != 5


@pytest.mark.parametrize(
    "part",
    [
        {},
        {"skip": 3000},
        {"used": BLOCKS},
        {"used": DAMAGED},
    ],
)
def test_what_is_not_evaluated_is_still_seen_by_the_filter(drifted, part):
    signals = replace(drifted, **part)
    if part.get("used") is DAMAGED:
        compared = signals.compared.copy()
        compared[~DAMAGED] += 1.0
        signals = replace(signals, compared=compared)
    left = signals.left(np.zeros(6000))
    assert left.size == signals.n_evaluated
    assert np.sqrt(np.mean(left**2)) == pytest.approx(1e-6, rel=0.1)
    assert np.abs(left).max() < 6e-6


def test_many_states_near_one_another_keep_their_digits():
    effects = {
        "second_mode": {"mass_kg": 0.1, "frequency_Hz": 30.0, "damping_ratio": 0.02},
        "actuator_lag": {"time_constant_s": 0.002, "damping_ratio": 0.7},
    }
    one = straight_drive(replace(FREE, effects=effects), 2e-5)
    found = one.whitening(1e8)
    residual = np.random.default_rng(6).standard_normal(20_000)
    state, expected = np.zeros(one.b.size), np.zeros(residual.size)
    for n, value in enumerate(residual):
        expected[n] = value - found.reading @ state
        state = found.change @ state + found.gain * value
    assert found(residual).values * np.sqrt(found.variance) == pytest.approx(expected)
    assert np.abs(np.linalg.eigvals(found.change)).max() < 1.0


@pytest.mark.parametrize(("is_noisy", "is_told"), [(True, True), (False, False)])
def test_residuals_tell_whether_the_roughness_of_an_input_is_noise(is_noisy, is_told):
    of, noise = replace(problem(), drive=FREE), floor(0.02)
    rng = np.random.default_rng(5)
    one = straight_drive(FREE, of.signals[0].sample_time_s)
    parts = []
    for signals in of.signals:
        n = signals.n_evaluated
        u = 0.02 * is_noisy * rng.standard_normal(n)
        moved = answer(one.a, one.b, one.c[0].copy(), one.through, u)
        parts.append(moved + noise.rms * rng.standard_normal(n))
    told = told_input_rms(parts, of, [FREE] * len(parts), noise)
    assert (told >= LESS_NOISE * noise.input_rms) is is_told


def test_tasks_behind_the_filter_are_no_others():
    asked = []

    def run(tasks, *, keep):
        asked.extend((one.content, len(one.arrays)) for one in tasks)
        return [1] * len(tasks)

    of = replace(problem(), drive=FREE)
    behind = FilteredTasks(run, with_noise_filter(of, FREE, floor(0.02)))
    task = DiagnosisTask("t", len, (), int, {"effects": ()})
    assert behind([task], keep=True) == [1]
    assert asked == [({"effects": (), "filter": "noise"}, 1)]


def moved(wanted, seed, magnets_N=(10.0, 3.5), friction_N=0.0):
    """A stage over two rows of magnets, under a position controller, in 20 steps a sample.

    The logger reads the current with noise and the scale in steps of 1 um.
    """
    rng = np.random.default_rng(seed)
    x = v = total = 0.0
    current, place = np.zeros(N), np.zeros(N)
    for k in range(N):
        error = 12.0 * (wanted[k] - x) - v
        total = np.clip(total + 6.0 * STEP_S * error, -0.05, 0.05)
        current[k], place[k] = 108.0 * (error + total), x
        for _ in range(20):
            other = magnets_N[0] * np.sin(2 * np.pi * x / 0.032 + 0.7)
            other += magnets_N[1] * np.sin(2 * np.pi * x / 0.0135 - 0.4)
            other -= friction_N * np.tanh(v / 4e-4)
            v += STEP_S / 20 * (35.0 * current[k] - 200.0 * v + other) / 95.0
            x += STEP_S / 20 * v
    noisy = current + 0.01 * rng.standard_normal(N)
    steps = np.round((place + 3e-7 * rng.standard_normal(N)) * 1e6) / 1e6
    return Recording(
        f"move_{seed}", noisy, steps, STEP_S, input_unit="A", output_unit="m"
    )


@pytest.mark.slow
def test_two_rows_of_magnets_are_told_far_below_what_noise_of_the_current_adds_up_to():
    t = STEP_S * np.arange(N)
    smooth = 0.5 - 0.5 * np.cos(np.pi * np.clip((t - 0.2) / 1.2, 0, 1))
    back = 0.5 - 0.5 * np.cos(np.pi * np.clip((t - 2.2) / 1.2, 0, 1))
    wanted = [
        0.12 * (smooth - back),
        0.07 * smooth + 0.05 * back,
        0.08 * np.sin(2 * np.pi * 0.5 * np.maximum(t - 0.2, 0)),
        0.1 * smooth - 0.14 * back,
    ]
    found = diagnose(
        [moved(one, seed) for seed, one in enumerate(wanted)],
        STAGE,
        DiagnoseOptions(effects=("cogging", "coulomb_friction", "input_delay")),
        in_turn,
        lambda *_: None,
    )
    assert [one.id for one in found.effects] == ["cogging", "cogging"]
    values = [{p.name: p.value for p in one.parameters} for one in found.effects]
    assert values[0]["amplitude_N"] == pytest.approx(10.0, rel=0.02)
    assert values[0]["period_m"] == pytest.approx(0.032, rel=2e-3)
    assert values[1]["amplitude_N"] == pytest.approx(3.5, rel=0.05)
    assert values[1]["period_m"] == pytest.approx(0.0135, rel=2e-3)
    assert found.after.ratio_to_noise < 2.0 < 20.0 < found.before.ratio_to_noise
    assert "a filter takes that out of all errors" in found.noise.sentence
    (said,) = (one for one in found.warnings if "behind a filter" in one)
    # Whole recordings differ by what the noise has added up to.
    assert "at last" in said


@pytest.mark.slow
def test_a_clean_axis_with_friction_lacks_nothing_where_noise_decides_when_it_lets_go():
    t = STEP_S * np.arange(N)
    wanted = [
        0.12 * np.sin(2 * np.pi * 0.5 * np.maximum(t - 0.2, 0)),
        0.04 - 0.04 * np.cos(np.pi * np.clip((t - 0.3) / 1.2, 0, 1)),
        0.08 * scipy.signal.sawtooth(2 * np.pi * 0.25 * t, 0.5) + 0.08,
        0.06 * np.sin(2 * np.pi * 0.8 * np.maximum(t - 0.4, 0)),
    ]
    found = diagnose(
        [moved(one, seed, (0.0, 0.0), 20.0) for seed, one in enumerate(wanted)],
        replace(STAGE, effects={"coulomb_friction": {"force_N": 22.0}}),
        DiagnoseOptions(effects=("position_friction", "quadratic_drag")),
        in_turn,
        lambda *_: None,
    )
    assert found.verdict == "parameters"
    assert {one.name: one.after for one in found.base} == pytest.approx(
        {
            "damping_N_s_per_m": 200.0,
            "stiffness_N_per_m": 0.0,
            "force_constant_N_per_A": 35.0,
        },
        rel=2e-3,
    )
