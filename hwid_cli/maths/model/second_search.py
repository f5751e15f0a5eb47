"""Where a search may have ended in a poor minimum, and from where to begin again.

The error of a poor minimum is of another shape than noise: it follows itself from sample
to sample, or it is large at few moments. Then what the first search took for granted is
doubted: the input maps that came with the linear starts (where an output folds, least
squares on the output see a wrong one), and the maps that it found around its own block.

References
----------
docs/method.md, section "The search".
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from hwid_cli.maths.model import static_map
from hwid_cli.maths.model.candidates import Candidate, Experiment
from hwid_cli.maths.model.distinct import borne_residuals
from hwid_cli.maths.model.starts import Start
from hwid_cli.records.model import FitOptions

# Correlation of neighbouring residuals, and mean fourth power over squared mean square
# (3 for normal noise), from which on residuals are not taken for noise.
_COLOURED, _PEAKED = 0.5, 4.0
# Deviation, as a share of the output's own, below which peaks are let be. Models of too
# few poles can come closer still, by maps that bend for this one record.
_CLOSE = 0.005
# The same share from which on next to nothing has been found, whatever the error's shape.
_FAR = 0.5
# Break-points of maps whose shape other kinds take over.
_BREAK_POINTS = 15
_NOT_REPLACED = ("none", "piecewise_linear")
# Values by which a start takes over an input map, and an input map of another kind.
_MAP_POINTS, FINE_MAP_POINTS = 12, 200


def leaves_structure(candidate: Candidate, experiments: Sequence[Experiment]) -> bool:
    """Tell whether residuals look like the error of a poor minimum.

    Parameters
    ----------
    candidate : Candidate
    experiments : sequence of Experiment

    Returns
    -------
    bool
        Whether they follow their neighbours, are half as large as the output, or are not
        small and large at few moments.
    """
    # Outliers, where they are to be borne, are no error of the model.
    residuals = borne_residuals(candidate, experiments)
    following = sum(float(one[1:] @ one[:-1]) for one in residuals)
    joined = np.concatenate(residuals)
    power = float(joined @ joined)
    spread = sum(
        float(np.sum((one.output - np.mean(one.output)) ** 2)) for one in experiments
    )
    if following > _COLOURED * power or power > _FAR**2 * spread:
        return True
    squares = joined * joined
    peaks = joined.size * float(squares @ squares)
    return power > _CLOSE**2 * spread and peaks > _PEAKED * power**2


def doubted_input_maps(
    starts: Sequence[Start], experiments: Sequence[Experiment]
) -> list[Start]:
    """Blocks that came with an input map of their own, without it.

    Parameters
    ----------
    starts : sequence of Start
    experiments : sequence of Experiment

    Returns
    -------
    list of Start
    """
    return [_straight(one, experiments) for one in starts if one.is_expanded]


def maps_anew(
    candidate: Candidate,
    experiments: Sequence[Experiment],
    n_points: int = _MAP_POINTS,
) -> list[Start]:
    """The block that a search found, to find maps around it again.

    Parameters
    ----------
    candidate : Candidate
    experiments : sequence of Experiment
    n_points : int, [-]
        Values by which a start takes over the input map.

    Returns
    -------
    list of Start
        With its input map at equal distances, and without.
    """
    model = candidate.model
    points = np.linspace(*_range(experiments), n_points)
    found = Start(
        model.numerator,
        model.denominator,
        np.inf,
        points,
        static_map.evaluate(model.input_map, points),
        0.0,
        candidate.free_responses,
        delay=model.delay,
    )
    return [found, _straight(found, experiments)]


def with_break_points(options: FitOptions) -> FitOptions:
    """Options of a model with piecewise linear maps in the place of others.

    Parameters
    ----------
    options : FitOptions

    Returns
    -------
    FitOptions
        The same where no map is of another kind.
    """
    if options.input_map not in _NOT_REPLACED:
        options = replace(
            options, input_map="piecewise_linear", input_units=_BREAK_POINTS
        )
    if options.output_map not in _NOT_REPLACED:
        options = replace(
            options, output_map="piecewise_linear", output_units=_BREAK_POINTS
        )
    return options


def _straight(start: Start, experiments: Sequence[Experiment]) -> Start:
    ends = np.array(_range(experiments))
    return replace(start, input_points=ends, input_values=ends)


def _range(experiments: Sequence[Experiment]) -> tuple[float, float]:
    lowest = min(float(one.input.min()) for one in experiments)
    return lowest, max(float(one.input.max()) for one in experiments)
