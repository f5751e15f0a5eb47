"""The answer of a diagnosis: what the simulation lacks, how much, and how much it helps."""

from collections.abc import Mapping
from math import floor, isfinite, isnan, log10
from typing import Any

import numpy as np

from hwid_cli.records.axis import unit_of_effect
from hwid_cli.records.candidates import CAUSES
from hwid_cli.records.diagnosis import (
    STILL_LARGE,
    Diagnosis,
    FittedEffect,
    FittedParameter,
    Gap,
    LatentForce,
    Overlay,
)
from hwid_cli.records.report import ReportContents
from hwid_cli.report.charts import (
    Chart,
    Curve,
    Panel,
    thinned,
    thinned_note,
    thinned_places,
    thinning,
)
from hwid_cli.report.diagnosis import (
    leaves_little,
    missing_force,
    moved_parameters,
    quantity_and_unit,
    says_what_was_run,
    shown_value,
    warning_sentences,
)
from hwid_cli.report.dots import Dot, DotGroup, DotRow, Dots
from hwid_cli.report.figures.diagnosis_curves import telling_stretch
from hwid_cli.report.formats import counted, listed, percent, with_unit
from hwid_cli.report.page import Answer, PageBlock, marked_if_changed

_QUESTION = "What does the simulation lack?"
# Names that begin with a capital letter.
_PROPER = {"coulomb": "Coulomb", "stribeck": "Stribeck"}
# Height of the charts beside the verdict, [pixels], and points of their curves.
_HEIGHT, _MOST_POINTS = 170, 2000
# A simulation so many times beyond the measurement is not drawn, [-].
_ASTRAY = 1e2
_SETTLED = ("named", "parameters", "none")


def effect_name(effect: str) -> str:
    """Name an effect as people do.

    Examples
    --------
    >>> effect_name("coulomb_friction"), effect_name("input_dead_zone")
    ('Coulomb friction', 'input dead zone')
    """
    words = effect.replace("+", " with ").split("_")
    return " ".join(_PROPER.get(word, word) for word in words)


def diagnosis_answer(contents: ReportContents) -> Answer | None:
    """Say in a sentence what is missing, with its size and interval."""
    record, stored = contents.stored.diagnosis_record, contents.stored.diagnosis
    if record is None:
        if stored is None:
            return None
        return marked_if_changed(_answer_of_json(stored), contents, ("diagnose",))
    return marked_if_changed(_answer_of_record(record), contents, ("diagnose",))


def _answer_of_record(record: Diagnosis) -> Answer:
    blocks: list[PageBlock] = [_gaps(record)]
    forces = [one for one in record.latent_force if one.at.size]
    if forces:
        blocks.append(force_chart(forces[0], record, height_px=_HEIGHT))
    overlays = [one for one in record.overlays if one.measured.size]
    if overlays:
        blocks.append(overlay_chart(overlays[0], record, is_small=True))
    return Answer(
        _QUESTION,
        verdict_in_words(record),
        is_settled=record.verdict in _SETTLED
        and (record.complete or record.verdict != "named"),
        details=(
            _gap_in_words(record),
            *_of_measuring(record),
            *warning_sentences(record.warnings),
        ),
        blocks=tuple(blocks),
        next_steps=_next(record),
    )


def verdict_in_words(diagnosis: Diagnosis) -> str:
    """Write the verdict as a sentence, effects with values and 95 % intervals."""
    found = [_effect_in_words(one, diagnosis) for one in diagnosis.effects]
    if diagnosis.verdict == "named" and diagnosis.after.ratio_to_noise > STILL_LARGE:
        verb = "explains" if len(found) == 1 else "explain"
        share = f"{100 * diagnosis.explained_share:.3g} %"
        remains = CAUSES.get(diagnosis.remains, "not explained")
        text = f"{listed(found)} {verb} {share} of the gap; what remains is {remains}."
        return text[:1].upper() + text[1:]
    if diagnosis.verdict == "named" and found:
        return f"The simulation lacks {listed(found)}.{_rest(diagnosis)}"
    if diagnosis.verdict == "ambiguous" and found:
        others = [effect_name(one) for one in diagnosis.ambiguous_with]
        return (
            f"The simulation lacks {listed(found)}, or instead {' or '.join(others)}: these "
            "recordings cannot tell them apart."
        )
    if diagnosis.verdict == "parameters":
        return f"No effect is missing: parameters were off{_largest_shift(diagnosis)}."
    if diagnosis.verdict == "unknown":
        return "Something is missing that no known effect explains."
    if diagnosis.verdict == "none":
        return "Nothing is missing: the simulation agrees with the measurements up to their noise."
    return diagnosis.summary


