"""A whole experiment as its YAML file describes it; the defaults live here only.

Every key of a configuration file is a field here. ``configs/README.md`` explains them.
"""

from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Literal

from hwid_cli.records.axis import ROTARY_NAMES, check_axis
from hwid_cli.records.drive import (
    HOLDS,
    OUTPUTS,
    STARTS,
    UNSAID_HOLD,
    Controller,
    Repeatable,
)
from hwid_cli.records.machines import GunMachine, ServoMachine
from hwid_cli.records.maps import MAP_KINDS
from hwid_cli.records.model import FitOptions
from hwid_cli.records.next import GOALS
from hwid_cli.records.own_effects import OwnEffect
from hwid_cli.records.programs import ForeignSimulation
from hwid_cli.records.recordings import KINDS
from hwid_cli.records.rules import (
    NO_KEY,
    NOT_NEGATIVE,
    POSITIVE,
    Distinct,
    Each,
    FileLimit,
    Filled,
    Integer,
    Interval,
    NamesFor,
    Number,
    OneOf,
    OrderAxis,
    StandsFor,
)

RECIPE_STEPS = ("cut", "input_offset", "output_offset", "recut")
NK_ROLES = ("poles", "delay")
KEEP_RULES = ("top", "best", "coverage_at_least")
# A known parameter that is listed without a tolerance may move by so much: what data
# sheets of motors promise at best, [-].
KNOWN_TOLERANCE = 0.02
# Far beyond any use: grids of the literature end at 20 orders, maps at 100 units.
_MOST_ORDER = 1000
# Pairs of orders in one grid: 50 by 50, 25 times the published one.
MOST_PAIRS = 2500

_COLUMN = Integer(least=0, words="a number >= 0")
_PATTERN = Each(bool, "a file name or pattern")
_SCALE = Each(bool, "a number other than 0")
_Recipe = Annotated[tuple[str, ...], OneOf(RECIPE_STEPS), Distinct()]
# Marks the keys that name recordings, so that a misspelt one is told at once.
OF_RECORDINGS = "of recordings"
_SOME_NAMES = (OF_RECORDINGS, Filled("at least one recording"), Distinct())
_Names = Annotated[tuple[str, ...] | None, StandsFor("all", None), *_SOME_NAMES]


@dataclass(frozen=True)
class Columns:
    """Where a recording's columns are in its file.

    CSV: header names (or 0-based numbers). MAT, NPZ, H5: names of variables, or
    ``variable`` with 0-based column numbers.

    Parameters
    ----------
    output_file : tuple of two str or None
        Where the output stands in a file of its own: what the path of the input's file
        has, and that of the output's file in its place.
    """

    input: Annotated[str | int, _COLUMN]
    output: Annotated[str | int, _COLUMN]
    time: Annotated[str | int | None, _COLUMN] = None
    reference: Annotated[str | int | None, _COLUMN] = None
    simulated: Annotated[str | int | None, _COLUMN] = None
    variable: str | None = None
    output_time: Annotated[str | int | None, _COLUMN] = None
    output_file: Annotated[
        tuple[str, ...] | None, Filled("two texts, such as [CH1, CH2]")
    ] = None


# In place of a unit: what each file says, where one is in V and the next one in mV.
AS_FILE = "file"


@dataclass(frozen=True)
class FileUnits:
    """Units of a file's columns, where they are not those of the configuration.

    ``AS_FILE`` stands for the one that each file says.
    """

    time: str | None = None
    input: str | None = None
    output: str | None = None


@dataclass(frozen=True)
class RecordingsOptions:
    """Which files hold the recordings and how to read them.

    Parameters
    ----------
    units : FileUnits
        Of the columns; None where the file says it, or nobody does.
    input_unit, output_unit : str or None
        In which this configuration's numbers stand; None for those of the simulation,
        else those of the file.
    """

    files: Annotated[tuple[str, ...], Filled("at least one name or pattern"), _PATTERN]
    columns: Columns
    sample_time_s: Annotated[
        float | None, Number(above=0, words="a number of seconds > 0")
    ] = None
    kind: Annotated[dict[str, tuple[str, ...]], OneOf(KINDS)] = field(
        default_factory=dict
    )
    exclude: Annotated[tuple[str, ...], _PATTERN] = ()
    resample: bool = False
    sampling_tolerance: Annotated[
        float, Number(above=0, words="a share of the sample time > 0, such as 0.01")
    ] = 0.01
    units: FileUnits = field(default_factory=FileUnits)
    input_unit: str | None = None
    output_unit: str | None = None
    input_scale: Annotated[float, _SCALE] = 1.0
    output_scale: Annotated[float, _SCALE] = 1.0
    first_sample: Annotated[int, Integer(least=0)] = 0
    last_sample: int | None = None
    parts: dict[str, tuple[int, ...]] = field(default_factory=dict)
    average: Annotated[int, Integer(least=1), FileLimit(1_000_000)] = 1
    optional: bool = False


