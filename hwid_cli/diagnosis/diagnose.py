"""What a simulation of a drive lacks, and what shows it: the whole way, in order.

The base is re-fitted first, because wrong parameters are not a missing effect; then
effects of the catalogue are tried, alone and in sets; held-out recordings decide.
docs/method_diagnosis.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.base_fit import (
    FittedBase,
    asks_for_resistance,
    compared_as_given,
    fitted_base,
    fitted_from,
    with_free_resistance,
)
from hwid_cli.diagnosis.behind_loop import unseen_in_command
from hwid_cli.diagnosis.candidate import (
    Baseline,
    compared_with_fit,
    fitted_drive,
)
from hwid_cli.diagnosis.causes import without_damage, without_repeats
from hwid_cli.diagnosis.findings import Findings, describe
from hwid_cli.diagnosis.found_start import started_in_motion, with_found_start
from hwid_cli.diagnosis.held_command import (
    best_of,
    does_as_well,
    is_held,
    is_settled_if_held,
    most_likely,
    other_command,
    with_held_command,
)
from hwid_cli.diagnosis.held_out import held_out_names
from hwid_cli.diagnosis.judgement import decided, is_lost
from hwid_cli.diagnosis.latent_force import Smoothed, latent_force
from hwid_cli.diagnosis.laws import find_law
from hwid_cli.diagnosis.noise_filter import (
    FilteredTasks,
    filtered_sentence,
    holds_that_noise,
    plain_errors_sentence,
    with_noise_filter,
)
from hwid_cli.diagnosis.odd_recordings import with_odd_ones_trained
from hwid_cli.diagnosis.parameters import each_sum_of_squares
from hwid_cli.diagnosis.pieces_search import (
    imitates,
    judged_in_pieces,
    seeds_of_pieces,
)
from hwid_cli.diagnosis.problem import (
    Compared,
    DiagnosisProblem,
    prepare,
)
from hwid_cli.diagnosis.residual_noise import residual_noise
from hwid_cli.diagnosis.resonances import resonances
from hwid_cli.diagnosis.rounds import RoundsResult, continue_rounds, run_rounds
from hwid_cli.diagnosis.selection import (
    LEAST_EXPLAINED_SET,
    LEAST_GAIN,
    MOST_LEFT_BY_SET,
    SelectionCriteria,
)
from hwid_cli.diagnosis.set_fits import Rounds
from hwid_cli.diagnosis.tasks import OnRound, RunTasks
from hwid_cli.diagnosis.verdict import decide
from hwid_cli.diagnosis.where import places
from hwid_cli.diagnosis.whiteness import whiteness
from hwid_cli.drive.catalogue import CATALOGUE, may_be_added, public_id
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import STILL_LARGE, Diagnosis, NoiseFloor
from hwid_cli.records.drive import LINE, StandIn
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.own_effects import own_ids
from hwid_cli.records.recordings import Recording

# Searches that may follow each other: the first, one beside a better base or a held
# command, and one behind the filter for noise of the input.
MOST_SEARCHES = 3
# Times the noise that a law leaves at most which takes the place of larger sets.
_LEFT_BY_SHORT_LAW = 2.0
_BEHIND_INPUT = (
    "compared is the output behind the logged input: in the controller's command hardly "
    "anything of this shows"
)


def diagnose(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    run_tasks: RunTasks,
    on_round: OnRound,
) -> Diagnosis:
    """Find what a simulation lacks.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    run_tasks : callable
        Computes tasks, or takes their results from where it kept them.
    on_round : callable
        Called with what begins and its number of tasks.
    """
    problem = problem_of(recordings, simulation, options)
    found = find(problem, options, run_tasks, on_round)
    chosen = found.verdict.chosen
    if chosen.effects or not unseen_in_command(problem, chosen, found.scales):
        return describe(found)
    # The machine has answered to the logged input, whatever has asked for it.
    problem = problem_of(recordings, replace(simulation, controller=None), options)
    behind = find(problem, options, run_tasks, on_round)
    if not behind.verdict.chosen.effects:
        return describe(found)
    return describe(replace(behind, warnings=(*behind.warnings, _BEHIND_INPUT)))


def problem_of(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
) -> DiagnosisProblem:
    """What a diagnosis of recordings works on."""
    held_out = held_out_of(recordings, options)
    problem = prepare(recordings, simulation, options, held_out)
    return without_damage(without_repeats(problem))


def held_out_of(
    recordings: Sequence[Recording], options: DiagnoseOptions
) -> tuple[str, ...]:
    """Names of the recordings that are held out: as asked for, or chosen."""
    held_out = options.hold_out
    return held_out_names(recordings) if isinstance(held_out, str) else held_out


def find(
    problem: DiagnosisProblem,
    options: DiagnoseOptions,
    run_tasks: RunTasks,
    on_round: OnRound,
    given_sse: np.ndarray | None = None,
    *,
    may_cut: bool = True,
) -> Findings:
    """Find what the drive of a problem lacks.

    Parameters
    ----------
    given_sse : ndarray, shape (n_recordings,), or None, [output unit squared]
        What the simulation leaves with the parameters that the configuration gives; None
        where that is the problem's own drive.
    may_cut : bool
        Look in pieces of the recordings, too, where whole ones settle nothing.

    Raises
    ------
    ConfigError
        If the output clearly moves against the input.
    """
    searched = _held_or_not(problem, options, run_tasks, on_round, given_sse)
    if may_cut:
        searched = _with_pieces(searched, options.max_effects)
    filtered = _behind_noise_filter(searched, options)
    if filtered is not None:
        searched = _led_by(searched, filtered)
        if not _is_settled(searched):
            behind = _told_behind_filter(searched, filtered, options)
            if behind is not None:
                return behind
    whole = _judged(searched, options)
    if whole.pieces is not None or whole.law is not None:
        return whole
    return replace(whole, other=other_command(searched.rounds, whole.verdict.chosen))


def _held_or_not(
    problem: DiagnosisProblem,
    options: DiagnoseOptions,
    run_tasks: RunTasks,
    on_round: OnRound,
    given_sse: np.ndarray | None,
) -> "_Searched":
    """What is found beside a command in straight lines, or beside a held one."""
    on_round("base", 0)
    fitted, held = _begun(problem, options), None
    if problem.may_be_held and not _lacks_nothing(fitted):
        held = _begun(with_held_command(problem), options)
        if _lacks_nothing(held):
            return _searched(held, options, run_tasks, on_round, given_sse)
    searched = _searched(fitted, options, run_tasks, on_round, given_sse)
    rounds, found = searched.rounds, searched.found
    if held is not None and searched.has_gap and is_held(rounds, found):
        again = _begun_search(held, options, run_tasks, on_round, given_sse)
        seeds = most_likely(rounds, found)
        likely = continue_rounds(again.rounds, RoundsResult(), seeds)
        if again.rounds.criteria.is_complete(best_of(again.rounds, likely)):
            again = replace(again, found=likely)
        else:
            again = _searched(held, options, run_tasks, on_round, given_sse)
        best = best_of(again.rounds, again.found)
        if does_as_well(rounds, best, best_of(rounds, found)):
            searched = again
    return searched


def _behind_noise_filter(
    searched: "_Searched", options: DiagnoseOptions
) -> "_Searched | None":
    """A second look, where noise of the input hides what is missing.

    None where it is not needed.
    """
    rounds, criteria = searched.rounds, searched.rounds.criteria
    if not searched.is_open or criteria.standing is not None or options.laws == "only":
        return None
    verdict = decided(rounds, searched.given_sse, searched.found)
    is_settled = verdict.is_complete or bool(verdict.chosen.cause)
    if is_settled or criteria.ratio(verdict.chosen) <= STILL_LARGE:
        return None
    noise = rounds.baseline.noise
    problem = with_noise_filter(rounds.problem, rounds.baseline.drive, noise)
    if problem is None:
        return None
    rounds.on_round("behind a filter for noise of the input", 0)
    run_tasks = FilteredTasks(rounds.run_tasks, problem)
    return _held_or_not(problem, options, run_tasks, rounds.on_round, None)


def _led_by(searched: "_Searched", filtered: "_Searched") -> "_Searched":
    """Whole recordings, with the sets that were found behind a filter fitted to them.

    Errors that follow from earlier ones are hidden there, so that sets are found to which
    no way leads from single effects.
    """
    rounds, drive = searched.rounds, filtered.rounds.problem.drive
    seeds = [one for one in filtered.found.best if one.is_usable]
    if not seeds or drive.hold != rounds.problem.drive.hold:
        return searched
    found = continue_rounds(rounds, searched.found, seeds, with_relatives=True)
    return replace(searched, found=found)


def _is_settled(searched: "_Searched") -> bool:
    """Whether whole recordings say what is missing, and little is left."""
    rounds = searched.rounds
    verdict = decided(rounds, searched.given_sse, searched.found)
    is_named = verdict.word in ("named", "ambiguous")
    return is_named and rounds.criteria.ratio(verdict.chosen) <= STILL_LARGE


def _told_behind_filter(
    searched: "_Searched", filtered: "_Searched", options: DiagnoseOptions
) -> Findings | None:
    """What is found behind a filter for noise of the input; None if nothing is settled."""
    noise = searched.rounds.baseline.noise
    told = _judged(filtered, replace(options, laws="never"))
    left = told.criteria.ratio(told.verdict.chosen)
    if told.verdict.word == "unknown" or left > MOST_LEFT_BY_SET:
        return None
    whole = filtered.rounds.problem.without_filter()
    if not holds_that_noise(whole, told.verdict.chosen, told.scales, noise):
        return None
    if told.pieces is None:
        told = replace(told, other=other_command(filtered.rounds, told.verdict.chosen))
    return _with_both_errors(told, noise)


def _with_both_errors(told: Findings, noise: NoiseFloor) -> Findings:
    """Findings behind a filter that say so, and what whole recordings differ by."""
    problem, chosen = told.problem, told.verdict.chosen
    after = compared_with_fit(problem, chosen, told.scales)
    before_rms, after_rms = (
        float(np.sqrt(np.mean(np.concatenate([one.residual for one in these]) ** 2)))
        for these in (told.before, after)
    )
    said = plain_errors_sentence(before_rms, after_rms, problem.unit)
    floor = replace(
        told.criteria.noise,
        resolution=noise.resolution,
        sentence=filtered_sentence(noise, problem.input_unit),
    )
    return replace(
        told,
        criteria=replace(told.criteria, noise=floor),
        warnings=(*told.warnings, said),
    )


@dataclass(frozen=True, eq=False)
class _Searched:
    """What the search for effects began with, and what it has found.

    Parameters
    ----------
    given_sse : ndarray, shape (n_recordings,), [output unit squared]
        Of the simulation with the parameters that the configuration gives.
    before : list of Compared
        Simulations with the re-fitted base.
    force : list of Smoothed
        That the re-fitted base lacks.
    found : RoundsResult
        On whole recordings.
    seeds : tuple of CandidateFit
        Best sets of each size on pieces; empty where these were not asked.
    smoothed : list of Smoothed
        Motion that pieces start from.
    has_short_law : bool
        Whether larger sets, pieces and filters were left out because a short law holds.
    """

    rounds: Rounds
    given_sse: np.ndarray
    before: list[Compared]
    force: list[Smoothed]
    found: RoundsResult
    seeds: tuple[CandidateFit, ...]
    smoothed: list[Smoothed]
    has_short_law: bool = False

    @property
    def has_gap(self) -> bool:
        """Whether the re-fitted base leaves something to explain."""
        base = self.rounds.base
        return base.is_usable and not self.rounds.criteria.needs_nothing(base)

    @property
    def is_open(self) -> bool:
        """Whether something is left that no short law holds."""
        return self.has_gap and not self.has_short_law

    @property
    def best(self) -> CandidateFit | None:
        """The set of effects of the lowest criterion, if there is one."""
        criteria, base = self.rounds.criteria, self.rounds.base
        fits = [one for one in self.found.fits.values() if one.is_usable]
        best = max(fits, key=lambda one: criteria.gain(one, base), default=None)
        return best if best is not None and criteria.gain(best, base) > 0 else None


def _begun(problem: DiagnosisProblem, options: DiagnoseOptions) -> FittedBase:
    """The base fitted again, from where recordings start."""
    fitted = _from_found_start(fitted_base(problem), problem)
    if isinstance(options.hold_out, str):
        fitted = _with_odd_ones_trained(fitted)
    return fitted


def _lacks_nothing(fitted: FittedBase) -> bool:
    """Whether a base leaves nothing but noise, or what measuring alone explains."""
    criteria = SelectionCriteria.of(fitted.problem, fitted.noise)
    return fitted.base.is_usable and criteria.needs_nothing(fitted.base)


def _searched(
    fitted: FittedBase,
    options: DiagnoseOptions,
    run_tasks: RunTasks,
    on_round: OnRound,
    given_sse: np.ndarray | None,
) -> _Searched:
    """Search for sets of effects."""
    searched = _beside(fitted, options, run_tasks, on_round, given_sse)
    better = _better_base(fitted, searched)
    if better is not None:
        fitted = better
        searched = _beside(fitted, options, run_tasks, on_round, given_sse)
    best = searched.best
    if best is None or not asks_for_resistance(fitted.problem, best):
        return searched
    free = with_free_resistance(fitted)
    other = _beside(free, options, run_tasks, on_round, given_sse)
    is_better = other.best is not None and (
        searched.rounds.criteria.gain(other.best, best) > 0
    )
    return other if is_better else searched


def _from_found_start(fitted: FittedBase, problem: DiagnosisProblem) -> FittedBase:
    """The base from where recordings start, where they do not start in balance.

    Zeros of the sensor that differ are no places of the machine.
    """
    if _lacks_nothing(fitted):
        return fitted
    found = with_found_start(problem)
    if found is not problem:
        fitted = fitted_base(found)
    if found.start == "estimated" or _lacks_nothing(fitted):
        return fitted
    return started_in_motion(problem, fitted.base) or fitted


def _better_base(fitted: FittedBase, searched: _Searched) -> FittedBase | None:
    """The base from where the best single effect has led it, if that leaves much less.

    A drive that stands for another simulation has a base that is near in any case.
    """
    rounds = searched.rounds
    singles = [
        one
        for one in searched.found.fits.values()
        if len(one.effects) == 1 and one.is_usable
    ]
    if not searched.has_gap or not singles or rounds.criteria.standing is not None:
        return None
    best = max(singles, key=lambda one: rounds.criteria.gain(one, rounds.base))
    explained = rounds.criteria.evidence(best, rounds.base).explained
    return fitted_from(fitted, best) if explained >= LEAST_EXPLAINED_SET else None


def _beside(
    fitted: FittedBase,
    options: DiagnoseOptions,
    run_tasks: RunTasks,
    on_round: OnRound,
    given_sse: np.ndarray | None,
) -> _Searched:
    """Search for sets of effects beside a base."""
    begun = _begun_search(fitted, options, run_tasks, on_round, given_sse)
    return _on_whole_recordings(begun, options)


def _begun_search(
    fitted: FittedBase,
    options: DiagnoseOptions,
    run_tasks: RunTasks,
    on_round: OnRound,
    given_sse: np.ndarray | None,
) -> _Searched:
    """What a search beside a base begins with: nothing is found yet."""
    problem, noise, base = fitted.problem, fitted.noise, fitted.base
    drive = fitted_drive(problem.drive, base)
    before = compared_with_fit(problem, base, fitted.scales)
    force = latent_force(before, drive, noise)
    if given_sse is None:
        given_sse = each_sum_of_squares([one.left for one in fitted.given])
    allowed = allowed_effects(problem, options)
    baseline = Baseline(drive, fitted.scales, noise, problem.drive)
    criteria = SelectionCriteria.of(problem, noise)
    if base.is_usable and not criteria.needs_nothing(base):
        seen = resonances(problem, drive, allowed, fitted.scales, run_tasks)
        baseline = replace(baseline, resonances=seen)
    rounds = Rounds(
        problem,
        baseline,
        criteria,
        base,
        allowed,
        run_tasks,
        on_round,
    )
    return _Searched(rounds, given_sse, before, force, RoundsResult(), (), force)


def _with_odd_ones_trained(fitted: FittedBase) -> FittedBase:
    """The base fitted again where the few recordings that hold the gap were held out."""
    if not fitted.base.is_usable or _lacks_nothing(fitted):
        return fitted
    criteria = SelectionCriteria.of(fitted.problem, fitted.noise)
    excess = np.maximum(fitted.base.sse - criteria.floors, 0.0)
    problem = with_odd_ones_trained(fitted.problem, excess)
    return fitted if problem is fitted.problem else fitted_base(problem)


def _on_whole_recordings(searched: _Searched, options: DiagnoseOptions) -> _Searched:
    """Look for sets of effects; from pieces first where the base imitates."""
    rounds, found, max_effects = searched.rounds, searched.found, options.max_effects
    if not searched.has_gap:
        return searched
    criteria, known = rounds.criteria, None
    if imitates(rounds):
        given = compared_as_given(rounds.problem)
        smoothed = latent_force(given, rounds.problem.drive, rounds.baseline.noise)
        seeds, near, wide = seeds_of_pieces(rounds, smoothed, max_effects)
        searched = replace(searched, seeds=seeds, smoothed=smoothed)
        found = continue_rounds(rounds, found, (*seeds, *near))
        # What a plain stop leaves, one with a damper may be.
        if found.best and not (
            criteria.leaves_noise(found.best[-1]) or _is_enough_if_held(rounds, found)
        ):
            found = continue_rounds(rounds, found, wide)
        if found.best and criteria.is_nearly_all(found.best[-1], rounds.base):
            return replace(searched, found=found)
        if not is_lost(
            criteria, decided(rounds, searched.given_sse, found), rounds.base
        ):
            known = found

    has_law = False

    def is_enough(so_far: RoundsResult) -> bool:
        nonlocal has_law
        if _is_enough_if_held(rounds, so_far):
            return True
        if len(so_far.best) < max_effects:
            has_law = _has_short_law(replace(searched, found=so_far), options)
        return has_law

    if criteria.is_close_to_noise(rounds.base):
        # A third of the noise holds no set of effects.
        max_effects = min(max_effects, 1)
    found = run_rounds(rounds, max_effects, is_enough, known)
    return replace(searched, found=found, has_short_law=has_law)


def _is_enough_if_held(rounds: Rounds, found: RoundsResult) -> bool:
    """Whether next to nothing remains beside a held command, where it may be held."""
    problem = rounds.problem
    is_line = problem.may_be_held and problem.drive.hold == LINE
    return is_line and is_settled_if_held(rounds, found)


def _has_short_law(searched: _Searched, options: DiagnoseOptions) -> bool:
    """Whether a law leaves little where all sets of as many effects leave much.

    Larger sets, which take most of the time, would only imitate it.
    """
    rounds, found = searched.rounds, searched.found
    if not _may_be_law(options) or not found.best:
        return False
    criteria, best = rounds.criteria, found.best[-1]
    # Where a drive stands for another simulation, the rest may be its own error: only a law
    # that is all of it makes larger sets needless.
    stands_in = criteria.standing is not None
    if criteria.ratio(best) <= STILL_LARGE and not stands_in:
        return False
    if criteria.is_nearly_all(best, rounds.base):
        return False
    verdict = decided(rounds, searched.given_sse, found)
    told, _, law = find_law(
        rounds, searched.before, searched.force, found, verdict, len(found.best)
    )
    chosen = told.chosen
    if law is None or criteria.ratio(chosen) > _LEFT_BY_SHORT_LAW:
        return False
    return criteria.leaves_noise(chosen) or not stands_in


def _may_be_law(options: DiagnoseOptions) -> bool:
    """Whether formulas are asked for; who asks for some effects only wants none instead."""
    return options.laws == "auto" and options.effects is None


def _with_pieces(searched: _Searched, max_effects: int) -> _Searched:
    """Look in pieces of the recordings, too, where whole ones settle nothing."""
    rounds, found = searched.rounds, searched.found
    if not searched.is_open or rounds.problem.compares_command:
        return searched
    verdict = decided(rounds, searched.given_sse, found)
    if not is_lost(rounds.criteria, verdict, rounds.base):
        return searched
    seeds = searched.seeds
    if not seeds:
        seeds, _, _ = seeds_of_pieces(rounds, searched.smoothed, max_effects)
    return replace(searched, seeds=seeds, found=continue_rounds(rounds, found, seeds))


def _judged(searched: _Searched, options: DiagnoseOptions) -> Findings:
    """Decide, from pieces and formulas where whole recordings and effects do not."""
    rounds, given_sse, found = searched.rounds, searched.given_sse, searched.found
    criteria, base, seeds = rounds.criteria, rounds.base, searched.seeds
    before, force = searched.before, searched.force
    where = places(before, rounds.baseline.noise, rounds.baseline.drive, force)
    rounds.on_round("verdict", 0)
    verdict = decided(rounds, given_sse, found)
    whole = Findings(
        problem=rounds.problem, criteria=criteria, scales=rounds.baseline.scales,
        given_sse=given_sse, base=base, before=before, force=force, where=where,
        found=found, verdict=verdict,
    )  # fmt: skip
    # Pieces were asked, and whole recordings leave much, whatever they name: it may be what
    # the noise of their starts grows to. Where a drive stands for another simulation, that
    # one judges.
    is_far = criteria.ratio(verdict.chosen) > STILL_LARGE
    if is_far and seeds and criteria.standing is None:
        judged = judged_in_pieces(rounds, whole, seeds, searched.smoothed)
        if judged is not None:
            return judged
    if _may_be_law(options) or options.laws == "only":
        verdict, found, law = find_law(rounds, before, force, found, verdict)
        whole = replace(whole, found=found, verdict=verdict, law=law)
    return _with_residual_noise(whole)


def _with_residual_noise(whole: Findings) -> Findings:
    """What is left as noise, where nothing explains anything of it and it looks like it."""
    criteria, base = whole.criteria, whole.base
    explains = any(
        criteria.gain(one, base) >= LEAST_GAIN for one in whole.found.fits.values()
    )
    # Where a drive stands for another simulation, its own error may have any colour.
    is_open = whole.verdict.word == "unknown" and criteria.standing is None
    is_open = is_open and not whole.problem.is_filtered
    if explains or not is_open or not base.is_usable:
        return whole
    noise = residual_noise(whole.before, criteria.noise, whole.problem.unit)
    if noise is None:
        return whole
    criteria = replace(criteria, noise=noise)
    left = whiteness([one.residual for one in whole.before], noise)
    cause = "coloured_noise" if noise.is_coloured else base.cause
    base = replace(base, whiteness=left, cause=cause)
    verdict = decide(criteria, whole.given_sse, base, {}, (), lambda _: ())
    return replace(whole, criteria=criteria, base=base, verdict=verdict)


def allowed_effects(
    problem: DiagnosisProblem, options: DiagnoseOptions
) -> tuple[str, ...]:
    """Ids that may be named: those asked for that make sense for this drive."""
    wanted = () if options.laws == "only" else options.effects
    present = drive_effects(problem.drive)
    has_spring = problem.drive.stiffness_N_per_m > 0
    has_circuit = problem.drive.resistance_ohm is not None
    stands_in = isinstance(problem.drive, StandIn)
    several = len(problem.part(held_out=False).signals) > 2
    own = {one: CATALOGUE[one] for one in own_ids(options.own_effects)}
    return tuple(
        name
        for name, effect in {**CATALOGUE, **own}.items()
        if (wanted is None or public_id(name) in wanted)
        # A second one waits for the first.
        and may_be_added(name, {*present, effect.beside})
        and (has_spring or not effect.needs_spring)
        and not (has_spring and effect.needs_free_axis)
        and (stands_in or not effect.needs_stand_in)
        and (has_circuit or not effect.needs_circuit)
        and (several or not any(one.is_factor for one in effect.parameters))
        and not (problem.compares_command and effect.enters == "output")
    )
