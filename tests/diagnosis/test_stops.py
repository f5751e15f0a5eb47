"""A slide with stops of other laws: solved by the classical Runge-Kutta method."""

import numpy as np
import pytest

from hwid_cli import Recording, diagnose
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions

STEP_S, N, FINE, NOISE = 5e-4, 1600, 40, 5e-5
MASS, DAMPING, STIFFNESS, FORCE_CONSTANT = 0.8, 25.0, 3000.0, 40.0
# Position [m], stiffness [N/m], damping [s/m].
UPPER, LOWER = (0.009, 8e5, 0.5), (-0.006, 3e5, 0.5)
# Position [m], stiffness [N/m], damping [N s/m].
ELECTRODE = (0.007, 6e4, 70.0)
GIVEN = SimulationOptions(
    mass_kg=MASS,
    damping_N_s_per_m=22.0,
    stiffness_N_per_m=3150.0,
    force_constant_N_per_A=37.0,
    hold="linear",
)


def commands():
    """Steps, stairs, a triangle and sines of a current, as many columns, [A]."""
    time_s = STEP_S * np.arange(N)
    moving = time_s > 0.05

    def levels(*values):
        return np.repeat(values, -(-N // len(values)))[:N]

    def sine(amplitude, hertz):
        return amplitude * moving * np.sin(2 * np.pi * hertz * (time_s - 0.05))

    return {
        "step_big": levels(0, 1.1, 0, -1.1, 0),
        "step_small": levels(0, 0.4, -0.4, 0.25),
        "stairs": levels(0, 0.25, 0.5, 0.8, 1.0, 0.5, 0, -0.5, -0.9, -0.3),
        "sine_slow": sine(0.9, 3.4),
        "sine_mid": sine(0.55, 7.8),
        "sine_fast": sine(1.0, 16.5),
    }


def between_stops(x, v):
    """Of both stops, on all slides, [N]: depth times stiffness, damped, never pulling."""
    (upper, k_upper, c_upper), (lower, k_lower, c_lower) = UPPER, LOWER
    push = np.maximum(k_upper * (x - upper) * (1 + c_upper * v), 0) * (x > upper)
    pull = np.maximum(k_lower * (lower - x) * (1 - c_lower * v), 0) * (x < lower)
    return pull - push


def against_electrode(x, v):
    """Of a spring with a dashpot beside it, on all slides, [N]; never pulling."""
    edge, stiffness, damping = ELECTRODE
    return -np.maximum(stiffness * (x - edge) + damping * v, 0) * (x > edge)


def measured(force):
    """What a sensor reads of the slide under all commands.

    Parameters
    ----------
    force : callable
        Of the stops, from positions and velocities.
    """
    names = list(commands())
    u = np.array([commands()[name] for name in names])
    x, v, h = np.zeros(len(names)), np.zeros(len(names)), STEP_S / FINE
    read = np.zeros_like(u)

    def rates(x, v, current):
        pushed = FORCE_CONSTANT * current - STIFFNESS * x - DAMPING * v + force(x, v)
        return v, pushed / MASS

    for n in range(1, N):
        rise = (u[:, n] - u[:, n - 1]) / FINE
        for j in range(FINE):
            begin = u[:, n - 1] + j * rise
            x1, v1 = rates(x, v, begin)
            x2, v2 = rates(x + h / 2 * x1, v + h / 2 * v1, begin + rise / 2)
            x3, v3 = rates(x + h / 2 * x2, v + h / 2 * v2, begin + rise / 2)
            x4, v4 = rates(x + h * x3, v + h * v3, begin + rise)
            x = x + h / 6 * (x1 + 2 * x2 + 2 * x3 + x4)
            v = v + h / 6 * (v1 + 2 * v2 + 2 * v3 + v4)
        read[:, n] = x
    read += NOISE * np.random.default_rng(9).standard_normal(read.shape)
    return [
        Recording(name, current, output, STEP_S)
        for name, current, output in zip(names, u, read, strict=True)
    ]


@pytest.mark.slow
def test_two_unequal_stops_are_one_kind_of_stop_twice():
    allowed = ("end_stop", "one_sided_stop", "coulomb_friction")
    options = DiagnoseOptions(effects=allowed, max_effects=2)
    found = diagnose(measured(between_stops), GIVEN, options)
    assert [one.id for one in found.effects] == ["one_sided_stop"] * 2
    assert found.complete
    sides = sorted(
        ({p.name: p for p in one.parameters} for one in found.effects),
        key=lambda one: one["position_m"].value,
    )
    for side, (position, stiffness, damping) in zip(sides, (LOWER, UPPER), strict=True):
        assert side["position_m"].value == pytest.approx(position, rel=2e-3)
        assert side["stiffness_N_per_m"].value == pytest.approx(stiffness, rel=0.1)
        assert side["damping_s_per_m"].low < damping < side["damping_s_per_m"].high


@pytest.mark.thorough
def test_a_stop_with_a_dashpot_is_one_stop():
    allowed = ("end_stop", "one_sided_stop", "cubic_stiffness", "coulomb_friction")
    found = diagnose(
        measured(against_electrode), GIVEN, DiagnoseOptions(effects=allowed)
    )
    assert [one.id for one in found.effects] == ["one_sided_stop"]
    assert found.complete
    values = {one.name: one for one in found.effects[0].parameters}
    # The step of the reference goes into the contact once: 0.1 % of its damping.
    for name, true in zip(
        ("position_m", "stiffness_N_per_m", "damping_N_s_per_m"), ELECTRODE, strict=True
    ):
        assert values[name].value == pytest.approx(true, rel=5e-3)
