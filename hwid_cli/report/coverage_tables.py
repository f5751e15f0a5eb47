"""What covers what in the final test, as text: the matrix, and what is not covered."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.records.groups import FinalTest
from hwid_cli.records.units import behind
from hwid_cli.report.sections.words import counted
from hwid_cli.report.simulation_words import simulation_words
from hwid_cli.report.text_table import (
    GAP,
    WIDTH,
    joined_names,
)

# Columns of the matrix that stand together, so that the eye can count.
_TOGETHER = 5


def coverage_matrix_table(
    final: FinalTest, *, initial_state: str, width: int = WIDTH
) -> str:
    """Show which model covers which recording (as T3.4.3-1).

    Parameters
    ----------
    final : FinalTest
    initial_state : str
        Rule of the fits.
    width : int, [characters]
        Of the screen; more recordings than fit go into further blocks.

    Returns
    -------
    str
        One character for each pair, recordings' names from top to bottom.
    """
    labels = ["model", *_short_names(final), "covered by"]
    label = max(map(len, labels))
    room = width - label - len(GAP) - len("  covers")
    # Each group of columns takes one more character for the gap behind it.
    per_block = max(1, room * _TOGETHER // (_TOGETHER + 1))
    title = (
        f"Coverage of all models on all recordings: 1 RMSD below {final.threshold:g}"
        f"{behind(final.unit)}, . not,\nblank its own; a + adds to the model above it "
        "(form of T3.4.3-1)\n"
        f"{simulation_words(initial_state, is_validation=True)}"
    )
    blocks = [
        _matrix_block(final, slice(first, first + per_block), labels[1:-1], label)
        for first in range(0, len(final.recordings), per_block)
    ]
    return "\n\n".join([f"{title}\n{blocks[0]}", *blocks[1:]])


def _matrix_block(
    final: FinalTest, part: slice, labels: Sequence[str], label: int
) -> str:
    """Some columns of the matrix, with heads, rows and sums."""

    def line(start: str, cells: str, end: str = "") -> str:
        return f"{start:{label}}{GAP}{_grouped(cells)}{GAP}{end:>6}".rstrip()

    heads = _downwards(final.recordings[part])
    lines = [line("", cells) for cells in heads[:-1]]
    lines.append(line("model", heads[-1], "covers"))
    covered = final.rmsd[:, part] < final.threshold
    for row, name in enumerate(labels):
        cells = np.where(covered[row], "1", ".")
        cells[final.is_own[row, part]] = " "
        lines.append(line(name, "".join(cells), str(final.covers[row])))
    counts = _downwards([str(n) for n in final.covered_by[part]])
    lines.append(line("covered by", counts[0]))
    lines += [line("", cells) for cells in counts[1:]]
    return "\n".join(lines)


def _short_names(final: FinalTest) -> list[str]:
    """Names of models; what a chain's model adds to the one above it follows a ``+``."""
    short = []
    before = ""
    for model in final.models:
        who = model.rsplit("/", 2)[0]
        is_longer = model in final.chain and before and who.startswith(f"{before}+")
        short.append(model[len(before) :] if is_longer else model)
        before = who if model in final.chain else ""
    return short


def _downwards(names: Sequence[str]) -> list[str]:
    """Lines that hold the names from top to bottom, one name in each column."""
    height = max(map(len, names))
    placed = [name.rjust(height) for name in names]
    return ["".join(letters) for letters in zip(*placed, strict=True)]


def _grouped(cells: str) -> str:
    starts = range(0, len(cells), _TOGETHER)
    return " ".join(cells[first : first + _TOGETHER] for first in starts)


def gaps_text(final: FinalTest, *, width: int = WIDTH) -> str:
    """Name the recordings that nothing covers, or hardly anything.

    Parameters
    ----------
    final : FinalTest
    width : int, [characters]
        Of the screen.

    Returns
    -------
    str
    """
    parts = [
        ("Covered by no model at all, not even their own", final.uncovered),
        ("Covered by fewer than a tenth of the other models", final.hard_to_cover),
    ]
    lines = []
    for what, names in parts:
        every = counted(len(final.recordings), "recording")
        lines.append(f"{what}: {len(names)} of {every}")
        lines += [f"  {line}" for line in joined_names(names, width=width - 2) if line]
    return "\n".join(lines)
