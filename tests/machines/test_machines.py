"""The machines' equations beside closed forms, the rules of scoring, and frozen seeds."""

import numpy as np
import pytest

from tests.machines import hidden as h
from tests.machines.bench import SEEDS, Draw
from tests.machines.excitation import Signal
from tests.machines.gap import linear_output
from tests.machines.machine import Machine, clean_readings
from tests.machines.plants import Base
from tests.machines.run_machines import row
from tests.machines.score import outcome, score
from tests.machines.suite import SUITE, built
from tests.machines.tables import document
from tests.machines.write_machine import configuration, write

CATALOGUE = {
    *("coulomb_friction", "asymmetric_friction", "stribeck_friction", "hysteresis"),
    *("load_friction", "position_friction", "quadratic_drag", "cubic_stiffness"),
    *(
        "quadratic_stiffness",
        "end_stop",
        "one_sided_stop",
        "spring_gap",
        "spring_preload",
    ),
    *("gear_backlash", "output_backlash", "second_mode", "elastic_coupling", "cogging"),
    *("constant_load", "gravity", "input_dead_zone", "input_saturation", "rate_limit"),
    *("input_delay", "actuator_lag", "force_constant_saturation", "supply_sag"),
    *("thermal_gain_loss", "voltage_limit", "torque_ripple", "winding_inductance"),
    *("sensor_quadratic", "sensor_cubic", "sensor_drift", "sensor_saturation"),
    *("sensor_hum", "sensor_eccentricity", "clock_skew", "periodic_force"),
    "parameter_change",
}


def bare(base, values, hidden, sample_s=1e-3, **more):
    """A machine with one recording."""
    signals = [Signal("one", "other", np.asarray(values, float))]
    return Machine("bare", "", "", base, sample_s, signals, 1.0, list(hidden), **more)


def response(machine):
    commands = np.stack([one.values for one in machine.signals], axis=1)
    return clean_readings(machine, machine.hidden, commands)[:, 0]


@pytest.mark.thorough
def test_a_step_against_dry_friction_swings_in_half_cosines():
    base, force, friction = Base(2.0, 0.0, 800.0, 1.0), 10.0, 1.5
    values = np.full(600, force)
    values[0] = 0.0
    x = response(bare(base, values, [h.coulomb(friction)]))
    # Half a millisecond later than the jump, as the command is straight between samples.
    t, rate = np.arange(600) * 1e-3 - 0.5e-3, 20.0
    half = np.pi / rate
    first = (force - friction) / 800.0 * (1.0 - np.cos(rate * t))
    top = 2.0 * (force - friction) / 800.0
    middle = (force + friction) / 800.0
    second = middle + (top - middle) * np.cos(rate * (t - half))
    expected = np.where(t < half, first, second)[1 : int(2 * half / 1e-3)]
    assert np.abs(x[1 : int(2 * half / 1e-3)] - expected).max() < 1e-3 * top


@pytest.mark.thorough
def test_friction_stops_a_free_mass_and_holds_it():
    base = Base(2.0, 0.0, 0.0, 1.0)
    values = np.zeros(1700)
    values[1:501] = 6.0
    x = response(bare(base, values, [h.coulomb(2.0)], cells=3))
    # It moves from a third of a millisecond on, when the command passes the friction; half
    # a second at 2 m/s^2, a millisecond in which the command falls, a second at -1 m/s^2.
    assert x[1550] == pytest.approx(0.7494993, rel=1e-6)
    assert x[1550] == x[1699]
    assert np.all(np.diff(x) >= 0.0)


def test_a_machine_without_effects_moves_as_the_matrix_exponential_says():
    base = Base(0.7, 1.1, 300.0, 4.0)
    values = np.cumsum(np.random.default_rng(1).normal(size=400)) * 0.1
    values[0] = 0.0
    exact = linear_output(base, values[:, None], 1e-3, "linear")[:, 0]
    assert (
        np.abs(response(bare(base, values, [])) - exact).max()
        < 1e-7 * np.abs(exact).max()
    )


