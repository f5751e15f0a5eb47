"""Diagnosis of a simulation that cannot be opened, by a drive that stands for it.

Its parameters are fitted again where there are some; a plain drive then stands for it
(``stand_in``), and what that lacks is looked for as for any drive. What is found is put
into the simulation itself as a force along its motion, and that run corrects the stand-in,
until both agree: only then is it confirmed. docs/method_diagnosis.md, eq. (D30) to (D33).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.candidate import belongs_to, fitted_drive
from hwid_cli.diagnosis.causes import without_repeats
from hwid_cli.diagnosis.confirmation import confirm, unconfirmed
from hwid_cli.diagnosis.diagnose import find, held_out_of
from hwid_cli.diagnosis.findings import Findings, describe
from hwid_cli.diagnosis.further_effects import with_further_effect
from hwid_cli.diagnosis.laws_in_simulation import law_instead, short_law
from hwid_cli.diagnosis.leads_in_simulation import leads_in_simulation
from hwid_cli.diagnosis.noise import noise_floor
from hwid_cli.diagnosis.own_base import judged_by_own_base, with_own_base
from hwid_cli.diagnosis.own_parameters import fit_parameters
from hwid_cli.diagnosis.problem import DiagnosisProblem, Signals, prepare
from hwid_cli.diagnosis.run_starts import Begun, begin, starts_sentence, with_starts
from hwid_cli.diagnosis.simulator import CountedRuns, Runs, Simulator, most_runs
from hwid_cli.diagnosis.single_effects import ToldByRuns, single_in_simulation
from hwid_cli.diagnosis.stand_in import (
    act_as_forces,
    acts_at_port,
    change_between,
    lag_before,
)
from hwid_cli.diagnosis.standing import its_own, standing_beside
from hwid_cli.diagnosis.tasks import OnRound, RunTasks
from hwid_cli.diagnosis.turns import have_moved, where_it_starts
from hwid_cli.diagnosis.untold import (
    law_without_forces_told,
    untold_parameters,
    with_interval,
    without_forces_told,
)
from hwid_cli.records.diagnosis import BaseParameter, Diagnosis
from hwid_cli.records.drive import StandIn
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import SimulatorRun, StandInChange
from hwid_cli.records.recordings import Recording

# Searches, each from where the last one has moved the parameters by more than this.
MOST_SEARCHES = 3
_MOVED = 0.01
# Beside an effect that runs bear out, parameters that have moved by less had hardly imitated
# it: what else is missing is looked for at once.
_MOVED_BESIDE_NAMED = 0.05
# Of all runs, those after which no further single effect is tried: sets need some, too. Where
# the configuration leaves their number open, what is missing beside an effect, and sets, have
# some beyond them.
_FOR_SINGLES, _FOR_SETS = 0.75, 1.5
# Factors of the stand-in that are none: as far as parameters are told, at most and at
# least by these shares, [-].
_SLIGHT, _LARGEST_SLIGHT = 1e-4, 0.01
_BESIDE_PARAMETERS = (
    "the parameters of the simulation alone do not give what is said here: forces that go "
    "with displacement, velocity and input act beside them, as factors under "
    "simulation.stand_in in extended_simulation.yaml"
)


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
    search = _searched(begun, given, refitted, options, on_round)
    found, values = search.findings, search.values
    if search.is_confirmed and not _is_all_but_nothing(found):
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


def _said_of_runs(counted: CountedRuns, found: Findings) -> tuple[str, ...]:
    """Say that the limit of runs has ended the search, where something is left."""
    if not counted.are_spent:
        return ()
    if found.verdict.is_complete or _is_all_but_nothing(found):
        return ()
    return (
        f"the search reached its limit of runs (diagnose.max_runs) after {counted.count} "
        "runs of the simulation, and may have left out likely effects: a larger limit, as "
        f"in 'diagnose: {{max_runs: {2 * counted.count}}}', takes finished runs from the "
        "cache",
    )


@dataclass(frozen=True, eq=False)
class _Search:
    """What one search beside a stand-in has led to.

    Parameters
    ----------
    values : dict of str to float
        Parameters of the simulation, with what was found where that is confirmed.
    is_confirmed : bool
        Whether the simulation's own run bears it out.
    """

    findings: Findings
    values: dict[str, float]
    is_confirmed: bool

    def stays_beside(self, further: "_Search") -> bool:
        """Whether a further search is no reason to give this one up."""
        if not self.is_confirmed:
            return False
        return not (
            further.is_confirmed and _leaves_less_than(further.findings, self.findings)
        )


def _searched(
    begun: Begun,
    given: Sequence[SimulatorRun],
    values: dict[str, float],
    options: DiagnoseOptions,
    on_round: OnRound,
) -> _Search:
    """Search, again and again while that moves the simulation's parameters.

    Parameters
    ----------
    given : sequence of SimulatorRun
        What the simulation gives with these values of its parameters.
    """
    problem, runs = begun.problem, begun.runs
    simulator = runs.simulator
    # With effects of its own the stand-in says what the whole simulation leaves, and the
    # parameters are fitted with them.
    given_sse = None if simulator.is_extended else _sse(problem.signals, begun.given)
    kept: _Search | None = None
    for count in range(MOST_SEARCHES):
        is_last = count == MOST_SEARCHES - 1
        standing = standing_beside(runs, problem, given, values)
        found, moved, is_confirmed = _found(
            standing, options, (runs, values), on_round, given_sse, is_first=count == 0
        )
        this = _Search(found, moved if is_confirmed else values, is_confirmed)
        if kept is not None and kept.stays_beside(this):
            break
        if kept is None or is_confirmed or not is_last:
            kept = this
        is_all = found.criteria.is_nearly_all(found.verdict.chosen, found.base)
        if is_confirmed and (is_all or _is_all_but_nothing(found)):
            break
        if runs.run_tasks.are_spent or (count and _has_few_runs(runs)):
            break
        # Parameters that imitated what is missing have led elsewhere; or to where nothing
        # holds in the simulation: the given ones have imitated nothing yet.
        is_in_vain = count == MOST_SEARCHES - 2 and not is_confirmed
        following = dict(simulator.values) if is_in_vain else moved
        if not have_moved(values, following, _MOVED):
            break
        values = following
        given = runs.of(problem.signals, values)
    if kept is None:
        raise ValueError("no search was made")
    return kept


def _has_few_runs(runs: Runs) -> bool:
    """Whether no further single effect would be tried."""
    return runs.up_to(_FOR_SINGLES).run_tasks.are_spent


def _found(
    standing: DiagnosisProblem,
    options: DiagnoseOptions,
    simulation: tuple[Runs, dict[str, float]],
    on_round: OnRound,
    given_sse: np.ndarray | None,
    *,
    is_first: bool,
) -> tuple[Findings, dict[str, float], bool]:
    """What the stand-in lacks, single effects first, put into the simulation.

    Where one that explains most has moved the parameters, these had imitated it: no set is
    looked for beside a stand-in of the old ones. One that the simulation's own run bears
    out stays where no set, which a stand-in has chosen, leaves less; a second one is looked
    for beside it first.

    Parameters
    ----------
    simulation : tuple of Runs and dict of str to float
        That it stands for, with these parameters.
    """
    runs, values = simulation
    singles, alone = replace(options, max_effects=1, laws="never"), None
    if options.laws != "only" and runs.simulator.run is not None:
        found = find(
            standing, singles, runs.run_tasks, on_round, given_sse, may_cut=False
        )
        found = with_own_base(found, standing, runs.simulator)
        law = short_law(standing, options, simulation, found, on_round)
        if law is not None:
            return law
        some = runs.up_to(_FOR_SINGLES)
        alone = single_in_simulation(
            found, some, values, on_round, may_pair=options.max_effects > 1
        )
        if alone.findings is not None and alone.is_all:
            return alone.findings, alone.values, True
        told = alone.findings
        least = _MOVED if told is None else _MOVED_BESIDE_NAMED
        begins_anew = is_first and have_moved(values, alone.values, least)
        if begins_anew and not _is_exact(told):
            # What runs bear out stays unless a search from there leaves less.
            return told or found, alone.values, told is not None
        # Nothing more to look for: no gap, or parameters.
        if found.verdict.word in ("none", "parameters"):
            return confirm(found, runs, values)
        if options.max_runs is None:
            runs = runs.up_to(_FOR_SETS)
        alone = with_further_effect(alone, runs, options, on_round)
        is_told = alone.findings is not None
        if begins_anew and not _is_enough(alone):
            return alone.findings or found, alone.values, is_told
        if runs.run_tasks.are_spent or (is_told and _is_enough(alone)):
            lead = _with_runs(unconfirmed(found), alone)
            return alone.findings or lead, alone.values, is_told
    else:
        standing = _with_nearer_spring(standing, singles, runs, on_round)
    return _of_sets(standing, options, (runs, values), on_round, given_sse, alone)


def _is_exact(told: Findings | None) -> bool:
    """Whether what is told was fitted through runs alone, whatever the stand-in says.

    Effects at the ports are, from the parameters as stated, too: a search from where these
    have moved to would tell no more of them.
    """
    return told is not None and acts_at_port(told.verdict.chosen.effects)


def _is_enough(alone: ToldByRuns) -> bool:
    """Whether sets that a stand-in chooses could tell no more than runs have.

    A second effect was looked for in the simulation before.
    """
    one = alone.findings
    return one is not None and (alone.is_all or _is_all_but_nothing(one))


def _is_all_but_nothing(found: Findings) -> bool:
    """Whether what is chosen leaves next to nothing, whatever shape that has."""
    return found.criteria.leaves_next_to_nothing(found.verdict.chosen, found.base)


def _of_sets(
    standing: DiagnosisProblem,
    options: DiagnoseOptions,
    simulation: tuple[Runs, dict[str, float]],
    on_round: OnRound,
    given_sse: np.ndarray | None,
    alone: ToldByRuns | None,
) -> tuple[Findings, dict[str, float], bool]:
    """What the stand-in lacks, several effects at once, put into the simulation.

    Parameters
    ----------
    alone : ToldByRuns or None
        What single effects in the simulation have told, where they were tried.
    """
    runs, values = simulation
    one = None if alone is None else alone.findings
    # What a stand-in leaves of an effect that runs bear out is its own error: pieces,
    # which are asked where nothing is settled, would only repeat it.
    found = find(
        standing, options, runs.run_tasks, on_round, given_sse, may_cut=one is None
    )
    found = with_own_base(found, standing, runs.simulator)
    on_round("the effect in the simulation", 0)
    several = confirm(found, runs, values)
    if alone is None:
        return several
    if not _is_borne_out(several):
        leads = leads_in_simulation(found, runs, values, on_round)
        if leads.findings is not None:
            several = leads.findings, leads.values, True
    if one is None or _leaves_less(several, one):
        told, moved, is_confirmed = several
        return _with_runs(told, alone), moved, is_confirmed
    return one, alone.values, True


def _with_runs(found: Findings, alone: ToldByRuns) -> Findings:
    """Findings in which nothing is named, with what the simulation's runs say of effects.

    Leads are taken from there rather than from a stand-in that errs.
    """
    if found.verdict.word != "unknown":
        return found
    problem = found.problem
    of_runs = {ids: where_it_starts(problem, one) for ids, one in alone.fits.items()}
    leads = {
        ids: one
        for ids, one in of_runs.items()
        if belongs_to(problem, one, found.scales)
    }
    fits = {**found.found.fits, **leads}
    return replace(found, found=replace(found.found, fits=fits))


def _is_borne_out(several: tuple[Findings, dict[str, float], bool]) -> bool:
    """Whether there are effects that the simulation's own run confirms."""
    told, _, is_confirmed = several
    return is_confirmed and bool(told.verdict.chosen.effects)


