"""Records of a diagnosis: what they refuse, and what they say of themselves."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.diagnosis import VERDICTS, FittedParameter, Gap
from tests.report.diagnosis_examples import named


def fit_with(sse):
    nothing = np.zeros(0)
    return CandidateFit(
        (), (), nothing, (), np.zeros((2, 0)),
        np.array(sse), 0.5, 0.0, 1, True,
    )  # fmt: skip


@pytest.mark.parametrize("word", VERDICTS)
def test_every_verdict_is_accepted(word):
    assert replace(named(), verdict=word).verdict == word


def test_another_word_is_refused():
    with pytest.raises(ValueError, match="'maybe' is none of named, ambiguous"):
        replace(named(), verdict="maybe")


def test_a_fit_is_usable_if_every_recording_could_be_simulated():
    assert fit_with([1.0, 2.0]).is_usable
    assert not fit_with([1.0, np.inf]).is_usable
    assert not fit_with([np.nan, 1.0]).is_usable


def test_a_parameter_without_interval_has_none():
    one = FittedParameter("force_N", 0.8)
    assert np.isnan([one.low, one.high]).all()
    assert one.text == ""


def test_a_record_does_not_change():
    with pytest.raises(FrozenInstanceError):
        Gap(1.0, 2.0, 3.0).train_rms = 0.0


def test_a_parameter_of_an_effect_whose_formula_divides_is_read_as_it_was_written():
    own = ParameterRef('law:{"force_N":"c1*sin(2*pi*x/l1)","unit":"N/(m s)"}', "l1")

    assert ParameterRef.of_text(str(own)) == own
