"""Fit a Hammerstein-Wiener model to recordings by their free-run simulation error.

The data are scaled to about one, searched (`search`), and the winner is brought back to
their units (`normalise`). Whatever goes wrong ends in `Fit.status`, never in an
exception: a campaign counts failures, it does not stop at them.

References
----------
docs/method.md, sections "The fit" and "The search".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.maths.model.beginnings import (
    block_starts,
    contained_candidates,
    linear_beginnings,
    member_models,
)
from hwid_cli.maths.model.candidates import Candidate
from hwid_cli.maths.model.description import described
from hwid_cli.maths.model.levenberg_marquardt import Search
from hwid_cli.maths.model.linear_block import is_stable
from hwid_cli.maths.model.linear_search import linear_beyond
from hwid_cli.maths.model.prerequisites import (
    check_arguments,
    reason_not_to_fit,
)
from hwid_cli.maths.model.problem import Problem, rmsd, scaled
from hwid_cli.maths.model.robust import rejudged, renewed, settled, winsorised
from hwid_cli.maths.model.search import (
    grown,
    nonlinear_search,
    search_beyond,
)
from hwid_cli.maths.model.starts import Start
from hwid_cli.maths.model.warm_start import warm_search
from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording

_DEFAULTS = FitOptions()


@dataclass(frozen=True, eq=False)
class _Given:
    """Models that a fit begins with, and whether it also begins without."""

    starts: tuple[HammersteinWiener, ...]
    contained: tuple[HammersteinWiener, ...]
    search_anew: bool


def fit(
    recordings: Sequence[Recording],
    orders: Orders,
    options: FitOptions = _DEFAULTS,
    *,
    starts: Sequence[HammersteinWiener] = (),
    contained: Sequence[HammersteinWiener] = (),
    search_anew: bool = True,
) -> Fit:
    """Fit one model to one or several recordings.

    Parameters
    ----------
    recordings : sequence of Recording
        Of one sample time. Joined as ``options.join`` says.
    orders : Orders
    options : FitOptions
    starts : sequence of HammersteinWiener
        Models of the same orders and kinds of maps to begin with, such as those of the
        single recordings of a group; several times faster than a search from nothing,
        which is what happens without a stable one or where theirs ends without a model.
    contained : sequence of HammersteinWiener
        Models of smaller orders fitted to the same recordings with the same options: the
        result is not worse in training than any of them.
    search_anew : bool
        Whether to search beside going on from contained models. Without, a fit takes a
        fraction of the time and stays in the minimum of the best of them.

    Returns
    -------
    Fit
        With ``status`` ``failed`` and a reason where no usable model was found.

    Raises
    ------
    TypeError
        If ``recordings`` is a single one, or ``orders`` are no ``Orders``.
    ValueError
        If there is no recording, the sample times differ, a start has other orders or
        kinds of maps, or a frozen linear block has other orders.

    References
    ----------
    docs/method.md, sections "The fit" and "The search".

    Examples
    --------
    >>> from scipy.signal import lfilter
    >>> u = np.random.default_rng(1).standard_normal(300)
    >>> recording = Recording("r1", u, lfilter([0.0, 0.2], [1.0, -0.8], u), 1e-3)
    >>> linear = FitOptions(input_map="none", output_map="none")
    >>> result = fit([recording], Orders(nb=1, nf=1, nk=1), linear)
    >>> result.status, np.round(result.model.denominator, 6)
    ('converged', array([ 1. , -0.8]))
    """
    given = _Given(tuple(starts), tuple(contained), search_anew)
    return _fitted(recordings, orders, options, given, standard_errors=True)


def fit_without_standard_errors(
    recordings: Sequence[Recording],
    orders: Orders,
    options: FitOptions = _DEFAULTS,
    *,
    starts: Sequence[HammersteinWiener] = (),
    contained: Sequence[HammersteinWiener] = (),
    search_anew: bool = True,
) -> Fit:
    """Fit one of many models: standard errors may take a third of a warm fit's time.

    Parameters
    ----------
    recordings : sequence of Recording
    orders : Orders
    options : FitOptions
    starts, contained : sequence of HammersteinWiener
    search_anew : bool

    Returns
    -------
    Fit
        The same model as `fit` gives, without standard errors and information criteria;
        `uncertainty.with_standard_errors` works them out.
    """
    given = _Given(tuple(starts), tuple(contained), search_anew)
    return _fitted(recordings, orders, options, given, standard_errors=False)


# A step to a model that overflows is refused by its cost.
@np.errstate(over="ignore", invalid="ignore")
def _fitted(
    recordings: Sequence[Recording],
    orders: Orders,
    options: FitOptions,
    given: _Given,
    *,
    standard_errors: bool,
) -> Fit:
    check_arguments(recordings, orders, options, given.starts)
    names = tuple(one.name for one in recordings)
    blank = Fit(names, orders, options, None, "failed", "")
    reason = reason_not_to_fit(recordings, orders, options)
    if reason:
        return replace(blank, message=reason)
    problem = scaled(recordings, options)
    options = options.in_units(problem.input_scale, problem.output_scale)
    linear_rmsd = float("nan")
    try:
        known = contained_candidates(problem, orders, options, given.contained)
        anew = given.search_anew or not known
        search = _warm_search(problem, options, given.starts, known, anew)
        if search is None:
            starts_found, linear = linear_beginnings(
                problem, orders, options, sees_input_map=anew
            )
            linear_rmsd = rmsd(_yardstick(linear, problem, orders, options), problem)
            problem = _with_threshold(problem, linear)
            orders = replace(orders, nk=starts_found[0].delay)
            known = contained_candidates(problem, orders, options, given.contained)
            found = (starts_found, linear, known)
            if anew or _is_linear(options):
                search = _search(problem, options, found)
                search = _again(search, problem, orders, options, found)
            else:
                search = grown(known, problem.experiments, options, linear)
        search, experiments = settled(search, problem.experiments, options)
    except np.linalg.LinAlgError as error:
        return replace(blank, message=f"linear algebra failed: {error}")
    if not _is_usable(search):
        return replace(
            blank, message="no start gave a stable model", linear_rmsd=linear_rmsd
        )
    return described(
        replace(blank, linear_rmsd=linear_rmsd),
        search,
        recordings,
        replace(problem, experiments=tuple(experiments)),
        standard_errors=standard_errors,
    )


def _yardstick(
    linear: Search, problem: Problem, orders: Orders, options: FitOptions
) -> Search:
    """Linear model to compare with; a frozen block does not hold it."""
    if not options.keeps_block:
        return linear
    free = replace(options, linear_block=None)
    return linear_beginnings(problem, orders, free, sees_input_map=False)[1]


def _warm_search(
    problem: Problem,
    options: FitOptions,
    starts: Sequence[HammersteinWiener],
    known: Sequence[Candidate],
    anew: bool,
) -> Search | None:
    """Search near the starts; None where none is stable or no model came of them."""
    models = member_models(problem, options, starts)
    if not models:
        return None
    try:
        search = warm_search(
            problem.experiments, options, models, known, search_anew=anew
        )
    except np.linalg.LinAlgError:
        return None
    return search if _is_usable(search) else None


def _is_usable(search: Search) -> bool:
    """Tell whether a search ended with a model whose poles are where they may be."""
    candidate = search.candidate
    radius = candidate.limits.largest_pole_radius
    return bool(np.isfinite(search.cost)) and is_stable(
        candidate.model.denominator, radius
    )


def _search(
    problem: Problem,
    options: FitOptions,
    found: tuple[tuple[Start, ...], Search, list[Candidate]],
) -> Search:
    """Search from nothing but linear models and models of smaller orders."""
    starts, linear, known = found
    if _is_linear(options):
        return linear_beyond(known, problem.experiments, options, linear)
    if known:
        return search_beyond(known, problem.experiments, options, starts, linear)
    return nonlinear_search(problem.experiments, options, starts, linear)


def _again(
    first: Search,
    problem: Problem,
    orders: Orders,
    options: FitOptions,
    found: tuple[tuple[Start, ...], Search, list[Candidate]],
) -> Search:
    """The better of a search and a second one that knows which samples are outliers."""
    if options.loss == "squared" or _is_linear(options):
        return first
    first, experiments = settled(first, problem.experiments, options)
    starts = block_starts(winsorised(first, experiments), orders, options)
    second = _search(problem, options, (starts, *found[1:]))
    second, experiments = settled(second, problem.experiments, options)
    first = rejudged(first, experiments)
    return min(first, rejudged(second, experiments), key=lambda one: one.cost)


def _with_threshold(problem: Problem, search: Search) -> Problem:
    """Problem with the threshold that a search's residuals ask for."""
    experiments = renewed(problem.experiments, [search.candidate])
    return replace(problem, experiments=tuple(experiments))


def _is_linear(options: FitOptions) -> bool:
    return options.input_map == "none" and options.output_map == "none"
