"""Section of the page: how far to trust the models, and what to record next."""

from functools import partial

from hwid_cli.records.next import NextRecordings
from hwid_cli.records.report import ReportContents
from hwid_cli.records.trust import ShownBand, TrustOnTests
from hwid_cli.report.bands import band_chart
from hwid_cli.report.figures.next import band_figure, visited_figure
from hwid_cli.report.formats import counted, with_unit
from hwid_cli.report.next import next_blocks
from hwid_cli.report.page import (
    Collapsible,
    Drawing,
    Figures,
    PageBlock,
    Section,
    drawn,
)
from hwid_cli.report.trust import HELD_OUT, TESTED, VALIDATING, trust_table


def trust_section(contents: ReportContents) -> Section:
    """Show bands on the test recordings, and the proposed recordings."""
    found: NextRecordings | None = contents.stored.results.get("next")
    blocks: list[PageBlock] = []
    crossval = contents.stored.crossval
    if crossval is not None and crossval.bands.rows:
        table = trust_table(crossval.bands.rows, VALIDATING)
        about = counted(len(crossval.bands.rows), "band")
        blocks.append(Collapsible(f"{about} of the widest models", (table,)))
    for _, bands, about in _shown_bands(contents):
        blocks += _band_blocks(bands, about)
    if found is not None:
        alt = "Largest amplitude of the input in each octave: visited and proposed"
        figure = drawn("next/visited", visited_figure(found.map, found.input_unit), alt)
        sentence = "What the recordings visited, and what the proposals would add."
        blocks += [*next_blocks(found), Figures((figure,), sentence)]
    title = "Trust: how far to believe the models, and what to record next"
    missing = "" if blocks else "run 'hwid test CONFIG' and 'hwid next CONFIG'"
    return Section("trust", title, "Trust", tuple(blocks), missing)


def _shown_bands(contents: ReportContents) -> list[tuple[str, TrustOnTests, str]]:
    """File of the figure, bands, and what these are about."""
    found = []
    final, diagnosis = contents.stored.final_test, contents.stored.diagnosis_record
    if final is not None:
        found.append(("next/band.png", final.trust, TESTED))
    if diagnosis is not None:
        found.append(("next/simulation_band.png", diagnosis.bands, HELD_OUT))
    return found


def _band_blocks(found: TrustOnTests, about: str) -> list[PageBlock]:
    """The prediction that its band holds worst, and a row for every band."""
    if not found.rows:
        return []
    table = trust_table(found.rows, about)
    if found.shown is None:
        return [table]
    return [band_chart(found.shown, _band_sentence(found, found.shown)), table]


def _band_sentence(found: TrustOnTests, shown: ShownBand) -> str:
    row = next(
        one
        for one in found.rows
        if (one.model, one.recording) == (shown.model, shown.recording)
    )
    return (
        f"The band of 90 % holds {row.coverage:.0%} of what was measured here; it is "
        f"{with_unit(row.width, row.unit)} wide on average, the RMSD is "
        f"{with_unit(row.rmsd, row.unit)}. The fit has seen the values of "
        f"{row.inside_amplitude:.0%} of the samples, the rates of {row.inside_rate:.0%} and "
        f"the frequencies of {row.inside_frequency:.0%}."
    )


def trust_drawings(contents: ReportContents) -> list[Drawing]:
    """Figures of the bands that lie beside the page."""
    return [
        Drawing(file, partial(band_figure, bands.shown))
        for file, bands, _ in _shown_bands(contents)
        if bands.shown is not None
    ]


SECTIONS = (trust_section,)
DRAWINGS = (trust_drawings,)
