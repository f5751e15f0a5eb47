"""How long a campaign takes on a cluster: its queues, played through event by event.

One process hands chunks of tasks out, takes results back and writes them; one scheduler
passes them on; workers compute. A round of tasks ends before the next one begins, as the
grid of orders and the stages do. Times come from measurements (``bench_dask``).
"""

import heapq
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Costs:
    """What the way of a chunk costs.

    Parameters
    ----------
    send_s, receive_s : float, [s]
        That the parent is busy with a chunk, apart from its results.
    write_s : float, [s]
        That the parent is busy with one result: unpacked, written, counted.
    scheduler_s : float, [s]
        That the scheduler is busy with a chunk.
    latency_s : float, [s]
        From the parent to a worker, and back.
    """

    send_s: float
    receive_s: float
    write_s: float
    scheduler_s: float
    latency_s: float


@dataclass(frozen=True)
class Round:
    """Tasks that may run side by side.

    Parameters
    ----------
    tasks : int, [-]
    seconds : float, [s]
        Mean of a task.
    spread : float, [-]
        Standard deviation of the logarithm of a task's duration.
    chunk : int, [-]
        Tasks that go out together.
    """

    tasks: int
    seconds: float
    spread: float
    chunk: int


@dataclass(frozen=True)
class Played:
    """What came of it.

    Parameters
    ----------
    wall_s : float, [s]
    parent_busy, scheduler_busy, workers_busy : float, [-]
        Share of the wall time; of the workers, the mean.
    """

    wall_s: float
    parent_busy: float
    scheduler_busy: float
    workers_busy: float


def play(
    rounds: tuple[Round, ...], workers: int, costs: Costs, *, ahead: int, seed: int = 1
) -> Played:
    """Play a campaign through.

    Parameters
    ----------
    rounds : tuple of Round
    workers : int
        With one thread each.
    costs : Costs
    ahead : int
        Chunks that are on their way for each worker at most.
    seed : int

    Returns
    -------
    Played
    """
    random = np.random.default_rng(seed)
    now = parent = scheduler_free = scheduler = computed = 0.0
    for one in rounds:
        sizes = np.full(-(-one.tasks // one.chunk), one.chunk)
        sizes[-1] -= sizes.sum() - one.tasks
        mean = np.log(one.seconds) - 0.5 * one.spread**2
        work = np.add.reduceat(
            random.lognormal(mean, one.spread, one.tasks),
            np.concatenate([[0], np.cumsum(sizes)[:-1]]),
        )
        free = [now] * workers
        coming: list[tuple[float, int]] = []
        handed = 0
        while handed < sizes.size or coming:
            if handed < sizes.size and len(coming) < ahead * workers:
                now += costs.send_s
                parent += costs.send_s
                scheduler_free = max(scheduler_free, now) + costs.scheduler_s
                scheduler += costs.scheduler_s
                arrives = scheduler_free + costs.latency_s
                ends = max(heapq.heappop(free), arrives) + work[handed]
                heapq.heappush(free, ends)
                heapq.heappush(coming, (ends + costs.latency_s, int(sizes[handed])))
                computed += work[handed]
                handed += 1
            else:
                ready, size = heapq.heappop(coming)
                busy = costs.receive_s + size * costs.write_s
                now = max(now, ready) + busy
                parent += busy
    return Played(now, parent / now, scheduler / now, computed / now / workers)


def grid_rounds(
    recordings: int, nb: int, nk: int, *, seconds: float, spread: float, chunk: int
) -> tuple[Round, ...]:
    """Rounds in which a grid of orders grows from its corner, for all recordings.

    Parameters
    ----------
    recordings, nb, nk : int
        The grid has nb x nk pairs of orders.
    seconds, spread : float
        Of one fit.
    chunk : int

    Returns
    -------
    tuple of Round
        One for each diagonal.
    """
    lengths = [min(k, nb, nk, nb + nk - k) for k in range(1, nb + nk)]
    return tuple(Round(recordings * n, seconds, spread, chunk) for n in lengths)
