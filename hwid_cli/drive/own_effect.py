"""Effects of the user's own as entries beside those of the catalogue.

Their start values are fitted to the force (or the reading, or the input) that the
simulation lacks along the recordings, before any of them is simulated.
docs/method_diagnosis.md, eq. (D34).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from itertools import product
from math import inf

import numpy as np
import scipy

from hwid_cli.drive import formula as text
from hwid_cli.drive import slots
from hwid_cli.drive.effect import Effect, Formula, Missing, Parameter, Scales, Values
from hwid_cli.records.own_effects import ACTS_ON, OwnEffect, OwnParameter, own_of

# First values that are tried, as shares of what the unit suggests, and how many sets of
# them; the best ones are kept as starts.
_SHARES = (0.1, 1.0)
_MOST_TRIED = 16
_KEPT = 2
_EVALUATIONS = 40
# A parameter whose unit says nothing is near 1.
_NO_EXPONENTS = (0.0, 0.0, 0.0, 0.0)
_RIDGE = 1e-3


@cache
def own_effect(identifier: str) -> Effect:
    """Entry of an effect of the user's own.

    Parameters
    ----------
    identifier : str
        From ``own_id``.

    Raises
    ------
    Refused
        If its formula cannot be read.
    """
    _, stated = own_of(identifier)
    node = text.parsed(stated.formula)
    acts_on = ACTS_ON[stated.key]
    if acts_on == "input" and not text.names(node) & {"x", "v"}:
        enters = "command"
    else:
        enters = "output" if acts_on == "output" else "motion"
    symbol = {"force": "F", "input": "i", "output": "y"}[acts_on]
    return Effect(
        id=identifier,
        sentence=stated.sentence or f"a formula of the configuration ({stated.key})",
        equation=f"{symbol} = {text.as_text(node)}",
        enters=enters,
        parameters=tuple(_parameter(*item) for item in stated.parameters.items()),
        seen=lambda scales: starts(stated, scales),
        moves_at_rest="t" in text.names(node) and acts_on == "force",
        formula=Formula(acts_on, node),
        strength=strength(stated),
    )


def _parameter(name: str, stated: OwnParameter) -> Parameter:
    low, high = stated.bounds or (-inf, inf)
    if stated.positive:
        low = max(low, 0.0)
    return Parameter(
        name,
        lambda scales: (first_value(stated, scales),),
        lambda scales: (low, high),
        is_positive=stated.positive,
        unit=stated.unit,
    )


def strength(stated: OwnEffect) -> str:
    """Name of the parameter without which the effect is least.

    The one at 0 of which the formula leaves least; of several, the first.
    """
    node = text.parsed(stated.formula)
    rng = np.random.default_rng(1)
    at = {name: rng.uniform(0.5, 1.5, 50) for name in text.VARIABLES}
    at["v"] = at["v"] * rng.choice([-1.0, 1.0], 50)
    without = {"force_N": 0.0, "input": at["u"], "output": at["x"]}[stated.key]
    left = {}
    for name in stated.parameters:
        values: dict[str, float] = {**dict.fromkeys(stated.parameters, 1.0), name: 0.0}
        found = np.asarray(text.evaluate(node, {**at, **values})) - without
        size = float(np.sum(np.square(found)))
        left[name] = size if np.isfinite(size) else inf
    return min(left, key=lambda name: left[name])


def first_value(stated: OwnParameter, scales: Scales) -> float:
    """A value of the size that its unit suggests, within its bounds."""
    if stated.start is not None:
        return stated.start
    mass, length, time, current = stated.exponents or _NO_EXPONENTS
    # kg = N s^2/m, and s = m/(m/s).
    a_time = scales.displacement_m / scales.velocity_m_per_s
    size = scales.force_N**mass * scales.displacement_m ** (length - mass)
    size *= a_time ** (time + 2 * mass) * scales.current_A**current
    low, high = stated.bounds or (-inf, inf)
    return float(min(max(size, low), high))


def starts(stated: OwnEffect, scales: Scales) -> tuple[dict[str, float], ...]:
    """Start values: those that are given, or what comes nearest to what is missing.

    Returns
    -------
    tuple of dict of str to float
        The best first.
    """
    first = {name: first_value(one, scales) for name, one in stated.parameters.items()}
    free = [name for name, one in stated.parameters.items() if one.start is None]
    if not free or scales.missing is None:
        return (first,)
    fitted = _Fitted(stated, scales.missing, first, tuple(free))
    found = sorted(
        (fitted.from_shares(shares) for shares in _tried(stated, free)),
        key=lambda one: one[0],
    )
    kept: list[dict[str, float]] = []
    for _, values in found:
        if not any(_is_near(values, other) for other in kept):
            kept.append(values)
        if len(kept) == _KEPT:
            break
    return tuple(kept)


def _tried(stated: OwnEffect, free: Sequence[str]) -> list[tuple[float, ...]]:
    """Shares of the first values, of either sign where it is open; not too many."""
    choices = [
        _SHARES
        if stated.parameters[name].positive
        else (*_SHARES, *(-s for s in _SHARES))
        for name in free
    ]
    every = list(product(*choices))
    if len(every) <= _MOST_TRIED:
        return every
    rows = np.random.default_rng(1).choice(len(every), _MOST_TRIED, replace=False)
    return [every[int(row)] for row in rows]


def _is_near(one: Values, other: Values) -> bool:
    return all(
        abs(one[name] - other[name]) <= 0.05 * (abs(one[name]) + abs(other[name]))
        for name in one
    )


@dataclass(frozen=True, eq=False)
class _Fitted:
    """A formula fitted to what is missing, apart from what the base can take over."""

    stated: OwnEffect
    missing: Missing
    first: Mapping[str, float]
    free: tuple[str, ...]

    def from_shares(self, shares: Sequence[float]) -> tuple[float, dict[str, float]]:
        """Sum of squares that is left, and the values."""
        sizes = np.array([abs(self.first[name]) or 1.0 for name in self.free])
        start = np.array(shares) * sizes
        low, high = self._limits(sizes)
        start = np.clip(start, low, high)
        wanted, absorbed = self._wanted()
        whole = float(np.sqrt(wanted @ wanted)) or 1.0
        node = text.parsed(self.stated.formula)
        at = self.missing.variables

        def left(scaled: np.ndarray) -> np.ndarray:
            values = {**self.first, **self._named(scaled * sizes)}
            found = np.broadcast_to(text.evaluate(node, {**at, **values}), wanted.shape)
            change = self.missing.change(self.stated.key, found)
            change = np.nan_to_num(change, nan=1e6, posinf=1e6, neginf=-1e6)
            rest = wanted - (change - absorbed @ (absorbed.T @ change))
            return np.r_[rest / whole, _RIDGE * (scaled - start / sizes)]

        found = scipy.optimize.least_squares(
            left, start / sizes, bounds=(low / sizes, high / sizes),
            max_nfev=_EVALUATIONS, x_scale="jac",
        )  # fmt: skip
        return float(found.cost), {**self.first, **self._named(found.x * sizes)}

    def _named(self, values: np.ndarray) -> dict[str, float]:
        return dict(zip(self.free, (float(one) for one in values), strict=True))

    def _limits(self, sizes: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        lows, highs = [], []
        for name, size in zip(self.free, sizes, strict=True):
            one = self.stated.parameters[name]
            low, high = one.bounds or (-inf, inf)
            # Of a positive one something has to be there to start from.
            lows.append(max(low, 1e-6 * size) if one.positive else low)
            highs.append(high)
        return np.array(lows), np.array(highs)

    def _wanted(self) -> tuple[np.ndarray, np.ndarray]:
        """What is missing, without what the base's parameters may take over."""
        wanted = self.missing.wanted(self.stated.key)
        at = self.missing.variables
        columns = [np.ones(wanted.size), at["x"], at["v"], at["u"]]
        columns = [one / (float(np.max(np.abs(one))) or 1.0) for one in columns]
        absorbed = np.linalg.qr(np.column_stack(columns))[0]
        return wanted - absorbed @ (absorbed.T @ wanted), absorbed


