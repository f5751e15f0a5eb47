"""Forces for a simulation that holds its inputs between samples.

A stand-in has forces in straight lines. A program that takes one value for each step holds
it, and the line comes half a sample late; the mean over each step does not. A step of the
input tells: held, it changes nothing before the next sample.
docs/method_diagnosis.md, eq. (D32f).
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from hwid_cli.records.programs import RunRequest, SimulatorRun

# Where the step of a trial is, in a recording of so many samples at least.
_AT, _FEWEST = 16, 32
# Steps of a force, until one moves anything and gives numbers, [N].
_SIZES = (1.0, 1e-3, 1e3, 1e-6, 1e6)
# Share of the largest change from which on the output has changed, [-].
_CHANGED = 1e-9

# A run; None where it gives no answer.
RunOnce = Callable[[RunRequest], SimulatorRun | None]


def is_held(run: RunOnce, request: RunRequest, *, at_force: bool) -> bool:
    """Whether a simulation holds what it is given between samples.

    Parameters
    ----------
    request : RunRequest
        That is run as it is, and with a step.
    at_force : bool
        Ask its force input, not its input.

    References
    ----------
    docs/method_diagnosis.md, eq. (D32f).
    """
    size = request.input.size
    before = run(request) if size >= _FEWEST else None
    if before is None:
        return False
    steps = _SIZES if at_force else (float(np.ptp(request.input)) or 1.0,)
    for height in steps:
        step = height * (np.arange(size) >= _AT)
        moved = (
            replace(request, force=step)
            if at_force
            else replace(request, input=request.input + step)
        )
        after = run(moved)
        if after is None:
            continue
        change = np.abs(after.output - before.output)
        if change.max() > 0:
            # Later on the change may be any, as of a machine that is pushed over.
            near = change[:_FEWEST]
            return bool(np.argmax(near > _CHANGED * near.max()) > _AT)
    return False


def mean_over_steps(force: np.ndarray) -> np.ndarray:
    """What a force in straight lines between samples is on average until the next one.

    Parameters
    ----------
    force : ndarray, shape (n_samples,), [N]

    Returns
    -------
    ndarray, shape (n_samples,), [N]
    """
    return np.r_[0.5 * (force[:-1] + force[1:]), force[-1:]]
