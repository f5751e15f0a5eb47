"""A diagnosis as tables and sentences, and all that the screen shows of it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.records.axis import unit_of_effect, unit_on
from hwid_cli.records.candidates import CAUSES
from hwid_cli.records.diagnosis import (
    SMALL_REMAINDER,
    BaseParameter,
    Diagnosis,
    FittedEffect,
    FittedParameter,
    Gap,
    Law,
    RankedCandidate,
)
from hwid_cli.records.drive import BASE_AND_MASS, DriveResponse
from hwid_cli.records.units import behind
from hwid_cli.report.formats import MISSING, counted, decimals, listed, number
from hwid_cli.report.table import Column, Heading, Table, Text, numbers, texts

# What a unit in a name is made of.
_UNITS = {"N", "m", "kg", "A", "V", "H", "ohm", "s", "Hz", "rad", "deg"}
_PER = "per"
# Recordings whose factors are listed.
_MOST_FACTORS = 12


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


def missing_force(diagnosis: Diagnosis) -> tuple[str, str]:
    """What a simulation lacks, in words, and its unit: a torque on an angle."""
    unit = unit_on(diagnosis.axis, diagnosis.units.force)
    return "torque F" if unit == "N m" else "force F", unit


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


# No measurement tells more, [-].
_MOST_DIGITS = 9
# Where something else remains, an effect also takes up some of that.
INTERVALS_OF_A_PART = "intervals hold as if nothing else were missing"


def effects_table(diagnosis: Diagnosis) -> Table:
    """Show the parameters of the effects that the simulation lacks."""
    rows = []
    for effect in diagnosis.effects:
        name = effect.id
        for parameter in effect.parameters:
            quantity, unit = _told_as(diagnosis, effect, parameter)
            value = parameter.text or _value(parameter.value, parameter.name)
            rows.append((name, quantity, value, _interval(parameter), unit))
            name = ""
    title = "Effects that the simulation lacks"
    if rows and not diagnosis.complete:
        title += f"; {INTERVALS_OF_A_PART}"
    columns = (
        *texts("effect", "parameter"),
        *numbers("value", "95 % interval"),
        *texts("unit"),
    )
    return Table(title, columns, tuple(rows))


def _told_as(
    diagnosis: Diagnosis, effect: FittedEffect, parameter: FittedParameter
) -> tuple[str, str]:
    """Quantity of an effect's parameter in words, and its unit on this axis."""
    quantity, unit = quantity_and_unit(parameter.name)
    return quantity, parameter.unit or unit_of_effect(
        effect.id,
        unit,
        axis=diagnosis.axis,
        output=diagnosis.output,
        units=diagnosis.units,
    )


def _base_told_as(name: str) -> tuple[str, str]:
    """Quantity of a parameter of the simulation, and its unit where the name tells it.

    In a name of the user's ``flexure_N_m`` may be a torque or a spring.
    """
    quantity, unit = quantity_and_unit(name)
    is_told = name in BASE_AND_MASS or " " not in unit or "/" in unit
    return (quantity, unit) if is_told else (name, "-")


def _interval(parameter: FittedParameter | BaseParameter) -> str:
    bounds = (parameter.low, parameter.high)
    if not np.isfinite(bounds).all():
        return MISSING
    return shown_interval(parameter.low, parameter.high, parameter.name)


def gap_table(diagnosis: Diagnosis) -> Table:
    """Show the gap between simulation and measurement, step by step.

    Returns
    -------
    Table
        The last row, with the effects, only where there are any.
    """
    steps = [
        ("as given", diagnosis.given),
        ("base re-fitted", diagnosis.refitted),
        ("with the effects", diagnosis.after),
    ]
    unit = diagnosis.output_unit
    notes = [explained_sentence(diagnosis)] if diagnosis.effects else []
    if diagnosis.confirmed == "surrogate":
        notes.append(_OF_STAND_IN)
    if says_what_was_run(diagnosis):
        notes.append(_OF_SIMULATION)
    if diagnosis.noise.sentence:
        notes.append(f"What counts as noise: {diagnosis.noise.sentence}.")
    return Table(
        f"Gap between simulation and measurement; noise {number(diagnosis.noise.rms)}"
        f"{behind(unit)}",
        (
            *texts("simulation"),
            *numbers(
                f"train RMS [{unit}]", f"held-out RMS [{unit}]", "held-out / noise"
            ),
        ),
        tuple(_gap_row(*step) for step in steps[: 3 if diagnosis.effects else 2]),
        tuple(notes),
    )


