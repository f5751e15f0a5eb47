"""Play between motor and load, from equations and an integrator of their own.

Two inertias of 0.003 and 0.009 kg m^2, teeth of 400 N m/rad with a half gap of 0.02 rad;
a torque is the input, the load's angle the output, with white noise of 0.8 mrad. With a
spring of 1.5 N m/rad, and free. ``python -m tests.benchmarks.bench_play`` prints what
`hwid diagnose` finds, from one process: five minutes.
"""

import time
from dataclasses import replace

import numpy as np
from scipy.integrate import solve_ivp

from hwid_cli import Recording, diagnose
from hwid_cli.records.experiment import SimulationOptions

STEP_S, N = 2e-3, 1500
INERTIA, MOTOR_SHARE = 0.012, 0.25
TEETH, HALF_GAP, DAMPING_RATIO = 400.0, 0.02, 0.137
DAMPING, NOISE = 0.03, 8e-4
TRUE = (HALF_GAP, TEETH, MOTOR_SHARE, DAMPING_RATIO)


def torques(rng):
    """Steps there and back, sines and multisines after a rest, by name."""
    time_s = STEP_S * np.arange(N)
    found = {}
    for number, size in enumerate((0.5, 1.0, -0.8), 1):
        found[f"step_{number}"] = np.select(
            [time_s > 1.6, time_s > 0.2], [-0.5 * size, size]
        )
    for number, (size, hz) in enumerate(((0.6, 1.0), (1.0, 2.5), (0.4, 4.0)), 1):
        found[f"sine_{number}"] = size * np.sin(2 * np.pi * hz * (time_s - 0.2))
    for number, size in enumerate((0.25, 0.4, 0.15), 1):
        lines = [
            np.sin(2 * np.pi * hz * time_s + rng.uniform(0, 6.28))
            for hz in np.arange(0.5, 12, 0.7)
        ]
        total = np.sum(lines, axis=0)
        found[f"random_{number}"] = size * total / total.std()
    for name in found:
        if not name.startswith("step"):
            found[name][:100] = 0.0
    return found


def angle(torque, spring):
    """Angle of the load, by an integrator for stiff equations."""
    time_s = STEP_S * np.arange(N)
    motor, load = MOTOR_SHARE * INERTIA, (1 - MOTOR_SHARE) * INERTIA
    loss = 2 * DAMPING_RATIO * np.sqrt(TEETH * motor * load / INERTIA)

    def moves(t, state):
        xm, vm, x, v = state
        twist, push = xm - x, 0.0
        if twist > HALF_GAP:
            push = max(TEETH * (twist - HALF_GAP) + loss * (vm - v), 0.0)
        elif twist < -HALF_GAP:
            push = min(TEETH * (twist + HALF_GAP) + loss * (vm - v), 0.0)
        drive = np.interp(t, time_s, torque)
        return [vm, (drive - push) / motor, v, (push - DAMPING * v - spring * x) / load]

    found = solve_ivp(
        moves, (0, time_s[-1]), [0.0] * 4, t_eval=time_s, method="LSODA",
        max_step=2e-4, rtol=1e-8, atol=1e-10,
    )  # fmt: skip
    return found.y[2]


def measured(seed, spring):
    rng = np.random.default_rng(seed)
    return [
        Recording(
            name, torque, angle(torque, spring) + rng.normal(0, NOISE, N), STEP_S,
            kind=name.split("_")[0], input_unit="N m", output_unit="rad",
        )
        for name, torque in torques(rng).items()
    ]  # fmt: skip


def shown(diagnosis, effects):
    told = [
        (one.value, one.low, one.high)
        for effect in effects
        for one in effect.parameters
    ]
    if len(told) != len(TRUE):
        return f"{diagnosis.verdict}: {[one.id for one in effects]}"
    inside = sum(low <= v <= high for v, (_, low, high) in zip(TRUE, told, strict=True))
    values = ", ".join(
        f"{value:.4g} [{low:.4g}, {high:.4g}]" for value, low, high in told
    )
    return (
        f"{diagnosis.verdict}, {diagnosis.after.ratio_to_noise:.3f} times the noise: "
        f"{values}; {inside} of 4 intervals hold"
    )


def main():
    print(f"true: {TRUE}")
    for spring in (1.5, 0.0):
        plain = SimulationOptions(
            inertia_kg_m2=INERTIA, damping_N_m_s_per_rad=DAMPING,
            stiffness_N_m_per_rad=spring, torque_constant_N_m_per_A=1.0,
        )  # fmt: skip
        off = {
            "half_gap_m": 0.0163, "stiffness_N_per_m": 229.0, "motor_share": 0.264,
            "contact_damping_ratio": 0.169,
        }  # fmt: skip
        for seed in (1, 2, 3):
            recordings = measured(seed, spring)
            for what, given in (
                ("named", plain),
                ("given, off", replace(plain, effects={"gear_backlash": off})),
            ):
                begun = time.perf_counter()
                found = diagnose(recordings, given, jobs=2)
                effects = found.effects or found.present
                seconds = time.perf_counter() - begun
                print(
                    f"spring {spring} draw {seed} {what}: {shown(found, effects)}; "
                    f"{seconds:.0f} s",
                    flush=True,
                )


if __name__ == "__main__":
    main()
