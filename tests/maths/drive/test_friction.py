import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from hwid_cli.maths.drive.friction import friction_force, sticks
from hwid_cli.records.mechanics import Friction

LAW = Friction(coulomb_N=2.0, break_away_N=3.0)
FORCES = st.floats(-10, 10)


def test_sliding_friction_opposes_the_velocity_with_the_coulomb_force():
    force = friction_force(np.array([-0.1, 1e-12]), np.array([50.0, -50.0]), LAW)
    np.testing.assert_array_equal(force, [2.0, -2.0])


@given(applied=FORCES)
def test_friction_at_rest_balances_what_it_can_hold_and_else_opposes_it(applied):
    force = float(friction_force(np.array(0.0), np.array(applied), LAW))
    if abs(applied) <= 3.0:
        assert force + applied == 0.0
    else:
        assert force == -2.0 * np.sign(applied)


def test_break_away_level_itself_still_holds():
    np.testing.assert_array_equal(
        sticks(np.array([3.0, -3.0, 3.0001]), LAW), [True, True, False]
    )


@given(velocity=st.floats(-5, 5), applied=FORCES)
def test_friction_never_drives_a_motion(velocity, applied):
    force = friction_force(np.array(velocity), np.array(applied), LAW)
    assert force * velocity <= 0.0
