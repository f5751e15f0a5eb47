"""Units that contradict a simulation, that nobody says, and that sizes give away."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import (
    Columns,
    DiagnoseOptions,
    Experiment,
    RecordingsOptions,
    SimulationOptions,
)
from hwid_cli.records.recordings import CalibrationLog, SignalUnit
from hwid_cli.stages.diagnose import diagnose, given_by
from hwid_cli.stages.simulation_units import (
    assumed_units,
    doubtful_sizes,
    in_simulation_units,
    overruled_units,
    refused_sizes,
    refused_units,
)
from tests.diagnosis.small_drive import recordings, simulation

DRIVE = simulation()
REST = DiagnoseOptions()


def experiment(model=DRIVE, **options):
    given = RecordingsOptions(("*.csv",), Columns("u", "y"), **options)
    return Experiment("a", "a.yaml", recordings=given, simulation=model)


def refused(model=DRIVE, *, said_by="the name 'y [x]'", options=None, **units):
    (side,) = [key.removesuffix("_unit") for key in units]
    one = replace(recordings()[0], **units)
    unit = SignalUnit(side, units[f"{side}_unit"], said_by, units[f"{side}_unit"])
    log = CalibrationLog(one.name, (), 0, 1, 1, 1, units=(unit,))
    return refused_units(experiment(model, **(options or {})), [one], [log])


@pytest.mark.parametrize("unit", ["A", "mm", "inc", "s", "m/s", "deg"])
def test_an_output_of_another_unit_is_refused(unit):
    (line,) = refused(output_unit=unit)
    assert line.startswith(
        f"a.yaml: recordings.columns.output: the name 'y [x]' says {unit!r} (recording "
        "step_0); expected 'm', the unit of the simulation"
    )
    assert "\n" not in line


@pytest.mark.parametrize("unit", ["m", "mV", "mA", "%", "kN", "rpm"])
def test_an_input_of_another_unit_is_refused(unit):
    (line,) = refused(input_unit=unit)
    assert "expected 'A', the unit of the simulation" in line


@pytest.mark.parametrize(
    ("side", "unit"), [("input", "V"), ("input", "N"), ("output", "rad")]
)
def test_si_units_of_the_same_equations_are_taken(side, unit):
    assert refused(**{f"{side}_unit": unit}) == ()


def test_a_circuit_takes_a_voltage_only():
    circuit = simulation(resistance_ohm=2.0)
    assert refused(circuit, input_unit="V") == ()
    (line,) = refused(circuit, input_unit="A")
    assert "expected 'V' over resistance_ohm" in line
    assert refused(circuit, input_unit="A", options={"input_unit": "A"})


@pytest.mark.parametrize(
    ("side", "unit"),
    [
        *(("input", unit) for unit in ("A", "V", "N", "N m", "-")),
        *(("output", unit) for unit in ("m", "rad", "-")),
    ],
)
def test_a_configuration_may_say_what_its_numbers_stand_in(side, unit):
    key = f"{side}_unit"
    assert refused(**{key: unit}, options={key: unit}) == ()


@pytest.mark.parametrize(
    ("side", "unit"),
    [("input", "mA"), ("input", "m"), ("output", "mm"), ("output", "V")],
)
def test_it_may_not_say_that_they_stand_in_something_else(side, unit):
    key = f"{side}_unit"
    said_by = f"recordings.{key}"
    (line,) = refused(**{key: unit}, options={key: unit}, said_by=said_by)
    assert line.startswith(f"a.yaml: recordings.{key}: found {unit!r}; expected")


@pytest.mark.parametrize(
    ("units", "step"),
    [
        ({"output_unit": "deg"}, "say recordings.output_unit: rad if the simulation's"),
        ({"input_unit": "mN"}, "say recordings.input_unit: N if the simulation's"),
        (
            {"output_unit": "inc"},
            "name its unit in recordings.units.output, or convert",
        ),
        (
            {"output_unit": "A"},
            "name another column, or correct recordings.units.output",
        ),
    ],
)
def test_a_refusal_says_what_to_do(units, step):
    (line,) = refused(**units)
    assert step in line


def test_an_experiment_without_a_simulation_may_be_in_any_unit():
    assert refused(None, output_unit="inc") == ()


def with_units(*units):
    log = CalibrationLog("step_0", (), 0, 1, 1, 1, units=units)
    return assumed_units(experiment(), recordings()[:1], [log])


def test_what_nobody_says_is_taken_for_si_in_one_line():
    line = with_units(
        SignalUnit("time", "", "", "s"),
        SignalUnit("input", "", "", "A"),
        SignalUnit("output", "", "", "m"),
    )
    assert line == (
        "a.yaml: recordings.units: nothing says the unit of the input, the output and "
        "the time: taken as A, m and s, as the simulation's numbers are; correct or "
        "confirm it with recordings.units: {input: A, output: m, time: s}"
    )


def test_what_is_known_is_not_assumed():
    known = SignalUnit("input", "mA", "the name 'mA'", "A", 1e-3)
    assert with_units(SignalUnit("time", "s", "x", "s"), known) == ""
    line = with_units(known, SignalUnit("output", "-", "recordings.output_unit", "-"))
    assert "unit of the output: taken as m," in line
    assert line.endswith("{output: m} in place of recordings.output_unit")


def log_of(name, *, overruled):
    said_by = "recordings.units.input"
    unit = SignalUnit("input", "mA", said_by, "A", 1e-3, overruled)
    return CalibrationLog(name, (), 0, 1, 1, 1, units=(unit,))


@pytest.mark.parametrize(
    ("overruled", "says", "step"),
    [
        (("A", ""), "the file of r0 says 'A'", "say 'file' there"),
        (("", "A", "A"), "the files of r1 and another say 'A'", "say 'file' there"),
        (("A", "A", "A"), "the files of r0 and 2 others say 'A'", "correct it"),
    ],
)
def test_files_that_contradict_a_stated_unit_are_named(overruled, says, step):
    found = [
        log_of(f"r{number}", overruled=one) for number, one in enumerate(overruled)
    ]

    (line,) = overruled_units("own.yaml", found)

    assert line.startswith("own.yaml: recordings.units.input: found 'mA', but " + says)
    assert step in line


def test_files_that_agree_with_a_stated_unit_are_no_matter():
    assert overruled_units("own.yaml", [log_of("r0", overruled="")]) == []


def rescaled(*, current=1.0, displacement=1.0, step=1.0, **changes):
    return [
        replace(
            one,
            input=current * one.input,
            output=displacement * one.output,
            sample_time_s=step * one.sample_time_s,
            **changes,
        )
        for one in recordings()
    ]


def doubt(found, model=DRIVE, options=REST, logs=()):
    asked = (experiment(), found, model, options, logs)
    refused, warned = refused_sizes(*asked), doubtful_sizes(*asked)
    assert not (refused and warned)
    return refused or warned


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"displacement": 1e3}, "{output: mm} if it is in mm, or {output: m}"),
        ({"displacement": 1e6}, "recordings.units: {output: um}"),
        ({"current": 1e3}, "recordings.units: {input: mA} if"),
    ],
)
def test_sizes_that_differ_by_powers_of_ten_give_a_unit_away(changes, words):
    line = doubt(rescaled(**changes))
    assert line.startswith("a.yaml: recordings.units.")
    assert "contradicts the simulation: what was measured is" in line
    assert words in line
    assert "\n" not in line


@pytest.mark.parametrize(
    ("role", "given", "words"),
    [
        # A name that lies, where the other unit is only assumed, is the last suspect.
        ("output", "mm", "nothing says the unit of the input, and A contradicts"),
        ("input", "A", "is the output in m, not mm?"),
    ],
)
def test_what_somebody_has_stated_is_doubted_last(role, given, words):
    found = rescaled(displacement=1e-3)
    known = SignalUnit(role, given, "the name", "m" if role == "output" else "A")
    others = (
        [] if role == "output" else [SignalUnit("output", "mm", "a row", "m", 1e-3)]
    )
    log = CalibrationLog(found[0].name, (), 0, 1, 1, 1, units=(known, *others))
    assert words in doubt(found, logs=[log])


def test_milliseconds_give_themselves_away_where_nothing_holds_the_drive():
    free = simulation(stiffness_N_per_m=0.0, damping_N_s_per_m=0.05)
    time = 1e-3 * np.arange(400)
    bump = np.sin(2 * np.pi * time / 0.4)
    # The double integral of the force, in closed form.
    way = 5.0 / 0.3 * (0.4 / (2 * np.pi)) * (time - 0.4 / (2 * np.pi) * bump)
    (first, *_) = recordings()
    found = [replace(first, input=bump, output=way, sample_time_s=1.0)]
    assert "{time: ms} if it is in ms" in doubt(found, free)
    assert doubt([replace(found[0], sample_time_s=1e-3)], free) == ""


@pytest.mark.parametrize("unit", ["m/s", "rad/s"])
def test_a_speed_in_thousandths_gives_itself_away(unit):
    """A speed in mm/s, or mrad/s, where nobody says a unit."""
    axis = {
        "mass_kg": "inertia_kg_m2", "damping_N_s_per_m": "damping_N_m_s_per_rad",
        "stiffness_N_per_m": "stiffness_N_m_per_rad",
        "force_constant_N_per_A": "torque_constant_N_m_per_A",
    }  # fmt: skip
    base = {name: getattr(DRIVE, name) for name in axis}
    turning = {axis[name]: value for name, value in base.items()}
    model = SimulationOptions(
        **(turning if unit == "rad/s" else base), output="velocity"
    )
    found = [
        replace(one, output=1e3 * np.gradient(one.output, 1e-3), output_unit=unit)
        for one in recordings()
    ]
    assert f"{{output: m{unit}}} if it is in m{unit}" in doubt(found, model)
    right = [replace(one, output=one.output / 1e3) for one in found]
    assert doubt(right, model) == ""


@pytest.mark.parametrize("factor", [1.0, 250.0, 1 / 250.0])
def test_parameters_that_are_off_are_no_matter_of_units(factor):
    assert doubt(recordings()) == ""
    assert doubt(recordings(), simulation(force_constant_N_per_A=5.0 * factor)) == ""


@pytest.mark.parametrize("start", ["held", "estimated"])
def test_sizes_are_compared_wherever_recordings_start(start):
    options = DiagnoseOptions(initial_state=start)
    assert "output: mm" in doubt(rescaled(displacement=1e3), options=options)


def test_recordings_in_units_of_their_own_are_converted_for_a_drive():
    kept = [
        replace(one, output=1e3 * one.output, output_unit="mm") for one in recordings()
    ]
    asked = given_by(experiment(output_unit="mm"), kept, ())

    assert asked.units == ("A", "mm")
    for one, same in zip(asked.recordings, recordings(), strict=True):
        assert one.output_unit == "m"
        assert one.output == pytest.approx(same.output)


def test_recordings_of_a_program_are_converted():
    found = rescaled(current=1e3, displacement=1e3, input_unit="mA", output_unit="mm")
    for one, si in zip(in_simulation_units(found, DRIVE), recordings(), strict=True):
        np.testing.assert_allclose(one.input, si.input, rtol=1e-15)
        np.testing.assert_allclose(one.output, si.output, rtol=1e-15)
        assert (one.input_unit, one.output_unit) == ("A", "m")


def test_recordings_of_a_program_in_other_units_are_refused():
    found = [replace(one, output_unit="A") for one in recordings()]
    with pytest.raises(
        ConfigError, match="'step_0': output_unit: found 'A'; expected 'm'"
    ):
        diagnose(found, DRIVE, jobs=1)


@pytest.mark.parametrize(("unit", "model"), [("rad", DRIVE), ("-", DRIVE)])
def test_recordings_of_a_program_may_be_of_a_rotation(unit, model):
    (one, *_) = in_simulation_units([replace(recordings()[0], output_unit=unit)], model)
    assert one.output_unit == unit
