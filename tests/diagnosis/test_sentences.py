"""What is said of the rest that a verdict leaves."""

from dataclasses import replace

import pytest

from hwid_cli.diagnosis.sentences import _held_command, _rest
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.records.diagnosis import FittedEffect, FittedParameter
from tests.diagnosis.made_up_fits import CRITERIA, made_up
from tests.diagnosis.small_drive import STEP_S, problem, recordings


@pytest.mark.parametrize(
    ("times_the_noise", "is_complete", "said"),
    [
        (1.0, True, ""),
        (
            0.4,
            False,
            " What remains is no larger than the noise, but not as random.",
        ),
        (2.0, False, " Something smaller remains."),
        (10.0, False, " What remains is not explained."),
    ],
)
@pytest.mark.parametrize("word", ["named", "law"])
def test_the_rest_is_called_what_it_is(word, times_the_noise, is_complete, said):
    found = made_up(("coulomb_friction",), 100 * times_the_noise**2)
    verdict = DiagnosisVerdict(word, is_complete, found, ())
    assert _rest(CRITERIA, verdict) == said


def delayed(delay_s):
    value = FittedParameter("delay_s", delay_s)
    return FittedEffect("input_delay", "acts later", "i(t - td)", (value,))


@pytest.mark.parametrize(
    ("samples", "hold", "is_said"),
    [(0.5, "linear", True), (0.53, "linear", True), (0.5, "zero", False),
     (1.0, "linear", False), (2.5, "linear", False)],
)  # fmt: skip
def test_a_delay_of_half_a_sample_may_be_a_held_command(samples, hold, is_said):
    of = problem(recordings())
    of = replace(of, drive=replace(of.drive, hold=hold), may_be_held=False)
    said = _held_command(of, (delayed(samples * STEP_S),))
    assert ("simulation.hold: zero" in said) == is_said
