"""What a diagnosis found: the verdict, how it was reached, and what shows it."""

import math
from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from hwid_cli.records.axis import MotionUnits
from hwid_cli.records.candidates import RankedCandidate
from hwid_cli.records.drive import LINE
from hwid_cli.records.programs import OF_DRIVE, Capabilities, StandInChange
from hwid_cli.records.rules import STORED_CURVE, STORED_NUMBERS, STORED_OR_MISSING
from hwid_cli.records.shown import Shown
from hwid_cli.records.stored import ADDED_LATER, check_lengths
from hwid_cli.records.trust import ModelTrust, TrustOnTests

# What leaves more than so many times the noise is a part of what is missing, no fact.
STILL_LARGE = 3.0
# Ratio to the noise up to which a remainder that no effect explains is no missing effect:
# the logger, a timer, a cable.
SMALL_REMAINDER = 1.2
# Standard deviations of a ratio of few samples that count as chance.
LEAST_SURE = 3.0
VERDICTS = ("named", "ambiguous", "law", "parameters", "unknown", "none")


@dataclass(frozen=True)
class FittedParameter:
    """One parameter with its 95 % interval.

    Parameters
    ----------
    name : str
        Ends in its unit.
    low, high : float
        Bounds of the interval; NaN where there is none.
    text : str
        In place of a number where the parameter is a word; else empty.
    unit : str
        Where the name does not say it.
    before, refitted : float
        Of an effect that the simulation has: as given, and fitted without further effects;
        NaN elsewhere.
    """

    name: str
    value: float
    low: float = float("nan")
    high: float = float("nan")
    text: str = ""
    unit: str = field(default="", metadata=ADDED_LATER)
    before: float = field(default=float("nan"), metadata=ADDED_LATER)
    refitted: float = field(default=float("nan"), metadata=ADDED_LATER)


@dataclass(frozen=True)
class FittedEffect:
    """An effect that the simulation lacks.

    Parameters
    ----------
    sentence : str
        In plain words.
    own : str
        Where it is one of the user's own: the id that holds its formula.
    """

    id: str
    sentence: str
    equation: str
    parameters: tuple[FittedParameter, ...]
    own: str = field(default="", metadata=ADDED_LATER)


@dataclass(frozen=True)
class LawTerm:
    """One term of a law.

    Parameters
    ----------
    term : str
        In x, v, u and t, without its coefficient.
    value, low, high : float, [unit]
        Of the coefficient, with its 95 % interval.
    inclusion : float, [-]
        Share of resampled recordings in which such a term was chosen again.
    """

    term: str
    value: float
    low: float
    high: float
    unit: str
    inclusion: float


@dataclass(frozen=True)
class Law:
    """A formula for what no effect of the catalogue explains.

    Parameters
    ----------
    formula : str
        As sympy reads it.
    acts_on : str
        ``force``, ``input`` or ``output``: a force on the mass, what stands for the
        input, or what the sensor reads.
    terms : tuple of LawTerm
        The largest share first.
    """

    formula: str
    acts_on: str
    terms: tuple[LawTerm, ...]


@dataclass(frozen=True)
class NoiseFloor:
    """How much of the output is noise.

    Parameters
    ----------
    rms : float, [output unit]
    method : str
        ``repeats``, ``rest``, ``differences`` or ``residuals``.
    resolution : float, [output unit]
        Smallest difference of a coarse sensor; 0 where it is not the limit.
    is_coloured : bool
        Whether neighbouring samples of the noise go together.
    whitening : tuple of float
        Coefficients of the autoregressive filter that makes it white; (1,) if it is.
    input_rms : float, [input unit]
        Noise that the measured input holds at most, from its differences.
    held_out_rms : float, [output unit]
        Of the recordings that judge, which may hold more or less; 0 where it was not
        asked for.
    """

    rms: float
    method: str
    resolution: float
    is_coloured: bool
    whitening: tuple[float, ...]
    sentence: str
    input_rms: float = field(default=0.0, metadata=ADDED_LATER)
    held_out_rms: float = field(default=0.0, metadata=ADDED_LATER)

    @property
    def judging_rms(self) -> float:
        """Noise that a held-out error is compared with, [output unit]."""
        return self.held_out_rms or self.rms


