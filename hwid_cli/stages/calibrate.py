"""Stage ``calibrate``: raw measurements in, recordings of equal length out.

Each kind of recording has a recipe of steps (``data/calibration.py``). Damaged samples,
alone or two side by side, are replaced before the first step and listed in the log. A recipe is repeated
until it changes nothing, so that calibrating a calibrated recording gives the same
recording.
"""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from hwid_cli.data.calibration import OFFSETS, Draft, removed_samples, run_recipe
from hwid_cli.data.doubtful import doubts
from hwid_cli.data.recording_files import (
    find_files,
    missing_files_message,
    recordings_base,
)
from hwid_cli.data.recordings import read_recordings
from hwid_cli.data.signal_features import LEAST_QUIET
from hwid_cli.errors import ConfigError, MeasurementError, NothingToDo
from hwid_cli.files.figure_files import read_figure, write_figure
from hwid_cli.records.check import StagePlan
from hwid_cli.records.experiment import RECIPE_STEPS, CalibrateOptions
from hwid_cli.records.recordings import (
    Calibrated,
    CalibrationLog,
    RawRecording,
    Recording,
)
from hwid_cli.records.units import behind
from hwid_cli.report.calibration import calibration_table
from hwid_cli.report.formats import listed
from hwid_cli.report.sections.calibrate import drawings_of
from hwid_cli.stages.fit_seconds import counted
from hwid_cli.stages.proposed_starts import levels_left, levels_taken_off, rest_level
from hwid_cli.stages.selection import named_recordings, select_recordings
from hwid_cli.stages.simulation_units import overruled_units
from hwid_cli.stages.stage import Context, Planning, Runner, Stage, in_results
from hwid_cli.store.result_files import Provenance
from hwid_cli.store.results import read_calibrated, write_calibrated
from hwid_cli.tasks.cache import task_key

NAME = "calibrate"
STAGE_VERSION = 7

# Two passes settle nearly every recording (the second one changes nothing); noise at a
# threshold may take one or two more.
MOST_PASSES = 8
# An offset below this share of the signal's size is rounding, [-].
ROUNDING = 1e-12


def calibrate_all(
    raws: Sequence[RawRecording], options: CalibrateOptions | None
) -> tuple[tuple[Recording, ...], tuple[CalibrationLog, ...]]:
    """Calibrate measurements by the recipe of their kind.

    Parameters
    ----------
    options : CalibrateOptions or None
        None leaves every measurement as it is.

    Returns
    -------
    tuple of Recording, tuple of CalibrationLog
        In the order of the measurements.

    Raises
    ------
    ConfigError
        If a recipe names an unknown step or a length makes no sense.
    MeasurementError
        If a step cannot work on a measurement, or input and output differ in length
        where no step cuts them.
    """
    chosen = CalibrateOptions() if options is None else options
    _check_options(chosen)
    pairs = [_calibrate(raw, chosen) for raw in raws]
    return tuple(pair[0] for pair in pairs), tuple(pair[1] for pair in pairs)


def calibration_key(
    raws: Sequence[RawRecording], options: CalibrateOptions | None
) -> str:
    """Content key of a calibration: everything that its result depends on."""
    # Moving a file changes nothing; its bytes are in sha256.
    about = [
        {
            item.name: getattr(raw, item.name)
            for item in fields(raw)
            if item.name != "source"
        }
        for raw in raws
    ]
    arrays = [one.pop(side) for one in about for side in ("input", "output")]
    for one in about:
        # The log holds what is known of units and of samples that were bridged; without
        # these, keys stay as they were.
        for name in ("units", "bridged_input", "bridged_output"):
            if not one[name]:
                del one[name]
        reference = one.pop("reference")
        # Said only where there is one: keys of recordings without one stay as they were.
        if reference is not None:
            one["has_reference"] = True
            arrays.append(reference)
    settings = {"recordings": about, "options": options}
    return task_key(NAME, STAGE_VERSION, settings, arrays)