@pytest.mark.thorough
def test_two_masses_swing_with_their_frequency():
    base = Base(3.0, 0.0, 0.0, 1.0)
    shaft = h.shaft(base, 900.0, 1.0 / 3.0, 0.0, "motor")
    values = np.zeros(1500)
    values[1:4] = 1.0
    x = response(bare(base, values, [shaft], cells=2))
    swing = x - np.polyval(np.polyfit(np.arange(1500), x, 1), np.arange(1500))
    spectrum = np.abs(np.fft.rfft(swing * np.hanning(1500), 30000))
    frequency = np.fft.rfftfreq(30000, 1e-3)[spectrum.argmax()]
    assert frequency == pytest.approx(
        np.sqrt(900.0 * 3.0 / 2.0) / (2.0 * np.pi), rel=0.01
    )


def test_a_lag_follows_a_ramp_at_its_time_constant():
    ramp = 3.0 * np.arange(2000)[:, None] * 1e-3
    lagged = h.lag(0.02).chain(ramp, 1e-3)
    t = np.arange(2000)[:, None] * 1e-3
    assert np.allclose(lagged, 3.0 * (t - 0.02 * (1.0 - np.exp(-t / 0.02))), atol=1e-12)


@pytest.mark.thorough
def test_arms_and_loads_rest_where_forces_balance():
    base = Base(1.0, 0.5, 10.0, 1.0)
    x = response(bare(base, np.zeros(300), [h.weight(-2.0)]))
    assert np.allclose(x, -0.2)
    x = response(bare(base, np.zeros(300), [h.unbalance(3.0, 0.5)]))
    assert 10.0 * x[0] == pytest.approx(-3.0 * np.sin(x[0] + 0.5))
    assert np.allclose(x, x[0])


@pytest.mark.thorough
def test_a_current_through_a_winding_lags_by_inductance_over_resistance():
    # Heavy enough to stay where it is, on a stiff spring: position follows the current.
    base = Base(1e-3, 2.0, 4e4, 1.0, resistance=2.0)
    values = np.full(200, 4.0)
    values[0] = 0.0
    x = response(bare(base, values, [h.winding(0.04)], sample_s=1e-3, cells=60))
    t = np.arange(200) * 1e-3 - 0.5e-3
    expected = 2.0 / 4e4 * (1.0 - np.exp(-t / 0.02))
    assert np.abs(x - expected)[10:].max() < 0.01 * expected.max()


def test_seeds_are_frozen():
    assert SEEDS == {
        "development": 20_260_101,
        "reporting": 77_431_902,
        "second_reporting": 41_907_263,
        "third_reporting": 63_580_417,
        "fourth_reporting": 18_946_035,
        "fifth_reporting": 52_718_394,
        "sixth_reporting": 87_205_631,
    }
    first = {seeds: round(float(Draw("any", seeds).rng.random()), 6) for seeds in SEEDS}
    assert first == {
        "development": 0.295498,
        "reporting": 0.204564,
        "second_reporting": 0.096051,
        "third_reporting": 0.574006,
        "fourth_reporting": 0.827833,
        "fifth_reporting": 0.747406,
        "sixth_reporting": 0.80582,
    }
    made = [built("voice_coil_coulomb", seeds) for seeds in SEEDS]
    assert len({one.base.mass for one in made}) == len(SEEDS)
    assert len({tuple(s.name for s in one.signals) for one in made}) == len(SEEDS)


def test_there_are_enough_machines_of_every_family():
    families = [family for family, _ in SUITE.values()]
    assert len(SUITE) >= 72
    assert families.count("clean") >= 12
    assert families.count("two") >= 10
    assert families.count("three") >= 4


@pytest.mark.parametrize("name", SUITE)
def test_answers_are_of_the_catalogue_and_files_hold_what_the_machine_is(name):
    machine = built(name, "development")
    kinds = machine.answers
    named = [one for part in (kinds.full, kinds.near, kinds.partial) for one in part]
    assert {effect for answer in named for effect in answer} <= CATALOGUE
    given = configuration(machine)["simulation"]
    assert given["mass_kg"] == pytest.approx(machine.base.mass, rel=1e-5)
    assert 4 <= len(machine.signals) <= 20
    assert 300 <= machine.signals[0].values.size <= 4000
    assert all(one.values[0] == 0.0 for one in machine.signals)
    if machine.family == "outside":
        assert kinds.honest_refusal
    if machine.family == "clean":
        assert not machine.hidden


