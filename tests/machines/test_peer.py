"""The peer's smoother and regression on signals of which the answer is known."""

import numpy as np

from tests.machines.peer import Smoothed, chosen_terms, document, outcome, smooth

TIME = 1e-3 * np.arange(2000)
X = 0.02 * np.sin(2 * np.pi * 3.0 * TIME) + 0.01 * np.sin(2 * np.pi * 7.1 * TIME)
V = np.gradient(X, TIME)
DRIVE = 4.0 * np.sin(2 * np.pi * 3.0 * TIME + 0.4) + np.sign(np.sin(9.0 * TIME))


def motion(force):
    rng = np.random.default_rng(1)
    noise = 0.02 * rng.standard_normal(len(TIME))
    return [Smoothed(TIME, DRIVE, X, V, force + noise)]


def test_dry_friction_is_the_first_term():
    assert chosen_terms(motion(-0.8 * np.sign(V)))[0][0] == "coulomb_friction"


def test_a_hardening_spring_is_the_first_term():
    assert chosen_terms(motion(-2e5 * X**3))[0] == ("cubic_stiffness",)


def test_noise_alone_is_no_term():
    assert chosen_terms(motion(3.0 * X - 0.2 * V)) == []


def test_the_smoother_finds_a_constant_force():
    # At rest k x = kt i + F.
    output = np.full(800, (5.0 + 0.7) / 1000.0)
    drive = np.full(800, 5.0)
    found, _ = smooth(TIME[:800], drive, output, (0.3, 15.0, 1000.0), 1e-6, 1e-6)
    assert np.allclose(found.force[300:], 0.7, atol=5e-3)
    assert np.allclose(found.v[300:], 0.0, atol=1e-3)


def test_outcomes():
    truth = {"family": "friction", "full": [["coulomb_friction"]]}
    truth |= {"near": [], "partial": []}
    assert outcome(truth, [("coulomb_friction", "hysteresis")]) == "right"
    assert outcome(truth, [("gravity",), ("coulomb_friction",)]) == "wrong"
    assert outcome(truth, []) == "nothing"
    clean = {**truth, "family": "clean"}
    assert outcome(clean, []) == "right"
    assert outcome(clean, [("gravity",)]) == "false alarm"


def test_the_page_counts_machines_with_effects_and_clean_ones_apart():
    told = {"name": "one", "hidden": ["gravity"], "found": [("gravity",)]}
    rows = [
        {**told, "family": "springs", "outcome": "right"},
        {**told, "family": "clean", "hidden": [], "outcome": "false alarm"},
    ]
    text = document(rows, "development")
    assert "| right | 1 of 1 |" in text
    assert "false alarm | 1 of 1 |" in text
