"""A map of the user's own: a Python function with its derivatives.

The text of its file runs once in every process that uses it. It must define a
`MapFunction` of the stated name, which is checked against itself then: shapes, finite
numbers, and derivatives against central differences.

References
----------
docs/method.md, eq. (4f).
"""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import lru_cache
from typing import NoReturn

import numpy as np

from hwid_cli.errors import ConfigError
from hwid_cli.model.maps.rule import MapRule, Part, Portable, Shape
from hwid_cli.records.maps import MapFunction, MapOptions, OwnFunction, StaticMap

# Arguments at which a function is checked, and by how much they lie off round numbers,
# at which a function may have a corner, as a share of their distance.
_CHECKED, _OFF = 41, 0.137
# Step of the central differences as a share of what is varied, and the share of the
# largest derivative by which they may differ: rounding leaves 1e-9, curvature 1e-10.
_STEP, _TOLERANCE = 1e-6, 1e-4
# Share of the largest value that may be rounding in a difference of two.
_ROUNDING = 1e-13


@lru_cache(maxsize=16)
def load(name: str, source: str) -> MapFunction:
    """Run a function's text and check what it defines, once in a process.

    Raises
    ------
    ValueError
        If the text does not run, or does not define a map function that agrees with
        itself. One line that says where and what.
    """
    scope: dict[str, object] = {"__name__": "hwid_own_function"}
    try:
        with _exits_refused():
            exec(compile(source, f"<own function {name}>", "exec"), scope)
    except (Exception, SystemExit) as error:
        raise ValueError(f"its text does not run: {_said(error)}") from error
    function = scope.get(name)
    if not isinstance(function, MapFunction):
        found = "no such name" if name not in scope else type(function).__name__
        raise ValueError(
            f"found {found}; expected {name} = MapFunction(value=..., by_argument=..., "
            "by_parameters=..., start=...) with: from hwid_cli import MapFunction"
        )
    for start in starting_parameters(function):
        _check_at(function, start)
    return function


@contextmanager
def _exits_refused() -> Iterator[None]:
    """Let a function's text raise where it would end the process without a word."""

    def refuse(code: int = 0) -> NoReturn:
        raise SystemExit(code)

    before, os._exit = os._exit, refuse  # type: ignore[assignment]
    try:
        yield
    finally:
        os._exit = before


def starting_parameters(function: MapFunction) -> np.ndarray:
    """Starts of a function, one a row.

    Returns
    -------
    ndarray, shape (n_starts, n_parameters)

    Raises
    ------
    ValueError
        If they are no finite numbers in rows of equal length, or the names or the
        range do not fit them.
    """
    try:
        starts = np.atleast_2d(np.array(function.start, dtype=float))
    except (TypeError, ValueError):
        starts = np.empty((0, 0))
    if starts.ndim != 2 or starts.size == 0 or not np.isfinite(starts).all():
        raise ValueError(
            f"start: found {function.start!r}; expected at least one finite number, or "
            "rows of equal length"
        )
    if len(function.names) not in (0, starts.shape[1]):
        raise ValueError(
            f"names: found {len(function.names)}; expected {starts.shape[1]}, one for "
            "each parameter"
        )
    low, high = function.check_range
    if not (np.isfinite([low, high]).all() and low < high):
        raise ValueError(
            f"check_range: found {function.check_range!r}; expected two finite numbers, "
            "the lower one first"
        )
    return starts


def _check_at(function: MapFunction, start: np.ndarray) -> None:
    """Refuse a function that does not agree with itself at a start."""
    low, high = function.check_range
    width = (high - low) / _CHECKED
    at = low + width * (np.arange(_CHECKED) + 0.5 + _OFF)
    value = _called(function, "value", (at, start), (at.size,))
    slope = _called(function, "by_argument", (at, start), (at.size,))
    columns = _called(function, "by_parameters", (at, start), (at.size, start.size))
    step = _STEP * max(abs(low), abs(high))
    above, below = (
        _called(function, "value", (at + sign * step, start), value.shape)
        for sign in (1.0, -1.0)
    )
    _compare("by_argument", slope, (above, below, step), at)
    usual = float(np.max(np.abs(start))) or 1.0
    for k in range(start.size):
        change = np.zeros(start.size)
        change[k] = _STEP * (abs(start[k]) or usual)
        above, below = (
            _called(function, "value", (at, start + sign * change), value.shape)
            for sign in (1.0, -1.0)
        )
        sides = (above, below, change[k])
        _compare(f"by_parameters, column {k}", columns[:, k], sides, at)


