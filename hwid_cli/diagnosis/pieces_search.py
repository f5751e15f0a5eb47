"""A search in short pieces of the recordings, where whole ones cannot be followed.

In a piece a free axis cannot drift away, and its base has nothing to imitate.
docs/method_diagnosis.md, eq. (D29).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.diagnosis.base_fit import compared_as_given
from hwid_cli.diagnosis.candidate import (
    SearchStart,
    base_of,
    fit_candidate,
    fitted_drive,
    start_from,
)
from hwid_cli.diagnosis.effect_sets import includes_one_of
from hwid_cli.diagnosis.findings import Findings
from hwid_cli.diagnosis.judgement import decided
from hwid_cli.diagnosis.latent_force import Smoothed
from hwid_cli.diagnosis.parameters import each_sum_of_squares
from hwid_cli.diagnosis.pieces import JudgedPieces, in_pieces
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.rounds import RoundsResult, continue_rounds, run_rounds
from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.diagnosis.set_fits import WORTH_MORE, Rounds
from hwid_cli.drive.catalogue import CATALOGUE
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import SMALL_REMAINDER, STILL_LARGE
from hwid_cli.records.drive import StandIn

# Whole recordings cannot judge where the noise of their start alone, sent through the
# fit, makes up this share of what the fit leaves of them.
LOST_TO_NOISE = 0.3
# The base of a free axis imitates what holds it in place where it leaves this share of half
# of the recordings, or where its damping has grown by this factor. Arms under gravity leave
# 0.9 and more, machines that other forces act on 0.3 at most.
IMITATION_LEAVES = 0.5
IMITATION_DAMPING = 30.0
# Pieces whose base leaves so many times what that of whole recordings leaves start wrong.
WRONG_START = 10.0


def imitates(rounds: Rounds) -> bool:
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


def seeds_of_pieces(
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
    if not of_pieces.base.is_usable or _start_wrong(rounds, of_pieces):
        return (), (), ()
    free = in_pieces(rounds.problem, force, are_free=True)
    criteria = SelectionCriteria.of(free, rounds.baseline.noise)

    def is_enough(so_far: RoundsResult) -> bool:
        # What starts that are not exact leave looks as if more were missing.
        best = so_far.best[-1]
        return criteria.ratio(_from_there(rounds, free, best)) <= SMALL_REMAINDER

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


def _start_wrong(rounds: Rounds, of_pieces: Rounds) -> bool:
    """Whether pieces begin elsewhere than the machine was, so that no effect fits them.

    The base has less to follow in a piece than in a whole recording, and leaves less of
    it. A lost sample where a piece begins gives that another speed.
    """
    left = of_pieces.criteria.ratio(of_pieces.base)
    return left > WRONG_START * rounds.criteria.ratio(rounds.base)


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


def judged_in_pieces(
    rounds: Rounds,
    whole: Findings,
    seeds: Sequence[CandidateFit],
    smoothed: Sequence[Smoothed],
) -> Findings | None:
    """What pieces with free starts name, where whole recordings cannot tell.

    None where they name nothing, or where a start that is off by the noise changes whole
    recordings by less than what the named effects leave of them.
    """
    rounds.on_round("pieces with free starts", 0)
    pieces = in_pieces(rounds.problem, smoothed, are_free=True)
    of_pieces = _rounds_of(rounds, pieces)
    if not of_pieces.base.is_usable:
        return None
    found = continue_rounds(of_pieces, RoundsResult(), seeds)
    given = each_sum_of_squares([one.left for one in compared_as_given(pieces)])
    verdict = decided(of_pieces, given, found)
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
