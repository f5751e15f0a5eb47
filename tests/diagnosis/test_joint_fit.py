"""Effects and parameters of a simulation together, beside a stand-in."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import joint_fit
from hwid_cli.diagnosis.parameters import residuals_at
from tests.diagnosis.small_drive import fit, problem, recordings, sizes, white


def with_friction():
    of = problem(recordings({"coulomb_friction": {"force_N": 0.8}}))
    signals = tuple(
        replace(one, force=np.zeros(one.driven_by.size)) for one in of.signals
    )
    return replace(of, signals=signals)


def together(of, before, n=1, hold=1e-6):
    """With parameters of the simulation, each of which shifts its output."""
    findings = SimpleNamespace(
        scales=sizes(of), criteria=SimpleNamespace(noise=white())
    )
    slopes = [np.ones((one.driven_by.size, n)) for one in of.signals]
    moved_by = slopes, [1184.0 * one for one in slopes]
    holds = hold * np.arange(1.0, n + 1)
    return joint_fit.fitted_together(of, before, moved_by, holds, findings)


def test_parameters_that_samples_do_not_tell_apart_stay_where_they_are():
    # Each recording is off by 1 mm, which each of two parameters explains as well.
    of = with_friction()
    signals = tuple(replace(one, compared=one.compared + 1e-3) for one in of.signals)
    _, (first, second) = together(replace(of, signals=signals), fit(of), 2, hold=1e-3)
    assert first + second == pytest.approx(1e-3, rel=0.05)
    # Least a^2 + (2 b)^2 with a + b given: the one that is held twice as hard moves least.
    assert first == pytest.approx(4 * second, rel=0.02)


def test_a_stand_in_that_has_run_away_tells_nothing(monkeypatch):
    # A spring that softens gives way for good.
    of = with_friction()
    before = fit(of)

    def ran_away(*args):
        return [np.full(one.size, np.nan) for one in residuals_at(*args)]

    monkeypatch.setattr(joint_fit, "residuals_at", ran_away)
    assert together(of, before) is None


def test_a_search_goes_on_where_the_stand_in_runs_away_beside_it(monkeypatch):
    of = with_friction()
    before = fit(of)
    usual, _ = together(of, before)
    calls = []

    def sometimes(*args):
        calls.append(args)
        left = residuals_at(*args)
        # The first derivative, after the start three times.
        is_there = len(calls) == 4
        return [np.full(one.size, np.nan) for one in left] if is_there else left

    monkeypatch.setattr(joint_fit, "residuals_at", sometimes)
    found, _ = together(of, before)
    assert len(calls) > 4
    assert found.sse.sum() == pytest.approx(usual.sse.sum(), rel=0.02)


def test_what_belongs_to_a_recording_stays_within_its_bounds(monkeypatch):
    # A mass of almost nothing: its drive would be simulated for hours.
    of = with_friction()
    change = "parameter_change:mass"
    before = fit(of, {change: {"log_mass": 0.0}})

    def far_away(errors, start, *_, **__):
        at = np.concatenate([start[:-3], [-10.0, -10.0, -10.0]])
        return SimpleNamespace(x=at, left=errors(at))

    monkeypatch.setattr(joint_fit.scipy.optimize, "least_squares", far_away)
    found, _ = together(of, before)
    assert found.own.min() == pytest.approx(-1.5)
