"""Models side by side, as text."""

from collections.abc import Callable
from string import ascii_uppercase

import numpy as np

from hwid_cli.records.comparison import Comparison
from hwid_cli.report.simulation_words import simulation_words
from hwid_cli.report.text_table import MISSING, WIDTH, number, split_table

_OWN, _OTHER = "'", " "
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


def comparison_table(comparison: Comparison, *, width: int = WIDTH) -> str:
    """Show RMSD and fit percent of each model on each recording.

    Parameters
    ----------
    width : int, [characters]
        Of the screen.

    Returns
    -------
    str
        An apostrophe marks recordings that took part in a model's fit; where several
        models are best to the digits shown, the best is an equals sign.
    """
    letters = model_letters(comparison)
    pooled = np.sqrt(np.mean(comparison.rmsd**2, axis=1))
    middle = np.mean(comparison.fit_percent, axis=1)
    deviations = [
        (name, *_deviations(comparison, m), *_best(comparison.rmsd[:, m], number))
        for m, name in enumerate(comparison.recordings)
    ]
    percents = [
        (name, *map(_percent, column), *_best(column, _percent, is_high=True))
        for name, column in zip(
            comparison.recordings, comparison.fit_percent.T, strict=True
        )
    ]
    if len(comparison.recordings) > 1:
        cells = [number(one) + _OTHER for one in pooled]
        deviations.append(("all", *cells, *_best(pooled, number)))
        best = _best(middle, _percent, is_high=True)
        percents.append(("all", *map(_percent, middle), *best))
    best_head = ("best",) if len(letters) > 1 else ()
    tables = [
        split_table(
            _title(comparison) if what == "RMSD" else "",
            ("recording", *[f"{one} {what}" for one in letters], *best_head),
            rows,
            width=width,
        )
        for what, rows in (("RMSD", deviations), ("fit %", percents))
    ]
    names = [f"{a}: {_about(comparison, n)}" for n, a in enumerate(letters)]
    marks = (
        [f"{_OWN} the model was identified on this recording"]
        if comparison.is_own.any()
        else []
    )
    return "\n".join(["\n\n".join(tables), *marks, *names])


def start_words(comparison: Comparison) -> str:
    """Say how the simulations start.

    Returns
    -------
    str
        One sentence for each rule that a model has.
    """
    letters = model_letters(comparison)
    rules: dict[str, list[str]] = {}
    for letter, one in zip(letters, comparison.models, strict=True):
        rules.setdefault(one.model.initial_state, []).append(letter)
    if len(rules) == 1:
        return simulation_words(next(iter(rules)), is_validation=True)
    return "\n".join(
        f"{', '.join(own)}: {simulation_words(rule, is_validation=True)}"
        for rule, own in rules.items()
    )


def _title(comparison: Comparison) -> str:
    return (
        f"Models side by side: RMSD [{comparison.output_unit}] and fit percent; all: "
        f"pooled RMSD, mean fit\n{start_words(comparison)}"
    )


def _about(comparison: Comparison, number_: int) -> str:
    one = comparison.models[number_]
    orders = one.model.orders
    maps = f"{one.model.input_map.kind} -> {one.model.output_map.kind}"
    return f"{one.name} [{orders.nb} {orders.nf} {orders.nk}], {maps}"


def _deviations(comparison: Comparison, m: int) -> list[str]:
    own = [_OWN if flag else _OTHER for flag in comparison.is_own[:, m]]
    values = map(number, comparison.rmsd[:, m])
    return [text + mark for text, mark in zip(values, own, strict=True)]


def _percent(value: float) -> str:
    return f"{value:.2f}" if np.isfinite(value) else MISSING


def _best(
    values: np.ndarray, shown: Callable[[float], str], *, is_high: bool = False
) -> tuple[str, ...]:
    """Cell of the best model, if there are others; a tie in the digits shown is none."""
    if values.size < 2:
        return ()
    if not np.isfinite(values).any():
        return (MISSING,)
    place = int(np.nanargmax(values) if is_high else np.nanargmin(values))
    texts = [shown(value) for value in values]
    return (_TIE if texts.count(texts[place]) > 1 else _letters(values.size)[place],)
