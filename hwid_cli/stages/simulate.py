"""Stage ``simulate``: the planned recordings of a virtual machine.

Every recording has a random stream of its own, spawned from the machine's seed by its
place in the full plan. Leaving recordings out, or adding some of another kind, does not
change the others.
"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.data.virtual_measurements import (
    read_virtual_key,
    write_virtual_measurements,
)
from hwid_cli.drive import circuit, excitation, mechanics, sensors
from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import Experiment
from hwid_cli.records.machines import (
    GunMachine,
    GunPlan,
    ServoMachine,
    VirtualMeasurement,
)
from hwid_cli.records.mechanics import Mechanics
from hwid_cli.stages.gun_plan import (
    GUN_KINDS,
    PlannedRecording,
    plan_gun,
    select_recordings,
)
from hwid_cli.stages.stage import Context, Runner, Stage, Storage
from hwid_cli.store.result_files import Provenance
from hwid_cli.tasks.cache import task_key

NAME = "simulate"
STAGE_VERSION = 4

# The gun rests within this share of its stiction band, so that no reading of the lead-in
# depends on rounding at the band's edge.
REST_SHARE = 0.8


def simulate_machine(
    machine: ServoMachine | GunMachine,
) -> tuple[VirtualMeasurement, ...]:
    """Virtual measurements of a machine, all of its plan.

    Returns
    -------
    tuple of VirtualMeasurement
        In the order of the plan.

    Raises
    ------
    ConfigError
        If ``plan.only`` names a recording that the plan does not have.
    """
    if isinstance(machine, ServoMachine):
        return _simulate_servo(machine)
    return _simulate_gun(machine)


def _simulate_gun(gun: GunMachine) -> tuple[VirtualMeasurement, ...]:
    planned = plan_gun(gun.plan)
    chosen = select_recordings(planned, gun.plan.only)
    kind_seeds = dict(
        zip(
            GUN_KINDS,
            np.random.SeedSequence(gun.seed).spawn(len(GUN_KINDS)),
            strict=True,
        )
    )
    most = max(recording.number for recording in planned) if planned else 0
    seeds = {kind: seed.spawn(most) for kind, seed in kind_seeds.items()}
    return tuple(
        _measure_gun(gun, recording, seeds[recording.kind][recording.number - 1])
        for recording in chosen
    )


def _measure_gun(
    gun: GunMachine, recording: PlannedRecording, seed: np.random.SeedSequence
) -> VirtualMeasurement:
    """Run one recording: command, motion, readings of both sensors."""
    # One stream per purpose: another noise level leaves excitation and machine alone.
    streams = [np.random.default_rng(child) for child in seed.spawn(4)]
    command_rng, machine_rng, current_rng, displacement_rng = streams
    plan = gun.plan
    command, lead_in, lengths = _command(plan, recording, command_rng)
    mechanism, factor = _changed_mechanics(gun, machine_rng)
    rest = _rest_position(mechanism, machine_rng)
    displacement, _ = mechanics.simulate_motion(
        command,
        mechanism,
        limit_A=gun.current_limit_A,
        sample_time_s=plan.sample_time_s,
        position_m=rest,
    )
    current, current_truth = _read_current(gun, command[: lengths[0]], current_rng)
    output, output_truth = _read_displacement(
        gun, displacement[: lengths[1]], displacement_rng
    )
    return VirtualMeasurement(
        name=recording.name,
        kind=recording.kind,
        time_s=plan.sample_time_s * np.arange(max(lengths)),
        input=current,
        output=output,
        plan={
            "amplitude_A": recording.amplitude_A,
            "ramp_samples": recording.ramp_samples,
            "frequency_rad_per_sample": recording.rad_per_sample,
            "lead_in_samples": lead_in,
            "changed_parameter": gun.change.parameter,
            "parameter_factor": factor,
            "rest_position_m": rest,
            **current_truth,
            **output_truth,
        },
    )


def _command(
    plan: GunPlan, recording: PlannedRecording, rng: np.random.Generator
) -> tuple[np.ndarray, int, tuple[int, int]]:
    """Return command with rest before it, length of that rest, lengths of columns."""
    lead_in = int(
        rng.integers(plan.shortest_lead_in_samples, plan.longest_lead_in_samples + 1)
    )
    tails = rng.integers(
        plan.shortest_tail_samples, plan.longest_tail_samples + 1, size=2
    )
    lengths = (
        lead_in + plan.samples + int(tails[0]),
        lead_in + plan.samples + int(tails[1]),
    )
    excited = _excitation(plan, recording, max(lengths) - lead_in, rng)
    return np.concatenate([np.zeros(lead_in), excited]), lead_in, lengths


def _excitation(
    plan: GunPlan, recording: PlannedRecording, n: int, rng: np.random.Generator
) -> np.ndarray:
    if recording.kind == "step":
        return excitation.step(n, recording.amplitude_A, recording.ramp_samples)
    if recording.kind == "sine":
        return excitation.sine(
            n,
            recording.amplitude_A,
            recording.rad_per_sample,
            plan.sine_fade_in_samples,
        )
    return excitation.random_levels(
        n,
        recording.amplitude_A,
        shortest_samples=plan.random_shortest_samples,
        longest_samples=plan.random_longest_samples,
        rng=rng,
    )


def _changed_mechanics(
    gun: GunMachine, rng: np.random.Generator
) -> tuple[Mechanics, float]:
    """Return the mechanics of one recording and the factor on its changed parameter."""
    is_changed = rng.random() < gun.change.share
    relative = rng.uniform(-gun.change.largest, gun.change.largest)
    factor = 1.0 + float(relative) if is_changed else 1.0
    name = {
        "stiffness": "stiffness_N_per_m",
        "damping": "damping_N_s_per_m",
        "force_constant": "force_constant_N_per_A",
    }[gun.change.parameter]
    value = getattr(gun.mechanics, name) * factor
    return replace(gun.mechanics, **{name: value}), factor


def _rest_position(mechanism: Mechanics, rng: np.random.Generator) -> float:
    """Return where the mass rests without current, somewhere in its stiction band."""
    lowest, highest = mechanics.rest_range(0.0, mechanism)
    middle, reach = 0.5 * (lowest + highest), 0.5 * (highest - lowest)
    return middle + REST_SHARE * reach * float(rng.uniform(-1.0, 1.0))


def _read_current(
    gun: GunMachine, command: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, dict[str, float | str | int]]:
    """Return the measured command and what the sensor did to it."""
    chain = gun.sensors
    offset = float(rng.uniform(-chain.current_offset_A, chain.current_offset_A))
    reading = sensors.read_sensor(
        command, offset=offset, noise=chain.current_noise_A, resolution=0.0, rng=rng
    )
    reading, damaged = sensors.damage_samples(
        reading, chain.damaged_samples, chain.current_damage_A, rng
    )
    return reading, {"input_offset_A": offset, "damaged_input": _join(damaged)}


def _read_displacement(
    gun: GunMachine, displacement: np.ndarray, rng: np.random.Generator
) -> tuple[np.ndarray, dict[str, float | str | int]]:
    """Return the measured displacement and what the sensor did to it."""
    chain = gun.sensors
    offset = float(
        rng.uniform(-chain.displacement_offset_m, chain.displacement_offset_m)
    )
    reading = sensors.read_sensor(
        displacement,
        offset=offset,
        noise=chain.displacement_noise_m,
        resolution=chain.displacement_resolution_m,
        rng=rng,
    )
    reading, damaged = sensors.damage_samples(
        reading, chain.damaged_samples, chain.displacement_damage_m, rng
    )
    return reading, {"output_offset_m": offset, "damaged_output": _join(damaged)}


def _join(indices: tuple[int, ...]) -> str:
    return " ".join(str(index) for index in indices)


def _simulate_servo(servo: ServoMachine) -> tuple[VirtualMeasurement, ...]:
    resistances = [
        circuit.series_resistance(servo, current) for current in servo.currents_A
    ] or [servo.resistance_ohm]
    seeds = np.random.SeedSequence(servo.seed).spawn(len(resistances))
    return tuple(
        _measure_servo(servo, number, resistance, np.random.default_rng(seed))
        for number, (resistance, seed) in enumerate(
            zip(resistances, seeds, strict=True), start=1
        )
    )


def _measure_servo(
    servo: ServoMachine, number: int, resistance: float, rng: np.random.Generator
) -> VirtualMeasurement:
    """Run one recording of the servo: source switched on, current and travel read."""
    times = servo.sample_time_s * np.arange(servo.samples)
    states = circuit.switch_on(servo, resistance, times)
    columns = [states[:, 0], servo.wheel_radius_m * states[:, 1]]
    current, displacement = (
        sensors.read_sensor(
            column,
            offset=0.0,
            noise=servo.noise_relative * float(np.max(np.abs(column))),
            resolution=0.0,
            rng=rng,
        )
        for column in columns
    )
    return VirtualMeasurement(
        name=f"step_{number:02d}",
        kind="step",
        time_s=times,
        input=current,
        output=displacement,
        plan={
            "nominal_current_A": servo.source_voltage_V / resistance,
            "resistance_ohm": resistance,
            "switched_on_s": servo.rest_s,
        },
    )


@dataclass(frozen=True, eq=False)
class _Given:
    """A machine to simulate; no recording goes in."""

    machine: GunMachine | ServoMachine
    recordings: tuple[()] = ()


def _choose(context: Context) -> _Given:
    return _Given(_machine(context.experiment))


def _machine(experiment: Experiment) -> GunMachine | ServoMachine:
    if experiment.simulate is None:
        raise ConfigError(
            f"{experiment.source}: simulate: missing; expected a machine to "
            "simulate; add the section (configs/README.md explains it), or simulation: "
            "where measurements exist"
        )
    return experiment.simulate


def _key(given: _Given) -> str:
    return task_key("simulate", STAGE_VERSION, given.machine, [])


def _compute(given: _Given, _: Runner) -> tuple[VirtualMeasurement, ...]:
    return simulate_machine(given.machine)


def _write(
    path: Path, _: _Given, result: tuple[VirtualMeasurement, ...], origin: Provenance
) -> None:
    write_virtual_measurements(path.parent, result, key=origin.key)


def _summary(_: _Given, result: Any, is_stored: bool) -> str:
    if is_stored:
        return "measurements from the cache"
    return f"{len(result)} measurements computed"


STAGE = Stage(
    name="simulate",
    choose=_choose,
    key=_key,
    compute=_compute,
    storage=Storage("raw", read_virtual_key, lambda path: None, _write, is_hdf5=False),
    require=_machine,
    sections=("simulate",),
    summary=_summary,
    files=("raw",),
)
