"""Choose orders and maps from training data alone.

Rule: the second, third and last quarter of the training recordings are held out in turn.
Every candidate is fitted to the rest, each piece with an initial state of its own, and
simulated free run from the beginning of the recording; the held-out quarter judges it.
Its score is the mean logarithm of these errors. Of the candidates whose score is within
5 % of the best (the tolerance of ``hwid order``) the one with the fewest parameters is
taken. Orders are chosen with the default maps, then maps with these orders, then orders
with these maps, and so on until nothing changes or three rounds have passed. The winner
is fitted anew to all training data. AIC and BIC do not serve here: residuals of a wrong
structure are far from white, and both then ask for too many parameters.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.model.fit import fit
from hwid_cli.records.experiment import OrderOptions
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from tests.benchmarks.real_data import Exam, error, part

# The quarters of a recording that are held out in turn. The first is not: a simulation
# begins with a state that training data give.
HELD_OUT = (1, 2, 3)
MOST_ROUNDS = 3
TOLERANCE = OrderOptions().tolerance


@dataclass(frozen=True)
class Setting:
    """Orders and options of a fit."""

    orders: Orders
    options: FitOptions


@dataclass(frozen=True)
class Judged:
    """A setting, the mean logarithm of its errors, and its number of parameters."""

    setting: Setting
    score: float
    n_parameters: int


def folds(
    recordings: Sequence[Recording],
) -> list[tuple[list[Recording], list[Exam]]]:
    """What each fold fits to, and the stretches that it holds out and judges on."""
    found = []
    for quarter in HELD_OUT:
        train, exams = [], []
        for one in recordings:
            first, stop = (one.n_samples * k // 4 for k in (quarter, quarter + 1))
            pieces = (part(one, 0, first), part(one, stop, one.n_samples))
            train += [piece for piece in pieces if piece.n_samples]
            exams.append(Exam(one.name, part(one, 0, stop), first, (), known=first))
        found.append((train, exams))
    return found


def judge(recordings: Sequence[Recording], setting: Setting) -> Judged:
    """Score of a setting; infinite where a fit fails or diverges."""
    logs, count = [], 0
    for train, exams in folds(recordings):
        result = fit(train, setting.orders, setting.options)
        if result.model is None:
            return Judged(setting, math.inf, 0)
        errors = [error(result.model, exam) for exam in exams]
        logs += [math.log(max(one, 1e-300)) for one in errors]
        count = max(count, result.information.n_parameters)
    return Judged(setting, float(np.mean(logs)), count)


def smallest_good(judged: Sequence[Judged], tolerance: float = TOLERANCE) -> Judged:
    """The fewest parameters within the tolerance of the best score."""
    best = min(one.score for one in judged)
    if math.isinf(best):
        return judged[0]
    good = [one for one in judged if one.score <= best + math.log1p(tolerance)]
    return min(good, key=lambda one: (one.n_parameters, one.score))


def select(
    orders: Sequence[Orders],
    options: Sequence[FitOptions],
    judge_one: Callable[[Setting], Judged],
) -> tuple[Judged, int]:
    """Choose orders and options in turn; the winner and how many were judged."""
    known: dict[Setting, Judged] = {}

    def chosen(settings: Sequence[Setting]) -> Judged:
        for one in settings:
            if one not in known:
                known[one] = judge_one(one)
        return smallest_good([known[one] for one in settings])

    best = chosen([Setting(one, options[0]) for one in orders])
    for _ in range(MOST_ROUNDS):
        before = best.setting
        best = chosen([Setting(before.orders, one) for one in options])
        best = chosen([Setting(one, best.setting.options) for one in orders])
        if best.setting == before:
            break
    return best, len(known)
