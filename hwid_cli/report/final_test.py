"""The final test as tables: the chain of groups, what covers what, what serves what."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from hwid_cli.records.groups import ChainTrend, FinalTest, Prediction, SingleModels
from hwid_cli.records.units import behind
from hwid_cli.report.formats import (
    MISSING,
    as_sentence,
    counted,
    decimals,
    number,
    with_unit,
)
from hwid_cli.report.table import Cell, Column, Row, Table, Text, numbers, texts

# Published tables of the chain on all recordings of a kind.
_FORMS = {"step": "T3.4.1-2", "sine": "T3.4.1-3"}
# Longer names leave no room for recordings beside them, [characters].
_LONGEST_NAME = 36


def chain_on_tests_table(final: FinalTest, trend: ChainTrend) -> Table:
    """Show the chain on the recordings that nothing else has used.

    Returns
    -------
    Table
        Beneath it stands whether the RMSD falls along the chain.
    """
    last = list(map(number, trend.tested_rmsd))
    rows = _chain_rows(final, final.tested_on, last)
    singles = trend.singles
    if singles is not None and singles.chosen not in final.chain:
        alone = replace(final, chain=(singles.chosen,))
        mean = [number(singles.chosen_rmsd)]
        rows = (*_chain_rows(alone, final.tested_on, mean), *rows)
    return Table(
        f"The chain on the test recordings: RMSD [{final.unit}], * below "
        f"{final.threshold:g}",
        _chain_columns(final.tested_on, "mean"),
        rows,
        (trend_sentence(trend), *_joining_note(final, trend)),
        is_validation=True,
        published="T3.3.3.4-1",
    )


def trend_sentence(trend: ChainTrend) -> str:
    """Say whether the RMSD on the test recordings falls along the chain.

    Examples
    --------
    >>> coverage = np.array([[3], [4], [4]])
    >>> trend_sentence(ChainTrend(("a", "b", "c"), (0.3, 0.1, 0.2), ("step",), coverage))
    'Along the chain the mean RMSD on the test recordings falls, but not at every level.'
    """
    values = trend.tested_rmsd
    start = "Along the chain the mean RMSD on the test recordings"
    if len(values) < 2:
        return "The chain has one level, so there is no trend."
    if not np.isfinite(values).all():
        return f"{start} is not known at every level."
    falls = [later < earlier for earlier, later in pairwise(values)]
    if all(falls):
        return f"{start} falls at every level."
    if values[-1] < values[0]:
        return f"{start} falls, but not at every level."
    return f"{start} does not fall."


def _joining_note(final: FinalTest, trend: ChainTrend) -> tuple[str, ...]:
    """Whether joining recordings helped; empty where the winner is no group."""
    if trend.singles is None or not trend.models or "+" not in trend.models[-1]:
        return ()
    found = joining_clause(trend.tested_rmsd[-1], trend.singles, final.unit)
    return (as_sentence(found),) if found else ()


def joining_clause(rmsd: float, singles: SingleModels, unit: str) -> str:
    """Say whether joining recordings helped on those that nothing has used.

    Parameters
    ----------
    rmsd : float, [unit]
        Of the joined model, mean over these recordings.

    Returns
    -------
    str
        Empty where one of both RMSDs is not known.

    Examples
    --------
    >>> said = joining_clause(0.1, SingleModels("b/1/2", 0.2, "b/1/2", 0.2), "m")
    >>> print(*said.split())
    joining recordings helps here: b/1/2, the single model chosen in the same way, leaves 0.2 m
    """
    if not (np.isfinite(rmsd) and np.isfinite(singles.chosen_rmsd)):
        return ""
    helps = "helps" if rmsd < singles.chosen_rmsd else "does not help"
    chosen, nearest = (
        with_unit(one, unit) for one in (singles.chosen_rmsd, singles.nearest_rmsd)
    )
    said = (
        f"joining recordings {helps} here: {singles.chosen}, the single model chosen in "
        f"the same way, leaves {chosen}"
    )
    if singles.nearest_rmsd < min(rmsd, singles.chosen_rmsd):
        said += (
            f"; {singles.nearest} happens to be nearer, {nearest}, which only the test "
            "recordings can tell"
        )
    return said


def chain_coverage_table(
    final: FinalTest, trend: ChainTrend, names: Mapping[str, str]
) -> Table:
    """Show how many recordings the chain covers, level by level.

    Parameters
    ----------
    names : mapping of str to str
        Of models in the thesis, by ours.
    """
    rows = tuple(
        (model, *map(str, counts), str(total), names.get(model, MISSING))
        for model, counts, total in zip(
            trend.models, trend.coverage, trend.total, strict=True
        )
    )
    return Table(
        f"Recordings that the chain covers, its own included, of {len(final.recordings)}",
        (
            *texts("model"),
            *numbers(*trend.kinds, "all"),
            Column("thesis's name", is_text=True, is_thesis=True),
        ),
        rows,
        is_validation=True,
        published="T3.4.1-1 and T3.4.2-1",
    )


def chain_tables(
    final: FinalTest, trend: ChainTrend, kinds: Mapping[str, str]
) -> tuple[Table, ...]:
    """Show the chain on all recordings, kind by kind.

    Parameters
    ----------
    kinds : mapping of str to str
        Kind of each recording by its name.
    """
    found = []
    for place, kind in enumerate(trend.kinds):
        names = [name for name in final.recordings if kinds[name] == kind]
        covers = [str(count) for count in trend.coverage[:, place]]
        table = Table(
            f"The chain on all recordings of kind {kind}: RMSD [{final.unit}], * below "
            f"{final.threshold:g}",
            _chain_columns(names, "covers"),
            _chain_rows(final, names, covers),
            is_validation=True,
            published=_FORMS.get(kind, ""),
        )
        found.append(table)
    return tuple(found)


def _chain_columns(names: Sequence[str], last: str) -> tuple[Column, ...]:
    return (*texts("model"), *numbers(*names), Column(last, stays=True))


def _chain_rows(
    final: FinalTest, names: Sequence[str], last: Sequence[str]
) -> tuple[Row, ...]:
    """RMSD of each of the chain's models on some recordings."""
    columns = [final.recordings.index(name) for name in names]
    is_long = max(map(len, final.chain), default=0) > _LONGEST_NAME
    return tuple(
        (
            Cell(model, short=f"C{place}" * is_long),
            *(_rmsd(value, final) for value in final.rmsd[row, columns]),
            end,
        )
        for place, (model, end) in enumerate(zip(final.chain, last, strict=True), 1)
        for row in [final.models.index(model)]
    )


