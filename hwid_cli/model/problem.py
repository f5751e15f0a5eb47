"""Recordings as the experiments of one fit, divided by their size.

References
----------
docs/method.md, section "The search".
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.model import sensitivities
from hwid_cli.model.candidates import Experiment
from hwid_cli.model.levenberg_marquardt import Search
from hwid_cli.model.robust import plain, with_loss
from hwid_cli.records.model import FitOptions
from hwid_cli.records.recordings import Recording


@dataclass(frozen=True, eq=False)
class Problem:
    """Scaled experiments and what they were divided by.

    Parameters
    ----------
    experiments : tuple of Experiment
        Of size about one.
    input_scale : float, [input unit]
    output_scale : float, [output unit]
    """

    experiments: tuple[Experiment, ...]
    input_scale: float
    output_scale: float


def joined(
    recordings: Sequence[Recording], options: FitOptions
) -> tuple[Experiment, ...]:
    """Recordings joined as the options say.

    Returns
    -------
    tuple of Experiment
        In the units of the recordings.
    """
    if options.join == "experiments":
        return tuple(Experiment(one.input, one.output) for one in recordings)
    return (
        Experiment(
            np.concatenate([one.input for one in recordings]),
            np.concatenate([one.output for one in recordings]),
        ),
    )


def scaled(recordings: Sequence[Recording], options: FitOptions) -> Problem:
    """Experiments divided by their size, so that one damping suits all."""
    experiments = joined(recordings, options)
    input_scale = max(float(np.max(np.abs(one.input))) for one in experiments)
    output_scale = float(np.std(np.concatenate([one.output for one in experiments])))
    divided = [
        Experiment(one.input / input_scale, one.output / output_scale)
        for one in experiments
    ]
    return Problem(with_loss(divided, options), input_scale, output_scale)


def rmsd(search: Search, problem: Problem) -> float:
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
