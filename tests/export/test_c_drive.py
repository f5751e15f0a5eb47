import numpy as np
import pytest

from hwid_cli.drive.simulation import drive_effects, parameter_vector
from hwid_cli.errors import ConfigError, ModelFileError
from hwid_cli.export.c_drive import drive_source
from hwid_cli.export.formats import write_exported
from hwid_cli.export.predict import predict
from hwid_cli.records.drive import Controller, Drive
from hwid_cli.records.experiment import Columns
from hwid_cli.records.exported import ExportedSimulation, ModelCard
from hwid_cli.records.own_effects import OwnEffect, OwnParameter, own_id
from tests.drive import drive_cases as cases
from tests.export.fmu_runs import answered
from tests.export.model_examples import (
    MAIN,
    c_output,
    compiled,
    deviation,
)

STEP = 1e-3
# Steps without tables of matrices round otherwise; friction does not enlarge that.
PROMISED = 1e-12
# The program has no tables of matrices for halves of a sample: where hwid takes exponential
# steps, it takes Runge-Kutta steps. A gear that rattles enlarges the difference.
OTHER_STEPS = 5e-5
INNER = {"gear_backlash", "elastic_coupling", "second_mode"}
CURVED = {
    "cogging",
    "cubic_stiffness",
    "end_stop",
    "gravity",
    "load_friction",
    "hysteresis",
    "one_sided_stop",
    "position_friction",
    "quadratic_drag",
    "quadratic_stiffness",
    "stribeck_friction",
}
# A simulation starts in one way only.
ONE_START = MAIN.replace("init_empty", "init").replace("init_steady", "init")
BACKLASH = {"output_backlash": {"half_gap_m": 1e-3}}
SENSORS = {
    "sensor_quadratic": {"coefficient": 0.1},
    "sensor_cubic": {"coefficient": 0.05},
    "sensor_drift": {"drift_m_per_s": 0.01},
    "sensor_eccentricity": {"amplitude_m": 3e-4, "period_m": 4e-3},
    "sensor_hum": {"amplitude_m": 2e-4, "frequency_Hz": 50.0},
    "sensor_saturation": {"limit_m": 0.01},
    "sensor_lag": {"time_constant_s": 0.004},
}
COUPLED_MOTOR = {
    "elastic_coupling": {
        "stiffness_N_per_m": 2e4,
        "motor_share": 0.3,
        "damping_ratio": 0.05,
        "sensor": "motor",
    }
}
SLOW_SENSOR = {"sensor_lag": {"time_constant_s": 0.004, "damping_ratio": 0.7}}
MACHINES = (
    (SLOW_SENSOR, {"controller": Controller(20.0, 30.0, 4.0)}),
    ({}, {}),
    (BACKLASH, {}),
    (SENSORS, {}),
    (cases.COULOMB, {"stiffness_N_per_m": 0.0}),
    (cases.COULOMB, {"hold": "zero"}),
    (cases.COULOMB, {"resistance_ohm": 2.0}),
    (cases.COULOMB | cases.HEAT, {"resistance_ohm": 2.0, "inductance_H": 1e-3}),
    (cases.BRISTLES, {}),
    (cases.STRIBECK, {"controller": Controller(20.0, 30.0, 4.0)}),
    (COUPLED_MOTOR, {"controller": Controller(20.0, 30.0, 4.0, 25.0)}),
    (
        cases.COULOMB,
        {
            "controller": Controller(
                limit=0.8,
                proportional_gain=300.0,
                integral_gain=4000.0,
                derivative_gain=4.0,
            )
        },
    ),
    (COUPLED_MOTOR | BACKLASH | cases.COULOMB, {}),
    (BACKLASH | SENSORS, {"output": "velocity"}),
    (
        cases.COULOMB,
        {
            "output": "velocity",
            "controller": Controller(None, None, 0.5, 0.0, 8.0, 9.0),
        },
    ),
    (COUPLED_MOTOR | cases.GEAR, {"stiffness_N_per_m": 0.0}),
)
# Another clock is refused.
ALONE = tuple(
    ({name: values}, cases.machine_of(name))
    for name, values in cases.EVERY.items()
    if name != "clock_skew"
)
TOGETHER = tuple(
    (both, {}) for both in cases.VARIANTS + cases.TOGETHER + cases.TOGETHER_SLOW
)


def exported_drive(effects, **values):
    base = {
        "mass_kg": 0.3,
        "damping_N_s_per_m": 15.1,
        "stiffness_N_per_m": 1184.0,
        "force_constant_N_per_A": 5.0,
        "reference_current_A": 5.0,
        "reference_displacement_m": 0.02,
    }
    drive = Drive(**(base | values), effects=effects)
    card = ModelCard("simulation", "simulation", Columns("u", "y"), (-6.0, 6.0))
    vector = parameter_vector(drive, drive_effects(drive))
    return ExportedSimulation(card, drive, STEP, vector)


