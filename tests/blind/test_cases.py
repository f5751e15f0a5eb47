"""The cases, their files and their seeds."""

import json
from functools import cache

import numpy as np
import pytest
import yaml

from tests.blind.campaign import measured_case
from tests.blind.cases import NOISE_PERCENT, SEEDS, SUITES, cases_of, make_case
from tests.blind.effects import CATALOGUE
from tests.blind.nuisances import NUISANCES, coloured, measure
from tests.blind.score import FAMILY_OF, NOT_REPORTED
from tests.blind.write_case import write_case

# The table in section "Diagnosis" of the contract: ids and the parameters of each.
REPORTED = {
    "coulomb_friction": {"force_N"},
    "asymmetric_friction": {"force_forward_N", "force_backward_N"},
    "stribeck_friction": {"force_N", "static_excess_N", "velocity_m_per_s"},
    "hysteresis": {"force_N", "yield_m"},
    "quadratic_drag": {"drag_N_s2_per_m2"},
    "cubic_stiffness": {"stiffness_N_per_m3"},
    "quadratic_stiffness": {"stiffness_N_per_m2"},
    "end_stop": {"position_m", "stiffness_N_per_m"},
    "one_sided_stop": {"position_m", "stiffness_N_per_m"},
    "spring_gap": {"half_gap_m"},
    "gear_backlash": {"half_gap_m", "stiffness_N_per_m"},
    "output_backlash": {"half_gap_m"},
    "second_mode": {"mass_kg", "frequency_Hz", "damping_ratio"},
    "cogging": {"amplitude_N", "period_m"},
    "constant_load": {"force_N"},
    "input_dead_zone": {"threshold_A"},
    "input_saturation": {"limit_A"},
    "rate_limit": {"rate_A_per_s"},
    "input_delay": {"delay_s"},
    "actuator_lag": {"time_constant_s"},
    "force_constant_saturation": {"loss_at_reference"},
    "supply_sag": {"loss_at_reference"},
    "thermal_gain_loss": {"loss_at_reference", "time_constant_s"},
    "voltage_limit": {"limit_A", "slope_A_s_per_m"},
    "sensor_quadratic": {"coefficient"},
    "sensor_cubic": {"coefficient"},
    "sensor_drift": {"drift_m_per_s"},
    "periodic_force": {"amplitude_N", "frequency_Hz"},
    "parameter_change": {"spread"},
}


# Cases are values and their truths are never changed here.
measured = cache(measured_case)


def short_case(*effects, **fields):
    return make_case("full", effects, 0, plan="short", **fields)


@pytest.mark.thorough
def test_every_effect_is_hidden_with_the_parameters_that_must_be_reported():
    assert set(CATALOGUE) == set(REPORTED) == set(FAMILY_OF)
    for effect in ("gear_backlash", "cogging", "parameter_change", "end_stop"):
        _, truth = measured(short_case(effect))
        (one,) = truth["effects"]
        assert set(one["parameters"]) - NOT_REPORTED == REPORTED[effect]


def test_every_suite_holds_each_case_once_and_seeds_never_meet():
    for suite in SUITES:
        found = {kind: cases_of(suite, kind, 2) for kind in SEEDS}
        names = [case.name for case in found["reporting"]]
        assert len(set(names)) == len(names)
        seeds = {kind: {case.seed for case in cases} for kind, cases in found.items()}
        assert len(seeds["reporting"]) == len(names)
        assert not seeds["reporting"] & seeds["development"]
    full = {
        (case.effects, case.noise_percent) for case in cases_of("full", "reporting", 1)
    }
    assert full == {((one,), noise) for one in CATALOGUE for noise in NOISE_PERCENT}


@pytest.mark.thorough
def test_a_case_is_the_same_at_every_call_and_another_for_another_number():
    first = measured(short_case("gear_backlash"))
    again = measured_case(short_case("gear_backlash"))
    other = make_case("full", ("gear_backlash",), 1, plan="short")

    assert first[1] == again[1]
    for one, two in zip(first[0], again[0], strict=True):
        assert np.array_equal(one.displacement_m, two.displacement_m)
    assert measured_case(other)[1]["base"] != first[1]["base"]


def test_the_simulation_is_wrong_by_what_it_should_be():
    _, truth = measured(short_case())

    for name, value in truth["base"].items():
        assert 0.1 <= abs(truth["simulation"][name] / value - 1) <= 0.25
    # Nothing is hidden: only rounding stays after the re-fit.
    assert truth["gap"]["share_of_motion"] < 1e-6


@pytest.mark.parametrize("noise", [0.1, 3.0])
def test_the_noise_has_the_power_that_the_truth_states(noise):
    noisy, truth = measured(short_case(noise=noise))
    at_rest = np.concatenate([one.displacement_m[:100] for one in noisy])

    # 1000 samples of rest: the standard error of the deviation is 2.2 %.
    assert np.std(at_rest) == pytest.approx(truth["noise_sigma_m"], rel=0.09)