def _rmsd(value: float, final: FinalTest) -> Cell:
    return Cell(number(value), is_marked=bool(value < final.threshold))


def coverage_matrix_table(final: FinalTest) -> Table:
    """Show which model covers which recording.

    Returns
    -------
    Table
        One character for each pair, recordings' names from top to bottom.
    """
    covered = np.where(final.rmsd < final.threshold, "1", ".")
    rows = [
        (name, *np.where(is_own, " ", cells).tolist(), str(covers))
        for name, is_own, cells, covers in zip(
            _short_names(final), final.is_own, covered, final.covers, strict=True
        )
    ]
    rows.append(("covered by", *map(str, final.covered_by), ""))
    columns = (
        *texts("model"),
        *(Column(name, is_upright=True) for name in final.recordings),
        Column("covers", stays=True),
    )
    caption = (
        f"Coverage of all models on all recordings: 1 RMSD below {final.threshold:g}"
        f"{behind(final.unit)}, . not, blank its own; a + adds to the model above it"
    )
    return Table(
        caption, columns, tuple(rows), is_validation=True, published="T3.4.3-1"
    )


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


def gap_sentences(final: FinalTest) -> tuple[Text, ...]:
    """Name the recordings that nothing covers, or hardly anything."""
    n_all = len(final.recordings)
    hard = [name for name in final.hard_to_cover if name not in final.uncovered]
    if len(final.uncovered) == n_all:
        found = ["No model covers any recording, not even its own."]
    elif final.uncovered:
        found = [
            f"No model covers {len(final.uncovered)} of {counted(n_all, 'recording')}, not "
            f"even their own: {', '.join(final.uncovered)}."
        ]
    else:
        found = ["Every recording is covered by some model."]
    if hard:
        at = [final.recordings.index(name) for name in hard]
        who = (
            "Fewer than a tenth of the other models cover"
            if final.covered_by[at].any()
            else "No other model covers"
        )
        found.append(
            f"{who} {len(hard)} of {counted(n_all, 'recording')}: {', '.join(hard)}."
        )
    return tuple(map(Text, found))


