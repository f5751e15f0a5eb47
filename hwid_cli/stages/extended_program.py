"""The simulation of a user's own with the effects that its diagnosis found inside."""

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from hwid_cli.diagnosis.foreign import stand_in_for
from hwid_cli.diagnosis.problem import Signals
from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.records.drive import Drive
from hwid_cli.records.programs import Program, RunRequest
from hwid_cli.simulations.extended import ExtendedSimulation, run_extended
from hwid_cli.simulations.kinds import kind_named
from hwid_cli.stages.diagnose import ToDiagnose
from hwid_cli.stages.foreign_simulation import (
    extended_foreign,
    in_turn,
    simulator_of,
)


def extended_program(
    diagnosis: Diagnosis, given: ToDiagnose, program: Program
) -> tuple[ExtendedSimulation, str]:
    """Simulation with effects inside, and how well it reproduces the diagnosis.

    Parameters
    ----------
    program : PythonSimulation or FmuSimulation
        As it was diagnosed.
    """
    section: Any = extended_foreign(diagnosis, program)
    simulator = simulator_of(section, given.recordings, given.logs)
    plain, signals = stand_in_for(given.recordings, simulator, given.options, in_turn)
    base: dict[str, Any] = {} if program.free else _changed(plain, diagnosis)
    stand_in = replace(
        plain,
        **base,
        effects=section.effects,
        reference_current_A=diagnosis.reference_current_A,
        reference_displacement_m=diagnosis.reference_displacement_m,
    )
    extended = ExtendedSimulation(section, plain, stand_in)
    return extended, _exactness(extended, signals, diagnosis)


def _changed(plain: Drive, diagnosis: Diagnosis) -> dict[str, float]:
    """What stands in for parameters that nobody can reach, as shares of the stand-in."""
    return {
        one.name: getattr(plain, one.name) * one.after / one.before
        for one in diagnosis.base
        if one.before
    }


def _exactness(
    extended: ExtendedSimulation, signals: Sequence[Signals], diagnosis: Diagnosis
) -> str:
    """What it leaves of the recordings, beside what the diagnosis left."""
    base = extended.base
    run: Any = kind_named(base.kind).run
    left, shares = [], []
    for one in signals:
        request = RunRequest(
            one.name, one.sample_time_s, one.driven_by, np.zeros(0), base.values
        )
        found = run_extended(
            partial(run, base),
            request,
            (extended.plain, extended.stand_in),
            has_force=base.force_input is not None,
        )
        left.append((one.compared - found.output)[one.evaluated])
        shares.append(found.disagreement)
    rms = float(np.sqrt(np.mean(np.concatenate(left) ** 2)))
    said = float(np.sqrt(np.mean([one.rms_after**2 for one in diagnosis.gaps])))
    return (
        f"on the recordings of the diagnosis it leaves {rms:.3g} (RMS, unit of the "
        f"output);\nthe diagnosis left {said:.3g}. Its last two runs differed by at most "
        f"{max(shares):.2%}\nof what the effects do."
    )
