"""Outputs that differ although the command of a controller agrees."""

from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import behind_loop
from tests.diagnosis.made_up_fits import made_up

N, NOISE = 400, 1e-4


def said(monkeypatch, errors, *, compares_command=True):
    """What is said of recordings whose simulation errs by a slow wave of these sizes."""
    rng = np.random.default_rng(6)
    wave = np.sin(2 * np.pi * np.arange(N) / 150)
    signals = [
        SimpleNamespace(
            name=f"run_{row}", output=0.2 * wave + NOISE * rng.standard_normal(N)
        )
        for row in range(len(errors))
    ]
    motions = [SimpleNamespace(output=(0.2 - size) * wave) for size in errors]
    monkeypatch.setattr(behind_loop, "rebuilt", lambda *_: ())
    monkeypatch.setattr(behind_loop, "simulate_at", lambda _: motions)
    problem = SimpleNamespace(signals=signals, compares_command=compares_command)
    return behind_loop.unseen_in_command(problem, made_up((), 100.0), None)


def test_a_recording_that_stands_out_in_the_output_is_named(monkeypatch):
    errors = (3e-4, 3e-4, 4e-3, 3e-4)
    # Errors of a sine: 0.71 of its size.
    (text,) = said(monkeypatch, errors)
    assert "run_2 differs by up to 28" in text
    assert "run_1" not in text
    assert "without simulation.controller" in text


@pytest.mark.parametrize(
    ("errors", "compares_command"),
    [
        # All alike, small beside the noise, or compared anyway.
        ((4e-3, 4e-3, 4e-3), True),
        ((1e-4, 1e-4, 9e-4), True),
        ((3e-4, 3e-4, 4e-3), False),
    ],
)
def test_nothing_is_said_of_what_is_usual_or_compared(
    monkeypatch, errors, compares_command
):
    assert said(monkeypatch, errors, compares_command=compares_command) == ()
