"""Play between motor and load: a fit to growing parts finds what whole ones hide."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli.diagnosis.base_fit import fitted_base
from hwid_cli.diagnosis.candidate import fit_candidate
from hwid_cli.diagnosis.growing import (
    fit_grown,
    grown_starts,
    is_rugged,
    with_valleys_of,
)
from hwid_cli.diagnosis.intervals import intervals
from hwid_cli.drive.catalogue import CATALOGUE
from tests.diagnosis.small_drive import (
    DRIVE,
    problem,
    recordings,
    search_start,
    sizes,
    white,
)

pytestmark = pytest.mark.thorough

PLAY = {
    "half_gap_m": 3e-4,
    "stiffness_N_per_m": 2e5,
    "motor_share": 0.25,
    "motor_damping_share": 0.1,
    "contact_damping_ratio": 0.137,
}
GEAR = ("gear_backlash",)
NOISE = 1e-5


@pytest.fixture(scope="module")
def rattling():
    """A lightly damped drive whose teeth hit dozens of times in every recording."""
    drive = replace(DRIVE, damping_N_s_per_m=2.0)
    found = recordings({"gear_backlash": PLAY}, drive=drive, noise=NOISE, n=800)
    found = [one for one in found if one.name in ("step_1", "step_4", "sine_1")]
    return problem(found, damping_N_s_per_m=2.0)


def gear_start(of, **changes):
    return search_start(of, {"gear_backlash": {**PLAY, **changes}})


@pytest.fixture(scope="module")
def stuck(rattling):
    start = gear_start(rattling, half_gap_m=8e-4, stiffness_N_per_m=6e4)
    return fit_candidate(rattling, GEAR, [start], sizes(rattling), white(NOISE))


@pytest.fixture(scope="module")
def grown(rattling, stuck):
    start = gear_start(rattling, half_gap_m=8e-4, stiffness_N_per_m=6e4)
    begun = grown_starts(start, GEAR, sizes(rattling))
    return fit_grown(rattling, stuck, begun, sizes(rattling), white(NOISE))


def train_ratio(of, found):
    rows = [row for row, one in enumerate(of.signals) if not one.is_held_out]
    count = sum(of.signals[row].n_evaluated for row in rows)
    return np.sqrt(found.sse[rows].sum() / count) / NOISE


def test_the_first_valley_of_whole_recordings_is_not_the_deepest(
    rattling, stuck, grown
):
    assert train_ratio(rattling, stuck) > 1.5
    assert train_ratio(rattling, grown) < 1.1


def test_growing_parts_lead_to_the_true_values(grown):
    found = {one.parameter: v for one, v in zip(grown.names, grown.values, strict=True)
             if one.owner == "gear_backlash"}  # fmt: skip
    assert found == pytest.approx(PLAY, rel=0.02)


def test_intervals_reach_over_the_other_valleys(rattling, grown):
    assert len(grown.valleys) > 1
    low, high = intervals(rattling, grown, sizes(rattling))
    alone = replace(grown, valleys=np.zeros((0, 0)))
    narrow_low, narrow_high = intervals(rattling, alone, sizes(rattling))
    for valley in grown.valleys:
        assert np.all((low <= valley) & (valley <= high))
    assert np.all(low <= narrow_low)
    assert np.all(high >= narrow_high)


def test_a_better_fit_of_the_same_effects_keeps_what_was_known_of_valleys(grown):
    better = replace(grown, values=1.01 * grown.values, valleys=np.zeros((0, 0)))
    known = with_valleys_of(better, grown).valleys
    assert len(known) == len(grown.valleys) + 1
    assert known[-1] == pytest.approx(grown.values)
    plain = replace(grown, valleys=np.zeros((0, 0)))
    assert with_valleys_of(better, plain).valleys.size == 0


def test_growth_that_leads_nowhere_leaves_the_fit_as_it_is(rattling, stuck):
    """Dry friction is missing as well: early parts leave more than noise."""
    drive = replace(DRIVE, damping_N_s_per_m=2.0)
    both = {"gear_backlash": PLAY, "coulomb_friction": {"force_N": 1.0}}
    found = recordings(both, drive=drive, noise=NOISE, n=800)
    of = problem([one for one in found if one.name == "sine_1"], damping_N_s_per_m=2.0)
    begun = [gear_start(of)]
    assert fit_grown(of, stuck, begun, sizes(of), white(NOISE)) is stuck


def test_a_simulation_that_has_the_teeth_is_fitted_again_before_anything_is_added(
    rattling,
):
    """From values in another valley: nothing is missing, the parameters were off."""
    off = {**PLAY, "half_gap_m": 6e-4, "stiffness_N_per_m": 6e4}
    present = replace(rattling.drive, effects={"gear_backlash": off})
    found = fitted_base(replace(rattling, drive=present)).base
    assert train_ratio(rattling, found) < 1.1


def test_only_what_remembers_impacts_grows():
    assert is_rugged(("coulomb_friction", "gear_backlash"))
    assert not is_rugged(("coulomb_friction", "end_stop"))


def test_growth_begins_where_the_fit_stopped_and_at_all_starts_of_the_teeth(rattling):
    start = gear_start(rattling)
    begun = grown_starts(start, ("coulomb_friction", *GEAR), sizes(rattling))
    assert begun[0] == start
    assert len(begun) == 1 + len(CATALOGUE["gear_backlash"].starts(sizes(rattling)))
    assert {one.effects["gear_backlash"]["motor_share"] for one in begun[1:]} == {
        0.2,
        0.45,
    }


def test_on_an_axis_that_goes_far_the_teeth_may_be_as_stiff_as_the_samples_show(
    rattling,
):
    """The way over the force says nothing of teeth: mass and sampling do."""
    of = sizes(rattling)
    far = replace(of, displacement_m=1e4 * of.displacement_m)
    low, high = CATALOGUE["gear_backlash"].parameter("stiffness_N_per_m").bounds(far)
    assert low < PLAY["stiffness_N_per_m"] < high
