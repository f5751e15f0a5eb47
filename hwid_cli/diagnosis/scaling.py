"""Sizes for start values, from what a fit leaves of the recordings."""

from hwid_cli.diagnosis.comparing import compare
from hwid_cli.diagnosis.latent_force import latent_force
from hwid_cli.diagnosis.lines import line_frequencies, waves_along
from hwid_cli.diagnosis.problem import Problem, scales
from hwid_cli.diagnosis.stored_fit import fitted_drive, rebuilt
from hwid_cli.drive.effect import Scales
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import NoiseFloor


def scales_of(
    problem: Problem, found: CandidateFit, given: Scales, noise: NoiseFloor
) -> Scales:
    """Sizes with the speeds of a fit, and the lines of the error that it leaves.

    Parameters
    ----------
    problem : Problem
        The recordings that the fit was judged on.
    found : CandidateFit
        Able to simulate them all.
    given : Scales
        That the fit was made with.
    """
    compared = compare(problem, *rebuilt(problem, found, given))
    drive = fitted_drive(problem.drive, found)
    return scales(
        problem,
        [one.velocity for one in compared],
        line_frequencies(compared, noise),
        waves_along(compared, latent_force(compared, drive, noise)),
    )