def _of_measuring(diagnosis: Diagnosis) -> tuple[str, ...]:
    """What measuring has added, where no effect is missing."""
    is_nothing = diagnosis.verdict in ("parameters", "none")
    if not (is_nothing and diagnosis.remains in CAUSES):
        return ()
    return (f"What is left is {CAUSES[diagnosis.remains]}.",)


def _rest(diagnosis: Diagnosis) -> str:
    """What stays unexplained beside the effects; empty for nothing."""
    if diagnosis.complete:
        return ""
    if diagnosis.remains:
        return f" What remains is {CAUSES[diagnosis.remains]}."
    if leaves_little(diagnosis):
        return " Little more than the noise remains."
    return " A part of the gap stays unexplained."


def _effect_in_words(effect: FittedEffect, diagnosis: Diagnosis) -> str:
    """``Coulomb friction: 0.799 N [0.797, 0.801]``."""
    values = []
    for one in effect.parameters:
        quantity, unit = quantity_and_unit(one.name)
        unit = unit_of_effect(
            effect.id,
            unit,
            axis=diagnosis.axis,
            output=diagnosis.output,
            units=diagnosis.units,
        )
        name = f"{quantity} " if len(effect.parameters) > 1 else ""
        values.append(f"{name}{value_with_interval(one, unit)}")
    name = effect_name(effect.id)
    return f"{name}: {', '.join(values)}" if values else name


def value_with_interval(one: FittedParameter, unit: str) -> str:
    """Write a value with as many digits as its interval allows.

    Examples
    --------
    >>> value_with_interval(FittedParameter("ratio", 0.79894, 0.79737, 0.80052), "-")
    '0.799 [0.797, 0.801]'
    >>> value_with_interval(FittedParameter("which", float("nan"), text="stiffness"), "-")
    'stiffness'
    >>> value_with_interval(FittedParameter("force_N", 0.7989), "-")
    '0.7989 (not told)'
    """
    if one.text:
        return one.text
    behind = "" if unit in ("-", "") else f"\N{NO-BREAK SPACE}{unit}"
    if not (isfinite(one.low) and isfinite(one.high) and one.high > one.low):
        value = shown_value(one.value, one.name) if isfinite(one.value) else "unknown"
        # The recordings leave it open; a warning says beside what.
        untold = " (not told)" if isfinite(one.value) and isnan(one.low) else ""
        return f"{value}{behind}{untold}"
    # The first digit of half the interval is the last one of all three that says something.
    half = 0.5 * (one.high - one.low)
    digits = -floor(log10(half))
    largest = max(abs(one.value), abs(one.low), abs(one.high))
    if digits > 6 or largest >= 1e6:
        shown = [f"{number:.4g}" for number in (one.value, one.low, one.high)]
    else:
        shown = [
            f"{round(number, digits):.{max(0, digits)}f}"
            for number in (one.value, one.low, one.high)
        ]
    return f"{shown[0]}{behind} [{shown[1]}, {shown[2]}]"


def _largest_shift(diagnosis: Diagnosis) -> str:
    """The parameter that moved most, in words."""
    moved = [
        (abs(one.refitted / one.before - 1.0), one)
        for one in moved_parameters(diagnosis)
        if one.before != 0.0 and isfinite(one.refitted / one.before)
    ]
    if not moved:
        return ""
    _, most = max(moved, key=lambda pair: pair[0])
    behind = "" if most.unit == "-" else f"\N{NO-BREAK SPACE}{most.unit}"
    share = 100.0 * (most.refitted / most.before - 1.0)
    return (
        f", most of all the {most.quantity}: {most.before:.4g} given, {most.refitted:.4g}{behind} "
        f"fitted ({share:+.1f}\N{NO-BREAK SPACE}%)"
    )


