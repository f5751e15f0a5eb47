"""A diagnosis as text for the screen.

Names of parameters that end in their unit, taken apart for people.

Tables and sentences of a diagnosis: what the screen and the page of the report show alike.
"""

import textwrap
from collections.abc import Sequence

import numpy as np

from hwid_cli.records.diagnosis import (
    BaseParameter,
    Diagnosis,
    FittedParameter,
    Gap,
    RankedCandidate,
)
from hwid_cli.records.units import behind
from hwid_cli.report.page import Cell, Table
from hwid_cli.report.text_table import GAP, MISSING, WIDTH, number, text_table

# What a unit in a name is made of.
_UNITS = {"N", "m", "kg", "A", "V", "H", "ohm", "s", "Hz", "rad", "deg"}
_PER = "per"


def quantity_and_unit(name: str) -> tuple[str, str]:
    """Take the name of a parameter apart.

    Returns
    -------
    quantity : str
        In words.
    unit : str
        A dash where there is none.

    Examples
    --------
    >>> quantity_and_unit("drag_N_s2_per_m2")
    ('drag', 'N s^2/m^2')
    >>> quantity_and_unit("position_gain_per_s"), quantity_and_unit("damping_ratio")
    (('position gain', '1/s'), ('damping ratio', '-'))
    """
    words = name.split("_")
    first = len(words)
    # The first word is never a unit: it says what the number is.
    while first > 1 and _is_unit(words[first - 1]):
        first -= 1
    above, _, below = "_".join(words[first:]).partition(_PER)
    unit = _product(above) or "1"
    if below:
        unit += f"/{_product(below)}"
    return " ".join(words[:first]), unit if first < len(words) else "-"


def _is_unit(word: str) -> bool:
    return word == _PER or word.rstrip("234") in _UNITS


def _product(words: str) -> str:
    """``_N_s2_`` as ``N s^2``."""
    parts = [word for word in words.split("_") if word]
    return " ".join(
        f"{part[:-1]}^{part[-1]}" if part[-1].isdigit() else part for part in parts
    )


# Joins the effects of a candidate.
AND = " + "
NO_EFFECT = "no effect added"


def candidate_name(effects: Sequence[str]) -> str:
    """Name a set of effects.

    Parameters
    ----------
    effects : sequence of str
        Ids.

    Examples
    --------
    >>> candidate_name(["cogging", "second_mode"]), candidate_name([])
    ('cogging + second_mode', 'no effect added')
    """
    return AND.join(effects) or NO_EFFECT


def is_chosen(candidate: RankedCandidate, diagnosis: Diagnosis) -> bool:
    """Say whether a candidate is what the diagnosis names."""
    found = {effect.id for effect in diagnosis.effects}
    return bool(found) and set(candidate.effects) == found


# Where something else remains, an effect also takes up some of that.
INTERVALS_OF_A_PART = "intervals hold as if nothing else were missing"


def effects_table(diagnosis: Diagnosis) -> Table:
    """Show the parameters of the effects that the simulation lacks."""
    rows = []
    for effect in diagnosis.effects:
        name = effect.id
        for parameter in effect.parameters:
            quantity, unit = quantity_and_unit(parameter.name)
            value = parameter.text or _value(parameter.value)
            rows.append((name, quantity, value, _interval(parameter), unit))
            name = ""
    title = "Effects that the simulation lacks"
    if rows and not diagnosis.complete:
        title += f"; {INTERVALS_OF_A_PART}"
    return Table(
        title,
        ("effect", "parameter", "value", "95 % interval", "unit"),
        tuple(rows),
        text_columns=(0, 1, 4),
    )


def _interval(parameter: FittedParameter) -> str:
    bounds = (parameter.low, parameter.high)
    return " to ".join(map(_value, bounds)) if np.isfinite(bounds).all() else MISSING


def gap_table(diagnosis: Diagnosis) -> Table:
    """Show the gap between simulation and measurement, step by step.

    Returns
    -------
    Table
        The last row, with the effects, only where there are any.
    """
    steps = [
        ("as given", diagnosis.given),
        ("base re-fitted", diagnosis.before),
        ("with the effects", diagnosis.after),
    ]
    unit = diagnosis.output_unit
    return Table(
        f"Gap between simulation and measurement; noise {number(diagnosis.noise.rms)}"
        f"{behind(unit)}",
        (
            "simulation",
            f"train RMS [{unit}]",
            f"held-out RMS [{unit}]",
            "held-out / noise",
        ),
        tuple(_gap_row(*step) for step in steps[: 3 if diagnosis.effects else 2]),
    )


