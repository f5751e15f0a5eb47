"""What a run takes beside the work of its stages: starts of processes, and the page.

Measured on two cores (docs/benchmarks.md, "What hwid check forecasts").
"""

from collections.abc import Sequence
from dataclasses import replace

from hwid_cli.records.check import StagePlan

# Reading the compiled loops of what the first tasks need, and starting processes that do
# so too, once for all stages, [s].
LOADING_SECONDS, _START_SECONDS = 0.6, 1.6
# Writing the page, and drawing its figures for each recording, [s].
_PAGE_SECONDS, _FIGURES_SECONDS = 0.8, 0.35


def page_plan(n_recordings: int) -> StagePlan:
    """What it takes to write the page and to draw its figures.

    Parameters
    ----------
    n_recordings : int, [-]
    """
    seconds = _PAGE_SECONDS + _FIGURES_SECONDS * n_recordings
    return StagePlan("report", "the page and its figures", 1, None, seconds, 0.0)


def with_start(plans: Sequence[StagePlan], workers: int) -> list[StagePlan]:
    """Add to the first stage whose tasks are shared what it takes to begin with them.

    Parameters
    ----------
    workers : int, [-]
        Processes that share the work; one alone need not be started.
    """
    seconds = LOADING_SECONDS + (_START_SECONDS if workers > 1 else 0.0)
    first = next((one for one in plans if one.waits_for_processes), None)
    return [
        replace(
            one,
            seconds=one.seconds + seconds,
            most_seconds=one.most_seconds + seconds,
        )
        if one is first
        else one
        for one in plans
    ]
