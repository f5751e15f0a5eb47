"""Recordings as the experiments of one fit, divided by their size.

References
----------
docs/method.md, section "The search".
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.model import sensitivities
from hwid_cli.model.candidates import FitData
from hwid_cli.model.levenberg_marquardt import Search
from hwid_cli.model.robust import plain, with_loss
from hwid_cli.records.model import FitOptions
from hwid_cli.records.recordings import Recording


@dataclass(frozen=True, eq=False)
class FitProblem:
    """Scaled experiments and what they were divided by.

    Parameters
    ----------
    experiments : tuple of FitData
        Of size about one.
    input_scale : float, [input unit]
    output_scale : float, [output unit]
    """

    experiments: tuple[FitData, ...]
    input_scale: float
    output_scale: float


def joined(recordings: Sequence[Recording], options: FitOptions) -> tuple[FitData, ...]:
    """Recordings joined as the options say.

    Returns
    -------
    tuple of FitData
        In the units of the recordings.
    """
    if options.join == "experiments":
        return tuple(FitData(one.input, one.output) for one in recordings)
    return (
        FitData(
            np.concatenate([one.input for one in recordings]),
            np.concatenate([one.output for one in recordings]),
        ),
    )


def scaled(recordings: Sequence[Recording], options: FitOptions) -> FitProblem:
    """Experiments divided by their size, so that one damping suits all."""
    experiments = joined(recordings, options)
    input_scale = max(float(np.max(np.abs(one.input))) for one in experiments)
    output_scale = float(np.std(np.concatenate([one.output for one in experiments])))
    divided = [
        FitData(one.input / input_scale, one.output / output_scale)
        for one in experiments
    ]
    return FitProblem(with_loss(divided, options), input_scale, output_scale)


def rmsd(search: Search, problem: FitProblem) -> float:
    """RMSD of a search's model, whatever loss it was found with.

    Returns
    -------
    float, [output unit]
    """
    samples = sum(one.output.size for one in problem.experiments)
    cost = search.cost
    if problem.experiments[0].threshold < np.inf:
        cost = sensitivities.cost(search.candidate, plain(problem.experiments))
    return float(np.sqrt(cost / samples)) * problem.output_scale
