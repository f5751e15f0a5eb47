"""The measurement that a calibrated recording was made of."""

import numpy as np

from hwid_cli.records.recordings import CalibrationLog, Recording


def as_measured(
    recording: Recording, log: CalibrationLog
) -> tuple[np.ndarray, np.ndarray] | None:
    """Give back the measurement that a recording was calibrated from.

    Returns
    -------
    input : ndarray, shape (n_raw_input,), [input unit]
    output : ndarray, shape (n_raw_output,), [output unit]
        None where the log does not hold what was removed.
    """
    n_samples, first = log.n_samples, log.first_sample
    sides = (
        (recording.input, log.input_offset, log.n_raw_input, log.repaired_input),
        (recording.output, log.output_offset, log.n_raw_output, log.repaired_output),
    )
    n_removed = sum(n_raw - n_samples + len(bad) for _, _, n_raw, bad in sides)
    if log.removed.size != n_removed:
        return None
    found, rest = [], log.removed
    for values, offset, n_raw, replaced in sides:
        sizes = np.cumsum([first, n_raw - n_samples - first, len(replaced)])
        before, behind, damaged, rest = np.split(rest, sizes)
        signal = np.concatenate([before, values + offset, behind])
        signal[list(replaced)] = damaged
        found.append(signal)
    return found[0], found[1]
