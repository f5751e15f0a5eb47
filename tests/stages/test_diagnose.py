"""Diagnoses end to end: each word of the verdict, on recordings that deserve it."""

from dataclasses import asdict, replace

import numpy as np
import pytest

from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.drive import BASE_PARAMETERS
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.diagnose import STAGE_VERSION, diagnosis_key, extended_options
from hwid_cli.tasks.cache import MemoryStore, task_key
from tests.diagnosis.small_drive import (
    DRIVE,
    NOISE,
    STEP_S,
    N,
    recordings,
    simulation,
)
from tests.stages.diagnosed_drive import (
    FRICTION,
    breathing,
    diagnosed,
    parameters,
    settings,
)
from tests.store.record_examples import assert_same

PAIR = {**FRICTION, "cubic_stiffness": {"stiffness_N_per_m3": 8e5}}
TWO = ("coulomb_friction", "cubic_stiffness", "input_dead_zone")


@pytest.fixture(scope="module")
def with_friction():
    return recordings(FRICTION)


@pytest.fixture(scope="module")
def friction_found(with_friction):
    return diagnosed(with_friction)


def test_nothing_is_missing_where_the_simulation_is_right():
    found = diagnosed(recordings())
    assert (found.verdict, found.complete, found.effects) == ("none", True, ())
    assert found.candidates == ()
    assert found.after.ratio_to_noise < 1.05


CIRCUIT = {"resistance_ohm": 2.0, "inductance_H": 6e-3}


def test_a_wrong_inductance_is_no_missing_one():
    read = recordings(drive=replace(DRIVE, **CIRCUIT))
    wrong = simulation(**{**CIRCUIT, "inductance_H": 5e-3})
    found = diagnosed(read, wrong, effects=("winding_inductance", "actuator_lag"))

    assert (found.verdict, found.complete, found.effects) == ("parameters", True, ())
    (winding,) = found.present
    assert winding.id == "winding_inductance"
    assert winding.parameters[0].value == pytest.approx(6e-3, rel=0.01)
    extended = extended_options(found, wrong)
    assert extended.inductance_H == winding.parameters[0].value
    assert extended.effects == {}


def test_an_inductance_that_is_known_stays():
    read = recordings(drive=replace(DRIVE, **CIRCUIT))
    known = simulation(**{**CIRCUIT, "inductance_H": 5e-3}, known={"inductance_H": 0.0})
    found = diagnosed(read, known, effects=("winding_inductance", "actuator_lag"))

    assert found.verdict == "named"
    assert [one.id for one in found.effects] == ["winding_inductance"]
    assert extended_options(found, known).inductance_H == 5e-3


def test_wrong_parameters_are_no_missing_effect():
    wrong = simulation(force_constant_N_per_A=5.3, damping_N_s_per_m=12.0)
    found = diagnosed(recordings(), wrong)

    assert (found.verdict, found.complete, found.effects) == ("parameters", True, ())
    after = {one.name: one.after for one in found.base}
    # A few times the 0.01 % that this noise leaves.
    assert after["force_constant_N_per_A"] == pytest.approx(5.0, rel=2e-3)
    assert after["damping_N_s_per_m"] == pytest.approx(15.0, rel=5e-3)
    assert found.before.ratio_to_noise > 10 > 1.05 > found.after.ratio_to_noise


def test_friction_is_named_with_its_force(friction_found):
    assert (friction_found.verdict, friction_found.complete) == ("named", True)
    (effect,) = friction_found.effects
    assert effect.id == "coulomb_friction"
    (force,) = effect.parameters
    # The interval is 0.4 % wide.
    assert force.value == pytest.approx(0.8, rel=0.01)
    assert force.low < force.value < force.high
    assert friction_found.explained_share > 0.99
    assert friction_found.ambiguous_with == ()


@pytest.mark.thorough
def test_wrong_parameters_do_not_hide_friction(with_friction):
    wrong = simulation(stiffness_N_per_m=1000.0, damping_N_s_per_m=20.0)
    found = diagnosed(with_friction, wrong)
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    assert parameters(found.effects[0])["force_N"] == pytest.approx(0.8, rel=0.01)


@pytest.mark.thorough
def test_one_of_two_effects_is_named_as_incomplete():
    hidden = {**PAIR, "coulomb_friction": {"force_N": 0.2}}
    found = diagnosed(recordings(hidden), effects=TWO)
    assert (found.verdict, found.complete) == ("named", False)
    assert found.effects[0].id in PAIR
    assert "remains" in found.summary


