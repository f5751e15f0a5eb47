from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from matplotlib.figure import Figure

from hwid_cli.report.html import report_page
from hwid_cli.report.page import Drawing
from hwid_cli.stages.report import report_contents
from hwid_cli.stages.table import STAGES
from tests.report.diagnosis_examples import named
from tests.report.report_examples import everything, with_results


def keys_of(stored):
    page = report_page(report_contents(stored), STAGES)
    return {one.file: one.key for one in page.drawings}


@pytest.fixture(scope="module")
def keys():
    return keys_of(everything(6, levels=2))


@pytest.mark.thorough
def test_a_change_of_what_draws_gives_each_figure_another_key(keys, monkeypatch):
    monkeypatch.setattr("hwid_cli.report.page.checksum_of_folder", lambda _: "other")

    changed = keys_of(everything(6, levels=2))
    assert not set(changed.values()) & set(keys.values())


@pytest.mark.thorough
def test_equal_results_give_each_figure_the_same_key(keys):
    assert keys_of(everything(6, levels=2)) == keys
    assert len(set(keys.values())) == len(keys) > 30


@pytest.mark.thorough
def test_a_diagnosis_leaves_the_figures_of_other_stages(keys):
    stored = everything(6, levels=2)
    other = replace(named(), summary="another one")
    changed = keys_of(with_results(stored, diagnose=other))

    moved = {file for file in keys if changed[file] != keys[file]}
    assert moved == {file for file in keys if file.startswith("diagnosis/")}


VALUES = (
    *(1, 1.5, float("nan"), "a", None, True, (1, 2), ((1,), 2), {"a": 1}),
    *(np.arange(2), np.arange(2.0), np.arange(2.0).reshape(1, 2)),
    np.array(["a", None], object),
)


@pytest.mark.parametrize("value", VALUES)
def test_a_figure_of_another_value_has_another_key(value):
    def draw(_):
        return Figure()

    def key(one):
        return Drawing("a.png", partial(draw, one)).key

    others = [2, "1", (1, 3), {"a": 2}, np.array([0.0, 2.0]), np.array([0.0, np.nan])]
    assert key(value) == key(value)
    assert key(value) not in [key(one) for one in others]
    assert key(value) != Drawing("b.png", partial(draw, value)).key
