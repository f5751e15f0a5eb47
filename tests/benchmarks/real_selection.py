"""Choose orders and maps from training data alone.

Rule: the second, third and last quarter of the training recordings are held out in turn.
Every candidate is fitted to the rest, each piece with an initial state of its own, and
simulated free run from the beginning of the recording; the held-out quarter judges it.
Its score is the mean logarithm of these errors. Orders are chosen with given maps, then
maps with these orders, then orders with these maps, and so on until nothing changes or
three rounds have passed: each time the fewest parameters whose score is within 5 % of the
best. This is done from the linear model and from the default maps, because the orders
that suit the one may be poor for the other. Of all candidates seen, the one with the
fewest parameters is taken whose score is within 5 % or half a standard error of the best:
what a few quarters of one recording cannot tell apart is not better for being larger.
The winner is fitted anew to all training data. AIC and BIC do not serve here: residuals of
a wrong structure are far from white, and both then ask for too many parameters.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.model.fit import fit
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from tests.benchmarks.real_data import Exam, error, part

# The quarters of a recording that are held out in turn. The first is not: a simulation
# begins with a state that training data give.
HELD_OUT = (1, 2, 3)
MOST_ROUNDS = 3
# Share by which a score may be worse than the best.
TOLERANCE = 0.05
# Standard errors of a difference within which two settings count as equal.
ERRORS = 0.5


@dataclass(frozen=True)
class Setting:
    """Orders and options of a fit."""

    orders: Orders
    options: FitOptions


@dataclass(frozen=True)
class Judged:
    """A setting, the logarithms of its errors, and its number of parameters."""

    setting: Setting
    logs: tuple[float, ...]
    n_parameters: int

    @property
    def score(self) -> float:
        """Mean logarithm of the errors."""
        return float(np.mean(self.logs))


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
            return Judged(setting, (math.inf,), 0)
        errors = [error(result.model, exam) for exam in exams]
        logs += [math.log(max(one, 1e-300)) for one in errors]
        count = max(count, result.information.n_parameters)
    return Judged(setting, tuple(logs), count)


def smallest_good(
    judged: Sequence[Judged], tolerance: float = TOLERANCE, *, errors: float = 0.0
) -> Judged:
    """The fewest parameters within a tolerance, or some standard errors, of the best."""
    best = min(judged, key=lambda one: one.score)
    if math.isinf(best.score):
        return judged[0]

    def is_good(one: Judged) -> bool:
        if math.isinf(one.score):
            return False
        worse = np.subtract(one.logs, best.logs)
        spread = worse.std(ddof=1) / math.sqrt(worse.size) if worse.size > 1 else 0.0
        return bool(worse.mean() <= max(math.log1p(tolerance), errors * spread))

    good = [one for one in judged if is_good(one)]
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

    linear = replace(options[0], input_map="none", output_map="none")
    for begun in dict.fromkeys((linear, options[0])):
        best = chosen([Setting(one, begun) for one in orders])
        for _ in range(MOST_ROUNDS):
            before = best.setting
            best = chosen([Setting(before.orders, one) for one in options])
            best = chosen([Setting(one, best.setting.options) for one in orders])
            if best.setting == before:
                break
    return smallest_good(list(known.values()), errors=ERRORS), len(known)
