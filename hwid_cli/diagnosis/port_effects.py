"""Effects at the ports of a simulation, on its input or its output, fitted through its runs.

They need no loop: a run with the changed input is exact, and so is a reading of a run, of
one effect or of several.
Parameters of the simulation that have imitated a delay leave a second minimum, which no turn
leaves; so effect and parameters are fitted together, from the parameters as stated too.
docs/method_diagnosis.md, eq. (D32c).
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.candidate import (
    rebuilt,
    with_values,
    without_base,
    without_owner,
)
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.own_base import gap_without
from hwid_cli.diagnosis.own_parameters import cost_of, fit_beside
from hwid_cli.diagnosis.parameters import simulate_at
from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.settling import begun_with
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.stand_in import changes_input, moved_as
from hwid_cli.diagnosis.turns import (
    Turn,
    as_sent,
    best_turn,
    forces_along,
    held,
    pushed,
)
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.output import read
from hwid_cli.drive.simulation import parameter_vector
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.programs import FreeParameter, SimulatorRun

# Training recordings that effects at the ports are tried on first.
_FEW = 2


@dataclass(frozen=True, eq=False)
class PortStart:
    """Effects at the ports as a few recordings tell them, to go on from.

    Parameters
    ----------
    fit : CandidateFit
        Of the effects to the stand-in.
    values : dict of str to float
        Of the simulation's parameters and of the effects'.
    left : float, [-]
        Mean square that it leaves of these recordings, over that of the noise.
    share : float, [-]
        Of what the simulation leaves of these recordings without it.
    """

    fit: CandidateFit
    values: dict[str, float]
    left: float
    share: float

    @property
    def of_effects(self) -> dict[str, dict[str, float]]:
        """Parameters of each effect."""
        found: dict[str, dict[str, float]] = {one: {} for one in self.fit.effects}
        for ref in self.fit.names:
            if ref.owner in found:
                found[ref.owner][ref.parameter] = self.values[str(ref)]
        return found

    @property
    def of_simulation(self) -> dict[str, float]:
        """Parameters of the simulation."""
        of_effects = {str(ref) for ref in self.fit.names}
        return {k: one for k, one in self.values.items() if k not in of_effects}


def port_effects(
    findings: Findings, values: Mapping[str, Mapping[str, float]]
) -> CandidateFit:
    """Effects at the ports alone, with values to start from.

    Parameters
    ----------
    values : mapping of str to mapping of str to float
        Of the parameters of each effect, by their names.
    """
    base = without_base(findings.base)
    effects = tuple(sorted(values))
    each = {
        ParameterRef(effect, name): value
        for effect in effects
        for name, value in values[effect].items()
    }
    return replace(
        base,
        effects=effects,
        names=(*base.names, *each),
        values=np.r_[base.values, list(each.values())],
        valleys=np.zeros((0, 0)),
    )


def begin_at_port(
    findings: Findings, fit: CandidateFit, runs: Runs, values: dict[str, float]
) -> PortStart | None:
    """Fit effects at the ports and the parameters to the recordings that move most.

    Hopeless ones are known by then, for a part of the runs.

    Parameters
    ----------
    fit : CandidateFit
        Of effects at the ports to the stand-in.
    values : dict of str to float
        Parameters of the simulation as they were fitted without the effect that is new,
        and values of those that are not.

    Returns
    -------
    PortStart or None
        None where the simulation gives no answer, or leaves more than without the effect.
    """
    search = PortSearch(findings, without_base(fit), runs)
    best = search.best_of(search.starts(values))
    if best is None:
        return None
    few = moving_most(findings.problem.signals)
    without = _by_name(findings, gap_without(findings))
    rms = findings.criteria.noise.rms
    found = fit_beside(search.ask, few, search.free, best, without, rms)
    if found is None:
        return None
    noise = _by_name(findings, findings.criteria.floors)
    left = cost_of(search.ask, few, found)
    of_noise, of_gap = (
        left / squares if (squares := sum(each[one.name] for one in few)) else np.inf
        for each in (noise, without)
    )
    return PortStart(fit, found, of_noise, of_gap)


def with_port_effects(findings: Findings, start: PortStart, runs: Runs) -> Turn | None:
    """Best run with effects at the ports, fitted together with the parameters.

    Returns
    -------
    Turn or None
        None where the simulation gives no answer, or what it leaves is not less than
        without the effect.
    """
    search = PortSearch(findings, without_base(start.fit), runs)
    signals = findings.problem.signals
    without = _by_name(findings, gap_without(findings))
    rms = findings.criteria.noise.rms
    found = fit_beside(search.ask, signals, search.free, start.values, without, rms)
    begun = None if found is None else search.begun(found)
    turn = None if begun is None else best_turn(findings, begun, runs)
    if turn is None or turn.tried is None:
        return None
    return None if turn.sse.sum() >= gap_without(findings).sum() else turn


def moving_most(signals: Sequence[Signals]) -> list[Signals]:
    """The training recordings that effects at the ports are tried on first."""
    train = [one for one in signals if not one.is_held_out]
    train.sort(key=lambda one: -float(np.ptp(one.compared)))
    return train[:_FEW]


def _by_name(findings: Findings, each: np.ndarray) -> dict[str, float]:
    """What belongs to each recording, by its name.

    Parameters
    ----------
    each : ndarray, shape (n_recordings,), [output unit squared]
    """
    names = (one.name for one in findings.problem.signals)
    return dict(zip(names, each.tolist(), strict=True))


class PortSearch:
    """Effects at the ports and the simulation's parameters as one set of values.

    Parameters
    ----------
    fit : CandidateFit
        Of the effects alone; without any, of the simulation itself.
    """

    def __init__(self, findings: Findings, fit: CandidateFit, runs: Runs) -> None:
        self.findings, self._fit, self._runs = findings, fit, runs
        self._problem = held(findings.problem)
        of_input = [one for one in fit.effects if changes_input((one,))]
        self._at_output = [one for one in fit.effects if one not in of_input]
        self._on_input = fit
        for one in self._at_output:
            self._on_input = without_owner(self._on_input, one)
        fitted = dict(zip(fit.names, fit.values.tolist(), strict=True))
        self.of_effects = {
            str(ref): value for ref, value in fitted.items() if ref.owner in fit.effects
        }

    def of(self, fit: CandidateFit) -> "PortSearch":
        """The same for other effects."""
        return PortSearch(self.findings, without_base(fit), self._runs)

    def changes_input_as(self, other: "PortSearch") -> bool:
        """Whether both change the input alike, as long as values are the same."""
        return self._on_input.effects == other._on_input.effects

    @property
    def free(self) -> dict[str, FreeParameter]:
        """Parameters of the simulation and of the effects, with their bounds."""
        effects = {}
        for key, value in self.of_effects.items():
            ref = ParameterRef.of_text(key)
            bounds = CATALOGUE[ref.owner].parameter(ref.parameter).bounds(self._scales)
            effects[key] = FreeParameter(float(np.clip(value, *bounds)), bounds)
        return {**self._runs.simulator.free, **effects}

    @property
    def _scales(self) -> Scales:
        return self.findings.scales

    def starts(self, values: Mapping[str, float]) -> list[dict[str, float]]:
        """Where to begin: parameters as fitted and as stated, a new effect of any size."""
        new = {k: one for k, one in self.of_effects.items() if k not in values}
        sizes = [new]
        of = {key: _name(key) for key in new}
        for effect in dict.fromkeys(ParameterRef.of_text(key).owner for key in new):
            starts = CATALOGUE[effect].starts(self._scales)
            sizes += [{key: one[name] for key, name in of.items()} for one in starts]
        stated = {**values, **self._runs.simulator.values}
        return [{**of, **size} for of in (values, stated) for size in sizes]

    def best_of(self, starts: Sequence[dict[str, float]]) -> dict[str, float] | None:
        """The start that leaves least of the training recording that moves most."""
        train = [one for one in self._problem.signals if not one.is_held_out]
        largest = max(train, key=lambda one: float(np.ptp(one.compared)))
        costs = [cost_of(self.ask, [largest], one) for one in starts]
        best = int(np.argmin(costs))
        return starts[best] if np.isfinite(costs[best]) else None

    def ask(
        self, signals: Sequence[Signals], values: Mapping[str, float]
    ) -> list[SimulatorRun] | None:
        """Run the simulation with its input and its output as the effects change them."""
        found = self.run(signals, values)
        return None if found is None else self.read(signals, found, values)

    def run(
        self, signals: Sequence[Signals], values: Mapping[str, float]
    ) -> list[SimulatorRun] | None:
        """Run the simulation with its input as the effects change it."""
        own = self._of_simulation(values)
        if not self._on_input.effects:
            return self._runs.tried(signals, own)
        forces = self._forces(values)
        if forces is None:
            return None
        rows = {one.name: row for row, one in enumerate(self._problem.signals)}
        sent = as_sent(
            self._runs, self._problem, forces, self._on_input.effects, at_force=False
        )
        chosen = [sent[rows[one.name]] for one in signals]
        some = replace(self._problem, signals=tuple(signals))
        return pushed(self._runs, some, chosen, False, own)

    def read(
        self,
        signals: Sequence[Signals],
        found: Sequence[SimulatorRun],
        values: Mapping[str, float],
    ) -> list[SimulatorRun]:
        """What a sensor with the effects shows of runs."""
        if not self._at_output:
            return list(found)
        of_output: dict[str, dict[str, float]] = {one: {} for one in self._at_output}
        for key in self.of_effects:
            ref = ParameterRef.of_text(key)
            if ref.owner in of_output:
                of_output[ref.owner][ref.parameter] = values[key]
        vector = parameter_vector(self._problem.drive, of_output)
        read_runs = []
        for one, run in zip(signals, found, strict=True):
            moved, step = moved_as(one, run), one.sample_time_s
            output = read(moved.position, moved.velocity, one.driven_by, step, vector)
            read_runs.append(replace(run, output=output))
        return read_runs

    def begun(self, values: Mapping[str, float]) -> Turn | None:
        """A first turn from these values."""
        forces = self._forces(values)
        if forces is None:
            return None
        said = float(self._fit.sse.sum())
        fit = with_values(self._fit, _by_ref(values, self.of_effects))
        own = self._of_simulation(values)
        turn = Turn(self._problem, fit, own, said, at_force=False)
        return begun_with(turn, self._runs, own, forces)

    def _forces(self, values: Mapping[str, float]) -> list[np.ndarray] | None:
        fit = self._on_input
        if not fit.effects:
            return [np.zeros(one.driven_by.size) for one in self._problem.signals]
        refs = {str(ref) for ref in fit.names}
        of_input = [key for key in self.of_effects if key in refs]
        fit = with_values(fit, _by_ref(values, of_input))
        point = rebuilt(self._problem, fit, self._scales)
        forces = forces_along(self._problem, simulate_at(self._problem, *point))
        return forces if all(np.isfinite(one).all() for one in forces) else None

    def _of_simulation(self, values: Mapping[str, float]) -> dict[str, float]:
        return {k: v for k, v in values.items() if k not in self.of_effects}


def _name(key: str) -> str:
    return ParameterRef.of_text(key).parameter


def _by_ref(
    values: Mapping[str, float], keys: Iterable[str]
) -> dict[ParameterRef, float]:
    return {ParameterRef.of_text(key): values[key] for key in keys}
