"""What is said of the rest that a verdict leaves."""

import pytest

from hwid_cli.diagnosis.sentences import _rest
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from tests.diagnosis.made_up_fits import CRITERIA, made_up


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
