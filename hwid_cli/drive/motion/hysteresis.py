"""Compiled friction that builds up along the way: Dahl, Bouc-Wen, and LuGre's bristles.

docs/method_diagnosis.md, eq. (D9), (D9a).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots
from hwid_cli.drive.motion.state import DEFLECTION, LEVEL, TURNED_AT, WAY

# Length of a step along the deflection of a hysteresis, in yield lengths, and what is
# left of it when it has yielded, [-].
SHAPE_STEP, YIELDED = 0.1, 1e-14
# Where the law of what is left has a solution of its own, to a part in 1e8 of the force.
NEARLY_YIELDED = 1e-3


@compiled(**INNER)
def yielded(x: float, v: float, memory: np.ndarray, p: np.ndarray) -> float:
    """Return the deflection of the hysteresis: 1 where it has yielded, at speed.

    Parameters
    ----------
    x, v : float, [m], [m/s]
    memory : ndarray, shape (N_MEMORY,)
    p : ndarray, shape (N_SLOTS,)
    """
    way = memory[WAY]
    if way == 0.0:
        return memory[DEFLECTION]
    gone = abs(x - memory[TURNED_AT]) / p[slots.HYSTERESIS_YIELD]
    if p[slots.HAS_BRISTLES] != 0.0:
        return way * _bent(way * memory[DEFLECTION], gone, v, memory, p)
    if p[slots.HAS_SHAPE] != 0.0:
        return way * _yielded_in_shape(way * memory[DEFLECTION], gone, p)
    return way - (way - memory[DEFLECTION]) * np.exp(-gone)


@compiled(**INNER)
def bristle_level(v: float, p: np.ndarray) -> float:
    """Return the deflection at which bristles slide at a speed, [-].

    Parameters
    ----------
    v : float, [m/s]
    p : ndarray, shape (N_SLOTS,)
    """
    if p[slots.BRISTLE_EXCESS] == 0.0:
        return 1.0
    share = v / p[slots.BRISTLE_VELOCITY]
    return 1.0 + p[slots.BRISTLE_EXCESS] * np.exp(-share * share)


@compiled(**INNER)
def bending(v: float, deflection: float, memory: np.ndarray, p: np.ndarray) -> float:
    """Return how fast bristles bend, [m/s].

    Parameters
    ----------
    v : float, [m/s]
    deflection : float, [-]
    memory : ndarray, shape (N_MEMORY,)
    p : ndarray, shape (N_SLOTS,)
    """
    return v * (1.0 - memory[WAY] * deflection / bristle_level(v, p))


@compiled(**INNER)
def _bent(
    ahead: float, gone: float, v: float, memory: np.ndarray, p: np.ndarray
) -> float:
    """Return the deflection of bristles in the direction of motion.

    Their level g changes evenly along the way s: of z' = 1 - z / g follows that z - g dies
    away while -g' drives it.
    """
    before, now = memory[LEVEL], bristle_level(v, p)
    if gone <= 0.0:
        return ahead
    level = 0.5 * (before + now)
    lost = -np.expm1(-gone / level)
    off = (ahead - before) * (1.0 - lost)
    return now + off - (now - before) * level / gone * lost


@compiled(**INNER)
def yielding(ahead: float, p: np.ndarray) -> float:
    """Return how the deflection of a hysteresis of any shape grows, [1/yield length].

    Parameters
    ----------
    ahead : float, [-]
        Deflection in the direction of motion.
    p : ndarray, shape (N_SLOTS,)
    """
    share = np.power(abs(ahead), 1.0 + p[slots.HYSTERESIS_BEND])
    if ahead < 0.0:
        share *= (p[slots.HYSTERESIS_RATIO] - 1.0) / (p[slots.HYSTERESIS_RATIO] + 1.0)
    return 1.0 - share


@compiled(**INNER)
def _yielded_in_shape(ahead: float, gone: float, p: np.ndarray) -> float:
    """Return the deflection in the direction of motion after a way in yield lengths."""
    count = np.ceil(gone * (1.0 + p[slots.HYSTERESIS_BEND]) / SHAPE_STEP)
    h = gone / max(count, 1.0)
    left = gone
    while left > 0.5 * h:
        if 1.0 - ahead < NEARLY_YIELDED:
            return 1.0 - _left_to_yield(1.0 - ahead, left, p)
        step = h
        after = _shape_step(ahead, step, p)
        if ahead < 0.0 and after > 0.0:
            # The law has an edge at 0: there first, by Simpson's rule.
            rest = 1.0 / yielding(ahead, p) + 4.0 / yielding(0.5 * ahead, p)
            step = min(-ahead * (rest + 1.0) / 6.0, h)
            after = _shape_step(0.0, h - step, p)
        ahead = after
        left -= h
    return min(ahead, 1.0)


@compiled(**INNER)
def _left_to_yield(left: float, gone: float, p: np.ndarray) -> float:
    """Return what is left of a deflection near 1, where the law is nearly linear.

    With d = 1 - z the law is d' = -n d + n (n - 1) / 2 d^2, up to d^3.
    """
    fading = np.exp(-(1.0 + p[slots.HYSTERESIS_BEND]) * gone)
    bent = 0.5 * p[slots.HYSTERESIS_BEND] * left * (1.0 - fading)
    return left * fading / (1.0 - bent)


@compiled(**INNER)
def _shape_step(ahead: float, h: float, p: np.ndarray) -> float:
    """Return the deflection one Runge-Kutta step on."""
    k1 = yielding(ahead, p)
    k2 = yielding(ahead + 0.5 * h * k1, p)
    k3 = yielding(ahead + 0.5 * h * k2, p)
    k4 = yielding(ahead + h * k3, p)
    return ahead + h / 6.0 * (k1 + 2.0 * (k2 + k3) + k4)


@compiled(**INNER)
def remember(x: float, v: float, memory: np.ndarray, p: np.ndarray) -> None:
    """Keep how far a hysteresis of any shape has yielded, at the end of a step.

    Parameters
    ----------
    x, v : float, [m], [m/s]
    memory : ndarray, shape (N_MEMORY,)
        Changed in place.
    p : ndarray, shape (N_SLOTS,)
    """
    way = memory[WAY]
    if way == 0.0:
        return
    deflection = yielded(x, v, memory, p)
    if p[slots.HAS_BRISTLES] != 0.0:
        memory[DEFLECTION], memory[LEVEL] = deflection, bristle_level(v, p)
        memory[TURNED_AT] = x
        return
    memory[DEFLECTION] = way if 1.0 - way * deflection <= YIELDED else deflection
    memory[TURNED_AT] = x
