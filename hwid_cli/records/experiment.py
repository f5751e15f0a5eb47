"""A whole experiment as its YAML file describes it; the defaults live here only.

Every key of a configuration file is a field here. ``configs/README.md`` explains them.
"""

from dataclasses import dataclass, field
from typing import Annotated

from hwid_cli.records.drive import Controller
from hwid_cli.records.machines import GunMachine, ServoMachine
from hwid_cli.records.model import FitOptions

RECIPE_STEPS = ("cut", "input_offset", "output_offset", "recut")
NK_ROLES = ("poles", "delay")
# Marks the keys that name recordings, so that a misspelt one is told at once.
OF_RECORDINGS = "of recordings"
RecordingNames = Annotated[tuple[str, ...], OF_RECORDINGS]


@dataclass(frozen=True)
class Columns:
    """Where a recording's columns are in its file.

    CSV: header names (or 0-based numbers). MAT, NPZ, H5: names of variables, or
    ``variable`` with 0-based column numbers.
    """

    input: str | int
    output: str | int
    time: str | int | None = None
    reference: str | int | None = None
    variable: str | None = None


@dataclass(frozen=True)
class RecordingsOptions:
    """Which files hold the recordings and how to read them."""

    files: tuple[str, ...]
    columns: Columns
    sample_time_s: float | None = None
    kind: dict[str, tuple[str, ...]] = field(default_factory=dict)
    exclude: tuple[str, ...] = ()
    resample: bool = False
    sampling_tolerance: float = 0.01
    input_unit: str = "A"
    output_unit: str = "m"
    input_scale: float = 1.0
    output_scale: float = 1.0
    first_sample: int = 0
    last_sample: int | None = None
    parts: dict[str, tuple[int, ...]] = field(default_factory=dict)
    average: int = 1
    optional: bool = False


@dataclass(frozen=True)
class CalibrateOptions:
    """The recipe for each kind of recording; an empty recipe leaves it as it is."""

    step: tuple[str, ...] = ()
    sine: tuple[str, ...] = ()
    random: tuple[str, ...] = ()
    other: tuple[str, ...] = ()
    samples: int | None = None
    rest_samples: int = 100
    repair: bool = True


@dataclass(frozen=True)
class OrdersOptions:
    """The grid of candidate orders."""

    nb: tuple[int, ...] = tuple(range(1, 11))
    nk: tuple[int, ...] = tuple(range(1, 11))
    nk_role: str = "poles"
    nf: int | None = None


@dataclass(frozen=True)
class IdentifyOptions:
    """Which recordings get models; None means all."""

    recordings: RecordingNames | None = None


@dataclass(frozen=True)
class CrossvalOptions:
    """Which recordings judge the models, and where a model counts as good."""

    threshold: float = 0.01
    recordings: RecordingNames | None = None


@dataclass(frozen=True)
class OrderOptions:
    """When smaller ones count as good as the best, and which maps to compare."""

    tolerance: float = 0.05
    maps: tuple[str, ...] = ()
    units: tuple[int, ...] = ()


@dataclass(frozen=True)
class GroupOptions:
    """The greedy search for groups of recordings."""

    start: RecordingNames | None = None
    candidates: RecordingNames | None = None
    validate: RecordingNames | None = None
    keep: dict[str, int | bool | tuple[int, ...]] = field(
        default_factory=lambda: {"top": 3}
    )
    max_level: int = 4
    warm_start: bool = True


@dataclass(frozen=True)
class FinalTestOptions:
    """Recordings that judge the final models and are used nowhere else."""

    recordings: RecordingNames


@dataclass(frozen=True)
class SimulationOptions:
    """The physics model that diagnosis judges, in SI units."""

    kind: str = "drive"
    mass_kg: float = 1.0
    damping_N_s_per_m: float = 0.0
    stiffness_N_per_m: float = 0.0
    force_constant_N_per_A: float = 1.0
    effects: dict[str, dict[str, float | str]] = field(default_factory=dict)
    reference_current_A: float | None = None
    reference_displacement_m: float | None = None
    resistance_ohm: float | None = None
    inductance_H: float = 0.0
    back_emf_V_s_per_m: float | None = None
    hold: str = "linear"
    controller: Controller | None = None


@dataclass(frozen=True)
class DiagnoseOptions:
    """What diagnosis may use."""

    recordings: RecordingNames | None = None
    hold_out: str | RecordingNames = "auto"
    effects: tuple[str, ...] | None = None
    max_effects: int = 3
    initial_state: str = "rest"
    skip_samples: int = 0


@dataclass(frozen=True)
class Experiment:
    """One configuration file.

    A section that the file leaves out is None where it names work to do, and holds the
    defaults where it only says how.

    Parameters
    ----------
    thesis_names : bool
        Whether screens and pages show the thesis's names of models and tables, too.
    """

    name: str
    source: str
    recordings: RecordingsOptions | None = None
    simulate: ServoMachine | GunMachine | None = None
    calibrate: CalibrateOptions | None = None
    orders: OrdersOptions = field(default_factory=OrdersOptions)
    fit: FitOptions = field(default_factory=FitOptions)
    identify: IdentifyOptions | None = None
    crossval: CrossvalOptions | None = None
    order: OrderOptions | None = None
    group: GroupOptions | None = None
    test: FinalTestOptions | None = None
    simulation: SimulationOptions | None = None
    diagnose: DiagnoseOptions | None = None
    thesis_names: bool = False
