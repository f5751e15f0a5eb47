"""Compiled interpreter of formulas of the user's own.

A formula is a list of numbers behind the places of the vector that the loops read
(``slots``): how many steps it has, then each step's code and number. Steps take what
they need from a pile of numbers, for which the vector holds room as well.
docs/method_diagnosis.md, eq. (D34).
"""

import numpy as np

from hwid_cli.compiled import INNER, compiled
from hwid_cli.drive import slots

# What a step may put on the pile, by the number beside its code. ``way`` is the direction
# of sliding, 0 at rest; ``gain`` the force constant.
VARIABLES = ("x", "v", "u", "t", "way", "gain")
(
    CONSTANT,
    VARIABLE,
    ADD,
    SUBTRACT,
    MULTIPLY,
    DIVIDE,
    POWER,
    MAX,
    MIN,
    # From here on steps change the last number only.
    NEGATE,
    SQUARE,
    CUBE,
    ABS,
    SIGN,
    HEAVISIDE,
    SIN,
    COS,
    EXP,
    LOG,
    SQRT,
    TAN,
    ATAN,
    SINH,
    COSH,
    TANH,
) = range(25)


@compiled(**INNER)
def formula_value(
    at: float,
    x: float,
    v: float,
    u: float,
    t: float,
    way: float,
    p: np.ndarray,
) -> float:
    """Return the value of a formula.

    Parameters
    ----------
    at : float
        Where in the vector it begins.
    x, v, u, t : float, [m], [m/s], [A] or [V], [s]
    way : float
        Direction of sliding, 0 at rest.
    p : ndarray, shape (at least N_SLOTS,)
        The pile in it is used as room to work in.
    """
    start = int(at)
    bottom = int(p[slots.OWN_PILE])
    top = bottom - 1
    for n in range(int(p[start])):
        step = int(p[start + 1 + 2 * n])
        number = p[start + 2 + 2 * n]
        if step == CONSTANT:
            top += 1
            p[top] = number
        elif step == VARIABLE:
            top += 1
            p[top] = _variable(int(number), x, v, u, t, way, p)
        elif step >= NEGATE:
            p[top] = _changed(step, p[top])
        else:
            top -= 1
            p[top] = _combined(step, p[top], p[top + 1])
    return p[bottom]


@compiled(**INNER)
def _variable(
    which: int,
    x: float,
    v: float,
    u: float,
    t: float,
    way: float,
    p: np.ndarray,
) -> float:
    """Return a variable by its number."""
    if which == 0:
        return x
    if which == 1:
        return v
    if which == 2:
        return u
    if which == 3:
        return t
    return way if which == 4 else p[slots.FORCE_CONSTANT]


@compiled(**INNER)
def _combined(step: int, a: float, b: float) -> float:
    """Return what becomes of two numbers."""
    if step == ADD:
        return a + b
    if step == SUBTRACT:
        return a - b
    if step == MULTIPLY:
        return a * b
    if step == DIVIDE:
        return a / b
    if step == POWER:
        return np.power(a, b)
    return max(a, b) if step == MAX else min(a, b)


@compiled(**INNER)
def _changed(step: int, a: float) -> float:
    """Return what becomes of a number."""
    if step == NEGATE:
        return -a
    if step == SQUARE:
        return a * a
    if step == CUBE:
        return a * a * a
    if step == ABS:
        return abs(a)
    if step == SIGN:
        return np.sign(a)
    if step == HEAVISIDE:
        return 0.5 + 0.5 * np.sign(a)
    if step == SIN:
        return np.sin(a)
    if step == COS:
        return np.cos(a)
    return _curved(step, a)


@compiled(**INNER)
def _curved(step: int, a: float) -> float:
    """Return what becomes of a number, by the rarer functions."""
    if step == EXP:
        return np.exp(a)
    if step == LOG:
        return np.log(a)
    if step == SQRT:
        return np.sqrt(a)
    if step == TAN:
        return np.tan(a)
    if step == ATAN:
        return np.arctan(a)
    if step == SINH:
        return np.sinh(a)
    return np.cosh(a) if step == COSH else np.tanh(a)
