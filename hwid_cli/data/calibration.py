"""The steps of a calibration recipe: repair, cut, offsets, whole periods.

- ``cut``: input and output from the onset of the excitation on, to the same length.
  Steps (and other kinds) keep ``rest_samples`` of the rest before it, and so does a
  random signal whose recipe subtracts an offset; a sine keeps none.
- ``input_offset``, ``output_offset``: subtract the mean over the rest before the
  excitation; for a sine the mean over its first whole period.
- ``recut``: a sine to whole periods.

A reference is cut with the input, and an offset of the output is subtracted from it too.

A step takes a draft and returns the next one; it never alters a record.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.data.signal_features import (
    LEAST_QUIET,
    find_onset,
    find_period,
    mean_over_period,
    whole_periods,
)
from hwid_cli.errors import MeasurementError
from hwid_cli.model.damaged_samples import repaired
from hwid_cli.records.experiment import CalibrateOptions
from hwid_cli.records.recordings import CalibrationLog, RawRecording
from hwid_cli.records.units import behind

OFFSETS = ("input_offset", "output_offset")
# Rounds of repairing or cutting one signal; two settle nearly all of them.
MOST_ROUNDS = 8


@dataclass(frozen=True, eq=False)
class Draft:
    """A recording in the middle of its recipe, with what was done so far.

    Parameters
    ----------
    input : ndarray, shape (n_input,), [input unit]
    output : ndarray, shape (n_output,), [output unit]
    reference : ndarray or None, shape (n_input,), [output unit]
    """

    raw: RawRecording
    options: CalibrateOptions
    input: np.ndarray
    output: np.ndarray
    log: CalibrationLog
    reference: np.ndarray | None = None

    @property
    def recipe(self) -> tuple[str, ...]:
        """Steps for this kind of recording."""
        return getattr(self.options, self.raw.kind)

    @property
    def place(self) -> str:
        """Name of the recording, and its file if it has one."""
        raw = self.raw
        return f"{raw.source} (recording {raw.name})" if raw.source else raw.name


def run_recipe(draft: Draft) -> Draft:
    """Run every step of a recipe once.

    Raises
    ------
    MeasurementError
        If a step cannot work on this recording.
    """
    if draft.options.repair:
        draft = _repair(draft)
    for step in draft.recipe:
        draft = _STEPS[step](draft)
    return draft


def _repair(draft: Draft) -> Draft:
    log = draft.log
    values_in, found_in = repaired(draft.input)
    values_out, found_out = repaired(draft.output, may_hold=False)
    before_in, before_out = log.repaired_input, log.repaired_output
    log = replace(
        log,
        repaired_input=_with(before_in, found_in + log.first_sample),
        repaired_output=_with(before_out, found_out + log.first_sample),
    )
    return replace(draft, input=values_in, output=values_out, log=log)


def _with(before: tuple[int, ...], found: np.ndarray) -> tuple[int, ...]:
    return tuple(sorted({*before, *found.tolist()}))


def _cut(draft: Draft) -> Draft:
    """Drop the lead-in, and at the end what only one of the two columns has."""
    rest = _rest_to_keep(draft)
    length = min(draft.input.size, draft.output.size)
    most = length if draft.options.samples is None else draft.options.samples
    first, looked_at = 0, slice(0, draft.input.size)
    for _ in range(MOST_ROUNDS):
        first += max(0, _onset(draft, draft.input[looked_at]) - rest)
        kept = slice(first, min(length, first + most))
        if kept.stop - kept.start < LEAST_QUIET:
            raise MeasurementError(
                f"{draft.place}: 'cut' leaves {max(0, kept.stop - kept.start)} samples "
                f"(input {draft.input.size}, output {draft.output.size}, excitation "
                f"from sample {first + rest}); expected at least {LEAST_QUIET}: check "
                "that both columns cover the excitation"
            )
        if kept == looked_at:
            break
        # What is kept must by itself show the same onset: look at it alone.
        looked_at = kept
    return _keep(draft, first, kept.stop - kept.start)


def _rest_to_keep(draft: Draft) -> int:
    """Return how much rest before the onset 'cut' leaves in place."""
    if draft.raw.kind == "sine":
        return 0
    if draft.raw.kind == "random" and not set(draft.recipe) & set(OFFSETS):
        return 0
    return draft.options.rest_samples


def _onset(draft: Draft, values: np.ndarray) -> int:
    quiet_is_rest = draft.raw.kind in ("step", "other") or _rest_to_keep(draft) > 0
    onset = find_onset(values, quiet_is_rest=quiet_is_rest)
    if onset is None:
        raise MeasurementError(
            f"{draft.place}: the input stays at {np.median(values):.6g}"
            f"{behind(draft.raw.input_unit)} over {values.size} samples, no onset of an "
            "excitation was found; check the input column, or take 'cut' and the "
            f"offsets out of calibrate.{draft.raw.kind}"
        )
    return onset


def _keep(draft: Draft, first: int, n_samples: int) -> Draft:
    kept = slice(first, first + n_samples)
    return replace(
        draft,
        input=draft.input[kept],
        output=draft.output[kept],
        reference=None if draft.reference is None else draft.reference[kept],
        log=replace(draft.log, first_sample=draft.log.first_sample + first),
    )


def _subtract(side: str) -> Callable[[Draft], Draft]:
    """Step that subtracts the mean over the rest, or over a sine's first period."""

    def subtract(draft: Draft) -> Draft:
        values = getattr(draft, side)
        if draft.raw.kind == "sine":
            draft = _with_period(draft)
            offset = mean_over_period(values, draft.log.period_samples)
        else:
            offset = float(np.mean(values[: _rest_length(draft, f"{side}_offset")]))
        total = getattr(draft.log, f"{side}_offset") + offset
        log = replace(draft.log, **{f"{side}_offset": total})
        reference = draft.reference
        if side == "output" and reference is not None:
            # A controller compares the two: their difference stays what it was.
            reference = reference - offset
        return replace(draft, **{side: values - offset}, log=log, reference=reference)

    return subtract


