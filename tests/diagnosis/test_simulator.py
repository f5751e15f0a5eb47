"""Runs of a simulation, and what is told of them."""

from types import SimpleNamespace

import pytest

from hwid_cli.diagnosis.simulator import CountedRuns, most_runs
from hwid_cli.records.candidates import CandidateFit
from hwid_cli.records.programs import SimulatorRun


def test_what_begins_is_told_with_the_runs_until_then():
    said = []
    counted = CountedRuns(lambda tasks, *, keep: [(one, keep) for one in tasks])
    begin = counted.told(lambda what, total: said.append((what, total)))
    run, fit = (
        SimpleNamespace(result_type=one) for one in (SimulatorRun, CandidateFit)
    )

    begin("the simulation as given", 1)
    assert counted([run], keep=True) == [(run, True)]
    begin("its parameters", 0)
    counted([run, fit, run], keep=False)
    begin("single effects, screening", 30)
    assert said == [
        ("the simulation as given", 1),
        ("its parameters, after 1 run", 0),
        ("single effects, screening, after 3 runs", 30),
    ]


@pytest.mark.parametrize(
    ("given", "recordings", "free", "most"),
    [(None, 4, 2, 800), (None, 6, 5, 1440), (None, 27, 1, 2160), (50, 27, 3, 50)],
)
def test_as_many_runs_as_recordings_and_parameters_ask_for_unless_the_configuration_says(
    given, recordings, free, most
):
    assert most_runs(given, recordings, free) == most


def test_some_runs_are_left_for_what_follows():
    counted = CountedRuns(lambda tasks, *, keep: tasks, most=10)
    run = SimpleNamespace(result_type=SimulatorRun)
    counted([run], keep=True)
    some = counted.up_to(0.75)
    some([run] * 6, keep=True)
    assert not some.are_spent
    some([run], keep=True)
    assert (some.are_spent, counted.are_spent, counted.count) == (True, False, 8)
