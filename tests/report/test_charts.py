"""What a browser is given to draw, read back by a decoder of the tests' own."""

import json

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from hwid_cli.report.charts import (
    Chart,
    Curve,
    Panel,
    Thinning,
    as_data,
    chart_data,
    on_common_axis,
    packed,
    thinned,
    thinned_note,
    thinned_places,
    thinning,
)

NAN = float("nan")


def unpacked(found):
    """Numbers of a packed curve; steps are summed one by one."""
    if isinstance(found, list):
        return np.array([NAN if one is None else one for one in found])
    total, values = 0, []
    for step in found["d"]:
        total += step or 0
        values.append(NAN if step is None else found["o"] + found["s"] * total)
    return np.array(values)


def unrolled(spec):
    if "runs" not in spec:
        return unpacked(spec["x"])
    return np.concatenate([a + b * np.arange(n) for a, b, n in spec["runs"]])


numbers = st.floats(-1e6, 1e6) | st.just(NAN)


@given(arrays(float, st.integers(1, 200), elements=numbers))
def test_packed_numbers_come_back_to_a_fraction_of_their_range(values):
    found = unpacked(packed(values))

    known = values[np.isfinite(values)]
    span = np.ptp(known) if known.size else 0.0
    # Half of a 40 000th of the range, or six digits of a short curve.
    room = span / 79_000 + 1e-5 * (np.abs(known).max() if known.size else 0.0)
    np.testing.assert_allclose(found, values, rtol=0, atol=room + 1e-300)


def test_long_curves_take_few_characters():
    time = np.linspace(0, 10, 4000)
    text = json.dumps(packed(np.sin(time)), separators=(",", ":"))

    # Steps of a smooth curve have two or three digits.
    assert len(text) < 5 * time.size


def test_bins_keep_every_peak_in_its_order():
    values = np.zeros(10_000)
    values[[1234, 6789]] = 7.0, -3.0
    chosen = thinning(values.size, 1000, (0, 0))
    kept, places = thinned(values, chosen), thinned_places(chosen)

    assert kept.size == places.size <= 1001
    assert kept.max() == 7.0
    assert kept.min() == -3.0
    size = chosen.largest_bin
    assert abs(places[kept.argmax()] - 1234) <= size
    assert abs(places[kept.argmin()] - 6789) <= size
    assert (np.diff(places) > 0).all()


def test_a_detail_stays_whole():
    values = np.arange(20_000.0)
    chosen = thinning(values.size, 4000, (5000, 6000))
    kept, places = thinned(values, chosen), thinned_places(chosen)

    is_detail = (places >= 5000) & (places < 6000)
    np.testing.assert_array_equal(kept[is_detail], values[5000:6000])
    assert kept.size <= 4010


def test_a_bin_without_a_number_stays_without():
    values = np.array([1.0, 2.0, NAN, NAN, 5.0, NAN])

    np.testing.assert_array_equal(
        thinned(values, Thinning(((0, 6, 2),))), [1.0, 2.0, NAN, NAN, 5.0, 5.0]
    )


@pytest.mark.parametrize(("count", "is_said"), [(4000, False), (4001, True)])
def test_what_is_left_out_is_said(count, is_said):
    note = thinned_note(thinning(count, 4000, (0, 0)))

    assert ("thinned" in note) == is_said


def chart_of(at, *panels):
    return Chart("c", np.asarray(at, float), "time t [s]", panels, "A chart.", "alt")


def test_even_times_travel_as_runs_and_uneven_ones_as_numbers():
    curve = Curve("y", np.zeros(500), "measured")
    even = 0.1 * np.arange(500)
    uneven = np.sort(np.random.default_rng(1).uniform(size=500))
    mixed = np.concatenate([np.arange(250.0), 250 + 5.0 * np.arange(250)])
    for at, n_runs in ((even, 1), (mixed, 2), (uneven, None)):
        spec = json.loads(chart_data(chart_of(at, Panel("y [m]", (curve,)))))
        assert len(spec.get("runs", [])) == (n_runs or 0)
        np.testing.assert_allclose(unrolled(spec), at, rtol=0, atol=np.ptp(at) / 7e4)


def test_a_chart_says_what_a_browser_needs():
    band = Curve("noise", -np.ones(3), "noise", "band", upper=np.ones(3))
    model = Curve("a/1/2", np.zeros(3), "simulated", model="a/1/2", is_hidden=True)
    panel = Panel("y [m]", (band, model), 200, lines=(0.0,), spans=((1.0, 2.0),))
    spec = json.loads(chart_data(chart_of([0, 1, 2], panel)))

    (found,) = spec["panels"]
    assert found["lines"] == [0.0]
    assert found["spans"] == [[1.0, 2.0]]
    assert found["curves"][0]["low"] == [-1.0, -1.0, -1.0]
    assert found["curves"][0]["high"] == [1.0, 1.0, 1.0]
    assert found["curves"][1] | {"y": []} == {
        "l": "a/1/2",
        "r": "simulated",
        "k": "line",
        "y": [],
        "g": "a/1/2",
        "off": True,
    }


def test_no_text_of_the_user_can_end_the_data():
    text = as_data({"a": "</script><!-- & -->"})

    assert not set("<>&") & set(text)
    assert json.loads(text) == {"a": "</script><!-- & -->"}


def test_curves_of_their_own_samples_share_one_axis():
    at, (first, second) = on_common_axis(([0, 2, 4], [1, 2, 3]), ([2, 3], [9, 8]))

    np.testing.assert_array_equal(at, [0, 2, 2, 3, 4])
    np.testing.assert_array_equal(first, [1, 2, NAN, NAN, 3])
    np.testing.assert_array_equal(second, [NAN, NAN, 9, 8, NAN])


@pytest.mark.parametrize(
    ("role", "style"), [("pink", "line"), ("measured", "wavy"), ("measured", "band")]
)
def test_curves_that_nobody_can_draw_are_refused(role, style):
    with pytest.raises(ValueError, match=r"no such curve|upper end"):
        Curve("y", np.zeros(2), role, style)
