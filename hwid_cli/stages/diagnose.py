"""Stage ``diagnose``: its key, its tasks from the cache, and what it leaves.

What a diagnosis does is in ``hwid_cli.diagnosis.diagnose``. Here as well: a diagnosis
in memory, for programs that hold recordings and write no results.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from math import nan
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from hwid_cli.config.extended_simulation import write_extended_simulation
from hwid_cli.config.simulation_checks import SIMULATION_EXAMPLE
from hwid_cli.data.units import in_unit
from hwid_cli.diagnosis import diagnose as pipeline
from hwid_cli.diagnosis import further_inputs
from hwid_cli.diagnosis.direction import ReversedInputError, reversal_sentence
from hwid_cli.diagnosis.foreign import MOST_SEARCHES, diagnose_foreign
from hwid_cli.diagnosis.hidden import HiddenEffect
from hwid_cli.diagnosis.simulator import most_runs
from hwid_cli.diagnosis.tasks import DiagnosisTask, OnRound, RunTasks
from hwid_cli.drive.simulation import are_loops_compiled
from hwid_cli.errors import CacheError, ConfigError
from hwid_cli.files.figure_files import read_figure, write_figure
from hwid_cli.records.check import StagePlan
from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.records.drive import UNSAID_HOLD, WINDING, DriveResponse, told_apart
from hwid_cli.records.experiment import DiagnoseOptions, Experiment, SimulationOptions
from hwid_cli.records.programs import ForeignSimulation
from hwid_cli.records.recordings import CalibrationLog, Recording
from hwid_cli.report.diagnosis import diagnosis_blocks
from hwid_cli.simulations.drive import simulate_recordings
from hwid_cli.simulations.kinds import kind_named
from hwid_cli.stages.diagnosis_seconds import LEAST_RUNS, time_diagnosis
from hwid_cli.stages.diagnosis_starts import (
    moving_sentence,
    moving_starts,
    with_rests,
)
from hwid_cli.stages.fit_seconds import counted
from hwid_cli.stages.foreign_simulation import (
    content_of,
    extended_foreign,
    in_units_of,
    placed,
    simulated,
    simulator_of,
    uncovered_by,
)
from hwid_cli.stages.selection import select_recordings
from hwid_cli.stages.simulation_units import (
    assumed_units,
    calibrated_in_simulation_units,
    doubtful_sizes,
    in_simulation_units,
    refused_sizes,
    refused_units,
)
from hwid_cli.stages.stage import Context, Planning, Runner, Stage, as_record
from hwid_cli.stages.swapped_signals import swapped_sentence
from hwid_cli.store.diagnosis_results import (
    read_diagnosis,
    write_diagnosis_json,
    write_diagnosis_tables,
)
from hwid_cli.store.final_test_results import write_trust_csv
from hwid_cli.store.result_files import Provenance
from hwid_cli.tasks.cache import MemoryStore, task_key
from hwid_cli.tasks.runner import RunSettings, Workers, run_tasks
from hwid_cli.tasks.task import Task, one_thread

NAME = "diagnose"
STAGE_VERSION = 62

_Answer = TypeVar("_Answer")


def diagnosis_key(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
) -> str:
    """Content key of a diagnosis: everything that its result depends on."""
    model = asdict(simulation)
    # Said only where there is something: keys without it stay as they were.
    if not model["known"]:
        del model["known"]
    return _key_of(recordings, model, options)


def _key_of(
    recordings: Sequence[Recording], model: dict[str, Any], options: DiagnoseOptions
) -> str:
    about = [
        {"name": one.name, "kind": one.kind, "sample_time_s": one.sample_time_s}
        for one in recordings
    ]
    arrays = [array for one in recordings for array in (one.input, one.output)]
    arrays += [one.reference for one in recordings if one.reference is not None]
    settings = {"recordings": about, "simulation": model, "options": options}
    return task_key(NAME, STAGE_VERSION, settings, arrays)


def diagnose_all(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    settings: RunSettings,
    on_stage: OnRound,
) -> Diagnosis:
    """Find what a simulation lacks.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    on_stage : callable
        Called with what begins and its number of tasks.
    """
    key = diagnosis_key(recordings, simulation, options)
    runner = _runner(key, settings)
    with one_thread():
        return pipeline.diagnose(recordings, simulation, options, runner, on_stage)


def _runner(key: str, settings: RunSettings) -> RunTasks:
    """Run the tasks of one diagnosis over the workers, memoised.

    Parameters
    ----------
    key : str
        Of the diagnosis.
    """

    def run(tasks: Sequence[DiagnosisTask], *, keep: bool) -> list[Any]:
        keyed = [
            Task(
                key=_fit_key(key, one) if keep else one.name,
                name=one.name,
                function=one.function,
                arguments=one.arguments,
                result_type=one.result_type,
            )
            for one in tasks
        ]
        chosen = settings if keep else replace(settings, store=MemoryStore())
        return [one.result for one in run_tasks(keyed, chosen)]

    return run


def _fit_key(key: str, task: DiagnosisTask) -> str:
    content = {"problem": key, **task.content}
    return task_key(NAME, STAGE_VERSION, content, task.arrays)


def extended_options(
    diagnosis: Diagnosis, simulation: SimulationOptions
) -> SimulationOptions:
    """Simulation with the effects that were found and the fitted base.

    Returns
    -------
    SimulationOptions
        With a re-fitted base only, where no effect was found.
    """
    base: dict[str, Any] = {one.name: one.after for one in diagnosis.base}
    is_own = simulation.inductance_H > 0 and WINDING not in simulation.effects
    for effect in diagnosis.present:
        if is_own and effect.id == WINDING:
            # The simulation has it among its own parameters.
            base["inductance_H"] = effect.parameters[0].value
    effects = [
        (
            effect.own or effect.id,
            {one.name: one.text or one.value for one in effect.parameters},
        )
        for effect in (*diagnosis.present, *diagnosis.effects)
        if not (is_own and effect.id == WINDING)
    ]
    return replace(
        simulation,
        **base,
        effects=told_apart(effects),
        hold=diagnosis.hold if simulation.hold == UNSAID_HOLD else simulation.hold,
        reference_current_A=diagnosis.reference_current_A,
        reference_displacement_m=diagnosis.reference_displacement_m,
    )


def diagnose(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions | None = None,
    *,
    jobs: int | None = 1,
    on_stage: OnRound = lambda what, total: None,
) -> Diagnosis:
    """Find what a simulation of a drive lacks, beside recordings of it.

    Parameters
    ----------
    recordings : sequence of Recording
        Inputs in ampere and outputs in metre unless the simulation is of other units;
        every name once.
    simulation : SimulationOptions
        The physics model, in SI units.
    options : DiagnoseOptions, optional
        Which recordings take part and are held out, which effects may be named.
    jobs : int or None, [-]
        Processes; None means one for each core.
    on_stage : callable
        Called with what begins and its number of tasks.

    Returns
    -------
    Diagnosis
        What ``hwid diagnose`` writes to ``diagnosis.json``: ``verdict``, ``effects``
        with their parameters, ``explained_share``, ``summary`` in words, and more.

    Raises
    ------
    ConfigError
        If the options name unknown recordings or leave none to train on.
    ValueError
        If two recordings have one name.

    Examples
    --------
    The simulation's spring is too soft; nothing else is wrong:

    >>> import numpy as np
    >>> from scipy import signal
    >>> from hwid_cli import Recording, SimulationOptions, diagnose
    >>> rng, time_s = np.random.default_rng(1), 1e-3 * np.arange(400)
    >>> plant = signal.lti([5.0], [0.3, 15.0, 1184.0])
    >>> def measured(size):
    ...     current = size * (time_s > 0.05)
    ...     position = signal.lsim(plant, current, time_s)[1]
    ...     noise = 2e-5 * rng.standard_normal(400)
    ...     return Recording(f"step_{size}", current, position + noise, 1e-3)
    >>> simulation = SimulationOptions(
    ...     mass_kg=0.3,
    ...     damping_N_s_per_m=15.0,
    ...     stiffness_N_per_m=1000.0,
    ...     force_constant_N_per_A=5.0,
    ... )
    >>> diagnosis = diagnose([measured(size) for size in (1, 2, -3)], simulation)
    >>> diagnosis.verdict
    'parameters'
    >>> stiffness = next(p for p in diagnosis.base if p.name == "stiffness_N_per_m")
    >>> abs(stiffness.after - 1184.0) < 5.0
    True
    """
    options = options or DiagnoseOptions()
    names = [one.name for one in recordings]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"two recordings are named {name!r}")
    chosen = in_simulation_units(
        select_recordings(recordings, options.recordings, key="recordings"), simulation
    )
    if not isinstance(options.hold_out, str):
        held_out = select_recordings(chosen, options.hold_out, key="hold_out")
        if len(held_out) == len(chosen):
            raise ConfigError(
                f"hold_out: names all {len(chosen)} recordings; expected at least one "
                "left to train on; take one out, or give 'auto'"
            )
    settings = RunSettings(MemoryStore(), Workers(jobs))
    return diagnose_all(chosen, simulation, options, settings, on_stage)


@dataclass(frozen=True, eq=False)
class ToDiagnose:
    """A simulation, and the recordings that it is compared with.

    Parameters
    ----------
    recordings : tuple of Recording
        In the units of the simulation.
    units : tuple of str
        Of input and output in the experiment, where they are others.
    """

    experiment: Experiment
    recordings: tuple[Recording, ...]
    simulation: SimulationOptions | ForeignSimulation
    options: DiagnoseOptions
    logs: tuple[CalibrationLog, ...] = ()
    units: tuple[str, ...] = ()

    @property
    def key(self) -> str:
        """Content key of the diagnosis: everything that its result depends on."""
        if isinstance(self.simulation, SimulationOptions):
            return diagnosis_key(self.recordings, self.simulation, self.options)
        content = content_of(self.simulation, self.experiment.source)
        return _key_of(self.recordings, content, self.options)

    @property
    def can_play_inputs(self) -> bool:
        """Whether what was found can be simulated on inputs that nobody has played."""
        simulation = self.simulation
        return isinstance(simulation, SimulationOptions) and not simulation.controller

    @property
    def extended(self) -> Callable[[Diagnosis], SimulationOptions | ForeignSimulation]:
        """From a diagnosis to the simulation with what was found."""
        given = self.simulation
        if isinstance(given, SimulationOptions):
            return lambda diagnosis: extended_options(diagnosis, given)
        return lambda diagnosis: extended_foreign(diagnosis, given)


def choose(context: Context) -> ToDiagnose:
    """Choose the recordings that a simulation is compared with.

    Raises
    ------
    ConfigError
        If the configuration has no simulation, names unknown recordings, leaves none to
        train on, or a signal is in a unit that contradicts the simulation.
    """
    calibrated = context.results["calibrate"]
    given = given_by(context.experiment, calibrated.recordings, calibrated.logs)
    if isinstance(given.simulation, SimulationOptions):
        refused = refused_sizes(
            given.experiment,
            given.recordings,
            given.simulation,
            given.options,
            given.logs,
        )
        if refused:
            raise ConfigError(refused)
    return given


def given_by(
    experiment: Experiment,
    recordings: Sequence[Recording],
    logs: tuple[CalibrationLog, ...],
) -> ToDiagnose:
    """The same of calibrated recordings."""
    simulation = _simulation(experiment)
    options = experiment.diagnose or DiagnoseOptions()
    options = replace(options, own_effects=experiment.own_effects)
    place = f"{experiment.source}: diagnose"
    names = options.recordings
    if names is None:
        names = uncovered_by(simulation, [one.name for one in recordings])
    recordings = select_recordings(
        recordings,
        names,
        key=f"{place}.recordings",
    )
    first = recordings[0]
    units = (first.input_unit, first.output_unit)
    recordings, logs = calibrated_in_simulation_units(simulation, recordings, logs)
    if not isinstance(simulation, SimulationOptions):
        simulation = in_units_of(simulation, recordings[0])
    if not isinstance(options.hold_out, str):
        held_out = select_recordings(
            recordings, options.hold_out, key=f"{place}.hold_out"
        )
        if len(held_out) == len(recordings):
            raise ConfigError(
                f"{place}.hold_out: names all {len(recordings)} recordings; expected "
                "at least one left to train on; take one out, or write 'auto'"
            )
    for refused in refused_units(experiment, recordings, logs):
        raise ConfigError(refused)
    if isinstance(simulation, SimulationOptions):
        recordings = tuple(with_rests(recordings, logs))
    return ToDiagnose(experiment, recordings, simulation, options, logs, units)


def _simulation(experiment: Experiment) -> SimulationOptions | ForeignSimulation:
    if experiment.simulation is None:
        raise ConfigError(
            f"{experiment.source}: simulation: missing; expected the physics model that "
            f"is compared with the recordings; add it, such as '{SIMULATION_EXAMPLE}'"
        )
    foreign = experiment.foreign_simulation
    return (
        experiment.simulation if foreign is None else placed(foreign, experiment.source)
    )


def _warnings(context: Context, given: ToDiagnose) -> list[str]:
    """What the units are taken for, and which recordings a cut begins in motion."""
    recordings, simulation, options = given.recordings, given.simulation, given.options
    if not isinstance(simulation, SimulationOptions):
        said = [_announcement(simulation)]
        total = len(context.results["calibrate"].recordings)
        if options.recordings is None and len(recordings) < total:
            shown = ", ".join(one.name for one in recordings)
            said.append(
                f"diagnosed are the {len(recordings)} of {total} recordings that "
                f"{getattr(simulation, 'name', '')} does not cover: {shown}; "
                "diagnose.recordings names others"
            )
        return said
    said = [
        assumed_units(given.experiment, recordings, given.logs),
        doubtful_sizes(given.experiment, recordings, simulation, options, given.logs),
    ]
    moving = moving_starts(recordings, given.logs, simulation, options)
    if sentence := moving_sentence(moving, recordings):
        said.append(f"{context.experiment.source}: {sentence}")
    if simulation.controller is None and "identify" not in context.results:
        said.append(swapped_sentence(recordings, str(context.experiment.source)))
    return [one for one in said if one]


def simulated_recordings(given: ToDiagnose) -> tuple[DriveResponse, ...]:
    """What the simulation makes of the recordings, with the given parameters."""
    simulation = given.simulation
    if not isinstance(simulation, SimulationOptions):
        # Files and programs that are missing are told before anything runs.
        content_of(simulation, given.experiment.source)
        return simulated(simulation, given.recordings, given.logs, given.options)
    return simulate_recordings(given.recordings, simulation, given.options)


def _announcement(simulation: ForeignSimulation) -> str:
    """What is going to run, and what a diagnosis may do with it."""
    kind = kind_named(simulation.kind)
    able = kind.capabilities(simulation)
    can = [
        word
        for word, is_so in (
            ("other inputs", able.run),
            ("other parameters", able.parameters),
            ("a force input", able.force),
            ("single steps", able.step),
        )
        if is_so
    ]
    words = ", ".join(can) or "nothing: only its outputs are compared"
    what = kind.own_code(simulation)
    runs = f"runs {what}" if able.run and what else "runs nothing of yours"
    return f"simulation.kind {simulation.kind}: {runs}; it can be given {words}"


def _compute(given: ToDiagnose, runner: Runner) -> Diagnosis:
    with runner.rounds("tasks") as (settings, begin_round), one_thread():
        return _diagnosed(given, _runner(given.key, settings), begin_round)


def _diagnosed(given: ToDiagnose, run: RunTasks, on_round: OnRound) -> Diagnosis:
    recordings, simulation, options = given.recordings, given.simulation, given.options
    if isinstance(simulation, SimulationOptions):
        try:
            return pipeline.diagnose(recordings, simulation, options, run, on_round)
        except ConfigError as error:
            source = given.experiment.source
            said = str(error)
            read = given.experiment.recordings
            if isinstance(error, ReversedInputError) and read is not None:
                said = reversal_sentence(error.found, input_scale=read.input_scale)
            raise ConfigError(f"{source}: {said}") from None
    simulator = simulator_of(simulation, recordings, given.logs)
    return diagnose_foreign(recordings, simulator, options, run, on_round)


def undecided(
    given: ToDiagnose, runner: Runner, inputs: Sequence[np.ndarray]
) -> further_inputs.Separations:
    """How far inputs bring the candidates apart that a diagnosis leaves undecided.

    Parameters
    ----------
    inputs : sequence of ndarray, shape (n_samples,), [input unit of the experiment]
        At the sample time of the recordings.

    Raises
    ------
    ConfigError
        If the simulation is not the program's own drive.
    """
    return _on_inputs(given, runner, inputs, further_inputs.separations)


def answers(
    given: ToDiagnose, runner: Runner, inputs: Sequence[np.ndarray]
) -> list[tuple[np.ndarray, ...]]:
    """What the candidates that a diagnosis leaves answer to inputs.

    Parameters
    ----------
    inputs : sequence of ndarray, shape (n_samples,), [input unit of the experiment]
        At the sample time of the recordings.

    Raises
    ------
    ConfigError
        If the simulation is not the program's own drive.
    """
    found = _on_inputs(given, runner, inputs, further_inputs.answers)
    unit = given.recordings[0].output_unit
    own = given.units[1] if given.units else unit
    return [tuple(in_unit(one, unit, own) for one in each) for each in found]


def hidden(
    given: ToDiagnose, runner: Runner, inputs: Sequence[np.ndarray]
) -> list[HiddenEffect]:
    """How well inputs show effects that a diagnosis does not name.

    Parameters
    ----------
    inputs : sequence of ndarray, shape (n_samples,), [input unit of the experiment]
        At the sample time of the recordings.

    Raises
    ------
    ConfigError
        If the simulation is not the program's own drive.
    """
    return _on_inputs(given, runner, inputs, further_inputs.hidden)


def _on_inputs(
    given: ToDiagnose,
    runner: Runner,
    inputs: Sequence[np.ndarray],
    ask: Callable[..., _Answer],
) -> _Answer:
    """Ask the pipeline of a diagnosis about inputs."""
    simulation, options = given.simulation, given.options
    if not isinstance(simulation, SimulationOptions):
        raise ConfigError(
            f"{given.experiment.source}: next.goal: diagnosis of a simulation.kind "
            f"{simulation.kind}; expected drive, whose candidates can be simulated on "
            "other inputs; choose the goal coverage"
        )
    recordings = given.recordings
    unit = recordings[0].input_unit
    own = given.units[0] if given.units else unit
    inputs = [in_unit(one, own, unit) for one in inputs]
    key = diagnosis_key(given.recordings, simulation, options)
    with runner.rounds("tasks") as (settings, begin_round), one_thread():
        return ask(
            recordings, simulation, options, inputs, _runner(key, settings), begin_round
        )


def _write_files(
    out: Path,
    given: ToDiagnose,
    diagnosis: Diagnosis,
    origin: Provenance | None,
    is_new: bool,
) -> None:
    """Write the JSON file, the tables, the extended simulation and the figures."""
    if origin is None:
        raise ValueError("a diagnosis is always stored")
    path = out / "diagnosis.json"
    figures = None if is_new else _drawn_before(out, origin)
    if figures is None:
        figures = _draw(out / "figures", diagnosis, origin.key)
    units = dict.fromkeys(one for log in given.logs for one in log.units)
    write_diagnosis_json(
        path, diagnosis, origin.seconds, origin, figures=figures, units=list(units)
    )
    write_diagnosis_tables(out, diagnosis)
    write_trust_csv(out / "diagnosis_trust.csv", diagnosis.bands.rows)
    write_extended_simulation(
        out / "extended_simulation.yaml",
        given.experiment,
        given.extended(diagnosis),
    )


def _drawn_before(out: Path, origin: Provenance) -> list[str] | None:
    """Names of the figures of this very run, if all of them are still there."""
    try:
        found = read_diagnosis(out / "diagnosis.json") or {}
    except CacheError:
        return None
    about, names = found.get("provenance") or {}, found.get("figures") or []
    # Seconds tell one run from another one with the same key (--force).
    is_same = about.get("key") == origin.key and found.get("seconds") == origin.seconds
    folder, told = out / "figures", origin.key
    is_there = all(read_figure(folder / name, told) is not None for name in names)
    return names if is_same and names and is_there else None


def _draw(folder: Path, diagnosis: Diagnosis, about: str) -> list[str]:
    # Loading what draws takes longer than reading what is drawn already.
    from hwid_cli.report import plots
    from hwid_cli.report.figures.diagnosis import diagnosis_figures

    figures = diagnosis_figures(diagnosis)
    drawn = {f"{name}.png": plots.as_png(figure) for name, figure in figures.items()}
    for path in folder.glob("diagnosis_*.png"):
        # Another verdict may have fewer figures.
        if path.name not in drawn:
            path.unlink()
    for name, png in drawn.items():
        write_figure(folder / name, png, about)
    return sorted(drawn)


def _plan(planning: Planning) -> tuple[StagePlan, ...]:
    """What a diagnosis takes: with a single effect, and with all rounds of its search."""
    given = given_by(planning.experiment, planning.recordings, planning.logs)
    n = len(given.recordings)
    what = f"{counted(n, 'recording')}, as many effects as diagnose.effects allows"
    # A first run compiles its loops, which would be all that is timed.
    if not (planning.may_time and are_loops_compiled()):
        return (StagePlan(NAME, what, n, None, nan, 1e6),)
    found = time_diagnosis(
        lambda run, on_round: _diagnosed(given, run, on_round),
        n,
        given.options.max_effects,
        planning.workers,
        searches=pipeline.MOST_SEARCHES
        if isinstance(given.simulation, SimulationOptions)
        else MOST_SEARCHES,
        may_be_law=given.options.laws != "never",
    )
    what = f"{counted(n, 'recording')} x {counted(found.n_tasks, 'effect')}"
    if found.by_runs:
        what = f"{counted(n, 'recording')}; {LEAST_RUNS} to {most_runs(None, n)} runs of the simulation"
    elif not found.n_tasks:
        what = f"{counted(n, 'recording')}; no effect is looked for"
    why = "one effect is not enough and the search is repeated"
    if given.options.laws != "never":
        why += ", or laws are searched for"
    return (
        StagePlan(
            NAME,
            what,
            found.n_tasks,
            None,
            found.seconds,
            1e6,
            found.most_seconds,
            why,
            is_shared=True,
        ),
    )


STAGE = Stage(
    name="diagnose",
    needs=("calibrate",),
    sections=("simulation", "diagnose"),
    require=_simulation,
    choose=choose,
    key=lambda given: given.key,
    compute=_compute,
    storage=as_record(NAME, Diagnosis),
    summary=lambda given, result, is_stored: (
        f"{counted(len(given.recordings), 'recording')} from the cache"
        if is_stored
        else ""
    ),
    write_files=_write_files,
    tables=lambda context, result: diagnosis_blocks(
        result,
        () if context.experiment.test is None else context.experiment.test.recordings,
    ),
    files=(
        "diagnosis.json",
        "ranking.csv",
        "where.csv",
        "gaps.csv",
        "diagnosis_trust.csv",
        "extended_simulation.yaml",
        "figures",
    ),
    warnings=_warnings,
    plan=_plan,
)