def _rest_length(draft: Draft, step: str) -> int:
    onset = find_onset(draft.input, quiet_is_rest=True)
    if onset is None:
        return _onset(draft, draft.input)
    if onset < LEAST_QUIET:
        raise MeasurementError(
            f"{draft.place}: the input moves within its first {LEAST_QUIET} samples, "
            f"so there is no rest before the excitation for '{step}'; expected a "
            f"lead-in at rest, or take '{step}' out of calibrate.{draft.raw.kind}"
        )
    return onset


def _with_period(draft: Draft) -> Draft:
    period = find_period(draft.input)
    known = draft.log.period_samples
    if period is None and known and whole_periods(draft.input.size, known):
        # One period alone crosses its middle too seldom to be measured again.
        period = known
    if period is None:
        size, total = draft.input.size, draft.raw.input.size
        left = "" if size == total else f" left of the file's {total}"
        raise MeasurementError(
            f"{draft.place}: no whole period was found in the input's {size} samples"
            f"{left}; expected a sine of at least one period: "
            "check recordings.kind, or take the offsets and 'recut' out of "
            "calibrate.sine"
        )
    return replace(draft, log=replace(draft.log, period_samples=period))


def _recut(draft: Draft) -> Draft:
    """Keep whole periods."""
    draft = _with_period(draft)
    length = min(draft.input.size, draft.output.size)
    return _keep(draft, 0, whole_periods(length, draft.log.period_samples))


_STEPS: dict[str, Callable[[Draft], Draft]] = {
    "cut": _cut,
    "input_offset": _subtract("input"),
    "output_offset": _subtract("output"),
    "recut": _recut,
}


def removed_samples(raw: RawRecording, log: CalibrationLog) -> np.ndarray:
    """Collect what a calibration took away, as its log keeps it.

    Returns
    -------
    ndarray, shape (n_removed,), [input unit], then [output unit]
    """
    first, end = log.first_sample, log.first_sample + log.n_samples
    sides = ((raw.input, log.repaired_input), (raw.output, log.repaired_output))
    return np.concatenate(
        [
            part
            for values, repaired in sides
            for part in (values[:first], values[end:], values[list(repaired)])
        ]
    )
