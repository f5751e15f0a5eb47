"""Tasks on a dask cluster: data sent once, results back to this process, which writes.

Workers need this package in the same version and nothing else: no shared disk and no
configuration. Large arguments, such as recordings, are tasks of their own: the scheduler
hands them to another worker when one has died, with what that one was computing.
"""

import atexit
import logging
import pickle
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from hashlib import sha256
from importlib.util import find_spec
from typing import Any
from uuid import uuid4

from threadpoolctl import threadpool_limits

from hwid_cli import __version__
from hwid_cli.errors import ConfigError
from hwid_cli.files.messages import shown
from hwid_cli.tasks.chunks import CHUNKS_AHEAD, RECENT, Chunks
from hwid_cli.tasks.task import Computed, Task, computed

# A scheduler that does not answer within this time is not there, [s]; the first for the
# library, which bounds only some of its waiting, the second for all of it.
CONNECT_TIMEOUT_S, ANSWER_S = 5.0, 6.0
# A scheduler that was there and is connected may be busy for so long; one whose
# connection broke is given up after the other time, [s].
_BUSY_S, _BROKEN_S = 20.0, 4.0
# Time for giving up what is under way, and for leaving a cluster, [s]; one of our own is
# left when its workers have ended, or the library reports it at exit.
_LEAVE_S, _END_S = 1.0, 10.0
# Arguments with a longer pickle are sent once, [bytes].
LARGE = 8192
# Time between two looks at the workers, and after which a message says there are none.
_LOOK_S, _PATIENCE_S = 2.0, 15.0

_log = logging.getLogger(__name__)

# Key, function, arguments, and what packs the result.
Call = tuple[str, Callable[..., Any], Sequence[Any], Callable[[str, Any], Any] | None]


@dataclass(frozen=True)
class ChunkDone:
    """What a worker sends back.

    Parameters
    ----------
    results : tuple of (str, Computed)
        Keys and results.
    seconds : float, [s]
        That the worker took.
    """

    results: tuple[tuple[str, Computed], ...]
    seconds: float


def cluster_results(
    tasks: Sequence[Task], scheduler: str | None, count: int
) -> Iterator[tuple[str, Computed]]:
    """Results of tasks as they come from a cluster, each with its key.

    Parameters
    ----------
    scheduler : str or None
        Address; None starts a cluster on this machine.
    count : int
        Processes of that.

    Raises
    ------
    ConfigError
        If dask is not installed, the scheduler does not answer or goes away, or a worker
        has no package of this version.
    WorkerError
        If workers died over the same tasks again and again.
    """
    cluster = _cluster(scheduler, count)
    chunks = Chunks(tasks, cluster.recent(tasks))
    on_way: dict[Any, tuple[Task, ...]] = {}
    arrived: queue.Queue[Any] = queue.Queue()
    try:
        while chunks or on_way:
            threads = max(1, cluster.threads())
            while chunks and len(on_way) < CHUNKS_AHEAD * threads:
                chunk = chunks.take(threads)
                future = cluster.submit(chunk)
                on_way[future] = chunk
                future.add_done_callback(arrived.put)
            for future, done in cluster.results(_arrived(arrived, cluster)):
                chunk = on_way.pop(future)
                if done is None:
                    names = chunks.has_died(chunk)
                    _log.warning("workers died over %s; tried once more", names)
                    continue
                chunks.is_done(chunk, done.seconds)
                yield from done.results
    finally:
        cluster.forget(list(on_way))
    chunks.check()


def run_chunk(version: str, calls: Sequence[Call]) -> ChunkDone:
    """Run calls on a worker, one after the other.

    Parameters
    ----------
    version : str
        Of the package in the process that asks.

    Raises
    ------
    ConfigError
        If this worker has another version.
    """
    if version != __version__:
        raise ConfigError(
            f"a worker has hwid {__version__}; expected {version}, as here; install the "
            "same version on all workers"
        )
    _one_thread_for_good()
    begin = time.perf_counter()
    results = tuple((call[0], computed(*call)) for call in calls)
    return ChunkDone(results, time.perf_counter() - begin)


@lru_cache(maxsize=1)
def _one_thread_for_good() -> None:
    """Keep linear algebra to one thread, also where a worker runs several tasks at once."""
    threadpool_limits(limits=1)


