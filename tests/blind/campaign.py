"""The recordings of a case, and the truth behind them."""

from typing import NamedTuple

import numpy as np

from tests.blind.effects import CHANGING, draw, hide
from tests.blind.inputs import LARGEST_A, plan
from tests.blind.machine import SAMPLE_TIME_S, Machine, half_steps, move
from tests.blind.nuisances import measure
from tests.blind.refit import gap_of

# Relative distance of the machine from the nominal values, and of the simulation's
# parameters from the machine.
MACHINE_SPREAD = (0.15, 0.30)
SIMULATION_SPREAD = (0.10, 0.25)
BASE = tuple(CHANGING.values())
# Runge-Kutta steps in a sample: 50 us; with twice as many the displacement changes by
# less than 1e-8 m, see test_machine.py.
STEPS = 20
# Largest displacement in static travels; at resonance it is below 2.
MOST_TRAVELS = 4
# A disturbance that acts before the recording begins has settled after this time.
SETTLING_SAMPLES = 1000


class Recorded(NamedTuple):
    """One recording as its file shows it."""

    name: str
    time_s: np.ndarray
    current_A: np.ndarray
    displacement_m: np.ndarray


def measured_case(case, further=None):
    """Recordings of a case and its truth as plain values.

    ``further`` are commands by name that the same machine answers after those of the
    plan: its laws, its noise and its sensor are those that the plan's recordings set.
    """
    rng = case.rng()
    machine = Machine()
    machine = machine._replace(**_spread(machine, MACHINE_SPREAD, rng))
    simulation = _spread(machine, SIMULATION_SPREAD, rng)
    size = float(rng.uniform(case.smallest_size, case.largest_size))
    hidden = {effect: draw(effect, machine, rng, size) for effect in case.effects}
    whole = machine
    for effect, values in hidden.items():
        whole = hide(effect, values, whole)
    planned = plan(case.plan, rng)
    commands = {**planned, **(further or {})}
    factors = _factors(hidden, planned, further or {}, rng)
    clean = {
        name: _displacement(whole, command, hidden, factors.get(name, 1.0), rng)
        for name, command in commands.items()
    }
    clean, reference = _through_sensor(clean, hidden, planned)
    full_scale = max(np.abs(clean[name]).max() for name in planned)
    travel = machine.force_constant_N_per_A * LARGEST_A / machine.stiffness_N_per_m
    if not full_scale < MOST_TRAVELS * travel:
        raise ValueError(
            f"{case.name}: runs away to {full_scale:.2g} m; a smaller size"
        )
    sigma = case.noise_percent / 100 * full_scale
    recordings = []
    for name, command in commands.items():
        y, current = measure(
            clean[name], command, case.nuisance, sigma, full_scale, rng
        )
        time = np.arange(len(y)) * SAMPLE_TIME_S
        recordings.append(Recorded(name, time, current, y))
    truth = {
        "case": case.name,
        "suite": case.suite,
        "seed": list(case.seed),
        "plan": case.plan,
        "nuisance": case.nuisance,
        "noise_percent": case.noise_percent,
        "noise_sigma_m": sigma,
        "size": size,
        "effects": [{"id": one, "parameters": v} for one, v in hidden.items()],
        "acceptable": [list(one) for one in case.acceptable],
        "base": {name: getattr(machine, name) for name in BASE},
        "simulation": simulation,
        "reference_A": LARGEST_A,
        "reference_m": reference,
        "gap": _gap(commands, clean, simulation, sigma),
        "recordings": {
            one.name: {
                "largest_A": float(np.abs(one.current_A).max()),
                "largest_m": float(np.abs(one.displacement_m).max()),
                "factor": factors.get(one.name, 1.0),
            }
            for one in recordings
        },
    }
    return recordings, truth


def _spread(machine, shares, rng):
    """Base parameters, each moved up or down by a random share."""
    moved = {}
    for name in BASE:
        share = rng.uniform(*shares) * rng.choice([-1.0, 1.0])
        moved[name] = float(getattr(machine, name) * (1 + share))
    return moved


