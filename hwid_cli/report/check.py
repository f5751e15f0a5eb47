"""What a check found, as tables."""

import math
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from hwid_cli.records.check import FitCost, RecordingFacts, StagePlan
from hwid_cli.records.units import behind
from hwid_cli.report.formats import MISSING, counted
from hwid_cli.report.table import Column, Table, numbers, texts

_KILO = 1000.0


def recordings_table(facts: Sequence[RecordingFacts]) -> Table:
    """Show the recordings as they are read, and beneath what looks odd."""
    rows = tuple(
        (
            one.name,
            one.kind,
            str(one.n_input)
            if one.n_input == one.n_output
            else f"{one.n_input}/{one.n_output}",
            str(one.n_used or MISSING),
            f"{one.sample_time_s:g}",
            _range(one.input_range, one.input_unit),
            _range(one.output_range, one.output_unit),
        )
        for one in facts
    )
    columns = (
        *texts("recording", "kind"),
        *numbers("samples", "used", "step [s]", "input", "output"),
    )
    caption = (
        f"{counted(len(facts), 'recording')} as read (used: samples after calibration)"
    )
    notes = tuple(f"{one.name}: {note}" for one in facts for note in one.notes)
    return Table(caption, columns, rows, notes)


def stages_table(plans: Sequence[StagePlan], cost: FitCost, workers: int) -> Table:
    """Show what each stage would do, and what it takes.

    Parameters
    ----------
    workers : int, [-]
        Processes that share the work.
    """
    rows = tuple(
        (
            plan.stage,
            plan.what,
            MISSING if plan.cached is None else f"{plan.cached} of {plan.tasks}",
            time_range(plan.seconds, plan.longest_seconds),
        )
        for plan in plans
    )
    apart = ["start of the program"]
    apart += [plan.stage for plan in plans if not math.isfinite(plan.seconds)]
    notes = (
        f"Estimate, to a factor of 2: {time_range(*total_seconds(plans))} on {workers} "
        f"{'process' if workers == 1 else 'processes'}, {' and '.join(apart)} apart.",
        *(
            f"{plan.stage}: {duration(plan.most_seconds)} if {plan.most_reason}."
            for plan in plans
            if "to" in time_range(plan.seconds, plan.longest_seconds)
        ),
        *(
            f"Scaled from {cost.source}: {cost.seconds:.3f} s for {cost.n_samples} samples."
            for plan in plans
            if plan.stage == "identify"
        ),
        f"Disk: about {size(sum(plan.size_bytes for plan in plans))} more.",
    )
    columns = (
        *texts("stage"),
        Column("tasks", is_text=True, joint=" "),
        *numbers("cached", "time"),
    )
    return Table("What would run", columns, rows, notes)


def total_seconds(plans: Sequence[StagePlan]) -> tuple[float, float]:
    """Sum what is known of all stages: at least and at most, [s]."""
    known = [one for one in plans if math.isfinite(one.seconds)]
    least = math.fsum(one.seconds for one in known)
    return least, math.fsum(one.longest_seconds for one in known)


def time_range(least: float, most: float) -> str:
    """Write how long something takes, as a range where the ends read differently.

    Parameters
    ----------
    least, most : float, [s]

    Examples
    --------
    >>> time_range(20.0, 180.0), time_range(0.2, 0.3), time_range(7.0, 7.0)
    ('20 s to 3 min', '< 1 s', '7 s')
    """
    both = duration(least), duration(most)
    return both[0] if both[0] == both[1] else f"{both[0]} to {both[1]}"


def check_document(
    facts: Sequence[RecordingFacts], plans: Sequence[StagePlan], workers: int
) -> dict[str, Any]:
    """Say the same for programs: times in s, sizes in bytes, null for what is not known.

    Parameters
    ----------
    workers : int, [-]
        Processes that share the work.
    """
    least, most = total_seconds(plans)
    return {
        "recordings": [asdict(one) for one in facts],
        "stages": [
            {
                "stage": one.stage,
                "what": one.what,
                "tasks": one.tasks,
                "cached": one.cached,
                "seconds": _known(one.seconds),
                "most_seconds": _known(one.longest_seconds),
                "most_reason": one.most_reason,
                "size_bytes": one.size_bytes,
            }
            for one in plans
        ],
        "processes": workers,
        "seconds": least,
        "most_seconds": most,
    }


def _known(value: float) -> float | None:
    return value if math.isfinite(value) else None


def duration(seconds: float) -> str:
    """Write a time so that its size is seen at once.

    Parameters
    ----------
    seconds : float, [s]

    Examples
    --------
    >>> [duration(value) for value in (0.02, 7.3, 300.0, 9000.0, float("nan"))]
    ['< 1 s', '7 s', '5 min', '2.5 h', '-']
    """
    if not math.isfinite(seconds):
        return MISSING
    if seconds < 1.0:
        return "< 1 s"
    for limit, unit, name, digits in (
        (120.0, 1.0, "s", 0),
        (7200.0, 60.0, "min", 0),
        (math.inf, 3600.0, "h", 1),
    ):
        if seconds < limit:
            return f"{seconds / unit:.{digits}f} {name}"
    return MISSING


def size(n_bytes: float) -> str:
    """Write a size on the disk.

    Parameters
    ----------
    n_bytes : float, [bytes]

    Examples
    --------
    >>> size(2.5e6), size(3.1e9)
    ('3 MB', '3.1 GB')
    """
    if n_bytes < _KILO**3:
        return f"{math.ceil(n_bytes / _KILO**2)} MB"
    return f"{n_bytes / _KILO**3:.1f} GB"


def _range(limits: tuple[float, float], unit: str) -> str:
    # Adding zero takes the sign off a negative one.
    return f"{limits[0] + 0.0:.3g} to {limits[1] + 0.0:.3g}{behind(unit)}"
