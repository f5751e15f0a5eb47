"""Effects of the user's own in the simulation: motion, sticking, input, sensor, starts."""

import numpy as np
import pytest

from hwid_cli.drive import slots
from hwid_cli.drive.catalogue import CATALOGUE, entry_of, public_id
from hwid_cli.drive.effect import Missing, Scales
from hwid_cli.drive.own_effect import own_effect
from hwid_cli.drive.simulation import drive_effects, parameter_vector, simulate_drive
from hwid_cli.records.drive import Drive
from hwid_cli.records.own_effects import OwnEffect, OwnParameter, own_id, own_of
from tests.laws.machine import Base, Hidden, measured

DT = 1e-3
BASE = {
    "mass_kg": 0.3,
    "damping_N_s_per_m": 15.0,
    "stiffness_N_per_m": 1184.0,
    "force_constant_N_per_A": 5.0,
    "reference_displacement_m": 0.012,
}


def drive_with(values, **stated):
    parameters = {name: OwnParameter("N") for name in values}
    identifier = own_id("mine", OwnEffect(parameters=parameters, **stated))
    return Drive(**BASE, effects={identifier: values})


def command(n=1500):
    """Fast and slow reversals, a step, and long rests at a load that friction holds."""
    t = DT * np.arange(n)
    u = 2.5 * np.sin(2 * np.pi * 4 * t) * (t < 0.6) + 1.1 * ((t > 0.7) & (t < 1.0))
    return u + 0.4 * np.sin(2 * np.pi * 1.5 * t) * (t > 1.1)


def outputs(own, other):
    pair = (own, Drive(**BASE, effects=other))
    return [simulate_drive(command(), one, sample_time_s=DT).output for one in pair]


@pytest.mark.parametrize(
    ("formula", "values", "effects", "share"),
    [
        ("-a*sign(v)", {"a": 1.2}, {"coulomb_friction": {"force_N": 1.2}}, 1e-7),
        ("a*sign(-3*v)", {"a": 1.2}, {"coulomb_friction": {"force_N": 1.2}}, 1e-7),
        (
            "-a*Heaviside(v) + b*Heaviside(-v)",
            {"a": 1.2, "b": 0.5},
            {"asymmetric_friction": {"force_forward_N": 1.2, "force_backward_N": 0.5}},
            1e-7,
        ),
        (
            "-a*(1 + sign(v))/2 + b*(1 - sign(v))/2",
            {"a": 1.2, "b": 0.5},
            {"asymmetric_friction": {"force_forward_N": 1.2, "force_backward_N": 0.5}},
            1e-7,
        ),
        ("-a*v*abs(v)", {"a": 90.0}, {"quadratic_drag": {"drag_N_s2_per_m2": 90.0}}, 1e-9),
        ("-a*x**3", {"a": 4e6}, {"cubic_stiffness": {"stiffness_N_per_m3": 4e6}}, 1e-7),
        # A contact's edge is stepped over, not located.
        (
            "-a*Max(x - 0.006, 0)",
            {"a": 5e4},
            {"one_sided_stop": {"position_m": 0.006, "stiffness_N_per_m": 5e4}},
            3e-4,
        ),
        ("a*sin(2*pi*x/0.002)", {"a": 0.7}, {"cogging": {"amplitude_N": 0.7, "period_m": 2e-3}}, 1e-4),
        (
            "-(a + b*1184*abs(x))*sign(v)",
            {"a": 0.3, "b": 0.1},
            {"load_friction": {"force_N": 0.3, "load_share": 0.1, "load": "spring"}},
            # The catalogue's ends its steps at 0.
            1e-5,
        ),
    ],
)  # fmt: skip
def test_a_force_moves_the_drive_as_the_effect_of_the_catalogue(
    formula, values, effects, share
):
    own, other = outputs(drive_with(values, force_N=formula), effects)
    plain = simulate_drive(command(), Drive(**BASE), sample_time_s=DT).output
    size = np.std(other - plain)
    assert size > 1e-5
    assert np.max(np.abs(own - other)) < share * np.max(np.abs(other))


