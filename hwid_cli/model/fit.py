"""Fit a Hammerstein-Wiener model to recordings by their free-run simulation error.

The data are scaled to about one, searched (`search`), and the winner is brought back to
their units (`normalise`). Whatever goes wrong ends in `Fit.status`, never in an
exception: a campaign counts failures, it does not stop at them.

References
----------
docs/method.md, sections "The fit" and "The search".

What a fit needs: arguments that make sense, and data that can determine a model.

Search that begins with models of the same orders instead of from nothing.

A group's recordings each have a model already. Its linear block and maps are where the
group's model is looked for: the screening of linear starts and the re-estimation of the
block, which make up most of a fit, are left out.

References
----------
docs/method.md, section "Warm starts".
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.model import static_map
from hwid_cli.model.candidates import Candidate, FitData, limits_of, thinned
from hwid_cli.model.circle_starts import lasting_poles
from hwid_cli.model.description import described
from hwid_cli.model.initial_candidates import (
    block_starts,
    linear_initial_candidates,
    member_models,
    nested_candidates,
)
from hwid_cli.model.levenberg_marquardt import Search, minimise
from hwid_cli.model.linear_block import is_stable
from hwid_cli.model.linear_search import linear_from_nested
from hwid_cli.model.phases import converge, finish, place, standing
from hwid_cli.model.placing import coarser, finer, with_maps
from hwid_cli.model.pole_bound import is_within
from hwid_cli.model.problem import FitProblem, offset_left, rmsd, scaled
from hwid_cli.model.robust import renewed, rescored, settled, unhidden, winsorised
from hwid_cli.model.search import (
    continue_nested,
    nonlinear_search,
    search_beside_nested,
)
from hwid_cli.model.simulate import validation_output
from hwid_cli.model.starts import Start
from hwid_cli.model.straight_levels import SAID, asks_for_levels, with_straight_maps
from hwid_cli.records.model import (
    Fit,
    FitOptions,
    HammersteinWiener,
    Orders,
    Uncertainty,
)
from hwid_cli.records.recordings import Recording

# Sizes whose squares, and those of their ratios, still are numbers of 64 bits.
_SMALLEST, _LARGEST = 1e-60, 1e60


def check_arguments(
    recordings: Sequence[Recording],
    orders: Orders,
    options: FitOptions,
    starts: Sequence[HammersteinWiener],
) -> None:
    """Refuse arguments that make no sense together, whatever the data are.

    Raises
    ------
    TypeError
        If ``recordings`` is a single one, or ``orders`` are no ``Orders``.
    ValueError
        If there is no recording, the sample times differ, a start has other orders or
        kinds of maps, or a frozen linear block has other orders.
    """
    _check_types(recordings, orders)
    if len({one.sample_time_s for one in recordings}) > 1:
        raise ValueError("recordings of one fit must share their sample time")
    kinds = (options.input_map, options.output_map)
    for start in starts:
        nk = start.delay if start.delay in options.delays else orders.nk
        if (start.input_map.kind, start.output_map.kind) != kinds or (
            start.orders != replace(orders, nk=nk)
        ):
            raise ValueError(f"a start must have the orders {orders} and maps {kinds}")
    block = options.linear_block
    if block is not None and block.frozen and block.orders != orders:
        raise ValueError(
            f"the frozen linear block has the orders {block.orders}, not {orders}"
        )


def reason_not_to_fit(
    recordings: Sequence[Recording], orders: Orders, options: FitOptions
) -> str:
    """Say why data cannot determine a model.

    Returns
    -------
    str
        Empty if they can.
    """
    block = options.linear_block
    if block is not None and block.frozen:
        radius = options.largest_pole_radius
        if not is_stable(np.array(block.denominator), radius):
            return f"the frozen linear block has a pole at or beyond radius {radius:g}"
    total = sum(one.n_samples for one in recordings)
    delay = min(options.delays, default=orders.nk)
    needed = _least_parameters(orders, options) + replace(orders, nk=delay).n_state
    if total <= needed:
        return f"{total} samples cannot determine a model that needs more than {needed}"
    longest = total
    if options.join == "experiments":
        longest = max(one.n_samples for one in recordings)
    if delay >= longest:
        return f"a delay of {delay} samples leaves nothing of a record of {longest}"
    for side in ("input", "output"):
        signal = np.concatenate([getattr(one, side) for one in recordings])
        largest = float(np.max(np.abs(signal)))
        if largest > _LARGEST:
            return f"the {side} reaches {largest:.3g}, beyond {_LARGEST:g}"
        span = float(np.ptp(signal))
        if span == 0.0:
            return f"the {side} is constant at {signal[0]:g}"
        if span < _SMALLEST:
            return f"the {side} spans {span:.3g}, less than {_SMALLEST:g}"
    return ""


def _check_types(recordings: Sequence[Recording], orders: Orders) -> None:
    """Refuse what a program that nobody type-checks hands over easily."""
    if isinstance(recordings, Recording):
        raise TypeError(
            "recordings must be a sequence of Recording; put it into a list"
        )
    if not isinstance(orders, Orders):
        raise TypeError(
            f"orders must be Orders(nb=..., nf=..., nk=...), got {orders!r}"
        )
    if not recordings:
        raise ValueError("fit needs at least one recording")


def _least_parameters(orders: Orders, options: FitOptions) -> int:
    """Parameters of a model, each shared gain counted once."""
    maps = (
        static_map.identity(one.kind, one, np.array([0.0, 1.0]))
        for one in (options.of_input, options.of_output)
    )
    n_block = 0 if options.keeps_block else orders.nb + orders.nf
    return n_block + sum(one.parameters.size for one in maps)


# Samples that count where starts are compared, and iterations of the best: enough to
# adapt initial states and offsets.
_ROWS, _SCREENING_ITERATIONS = 1000, 3
# Groups are told apart by a threshold: the last tenth of a percent of the deviation is
# not worth half of the time.
_LEAST_GAIN = 1e-3
# Smaller gains in a row that end the continuation of a nested model: the next orders go
# on from here again.
_PATIENCE = 1


def warm_search(
    experiments: Sequence[FitData],
    options: FitOptions,
    starts: Sequence[HammersteinWiener],
    nested: Sequence[Candidate] = (),
    *,
    search_anew: bool = True,
) -> Search:
    """Hammerstein-Wiener model found from models that are near it.

    Parameters
    ----------
    experiments : sequence of FitData
        Scaled to about one.
    starts : sequence of HammersteinWiener
        At least one; in the units of the experiments, with the orders and the kinds of
        maps that the result has.
    nested : sequence of Candidate
        Models of smaller orders, written with those of the result, which is not worse
        than any of them.
    search_anew : bool
        Whether the starts are tried beside nested models.

    Returns
    -------
    Search
        From the start that is best for these experiments; of equal ones the first.
    """
    found = []
    if nested:
        known = min(
            (standing(one, experiments) for one in nested), key=lambda one: one.cost
        )
        near = converge(
            known,
            experiments,
            options,
            least_gain=_LEAST_GAIN,
            patience=_PATIENCE,
        )
        found = [known, near]
    if search_anew or not nested:
        screened = _screened(experiments, options, starts)
        (placed,) = place([screened], experiments, options)
        found.append(finish(placed, experiments, options, least_gain=_LEAST_GAIN))
    return min(found, key=lambda one: one.cost)


def _screened(
    experiments: Sequence[FitData],
    options: FitOptions,
    starts: Sequence[HammersteinWiener],
) -> Search:
    """The start that is best for these experiments, after a few iterations."""
    few = thinned(experiments, _ROWS)
    best = min(
        (standing(_starting(one, experiments, options), few) for one in starts),
        key=lambda one: one.cost,
    )
    return minimise(
        _spread(best.candidate, experiments, options),
        few,
        with_positions=False,
        max_iterations=min(_SCREENING_ITERATIONS, options.max_iterations),
    )


def _starting(
    model: HammersteinWiener, experiments: Sequence[FitData], options: FitOptions
) -> Candidate:
    """A model with empty initial states for every experiment."""
    is_estimated = options.initial_state == "estimated"
    n_state = model.orders.n_state if is_estimated else 0
    return Candidate(
        replace(model, free_response=np.zeros(0), initial_state=options.initial_state),
        np.zeros((len(experiments), n_state)),
        limits_of(options),
    )


def _spread(
    candidate: Candidate, experiments: Sequence[FitData], options: FitOptions
) -> Candidate:
    """Maps whose break-points cover what the experiments reach, not the start's data."""
    fine = with_maps(candidate, experiments, finer)
    return coarser(fine, experiments, options)


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
        starts_found, linear = linear_initial_candidates(
            problem, orders, options, sees_input_map=anew
        )
        linear_rmsd = rmsd(_yardstick(linear, problem, orders, options), problem)
        problem = _with_threshold(problem, linear)
        orders = replace(orders, nk=starts_found[0].delay)
        known = nested_candidates(problem, orders, options, given.contained)
        found = (starts_found, linear, known)
        if anew or _is_linear(options):
            search = _search(problem, options, found)
            search, problem, hidden = _settled(search, problem, options)
            search = _again(search, problem, orders, options, found)
        else:
            search = continue_nested(known, problem.experiments, options, linear)
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
    return linear_initial_candidates(problem, orders, free, sees_input_map=False)[1]


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
    found: tuple[tuple[Start, ...], Search, list[Candidate]],
) -> Search:
    """Search from nothing but linear models and models of smaller orders."""
    starts, linear, known = found
    if _is_linear(options):
        return linear_from_nested(known, problem.experiments, options, linear)
    if known:
        return search_beside_nested(known, problem.experiments, options, starts, linear)
    return nonlinear_search(problem.experiments, options, starts, linear)


def _again(
    first: Search,
    problem: FitProblem,
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
    first = rescored(first, experiments)
    return min(first, rescored(second, experiments), key=lambda one: one.cost)


def _with_threshold(problem: FitProblem, search: Search) -> FitProblem:
    """Problem with the threshold that a search's residuals ask for."""
    experiments = renewed(problem.experiments, [search.candidate])
    return replace(problem, experiments=tuple(experiments))


def _is_linear(options: FitOptions) -> bool:
    kinds = (options.input_map, options.output_map)
    return all(static_map.RULES[kind].is_identity for kind in kinds)