@pytest.mark.thorough
def test_half_of_a_large_gap_is_no_name():
    found = diagnosed(recordings(PAIR), effects=TWO)
    assert found.after.ratio_to_noise > 10
    assert found.verdict == "unknown"


@pytest.mark.thorough
def test_both_of_two_effects_are_named():
    found = diagnosed(recordings(PAIR), effects=TWO, max_effects=2)
    assert (found.verdict, found.complete) == ("named", True)
    named = {one.id: parameters(one) for one in found.effects}
    # The noise leaves 0.2 and 0.3 %.
    assert named["coulomb_friction"]["force_N"] == pytest.approx(0.8, rel=0.01)
    assert named["cubic_stiffness"]["stiffness_N_per_m3"] == pytest.approx(
        8e5, rel=0.015
    )


def slow_ramps(noise):
    """Ramps that are slow beside a lag of 2 ms."""
    rng = np.random.default_rng(3)
    lagging = replace(DRIVE, effects={"actuator_lag": {"time_constant_s": 0.002}})
    time = STEP_S * np.arange(N)
    found = []
    for number, (size, ramp) in enumerate(
        ((1.0, 0.03), (2.0, 0.05), (3.0, 0.03), (4.0, 0.05), (-2.0, 0.03), (-4.0, 0.05))
    ):
        current = size * np.interp(
            time, [0.04, 0.04 + ramp, 0.24, 0.24 + ramp], [0, 1, 1, 0]
        )
        motion = simulate_drive(current, lagging, sample_time_s=STEP_S)
        read = motion.output + noise * rng.standard_normal(N)
        found.append(Recording(f"step_{number}", current, read, STEP_S, kind="step"))
    return found


@pytest.mark.thorough
def test_slow_ramps_with_noise_cannot_tell_a_delay_from_a_lag():
    two = ("actuator_lag", "input_delay")
    found = diagnosed(slow_ramps(4e-4), effects=two)
    assert found.verdict == "ambiguous"
    assert {found.effects[0].id, *found.ambiguous_with} == set(two)
    assert f", or instead {found.ambiguous_with[0]}: with the first" in found.summary
    assert "cannot tell" in found.summary
    assert found.next_experiment.input

    clear = diagnosed(slow_ramps(NOISE), effects=two)
    assert (clear.verdict, clear.effects[0].id) == ("named", "actuator_lag")


@pytest.mark.thorough
def test_what_no_effect_explains_is_unknown():
    found = diagnosed(breathing(), effects=TWO, max_effects=2)
    assert (found.verdict, found.complete, found.effects) == ("unknown", False, ())
    assert found.before.ratio_to_noise > 10
    assert found.after == found.before
    assert found.places
    assert found.next_experiment.input


def test_the_extended_simulation_lacks_nothing(with_friction, friction_found):
    extended = extended_options(friction_found, simulation())
    assert extended.effects == {
        "coulomb_friction": parameters(friction_found.effects[0])
    }
    again = diagnosed(with_friction, extended)
    assert (again.verdict, again.effects) == ("none", ())
    assert [one.id for one in again.present] == ["coulomb_friction"]
    # From the very place where the first search stopped.
    assert again.after.held_out_rms == pytest.approx(
        friction_found.after.held_out_rms, rel=1e-3
    )


def test_a_refitted_base_is_extended_without_an_effect():
    found = diagnosed(recordings(), simulation(force_constant_N_per_A=5.3))
    extended = extended_options(found, simulation())
    assert extended.effects == {}
    assert diagnosed(recordings(), extended).verdict == "none"


@pytest.mark.thorough
def test_the_order_of_the_recordings_does_not_change_the_verdict(
    with_friction, friction_found
):
    turned = diagnosed(with_friction[::-1])
    assert turned.verdict == friction_found.verdict
    assert [one.id for one in turned.effects] == ["coulomb_friction"]
    # A search may stop a step sooner: within a tenth of the interval.
    force, again = (
        friction_found.effects[0].parameters[0],
        turned.effects[0].parameters[0],
    )
    assert again.value == pytest.approx(force.value, abs=0.1 * (force.high - force.low))
    assert set(turned.held_out) == set(friction_found.held_out)


@pytest.mark.slow
def test_several_processes_find_the_same(with_friction, friction_found):
    spread = diagnosed(with_friction, run=settings(jobs=2))
    assert_same(spread, friction_found)


