"""Section about the diagnosis: with its figures, or from ``diagnosis.json`` alone."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from hwid_cli.records.axis import units_note
from hwid_cli.records.diagnosis import Diagnosis, RecordingGap
from hwid_cli.records.report import ReportContents
from hwid_cli.report.diagnosis import (
    INTERVALS_OF_A_PART,
    base_table,
    closing_sentences,
    effect_sentences,
    effects_table,
    gap_table,
    ranking_table,
    recordings_table,
    shown_value,
    used_sentence,
    warning_sentences,
)
from hwid_cli.report.figures.diagnosis import diagnosis_figures
from hwid_cli.report.formats import MISSING, counted, listed, with_unit
from hwid_cli.report.page import Collapsible, Figures, PageBlock, Section, drawn
from hwid_cli.report.table import Heading, Table, Text, numbers, texts

# Places that are told in words, and recordings that are called the worst.
_MOST_PLACES, _MOST_NAMED = 5, 3
_ALTS = {
    "diagnosis_gap": "RMS of the residual of every recording, with the noise",
    "diagnosis_overlay": "Measurement and simulations of the worst held-out recordings",
    "diagnosis_force": "The missing force against what it follows",
    "diagnosis_ranking": "Held-out RMS and explained share of the candidates",
    "diagnosis_where": "Shares of the error by variable, segment and recording",
}
_VERDICTS = {
    "named": "The gap between simulation and measurement has a name.",
    "law": "No effect of the catalogue is missing, but a formula describes what is.",
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
    elif found is None:
        blocks.append(Text("There is no diagnosis among these results.", is_note=True))
    else:
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
            text = f"Next experiment: {following.get('input', MISSING)}"
            reason = following.get("reason")
            blocks.append(Text(f"{text} - {reason}" if reason else text))
    title = "Diagnosis of the simulation"
    return Section("diagnosis", title, "Diagnosis", tuple(blocks))


def _record_blocks(diagnosis: Diagnosis) -> list[PageBlock]:
    """The verdict first, then the gap, where it is, the parameters and the candidates."""
    figures = {
        name: drawn(name.replace("_", "/", 1), figure, _ALTS[name])
        for name, figure in diagnosis_figures(diagnosis).items()
    }

    def figure(name: str, sentence: str) -> list[PageBlock]:
        return [Figures((figures[name],), sentence)] if name in figures else []

    blocks: list[PageBlock] = [Text(diagnosis.summary)]
    blocks += map(Text, warning_sentences(diagnosis.warnings))
    blocks += map(Text, effect_sentences(diagnosis))
    if diagnosis.effects:
        blocks.append(effects_table(diagnosis))
    blocks += [Text(line) for line in closing_sentences(diagnosis)]
    blocks += [Heading("The gap"), gap_table(diagnosis), Text(used_sentence(diagnosis))]
    blocks += figure("diagnosis_gap", _worst(diagnosis))
    if diagnosis.gaps:
        about = f"The gap in {counted(len(diagnosis.gaps), 'recording')} as a table"
        blocks.append(Collapsible(about, (recordings_table(diagnosis),)))
    blocks += figure("diagnosis_overlay", _overlay_sentence(diagnosis))
    where = [Text(one.sentence) for one in diagnosis.places if one.sentence]
    where_figure = "Shares of the error that parameters of the base cannot take away."
    places: list[PageBlock] = [
        *where[:_MOST_PLACES],
        *figure("diagnosis_where", where_figure),
    ]
    places += figure("diagnosis_force", _force_sentence(diagnosis))
    blocks += [Heading("Where the error sits"), *places] if places else []
    if diagnosis.base:
        blocks += [Heading("Parameters of the simulation"), base_table(diagnosis)]
    if diagnosis.candidates:
        about = f"{counted(len(diagnosis.candidates), 'candidate')} as a table"
        table = ranking_table(diagnosis)
        sentence = "The best candidates that were fitted, and the simulation alone."
        blocks.append(Heading("Candidates"))
        blocks += [*figure("diagnosis_ranking", sentence), Collapsible(about, (table,))]
    return blocks


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


def _overlay_sentence(diagnosis: Diagnosis) -> str:
    names = listed([one.name for one in diagnosis.overlays])
    below = (
        "beneath them both residuals, and those with the effects in their own scale"
        if diagnosis.effects
        else "beneath them the residuals"
    )
    return f"Where the simulation fails most: {names}; {below}. Grey is the noise."


def _force_sentence(diagnosis: Diagnosis) -> str:
    if not diagnosis.latent_force:
        return ""
    law = (
        " The dashed line is what the simulation with the effects gives instead."
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
    return " to ".join(_text(one, name) for one in bounds) if bounds else MISSING


def _gap_table(found: Mapping[str, Any]) -> Table | None:
    gap = found.get("gap")
    if not isinstance(gap, Mapping):
        return None
    rows = []
    for label, key in (("before", "before"), ("with the effects", "after")):
        part = gap.get(key) or {}
        cells = [_text(part.get(one)) for one in ("train_rms", "held_out_rms")]
        rows.append((label, *cells, _text(part.get("ratio_to_noise"))))
    share = gap.get("explained_share")
    caption = (
        f"Gap between simulation and measurement; noise {_text(gap.get('noise_rms'))}"
    )
    if isinstance(share, int | float):
        caption += f", explained share {share:.1%}"
    heads = ("train RMS", "held-out RMS", "ratio to noise [-]")
    return Table(caption, (*texts("simulation"), *numbers(*heads)), tuple(rows))


def _text(value: object, name: str = "") -> str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return MISSING if value is None else str(value)
    return shown_value(value, name)


# Sections of the page, in their order.
SECTIONS = (diagnosis_section,)