def _steps(diagnosis: Diagnosis) -> list[tuple[str, str, Gap]]:
    """Name, role and gap of the simulation as given, re-fitted, and with the effects."""
    steps = [
        ("as given", "given", diagnosis.given),
        ("re-fitted", "refitted", diagnosis.refitted),
    ]
    if diagnosis.effects:
        names = [effect_name(one.id) for one in diagnosis.effects]
        name = f"with {names[0]}" if len(names) == 1 else f"with {len(names)} effects"
        steps.append((name, "extended", diagnosis.after))
    return steps


def _has_noise(diagnosis: Diagnosis) -> bool:
    return isfinite(diagnosis.noise.judging_rms) and diagnosis.noise.judging_rms > 0.0


def _rms(gap: Gap, diagnosis: Diagnosis) -> float:
    return gap.held_out_rms if diagnosis.held_out else gap.train_rms


def _gap_in_words(diagnosis: Diagnosis) -> str:
    """How the gap falls, and on what."""
    count = len(diagnosis.held_out)
    on = (
        f"{counted(count, 'recording')} that {'was' if count == 1 else 'were'} never "
        "trained on"
        if count
        else "the recordings of the fit (none was held out)"
    )
    arrow = " \N{RIGHTWARDS ARROW} "
    gaps = [gap for _, _, gap in _steps(diagnosis)]
    if _has_noise(diagnosis):
        way = arrow.join(f"{gap.ratio_to_noise:.3g}" for gap in gaps)
        text = f"Gap on {on}: {way} times the noise"
    else:
        unit = diagnosis.output_unit
        way = arrow.join(with_unit(_rms(gap, diagnosis), unit) for gap in gaps)
        text = f"Gap on {on}: {way}"
    if diagnosis.effects and isfinite(diagnosis.explained_share):
        text += f"; explained: {percent(100 * diagnosis.explained_share)} of the excess"
    text += "."
    if diagnosis.effects and diagnosis.confirmed == "surrogate":
        text += " A linear stand-in was run with the effect, not the simulation itself."
    if says_what_was_run(diagnosis):
        text += " The simulation itself was run with the effect."
    return text


def _gaps(diagnosis: Diagnosis) -> Dots:
    """The gap before and after, beside the noise."""
    has_noise, unit = _has_noise(diagnosis), diagnosis.output_unit
    rows = []
    for name, role, gap in _steps(diagnosis):
        value = gap.ratio_to_noise if has_noise else _rms(gap, diagnosis)
        told = (
            f"{value:.3g} \N{MULTIPLICATION SIGN}"
            if has_noise
            else with_unit(value, unit)
        )
        rows.append(
            DotRow(name, (Dot(value, role, told),), told, is_bold=role == "extended")
        )
    on = "held-out recordings" if diagnosis.held_out else "recordings of the fit"
    noise = with_unit(diagnosis.noise.judging_rms, unit)
    return Dots(
        label="RMS gap over noise [-]" if has_noise else f"RMS gap [{unit}]",
        groups=(DotGroup("", tuple(rows)),),
        sentence=f"Gap on {on}" + (f"; dashed: noise, {noise}." if has_noise else "."),
        alt=f"Gap on {on}: {'; '.join(f'{row.name} {row.text}' for row in rows)}",
        reference=(1.0, f"noise {noise}") if has_noise else None,
        is_log=True,
        is_bar=True,
        is_narrow=True,
    )


def force_chart(
    force: LatentForce, diagnosis: Diagnosis, *, height_px: int = 230
) -> Chart:
    """The force that the simulation lacks over a variable, with the law drawn in."""
    what, unit = missing_force(diagnosis)
    low, high = force.mean - force.spread, force.mean + force.spread
    curves = [
        Curve("spread, \N{PLUS-MINUS SIGN}1 sd", low, "noise", "band", upper=high),
        Curve("from measurements", force.mean, "estimate", "line+points"),
    ]
    law = ""
    if force.law.size == force.at.size:
        curves.append(Curve("with the effects", force.law, "law"))
        law = " with its law"
    return Chart(
        name=f"missing force over {force.variable}",
        at=force.at,
        label=f"{force.variable} [{force.unit}]",
        panels=(
            Panel(f"missing {what} [{unit}]", tuple(curves), height_px, lines=(0.0,)),
        ),
        sentence=f"Missing {what.split()[0]} over the {force.variable}{law}.",
        alt=f"Missing {what.split()[0]} over the {force.variable} with its law",
        has_gaps_closed=True,
    )


