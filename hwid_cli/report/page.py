"""Blocks that a page of the report is made of; templates/report.html draws them."""

import hashlib
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, is_dataclass, replace
from functools import partial
from shlex import quote
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from hwid_cli.files.stems import shortened_stem
from hwid_cli.records.report import ReportContents, StoredResults
from hwid_cli.report.charts import Chart
from hwid_cli.report.dots import Dots
from hwid_cli.report.formats import listed
from hwid_cli.report.simulation_note import HUBER_NOTE, simulation_note
from hwid_cli.report.table import Block, Table, Text
from hwid_cli.sources import PACKAGE, checksum_of_folder

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Collapsible:
    """Blocks that open when they are asked for.

    Parameters
    ----------
    summary : str
        What is inside.
    is_printed : bool
        Whether they are opened on paper.
    """

    kind: ClassVar[str] = "folded"
    summary: str
    blocks: "tuple[PageBlock, ...]"
    is_printed: bool = True


@dataclass(frozen=True)
class Picker:
    """Blocks of several recordings or models, of which the page shows one at a time.

    Parameters
    ----------
    what : str
        What they are of; pickers of one thing change together.
    items : tuple of (str, tuple of block)
        By their names, in their order.
    """

    kind: ClassVar[str] = "picker"
    what: str
    items: "tuple[tuple[str, tuple[PageBlock, ...]], ...]"


@dataclass(frozen=True)
class Row:
    """Blocks beside each other where there is room."""

    kind: ClassVar[str] = "row"
    blocks: "tuple[PageBlock, ...]"


@dataclass(frozen=True)
class Answer:
    """One question, its answer in a sentence, and what shows it; stands first on the page.

    Parameters
    ----------
    is_settled : bool
        Whether nothing stays open.
    details : tuple of str
        Sentences beneath the verdict.
    blocks : tuple of block
        Up to three, beside each other.
    next_steps : tuple of (str, str)
        What to do next, and the command for it; empty for none.
    is_small : bool
        Whether another answer needs room on the same screen.
    """

    kind: ClassVar[str] = "answer"
    question: str
    verdict: str
    is_settled: bool
    details: tuple[str, ...] = ()
    blocks: "tuple[PageBlock, ...]" = ()
    next_steps: tuple[tuple[str, str], ...] = ()
    is_small: bool = False


PageBlock = Block | Collapsible | Chart | Dots | Picker | Row | Answer


@dataclass(frozen=True)
class Section:
    """A section of the page.

    Parameters
    ----------
    id : str
        Where links lead.
    short : str
        Its name in the navigation.
    missing : str
        Why there is nothing to show; such a section is one line at the end of the page.
    """

    id: str
    title: str
    short: str
    blocks: tuple[PageBlock, ...] = field(default_factory=tuple)
    missing: str = ""


@dataclass(frozen=True)
class Drawing:
    """A figure that lies beside the page as a file, for other documents.

    Parameters
    ----------
    file : str
        Where it lies below ``figures/``.
    draw : partial
        Gives the figure from the records that it holds; nothing is drawn before.
    """

    file: str
    draw: "partial[Figure]"

    @property
    def key(self) -> str:
        """Hash of what it is drawn from: as long as it stays, the file may stay.

        Values that nothing tells apart reliably give another key each time, and a figure
        that is drawn again.
        """
        # What draws stands in this room; all that is drawn is handed to it.
        sources = checksum_of_folder(PACKAGE / "report")
        digest = hashlib.blake2b(f"{sources} {self.file}".encode())
        _add(digest, self.draw)
        return digest.hexdigest()

    @property
    def png(self) -> bytes:
        """The drawn file."""
        # Loading what draws takes longer than to see that nothing has to be drawn.
        from hwid_cli.report.figures.style import as_png, report_style
        from hwid_cli.report.plots import shared_sheets

        with report_style(), shared_sheets():
            return as_png(self.draw())


