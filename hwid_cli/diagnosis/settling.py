"""Which way stand-in and simulation settle with an effect.

The simulation's own parameters do what the stand-in's base did; where they had imitated
the effect they are fitted beside it; only what no parameter can do is left to forces.
docs/method_diagnosis.md, eq. (D32).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.candidate import fitted_drive, rebuilt, without_base
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.own_base import gap_without
from hwid_cli.diagnosis.own_parameters import fit_parameters
from hwid_cli.diagnosis.parameters import simulate_at
from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.simulator import Runs
from hwid_cli.diagnosis.stand_in import (
    counts_by_base,
    force_beside,
    moved_as,
    standing_for,
)
from hwid_cli.diagnosis.standing import standing_beside
from hwid_cli.diagnosis.turns import (
    Turn,
    acts_at_force,
    as_sent,
    best_turn,
    forces_along,
    have_moved,
    held,
    is_as_good,
    pushed,
    where_it_starts,
)
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.drive import Drive
from hwid_cli.records.programs import SimulatorRun

# The simulation's own parameters rather than further forces, if no more squares are left.
_PREFERRED = 2.0
# An effect through the input that leaves more than this share of what the base leaves is
# tried at the force input as well.
_CUT_OFF = 0.9
# Share of a parameter's value by which it may have moved beside one stand-in, [-].
_ANOTHER_STAND_IN = 0.05


def settled(
    findings: Findings,
    fit: CandidateFit,
    runs: Runs,
    values: dict[str, float],
    rival: float = np.inf,
) -> Turn | None:
    """Best run of the simulation with a set of effects; None if it is no better.

    Parameters
    ----------
    rival : float, [output unit squared]
        What the best run with other effects leaves: no further way is tried with what
        leaves far more.
    """
    has_force = runs.simulator.capabilities.force
    at_force = acts_at_force(findings.problem, fit, runs)
    said = float(fit.sse.sum())
    turn = Turn(findings.problem, fit, values, said, at_force, rival=rival)
    best = _best_of(findings, turn, runs)
    without = float(gap_without(findings).sum())
    if (
        fit.effects
        and has_force
        and not at_force
        and best.sse.sum() > _CUT_OFF * without
        and not best.is_far_behind
    ):
        # A map of the simulation may cut off what should come through its input.
        other = _best_of(findings, replace(turn, at_force=True), runs)
        best = min(best, other, key=_left_by)
    # A run that is worse than without the effect says nothing of it.
    is_worse = bool(fit.effects) and float(best.sse.sum()) >= without
    return None if best.tried is None or is_worse else best


def _best_of(findings: Findings, turn: Turn, runs: Runs) -> Turn:
    """Best turn, of those in which the simulation's own parameters may do enough.

    They do what the stand-in's base did; where they cannot, forces that go with
    displacement, velocity and input do it.
    """
    if not runs.simulator.free:
        return best_turn(findings, turn, runs)
    first = replace(turn, problem=held(findings.problem))
    best = _beside_own_stand_in(findings, turn, best_turn(findings, first, runs), runs)
    if best.is_far_behind or runs.run_tasks.are_spent:
        return best
    if not is_as_good(best):
        best = min(best, _again(findings, turn, runs), key=_left_by)
    # Forces in the place of parameters that nobody could find would pass for the effect's.
    if best.ran_away or is_as_good(best):
        return best
    other = best_turn(findings, turn, runs)
    if _is_clearly_better(other, best):
        # Its runs know the effect better than the first stand-in did.
        best = min(best, _again(findings, other, runs), key=_left_by)
    return other if _is_clearly_better(other, best) else best


def _beside_own_stand_in(
    findings: Findings, first: Turn, best: Turn, runs: Runs
) -> Turn:
    """The best turn, or where it leads beside a stand-in of the parameters that it has found.

    What the input does, and what shares of the mass do, counts by the stand-in's base: a
    delay would make up for a force constant that has been left behind.
    """
    effects, values = best.fit.effects, best.values_of_run
    has_moved = have_moved(first.values, values, _ANOTHER_STAND_IN)
    if best.tried is None or not has_moved or not counts_by_base(effects):
        return best
    if best.ran_away or best.is_far_behind or runs.run_tasks.are_spent:
        return best
    run = replace(best, fit=best.tried[0], values=values)
    motions = simulate_at(run.problem, *rebuilt(run.problem, run.fit, findings.scales))
    there = begun_with(run, runs, values, forces_along(run.problem, motions))
    if there is None:
        return best
    beside = best_turn(findings, there, runs)
    return best if beside.tried is None else beside


def _again(findings: Findings, turn: Turn, runs: Runs) -> Turn:
    """Best turn from where the simulation's parameters belong beside known effects."""
    if not turn.fit.effects:
        return turn
    return best_turn(findings, _beside_effect(findings, turn, runs), runs)