@dataclass(frozen=True)
class Gap:
    """Distance between simulation and measurement.

    Parameters
    ----------
    train_rms, held_out_rms : float, [output unit]
        NaN where no recording was held out.
    ratio_to_noise : float, [-]
        Of the held-out recordings; of the others where none was held out.
    """

    train_rms: float
    held_out_rms: float
    ratio_to_noise: float


@dataclass(frozen=True)
class BaseParameter:
    """A parameter of the simulation as given and as fitted.

    Parameters
    ----------
    before, refitted, after : float
        As given; fitted without an effect; fitted together with the effects.
    low, high : float
        95 % interval of the last; NaN where there is none.
    """

    name: str
    before: float
    refitted: float
    after: float
    low: float = field(default=math.nan, metadata=ADDED_LATER)
    high: float = field(default=math.nan, metadata=ADDED_LATER)


@dataclass(frozen=True)
class RecordingGap:
    """The gap in one recording.

    Parameters
    ----------
    rms_given, rms_before, rms_after : float, [output unit]
        Simulation as given, base re-fitted, with the effects.
    factor : float, [-]
        Over its mean, the parameter that differs between recordings; NaN where none does.
    """

    name: str
    kind: str
    is_held_out: bool
    rms_given: float
    rms_before: float
    rms_after: float
    factor: float = field(default=float("nan"), metadata=ADDED_LATER)


@dataclass(frozen=True)
class Place:
    """A place where the error sits.

    Parameters
    ----------
    about : str
        ``recording``, ``segment``, ``harmonic``, ``amplitude`` or ``variable``.
    variable : str
        Name of the recording, segment, harmonic, kind of recording or variable.
    share : float, [-]
        Of the excess error (of the variance of the missing force, for a variable).
    rms : float, [output unit]
        NaN where it has no meaning.
    """

    about: str
    variable: str
    share: float
    rms: float
    sentence: str


@dataclass(frozen=True, eq=False)
class Overlay:
    """Curves of one recording.

    Parameters
    ----------
    time_s, input, measured, before, after : ndarray, shape (n_samples,)
    """

    name: str
    time_s: Annotated[np.ndarray, STORED_NUMBERS]
    input: Annotated[np.ndarray, STORED_OR_MISSING]
    measured: Annotated[np.ndarray, STORED_OR_MISSING]
    before: Annotated[np.ndarray, STORED_CURVE]
    after: Annotated[np.ndarray, STORED_CURVE]
    noise_rms: float

    def check_stored(self) -> None:
        """Refuse curves of different lengths.

        Raises
        ------
        ValueError
        """
        check_lengths(self, "time_s", "input", "measured", "before", "after")


@dataclass(frozen=True, eq=False)
class LatentForce:
    """The force that the simulation lacks, against the variable that explains it most.

    Parameters
    ----------
    at : ndarray, shape (n_bins,), [unit]
    mean, spread : ndarray, shape (n_bins,), [N]
        Of the force estimated from the measurements.
    law : ndarray, shape (n_bins,), [N]
        The same estimated from the simulation with the effects; empty without any.
    """

    variable: str
    unit: str
    at: Annotated[np.ndarray, STORED_NUMBERS]
    mean: Annotated[np.ndarray, STORED_OR_MISSING]
    spread: Annotated[np.ndarray, STORED_OR_MISSING]
    law: Annotated[np.ndarray, STORED_OR_MISSING]

    def check_stored(self) -> None:
        """Refuse curves of different lengths.

        Raises
        ------
        ValueError
        """
        laws = ("law",) if self.law.size else ()
        check_lengths(self, "at", "mean", "spread", *laws)


@dataclass(frozen=True)
class NextExperiment:
    """An input that would separate what these data do not.

    Parameters
    ----------
    input : str
        Empty where none is needed.
    """

    input: str
    reason: str


