"""A last fit whose derivatives are of runs: on made-up runs whose answer is known."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import through_runs
from hwid_cli.diagnosis.scales import scales_of_recordings
from hwid_cli.diagnosis.simulator import CountedRuns, Runs, Simulator
from hwid_cli.diagnosis.through_runs import fitted_through_runs, followed
from hwid_cli.diagnosis.turns import Turn, held
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.programs import Capabilities, FreeParameter
from tests.diagnosis.small_drive import NOISE, problem

FORCE = ParameterRef("coulomb_friction", "force_N")
TRUE_N, TRUE_KG, N_TRAINING = 2.0, 0.4, 8


class Program:
    """Runs whose errors go with the logarithm of a force and with a mass.

    Both change the output alike but for `apart` of it: a valley. A run lies between where
    the last one was and what its values lead to, so that several are needed to agree.
    """

    def __init__(self, apart, *, agrees_by=0.2, bend=0.0, gap=0.0):
        self.count = 0
        self.agrees_by, self.bend = agrees_by, bend
        rng = np.random.default_rng(3)
        self.both, other = rng.standard_normal((2, 200)) * 100 * NOISE
        self.apart = apart * other
        self.gap = gap * NOISE * rng.standard_normal(200)

    def answered(self, _findings, turn, _runs):
        self.count += 1
        force = np.log(turn.fit.values[0] / TRUE_N)
        mass = (turn.values["mass"] - TRUE_KG) / 0.3
        along = force - mass + self.bend * (force + mass) ** 2
        wanted = self.both * along + self.apart * (force + mass) + self.gap
        before = np.concatenate(turn.left)[: wanted.size] if turn.left else 0 * wanted
        now = wanted + self.agrees_by * (before - wanted)
        one = (now,) * len(turn.problem.signals)
        late = float(np.sqrt(np.mean((now - wanted) ** 2)))
        following = replace(turn, left=one, disagreement=late,
                            tried=(turn.fit, turn.values))  # fmt: skip
        return SimpleNamespace(turn=following)


@pytest.fixture
def begun(monkeypatch):
    """A turn that is 30 % off along the valley, findings and runs."""

    def of(program, *, force=2.32, mass=0.445):
        monkeypatch.setattr(through_runs, "answered", program.answered)
        given = problem(held_out=("sine_3",))
        fit = CandidateFit(
            effects=("coulomb_friction",), names=(FORCE,), values=np.array([force]),
            own_names=(), own=np.zeros((9, 0)), sse=np.ones(9), whiteness=2.0,
            neighbour=0.0, iterations=1, has_converged=True,
        )  # fmt: skip
        values = {"mass": mass}
        turn = Turn(held(given), fit, values, said=1.0, at_force=True,
                    tried=(fit, values))  # fmt: skip
        turn = program.answered(None, turn, None).turn
        speeds = [one.velocity for one in given.signals]
        findings = SimpleNamespace(
            scales=scales_of_recordings(given, speeds),
            criteria=SimpleNamespace(
                noise=SimpleNamespace(rms=NOISE),
                ratio=lambda _: 2.0,
                is_complete=lambda _: False,
            ),
        )
        free = {"mass": FreeParameter(0.3, (0.05, 3.0))}
        tasks = SimpleNamespace(are_spent=False)
        runs = SimpleNamespace(simulator=SimpleNamespace(free=free), run_tasks=tasks)
        return findings, turn, runs

    return of


@pytest.mark.parametrize("apart", [1.0, 0.03, 0.01])
def test_a_valley_is_followed_to_its_end(begun, apart):
    program = Program(apart)
    found = fitted_through_runs(*begun(program))

    # Twice the standard deviation that noise would give along the valley.
    length = np.linalg.norm(2.0 * program.apart) * np.sqrt(N_TRAINING)
    within = max(0.003, 2.0 * NOISE / length)
    assert np.log(found.fit.values[0] / TRUE_N) == pytest.approx(0.0, abs=within)
    assert (found.values["mass"] - TRUE_KG) / 0.3 == pytest.approx(0.0, abs=within)


def test_a_bent_valley_takes_more_steps(begun):
    found = fitted_through_runs(*begun(Program(0.1, bend=0.2)))

    assert found.fit.values[0] == pytest.approx(TRUE_N, rel=0.02)


def test_beside_what_is_missing_no_valley_is_followed(begun):
    """A wrong law took 590 runs to leave 54 times the noise in place of 60, in squares."""
    near, far = (Program(0.1, bend=0.2, gap=gap) for gap in (1.0, 10.0))
    for program in (near, far):
        fitted_through_runs(*begun(program))

    assert far.count < 0.8 * near.count


def test_values_stay_within_their_bounds(begun):
    findings, turn, runs = begun(Program(1.0))
    runs.simulator.free["mass"] = FreeParameter(0.42, (0.42, 3.0))

    found = fitted_through_runs(findings, turn, runs)

    assert found.values["mass"] == pytest.approx(0.42)


def test_no_step_where_none_is_worth_it(begun):
    program = Program(1.0)
    findings, turn, runs = begun(program, force=TRUE_N, mass=TRUE_KG)

    assert fitted_through_runs(findings, turn, runs) is None
    # One set of derivatives says so.
    assert program.count < 10


def test_nor_once_the_runs_are_spent(begun):
    program = Program(1.0)
    findings, turn, runs = begun(program)
    runs.run_tasks.are_spent = True

    assert fitted_through_runs(findings, turn, runs) is None


@pytest.mark.parametrize("free", [True, False])
def test_factors_of_the_base_are_no_parameters_of_a_simulation(begun, free):
    findings, turn, runs = begun(Program(1.0))
    if free:
        turn = replace(turn, problem=replace(turn.problem, known={}))
    else:
        runs.simulator.free.clear()

    assert fitted_through_runs(findings, turn, runs) is None


@pytest.mark.parametrize(("ratio", "is_followed"), [(2.0, True), (40.0, False)])
def test_what_leaves_far_more_than_noise_is_not_followed(
    begun, monkeypatch, ratio, is_followed
):
    findings, turn, runs = begun(Program(1.0))
    monkeypatch.setattr(through_runs, "fit_of_run", lambda *_: turn.fit)
    findings.criteria.ratio = lambda _: ratio
    runs = Runs(
        Simulator(Capabilities(run=True), free=runs.simulator.free), CountedRuns(print)
    )

    assert (followed(findings, turn, runs) is not turn) is is_followed