def says_what_was_run(diagnosis: Diagnosis) -> bool:
    """Whether a simulation of the user's own was run with effects in it."""
    is_run = diagnosis.is_foreign and diagnosis.confirmed == "simulation"
    return is_run and bool(diagnosis.effects)


def _gap_row(label: str, gap: Gap) -> tuple[str, ...]:
    values = number(gap.train_rms), number(gap.held_out_rms)
    return (label, *values, _ratio(gap.ratio_to_noise))


@dataclass(frozen=True)
class Moved:
    """A parameter of the simulation, of its base or of an effect that it has.

    Parameters
    ----------
    before, refitted, after : float, [unit]
        As given; fitted without further effects; fitted with them.
    interval : str
        95 % interval of the last.
    """

    quantity: str
    unit: str
    before: float
    refitted: float
    after: float
    interval: str = MISSING


def moved_parameters(diagnosis: Diagnosis) -> list[Moved]:
    """List the parameters of the simulation, the base first."""
    moved = [
        Moved(
            *_base_told_as(one.name),
            one.before,
            one.refitted,
            one.after,
            _interval(one),
        )
        for one in diagnosis.base
    ]
    for effect in diagnosis.present:
        for parameter in effect.parameters:
            quantity, unit = _told_as(diagnosis, effect, parameter)
            steps = (parameter.before, parameter.refitted, parameter.value)
            if np.isfinite(steps).all():
                name = f"{effect.id}: {quantity}"
                moved.append(Moved(name, unit, *steps, _interval(parameter)))
    return moved


def base_table(diagnosis: Diagnosis) -> Table:
    """Show the parameters of the simulation as given and as fitted.

    Returns
    -------
    Table
        Base first, then the effects that it has; the last column but the unit is how far
        the last fit moved each of them.
    """
    steps = ["given", "re-fitted", "with the effects"][: 3 if diagnosis.effects else 2]
    rows = []
    for one in moved_parameters(diagnosis):
        values = [one.before, one.refitted, one.after][: len(steps)]
        shift = _shift(one.before, values[-1])
        row = (one.quantity, *map(_value, values), shift, one.interval, one.unit)
        rows.append(row)
    columns = (
        *texts("parameter"),
        *numbers(*steps, "shift", "95 % interval"),
        *texts("unit"),
    )
    caption = "Parameters of the simulation; shift and interval: of the last"
    return Table(caption, columns, tuple(rows))


def _shift(given: float, fitted: float) -> str:
    if given == 0.0 or not np.isfinite(fitted / given):
        return MISSING
    return f"{100.0 * (fitted / given - 1.0):+.1f} %"


def is_chosen(candidate: RankedCandidate) -> bool:
    """Say whether a candidate is what the diagnosis names."""
    return bool(candidate.effects) and candidate.role == "diagnosis"


_OF_SIMULATION = (
    "The last row is of your simulation itself, run with the effects in it "
    "(confirmed: simulation)."
)
_OF_STAND_IN = (
    "Below 'as given' stands what a drive in the place of the simulation leaves "
    "(confirmed: surrogate); the simulation itself was not run so."
)
_NOT_FITTED = (
    f"{MISSING}: left after its first iterations, where others were better; or not needed, "
    "because what it includes leaves only noise."
)


def ranking_table(diagnosis: Diagnosis, *, count: int | None = None) -> Table:
    """Show the candidates, the largest gain of the criterion first.

    Parameters
    ----------
    count : int or None, [-]
        How many, and the diagnosis where it ranks below them; None for all.

    Returns
    -------
    Table
        What was not fitted has a forecast only.
    """
    has_noise = diagnosis.noise.rms > 0.0
    shown = [
        one
        for rank, one in enumerate(diagnosis.candidates)
        if count is None or rank < count or is_chosen(one)
    ]
    rows = []
    for one in shown:
        error = one.held_out_rms
        rows.append(
            (
                candidate_name(one.effects) + "*" * is_chosen(one),
                percent(one.forecast_share),
                _ratio(error / diagnosis.noise.judging_rms)
                if has_noise
                else number(error),
                percent(one.explained_share),
                percent(one.improved_share),
                decimals(one.bic_gain, 0),
                one.note,
            )
        )
    mark = " (* the diagnosis)" if diagnosis.effects else ""
    left = [one for one in shown if np.isnan(one.held_out_rms)]
    heads = (
        "forecast",
        "held-out/noise" if has_noise else f"RMS [{diagnosis.output_unit}]",
        "explained",
        "improved",
        "BIC gain",
    )
    return Table(
        f"Candidates, the largest gain of the criterion (BIC) first{mark}; forecast, explained "
        "and improved are shares of the error, of its excess over the noise, and of the "
        "recordings",
        (
            Column("added to the simulation", is_text=True, joint=AND),
            *numbers(*heads),
            Column("note", is_text=True, is_detail=True),
        ),
        tuple(rows),
        (_NOT_FITTED,) if left else (),
    )