@pytest.mark.thorough
def test_a_second_run_computes_no_candidate_again(with_friction, friction_found):
    store, seen = MemoryStore(), []
    run = settings(store, on_done=seen.append)
    first = diagnosed(with_friction, run=run)
    fitted = [one for one in seen if one.task.function.__name__ == "fit_candidate"]
    computed = {one.task.key for one in fitted if not one.from_cache}
    assert computed
    # A run may ask for one fit twice.
    assert {one.task.key for one in fitted} == computed

    seen.clear()
    second = diagnosed(with_friction, run=run)
    again = {one.task.function.__name__ for one in seen if one.from_cache}
    assert {"fit_candidate", "screen"} <= again
    assert {one.task.function.__name__ for one in seen} - again <= {"forecast"}
    assert_same(second, first)
    assert_same(second, friction_found)


def test_everything_that_matters_is_in_the_key(with_friction):
    def key(given=with_friction, model=None, **options):
        return diagnosis_key(given, model or simulation(), DiagnoseOptions(**options))

    moved = replace(with_friction[0], output=with_friction[0].output + 1e-9)
    led = replace(with_friction[0], reference=with_friction[0].output)
    keys = [
        key(),
        key([moved, *with_friction[1:]]),
        key([led, *with_friction[1:]]),
        key(with_friction[1:]),
        key(model=simulation(mass_kg=0.31)),
        key(model=simulation(effects=FRICTION)),
        key(max_effects=2),
        key(effects=("coulomb_friction",)),
        key(skip_samples=3),
        key([replace(with_friction[0], kind="other"), *with_friction[1:]]),
    ]
    assert len(set(keys)) == len(keys)
    assert key() == keys[0]


@pytest.mark.thorough
def test_chosen_recordings_are_held_out(with_friction):
    found = diagnosed(with_friction, hold_out=("step_0", "sine_2"))
    assert found.held_out == ("step_0", "sine_2")
    assert set(found.train) == {one.name for one in with_friction} - {
        "step_0",
        "sine_2",
    }


def test_only_effects_that_are_asked_for_are_tried(friction_found):
    tried = {
        public_id(one) for each in friction_found.candidates for one in each.effects
    }
    assert tried == {"coulomb_friction", "input_dead_zone", "output_backlash"}


@pytest.mark.thorough
def test_without_any_effect_allowed_a_gap_is_unknown(with_friction):
    assert diagnosed(with_friction, effects=()).verdict == "unknown"
    assert diagnosed(with_friction, max_effects=0).verdict == "unknown"


@pytest.mark.thorough
def test_the_stages_are_announced(with_friction):
    seen = []
    few = with_friction[::2]
    diagnosed(few, on_stage=lambda what, count: seen.append((what, count)))
    assert seen == [
        ("base", 0),
        ("forecasts", 4),
        ("single effects, screening", 3),
        ("single effects", 3),
        ("single effects, with the noise of the input", 2),
        # The best one, without it, and the other two.
        ("the command held", 4),
        ("verdict", 0),
        ("the other command", 1),
    ]


def test_a_simulation_that_runs_away_is_a_verdict_and_no_exception(with_friction):
    away = simulation(effects={"cubic_stiffness": {"stiffness_N_per_m3": -1e9}})
    found = diagnosed(with_friction, away)
    assert found.verdict == "unknown"


@pytest.mark.thorough
def test_with_a_wrong_law_in_the_catalogue_the_right_name_is_not_found(monkeypatch):
    given = recordings({"input_dead_zone": {"threshold_A": 0.25}})
    right = diagnosed(given)
    assert [one.id for one in right.effects] == ["input_dead_zone"]

    entry = CATALOGUE["input_dead_zone"]
    elsewhere = replace(entry.parameters[0], places=("SATURATION",), off=np.inf)
    wrong = replace(entry, parameters=(elsewhere,))
    monkeypatch.setitem(CATALOGUE, "input_dead_zone", wrong)
    mistaken = diagnosed(given, run=settings())
    assert "input_dead_zone" not in [one.id for one in mistaken.effects]
    assert not mistaken.complete


@pytest.mark.parametrize(
    ("effects", "names"),
    [
        (
            {"cogging": {"amplitude_N": 0.5, "period_m": 5e-3}},
            ["amplitude_N", "period_m", "phase_rad"],
        ),
        pytest.param(
            {"gear_backlash": {"half_gap_m": 1e-4, "stiffness_N_per_m": 5e4}},
            [
                "half_gap_m",
                "stiffness_N_per_m",
                "motor_share",
                "contact_damping_ratio",
            ],
            marks=pytest.mark.slow,
        ),
    ],
    ids=["cogging", "gear_backlash"],
)
def test_a_simulation_may_leave_out_what_completes_a_law(effects, names):
    found = diagnosed(recordings(effects)[::4], simulation(effects=effects))
    assert [one.id for one in found.present] == list(effects)
    assert list(parameters(found.present[0])) == names


