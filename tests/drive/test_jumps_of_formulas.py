"""Forces of formulas that jump along the way: met where they are, whatever lies between."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from hwid_cli.drive import formula as text
from hwid_cli.drive import slots
from hwid_cli.drive.simulation import drive_effects, parameter_vector, simulate_drive
from hwid_cli.records.drive import Drive
from hwid_cli.records.own_effects import OwnEffect, OwnParameter, own_id

DT, N = 1e-3, 1200
MASS, DAMPING, STIFFNESS, GAIN = 0.5, 6.0, 900.0, 8.0
U = 0.9 * np.sin(2 * np.pi * np.arange(N) * DT * np.linspace(1.0, 4.0, N))


def simulated(formula, values, u=U):
    stated = OwnEffect(
        force_N=formula, parameters={name: OwnParameter("N") for name in values}
    )
    drive = Drive(
        MASS, DAMPING, STIFFNESS, GAIN,
        reference_displacement_m=0.01, effects={own_id("mine", stated): values},
    )  # fmt: skip
    return simulate_drive(u, drive, sample_time_s=DT).output


def integrated(force, edges, u=U):
    """By another integration, which ends a stretch at every edge that is met."""
    t = DT * np.arange(u.size)

    def motion(time, state, side):
        x, v = state
        push = GAIN * np.interp(time, t, u) + force(side)
        return [v, (push - DAMPING * v - STIFFNESS * x) / MASS]

    def met(edge):
        def at(time, state, side):
            return state[0] - edge

        at.terminal = True
        return at

    now, state, found = 0.0, np.array([0.0, 0.0]), np.zeros(u.size)
    side = np.sign(-np.asarray(edges))
    while now < t[-1]:
        told = solve_ivp(
            motion, (now, t[-1]), state, args=(side,), rtol=1e-9, atol=1e-12,
            events=[met(edge) for edge in edges], dense_output=True, max_step=DT,
        )  # fmt: skip
        inside = (t >= now) & (t <= told.t[-1])
        if inside.any():
            found[inside] = told.sol(t[inside])[0]
        now, state = told.t[-1], told.y[:, -1]
        for n, events in enumerate(told.t_events):
            if events.size:
                side[n] = np.sign(state[1])
                # Off the edge: else it is met again at once.
                state[0] = edges[n] + 1e-13 * side[n]
    return found


@pytest.mark.parametrize(
    ("formula", "values", "force", "edges", "most"),
    [
        ("a*Heaviside(x - 0.0031)", {"a": -2.0}, lambda s: -(1 + s[0]), [0.0031], 2e-3),
        (
            "a*sign(x - 0.002) + a*sign(x + 0.0013)",
            {"a": 0.7},
            lambda s: 0.7 * (s[0] + s[1]),
            [0.002, -0.0013],
            1e-3,
        ),
        # A magnet's short reach: a drive is through it within a few samples.
        (
            "a*Heaviside(x - 0.003)*Heaviside(0.0033 - x)",
            {"a": 6.0},
            lambda s: 1.5 * (1 + s[0]) * (1 - s[1]),
            [0.003, 0.0033],
            0.06,
        ),
    ],
)
def test_a_jump_is_followed_as_by_an_integration_that_ends_at_it(
    formula, values, force, edges, most
):
    found, expected = simulated(formula, values), integrated(force, edges)
    plain = simulated(formula, dict.fromkeys(values, 0.0))

    effect = np.std(expected - plain)
    assert effect > 2e-5
    # Jumps are not located: steps are an eighth of a sample there. With whole ones errors
    # are twelve times as large.
    assert np.max(np.abs(found - expected)) < most * effect


def test_signs_of_the_position_are_told_apart_by_their_sum():
    node = text.with_values(
        text.parsed("a*sign(x - 1)*sign(v) + Heaviside(x - 2)*exp(x) + sign(x - 1)"),
        {"a": 2.0},
    )
    sides = text.jumps_along(node)
    values = [float(text.evaluate(sides, {"x": x})) for x in (0.0, 1.0, 1.5, 2.0, 3.0)]
    assert len(set(values)) == len(values)


@pytest.mark.parametrize("formula", ["sign(x - u)", "sign(u) + sign(x)", "-sign(v)*x"])
def test_jumps_that_do_not_go_with_the_position_alone_may_be_anywhere(formula):
    assert text.jumps_along(text.parsed(formula)) is None


@pytest.mark.parametrize(
    ("formula", "is_told"), [("a*Heaviside(x - 0.001)", True), ("a*sign(x - u)", False)]
)
def test_the_loops_are_told_where_a_force_jumps(formula, is_told):
    stated = OwnEffect(force_N=formula, parameters={"a": OwnParameter("N")})
    drive = Drive(
        MASS, DAMPING, STIFFNESS, GAIN, effects={own_id("m", stated): {"a": 1.0}}
    )
    vector = parameter_vector(drive, drive_effects(drive))

    assert bool(vector[slots.OWN_JUMPS]) is is_told
    assert vector[slots.OWN_FINENESS] > 1.0
