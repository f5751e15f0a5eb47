"""The whole way of a diagnosis, with a runner that keeps nothing."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.diagnose import allowed_effects, diagnose
from hwid_cli.diagnosis.held_out import held_out_names
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.records.drive import Controller, StandIn
from hwid_cli.records.experiment import DiagnoseOptions
from tests.diagnosis.small_drive import DRIVE, in_turn, problem, recordings, simulation
from tests.stages.diagnosed_drive import FEW, FRICTION, diagnosed
from tests.store.record_examples import assert_same


@pytest.mark.thorough
def test_any_runner_gives_what_the_stage_gives():
    given = recordings(FRICTION)
    options = DiagnoseOptions(effects=FEW, max_effects=1)
    found = diagnose(given, simulation(), options, in_turn, lambda what, count: None)
    assert [one.id for one in found.effects] == ["coulomb_friction"]
    assert_same(found, diagnosed(given))


@pytest.mark.thorough
def test_fits_and_screenings_are_to_be_kept_and_forecasts_are_not():
    seen = []

    def run(tasks, *, keep):
        seen.append((keep, {one.result_type.__name__ for one in tasks}))
        return in_turn(tasks, keep=keep)

    options = DiagnoseOptions(effects=FEW, max_effects=1)
    diagnose(recordings(FRICTION), simulation(), options, run, lambda what, count: None)
    assert (False, {"Forecast"}) in seen
    kept = ({"Screened"}, {"CandidateFit"})
    assert all((True, one) in seen for one in kept)
    assert {keep for keep, names in seen if names not in kept} == {False}


@pytest.mark.thorough
def test_tasks_that_are_kept_differ_in_their_content():
    """Else one would come back from the cache for another; one may be asked for twice."""
    found = {}

    def run(tasks, *, keep):
        results = in_turn(tasks, keep=keep)
        for task, result in zip(tasks, results, strict=True):
            if keep:
                found.setdefault(str(task.content), []).append(
                    np.ravel(result.sse).tolist()
                )
        return results

    options = DiagnoseOptions(effects=FEW, max_effects=1)
    diagnose(recordings(FRICTION), simulation(), options, run, lambda what, count: None)
    assert len(found) >= len(FEW)
    assert all(one == several[0] for several in found.values() for one in several)


OF_CIRCUIT = {name for name, one in CATALOGUE.items() if one.needs_circuit}
OF_FREE_AXIS = {name for name, one in CATALOGUE.items() if one.needs_free_axis}
OF_STAND_IN = {name for name, one in CATALOGUE.items() if one.needs_stand_in}


@pytest.mark.parametrize(
    ("changes", "lost"),
    [
        (
            {"effects": {"coulomb_friction": {"force_N": 0.1}}},
            {"coulomb_friction", *OF_FREE_AXIS},
        ),
        (
            {"stiffness_N_per_m": 0.0},
            {name for name, one in CATALOGUE.items() if one.needs_spring},
        ),
        (
            {"controller": Controller(20.0, 30.0)},
            {name for name, one in CATALOGUE.items() if one.enters == "output"}
            | OF_FREE_AXIS,
        ),
    ],
)
def test_what_makes_no_sense_for_a_drive_is_not_tried(changes, lost):
    of = problem(recordings(), **changes)
    allowed = set(allowed_effects(of, DiagnoseOptions()))
    assert lost
    lost = lost | OF_CIRCUIT | OF_STAND_IN
    assert allowed == {name for name in CATALOGUE if name not in lost}


def test_a_drive_that_stands_for_a_simulation_may_start_settled():
    given = problem(recordings())
    drive = StandIn(0.3, 15.0, 1184.0, 5.0)
    allowed = set(allowed_effects(replace(given, drive=drive), DiagnoseOptions()))
    assert {"gravity:settled"} == OF_STAND_IN
    assert allowed >= OF_STAND_IN


def test_a_circuit_may_have_an_inductance():
    of = problem(recordings(), resistance_ohm=2.0)
    allowed = allowed_effects(of, DiagnoseOptions())
    assert set(CATALOGUE) - set(allowed) == OF_FREE_AXIS | OF_STAND_IN
    assert list(OF_CIRCUIT) == ["winding_inductance"]


def test_a_second_one_is_tried_until_the_simulation_has_two():
    stop = {"position_m": 0.01, "stiffness_N_per_m": 1e4}
    one = problem(recordings(), effects={"one_sided_stop": stop})
    both = {"one_sided_stop": stop, "one_sided_stop:second": stop}
    two = problem(recordings(), effects=both)
    stops = [
        {name for name in allowed_effects(of, DiagnoseOptions()) if "one_sided" in name}
        for of in (one, two)
    ]
    seconds = {name for name in CATALOGUE if name.startswith("one_sided_stop:second")}
    assert stops == [seconds, set()]
    assert len(seconds) == 3


def test_two_recordings_show_no_change_between_recordings():
    few = allowed_effects(problem(recordings()[:2]), DiagnoseOptions())
    assert not any(CATALOGUE[one].parameters[0].is_own for one in few)


@pytest.mark.thorough
@pytest.mark.parametrize("is_asked_for", [False, True])
def test_a_payload_in_one_recording_is_found_wherever_the_plan_has_put_it(is_asked_for):
    names = [one.name for one in recordings()]
    held_out = held_out_names(recordings())
    loaded = names.index(held_out[-1])

    def own(number, drive):
        return replace(drive, mass_kg=0.4) if number == loaded else drive

    options = DiagnoseOptions(
        effects=("parameter_change", "coulomb_friction"),
        hold_out=held_out if is_asked_for else "auto",
    )
    given = recordings(own=own)
    found = diagnose(given, simulation(), options, in_turn, lambda what, count: None)
    if is_asked_for:
        # Who says what is held out has it so.
        assert found.held_out == held_out
        return
    assert [one.id for one in found.effects] == ["parameter_change"]
    assert names[loaded] in found.train
    assert found.held_out
    which, _ = found.effects[0].parameters
    assert which.text == "mass"


@pytest.mark.thorough
def test_intervals_of_the_base_hold_on_fresh_noise():
    options, inside = DiagnoseOptions(effects=("coulomb_friction",)), []
    for seed in range(8):
        given = recordings(seed=seed)
        found = diagnose(given, simulation(), options, in_turn, lambda what, n: None)
        assert found.verdict == "none"
        inside += [one.low < getattr(DRIVE, one.name) < one.high for one in found.base]
    assert 20 <= sum(inside) <= len(inside) == 24


def test_where_nothing_is_missing_no_recording_is_odd(monkeypatch):
    def odd(*_):
        raise AssertionError("noise is no gap")

    monkeypatch.setattr("hwid_cli.diagnosis.diagnose.with_odd_ones_trained", odd)
    options = DiagnoseOptions(effects=("coulomb_friction",))
    found = diagnose(recordings(), simulation(), options, in_turn, lambda what, n: None)
    assert found.verdict == "none"


def test_a_hum_has_a_phase_in_each_of_two_recordings_and_parameters_do_not_differ():
    few = allowed_effects(problem(recordings()[:2]), DiagnoseOptions())
    assert {"sensor_hum", "periodic_force"} <= set(few)
    assert not any(one.startswith("parameter_change") for one in few)
