"""The stages of an experiment, in the order in which they work: the only list of them.

Light, so that ``hwid --help`` stays fast: the module of a stage is loaded when somebody
asks for it.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from hwid_cli.records.experiment import Experiment
    from hwid_cli.stages.stage import Stage

# Name of each stage, which its module and its section have too, and what its command's
# help says; the first line stands in the list of commands.
STAGES = {
    "simulate": """Make virtual measurements, or simulate what was measured.

With a simulate: section, writes raw/*.csv, as raw as measured ones, and
raw/plan.csv, which says how each was made. With a simulation: section,
computes what that physics model makes of the input of every recording, writes
simulated/*.csv and shows the distance to what was measured.
""",
    "calibrate": """Cut recordings to their useful part and take offsets off.

Reads the raw recordings, applies the recipe of each kind, replaces damaged
samples (alone or in pairs), and writes calibrated.h5 and a figure before/after
of each recording.
""",
    "identify": """Fit a model to every recording for every pair of orders.

Writes the models to results.h5:/identify and shows the three best of each
recording.
""",
    "crossval": """Validate every model on every recording.

Writes the tensor of RMSDs to results.h5:/crossval, and crossval.csv,
coverage.csv and crossval_trust.csv. Shows the models that cover the most
recordings.
""",
    "order": """Recommend orders and maps, and say why.

Takes the smallest orders that predict other recordings about as well as the
best of the grid, and compares them with AIC, BIC, and the delay and poles
that the data show by themselves. Writes order.csv. Where the section 'order'
names maps or units, fits every pair of them with these orders and recommends
one in the same way; writes maps.csv.
""",
    "group": """Join recordings into models that cover more, level by level.

Writes the search to results.h5:/group and groups.csv, and shows the coverage
of every group that was tried.
""",
    "test": """Judge the final models on recordings that were never used.

Judges the widest model of each recording and the chain of groups on all
recordings. Writes results.h5:/test, test.csv, assignment.csv and
coverage_matrix.csv, and shows the trend along the chain, what covers what,
and which model serves which recording.
""",
    "diagnose": """Find what a physics simulation of the drive lacks.

Compares the simulation with the recordings, names the missing effect, adds
it, and shows what is left on recordings that were held out; or says that
nothing is missing, or that nothing known explains the gap. Writes
diagnosis.json, ranking.csv, where.csv, gaps.csv, diagnosis_trust.csv,
extended_simulation.yaml, results.h5:/diagnose and figures.
""",
    "next": """Say which recordings to take next, or that enough is known.

Chooses from a plan, or designs within limits, the recordings that teach most:
for coverage, for the parameters of a model, or to tell the candidates of an
ambiguous diagnosis apart. Writes next.csv, next.json and next/*.csv, inputs
that are ready to play.
""",
}


def stage_named(name: str) -> "Stage":
    """Load a stage.

    Parameters
    ----------
    name : str
        One of ``STAGES``.
    """
    stage: Stage = import_module(f"hwid_cli.stages.{name}").STAGE
    return stage


def needed(name: str, experiment: "Experiment | None" = None) -> tuple[str, ...]:
    """Name the stages that must have run before one, in their order.

    Parameters
    ----------
    experiment : Experiment, optional
        Without it, also those that only some configurations ask for.
    """
    found: set[str] = set()
    stage = stage_named(name)
    asked = [
        one
        for one in stage.needs_where_named
        if experiment is None or is_named(one, experiment)
    ]
    if experiment is not None:
        asked += stage.needs_for(experiment)
    for before in (*stage.needs, *asked):
        found |= {before, *needed(before, experiment)}
    return tuple(one for one in STAGES if one in found)


def is_named(name: str, experiment: "Experiment") -> bool:
    """Whether a configuration has the section of a stage."""
    return getattr(experiment, name) is not None


def named(experiment: "Experiment") -> tuple[str, ...]:
    """Stages whose sections a configuration has, in the order in which they work."""
    return tuple(one for one in STAGES if is_named(one, experiment))


def none_named(experiment: "Experiment") -> str:
    """What to say of a configuration that names no stage; empty where it names one."""
    if named(experiment):
        return ""
    section = "crossval" if experiment.simulation is None else "diagnose"
    return (
        f"{experiment.source}: names no stage; expected some of {', '.join(STAGES)}; "
        f"add the section of what is to be done, such as '{section}: {{}}'"
    )


def to_run(experiment: "Experiment") -> tuple[str, ...]:
    """Stages that ``hwid run`` would run: the named ones, and those that they need."""
    found = {"calibrate"}
    for one in named(experiment):
        found |= {one, *needed(one, experiment)}
    return tuple(one for one in STAGES if one in found)
