"""Stand-in and simulation in turns, until both agree.

An effect becomes a force along the simulation's motion; the run with it corrects the
stand-in, to which effects and the simulation's own parameters are fitted again.
docs/method_diagnosis.md, eq. (D32).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from hwid_cli.diagnosis.candidate import (
    fitted_drive,
    neighbour_of,
    rebuilt,
    without_starts,
)
from hwid_cli.diagnosis.causes import left_over
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.input_lag import through_input
from hwid_cli.diagnosis.joint_fit import (
    fitted_again,
    fitted_together,
    noise_sizes,
    pushes_of,
)
from hwid_cli.diagnosis.noise import measured_input_rms
from hwid_cli.diagnosis.own_parameters import HOLD
from hwid_cli.diagnosis.parameters import (
    BASE,
    each_sum_of_squares,
    simulate_at,
)
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.simulator import Runs, derivative
from hwid_cli.diagnosis.stand_in import (
    act_as_forces,
    corrected,
    force_of_motion,
    lag_before,
    starts_in_balance,
)
from hwid_cli.drive.simulation import Motion, drive_effects
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.drive import BASE_PARAMETERS, HELD
from hwid_cli.records.programs import FreeParameter, SimulatorRun

# Runs with the effect, and the share of what remains (or of the noise) by which loop and
# simulation may differ.
_MOST_TURNS = 8
# And at most so many while each leaves clearly less, and no more than the stand-in said.
_MOST_THAT_GAIN = 16
_AGREEMENT = 0.1
# Squares of the noise that are hardly worth another turn.
_WORTH_A_FIT = 2.0
# Turns in a row that leave more than the stand-in said, and more than this share of the best
# run before: there it does not settle.
_MOST_IN_VAIN = 3
# Squares over those that are left without the effect, from which on none follows.
_FAR_OFF = 10.0
_WORTH_A_TURN = 0.95
# Squares over those that another effect's run leaves, from which on so many turns are enough.
_FAR_BEHIND, _FEW_TURNS = 3.0, 3
# Turns that agree go on while each leaves less than this share of the last one.
_SETTLED = 0.995
# Over the noise, what a run may leave because its effect is a little late at corners.
_LATE_AT_CORNERS = 1.1
# Derivatives by the simulation's parameters are found again where one of these has moved by
# more than this share.
_SAME_SLOPES = 0.02
# What is confirmed leaves at most so many times the squares that the stand-in left.
_NO_WORSE = 1.2


@dataclass(frozen=True, eq=False)
class Turn:
    """A fit of the chosen set, and how the simulation's own run with it differs.

    Parameters
    ----------
    problem : DiagnosisProblem
        Of the stand-in as it was corrected last.
    fit : CandidateFit
        To it.
    values : dict of str to float
        Parameters of the simulation that go with it.
    said : float
        Sum of squares that the stand-in alone left.
    at_force : bool
        Whether forces act at the simulation's force input, not through its input.
    rival : float, [output unit squared]
        Sum of squares that the best run with other effects left.
    tried : tuple of CandidateFit and dict of str to float, or None
        What the simulation itself was run with.
    slopes : tuple of ndarray, shape (n_samples, n_free)
        Derivatives of each recording's output by the simulation's parameters.
    slopes_at : dict of str to float
        Parameters that they were found at.
    left : tuple of ndarray, shape (n_evaluated,), [output unit]
        What that run left of each recording.
    disagreement : float, [output unit]
        RMS between that run and what the stand-in had said.
    ran_away : bool
        Whether the stand-in no longer says what the parameters should be.
    """

    problem: DiagnosisProblem
    fit: CandidateFit
    values: dict[str, float]
    said: float
    at_force: bool
    rival: float = np.inf
    tried: tuple[CandidateFit, dict[str, float]] | None = None
    slopes: tuple[np.ndarray, ...] = ()
    slopes_at: dict[str, float] = field(default_factory=dict)
    left: tuple[np.ndarray, ...] = ()
    disagreement: float = np.inf
    ran_away: bool = False

    @property
    def sse(self) -> np.ndarray:
        """Sum of squares of each recording that the run left; infinite without one."""
        return each_sum_of_squares(self.left) if self.left else np.array([np.inf])

    @property
    def is_far_behind(self) -> bool:
        """Whether the run leaves far more than one with other effects."""
        return bool(self.sse.sum() > _FAR_BEHIND * self.rival)

    @property
    def values_of_run(self) -> dict[str, float]:
        """Parameters of the simulation's run."""
        return self.values if self.tried is None else self.tried[1]


