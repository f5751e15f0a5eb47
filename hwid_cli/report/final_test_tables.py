"""The final test as text: the chain of groups on all recordings."""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

import numpy as np

from hwid_cli.records.groups import ChainTrend, FinalTest
from hwid_cli.report.simulation_words import simulation_words
from hwid_cli.report.tables import thesis_name
from hwid_cli.report.text_table import (
    WIDTH,
    number,
    split_table,
    text_table,
)

# Published tables of the chain on all recordings of a kind.
_FORMS = {"step": "T3.4.1-2", "sine": "T3.4.1-3"}
# Longer names leave no room for recordings beside them, [characters].
_LONGEST_NAME = 36


def chain_on_tests_table(
    final: FinalTest, trend: ChainTrend, *, initial_state: str, width: int = WIDTH
) -> str:
    """Show the chain on the recordings that nothing else has used (as T3.3.3.4-1).

    Parameters
    ----------
    final : FinalTest
    trend : ChainTrend
    initial_state : str
        Rule of the fits.
    width : int, [characters]
        Of the screen.

    Returns
    -------
    str
        Beneath the table stands whether the RMSD falls along the chain.
    """
    rows = _chain_rows(final, final.tested_on, map(number, trend.tested_rmsd))
    title = (
        f"The chain on the test recordings: RMSD [{final.unit}], * below "
        f"{final.threshold:g}\n(form of T3.3.3.4-1)\n"
        f"{simulation_words(initial_state, is_validation=True)}"
    )
    table = split_table(title, ("model", *final.tested_on, "mean"), rows, width=width)
    legend = [f"{label}: {model}" for model, label in _labels(final).items()]
    meanings = legend if _has_long_names(final) else []
    return "\n".join([table, *meanings, trend_line(trend)])


def trend_line(trend: ChainTrend) -> str:
    """Say whether the RMSD on the test recordings falls along the chain.

    Parameters
    ----------
    trend : ChainTrend

    Returns
    -------
    str

    Examples
    --------
    >>> coverage = np.array([[3], [4], [4]])
    >>> trend_line(ChainTrend(("a", "b", "c"), (0.3, 0.1, 0.2), ("step",), coverage))
    'Along the chain the mean RMSD on the test recordings falls, but not at every level.'
    """
    values = trend.tested_rmsd
    start = "Along the chain the mean RMSD on the test recordings"
    if len(values) < 2:
        return "The chain has one level, so there is no trend to judge."
    if not np.isfinite(values).all():
        return f"{start} is not known at every level."
    falls = [later < earlier for earlier, later in pairwise(values)]
    if all(falls):
        return f"{start} falls at every level."
    if values[-1] < values[0]:
        return f"{start} falls, but not at every level."
    return f"{start} does not fall."


def chain_coverage_table(
    final: FinalTest,
    trend: ChainTrend,
    *,
    initial_state: str,
    nf: int | None = None,
    has_names: bool = True,
) -> str:
    """Show how many recordings the chain covers, level by level (as T3.4.1-1).

    Parameters
    ----------
    final : FinalTest
    trend : ChainTrend
    initial_state : str
        Rule of the fits.
    nf : int or None, [-]
        As for ``tables.thesis_name``.
    has_names : bool
        Whether the thesis's names, which hold a delay, can be told from the grid.

    Returns
    -------
    str
    """
    rows = [
        (model, *map(str, counts), str(total), *_names(model, nf, has_names=has_names))
        for model, counts, total in zip(
            trend.models, trend.coverage, trend.total, strict=True
        )
    ]
    title = (
        f"Recordings that the chain covers, its own included, of {len(final.recordings)}"
        "\n(form of T3.4.1-1 and T3.4.2-1)\n"
        f"{simulation_words(initial_state, is_validation=True)}"
    )
    names = ("thesis's name",) if has_names else ()
    heads = ("model", *trend.kinds, "all", *names)
    last = (len(heads) - 1,) if has_names else ()
    return text_table(title, heads, rows, text_columns=(0, *last))


def _names(model: str, nf: int | None, *, has_names: bool) -> tuple[str, ...]:
    identified_on, nb, nk = model.rsplit("/", 2)
    return (thesis_name(identified_on, int(nb), int(nk), nf),) if has_names else ()


def chain_tables(
    final: FinalTest,
    trend: ChainTrend,
    kinds: Mapping[str, str],
    *,
    initial_state: str,
    width: int = WIDTH,
) -> str:
    """Show the chain on all recordings, kind by kind (as T3.4.1-2 and T3.4.1-3).

    Parameters
    ----------
    final : FinalTest
    trend : ChainTrend
    kinds : mapping of str to str
        Kind of each recording by its name.
    initial_state : str
        Rule of the fits.
    width : int, [characters]
        Of the screen.

    Returns
    -------
    str
    """
    tables = []
    for place, kind in enumerate(trend.kinds):
        names = [name for name in final.recordings if kinds[name] == kind]
        rows = _chain_rows(final, names, map(str, trend.coverage[:, place]))
        form = f" (form of {_FORMS[kind]})" if kind in _FORMS else ""
        title = (
            f"The chain on all recordings of kind {kind}: RMSD [{final.unit}], * below "
            f"{final.threshold:g}{form}\n"
            f"{simulation_words(initial_state, is_validation=True)}"
        )
        tables.append(
            split_table(title, ("model", *names, "covers"), rows, width=width)
        )
    return "\n\n".join(tables)


def _chain_rows(
    final: FinalTest, names: Sequence[str], last: Iterable[str]
) -> list[tuple[str, ...]]:
    """RMSD of each of the chain's models on some recordings."""
    columns = [final.recordings.index(name) for name in names]
    labels = _labels(final)
    return [
        (
            labels[model],
            *(_marked(value, final) for value in final.rmsd[row, columns]),
            end,
        )
        for model, row, end in zip(
            final.chain, map(final.models.index, final.chain), last, strict=True
        )
    ]


def _has_long_names(final: FinalTest) -> bool:
    return max(map(len, final.chain), default=0) > _LONGEST_NAME


def _labels(final: FinalTest) -> dict[str, str]:
    """What stands for the chain's models: their names, or C1, C2 ... where these are long."""
    if not _has_long_names(final):
        return {model: model for model in final.chain}
    return {model: f"C{place}" for place, model in enumerate(final.chain, 1)}


def _marked(value: float, final: FinalTest) -> str:
    return number(value) + ("*" if value < final.threshold else " ")