def _add(digest: "hashlib.blake2b", value: object) -> None:
    """Add a value to a digest, with all that it holds."""
    if isinstance(value, partial):
        value = (value.func.__qualname__, value.args, value.keywords)
    if is_dataclass(value):
        digest.update(type(value).__name__.encode())
        value = {one.name: getattr(value, one.name) for one in fields(value)}
    if isinstance(value, np.ndarray) and not value.dtype.hasobject:
        digest.update(f"array {value.dtype.str} {value.shape} ".encode())
        digest.update(np.ascontiguousarray(value).data)
    elif isinstance(value, Mapping):
        _add(digest, tuple(value.items()))
    elif isinstance(value, tuple | list | np.ndarray):
        digest.update(f"many {len(value)} ".encode())
        for one in value:
            _add(digest, one)
    else:
        digest.update(f"{value!r} ".encode())


def section_notes(contents: ReportContents, *, is_validation: bool) -> list[Text]:
    """Say how the models of a section were fitted and simulated.

    Parameters
    ----------
    is_validation : bool
        As for ``simulation_note``.

    Returns
    -------
    list of Text
        None where there are no models.
    """
    fits = list(contents.stored.fits)
    if contents.stored.search is not None:
        fits += [one for one in contents.stored.search.fits if one is not None]
    rules = dict.fromkeys(one.options.initial_state for one in fits)
    notes = [simulation_note(rule, is_validation=is_validation) for rule in rules]
    if any(one.options.loss == "huber" for one in fits):
        notes.append(HUBER_NOTE)
    return [Text(one, is_note=True) for one in notes]


def marked_if_changed(
    answer: Answer, contents: ReportContents, stages: Sequence[str]
) -> Answer:
    """Say first that an answer was made with other settings than those of today.

    Parameters
    ----------
    stages : sequence of str
        Whose results the answer is of.
    """
    runs = [one for one in contents.stored.stages if one.stage in stages]
    changed = tuple(dict.fromkeys(name for one in runs for name in one.changed))
    if not changed:
        return answer
    command = f"hwid {next(one.stage for one in reversed(runs) if one.changed)}"
    note = f"Made with other settings of {listed(changed)}: run {command} again."
    return replace(
        answer,
        is_settled=False,
        details=(note, *answer.details),
        next_steps=(
            ("With the settings of today:", f"{command} CONFIG"),
            *answer.next_steps,
        ),
    )


def to_copy(command: str, stored: StoredResults) -> str:
    """Write a command with the configuration that the page is of.

    Examples
    --------
    >>> stored = StoredResults("a", "{}", "poles", source="the axis.yaml")
    >>> to_copy("hwid export CONFIG --diagnosis", stored)
    "hwid export 'the axis.yaml' --diagnosis"
    """
    return command.replace("CONFIG", quote(stored.source))


def collapsed_beyond(most: int, table: Table, summary: str) -> Table | Collapsible:
    """Fold a table that is long.

    Parameters
    ----------
    most : int, [-]
        Rows that are shown open.
    summary : str
        What is inside.
    """
    return table if len(table.rows) <= most else Collapsible(summary, (table,))


def file_names(names: Iterable[str], endings: Sequence[str] = ("",)) -> dict[str, str]:
    """Make file names of recordings or models that every disk takes and tells apart.

    Parameters
    ----------
    endings : sequence of str
        What follows a name in the files that belong to it.

    Returns
    -------
    dict of str to str
        By the names; equal ones are numbered. Large and small letters count as equal,
        as they do on some disks.

    Examples
    --------
    >>> file_names(["step_06+step_09/3/7", "c#", "c_"])
    {'step_06+step_09/3/7': 'step_06+step_09_3_7', 'c#': 'c_', 'c_': 'c__2'}
    """
    found: dict[str, str] = {}
    taken: set[str] = set()
    for name in dict.fromkeys(names):
        plain = shortened_stem(re.sub(r"[^\w.+ -]", "_", name))
        file, number = plain, 1
        while taken & (files := {f"{file}{end}".casefold() for end in endings}):
            number += 1
            file = f"{plain}_{number}"
        taken |= files
        found[name] = file
    return found