def test_the_largest_reading_is_the_reference_of_a_sensor_law():
    recordings, truth = measured(short_case("sensor_cubic", noise=1e-6))
    plain, _ = measured(short_case("sensor_cubic", noise=1e-6))
    largest = max(np.abs(one.displacement_m).max() for one in recordings)

    # Noise of 1e-8 of the largest reading, and thirty rounds of the fixed point.
    assert largest == pytest.approx(truth["reference_m"], rel=1e-6)
    assert plain[0].name == "step_01"


def test_the_spread_of_a_changing_parameter_is_the_drawn_one():
    _, truth = measured(short_case("parameter_change"))
    factors = [one["factor"] for one in truth["recordings"].values()]

    spread = truth["effects"][0]["parameters"]["spread"]
    assert np.std(factors) / np.mean(factors) == pytest.approx(spread)


@pytest.mark.parametrize("effect", ["sensor_quadratic", "parameter_change"])
def test_a_further_recording_is_answered_by_the_same_machine(effect):
    case = make_case("few", (effect,), 0, plan="few", noise=1e-6)
    before, truth = measured(case)
    # Further than the steps of the plan: 7 A instead of 5 A.
    further = {"fast": 7.0 * np.sin(0.06 * np.arange(500))}

    after, told = measured_case(case, further)

    assert [one.name for one in after] == [*(one.name for one in before), "fast"]
    largest = max(np.abs(one.displacement_m).max() for one in before)
    assert np.abs(after[-1].displacement_m).max() > 1.05 * largest
    for one, again in zip(before, after, strict=False):
        # The noise is other noise, of 1e-8 of the largest reading.
        assert again.displacement_m == pytest.approx(
            one.displacement_m, abs=1e-6 * largest
        )
    assert told["reference_m"] == truth["reference_m"]
    assert told["noise_sigma_m"] == truth["noise_sigma_m"]


@pytest.mark.parametrize("nuisance", NUISANCES)
def test_a_nuisance_shows_in_the_recording(nuisance):
    rng = np.random.default_rng(3)
    x, u = np.sin(np.arange(4000) / 50) * 0.02, np.cos(np.arange(4000) / 50)

    y, current = measure(x, u, nuisance, 1e-4, 0.02, rng)

    assert np.array_equal(current, u) == (nuisance != "current_noise")
    if nuisance == "coarse_sensor":
        assert y / 2e-4 == pytest.approx(np.round(y / 2e-4), abs=1e-9)
    if nuisance == "drift":
        assert abs(np.mean(y - x)) > 2e-5
    if nuisance == "gain_spread":
        gain = np.dot(y, x) / np.dot(x, x)
        assert 1e-4 < abs(gain - 1) < 0.02
    if nuisance == "coloured_noise":
        rest = y - x
        # Half the power forgets slowly; standard error of the ratio about 0.05.
        assert np.mean(rest[1:] * rest[:-1]) / np.mean(rest**2) == pytest.approx(
            0.5 * np.exp(-1 / 20), abs=0.15
        )


def test_coloured_noise_has_unit_power():
    noise = coloured(200_000, np.random.default_rng(0))

    # 200 000 samples that forget within 20: 10 000 independent ones, 3 standard errors.
    assert np.std(noise) == pytest.approx(1.0, abs=0.03)


@pytest.mark.thorough
def test_the_files_hold_recordings_and_configuration_but_nothing_of_the_truth(tmp_path):
    case = short_case("input_dead_zone")
    config, truth = write_case(case, tmp_path / "case", tmp_path / "truth" / "a.json")

    written = yaml.safe_load(config.read_text())
    assert written["simulation"]["effects"] == {}
    assert written["simulation"]["mass_kg"] == 0.3
    assert "dead_zone" not in config.read_text()
    files = sorted((tmp_path / "case" / "raw").iterdir())
    assert [file.stem for file in files] == sorted(truth["recordings"])
    assert files[0].read_text().splitlines()[0] == "time_s,current_A,displacement_m"
    assert json.loads((tmp_path / "truth" / "a.json").read_text()) == truth
    with pytest.raises(ValueError, match="must stay outside"):
        write_case(case, tmp_path / "case", tmp_path / "case" / "truth.json")


def test_the_generator_imports_nothing_of_the_program(request):
    allowed = {"run_blind.py", "run_next.py", "test_cases.py", "test_blind.py"}
    importing = {
        file.name
        for file in request.path.parent.glob("*.py")
        if any(
            line.split()[:1] in (["import"], ["from"]) and "hwid_cli" in line
            for line in file.read_text().splitlines()
        )
    }
    assert importing <= allowed
    assert "run_blind.py" in importing
