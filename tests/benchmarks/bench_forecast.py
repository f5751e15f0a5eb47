"""What ``hwid check`` forecasts for each stage beside what the stage then takes.

``python -m tests.benchmarks.bench_forecast CONFIG...``; one process, first with an empty
cache, then with the full one and empty results. Processor time: a busy machine changes it little. A simulation of the user's own works in
a process of its own, so the forecast of its diagnosis is to be read beside the wall time.
"""

import sys
import tempfile
import time
from pathlib import Path

from hwid_cli.cli.driver import result_of
from hwid_cli.cli.options import Choices
from hwid_cli.cli.session import open_session
from hwid_cli.records.check import StagePlan
from hwid_cli.stages.fit_seconds import time_fits
from hwid_cli.stages.stage import Planning
from hwid_cli.stages.table import stage_named, to_run
from hwid_cli.store.cache import Hdf5Store
from hwid_cli.tasks.task import one_thread


def compare(config: str, out: Path, cache: Path, *, said: str) -> None:
    choices = Choices(Path(config), out, cache=cache, jobs=1, quiet=True)
    session = open_session(choices)
    experiment, measured = session.experiment, result_of(session, "calibrate")
    start = time.process_time()
    with one_thread():
        cost = time_fits(measured.recordings, experiment.orders, experiment.fit)
        store = Hdf5Store(session.cache, sets_aside=False)
        planning = Planning(
            experiment, measured.recordings, cost, store, 1, measured.logs
        )
        names = [one for one in to_run(experiment) if one != "calibrate"]
        plans = [one for name in names for one in stage_named(name).plan(planning)]
    print(f"{config}, {said}: forecast made in {time.process_time() - start:.1f} s")
    for plan in plans:
        start, wall = time.process_time(), time.perf_counter()
        result_of(session, plan.stage)
        taken, wall = time.process_time() - start, time.perf_counter() - wall
        print(
            f"  {plan.stage:9s} {plan.seconds:8.1f} {plan.longest_seconds:8.1f} "
            f"{taken:8.1f} {_missed(plan, taken):6.2f}   (wall {wall:.1f})"
        )


def _missed(plan: StagePlan, taken: float) -> float:
    """How many times the time lies outside of the range; 1 within it, or below a second."""
    least, most = (max(one, 1.0) for one in (plan.seconds, plan.longest_seconds))
    taken = max(taken, 1.0)
    return max(least / taken, taken / most, 1.0)


def main() -> None:
    print("stage         least     most    taken missed")
    for config in sys.argv[1:]:
        with tempfile.TemporaryDirectory() as folder:
            cache = Path(folder) / "cache"
            for said in ("empty cache", "full cache"):
                compare(config, Path(folder) / said, cache, said=said)


if __name__ == "__main__":
    main()
