"""The final test as text: the chain of groups on all recordings.

What covers what in the final test, as text: the matrix, and what is not covered.

Which model serves which recording, as text.
"""

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

import numpy as np

from hwid_cli.records.groups import ChainTrend, FinalTest, Prediction
from hwid_cli.records.units import behind
from hwid_cli.report.sections.words import counted
from hwid_cli.report.simulation_words import simulation_words
from hwid_cli.report.tables import thesis_name
from hwid_cli.report.text_table import (
    GAP,
    MISSING,
    WIDTH,
    joined_names,
    number,
    split_table,
    text_table,
)

# Columns of the matrix that stand together, so that the eye can count.
_TOGETHER = 5


def coverage_matrix_table(
    final: FinalTest, *, initial_state: str, width: int = WIDTH
) -> str:
    """Show which model covers which recording (as T3.4.3-1).

    Parameters
    ----------
    initial_state : str
        Rule of the fits.
    width : int, [characters]
        Of the screen; more recordings than fit go into further blocks.

    Returns
    -------
    str
        One character for each pair, recordings' names from top to bottom.
    """
    labels = ["model", *_short_names(final), "covered by"]
    label = max(map(len, labels))
    room = width - label - len(GAP) - len("  covers")
    # Each group of columns takes one more character for the gap behind it.
    per_block = max(1, room * _TOGETHER // (_TOGETHER + 1))
    title = (
        f"Coverage of all models on all recordings: 1 RMSD below {final.threshold:g}"
        f"{behind(final.unit)}, . not,\nblank its own; a + adds to the model above it "
        "(form of T3.4.3-1)\n"
        f"{simulation_words(initial_state, is_validation=True)}"
    )
    blocks = [
        _matrix_block(final, slice(first, first + per_block), labels[1:-1], label)
        for first in range(0, len(final.recordings), per_block)
    ]
    return "\n\n".join([f"{title}\n{blocks[0]}", *blocks[1:]])


def _matrix_block(
    final: FinalTest, part: slice, labels: Sequence[str], label: int
) -> str:
    """Some columns of the matrix, with heads, rows and sums."""

    def line(start: str, cells: str, end: str = "") -> str:
        return f"{start:{label}}{GAP}{_grouped(cells)}{GAP}{end:>6}".rstrip()

    heads = _downwards(final.recordings[part])
    lines = [line("", cells) for cells in heads[:-1]]
    lines.append(line("model", heads[-1], "covers"))
    covered = final.rmsd[:, part] < final.threshold
    for row, name in enumerate(labels):
        cells = np.where(covered[row], "1", ".")
        cells[final.is_own[row, part]] = " "
        lines.append(line(name, "".join(cells), str(final.covers[row])))
    counts = _downwards([str(n) for n in final.covered_by[part]])
    lines.append(line("covered by", counts[0]))
    lines += [line("", cells) for cells in counts[1:]]
    return "\n".join(lines)


def _short_names(final: FinalTest) -> list[str]:
    """Names of models; what a chain's model adds to the one above it follows a ``+``."""
    short = []
    before = ""
    for model in final.models:
        who = model.rsplit("/", 2)[0]
        is_longer = model in final.chain and before and who.startswith(f"{before}+")
        short.append(model[len(before) :] if is_longer else model)
        before = who if model in final.chain else ""
    return short


def _downwards(names: Sequence[str]) -> list[str]:
    """Lines that hold the names from top to bottom, one name in each column."""
    height = max(map(len, names))
    placed = [name.rjust(height) for name in names]
    return ["".join(letters) for letters in zip(*placed, strict=True)]


def _grouped(cells: str) -> str:
    starts = range(0, len(cells), _TOGETHER)
    return " ".join(cells[first : first + _TOGETHER] for first in starts)


def gaps_text(final: FinalTest, *, width: int = WIDTH) -> str:
    """Name the recordings that nothing covers, or hardly anything.

    Parameters
    ----------
    width : int, [characters]
        Of the screen.
    """
    parts = [
        ("Covered by no model at all, not even their own", final.uncovered),
        ("Covered by fewer than a tenth of the other models", final.hard_to_cover),
    ]
    lines = []
    for what, names in parts:
        every = counted(len(final.recordings), "recording")
        lines.append(f"{what}: {len(names)} of {every}")
        lines += [f"  {line}" for line in joined_names(names, width=width - 2) if line]
    return "\n".join(lines)


# Room for names of recordings, however long the names of models are, [characters].
_LEAST_ROOM = 24


def smallest_set_table(
    final: FinalTest, *, initial_state: str, width: int = WIDTH
) -> str:
    """Show the smallest set of models and what each serves (as T3.4.3-2).

    Parameters
    ----------
    initial_state : str
        Rule of the fits.
    width : int, [characters]
        Of the screen.

    Returns
    -------
    str
        Models are numbered M1, M2, ... for the table of predictions.
    """
    if not final.smallest_set:
        return "No model covers any recording, so no set of models is of use."
    short = _short_labels(final)
    taken = [max(map(len, (*final.smallest_set, "model"))), len("M99"), len("serves")]
    room = max(_LEAST_ROOM, width - sum(taken) - 3 * len(GAP))
    rows = []
    for model in final.smallest_set:
        served = _served_by(model, final)
        first, *others = joined_names(served, width=room)
        rows.append((short[model], model, str(len(served)), first))
        rows += [("", "", "", line) for line in others]
    n_covered = len(final.recordings) - len(final.uncovered)
    title = (
        f"Fewest models that cover all that any model covers: {len(final.smallest_set)} of "
        f"{len(final.models)} models\nfor {n_covered} of {len(final.recordings)} "
        "recordings; each served by the lowest RMSD, * covered\n(form of T3.4.3-2)\n"
        f"{simulation_words(initial_state, is_validation=True)}"
    )
    heads = ("", "model", "serves", "recordings")
    return text_table(title, heads, rows, text_columns=(0, 1, 3))


def _served_by(model: str, final: FinalTest) -> list[str]:
    """Recordings that a model of the smallest set serves, marked where covered."""
    values = final.rmsd[final.models.index(model)]
    return [
        name + ("*" if value < final.threshold else "")
        for name, value, chosen in zip(
            final.recordings, values, final.assigned_in_set, strict=True
        )
        if chosen == model
    ]


def _short_labels(final: FinalTest) -> dict[str, str]:
    labels = {model: f"M{n}" for n, model in enumerate(final.smallest_set, 1)}
    return labels | {"": MISSING}


def prediction_table(final: FinalTest, *, initial_state: str) -> str:
    """Show which model the input alone tells to use, and how that went.

    Parameters
    ----------
    initial_state : str
        Rule of the fits.

    Returns
    -------
    str
        Beneath the table stands how often the choice was right.
    """
    short = _short_labels(final)
    rows = [
        (
            told.recording,
            "test" if told.recording in final.tested_on else "",
            told.nearest or MISSING,
            f"{told.distance:.3f}" if told.nearest else MISSING,
            short[told.model],
            number(told.rmsd) + ("*" if told.is_right else " "),
            short[told.best_model],
            number(told.best_rmsd) + ("*" if told.is_possible else " "),
        )
        for told in final.predictions
    ]
    heads = (
        "recording",
        "",
        "nearest",
        "distance",
        "model",
        "RMSD ",
        "best",
        "its RMSD ",
    )
    title = (
        "Model for a recording told from its input: that of the recording of nearest input,"
        f"\nRMSD [{final.unit}], * covered; models fitted to the recording itself are "
        f"left out\n{simulation_words(initial_state, is_validation=True)}"
    )
    table = text_table(title, heads, rows, text_columns=(0, 1, 2))
    return f"{table}\n{prediction_line(final)}"


def prediction_line(final: FinalTest) -> str:
    """Say how often the model that the input told was right."""
    tests = [told for told in final.predictions if told.recording in final.tested_on]
    return (
        f"Right for {_rights(final.predictions)} recordings ({_rights(tests)} test "
        f"recordings);\nsome model that could have been chosen covers "
        f"{sum(told.is_possible for told in final.predictions)} "
        f"({sum(told.is_possible for told in tests)}) of them."
    )


def _rights(predictions: Sequence[Prediction]) -> str:
    return f"{sum(told.is_right for told in predictions)} of {len(predictions)}"


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
    initial_state : str
        Rule of the fits.
    nf : int or None, [-]
        As for ``tables.thesis_name``.
    has_names : bool
        Whether the thesis's names, which hold a delay, can be told from the grid.
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
    kinds : mapping of str to str
        Kind of each recording by its name.
    initial_state : str
        Rule of the fits.
    width : int, [characters]
        Of the screen.
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