FRICTIONS = {
    "grows along the way": (
        "-(a + 80*x)*sign(v)",
        {"a": 1.4},
        lambda x, v, u, t, way: -(1.4 + 80 * x) * way,
    ),
    "grows with the input": (
        "-(a + 0.2*abs(u))*sign(v)",
        {"a": 0.6},
        lambda x, v, u, t, way: -(0.6 + 0.2 * np.abs(u)) * way,
    ),
    "wears off": (
        "-a*exp(-t/0.8)*sign(v) - 40*v*abs(v)",
        {"a": 2.0},
        lambda x, v, u, t, way: -2.0 * np.exp(-t / 0.8) * way - 40 * v * abs(v),
    ),
    "falls with speed": (
        "-(a + 0.8*exp(-(v/0.05)**2))*sign(v)",
        {"a": 0.5},
        lambda x, v, u, t, way: -(0.5 + 0.8 * np.exp(-((v / 0.05) ** 2))) * way,
    ),
    "asymmetric, on a slope": (
        "-a*sign(v) - 0.3 + 0.2*x*v",
        {"a": 1.0},
        lambda x, v, u, t, way: -1.0 * way - 0.3 + 0.2 * x * v,
    ),
}


@pytest.mark.thorough
@pytest.mark.parametrize("name", FRICTIONS)
def test_friction_of_a_formula_sticks_and_breaks_away_as_in_another_integration(name):
    formula, values, force = FRICTIONS[name]
    drive = drive_with(values, force_N=formula)
    found = simulate_drive(command(), drive, sample_time_s=DT)
    expected, _ = measured(command(), DT, Base(), Hidden(force, has_friction=True))
    plain = simulate_drive(command(), Drive(**BASE), sample_time_s=DT).output
    effect = np.sqrt(np.mean((expected - plain) ** 2))
    error = np.sqrt(np.mean((found.output - expected) ** 2))
    # Steps of the curved motion are followed within a ten thousandth of what they do.
    assert error < 1e-4 * effect
    is_still = found.velocity == 0
    assert np.count_nonzero(is_still[700:1100]) > 100


def test_a_drive_at_rest_stays_where_it_is_to_the_last_digit():
    drive = drive_with({"a": 1.0}, force_N="-a*sign(v)")
    u = np.r_[np.zeros(50), np.full(400, 0.19), np.zeros(200)]
    found = simulate_drive(u, drive, sample_time_s=DT).output
    assert np.all(found == found[0])


def test_an_input_formula_bends_the_input():
    drive = drive_with({"a": 0.04}, input="u - a*u**3")
    u = command()
    fine = np.interp(np.arange(8 * u.size - 7) / 8, np.arange(u.size), u)
    bent = fine - 0.04 * fine**3
    expected = simulate_drive(bent, Drive(**BASE), sample_time_s=DT / 8).output[::8]
    found = simulate_drive(u, drive, sample_time_s=DT).output
    # A quarter of a sample is taken for straight.
    assert np.max(np.abs(found - expected)) < 1e-4 * np.max(np.abs(expected))


def test_an_input_formula_may_depend_on_the_motion():
    drive = drive_with({"a": 2.0}, input="u - a*v")
    more = Drive(**{**BASE, "damping_N_s_per_m": 25.0})
    found = simulate_drive(command(), drive, sample_time_s=DT).output
    expected = simulate_drive(command(), more, sample_time_s=DT).output
    assert np.max(np.abs(found - expected)) < 1e-6 * np.max(np.abs(expected))


def test_an_output_formula_is_what_the_sensor_reads():
    drive = drive_with({"a": 0.01}, output="x + a*v + 0.001*u + 0.002*t")
    found = simulate_drive(command(), drive, sample_time_s=DT)
    times = DT * np.arange(found.output.size)
    expected = (
        found.position + 0.01 * found.velocity + 0.001 * command() + 0.002 * times
    )
    assert np.allclose(found.output, expected, rtol=0, atol=1e-15)


