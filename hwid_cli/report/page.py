"""Blocks that a page of the report is made of; templates/report.html draws them."""

from dataclasses import dataclass, field
from typing import ClassVar


@dataclass(frozen=True)
class Text:
    """A paragraph.

    Parameters
    ----------
    is_note : bool
        Whether it stands back, as remarks and missing stages do.
    """

    kind: ClassVar[str] = "text"
    text: str
    is_note: bool = False


@dataclass(frozen=True)
class Code:
    """Text in a type of fixed width, line by line."""

    kind: ClassVar[str] = "code"
    text: str


@dataclass(frozen=True)
class Image:
    """One figure of the report.

    Parameters
    ----------
    file : str
        Where it lies below ``figures/``.
    alt : str
        What a reader who does not see it should know.
    width_px, height_px : int, [pixels]
    dots_per_inch : int, [pixels/inch]
        What text and lines were sized for.
    """

    file: str
    png: bytes
    alt: str
    width_px: int
    height_px: int
    dots_per_inch: int

    @property
    def width_in(self) -> float:
        """Width that the text was sized for, in inches."""
        return self.width_px / self.dots_per_inch


@dataclass(frozen=True)
class Figures:
    """Figures that belong together, and the one sentence that says what they show.

    Parameters
    ----------
    images : tuple of Image
        Side by side where there is room.
    """

    kind: ClassVar[str] = "figures"
    images: tuple[Image, ...]
    sentence: str


@dataclass(frozen=True)
class Cell:
    """A cell of a table.

    Parameters
    ----------
    title : str
        Shown when the pointer rests on it; empty for nothing.
    share : float or None, [-]
        Place between the table's lowest and highest number, for its colour.
    is_marked : bool
        Whether it stands out.
    """

    text: str
    title: str = ""
    share: float | None = None
    is_marked: bool = False


@dataclass(frozen=True)
class Table:
    """A table that scrolls inside its own box where the screen is narrow.

    Parameters
    ----------
    rows : tuple of tuple of Cell or str
        The first cell of each is its head.
    text_columns : tuple of int, [-]
        Columns that stand left; numbers stand right.
    """

    kind: ClassVar[str] = "table"
    caption: str
    heads: tuple[str, ...]
    rows: tuple[tuple["Cell | str", ...], ...]
    text_columns: tuple[int, ...] = (0,)


@dataclass(frozen=True)
class Heading:
    """A heading inside a section."""

    kind: ClassVar[str] = "heading"
    text: str


@dataclass(frozen=True)
class Folded:
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
    blocks: "tuple[Block, ...]"
    is_printed: bool = True


@dataclass(frozen=True)
class Pairs:
    """Small figures, two in a row where there is room."""

    kind: ClassVar[str] = "pairs"
    figures: tuple[Figures, ...]


Block = Text | Code | Figures | Pairs | Table | Heading | Folded


@dataclass(frozen=True)
class Section:
    """A section of the page.

    Parameters
    ----------
    id : str
        Where links lead.
    short : str
        Its name in the navigation.
    """

    id: str
    title: str
    short: str
    blocks: tuple[Block, ...] = field(default_factory=tuple)


def images_of(blocks: tuple[Block, ...]) -> tuple[Image, ...]:
    """Collect the figures of some blocks, folded ones too.

    Returns
    -------
    tuple of Image
        In the order of the page.
    """
    found: list[Image] = []
    for block in blocks:
        if isinstance(block, Figures):
            found += block.images
        elif isinstance(block, Folded):
            found += images_of(block.blocks)
        elif isinstance(block, Pairs):
            found += images_of(block.figures)
    return tuple(found)
