from types import SimpleNamespace

import pytest

from hwid_cli.records.programs import SimulatorRun
from hwid_cli.stages import diagnosis_seconds
from hwid_cli.stages.diagnosis_seconds import time_diagnosis


class Clock:
    """Both clocks of a machine on which every task takes its own time."""

    def __init__(self):
        self.now = 100.0

    def process_time(self):
        return self.now

    perf_counter = process_time


@pytest.fixture
def clock(monkeypatch):
    made = Clock()
    monkeypatch.setattr(diagnosis_seconds, "time", made)
    return made


def task(clock, seconds, kind=dict):
    def work():
        clock.now += seconds

    return SimpleNamespace(function=work, arguments=(), result_type=kind)


def test_a_search_is_scaled_from_some_of_its_tasks(clock):
    ended = []

    def diagnose(run, on_round):
        on_round("base", 0)
        clock.now += 2.0
        on_round("single effects, screening", 40)
        run([task(clock, 0.5) for _ in range(40)], keep=True)
        ended.append(True)

    found = time_diagnosis(diagnose, 6, 1, 1)
    # 2 s of the base, 40 tasks with a fifth for what is finished, figures.
    assert found.seconds == pytest.approx(2.0 + 1.2 * 20.0 + 0.6 + 0.7)
    # At most they are screened three times.
    assert found.most_seconds == pytest.approx(2.0 + 3 * 1.2 * 20.0 + 0.6 + 0.7)
    assert clock.now == pytest.approx(100.0 + 2.0 + 11 * 0.5)
    assert (found.n_tasks, ended) == (40, [])


def test_sets_of_effects_are_the_longer_end(clock):
    def diagnose(run, on_round):
        on_round("single effects, screening", 40)
        run([task(clock, 0.5) for _ in range(40)], keep=True)

    two, three = (time_diagnosis(diagnose, 6, most, 1) for most in (2, 3))
    assert two.seconds == three.seconds == pytest.approx(1.2 * 20.0 + 0.6 + 0.7)
    # On top of two sets 12 effects each, and 10 pairs; each half as long again.
    pairs = 3 * 1.2 * 0.5 * 1.5 * (2 * 12 + 10)
    assert two.most_seconds == pytest.approx(3 * 1.2 * 20.0 + pairs + 0.6 + 0.7)
    triples = 3 * 1.2 * 0.5 * 1.5 * 2 * 12
    assert three.most_seconds == pytest.approx(two.most_seconds + triples)


def test_nothing_to_search_for_takes_what_the_beginning_took(clock):
    def diagnose(run, on_round):
        on_round("base", 0)
        clock.now += 2.0

    found = time_diagnosis(diagnose, 6, 3, 1)
    assert found.seconds == found.most_seconds == pytest.approx(2.0 + 0.6 + 0.7)
    assert found.n_tasks == 0


def test_runs_of_the_users_simulation_come_again_at_the_end(clock):
    def diagnose(run, on_round):
        on_round("the simulation as given", 3)
        run([task(clock, 1.0, SimulatorRun) for _ in range(3)], keep=True)
        on_round("single effects, screening", 4)
        run([task(clock, 0.0) for _ in range(4)], keep=True)

    found = time_diagnosis(diagnose, 3, 2, 1)
    # The fake clock counts a run on both clocks.
    assert found.seconds == pytest.approx(3.0 + 3.0 + 9 * 3 * 1.0 + 0.6 + 0.7)
    # At most 800 of them.
    assert found.most_seconds == pytest.approx(3.0 + 800.0 + 0.6 + 0.7)
    assert not found.by_runs


def test_a_slow_simulation_is_not_run_to_the_end_for_a_forecast(clock):
    def diagnose(run, on_round):
        on_round("the simulation as given", 9)
        run([task(clock, 20.0, SimulatorRun) for _ in range(9)], keep=True)

    found = time_diagnosis(diagnose, 9, 2, 1)
    assert found.by_runs
    assert found.n_tasks == 0
    assert clock.now == 100.0 + 2 * 20.0
    # Those that were made say how long the 250 to 800 of a diagnosis take.
    assert (found.seconds, found.most_seconds) == (250 * 20.0, 800 * 20.0)
    shared = time_diagnosis(diagnose, 9, 2, 2)
    assert shared.seconds == 0.5 * found.seconds


def test_a_round_of_few_tasks_gains_little_from_several_processes(clock):
    def diagnose(run, on_round):
        on_round("single effects, screening", 5)
        run([task(clock, 0.5) for _ in range(5)], keep=True)

    alone, shared = (time_diagnosis(diagnose, 6, 1, count) for count in (1, 2))
    # Five tasks on two processes take as long as three; a fifth is lost besides.
    assert alone.seconds == pytest.approx(1.2 * 2.5 + 0.6 + 0.7)
    assert shared.seconds == pytest.approx(1.2 * 1.5 / 0.8 + 0.6 + 0.7)


def test_searches_that_follow_each_other_are_the_longer_end(clock):
    def diagnose(run, on_round):
        on_round("single effects, screening", 40)
        run([task(clock, 0.5) for _ in range(40)], keep=True)

    one, three = (time_diagnosis(diagnose, 6, 1, 1, searches=most) for most in (1, 3))
    assert three.seconds == one.seconds
    single = one.seconds - 0.6 - 0.7
    assert three.most_seconds - one.most_seconds == pytest.approx(6 * single)


def test_laws_are_the_longer_end_where_they_may_be_searched_for(clock):
    def diagnose(run, on_round):
        on_round("single effects, screening", 40)
        run([task(clock, 0.5) for _ in range(40)], keep=True)

    without, laws = (
        time_diagnosis(diagnose, 6, 1, 1, may_be_law=may) for may in (False, True)
    )
    assert laws.seconds == without.seconds
    # Two laws of each of four lengths, as forces and of the sensor, each as long as eight.
    assert laws.most_seconds - without.most_seconds == pytest.approx(16 * 8 * 0.5)


def test_a_drive_that_leaves_nothing_needs_no_law(clock):
    def diagnose(run, on_round):
        on_round("base", 0)
        clock.now += 1.0

    found = time_diagnosis(diagnose, 6, 1, 1, may_be_law=True)
    assert found.most_seconds == found.seconds