def test_two_formulas_add_up():
    one, two = (
        own_id(name, OwnEffect(force_N=text, parameters={"a": OwnParameter("N")}))
        for name, text in (("one", "-a*v"), ("two", "-a*x"))
    )
    drive = Drive(**BASE, effects={one: {"a": 5.0}, two: {"a": 100.0}})
    other = Drive(**{**BASE, "damping_N_s_per_m": 20.0, "stiffness_N_per_m": 1284.0})
    found, expected = (
        simulate_drive(command(), each, sample_time_s=DT).output
        for each in (drive, other)
    )
    assert np.max(np.abs(found - expected)) < 1e-6 * np.max(np.abs(expected))


def test_a_load_of_a_formula_shows_from_the_first_sample():
    drive = drive_with({"a": 2.0}, force_N="a")
    found = simulate_drive(np.zeros(50), drive, sample_time_s=DT).output
    assert np.allclose(found, 2.0 / 1184.0, rtol=1e-9)


def test_an_id_holds_all_that_the_effect_is():
    stated = OwnEffect(
        force_N="-a*x", sentence="a, b: {c}", parameters={"a": OwnParameter("N/m", True, 2.0, (1.0, 3.0))}
    )  # fmt: skip
    identifier = own_id("soft", stated)
    assert own_of(identifier) == ("soft", stated)
    assert public_id(identifier) == "soft"
    assert identifier in CATALOGUE
    assert identifier not in list(CATALOGUE)
    assert entry_of(identifier, {"a": 2.0}) is CATALOGUE[identifier]
    drive = Drive(**BASE, effects={identifier: {"a": 2.0}})
    assert drive_effects(drive) == {identifier: {"a": 2.0}}
    assert parameter_vector(drive, drive_effects(drive)).size > slots.N_SLOTS


def made_missing(force):
    rng = np.random.default_rng(2)
    variables = {
        name: rng.uniform(-size, size, 800)
        for name, size in (("x", 0.01), ("v", 0.3), ("u", 3.0), ("t", 1.0))
    }
    return Missing(variables, force(**variables), np.zeros(800), 5.0)


SCALES = Scales(0.01, 0.3, 3.0, 100.0, 0.02, 15.0, 0.3, 10.0, 1e-3, 1.0)


def test_starts_come_from_what_is_missing():
    # What goes with x, v and u alone may be the base's.
    missing = made_missing(lambda x, v, u, t: -(0.5 + 60 * abs(x)) * np.sign(v) + 7 * x)
    scales = Scales(**{**SCALES.__dict__, "missing": missing})
    stated = OwnEffect(
        force_N="-(a + b*abs(x)**1)*sign(v)",
        parameters={
            "a": OwnParameter("N", positive=True, exponents=(1, 1, -2, 0)),
            "b": OwnParameter("N/m", positive=True, exponents=(1, 0, -2, 0)),
        },
    )
    best = own_effect(own_id("mine", stated)).starts(scales)[0]
    assert best["a"] == pytest.approx(0.5, rel=0.02)
    assert best["b"] == pytest.approx(60.0, rel=0.02)


def test_a_start_that_is_given_is_kept_and_bounds_hold():
    missing = made_missing(lambda x, v, u, t: -3 * x * abs(x) / 1e-4)
    scales = Scales(**{**SCALES.__dict__, "missing": missing})
    stated = OwnEffect(
        force_N="-a*x*abs(x)/b**2",
        parameters={
            "a": OwnParameter("N", start=2.0),
            "b": OwnParameter("m", True, bounds=(0.001, 0.005), exponents=(0, 1, 0, 0)),
        },
    )
    best = own_effect(own_id("mine", stated)).starts(scales)[0]
    assert best["a"] == 2.0
    # The best one would be 0.0082.
    assert best["b"] == pytest.approx(0.005, rel=1e-3)