def _called(
    function: MapFunction,
    part: str,
    arguments: tuple[np.ndarray, np.ndarray],
    shape: tuple[int, ...],
) -> np.ndarray:
    """What a part of the function gives, refused where it cannot be used."""
    try:
        with np.errstate(all="ignore"), _exits_refused():
            given = np.asarray(getattr(function, part)(*arguments), dtype=float)
    except (Exception, SystemExit) as error:
        raise ValueError(f"{part} does not run: {_said(error)}") from error
    if given.shape != shape:
        raise ValueError(f"{part}: found shape {given.shape}; expected {shape}")
    if not np.isfinite(given).all():
        at = arguments[0][~np.isfinite(given.reshape(shape[0], -1)).all(axis=1)][0]
        raise ValueError(
            f"{part}: found a value that is not finite at v = {at:g}; expected finite "
            "ones over check_range"
        )
    return given


def _compare(
    part: str,
    stated: np.ndarray,
    sides: tuple[np.ndarray, np.ndarray, float],
    at: np.ndarray,
) -> None:
    """Refuse a derivative that the values a step above and below contradict."""
    above, below, step = sides
    difference = (above - below) / (2.0 * step)
    gap = np.abs(stated - difference)
    worst = int(np.argmax(gap))
    rounding = _ROUNDING * float(np.max(np.abs([above, below]))) / step
    if gap[worst] > _TOLERANCE * np.max(np.abs(difference)) + rounding:
        raise ValueError(
            f"{part}: found {stated[worst]:.6g} at v = {at[worst]:.4g}; expected "
            f"{difference[worst]:.6g}, the central difference of value; correct it, or "
            "move check_range or start off the place where there is no derivative"
        )


def _said(error: BaseException) -> str:
    """An exception in one line."""
    line = " ".join(str(error).split())
    if isinstance(error, SystemExit):
        return f"it called exit({line})"
    return f"{type(error).__name__}: {line}" if line else type(error).__name__


def _function(one: StaticMap) -> tuple[MapFunction, float]:
    own = _required(one.function)
    return load(own.name, own.source), own.unit


def _required(own: OwnFunction | None) -> OwnFunction:
    if own is None:
        raise ValueError("an own function needs its text")
    return own


def _evaluate(one: StaticMap, argument: np.ndarray) -> np.ndarray:
    function, unit = _function(one)
    argument = np.asarray(argument, dtype=float)
    try:
        with np.errstate(all="ignore"), _faults_named(one, "value"):
            value = np.asarray(
                function.value(argument / unit, one.parameters), dtype=float
            )
    except (ArithmeticError, ValueError):
        # No value for these parameters: the search rejects the step.
        return np.full(argument.shape, np.nan)
    return unit * value


@contextmanager
def _faults_named(one: StaticMap, part: str) -> Iterator[None]:
    """Turn what a function raises, or its try to end the process, into one line."""
    try:
        with _exits_refused():
            yield
    except (ArithmeticError, ValueError):
        raise
    except (Exception, SystemExit) as error:
        raise ConfigError(
            f"own function {_required(one.function).name!r}: {part} does not run: "
            f"{_said(error)}; expected numbers, whatever the parameters; found at "
            f"parameters {one.parameters.tolist()}; correct its file"
        ) from error


def _differentiate(
    one: StaticMap,
    argument: np.ndarray,
    with_positions: bool,  # noqa: ARG001 - a rule's signature
    out: np.ndarray,
    first: int,
) -> tuple[np.ndarray, np.ndarray]:
    function, unit = _function(one)
    at, p = argument / unit, one.parameters
    with np.errstate(all="ignore"), _faults_named(one, "a derivative"):
        columns = unit * np.asarray(function.by_parameters(at, p), dtype=float)
        slope = np.array(function.by_argument(at, p), dtype=float)
    out[:, first : first + p.size] = columns
    return _evaluate(one, argument), slope


def _starts(
    options: MapOptions,
    lowest: float,
    highest: float,
    shape: Shape,  # noqa: ARG001 - a rule's signature
) -> tuple[StaticMap, ...]:
    own = _required(options.function)
    return tuple(
        StaticMap("own_function", row, (lowest, highest), own)
        for row in starting_parameters(load(own.name, own.source))
    )


def _names(one: StaticMap) -> tuple[str, ...]:
    names = _function(one)[0].names
    return tuple(names) or tuple(f"p[{i}]" for i in range(one.parameters.size))


RULE = MapRule(
    evaluate=_evaluate,
    differentiate=_differentiate,
    starts=_starts,
    names=_names,
    # Parameters of any kind and unit.
    has_common_sizes=False,
    # Only Python can run it.
    portable=Portable(
        (Part("parameters", lambda total: total, "As the function says."),)
    ),
)
