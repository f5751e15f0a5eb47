"""Recordings whose input was logged later than it acted."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.candidate import SearchStart, base_of, fit_candidate
from hwid_cli.diagnosis.diagnose import diagnose
from hwid_cli.diagnosis.through_pieces import fit_through_pieces
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.recordings import Recording
from tests.diagnosis.small_drive import (
    NOISE,
    in_turn,
    problem,
    recordings,
    simulation,
    sizes,
    white,
)
from tests.stages.diagnosed_drive import FRICTION

FEW = ("coulomb_friction", "actuator_lag", "input_delay", "second_mode")
SAID = "later in the recordings than it acted"


def found(given, of=None):
    options = DiagnoseOptions(effects=FEW, max_effects=1)
    return diagnose(given, of or simulation(), options, in_turn, lambda what, n: None)


def logged_late(given, samples):
    """The same recordings with the input of the samples before."""
    return [
        replace(one, input=np.r_[np.full(samples, one.input[0]), one.input[:-samples]])
        for one in given
    ]


@pytest.mark.thorough
@pytest.mark.parametrize(("samples", "count"), [(1, "one sample"), (2, "two samples")])
def test_an_input_that_was_logged_late_is_no_effect(samples, count):
    diagnosis = found(
        logged_late(recordings(), samples), simulation(stiffness_N_per_m=1000.0)
    )

    assert diagnosis.verdict == "parameters"
    assert f"the input stands {count} {SAID}" in diagnosis.summary
    after = {one.name: one.after for one in diagnosis.base}
    assert after["stiffness_N_per_m"] == pytest.approx(1184.0, rel=2e-3)
    assert after["damping_N_s_per_m"] == pytest.approx(15.0, rel=1e-2)
    assert diagnosis.after.held_out_rms == pytest.approx(NOISE, rel=0.05)


@pytest.mark.thorough
def test_an_input_that_was_logged_early_is_a_delay():
    early = [
        replace(one, input=np.r_[one.input[2:], one.input[-1:], one.input[-1:]])
        for one in recordings()
    ]
    diagnosis = found(early)

    assert diagnosis.verdict == "named"
    assert [one.id for one in diagnosis.effects] == ["input_delay"]


@pytest.mark.thorough
def test_a_late_input_hides_no_friction():
    diagnosis = found(recordings(FRICTION))

    assert [one.id for one in diagnosis.effects] == ["coulomb_friction"]
    assert SAID not in diagnosis.summary


def axis_in_a_loop(seed, moves, *, ripple=0.0, step=2e-3, n=1500, parts=40):
    """A free axis with friction under a position loop, in small explicit steps.

    With a ripple each 5 mm, [N]; its current as it acted.
    """
    goal = np.interp(np.arange(n) * step, *moves)
    x = v = 0.0
    current, position = np.zeros(n), np.zeros(n)
    for k in range(n):
        position[k] = x
        current[k] = np.clip(13.0 * (14.0 * (goal[k] - x) - v), -16, 16)
        for _ in range(parts):
            force = 38.0 * current[k] - 85.0 * v
            force += ripple * np.sin(2 * np.pi * x / 5e-3 + 0.6)
            if v == 0 and abs(force) <= 17.0:
                continue
            way = np.sign(v if v else force)
            moved = v + step / parts * (force - 17.0 * way) / 12.5
            v = 0.0 if v and moved * v < 0 else moved
            x += step / parts * v
    read = position + 3e-4 * np.random.default_rng(seed).standard_normal(n)
    return Recording(f"r{seed}", current, read, step)


@pytest.mark.thorough
def test_it_is_told_beside_friction_in_a_loop_too():
    """Played back, each minimum of the squares is near the next one."""
    given = [
        axis_in_a_loop(1, ([0.1, 0.5, 1.2, 1.7], [0, 0.25, 0.25, 0.05])),
        axis_in_a_loop(2, ([0.1, 1.0, 2.0, 2.9], [0, 0.1, -0.1, 0.2])),
        axis_in_a_loop(3, ([0.1, 0.4, 0.9, 1.3, 2.0, 2.4], [0, 0.1, 0.1, 0, 0, 0.3])),
        axis_in_a_loop(4, ([0.1, 2.5, 2.9], [0, 0.3, 0.2])),
    ]
    of = simulation(
        mass_kg=12.5,
        damping_N_s_per_m=110.0,
        stiffness_N_per_m=0.0,
        force_constant_N_per_A=34.0,
        hold="zero",
        effects={"coulomb_friction": {"force_N": 22.0}},
    )
    diagnosis = found(logged_late(given, 1), of)
    after = {one.name: one.after for one in diagnosis.base}

    assert diagnosis.verdict == "parameters"
    assert SAID in diagnosis.summary
    assert after["force_constant_N_per_A"] == pytest.approx(38.0, rel=5e-3)


@pytest.mark.thorough
def test_pieces_lead_out_of_a_minimum_that_friction_makes():
    rng = np.random.default_rng(0)
    times = [0.1, 0.5, 0.9, 1.3, 1.7, 2.1, 2.5, 2.9]
    walks = [np.r_[0, np.cumsum(rng.uniform(-0.15, 0.15, 7))] for _ in range(8)][4:]
    of = problem(
        [axis_in_a_loop(k, (times, one), ripple=0.8) for k, one in enumerate(walks)],
        mass_kg=12.5,
        damping_N_s_per_m=70.0,
        stiffness_N_per_m=0.0,
        force_constant_N_per_A=42.0,
        hold="zero",
        effects={
            "coulomb_friction": {"force_N": 13.0},
            "cogging": {"amplitude_N": 0.48, "period_m": 5e-3, "phase_rad": 0.6},
        },
    )
    start = SearchStart(base_of(of.drive), drive_effects(of.drive))
    found = fit_candidate(of, (), [start], sizes(of), white(3e-4))
    better = fit_through_pieces(of, found, sizes(of), white(3e-4))

    assert found.whiteness > 1.0
    assert better.sse.sum() < 0.1 * found.sse.sum()


@pytest.mark.thorough
def test_a_third_of_the_noise_is_searched_for_single_effects_only():
    """A sensor that warms up: sets of effects are not worth their time."""
    warming = [
        replace(one, output=one.output + 0.5 * NOISE * np.exp(-np.arange(400) / 150))
        for one in recordings()
    ]
    seen = []
    options = DiagnoseOptions(effects=FEW, max_effects=3)
    diagnosis = diagnose(
        warming, simulation(), options, in_turn, lambda what, n: seen.append(what)
    )
    assert diagnosis.verdict == "none"
    assert any("single effects" in one for one in seen)
    assert not any("sets of 2" in one for one in seen)
