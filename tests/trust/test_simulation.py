"""The band of a diagnosed simulation, on a machine that is not the program's drive."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli import SimulationOptions, diagnose
from hwid_cli.diagnosis.parameters import (
    START,
    ParameterLayout,
    ParameterPoint,
    Unknown,
)
from hwid_cli.diagnosis.problem import drive_of, prepare
from hwid_cli.diagnosis.simulation_trust import _as_unseen
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.export.contents import export_simulation
from hwid_cli.export.json_reader import read_exported
from hwid_cli.export.json_writer import write_json
from hwid_cli.export.predict import predict, predict_band
from hwid_cli.records.drive import Drive
from hwid_cli.records.experiment import (
    Columns,
    DiagnoseOptions,
    RecordingsOptions,
)
from hwid_cli.stages.diagnose import extended_options
from hwid_cli.trust.simulation import moved, simulation_band
from tests.trust.friction_machine import MASS, SAMPLE_TIME_S, motion, recording

GIVEN = SimulationOptions(
    mass_kg=MASS,
    damping_N_s_per_m=15.0,
    stiffness_N_per_m=1150.0,
    force_constant_N_per_A=5.3,
)


def diagnosed(effects, **machine):
    recordings = [recording("steps", seed, **machine) for seed in range(9)]
    found = diagnose(recordings, GIVEN, DiagnoseOptions(effects=effects, max_effects=1))
    extended = extended_options(found, GIVEN)
    signals = prepare(recordings, extended, DiagnoseOptions(), ()).signals
    return found, drive_of(extended, signals), recordings


@pytest.fixture(scope="module")
def right():
    return diagnosed(("coulomb_friction",))


@pytest.fixture(scope="module")
def wrong():
    return diagnosed(("input_delay",))


def on_unused(found, drive, kind, count=10):
    """Coverage and width on recordings that nothing has used."""
    rows = []
    for seed in range(100, 100 + count):
        new = recording(kind, seed)
        band = simulation_band(
            drive, found.trust, new.input, sample_time_s=SAMPLE_TIME_S
        )
        is_held = (new.output >= band.lower) & (new.output <= band.upper)
        rows.append((is_held.mean(), np.mean(band.upper - band.lower)))
    return np.mean(rows, axis=0)


def test_the_machine_of_these_tests_answers_as_its_equations_say():
    # Rest under a constant current, within what friction may hold; no friction: exact.
    current = np.full(600, 2.0)

    assert motion(current, friction=0.0)[-2] == pytest.approx(
        2 * 5.0 / 1200.0, rel=1e-4
    )
    assert motion(0.01 * current, friction=0.8)[-2] == 0.0


@pytest.mark.thorough
@pytest.mark.parametrize("kind", ["steps", "multisine"])
def test_the_band_of_a_complete_diagnosis_holds_what_it_promises(right, kind):
    found, drive, _ = right

    coverage, width = on_unused(found, drive, kind)

    assert [one.id for one in found.effects] == ["coulomb_friction"]
    # Ten recordings of 600 samples, aimed at 0.90 and not narrower than needed.
    assert 0.85 <= coverage <= 0.96
    assert width < 8 * 2e-5


@pytest.mark.thorough
@pytest.mark.parametrize("kind", ["steps", "multisine"])
def test_a_simulation_of_the_wrong_structure_has_a_wide_band(right, wrong, kind):
    (found, drive, _), (other, without, _) = right, wrong

    narrow = on_unused(found, drive, kind)[1]
    coverage, width = on_unused(other, without, kind)

    assert other.effects == ()
    assert coverage > 0.85
    assert width > 10 * narrow


@pytest.mark.thorough
def test_bands_of_held_out_recordings_are_told_by_the_others(right):
    found, _, _ = right

    rows = found.bands.rows

    assert tuple(one.recording for one in rows) == found.held_out
    assert all(0.7 < one.coverage <= 1.0 for one in rows)
    worst = min(rows, key=lambda one: one.coverage)
    assert found.bands.shown.recording == worst.recording


@pytest.mark.thorough
def test_steps_are_the_intervals_of_the_effects(right):
    found, _, _ = right
    trust = found.trust

    (force,) = found.effects[0].parameters
    column = trust.parameters.index("coulomb_friction.force_N")

    # The same number another way: steps of a logarithm are straight to its square.
    deviation = float(np.sqrt(np.sum(trust.steps[:, column] ** 2)))
    assert deviation == pytest.approx((force.high - force.low) / 3.92, rel=0.02)


def test_the_part_of_the_parameters_is_what_two_simulations_differ_by():
    drive = Drive(
        mass_kg=0.3,
        damping_N_s_per_m=15.0,
        stiffness_N_per_m=1000.0,
        force_constant_N_per_A=5.0,
        effects={"coulomb_friction": {"force_N": 0.5}},
    )
    names = ("base.stiffness_N_per_m", "coulomb_friction.force_N")

    other = moved(drive, names, np.array([10.0, 0.1]))

    assert other.stiffness_N_per_m == 1010.0
    assert other.effects["coulomb_friction"]["force_N"] == pytest.approx(0.6)
    assert drive.effects["coulomb_friction"]["force_N"] == 0.5
    with pytest.raises(ValueError, match=r"no parameter 'gravity\.torque_N_m'"):
        moved(drive, ("gravity.torque_N_m",), np.zeros(1))


@pytest.mark.thorough
def test_an_exported_simulation_predicts_with_the_same_band(right, tmp_path):
    found, drive, recordings = right
    path = tmp_path / "simulation.json"
    options = RecordingsOptions(
        files=("raw/*.csv",), columns=Columns("current_A", "displacement_m", "time_s")
    )
    exported = export_simulation(
        extended_options(found, GIVEN),
        recordings,
        options,
        DiagnoseOptions(),
        origin={},
    )
    write_json(path, replace(exported, trust=found.trust))

    new = recording("multisine", 55)
    back = read_exported(path)
    band = predict_band(back, new.input)

    expected = simulation_band(
        drive, found.trust, new.input, sample_time_s=SAMPLE_TIME_S
    )
    assert np.array_equal(band.output, predict(back, new.input))
    assert np.array_equal(band.lower, expected.lower)
    plain = simulate_drive(new.input, drive, sample_time_s=SAMPLE_TIME_S).output
    assert np.array_equal(band.output, plain)


@pytest.mark.parametrize(("start", "place"), [("rest", 0.6), ("estimated", 0.75)])
def test_a_held_out_axis_begins_where_it_is_read_to_rest(start, place):
    # A fitted place would take a part of a later drift off.
    far = float("inf")
    layout = ParameterLayout(
        (), (Unknown(START, "position", False, 2.0, -far, far),), ()
    )
    signals = [
        SimpleNamespace(is_held_out=is_held, rest_position_m=0.6)
        for is_held in (False, True)
    ]
    own = np.array([[layout.own[0].coordinate(0.75)]] * 2)
    seen = _as_unseen(
        SimpleNamespace(signals=signals, start=start),
        layout,
        ParameterPoint(np.zeros(0), own),
    )
    places = [layout.own[0].value(one) for (one,) in seen.own]
    assert places == pytest.approx([0.75, place])