def overlay_chart(
    one: Overlay, diagnosis: Diagnosis, *, is_small: bool = False
) -> Chart:
    """A recording, measured and simulated before and after, where the simulation fails."""
    first, end = telling_stretch(one)
    size = one.measured.size
    chosen = thinning(
        size, _MOST_POINTS, (first, end) if end - first < size else (0, 0)
    )
    places = thinned_places(chosen)
    at = np.interp(places, np.arange(size), one.time_s)
    most = _ASTRAY * max(float(np.nanmax(np.abs(one.measured))), np.finfo(float).tiny)
    runs = [("re-fitted", "refitted", one.before)]
    if diagnosis.effects:
        runs.append(("with the effects", "extended", one.after))
    outputs = [Curve("measured", thinned(one.measured, chosen), "measured")]
    left: list[Curve] = []
    if isfinite(one.noise_rms) and one.noise_rms > 0.0:
        band = np.full(at.size, 2.0 * one.noise_rms)
        label = "noise, \N{PLUS-MINUS SIGN}2 sd"
        left.append(Curve(label, -band, "noise", "band", upper=band))
    for name, role, output in runs:
        with np.errstate(invalid="ignore"):
            usable = np.where(np.abs(output) < most, output, np.nan)
        outputs.append(Curve(name, thinned(usable, chosen), role, model=name))
        residual = thinned(one.measured - usable, chosen)
        left.append(Curve(name, residual, role, model=name))
    unit = diagnosis.output_unit
    height = (_HEIGHT if is_small else 240, 150)
    panels = [
        Panel(f"{diagnosis.compared} [{unit}]", tuple(outputs), height[0]),
        Panel(f"residual e [{unit}]", tuple(left), height[1], lines=(0.0,)),
    ]
    window = (float(one.time_s[first]), float(one.time_s[end - 1]))
    whole = end - first >= size
    where = "" if whole else ", where the simulation fails most (All: the rest)"
    kind = "held out" if one.name in diagnosis.held_out else "trained on"
    return Chart(
        name=one.name,
        at=at,
        label="time t [s]",
        panels=tuple(panels[:1] if is_small else panels),
        sentence=f"{one.name} ({kind}): measured and simulated{where}.{thinned_note(chosen)}",
        alt=f"Measured and simulated output of {one.name} over time",
        window=None if whole else window,
        detail=None if whole else window,
    )


def _next(diagnosis: Diagnosis) -> tuple[tuple[str, str], ...]:
    steps = []
    following = diagnosis.next_experiment
    if following.input:
        reason = following.reason.strip().rstrip(".")
        steps.append(
            (f"Measure: {following.input.strip().rstrip('.')} ({reason}).", "")
        )
    elif following.reason and diagnosis.verdict in ("ambiguous", "unknown"):
        reason = following.reason.strip().rstrip(".")
        steps.append((f"No recording is proposed: {reason}.", ""))
    if diagnosis.verdict in ("named", "parameters", "ambiguous"):
        steps.append(
            (
                "Go on with the corrected simulation, written beside this page:",
                "extended_simulation.yaml",
            )
        )
    if diagnosis.verdict == "unknown":
        steps.append(
            (
                "Add a candidate of your own (diagnose.own_effects), and run",
                "hwid diagnose CONFIG",
            )
        )
    return tuple(steps)


def _answer_of_json(found: Mapping[str, Any]) -> Answer:
    """The answer of results that left ``diagnosis.json`` only."""
    verdict = str(found.get("verdict", "unknown"))
    summary = str(found.get("summary") or f"Verdict: {verdict}.")
    return Answer(_QUESTION, summary, is_settled=verdict in _SETTLED)