def _check_options(options: CalibrateOptions) -> None:
    for kind in ("step", "sine", "random", "other"):
        for step in getattr(options, kind):
            if step not in RECIPE_STEPS:
                raise ConfigError(
                    f"calibrate.{kind}: unknown step {step!r}; "
                    f"expected some of {', '.join(RECIPE_STEPS)}"
                )
            if step == "recut" and kind != "sine":
                raise ConfigError(
                    f"calibrate.{kind}: 'recut' keeps whole periods of a sine; "
                    "remove it, 'cut' alone gives equal lengths"
                )
    if options.samples is not None and options.samples < LEAST_QUIET:
        raise ConfigError(
            f"calibrate.samples: {options.samples}; expected at least {LEAST_QUIET}"
        )
    if options.rest_samples < LEAST_QUIET and any(
        "cut" in recipe and set(recipe) & set(OFFSETS)
        for recipe in (options.step, options.random, options.other)
    ):
        raise ConfigError(
            f"calibrate.rest_samples: {options.rest_samples}; expected at least "
            f"{LEAST_QUIET} where a recipe subtracts the mean over the rest"
        )


def _calibrate(
    raw: RawRecording, options: CalibrateOptions
) -> tuple[Recording, CalibrationLog]:
    """One measurement through its recipe until nothing changes any more."""
    draft = Draft(
        raw=raw,
        options=options,
        input=raw.input,
        output=raw.output,
        reference=raw.reference,
        log=CalibrationLog(
            name=raw.name,
            steps=getattr(options, raw.kind),
            first_sample=0,
            n_samples=raw.input.size,
            n_raw_input=raw.input.size,
            n_raw_output=raw.output.size,
            repaired_input=raw.bridged_input,
            repaired_output=raw.bridged_output,
            units=raw.units,
        ),
    )
    if draft.recipe:
        for _ in range(MOST_PASSES):
            before, draft = draft, run_recipe(draft)
            if _is_same(before, draft):
                break
    return _finish(draft)


def _is_same(before: Draft, after: Draft) -> bool:
    if before.log.repaired_input != after.log.repaired_input:
        return False
    if before.log.repaired_output != after.log.repaired_output:
        return False
    return all(
        old.size == new.size
        and np.max(np.abs(old - new)) <= ROUNDING * max(np.max(np.abs(old)), 1e-300)
        for old, new in ((before.input, after.input), (before.output, after.output))
    )


def _finish(draft: Draft) -> tuple[Recording, CalibrationLog]:
    raw = draft.raw
    if draft.input.size != draft.output.size:
        raise MeasurementError(
            f"{draft.place}: input has {draft.input.size} samples, output "
            f"{draft.output.size}; expected equal lengths, or 'cut' in "
            f"calibrate.{raw.kind}"
        )
    recording = Recording(
        name=raw.name,
        input=draft.input,
        output=draft.output,
        sample_time_s=raw.sample_time_s,
        kind=raw.kind,
        sha256=raw.sha256,
        input_unit=raw.input_unit,
        output_unit=raw.output_unit,
        reference=draft.reference,
    )
    log = replace(draft.log, n_samples=recording.n_samples)
    return recording, replace(log, removed=removed_samples(raw, log))


# Measured on the demo: a sample, the figures of a recording, the page, [bytes].
_SAMPLE_BYTES, _FIGURE_BYTES, _PAGE_BYTES = 16, 80e3, 4e6


@dataclass(frozen=True, eq=False)
class Measured:
    """Measurements as they were read, and what calibration shall do with them."""

    recordings: tuple[RawRecording, ...]
    options: CalibrateOptions | None

    @cached_property
    def key(self) -> str:
        """Content key; looked at before and after the calibration, hashed once."""
        return calibration_key(self.recordings, self.options)


def _choose(context: Context) -> Measured:
    experiment = context.experiment
    base = recordings_base(experiment, context.out)
    if not find_files(experiment, base):
        raise NothingToDo(missing_files_message(experiment, base))
    raws = read_recordings(experiment, context.out)
    # A misspelt name in any section is refused before anything is computed.
    for key, names in named_recordings(experiment):
        select_recordings(raws, names or None, key=f"{experiment.source}: {key}")
    return Measured(tuple(raws), experiment.calibrate)


def _compute(given: Measured, _: Runner) -> Calibrated:
    recordings, logs = calibrate_all(given.recordings, given.options)
    return Calibrated(recordings, logs, given.key)


def _write(path: Path, _: Measured, result: Calibrated, origin: Provenance) -> None:
    write_calibrated(path, result.recordings, result.logs, origin)


