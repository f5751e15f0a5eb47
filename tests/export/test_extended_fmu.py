"""FMUs that contain the user's own and the effects, run by FMPy."""

import subprocess
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from hwid_cli.errors import ConfigError, SimulationError
from hwid_cli.export.effect_source import effect_source
from hwid_cli.export.extended_fmu import write_extended_fmu
from hwid_cli.records.drive import Drive
from hwid_cli.records.experiment import Columns
from hwid_cli.records.exported import ModelCard
from hwid_cli.records.programs import RunRequest
from hwid_cli.simulations import fmu
from hwid_cli.simulations.extended import ExtendedSimulation, run_extended
from tests.simulations.fmu_examples import COMPILER, make_fmu, needs_compiler
from tests.simulations.test_fmu import section

pytestmark = needs_compiler
STEP_S = 1e-3
TIMES = STEP_S * np.arange(1000)
CURRENTS = {
    "slow": 2 * np.sin(2 * np.pi * 4 * TIMES),
    "fast": 4 * np.sin(2 * np.pi * 11 * TIMES),
    "to and fro": np.interp(TIMES, [0.05, 0.08, 0.5, 0.55], [0, 2, 2, 0]),
}
# A stand-in that is this wrong.
ROUGH = Drive(0.33, 12.0, 1000.0, 5.0, reference_displacement_m=0.02)
EFFECTS = {
    "friction": {"coulomb_friction": {"force_N": 0.8}},
    "drag": {"quadratic_drag": {"drag_N_s2_per_m2": 40.0}},
    "cubic": {"cubic_stiffness": {"stiffness_N_per_m3": 4e6}},
    "stop": {"one_sided_stop": {"position_m": 0.006, "stiffness_N_per_m": 2e4}},
    "cogging": {"cogging": {"amplitude_N": 2.0, "period_m": 4e-3, "phase_rad": 0.3}},
    "hysteresis": {"hysteresis": {"force_N": 1.0, "yield_m": 3e-4}},
    "delay": {"input_delay": {"delay_s": 3.3e-3}},
    "dead zone": {"input_dead_zone": {"threshold_A": 0.3}},
    "lag": {"actuator_lag": {"time_constant_s": 4e-3}},
    "sensor": {"sensor_quadratic": {"coefficient": 0.1}},
    "play": {"output_backlash": {"half_gap_m": 5e-4}},
    "mode": {
        "second_mode": {"mass_kg": 0.05, "frequency_Hz": 30.0, "damping_ratio": 0.03}
    },
    "both": {
        "quadratic_drag": {"drag_N_s2_per_m2": 40.0},
        "sensor_quadratic": {"coefficient": 0.1},
    },
}
CARD = ModelCard(
    "simulation", "simulation", Columns("current_A", "displacement_m"), (-4.0, 4.0)
)


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    yield section(make_fmu(tmp_path_factory.mktemp("plant")))
    fmu._PROCESS.end()


def request_of(current):
    return RunRequest("a", STEP_S, current, np.zeros(0), {})


def extended_of(plant, effects, plain=ROUGH):
    base = replace(plant, parameters={"damping": 13.0})
    return ExtendedSimulation(base, plain, replace(plain, effects=effects))


def differences(plant, effects, path, plain=ROUGH):
    """Between the FMU and the extended simulation, as shares of what the effects do."""
    extended = extended_of(plant, effects, plain)
    base = extended.base
    write_extended_fmu(path, extended, CARD, STEP_S)
    for name, current in CURRENTS.items():
        request = replace(request_of(current), parameters=base.values)
        bare = fmu.KIND.run(base, request).output
        drives = extended.plain, extended.stand_in
        known = run_extended(
            partial(fmu.KIND.run, base), request, drives,
            has_force=base.force_input is not None,
        ).output  # fmt: skip
        # Nothing is set: the fitted parameters are its own.
        given = replace(base, file=str(path), parameters={})
        found = fmu.KIND.run(given, request_of(current)).output
        yield name, np.std(found - known) / np.std(known - bare)


@pytest.mark.thorough
@pytest.mark.parametrize("name", EFFECTS)
def test_it_gives_what_the_extended_simulation_gives(plant, name, tmp_path):
    for current, share in differences(plant, EFFECTS[name], tmp_path / "a.fmu"):
        assert share < 0.01, current


