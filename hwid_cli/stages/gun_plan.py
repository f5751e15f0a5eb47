"""Which recordings of the virtual gun are planned: the thesis's three tables."""

import difflib
from dataclasses import dataclass

from hwid_cli.errors import ConfigError
from hwid_cli.records.machines import (
    GunPlan,
)

GUN_KINDS = ("step", "sine", "random")


@dataclass(frozen=True)
class PlannedRecording:
    """One recording of the gun's plan.

    Parameters
    ----------
    kind : str
        One of ``GUN_KINDS``.
    number : int, [-]
        Its number among the recordings of its kind, from 1.
    amplitude_A : float, [A]
    ramp_samples : int, [samples]
        Of a step.
    rad_per_sample : float, [rad/sample]
        Of a sine.
    """

    kind: str
    number: int
    amplitude_A: float
    ramp_samples: int = 0
    rad_per_sample: float = 0.0

    @property
    def name(self) -> str:
        """Name of the recording, ``step_01``."""
        return f"{self.kind}_{self.number:02d}"


def plan_gun(plan: GunPlan) -> tuple[PlannedRecording, ...]:
    """List the gun's full plan, numbered row by row, before ``only`` selects from it.

    Examples
    --------
    >>> recordings = plan_gun(GunPlan())
    >>> len(recordings), recordings[5].name, recordings[5].ramp_samples
    (43, 'step_06', 100)
    """
    steps = [
        PlannedRecording("step", number, amplitude, ramp_samples=ramp)
        for number, (ramp, amplitude) in enumerate(
            (
                (ramp, amplitude)
                for ramp in plan.step_ramps_samples
                for amplitude in plan.step_amplitudes_A
            ),
            start=1,
        )
    ]
    cells = [
        (frequency, amplitude)
        for row, frequency in enumerate(plan.sine_frequencies_rad_per_sample, start=1)
        for column, amplitude in enumerate(plan.sine_amplitudes_A, start=1)
        if f"{row}x{column}" not in plan.sine_left_out
    ]
    sines = [
        PlannedRecording("sine", number, amplitude, rad_per_sample=frequency)
        for number, (frequency, amplitude) in enumerate(cells, start=1)
    ]
    randoms = [
        PlannedRecording("random", number, amplitude)
        for number, amplitude in enumerate(plan.random_amplitudes_A, start=1)
    ]
    return (*steps, *sines, *randoms)


def select_recordings(
    planned: tuple[PlannedRecording, ...], only: tuple[str, ...] | None
) -> tuple[PlannedRecording, ...]:
    """Pick recordings from a plan by name.

    Parameters
    ----------
    only : tuple of str or None
        Names; None for all.

    Returns
    -------
    tuple of PlannedRecording
        In the plan's order.

    Raises
    ------
    ConfigError
        If a name is not in the plan.
    """
    if only is None:
        return planned
    names = [recording.name for recording in planned]
    for name in only:
        if name not in names:
            near = difflib.get_close_matches(name, names, n=1)
            hint = f"did you mean {near[0]!r}?" if near else "extend the plan"
            raise ConfigError(
                f"simulate.plan.only: {name!r} is none of the plan's {len(names)} "
                f"recordings; {hint}"
            )
    return tuple(recording for recording in planned if recording.name in only)
