"""Section about the diagnosis: with its figures, or from ``diagnosis.json`` alone."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hwid_cli.records.axis import units_note
from hwid_cli.records.diagnosis import Diagnosis, Place, RecordingGap
from hwid_cli.records.report import ReportContents
from hwid_cli.report.diagnosis import (
    INTERVALS_OF_A_PART,
    base_table,
    candidate_name,
    closing_sentences,
    effect_sentences,
    effects_table,
    gap_table,
    is_chosen,
    ranking_table,
    recordings_table,
    shown_interval,
    shown_value,
    used_sentence,
    warning_sentences,
)
from hwid_cli.report.dots import Dot, DotGroup, DotRow, Dots
from hwid_cli.report.figures.diagnosis import figure_makers
from hwid_cli.report.figures.diagnosis_bars import (
    PLACES,
    shown_candidates,
    shown_places,
)
from hwid_cli.report.formats import (
    MISSING,
    counted,
    listed,
    share_text,
    with_unit,
)
from hwid_cli.report.page import (
    Collapsible,
    Drawing,
    PageBlock,
    Picker,
    Row,
    Section,
)
from hwid_cli.report.sections.diagnosis_answer import (
    diagnosis_answer,
    force_chart,
    overlay_chart,
)
from hwid_cli.report.table import Heading, Table, Text, numbers, texts

# Places that are told in words, and recordings that are called the worst.
_MOST_PLACES, _MOST_NAMED = 5, 3
# Variables whose forces are drawn, and the lowest share that has room on the axis, [%].
_MOST_FORCES, _LOWEST = 3, -20.0
_VERDICTS = {
    "named": "The gap between simulation and measurement has a name.",
    "law": "What is missing is not in the catalogue, but a formula describes it.",
    "ambiguous": "Several effects explain the gap equally well.",
    "parameters": "No effect is missing: the simulation's parameters were off.",
    "unknown": "There is a gap that no known effect explains.",
    "none": "There is no gap beyond the noise.",
}


def diagnosis_section(contents: ReportContents) -> Section:
    """Show the verdict, the effects with their parameters, and the gap."""
    found, record = contents.stored.diagnosis, contents.stored.diagnosis_record
    blocks: list[PageBlock] = []
    if record is not None:
        blocks += _record_blocks(record)
    elif found is not None:
        blocks += [Text(line) for line in _sentences(found)]
        effects = _effects_table(
            _items(found, "effects"),
            is_all=found.get("complete") is True,
            note=units_note(
                axis=str(found.get("axis")), output=str(found.get("output"))
            ),
        )
        blocks += [table for table in (effects, _gap_table(found)) if table is not None]
        where = [
            str(one.get("sentence") or one.get("variable", ""))
            for one in _items(found, "where")
        ]
        blocks += [Text(text) for text in where if text]
        following = found.get("next_experiment")
        if isinstance(following, Mapping) and following:
            text = f"Next experiment: {following.get('input') or 'none'}"
            reason = following.get("reason")
            blocks.append(Text(f"{text} - {reason}" if reason else text))
    title = "Diagnosis of the simulation"
    missing = (
        "" if blocks else "no simulation was diagnosed: run 'hwid diagnose CONFIG'."
    )
    return Section("diagnosis", title, "Diagnosis", tuple(blocks), missing)


def _record_blocks(diagnosis: Diagnosis) -> list[PageBlock]:
    """The verdict first, then the gap, where it is, the parameters and the candidates."""
    blocks: list[PageBlock] = [Text(diagnosis.summary)]
    blocks += map(Text, warning_sentences(diagnosis.warnings))
    blocks += map(Text, effect_sentences(diagnosis))
    if diagnosis.effects:
        blocks.append(effects_table(diagnosis))
    blocks += [Text(line) for line in closing_sentences(diagnosis)]
    blocks += [Heading("The gap"), gap_table(diagnosis), Text(used_sentence(diagnosis))]
    if diagnosis.gaps:
        about = f"The gap in {counted(len(diagnosis.gaps), 'recording')} as a table"
        blocks.append(_gap_dots(diagnosis))
        blocks.append(Collapsible(about, (recordings_table(diagnosis),)))
    overlays = [one for one in diagnosis.overlays if one.measured.size]
    if overlays:
        items = [(one.name, (overlay_chart(one, diagnosis),)) for one in overlays]
        blocks += [Heading("Measured and simulated"), Picker("diagnosed", tuple(items))]
    blocks += _place_blocks(diagnosis)
    if diagnosis.base:
        blocks += [Heading("Parameters of the simulation"), base_table(diagnosis)]
    if diagnosis.candidates:
        about = f"{counted(len(diagnosis.candidates), 'candidate')} as a table"
        table = ranking_table(diagnosis)
        blocks.append(Heading("Candidates"))
        if shown_candidates(diagnosis):
            blocks.append(_candidate_dots(diagnosis))
        blocks.append(Collapsible(about, (table,)))
    return blocks


def _place_blocks(diagnosis: Diagnosis) -> list[PageBlock]:
    """Where the error sits: in words, as bars, and the force over what it follows."""
    said = [Text(one.sentence) for one in diagnosis.places if one.sentence]
    blocks: list[PageBlock] = [*said[:_MOST_PLACES]]
    sorts = shown_places(diagnosis)
    if sorts:
        blocks.append(_where_bars(sorts))
    forces = [one for one in diagnosis.latent_force if one.at.size][:_MOST_FORCES]
    if forces:
        charts = tuple(force_chart(one, diagnosis) for one in forces)
        blocks += [Text(_force_sentence(diagnosis)), Row(charts)]
    return [Heading("Where the error sits"), *blocks] if blocks else []


def _gap_dots(diagnosis: Diagnosis) -> Dots:
    """The gap of every recording: as given, re-fitted, with the effects."""
    unit = diagnosis.output_unit
    steps = [
        ("as given", "given", "rms_given"),
        ("re-fitted", "refitted", "rms_before"),
    ]
    if diagnosis.effects:
        steps.append(("with the effects", "extended", "rms_after"))
    groups = []
    for title, is_held_out in (("held out", True), ("trained on", False)):
        rows = []
        for one in diagnosis.gaps:
            if one.is_held_out != is_held_out:
                continue
            values = [
                (label, role, getattr(one, field)) for label, role, field in steps
            ]
            dots = [
                Dot(value, role, f"{label} {with_unit(value, unit)}")
                for label, role, value in values
                if value > 0.0
            ]
            rows.append(DotRow(one.name, tuple(dots)))
        if rows:
            groups.append(DotGroup(f"{title}: {len(rows)}", tuple(rows)))
    noise = diagnosis.noise.rms
    has_noise = np.isfinite(noise) and noise > 0.0
    return Dots(
        label=f"RMS of the residual [{unit}]",
        groups=tuple(groups),
        sentence=_worst(diagnosis),
        alt="RMS of the residual of every recording, with the noise",
        legend=tuple((role, label) for label, role, _ in steps),
        reference=(noise, f"noise {with_unit(noise, unit)}") if has_noise else None,
        is_log=True,
    )


def _where_bars(sorts: Mapping[str, Sequence[Place]]) -> Dots:
    groups = []
    for sort, places in sorts.items():
        rows = []
        for one in places:
            share = max(0.0, 100.0 * one.share)
            text = f"{share:.0f} %"
            rows.append(DotRow(one.variable, (Dot(share, "extended", text),), text))
        groups.append(DotGroup(PLACES[sort], tuple(rows)))
    return Dots(
        label="share [%]",
        groups=tuple(groups),
        sentence=(
            "Shares of the error that parameters of the base cannot take away; for "
            "variables, of the variance of the missing force."
        ),
        alt="Shares of the error by variable, segment, harmonic and recording",
        is_bar=True,
    )


# How a candidate is drawn, by what it is to the verdict.
_ROLES = {"": "given", "diagnosis": "extended", "rival": "refitted"}


def _candidate_dots(diagnosis: Diagnosis) -> Dots:
    """The best candidates by the share of the gap that they explain on held-out data."""
    noise = diagnosis.noise.judging_rms
    rows = []
    shown = shown_candidates(diagnosis)
    for one in shown:
        is_it = is_chosen(one)
        role = _ROLES[one.role]
        share = 100.0 * one.explained_share
        told = f"{share:.1f} %"
        if np.isfinite(noise) and noise > 0.0 and np.isfinite(one.held_out_rms):
            told += f", {one.held_out_rms / noise:.3g} \N{MULTIPLICATION SIGN} noise"
        dots = (Dot(max(share, _LOWEST), role, told),)
        rows.append(DotRow(candidate_name(one.effects), dots, told, is_bold=is_it))
    keys = [("extended", "chosen"), ("given", "others")]
    if any(one.role == "rival" for one in shown):
        keys.insert(1, ("refitted", "cannot be told from it"))
    return Dots(
        label="share of the excess error explained on held-out recordings [%]",
        groups=(DotGroup("", tuple(rows)),),
        sentence="The best candidates that were fitted; 0 % is the re-fitted simulation alone.",
        alt="Explained share and held-out error of the candidates",
        legend=tuple(keys),
        is_bar=True,
    )


def _worst(diagnosis: Diagnosis) -> str:
    """The held-out recordings with the largest gap that is left; of all if none is."""

    def left(one: RecordingGap) -> float:
        return one.rms_after if diagnosis.effects else one.rms_before

    held_out = [one for one in diagnosis.gaps if one.is_held_out]
    usable = [one for one in held_out or diagnosis.gaps if np.isfinite(left(one))]
    worst = sorted(usable, key=left, reverse=True)[:_MOST_NAMED]
    start = "Each recording's gap; the dashed line is the noise."
    if not worst:
        return start
    unit = diagnosis.output_unit
    names = listed([f"{one.name} ({with_unit(left(one), unit)})" for one in worst])
    most = "the largest gap of the held-out recordings is" if held_out else "most is"
    return f"{start} In the end {most} left in {names}."


def _force_sentence(diagnosis: Diagnosis) -> str:
    if not diagnosis.latent_force:
        return ""
    law = (
        " The blue line is what the simulation with the effects gives instead."
        if diagnosis.latent_force[0].law.size
        else ""
    )
    follows = diagnosis.latent_force[0].variable
    return f"The force that the simulation lacks follows {follows} most.{law}"


def _sentences(found: Mapping[str, Any]) -> list[str]:
    verdict = str(found.get("verdict", MISSING))
    text = _VERDICTS.get(verdict, f"Verdict: {verdict}.")
    if verdict == "named" and found.get("complete") is False:
        text += " Part of it stays unexplained."
    lines = [text]
    ambiguous = [
        one if isinstance(one, str) else " with ".join(map(str, one))
        for one in found.get("ambiguous_with") or ()
    ]
    if ambiguous:
        lines.append(f"These data cannot tell it from {listed(ambiguous)}.")
    lines += warning_sentences([str(one) for one in found.get("warnings") or ()])
    hidden = [str(one) for one in found.get("not_observable") or ()]
    if hidden:
        lines.append(f"Not observable in these recordings: {listed(hidden)}.")
    return lines


def _items(found: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    return [one for one in found.get(key) or () if isinstance(one, Mapping)]


def _effects_table(
    effects: Sequence[Mapping[str, Any]], *, is_all: bool, note: str
) -> Table | None:
    if not effects:
        return None
    rows = []
    for effect in effects:
        name = str(effect.get("id", MISSING))
        about = str(effect.get("sentence", ""))
        parameters = effect.get("parameters") or {"": {}}
        for parameter, value in parameters.items():
            cells = _value(value, parameter), _interval(value, parameter)
            rows.append((name, about, parameter, *cells))
            name = about = ""
    columns = (
        *texts("effect", "meaning", "parameter"),
        *numbers("value", "95 % interval"),
    )
    caption = "Effects that the simulation lacks; the unit ends each parameter's name"
    if note:
        caption += f" ({note})"
    if not is_all:
        caption += f"; {INTERVALS_OF_A_PART}"
    return Table(caption, columns, tuple(rows))


def _value(parameter: object, name: str) -> str:
    value = parameter.get("value") if isinstance(parameter, Mapping) else parameter
    return _text(value, name)


def _interval(parameter: object, name: str) -> str:
    bounds = parameter.get("ci95") if isinstance(parameter, Mapping) else None
    if not bounds:
        return MISSING
    low, high = bounds
    if isinstance(low, int | float) and isinstance(high, int | float):
        return shown_interval(low, high, name)
    return f"{_text(low, name)} to {_text(high, name)}"


def _gap_table(found: Mapping[str, Any]) -> Table | None:
    gap = found.get("gap")
    if not isinstance(gap, Mapping):
        return None
    steps = [("as given", "given"), ("base re-fitted", "refitted")]
    if "refitted" not in gap:
        # As files of earlier versions are.
        steps = [("before", "before")]
    if found.get("effects"):
        steps.append(("with the effects", "after"))
    rows = []
    for label, key in steps:
        part = gap.get(key) or {}
        cells = [_text(part.get(one)) for one in ("train_rms", "held_out_rms")]
        rows.append((label, *cells, _text(part.get("ratio_to_noise"))))
    share = gap.get("explained_share")
    caption = (
        f"Gap between simulation and measurement; noise {_text(gap.get('noise_rms'))}"
    )
    if isinstance(share, int | float):
        caption += f", explained share {share_text(share, 1)}"
    heads = ("train RMS", "held-out RMS", "ratio to noise [-]")
    return Table(caption, (*texts("simulation"), *numbers(*heads)), tuple(rows))


def _text(value: object, name: str = "") -> str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return MISSING if value is None else str(value)
    return shown_value(value, name)


def diagnosis_drawings(contents: ReportContents) -> tuple[Drawing, ...]:
    """Figures of the diagnosis as files."""
    record = contents.stored.diagnosis_record
    if record is None:
        return ()
    return tuple(
        Drawing(f"{name.replace('_', '/', 1)}.png", draw)
        for name, draw in figure_makers(record).items()
    )


# Answers, sections of the page, and figures beside it.
ANSWERS = (diagnosis_answer,)
SECTIONS = (diagnosis_section,)
DRAWINGS = (diagnosis_drawings,)
