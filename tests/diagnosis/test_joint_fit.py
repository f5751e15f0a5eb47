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


def together(of, before):
    """With one parameter of the simulation, which shifts its output."""
    findings = SimpleNamespace(
        scales=sizes(of), criteria=SimpleNamespace(noise=white())
    )
    slopes = [np.ones((one.driven_by.size, 1)) for one in of.signals]
    pushes = [1184.0 * one for one in slopes]
    return joint_fit.fitted_together(of, before, (slopes, pushes), findings)


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
