import numpy as np
import pytest
from scipy.optimize import minimize

from hwid_cli.model.linear_block import difference_basis
from hwid_cli.model.pole_bound import (
    by_sections,
    drawn_in,
    is_within,
    moved_sections,
    sections_of,
    sides,
    step_within,
)

RADIUS = 0.8
PAIR = RADIUS * np.exp(0.4j * np.array([1, -1]))
ON_CIRCLE = {
    "an integrator": [1.0, 0.5],
    "two integrators": [1.0, 1.0, 0.3, -0.4],
    "a mode": [*np.exp(0.7j * np.array([1, -1])), 0.9],
    "an integrator and a mode": [1.0, *np.exp(0.2j * np.array([1, -1]))],
    "a pole at -1": [-1.0, 0.2],
}


def test_sections_multiply_to_the_denominator():
    for name, poles in ON_CIRCLE.items():
        denominator = np.real(np.poly(poles))
        found = sections_of(denominator, 1.0)
        # Two equal poles come apart by the root of rounding and are cut to the circle.
        np.testing.assert_allclose(
            found.denominator, denominator, atol=1e-7, err_msg=name
        )


def test_derivatives_by_sections_are_differences():
    sections = sections_of(np.real(np.poly([*(0.9 * PAIR), 0.5, 0.2, -0.3])), 0.9)
    found = by_sections(sections)
    for k, one in enumerate(np.eye(5)):
        ahead = moved_sections(sections, 1e-6 * one).denominator
        behind = moved_sections(sections, -1e-6 * one).denominator
        # The product is linear in each coefficient: only rounding is left.
        np.testing.assert_allclose(
            found[:, k], (ahead - behind)[1:] / 2e-6, rtol=1e-8, atol=1e-9
        )


@pytest.mark.parametrize("radius", [1.0, RADIUS])
def test_no_pole_leaves_the_circle_within_the_sides(radius):
    rng = np.random.default_rng(3)
    sections = sections_of(radius * np.array([1.0, -1.2, 0.5, -0.1]) ** 1.0, radius)
    rows, room = sides(sections)
    outside = 0
    for _ in range(300):
        step = 3.0 * rng.standard_normal(3)
        is_allowed = bool((rows @ step <= room).all())
        poles = np.concatenate(
            [
                np.roots(factor[1:] if factor[0] == 0.0 else factor)
                for factor in _stepped(sections, step)
            ]
        )
        assert is_allowed == bool((np.abs(poles) <= 1.0 + 1e-12).all())
        outside += not is_allowed
    assert 0 < outside < 300


def _stepped(sections, step):
    factors, at = [], 0
    for one in sections.factors:
        factor = one.copy()
        factor[1:] += step[at : at + one.size - 1]
        at += one.size - 1
        factors.append(factor)
    return factors


def test_a_step_within_the_circle_is_that_of_another_solver():
    rng = np.random.default_rng(1)
    active = 0
    for _ in range(20):
        denominator = np.real(np.poly([0.98, 0.95, -0.3]))
        sections = sections_of(denominator, 1.0)
        root = rng.standard_normal((7, 5))
        matrix, vector = root.T @ root, 3.0 * rng.standard_normal(5)
        scale, damping = rng.uniform(0.5, 2.0, 5), 0.1
        step, reached = step_within(
            (matrix, vector, scale, damping), sections, slice(2, 5)
        )
        chain = by_sections(sections)
        rows, room = sides(sections)
        basis = difference_basis(3)

        def in_steps(z, chain=chain, basis=basis, scale=scale):
            return np.r_[z[:2], basis @ (chain @ z[2:]) / scale[2:]]

        def value(z, matrix=matrix, vector=vector, in_steps=in_steps):
            s = in_steps(z)
            return 0.5 * s @ (matrix + 0.1 * np.eye(5)) @ s - vector @ s

        found = minimize(
            value,
            np.zeros(5),
            method="SLSQP",
            constraints={
                "type": "ineq",
                "fun": lambda z, rows=rows, room=room: room - rows @ z[2:],
            },
            options={"ftol": 1e-14, "maxiter": 500},
        )
        # SLSQP ends within the root of its tolerance.
        np.testing.assert_allclose(step, in_steps(found.x), rtol=1e-4, atol=1e-5)
        assert is_within(reached.denominator, 1.0)
        active += bool(np.min(room - rows @ found.x[2:]) < 1e-8)
    assert active > 5


def test_poles_on_the_circle_are_within_it_and_poles_beyond_are_not():
    for name, poles in ON_CIRCLE.items():
        assert is_within(np.real(np.poly(poles)), 1.0), name
        assert not is_within(np.real(np.poly(1.001 * np.array(poles))), 1.0), name
    assert not is_within(np.real(np.poly(PAIR * 1.00001)), RADIUS)


def test_poles_beyond_the_bound_come_back_to_it():
    denominator = np.real(np.poly([*(1.1 * PAIR), 0.3]))
    found = np.sort(np.abs(np.roots(drawn_in(denominator, RADIUS))))
    np.testing.assert_allclose(found, [0.3, RADIUS, RADIUS], rtol=1e-5)
    assert found[-1] < RADIUS
