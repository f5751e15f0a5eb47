"""How long fits of several recordings take, told from some that are timed."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from hwid_cli.cli import check
from hwid_cli.config.load import load_experiment
from hwid_cli.records.check import FitCost
from hwid_cli.records.experiment import OrdersOptions
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages import fit_seconds, joint_seconds
from hwid_cli.stages.recording_facts import Checked
from hwid_cli.stages.run_seconds import page_plan
from hwid_cli.stages.stage import Planning
from hwid_cli.stages.table import stage_named
from hwid_cli.tasks.cache import MemoryStore

TWO_KINDS = (FitOptions(), FitOptions(input_map="none", output_map="none"))
# Of both maps, each alone, and a linear model, [s].
COST = FitCost(0.1, 1000, 2.0, 10, "a test", (0.1, 0.1, 0.1), (4.0, 1.0, 2.0, 0.5))


def recordings_of(lengths):
    rng = np.random.default_rng(1)
    return [
        Recording(f"run_{row}", rng.normal(size=n), np.zeros(n), 1e-3)
        for row, n in enumerate(lengths)
    ]


@pytest.mark.parametrize(
    ("lengths", "n_fitted"),
    # Two folds each; of many recordings six, and parts of long ones.
    [((400, 600), 1), ((400,) * 20, 5), ((40_000, 40_000), 1), ((500,), 1)],
)
def test_some_fits_stand_for_all_recordings(monkeypatch, lengths, n_fitted):
    clock, fitted = [0.0], []

    def fit(recordings, orders, options):
        if options.max_iterations > 1:
            fitted.append([one.n_samples for one in recordings])
        # Without maps it takes a quarter.
        each = 4e-3 if options.has_maps else 1e-3
        clock[0] += each * sum(one.n_samples for one in recordings)

    monkeypatch.setattr(joint_seconds, "fit_without_standard_errors", fit)
    monkeypatch.setattr(joint_seconds.time, "process_time", lambda: clock[0])
    recordings = recordings_of(lengths)
    found = joint_seconds.joint_seconds(recordings, Orders(1, 2, 1), TWO_KINDS)
    # Each fold leaves the first or the last one out, but for a single recording.
    timed = min(len(lengths), 6)
    left = (timed - 1) / timed if len(lengths) > 1 else 1.0
    assert found[0] == pytest.approx(4e-3 * left * sum(lengths))
    assert found[0] == pytest.approx(4 * found[1])
    assert {len(one) for one in fitted} == {n_fitted}
    assert len(fitted) == (4 if len(lengths) > 1 else 2)
    assert max(map(max, fitted)) <= 10_000


def planning(tmp_path, group="group: {together: true}", cost=COST, workers=2):
    config = tmp_path / "experiment.yaml"
    config.write_text(
        "name: x\nrecordings: {files: data/*.csv, columns: {input: u, output: y}, "
        "sample_time_s: 0.001}\norders: {nb: [1, 2], nk: [1, 2, 3]}\n"
        f"crossval: {{threshold: 0.1}}\n{group}\ntest: {{recordings: [run_4]}}\n"
    )
    recordings = recordings_of((1000,) * 5)
    experiment = load_experiment(Path(config))
    return Planning(experiment, tuple(recordings), cost, MemoryStore(), workers)


def test_the_model_of_all_is_forecast_as_a_range_of_what_its_maps_may_be(tmp_path):
    given = planning(tmp_path)
    plan = joint_seconds.joint_plan(given.experiment, given.recordings, COST)
    # Four folds: of two orders with three kinds of maps and two sizes, then of six orders;
    # 21 longer delays may be tried, and the last fit is that of all.
    before, of_orders = 4 * 8 + 1, 4 * 6
    mean = 7.0 / 3.0
    assert plan.n_fits == before + of_orders + 21
    least = before * mean + of_orders * 1.0
    assert plan.search[0] == pytest.approx(least + 0.005 * (before + of_orders))
    most = (before + 21) * mean + of_orders * 4.0
    assert plan.search[1] == pytest.approx(most + 0.005 * plan.n_fits)
    # Each recording but that of the test is left out once; six orders of linear models.
    # Their orders are not known: 1 to 2.5 coefficients of each kind, of which 2 are timed.
    smallest, largest = (1.0 / 2.0) ** 0.54, (2.5 / 2.0) ** 0.54
    assert plan.bands == pytest.approx((4 * 1.0 * smallest, 4 * 4.0 * largest))
    assert plan.linear == 6 * 0.5
    # Of many recordings linear models are fitted to eight.
    many = (*recordings_of((1000,) * 4), *recordings_of((1000,) * 13)[5:])
    wide = joint_seconds.joint_plan(given.experiment, many, COST)
    assert wide.linear == pytest.approx(6 * 0.5 * 8 / len(many))


def test_stages_that_follow_count_the_fits_of_the_model_of_all(tmp_path):
    given = planning(tmp_path)
    (group,) = stage_named("group").plan(given)
    (tested,) = stage_named("test").plan(given)
    plan = joint_seconds.joint_plan(given.experiment, given.recordings, COST)
    assert group.seconds == pytest.approx(plan.search[0] / 2, rel=0.1)
    # The bands are one task, so a second process does not help.
    assert tested.seconds == pytest.approx(plan.bands[0], abs=0.1)
    assert tested.longest_seconds == pytest.approx(plan.bands[1], abs=0.1)
    alone = planning(tmp_path, group="group: {together: false}")
    more = page_plan(given).seconds - page_plan(alone).seconds
    assert more == pytest.approx(3.0 / 2, rel=0.5)
    (without,) = stage_named("test").plan(alone)
    assert without.longest_seconds < 0.1


def test_without_timing_a_joint_fit_is_scaled_from_one_of_a_recording(tmp_path):
    given = planning(tmp_path, cost=fit_seconds.MEASURED)
    plan = joint_seconds.joint_plan(
        given.experiment, given.recordings, fit_seconds.MEASURED
    )
    assert plan.search[0] < plan.search[1]
    assert 0.0 < plan.bands[0] < plan.bands[1]


def test_nothing_is_timed_where_nothing_is_fitted_together(tmp_path, monkeypatch):
    given = planning(tmp_path, group="group: {together: false}")
    monkeypatch.setattr(joint_seconds, "fit_without_standard_errors", None)
    found = joint_seconds.time_joint_fits(given.experiment, given.recordings)
    assert found == ()


def test_each_recording_has_a_say_in_how_long_maps_take(monkeypatch):
    clock, fitted = [0.0], []

    def fit(recordings, orders, options):
        (one,) = recordings
        fitted.append((one.name, options.input_units))
        # Only one of eight recordings is searched again.
        clock[0] += 4.0 if one.name == "run_3" else 0.0

    monkeypatch.setattr(fit_seconds, "fit", fit)
    monkeypatch.setattr(
        fit_seconds, "time", SimpleNamespace(process_time=lambda: clock[0])
    )
    maps = [FitOptions(input_units=n) for n in range(2, 10)]
    orders = OrdersOptions(nb=(2,), nk=(2,))
    least, most = fit_seconds.map_seconds(
        COST, orders, recordings_of((1000,) * 8), maps
    )
    # One of eight: 4 s on a recording, 0.5 s on the mean, known to 0.5 s.
    assert (least, most) == pytest.approx((8 * 8 * 0.25, 8 * 8 * 1.5))
    assert fitted == [(f"run_{row}", 2 + row) for row in range(8)]


def test_maps_are_timed_for_more_than_a_second(monkeypatch):
    clock, fitted = [0.0], []

    def fit(recordings, orders, options):
        fitted.append((recordings[0].name, options.input_units))
        clock[0] += 0.0625 if len(fitted) % 2 else 0.0

    monkeypatch.setattr(fit_seconds, "fit", fit)
    monkeypatch.setattr(
        fit_seconds, "time", SimpleNamespace(process_time=lambda: clock[0])
    )
    maps = [FitOptions(input_units=n) for n in range(2, 10)]
    orders = OrdersOptions(nb=(1, 2, 4), nk=(2,))
    least, most = fit_seconds.map_seconds(
        COST, orders, recordings_of((1000,) * 8), maps
    )
    # Each with each other until 1.5 s have gone.
    assert len(fitted) == len(set(fitted)) == 49
    assert fitted[8] == ("run_1", 2)
    mean = 25 * 0.0625 / 49
    assert least / 64 < mean < most / 64
    # Larger orders take longer: a mean of 3 coefficients for 2.
    assert most / 64 > mean * 1.2


def test_nothing_is_timed_and_no_linear_model_planned_where_nothing_is_fitted(
    tmp_path, monkeypatch
):
    config = tmp_path / "experiment.yaml"
    config.write_text(
        "name: x\nrecordings: {files: data/*.csv, columns: {input: u, output: y}, "
        "sample_time_s: 0.001}\nsimulation: {mass_kg: 1.0, damping_N_s_per_m: 2.0, "
        "stiffness_N_per_m: 0.0, force_constant_N_per_A: 3.0}\ndiagnose: {}\n"
    )
    monkeypatch.setattr(check, "time_fits", None)
    experiment, recordings = load_experiment(config), tuple(recordings_of((500,) * 3))
    given = Checked((), recordings, ())
    cost = check._cost(experiment, given, MemoryStore(), timing=True)
    assert cost is fit_seconds.MEASURED
    given = Planning(experiment, recordings, cost, MemoryStore())
    assert page_plan(given).what == "the page and its figures"