def _left_by(turn: Turn) -> float:
    return float(turn.sse.sum())


def _is_clearly_better(one: Turn, other: Turn) -> bool:
    return bool(one.sse.sum() * _PREFERRED < other.sse.sum())


def _beside_effect(findings: Findings, turn: Turn, runs: Runs) -> Turn:
    """A first turn with the simulation's parameters as they fit beside known effects.

    Parameters that have imitated an effect are far from where they belong; where the
    stand-in has moved its base for them, it knows the effect well enough to lead them there.
    """
    fit, problem = turn.fit, turn.problem
    motions = simulate_at(problem, *rebuilt(problem, fit, findings.scales))
    # Of the effect alone: what the changed base does is no force of it.
    changed = replace(problem, drive=fitted_drive(problem.drive, fit))
    names = [one.name for one in problem.signals]
    each = forces_along(changed, motions)
    sent = as_sent(runs, problem, each, fit.effects, at_force=turn.at_force)
    forces = dict(zip(names, sent, strict=True))

    def ask(
        signals: Sequence[Signals], values: Mapping[str, float]
    ) -> list[SimulatorRun] | None:
        some = replace(problem, signals=tuple(signals))
        return pushed(
            runs, some, [forces[one.name] for one in signals], turn.at_force, values
        )

    values = fit_parameters(
        ask, problem.signals, runs.simulator.free, turn.values,
        findings.criteria.noise.rms, is_rough=True,
    )  # fmt: skip
    there = begun_with(turn, runs, values, each)
    return replace(turn, problem=held(problem)) if there is None else there


def begun_with(
    turn: Turn,
    runs: Runs,
    values: dict[str, float],
    forces: Sequence[np.ndarray],
) -> Turn | None:
    """A first turn with given parameters of the simulation and the forces of its effects.

    None where the simulation gives no answer there.

    Parameters
    ----------
    forces : sequence of ndarray, shape (n_samples,), [N]
        For each recording, what the effects of the turn's fit make.
    """
    problem = turn.problem
    given = runs.tried(problem.signals, values)
    sent = as_sent(runs, problem, forces, turn.fit.effects, at_force=turn.at_force)
    found = pushed(runs, problem, sent, turn.at_force, values)
    if given is None or found is None:
        return None
    standing = standing_beside(runs, problem, given, values)
    # Effects that were found before are in the drive, too.
    drive = replace(standing.drive, effects=problem.drive.effects)
    signals = tuple(
        _standing_with(drive, one, run, force)
        for one, run, force in zip(standing.signals, found, forces, strict=True)
    )
    there = held(replace(standing, drive=drive, signals=signals))
    fit = where_it_starts(there, without_base(turn.fit))
    return Turn(there, fit, values, turn.said, turn.at_force, rival=turn.rival)


def _standing_with(
    drive: Drive, signals: Signals, found: SimulatorRun, force: np.ndarray
) -> Signals:
    """Signals with what makes the stand-in move as a run does, with an effect's force.

    Without it both may be far from there.

    Parameters
    ----------
    found : SimulatorRun
        With the force.
    """
    plain = replace(drive, effects={})
    along = force_beside(plain, signals, moved_as(signals, found))
    there = standing_for(signals, found, plain, along)
    return replace(there, force=along - force, start=there.own_start)
