"""A stage with LuGre friction that a stiff integrator has moved, diagnosed."""

import numpy as np
import pytest

from hwid_cli import Recording, diagnose
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from tests.drive.test_bristles import CONSTANT, DAMPING, MASS, STIFFNESS, published

STEP_S, N, NOISE = 1e-3, 500, 1e-5
TRUE = {
    "force_N": 1.2,
    "yield_m": 2e-4,
    "static_excess_N": 0.6,
    "velocity_m_per_s": 0.01,
    "damping_N_s_per_m": 30.0,
}
TIME = STEP_S * np.arange(N)


def commands():
    for row, size in enumerate((1.0, -2.0, 4.0)):
        corners = [0, 0.04, 0.12 + 0.02 * row, 0.24, 0.4, 0.5]
        yield np.interp(TIME, corners, np.array([0, 0, 1, 1, -0.6, 0]) * size)
    for frequency, size in ((3.0, 1.5), (6.0, 3.0), (9.0, 2.0)):
        yield (size * np.sin(2 * np.pi * frequency * np.maximum(TIME - 0.04, 0)))
    for seed in range(3):
        rng = np.random.default_rng(seed)
        yield np.interp(
            TIME, np.linspace(0, 0.5, 11), np.r_[0, 0, rng.uniform(-3, 3, 9)]
        )


def stage():
    rng = np.random.default_rng(7)
    return [
        Recording(
            f"move_{row}", command,
            published(TRUE, TIME, (TIME, command)) + NOISE * rng.standard_normal(N),
            STEP_S, kind="other",
        )
        for row, command in enumerate(commands())
    ]  # fmt: skip


@pytest.mark.thorough
def test_lugre_friction_is_named_with_its_parameters():
    found = diagnose(
        stage(),
        SimulationOptions(
            mass_kg=MASS, damping_N_s_per_m=1.1 * DAMPING,
            stiffness_N_per_m=0.95 * STIFFNESS, force_constant_N_per_A=CONSTANT,
        ),
        DiagnoseOptions(
            effects=(
                "coulomb_friction", "stribeck_friction", "hysteresis", "input_delay",
                "quadratic_drag",
            )
        ),
    )  # fmt: skip
    assert (found.verdict, found.complete) == ("named", True)
    (effect,) = found.effects
    assert effect.id == "hysteresis"
    assert "LuGre" in effect.sentence
    values = {one.name: one for one in effect.parameters}
    assert values["force_N"].value == pytest.approx(TRUE["force_N"], rel=0.02)
    assert values["yield_m"].value == pytest.approx(TRUE["yield_m"], rel=0.05)
    assert set(values) == set(TRUE)
    for name, true in TRUE.items():
        reach = 0.5 * (values[name].high - values[name].low)
        # 1.96 deviations are half an interval: 3 of them.
        assert abs(values[name].value - true) < 1.5 * reach, name
    assert found.after.ratio_to_noise < 1.1 < 2.0 < found.before.ratio_to_noise
