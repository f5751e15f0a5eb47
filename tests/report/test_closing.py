from dataclasses import replace

import pytest

from hwid_cli.records.best_model import BestModel
from hwid_cli.report.closing import best_model_sentences, closing_text

BEST = BestModel(
    *("a+b/2/3", "test", ("c", "d"), 0.012, "m", 0.01),
    linear_rmsd=0.03,
    single="a/2/2",
    single_rmsd=0.011,
)


def test_a_command_to_copy_stays_on_one_line():
    command = "hwid export experiment.yaml --model " + "a+" * 60
    text = closing_text("t", [("best model", "word " * 40), ("next", command)], 80)

    assert f"  next        {command}" in text.splitlines()
    assert max(map(len, text.splitlines()[:-1])) <= 80


def test_a_failure_to_help_is_said():
    said = "; ".join(best_model_sentences(BEST)).replace("\xa0", " ")

    assert "mean RMSD 0.012 m on 2 recordings never used (c and d)" in said
    assert "NOT below the 0.01 m" in said
    assert "joining recordings does not help here: a/2/2 alone 0.011 m" in said
    better = replace(BEST, rmsd=0.009)
    assert "joining recordings helps here" in "; ".join(best_model_sentences(better))


def test_a_judge_that_nobody_knows_is_refused():
    with pytest.raises(ValueError, match="judge 'me' is none of"):
        replace(BEST, judge="me")
