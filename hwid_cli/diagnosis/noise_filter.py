"""A second look behind a filter, where noise of the input hides what is missing.

On a free axis noise of the measured input adds up to far more than the sensor's noise, and
whole recordings tell little of what else is missing. The filter of the re-fitted base
leaves of each sample what those before it do not tell: there the same effect shows far
above the noise. docs/method_diagnosis.md, eq. (D27b).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from hwid_cli.diagnosis.candidate import rebuilt
from hwid_cli.diagnosis.input_noise import LESS_NOISE, told_input_rms
from hwid_cli.diagnosis.noise import noise_levels
from hwid_cli.diagnosis.parameters import drives_at, residuals_at
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.diagnosis.tasks import DiagnosisTask, RunTasks
from hwid_cli.diagnosis.whitening_filters import noisy_drives
from hwid_cli.drive.effect import Scales
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.drive import Drive

# Noise of the input that moves the drive by so many times the noise of the output hides
# what is missing.
_HIDES = 2.0


def with_noise_filter(
    problem: DiagnosisProblem, drive: Drive, noise: NoiseFloor
) -> DiagnosisProblem | None:
    """The same recordings, judged behind a filter; None where that noise hides nothing.

    Parameters
    ----------
    drive : Drive
        With the re-fitted base.
    """
    if problem.is_filtered or problem.compares_command:
        return None
    has_one_size = not noise.is_coloured and np.ptp(noise_levels(problem, noise)) == 0
    if noise.input_rms <= 0 or noise.rms <= 0 or not has_one_size:
        return None
    drives = noisy_drives(
        [drive] * len(problem.signals), problem.signals, are_whole=True
    )
    pairs = list(zip(drives, problem.signals, strict=True))
    moved = [one.moved(signals.n_evaluated)[0] for one, signals in pairs]
    if noise.input_rms * np.sqrt(np.median(moved)) < _HIDES * noise.rms:
        return None
    filters = [one.whitening((noise.input_rms / noise.rms) ** 2) for one in drives]
    signals = tuple(
        replace(one, noise_filter=found)
        for one, found in zip(problem.signals, filters, strict=True)
        if found is not None
    )
    is_whole = len(signals) == len(problem.signals)
    return replace(problem, signals=signals) if is_whole else None


def holds_that_noise(
    whole: DiagnosisProblem, found: CandidateFit, scales: Scales, noise: NoiseFloor
) -> bool:
    """Whether what is left of whole recordings holds as much noise of the input as assumed.

    The live command of a controller is as rough as noise, and the machine follows it.

    Parameters
    ----------
    whole : DiagnosisProblem
        Without the filter.
    noise : NoiseFloor
        That the filter is made for.
    """
    fit_layout, point = rebuilt(whole, found, scales)
    parts = residuals_at(whole, fit_layout, point)
    told = told_input_rms(parts, whole, drives_at(whole, fit_layout, point), noise)
    return told >= LESS_NOISE * noise.input_rms


def filtered_sentence(noise: NoiseFloor, input_unit: str) -> str:
    """What counts as noise behind the filter."""
    return (
        f"{noise.sentence}; noise of the input, {noise.input_rms:.2g} {input_unit}, adds "
        "up along a free axis, and a filter takes that out of all errors"
    )


def plain_errors_sentence(before: float, after: float, unit: str) -> str:
    """What whole recordings differ by, of which the filter takes most out.

    Parameters
    ----------
    before, after : float, [output unit]
        With the re-fitted base, and with what is named.
    """
    return (
        "errors are those behind a filter for noise of the input; whole recordings differ "
        f"from the simulation by {before:.3g} {unit} with the re-fitted base and by "
        f"{after:.3g} {unit} at last"
    )


@dataclass(frozen=True, eq=False)
class FilteredTasks:
    """Runs tasks of problems with a filter, which are others than those without."""

    run_tasks: RunTasks
    problem: DiagnosisProblem

    def __call__(self, tasks: Sequence[DiagnosisTask], *, keep: bool) -> list[Any]:
        """Results in the order of the tasks."""
        filters = [one.noise_filter for one in self.problem.signals]
        arrays = [one.numbers for one in filters if one is not None]
        marked = [
            replace(
                one,
                content={**one.content, "filter": "noise"},
                arrays=(*one.arrays, np.concatenate(arrays)),
            )
            for one in tasks
        ]
        return self.run_tasks(marked, keep=keep)
