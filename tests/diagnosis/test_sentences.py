"""What is said of the rest that a verdict leaves."""

import re
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.diagnosis import sentences
from hwid_cli.diagnosis.sentences import (
    _held_command,
    _named,
    _rest,
    doubtful_values,
    hardly_late,
    hidden_from_view,
    stops_in_the_middle,
    unseen_beside,
)
from hwid_cli.diagnosis.verdict import DiagnosisVerdict
from hwid_cli.records.diagnosis import BaseParameter, FittedEffect, FittedParameter
from hwid_cli.records.drive import StandIn
from tests.diagnosis.made_up_fits import CRITERIA, base, made_up
from tests.diagnosis.small_drive import DRIVE, STEP_S, problem, recordings
from tests.diagnosis.test_odd_recordings import problem as eight_recordings


@pytest.mark.parametrize(
    ("times_the_noise", "is_complete", "said"),
    [
        (1.0, True, ""),
        (
            0.4,
            False,
            " What remains is no larger than the noise, but not as random.",
        ),
        (1.1, False, " Little more than the noise remains."),
        (2.0, False, " Something smaller remains."),
        (10.0, False, " What remains is not explained."),
    ],
)
@pytest.mark.parametrize("word", ["named", "law"])
def test_the_rest_is_called_what_it_is(word, times_the_noise, is_complete, said):
    found = made_up(("coulomb_friction",), 100 * times_the_noise**2)
    verdict = DiagnosisVerdict(word, is_complete, found, ())
    assert _rest(CRITERIA, verdict) == said


@pytest.mark.parametrize(
    ("times_the_noise", "said"),
    [
        (1.6, " What remains is noise of the measured input, seen through the drive."),
        (1.1, ""),
    ],
)
def test_more_than_the_outputs_noise_is_called_what_it_is_where_all_is_found(
    times_the_noise, said
):
    fit = made_up(("coulomb_friction",), 100.0 * times_the_noise**2)
    fit = replace(fit, cause="input_noise")
    assert _rest(CRITERIA, DiagnosisVerdict("named", True, fit, ())) == said


def delayed(delay_s):
    value = FittedParameter("delay_s", delay_s)
    return FittedEffect("input_delay", "acts later", "i(t - td)", (value,))


@pytest.mark.parametrize(
    ("samples", "hold", "is_said"),
    [(0.5, "linear", True), (0.53, "linear", True), (0.5, "zero", False),
     (1.0, "linear", False), (2.5, "linear", False)],
)  # fmt: skip
def test_a_delay_of_half_a_sample_may_be_a_held_command(samples, hold, is_said):
    of = problem(recordings())
    of = replace(of, drive=replace(of.drive, hold=hold), may_be_held=False)
    said = _held_command(of, (delayed(samples * STEP_S),))
    assert ("simulation.hold: zero" in said) == is_said


def moved(**ratios):
    """Parameters that a fit has moved by these factors."""
    return [
        BaseParameter(name, given, given, ratio * given)
        for (name, ratio), given in zip(
            ratios.items(), (15.0, 1184.0, 5.0), strict=True
        )
    ]


ALL = ("damping_N_s_per_m", "stiffness_N_per_m", "force_constant_N_per_A")


@pytest.mark.parametrize(
    ("factor", "said"),
    [(10.0, "10 times too large"), (0.1, "10 times too small")],
)
def test_what_moves_by_one_factor_altogether_questions_the_mass(factor, said):
    # The mass is 0.3 kg; damping moves a little further, as it does beside friction.
    ratios = dict.fromkeys(ALL, factor) | {"damping_N_s_per_m": 1.1 * factor}
    (text,) = doubtful_values(moved(**ratios), DRIVE)
    assert text.startswith(f"mass_kg is 0.3, probably {said}: ")
    (value,) = [float(one) for one in re.findall(r"with mass_kg ([\d.]+)", text)]
    assert value == pytest.approx(0.3 / factor, rel=0.05)


def test_what_moves_apart_is_questioned_for_itself():
    texts = doubtful_values(
        moved(**dict(zip(ALL, (10.0, 10.0, 1.0), strict=True))), DRIVE
    )
    assert [text.split()[0] for text in texts] == list(ALL[:2])
    assert doubtful_values(moved(**dict.fromkeys(ALL, 1.4)), DRIVE) == ()
    # A resistance that is off scales other quotients.
    driven = replace(DRIVE, resistance_ohm=1.0)
    assert len(doubtful_values(moved(**dict.fromkeys(ALL, 10.0)), driven)) == 3


