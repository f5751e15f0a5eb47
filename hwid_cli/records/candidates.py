"""Sets of effects that a diagnosis considers: how they were fitted, how they rank."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from hwid_cli.records.rules import OneOf
from hwid_cli.records.stored import ADDED_LATER

# What a candidate is to the verdict: what it states, what it cannot tell from that.
CANDIDATE_ROLES = ("", "diagnosis", "rival")

# An input that was logged later than it acted, by one sample, two, three.
LATE_INPUT = ("late_input", "late_input_2", "late_input_3")
# What the measuring chain may add to the noise of the output, in words.
CAUSES = {
    "input_noise": "noise of the measured input, seen through the drive",
    "stand_in": "small, and of the kind that the drive in place of the simulation is "
    "wrong by at steps of the input",
    "zeros": "the sensor's zero, which differs between recordings",
    **{
        cause: f"timing: the input stands {count} later in the recordings than it acted; "
        "take its column back by as much"
        for cause, count in zip(
            LATE_INPUT, ("one sample", "two samples", "three samples"), strict=True
        )
    },
    "interpolation": "noise that interpolation between uneven samples has linked",
    "coloured_noise": "coloured noise, of one size and colour in all recordings",
}

# Of these the filter of the input's noise leaves nothing.
LIKE_INPUT_NOISE = ("input_noise", "stand_in")


@dataclass(frozen=True)
class RankedCandidate:
    """One set of effects that was considered.

    Parameters
    ----------
    effects : tuple of str
        Ids; empty for the base alone.
    forecast_share : float, [-]
        Share of the base's error that it should explain by the ranking beforehand.
    is_fitted : bool
        Whether it was fitted by simulation; what follows is NaN if not.
    train_rms, held_out_rms : float, [output unit]
    bic_gain : float, [-]
        How much lower its information criterion is than the base's, on training data.
    explained_share : float, [-]
        Of the excess over the noise on held-out recordings.
    improved_share : float, [-]
        Of the held-out recordings.
    whiteness : float, [-]
        Statistic of what it leaves, over its limit: above 1 something remains.
    role : str
        One of ``CANDIDATE_ROLES``.
    """

    effects: tuple[str, ...]
    forecast_share: float
    is_fitted: bool
    train_rms: float
    held_out_rms: float
    bic_gain: float
    explained_share: float
    improved_share: float
    whiteness: float
    note: str = ""
    role: Annotated[str, OneOf(CANDIDATE_ROLES)] = field(
        default="", metadata=ADDED_LATER
    )


@dataclass(frozen=True)
class ParameterRef:
    """Which parameter of a fit a value belongs to.

    Files hold it as text, ``<owner>/<parameter>``; this is the one place that writes
    and reads that form.

    Parameters
    ----------
    owner : str
        Id of an effect in the catalogue, ``base``, or ``start`` for how a recording
        starts.

    Examples
    --------
    >>> str(ParameterRef("coulomb_friction", "force_N"))
    'coulomb_friction/force_N'
    >>> ParameterRef.of_text("base/stiffness_N_per_m").parameter
    'stiffness_N_per_m'
    """

    owner: str
    parameter: str

    def __str__(self) -> str:
        return f"{self.owner}/{self.parameter}"

    @classmethod
    def of_text(cls, text: str) -> "ParameterRef":
        """Read what ``str`` gives."""
        # A formula of the owner may divide; names of parameters hold no slash.
        owner, _, parameter = text.rpartition("/")
        return cls(owner, parameter)


@dataclass(frozen=True, eq=False)
class CandidateFit:
    """Base and effects as fitted to the training recordings, and how they do.

    Parameters
    ----------
    effects : tuple of str
        Ids in the catalogue of drive effects, without those that the simulation had.
    names : tuple of ParameterRef
        Of what all recordings share.
    values : ndarray, shape (n_names,)
    own_names : tuple of ParameterRef
        Of what each recording has for itself.
    own : ndarray, shape (n_recordings, n_own)
        In the order of the recordings.
    sse : ndarray, shape (n_recordings,)
        Sum of squared residuals of each recording.
    whiteness : float, [-]
        Of all residuals, see ``RankedCandidate``.
    neighbour : float, [-]
        Correlation of neighbouring residuals.
    cause : str
        What beside the noise of the output makes up what is left, one of ``CAUSES``;
        empty where that noise is all, or something remains.
    valleys : ndarray, shape (n_valleys, n_names)
        Values at which other searches have ended that are as likely; empty where one
        search is enough.
    """

    effects: tuple[str, ...]
    names: tuple[ParameterRef, ...]
    values: np.ndarray
    own_names: tuple[ParameterRef, ...]
    own: np.ndarray
    sse: np.ndarray
    whiteness: float
    neighbour: float
    iterations: int
    has_converged: bool
    cause: str = ""
    valleys: np.ndarray = field(
        default_factory=lambda: np.zeros((0, 0)), metadata=ADDED_LATER
    )

    @property
    def is_usable(self) -> bool:
        """Whether every recording could be simulated."""
        return bool(np.isfinite(self.sse).all())
