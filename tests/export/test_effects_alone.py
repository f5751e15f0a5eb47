"""Effects as text for other tools, worked off by other means than the program's own."""

import ast
import ctypes
import re
import subprocess
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.errors import ConfigError
from hwid_cli.export.effects_alone import write_effects
from hwid_cli.export.modelica import LAWS, modelica_text
from hwid_cli.records.drive import Drive, StandIn
from hwid_cli.records.experiment import Columns
from hwid_cli.records.exported import ModelCard
from hwid_cli.records.own_effects import OwnEffect, OwnParameter, own_id
from hwid_cli.records.programs import PythonSimulation
from hwid_cli.simulations.extended import ExtendedSimulation
from tests.simulations.fmu_examples import COMPILER, needs_compiler

STEP_S = 1e-3
TIMES = STEP_S * np.arange(700)
CURRENT = 2.5 * np.sin(2 * np.pi * 5 * TIMES) * np.minimum(TIMES / 0.05, 1.0)
PLAIN = Drive(
    0.3, 15.0, 1184.0, 5.0, reference_current_A=2.5, reference_displacement_m=0.012
)
CARD = ModelCard("simulation", "simulation", Columns("i", "x"), (-3.0, 3.0))
OWN = OwnEffect(
    force_N="-(a + b * abs(x)) * sign(v)",
    parameters={"a": OwnParameter("N", True), "b": OwnParameter("N/m", True)},
)
VALUES = {
    "coulomb_friction": {"force_N": 0.9},
    "asymmetric_friction": {"force_forward_N": 0.6, "force_backward_N": 1.1},
    "stribeck_friction": {
        "force_N": 0.5, "static_excess_N": 0.6, "velocity_m_per_s": 0.05,
    },
    "stribeck_friction:exponential": {
        "force_N": 0.5, "static_excess_N": 0.6, "velocity_m_per_s": 0.05,
    },
    "position_friction": {
        "force_N": 0.8, "variation_share": 0.5, "period_m": 0.008, "phase_rad": 0.4,
    },
    "hysteresis": {"force_N": 1.0, "yield_m": 4e-4},
    "hysteresis:lugre": {
        "force_N": 0.9, "yield_m": 4e-4, "static_excess_N": 0.5,
        "velocity_m_per_s": 0.05, "damping_N_s_per_m": 4.0,
    },
    "quadratic_drag": {"drag_N_s2_per_m2": 40.0},
    "cubic_stiffness": {"stiffness_N_per_m3": 3e6},
    "quadratic_stiffness": {"stiffness_N_per_m2": 2e4},
    "end_stop": {"position_m": 0.006, "stiffness_N_per_m": 8e3},
    "one_sided_stop": {"position_m": -0.006, "stiffness_N_per_m": 8e3},
    "cogging": {"amplitude_N": 1.5, "period_m": 5e-3, "phase_rad": 0.3},
    "constant_load": {"force_N": 2.0},
    "second_mode": {"mass_kg": 0.05, "frequency_Hz": 25.0, "damping_ratio": 0.05},
    "periodic_force": {"amplitude_N": 1.0, "frequency_Hz": 8.0, "phase_rad": 0.0},
    "input_delay": {"delay_s": 3.3e-3},
    "input_dead_zone": {"threshold_A": 0.3},
    "input_saturation": {"limit_A": 1.8},
    "actuator_lag": {"time_constant_s": 5e-3},
    "actuator_lag:second_order": {"time_constant_s": 5e-3, "damping_ratio": 0.6},
    "force_constant_saturation": {"loss_at_reference": 0.2},
    "supply_sag": {"loss_at_reference": 0.2},
    "torque_ripple": {"share": 0.2, "per_turn": 900.0, "phase_rad": 0.2},
    "thermal_gain_loss": {"loss_at_reference": 0.3, "time_constant_s": 0.4},
    "sensor_eccentricity": {"amplitude_m": 3e-4, "period_m": 4e-3, "phase_rad": 0.2},
    "sensor_quadratic": {"coefficient": 0.1},
    "sensor_cubic": {"coefficient": 0.1},
    "sensor_drift": {"drift_m_per_s": 5e-3},
    "sensor_hum": {"amplitude_m": 3e-4, "frequency_Hz": 50.0, "phase_rad": 0.5},
    "sensor_saturation": {"limit_m": 0.007},
    "sensor_lag": {"time_constant_s": 5e-3},
    "sensor_lag:second_order": {"time_constant_s": 5e-3, "damping_ratio": 0.6},
    own_id("chain", OWN): {"a": 0.3, "b": 60.0},
}  # fmt: skip


