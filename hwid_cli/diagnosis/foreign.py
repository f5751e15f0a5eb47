"""Diagnosis of a simulation that cannot be opened, by a drive that stands for it.

Its parameters are fitted again where there are some; a plain drive then stands for it
(``stand_in``), and what that lacks is looked for as for any drive. What is found is put
into the simulation itself as a force along its motion, and that run corrects the stand-in,
until both agree: only then is it confirmed. docs/method_diagnosis.md, eq. (D30) to (D33).
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.beside_stand_in import (
    MOVED,
    Beside,
    FoundBeside,
    has_few_runs,
    is_all_but_nothing,
    searched_beside,
)
from hwid_cli.diagnosis.candidate import fitted_drive
from hwid_cli.diagnosis.causes import without_repeats
from hwid_cli.diagnosis.diagnose import held_out_of
from hwid_cli.diagnosis.findings import Findings, describe
from hwid_cli.diagnosis.laws_in_simulation import law_instead
from hwid_cli.diagnosis.noise import noise_floor
from hwid_cli.diagnosis.own_base import judged_by_own_base
from hwid_cli.diagnosis.own_parameters import fit_parameters
from hwid_cli.diagnosis.problem import Signals, prepare
from hwid_cli.diagnosis.run_starts import Begun, begin, starts_sentence, with_starts
from hwid_cli.diagnosis.simulator import CountedRuns, Runs, Simulator, most_runs
from hwid_cli.diagnosis.stand_in import (
    act_as_forces,
    change_between,
    lag_before,
)
from hwid_cli.diagnosis.standing import its_own, standing_beside
from hwid_cli.diagnosis.tasks import OnRound, RunTasks
from hwid_cli.diagnosis.turns import have_moved
from hwid_cli.diagnosis.untold import (
    law_without_forces_told,
    untold_parameters,
    with_interval,
    without_forces_told,
)
from hwid_cli.records.diagnosis import STILL_LARGE, BaseParameter, Diagnosis
from hwid_cli.records.drive import StandIn
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import FreeParameter, SimulatorRun, StandInChange
from hwid_cli.records.recordings import Recording

# Searches, each from where the last one has moved the parameters.
MOST_SEARCHES = 3
# Factors of the stand-in that are none: as far as parameters are told, at most and at
# least by these shares, [-].
_SLIGHT, _LARGEST_SLIGHT = 1e-4, 0.01
_BESIDE_PARAMETERS = (
    "the parameters of the simulation alone do not give what is said here: forces that go "
    "with displacement, velocity and input act beside them, as factors under "
    "simulation.stand_in in extended_simulation.yaml"
)
# A parameter is at a bound within this share of its stated value, and far away beyond this
# factor, [-].
_AT_BOUND, _FAR = 1e-3, 5.0
# Values of a simulation's parameters, and what it gives with them.
_Start = tuple[dict[str, float], Sequence[SimulatorRun]]


def diagnose_foreign(
    recordings: Sequence[Recording],
    simulator: Simulator,
    options: DiagnoseOptions,
    run_tasks: RunTasks,
    on_round: OnRound,
) -> Diagnosis:
    """Find what a simulation of any kind lacks.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    run_tasks : callable
        Computes tasks, runs of the simulation among them, or takes their results from
        where it kept them.
    """
    most = most_runs(options.max_runs, len(recordings), len(simulator.free))
    counted = CountedRuns(run_tasks, most)
    on_round = counted.told(on_round)
    held_out = held_out_of(recordings, options)
    problem = prepare(recordings, its_own(simulator), options, held_out)
    problem = without_repeats(problem)
    on_round("the simulation as given", len(problem.signals))
    begun = begin(problem, simulator, options, counted)
    given, refitted = list(begun.given), dict(simulator.values)
    if simulator.free and not simulator.is_extended:
        on_round("its parameters", 0)
        begun, given, refitted = _refitted(begun, refitted)
    runs = begun.runs
    stated = dict(simulator.values)
    starts: tuple[_Start, _Start] = (refitted, given), (stated, begun.given)
    if _has_imitated(begun, given, refitted):
        starts = (starts[1], starts[0])
    search = _searched(begun, starts, options, on_round)
    found, values = search.findings, search.values
    if search.is_confirmed and not is_all_but_nothing(found):
        law = law_instead(
            runs, begun.problem, found.verdict, refitted, options, on_round
        )
        found, values = law or (found, values)
    if found.verdict.word not in ("none", "parameters"):
        found = judged_by_own_base(found)
    told = _told(found, begun, (refitted, values))
    if said := _said_of_runs(counted, found):
        told = replace(told, warnings=(*told.warnings, *said))
    if not search.is_confirmed:
        return replace(told, confirmed="surrogate")
    return _confirmed(told, found, (runs, values), on_round)


def _refitted(
    begun: Begun, values: dict[str, float]
) -> tuple[Begun, list[SimulatorRun], dict[str, float]]:
    """The simulation's parameters fitted again, and its runs with them.

    Starts of the recordings that did not show beside parameters that are off are taken
    off then, and the parameters are fitted once more.
    """
    values, given = _fitted_to(begun, values)
    later = with_starts(begun, given)
    if later is begun:
        return begun, given, values
    values, given = _fitted_to(later, values)
    return later, given, values


def _fitted_to(
    begun: Begun, values: dict[str, float]
) -> tuple[dict[str, float], list[SimulatorRun]]:
    runs, signals = begun.runs, begun.problem.signals
    noise = noise_floor(begun.problem).rms
    values = fit_parameters(runs.tried, signals, runs.simulator.free, values, noise)
    return values, runs.of(signals, values)


def _has_imitated(
    begun: Begun, given: Sequence[SimulatorRun], values: Mapping[str, float]
) -> bool:
    """Whether a re-fit has led a parameter far away, or to a bound, and leaves much.

    It has imitated what is missing then, as far as it may: a weight by a tenth of the
    input's gain.
    """
    problem, free = begun.problem, begun.runs.simulator.free
    left = float(_sse(problem.signals, given).sum())
    most = STILL_LARGE**2 * problem.n_evaluated * noise_floor(problem).rms ** 2
    return left > most and any(_is_far(one, values[name]) for name, one in free.items())


def _is_far(stated: FreeParameter, value: float) -> bool:
    """Whether a parameter was fitted far from its stated value; of 0 nothing is far."""
    size = abs(stated.value)
    at_bound = any(abs(value - one) <= _AT_BOUND * size for one in stated.limits)
    is_away = not size / _FAR <= abs(value) <= size * _FAR
    return at_bound or (is_away and size > 0)


def _said_of_runs(counted: CountedRuns, found: Findings) -> tuple[str, ...]:
    """Say that the limit of runs has ended the search, where something is left."""
    if not counted.are_spent:
        return ()
    if found.verdict.is_complete or is_all_but_nothing(found):
        return ()
    return (
        f"the search reached its limit of runs (diagnose.max_runs) after {counted.count} "
        "runs of the simulation, and may have left out likely effects: a larger limit, as "
        f"in 'diagnose: {{max_runs: {2 * counted.count}}}', takes finished runs from the "
        "cache",
    )


def _searched(
    begun: Begun,
    starts: tuple[_Start, _Start],
    options: DiagnoseOptions,
    on_round: OnRound,
) -> FoundBeside:
    """Search, again and again while that moves the simulation's parameters.

    Parameters
    ----------
    starts : tuple
        Values of its parameters to begin with, and those for where nothing holds beside
        these, each with what the simulation gives with them.
    """
    (values, given), (others, _) = starts
    problem, runs = begun.problem, begun.runs
    simulator = runs.simulator
    # With effects of its own the stand-in says what the whole simulation leaves, and the
    # parameters are fitted with them.
    given_sse = None if simulator.is_extended else _sse(problem.signals, begun.given)
    kept: FoundBeside | None = None
    for count in range(MOST_SEARCHES):
        is_last = count == MOST_SEARCHES - 1
        standing = standing_beside(runs, problem, given, values)
        beside = Beside(standing, options, runs, values, given_sse, on_round)
        this = searched_beside(beside, is_first=count == 0)
        moved = this.values
        if not this.is_confirmed:
            this = replace(this, values=values)
        if kept is not None and kept.stays_beside(this):
            break
        if kept is None or this.is_confirmed or not is_last:
            kept = this
        if this.is_confirmed and _is_all(this.findings):
            break
        if runs.run_tasks.are_spent or (count and has_few_runs(runs)):
            break
        # Parameters that imitated what is missing have led elsewhere; or to where nothing
        # holds in the simulation.
        is_in_vain = count == MOST_SEARCHES - 2 and not this.is_confirmed
        following = dict(others) if is_in_vain else moved
        if not have_moved(values, following, MOVED):
            break
        values = following
        given = runs.of(problem.signals, values)
    if kept is None:
        raise ValueError("no search was made")
    return kept


def _is_all(found: Findings) -> bool:
    """Whether nothing is left that a further search could name."""
    is_nearly_all = found.criteria.is_nearly_all(found.verdict.chosen, found.base)
    return is_nearly_all or is_all_but_nothing(found)


def _sse(signals: Sequence[Signals], runs: Sequence[SimulatorRun]) -> np.ndarray:
    left = [
        (one.compared - found.output)[one.evaluated]
        for one, found in zip(signals, runs, strict=True)
    ]
    return np.array([float(one @ one) for one in left])


def _told(
    findings: Findings,
    begun: Begun,
    values: tuple[Mapping[str, float], Mapping[str, float]],
) -> Diagnosis:
    """The diagnosis with the simulation's own parameters, re-fitted and at last."""
    told, simulator = describe(findings), begun.runs.simulator
    base = tuple(
        BaseParameter(name, one.value, *(of[name] for of in values))
        for name, one in simulator.free.items()
    )
    change = _change_of(findings, simulator)
    warnings = told.warnings
    # Without an effect the table says whose gap this is.
    if base and told.effects and not change.is_none:
        warnings = (*warnings, _BESIDE_PARAMETERS)
    said = (
        starts_sentence(begun.starts.above, begun.problem.unit),
        _lag_sentence(findings, can_run=simulator.run is not None),
    )
    warnings = (*warnings, *filter(None, said))
    return replace(
        told,
        base=base or told.base,
        is_foreign=True,
        capabilities=simulator.capabilities,
        stand_in=change,
        warnings=warnings,
    )


