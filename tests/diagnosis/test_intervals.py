"""Which effects of a fit the recordings leave open."""

import pytest

from hwid_cli.diagnosis.intervals import unclear_effects
from tests.diagnosis.small_drive import fit, problem, recordings, sizes

STRIBECK = {"force_N": 0.6, "static_excess_N": 0.5, "velocity_m_per_s": 0.02}


@pytest.mark.parametrize(
    ("true", "unclear"),
    [
        # Plain friction: an excess at rest of next to nothing fits as well.
        ({"coulomb_friction": {"force_N": 0.8}}, ("stribeck_friction",)),
        ({"stribeck_friction": STRIBECK}, ()),
    ],
)
def test_a_law_that_may_be_the_simpler_one_is_left_open(true, unclear):
    given = problem(recordings(true))
    scales = sizes(problem())
    start = {"force_N": 0.7, "static_excess_N": 0.05, "velocity_m_per_s": 0.02}
    found = fit(given, {"stribeck_friction": start}, scales=scales)

    assert found.is_usable
    assert unclear_effects(given, found, scales) == unclear
