"""Which stretch of a recording is worth a closer look."""

import numpy as np

from hwid_cli.maths.calibration import find_period

# The output has begun to move, and has moved most of its way, at these shares of its
# largest distance from where it started, [-].
_BEGUN, _ARRIVED = 0.05, 0.9
# Shown before the beginning and after the arrival, in lengths of the way between, [-].
_BEFORE, _AFTER = 0.25, 1.0
_PERIODS = 3.0
# A detail is shorter than the whole, and long enough to be a curve, [-], [samples].
_MOST_SHARE, _LEAST_SAMPLES = 0.5, 40
# The start's level is the median of so many samples, [samples].
_START = 5


def detail_window(
    input: np.ndarray,  # noqa: A002 - the field's word
    output: np.ndarray,
    *,
    is_periodic: bool,
) -> tuple[int, int]:
    """Choose the stretch of a recording in which its transient lies.

    Parameters
    ----------
    input, output : ndarray, shape (n_samples,), [any]
    is_periodic : bool
        Show the first three periods of the input instead, where it has periods.

    Returns
    -------
    first, end : int, [samples]
        From shortly before the output begins to move until it has settled for as long as
        it moved; at most half of the recording.

    Examples
    --------
    >>> ramp = np.clip(np.arange(1000.0) - 100, 0, 100)
    >>> detail_window(ramp, ramp, is_periodic=False)
    (85, 276)
    """
    distance = np.abs(output - np.median(output[:_START]))
    largest = float(np.max(distance))
    begun = int(np.argmax(distance > _BEGUN * largest))
    arrived = int(np.argmax(distance > _ARRIVED * largest))
    way = arrived - begun
    period = find_period(input) if is_periodic else None
    if period is None:
        first, end = begun - round(_BEFORE * way), arrived + round(_AFTER * way)
    else:
        first, end = begun, begun + round(_PERIODS * period)
    first = max(0, first)
    most = max(int(_MOST_SHARE * output.size), min(_LEAST_SAMPLES, output.size))
    end = first + min(max(end - first, _LEAST_SAMPLES), most)
    # Close to the end of the recording the stretch moves forward, it does not shrink.
    over = max(0, end - output.size)
    return first - over, end - over
