"""Section about the diagnosis of the physics simulation, from ``diagnosis.json``."""

from collections.abc import Mapping, Sequence
from typing import Any

from hwid_cli.records.report import ReportContents
from hwid_cli.report.page import Block, Section, Table, Text
from hwid_cli.report.sections.words import listed
from hwid_cli.report.text_table import MISSING

_VERDICTS = {
    "named": "The gap between simulation and measurement has a name.",
    "ambiguous": "Several effects explain the gap equally well.",
    "parameters": "No effect is missing: the simulation's parameters were off.",
    "unknown": "There is a gap that no known effect explains.",
    "none": "There is no gap beyond the noise.",
}


def diagnosis_section(contents: ReportContents) -> Section:
    """Show the verdict, the effects with their parameters, and the gap.

    Parameters
    ----------
    contents : ReportContents

    Returns
    -------
    Section
    """
    found = contents.stored.diagnosis
    blocks: list[Block] = []
    if found is None:
        blocks.append(Text("There is no diagnosis among these results.", is_note=True))
    else:
        blocks += [Text(line) for line in _sentences(found)]
        effects = _effects_table(_items(found, "effects"))
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
    hidden = [str(one) for one in found.get("not_observable") or ()]
    if hidden:
        lines.append(f"Not observable in these recordings: {listed(hidden)}.")
    return lines


def _items(found: Mapping[str, Any], key: str) -> list[Mapping[str, Any]]:
    return [one for one in found.get(key) or () if isinstance(one, Mapping)]


def _effects_table(effects: Sequence[Mapping[str, Any]]) -> Table | None:
    if not effects:
        return None
    rows = []
    for effect in effects:
        name = str(effect.get("id", MISSING))
        about = str(effect.get("sentence", ""))
        parameters = effect.get("parameters") or {"": {}}
        for parameter, value in parameters.items():
            rows.append((name, about, parameter, _value(value), _interval(value)))
            name = about = ""
    heads = ("effect", "meaning", "parameter", "value", "95 % interval")
    caption = "Effects that the simulation lacks; the unit ends each parameter's name"
    return Table(caption, heads, tuple(rows), text_columns=(0, 1, 2))


def _value(parameter: object) -> str:
    value = parameter.get("value") if isinstance(parameter, Mapping) else parameter
    return _text(value)


def _interval(parameter: object) -> str:
    bounds = parameter.get("ci95") if isinstance(parameter, Mapping) else None
    return " to ".join(_text(one) for one in bounds) if bounds else MISSING


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
    heads = ("simulation", "train RMS", "held-out RMS", "ratio to noise [-]")
    return Table(caption, heads, tuple(rows))


def _text(value: object) -> str:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return MISSING if value is None else str(value)
    return f"{value:.4g}"
