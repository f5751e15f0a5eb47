"""What a check of a configuration and its data found, before anything is computed."""

from dataclasses import dataclass
from math import isnan, nan


@dataclass(frozen=True)
class RecordingFacts:
    """One recording as it is read.

    Parameters
    ----------
    n_input, n_output : int, [samples]
        Lengths of the raw columns.
    n_used : int, [samples]
        After calibration; 0 where calibration fails.
    sample_time_s : float, [s]
    input_range, output_range : tuple of float
        Smallest and largest value.
    notes : tuple of str
        What looks odd, in words.
    """

    name: str
    kind: str
    n_input: int
    n_output: int
    n_used: int
    sample_time_s: float
    input_range: tuple[float, float]
    output_range: tuple[float, float]
    input_unit: str
    output_unit: str
    notes: tuple[str, ...] = ()


@dataclass(frozen=True)
class StagePlan:
    """What one stage would do.

    Parameters
    ----------
    what : str
        Its tasks in words, with their number.
    tasks : int, [-]
        Of the largest kind; an upper bound where the work depends on what is found.
    cached : int or None, [-]
        Tasks whose results are there; None where that cannot be told beforehand.
    seconds : float, [s]
        For what is not cached, at least; NaN where there is no estimate.
    size_bytes : float, [bytes]
        What it adds to the disk.
    most_seconds : float, [s]
        Where the work depends on what is found; NaN where ``seconds`` says it all.
    most_reason : str
        When it takes that long, in words.
    is_shared : bool
        Whether several processes share its tasks, which have to be started once.
    """

    stage: str
    what: str
    tasks: int
    cached: int | None
    seconds: float
    size_bytes: float
    most_seconds: float = nan
    most_reason: str = ""
    is_shared: bool = False

    @property
    def waits_for_processes(self) -> bool:
        """Whether there is something left that processes share."""
        return self.is_shared and self.cached != self.tasks

    @property
    def longest_seconds(self) -> float:
        """What it takes at most, [s]; NaN where there is no estimate."""
        return self.seconds if isnan(self.most_seconds) else self.most_seconds


@dataclass(frozen=True)
class FitCost:
    """Time of one fit, from which others are scaled.

    Parameters
    ----------
    seconds : float, [s]
    n_samples : int, [samples]
    order : float, [-]
        Mean of nb and the number of poles.
    units : int, [-]
    source : str
        Where the time comes from, in words.
    rounds : tuple of float, [s]
        Of a fit in the grid's first round, in a round that is searched anew, and in a
        later one, timed on the recordings themselves; empty where they were not.
    joint : tuple of float, [s]
        Of a fit of all recordings together, with each of the maps that are tried, and of a
        linear one; empty where they were not timed.
    """

    seconds: float
    n_samples: int
    order: float
    units: int
    source: str
    rounds: tuple[float, ...] = ()
    joint: tuple[float, ...] = ()