@pytest.mark.parametrize(
    ("ids", "said"),
    [
        (("cogging",), "lacks cogging (a force along the way): with it the error"),
        (
            ("cogging",) * 2,
            "cogging twice (a force along the way): with them the error",
        ),
    ],
)
def test_an_effect_that_is_there_twice_is_named_once(ids, said):
    effects = tuple(FittedEffect(one, "a force along the way", "", ()) for one in ids)
    verdict = DiagnosisVerdict("named", True, made_up(ids, 100.0), ())
    assert said in _named(problem(), CRITERIA, base(), verdict, effects)


def test_a_lag_may_be_one_of_the_sensor():
    of = problem(recordings()[:3])
    (text,) = unseen_beside(("actuator_lag", "input_delay", "coulomb_friction"), of)
    assert "sensor" in text
    assert unseen_beside(("coulomb_friction",), of) == ()


def test_what_a_simulation_of_ones_own_holds_is_not_said_to_be_unseen():
    of = problem(recordings()[:3])
    own = replace(of, drive=StandIn(**vars(of.drive)))
    assert any("brush" in text for text in hidden_from_view(of))
    texts = hidden_from_view(own)
    assert not any("brush" in text or "mass" in text for text in texts)


def test_where_a_drive_never_is_counts_from_its_start_as_well():
    one_way = [replace(one, output=abs(one.output)) for one in recordings()]
    side = "anything on the negative side, where the drive never is"
    assert side in hidden_from_view(problem(one_way))
    # A laser whose zero lies elsewhere: the drive moves to both sides of its rest.
    offset = [replace(one, output=one.output + 0.1) for one in recordings()]
    assert side not in hidden_from_view(problem(offset))
    assert side not in hidden_from_view(problem())


@pytest.mark.parametrize(
    ("effect", "value", "said"),
    [
        ("input_delay", 2e-5, "input_delay is 0.02 of a sample"),
        ("sensor_lag", 1.9e-4, "sensor_lag is 0.19 of a sample"),
        ("actuator_lag", 2.1e-4, None),
        ("coulomb_friction", 2e-5, None),
    ],
)
def test_what_shifts_a_signal_by_a_small_part_of_a_sample_is_questioned(
    effect, value, said
):
    found = FittedEffect(effect, "", "", (FittedParameter("a", value, 0.0, 1.0),))
    texts = hardly_late([found], 1e-3)
    assert [one.split(":")[0] for one in texts] == ([] if said is None else [said])


@pytest.mark.parametrize(
    ("effect", "place", "exponent", "is_said"),
    [
        ("end_stop", 3e-4, 2.75, True),
        # A stop in the middle, straight; one farther out; a spring on one side.
        ("end_stop", 3e-4, 1.0, False),
        ("end_stop", 9e-3, 1.5, False),
        ("one_sided_stop", 3e-4, 2.75, False),
    ],
)
def test_a_curved_stop_that_begins_at_once_is_a_spring(
    effect, place, exponent, is_said
):
    values = {"position_m": place, "exponent": exponent}
    parameters = tuple(
        FittedParameter(name, one, 0.0, 1.0) for name, one in values.items()
    )
    texts = stops_in_the_middle([FittedEffect(effect, "", "", parameters)], 0.0148)
    assert len(texts) == is_said
    for text in texts:
        assert text.startswith("end_stop begins at 2 % of the way: it is no stop but a")
        assert "the power 2.75" in text


@pytest.mark.parametrize(
    ("gap", "said"),
    [
        ([0.1] * 8, ""),
        ([0.0] * 4 + [5.0] + [0.0] * 3, "sits in r4: check how they start"),
        # Off by as much as it has moved.
        (
            [0.0] * 4 + [5000.0] + [0.0] * 3,
            "sits in r4, where the machine went another",
        ),
        ([0.0, 5.0, *[0.0] * 5, 5e4], "sits in r7, where the machine went another way"),
    ],
)
def test_where_the_gap_sits_and_what_to_do_about_it(gap, said):
    criteria = SimpleNamespace(floors=np.zeros(8))
    chosen = SimpleNamespace(sse=np.array(gap))
    text = sentences._where_it_sits(eight_recordings(), criteria, chosen)
    assert said in text
    assert bool(said) == bool(text)
    assert ("diagnose.recordings" in text) == ("another" in said)
