"""What a report shows: stored results, and what is worked out from them for its figures."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hwid_cli.records.answer import ChosenMaps, ModelAnswer
from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.records.experiment import OrderOptions
from hwid_cli.records.groups import ChainTrend, FinalTest, GroupSearch
from hwid_cli.records.model import Fit, Information
from hwid_cli.records.recordings import Calibrated, CalibrationLog, Recording
from hwid_cli.records.residuals import ResidualTests
from hwid_cli.records.results import CrossValidation, ModelScore

# Why a recording is shown with a model: it is the best of those fitted to it, the one
# that the final test assigned, or the best of the cross-validation.
CHOICES = ("own", "assigned", "crossval")


@dataclass(frozen=True)
class StageRun:
    """The run of a stage whose results are stored.

    Parameters
    ----------
    key : str
        Hash of everything that the results depend on.
    seconds : float, [s]
        What the run took; NaN unknown.
    versions : mapping of str to str
        Program, Python and packages; empty unknown.
    changed : tuple of str
        Sections of the configuration that matter to the stage and read differently now.
    """

    stage: str
    key: str
    seconds: float = float("nan")
    versions: Mapping[str, str] = field(default_factory=dict)
    changed: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class StoredResults:
    """Whatever stages have left below ``--out``.

    Parameters
    ----------
    name : str
        Of the experiment.
    config : str
        Resolved configuration as JSON.
    nk_role : str
        What the second axis of the order grid counts; one of ``experiment.NK_ROLES``.
    stages : tuple of StageRun
        Those that have run, in their order.
    results : mapping of str to object
        What each of them gave, by its name.
    diagnosis : mapping or None
        Content of ``diagnosis.json``.
    thesis_names : bool
        Whether the configuration asks for the thesis's names of models and tables.
    order : OrderOptions or None
        Section of the configuration; None takes its defaults.
    chosen_maps : ChosenMaps or None
        What ``hwid order`` has left.
    source : str
        Name of the configuration's file: the same page wherever it lies.
    """

    name: str
    config: str
    nk_role: str
    stages: tuple[StageRun, ...] = ()
    results: Mapping[str, Any] = field(default_factory=dict)
    diagnosis: Mapping[str, Any] | None = None
    thesis_names: bool = False
    order: OrderOptions | None = None
    chosen_maps: ChosenMaps | None = None
    source: str = "CONFIG"

    @property
    def recordings(self) -> tuple[Recording, ...]:
        """Calibrated ones."""
        found: Calibrated | None = self.results.get("calibrate")
        return () if found is None else found.recordings

    @property
    def logs(self) -> tuple[CalibrationLog, ...]:
        """What was done to the recordings, in their order."""
        found: Calibrated | None = self.results.get("calibrate")
        return () if found is None else found.logs

    @property
    def fits(self) -> tuple[Fit, ...]:
        """Fits of single recordings."""
        found: tuple[Fit, ...] = self.results.get("identify", ())
        return found

    @property
    def crossval(self) -> CrossValidation | None:
        """RMSD of every model on every recording."""
        return self.results.get("crossval")

    @property
    def search(self) -> GroupSearch | None:
        """The search for groups."""
        return self.results.get("group")

    @property
    def final_test(self) -> FinalTest | None:
        """The final models on all recordings."""
        return self.results.get("test")

    @property
    def diagnosis_record(self) -> Diagnosis | None:
        """What ``diagnosis.json`` was written from, with its curves."""
        return self.results.get("diagnose")


@dataclass(frozen=True, eq=False)
class ModelOutput:
    """What one more model makes of a recording's input.

    Parameters
    ----------
    is_linear : bool
        Whether it is the linear one beside the model to take, or that model itself.
    output : ndarray, shape (n_samples,), [output unit]
    rmsd : float, [output unit]
    fit_percent : float, [%]
    """

    model: str
    is_linear: bool
    output: np.ndarray
    rmsd: float
    fit_percent: float


@dataclass(frozen=True, eq=False)
class SimulatedRecording:
    """A recording and what a model makes of its input.

    Parameters
    ----------
    model : str
        ``step_06/3/7``.
    choice : str
        Why this model; one of ``CHOICES``.
    output : ndarray, shape (n_samples,), [output unit]
        Simulated.
    residual : ndarray, shape (n_samples,), [output unit]
        Measured minus simulated.
    rmsd : float, [output unit]
    fit_percent : float, [%]
    detail : tuple of int, [samples]
        First sample of the stretch worth a closer look, and the one after its last.
    tests : ResidualTests or None
        None where the output is not finite or nobody asked.
    others : tuple of ModelOutput
        The model to take and the linear one beside it, as far as they are others.
    """

    recording: Recording
    model: str
    choice: str
    output: np.ndarray
    residual: np.ndarray
    rmsd: float
    fit_percent: float
    detail: tuple[int, int]
    tests: ResidualTests | None = None
    others: tuple[ModelOutput, ...] = ()


@dataclass(frozen=True, eq=False)
class OrderGrid:
    """RMSD of every model on its own recording.

    Parameters
    ----------
    rmsd : ndarray, shape (n, nb, nk), [unit]
        NaN where a fit failed.
    unit : str
        Unit of the output.
    """

    recordings: tuple[str, ...]
    nb: tuple[int, ...]
    nk: tuple[int, ...]
    nk_role: str
    rmsd: np.ndarray
    unit: str


@dataclass(frozen=True, eq=False)
class RmsdMatrix:
    """RMSD of some models on some recordings, and what that covers.

    Parameters
    ----------
    rmsd : ndarray, shape (n, m), [unit]
    is_own : ndarray of bool, shape (n, m)
        Whether the model was fitted to the recording.
    covers : ndarray of int, shape (n,), [-]
        Recordings that each model covers, a model's own counted or not as the stage does.
    covered_by : ndarray of int, shape (m,), [-]
        Models that cover each recording.
    threshold : float, [unit]
    """

    models: tuple[str, ...]
    recordings: tuple[str, ...]
    rmsd: np.ndarray
    is_own: np.ndarray
    covers: np.ndarray
    covered_by: np.ndarray
    unit: str
    threshold: float


@dataclass(frozen=True, eq=False)
class MapCurve:
    """A static map over the range of its argument.

    Parameters
    ----------
    argument, value : ndarray, shape (n,)
    corners, corner_values : ndarray, shape (n_corners,)
        Break-points or limits in that range; empty for smooth maps.
    """

    argument: np.ndarray
    value: np.ndarray
    corners: np.ndarray
    corner_values: np.ndarray


@dataclass(frozen=True, eq=False)
class FrequencyResponse:
    """Response of a linear block up to half the sampling frequency.

    Parameters
    ----------
    frequency_Hz : ndarray, shape (n,), [Hz]
    magnitude : ndarray, shape (n,), [-]
        Both sides of the block are in the input's unit.
    phase_deg : ndarray, shape (n,), [deg]
        Unwrapped, the delay included.
    """

    frequency_Hz: np.ndarray
    magnitude: np.ndarray
    phase_deg: np.ndarray


@dataclass(frozen=True, eq=False)
class StepResponse:
    """Response of a linear block to a unit step at time zero.

    Parameters
    ----------
    time_s : ndarray, shape (n,), [s]
    value : ndarray, shape (n,), [-]
        Both sides of the block are in the input's unit.
    """

    time_s: np.ndarray
    value: np.ndarray


@dataclass(frozen=True, eq=False)
class ModelView:
    """One model, seen from all sides.

    Parameters
    ----------
    model : str
        Its name.
    poles, zeros : ndarray of complex, [-]
    delay : int, [samples]
    rmsd : float, [output unit]
        On the recordings of its fit.
    coverage : int, [-]
        Recordings that it covers, of ``covers_of``.
    covers_of : int, [-]
    input_range, block_range : tuple of float, [input unit]
        What the arguments of the input map and of the output map have visited in the fit.
    """

    model: str
    input_curve: MapCurve
    output_curve: MapCurve
    response: FrequencyResponse
    poles: np.ndarray
    zeros: np.ndarray
    delay: int
    is_stable: bool
    rmsd: float
    coverage: int
    covers_of: int
    input_unit: str
    output_unit: str
    information: Information
    step: StepResponse
    input_range: tuple[float, float]
    block_range: tuple[float, float]


@dataclass(frozen=True, eq=False)
class ChainOnTests:
    """The chain of groups on recordings that nothing else has used.

    Parameters
    ----------
    models : tuple of str, length n
        Level by level.
    rmsd : ndarray, shape (n, m), [unit]
    mean : ndarray, shape (n,), [unit]
        Over the recordings; NaN where one is missing.
    covers : ndarray of int, shape (n,), [-]
    threshold : float, [unit]
    """

    models: tuple[str, ...]
    recordings: tuple[str, ...]
    rmsd: np.ndarray
    mean: np.ndarray
    covers: np.ndarray
    unit: str
    threshold: float


@dataclass(frozen=True)
class PredictionCounts:
    """How often the model told from the input alone was right.

    Parameters
    ----------
    right : int, [-]
        Recordings that the chosen model covers.
    possible : int, [-]
        Recordings that any model of the set covers.
    total : int, [-]
    """

    right: int
    possible: int
    total: int


@dataclass(frozen=True, eq=False)
class ReportContents:
    """Everything that a report shows.

    Parameters
    ----------
    statuses : mapping of str to int
        How the fits ended.
    simulated : tuple of SimulatedRecording
        In the order of the recordings, without those that no model is there for.
    without_model : tuple of str
        Those recordings.
    best : tuple of tuple of Fit
        The best fits of each recording.
    scores : tuple of ModelScore
        All models of single recordings, the widest first.
    cross : RmsdMatrix or None
        The widest model of each recording on all that judge.
    models : tuple of ModelView
        The chain of groups, or the widest models.
    chain_matrix, full_matrix : RmsdMatrix or None
        The chain, and all models of the final test, on all recordings.
    chain : ChainTrend or None
        What happens along that chain; None without one.
    answer : ModelAnswer or None
        The model to take; None without any.
    outdated : tuple of str
        Stages whose stored results do not belong to the models that are stored now.
    """

    stored: StoredResults
    statuses: Mapping[str, int] = field(default_factory=dict)
    simulated: tuple[SimulatedRecording, ...] = ()
    without_model: tuple[str, ...] = ()
    best: tuple[tuple[Fit, ...], ...] = ()
    grid: OrderGrid | None = None
    scores: tuple[ModelScore, ...] = ()
    cross: RmsdMatrix | None = None
    models: tuple[ModelView, ...] = ()
    trend: ChainOnTests | None = None
    chain: ChainTrend | None = None
    chain_matrix: RmsdMatrix | None = None
    full_matrix: RmsdMatrix | None = None
    predictions: PredictionCounts | None = None
    answer: ModelAnswer | None = None
    outdated: tuple[str, ...] = ()