@dataclass(frozen=True)
class CalibrateOptions:
    """The recipe for each kind of recording; an empty recipe leaves it as it is."""

    step: _Recipe = ()
    sine: _Recipe = ()
    random: _Recipe = ()
    other: _Recipe = ()
    samples: Annotated[int | None, Integer(least=1)] = None
    rest_samples: Annotated[int, Integer(least=1)] = 100
    repair: bool = True


@dataclass(frozen=True)
class OrdersOptions:
    """The grid of candidate orders."""

    nb: Annotated[
        tuple[int, ...],
        OrderAxis(_MOST_ORDER),
        Filled("at least one order"),
        Integer(least=1, words="orders >= 1"),
        Distinct(),
    ] = tuple(range(1, 11))
    nk: Annotated[
        tuple[int, ...],
        OrderAxis(_MOST_ORDER),
        Filled("at least one order"),
        Integer(least=0, words="orders >= 0"),
        Distinct(),
    ] = tuple(range(1, 11))
    nk_role: Annotated[str, OneOf(NK_ROLES)] = "poles"
    nf: Annotated[int | None, Integer(least=0), FileLimit(_MOST_ORDER)] = None


@dataclass(frozen=True)
class IdentifyOptions:
    """Which recordings get models; None means all."""

    recordings: _Names = None


@dataclass(frozen=True)
class CrossvalOptions:
    """Which recordings judge the models, and where a model counts as good."""

    threshold: Annotated[float, POSITIVE] = 0.01
    recordings: _Names = None


@dataclass(frozen=True)
class OrderOptions:
    """When smaller ones count as good as the best, and which maps to compare."""

    tolerance: Annotated[float, NOT_NEGATIVE] = 0.02
    # A function of the user's own needs a file beside it.
    maps: Annotated[
        tuple[str, ...],
        OneOf([kind for kind, one in MAP_KINDS.items() if not one.has_function]),
    ] = ()
    units: Annotated[
        tuple[int, ...], Integer(least=2, words="integers >= 2"), FileLimit(1000)
    ] = ()


@dataclass(frozen=True)
class GroupOptions:
    """The greedy search for groups of recordings.

    Parameters
    ----------
    together : bool
        Whether all candidates make one group as well, and the closest group wins rather
        than the widest.
    """

    start: _Names = None
    candidates: _Names = None
    validate: _Names = None
    keep: Annotated[dict[str, int | bool | tuple[int, ...]], OneOf(KEEP_RULES)] = field(
        default_factory=lambda: {"top": 3}
    )
    max_level: Annotated[int, Integer(least=1), FileLimit(1000)] = 4
    together: bool = False
    warm_start: bool = True


@dataclass(frozen=True)
class FinalTestOptions:
    """Recordings that judge the final models and are used nowhere else."""

    recordings: Annotated[tuple[str, ...], *_SOME_NAMES]


@dataclass(frozen=True)
class NextLimits:
    """What a recording that is designed may do, in the unit of the input.

    Parameters
    ----------
    one_sided : bool
        Whether the input stays on the recorded ones' side of the level, as a heater's
        power.
    level : float
        Where it begins and ends, as at a valve's operating point.
    """

    amplitude: Annotated[float, POSITIVE]
    rate: Annotated[float, POSITIVE]
    duration_s: Annotated[float, POSITIVE]
    one_sided: bool = False
    level: Annotated[float, Number()] = 0.0


@dataclass(frozen=True)
class NextOptions:
    """Which recordings could be taken next, and what for.

    Parameters
    ----------
    plan : str or None
        Table of recordings that could be taken.
    limits : NextLimits or None
        Within which they are designed instead.
    enough : float, [-]
        Gain below which a recording is not worth taking: a share of the table of
        amplitudes and frequencies, by which standard errors shrink, or of what the output
        varies, by which a repeat lets the band of a further recording shrink.
    output_range : tuple of float, shape (2,), or None, [output unit]
        Lowest and highest output that a recording may reach, such as a travel.
    """

    goal: Annotated[str, OneOf(GOALS)] = "coverage"
    plan: str | None = None
    limits: NextLimits | None = None
    output_range: Annotated[tuple[float, float] | None, Interval()] = None
    number: Annotated[int, Integer(least=1), FileLimit(100)] = 3
    enough: Annotated[float, Number(above=0, most=1)] = 0.01