def where_it_starts(problem: DiagnosisProblem, fit: CandidateFit) -> CandidateFit:
    """The fit without starts of its own where these are known: the simulation's."""
    return without_starts(fit) if problem.has_starts else fit


def _with_starts(
    problem: DiagnosisProblem, found: Sequence[SimulatorRun]
) -> DiagnosisProblem:
    """The stand-in that starts in balance once runs with an effect show it."""
    pairs = zip(problem.signals, found, strict=True)
    if not any(starts_in_balance(one, run) for one, run in pairs):
        return problem
    signals = tuple(replace(one, own_start=None) for one in problem.signals)
    return replace(problem, signals=signals)


def _late(
    problem: DiagnosisProblem, motions: Sequence[Motion], found: Sequence[SimulatorRun]
) -> list[np.ndarray]:
    """How far runs are from what the stand-in had said."""
    return [
        run.output - one.seen(motion) - (0.0 if one.offset is None else one.offset)
        for one, motion, run in zip(problem.signals, motions, found, strict=True)
    ]


def held(problem: DiagnosisProblem) -> DiagnosisProblem:
    """The same with a base that no fit moves."""
    return replace(problem, known=dict.fromkeys(BASE_PARAMETERS, 0.0))


def best_turn(findings: Findings, turn: Turn, runs: Runs) -> Turn:
    """Turn after turn until stand-in and simulation agree; the best of the runs.

    Agreement within a part of the noise still shows beside many samples: while something
    remains, one more turn follows.
    """
    best, agreed, in_vain = turn, 0, 0
    for count in range(_MOST_THAT_GAIN):
        following = _next_turn(findings, turn, runs)
        if following is None:
            break
        has_settled = following.sse.sum() > _SETTLED * turn.sse.sum()
        turn = following
        is_worth_it = turn.sse.sum() < _WORTH_A_TURN * best.sse.sum()
        in_vain = 0 if is_worth_it or is_as_good(turn) else in_vain + 1
        if turn.sse.sum() > _FAR_OFF * findings.base.sse.sum():
            # No step of the stand-in leads back from there.
            in_vain = _MOST_IN_VAIN
        if turn.sse.sum() < best.sse.sum():
            best = turn
        if turn.ran_away:
            return replace(best, ran_away=True)
        if count >= _FEW_TURNS - 1 and best.is_far_behind:
            break
        if runs.run_tasks.are_spent and not is_worth_it:
            break
        if count >= _MOST_TURNS - 1 and not (is_worth_it and is_as_good(turn)):
            break
        agreed = agreed + 1 if _agrees(findings, turn) and is_as_good(turn) else 0
        is_enough = (
            agreed > 0
            and findings.criteria.is_complete(fit_of_run(findings, turn))
            and not _promises_more(findings, turn)
        )
        is_over = agreed > 1 and has_settled
        if is_enough or is_over or in_vain == _MOST_IN_VAIN:
            break
    return best


def _agrees(findings: Findings, turn: Turn) -> bool:
    """Whether the run is what the stand-in had said, but for a part of what remains."""
    n = sum(one.n_evaluated for one in turn.problem.signals)
    remains = float(np.sqrt(turn.sse.sum() / n))
    return turn.disagreement <= _AGREEMENT * max(remains, findings.criteria.noise.rms)


