"""Tables and sentences of a diagnosis: what the screen and the page of the report show alike."""

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
from hwid_cli.report.page import Table
from hwid_cli.report.parameter_names import quantity_and_unit
from hwid_cli.report.text_table import MISSING, number

# Joins the effects of a candidate.
AND = " + "
NO_EFFECT = "no effect added"


def candidate_name(effects: Sequence[str]) -> str:
    """Name a set of effects.

    Parameters
    ----------
    effects : sequence of str
        Ids.

    Returns
    -------
    str

    Examples
    --------
    >>> candidate_name(["cogging", "second_mode"]), candidate_name([])
    ('cogging + second_mode', 'no effect added')
    """
    return AND.join(effects) or NO_EFFECT


def is_chosen(candidate: RankedCandidate, diagnosis: Diagnosis) -> bool:
    """Say whether a candidate is what the diagnosis names.

    Parameters
    ----------
    candidate : RankedCandidate
    diagnosis : Diagnosis

    Returns
    -------
    bool
    """
    found = {effect.id for effect in diagnosis.effects}
    return bool(found) and set(candidate.effects) == found


# Where something else remains, an effect also takes up some of that.
INTERVALS_OF_A_PART = "intervals hold as if nothing else were missing"


def effects_table(diagnosis: Diagnosis) -> Table:
    """Show the parameters of the effects that the simulation lacks.

    Parameters
    ----------
    diagnosis : Diagnosis

    Returns
    -------
    Table
    """
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

    Parameters
    ----------
    diagnosis : Diagnosis

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

    Parameters
    ----------
    diagnosis : Diagnosis

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
    diagnosis : Diagnosis
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
    """Show the gap in every recording.

    Parameters
    ----------
    diagnosis : Diagnosis

    Returns
    -------
    Table
    """
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
    """Say what the data cannot tell apart, what to measure next, what nothing shows.

    Parameters
    ----------
    diagnosis : Diagnosis

    Returns
    -------
    list of str
    """
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
    """Say how much of the gap the effects explain.

    Parameters
    ----------
    diagnosis : Diagnosis

    Returns
    -------
    str
    """
    share = percent(diagnosis.explained_share)
    return f"Explained: {share} of the excess over the noise, held-out recordings."


def percent(share: float) -> str:
    """Write a share in percent with one decimal.

    Parameters
    ----------
    share : float, [-]

    Returns
    -------
    str

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