def with_formulas(
    vector: np.ndarray, effects: Sequence[tuple[Effect, Values]]
) -> np.ndarray:
    """Vector of parameters with formulas behind its places.

    Parameters
    ----------
    vector : ndarray, shape (N_SLOTS,)
    effects : sequence of (Effect, mapping of str to float)
        Those with a formula.

    Returns
    -------
    ndarray, shape (at least N_SLOTS,)
    """
    if not effects:
        return vector
    of = _by_place(effects)
    force = of.get(slots.OWN_FORCE)
    sides = None if force is None else text.jumps_along(force)
    if sides is not None:
        of[slots.OWN_JUMPS] = sides
    depth = max(text.depth(one) for one in of.values())
    vector[slots.OWN_PILE] = vector.size
    parts, end = [vector, np.zeros(depth + 1)], vector.size + depth + 1
    for place, node in of.items():
        vector[place] = end
        steps = np.array(text.program(node))
        parts.append(steps)
        end += steps.size
    if force is not None:
        jumps, bends = text.edges(force)
        vector[slots.OWN_FRICTION] = float(text.has_friction(force))
        vector[slots.OWN_WAVES] = text.waves(force, "x")
        vector[slots.OWN_TURNING] = text.waves(force, "t")
        vector[slots.OWN_FINENESS] = _JUMP_STEPS * jumps
        vector[slots.OWN_BENDS] = float(bends)
    return np.concatenate(parts)


# Steps in a sample in which a force may jump: its places are not located.
_JUMP_STEPS = 8.0


def _by_place(effects: Sequence[tuple[Effect, Values]]) -> dict[int, text.Node]:
    """One formula for each place where formulas act."""
    forces: list[text.Node] = []
    chains: dict[int, text.Node] = {}
    for effect, values in effects:
        formula = effect.formula
        if formula is None:
            raise ValueError(f"effect {effect.id!r} has no formula")
        node = text.with_values(formula.node, values)
        if formula.acts_on == "force":
            forces.append(node)
        elif effect.enters == "motion":
            # What stands for the input and depends on the motion acts as a force.
            less = text.Node("-", parts=(node, text.Node("u")))
            forces.append(text.Node("*", parts=(text.Node("gain"), less)))
        else:
            place = slots.OWN_INPUT if enters_input(effect) else slots.OWN_OUTPUT
            through = "u" if enters_input(effect) else "x"
            before = chains.get(place)
            chains[place] = node if before is None else _put(node, through, before)
    if forces:
        chains[slots.OWN_FORCE] = text.sum_of(forces)
    return chains


def enters_input(effect: Effect) -> bool:
    """Whether it changes the command before all else."""
    return effect.enters == "command"


def _put(node: text.Node, name: str, inner: text.Node) -> text.Node:
    """The formula with another one in place of a variable."""
    if node == text.Node(name):
        return inner
    parts = tuple(_put(one, name, inner) for one in node.parts)
    return text.Node(node.name, node.value, parts)
