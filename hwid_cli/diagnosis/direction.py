"""Whether the output counts against the input.

A force constant is positive: a wire, a column or an axis that counts the other way makes
its fit end at next to nothing, and every effect then stands in for the motion itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.diagnosis.candidate import SearchStart, base_of, fit_candidate
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.drive.effect import Scales
from hwid_cli.drive.simulation import drive_effects
from hwid_cli.errors import ConfigError
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.diagnosis import NoiseFloor
from hwid_cli.records.units import as_percent

# A fit that leaves less than this share of the motion has its direction right ...
_LEAVES_LITTLE = 0.5
# ... and one that leaves this share of what the other direction leaves has it, too.
_CLEARLY_BETTER = 0.25


@dataclass(frozen=True)
class Reversal:
    """What remains of the motion with the input as it is, and turned round.

    Parameters
    ----------
    as_given, reversed : float, [-]
        RMS over that of the motion about each recording's mean.
    """

    as_given: float
    reversed: float


def find_reversal(
    problem: DiagnosisProblem, base: CandidateFit, scales: Scales, noise: NoiseFloor
) -> Reversal | None:
    """Tell whether the base fits far better with the input turned round.

    Parameters
    ----------
    base : CandidateFit
        Re-fitted.

    Returns
    -------
    Reversal or None
        None where the direction is right, or cannot be told. Under a controller the
        loop itself tells.
    """
    motion = float(problem.each_motion.sum())
    # Forces along a recording belong to the simulation that they stand in for.
    has_force = any(one.force.size for one in problem.signals)
    if (
        problem.compares_command
        or has_force
        or motion == 0
        or not _leaves_much(base.sse, motion)
    ):
        return None
    turned = replace(
        problem,
        signals=tuple(
            replace(one, driven_by=-one.driven_by, input=-one.input)
            for one in problem.signals
        ),
    )
    start = SearchStart(base_of(problem.drive), drive_effects(problem.drive))
    other = fit_candidate(turned, (), [start], scales, noise)
    left = float(other.sse.sum())
    if not (other.is_usable and left < _CLEARLY_BETTER * min(base.sse.sum(), motion)):
        return None
    return Reversal(
        as_given=float(np.sqrt(base.sse.sum() / motion)),
        reversed=float(np.sqrt(left / motion)),
    )


class ReversedInputError(ConfigError):
    """The output moves against the input.

    Parameters
    ----------
    found : Reversal
    """

    def __init__(self, found: Reversal) -> None:
        super().__init__(reversal_sentence(found))
        self.found = found


def reversal_sentence(found: Reversal, *, input_scale: float = 1.0) -> str:
    """Say what was seen and what to do, in one line.

    Parameters
    ----------
    input_scale : float, [-]
        ``recordings.input_scale`` as it is: its sign is wrong, not its size.
    """
    return (
        "recordings.input_scale: the output moves against the input: the re-fitted "
        f"simulation errs by {as_percent(found.as_given)} of the motion as it is, and by "
        f"{as_percent(found.reversed)} with the input turned round; write input_scale: "
        f"{-input_scale:.15g}, or give the force constant the other sign"
    )


def _leaves_much(sse: Sequence[float] | np.ndarray, motion: float) -> bool:
    left = float(np.sum(sse))
    return not np.isfinite(left) or left > _LEAVES_LITTLE * motion
