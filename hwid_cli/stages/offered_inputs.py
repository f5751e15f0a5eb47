"""What could be recorded next: inputs of a plan, or designed ones, and what is odd about them.

References
----------
docs/trust.md.
"""

from collections.abc import Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np

from hwid_cli.data.recording_plan import read_plan
from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import (
    Experiment,
    NextLimits,
    NextOptions,
    RecordingsOptions,
)
from hwid_cli.records.next import PlannedInput
from hwid_cli.records.recordings import Recording
from hwid_cli.records.units import behind
from hwid_cli.stages.fit_seconds import counted
from hwid_cli.stages.output_range import in_words
from hwid_cli.trust.designs import (
    LEAST_SAMPLES,
    around_level,
    designs,
    working_level,
)
from hwid_cli.trust.repeats import is_as_planned

# Times the range of all recorded outputs that a range of the output is questioned beyond.
_FAR_BEYOND = 20.0
# Share of the largest input up to which inputs of the other sign are noise.
_OTHER_SIDE = 0.02
# Samples of a designed input: a duration in other units must not fill the memory.
_MOST_SAMPLES = 500_000
# Times the largest recorded input beyond which an offered one is questioned.
_FAR_OUTSIDE = 3.0


def offered_inputs(
    experiment: Experiment, recordings: Sequence[Recording]
) -> tuple[PlannedInput, ...]:
    """Inputs of the plan, or designed within the limits.

    One whose name a recording of another input has is on offer under a further name: the
    limits may have changed since.

    Raises
    ------
    MeasurementError, ConfigError
        If the plan cannot be used, or no input fits within the limits.
    """
    options, first = next_options(experiment), recordings[0]
    if options.plan is not None:
        path = Path(experiment.source).parent / options.plan
        found = read_plan(
            path, _files(experiment), first.sample_time_s, first.input_unit
        )
        return _under_own_names(found, recordings)
    limits = options.limits
    if limits is None:
        raise ValueError("a configuration without plan and limits is refused")
    n_samples = limits.duration_s / first.sample_time_s
    if n_samples > _MOST_SAMPLES:
        most_s = _MOST_SAMPLES * first.sample_time_s
        raise ConfigError(
            f"{experiment.source}: next.limits.duration_s: found {limits.duration_s:g} s, "
            f"{n_samples:.3g} samples; expected at most {most_s:g} s, {_MOST_SAMPLES} "
            "samples; give it in seconds"
        )
    found = designs(
        limits.amplitude,
        limits.rate,
        limits.duration_s,
        first.sample_time_s,
        first.input_unit,
        side=_usual_side(recordings, limits.level) if limits.one_sided else 0,
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
    return _under_own_names(
        around_level(found, limits.level, first.input_unit), recordings
    )


def _under_own_names(
    plan: Sequence[PlannedInput], recordings: Sequence[Recording]
) -> tuple[PlannedInput, ...]:
    """The same, each under a name that no recording of another input has."""
    known = {one.name: one.input for one in recordings}
    taken = {one.name for one in plan}

    def may_be(name: str, one: PlannedInput) -> bool:
        return name not in known or is_as_planned(known[name], one.values)

    found = []
    for one in plan:
        names = (f"{one.name}_{number}" for number in count(2))
        name = one.name
        while not (may_be(name, one) and (name == one.name or name not in taken)):
            name = next(names)
        first = one.name if name != one.name else ""
        found.append(replace(one, name=name, first_name=first))
        taken.add(name)
    return tuple(found)


def _usual_side(recordings: Sequence[Recording], level: float) -> int:
    """On which side of a level the inputs go farther."""
    lowest = min(float(one.input.min()) for one in recordings)
    highest = max(float(one.input.max()) for one in recordings)
    return 1 if highest - level >= level - lowest else -1


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
    said = _other_inputs(plan)
    said += _far_outside(recordings, [one for one in plan if one.name not in known])
    said += _wide_range(options, recordings)
    if options.limits is not None:
        said += _where_nothing_was(options.limits, recordings, source)
    return said


def _where_nothing_was(
    limits: NextLimits, recordings: Sequence[Recording], source: str
) -> list[str]:
    """That designed inputs go where the input of no recording was near, if so."""
    inputs, unit = [one.input for one in recordings], behind(recordings[0].input_unit)
    level = working_level(inputs)
    if level != 0.0 and limits.level == 0.0:
        return [
            f"recordings begin at {level:.3g}{unit}, and none comes near 0, where designed "
            f"ones begin and end: put level: {level:.3g} into next.limits of {source} if "
            "the machine works around that"
        ]
    ends = min(one.min() for one in inputs), max(one.max() for one in inputs)
    if limits.level != 0.0 and not ends[0] <= limits.level <= ends[1]:
        return [
            f"{source}: next.limits.level: found {limits.level:g}{unit}, where no recording "
            f"was ({in_words(ends, recordings[0].input_unit)}); make sure that the machine "
            "bears it"
        ]
    # Towards the side where the recordings were.
    side = _usual_side(recordings, 0.0)
    farthest = max(float((side * one).max()) for one in inputs)
    nearest = min(float((side * one).min()) for one in inputs)
    stays = limits.one_sided or side * limits.level >= limits.amplitude
    if stays or nearest < -_OTHER_SIDE * farthest:
        return []
    word = "negative" if side > 0 else "positive"
    return [
        f"no recording has a {word} input, but designed ones may: where there is none, "
        f"as of a heater, put one_sided: true into next.limits of {source}"
    ]


def _other_inputs(plan: Sequence[PlannedInput]) -> list[str]:
    """Recordings that have the name of an offered input, and another input."""
    return [
        f"{one.first_name}: its input is not what was to be played under this name "
        f"({one.words}); it counts as what was measured, and what was to be played is "
        f"{one.name} from now on"
        for one in plan
        if one.first_name
    ]


def _far_outside(
    recordings: Sequence[Recording], offered: Sequence[PlannedInput]
) -> list[str]:
    """That inputs are far larger than any that was recorded, if so."""
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
        f"{counted(len(far), 'input')} on offer {'is' if len(far) == 1 else 'are'} far "
        f"larger than all recorded ones: {worst} reaches {sizes[worst]:g}{unit}, recordings {largest:g}{unit}; make sure "
        "that the machine bears it"
    ]


def _wide_range(options: NextOptions, recordings: Sequence[Recording]) -> list[str]:
    """That a range of the output is so wide that it may be in another unit, if so."""
    if options.output_range is None:
        return []
    lowest = min(float(one.output.min()) for one in recordings)
    highest = max(float(one.output.max()) for one in recordings)
    unit = recordings[0].output_unit
    low, high = options.output_range
    times = (high - low) / max(highest - lowest, 1e-300)
    if times <= _FAR_BEYOND:
        return []
    return [
        f"next.output_range: {in_words((low, high), unit)} is {times:.3g} times as wide as "
        f"what the recordings reach ({in_words((lowest, highest), unit)}), and hardly "
        "leaves anything out; make sure that it is in the unit of the output"
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
