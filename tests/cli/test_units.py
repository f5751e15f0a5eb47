"""The same nine recordings in other units: the same diagnosis, or one clear line."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from hwid_cli.cli.main import main
from hwid_cli.config.load import load_experiment
from hwid_cli.store.results import read_calibrated
from tests.cli.drive_examples import CONFIG, NOISE, STEP_S, N, currents, displacement

SI = "time_s,current_A,displacement_m"
MILLI = (1e3, 1e3, 1e3)


def write_experiment(folder, header=SI, factors=(1.0, 1.0, 1.0), more="", changed=()):
    """Nine recordings, times factors, and a configuration that reads them."""
    rng = np.random.default_rng(7)
    (folder / "data").mkdir(parents=True)
    ninth = ("sine_05", 3.0 * np.sin(2 * np.pi * 5.0 * STEP_S * np.arange(N)))
    for name, current in (*currents(), ninth):
        output = displacement(current) + NOISE * rng.standard_normal(N)
        # Thousandths of few digits: divided by 1000 they are the same numbers in SI.
        milli = np.round(
            1e3 * np.column_stack([STEP_S * np.arange(N), current, output]), 6
        )
        rows = milli / 1000.0 * factors
        rows = np.where(np.asarray(factors) == 1e3, milli, rows)
        np.savetxt(
            folder / "data" / f"{name}.csv",
            rows,
            fmt="%.17g",
            delimiter=",",
            header=header,
            comments="",
        )
    time, input_, output = header.splitlines()[0].split(",")
    keys = f'{{time: "{time}", input: "{input_}", output: "{output}"}}'
    text = CONFIG.replace(
        "{time: time_s, input: current_A, output: displacement_m}", keys
    )
    text = text.replace("recordings:\n", f"recordings:\n{more}")
    for old, new in changed:
        assert old in text
        text = text.replace(old, new)
    path = folder / "drive.yaml"
    path.write_text(text)
    return path


def run(command, path, *options):
    more = ["--no-timing"] if command == "check" else ["--jobs", "1"]
    return CliRunner().invoke(main, [command, str(path), *more, *options])


def diagnosis(path):
    out = path.parent / "out"
    result = run("diagnose", path, "--out", str(out))
    assert result.exit_code == 0, result.output
    return json.loads((out / "diagnosis.json").read_text()), result


def leaves(value, place=""):
    if isinstance(value, dict):
        for key, item in value.items():
            yield from leaves(item, f"{place}.{key}")
    elif isinstance(value, list):
        for number, item in enumerate(value):
            yield from leaves(item, f"{place}.{number}")
    else:
        yield place, value


@pytest.fixture(scope="module")
def in_si(tmp_path_factory):
    return diagnosis(write_experiment(tmp_path_factory.mktemp("si")))


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("header", "more"),
    [
        ("t_ms,I (mA),position [mm]", ""),
        ("t,u,y", "  units: {time: ms, input: mA, output: mm}\n"),
        ("t,u,y\nms,mA,mm", ""),
        # Of all other stages the numbers stay in mA and mm.
        ("t_ms,u,y", "  input_unit: mA\n  output_unit: mm\n"),
    ],
    ids=["names", "keys", "row", "labels"],
)
def test_the_diagnosis_is_the_same_in_other_units(in_si, tmp_path, header, more):
    expected, said = in_si
    found, also_said = diagnosis(write_experiment(tmp_path, header, MILLI, more))
    assert "hwid: " not in said.stderr + also_said.stderr
    for about in (expected, found):
        about.pop("seconds", None)
        about.pop("sha256", None)
        provenance = about.pop("provenance", None)
    assert {one["role"]: one["given"] for one in provenance["units"]} == {
        "time": "ms",
        "input": "mA",
        "output": "mm",
    }
    expected, found = dict(leaves(expected)), dict(leaves(found))
    assert set(found) == set(expected)
    for place, value in expected.items():
        # The same numbers go in.
        want = pytest.approx(value, rel=1e-9) if isinstance(value, float) else value
        assert found[place] == want, place
    assert expected[".verdict"] == "named"
    assert expected[".effects.0.parameters.force_N.value"] == pytest.approx(
        0.8, rel=0.02
    )


def test_results_say_what_was_converted(tmp_path):
    path = write_experiment(tmp_path, "t_ms,I (mA),position [mm]", MILLI)
    result = run("calibrate", path, "--out", str(tmp_path / "out"))
    assert "input converted from mA to A" in result.stderr
    assert "output converted from mm to m" in result.stderr
    assert "time converted from ms to s" in result.stderr
    calibrated = read_calibrated(tmp_path / "out" / "calibrated.h5")
    (time, input_, _) = calibrated.logs[0].units
    assert (time.given, time.unit, time.factor) == ("ms", "s", 0.001)
    assert input_.said_by == "the name 'I (mA)'"
    assert calibrated.recordings[0].input_unit == "A"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("header", "more", "changed", "said"),
    [
        (
            "time_s,current_A,voltage_V",
            "",
            (),
            "recordings.columns.output: the name 'voltage_V' says 'V' (recording step_01);"
            " expected 'm', the unit of the simulation; name another column, or correct",
        ),
        (
            "t,u,y",
            "  units: {output: deg}\n",
            (),
            "recordings.units.output: found 'deg'; expected 'm', the unit of the "
            "simulation; name another column, or say recordings.output_unit: rad",
        ),
        (
            "time_s,current_A,position [inc]",
            "",
            (),
            "the name 'position [inc]' says 'inc' (recording step_01); expected 'm'",
        ),
        (
            SI,
            "",
            (("  mass_kg: 0.3\n", "  mass_kg: 0.3\n  resistance_ohm: 2\n"),),
            "recordings.columns.input: the name 'current_A' says 'A' (recording step_01);"
            " expected 'V' over resistance_ohm",
        ),
    ],
    ids=["voltage", "degrees", "counts", "circuit"],
)
def test_a_unit_that_contradicts_the_simulation_is_refused_in_one_line(
    tmp_path, header, more, changed, said
):
    path = write_experiment(tmp_path, header, more=more, changed=changed)
    for command in ("check", "diagnose", "simulate"):
        result = run(command, path, "--out", str(tmp_path / "out"))
        assert result.exit_code == 1
        assert result.stderr.count("\n") == 1
        assert result.stderr.startswith(f"hwid: {path}: ")
        assert said in result.stderr


def test_what_a_later_stage_refuses_is_refused_before_others_compute(tmp_path):
    first = (("diagnose: {", "identify: {recordings: [step_04]}\ndiagnose: {"),)
    path = write_experiment(tmp_path, "time_s,current_A,y [inc]", changed=first)
    result = run("run", path, "--out", str(tmp_path / "out"))
    assert result.exit_code == 1
    assert "'y [inc]' says 'inc'" in result.stderr
    assert not (tmp_path / "out" / "results.h5").exists()


def test_other_stages_do_not_mind(tmp_path):
    path = write_experiment(tmp_path, "time_s,current_A,position [inc]")
    assert run("calibrate", path, "--out", str(tmp_path / "out")).exit_code == 0


@pytest.mark.parametrize("section", ["with", "without"])
def test_what_nobody_says_is_said_to_be_assumed(tmp_path, section):
    path = write_experiment(tmp_path, "t,u,y")
    if section == "without":
        text = path.read_text()
        path.write_text(text[: text.index("diagnose:")])
    result = run("check", path)
    assert result.exit_code == 0, result.output
    first, *further = result.stderr.splitlines(keepends=True)
    assert bool(further) is (section == "without")
    assert first == (
        f"hwid: {path}: recordings.units: nothing says the unit of the input, the output "
        "and the time: taken as A, m and s, as the simulation's numbers are; correct or "
        "confirm it with recordings.units: {input: A, output: m, time: s}\n"
    )


@pytest.mark.thorough
def test_an_unknown_unit_that_the_sizes_contradict_is_refused_in_one_line(tmp_path):
    path = write_experiment(tmp_path, "time_s,current_A,y", (1.0, 1.0, 1e3))
    said = set()
    for command in ("check", "diagnose", "simulate"):
        result = run(command, path, "--out", str(tmp_path / "out"))
        assert result.exit_code == 1, result.output
        said.add(result.stderr.splitlines()[-1])
        assert not (tmp_path / "out" / "diagnosis.json").exists()
    (line,) = said
    assert "recordings.units.output: nothing says the unit of the output" in line
    assert "write recordings.units: {output: mm} if it is in mm" in line
    # What it proposes is what helps.
    text = path.read_text()
    units = "recordings:\n  units: {output: mm}\n"
    path.write_text(text.replace("recordings:\n", units))
    assert run("check", path).stderr == ""
    # Somebody who insists has to look at the parameters, and is warned.
    path.write_text(text.replace("recordings:\n", units.replace("mm", "m")))
    result = run("check", path)
    assert result.exit_code == 0, result.output
    assert "is the output in mm, not m?" in result.stderr


@pytest.mark.thorough
def test_init_writes_the_units_that_it_reads(tmp_path):
    write_experiment(tmp_path, "t,i,y\nms,mA,mm", MILLI)
    out = tmp_path / "mine.yaml"
    result = CliRunner().invoke(
        main, ["init", str(tmp_path / "data"), "--out", str(out)]
    )
    assert result.exit_code == 0, result.output
    units = load_experiment(out).recordings.units
    assert (units.time, units.input, units.output) == ("ms", "mA", "mm")
    assert run("check", out).exit_code == 0


@pytest.mark.thorough
def test_a_prediction_takes_any_unit_that_goes_into_the_models(tmp_path):
    small = (("diagnose: {", "identify: {recordings: [step_04]}\ndiagnose: {"),)
    fit = (("orders: {nb: 1, nk: 1}", "orders: {nb: 1, nk: 1}\nfit: {units: 3, starts: 1, max_iterations: 3}"),)  # fmt: skip
    header = "t,i,y\nms,mA,mm"
    path = write_experiment(tmp_path, header, MILLI, changed=(*small, *fit))
    out = tmp_path / "out"
    options = ("--out", str(out), "--model", "step_04/1/1", "--format", "json")
    assert run("export", path, *options).exit_code == 0
    model = out / "models" / "step_04_1_1.json"
    content = json.loads(model.read_text())
    assert content["units"] == {"time": "s", "input": "A", "output": "m"}
    assert content["scales"] == {"input": 0.001, "output": 0.001}
    assert content["file_units"] == {"time": "ms", "input": "mA", "output": "mm"}

    def predicted(heads, factors):
        given = tmp_path / "given.csv"
        rows = np.column_stack([STEP_S * np.arange(N), dict(currents())["step_02"]])
        lines = [",".join(map(repr, row)) for row in (rows * factors).tolist()]
        given.write_text("\n".join([*heads, *lines]))
        target = tmp_path / "prediction.csv"
        arguments = ["predict", str(model), str(given), "--out", str(target)]
        result = CliRunner().invoke(main, arguments)
        if result.exit_code:
            return result.stderr
        is_other = heads[-1].endswith("A") and not heads[-1].endswith("mA")
        assert ("it is converted to mA" in result.stderr) == is_other
        return np.genfromtxt(target, delimiter=",", names=True)["predicted"]

    as_before = predicted(["t,i"], (1e3, 1e3))
    for heads, factors in (
        (["t,i", "ms,mA"], (1e3, 1e3)),
        (["t,i", "s,A"], (1.0, 1.0)),
        (["t,i", "us,uA"], (1e6, 1e6)),
    ):
        # A factor of its own rounds the input in its last digit.
        np.testing.assert_allclose(predicted(heads, factors), as_before, rtol=1e-9)
    assert np.ptp(as_before) > 1e-3
    assert "says that input 'i' is in 'V'; expected 'mA'" in predicted(
        ["t,i", "s,V"], (1.0, 1.0)
    )
    assert "says that time 't' is in 'm'; expected a unit of time" in predicted(
        ["t,i", "m,A"], (1.0, 1.0)
    )


@pytest.mark.parametrize("unit", ["mm/s", "m/s"])
def test_a_velocity_is_told_what_makes_it_one(tmp_path, unit):
    path = write_experiment(tmp_path, f"time_s,current_A,y [{unit}]")
    result = run("run", path, "--out", str(tmp_path / "out"))
    assert result.exit_code == 1
    assert "simulation.output: velocity" in result.stderr
