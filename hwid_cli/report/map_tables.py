"""Recommended maps as a table, and the reasons as sentences."""

from hwid_cli.records.order import MapAdvice, MapCandidate
from hwid_cli.report.judgement_words import (
    beyond_sentence,
    outlier_sentence,
    paragraphs,
    reason_to_take,
)
from hwid_cli.report.simulation_words import simulation_words
from hwid_cli.report.text_table import MISSING, WIDTH, number, text_table

# Rows on the screen; maps.csv has all.
_SHOWN = 12


def map_table(advice: MapAdvice, *, initial_state: str) -> str:
    """Show the pairs of maps that predict best, that to take and that of the configuration.

    Parameters
    ----------
    advice : MapAdvice
    initial_state : str
        Rule of the fits.

    Returns
    -------
    str
    """
    lowest = min(one.bic for one in advice.candidates)
    rows = [
        (
            _mark(one, advice),
            _map(one.input_map, one.input_units),
            _map(one.output_map, one.output_units),
            str(one.n_parameters or MISSING),
            number(one.rmsd),
            f"{one.factor:.2f}",
            f"{one.bic - lowest:.0f}" if lowest < one.bic < float("inf") else MISSING,
        )
        for place, one in enumerate(advice.candidates)
        if place < _SHOWN or one in (advice.chosen, advice.given)
    ]
    nb, nf, nk = advice.orders
    title = (
        f"Maps at the orders [{nb} {nf} {nk}], with p parameters: cross-validated RMSD "
        f"[{advice.unit}]\n(geometric mean), factor above the best (ten at most on one "
        "recording),\nBIC above the lowest; "
        f"{len(rows)} of {len(advice.candidates)} pairs\n"
        f"{simulation_words(initial_state, is_validation=True)}"
    )
    heads = ("", "input map", "output map", "p", "RMSD", "factor", "BIC")
    return text_table(title, heads, rows, text_columns=(0, 1, 2))


def map_sentences(advice: MapAdvice, *, width: int = WIDTH) -> str:
    """Say which maps to take, and why.

    Parameters
    ----------
    advice : MapAdvice
    width : int, [characters]
        Of a line.

    Returns
    -------
    str
        A paragraph for each reason.
    """
    sentences = (
        _recommendation(advice),
        beyond_sentence(advice.judgement),
        outlier_sentence(advice.judgement),
    )
    return paragraphs(sentences, width)


def _recommendation(advice: MapAdvice) -> str:
    one, best = advice.chosen, advice.candidates[0]
    take = f"Take fit: {{{_keys(one)}}}: "
    if not advice.judgement.n_judges:
        return (
            f"{take}they have the lowest BIC. No other recording judges, and BIC takes "
            "residuals for white; cut the recording into several (recordings.parts) to let "
            "data judge that were not fitted."
        )
    words = f"maps, {_map(best.input_map, best.input_units)} and "
    words += _map(best.output_map, best.output_units)
    reason = reason_to_take(
        advice.judgement, advice.tolerance, "maps", None if one == best else words
    )
    if one == advice.given:
        return f"{take}{reason} They are those of the configuration."
    if advice.given == best:
        return f"{take}{reason} Those of the configuration are the best."
    return (
        f"{take}{reason} Those of the configuration are {advice.given.factor:.3g} times as "
        "far off as the best."
    )


def _keys(one: MapCandidate) -> str:
    """The keys of the configuration that ask for these maps."""
    keys = []
    for side in ("input", "output"):
        keys.append(f"{side}_map: {getattr(one, f'{side}_map')}")
        if units := getattr(one, f"{side}_units"):
            keys.append(f"{side}_units: {units}")
    return ", ".join(keys)


def _mark(one: MapCandidate, advice: MapAdvice) -> str:
    if one == advice.chosen:
        return "take"
    return "yours" if one == advice.given else ""


def _map(kind: str, units: int) -> str:
    words = kind.replace("_", " ")
    return f"{words}, {units}" if units else words
