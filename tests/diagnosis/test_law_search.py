"""Subsets of named terms, on forces that are known and put through another integration."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lsim

from hwid_cli.diagnosis.latent_force import Smoothed
from hwid_cli.diagnosis.law_search import (
    best_subsets,
    coefficients,
    inclusion,
    regression,
)
from hwid_cli.diagnosis.law_terms import Term, coefficient_unit, library, readings
from hwid_cli.diagnosis.problem import Compared, Signals
from hwid_cli.drive.effect import Scales, Wave
from hwid_cli.drive.formula import names, parsed
from hwid_cli.records.drive import Drive

DT, N = 1e-3, 600
TIME = DT * np.arange(N)
DRIVE = Drive(0.3, 15.0, 1184.0, 5.0)
SCALES = Scales(
    0.0135, 0.3, 3.0, 100.0, 0.02, 15.0, 0.3, 10.0, DT, 0.6, (7.0, 13.0),
    (Wave(0.004, 1.0, 0.0), Wave(0.002, 0.5, 0.0)),
)  # fmt: skip
TERMS = library(SCALES)


def motions(force, *, sensor=None, noise=0.0, base=lambda x, v, u: 0.0):
    """Recordings along prescribed motions: the error is what the force does."""
    rng = np.random.default_rng(1)
    pairs = []
    for number in range(6):
        waves = [
            (rng.uniform(0.5, 1.5), 2 * np.pi * rng.uniform(1, 8), rng.uniform(0, 6))
            for _ in range(3)
        ]
        x = 0.004 * sum(a * np.sin(w * TIME + p) for a, w, p in waves)
        v = 0.004 * sum(a * w * np.cos(w * TIME + p) for a, w, p in waves)
        u = 2 * np.sin(2 * np.pi * rng.uniform(1, 5) * TIME + rng.uniform(0, 6))
        wanted = force(x, v, u, TIME) + base(x, v, u)
        system = (
            [1.0],
            [DRIVE.mass_kg, DRIVE.damping_N_s_per_m, DRIVE.stiffness_N_per_m],
        )
        error = lsim(system, np.broadcast_to(wanted, N), TIME)[1]
        if sensor is not None:
            error = error + sensor(x, v, u, TIME)
        error = error + noise * rng.standard_normal(N)
        signals = Signals(f"r{number}", "sine", u, x, u, x, DT)
        simulated = x - error
        compared = Compared(signals, simulated, x if sensor else simulated, v)
        pairs.append((compared, Smoothed(np.zeros(N), x, v, np.zeros(N))))
    return [one for one, _ in pairs], [motion for _, motion in pairs]


def found_terms(found, size):
    return {
        found.terms[place].formula for place in best_subsets(found)[size - 1][0].places
    }


@pytest.mark.thorough
def test_the_terms_of_a_force_are_found_with_their_coefficients():
    pair = motions(
        lambda x, v, u, t: -900 * x * v - 0.4 * np.abs(u), noise=1e-6,
        base=lambda x, v, u: -30 * x + 0.7 * v + 0.2 * u,
    )  # fmt: skip
    found = regression(*pair, DRIVE, TERMS, through=True)
    (best, *_), places = best_subsets(found)[1], None
    assert found_terms(found, 2) == {"x*v", "abs(u)"}
    places = best.places
    of_terms, of_base = coefficients(found, places)
    named = {found.terms[p].formula: w for p, w in zip(places, of_terms, strict=True)}
    # The error is noise of a ten thousandth of the motion.
    assert named["x*v"] == pytest.approx(-900, rel=0.01)
    assert named["abs(u)"] == pytest.approx(-0.4, rel=0.01)
    assert of_base[1:] == pytest.approx([-30, 0.7, 0.2], rel=0.05)


@pytest.mark.thorough
def test_four_terms_are_found_on_top_of_three():
    pair = motions(
        lambda x, v, u, t: (
            -900 * x * v - 0.4 * np.abs(u) - 2e4 * x * np.abs(x) + 0.8 * t
        )
    )
    found = regression(*pair, DRIVE, TERMS, through=True)
    assert found_terms(found, 4) == {"x*v", "abs(u)", "x*abs(x)", "t"}
    sizes = [len(one[0].places) for one in best_subsets(found)]
    assert sizes == [1, 2, 3, 4]
    left = [one[0].left for one in best_subsets(found)]
    assert left == sorted(left, reverse=True)


def test_what_a_sensor_adds_is_found_without_going_through_the_drive():
    pair = motions(
        lambda x, v, u, t: 0.0 * x, sensor=lambda x, v, u, t: 0.05 * np.abs(x)
    )
    found = regression(*pair, DRIVE, readings(SCALES), through=False)
    assert found_terms(found, 1) == {"abs(x)"}
    assert coefficients(found, best_subsets(found)[0][0].places)[0] == pytest.approx(
        [0.05]
    )


@pytest.mark.thorough
def test_inclusion_is_sure_of_what_is_there_and_not_of_noise():
    rng = np.random.default_rng(3)
    strong = motions(lambda x, v, u, t: -900 * x * v, noise=1e-6)
    weak = motions(lambda x, v, u, t: 0.0 * x, noise=1e-5)
    for pair, low, high in ((strong, 0.99, 1.0), (weak, 0.0, 0.8)):
        found = regression(*pair, DRIVE, TERMS, through=True)
        ranked = best_subsets(found)
        shares = inclusion(found, ranked, ranked[0][0].places, rng, draws=50)
        assert low <= shares[0] <= high


def test_units_of_all_terms_fit_their_formulas():
    from hwid_cli.data.formula_units import fits, unit_of
    from hwid_cli.data.units import base_exponents

    signals = {"x": "m", "v": "m/s", "u": "A", "t": "s"}
    units = {name: base_exponents(unit)[0] for name, unit in signals.items()}
    for term in (*TERMS, *readings(SCALES)):
        own = {
            name: base_exponents(unit or "A")[0]
            for name, (_, unit) in term.shape.items()
        }
        coefficient = base_exponents(coefficient_unit(term, "N", ("m", "A")))[0]
        whole = parsed(f"c*{term.formula}")
        assert names(whole) == {"c", *term.variables, *term.shape}
        found = unit_of(whole, {**units, **own, "c": coefficient})
        assert fits(found, base_exponents("N")[0]), term.formula


def test_a_term_has_the_values_of_its_formula():
    at = {"x": np.array([0.5, -2.0]), "v": np.ones(2), "u": np.ones(2), "t": np.ones(2)}
    term = Term("Max(x - a, 0)*v", (2, -1, 0), {"a": (0.1, "m")})
    assert term.values(at) == pytest.approx([0.4, 0.0])
    assert term.variables == {"x", "v"}


@pytest.mark.thorough
def test_a_law_is_found_in_the_speed_of_a_free_axis():
    # Where it started does not show in its speed.
    free = replace(DRIVE, stiffness_N_per_m=0.0, output="velocity")
    rng = np.random.default_rng(3)
    compared, smoothed = [], []
    for number in range(4):
        turns = 2 * np.pi * rng.uniform(1, 6, 3)[:, None] * TIME
        v = (0.2 * np.sin(turns + rng.uniform(0, 6, 3)[:, None])).sum(axis=0)
        x = np.cumsum(v) * DT
        u = 2 * np.sin(2 * np.pi * rng.uniform(1, 5) * TIME)
        system = ([1.0], [free.mass_kg, free.damping_N_s_per_m])
        error = lsim(system, -3.0 * v * np.abs(v), TIME)[1]
        signals = Signals(f"r{number}", "sine", u, v, u, v, DT)
        compared.append(Compared(signals, v - error, x, v - error))
        smoothed.append(Smoothed(np.zeros(N), x, v, np.zeros(N)))
    found = regression(compared, smoothed, free, TERMS, through=True)
    assert np.isfinite(found.grams).all()
    assert found_terms(found, 1) == {"v*abs(v)"}
    of_terms, _ = coefficients(found, best_subsets(found)[0][0].places)
    assert of_terms[0] == pytest.approx(-3.0, rel=0.02)


@pytest.mark.thorough
def test_a_force_that_levels_off_is_one_term():
    pair = motions(lambda x, v, u, t: -3.0 * np.tanh(x / 0.002), noise=1e-6)
    found = regression(*pair, DRIVE, TERMS, through=True)
    assert found_terms(found, 1) == {"tanh(x/a)"}


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_force_that_fades_away_from_a_wall_is_an_exponential(side):
    # Air under a rotor, a magnet near iron: no series of powers holds far from the wall.
    pair = motions(lambda x, v, u, t: 3.0 * np.exp(side * x / 0.002), noise=1e-6)
    found = regression(*pair, DRIVE, TERMS, through=True)
    sign = "-" if side < 0.0 else ""
    assert found_terms(found, 1) == {f"exp({sign}x/a)"}


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_force_across_a_gap_is_not_one_that_fades(side):
    # A magnet 3 cm off: over the travel it grows to a factor of four.
    pair = motions(lambda x, v, u, t: 3.0 / (1.0 + side * x / 0.03) ** 2, noise=1e-6)
    found = regression(*pair, DRIVE, TERMS, through=True)
    sign = "+" if side > 0.0 else "-"
    assert found_terms(found, 1) == {f"1/(1 {sign} x/a)**2"}
    pair = motions(lambda x, v, u, t: u**2 / (1.0 + side * x / 0.03) ** 2, noise=1e-6)
    found = regression(*pair, DRIVE, TERMS, through=True)
    assert found_terms(found, 1) == {f"u**2/(1 {sign} x/a)**2"}