def _draw(
    out: Path, given: Measured, result: Calibrated, _: Provenance | None, is_new: bool
) -> None:
    """Draw each recording before and after, unless a whole figure of it is there."""
    if given.options is None:
        return
    for drawing in drawings_of(result.recordings, result.logs):
        path = out / "figures" / drawing.file
        if is_new or read_figure(path, drawing.key) is None:
            write_figure(path, drawing.png, drawing.key)


def _summary(given: Measured, result: Calibrated, is_stored: bool) -> str:
    state = "from the cache" if is_stored else "done"
    parts = [_changed(given, result), *_converted(result)]
    return f"{counted(len(given.recordings), 'recording')} {state}, {', '.join(parts)}"


def _converted(result: Calibrated) -> list[str]:
    """What was converted from one unit to another, once for all recordings."""
    found = dict.fromkeys(
        f"{one.role} converted from {one.given} to {one.unit}"
        for log in result.logs
        for one in log.units
        if one.factor != 1.0
    )
    return list(found)


def _changed(given: Measured, result: Calibrated) -> str:
    options = given.options
    if options is None:
        return "left as they are (no calibrate: section)"
    kinds = {recording.kind for recording in result.recordings}
    bare = sorted(kind for kind in kinds if not getattr(options, kind))
    none = f"calibrate: has no recipe for {' and '.join(bare)}"
    if len(bare) == len(kinds):
        return f"left as they are, not repaired either ({none})"
    n_repaired = sum(
        len(log.repaired_input) + len(log.repaired_output) for log in result.logs
    )
    changed = f"{n_repaired} damaged samples replaced"
    whole = f"{changed}, kinds used whole: {', '.join(bare)} (no recipe)"
    return whole if bare else changed


def _warnings(context: Context, given: Measured) -> list[str]:
    """Recordings that seem to have gone wrong, and levels that a recipe takes off."""
    source = str(context.experiment.source)
    said = [
        f"{source}: recordings: {name}: {doubt}"
        for name, several in doubts(given.recordings).items()
        for doubt in several
    ]
    said += overruled_units(source, given.recordings)
    return said + level_warnings(source, given.recordings, given.options)


def level_warnings(
    source: str, raws: Sequence[RawRecording], options: CalibrateOptions | None
) -> list[str]:
    """Levels that recipes take off, after which no model knows where the machine stands.

    Parameters
    ----------
    source : str
        Of the configuration.
    """
    if options is None:
        return []
    said = []
    recipes = {one.kind: getattr(options, one.kind) for one in raws}
    held = levels_taken_off(raws, recipes)
    if held:
        said.append(
            f"{source}: calibrate: output_offset takes off the level at which the input "
            f"holds the output of {listed([one.name for one in held])}, another one in "
            "each; models do not know that level then: take output_offset out, or add "
            "input_offset"
        )
    apart = levels_left(raws, recipes)
    if apart:
        kinds = listed(list(dict.fromkeys(one.kind for one in apart)))
        level = f"{rest_level(apart[0]):.3g}{behind(apart[0].output_unit)}"
        said.append(
            f"{source}: calibrate: recordings of the kind {kinds} keep the level at which "
            f"they rest ({level}), others lose it under the same input: put output_offset "
            "into the recipes of all kinds, or of none"
        )
    return said


def _plan(planning: Planning) -> tuple[StagePlan, ...]:
    n = len(planning.recordings)
    samples = sum(one.n_samples for one in planning.recordings)
    what = f"{counted(n, 'recording')}, {counted(samples, 'sample')}"
    size = _SAMPLE_BYTES * samples + _FIGURE_BYTES * n + _PAGE_BYTES
    return (StagePlan(NAME, what, n, None, planning.reading_seconds, size),)


STAGE = Stage(
    name=NAME,
    needs_where_named=("simulate",),
    sections=("recordings", "calibrate"),
    choose=_choose,
    key=lambda given: given.key,
    compute=_compute,
    storage=in_results(NAME, read_calibrated, _write),
    summary=_summary,
    write_files=_draw,
    tables=lambda context, result: [calibration_table(result.logs)],
    warnings=_warnings,
    is_shown_in_run=False,
    files=("calibrated.h5", "figures"),
    plan=_plan,
)
