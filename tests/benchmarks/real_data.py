"""Public measured data with their official splits, and the published errors on them.

The data lie in the folder that ``HWID_REALDATA`` names, else in ``shared/realdata``
beside the project; they are never part of it.
"""

import os
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.io import loadmat

from hwid_cli.model import scores
from hwid_cli.model.simulate import estimated_state, simulate
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.recordings import Recording

PROJECT = Path(__file__).resolve().parents[2]
METHODS = ("linear", "linear ARX", "poly. NARX", "GP NARX", "LSTM", "best")


@dataclass(frozen=True, eq=False)
class Exam:
    """A stretch on which a model is judged, free run and without a look at its output.

    Parameters
    ----------
    name : str
    recording : Recording
        Simulated from its first sample.
    first : int, [samples]
        The first sample that is scored.
    known : int, [samples]
        Samples at the beginning that belong to the training data: the initial state may
        be estimated on them.
    starts_like_fit : bool
        Whether it starts in the state in which the training recording starts. Without
        that, and with nothing known, it starts in equilibrium with its first input.
    published : tuple of float
        Errors of ``METHODS``, in the unit of the benchmark.
    """

    name: str
    recording: Recording
    first: int
    published: tuple[float, ...]
    known: int = 0
    starts_like_fit: bool = False


@dataclass(frozen=True, eq=False)
class Benchmark:
    """Training recordings and what judges their model.

    Parameters
    ----------
    name : str
    unit : str
    per_unit : float
        Units of the table in one unit of the output.
    train : tuple of Recording
    exams : tuple of Exam
    """

    name: str
    unit: str
    per_unit: float
    train: tuple[Recording, ...]
    exams: tuple[Exam, ...]


def folder() -> Path:
    """Where the data should lie."""
    beside = PROJECT.parent / "shared" / "realdata"
    return Path(os.environ.get("HWID_REALDATA") or beside)


def started(model: HammersteinWiener, exam: Exam) -> HammersteinWiener:
    """Model that starts an exam in a state which training data alone have given."""
    if model.initial_state != "estimated" or (exam.starts_like_fit and not exam.known):
        return model
    if exam.known:
        state = estimated_state(model, part(exam.recording, 0, exam.known))
        return replace(model, free_response=state)
    # Not from an empty block: an offset of w is only fixed together with the state.
    return replace(model, initial_state="steady", free_response=np.zeros(0))


def error(model: HammersteinWiener, exam: Exam) -> float:
    """Root-mean-square error over the samples that are scored, [output unit]."""
    one = exam.recording
    simulated = simulate(started(model, exam), one.input)[exam.first :]
    if not np.isfinite(simulated).all():
        return float("inf")
    return scores.rmsd(one.output[exam.first :], simulated)


def part(recording: Recording, first: int, stop: int) -> Recording:
    """Samples of a recording from one to before another, a recording of their own."""
    return Recording(
        recording.name,
        recording.input[first:stop],
        recording.output[first:stop],
        recording.sample_time_s,
    )


def ced(where: Path) -> Benchmark:
    """Coupled electric drives, uniform input: 400 samples train, 100 are the test."""
    data = loadmat(where / "ced" / "DATAUNIF.MAT")
    published = (
        (0.224, 0.291, 0.100, 0.102, 0.303, 0.115),
        (0.384, 0.331, 0.141, 0.090, 0.145, 0.074),
    )
    wholes = [
        Recording(f"CED {k}", data[f"u1{k}"].ravel(), data[f"z1{k}"].ravel(), 0.02)
        for k in (1, 2)
    ]
    exams = tuple(
        Exam(one.name, one, 410, row, known=400)
        for one, row in zip(wholes, published, strict=True)
    )
    train = tuple(part(one, 0, 400) for one in wholes)
    return Benchmark("CED", "ticks/s", 1.0, train, exams)


def tanks(where: Path) -> Benchmark:
    """Cascaded tanks: both recordings start in the same unknown state."""
    path = where / "cascaded_tanks" / "dataBenchmark.csv"
    rows = np.genfromtxt(path, delimiter=",", skip_header=1, usecols=range(4))
    u_fit, u_exam, y_fit, y_exam = np.ascontiguousarray(rows.T)
    exam = Exam(
        "tanks",
        Recording("tanks", u_exam, y_exam, 4.0),
        50,
        (0.588, 0.685, 0.413, 0.622, 0.490, 0.191),
        starts_like_fit=True,
    )
    return Benchmark(
        "tanks", "V", 1.0, (Recording("tanks", u_fit, y_fit, 4.0),), (exam,)
    )


def silverbox(where: Path) -> Benchmark:
    """Silverbox: a cubic spring inside the loop, which no output map can be."""
    data = np.load(where / "silverbox" / "silverbox.npz")
    published = {
        "multisine": (6.96, 6.95, 0.640, 0.301, 1.50, 0.36),
        "arrow_full": (14.4, 14.2, 2.25, 0.60, 2.68, 0.26),
        "arrow_no_extrap": (6.58, 6.59, 0.571, 0.259, 0.960, 0.32),
    }
    step = 1.0 / float(data["fs"])

    def read(name: str) -> Recording:
        one = slice(*data[name])
        return Recording(name, data["u"][one], data["y"][one], step)

    exams = tuple(
        Exam(f"Silverbox {name}", read(f"test_{name}"), 50, row)
        for name, row in published.items()
    )
    return Benchmark("Silverbox", "mV", 1e3, (read("train"),), exams)


def emps(where: Path) -> Benchmark:
    """EMPS: an integrator with dry friction inside a closed loop, run open here."""

    def read(name: str) -> Recording:
        data = loadmat(where / "emps" / f"{name}.mat")
        return Recording(name, data["vir"].ravel(), data["qm"].ravel(), 1e-3)

    published = (5.53, 12.6, 5.17, 1690.0, 74.1, 2.64)
    exam = Exam("EMPS", read("DATA_EMPS_PULSES"), 20, published, starts_like_fit=True)
    return Benchmark("EMPS", "mm", 1e3, (read("DATA_EMPS"),), (exam,))
