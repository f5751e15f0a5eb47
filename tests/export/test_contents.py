from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.errors import ConfigError
from hwid_cli.export.contents import (
    completed,
    export_model,
    export_simulation,
    find_fit,
)
from hwid_cli.model.simulate import simulate
from hwid_cli.records.drive import Controller
from hwid_cli.records.experiment import (
    Columns,
    DiagnoseOptions,
    RecordingsOptions,
    SimulationOptions,
)
from hwid_cli.records.exported import ModelCard
from hwid_cli.records.recordings import Recording
from tests.export.model_examples import example_model
from tests.store.record_examples import example_fit, failed_fit

TITLES = {"NLHW-Step-6-3-7-1": "step_06/3/7", "NLHW-Step-9-3-7-1": "step_09/3/7"}


@pytest.fixture
def named():
    return {
        "step_06/3/7": example_fit(),
        "step_06/3/8": failed_fit(),
        "step_09/3/7": example_fit(),
    }


def test_a_model_is_found_by_either_name(named):
    assert find_fit("step_06/3/7", named, TITLES)[0] == "step_06/3/7"
    assert find_fit("NLHW-Step-9-3-7-1", named, TITLES)[0] == "step_09/3/7"


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ("step_06/3/9", r"did you mean 'step_06/3/8' or 'step_06/3/7'\?"),
        ("step_6/3/7", r"did you mean 'step_06/3/7'"),
        ("NLHW-Step-6-3-7-2", r"did you mean 'NLHW-Step-6-3-7-1'"),
        ("random", r"expected one of step_06/3/7, step_06/3/8, step_09/3/7"),
        ("step_06/3/8", r"its fit failed \(.*\); expected a model"),
    ],
)
def test_a_model_that_is_not_there_is_one_line(asked, said, named):
    with pytest.raises(ConfigError, match=f"--model {asked}: .*{said}"):
        find_fit(asked, named, TITLES)


def test_an_exported_model_says_where_it_comes_from():
    model = example_model(1)
    fit = replace(example_fit(), identified_on=("a", "c"), model=model, rmsd=0.5)
    recordings = [
        Recording(
            name, level * np.array([-1.0, 2.0]), np.zeros(2), 1e-3, sha256=name * 3
        )
        for name, level in (("a", 1.0), ("b", 9.0), ("c", 3.0))
    ]
    options = RecordingsOptions(("*",), Columns("u", "y"), input_scale=2.0)
    exported = export_model(
        fit, recordings, options, name="a+c/2/2", title="A", origin={"stage": "group"}
    )

    card = exported.card
    assert card.input_range == (-3.0, 6.0)
    assert card.input_scale == 2.0
    assert card.origin["recordings"] == {"a": "aaa", "c": "ccc"}
    assert card.origin["fit"]["rmsd"] == 0.5
    assert card.origin["stage"] == "group"
    u = recordings[0].input
    assert simulate(exported.model, u).tolist() == simulate(model, u).tolist()


def test_an_exported_map_needs_nothing_but_its_break_points_and_values():
    model = example_model(1)
    low, high = model.input_map.domain
    u = np.linspace(2 * low - high, 2 * high - low, 50)
    card = ModelCard("a/2/2", "A", Columns("u", "y"), (low, high))
    exported = completed(card, model)

    assert model.input_map.extrapolation is not None
    assert exported.model.input_map.extrapolation is None
    assert simulate(exported.model, u).tolist() == simulate(model, u).tolist()


def test_under_a_controller_the_input_is_the_reference():
    ramp = np.linspace(0.0, 0.3, 50)
    recording = Recording("a", 9.0 * ramp, ramp, 1e-3, reference=2.0 * ramp)
    columns = Columns("u", "y", reference="r")
    options = RecordingsOptions(("*",), columns, input_scale=5.0, output_scale=3.0)
    simulation = SimulationOptions(controller=Controller(20.0, 3.0))
    exported = export_simulation(
        simulation, [recording], options, DiagnoseOptions(), origin={}
    )

    card = exported.card
    assert (card.columns.input, card.input_unit, card.input_scale) == ("r", "m", 3.0)
    assert card.input_range == (0.0, 0.6)
    assert exported.drive.reference_current_A == recording.input.max()


def test_a_pole_at_one_has_no_static_gain():
    model = replace(example_model(1), denominator=np.array([1.0, -1.0, 0.0]))
    card = ModelCard("a", "a", Columns("u", "y"), (0.0, 1.0))

    assert completed(card, model).static_gain == np.inf
