"""A fit that goes through pieces of the recordings, where friction makes many minima.

Played back in an open loop, a drive with friction stops a little earlier or later, and is
somewhere else from there on: the squares have minima near each other, and a fit ends in
one of them. Pieces with starts of their own forget that, and lead near the best one.
"""

from hwid_cli.diagnosis.candidate import (
    SearchStart,
    base_of,
    compared_with_fit,
    fit_candidate,
    fitted_drive,
    start_from,
)
from hwid_cli.diagnosis.growing import fit_grown
from hwid_cli.diagnosis.latent_force import latent_force
from hwid_cli.diagnosis.pieces import in_pieces
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import NoiseFloor


def fit_through_pieces(
    problem: DiagnosisProblem, found: CandidateFit, scales: Scales, noise: NoiseFloor
) -> CandidateFit:
    """Fit the same again by way of pieces with free starts.

    Parameters
    ----------
    found : CandidateFit
        Of the base, on whole recordings.

    Returns
    -------
    CandidateFit
        On whole recordings; the given one where that leaves less, or no effect of the
        simulation makes it worth the time.
    """
    is_settled = found.whiteness <= 1.0 or not found.is_usable
    is_plain = not drive_effects(problem.drive) or problem.compares_command
    if is_settled or is_plain:
        return found
    compared = compared_with_fit(problem, found, scales)
    smoothed = latent_force(compared, fitted_drive(problem.drive, found), noise)
    pieces = in_pieces(problem, smoothed, are_free=True)
    # A fit that is lost has bent everything: what is stated may be nearer.
    stated = SearchStart(base_of(problem.drive), drive_effects(problem.drive))
    starts = [start_from(problem.drive, found), stated]
    of_pieces = fit_candidate(pieces, found.effects, starts, scales, noise)
    if not of_pieces.is_usable:
        return found
    start = start_from(problem.drive, of_pieces)
    again = fit_candidate(problem, found.effects, [start], scales, noise)
    best = min((found, again), key=lambda one: float(one.sse.sum()))
    if best.whiteness <= 1.0:
        return best
    # From there a long recording still has many minima, and its first part few.
    grown = fit_grown(problem, best, [start], scales, noise)
    return min((best, grown), key=lambda one: float(one.sse.sum()))
