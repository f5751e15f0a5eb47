"""Effects at the ports of a simulation, on its input or its output, fitted through its runs.

They need no loop: a run with the changed input is exact, and so is a reading of a run.
Parameters of the simulation that have imitated a delay leave a second minimum, which no turn
leaves; so effect and parameters are fitted together, from the parameters as stated too.
docs/method_diagnosis.md, eq. (D32c).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.candidate import rebuilt, with_values, without_base
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.own_parameters import cost_of, fit_beside
from hwid_cli.diagnosis.parameters import simulate_at
from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.settling import begun_with
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.stand_in import changes_input, moved_as
from hwid_cli.diagnosis.turns import Turn, best_turn, forces_along, held, pushed
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.output import read
from hwid_cli.drive.simulation import parameter_vector
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.programs import FreeParameter, SimulatorRun

# Training recordings that effects at the ports are tried on first.
_FEW = 2


@dataclass(frozen=True, eq=False)
class PortStart:
    """An effect at a port as a few recordings tell it, to go on from.

    Parameters
    ----------
    fit : CandidateFit
        Of the effect to the stand-in.
    values : dict of str to float
        Of the simulation's parameters and of the effect's.
    left : float, [-]
        Mean square that it leaves of these recordings, over that of the noise.
    """

    fit: CandidateFit
    values: dict[str, float]
    left: float


def port_effect(
    findings: Findings, effect: str, values: Mapping[str, float]
) -> CandidateFit:
    """An effect at a port alone, with values to start from.

    Parameters
    ----------
    effect : str
        Id of the entry.
    values : mapping of str to float
        Of its parameters, by their names.
    """
    base = without_base(findings.base)
    return replace(
        base,
        effects=(effect,),
        names=(*base.names, *(ParameterRef(effect, name) for name in values)),
        values=np.r_[base.values, list(values.values())],
        valleys=np.zeros((0, 0)),
    )


def begin_at_port(
    findings: Findings, fit: CandidateFit, runs: Runs, values: dict[str, float]
) -> PortStart | None:
    """Fit an effect at a port and the parameters to the recordings that move most.

    A hopeless one is known by then, for a part of the runs.

    Parameters
    ----------
    fit : CandidateFit
        Of one effect at a port to the stand-in.
    values : dict of str to float
        Parameters of the simulation as they were fitted without it.

    Returns
    -------
    PortStart or None
        None where the simulation gives no answer, or leaves more than without the effect.
    """
    search = _Search(findings, without_base(fit), runs)
    best = search.best_of(search.starts(values))
    if best is None:
        return None
    few = moving_most(findings.problem.signals)
    without = _by_name(findings, findings.base.sse)
    found = fit_beside(search.ask, few, search.free, best, without)
    if found is None:
        return None
    noise = _by_name(findings, findings.criteria.floors)
    squares = sum(noise[one.name] for one in few)
    left = cost_of(search.ask, few, found) / squares if squares else np.inf
    return PortStart(fit, found, left)


def with_port_effect(findings: Findings, start: PortStart, runs: Runs) -> Turn | None:
    """Best run with an effect at a port, fitted together with the parameters.

    Returns
    -------
    Turn or None
        None where the simulation gives no answer, or what it leaves is not less than
        without the effect.
    """
    search = _Search(findings, without_base(start.fit), runs)
    signals = findings.problem.signals
    without = _by_name(findings, findings.base.sse)
    found = fit_beside(search.ask, signals, search.free, start.values, without)
    begun = None if found is None else search.begun(found)
    turn = None if begun is None else best_turn(findings, begun, runs)
    if turn is None or turn.tried is None:
        return None
    return None if turn.sse.sum() >= findings.base.sse.sum() else turn


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


def run_with_port_effect(
    findings: Findings,
    fit: CandidateFit,
    runs: Runs,
    plain: tuple[Sequence[Signals], Sequence[SimulatorRun]],
    values: dict[str, float],
) -> list[SimulatorRun] | None:
    """Run the simulation on some recordings with an effect on its input or its output.

    Parameters
    ----------
    plain : tuple of sequences of Signals and SimulatorRun
        The recordings, and runs without the effect, which another reading is made of.
    values : dict of str to float
        Parameters of the simulation.
    """
    search = _Search(findings, without_base(fit), runs)
    signals, found = plain
    both = {**values, **search.of_effect}
    if changes_input(fit.effects):
        return search.ask(signals, both)
    return search.read(signals, found, both)


class _Search:
    """An effect at a port and the simulation's parameters as one set of values.

    Parameters
    ----------
    fit : CandidateFit
        Of the effect alone.
    """

    def __init__(self, findings: Findings, fit: CandidateFit, runs: Runs) -> None:
        self._findings, self._fit, self._runs = findings, fit, runs
        self._problem = held(findings.problem)
        (self._effect,) = fit.effects
        fitted = dict(zip(fit.names, fit.values.tolist(), strict=True))
        self.of_effect = {
            str(ref): value
            for ref, value in fitted.items()
            if ref.owner == self._effect
        }

    @property
    def free(self) -> dict[str, FreeParameter]:
        """Parameters of the simulation and of the effect, with their bounds."""
        scales = self._findings.scales
        bounds = {
            name: CATALOGUE[self._effect].parameter(_name(name)).bounds(scales)
            for name in self.of_effect
        }
        effect = {
            name: FreeParameter(value, bounds[name])
            for name, value in self.of_effect.items()
        }
        return {**self._runs.simulator.free, **effect}

    def starts(self, values: Mapping[str, float]) -> list[dict[str, float]]:
        """Where to begin: parameters as fitted and as stated, effects as found and of any size."""
        effect = CATALOGUE[self._effect].starts(self._findings.scales)
        names = self.of_effect
        sizes = [{name: one[_name(name)] for name in names} for one in effect]
        stated = self._runs.simulator.values
        return [{**of, **size} for of in (values, stated) for size in (names, *sizes)]

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
        """Run the simulation with its input, or its output, as the effect changes it."""
        if not changes_input((self._effect,)):
            found = self._runs.tried(signals, self._of_simulation(values))
            return None if found is None else self.read(signals, found, values)
        forces = self._forces(values)
        if forces is None:
            return None
        rows = {one.name: row for row, one in enumerate(self._problem.signals)}
        chosen = [forces[rows[one.name]] for one in signals]
        some = replace(self._problem, signals=tuple(signals))
        return pushed(self._runs, some, chosen, False, self._of_simulation(values))

    def read(
        self,
        signals: Sequence[Signals],
        found: Sequence[SimulatorRun],
        values: Mapping[str, float],
    ) -> list[SimulatorRun]:
        """What a sensor with the effect shows of runs."""
        of_effect = {_name(key): values[key] for key in self.of_effect}
        vector = parameter_vector(self._problem.drive, {self._effect: of_effect})
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
        fit = with_values(self._fit, _by_ref(values, self.of_effect))
        own = self._of_simulation(values)
        turn = Turn(self._problem, fit, own, said, at_force=False)
        return begun_with(turn, self._runs, own, forces)

    def _forces(self, values: Mapping[str, float]) -> list[np.ndarray] | None:
        if not changes_input((self._effect,)):
            return [np.zeros(one.driven_by.size) for one in self._problem.signals]
        fit = with_values(self._fit, _by_ref(values, self.of_effect))
        point = rebuilt(self._problem, fit, self._findings.scales)
        forces = forces_along(self._problem, simulate_at(self._problem, *point))
        return forces if all(np.isfinite(one).all() for one in forces) else None

    def _of_simulation(self, values: Mapping[str, float]) -> dict[str, float]:
        return {k: v for k, v in values.items() if k not in self.of_effect}


def _name(key: str) -> str:
    return ParameterRef.of_text(key).parameter


def _by_ref(
    values: Mapping[str, float], keys: Mapping[str, float]
) -> dict[ParameterRef, float]:
    return {ParameterRef.of_text(key): values[key] for key in keys}