@dataclass(frozen=True)
class SimulationOptions:
    """The physics model that diagnosis judges, in SI units.

    A rotating axis is named by the keys that have an inertia, a torque or an angle in
    them, in place of those of a straight one.

    Parameters
    ----------
    known : dict of str to float, [-]
        Base parameters, by the names of either axis, that a re-fit may not move beyond
        this share of their value; 0 holds one fixed. The mass is held anyway, but where
        the input is the force itself.
    hold : str
        As for a drive; ``auto`` is a line, unless a diagnosis finds a held command.
    """

    # A section without a kind is one of these.
    IS_USUAL: ClassVar[bool] = True

    kind: Annotated[str, OneOf(["drive"])] = "drive"
    mass_kg: Annotated[float, POSITIVE] = 1.0
    damping_N_s_per_m: Annotated[float, NOT_NEGATIVE] = 0.0
    stiffness_N_per_m: Annotated[float, NOT_NEGATIVE] = 0.0
    force_constant_N_per_A: Annotated[float, POSITIVE] = 1.0
    effects: Annotated[dict[str, dict[str, float | str]], Repeatable()] = field(
        default_factory=dict
    )
    reference_current_A: Annotated[float | None, POSITIVE] = None
    reference_displacement_m: Annotated[float | None, POSITIVE] = None
    resistance_ohm: Annotated[float | None, POSITIVE] = None
    inductance_H: Annotated[float, NOT_NEGATIVE] = 0.0
    back_emf_V_s_per_m: Annotated[float | None, NOT_NEGATIVE] = None
    hold: Annotated[str, OneOf((UNSAID_HOLD, *HOLDS))] = UNSAID_HOLD
    controller: Controller | None = None
    known: Annotated[dict[str, float], NamesFor(KNOWN_TOLERANCE)] = field(
        default_factory=dict
    )

    output: Annotated[str, OneOf(OUTPUTS)] = "position"
    inertia_kg_m2: Annotated[float | None, POSITIVE] = None
    damping_N_m_s_per_rad: Annotated[float | None, NOT_NEGATIVE] = None
    stiffness_N_m_per_rad: Annotated[float | None, NOT_NEGATIVE] = None
    torque_constant_N_m_per_A: Annotated[float | None, POSITIVE] = None
    back_emf_V_s_per_rad: Annotated[float | None, NOT_NEGATIVE] = None

    @property
    def input_unit(self) -> str:
        """Unit that the input's numbers must have: a voltage drives a circuit."""
        return "A" if self.resistance_ohm is None else "V"

    @property
    def output_unit(self) -> str:
        """Unit that the output's numbers must have."""
        is_rotary = any(getattr(self, one) is not None for one in ROTARY_NAMES.values())
        is_speed = self.output == "velocity"
        return ("rad" if is_rotary else "m") + ("/s" if is_speed else "")

    def __post_init__(self) -> None:
        every = self.__dataclass_fields__
        check_axis(
            {
                name: getattr(self, name)
                for name in (*ROTARY_NAMES, *ROTARY_NAMES.values())
                if getattr(self, name) != every[name].default
            }
        )


@dataclass(frozen=True)
class DiagnoseOptions:
    """What diagnosis may use.

    Parameters
    ----------
    laws : str
        When a formula is looked for: where all effects may be named and something is
        left, in place of the catalogue, or never.
    max_runs : int or None
        Of a simulation of one's own: after so many of them no further way is tried; None
        means so many as the number of recordings asks for (``most_runs``).
    own_effects : dict of str to OwnEffect
        Formulas that are tried beside the catalogue; a section of their own in a file.
    """

    recordings: _Names = None
    hold_out: Annotated[
        Literal["auto"] | tuple[str, ...],
        OF_RECORDINGS,
        Filled("auto, or at least one recording"),
        Distinct(),
    ] = "auto"
    effects: Annotated[tuple[str, ...] | None, StandsFor("all", None), Distinct()] = (
        None
    )
    max_effects: Annotated[int, Integer(least=0), FileLimit(1000)] = 3
    max_runs: Annotated[int | None, StandsFor("auto", None), Integer(least=1)] = None
    laws: Annotated[str, OneOf(("auto", "only", "never"))] = "auto"
    initial_state: Annotated[str, OneOf(STARTS)] = "rest"
    skip_samples: Annotated[int, Integer(least=0)] = 0
    own_effects: dict[str, OwnEffect] = field(default_factory=dict, metadata=NO_KEY)


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
    source: str = field(metadata=NO_KEY)
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
    simulation: SimulationOptions | ForeignSimulation | None = None
    own_effects: dict[str, OwnEffect] = field(default_factory=dict)
    diagnose: DiagnoseOptions | None = None
    next: NextOptions | None = None
    thesis_names: bool = False

    @property
    def drive_simulation(self) -> SimulationOptions | None:
        """The simulation where it is the program's own drive."""
        found = self.simulation
        return found if isinstance(found, SimulationOptions) else None

    @property
    def foreign_simulation(self) -> ForeignSimulation | None:
        """The simulation where it is one of the user's own."""
        found = self.simulation
        return None if isinstance(found, SimulationOptions) else found
