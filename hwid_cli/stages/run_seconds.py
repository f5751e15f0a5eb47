"""What a run takes beside the work of its stages: starts of processes, and the page.

Measured on two cores (docs/benchmarks.md, "What hwid check forecasts").
"""

from collections.abc import Sequence
from dataclasses import replace

from hwid_cli.records.check import StagePlan
from hwid_cli.stages.fit_seconds import grid_seconds
from hwid_cli.stages.joint_seconds import joint_plan
from hwid_cli.stages.stage import Planning
from hwid_cli.stages.table import to_run

# Reading the compiled loops of what the first tasks need, and starting processes that do
# so too, once for all stages, [s].
LOADING_SECONDS, _START_SECONDS = 0.6, 1.6
# Writing the page, and drawing its figures for each recording, [s].
_PAGE_SECONDS, _FIGURES_SECONDS = 0.8, 0.35
# A grid of linear models, each fitted from nothing, against that of a recording with maps:
# 0.2 to 0.7 (demo, HSM150), [-].
_LINEAR_SHARE = 0.7


def page_plan(planning: Planning) -> StagePlan:
    """What it takes to fit linear models, to write the page and to draw its figures."""
    seconds = _PAGE_SECONDS + _FIGURES_SECONDS * len(planning.recordings)
    what = "the page and its figures"
    fits = "identify" in to_run(planning.experiment)
    if fits and planning.experiment.fit.has_maps:
        what = "linear models, the page and its figures"
        seconds += _linear_seconds(planning)
    return StagePlan("report", what, 1, None, seconds, 0.0)


def _linear_seconds(planning: Planning) -> float:
    """Time of the grid of linear models beside the model to take.

    Of all recordings together where such a model is asked for, else of a typical one.
    """
    found = joint_plan(planning.experiment, planning.recordings, planning.cost)
    if found is not None:
        return found.linear / planning.workers
    by_length = sorted(planning.recordings, key=lambda one: one.n_samples)
    if not by_length:
        return 0.0
    typical = by_length[len(by_length) // 2]
    speed = planning.cost, planning.workers
    return _LINEAR_SHARE * grid_seconds(planning.experiment, [typical], speed)


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
