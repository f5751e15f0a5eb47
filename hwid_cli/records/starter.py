"""What is found in a folder of measurements, and the configuration proposed for it."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True, eq=False)
class FoundColumn:
    """A column of numbers in a measurement file.

    Parameters
    ----------
    title : str
        Header or name of the variable; empty where a column has only a number.
    key : str or int
        As ``recordings.columns`` names it.
    values : ndarray, shape (n,)
        NaN where the file holds no number.
    variable : str or None
        Table that a numbered column belongs to.
    unit : str
        That the file states beside the name; empty where it states none.
    scale : float, [-]
        Factor that the file states for its counts; 1 where it states none.
    """

    title: str
    key: str | int
    values: np.ndarray
    variable: str | None = None
    unit: str = ""
    scale: float = 1.0

    @property
    def place(self) -> tuple[str | None, str | int]:
        """What tells the column from others of its file."""
        return self.variable, self.key


@dataclass(frozen=True, eq=False)
class FoundFile:
    """A file that may be a measurement.

    Parameters
    ----------
    name : str
        Path below the folder, with ``/``.
    columns : tuple of FoundColumn
        Long ones first come as they stand in the file; single numbers are among them.
    problem : str
        Why nothing was found; empty if something was.
    lacks_library : bool
        Whether it is that a library is not installed: it may be a measurement.
    """

    name: str
    columns: tuple[FoundColumn, ...] = ()
    problem: str = ""
    lacks_library: bool = False


@dataclass(frozen=True)
class Role:
    """A column with the role that it is taken for.

    Parameters
    ----------
    unit : str
        Empty where the name says none.
    reason : str
        Why this column.
    """

    key: str | int
    title: str
    unit: str
    reason: str


@dataclass(frozen=True)
class FolderLayout:
    """How the files of a folder are read.

    Parameters
    ----------
    patterns : tuple of str
        Below the folder.
    sample_time_s : float or None, [s]
        Only where there is no usable time column.
    clock_reason : str
        Where the sample time comes from.
    notes : tuple of str
        What else a reader of the configuration must know.
    output_time : Role or None
        Where the output has a clock of its own.
    left : tuple of (str, str)
        Files that are not used, and why.
    first_sample : int, [samples]
        Rows at the beginning of the files in which a signal has no number.
    parts : dict of str to tuple of int, [samples]
        First and end of each recording where a file holds several; empty for one.
    mixed : tuple of str
        Roles whose unit is another one in some files.
    output_file : tuple of two str or None
        Where the output is in a file of its own: what the name of the input's file has,
        and that of the output's file in its place.
    keeps_units : bool
        Whether the experiment's numbers are in the units of the files, and not in SI.
    """

    patterns: tuple[str, ...]
    input: Role
    output: Role
    time: Role | None = None
    reference: Role | None = None
    variable: str | None = None
    sample_time_s: float | None = None
    clock_reason: str = ""
    resample: bool = False
    notes: tuple[str, ...] = ()
    output_time: Role | None = None
    left: tuple[tuple[str, str], ...] = ()
    first_sample: int = 0
    parts: dict[str, tuple[int, ...]] = field(default_factory=dict)
    output_file: tuple[str, str] | None = None
    mixed: tuple[str, ...] = ()
    keeps_units: bool = False


@dataclass(frozen=True)
class Reached:
    """How far, fast and long the inputs of some recordings go.

    Parameters
    ----------
    level : float, [input unit]
        That the machine works around; 0 where the inputs come near zero.
    largest : float, [input unit]
        About that.
    fastest : float, [input unit/s]
    longest_s : float, [s]
    """

    level: float
    largest: float
    fastest: float
    longest_s: float


@dataclass(frozen=True)
class Proposal:
    """What is proposed to do with the recordings.

    Parameters
    ----------
    kinds : dict of str to tuple of str
        Patterns of each kind.
    recipes : dict of str to tuple of str
        Steps of calibration of each kind.
    nb, nk : tuple of int
        First and last order.
    threshold : float, [output unit]
    identify : tuple of str
        Empty for all.
    held_out : tuple of str
        Recordings that only judge; empty for none.
    held_out_reason : str
        Why these.
    average : int, [samples]
        1 for no advice.
    fit_start : tuple of (str, str)
        How models take the recordings to start, and why.
    initial_state : str
        How a diagnosis takes the recordings to start.
    sample_time_s : float, [s]
    reached : Reached
        How far, fast and long the inputs go.
    names : tuple of str
        Of the recordings that can be used.
    problems : tuple of str
        Why the others cannot.
    """

    kinds: dict[str, tuple[str, ...]]
    kind_reason: str
    recipes: dict[str, tuple[str, ...]]
    recipe_reason: str
    nb: tuple[int, int]
    nk: tuple[int, int]
    order_reason: str
    threshold: float
    threshold_reason: str
    sample_time_s: float
    reached: Reached
    exclude: tuple[str, ...] = ()
    parts: dict[str, tuple[int, ...]] = field(default_factory=dict)
    identify: tuple[str, ...] = ()
    held_out: tuple[str, ...] = ()
    held_out_reason: str = ""
    average: int = 1
    fit_start: tuple[str, str] = ("estimated", "")
    initial_state: str = "rest"
    notes: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
