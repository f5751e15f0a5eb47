"""Longer delays are asked for where models are better with them."""

from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.model.response_estimate import estimate_response
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.stages import delay_choice
from hwid_cli.stages.delay_choice import are_delays_needed, further_delays
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings
from tests.stages.test_together import levels

GRID = OrdersOptions(nb=(1, 2), nk=(1, 2))
OPTIONS = FitOptions(
    units=4, initial_state="steady", input_map="none", starts=2, max_iterations=20
)


def recordings(delay):
    return [levels(name, seed, delay) for seed, name in enumerate("abc", 1)]


def test_delays_go_as_far_as_recordings_allow_beyond_the_grid():
    responses = [estimate_response(one) for one in recordings(9)]
    found = further_delays(responses, GRID, OPTIONS)
    assert found == tuple(range(1, found[-1] + 1))
    assert found[-1] >= 9
    by_delay = OrdersOptions(nb=(1, 2), nk=(1, 2), nk_role="delay", nf=2)
    assert further_delays(responses, by_delay, OPTIONS) == ()
    given = FitOptions(delays=(1, 5))
    assert further_delays(responses, GRID, given) == ()


@pytest.mark.thorough
@pytest.mark.parametrize("delay", [0, 9])
def test_models_ask_for_a_delay_that_is_there_and_for_no_other(delay):
    given = recordings(delay)
    new = [levels("new", 9, delay)]
    options = OPTIONS, tuple(range(1, 15))
    settings = RunSettings(MemoryStore())
    needed = are_delays_needed(
        given, [*given, *new], Orders(2, 2, 1), options, settings
    )
    assert needed is bool(delay)


@pytest.mark.parametrize(
    ("gain", "errors", "expected"),
    [
        (100.0, (1.0, 0.9), True),
        # Fits no better, or predicts others worse.
        (10.0, (1.0, 0.9), False),
        (100.0, (1.0, 1.2), False),
    ],
)
def test_the_fit_and_other_recordings_have_to_agree(
    monkeypatch, gain, errors, expected
):
    def fits(some, *_):
        return [
            [SimpleNamespace(information=SimpleNamespace(bic=bic)) for bic in (gain, 0)]
            for _ in some
        ]

    monkeypatch.setattr(delay_choice, "fit_maps", fits)
    one, other = recordings(0)[:2]
    # Of a model of the first one, on both.
    rmsd = np.array([[[0.1, errors[0]], [0.1, errors[1]]]])
    monkeypatch.setattr(delay_choice, "validation_rmsd", lambda *_: (rmsd, ()))
    options = OPTIONS, (1, 2, 3)
    found = are_delays_needed([one], [one, other], Orders(1, 1, 1), options, None)
    assert found is expected