def smallest_set_table(final: FinalTest) -> Table | Text:
    """Show the smallest set of models and what each serves."""
    if not final.smallest_set:
        return Text("No model covers any recording, so no set of models is of use.")
    rows = []
    for model in final.smallest_set:
        served = _served_by(model, final)
        rows.append((model, str(len(served)), ", ".join(served)))
    n_covered = len(final.recordings) - len(final.uncovered)
    caption = (
        f"Fewest models that cover all that any model covers: {len(final.smallest_set)} of "
        f"{len(final.models)} models for {n_covered} of {len(final.recordings)} "
        "recordings; each served by the lowest RMSD, * covered"
    )
    return Table(
        caption,
        (
            *texts("model"),
            *numbers("serves"),
            Column("recordings", is_text=True, joint=", "),
        ),
        tuple(rows),
        is_validation=True,
        published="T3.4.3-2",
    )


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


def assignment_table(final: FinalTest) -> Table:
    """Show the best model of all and of the smallest set for each recording."""
    rows = tuple(
        (name, best, _of(final, best, column), in_set, _of(final, in_set, column))
        for column, (name, best, in_set) in enumerate(
            zip(final.recordings, final.assigned, final.assigned_in_set, strict=True)
        )
    )
    unit = f"RMSD [{final.unit}]"
    columns = (
        *texts("recording", "best model"),
        *numbers(unit),
        *texts("best of the smallest set"),
        *numbers(unit),
    )
    caption = f"The best models of each recording, * below {final.threshold:g}"
    return Table(caption + behind(final.unit), columns, rows)


def _of(final: FinalTest, model: str, column: int) -> Cell:
    if model not in final.models:
        return Cell(MISSING)
    return _rmsd(final.rmsd[final.models.index(model), column], final)


def prediction_table(final: FinalTest) -> Table:
    """Show which model the input alone tells to use, and how that went."""
    labels = {model: f"M{n}" for n, model in enumerate(final.smallest_set, 1)}

    def model(name: str) -> Cell:
        return Cell(name or MISSING, short=labels.get(name, ""))

    rows = tuple(
        (
            told.recording,
            "test" if told.recording in final.tested_on else "",
            _verdict(told),
            told.nearest or MISSING,
            decimals(told.distance, 3),
            model(told.model),
            Cell(number(told.rmsd), is_marked=told.is_right),
            model(told.best_model),
            Cell(number(told.best_rmsd), is_marked=told.is_possible),
        )
        for told in final.predictions
    )
    columns = (
        *texts("recording", ""),
        Column("verdict", is_text=True, is_detail=True),
        *texts("nearest"),
        *numbers("distance"),
        *texts("model"),
        *numbers("RMSD"),
        *texts("best"),
        *numbers("its RMSD"),
    )
    caption = (
        "Model for a recording told from its input: that of the recording of nearest input, "
        f"RMSD [{final.unit}], * covered; models fitted to the recording itself are left out"
    )
    notes = (prediction_sentence(final),)
    return Table(caption, columns, rows, notes, is_validation=True)


def _verdict(told: Prediction) -> str:
    if told.is_right:
        return "right"
    return "wrong" if told.is_possible else "no choice covers it"


def prediction_sentence(final: FinalTest) -> str:
    """Say how often the model that the input told was right."""
    tests = [told for told in final.predictions if told.recording in final.tested_on]
    return (
        f"Right for {_rights(final.predictions)} recordings ({_rights(tests)} test "
        "recordings); some model that could have been chosen covers "
        f"{sum(told.is_possible for told in final.predictions)} "
        f"({sum(told.is_possible for told in tests)}) of them."
    )


def _rights(predictions: Sequence[Prediction]) -> str:
    return f"{sum(told.is_right for told in predictions)} of {len(predictions)}"
