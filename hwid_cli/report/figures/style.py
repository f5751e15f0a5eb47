"""How all figures of the report look: sizes, colours that everybody can tell apart."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import wraps
from typing import Any, ParamSpec, TypeVar

import matplotlib as mpl
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

from hwid_cli.report import plots

Arguments = ParamSpec("Arguments")
Drawn = TypeVar("Drawn")

# Sharp on a screen with fine pixels, [dots/inch].
DOTS = 150
# Two figures side by side, and one over the whole width of the page, [inch].
HALF_WIDTH, FULL_WIDTH = 5.6, 11.2

# Colours by Okabe and Ito, told apart by colour-blind readers too; the order also falls
# in brightness steps that a grey print keeps.
BLACK, BLUE, VERMILLION, GREEN = "#000000", "#0072B2", "#D55E00", "#009E73"
ORANGE, SKY, PURPLE, GREY = "#E69F00", "#56B4E9", "#CC79A7", "#7f7f7f"
# Lines differ in colour, dashes and markers at once.
LINES: tuple[dict[str, Any], ...] = (
    {"color": BLUE, "ls": "-", "marker": "o"},
    {"color": VERMILLION, "ls": "--", "marker": "s"},
    {"color": GREEN, "ls": "-.", "marker": "^"},
    {"color": PURPLE, "ls": ":", "marker": "D"},
    {"color": ORANGE, "ls": "-", "marker": "v"},
    {"color": SKY, "ls": "--", "marker": "P"},
    {"color": BLACK, "ls": "-.", "marker": "X"},
)
# Even in brightness from end to end, so that it survives a grey print.
HEAT = "cividis"
# Where there is no number.
MISSING_COLOUR, MISSING_HATCH = "#e3e3e3", "////"

# Over more decades than this, each is marked once, [-].
_MANY_DECADES = 2.3

_SETTINGS: Any = {
    "font.size": 9.0,
    "axes.titlesize": 9.5,
    "axes.titlelocation": "left",
    # A fixed place: looking for a free one measures every tick again.
    "axes.titley": 1.0,
    "axes.labelsize": 9.0,
    "xtick.labelsize": 8.0,
    "ytick.labelsize": 8.0,
    "legend.fontsize": 8.0,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#555555",
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "hatch.linewidth": 0.5,
    "hatch.color": "#a0a0a0",
    # Names of recordings may hold dollars, which are no formulas.
    "text.parse_math": False,
}


# Whether the style is set already.
_has_style: ContextVar[bool] = ContextVar("has_style", default=False)


def styled(
    draw: Callable[Arguments, Drawn],
) -> Callable[Arguments, Drawn]:
    """Let a function draw in the report's style, whatever the user's settings are."""

    @wraps(draw)
    def with_style(*args: Arguments.args, **kwargs: Arguments.kwargs) -> Drawn:
        with report_style():
            return draw(*args, **kwargs)

    return with_style


@contextmanager
def report_style() -> Iterator[None]:
    """Draw in the report's style until the end; setting it anew takes milliseconds."""
    if _has_style.get():
        yield
        return
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(_SETTINGS)
        token = _has_style.set(True)
        try:
            yield
        finally:
            _has_style.reset(token)


def new_figure(width: float, height: float) -> Figure:
    """Give an empty figure.

    Parameters
    ----------
    width, height : float, [inch]
    """
    return Figure(figsize=(width, height), dpi=DOTS)


@styled
def as_png(figure: Figure) -> bytes:
    """Render a figure, with the same bytes for the same figure.

    Returns
    -------
    bytes
        A PNG file.
    """
    return plots.as_png(figure)


def number_decades(axis: Axis, low: float, high: float) -> None:
    """Write plain numbers along a logarithmic axis, often enough to read it.

    Parameters
    ----------
    low, high : float
        Ends of what is shown; positive.
    """
    decades = math.log10(high / low)
    subs = (1.0,) if decades > _MANY_DECADES else (1.0, 2.0, 5.0)
    axis.set_major_locator(LogLocator(subs=subs, numticks=12))
    axis.set_major_formatter(FuncFormatter(lambda value, place: f"{value:g}"))
    axis.set_minor_formatter(NullFormatter())


def label_with_factor(axes: Axes) -> None:
    """Move the factor of large and small numbers along y into the label's unit.

    Elsewhere it would stand above the axes, where the title is.

    Parameters
    ----------
    axes : Axes
        Drawn and labelled, with the unit in brackets.
    """
    axes.ticklabel_format(
        axis="y", scilimits=(-2, 3), useOffset=False, useMathText=False
    )
    formatter = axes.yaxis.get_major_formatter()
    formatter.set_locs(list(axes.yaxis.get_majorticklocs()))
    factor = formatter.get_offset()
    axes.yaxis.get_offset_text().set_visible(False)
    if factor:
        axes.set_ylabel(axes.get_ylabel().replace("[", f"[{factor} ", 1))


def mark_missing(axes: Axes) -> None:
    """Hatch whatever a heat map leaves blank."""
    axes.patch.set_facecolor(MISSING_COLOUR)
    axes.patch.set_hatch(MISSING_HATCH)
    axes.patch.set_edgecolor("#a0a0a0")