class _Cluster:
    """A connection to a scheduler, and what has been sent to it."""

    def __init__(self, client: Any, address: str) -> None:
        self.client, self.address = client, address
        self._sent: dict[int, tuple[Any, Any]] = {}
        self._threads, self._looked_at = 0, -_LOOK_S
        self._checked: set[str] = set()
        self._recent: dict[Callable[..., Any], deque[float]] = {}

    def recent(self, tasks: Sequence[Task]) -> deque[float]:
        """How long tasks of this kind took last, in the rounds before."""
        return self._recent.setdefault(tasks[0].function, deque(maxlen=RECENT))

    def threads(self) -> int:
        """Threads of all workers; looked up every few seconds."""
        if time.monotonic() - self._looked_at >= _LOOK_S:
            before = self._threads
            found = self.ask(self.client.nthreads)
            self._threads = sum(found.values())
            self._check_workers(found.keys() - self._checked)
            self._looked_at = time.monotonic()
            if self._threads < before:
                _log.warning(
                    "a worker of %s is gone; what it was computing is computed again",
                    self.address,
                )
        return self._threads

    def ask(self, call: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
        """What the scheduler answers, if it does so in time.

        Raises
        ------
        ConfigError
            If it is gone, or silent.
        """
        begin = time.monotonic()
        connected, answer = begin, _begun(call, *arguments, **options)
        while True:
            try:
                return _taken(answer, _BROKEN_S / 4)
            except (AttributeError, CancelledError, OSError, RuntimeError) as error:
                # A client that has lost its connection has no scheduler to call.
                is_lost = self.client.scheduler is None
                if isinstance(error, AttributeError) and not is_lost:
                    raise
                now = time.monotonic()
                if self.client.status == "running":
                    connected = now
                if now - connected > _BROKEN_S or now - begin > _BUSY_S:
                    raise self._gone(error) from error
                if not isinstance(error, _NoAnswerError):
                    # A new connection was refused or took long: the machine is busy.
                    time.sleep(_BROKEN_S / 4)
                    answer = _begun(call, *arguments, **options)

    def _gone(self, error: BaseException) -> ConfigError:
        said = " ".join(str(error).split()) or type(error).__name__
        return ConfigError(
            f"--scheduler {self.address}: went away while computing ({shown(said)}); "
            "expected a running dask scheduler; start it and give the same command again"
        )

    def _check_workers(self, new: set[str]) -> None:
        """Refuse workers without this package: they would die over every task."""
        if not new:
            return
        found = self.ask(
            self.client.run, find_spec, "hwid_cli", workers=list(new), on_error="return"
        )
        lacking = sorted(one for one, spec in found.items() if spec is None)
        if lacking:
            raise ConfigError(
                f"--scheduler {self.address}: the worker {lacking[0]} has no package "
                f"hwid; expected {__version__} on every worker; install it there (pip "
                "install 'hwid[dask]') and give the same command again"
            )
        self._checked |= new

    def submit(self, chunk: Sequence[Task]) -> Any:
        """Hand a chunk to the scheduler; gives dask's future."""
        calls = [
            (
                task.key,
                task.function,
                [self._reference(one) for one in task.arguments],
                task.pack,
            )
            for task in chunk
        ]
        name = f"hwid-tasks-{uuid4().hex}"
        return self.client.submit(run_chunk, __version__, calls, key=name)

    def results(self, futures: Sequence[Any]) -> list[tuple[Any, ChunkDone | None]]:
        """What came of chunks; None where workers died over one."""
        from distributed.scheduler import KilledWorker

        finished = [one for one in futures if one.status == "finished"]
        try:
            # All in one message: each alone would cost milliseconds.
            gathered = self._wait_for(self.client.gather, finished)
            found = dict(zip(finished, gathered, strict=True))
        except KilledWorker:
            # What had finished was lost with its worker, and killed those after it.
            found = {}
        return [
            (one, found[one] if one in found else self._result(one)) for one in futures
        ]

    def _result(self, future: Any) -> ChunkDone | None:
        from distributed.scheduler import KilledWorker

        if future.status == "cancelled":
            raise self._gone(CancelledError())
        try:
            return self._wait_for(future.result)
        except KilledWorker:
            return None
        except ImportError as error:
            raise ConfigError(
                f"--scheduler {self.address}: a worker cannot run tasks ({error}); "
                f"expected hwid {__version__} there too; install it on all workers"
            ) from error

    def _wait_for(self, call: Callable[..., Any], *arguments: Any) -> Any:
        """What may take as long as it takes, while the scheduler is there."""
        answer = _begun(call, *arguments)
        while True:
            try:
                return _taken(answer, _LOOK_S)
            except _NoAnswerError:
                self.ask(self.client.nthreads)
            except (CancelledError, OSError) as error:
                raise self._gone(error) from error

    def forget(self, futures: Sequence[Any]) -> None:
        """Give up what is still on its way."""
        if futures and self.client.status == "running":
            with suppress(CancelledError, OSError, RuntimeError):
                _within(_LEAVE_S, self.client.cancel, futures)

    def _reference(self, argument: Any) -> Any:
        """Argument, or what stands for it where it is large."""
        known = self._sent.get(id(argument))
        if known is not None:
            return known[1]
        if isinstance(argument, list | tuple):
            members = [self._reference(one) for one in argument]
            if any(
                one is not other for one, other in zip(members, argument, strict=True)
            ):
                return type(argument)(members)
        content = pickle.dumps(argument, protocol=pickle.HIGHEST_PROTOCOL)
        if len(content) <= LARGE:
            return argument
        name = f"hwid-data-{sha256(content).hexdigest()}"
        future = self.client.submit(pickle.loads, content, key=name)
        # The argument stays with it: its id is its name here.
        self._sent[id(argument)] = (argument, future)
        return future


class _NoAnswerError(TimeoutError):
    """A call has not come back yet."""


def _begun(
    call: Callable[..., Any], *arguments: Any, **options: Any
) -> queue.Queue[tuple[Any, BaseException | None]]:
    """Begin a call in a thread; gives where its result, or its error, will be."""
    answer: queue.Queue[tuple[Any, BaseException | None]] = queue.Queue()

    def run() -> None:
        try:
            answer.put((call(*arguments, **options), None))
        except BaseException as error:
            answer.put((None, error))

    threading.Thread(target=run, daemon=True).start()
    return answer


def _taken(
    answer: queue.Queue[tuple[Any, BaseException | None]], seconds: float
) -> Any:
    try:
        result, error = answer.get(timeout=seconds)
    except queue.Empty:
        raise _NoAnswerError(f"no answer within {seconds:g} s") from None
    if error is not None:
        raise error
    return result


def _within(
    seconds: float, call: Callable[..., Any], *arguments: Any, **options: Any
) -> Any:
    """What a call gives; the library waits without an end for a silent scheduler.

    Raises
    ------
    _NoAnswerError
        If it gives nothing within the time; it goes on in its thread.
    """
    return _taken(_begun(call, *arguments, **options), seconds)


def _arrived(arrived: queue.Queue[Any], cluster: _Cluster) -> list[Any]:
    """Futures that are done: at least one, and all others that have come meanwhile."""
    futures: list[Any] = []
    since, told = time.monotonic(), False
    while not futures:
        try:
            futures.append(arrived.get(timeout=_LOOK_S))
        except queue.Empty:
            has_none = cluster.threads() == 0
            if time.monotonic() - since > _PATIENCE_S and has_none and not told:
                _log.warning("%s has no workers; waiting for one", cluster.address)
                told = True
    while not arrived.empty():
        futures.append(arrived.get_nowait())
    return futures


def _quieten(package: str) -> None:
    """Keep dask from telling of lost workers: what matters is told here."""
    for name in logging.root.manager.loggerDict:
        if name.partition(".")[0] == package:
            logging.getLogger(name).setLevel(logging.CRITICAL)


@lru_cache(maxsize=4)
def _cluster(scheduler: str | None, count: int) -> _Cluster:
    """Connection that lasts as long as the program."""
    try:
        from distributed import Client
    except ImportError as error:
        raise ConfigError(
            f"--backend dask: {error}; expected dask[distributed] in this environment; "
            "run: pip install 'hwid[dask]', or leave --backend out"
        ) from error
    _quieten("distributed")
    try:
        if scheduler is None:
            # This machine only, whatever dask's configuration says.
            client = Client(
                n_workers=count,
                threads_per_worker=1,
                dashboard_address=None,
                host="127.0.0.1",
            )
        else:
            client = _within(ANSWER_S, Client, scheduler, timeout=CONNECT_TIMEOUT_S)
    # A server that is no scheduler may answer anything.
    except Exception as error:
        said = " ".join(str(error).split()) or type(error).__name__
        raise ConfigError(
            f"--scheduler {scheduler}: {shown(said)}; expected the address of a "
            f"running dask scheduler, such as tcp://127.0.0.1:8786{_on_tls(scheduler)}"
        ) from error
    atexit.register(_leave, client, _END_S if scheduler is None else _LEAVE_S)
    return _Cluster(client, scheduler or "the cluster on this machine")


def _on_tls(scheduler: str | None) -> str:
    if scheduler is None or not scheduler.startswith("tls://"):
        return ""
    return (
        "; tls:// needs distributed.comm.tls in dask's configuration, with certificates "
        "that the scheduler accepts (docs/security.md)"
    )


def _leave(client: Any, seconds: float) -> None:
    with suppress(Exception):
        _within(seconds, client.close)
