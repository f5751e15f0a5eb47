import pytest

from hwid_cli.errors import ConfigError
from hwid_cli.records.machines import GunPlan
from hwid_cli.stages.gun_plan import plan_gun, select_recordings

PLAN = {recording.name: recording for recording in plan_gun(GunPlan())}


def test_full_plan_has_15_steps_23_sines_and_5_random_signals():
    kinds = [recording.kind for recording in PLAN.values()]
    assert [kinds.count(kind) for kind in ("step", "sine", "random")] == [15, 23, 5]


@pytest.mark.parametrize(
    ("name", "ramp", "amplitude"),
    [("step_01", 0, 2), ("step_05", 0, 10), ("step_06", 100, 2), ("step_14", 300, 8)],
)
def test_steps_are_numbered_row_by_row_of_their_ramp(name, ramp, amplitude):
    assert (PLAN[name].ramp_samples, PLAN[name].amplitude_A) == (ramp, amplitude)


@pytest.mark.parametrize(
    ("name", "frequency", "amplitude"),
    [
        ("sine_01", 0.5, 1),
        ("sine_10", 0.34, 5),
        ("sine_18", 0.11, 3),
        ("sine_19", 0.005, 1),
        ("sine_23", 0.005, 5),
    ],
)
def test_sines_are_numbered_row_by_row_without_the_cells_left_out(
    name, frequency, amplitude
):
    recording = PLAN[name]
    assert (recording.rad_per_sample, recording.amplitude_A) == (frequency, amplitude)


def test_plan_without_cells_left_out_has_25_sines():
    plan = plan_gun(GunPlan(sine_left_out=()))
    assert sum(recording.kind == "sine" for recording in plan) == 25


def test_selection_keeps_the_order_of_the_plan():
    chosen = select_recordings(tuple(PLAN.values()), ("random_01", "step_03"))
    assert [recording.name for recording in chosen] == ["step_03", "random_01"]


def test_unknown_recording_is_refused_with_the_nearest_name():
    with pytest.raises(
        ConfigError, match=r"plan\.only: 'step_1' .* 43 recordings; did you mean 'step_"
    ):
        select_recordings(tuple(PLAN.values()), ("step_1",))
