"""What the compiled Runge-Kutta steps of fourth order share."""

from hwid_cli.compiled import INNER, compiled

# A step is so short that no smooth force turns by more than this, [rad].
LONGEST_PHASE = 0.3


@compiled(**INNER)
def runge_kutta_stage(stage: int, h: float) -> tuple[float, float, float]:
    """Return a stage's time in the step, its weight, and the way to the next one.

    Parameters
    ----------
    h : float, [s]
        Length of the step.

    Returns
    -------
    tuple of float, [s], [sixths of the step], [s]
    """
    if stage == 0:
        return 0.0, 1.0, 0.5 * h
    if stage == 3:
        return h, 1.0, 0.5 * h
    return 0.5 * h, 2.0, h if stage == 2 else 0.5 * h
