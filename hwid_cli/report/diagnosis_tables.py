"""A diagnosis as text for the screen."""

import textwrap
from collections.abc import Sequence

from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.report.diagnosis_cells import (
    AND,
    base_table,
    candidate_name,
    closing_sentences,
    effects_table,
    explained_line,
    gap_table,
    ranking_table,
)
from hwid_cli.report.page import Cell, Table
from hwid_cli.report.text_table import GAP, WIDTH, text_table

# Candidates and places that the screen shows.
_MOST_SHOWN = 5
# Verdicts that need no effect, so that little has to be said.
_SHORT = ("none", "parameters")


def verdict_line(diagnosis: Diagnosis) -> str:
    """Say the verdict in a few words.

    Parameters
    ----------
    diagnosis : Diagnosis

    Returns
    -------
    str
    """
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
    diagnosis : Diagnosis
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