def _gap_row(label: str, gap: Gap) -> tuple[str, ...]:
    values = number(gap.train_rms), number(gap.held_out_rms)
    return (label, *values, _ratio(gap.ratio_to_noise))


def base_table(diagnosis: Diagnosis) -> Table:
    """Show the parameters of the simulation as given and as fitted.

    Returns
    -------
    Table
        Its last column is how far the last fit moved each of them.
    """
    heads = ["parameter", "given", "re-fitted", "with the effects", "shift", "unit"]
    if not diagnosis.effects:
        heads.remove("with the effects")
    rows = []
    for one in diagnosis.base:
        quantity, unit = quantity_and_unit(one.name)
        values = [one.before, one.refitted, one.after][: len(heads) - 3]
        rows.append((quantity, *map(_value, values), _shift(one, values[-1]), unit))
    return Table(
        "Parameters of the simulation",
        tuple(heads),
        tuple(rows),
        text_columns=(0, len(heads) - 1),
    )


def _shift(one: BaseParameter, fitted: float) -> str:
    if one.before == 0.0 or not np.isfinite(fitted / one.before):
        return MISSING
    return f"{100.0 * (fitted / one.before - 1.0):+.1f} %"


def ranking_table(
    diagnosis: Diagnosis, *, count: int | None = None, with_notes: bool = False
) -> Table:
    """Show the candidates, the best first.

    Parameters
    ----------
    count : int or None, [-]
        How many; None for all.
    with_notes : bool
        Whether a last column holds the notes.

    Returns
    -------
    Table
        What was not fitted has a forecast only.
    """
    has_noise = diagnosis.noise.rms > 0.0
    rows = []
    for one in diagnosis.candidates[:count]:
        error = one.held_out_rms
        rows.append(
            (
                candidate_name(one.effects) + "*" * is_chosen(one, diagnosis),
                percent(one.forecast_share),
                _ratio(error / diagnosis.noise.rms) if has_noise else number(error),
                percent(one.explained_share),
                percent(one.improved_share),
                f"{one.bic_gain:.0f}" if np.isfinite(one.bic_gain) else MISSING,
                *([one.note] * with_notes),
            )
        )
    mark = " (* the diagnosis)" if diagnosis.effects else ""
    return Table(
        f"Candidates, the best first{mark}; forecast, explained and improved\n"
        "are shares of the error, of its excess over the noise, and of the recordings",
        (
            "added to the simulation",
            "forecast",
            "held-out/noise" if has_noise else f"RMS [{diagnosis.output_unit}]",
            "explained",
            "improved",
            "BIC gain",
            *(["note"] * with_notes),
        ),
        tuple(rows),
        text_columns=(0, 6),
    )


def recordings_table(diagnosis: Diagnosis) -> Table:
    """Show the gap in every recording."""
    heads = ["recording", "kind", "used to", "given", "re-fitted", "with the effects"]
    rows = []
    for one in diagnosis.gaps:
        values = [one.rms_given, one.rms_before, one.rms_after]
        if not diagnosis.effects:
            values.pop()
        use = "judge" if one.is_held_out else "train"
        rows.append((one.name, one.kind, use, *map(number, values)))
    return Table(
        f"RMS gap of every recording [{diagnosis.output_unit}]",
        tuple(heads if diagnosis.effects else heads[:-1]),
        tuple(rows),
        text_columns=(0, 1, 2),
    )


def closing_sentences(diagnosis: Diagnosis) -> list[str]:
    """Say what the data cannot tell apart, what to measure next, what nothing shows."""
    lines = []
    if diagnosis.ambiguous_with:
        names = ", ".join(one.replace("+", AND) for one in diagnosis.ambiguous_with)
        lines.append(f"These data cannot tell it from: {names}.")
    following = diagnosis.next_experiment
    if following.input:
        # Both may end with a full stop of their own.
        parts = [one.strip().rstrip(".") for one in (following.input, following.reason)]
        text = " - ".join(part for part in parts if part)
        lines.append(f"Next experiment: {text}.")
    if diagnosis.not_observable:
        names = "; ".join(one.rstrip(".") for one in diagnosis.not_observable)
        lines.append(f"Cannot be seen in these recordings: {names}.")
    return lines