def extended_with(effects):
    base = PythonSimulation(file="a.py", input="i", output="x", force_input="f")
    return ExtendedSimulation(base, PLAIN, replace(PLAIN, effects=effects))


class Block:
    """A Modelica model of plain equations, worked off in Python."""

    def __init__(self, text):
        self.values = {
            name: ast.literal_eval(value)
            for name, value in re.findall(
                r"(?:parameter|constant) Real (\w+) = ([-\w.+]+)", text
            )
        }
        declared, body = text.split("\nequation\n")
        # What begins at rest does so with its input, which is 0 in these cases.
        resting = re.findall(r"  der\((\w+)\) = 0;", declared)
        self.inner = (
            re.findall(r"Real (\w+)\(start = 0, fixed = true\)", text) + resting
        )
        body = body.rsplit("end ", 1)[0]
        pairs = [one.strip().split(" = ", 1) for one in body.split(";") if one.strip()]
        self.equations = {
            left: compile(in_python(right), "mo", "eval") for left, right in pairs
        }

    def at(self, time, x, v, u, inner):
        """All outputs and derivatives."""
        known = {
            **self.values, **dict(zip(self.inner, inner, strict=True)),
            "x": x, "v": v, "u": u(time), "time": time,
            "delay": lambda _, by: u(time - by), "max": max, "min": min, "abs": abs,
            "tanh": np.tanh, "exp": np.exp, "sin": np.sin, "__builtins__": {},
        }  # fmt: skip
        known["s"] = eval(self.equations["s"], known)
        return {name: eval(code, known) for name, code in self.equations.items()}


def in_python(text):
    text = re.sub(r"if (.+?) then (.+?) else (min\(.+?\))", r"\2 if \1 else \3", text)
    return text.replace("^", "**")


def rms(values):
    return float(np.sqrt(np.mean(np.square(values))))


@pytest.mark.thorough
@pytest.mark.parametrize("name", VALUES)
def test_modelica_text_moves_a_mass_as_the_effect_does(name):
    effects = {name: VALUES[name]}
    truth = simulate_drive(
        CURRENT, replace(PLAIN, effects=effects), sample_time_s=STEP_S
    )
    bare = simulate_drive(CURRENT, PLAIN, sample_time_s=STEP_S)
    block = Block(modelica_text(extended_with(effects), CARD))

    def u(time):
        return np.interp(time, TIMES, CURRENT)

    def change(time, state):
        x, v, *inner = state
        found = block.at(time, x, v, u, inner)
        push = 5.0 * found["u_acting"] + found["force"] - 15.0 * v - 1184.0 * x
        return [v, push / 0.3, *(found[f"der({one})"] for one in block.inner)]

    # A drive starts in equilibrium with what acts on it from the beginning.
    start = [truth.position[0], 0.0, *np.zeros(len(block.inner))]
    found = solve_ivp(
        change, (0, TIMES[-1]), start, t_eval=TIMES, rtol=1e-7, atol=1e-9, max_step=5e-4
    ).y
    reading = [
        block.at(t, x, v, u, inner)["y"]
        for t, x, v, *inner in zip(TIMES, *found, strict=True)
    ]
    assert rms(reading - truth.output) < 0.01 * rms(truth.output - bare.output)


def test_every_law_is_tried():
    assert set(LAWS) <= set(VALUES)


@pytest.mark.parametrize("file_format", ["c", "simulink"])
def test_forces_behind_a_lag_need_an_input_of_their_own(file_format, tmp_path):
    """Step by step nothing can be sent ahead; what acts before the lag needs not be."""
    plain = StandIn(0.3, 15.0, 1184.0, 5.0, lag_s=0.03)
    friction = {"coulomb_friction": VALUES["coulomb_friction"]}

    def write(force_input, effects):
        base = PythonSimulation(
            file="a.py", input="i", output="x", force_input=force_input
        )
        extended = ExtendedSimulation(base, plain, replace(plain, effects=effects))
        return write_effects(tmp_path, file_format, extended, CARD, STEP_S)

    with pytest.raises(ConfigError, match=r"force_input: missing, .* lag of 0\.03 s"):
        write(None, friction)
    assert write("f", friction)
    assert write(None, {"input_dead_zone": VALUES["input_dead_zone"]})


def test_what_is_no_plain_equation_is_one_line():
    play = {"output_backlash": {"half_gap_m": 1e-3}}
    with pytest.raises(ConfigError, match=r"output_backlash: .*; use --format c"):
        modelica_text(extended_with(play), CARD)