def _lag_sentence(findings: Findings, *, can_run: bool) -> str:
    """Say that effects act behind a lag of the input; empty where none does."""
    effects = findings.verdict.chosen.effects
    lag = lag_before(findings.problem.drive, effects)
    if not lag or not effects or not act_as_forces(effects):
        return ""
    said = (
        f"the simulation's input passes a lag of {lag:.3g} s before it acts as a force; "
        "what is missing acts behind it"
    )
    if not can_run:
        return said
    return (
        f"{said}, and comes through the input ahead by as much (an input for forces, "
        "simulation.force_input, shows more)"
    )


def _change_of(findings: Findings, simulator: Simulator) -> StandInChange:
    """What the drive that stands for a simulation changes at last."""
    before = findings.problem.drive
    after = fitted_drive(before, findings.verdict.chosen)
    if not (isinstance(before, StandIn) and isinstance(after, StandIn)):
        raise ValueError("no drive that stands for a simulation")
    return simulator.change.beside(change_between(before, after))


def _confirmed(
    told: Diagnosis,
    findings: Findings,
    simulation: tuple[Runs, Mapping[str, float]],
    on_round: OnRound,
) -> Diagnosis:
    """The diagnosis that the simulation bears out, with what the recordings leave open."""
    on_round("what the recordings leave open", 0)
    untold = untold_parameters(simulation[0], findings, simulation[1])
    effects, law = told.effects, told.law
    if untold.with_forces:
        effects = tuple(without_forces_told(one) for one in effects)
        law = None if law is None else law_without_forces_told(law)
    base = told.base
    least = min(max([_SLIGHT, *untold.deviations.values()]), _LARGEST_SLIGHT)
    if not told.effects and told.law is None and told.stand_in.is_within(least):
        # Beside an effect, a force between samples is off by more than the noise tells; and
        # beside forces in their place parameters would be those of nothing.
        base = tuple(with_interval(one, untold) for one in base)
    return replace(
        told,
        confirmed="simulation",
        effects=effects,
        law=law,
        base=base,
        warnings=(*untold.sentences, *told.warnings),
    )
