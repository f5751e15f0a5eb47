"""Outputs that differ although the command of a controller agrees."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import behind_loop
from hwid_cli.diagnosis import diagnose as pipeline
from hwid_cli.diagnosis.diagnose import diagnose
from hwid_cli.records.drive import Controller
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording
from tests.diagnosis.made_up_fits import made_up
from tests.diagnosis.small_drive import in_turn

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


def table(name, inertia, reference, seed):
    """A rotary table under a PID whose derivative the sensor's noise makes loud."""
    kp, ki, kd, step = 180.0, 1100.0, 25.0, 1e-3
    rng = np.random.default_rng(seed)
    angle = speed = total = last = 0.0
    read, sent = [], []
    for row, wanted in enumerate(reference):
        read.append(angle + 2e-5 * rng.standard_normal())
        error = wanted - read[-1]
        total += error * step
        change = (error - last) / step if row else 0.0
        last = error
        sent.append(kp * error + ki * total + kd * change)
        # Exactly, for a torque that is held.
        rate, torque = 0.08 / inertia, 1.1 * sent[-1] / inertia
        end, gone = torque / rate, np.exp(-rate * step)
        angle += end * step + (speed - end) * (1.0 - gone) / rate
        speed = end + (speed - end) * gone
    return Recording(
        name, np.array(sent), np.array(read), step, output_unit="rad",
        reference=np.asarray(reference),
    )  # fmt: skip


@pytest.mark.thorough
def test_what_a_command_does_not_show_is_looked_for_behind_it():
    time = 1e-3 * np.arange(2500)
    parts = [
        np.clip((time - 0.2) / length, 0, 1)
        for length in (1.6, 1.2, 1.4, 2.0, 1.3, 1.8)
    ]
    moves = [
        size * (part - np.sin(2 * np.pi * part) / (2 * np.pi))
        for size, part in zip((2.4, 1.6, -0.8, 3.0, -2.0, 2.5), parts, strict=True)
    ]
    recordings = [
        table(f"move_{row}", 0.11 if row == 2 else 0.05, one, row)
        for row, one in enumerate(moves)
    ]
    given = SimulationOptions(
        mass_kg=0.047, damping_N_s_per_m=0.09, stiffness_N_per_m=0.0,
        force_constant_N_per_A=1.05, hold="zero",
        controller=Controller(
            proportional_gain=180.0, integral_gain=1100.0, derivative_gain=25.0
        ),
    )  # fmt: skip
    options = DiagnoseOptions(
        effects=("parameter_change", "constant_load"), max_effects=1, laws="never"
    )
    found = diagnose(recordings, given, options, in_turn, lambda *_: None)
    assert (found.verdict, found.compared) == ("named", "output y")
    assert [one.id for one in found.effects] == ["parameter_change"]
    assert any("behind the logged input" in one for one in found.warnings)


@pytest.mark.parametrize(
    ("behind", "taken"), [(("gravity",), "behind"), ((), "command")]
)
def test_the_command_has_the_last_word_where_nothing_shows_behind_it(
    monkeypatch, behind, taken
):
    @dataclass
    class Found:
        name: str
        effects: tuple
        warnings: tuple = ()
        scales = None

        @property
        def verdict(self):
            return SimpleNamespace(chosen=SimpleNamespace(effects=self.effects))

    found = iter([Found("command", ()), Found("behind", behind)])
    for name, fake in (
        ("problem_of", lambda *_: None),
        ("find", lambda *_: next(found)),
        ("unseen_in_command", lambda *_: ("move_2",)),
        ("describe", lambda one: one),
    ):
        monkeypatch.setattr(pipeline, name, fake)
    assert diagnose((), SimulationOptions(mass_kg=1.0), None, None, None).name == taken
