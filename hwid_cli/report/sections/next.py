"""Section of the page: how far to trust the models, and what to record next."""

from dataclasses import replace
from functools import partial

import numpy as np

from hwid_cli.records.next import InputMap, NextRecordings
from hwid_cli.records.report import ReportContents
from hwid_cli.records.trust import ShownBand, TrustOnTests
from hwid_cli.report.bands import band_chart
from hwid_cli.report.charts import Chart, Curve, Panel
from hwid_cli.report.figures.next import band_figure, visited_figure
from hwid_cli.report.formats import counted, share_text, with_unit
from hwid_cli.report.next import next_blocks
from hwid_cli.report.page import (
    Collapsible,
    Drawing,
    PageBlock,
    Section,
)
from hwid_cli.report.table import Heading, Table, Text
from hwid_cli.report.trust import COLUMNS, HELD_OUT, TESTED, VALIDATING, trust_table


def trust_section(contents: ReportContents) -> Section:
    """Show bands on recordings that fits have not used, and the proposed recordings."""
    found: NextRecordings | None = contents.stored.results.get("next")
    crossval = contents.stored.crossval
    blocks: list[PageBlock] = []
    for title, _, bands, about in _shown_bands(contents):
        if bands.rows:
            blocks += [Heading(title), *_band_blocks(bands, about)]
    if crossval is not None and crossval.bands.rows:
        # The folded table stands below the answer to the question.
        about = counted(len(crossval.bands.rows), "band")
        table = _without_notes(trust_table(crossval.bands.rows, VALIDATING))
        blocks.append(Collapsible(f"{about} of the models that cover most", (table,)))
    if blocks:
        blocks.append(Text(COLUMNS, is_note=True))
    if found is not None:
        blocks += [
            Heading("What to record next"),
            *next_blocks(found),
            visited_chart(found.map, found.input_unit),
        ]
    title = "Trust: how far to believe the models, and what to record next"
    missing = "" if blocks else "run 'hwid test CONFIG' and 'hwid next CONFIG'"
    return Section("trust", title, "Trust", tuple(blocks), missing)


def _shown_bands(
    contents: ReportContents,
) -> list[tuple[str, str, TrustOnTests, str]]:
    """Heading, file of the figure, bands, and what these are about."""
    found = []
    final, diagnosis = contents.stored.final_test, contents.stored.diagnosis_record
    if final is not None:
        title = "Models on the test recordings"
        found.append((title, "next/band.png", final.trust, TESTED))
    if diagnosis is not None:
        title = "The simulation on recordings that were held out"
        file = "next/simulation_band.png"
        found.append((title, file, diagnosis.bands, HELD_OUT))
    return found


def _band_blocks(found: TrustOnTests, about: str) -> list[PageBlock]:
    """The prediction that its band holds worst, and a row for every band."""
    table = _without_notes(trust_table(found.rows, about))
    if found.shown is None:
        return [table]
    return [band_chart(found.shown, _band_sentence(found, found.shown)), table]


def _without_notes(table: Table) -> Table:
    """The page explains the columns once, below all tables that have them."""
    return replace(table, notes=())


def visited_chart(found: InputMap, unit: str) -> Chart:
    """Draw the largest amplitude in each octave: visited, proposed, on offer."""
    low = found.octaves_Hz / 2.0
    # The lowest octave first, each from its lower end to its upper one.
    at = np.stack([low, found.octaves_Hz], axis=1)[::-1].ravel()
    curves = tuple(
        Curve(label, np.repeat(table.max(axis=1)[::-1], 2), role)
        for label, table, role in (
            ("on offer and visited", found.reachable, "given"),
            ("with the proposals", found.proposed, "refitted"),
            ("visited", found.visited, "map"),
        )
    )
    panel = Panel(f"largest amplitude [{unit}]", curves, lines=(0.0,))
    return Chart(
        name="visited",
        at=at,
        label="frequency [Hz], in octaves; the lowest holds all that is slower",
        panels=(panel,),
        sentence="What the recordings visited, and what the proposals would add.",
        alt="Largest amplitude of the input in each octave: visited and proposed",
        is_log=True,
    )


def _band_sentence(found: TrustOnTests, shown: ShownBand) -> str:
    row = next(
        one
        for one in found.rows
        if (one.model, one.recording) == (shown.model, shown.recording)
    )
    return (
        f"The band of 90 % holds {share_text(row.coverage)} of what was measured here; it is "
        f"{with_unit(row.width, row.unit)} wide on average, the RMSD is "
        f"{with_unit(row.rmsd, row.unit)}. The fit has seen the values of "
        f"{share_text(row.inside_amplitude)} of the samples, the rates of {share_text(row.inside_rate)} and "
        f"the frequencies of {share_text(row.inside_frequency)}."
    )


def trust_drawings(contents: ReportContents) -> list[Drawing]:
    """Figures of the bands and of what was visited, as files."""
    drawings = [
        Drawing(file, partial(band_figure, bands.shown))
        for _, file, bands, _ in _shown_bands(contents)
        if bands.shown is not None
    ]
    found: NextRecordings | None = contents.stored.results.get("next")
    if found is not None:
        draw = partial(visited_figure, found.map, found.input_unit)
        drawings.append(Drawing("next/visited.png", draw))
    return drawings


SECTIONS = (trust_section,)
DRAWINGS = (trust_drawings,)
