"""A fit whose signal before the output map runs away is no model."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.model import fit as module
from hwid_cli.model.fit import fit
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording


@pytest.mark.thorough
def test_a_map_that_was_visited_without_end_makes_the_fit_a_failed_one(monkeypatch):
    rng = np.random.default_rng(1)
    u = np.repeat(rng.uniform(-1, 1, 20), 20)
    recording = Recording("r", u, np.tanh(u) + 0.01 * rng.standard_normal(400), 1.0)
    described = module.described

    def without_end(*arguments, **options):
        found = described(*arguments, **options)
        away = replace(found.model.output_map)
        object.__setattr__(away, "domain", (-np.inf, -np.inf))
        return replace(found, model=replace(found.model, output_map=away))

    assert fit([recording], Orders(1, 1, 1), FitOptions()).status != "failed"
    monkeypatch.setattr(module, "described", without_end)
    found = fit([recording], Orders(1, 1, 1), FitOptions())

    assert (found.status, found.model) == ("failed", None)
    assert "runs away" in found.message
