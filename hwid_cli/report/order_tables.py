"""Recommended orders as a table, and the reasons as sentences."""

from hwid_cli.records.order import OrderAdvice, OrderChoice
from hwid_cli.report.judgement_words import (
    beyond_sentence,
    outlier_sentence,
    paragraphs,
    reason_to_take,
)
from hwid_cli.report.simulation_words import simulation_words
from hwid_cli.report.text_table import MISSING, WIDTH, number, text_table

# Delay of a grid whose second axis counts poles, [samples].
_GRID_DELAY = 1
_ALL = "all together"


def order_table(advice: OrderAdvice, *, initial_state: str) -> str:
    """Show the recommended orders, over all recordings and for each.

    Parameters
    ----------
    advice : OrderAdvice
    initial_state : str
        Rule of the fits.

    Returns
    -------
    str
    """
    seen = {one.recording: (one.delay, one.n_poles) for one in advice.responses}
    seen[""] = (advice.delay, advice.n_poles)
    rows = []
    for one in (*advice.choices, advice.overall):
        delay, n_poles = seen.get(one.recording, (-1, 0))
        rows.append(
            (
                one.recording or _ALL,
                _pair(one.nb, one.nk),
                number(one.judgement.rmsd),
                f"{one.judgement.factor:.2f}",
                _pair(one.best_nb, one.best_nk),
                _pair(one.aic_nb, one.aic_nk),
                _pair(one.bic_nb, one.bic_nk),
                MISSING if delay < 0 else str(delay),
                str(n_poles or MISSING),
            )
        )
    heads = (
        "models of",
        "take",
        "RMSD",
        "factor",
        "best",
        "AIC",
        "BIC",
        "delay <=",
        "poles",
    )
    title = (
        f"Orders nb/nk to take, cross-validated RMSD [{advice.unit}] (geometric mean), the "
        "factor\nabove the best orders (ten at most on one recording), what AIC and BIC\n"
        "choose, delay and poles that data show\n"
        f"{simulation_words(initial_state, is_validation=True)}"
    )
    return text_table(title, heads, rows, text_columns=(0,))


def order_sentences(advice: OrderAdvice, *, width: int = WIDTH) -> str:
    """Say which orders to take, and why.

    Parameters
    ----------
    advice : OrderAdvice
    width : int, [characters]
        Of a line.

    Returns
    -------
    str
        A paragraph for each reason.
    """
    sentences = [
        _recommendation(advice),
        _criteria(advice.overall),
        beyond_sentence(advice.overall.judgement),
        outlier_sentence(advice.overall.judgement),
        _edges(advice),
        _delays(advice),
        _poles(advice),
    ]
    return paragraphs(sentences, width)


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
    take = f"Take nb = {one.nb}, nk = {one.nk} (orders {_orders(one.nb, one.nk, advice)}): "
    if not one.judgement.n_judges:
        return (
            f"{take}the smallest orders within {100 * advice.tolerance:g} % of the best on "
            "the recording of the fit itself. No other recording judges, so this rewards "
            "models that follow noise; trust BIC more, or add a recording."
        )
    best = None
    if (one.nb, one.nk) != (one.best_nb, one.best_nk):
        best = f"orders of the grid, {_orders(one.best_nb, one.best_nk, advice)}"
    return take + reason_to_take(one.judgement, advice.tolerance, "orders", best)


def _criteria(one: OrderChoice) -> str:
    if not one.bic_nb:
        return ""
    return (
        f"BIC of the fits chooses {_pair(one.bic_nb, one.bic_nk)}, AIC "
        f"{_pair(one.aic_nb, one.aic_nk)}. Both see the recording of the fit only and take "
        "residuals for white: where these are not, both ask for too much."
    )


def _edges(advice: OrderAdvice) -> str:
    one = advice.overall
    axes = [
        f"orders.{name} (beyond {max(axis)})"
        for name, value, axis in (
            ("nb", one.best_nb, advice.nb),
            ("nk", one.best_nk, advice.nk),
        )
        if len(axis) > 1 and value == max(axis)
    ]
    if not axes:
        return ""
    return (
        f"The best orders lie at the edge of the grid: widen {' and '.join(axes)} to see "
        "whether larger ones are better still."
    )


def _delays(advice: OrderAdvice) -> str:
    found = [one.delay for one in advice.responses if one.delay >= 0]
    if not found:
        return "Delay: no output answers its input."
    spread = _samples(max(found))
    if min(found) < max(found):
        spread = f"{min(found)} to {spread}"
    text = (
        f"Delay: at most {_samples(advice.delay)}; a quarter of the recordings contradict a "
        f"longer one (single recordings allow {spread}, smooth inputs leave it open)."
    )
    if advice.nk_role == "delay":
        return f"{text} The recommended delay is {advice.overall.nk}."
    if advice.tried_delays:
        return f"{text} {_tried(advice)}"
    if advice.delay > _GRID_DELAY:
        text += (
            f" The grid takes {_GRID_DELAY}; leading coefficients of B make up for more, "
            "so nb must reach further, or set orders.nk_role: delay."
        )
    if advice.delay < _GRID_DELAY:
        text += f" The grid takes {_GRID_DELAY}: set orders.nk_role: delay to try 0."
    return text


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


def _samples(count: int) -> str:
    return f"{count} sample{'s' * (count != 1)}"