@pytest.mark.thorough
@pytest.mark.parametrize("missing", [{"velocity": None}, {"force_input": None}])
@pytest.mark.parametrize("name", ["friction", "cubic"])
def test_without_a_velocity_or_a_force_input(plant, name, missing, tmp_path):
    few = replace(plant, **missing)
    for current, share in differences(few, EFFECTS[name], tmp_path / "a.fmu"):
        assert share < 0.01, current


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["friction", "drag", "cubic", "lag", "both"])
def test_where_the_velocity_is_measured(plant, name, tmp_path):
    of_speed = replace(plant, output=plant.velocity, velocity=None)
    plain = replace(ROUGH, output="velocity", reference_displacement_m=0.5)
    found = differences(of_speed, EFFECTS[name], tmp_path / "a.fmu", plain)
    for current, share in found:
        assert share < 0.01, current


@pytest.mark.thorough
def test_friction_is_nearer_to_the_machine_than_the_extended_simulation(
    plant, tmp_path
):
    # The machine has the friction in its own equations, in steps of a microsecond.
    machine = section(
        make_fmu(tmp_path, name="rub", coulomb_N=0.8, internal_step_s=1e-6)
    )
    extended = extended_of(plant, EFFECTS["friction"])
    base = extended.base
    write_extended_fmu(tmp_path / "a.fmu", extended, CARD, STEP_S)
    given = replace(base, file=str(tmp_path / "a.fmu"), parameters={})
    for name, current in CURRENTS.items():
        request = replace(request_of(current), parameters=base.values)
        truth = fmu.KIND.run(machine, request).output
        bare = fmu.KIND.run(base, request).output
        found = fmu.KIND.run(given, request_of(current)).output
        # The whole-run iteration comes within 0.6 %.
        assert np.std(found - truth) < 0.002 * np.std(bare - truth), name


@pytest.mark.thorough
def test_it_is_reset_to_its_start_and_runs_again(plant, tmp_path):
    extended = extended_of(plant, EFFECTS["hysteresis"])
    write_extended_fmu(tmp_path / "a.fmu", extended, CARD, STEP_S)
    given = replace(extended.base, file=str(tmp_path / "a.fmu"), parameters={})
    first, second = (
        fmu.KIND.run(given, request_of(CURRENTS["fast"])).output for _ in range(2)
    )
    np.testing.assert_array_equal(first, second)


@pytest.mark.thorough
def test_fmpy_takes_it_and_its_parameters_have_the_fitted_values(plant, tmp_path):
    import fmpy

    path = tmp_path / "a.fmu"
    write_extended_fmu(path, extended_of(plant, EFFECTS["drag"]), CARD, STEP_S)
    description = fmpy.read_model_description(path, validate=True)
    (damping,) = [one for one in description.modelVariables if one.name == "damping"]
    assert float(damping.start) == 13.0
    signals = np.zeros(TIMES.size, [("time", float), ("current_A", float)])
    signals["time"], signals["current_A"] = TIMES, CURRENTS["slow"]
    found = fmpy.simulate_fmu(
        str(path), stop_time=0.5, output_interval=1e-3, step_size=1e-3, input=signals,
        output=["displacement_m"],
    )  # fmt: skip
    assert np.ptp(found["displacement_m"]) > 1e-3


@pytest.mark.thorough
def test_a_step_that_does_not_fit_is_one_line_of_the_unit(plant, tmp_path):
    extended = extended_of(plant, EFFECTS["drag"])
    write_extended_fmu(tmp_path / "a.fmu", extended, CARD, STEP_S)
    given = replace(
        extended.base, file=str(tmp_path / "a.fmu"), parameters={}, step_s=1e-3 / 7
    )
    with pytest.raises(SimulationError, match=r"must be a multiple of 0\.0001 s"):
        fmu.KIND.run(given, request_of(CURRENTS["slow"]))


def test_an_fmu_of_fmi_3_is_refused_with_the_other_way(tmp_path):
    given = section(make_fmu(tmp_path, 3))
    with pytest.raises(ConfigError, match=r"of FMI 3\.0; expected .* --format python"):
        write_extended_fmu(
            tmp_path / "a.fmu", extended_of(given, EFFECTS["drag"]), CARD, STEP_S
        )


@pytest.mark.thorough
def test_the_effect_alone_compiles_without_a_warning(plant, tmp_path):
    text = effect_source(extended_of(plant, EFFECTS["both"]), CARD, 1e-4)
    (tmp_path / "effect.c").write_text(text)
    strict = ["-std=c99", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function"]
    done = subprocess.run(
        [COMPILER, *strict, "-c", "effect.c", "-o", "effect.o"],
        cwd=tmp_path, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
