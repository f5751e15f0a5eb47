"""Calibrated recordings in other units of the same quantities, with their logs."""

from dataclasses import replace

import numpy as np

from hwid_cli.data.units import factor_between, in_unit
from hwid_cli.records.recordings import CalibrationLog, Recording


def in_other_units(
    recording: Recording, log: CalibrationLog | None, units: tuple[str, str]
) -> tuple[Recording, CalibrationLog | None]:
    """Convert what can be converted; a side of another quantity stays as it is.

    Parameters
    ----------
    log : CalibrationLog or None
        Its own.
    units : tuple of str
        Wanted of the input and of the output.
    """
    own = (recording.input_unit, recording.output_unit)
    wanted = [
        after if factor_between(before, after) is not None else before
        for before, after in zip(own, units, strict=True)
    ]
    if tuple(wanted) == own:
        return recording, log
    of_input, of_output = zip(own, wanted, strict=True)
    reference = recording.reference
    converted = replace(
        recording,
        input=in_unit(recording.input, *of_input),
        output=in_unit(recording.output, *of_output),
        reference=None if reference is None else in_unit(reference, *of_output),
        input_unit=wanted[0],
        output_unit=wanted[1],
    )
    if log is None:
        return converted, None
    n_of_input = log.n_raw_input - log.n_samples + len(log.repaired_input)
    sides = np.split(log.removed, [min(n_of_input, log.removed.size)])
    return converted, replace(
        log,
        input_offset=in_unit(log.input_offset, *of_input),
        output_offset=in_unit(log.output_offset, *of_output),
        removed=np.concatenate(
            [in_unit(sides[0], *of_input), in_unit(sides[1], *of_output)]
        ),
        units=tuple(
            one
            if one.role == "time"
            else replace(
                one,
                unit=wanted[one.role == "output"],
                factor=one.factor
                * float(in_unit(1.0, one.unit, wanted[one.role == "output"])),
            )
            for one in log.units
        ),
    )
