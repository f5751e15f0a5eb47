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

from hwid_cli.model import static_map
from hwid_cli.model.candidates import Candidate
from hwid_cli.model.circle_starts import lasting_poles
from hwid_cli.model.description import described
from hwid_cli.model.fit_conditions import check_arguments, reason_not_to_fit
from hwid_cli.model.initial_candidates import (
    LinearCandidates,
    block_starts,
    linear_initial_candidates,
    member_models,
    nested_candidates,
)
from hwid_cli.model.levenberg_marquardt import Search
from hwid_cli.model.linear_search import linear_from_nested
from hwid_cli.model.loops_beside import loops_compiled_beside
from hwid_cli.model.pole_bound import is_within
from hwid_cli.model.problem import FitProblem, offset_left, rmsd, scaled
from hwid_cli.model.robust import renewed, rescored, settled, unhidden, winsorised
from hwid_cli.model.search import (
    continue_nested,
    nonlinear_search,
    search_beside_nested,
)
from hwid_cli.model.simulate import validation_output
from hwid_cli.model.straight_levels import SAID, asks_for_levels, with_straight_maps
from hwid_cli.model.warm_search import warm_search
from hwid_cli.records.model import (
    Fit,
    FitOptions,
    HammersteinWiener,
    Orders,
    Uncertainty,
)
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
    with loops_compiled_beside((options.input_map, options.output_map)):
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

    Returns
    -------
    Fit
        The same model as `fit` gives, without standard errors and information criteria;
        `uncertainty.with_standard_errors` works them out.
    """
    given = _Given(tuple(starts), tuple(contained), search_anew)
    with loops_compiled_beside((options.input_map, options.output_map)):
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
    try:
        found = _searched(scaled(recordings, options), orders, options, given)
        if found.may_integrate_an_offset:
            uncentred = scaled(recordings, options, centred=False)
            other = _searched(uncentred, orders, options, given)
            if not found.has_model_of_data or other.rmsd < found.rmsd:
                found = other
    except np.linalg.LinAlgError as error:
        return replace(blank, message=f"linear algebra failed: {error}")
    blank = replace(blank, linear_rmsd=found.linear_rmsd)
    if not _is_usable(found.search):
        return replace(blank, message="no start gave a stable model")
    fitted = described(
        blank,
        found.search,
        recordings,
        found.problem,
        standard_errors=standard_errors,
    )
    if not _has_finite_domains(fitted):
        # A constant behind a signal that runs away still has a finite output.
        return replace(blank, message="the signal before the output map runs away")
    said = [fitted.message, offset_left(recordings, options), found.outliers_said]
    fitted = replace(fitted, message="; ".join(one for one in said if one))
    return _without_needless_levels(fitted, recordings, standard_errors=standard_errors)


def _without_needless_levels(
    fitted: Fit, recordings: Sequence[Recording], *, standard_errors: bool
) -> Fit:
    """The same fit, or a linear model where that is as close as maps with levels."""
    options = fitted.options
    if options.keeps_block or not asks_for_levels(options):
        return fitted
    linear = _fitted(
        recordings,
        fitted.orders,
        replace(options, input_map="none", output_map="none", delays=()),
        _Given((), (), search_anew=True),
        standard_errors=standard_errors,
    )
    if linear.model is None or not linear.rmsd <= fitted.rmsd:
        return fitted
    u = np.concatenate([one.input for one in recordings])
    x = np.concatenate([validation_output(linear.model, one) for one in recordings])
    model = with_straight_maps(linear.model, options, u, x)
    uncertainty = Uncertainty(reason=SAID)
    return replace(
        linear,
        options=options,
        model=model,
        message=f"{linear.message}; {SAID}",
        uncertainty=uncertainty,
    )


@dataclass(frozen=True, eq=False)
class _Searched:
    """What a search found, and the problem with its last threshold for outliers."""

    search: Search
    problem: FitProblem
    linear_rmsd: float
    hidden_outliers: int

    @property
    def rmsd(self) -> float:
        """RMSD in the unit of the recordings."""
        return rmsd(self.search, self.problem)

    @property
    def outliers_said(self) -> str:
        """What is said of outliers that only the initial state would explain."""
        count = self.hidden_outliers
        if count == 0:
            return ""
        return f"{count} of the first samples taken for outliers, not for the start"

    @property
    def may_integrate_an_offset(self) -> bool:
        """Whether a block that hardly settles saw its input without its offset.

        What it makes of an offset is a ramp, which is no constant of any map.
        """
        if not self.problem.is_centred:
            return False
        model = self.search.candidate.model
        lasting = lasting_poles([model.denominator], self.problem.experiments)
        passes = static_map.RULES[model.input_map.kind].passes_constants
        return not self.has_model_of_data or (passes and lasting.size > 0)

    @property
    def has_model_of_data(self) -> bool:
        """Whether the model can be written for the recordings as they are."""
        if not (self.problem.is_centred and _is_usable(self.search)):
            return True
        return self.problem.of_data(self.search.candidate.model) is not None


def _searched(
    problem: FitProblem, orders: Orders, options: FitOptions, given: _Given
) -> _Searched:
    """Search for the model of a problem, with what is given to begin with."""
    options = options.in_units(problem.input_scale, problem.output_scale)
    linear_rmsd, hidden = float("nan"), 0
    known = nested_candidates(problem, orders, options, given.contained)
    anew = given.search_anew or not known
    search = _warm_search(problem, options, given.starts, known, anew)
    if search is None:
        begun = linear_initial_candidates(problem, orders, options, sees_input_map=anew)
        if _is_linear(options):
            begun = begun.with_circle
        problem = _with_threshold(problem, begun.linear)
        orders = replace(orders, nk=begun.starts[0].delay)
        known = nested_candidates(problem, orders, options, given.contained)
        if anew or _is_linear(options):
            search = _search(problem, options, begun, known)
            search, problem, hidden = _settled(search, problem, options)
            search = _again(search, problem, orders, options, begun, known)
        else:
            search = continue_nested(known, problem.experiments, options, begun)
        linear = begun.beside(search).linear
        linear_rmsd = rmsd(_yardstick(linear, problem, orders, options), problem)
    search, problem, others = _settled(search, problem, options)
    return _Searched(search, problem, linear_rmsd, hidden + others)


def _settled(
    search: Search, problem: FitProblem, options: FitOptions
) -> tuple[Search, FitProblem, int]:
    """Search with the last threshold, and how many outliers its first samples hid."""
    search, experiments = settled(search, problem.experiments, options)
    search, experiments, hidden = unhidden(search, experiments, options)
    return search, replace(problem, experiments=tuple(experiments)), hidden


def _yardstick(
    linear: Search, problem: FitProblem, orders: Orders, options: FitOptions
) -> Search:
    """Linear model to compare with; a frozen block does not hold it."""
    if not options.keeps_block:
        return linear
    free = replace(options, linear_block=None)
    begun = linear_initial_candidates(problem, orders, free, sees_input_map=False)
    return begun.with_circle.linear


def _warm_search(
    problem: FitProblem,
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


def _has_finite_domains(fitted: Fit) -> bool:
    """Tell whether both maps were visited in a finite range, if there is a model."""
    model = fitted.model
    if model is None:
        return True
    ends = (*model.input_map.domain, *model.output_map.domain)
    return bool(np.isfinite(ends).all())


def _is_usable(search: Search) -> bool:
    """Tell whether a search ended with a model whose poles are where they may be."""
    candidate = search.candidate
    radius = candidate.limits.largest_pole_radius
    return bool(np.isfinite(search.cost)) and is_within(
        candidate.model.denominator, radius
    )


def _search(
    problem: FitProblem,
    options: FitOptions,
    begun: LinearCandidates,
    known: Sequence[Candidate],
) -> Search:
    """Search from nothing but linear models and models of smaller orders."""
    if _is_linear(options):
        return linear_from_nested(known, problem.experiments, options, begun.linear)
    if known:
        return search_beside_nested(known, problem.experiments, options, begun)
    return nonlinear_search(problem.experiments, options, begun)


def _again(
    first: Search,
    problem: FitProblem,
    orders: Orders,
    options: FitOptions,
    begun: LinearCandidates,
    known: Sequence[Candidate],
) -> Search:
    """The better of a search and a second one that knows which samples are outliers."""
    if options.loss == "squared" or _is_linear(options):
        return first
    first, experiments = settled(first, problem.experiments, options)
    starts = block_starts(winsorised(first, experiments), orders, options)
    second = _search(problem, options, replace(begun, starts=starts), known)
    second, experiments = settled(second, problem.experiments, options)
    first = rescored(first, experiments)
    return min(first, rescored(second, experiments), key=lambda one: one.cost)


def _with_threshold(problem: FitProblem, search: Search) -> FitProblem:
    """Problem with the threshold that a search's residuals ask for."""
    experiments = renewed(problem.experiments, [search.candidate])
    return replace(problem, experiments=tuple(experiments))


def _is_linear(options: FitOptions) -> bool:
    kinds = (options.input_map, options.output_map)
    return all(static_map.RULES[kind].is_identity for kind in kinds)