@pytest.mark.thorough
def test_a_known_parameter_stays_where_data_would_move_it():
    # A spring that is 6 % too stiff, held to 2 %: its neighbours take the rest.
    wrong = simulation(stiffness_N_per_m=1255.0, known={"stiffness_N_per_m": 0.02})
    after = {one.name: one.after for one in diagnosed(recordings(), wrong).base}
    # At its bound, but for the rounding of a logarithm.
    assert after["stiffness_N_per_m"] == pytest.approx(1255.0 * 0.98, rel=1e-12)
    assert after["force_constant_N_per_A"] > 5.0 * 1.01


@pytest.mark.thorough
def test_a_known_force_constant_stays_and_the_mass_goes_with_it():
    wrong = simulation(
        force_constant_N_per_A=5.3, known={"force_constant_N_per_A": 0.02}
    )
    found = diagnosed(recordings(), wrong)
    after = {one.name: one.after for one in found.base}
    assert found.verdict == "parameters"
    assert after["force_constant_N_per_A"] == 5.3
    # Recordings tell the ratios to the mass of 0.3 kg beside 5 N/A.
    assert after["mass_kg"] == pytest.approx(0.3 * 1.06, rel=2e-3)
    assert after["stiffness_N_per_m"] == pytest.approx(1184.0 * 1.06, rel=2e-3)


@pytest.mark.thorough
def test_a_parameter_without_tolerance_is_exactly_what_was_given():
    held = dict.fromkeys(("force_constant_N_per_A", "damping_N_s_per_m"), 0.0)
    wrong = simulation(force_constant_N_per_A=5.3, known=held)
    found = diagnosed(recordings(FRICTION), wrong)
    after = {one.name: one.after for one in found.base}
    assert after["force_constant_N_per_A"] == 5.3
    assert after["damping_N_s_per_m"] == 15.0
    assert after["stiffness_N_per_m"] != 1184.0


@pytest.mark.thorough
def test_all_of_the_base_may_be_known():
    held = dict.fromkeys(BASE_PARAMETERS, 0.0)
    assert diagnosed(recordings(), simulation(known=held)).verdict == "none"
    found = diagnosed(recordings(FRICTION), simulation(known=held))
    assert parameters(found.effects[0])["force_N"] == pytest.approx(0.8, rel=0.01)


@pytest.mark.thorough
def test_under_a_measured_force_the_mass_is_found_and_friction_is_not_scaled():
    """Force constant 5 N/A times the current is the force; the mass is given 17 % low."""
    force = [
        replace(one, input=5.0 * one.input, input_unit="N")
        for one in recordings(FRICTION)
    ]
    given = simulation(mass_kg=0.25, force_constant_N_per_A=1.0)
    found = diagnosed(force, given)
    assert found.verdict == "named"
    assert parameters(found.effects[0])["force_N"] == pytest.approx(0.8, rel=0.01)
    after = {one.name: one.after for one in found.base}
    assert after["mass_kg"] == pytest.approx(0.3, rel=0.01)
    assert "force_constant_N_per_A" not in after
    assert extended_options(found, given).mass_kg == after["mass_kg"]
    assert not any("mass" in one for one in found.not_observable)


def test_keys_of_diagnoses_without_known_parameters_are_those_of_before():
    given, options = recordings(), DiagnoseOptions()
    model = asdict(simulation())
    assert model.pop("known") == {}
    about = [
        {"name": one.name, "kind": one.kind, "sample_time_s": one.sample_time_s}
        for one in given
    ]
    settings = {"recordings": about, "simulation": model, "options": options}
    arrays = [array for one in given for array in (one.input, one.output)]
    before = task_key("diagnose", STAGE_VERSION, settings, arrays)
    assert diagnosis_key(given, simulation(), options) == before
    held = simulation(known={"damping_N_s_per_m": 0.1})
    assert diagnosis_key(given, held, options) != before


def test_a_force_constant_that_is_far_off_is_questioned():
    found = diagnosed(recordings(), simulation(force_constant_N_per_A=20.0))
    (warning,) = found.warnings
    assert warning.startswith("force_constant_N_per_A was 20 and is fitted as 5:")
    assert diagnosed(recordings()).warnings == ()