def _leaves_less(
    several: tuple[Findings, dict[str, float], bool], one: Findings
) -> bool:
    """Whether the simulation's run with a set leaves less than that with one effect."""
    return _is_borne_out(several) and _leaves_less_than(several[0], one)


def _leaves_less_than(one: Findings, other: Findings) -> bool:
    """Whether what is chosen leaves less of all recordings than in other findings."""
    return bool(one.verdict.chosen.sse.sum() < other.verdict.chosen.sse.sum())


def _with_nearer_spring(
    standing: DiagnosisProblem,
    singles: DiagnoseOptions,
    runs: Runs,
    on_round: OnRound,
) -> DiagnosisProblem:
    """The stand-in whose curved spring changes as the recordings say; of outputs alone.

    Outputs do not tell whether a parameter that is off belongs to the straight part of a
    spring alone, as beside a hardening one, or to all of it, as the weight of a pendulum.

    Parameters
    ----------
    singles : DiagnoseOptions
        For single effects alone.
    """
    drive = standing.drive
    if runs.simulator.run is not None:
        return standing
    if not isinstance(drive, StandIn) or drive.bends == (0.0, 0.0):
        return standing
    whole = replace(drive, one_curve_N_per_m=drive.stiffness_N_per_m)
    problems = (standing, replace(standing, drive=whole))
    found = [find(one, singles, runs.run_tasks, on_round) for one in problems]
    criteria, base = found[0].criteria, found[0].base

    def worth(row: int) -> tuple[bool, float]:
        # Where one of them lacks nothing, the other one's effects make up for its curve.
        one = found[row]
        fits = (one.base, *one.found.fits.values())
        best = max(criteria.gain(fit, base) for fit in fits)
        return criteria.needs_nothing(one.base), best

    return problems[max(range(len(problems)), key=worth)]


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
        _lag_sentence(findings),
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


def _lag_sentence(findings: Findings) -> str:
    """Say that effects act behind a lag of the input; empty where none does."""
    effects = findings.verdict.chosen.effects
    lag = lag_before(findings.problem.drive, effects)
    if not lag or not effects or not act_as_forces(effects):
        return ""
    return (
        f"the simulation's input passes a lag of {lag:.3g} s before it acts as a force; "
        "what is missing acts behind it, and comes through the input ahead by as much (an "
        "input for forces, simulation.force_input, shows more)"
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