TRUTH = {
    "family": "friction",
    "full": [["coulomb_friction", "end_stop"]],
    "near": [["hysteresis", "end_stop"]],
    "partial": [["coulomb_friction"], ["end_stop"]],
    "honest_refusal": False,
    "gap_over_noise": 5.0,
    "noise_rms": 1.0,
    "parameters": [{"effect": "coulomb_friction", "values": {"force_N": 2.0}}],
}


def diagnosis(verdict, names=(), *, complete=False, left=1.0, others=()):
    limits = {"force_N": {"value": 2.1, "ci95": [1.9, 2.3]}}
    return {
        "verdict": verdict,
        "complete": complete,
        "effects": [{"id": name, "parameters": limits} for name in names],
        "ambiguous_with": list(others),
        "gap": {"after": {"held_out_rms": left}},
    }


BOTH = ("end_stop", "coulomb_friction")


@pytest.mark.parametrize(
    ("said", "expected"),
    [
        (diagnosis("named", BOTH, complete=True, left=3.0), "right"),
        (diagnosis("named", BOTH), "right"),
        (diagnosis("named", ["hysteresis", "end_stop"], complete=True), "right"),
        (
            diagnosis("named", ["hysteresis", "end_stop"], complete=True, left=2.0),
            "falsely complete",
        ),
        (diagnosis("named", ["end_stop"]), "partly"),
        (diagnosis("named", ["end_stop"], complete=True, left=2.0), "falsely complete"),
        (diagnosis("named", ["end_stop"], complete=True), "right"),
        (diagnosis("named", [*BOTH, "cogging"]), "wrong"),
        (diagnosis("ambiguous", ["cogging"], others=[list(BOTH)]), "right"),
        (diagnosis("ambiguous", ["cogging"], others=["end_stop"]), "partly"),
        (diagnosis("ambiguous", ["cogging"], others=["second_mode"]), "wrong"),
        (diagnosis("unknown"), "refused"),
        (diagnosis("law"), "refused"),
        (diagnosis("none"), "refused"),
    ],
)
def test_each_verdict_has_its_score(said, expected):
    assert outcome(TRUTH, said) == expected


def test_refusals_and_invisible_effects_are_right_where_the_truth_says_so():
    outside = TRUTH | {"honest_refusal": True, "full": [], "near": [], "partial": []}
    assert outcome(outside, diagnosis("unknown")) == "right"
    assert outcome(outside, diagnosis("named", ["cogging"])) == "wrong"
    assert outcome(TRUTH | {"gap_over_noise": 0.2}, diagnosis("parameters")) == "right"
    assert score(TRUTH, None).outcome == "failed"


def test_clean_machines_allow_nothing_but_none_and_parameters():
    clean = TRUTH | {
        "family": "clean",
        "full": [["sensor_hum"]],
        "near": [],
        "partial": [],
    }
    assert outcome(clean, diagnosis("none")) == "right"
    assert outcome(clean, diagnosis("named", ["sensor_hum"])) == "right"
    for verdict in ("named", "unknown", "law", "ambiguous"):
        assert outcome(clean, diagnosis(verdict, ["cogging"])) == "false alarm"


def test_intervals_are_counted_where_the_law_is_the_catalogues():
    result = score(TRUTH, diagnosis("named", BOTH))
    assert (result.covered, result.intervals) == (1, 1)
    other = TRUTH | {"parameters": [{"effect": "end_stop", "values": {"force_N": 9.0}}]}
    result = score(other, diagnosis("named", BOTH))
    assert (result.covered, result.intervals) == (0, 1)


def test_a_page_answers_first(tmp_path):
    machine = bare(Base(1.0, 2.0, 100.0, 1.0), np.sin(np.arange(400) * 0.05), [])
    told = write(machine, tmp_path / "one")
    made = row(told, diagnosis("none") | {"gap": {}}, 1.0)
    assert (
        document([made], "development").splitlines()[2].startswith("| of machines with")
    )
    assert (tmp_path / "one" / "recordings" / "one.csv").exists()
    assert told["gap_over_noise"] < 1e-6
