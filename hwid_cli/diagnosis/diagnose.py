"""What a simulation of a drive lacks, and what shows it: the whole way, in order.

The base is re-fitted first, because wrong parameters are not a missing effect; then
effects of the catalogue are tried, alone and in sets; held-out recordings decide.
docs/method_diagnosis.md.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.candidate import (
    Baseline,
    SearchStart,
    at_point,
    base_of,
    compared_with_fit,
    fit_candidate,
    fitted_drive,
    rebuilt,
    start_from,
)
from hwid_cli.diagnosis.causes import fit_with_input_noise, without_repeats
from hwid_cli.diagnosis.direction import ReversedInputError, find_reversal
from hwid_cli.diagnosis.effect_sets import includes_one_of
from hwid_cli.diagnosis.findings import Findings, describe
from hwid_cli.diagnosis.hidden import HiddenEffect, hidden_effects
from hwid_cli.diagnosis.intervals import unclear_effects
from hwid_cli.diagnosis.latent_force import Smoothed, latent_force
from hwid_cli.diagnosis.laws import find_law
from hwid_cli.diagnosis.next_experiment import (
    FittedCandidate,
    separation,
    undecided_candidates,
    with_best_lead,
)
from hwid_cli.diagnosis.noise import noise_floor, residual_noise, whiteness
from hwid_cli.diagnosis.parameters import (
    compare_at,
    each_sum_of_squares,
    first_point,
    parameter_layout,
)
from hwid_cli.diagnosis.pieces import JudgedPieces, in_pieces
from hwid_cli.diagnosis.problem import (
    Compared,
    DiagnosisProblem,
    held_out_names,
    prepare,
)
from hwid_cli.diagnosis.rounds import (
    WORTH_MORE,
    OnRound,
    Rounds,
    RoundsResult,
    RunTasks,
    continue_rounds,
    run_rounds,
)
from hwid_cli.diagnosis.scales import (
    line_frequencies,
    line_share,
    scales_of_fit,
    scales_of_recordings,
)
from hwid_cli.diagnosis.search import fit_own
from hwid_cli.diagnosis.selection import (
    LEAST_GAIN,
    SMALL_REMAINDER,
    SelectionCriteria,
    title_of,
)
from hwid_cli.diagnosis.verdict import DiagnosisVerdict, decide
from hwid_cli.diagnosis.where import places
from hwid_cli.diagnosis.zeros import with_zeros
from hwid_cli.drive.catalogue import CATALOGUE, may_be_added, public_id
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import STILL_LARGE, Diagnosis, NoiseFloor
from hwid_cli.records.drive import StandIn
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.own_effects import own_ids
from hwid_cli.records.recordings import Recording

# A line that takes this share of what the base leaves is no colour of noise.
LINE_SHARE = 0.3
# Whole recordings cannot judge where the noise of their start alone, sent through the
# fit, makes up this share of what the fit leaves of them.
LOST_TO_NOISE = 0.3
# The base of a free axis imitates what holds it in place where it leaves this share of half
# of the recordings, or where its damping has grown by this factor. Arms under gravity leave
# 0.9 and more, machines that other forces act on 0.3 at most.
IMITATION_LEAVES = 0.5
IMITATION_DAMPING = 30.0


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
    problem = _problem(recordings, simulation, options)
    return describe(find(problem, options, run_tasks, on_round))


def _problem(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
) -> DiagnosisProblem:
    """What a diagnosis of recordings works on."""
    held_out = held_out_of(recordings, options)
    return without_repeats(prepare(recordings, simulation, options, held_out))


@dataclass(frozen=True, eq=False)
class Separations:
    """How far inputs bring the candidates apart that a diagnosis cannot tell apart.

    Parameters
    ----------
    titles : tuple of str
        The candidates, the best one first.
    ratios : ndarray, shape (n_inputs,), [-]
        Least distance of a rival from the best one, over the noise; NaN where a
        candidate cannot be simulated.
    """

    titles: tuple[str, ...]
    ratios: np.ndarray


def separations(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    inputs: Sequence[np.ndarray],
    run_tasks: RunTasks,
    on_round: OnRound,
) -> Separations:
    """Simulate the candidates of an undecided diagnosis on inputs.

    Parameters
    ----------
    recordings : sequence of Recording
        Of the diagnosis, whose tasks are asked for again.
    inputs : sequence of ndarray, shape (n_samples,), [input unit]
        That could be played, at the sample time of the recordings.

    References
    ----------
    docs/method_diagnosis.md, eq. (D26).
    """
    problem = _problem(recordings, simulation, options)
    found = find(problem, options, run_tasks, on_round)
    criteria, fits = found.criteria, list(found.found.fits.values())
    candidates = undecided_candidates(criteria, found.verdict, fits)
    candidates = with_best_lead(criteria, candidates, fits)
    titles = tuple(title_of(one) for one in candidates)
    if len(candidates) < 2:
        return Separations(titles, np.full(len(inputs), np.nan))
    best, *rivals = (
        FittedCandidate(*rebuilt(problem, one, found.scales)) for one in candidates
    )
    noise = max(criteria.noise.rms, np.finfo(float).tiny)
    ratios = [
        min(separation(problem, best, rival, one) for rival in rivals) / noise
        for one in inputs
    ]
    return Separations(titles, np.array(ratios))


def hidden(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    inputs: Sequence[np.ndarray],
    run_tasks: RunTasks,
    on_round: OnRound,
) -> list[HiddenEffect]:
    """Look for effects that a diagnosis does not name, in inputs.

    Parameters
    ----------
    recordings : sequence of Recording
        Of the diagnosis, whose tasks are asked for again.
    inputs : sequence of ndarray, shape (n_samples,), [input unit]
        That could be played, at the sample time of the recordings.

    References
    ----------
    docs/method_diagnosis.md, eq. (D26b).
    """
    problem = _problem(recordings, simulation, options)
    found = find(problem, options, run_tasks, on_round)
    on_round("hidden effects", 0)
    return hidden_effects(found, allowed_effects(problem, options), inputs, run_tasks)


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
) -> Findings:
    """Find what the drive of a problem lacks.

    Parameters
    ----------
    given_sse : ndarray, shape (n_recordings,), or None, [output unit squared]
        What the simulation leaves with the parameters that the configuration gives; None
        where that is the problem's own drive.

    Raises
    ------
    ConfigError
        If the output clearly moves against the input.
    """
    on_round("base", 0)
    fitted = _fitted_base(problem)
    problem, noise, base, scales = (
        fitted.problem,
        fitted.noise,
        fitted.base,
        fitted.scales,
    )
    drive = fitted_drive(problem.drive, base)

    before = compared_with_fit(problem, base, scales)
    force = latent_force(before, drive, noise)
    where = places(before, noise, drive, force)

    criteria = SelectionCriteria.of(problem, noise)
    if given_sse is None:
        given_sse = each_sum_of_squares([one.residual for one in fitted.given])
    rounds = Rounds(
        problem,
        Baseline(drive, scales, noise, problem.drive),
        criteria,
        base,
        allowed_effects(problem, options),
        run_tasks,
        on_round,
    )
    searched = _search(rounds, given_sse, force, options.max_effects)
    found, seeds = searched.found, searched.seeds
    on_round("verdict", 0)
    verdict = _decided(rounds, given_sse, found)
    whole = Findings(
        problem=problem, criteria=criteria, scales=scales, given_sse=given_sse,
        base=base, before=before, force=force, where=where,
        found=found, verdict=verdict,
    )  # fmt: skip
    # Where a drive stands for another simulation, that one judges.
    if _is_lost(criteria, verdict, base) and seeds and criteria.standing is None:
        judged = _judged_in_pieces(rounds, whole, searched)
        if judged is not None:
            return judged
    # Who asks for some effects only wants no formula instead.
    is_open = options.laws == "auto" and options.effects is None
    if is_open or options.laws == "only":
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
    if explains or not is_open or not base.is_usable:
        return whole
    noise = residual_noise(whole.before, criteria.noise, whole.problem.unit)
    if noise is None:
        return whole
    criteria = replace(criteria, noise=noise)
    left = whiteness([one.residual for one in whole.before], noise)
    base = replace(base, whiteness=left, cause="coloured_noise")
    verdict = decide(criteria, whole.given_sse, base, {}, (), lambda _: ())
    return replace(whole, criteria=criteria, base=base, verdict=verdict)


@dataclass(frozen=True, eq=False)
class _FittedBase:
    """The re-fitted base, and the causes beside effects that it has led to.

    Parameters
    ----------
    problem : DiagnosisProblem
        With the zeros of its recordings where these differ.
    given : list of Compared
        With the parameters that the configuration gives.
    """

    problem: DiagnosisProblem
    noise: NoiseFloor
    given: list[Compared]
    scales: Scales
    base: CandidateFit


def _fitted_base(problem: DiagnosisProblem) -> _FittedBase:
    """Fit the base again, with what measuring alone explains."""
    noise = noise_floor(problem)
    given = compared_as_given(problem)
    scales = scales_of_recordings(problem, [one.velocity for one in given])
    base = _refit_base(problem, scales, noise)
    if _shakes_at_rest(problem, base, scales, noise):
        noise = noise_floor(problem, rests=False)
        base = _refit_base(problem, scales, noise)
    reversal = find_reversal(problem, base, scales, noise)
    if reversal is not None:
        raise ReversedInputError(reversal)
    base = _with_input_noise(problem, base, scales, noise)
    problem, base = with_zeros(problem, base, scales, noise)
    if base.cause == "zeros":
        given = compared_as_given(problem)
    if base.is_usable:
        scales = scales_of_fit(problem, base, scales, noise)
    return _FittedBase(problem, noise, given, scales, base)


@dataclass(frozen=True, eq=False)
class _Searched:
    """Sets of effects, from whole recordings and where these are lost from pieces.

    Parameters
    ----------
    found : RoundsResult
        On whole recordings.
    seeds : tuple of CandidateFit
        Best sets of each size on pieces; empty where these were not asked.
    smoothed : sequence of Smoothed
        Motion that pieces start from.
    """

    found: RoundsResult
    seeds: tuple[CandidateFit, ...]
    smoothed: Sequence[Smoothed]


def _search(
    rounds: Rounds, given_sse: np.ndarray, force: Sequence[Smoothed], max_effects: int
) -> _Searched:
    """Look for sets of effects on whole recordings, and on pieces where these fail."""
    base, criteria = rounds.base, rounds.criteria
    found, seeds = RoundsResult(), tuple[CandidateFit, ...]()
    if not base.is_usable or criteria.needs_nothing(base):
        return _Searched(found, seeds, force)
    known = None
    if _imitates(rounds):
        given = compared_as_given(rounds.problem)
        force = latent_force(given, rounds.problem.drive, rounds.baseline.noise)
        seeds, near, wide = _seeds_of_pieces(rounds, force, max_effects)
        for these in ((*seeds, *near), wide):
            found = continue_rounds(rounds, found, these)
            if found.best and criteria.is_nearly_all(found.best[-1], base):
                return _Searched(found, seeds, force)
        if not _is_lost(criteria, _decided(rounds, given_sse, found), base):
            known = found
    found = run_rounds(rounds, max_effects, known=known)
    is_lost = _is_lost(criteria, _decided(rounds, given_sse, found), base)
    if not is_lost or rounds.problem.compares_command:
        return _Searched(found, seeds, force)
    seeds = seeds or _seeds_of_pieces(rounds, force, max_effects)[0]
    return _Searched(continue_rounds(rounds, found, seeds), seeds, force)


def _imitates(rounds: Rounds) -> bool:
    """Whether the base of a free axis imitates what holds it in place.

    Without a spring only a huge damping keeps still. No effect fits from there, and where
    a force is curved a heavily damped drive takes dozens of steps in a sample. Short
    pieces leave the base where the configuration has it.
    """
    problem, drive = rounds.problem, rounds.problem.drive
    is_free = drive.stiffness_N_per_m == 0 and not isinstance(drive, StandIn)
    if problem.compares_command or not is_free:
        return False
    damping = rounds.baseline.drive.damping_N_s_per_m
    is_damped = damping > IMITATION_DAMPING * drive.damping_N_s_per_m > 0
    much = rounds.base.sse > IMITATION_LEAVES * problem.each_motion
    return is_damped or bool(2 * np.count_nonzero(much) > much.size)


def _is_lost(
    criteria: SelectionCriteria, verdict: DiagnosisVerdict, base: CandidateFit
) -> bool:
    """Whether whole recordings settle nothing, with much left."""
    is_open = verdict.word in ("unknown", "ambiguous")
    if verdict.word == "named":
        # What all near sets share has a name without being enough.
        is_open = not criteria.may_be_named(verdict.chosen, base)
    return is_open and criteria.ratio(verdict.chosen) > STILL_LARGE


def _decided(
    rounds: Rounds, given_sse: np.ndarray, found: RoundsResult
) -> DiagnosisVerdict:
    """Weigh what was found."""
    return decide(
        rounds.criteria,
        given_sse,
        rounds.base,
        found.fits,
        found.best,
        lambda one: unclear_effects(rounds.problem, one, rounds.baseline.scales),
    )


def compared_as_given(problem: DiagnosisProblem) -> list[Compared]:
    """Simulate with the parameters that the configuration gives.

    What belongs to one recording alone (a start, a phase) is found from it.
    """
    present = drive_effects(problem.drive)
    speeds = [signals.velocity for signals in problem.signals]
    rough = scales_of_recordings(problem, speeds)
    fit_layout = parameter_layout(problem, tuple(present), present, rough)
    point = first_point(problem, fit_layout, problem.drive, present)
    own = fit_own(problem, fit_layout, point.shared)
    return compare_at(problem, fit_layout, own)


def _refit_base(
    problem: DiagnosisProblem, scales: Scales, noise: NoiseFloor
) -> CandidateFit:
    """Base, and the effects that the simulation has already, fitted again."""
    start = SearchStart(base_of(problem.drive), drive_effects(problem.drive))
    return fit_candidate(problem, (), [start], scales, noise)


def _seeds_of_pieces(
    rounds: Rounds, force: Sequence[Smoothed], max_effects: int
) -> tuple[tuple[CandidateFit, ...], ...]:
    """Sets that pieces of the recordings lead to.

    Returns
    -------
    tuple of CandidateFit
        The best set of each size.
    tuple of CandidateFit
        Others that come near it: whole recordings may choose one of them.
    tuple of CandidateFit
        Near ones that include a best set.
    """
    of_pieces = _rounds_of(rounds, in_pieces(rounds.problem, force))
    if not of_pieces.base.is_usable:
        return (), (), ()
    free = in_pieces(rounds.problem, force, are_free=True)
    criteria = SelectionCriteria.of(free, rounds.baseline.noise)

    def is_enough(winner: CandidateFit) -> bool:
        # What starts that are not exact leave looks as if more were missing.
        return criteria.ratio(_from_there(rounds, free, winner)) <= SMALL_REMAINDER

    found = run_rounds(of_pieces, max_effects, is_enough)
    excess = of_pieces.criteria.excess
    most = {len(one.effects): WORTH_MORE * excess(one) for one in found.best}
    chosen = [one.effects for one in found.best]
    others = [
        one
        for one in found.fits.values()
        if one.is_usable
        and one.effects not in chosen
        and excess(one) <= most.get(len(one.effects), -np.inf)
    ]
    wide = [one for one in others if includes_one_of(one.effects, chosen)]
    near = [one for one in others if one not in wide]
    return tuple(found.best), tuple(near), tuple(wide)


def _from_there(
    rounds: Rounds, problem: DiagnosisProblem, found: CandidateFit
) -> CandidateFit:
    """The same effects fitted to another problem, from where their fit has ended."""
    start = start_from(problem.drive, found)
    baseline = rounds.baseline
    return fit_candidate(
        problem, found.effects, [start], baseline.scales, baseline.noise
    )


def _rounds_of(rounds: Rounds, pieces: DiagnosisProblem) -> Rounds:
    """The same rounds on pieces of the recordings, with their own base."""
    baseline, present = rounds.baseline, drive_effects(pieces.drive)
    starts = [SearchStart(base_of(baseline.drive), present)]
    if baseline.is_bent:
        starts.append(SearchStart(base_of(pieces.drive), present))
    base = fit_candidate(pieces, (), starts, baseline.scales, baseline.noise)
    # Values of each recording would be values of each piece, which imitate anything.
    shared = tuple(
        one
        for one in rounds.allowed
        if not any(parameter.is_own for parameter in CATALOGUE[one].parameters)
    )
    return replace(
        rounds,
        problem=pieces,
        allowed=shared,
        criteria=SelectionCriteria.of(pieces, baseline.noise),
        base=base,
        baseline=replace(baseline, drive=fitted_drive(pieces.drive, base)),
    )


def _judged_in_pieces(
    rounds: Rounds, whole: Findings, searched: _Searched
) -> Findings | None:
    """What pieces with free starts name, where whole recordings cannot tell.

    None where they name nothing, or where a start that is off by the noise changes whole
    recordings by less than what the named effects leave of them.
    """
    rounds.on_round("pieces with free starts", 0)
    pieces = in_pieces(rounds.problem, searched.smoothed, are_free=True)
    of_pieces = _rounds_of(rounds, pieces)
    if not of_pieces.base.is_usable:
        return None
    found = continue_rounds(of_pieces, RoundsResult(), searched.seeds)
    given = each_sum_of_squares([one.residual for one in compared_as_given(pieces)])
    verdict = _decided(of_pieces, given, found)
    is_near = of_pieces.criteria.ratio(verdict.chosen) <= STILL_LARGE
    if verdict.word != "named" or not is_near:
        return None
    problem, scales, noise = rounds.problem, whole.scales, rounds.baseline.noise
    judged = JudgedPieces(problem, pieces, verdict.chosen)
    spread, left = judged.spread_by_noise(scales, noise.rms)
    if not spread >= LOST_TO_NOISE * left:
        return None
    joined = {name: judged.joined_fit(one) for name, one in found.fits.items()}
    base = judged.joined_fit(of_pieces.base)
    return replace(
        whole,
        given_sse=judged.joined_sse(given),
        base=base,
        before=judged.compared(of_pieces.base, scales),
        found=replace(
            found, fits=joined, best=tuple(joined[one.effects] for one in found.best)
        ),
        verdict=replace(
            verdict,
            chosen=joined[verdict.chosen.effects],
            rivals=tuple(joined[one.effects] for one in verdict.rivals),
        ),
        pieces=judged,
        warnings=(
            f"judged in pieces of {judged.longest_s:.2g} s with starts of their own: over "
            f"whole recordings a start that is off by the noise changes the motion by "
            f"{spread:.2g} {problem.unit}",
        ),
    )


def _with_input_noise(
    problem: DiagnosisProblem, base: CandidateFit, scales: Scales, noise: NoiseFloor
) -> CandidateFit:
    """Base as fitted with the input's noise in mind, if nothing else remains then."""
    may_help = 1.0 < base.whiteness < np.inf and noise.input_rms > 0
    if not may_help or problem.compares_command:
        return base
    fit_layout, point = rebuilt(problem, base, scales)
    point = fit_with_input_noise(problem, fit_layout, point, noise)
    found = at_point(problem, base, fit_layout, point, noise)
    return found if found.cause == "input_noise" else base