def example_command(n, scale=1.0):
    """A rest, ramps with corners and a sine: reversals, stops and limits."""
    rng = np.random.default_rng(1)
    times = STEP * np.arange(n)
    corners = np.sort(rng.uniform(0.0, times[-1], n // 60))
    ramps = np.interp(times, corners, rng.uniform(-3.0, 3.0, corners.size))
    command = 3.5 * np.sin(2 * np.pi * 3.0 * times) + ramps
    command[:50] = command[50]
    return scale * command


def check(folder, effects, values, n):
    exported = exported_drive(effects, **values)
    source = drive_source(exported)
    folder.mkdir(exist_ok=True)
    u = example_command(n, 0.004 if "controller" in values else 1.0)
    found = c_output(compiled(folder, source, ONE_START), u)
    has_inner = INNER & set(effects) or "resistance_ohm" in values
    promised = OTHER_STEPS if has_inner and CURVED & set(effects) else PROMISED
    assert deviation(found, predict(exported, u)) <= promised


@pytest.mark.thorough
@pytest.mark.parametrize(
    "effects",
    [
        cases.COULOMB | cases.END_STOP | cases.DELAY,
        cases.GEAR | cases.HYSTERESIS,
        # Another curved one runs away below.
        pytest.param(
            {"quadratic_drag": {"drag_N_s2_per_m2": 200.0}} | cases.CUBIC,
            marks=pytest.mark.slow,
        ),
        cases.PRELOAD | cases.SPRING_LOAD | cases.RIPPLE | cases.SIDE_CONTACT,
    ],
    ids=["friction, stop, delay", "gear, hysteresis", "curved", "preload, contact"],
)
def test_the_program_simulates_as_hwid_does(effects, tmp_path):
    check(tmp_path, effects, {}, 1500)


@pytest.mark.slow
@pytest.mark.parametrize("place", range(len(ALONE + TOGETHER + MACHINES)))
def test_all_effects_alone_and_together(place, tmp_path):
    check(tmp_path, *(ALONE + TOGETHER + MACHINES)[place], 4000)


@pytest.mark.thorough
def test_formulas_of_the_users_own_are_in_the_program(tmp_path):
    parameters = {"a": OwnParameter("N"), "b": OwnParameter("m")}
    stated = [
        OwnEffect(
            force_N="-(a + 30*abs(x))*sign(v) + a*sin(x/b)*t", parameters=parameters
        ),
        OwnEffect(input="u - a*0.02*tanh(u)**3*b/b*cos(9*t)", parameters=parameters),
        OwnEffect(output="x + 0.001*a*v*b*Max(t, 0.1)", parameters=parameters),
    ]
    values = {"a": 0.6, "b": 0.004}
    effects = {own_id(f"own{n}", one): values for n, one in enumerate(stated)}
    check(tmp_path, effects | cases.DELAY, {}, 1500)


@pytest.mark.thorough
def test_a_simulation_that_runs_away_is_nan_from_there(tmp_path):
    exported = exported_drive({"cubic_stiffness": {"stiffness_N_per_m3": -1e7}})
    u = example_command(1000)
    found = c_output(compiled(tmp_path, drive_source(exported), ONE_START), u)
    with pytest.raises(
        ModelFileError, match="the predicted output is nan at sample"
    ) as e:
        predict(exported, u)

    first = int(str(e.value).partition("sample ")[2].partition(";")[0])
    assert 0 < first < u.size
    assert np.array_equal(np.isnan(found), np.arange(u.size) >= first)


def test_a_smooth_input_is_refused():
    with pytest.raises(
        ConfigError, match=r"simulation.hold smooth: .*use --format json"
    ):
        drive_source(exported_drive({}, hold="smooth"))


def test_another_clock_is_refused():
    with pytest.raises(ConfigError, match=r"effects.clock_skew: .*use --format json"):
        drive_source(exported_drive({"clock_skew": {"ratio": 1.01}}))


def test_matlab_is_refused(tmp_path):
    with pytest.raises(ConfigError, match="expected json, c or fmu"):
        write_exported(tmp_path, exported_drive({}), "mat")


@pytest.mark.thorough
def test_the_unit_of_a_simulation_answers_like_hwid(tmp_path):
    exported = exported_drive(cases.COULOMB)
    u = example_command(300)
    unit = write_exported(tmp_path, exported, "fmu")[0]

    assert deviation(answered(unit, u, STEP), predict(exported, u)) <= PROMISED
