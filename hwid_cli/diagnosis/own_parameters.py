"""What belongs to one recording alone: a phase, a factor, a start.

Found from that recording, for given values of what all recordings share.
docs/method_diagnosis.md, eq. (D18).
"""

import numpy as np

from hwid_cli.diagnosis.comparing import residuals
from hwid_cli.diagnosis.problem import Problem
from hwid_cli.diagnosis.search import fit
from hwid_cli.diagnosis.unknowns import START, Layout, Point, first_point

OWN_ITERATIONS = 12
# Values that an own parameter is tried at before its search.
_OWN_TRIALS = {
    "phase_rad": (0.0, 0.5 * np.pi, np.pi, 1.5 * np.pi),
    "log_stiffness": (-0.1, -0.03, 0.0, 0.03, 0.1),
    "log_force_constant": (-0.1, -0.03, 0.0, 0.03, 0.1),
    "log_damping": (-0.2, -0.06, 0.0, 0.06, 0.2),
}


def with_own_trials(problem: Problem, fit_layout: Layout, point: Point) -> Point:
    """Set each recording's own parameters to the best of a few values."""
    for column, unknown in enumerate(fit_layout.own):
        if unknown.owner == START:
            continue
        best = np.full(len(problem.signals), np.inf)
        chosen = point.own[:, column].copy()
        for value in _OWN_TRIALS[unknown.name]:
            own = point.own.copy()
            own[:, column] = unknown.coordinate(value)
            parts = residuals(problem, fit_layout, Point(point.shared, own))
            sse = np.array([float(part @ part) for part in parts])
            better = sse < best
            chosen[better] = own[better, column]
            best[better] = sse[better]
        own = point.own.copy()
        own[:, column] = chosen
        point = Point(point.shared, own)
    return point


def fit_own(problem: Problem, fit_layout: Layout, shared: np.ndarray) -> Point:
    """Find each recording's own parameters for given shared ones.

    Parameters
    ----------
    shared : ndarray, shape (n_shared,)
        Coordinates.
    """
    point = Point(shared, np.zeros((len(problem.signals), len(fit_layout.own))))
    if not fit_layout.own:
        return point
    start = {one: dict[str, float]() for one in fit_layout.effects}
    first = first_point(problem, _only_own(fit_layout), problem.drive, start)
    point = with_own_trials(problem, fit_layout, Point(shared, first.own))
    found = fit(
        problem, fit_layout, point, max_iterations=OWN_ITERATIONS, only_own=True
    )
    return found.point


def _only_own(fit_layout: Layout) -> Layout:
    return Layout((), fit_layout.own, fit_layout.effects)
