"""What could be recorded next: inputs of a plan, or designed ones, and what is odd about them.

References
----------
docs/trust.md.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from hwid_cli.data.recording_plan import read_plan
from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import Experiment, NextOptions, RecordingsOptions
from hwid_cli.records.next import PlannedInput
from hwid_cli.records.recordings import Recording
from hwid_cli.records.units import behind
from hwid_cli.stages.fit_seconds import counted
from hwid_cli.trust.designs import LEAST_SAMPLES, designs
from hwid_cli.trust.repeats import is_as_planned

# Share of the largest input up to which inputs of the other sign are noise.
_OTHER_SIDE = 0.02
# Times the largest recorded input beyond which an offered one is questioned.
_FAR_OUTSIDE = 3.0


def offered_inputs(
    experiment: Experiment, recordings: Sequence[Recording]
) -> tuple[PlannedInput, ...]:
    """Inputs of the plan, or designed within the limits.

    Raises
    ------
    MeasurementError, ConfigError
        If the plan cannot be used, or no input fits within the limits.
    """
    options, first = next_options(experiment), recordings[0]
    if options.plan is not None:
        path = Path(experiment.source).parent / options.plan
        return read_plan(path, _files(experiment), first.sample_time_s)
    limits = options.limits
    if limits is None:
        raise ValueError("a configuration without plan and limits is refused")
    found = designs(
        limits.amplitude,
        limits.rate,
        limits.duration_s,
        first.sample_time_s,
        first.input_unit,
        side=_usual_sign(recordings) if limits.one_sided else 0,
    )
    if not found:
        least = LEAST_SAMPLES * first.sample_time_s
        unit = behind(first.input_unit)
        raise ConfigError(
            f"{experiment.source}: next.limits: found amplitude {limits.amplitude:g}"
            f"{unit}, rate {limits.rate:g}{unit}/s and {limits.duration_s:g} s, within "
            "which no input fits; expected a twentieth of the amplitude to be reached "
            f"within the duration, and at least {least:g} s; raise rate or duration_s"
        )
    return found


def _usual_sign(recordings: Sequence[Recording]) -> int:
    """Sign of the largest input."""
    lowest = min(float(one.input.min()) for one in recordings)
    highest = max(float(one.input.max()) for one in recordings)
    return 1 if highest >= -lowest else -1


def odd_inputs(
    options: NextOptions,
    recordings: Sequence[Recording],
    plan: Sequence[PlannedInput],
    source: str,
) -> list[str]:
    """What is odd about inputs on offer, and about recordings of planned ones.

    Parameters
    ----------
    plan : sequence of PlannedInput
        All that could be played or was.
    source : str
        Of the configuration.
    """
    known = {one.name for one in recordings}
    said = _other_inputs(recordings, plan)
    if options.plan is not None:
        said += _far_outside(recordings, [one for one in plan if one.name not in known])
    limits = options.limits
    if limits is None or limits.one_sided:
        return said
    sign = _usual_sign(recordings)
    largest = max(float((sign * one.input).max()) for one in recordings)
    lowest = min(float((sign * one.input).min()) for one in recordings)
    if lowest < -_OTHER_SIDE * largest:
        return said
    word = "negative" if sign > 0 else "positive"
    return [
        *said,
        f"no recording has a {word} input, but designed ones may: where there is none, "
        f"as of a heater, put one_sided: true into next.limits of {source}",
    ]


def _other_inputs(
    recordings: Sequence[Recording], plan: Sequence[PlannedInput]
) -> list[str]:
    """Recordings that have the name of an offered input, and another input."""
    planned = {one.name: one for one in plan}
    return [
        f"{one.name}: its input is not what was to be played under this name "
        f"({planned[one.name].words}); it counts as what was measured: record it again, "
        "or give it another name"
        for one in recordings
        if one.name in planned
        and not is_as_planned(one.input, planned[one.name].values)
    ]


def _far_outside(
    recordings: Sequence[Recording], offered: Sequence[PlannedInput]
) -> list[str]:
    """That inputs of a plan are far larger than any that was recorded, if so."""
    largest = max(float(np.abs(one.input).max()) for one in recordings)
    sizes = {one.name: float(np.abs(one.values).max()) for one in offered}
    far = [name for name, size in sizes.items() if size > _FAR_OUTSIDE * largest]
    if not far:
        return []
    worst, unit = (
        max(far, key=sizes.__getitem__),
        behind(recordings[0].input_unit),
    )
    return [
        f"{counted(len(far), 'input')} of the plan are far larger than all recorded ones: "
        f"{worst} reaches {sizes[worst]:g}{unit}, recordings {largest:g}{unit}; make sure "
        "that the machine bears it"
    ]


def _files(experiment: Experiment) -> RecordingsOptions:
    if experiment.recordings is None:
        raise ConfigError(
            f"{experiment.source}: recordings: missing; expected the section, which says "
            "in which column a file has its input; add it"
        )
    return experiment.recordings


def next_options(experiment: Experiment) -> NextOptions:
    """The section ``next`` of a configuration.

    Raises
    ------
    ConfigError
        If it is missing.
    """
    if experiment.next is None:
        raise ConfigError(
            f"{experiment.source}: next: the section is missing; expected what could be "
            "recorded; add it, such as 'next: {limits: {amplitude: 6.0, rate: 50, "
            "duration_s: 7.5}}'"
        )
    return experiment.next
