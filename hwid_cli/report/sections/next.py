"""Section of the page: how far to trust the models, and what to record next."""

from hwid_cli.records.next import NextRecordings
from hwid_cli.records.report import ReportContents
from hwid_cli.records.trust import ShownBand, TrustOnTests
from hwid_cli.report.figures.next import band_figure, visited_figure
from hwid_cli.report.formats import counted, with_unit
from hwid_cli.report.next import next_blocks
from hwid_cli.report.page import Collapsible, Figures, PageBlock, Section, drawn
from hwid_cli.report.trust import HELD_OUT, TESTED, VALIDATING, trust_table


def trust_section(contents: ReportContents) -> Section:
    """Show bands on the test recordings, and the proposed recordings."""
    final = contents.stored.final_test
    found: NextRecordings | None = contents.stored.results.get("next")
    blocks: list[PageBlock] = []
    crossval = contents.stored.crossval
    if crossval is not None and crossval.bands.rows:
        table = trust_table(crossval.bands.rows, VALIDATING)
        about = counted(len(crossval.bands.rows), "band")
        blocks.append(Collapsible(f"{about} of the widest models", (table,)))
    if final is not None:
        blocks += _band_blocks(final.trust, "next/band", TESTED)
    diagnosis = contents.stored.diagnosis_record
    if diagnosis is not None:
        blocks += _band_blocks(diagnosis.bands, "next/simulation_band", HELD_OUT)
    if found is not None:
        alt = "Largest amplitude of the input in each octave: visited and proposed"
        figure = drawn("next/visited", visited_figure(found.map, found.input_unit), alt)
        sentence = "What the recordings visited, and what the proposals would add."
        blocks += [*next_blocks(found), Figures((figure,), sentence)]
    title = "Trust: how far to believe the models, and what to record next"
    missing = "" if blocks else "run 'hwid test CONFIG' and 'hwid next CONFIG'"
    return Section("trust", title, "Trust", tuple(blocks), missing)


def _band_blocks(found: TrustOnTests, file: str, about: str) -> list[PageBlock]:
    """The prediction that its band holds worst, and a row for every band."""
    if not found.rows:
        return []
    blocks: list[PageBlock] = []
    if found.shown is not None:
        alt = "A prediction with its band of 90 % beside the measured output"
        figure = drawn(file, band_figure(found.shown), alt)
        blocks.append(Figures((figure,), _band_sentence(found, found.shown)))
    return [*blocks, trust_table(found.rows, about)]


def _band_sentence(found: TrustOnTests, shown: ShownBand) -> str:
    row = next(
        one
        for one in found.rows
        if (one.model, one.recording) == (shown.model, shown.recording)
    )
    return (
        f"The band of 90 % holds {row.coverage:.0%} of what was measured here; it is "
        f"{with_unit(row.width, row.unit)} wide on average, the RMSD is "
        f"{with_unit(row.rmsd, row.unit)}. {row.inside:.0%} of the samples rest on data "
        "by value, rate and frequency (strip)."
    )


SECTIONS = (trust_section,)
