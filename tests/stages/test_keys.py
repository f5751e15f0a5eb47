"""What a configuration asks of a stage is in the stage's key, also what it asks later."""

from dataclasses import asdict, field, make_dataclass, replace

import pytest

from hwid_cli.records.experiment import (
    CalibrateOptions,
    Columns,
    CrossvalOptions,
    DiagnoseOptions,
    Experiment,
    FinalTestOptions,
    GroupOptions,
    IdentifyOptions,
    NextLimits,
    NextOptions,
    RecordingsOptions,
    SimulationOptions,
)
from hwid_cli.records.machines import ServoMachine
from hwid_cli.stages.stage import Context
from hwid_cli.stages.table import STAGES, stage_named
from tests.report.report_examples import everything, names

STORED = [name for name in STAGES if stage_named(name).key is not None]


@pytest.fixture(scope="module")
def experiment(tmp_path_factory):
    folder = tmp_path_factory.mktemp("keys")
    rows = "".join(f"{n},{2 * n}\n" for n in range(200))
    for name in names(6):
        (folder / f"{name}.csv").write_text(f"u,y\n{rows}")
    columns = Columns(input="u", output="y")
    return Experiment(
        "example",
        str(folder / "example.yaml"),
        recordings=RecordingsOptions((str(folder / "*.csv"),), columns, 0.01),
        simulate=ServoMachine(),
        calibrate=CalibrateOptions(),
        identify=IdentifyOptions(),
        crossval=CrossvalOptions(),
        group=GroupOptions(),
        test=FinalTestOptions(names(6)[-1:]),
        simulation=SimulationOptions(),
        diagnose=DiagnoseOptions(),
        next=NextOptions(limits=NextLimits(1.0, 10.0, 1.0)),
    )


def with_new_key(section, value):
    """A section whose class has one key more than today's."""
    new = [("added_later", int, field(default=0))]
    kind = make_dataclass("Later", new, bases=(type(section),), frozen=True)
    values = {name: getattr(section, name) for name in asdict(section)}
    return kind(**values, added_later=value)


@pytest.mark.parametrize("name", STORED)
def test_a_new_key_of_its_section_alters_the_key_of_a_stage(name, experiment, tmp_path):
    stage = stage_named(name)

    def key(value):
        section = with_new_key(getattr(experiment, name), value)
        changed = replace(experiment, **{name: section})
        context = Context(changed, tmp_path, everything(6, levels=2).results)
        return stage.key(stage.choose(context))

    assert key(0) == key(0)
    assert key(0) != key(1)
