"""The recordings to take next, and what was known before them."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from hwid_cli.records.recordings import frozen_vector
from hwid_cli.records.rules import (
    NOT_NEGATIVE,
    SAMPLE_TIME,
    STORED_NUMBERS,
    STORED_OR_MISSING,
    Integer,
)
from hwid_cli.records.stored import ADDED_LATER

# Columns of the file that a proposed input is written to.
PROPOSED_COLUMNS = ("time_s", "input")
GOALS = ("coverage", "parameters", "diagnosis")


@dataclass(frozen=True, eq=False)
class PlannedInput:
    """An input that could be played.

    Parameters
    ----------
    values : ndarray, shape (n_samples,), [input unit]
    words : str
        What it is, for people.
    first_name : str
        The name that it was given, where a recording of another input has that.
    """

    name: str
    values: np.ndarray
    words: str
    first_name: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen_vector(self.values, "values"))


@dataclass(frozen=True, eq=False)
class ProposedRecording:
    """A recording that teaches much.

    Parameters
    ----------
    values : ndarray, shape (n_samples,), [input unit]
        Its input, ready to play.
    gain : float
        Expected; in the unit of `gain_words`.
    gain_words : str
        What the number is.
    reason : str
    """

    name: str
    words: str
    values: Annotated[np.ndarray, STORED_NUMBERS]
    gain: float
    gain_words: str
    reason: str

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", frozen_vector(self.values, "values"))


@dataclass(frozen=True, eq=False)
class InputMap:
    """Which amplitudes were visited at which frequencies and around which values.

    Parameters
    ----------
    octaves_Hz : ndarray, shape (n_octaves,), [Hz]
        Upper end of each, from Nyquist's frequency down.
    edges : ndarray, shape (n_cells + 1,), [input unit]
        Of the cells of the value.
    visited, proposed, reachable : ndarray, shape (n_octaves, n_cells), [input unit]
        Largest amplitude by the recordings, with the proposals, by all that was offered.
    """

    octaves_Hz: Annotated[np.ndarray, STORED_NUMBERS]
    edges: Annotated[np.ndarray, STORED_NUMBERS]
    visited: Annotated[np.ndarray, STORED_OR_MISSING]
    proposed: Annotated[np.ndarray, STORED_OR_MISSING]
    reachable: Annotated[np.ndarray, STORED_OR_MISSING]


@dataclass(frozen=True)
class RepeatSpread:
    """How much repeats of one input differ, and how well that is known.

    Parameters
    ----------
    spread : float, [output unit]
        Standard deviation of a recording around the mean of its repeats.
    noise : float, [output unit]
        Part of it that changes from sample to sample.
    n_repeats : int, [-]
        Recordings beside the first of each input.
    half_width : float, [output unit]
        Of the band of 90 % that so many repeats allow around a further recording.
    """

    spread: Annotated[float, NOT_NEGATIVE]
    noise: Annotated[float, NOT_NEGATIVE]
    n_repeats: Annotated[int, Integer(least=1)]
    half_width: Annotated[float, NOT_NEGATIVE]


@dataclass(frozen=True, eq=False)
class NextRecordings:
    """What to record next, or that enough is known.

    Parameters
    ----------
    goal : str
        One of ``GOALS``.
    recordings : tuple of str
        That were known.
    known : float
        How much is known by the measure of the goal; `known_words` says what it is.
    is_enough : bool
        Whether no offered recording teaches more than the configuration asks for.
    sentence : str
        The answer in words.
    changed : str
        What the recordings since the last proposal changed; empty where none came.
    n_offered : int, [-]
        Inputs that were compared.
    repeats : RepeatSpread or None
        None where no input was recorded twice, or the goal does not ask.
    """

    goal: str
    recordings: tuple[str, ...]
    known: float
    known_words: str
    is_enough: bool
    sentence: str
    proposals: tuple[ProposedRecording, ...]
    map: InputMap
    n_offered: int
    sample_time_s: Annotated[float, SAMPLE_TIME]
    input_unit: str
    changed: str = field(default="")
    repeats: RepeatSpread | None = field(default=None, metadata=ADDED_LATER)
