"""``check``: what each recording is like, and whether it can be calibrated."""

from collections.abc import Sequence
from dataclasses import dataclass

from hwid_cli.data.doubtful import doubts
from hwid_cli.data.quality import quality_notes
from hwid_cli.errors import HwidError
from hwid_cli.records.check import RecordingFacts
from hwid_cli.records.experiment import Experiment
from hwid_cli.records.recordings import CalibrationLog, RawRecording, Recording
from hwid_cli.stages.calibrate import calibrate_all, level_warnings

# Clocks that deviate by a larger share of the sample time are worth a note, [-].
_NOTED_JITTER = 1e-3


@dataclass(frozen=True, eq=False)
class Checked:
    """What calibration makes of the recordings.

    Parameters
    ----------
    recordings : tuple of Recording
        Those that can be calibrated.
    logs : tuple of CalibrationLog
        Theirs.
    warnings : tuple of str
        What is odd about their recipes.
    """

    facts: tuple[RecordingFacts, ...]
    recordings: tuple[Recording, ...]
    problems: tuple[str, ...]
    logs: tuple[CalibrationLog, ...] = ()
    warnings: tuple[str, ...] = ()


def check_recordings(
    raws: Sequence[RawRecording],
    experiment: Experiment,
    jitter: dict[str, float],
    missing: dict[str, int],
) -> Checked:
    """Calibrate in memory, and say what each recording is like.

    Parameters
    ----------
    jitter : dict of str to float, [-]
        Largest deviation of a step of the time column by name, as a share of the step.
    missing : dict of str to int, [samples]
        Samples that the file lacks, by name.
    """
    facts, recordings, logs, problems = [], [], [], []
    doubtful = doubts(raws)
    for raw in raws:
        lost = missing.get(raw.name, 0)
        n_used, notes = 0, _notes(raw, jitter.get(raw.name, 0.0), lost)
        notes += doubtful.get(raw.name, ())
        try:
            (recording,), (log,) = calibrate_all([raw], experiment.calibrate)
        except HwidError as error:
            if str(error) not in problems:
                problems.append(str(error))
        else:
            recordings.append(recording)
            logs.append(log)
            n_used = recording.n_samples
        facts.append(
            RecordingFacts(
                name=raw.name,
                kind=raw.kind,
                n_input=raw.input.size,
                n_output=raw.output.size,
                n_used=n_used,
                sample_time_s=raw.sample_time_s,
                input_range=(float(raw.input.min()), float(raw.input.max())),
                output_range=(float(raw.output.min()), float(raw.output.max())),
                input_unit=raw.input_unit,
                output_unit=raw.output_unit,
                notes=notes,
            )
        )
    warnings = level_warnings(str(experiment.source), raws, experiment.calibrate)
    return Checked(
        tuple(facts), tuple(recordings), tuple(problems), tuple(logs), tuple(warnings)
    )


def _two_digits(number: float) -> str:
    """Write a number with two digits that count, and without an exponent.

    Examples
    --------
    >>> _two_digits(110.4), _two_digits(1234.0), _two_digits(0.153)
    ('110', '1200', '0.15')
    """
    return f"{float(f'{number:.2g}'):.15g}"


def _notes(raw: RawRecording, jitter: float, lost: int) -> tuple[str, ...]:
    notes = [
        f"{side} {note}"
        for side, values in (("input", raw.input), ("output", raw.output))
        for note in quality_notes(values, may_hold=side == "input")
    ]
    if jitter > _NOTED_JITTER:
        notes.append(
            f"the clock jitters by up to {_two_digits(100 * jitter)} % of a step"
        )
    if lost:
        are = "sample is" if lost == 1 else "samples are"
        notes.append(f"{lost} {are} missing in the file; straight lines stand for them")
    return tuple(notes)
