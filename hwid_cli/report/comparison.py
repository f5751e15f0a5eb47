"""Models side by side, as tables."""

from collections.abc import Callable
from string import ascii_uppercase

import numpy as np

from hwid_cli.records.comparison import Comparison
from hwid_cli.report.formats import MISSING, decimals, number
from hwid_cli.report.simulation_note import simulation_note
from hwid_cli.report.table import Cell, Column, Row, Table, numbers, texts

_TIE = "="


def model_letters(comparison: Comparison) -> list[str]:
    """Short names of the models, in their order.

    Returns
    -------
    list of str
        A, B, ... and numbers beyond Z.
    """
    return _letters(len(comparison.models))


def _letters(count: int) -> list[str]:
    return [ascii_uppercase[n] if n < 26 else str(n + 1) for n in range(count)]


def comparison_tables(comparison: Comparison) -> tuple[Table, Table]:
    """Show RMSD and fit percent of each model on each recording.

    Returns
    -------
    tuple of Table
        Recordings that took part in a model's fit are marked; where several models are
        best to the digits shown, the best is an equals sign.
    """
    letters = model_letters(comparison)
    rmsd, percents = comparison.rmsd.T, comparison.fit_percent.T
    own = comparison.is_own.T
    if len(comparison.recordings) > 1:
        pooled = np.sqrt(np.mean(comparison.rmsd**2, axis=1))
        rmsd = np.vstack([rmsd, pooled])
        percents = np.vstack([percents, np.mean(comparison.fit_percent, axis=1)])
        own = np.vstack([own, np.zeros(len(letters), bool)])
    # The last name is that of the row over all recordings, if there is one.
    names = (*comparison.recordings, "all")[: len(rmsd)]
    deviations: tuple[Row, ...] = tuple(
        (
            name,
            *(
                Cell(number(value), is_marked=bool(is_own))
                for value, is_own in zip(values, flags, strict=True)
            ),
            *_best(values, number),
        )
        for name, values, flags in zip(names, rmsd, own, strict=True)
    )
    shares = tuple(
        (name, *map(_percent, values), *_best(values, _percent, is_high=True))
        for name, values in zip(names, percents, strict=True)
    )
    marks = ["' the model was identified on this recording"] * bool(own.any())
    about = [f"{a}: {_about(comparison, n)}" for n, a in enumerate(letters)]
    caption = (
        f"Models side by side: RMSD [{comparison.output_unit}]; all: pooled over the "
        "recordings"
    )
    how = start_notes(comparison)
    return (
        Table(
            caption, _columns(letters, "RMSD"), deviations, tuple(marks), how, mark="'"
        ),
        Table(
            "Fit percent; all: mean over the recordings",
            _columns(letters, "fit %"),
            shares,
            tuple(about),
        ),
    )


def _columns(letters: list[str], what: str) -> tuple[Column, ...]:
    best = (Column("best", stays=True),) if len(letters) > 1 else ()
    return (*texts("recording"), *numbers(*(f"{one} {what}" for one in letters)), *best)


def start_notes(comparison: Comparison) -> tuple[str, ...]:
    """Say how the simulations start: one sentence for each rule that a model has."""
    rules: dict[str, list[str]] = {}
    for letter, one in zip(model_letters(comparison), comparison.models, strict=True):
        rules.setdefault(one.model.initial_state, []).append(letter)
    said = {rule: simulation_note(rule, is_validation=True) for rule in rules}
    if len(rules) == 1:
        return tuple(said.values())
    return tuple(f"{', '.join(own)}: {said[rule]}" for rule, own in rules.items())


def _about(comparison: Comparison, place: int) -> str:
    one = comparison.models[place]
    orders = one.model.orders
    maps = f"{one.model.input_map.kind} -> {one.model.output_map.kind}"
    return f"{one.name} [{orders.nb} {orders.nf} {orders.nk}], {maps}"


def _percent(value: float) -> str:
    return decimals(value, 2)


def _best(
    values: np.ndarray, shown: Callable[[float], str], *, is_high: bool = False
) -> tuple[str, ...]:
    """Cell of the best model, if there are others; a tie in the digits shown is none."""
    if values.size < 2:
        return ()
    if not np.isfinite(values).any():
        return (MISSING,)
    place = int(np.nanargmax(values) if is_high else np.nanargmin(values))
    cells = [shown(value) for value in values]
    return (_TIE if cells.count(cells[place]) > 1 else _letters(values.size)[place],)
