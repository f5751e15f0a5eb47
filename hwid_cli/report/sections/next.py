"""Section of the page: how far to trust the models, and what to record next."""

from functools import partial

from hwid_cli.records.next import NextRecordings
from hwid_cli.records.report import ReportContents
from hwid_cli.report.bands import band_chart
from hwid_cli.report.figures.next import band_figure, visited_figure
from hwid_cli.report.formats import with_unit
from hwid_cli.report.next import next_blocks
from hwid_cli.report.page import Drawing, Figures, PageBlock, Section, drawn
from hwid_cli.report.trust import trust_table


def trust_section(contents: ReportContents) -> Section:
    """Show bands on the test recordings, and the proposed recordings."""
    final = contents.stored.final_test
    found: NextRecordings | None = contents.stored.results.get("next")
    blocks: list[PageBlock] = []
    if final is not None and final.trust.rows:
        shown = final.trust.shown
        if shown is not None:
            blocks.append(band_chart(shown, _band_sentence(contents)))
        blocks.append(trust_table(final.trust.rows))
    if found is not None:
        alt = "Largest amplitude of the input in each octave: visited and proposed"
        figure = drawn("next/visited", visited_figure(found.map, found.input_unit), alt)
        sentence = "What the recordings visited, and what the proposals would add."
        blocks += [*next_blocks(found), Figures((figure,), sentence)]
    title = "Trust: how far to believe the models, and what to record next"
    missing = "" if blocks else "run 'hwid test CONFIG' and 'hwid next CONFIG'"
    return Section("trust", title, "Trust", tuple(blocks), missing)


def _band_sentence(contents: ReportContents) -> str:
    final = contents.stored.final_test
    shown = None if final is None else final.trust.shown
    if final is None or shown is None:
        return ""
    row = next(
        one
        for one in final.trust.rows
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
    """Figure of the band that lies beside the page."""
    final = contents.stored.final_test
    shown = None if final is None else final.trust.shown
    if shown is None:
        return []
    return [Drawing("next/band.png", partial(band_figure, shown))]


SECTIONS = (trust_section,)
DRAWINGS = (trust_drawings,)
