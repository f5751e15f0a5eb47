"""Recommended orders and maps as tables, and the reasons as sentences."""

from collections.abc import Sequence

from hwid_cli.records.order import (
    MapAdvice,
    MapCandidate,
    OrderAdvice,
    OrderChoice,
    SelectionEvidence,
)
from hwid_cli.records.units import behind
from hwid_cli.report.formats import MISSING, counted, decimals, number
from hwid_cli.report.map_words import fit_keys, map_words
from hwid_cli.report.table import Table, Text, numbers, texts

# Maps that are shown; maps.csv has all.
_SHOWN = 12
# Delay of a grid whose second axis counts poles, [samples].
_GRID_DELAY = 1
_ALL = "all together"


def _reason_to_take(
    evidence: SelectionEvidence, tolerance: float, things: str, best: str | None
) -> str:
    """Say why candidates are taken that validation recordings have ranked.

    Parameters
    ----------
    tolerance : float, [-]
    things : str
        What the candidates are, in the plural.
    best : str or None
        The best ones; None where these are taken.

    Returns
    -------
    str
        Goes on behind a colon.
    """
    on = (
        "recordings that the models were not fitted to"
        if evidence.n_validation > 1
        else "the one recording that it was not fitted to"
    )
    if best is None:
        return (
            f"they have the lowest RMSD on {on}, and no smaller ones come within "
            f"{100 * tolerance:g} % of it."
        )
    return (
        f"on {on} they are on average {100 * (evidence.factor - 1):.3g} % further off than "
        f"the best {best}; that is within the tolerance of {100 * tolerance:g} %, and no "
        f"smaller {things} are."
    )


def no_choice(evidence: SelectionEvidence, unit: str) -> str:
    """Say that candidates are all too bad for a choice; empty where they are not."""
    if evidence.predicts:
        return ""
    return (
        "no model of one recording predicts the others: the best are off by "
        f"{evidence.best_rmsd:.3g}{behind(unit)}, where outputs vary by "
        f"{evidence.output_spread:.3g}{behind(unit)}. Models of several recordings "
        "together (group: {max_level: 1, together: true}) choose their own"
    )


def _left_out(evidence: SelectionEvidence) -> tuple[str, ...]:
    """Say which pairs of model and recording, and which samples, the selection leaves out."""
    found = []
    if count := evidence.n_unexcited:
        found.append(
            f"{counted(count, 'pair')} of model and recording {'do' if count != 1 else 'does'} "
            "not count: there more than three quarters of the input lie beyond the range that "
            "the model was fitted in, and its maps are extrapolated."
        )
    if count := evidence.n_outliers:
        found.append(
            f"{counted(count, 'sample')} of the validation recordings "
            f"{'are outliers' if count != 1 else 'is an outlier'} and "
            f"{'do' if count != 1 else 'does'} not count here, as in the fits (fit.loss)."
        )
    return tuple(found)


def map_table(advice: MapAdvice) -> Table:
    """Show the pairs of maps that predict best, that to take and that of the configuration."""
    lowest = min(one.bic for one in advice.candidates)
    rows = tuple(
        (
            _mark(one, advice),
            map_words(one.input_map, one.input_units),
            map_words(one.output_map, one.output_units),
            str(one.n_parameters or MISSING),
            number(one.rmsd),
            f"{one.factor:.2f}",
            decimals(one.bic - lowest, 0) if lowest < one.bic else MISSING,
        )
        for place, one in enumerate(advice.candidates)
        if place < _SHOWN or one in (advice.chosen, advice.given)
    )
    nb, nf, nk = advice.orders
    caption = (
        f"Maps of models of one recording at the orders [{nb} {nf} {nk}], with p parameters: cross-validated RMSD "
        f"[{advice.unit}] (geometric mean), factor above the best (ten at most on one "
        f"recording), BIC above the lowest; {len(rows)} of {len(advice.candidates)} pairs"
    )
    columns = (
        *texts("", "input map", "output map"),
        *numbers("p", "RMSD", "factor", "BIC"),
    )
    return Table(caption, columns, rows, is_validation=True)


