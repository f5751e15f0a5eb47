"""Parameters of a simulation that the recordings do not tell.

Where a simulation's mass, its gain and the forces in it all grow by one factor, its output
stays: recordings of input and output tell these ratios alone. So each parameter that the
derivatives leave open is moved on purpose, the others are fitted again, and the
simulation's own run says whether the recordings would show it.
docs/method_diagnosis.md, eq. (D32a).
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from hwid_cli.diagnosis.candidate import rebuilt
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.intervals import QUANTILE
from hwid_cli.diagnosis.parameters import simulate_at
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.simulator import DIFFERENCE, Runs, derivative
from hwid_cli.diagnosis.turns import acts_at_force, as_sent, forces_along, pushed
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.records.diagnosis import BaseParameter, FittedEffect, Law
from hwid_cli.records.programs import FreeParameter

# Factor by which a parameter is moved on purpose.
FACTOR = 1.2
# Relative standard deviation above which a parameter is moved.
_LEAST_DEVIATION = 0.02
# Above this one a parameter is hardly told, and has no interval.
_HARDLY_TOLD = 1.0
# Squares of the noise by which a run has to differ for the recordings to show it: the
# 95 % quantile of chi squared with one degree of freedom.
_SHOWN = 3.84
# Times the error of differences, below which a direction counts as undetermined, and the
# share of the best determined one that it then has.
_FEW = 5.0
_UNDETERMINED = 1e-9
# Share of the largest below which a direction is like others.
_SAME = 1e-5
_MOST_RUNS = 4


@dataclass(frozen=True)
class Untold:
    """What the recordings leave open.

    Parameters
    ----------
    parameters : dict of str to float
        Of the simulation, with the values that were given; each may be `FACTOR` times as
        large or small, where the others follow.
    with_forces : bool
        Whether the forces of the effects follow too.
    deviations : dict of str to float, [-]
        Relative standard deviations of the other parameters, as if what is left were
        white.
    """

    parameters: Mapping[str, float] = field(default_factory=dict)
    with_forces: bool = False
    deviations: Mapping[str, float] = field(default_factory=dict)

    @property
    def sentences(self) -> tuple[str, ...]:
        """What a reader has to know; nothing where all is told."""
        if not self.parameters:
            return ()
        *first, last = self.parameters
        names = f"{', '.join(first)} and {last}" if first else last
        which = "each" if first else "it"
        follow = "the other parameters" + " and the forces of the effects" * (
            self.with_forces
        )
        name, value = next(iter(self.parameters.items()))
        off = f"{100 * (FACTOR - 1):.0f}\N{NO-BREAK SPACE}%"
        return (
            f"these recordings do not tell {names}: {which} may be {off} off where "
            f"{follow} follow, and the output changes by less than its noise; hold what "
            f"you know, as in 'parameters: {{{name}: {value:g}}}'",
        )


def with_interval(parameter: BaseParameter, untold: Untold) -> BaseParameter:
    """A parameter of the simulation with its 95 % interval, where the recordings tell it."""
    deviation = untold.deviations.get(parameter.name)
    if deviation is None or deviation > _HARDLY_TOLD:
        return parameter
    factor = float(np.exp(QUANTILE * deviation))
    low, high = sorted((parameter.after / factor, parameter.after * factor))
    return replace(parameter, low=low, high=high)


def without_forces_told(effect: FittedEffect) -> FittedEffect:
    """An effect whose forces have no interval."""
    return replace(
        effect,
        parameters=tuple(
            replace(one, low=np.nan, high=np.nan) if "N" in one.name.split("_") else one
            for one in effect.parameters
        ),
    )


def law_without_forces_told(law: Law) -> Law:
    """A law of forces whose coefficients have no interval."""
    if law.acts_on != "force":
        return law
    terms = tuple(replace(one, low=np.nan, high=np.nan) for one in law.terms)
    return replace(law, terms=terms)


def untold_parameters(
    runs: Runs, findings: Findings, values: Mapping[str, float]
) -> Untold:
    """Find the parameters of a simulation that the recordings do not tell.

    Parameters
    ----------
    findings : Findings
        With the effects that the simulation's run has borne out.
    values : mapping of str to float
        Parameters of the simulation at that run.
    """
    free = {name: one for name, one in runs.simulator.free.items() if values[name] != 0}
    if not free or findings.pieces is not None:
        return Untold()
    moving = _Moving.of(runs, findings, values, free)
    before = moving.errors(np.zeros(moving.size))
    if before is None:
        return Untold()
    slopes = moving.slopes(before)
    deviations = _deviations(slopes)
    open_ones = np.flatnonzero(deviations > _LEAST_DEVIATION)
    found = [
        column
        for column in open_ones
        if column < len(free) and _is_untold(moving, int(column), before, slopes)
    ]
    forces = len(free) in open_ones and bool(found)
    # What is left counts as noise of its own size.
    size = max(1.0, findings.criteria.ratio(findings.verdict.chosen))
    told = {
        name: size * float(deviations[row])
        for row, name in enumerate(free)
        if row not in found
    }
    untold = {
        name: one.value for row, (name, one) in enumerate(free.items()) if row in found
    }
    return Untold(untold, forces, told)


def _deviations(slopes: np.ndarray) -> np.ndarray:
    """Relative standard deviations of the parameters; shape (n,)."""
    lengths = np.maximum(np.linalg.norm(slopes, axis=0), 1e-300)
    sizes, turned = np.linalg.eigh((slopes / lengths).T @ (slopes / lengths))
    # What differences cannot tell from nothing is taken for nothing.
    is_open = sizes < (_FEW * DIFFERENCE) ** 2 * sizes[-1]
    sizes = np.where(is_open, _UNDETERMINED * sizes[-1], sizes)
    return np.asarray(np.sqrt(((turned**2) / sizes).sum(axis=1)) / lengths)


def _is_untold(
    moving: "_Moving", column: int, before: np.ndarray, slopes: np.ndarray
) -> bool:
    """Whether a parameter may be another one by `FACTOR` without a trace."""
    others = np.delete(slopes, column, axis=1)
    lengths = np.maximum(np.linalg.norm(others, axis=0), 1e-300)

    def followed(change: np.ndarray) -> np.ndarray:
        """Logarithms by which the others undo a change of the outputs."""
        steps = np.linalg.lstsq(others / lengths, -change, rcond=_SAME)[0]
        return np.insert(steps / lengths, column, 0.0)

    for sign in (1.0, -1.0):
        logs = np.zeros(moving.size)
        logs[column] = sign * np.log(FACTOR)
        logs = logs + followed(slopes[:, column] * logs[column])
        left = np.inf
        for _ in range(_MOST_RUNS):
            after = None if moving.leaves(logs) else moving.errors(logs)
            if after is None:
                break
            change = after - before
            still = float(change @ change)
            if still < _SHOWN:
                return True
            if still > 0.5 * left:
                break
            left, logs = still, logs + followed(change)
    return False


@dataclass(frozen=True, eq=False)
class _Moving:
    """Runs with all parameters, and all forces of effects, times factors.

    Parameters
    ----------
    forces : tuple of ndarray, shape (n_samples,), or empty
        Of the effects, in each recording.
    at_force : bool
        Whether they act at the simulation's force input, not through its input.
    """

    runs: Runs
    problem: DiagnosisProblem
    values: Mapping[str, float]
    free: Mapping[str, FreeParameter]
    forces: tuple[np.ndarray, ...]
    at_force: bool
    noise_rms: float

    @classmethod
    def of(
        cls,
        runs: Runs,
        findings: Findings,
        values: Mapping[str, float],
        free: Mapping[str, FreeParameter],
    ) -> "_Moving":
        """What a confirmed diagnosis can be moved by; its training recordings count."""
        chosen, problem = findings.verdict.chosen, findings.problem.part(held_out=False)
        enters = {CATALOGUE[one].enters for one in chosen.effects}
        forces: tuple[np.ndarray, ...] = ()
        at_force = acts_at_force(findings.problem, chosen, runs)
        if enters - {"output"}:
            layout, point = rebuilt(findings.problem, chosen, findings.scales)
            motions = simulate_at(findings.problem, layout, point)
            of_all = forces_along(findings.problem, motions)
            of_all = as_sent(
                runs, findings.problem, of_all, chosen.effects, at_force=at_force
            )
            forces = tuple(
                force
                for force, one in zip(of_all, findings.problem.signals, strict=True)
                if not one.is_held_out
            )
        noise = findings.criteria.noise.rms
        return cls(runs, problem, values, free, forces, at_force, noise)

    @property
    def size(self) -> int:
        """Parameters, and one factor of the forces where there are some."""
        return len(self.free) + (1 if self.forces else 0)

    def leaves(self, logs: np.ndarray) -> bool:
        """Whether a parameter leaves its bounds."""
        new = self._values(logs)
        return any(
            not one.limits[0] <= new[name] <= one.limits[1]
            for name, one in self.free.items()
        )

    def _values(self, logs: np.ndarray) -> dict[str, float]:
        factors = np.exp(logs)
        moved = {
            name: self.values[name] * float(factor)
            for name, factor in zip(self.free, factors, strict=False)
        }
        return {**self.values, **moved}

    def errors(self, logs: np.ndarray) -> np.ndarray | None:
        """Outputs over the noise; None where the simulation gives no answer."""
        signals, values = self.problem.signals, self._values(logs)
        if self.forces:
            forces = [float(np.exp(logs[-1])) * one for one in self.forces]
            found = pushed(self.runs, self.problem, forces, self.at_force, values)
        else:
            found = self.runs.tried(signals, values)
        if found is None:
            return None
        return np.concatenate(
            [
                run.output[one.evaluated] / self.noise_rms
                for one, run in zip(signals, found, strict=True)
            ]
        )

    def slopes(self, before: np.ndarray) -> np.ndarray:
        """Derivatives by the logarithms; shape (n_evaluated, n)."""
        columns = []
        for column in range(self.size):
            slope = partial(self._slope, before, column)
            columns.append(derivative(slope, errors_rms=1.0))
        return np.column_stack(columns)

    def _slope(self, before: np.ndarray, column: int, width: float) -> np.ndarray:
        logs = np.zeros(self.size)
        logs[column] = width
        if self.leaves(logs):
            logs[column] = -width
        after = self.errors(logs)
        # Where it cannot be run with more of a parameter, that one stays.
        moved = before if after is None else after
        return np.asarray((moved - before) / logs[column])