def _promises_more(findings: Findings, turn: Turn) -> bool:
    """Whether the next fit takes clearly more of what the run leaves."""
    gain = float(turn.sse.sum() - turn.fit.sse.sum())
    return gain > _WORTH_A_FIT * findings.criteria.noise.rms**2


def is_as_good(turn: Turn) -> bool:
    """Whether the run leaves no more than the stand-in alone did."""
    return float(turn.sse.sum()) <= _NO_WORSE * turn.said


@dataclass(frozen=True, eq=False)
class Answer:
    """What the simulation's runs with an effect's forces gave, and the turn after them.

    Parameters
    ----------
    turn : Turn
        With the stand-in corrected by the runs, and the fit as it was.
    found : list of SimulatorRun
    forces : list of ndarray, shape (n_samples,), [N]
        Along the stand-in's motions, that the runs were made with.
    """

    turn: Turn
    found: list[SimulatorRun]
    forces: list[np.ndarray]


def answered(findings: Findings, turn: Turn, runs: Runs) -> Answer | None:
    """Run the simulation with the effect's force, and correct the stand-in.

    None where a force or the stand-in's motion is not finite, or a run gives no answer.
    """
    problem = turn.problem
    motions = simulate_at(problem, *rebuilt(problem, turn.fit, findings.scales))
    forces = forces_along(problem, motions)
    if not all(np.isfinite(one).all() for one in forces):
        return None
    sent = as_sent(runs, problem, forces, turn.fit.effects, at_force=turn.at_force)
    found = pushed(runs, problem, sent, turn.at_force, turn.values)
    if found is None:
        return None
    late = _late(problem, motions, found)
    if not all(np.isfinite(one).all() for one in late):
        return None
    problem = _with_starts(problem, found)
    corrected = _corrected(problem, late, [run.output for run in found], forces)
    fit = where_it_starts(corrected, turn.fit)
    following = replace(
        turn,
        problem=corrected,
        fit=fit,
        tried=(fit, turn.values),
        left=_left(problem, motions, found),
        disagreement=_rms_of(problem, late),
    )
    return Answer(following, found, forces)


def _next_turn(findings: Findings, turn: Turn, runs: Runs) -> Turn | None:
    """Run the simulation with the effect's force; correct the stand-in; fit again."""
    answer = answered(findings, turn, runs)
    if answer is None:
        return None
    following, found, forces = answer.turn, answer.found, answer.forces
    if not turn.problem.known:
        fit = fitted_again(following.problem, following.fit, findings)
        return replace(following, fit=fit)
    if not turn.slopes or have_moved(turn.slopes_at, turn.values, _SAME_SLOPES):
        problem, rms = following.problem, findings.criteria.noise.rms
        sent = as_sent(runs, problem, forces, turn.fit.effects, at_force=turn.at_force)
        push = partial(pushed, runs, problem, sent, turn.at_force)
        slopes = tuple(_slopes(runs, push, turn.values, found, rms))
        following = replace(following, slopes=slopes, slopes_at=turn.values)
    return _with_values(following, (found, forces), runs, findings)


def acts_at_force(problem: DiagnosisProblem, fit: CandidateFit, runs: Runs) -> bool:
    """Whether effects act at a simulation's force input rather than through its input.

    Those that the drive has already are among them.
    """
    effects = (*drive_effects(problem.drive), *fit.effects)
    return runs.simulator.capabilities.force and act_as_forces(effects)


def forces_along(
    problem: DiagnosisProblem, motions: Sequence[Motion]
) -> list[np.ndarray]:
    """Forces that effects make along the motions of the stand-in, in each recording."""
    drive = replace(problem.drive, effects={})
    return [
        force_of_motion(drive, one, motion)
        for one, motion in zip(problem.signals, motions, strict=True)
    ]


