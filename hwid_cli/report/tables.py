"""Results as plain text that reads well on a screen, in a file and through a pipe."""

import re
from collections.abc import Sequence

from hwid_cli.records.model import Orders
from hwid_cli.records.recordings import CalibrationLog
from hwid_cli.records.results import CrossValidation, ModelScore
from hwid_cli.records.units import behind
from hwid_cli.report.simulation_words import simulation_words
from hwid_cli.report.text_table import (
    WIDTH,
    number,
    split_table,
    text_table,
)


def thesis_name(identified_on: str, nb: int, nk: int, nf: int | None = None) -> str:
    """Name of a model in the form of the published tables.

    Parameters
    ----------
    identified_on : str
        Name of the recording, or of several joined by ``+``.
    nb, nk : int, [-]
        Its place in the order grid.
    nf : int or None, [-]
        Number of poles where ``nk`` is a delay; None where ``nk`` counts the poles.

    Returns
    -------
    str
        Ends with the orders ``[nb nf nk]``.

    Examples
    --------
    >>> thesis_name("step_06", 3, 7)
    'NLHW-Step-6-3-7-1'
    >>> thesis_name("step_06+step_09", 3, 7)
    'NLHW-Step-6-9-3-7-1'
    >>> thesis_name("run7b", 2, 3, nf=4)
    'NLHW-run7b-2-4-3'
    """
    parts = identified_on.split("+")
    numbered = [re.fullmatch(r"([A-Za-z]+)_0*(\d+)", part) for part in parts]
    who = identified_on
    if all(numbered):
        kinds = [match[1].capitalize() for match in numbered if match]
        numbers = [match[2] for match in numbered if match]
        who = "-".join(
            number if i and kinds[i] == kinds[i - 1] else f"{kinds[i]}-{number}"
            for i, number in enumerate(numbers)
        )
    orders = f"{nb}-{nk}-1" if nf is None else f"{nb}-{nf}-{nk}"
    return f"NLHW-{who}-{orders}"


def thesis_name_of(identified_on: str, orders: Orders) -> str:
    """Name of a model in the form of the published tables, by its orders.

    Parameters
    ----------
    orders : Orders
        With the delay that was found.
    """
    return thesis_name(identified_on, orders.nb, orders.nk, orders.nf)


def calibration_table(logs: Sequence[CalibrationLog]) -> str:
    """Show what calibration did, one line for each recording."""
    heads, rows = calibration_cells(logs)
    return text_table(
        "Calibration: samples, what was subtracted, samples repaired (in/out)",
        heads,
        rows,
        text_columns=(0,),
    )


def calibration_cells(
    logs: Sequence[CalibrationLog],
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Write what calibration did, for a table on the screen or on a page.

    Returns
    -------
    rows : list of tuple of str
        One for each recording, its name first.
    """
    rows: list[tuple[str, ...]] = [
        (
            log.name,
            f"{log.n_raw_input}/{log.n_raw_output}",
            str(log.first_sample),
            str(log.n_samples),
            number(log.input_offset) if "input_offset" in log.steps else "-",
            number(log.output_offset) if "output_offset" in log.steps else "-",
            f"{log.period_samples:.2f}" if log.period_samples else "-",
            f"{len(log.repaired_input)}/{len(log.repaired_output)}",
        )
        for log in logs
    ]
    heads = (
        "recording",
        "raw in/out",
        "first",
        "kept",
        "in offset",
        "out offset",
        "period",
        "repaired",
    )
    return heads, rows


def coverage_table(
    scores: Sequence[ModelScore],
    crossval: CrossValidation,
    *,
    initial_state: str,
    count: int = 15,
) -> str:
    """Show the models that cover the most recordings (as T3.2.2.2-2).

    Parameters
    ----------
    scores : sequence of ModelScore
        As ``ranking.score_models`` gives them.
    initial_state : str
        Rule of the fits.
    count : int, [-]
        How many models to show.
    """
    rows = [
        (
            score.identified_on,
            str(score.nb),
            str(score.nk),
            f"{score.coverage} of {len(crossval.validated_on)}",
            number(score.rmsd),
            thesis_name_of(score.identified_on, score.orders),
        )
        for score in scores[:count]
    ]
    heads = ("identified on", "nb", "nk", "covers", "own RMSD", "thesis's name")
    title = (
        f"Models that cover the most recordings: RMSD below {crossval.threshold:g}"
        f"{behind(crossval.unit)}\n(form of T3.2.2.2-2)"
        f"\n{simulation_words(initial_state, is_validation=True)}"
    )
    return text_table(title, heads, rows, text_columns=(0, 5))


def cross_table(
    best: Sequence[ModelScore],
    crossval: CrossValidation,
    *,
    initial_state: str,
    width: int = WIDTH,
) -> str:
    """Show the widest model of each recording on all recordings (as T3.2.2.2-3).

    Parameters
    ----------
    best : sequence of ModelScore
        As ``ranking.best_of_each`` gives them.
    initial_state : str
        Rule of the fits.
    width : int, [characters]
        Of the screen; more recordings than fit go into further blocks.

    Returns
    -------
    str
        An asterisk marks what is covered.
    """
    rows = [
        (
            f"{score.identified_on}/{score.nb}/{score.nk}",
            *_cross_row(score, crossval),
            str(score.coverage),
        )
        for score in best
    ]
    title = (
        f"Widest model of each recording on all recordings: RMSD [{crossval.unit}], "
        f"* below\n{crossval.threshold:g} (form of T3.2.2.2-3)"
        f"\n{simulation_words(initial_state, is_validation=True)}"
    )
    heads = ("model", *crossval.validated_on, "covers")
    return split_table(title, heads, rows, width=width)


def _cross_row(score: ModelScore, crossval: CrossValidation) -> list[str]:
    values = crossval.rmsd[
        crossval.identified_on.index(score.identified_on),
        crossval.nb.index(score.nb),
        crossval.nk.index(score.nk),
    ]
    return [
        number(value) + ("*" if value < crossval.threshold else " ") for value in values
    ]
