"""A whole diagnosis where the logged input of a free axis holds noise, which adds up."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.diagnose import diagnose
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.report.diagnosis import verdict_sentence
from hwid_cli.report.sections.diagnosis_answer import verdict_in_words
from tests.diagnosis.small_drive import DRIVE, N, in_turn, recordings, simulation

FREE = replace(DRIVE, stiffness_N_per_m=0.0)
ALLOWED = ("coulomb_friction", "quadratic_drag", "parameter_change")


def told(effects):
    rng = np.random.default_rng(8)
    noisy = [
        replace(one, input=one.input + 0.02 * np.r_[0, rng.standard_normal(N - 1)])
        for one in recordings(effects, drive=FREE, noise=2e-6)
    ]
    options = DiagnoseOptions(effects=ALLOWED, laws="never", max_effects=2)
    return diagnose(
        noisy, simulation(stiffness_N_per_m=0.0), options, in_turn, lambda *_: None
    )


@pytest.mark.thorough
def test_effects_are_told_beside_the_noise_of_the_input_and_it_is_told_of_the_rest():
    effects = {
        "coulomb_friction": {"force_N": 2.0},
        "quadratic_drag": {"drag_N_s2_per_m2": 20.0},
    }
    found = told(effects)
    assert found.after.ratio_to_noise > 10
    values = {one.id: one.parameters[0] for one in found.effects}
    assert values.keys() == effects.keys()
    for name, given in effects.items():
        (true,) = given.values()
        assert values[name].low < true < values[name].high
    assert (found.verdict, found.complete, found.remains) == (
        "named", False, "input_noise",
    )  # fmt: skip
    rest = "noise of the measured input"
    assert found.summary.endswith(f"What remains is {rest}, seen through the drive.")
    assert f"what remains is {rest}" in verdict_sentence(found)
    assert f"what remains is {rest}" in verdict_in_words(found)


@pytest.mark.thorough
def test_a_clean_axis_lacks_nothing_however_far_the_noise_adds_up():
    found = told({})
    assert found.verdict in ("none", "parameters")
    assert found.before.ratio_to_noise > 10
    assert found.remains == "input_noise"