@dataclass(frozen=True, eq=False, repr=False)
class Diagnosis(Shown):
    """Everything that ``hwid diagnose`` found.

    Parameters
    ----------
    verdict : str
        One of ``VERDICTS``.
    complete : bool
        Whether nothing remains beyond the noise.
    summary : str
        The verdict in one or two sentences.
    ambiguous_with : tuple of str
        Effects that fit as well; the ids of a set are joined by ``+``.
    given, after : Gap
        Simulation as given, and with all that was found.
    before : Gap
        What the effects had to explain: base re-fitted; of the verdicts that need no
        effect what fitting had to explain: the simulation as given.
    explained_share : float, [-]
    places : tuple of Place
        Where the error sits, the largest first.
    candidates : tuple of RankedCandidate
        The best first.
    overlays : tuple of Overlay
        The worst held-out recordings first.
    latent_force : tuple of LatentForce
        The variable that explains most first.
    present : tuple of FittedEffect
        Effects that the simulation had already, as fitted now.
    reference_current_A, reference_displacement_m : float, [A], [m]
        Where laws that need a reference count from.
    output_unit : str
        Of the signal that is compared.
    warnings : tuple of str
        What a reader must check before believing the rest.
    units : MotionUnits
        Of force and displacement, as those of a straight axis, and of the input.
    axis, output : str
        One of ``axis.AXES`` and of ``drive.OUTPUTS``: in which units parameters are.
    confirmed : str
        ``simulation`` where the simulation itself was run with the effect, ``surrogate``
        where only a stand-in was.
    is_foreign : bool
        Whether the simulation is the user's own program, outputs or model, not a drive.
    capabilities : Capabilities
        What the simulation can do.
    law : Law or None
        The formula where the verdict is ``law``.
    trust : ModelTrust or None
        What is known of the errors of the simulation with what was found.
    bands : TrustOnTests
        How its bands of 90 % did on held-out recordings, each told by the others.
    hold : str
        How the command goes on between samples, as given or as found.
    remains : str
        What beside the noise of the output makes up what is left, one of ``CAUSES``;
        empty where that is not known.
    stand_in : StandInChange
        Of the drive that stands for a simulation, for parameters that it does not offer.
    compared : str
        The signal that is compared: ``output y``, or ``command u`` beside a controller.
    """

    verdict: str
    complete: bool
    summary: str
    effects: tuple[FittedEffect, ...]
    ambiguous_with: tuple[str, ...]
    noise: NoiseFloor
    given: Gap
    before: Gap
    after: Gap
    explained_share: float
    base: tuple[BaseParameter, ...]
    places: tuple[Place, ...]
    not_observable: tuple[str, ...]
    next_experiment: NextExperiment
    train: tuple[str, ...]
    held_out: tuple[str, ...]
    candidates: tuple[RankedCandidate, ...]
    gaps: tuple[RecordingGap, ...]
    overlays: tuple[Overlay, ...]
    latent_force: tuple[LatentForce, ...]
    present: tuple[FittedEffect, ...] = ()
    reference_current_A: float = 1.0
    reference_displacement_m: float = 1.0
    output_unit: str = "m"
    warnings: tuple[str, ...] = field(default=(), metadata=ADDED_LATER)
    axis: str = field(default="linear", metadata=ADDED_LATER)
    units: MotionUnits = field(default=MotionUnits(), metadata=ADDED_LATER)
    output: str = field(default="position", metadata=ADDED_LATER)
    confirmed: str = field(default="simulation", metadata=ADDED_LATER)
    is_foreign: bool = field(default=False, metadata=ADDED_LATER)
    capabilities: Capabilities = field(default=OF_DRIVE, metadata=ADDED_LATER)
    law: Law | None = field(default=None, metadata=ADDED_LATER)
    trust: ModelTrust | None = field(default=None, metadata=ADDED_LATER)
    bands: TrustOnTests = field(default=TrustOnTests(), metadata=ADDED_LATER)
    hold: str = field(default=LINE, metadata=ADDED_LATER)
    remains: str = field(default="", metadata=ADDED_LATER)
    compared: str = field(default="output y", metadata=ADDED_LATER)
    stand_in: StandInChange = field(default=StandInChange(), metadata=ADDED_LATER)

    @property
    def refitted(self) -> Gap:
        """The gap with the base re-fitted and no effect added."""
        return self.before if self.effects else self.after

    @property
    def judged_on(self) -> str:
        """Which recordings decided: ``held_out``, or ``training`` where none was."""
        return "held_out" if self.held_out else "training"

    def __post_init__(self) -> None:
        if self.verdict not in VERDICTS:
            raise ValueError(
                f"verdict {self.verdict!r} is none of {', '.join(VERDICTS)}"
            )

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Name and what there is of it."""
        return (
            ("verdict", self.verdict),
            ("effects", ", ".join(one.id for one in self.effects) or "none"),
            (
                "gap",
                f"{self.before.ratio_to_noise:.3g} -> "
                f"{self.after.ratio_to_noise:.3g} times the noise",
            ),
        )
