"""Simulations beside measurements, at a point of a fit."""

import numpy as np

from hwid_cli.diagnosis.problem import Compared, Problem
from hwid_cli.diagnosis.unknowns import Layout, Point, vectors_at
from hwid_cli.drive.simulation import REFINEMENT, Motion, run


def simulate(problem: Problem, fit_layout: Layout, point: Point) -> list[Motion]:
    """Simulate all recordings at a point."""
    vectors = vectors_at(problem, fit_layout, point)
    pairs = zip(problem.signals, vectors, strict=True)
    if problem.drive.hold == "smooth":
        return [
            run(
                signals.finely_driven_by,
                vector,
                signals.sample_time_s,
                refinement=REFINEMENT,
            )
            for signals, vector in pairs
        ]
    return [
        run(signals.driven_by, vector, signals.sample_time_s)
        for signals, vector in pairs
    ]


def compare(problem: Problem, fit_layout: Layout, point: Point) -> list[Compared]:
    """Put simulations beside the measurements."""
    motions = simulate(problem, fit_layout, point)
    return [
        Compared(
            signals,
            motion.command if problem.compares_command else motion.output,
            motion.position,
            motion.velocity,
        )
        for signals, motion in zip(problem.signals, motions, strict=True)
    ]


def residuals(problem: Problem, fit_layout: Layout, point: Point) -> list[np.ndarray]:
    """Measured minus simulated of each recording, where it is judged."""
    return [one.residual for one in compare(problem, fit_layout, point)]


def total(parts: list[np.ndarray]) -> float:
    """Sum of squares; infinite where a simulation ran away."""
    sse = sum(float(one @ one) for one in parts)
    return sse if np.isfinite(sse) else float("inf")