def recordings_table(diagnosis: Diagnosis) -> Table:
    """Show the gap in every recording."""
    heads = ["given", "re-fitted", "with the effects"]
    heads = heads if diagnosis.effects else heads[:-1]
    changing = _changing(diagnosis)
    heads += [f"{changing} over its mean"] if changing else []
    rows = []
    for one in diagnosis.gaps:
        values = [one.rms_given, one.rms_before, one.rms_after]
        if not diagnosis.effects:
            values.pop()
        use = "validation" if one.is_held_out else "training"
        factor = [f"{one.factor:.3f}"] if changing else []
        rows.append((one.name, one.kind, use, *map(number, values), *factor))
    return Table(
        f"RMS gap of every recording [{diagnosis.output_unit}]",
        (
            *texts("recording", "kind", "used for"),
            *numbers(*heads),
        ),
        tuple(rows),
    )


def _change_sentences(diagnosis: Diagnosis) -> list[str]:
    """Say what the parameter that differs is in every recording, the largest first."""
    changing = _changing(diagnosis)
    gaps = sorted(diagnosis.gaps, key=lambda one: -one.factor)
    if not changing or not gaps or not np.isfinite(gaps[0].factor):
        return []
    told = [f"{one.name} {one.factor:.3f}" for one in gaps[:_MOST_FACTORS]]
    rest = "; all in gaps.csv" if len(gaps) > _MOST_FACTORS else ""
    return [f"The {changing} over its mean: {', '.join(told)}{rest}."]


def _changing(diagnosis: Diagnosis) -> str:
    """Which parameter differs between recordings; empty where none does."""
    which = (
        one.text
        for effect in diagnosis.effects
        if effect.id == "parameter_change"
        for one in effect.parameters
        if one.text
    )
    return next(which, "")


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
    elif following.reason and diagnosis.verdict in ("ambiguous", "unknown"):
        lines.append(f"Next experiment: none; {following.reason.strip().rstrip('.')}.")
    if diagnosis.not_observable:
        names = "; ".join(one.rstrip(".") for one in diagnosis.not_observable)
        lines.append(f"Cannot be seen in these recordings: {names}.")
    return lines


def warning_sentences(warnings: Sequence[str]) -> list[str]:
    """Say what must be checked before the rest is believed."""
    return [f"Warning: {one}." for one in warnings]


def law_table(law: Law) -> Table:
    """Show the terms of a law, the largest first."""
    rows = tuple(
        (
            one.term,
            _value(one.value),
            _interval(FittedParameter("", one.value, one.low, one.high)),
            one.unit,
            percent(one.inclusion),
        )
        for one in law.terms
    )
    columns = (
        *texts("term"),
        *numbers("coefficient", "95 % interval"),
        *texts("unit"),
        *numbers("chosen again"),
    )
    return Table(f"Terms of the law (it acts on the {law.acts_on})", columns, rows)


def explained_sentence(diagnosis: Diagnosis) -> str:
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


def _value(value: float, name: str = "") -> str:
    return shown_value(value, name) if np.isfinite(value) else MISSING


def shown_value(value: float, name: str = "") -> str:
    """Write the value of a parameter.

    Parameters
    ----------
    name : str
        Of the parameter: of two clocks each millionth of their ratio counts.

    Examples
    --------
    >>> shown_value(0.81234, "force_N"), shown_value(1.00012, "ratio")
    ('0.8123', '1.000120')
    """
    return f"{value:.6f}" if name == "ratio" else f"{value:.4g}"


def shown_interval(low: float, high: float, name: str = "") -> str:
    """Write an interval, with more digits where its ends would read alike.

    Parameters
    ----------
    name : str
        Of the parameter.

    Examples
    --------
    >>> shown_interval(0.79737, 0.80052), shown_interval(3.199871, 3.200122)
    ('0.7974 to 0.8005', '3.1999 to 3.2001')
    """
    ends = [shown_value(one, name) for one in (low, high)]
    digits = 5
    while ends[0] == ends[1] and low < high and digits < _MOST_DIGITS:
        ends = [f"{one:.{digits}g}" for one in (low, high)]
        digits += 1
    return " to ".join(ends)