def explained_line(diagnosis: Diagnosis) -> str:
    """Say how much of the gap the effects explain."""
    share = percent(diagnosis.explained_share)
    return f"Explained: {share} of the excess over the noise, held-out recordings."


def percent(share: float) -> str:
    """Write a share in percent with one decimal.

    Parameters
    ----------
    share : float, [-]

    Examples
    --------
    >>> percent(0.998), percent(float("nan"))
    ('99.8 %', '-')
    """
    return f"{100.0 * share:.1f} %" if np.isfinite(share) else MISSING


def _value(value: float) -> str:
    return f"{value:.4g}" if np.isfinite(value) else MISSING


def _ratio(value: float) -> str:
    # Close to 1 each thousandth tells whether something remains.
    digits = 3 if value < 10.0 else 1
    return f"{value:.{digits}f}" if np.isfinite(value) else MISSING


# Candidates and places that the screen shows.
_MOST_SHOWN = 5
# Verdicts that need no effect, so that little has to be said.
_SHORT = ("none", "parameters")


def verdict_line(diagnosis: Diagnosis) -> str:
    """Say the verdict in a few words."""
    line = f"Verdict: {diagnosis.verdict}"
    if diagnosis.effects:
        names = candidate_name([effect.id for effect in diagnosis.effects])
        rest = "complete" if diagnosis.complete else "a part stays unexplained"
        line += f", {names} ({rest})"
    return line


def diagnosis_text(diagnosis: Diagnosis, *, width: int = WIDTH) -> str:
    """Show a diagnosis on the screen.

    Parameters
    ----------
    width : int, [characters]
        Of the screen.

    Returns
    -------
    str
        Short where nothing is missing.
    """
    is_short = diagnosis.verdict in _SHORT
    about = (
        f"Trained on {len(diagnosis.train)} recordings, judged on "
        f"{len(diagnosis.held_out)} held out."
    )
    parts = [_wrapped([verdict_line(diagnosis), diagnosis.summary, about], width)]
    for effect in diagnosis.effects:
        parts.append(_wrapped([effect.sentence, f"  {effect.equation}"], width))
    if diagnosis.effects:
        parts.append(_shown(effects_table(diagnosis), width))
    parts.append(_shown(gap_table(diagnosis), width))
    if diagnosis.effects:
        parts[-1] += f"\n{explained_line(diagnosis)}"
    parts[-1] += f"\n{_wrapped([diagnosis.noise.sentence], width)}"
    if not is_short and diagnosis.places:
        places = [f"- {one.sentence}" for one in diagnosis.places[:_MOST_SHOWN]]
        parts.append(f"Where the error sits\n{_wrapped(places, width)}")
    if diagnosis.base and diagnosis.verdict != "none":
        parts.append(_shown(base_table(diagnosis), width))
    parts.append(_wrapped(closing_sentences(diagnosis), width))
    if not is_short and diagnosis.candidates:
        parts.append(_shown(ranking_table(diagnosis, count=_MOST_SHOWN), width))
    return "\n\n".join(part.rstrip() for part in parts if part.strip())


def _wrapped(lines: Sequence[str], width: int) -> str:
    """Lines no wider than the screen; what goes on is indented as a point of a list is."""
    return "\n".join(
        textwrap.fill(
            line,
            width,
            subsequent_indent="  " if line.startswith(("- ", "  ")) else "",
        )
        for line in lines
        if line.strip()
    )


def _shown(table: Table, width: int) -> str:
    """A table as text; sets of effects go on in the next row where there is no room."""
    rows = [
        [one.text if isinstance(one, Cell) else one for one in row]
        for row in table.rows
    ]
    sizes = [max(map(len, column)) for column in zip(table.heads, *rows, strict=True)]
    if sum(sizes) + len(GAP) * (len(sizes) - 1) > width:
        rows = [part for row in rows for part in _stacked(row)]
    return text_table(table.caption, table.heads, rows, text_columns=table.text_columns)


def _stacked(row: Sequence[str]) -> list[list[str]]:
    first, *others = row[0].split(AND)
    blank = [""] * (len(row) - 1)
    return [[first, *row[1:]], *([f"  + {one}", *blank] for one in others)]