def as_sent(
    runs: Runs,
    problem: DiagnosisProblem,
    forces: Sequence[np.ndarray],
    effects: Sequence[str],
    *,
    at_force: bool,
) -> list[np.ndarray]:
    """Forces as a simulation is to be given them, in each recording.

    Parameters
    ----------
    forces : sequence of ndarray, shape (n_samples,), [N]
        In straight lines between samples.
    effects : sequence of str
        That make them, beside those of the drive.
    at_force : bool
        At its force input, not through its input.
    """
    drive = problem.drive
    is_held = runs.are_held if at_force else drive.hold == HELD
    lag = 0.0 if at_force else lag_before(drive, (*drive_effects(drive), *effects))
    return [
        through_input(force, lag, one.sample_time_s, is_held=is_held)
        for force, one in zip(forces, problem.signals, strict=True)
    ]


def have_moved(
    before: Mapping[str, float], now: Mapping[str, float], share: float
) -> bool:
    """Whether a parameter of a simulation is elsewhere.

    Parameters
    ----------
    share : float, [-]
        Of its value before, by which it may have changed.
    """
    return any(abs(now[one] - before[one]) > share * abs(before[one]) for one in before)


def _left(
    problem: DiagnosisProblem, motions: Sequence[Motion], found: Sequence[SimulatorRun]
) -> tuple[np.ndarray, ...]:
    """What runs leave of the recordings; a sensor's effect is on top of a run."""
    return tuple(
        (one.compared - run.output - (motion.output - one.seen(motion)))[one.evaluated]
        for one, motion, run in zip(problem.signals, motions, found, strict=True)
    )


def _rms_of(problem: DiagnosisProblem, late: Sequence[np.ndarray]) -> float:
    parts = [
        error[one.evaluated] for one, error in zip(problem.signals, late, strict=True)
    ]
    return float(np.sqrt(np.mean(np.concatenate(parts) ** 2)))


def _with_values(
    turn: Turn,
    run_with: tuple[Sequence[SimulatorRun], Sequence[np.ndarray]],
    runs: Runs,
    findings: Findings,
) -> Turn:
    """Fit effects and the simulation's parameters together; move both.

    Parameters
    ----------
    run_with : tuple
        The last runs, and the forces that they were made with.
    """
    (found, forces), slopes = run_with, turn.slopes
    pushes = pushes_of(turn.problem, slopes, found)
    now = np.array([abs(turn.values[name]) or 1.0 for name in runs.simulator.free])
    holds = HOLD * float(np.sqrt(turn.sse.sum())) / now
    moved_by = slopes, pushes
    together = fitted_together(turn.problem, turn.fit, moved_by, holds, findings)
    if together is None:
        return replace(turn, ran_away=True)
    fit, change = together
    values = dict(turn.values)
    for column, (name, one) in enumerate(runs.simulator.free.items()):
        values[name] = float(np.clip(values[name] + change[column], *one.limits))
    # What the change of the parameters should do, until the next run shows it.
    more = [one @ change for one in slopes]
    targets = [run.output + add for run, add in zip(found, more, strict=True)]
    problem = _corrected(turn.problem, more, targets, forces)
    sizes = noise_sizes(turn.problem, slopes, findings.criteria.noise.rms)
    signals = tuple(
        replace(one, pushes=push * sizes)
        for one, push in zip(problem.signals, pushes, strict=True)
    )
    return replace(
        turn, problem=replace(problem, signals=signals), fit=fit, values=values
    )


def _corrected(
    problem: DiagnosisProblem,
    late: Sequence[np.ndarray],
    targets: Sequence[np.ndarray],
    forces: Sequence[np.ndarray],
) -> DiagnosisProblem:
    """The stand-in with a further force that moves it by what it was late.

    Parameters
    ----------
    late, targets : sequence of ndarray, shape (n_samples,), [output unit]
        What is added to its motion, and where that has to lead.
    forces : sequence of ndarray, [N]
        Of the effect, with which it has to lead there.
    """
    drive = replace(problem.drive, effects={})
    signals = []
    for one, change, target, force in zip(
        problem.signals, late, targets, forces, strict=True
    ):
        signals.append(corrected(one, drive, change, target, force))
    return replace(problem, signals=tuple(signals))


