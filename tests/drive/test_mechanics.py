from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from hwid_cli.drive import excitation
from hwid_cli.drive.mechanics import (
    energy,
    rest_range,
    simulate_motion,
    spring_force,
    static_position,
)
from hwid_cli.records.mechanics import Contact, Friction, Mechanics

GUN = Mechanics(friction=Friction(2.4, 3.6), contact=Contact(0.33, 250.0))
TS = 0.005
# From rest, within one sample.
JUMP = np.repeat([0.0, 8.0], [5, 400])

# Tests on drawn currents have no deadline: the first one waits for the compiler.
currents = st.lists(st.floats(-10, 10), min_size=2, max_size=60).map(np.array)


def refined(current: np.ndarray, factor: int) -> np.ndarray:
    """Return the same broken line, sampled more finely."""
    n = current.size
    return np.interp(np.arange(factor * (n - 1) + 1) / factor, np.arange(n), current)


def wild_current(n: int = 1500) -> np.ndarray:
    """Return a current that makes the gun slide, reverse, stick and touch."""
    rng = np.random.default_rng(11)
    return excitation.random_levels(
        n, 9.0, shortest_samples=10, longest_samples=60, rng=rng
    ) + excitation.sine(n, 0.5, 0.5)


# The whole machine --------------------------------------------------------------------


def test_stiff_contact_is_as_exact_as_a_soft_one():
    mechanics = replace(GUN, contact=Contact(0.1, 1e6, both_sides=True))
    current = wild_current(400)
    coarse = simulate_motion(current, mechanics, sample_time_s=TS)[0]
    fine = simulate_motion(refined(current, 10), mechanics, sample_time_s=TS / 10)[0]
    # Each of some hundred bounces multiplies rounding; 1e-9 m is far below any sensor.
    np.testing.assert_allclose(coarse, fine[::10], atol=1e-9)


@pytest.mark.parametrize(
    "current",
    [
        excitation.step(2000, 9.5),
        excitation.step(2000, 2.0, 300),
        excitation.sine(2000, 1.0, 0.005),
        excitation.sine(2000, 3.0, 0.11),
        wild_current(),
    ],
    ids=["step", "ramp", "slow sine", "resonant sine", "random"],
)
def test_hundredfold_finer_steps_change_nothing(current):
    coarse = simulate_motion(current, GUN, sample_time_s=TS)[0]
    fine = simulate_motion(refined(current, 100), GUN, sample_time_s=TS / 100)[0]
    # Rounding only. The displacement sensor's noise is 1e-4 m.
    assert np.sqrt(np.mean((coarse - fine[::100]) ** 2)) < 1e-12


@given(
    seed=st.integers(0, 2**32 - 1),
    coulomb=st.floats(0, 10),
    excess=st.floats(0, 5),
    edge=st.floats(0.001, 0.3),
    mass=st.floats(0.1, 10),
    damping=st.floats(5, 500),
)
@settings(deadline=None)
def test_finer_steps_change_nothing_whatever_the_machine(
    seed, coulomb, excess, edge, mass, damping
):
    mechanics = Mechanics(
        mass_kg=mass,
        damping_N_s_per_m=damping,
        friction=Friction(coulomb, coulomb + excess),
        contact=Contact(edge, 1e4, both_sides=True),
    )
    current = 5.0 * np.random.default_rng(seed).standard_normal(60)
    coarse = simulate_motion(current, mechanics, sample_time_s=TS)[0]
    fine = simulate_motion(refined(current, 10), mechanics, sample_time_s=TS / 10)[0]
    # Rounding, magnified by bounces between the contacts: 1e-15 m in 6000 draws.
    np.testing.assert_allclose(coarse, fine[::10], atol=1e-12)


@given(
    x=st.floats(-0.5, 0.5),
    v=st.floats(-5, 5),
    level=st.floats(0, 20),
    excess=st.floats(0, 10),
    damping=st.floats(0, 60),
)
@settings(deadline=None)
def test_energy_never_grows_without_current(x, v, level, excess, damping):
    mechanics = replace(
        GUN, friction=Friction(level, level + excess), damping_N_s_per_m=damping
    )
    position, velocity = simulate_motion(
        np.zeros(300), mechanics, sample_time_s=TS, position_m=x, velocity_m_per_s=v
    )
    stored = energy(position, velocity, mechanics)
    # Rounding of at most 150 J.
    assert np.all(np.diff(stored) <= 1e-13 * (1 + stored[0]))