def map_reasons(advice: MapAdvice) -> tuple[Text, ...]:
    """Say which maps to take, and why, each reason a paragraph."""
    return tuple(map(Text, (_map_recommendation(advice), *_left_out(advice.evidence))))


def _map_recommendation(advice: MapAdvice) -> str:
    one, best = advice.chosen, advice.candidates[0]
    if reason := no_choice(advice.evidence, advice.unit):
        return f"These maps are no choice: {reason}."
    take = f"Put {fit_keys(one)} into fit: "
    if not advice.evidence.n_validation:
        return (
            f"{take}they have the lowest BIC. There is no validation recording, and BIC takes "
            "residuals for white; cut the recording into several (recordings.parts) to "
            "validate on data that were not fitted."
        )
    words = f"maps, {map_words(best.input_map, best.input_units)} and "
    words += map_words(best.output_map, best.output_units)
    reason = _reason_to_take(
        advice.evidence, advice.tolerance, "maps", None if one == best else words
    )
    if one == advice.given:
        return f"{take}{reason} They are those of the configuration."
    if advice.given == best:
        return f"{take}{reason} Those of the configuration are the best."
    return (
        f"{take}{reason} Those of the configuration are {advice.given.factor:.3g} times as "
        "far off as the best."
    )


def _mark(one: MapCandidate, advice: MapAdvice) -> str:
    if one == advice.chosen and advice.evidence.predicts:
        return "take"
    return "yours" if one == advice.given else ""


def order_table(advice: OrderAdvice) -> Table:
    """Show the recommended orders, over all recordings and for each."""
    seen = {one.recording: (one.delay, one.n_poles) for one in advice.responses}
    seen[""] = (advice.delay, advice.n_poles)
    rows = []
    for one in (*advice.choices, advice.overall):
        delay, n_poles = seen.get(one.recording, (-1, 0))
        rows.append(
            (
                one.recording or _ALL,
                _pair(one.nb, one.nk),
                number(one.evidence.rmsd),
                f"{one.evidence.factor:.2f}",
                _pair(one.best_nb, one.best_nk),
                _pair(one.aic_nb, one.aic_nk),
                _pair(one.bic_nb, one.bic_nk),
                MISSING if delay < 0 else str(delay),
                str(n_poles or MISSING),
            )
        )
    caption = (
        f"Orders nb/nk to take, cross-validated RMSD [{advice.unit}] (geometric mean), the "
        "factor above the best orders (ten at most on one recording), what AIC and BIC "
        "choose, delay and poles that data show"
    )
    heads = ("take", "RMSD", "factor", "best", "AIC", "BIC", "delay <=", "poles")
    columns = (*texts("models of"), *numbers(*heads))
    return Table(caption, columns, tuple(rows), is_validation=True)


def order_reasons(advice: OrderAdvice) -> tuple[Text, ...]:
    """Say which orders to take, and why, each reason a paragraph."""
    sentences = (
        _recommendation(advice),
        _criteria(advice.overall),
        *_left_out(advice.overall.evidence),
        _edges(advice),
        _delays(advice),
        _poles(advice),
    )
    return tuple(Text(one) for one in sentences if one)


def _pair(nb: int, nk: int) -> str:
    return f"{nb}/{nk}" if nb else MISSING


def _orders(nb: int, nk: int, advice: OrderAdvice) -> str:
    """Orders in the form of the toolboxes."""
    if advice.tried_delays:
        return f"[{nb} {nk} nk], nk of fit.delays"
    if advice.nk_role == "poles":
        return f"[{nb} {nk} {_GRID_DELAY}]"
    return f"[{nb} {advice.nf} {nk}]"


