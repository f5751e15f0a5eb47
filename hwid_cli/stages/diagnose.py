"""Stage ``diagnose``: what a simulation of the drive lacks, and what shows it.

The base is re-fitted first, because wrong parameters are not a missing effect; then
effects of the catalogue are tried, alone and in sets; held-out recordings decide.
docs/method_diagnosis.md.

A diagnosis in memory, for programs that hold recordings and write no results.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from hwid_cli.diagnosis.candidate import Footing, fit_candidate, fitted_drive, rebuilt
from hwid_cli.diagnosis.findings import Findings, describe
from hwid_cli.diagnosis.noise import noise_floor
from hwid_cli.diagnosis.parameters import compare, first_point, layout
from hwid_cli.diagnosis.problem import (
    Compared,
    Problem,
    held_out_names,
    prepare,
    scales,
)
from hwid_cli.diagnosis.rounds import (
    STAGE,
    STAGE_VERSION,
    Announce,
    Found,
    Rounds,
    run_rounds,
)
from hwid_cli.diagnosis.scales import line_frequencies, line_share, scales_of
from hwid_cli.diagnosis.search import fit_own
from hwid_cli.diagnosis.selection import Judge
from hwid_cli.drive.catalogue import CATALOGUE, public_id
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.errors import ConfigError
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import Diagnosis, NoiseFloor
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.selection import select_recordings
from hwid_cli.tasks.cache import MemoryStore, task_key
from hwid_cli.tasks.runner import RunSettings, Workers
from hwid_cli.tasks.task import one_thread

# A line that takes this share of what the base leaves is no colour of noise.
LINE_SHARE = 0.3


def diagnosis_key(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
) -> str:
    """Content key of a diagnosis: everything that its result depends on."""
    about = [
        {"name": one.name, "kind": one.kind, "sample_time_s": one.sample_time_s}
        for one in recordings
    ]
    arrays = [array for one in recordings for array in (one.input, one.output)]
    arrays += [one.reference for one in recordings if one.reference is not None]
    settings = {"recordings": about, "simulation": simulation, "options": options}
    return task_key(STAGE, STAGE_VERSION, settings, arrays)


def diagnose_all(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    settings: RunSettings,
    on_stage: Announce,
) -> Diagnosis:
    """Find what a simulation lacks.

    Parameters
    ----------
    recordings : sequence of Recording
        At least one.
    on_stage : callable
        Called with what begins and its number of tasks.
    """
    with one_thread():
        return _diagnose(recordings, simulation, options, settings, on_stage)


def _diagnose(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions,
    settings: RunSettings,
    on_stage: Announce,
) -> Diagnosis:
    held_out = (
        held_out_names(recordings)
        if isinstance(options.hold_out, str)
        else options.hold_out
    )
    problem = prepare(recordings, simulation, options, held_out)
    noise = noise_floor(problem)
    on_stage("base", 0)
    given = compared_as_given(problem)
    sizes = scales(problem, [one.velocity for one in given])
    base = _base(problem, sizes, noise)
    if _shakes_at_rest(problem, base, sizes, noise):
        noise = noise_floor(problem, rests=False)
        base = _base(problem, sizes, noise)
    judge = Judge.of(problem, noise)
    found = Found((), (), {})
    if base.is_usable:
        sizes = scales_of(problem, base, sizes, noise)
    if base.is_usable and not judge.is_complete(base):
        rounds = Rounds(
            problem=problem,
            key=diagnosis_key(recordings, simulation, options),
            footing=Footing(
                fitted_drive(problem.drive, base), sizes, noise, problem.drive
            ),
            judge=judge,
            base=base,
            allowed=_allowed(problem, options),
            settings=settings,
            announce=on_stage,
        )
        found = run_rounds(rounds, options.max_effects)
    on_stage("verdict", 0)
    return describe(Findings(problem, noise, judge, sizes, given, base, found))


def _base(problem: Problem, sizes: Scales, noise: NoiseFloor) -> CandidateFit:
    """Base, and the effects that the simulation has already, fitted again."""
    present = drive_effects(problem.drive)
    return fit_candidate(problem, (), [present], Footing(problem.drive, sizes, noise))


def _shakes_at_rest(
    problem: Problem, base: CandidateFit, sizes: Scales, noise: NoiseFloor
) -> bool:
    """Whether the colour at rest is a line that goes on all the time: motion."""
    if not (noise.is_coloured and noise.method == "rest" and base.is_usable):
        return False
    compared = compare(problem, *rebuilt(problem, base, sizes))
    white = replace(noise, whitening=(1.0,))
    line = line_frequencies(compared, white)[0]
    return line_share(compared, line) > LINE_SHARE


def compared_as_given(problem: Problem) -> list[Compared]:
    """Simulate with the parameters that the configuration gives.

    What belongs to one recording alone (a start, a phase) is found from it.
    """
    present = drive_effects(problem.drive)
    speeds = [
        np.gradient(signals.output, signals.sample_time_s)
        for signals in problem.signals
    ]
    rough = scales(problem, speeds)
    fit_layout = layout(problem, tuple(present), present, rough)
    point = first_point(problem, fit_layout, problem.drive, present)
    own = fit_own(problem, fit_layout, point.shared)
    return compare(problem, fit_layout, own)


def _allowed(problem: Problem, options: DiagnoseOptions) -> tuple[str, ...]:
    """Ids that may be named: those asked for that make sense for this drive."""
    wanted = options.effects
    has_spring = problem.drive.stiffness_N_per_m > 0
    several = len(problem.part(held_out=False).signals) > 2
    return tuple(
        name
        for name, effect in CATALOGUE.items()
        if (wanted is None or public_id(name) in wanted)
        and public_id(name)
        not in {public_id(one) for one in drive_effects(problem.drive)}
        and (has_spring or not effect.needs_spring)
        and (several or not any(one.is_own for one in effect.parameters))
        and not (problem.compares_command and effect.enters == "output")
    )


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
    effects: dict[str, dict[str, float | str]] = {}
    for effect in (*diagnosis.present, *diagnosis.effects):
        effects[effect.id] = {
            one.name: one.text or one.value for one in effect.parameters
        }
    return replace(
        simulation,
        **base,
        effects=effects,
        reference_current_A=diagnosis.reference_current_A,
        reference_displacement_m=diagnosis.reference_displacement_m,
    )


def diagnose(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions | None = None,
    *,
    jobs: int | None = 1,
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
    chosen = select_recordings(recordings, options.recordings, key="recordings")
    if not isinstance(options.hold_out, str):
        held_out = select_recordings(chosen, options.hold_out, key="hold_out")
        if len(held_out) == len(chosen):
            raise ConfigError(
                f"hold_out: names all {len(chosen)} recordings; expected at least one "
                "left to train on; take one out, or give 'auto'"
            )
    settings = RunSettings(MemoryStore(), Workers(jobs))
    return diagnose_all(chosen, simulation, options, settings, lambda what, total: None)