def _shakes_at_rest(
    problem: DiagnosisProblem, base: CandidateFit, scales: Scales, noise: NoiseFloor
) -> bool:
    """Whether the colour at rest is a line that goes on all the time: motion."""
    if not (noise.is_coloured and noise.method == "rest" and base.is_usable):
        return False
    compared = compared_with_fit(problem, base, scales)
    white = replace(noise, whitening=(1.0,))
    line = line_frequencies(compared, white)[0]
    return line_share(compared, line) > LINE_SHARE


def allowed_effects(
    problem: DiagnosisProblem, options: DiagnoseOptions
) -> tuple[str, ...]:
    """Ids that may be named: those asked for that make sense for this drive."""
    wanted = () if options.laws == "only" else options.effects
    present = drive_effects(problem.drive)
    has_spring = problem.drive.stiffness_N_per_m > 0
    has_circuit = problem.drive.resistance_ohm is not None
    several = len(problem.part(held_out=False).signals) > 2
    own = {one: CATALOGUE[one] for one in own_ids(options.own_effects)}
    return tuple(
        name
        for name, effect in {**CATALOGUE, **own}.items()
        if (wanted is None or public_id(name) in wanted)
        # A second one waits for the first.
        and may_be_added(name, {*present, effect.beside})
        and (has_spring or not effect.needs_spring)
        and (has_circuit or not effect.needs_circuit)
        and (several or not any(one.is_own for one in effect.parameters))
        and not (problem.compares_command and effect.enters == "output")
    )
