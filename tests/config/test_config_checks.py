import pytest

from hwid_cli.config.load import load_experiment
from hwid_cli.errors import ConfigError
from hwid_cli.records.experiment import FileUnits

RECORDINGS = (
    "recordings: {{files: a.csv, columns: {{time: t, input: u, output: y}}, {}}}"
)


@pytest.fixture
def load(write_config):
    return lambda text: load_experiment(write_config(f"name: tiny\n{text}\n"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("kind: {stepp: a}", r"recordings.kind: found 'stepp'; did you mean 'step'\?"),
        ("average: 0", r"recordings.average: found 0; expected an integer >= 1"),
        ("first_sample: -1", r"recordings.first_sample: found -1; expected .* >= 0"),
        (
            "first_sample: 5, last_sample: 5",
            r"recordings.last_sample: found 5; expected an integer > first_sample = 5",
        ),
        ("input_scale: 0", r"recordings.input_scale: found 0.0; .*other than 0"),
        ("sampling_tolerance: 0", r"sampling_tolerance: found 0.0; expected a share"),
        ("sample_time_s: -1", r"recordings.sample_time_s: found -1.0; .*seconds > 0"),
        ("exclude: ['']", r"recordings.exclude: found ''; expected a file name"),
    ],
)
def test_impossible_reading_option_is_refused(load, text, message):
    with pytest.raises(ConfigError, match=message):
        load(RECORDINGS.format(text))


@pytest.mark.parametrize(
    ("section", "message"),
    [
        (
            "{files: a.csv, columns: {input: u, output: y}}",
            r"recordings.sample_time_s: missing, and columns.time too; .*name the time",
        ),
        (
            "{files: a.csv, sample_time_s: 1, columns: {input: u, output: y, output_time: s}}",
            r"columns.output_time: found 's'; expected columns.time too, the clock",
        ),
        (
            "{files: a.csv, columns: {time: t, input: u, output: y, output_time: t}}",
            r"recordings.columns.output_time: found 't', which is the time too",
        ),
        (
            "{files: a.csv, columns: {time: u, input: u, output: y}}",
            r"recordings.columns.input: found 'u', which is the time too",
        ),
        (
            "{files: a.csv, columns: {time: 0, input: -1, output: 2}}",
            r"recordings.columns.input: found -1; expected a number >= 0",
        ),
        (
            "{files: a.csv, columns: {input: u, output: y}, sample_time_s: 1, "
            "resample: true}",
            r"recordings.resample: found true; expected a time column",
        ),
        (
            "{files: [], columns: {time: t, input: u, output: y}}",
            r"recordings.files: found \[\]; expected at least one name or pattern",
        ),
    ],
)
def test_columns_must_make_a_recording(load, section, message):
    with pytest.raises(ConfigError, match=message):
        load(f"recordings: {section}")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("calibrate: {step: [cutt]}", r"calibrate.step: found 'cutt'; did you mean"),
        ("calibrate: {step: [cut, cut]}", r"calibrate.step: 'cut' is listed twice"),
        ("calibrate: {samples: 0}", r"calibrate.samples: found 0; .* >= 1"),
        ("calibrate: {rest_samples: 0}", r"calibrate.rest_samples: found 0; .* >= 1"),
        ("orders: {nb: [0, 3]}", r"orders.nb: found 0; expected orders >= 1"),
        ("orders: {nk: [-1, 3]}", r"orders.nk: found -1; expected orders >= 0"),
        ("orders: {nb: []}", r"orders.nb: found \[\]; expected at least one order"),
        ("orders: {nb: [5, 2]}", r"orders.nb: found \[5, 2\]; .*write \[2, 5\]"),
        ("orders: {nb: [1, 2, 2]}", r"orders.nb: 2 is listed twice"),
        ("orders: {nk_role: pole}", r"orders.nk_role: found 'pole'; did you mean"),
        ("orders: {nk_role: delay}", r"orders.nf: missing; .*nk_role is delay"),
        ("orders: {nf: 2}", r"orders.nf: found 2; .*set nk_role: delay"),
        ("crossval: {threshold: 0}", r"crossval.threshold: found 0.0; .*> 0"),
        ("group: {keep: {topp: 1}}", r"group.keep: found 'topp'; did you mean 'top'"),
        ("group: {keep: {top: 1, best: true}}", r"group.keep: .*exactly one of"),
        ("group: {keep: {best: false}}", r"group.keep.best: found False; .*true"),
        ("group: {keep: {top: [3, 0]}}", r"group.keep.top: found \[3, 0\]"),
        ("group: {max_level: 0}", r"group.max_level: found 0; .* >= 1"),
        ("identify: {recordings: []}", r"identify.recordings: found \[\]"),
        ("identify: {recordings: [a, a]}", r"identify.recordings: 'a' is listed twice"),
    ],
)
def test_impossible_stage_option_is_refused(load, text, message):
    with pytest.raises(ConfigError, match=message):
        load(text)


