"""A machine with a force that nobody has named, integrated by other means.

``scipy.integrate.solve_ivp`` with events: the motion is followed in one direction until
the velocity is zero; there the force of both directions says whether the machine sticks,
and until when. Nothing of the program is used.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

RTOL, ATOL = 1e-9, 1e-12


@dataclass(frozen=True)
class Base:
    """Mass, damper, spring and motor."""

    mass: float = 0.3
    damping: float = 15.0
    stiffness: float = 1184.0
    gain: float = 5.0


@dataclass(frozen=True)
class Hidden:
    """What the machine has beside its base.

    Parameters
    ----------
    force : callable or None
        Of x, v, u, t and the direction of motion.
    sensor : callable or None
        What is read, of x, v, u and t.
    has_friction : bool
        Whether the force jumps with the direction.
    """

    force: object = None
    sensor: object = None
    has_friction: bool = False
    kinks: tuple = field(default=())


def measured(u, dt, base, hidden):
    """Position (or what is read of it) at every sample of an input."""
    time = dt * np.arange(u.size)

    def command(t):
        return np.interp(t, time, u)

    def force(x, v, t, way):
        return 0.0 if hidden.force is None else hidden.force(x, v, command(t), t, way)

    def balance(x, t, way):
        return base.gain * command(t) - base.stiffness * x + force(x, 0.0, t, way)

    x0 = _rest(base, force, command)
    states = np.zeros((u.size, 2))
    states[0] = x0, 0.0
    t, state = 0.0, np.array([x0, 0.0])
    way = 0 if hidden.has_friction else 1
    pieces = 0
    while t < time[-1]:
        pieces += 1
        if pieces > 20000:
            raise RuntimeError("too many events")
        if hidden.has_friction and way == 0:
            until, way = _leaves(state[0], t, time, balance)
            inside = (time > t) & (time <= until)
            states[inside] = state[0], 0.0
            t = until
            if way == 0:
                break
            continue
        t, state, turned = _slide(
            states, time, t, state, way, base, force, command, hidden
        )
        if turned:
            way = _next_way(state[0], t, balance)
    x, v = states.T
    if hidden.sensor is None:
        return x, v
    return hidden.sensor(x, v, u, time), v


def _rest(base, force, command):
    """Where the machine rests at first: friction holds no load there."""

    def left(x):
        ends = force(x, 0.0, 0.0, 1), force(x, 0.0, 0.0, -1)
        both = float(np.clip(0.0, min(ends), max(ends)))
        return base.gain * command(0.0) - base.stiffness * x + both

    if abs(left(0.0)) < 1e-15:
        return 0.0
    return brentq(left, -0.1, 0.1, xtol=1e-16)


def _next_way(x, t, balance):
    if balance(x, t, 1) > 0:
        return 1
    return -1 if balance(x, t, -1) < 0 else 0


def _leaves(x, t, time, balance):
    """When a sticking machine starts to move, and in which direction."""
    here = _next_way(x, t, balance)
    if here:
        return t, here
    row = int(np.searchsorted(time, t, side="right"))
    before = t
    for after in time[row:]:
        # The command is straight between samples: so is the balance, nearly.
        for share in (0.5, 1.0):
            at = before + share * (after - before)
            way = _next_way(x, at, balance)
            if way:
                low, high = before, at
                for _ in range(60):
                    middle = 0.5 * (low + high)
                    if _next_way(x, middle, balance):
                        high = middle
                    else:
                        low = middle
                return high, _next_way(x, high, balance)
        before = after
    return time[-1], 0


def _slide(states, time, t, state, way, base, force, command, hidden):
    """Follow the motion sample by sample until it turns."""
    row = int(np.searchsorted(time, t, side="right"))

    def rates(s, y):
        push = base.gain * command(s) - base.damping * y[1] - base.stiffness * y[0]
        direction = way if hidden.has_friction else np.sign(y[1])
        return [y[1], (push + force(y[0], y[1], s, direction)) / base.mass]

    def turning(s, y):
        return y[1]

    turning.terminal, turning.direction = True, -way
    events = [turning] if hidden.has_friction else None
    # As many samples at once as the step control can do; kinks of the command and of
    # the force are met by a limit on its steps.
    last = min(row + 25, time.size) - 1
    found = solve_ivp(
        rates,
        (t, time[last]),
        state,
        t_eval=time[row : last + 1],
        events=events,
        rtol=RTOL,
        atol=ATOL,
        max_step=time[1] - time[0],
        method="RK45",
    )
    if found.status < 0:
        raise RuntimeError(found.message)
    if len(found.t):
        states[row : row + len(found.t)] = found.y.T
    if found.status == 1:
        return found.t_events[0][0], np.array([found.y_events[0][0][0], 0.0]), True
    return time[last], found.y[:, -1], False
