"""The linear output-error model of a fit: its yardstick, and one more start.

docs/method.md, section "The search", step 6.
"""

from collections.abc import Sequence
from dataclasses import replace

from hwid_cli.model import sensitivities
from hwid_cli.model.candidates import Candidate, FitData, thinned
from hwid_cli.model.levenberg_marquardt import Search, minimise
from hwid_cli.model.phases import converge, finish, standing
from hwid_cli.model.robust import rescored
from hwid_cli.model.screening import Rounds, screen
from hwid_cli.model.starts import Start
from hwid_cli.records.model import FitOptions

# Samples that count for the linear model, and the share of the cost that a step must gain:
# it is a yardstick and one more start.
_LINEAR_ROWS, _LINEAR_GAIN = 2500, 1e-3
# A screening that ends at its first comparison: linear starts hardly change places in one.
_ENTERED: Rounds = ((0, 1),)


def linear_search(
    experiments: Sequence[FitData],
    options: FitOptions,
    starts: Sequence[Start],
) -> Search:
    """Linear output-error model, nearly converged: both maps are left out.

    Parameters
    ----------
    experiments : sequence of FitData
        Scaled to about one.
    options : FitOptions
        Its maps are ignored.
    starts : sequence of Start
        Best first; only those of the input as it is are used.
    """
    linear = replace(options, input_map="none", output_map="none")
    plain = [one for one in starts if not one.is_expanded]
    (leader,) = screen(experiments, plain, linear, rounds=_ENTERED)
    few = thinned(experiments, _LINEAR_ROWS)
    found = minimise(
        leader.candidate,
        few,
        with_positions=False,
        max_iterations=options.max_iterations,
        least_gain=_LINEAR_GAIN,
    )
    iterations = leader.iterations + found.iterations
    cost = sensitivities.cost(found.candidate, experiments)
    return replace(found, cost=cost, iterations=iterations)


def linear_from_nested(
    nested: Sequence[Candidate],
    experiments: Sequence[FitData],
    options: FitOptions,
    linear: Search,
) -> Search:
    """Linear model that is never worse than the nested ones of smaller orders.

    Parameters
    ----------
    nested : sequence of Candidate
        Of the orders asked for, without maps; may be empty.
    linear : Search
        What `linear_search` found.
    """
    known = [standing(one, experiments) for one in nested]
    found = [finish(rescored(linear, experiments), experiments, options)]
    if known:
        best = min(known, key=_cost)
        found += [best, converge(best, experiments, options)]
    return min(found, key=_cost)


def _cost(one: Search) -> float:
    return one.cost