@pytest.mark.parametrize("name", ["../up", "a/b", "", " a", ".hidden", "a:b"])
def test_name_must_be_a_folder_name(write_config, name):
    path = write_config(f"name: '{name}'\n")
    with pytest.raises(ConfigError, match=r"name: found .*that can be a folder"):
        load_experiment(path)


@pytest.mark.parametrize(
    ("section", "key"),
    [
        ("identify: {recordings: [a, b]}", "identify.recordings"),
        ("crossval: {recordings: [b]}", "crossval.recordings"),
        ("group: {start: [b]}", "group.start"),
        ("group: {candidates: [b]}", "group.candidates"),
        ("group: {validate: [b]}", "group.validate"),
    ],
)
def test_test_recording_that_is_used_before_is_refused(load, section, key):
    message = rf"test.recordings: 'b' .*\({key}\); expected recordings that are used"
    with pytest.raises(ConfigError, match=message):
        load(f"test: {{recordings: [b, c]}}\n{section}")


def test_test_recording_may_stand_beside_all(load):
    experiment = load("test: {recordings: [b]}\nidentify: {recordings: all}")
    assert experiment.identify.recordings is None


def test_delay_grid_with_poles_is_accepted(load):
    orders = load("orders: {nk_role: delay, nf: 2, nk: [0, 2]}").orders
    assert (orders.nf, orders.nk) == (2, (0, 1, 2))


def test_list_for_each_level_is_accepted(load):
    keep = load("group: {keep: {coverage_at_least: [7, 8]}}").group.keep
    assert keep == {"coverage_at_least": (7, 8)}


UNITS = "{files: a.csv, columns: {time: t, input: u, output: y}, units: {%s}%s}"


@pytest.mark.parametrize(
    ("units", "more", "match"),
    [
        (
            "output: furlough",
            "",
            r"units.output: found 'furlough'; expected a unit such",
        ),
        ("output: 3", "", r"units.output: found 3; expected text"),
        (
            "output: s",
            "",
            r"units.output: found 's'; expected a unit such as m, mm, rad",
        ),
        (
            "output: grad",
            "",
            r"found 'grad'; expected a unit such as m, mm, rad or deg",
        ),
        (
            "time: mm",
            "",
            r"units.time: found 'mm'; expected a unit such as s, ms or us",
        ),
        ("force: N", "", r"units.force: unknown key; expected one of time, input, out"),
        (
            "output: mm",
            ", output_unit: rad",
            r"units.output: found 'mm'; expected a unit that goes into recordings.output",
        ),
        (
            "input: mA",
            ", input_scale: 0.001",
            r"recordings.input_scale: found 0.001; expected 1 or -1 beside recordings.un",
        ),
    ],
)
def test_units_that_nobody_knows_or_that_contradict_are_refused(
    write_config, units, more, match
):
    path = write_config(f"name: tiny\nrecordings: {UNITS % (units, more)}\n")
    with pytest.raises(ConfigError, match=match):
        load_experiment(path)


def test_a_unit_of_time_needs_a_column_of_time(write_config):
    text = "{files: a.csv, columns: {input: u, output: y}, sample_time_s: 1, units: {time: ms}}"
    with pytest.raises(ConfigError, match="because sample_time_s is in seconds"):
        load_experiment(write_config(f"name: tiny\nrecordings: {text}\n"))


@pytest.mark.parametrize(
    ("units", "more"),
    [
        ("time: ms, input: mA, output: mm", ""),
        ("output: 1/min", ", output_unit: rpm"),
        ("output: deg", ", output_unit: rad, output_scale: -1"),
        ("input: '-', output: '-'", ""),
    ],
)
def test_units_that_are_known_are_accepted(write_config, units, more):
    path = write_config(f"name: tiny\nrecordings: {UNITS % (units, more)}\n")
    assert load_experiment(path).recordings.units != FileUnits()