def _factors(hidden, planned, further, rng):
    """Factor on the changing parameter, by recording; the plan's spread is the drawn one."""
    if "parameter_change" not in hidden:
        return {}
    shifts = rng.standard_normal(len(planned))
    shifts = (shifts - shifts.mean()) / shifts.std()
    shifts = np.r_[shifts, rng.standard_normal(len(further))]
    factors = 1.0 + hidden["parameter_change"]["spread"] * shifts
    return dict(zip([*planned, *further], factors.tolist(), strict=True))


def _displacement(machine, command, hidden, factor, rng):
    if "parameter_change" in hidden:
        name = CHANGING[hidden["parameter_change"]["which"]]
        machine = machine._replace(**{name: factor * getattr(machine, name)})
    early = SETTLING_SAMPLES if "settled_periodic_force" in hidden else 0
    command = np.r_[np.full(early, command[0]), command]
    times = half_steps(len(command), STEPS)
    found = move(
        machine,
        command,
        force_N=_disturbance(hidden, times, rng),
        stiffness_change=_stiffness_change(hidden, times, rng),
        steps=STEPS,
    )
    return found.behind_play_m[early:]


def _disturbance(hidden, times, rng):
    for name in ("periodic_force", "settled_periodic_force"):
        if name in hidden:
            p, phase = hidden[name], rng.uniform(0, 2 * np.pi)
            return p["amplitude_N"] * np.sin(
                2 * np.pi * p["frequency_Hz"] * times + phase
            )
    if "random_force" in hidden:
        p = hidden["random_force"]
        keep = np.exp(-2 * np.pi * p["bandwidth_Hz"] * SAMPLE_TIME_S)
        samples = round(times[-1] / SAMPLE_TIME_S) + 1
        noise = np.empty(samples)
        noise[0] = rng.standard_normal()
        for n in range(1, samples):
            shock = np.sqrt(1 - keep**2) * rng.standard_normal()
            noise[n] = keep * noise[n - 1] + shock
        return p["rms_N"] * np.interp(times, np.arange(samples) * SAMPLE_TIME_S, noise)
    return None


def _stiffness_change(hidden, times, rng):
    if "varying_stiffness" not in hidden:
        return None
    p, phase = hidden["varying_stiffness"], rng.uniform(0, 2 * np.pi)
    return p["share"] * np.sin(2 * np.pi * p["frequency_Hz"] * times + phase)


def _through_sensor(positions, hidden, planned):
    """Readings of the sensor; the largest one of the plan's recordings is its reference."""
    largest = max(np.abs(positions[name]).max() for name in planned)
    square = hidden.get("sensor_quadratic", {}).get("coefficient", 0.0)
    cube = hidden.get("sensor_cubic", {}).get("coefficient", 0.0)
    drift = hidden.get("sensor_drift", {}).get("drift_m_per_s", 0.0)
    reference = largest
    # The law contains its own largest reading; each round divides the error by ten.
    for _ in range(30):
        readings = {
            name: x
            + square * x**2 / reference
            + cube * x**3 / reference**2
            + drift * SAMPLE_TIME_S * np.arange(len(x))
            for name, x in positions.items()
        }
        if not (square or cube):
            break
        reference = max(np.abs(readings[name]).max() for name in planned)
    return readings, float(reference)


def _gap(commands, clean, simulation, sigma):
    start = [
        simulation[name]
        for name in (
            "damping_N_s_per_m",
            "stiffness_N_per_m",
            "force_constant_N_per_A",
        )
    ]
    left, motion, _ = gap_of(
        list(commands.values()), list(clean.values()), Machine().mass_kg, start
    )
    return {
        "rms_m": left,
        "motion_rms_m": motion,
        "share_of_motion": left / motion,
        "to_noise": left / sigma if sigma else float("inf"),
    }
