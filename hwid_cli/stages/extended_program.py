"""The simulation of a user's own with the effects that its diagnosis found inside."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from hwid_cli.diagnosis.problem import Signals
from hwid_cli.diagnosis.stand_in import with_change
from hwid_cli.diagnosis.standing import as_given, stand_in_for
from hwid_cli.errors import SimulationError
from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.records.programs import Program, RunRequest
from hwid_cli.records.units import as_percent
from hwid_cli.simulations.extended import ExtendedRun, ExtendedSimulation, run_extended
from hwid_cli.simulations.kinds import kind_named
from hwid_cli.stages.diagnose import ToDiagnose
from hwid_cli.stages.fit_seconds import counted
from hwid_cli.stages.foreign_simulation import (
    extended_foreign,
    in_turn,
    simulator_of,
)

# What is added step by step may differ from the extended simulation by this share of what
# the effects do; more is no export of it.
_MOST_DIFFERENCE = 0.05


@dataclass(frozen=True, eq=False)
class ExtendedProgram:
    """A simulation with effects inside, and the recordings that it was made beside."""

    extended: ExtendedSimulation
    signals: tuple[Signals, ...]


def extended_program(
    diagnosis: Diagnosis, given: ToDiagnose, program: Program
) -> ExtendedProgram:
    """Simulation with effects inside.

    Parameters
    ----------
    program : PythonSimulation, FmuSimulation or CommandSimulation
        As it was diagnosed.
    """
    section: Any = extended_foreign(diagnosis, program)
    simulator = simulator_of(section, given.recordings, given.logs)
    # What is exported holds a drive with a straight spring.
    begun = as_given(given.recordings, simulator, given.options, in_turn)
    plain = stand_in_for(begun, may_curve=False)
    stand_in = replace(
        with_change(plain, section.stand_in),
        effects=section.effects,
        reference_current_A=diagnosis.reference_current_A,
        reference_displacement_m=diagnosis.reference_displacement_m,
    )
    extended = ExtendedSimulation(section, plain, stand_in)
    return ExtendedProgram(extended, begun.lowered)


def _run_of(extended: ExtendedSimulation) -> Callable[[RunRequest], ExtendedRun]:
    base = extended.base
    run: Any = kind_named(base.kind).run
    return partial(
        run_extended,
        partial(run, base),
        drives=(extended.plain, extended.stand_in),
        has_force=base.force_input is not None,
    )


def _request(one: Signals, base: Program) -> RunRequest:
    nothing = np.zeros(0)
    return RunRequest(one.name, one.sample_time_s, one.driven_by, nothing, base.values)


def exactness_of(program: ExtendedProgram, diagnosis: Diagnosis) -> str:
    """What it leaves of the recordings, beside what the diagnosis left, in words."""
    run, base = _run_of(program.extended), program.extended.base
    left, shares = [], []
    for one in program.signals:
        found = run(_request(one, base))
        left.append((one.compared - found.output)[one.evaluated])
        shares.append(found.disagreement)
    rms = float(np.sqrt(np.mean(np.concatenate(left) ** 2)))
    said = float(np.sqrt(np.mean([one.rms_after**2 for one in diagnosis.gaps])))
    return (
        f"on the recordings of the diagnosis it leaves {rms:.3g} (RMS, unit of the "
        f"output);\nthe diagnosis left {said:.3g}. Its last two runs differed by at most "
        f"{as_percent(max(shares), 2)}\nof what the effects do."
    )


def told_difference(program: ExtendedProgram, path: Path) -> str:
    """How far an exported FMU is from the extended simulation, in words.

    Parameters
    ----------
    path : Path
        The FMU; it is run on all recordings.

    Raises
    ------
    SimulationError
        If it differs by more than a twentieth of what the effects do.
    """
    base: Any = program.extended.base
    plain: Any = kind_named(base.kind).run
    exported, run = replace(base, file=str(path)), _run_of(program.extended)
    off, size = 0.0, 0.0
    for one in program.signals:
        request = _request(one, base)
        known = run(request).output
        off += float(np.sum((plain(exported, request).output - known) ** 2))
        size += float(np.sum((plain(base, request).output - known) ** 2))
    share = float(np.sqrt(off / size)) if size > 0 else 0.0
    if share > _MOST_DIFFERENCE:
        raise SimulationError(
            f"--format fmu: {path.name} differs from the extended simulation by "
            f"{as_percent(share)} of what the effects do; expected at most {as_percent(_MOST_DIFFERENCE)}; "
            "use --format python"
        )
    return (
        f"{path.name} differs from the extended simulation by {as_percent(share, 2)} of what the "
        f"effects do, on {counted(len(program.signals), 'recording')}"
    )