# What an S-function asks of Simulink, and a mass that moves with it, in steps of 0.1 ms.
SIMSTRUC = """
typedef int int_T;
typedef struct { double in[3], out[2]; const double *at[3]; void *work; const char *error;
                 double step; int n_in, n_out; } SimStruct;
#define ssSetNumSFcnParams(S, n) ((void)(S))
#define ssGetNumSFcnParams(S) 0
#define ssGetSFcnParamsCount(S) 0
#define ssSetNumInputPorts(S, n) ((S)->n_in = (n))
#define ssSetNumOutputPorts(S, n) ((S)->n_out = (n))
#define ssSetInputPortWidth(S, n, w) ((S)->at[n] = &(S)->in[n])
#define ssSetInputPortDirectFeedThrough(S, n, w) ((void)(S))
#define ssSetOutputPortWidth(S, n, w) ((S)->out[n] = 0.0)
#define ssSetNumPWork(S, n) ((void)(S))
#define ssSetNumSampleTimes(S, n) ((void)(S))
#define ssSetSampleTime(S, n, t) ((S)->step = (t))
#define ssSetOffsetTime(S, n, t) ((void)(S))
#define ssSetErrorStatus(S, e) ((S)->error = (e))
#define ssSetPWorkValue(S, n, p) ((S)->work = (p))
#define ssGetPWorkValue(S, n) ((S)->work)
#define ssGetInputPortRealSignalPtrs(S, n) (&(S)->at[n])
#define ssGetOutputPortRealSignal(S, n) (&(S)->out[n])
"""
MASS = """
void run_mass(int n, const double *u, double *y) {
    SimStruct s = {0};
    double x = 0.0, v = 0.0;
    int i, j;
    mdlInitializeSizes(&s); mdlInitializeSampleTimes(&s); mdlStart(&s);
    for (i = 0; i < n; i++) {
        for (j = 0; j < 10; j++) {
            double next = i + 1 < n ? u[i + 1] : u[i], now = u[i] + j * (next - u[i]) / 10;
            double mean = now + (next - u[i]) / 20, f, h = s.step, half;
            s.in[0] = i + j == 0 ? u[0] : mean; s.in[1] = x; s.in[2] = v;
            mdlOutputs(&s, 0);
            if (j == 0) y[i] = s.out[1];
            f = 5.0 * mean + s.out[0];
            half = v + h / 2 * (f - 15.0 * v - 1184.0 * x) / 0.3;
            v += h * (f - 15.0 * half - 1184.0 * (x + h / 2 * v)) / 0.3;
            x += h * half;
        }
    }
    mdlTerminate(&s);
}
"""


@pytest.mark.thorough
@needs_compiler
@pytest.mark.parametrize("name", ["coulomb_friction", "sensor_quadratic", "hysteresis"])
def test_s_function_moves_a_mass_as_the_effect_does(name, tmp_path):
    extended = extended_with({name: VALUES[name]})
    truth = simulate_drive(CURRENT, extended.stand_in, sample_time_s=STEP_S).output
    bare = simulate_drive(CURRENT, PLAIN, sample_time_s=STEP_S).output
    written = write_effects(tmp_path, "simulink", extended, CARD, STEP_S)
    assert [one.name for one in written] == ["effect.c", "effect_sfun.c"]
    (tmp_path / "simstruc.h").write_text(SIMSTRUC)
    (tmp_path / "cg_sfun.h").write_text(MASS)
    flags = ["-std=c99", "-O2", "-Wall", "-Wextra", "-Werror", "-Wno-unused-function"]
    subprocess.run(
        [COMPILER, *flags, "-shared", "-fPIC", "-I.", "effect_sfun.c", "-o", "a.so", "-lm"],
        cwd=tmp_path, check=True,
    )  # fmt: skip
    library, output = ctypes.CDLL(str(tmp_path / "a.so")), np.empty(CURRENT.size)
    double = ctypes.POINTER(ctypes.c_double)
    library.run_mass(
        CURRENT.size, CURRENT.ctypes.data_as(double), output.ctypes.data_as(double)
    )
    assert np.std(output - truth) < 0.01 * np.std(truth - bare)


def test_modelica_text_reads_a_velocity_where_one_is_measured():
    speed = extended_with({"sensor_saturation": {"limit_m": 0.2}})
    plain, both = (
        replace(one, output="velocity") for one in (speed.plain, speed.stand_in)
    )
    speed = replace(speed, plain=plain, stand_in=both)
    text = modelica_text(speed, replace(CARD, output_unit="m/s"))
    assert 'input Real x "position of the simulation, m"' in text
    reading = re.search(r"  y = (.*);", text)[1]
    assert re.search(r"\bv\b", reading)
    assert not re.search(r"\bx\b", reading)