def _recommendation(advice: OrderAdvice) -> str:
    one = advice.overall
    if reason := no_choice(one.evidence, advice.unit):
        return f"These orders are no choice: {reason}."
    take = f"Take nb = {one.nb}, nk = {one.nk} (orders {_orders(one.nb, one.nk, advice)}): "
    if not one.evidence.n_validation:
        return (
            f"{take}the smallest orders within {100 * advice.tolerance:g} % of the best on "
            "the recording of the fit itself. There is no validation recording, so this "
            "rewards models that follow noise; trust BIC more, or add a recording."
        )
    best = None
    if (one.nb, one.nk) != (one.best_nb, one.best_nk):
        best = f"orders of the grid, {_orders(one.best_nb, one.best_nk, advice)}"
    return take + _reason_to_take(one.evidence, advice.tolerance, "orders", best)


def _criteria(one: OrderChoice) -> str:
    if not one.bic_nb:
        return ""
    return (
        f"BIC of the fits chooses {_pair(one.bic_nb, one.bic_nk)}, AIC "
        f"{_pair(one.aic_nb, one.aic_nk)}. Both see the recording of the fit only and take "
        "residuals for white: where these are not, both ask for too much."
    )


def axes_to_widen(advice: OrderAdvice, nb: int, nk: int) -> list[str]:
    """Keys of the grid whose largest value some orders have."""
    return [
        f"orders.{name} (beyond {max(axis)})"
        for name, value, axis in (("nb", nb, advice.nb), ("nk", nk, advice.nk))
        if len(axis) > 1 and value == max(axis)
    ]


def _edges(advice: OrderAdvice) -> str:
    axes = axes_to_widen(advice, advice.overall.nb, advice.overall.nk)
    if not axes:
        return ""
    return (
        f"These orders lie at the edge of the grid: widen {' and '.join(axes)} to see "
        "whether larger ones are better still."
    )


def _delays(advice: OrderAdvice) -> str:
    found = [one.delay for one in advice.responses if one.delay >= 0]
    if not found:
        return "Delay: no output responds to its input."
    spread = counted(max(found), "sample")
    if min(found) < max(found):
        spread = f"{min(found)} to {spread}"
    text = (
        f"Delay: at most {counted(advice.delay, 'sample')}; a quarter of the recordings contradict a "
        f"longer one (single recordings allow {spread}, smooth inputs leave it open)."
    )
    if advice.nk_role == "delay":
        return f"{text} The recommended delay is {advice.overall.nk}."
    if advice.tried_delays:
        return f"{text} {_tried(advice)}"
    if advice.delay > _GRID_DELAY:
        text += (
            f" The grid takes {_GRID_DELAY}; leading coefficients of B make up for more, "
            f"up to {_GRID_DELAY + max(advice.nb)}."
        )
    if tried := advice.further_delays:
        text += (
            f" Put {delay_keys(tried)} into fit, and every fit takes the best of them: "
            "models are better so."
        )
    elif advice.delay > _GRID_DELAY + max(advice.nb):
        text += " Models that may take a longer one are no better."
    if advice.delay < _GRID_DELAY:
        text += f" The grid takes {_GRID_DELAY}: set orders.nk_role: delay to try 0."
    return text


def delay_keys(delays: Sequence[int]) -> str:
    """The key of ``fit`` that asks for some delays."""
    return f"delays: [{', '.join(map(str, delays))}]"


def _tried(advice: OrderAdvice) -> str:
    """What fits have tried already, and whether the data allow more."""
    longest = max(advice.tried_delays)
    text = f"Every fit tries {', '.join(map(str, advice.tried_delays))} (fit.delays)."
    if advice.delay > longest:
        text += f" The data allow longer ones than {longest}."
    return text


def _poles(advice: OrderAdvice) -> str:
    if not advice.n_poles:
        return "Poles: no impulse response decays, so there is no hint of their number."
    agree = sum(one.n_poles == advice.n_poles for one in advice.responses)
    values = "singular values of the impulse response's Hankel matrix stand out"
    if advice.n_poles == 1:
        values = "singular value of the impulse response's Hankel matrix stands out"
    return (
        f"Poles: {advice.n_poles} {values} (median; so in {agree} of "
        f"{len(advice.responses)} recordings). A hint from linear models of the data, apart "
        "from the grid."
    )