def _slopes(
    runs: Runs,
    push: Callable[[dict[str, float]], list[SimulatorRun] | None],
    values: dict[str, float],
    found: Sequence[SimulatorRun],
    noise_rms: float,
) -> list[np.ndarray]:
    """Derivatives of each recording's output by the simulation's free parameters.

    Parameters
    ----------
    noise_rms : float, [output unit]
        Which a difference has to be seen beside.

    Returns
    -------
    list of ndarray, shape (n_samples, n_free)
    """
    free = runs.simulator.free.items()
    each = [_slope(push, values, (name, one), found, noise_rms) for name, one in free]
    return [
        np.array([slope[row] for slope in each]).reshape(-1, run.output.size).T
        for row, run in enumerate(found)
    ]


def _slope(
    push: Callable[[dict[str, float]], list[SimulatorRun] | None],
    values: dict[str, float],
    parameter: tuple[str, FreeParameter],
    found: Sequence[SimulatorRun],
    noise_rms: float,
) -> list[np.ndarray]:
    """Derivatives by one parameter; zeros where no run is possible with more of it."""
    name, one = parameter
    size = abs(values[name]) or abs(one.value) or 1.0

    def slope(share: float) -> np.ndarray:
        step = share * size
        if values[name] + step > one.limits[1]:
            step = -step
        there = push({**values, name: values[name] + step}) or found
        pairs = zip(there, found, strict=True)
        changes = [after.output - before.output for after, before in pairs]
        return np.concatenate(changes) / (step / size)

    ends = np.cumsum([run.output.size for run in found])[:-1]
    return np.split(derivative(slope, noise_rms) / size, ends)


def pushed(
    runs: Runs,
    problem: DiagnosisProblem,
    forces: Sequence[np.ndarray],
    at_force: bool,
    values: Mapping[str, float],
) -> list[SimulatorRun] | None:
    """Run the simulation with forces, at its force input or through its input's gain.

    None where a run gives no answer: the force may lead where the simulation ends.
    """
    if at_force:
        return runs.tried(problem.signals, values, forces)
    gain = problem.drive.force_constant_N_per_A
    inputs = [
        one.driven_by + force / gain
        for one, force in zip(problem.signals, forces, strict=True)
    ]
    return runs.tried(problem.signals, values, (), inputs)


def fit_of_run(findings: Findings, turn: Turn) -> CandidateFit:
    """What the simulation was run with, and how that does.

    The base is free again, so that intervals count what it could take over.
    """
    if turn.tried is None:
        raise ValueError("nothing was run")
    fit, drive = turn.tried[0], turn.problem.drive
    if BASE not in {one.owner for one in fit.names}:
        names = [name for name in BASE_PARAMETERS if getattr(drive, name) != 0]
        fit = replace(
            fit,
            names=(*(ParameterRef(BASE, name) for name in names), *fit.names),
            values=np.r_[[getattr(drive, name) for name in names], fit.values],
        )
    fit = replace(fit, sse=turn.sse, neighbour=neighbour_of(turn.left))
    # At corners a force between samples is late as an input is, by a little.
    is_late = findings.criteria.ratio(fit) <= _LATE_AT_CORNERS
    noise = findings.criteria.noise
    if not is_late:
        noise = replace(noise, input_rms=measured_input_rms(turn.problem))
    problem = replace(turn.problem, known={})
    drives = [fitted_drive(drive, fit)] * len(problem.signals)
    white, cause = left_over(turn.left, problem, drives, noise)
    return replace(fit, whiteness=white, cause=cause)