def _ratio(value: float) -> str:
    # Close to 1 each thousandth tells whether something remains.
    digits = 3 if value < 10.0 else 1
    return f"{value:.{digits}f}" if np.isfinite(value) else MISSING


def simulated_table(curves: Sequence[DriveResponse], side: str, unit: str) -> Table:
    """Show how far a simulation is from the measurements.

    Parameters
    ----------
    side : str
        What the two are compared by: output, or input in a closed loop.
    unit : str
        Of that side.
    """
    columns = (*texts("recording"), *numbers(f"RMS [{unit}]"))
    rows = tuple((one.name, number(one.rms)) for one in curves)
    return Table(f"RMS of measured minus simulated {side}", columns, rows)


# Candidates and places that the screen shows.
_MOST_SHOWN = 5
# Verdicts that need no effect, so that little has to be said.
_SHORT = ("none", "parameters")


def leaves_little(diagnosis: Diagnosis) -> bool:
    """Whether what stays unexplained is hardly more than the noise."""
    return diagnosis.after.ratio_to_noise <= SMALL_REMAINDER


def verdict_sentence(diagnosis: Diagnosis) -> str:
    """Say the verdict in a few words."""
    line = f"Verdict: {diagnosis.verdict}"
    if diagnosis.effects:
        names = candidate_name([effect.id for effect in diagnosis.effects])
        rest = "complete"
        if not diagnosis.complete:
            rest = (
                "little more than the noise remains"
                if leaves_little(diagnosis)
                else "a part stays unexplained"
            )
            if diagnosis.remains:
                rest = f"what remains is {CAUSES[diagnosis.remains].split(',')[0]}"
        named = "" if names == diagnosis.verdict else f", {names}"
        line += f"{named} ({rest})"
    return line


def effect_sentences(diagnosis: Diagnosis) -> list[str]:
    """Say what each effect does, where the summary has not, and its law."""
    found = []
    for effect in diagnosis.effects:
        if effect.sentence not in diagnosis.summary:
            found.append(f"{effect.id}: {effect.sentence}")
        whose = "" if effect.id == diagnosis.verdict else f" of {effect.id}"
        found.append(f"Law{whose}: {effect.equation}")
    return found


def used_sentence(diagnosis: Diagnosis, tests: Sequence[str] = ()) -> str:
    """Say what the effects were fitted to and validated on.

    Parameters
    ----------
    tests : sequence of str
        Recordings of the final test of models: a diagnosis holds out its own.
    """
    text = (
        f"Trained on {counted(len(diagnosis.train), 'recording')}, validated on "
        f"{counted(len(diagnosis.held_out), 'recording')} held out."
    )
    trained = [one for one in tests if one in diagnosis.train]
    if trained:
        text += (
            f" Among those trained on: {listed(trained)} of test.recordings, kept away "
            "from models only; diagnose.recordings says which are used."
        )
    return text


def diagnosis_blocks(
    diagnosis: Diagnosis, tests: Sequence[str] = ()
) -> list[Text | Heading | Table]:
    """Collect what the screen shows of a diagnosis: little where nothing is missing.

    Parameters
    ----------
    tests : sequence of str
        Recordings of the final test of models.
    """
    is_short = diagnosis.verdict in _SHORT
    sentences = [verdict_sentence(diagnosis), diagnosis.summary]
    sentences += warning_sentences(diagnosis.warnings)
    sentences += [used_sentence(diagnosis, tests), *effect_sentences(diagnosis)]
    blocks: list[Text | Heading | Table] = [
        Text(one) for one in sentences if one.strip()
    ]
    if diagnosis.law is not None:
        blocks += [Text(f"Formula: {diagnosis.law.formula}"), law_table(diagnosis.law)]
    elif diagnosis.effects:
        blocks.append(effects_table(diagnosis))
        blocks += [Text(one) for one in _change_sentences(diagnosis)]
    blocks.append(gap_table(diagnosis))
    if not is_short and diagnosis.places:
        places = [Text(f"- {one.sentence}") for one in diagnosis.places[:_MOST_SHOWN]]
        blocks += [Heading("Where the error sits"), *places]
    if diagnosis.base and diagnosis.verdict != "none":
        blocks.append(base_table(diagnosis))
    blocks += [Text(one) for one in closing_sentences(diagnosis)]
    if not is_short and diagnosis.candidates:
        blocks.append(ranking_table(diagnosis, count=_MOST_SHOWN))
    return blocks
