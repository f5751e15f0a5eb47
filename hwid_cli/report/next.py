"""What to record next, as sentences and a table."""

from hwid_cli.records.next import NextRecordings
from hwid_cli.report.formats import number
from hwid_cli.report.table import Block, Table, Text, numbers, texts


def next_blocks(found: NextRecordings) -> list[Block]:
    """Show what is proposed and why, or that enough is known."""
    blocks: list[Block] = []
    if found.changed:
        blocks.append(Text(f"{found.changed[:1].upper()}{found.changed[1:]}."))
    blocks.append(Text(f"{found.sentence[:1].upper()}{found.sentence[1:]}."))
    if found.proposals:
        blocks.append(next_table(found))
    return blocks


def next_table(found: NextRecordings) -> Table:
    """Show the proposed recordings, the best one first."""
    gain = found.proposals[0].gain_words
    rows = tuple(
        (str(rank), one.name, number(one.gain), one.words)
        for rank, one in enumerate(found.proposals, 1)
    )
    return Table(
        f"Recordings to take next, for {found.goal}; gain: {gain}",
        (
            *numbers("rank"),
            *texts("name"),
            *numbers("gain"),
            *texts("input"),
        ),
        rows,
        tuple(f"{one.name} {one.reason}." for one in found.proposals),
    )