@example(current=np.zeros(60), x=0.4, v=0.0)
@given(current=currents, x=st.floats(-0.4, 0.4), v=st.floats(-3, 3))
@settings(deadline=None)
def test_motion_is_odd_where_the_contact_is_on_both_sides(current, x, v):
    mechanics = replace(GUN, contact=Contact(0.33, 250.0, both_sides=True))
    there = simulate_motion(
        current, mechanics, sample_time_s=TS, position_m=x, velocity_m_per_s=v
    )
    back = simulate_motion(
        -current, mechanics, sample_time_s=TS, position_m=-x, velocity_m_per_s=-v
    )
    np.testing.assert_array_equal(there[0], -back[0])
    np.testing.assert_array_equal(there[1], -back[1])


@given(current=currents, cut=st.integers(1, 58))
@settings(deadline=None)
def test_motion_can_be_taken_up_again_from_any_sample(current, cut):
    cut = min(cut, current.size - 1)
    whole, velocity = simulate_motion(current, GUN, sample_time_s=TS)
    rest, _ = simulate_motion(
        current[cut:],
        GUN,
        sample_time_s=TS,
        position_m=whole[cut],
        velocity_m_per_s=velocity[cut],
    )
    np.testing.assert_allclose(rest, whole[cut:], atol=1e-12)


def test_current_that_is_not_finite_or_not_a_vector_is_refused():
    with pytest.raises(ValueError, match="command_A must be 1-D and finite"):
        simulate_motion(np.array([0.0, np.nan]), GUN, sample_time_s=TS)
    with pytest.raises(ValueError, match="command_A must be 1-D and finite"):
        simulate_motion(np.zeros((2, 2)), GUN, sample_time_s=TS)
    with pytest.raises(ValueError, match="sample_time_s must be positive"):
        simulate_motion(np.zeros(3), GUN, sample_time_s=0.0)


# Static positions ---------------------------------------------------------------------


@given(force=st.floats(-1000, 1000), both_sides=st.booleans())
def test_static_position_balances_the_force(force, both_sides):
    mechanics = replace(GUN, contact=Contact(0.33, 250.0, both_sides=both_sides))
    position = static_position(force, mechanics)
    # Rounding of the force.
    assert spring_force(np.array(position), mechanics) == pytest.approx(
        force, abs=1e-12
    )


def test_static_position_needs_a_spring():
    with pytest.raises(ValueError, match="stiffness_N_per_m must be positive"):
        static_position(1.0, replace(GUN, stiffness_N_per_m=0.0))


@pytest.mark.parametrize("current_A", [0.0, 3.0, 8.0])
def test_mass_rests_inside_its_rest_range_and_leaves_it_outside(current_A):
    lowest, highest = rest_range(current_A, GUN)
    current = np.full(5, current_A)
    margin = 1e-9
    for start in (lowest + margin, highest - margin):
        position, _ = simulate_motion(current, GUN, sample_time_s=TS, position_m=start)
        np.testing.assert_array_equal(position, start)
    for start, sense in ((lowest - margin, 1.0), (highest + margin, -1.0)):
        position, _ = simulate_motion(current, GUN, sample_time_s=TS, position_m=start)
        assert sense * (position[-1] - start) > 0


# The amplifier's limit -----------------------------------------------------------------


@pytest.mark.thorough
@pytest.mark.parametrize(
    "command",
    [
        JUMP,
        -JUMP,
        np.tile([0.0, 9.0, -7.0, 3.0, 4.0, 5.0], 60),
    ],
    ids=["jump", "jump down", "through both limits"],
)
def test_amplifier_cuts_its_command_between_the_samples_too(command):
    factor = 4000
    found = simulate_motion(command, GUN, sample_time_s=TS, limit_A=4.0)
    fine = np.clip(refined(command, factor), -4.0, 4.0)
    expected = simulate_motion(fine, GUN, sample_time_s=TS / factor)
    for one, two in zip(found, expected, strict=True):
        # The fine line misses the corners by half its step, 6e-7 s.
        scale = np.max(np.abs(two))
        np.testing.assert_allclose(one, two[::factor], atol=1e-7 * scale)


def test_samples_that_are_cut_alone_move_less():
    line, _ = simulate_motion(JUMP, GUN, sample_time_s=TS, limit_A=4.0)
    samples, _ = simulate_motion(np.clip(JUMP, -4.0, 4.0), GUN, sample_time_s=TS)
    assert np.max(line - samples) > 1e-3


@given(current=currents)
@settings(deadline=None)
def test_limit_that_nothing_reaches_changes_nothing(current):
    found = simulate_motion(current, GUN, sample_time_s=TS, limit_A=10.0)
    expected = simulate_motion(current, GUN, sample_time_s=TS)
    np.testing.assert_array_equal(found, expected)
