"""Runs of a simulation, and what is told of them."""

from types import SimpleNamespace

from hwid_cli.diagnosis.simulator import CountedRuns
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
