"""How long something took, as the commands say it."""

import time
from dataclasses import dataclass


@dataclass(frozen=True)
class Timer:
    """A running clock; a call gives the time since its start as text with its unit.

    Parameters
    ----------
    start_s : float, [s]
        Reading of the system's steady clock at the start.
    """

    start_s: float

    @property
    def seconds(self) -> float:
        """Time since the start, in seconds."""
        return time.perf_counter() - self.start_s

    def __call__(self) -> str:
        """Time since the start, as text."""
        return f"{self.seconds:.1f} s"


def start_timer() -> Timer:
    """Start a clock."""
    return Timer(time.perf_counter())
