"""What the configuration says of a simulation of the user's."""

from math import inf

import pytest

from hwid_cli.records.programs import FreeParameter


@pytest.mark.parametrize(
    ("value", "bounds", "limits"),
    [
        (13.0, (1.0, 100.0), (1.0, 100.0)),
        # A damping that turns negative imitates what is missing.
        (13.0, (), (0.013, inf)),
        (-2.0, (), (-inf, -0.002)),
        (0.0, (), (-inf, inf)),
        (13.0, (-100.0, 100.0), (-100.0, 100.0)),
    ],
)
def test_without_bounds_a_parameter_keeps_its_sign(value, bounds, limits):
    assert FreeParameter(value, bounds).limits == pytest.approx(limits)
