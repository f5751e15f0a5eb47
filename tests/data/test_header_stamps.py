"""Exports of ROS bags: the header's stamp is the clock, and lost samples are counted."""

import numpy as np
import pytest

from hwid_cli.data.column_clocks import guess_time
from hwid_cli.data.folder import guess_layout, list_measurements
from hwid_cli.data.recordings import read_recordings, survey_recordings
from hwid_cli.data.sampling import missing_samples
from hwid_cli.errors import MeasurementError

STEP_NS, N = 10_000_000, 300
LOST = (150, 200, 201)
# Names of the record time, of the stamp and of its key, of an input and an output.
EXPORTS = {
    "rostopic": ("%time", ("field.header.stamp",), "field.effort0", "field.position0"),
    "bagpy": (
        "Time",
        ("header.stamp.secs", "header.stamp.nsecs"),
        "effort_0",
        "position_0",
    ),
    # In the order of the alphabet: the input stands between the two times.
    "plotjuggler": (
        "__time",
        ("/joints/header/stamp",),
        "/joints/effort[0]",
        "/joints/position[0]",
    ),
    "ros2": (
        "timestamp",
        ("header.stamp.sec", "header.stamp.nanosec"),
        "effort",
        "position",
    ),
}
KEYS = {
    "rostopic": "field.header.stamp",
    "bagpy": "header.stamp",
    "plotjuggler": "/joints/header/stamp",
    "ros2": "header.stamp",
}


def write_export(folder, kind, lost=(), name="a"):
    """A regular record time, late by 3 ms, beside stamps that lack some samples."""
    record, stamp, effort, position = EXPORTS[kind]
    rng = np.random.default_rng(4)
    u = np.repeat(rng.uniform(-1, 1, N // 10), 10)
    y = 0.1 * np.cumsum(u) + 1e-3 * rng.standard_normal(N)
    header = [record, effort, *stamp, position]
    rows = [",".join(header)]
    for k in sorted(set(range(N)) - set(lost)):
        second, rest = divmod(STEP_NS * k + 990_000_000, 10**9)
        second += 1_700_000_000
        whole = second * 10**9 + rest
        cells = {
            ("field.header.stamp",): [whole],
            ("/joints/header/stamp",): [f"{whole / 1e9:.9f}"],
        }.get(stamp, [second, rest])
        late = whole + 3_000_000
        time = f"{late / 1e9:.9f}" if kind in ("bagpy", "plotjuggler") else late
        rows.append(",".join(map(str, [time, u[k], *cells, y[k]])))
    (folder / f"{name}.csv").write_text("\n".join(rows) + "\n")
    return effort, position


@pytest.mark.parametrize("kind", EXPORTS)
def test_the_stamp_of_the_header_is_the_clock(tmp_path, kind):
    effort, position = write_export(tmp_path, kind)
    layout = guess_layout(list_measurements(tmp_path))
    assert (layout.time.key, layout.output_time) == (KEYS[kind], None)
    assert {layout.input.key, layout.output.key} == {effort, position}
    assert not layout.resample


@pytest.mark.parametrize("kind", EXPORTS)
def test_lost_samples_are_counted_and_bridged(tmp_path, tiny, kind):
    write_export(tmp_path, kind)
    effort, position = write_export(tmp_path, kind, LOST, "b")
    layout = guess_layout(list_measurements(tmp_path))
    assert layout.resample
    assert "samples are missing: 3 in b.csv; straight lines stand for them" in (
        layout.notes
    )
    columns = f"{{time: {KEYS[kind]}, input: '{effort}', output: '{position}'}}"
    unit = "ns" if kind == "rostopic" else "s"
    more = f"units: {{time: {unit}}}\nresample: true"
    experiment = tiny("'*.csv'", columns, more)
    survey = survey_recordings(experiment, tmp_path)
    assert survey.problems == ()
    assert survey.missing == {"a": 0, "b": 3}
    # Stamps in nanoseconds since 1970 are rounded to 256 ns.
    assert max(survey.jitter.values()) < 1e-4
    whole, lossy = read_recordings(experiment, tmp_path)
    # Such stamps may leave the last tick a hair outside.
    assert abs(lossy.input.size - N) <= 1
    assert whole.sample_time_s == pytest.approx(STEP_NS * 1e-9, rel=1e-6)
    np.testing.assert_allclose(lossy.output[:150], whole.output[:150], atol=1e-4)
    refused = tiny("'b.csv'", columns, f"units: {{time: {unit}}}")
    with pytest.raises(
        MeasurementError, match=r"\(3 samples are missing in the file\)"
    ):
        read_recordings(refused, tmp_path)


def test_a_clock_that_scatters_lacks_nothing():
    rng = np.random.default_rng(1)
    ticks = np.arange(5000.0)
    for scatter in (0.05, 0.2, 0.4):
        late = np.maximum.accumulate(ticks + rng.exponential(scatter, ticks.size))
        # A file holds no stamp twice.
        assert missing_samples(late + 1e-6 * ticks) <= 1
    assert missing_samples(np.delete(ticks, [100, 2000])) == 2
    # Rounded stamps of a clock of 1.5 units.
    assert missing_samples(np.round(1.5 * ticks + 1e-3)) == 0


def test_a_stamp_that_nobody_has_set_is_no_clock(tmp_path):
    write_export(tmp_path, "bagpy")
    path = tmp_path / "a.csv"
    rows = [line.split(",") for line in path.read_text().splitlines()]
    rows = [rows[0], *([one[0], one[1], "0", "0", one[4]] for one in rows[1:])]
    path.write_text("\n".join(map(",".join, rows)))
    (found,) = list_measurements(tmp_path)
    assert guess_time(found.columns).role.key == "Time"
