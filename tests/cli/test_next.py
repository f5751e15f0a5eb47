import csv
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.signal import lfilter

from hwid_cli.cli.main import main
from hwid_cli.drive.simulation import simulate_drive
from hwid_cli.records.recordings import Recording
from tests.diagnosis.small_drive import DRIVE
from tests.stages.test_diagnose import slow_ramps

N, STEP_S = 400, 0.01
LIMITS = "next: {limits: {amplitude: 2.0, rate: 100, duration_s: 4.0}}\n"
RANGE = LIMITS.replace("next: {", "next: {output_range: [-0.3, 0.9], number: 20, ")
HEAD = (
    "name: bench\n"
    "recordings:\n"
    "  files: raw/*.csv\n"
    "  columns: {time: t, input: u, output: y}\n"
    "orders: {nb: [1, 2, 3], nk: [1, 2, 3]}\n"
    "fit: {input_map: none, output_map: none}\n"
)


def measure(folder, name, u, gain=1.0):
    """What a drive of the first order would answer, with noise of its own."""
    rng = np.random.default_rng(list(name.encode()))
    y = lfilter([0.0, 0.2 * gain], [1.0, -0.8], u) + 0.01 * rng.standard_normal(u.size)
    folder.mkdir(exist_ok=True)
    rows = np.column_stack([STEP_S * np.arange(u.size), u, y])
    head = {"header": "t,u,y", "comments": ""}
    np.savetxt(folder / f"{name}.csv", rows, delimiter=",", **head)


@pytest.fixture
def bench(tmp_path):
    u = np.zeros(N)
    u[N // 20 :] = 0.5
    measure(tmp_path / "raw", "small_step", u)
    return tmp_path


def run(bench, text, *more):
    config = bench / "bench.yaml"
    config.write_text(HEAD + text)
    asked = ["next", str(config), "--out", str(bench / "out"), "--jobs", "1", *more]
    return CliRunner().invoke(main, asked)


def proposals(bench):
    with (bench / "out" / "next.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def played(bench, row):
    return np.loadtxt(bench / "out" / row["file"], delimiter=",", skiprows=1)


def test_proposed_inputs_are_ready_to_play_and_say_why(bench):
    result = run(bench, LIMITS)

    assert result.exit_code == 0, result.output
    rows = proposals(bench)
    assert [row["rank"] for row in rows] == ["1", "2", "3"]
    assert float(rows[0]["gain"]) >= float(rows[1]["gain"])
    assert "more of the amplitudes and frequencies" in rows[0]["reason"]
    time, values = played(bench, rows[0]).T
    assert np.allclose(np.diff(time), STEP_S)
    assert np.abs(values).max() <= 2.0
    content = json.loads((bench / "out" / "next.json").read_text())
    assert content["goal"] == "coverage"
    assert content["proposals"][0]["name"] == rows[0]["name"]
    assert not content["is_enough"]


def test_a_sign_that_no_recording_has_had_is_asked_about(bench):
    both = run(bench, LIMITS)
    assert "no recording has a negative input" in flat(both.stderr)
    assert min(played(bench, row)[:, 1].min() for row in proposals(bench)) < -0.5

    one = run(bench, LIMITS.replace("amplitude", "one_sided: true, amplitude"))
    assert "no recording has" not in one.stderr
    assert min(played(bench, row)[:, 1].min() for row in proposals(bench)) >= 0.0
    assert max(played(bench, row)[:, 1].max() for row in proposals(bench)) > 1.5


def test_a_machine_that_works_around_a_level_is_asked_about_it(tmp_path):
    """A valve of 4 to 20 mA: 0 mA is a broken wire."""
    u = np.full(N, 12.0)
    u[N // 20 :] = 15.0
    measure(tmp_path / "raw", "small_step", u)
    limits = LIMITS.replace("amplitude: 2.0", "amplitude: 7.0")
    plain = run(tmp_path, limits)
    assert "put level: 12 into next.limits" in flat(plain.stderr)

    around = run(tmp_path, limits.replace("amplitude", "level: 12, amplitude"))
    assert "into next.limits" not in around.stderr
    inputs = [played(tmp_path, row)[:, 1] for row in proposals(tmp_path)]
    assert all(one[0] == one[-1] == 12.0 for one in inputs)
    assert 5.0 <= min(one.min() for one in inputs) < 7.0
    assert 17.0 < max(one.max() for one in inputs) <= 19.0

    one = run(
        tmp_path, limits.replace("amplitude", "level: 12, one_sided: true, amplitude")
    )
    assert "into next.limits" not in one.stderr
    inputs = [played(tmp_path, row)[:, 1] for row in proposals(tmp_path)]
    assert min(one.min() for one in inputs) == 12.0

    # 20 for 12 mA.
    above = run(tmp_path, limits.replace("amplitude", "level: 20, amplitude"))
    said = "next.limits.level: found 20 A, where no recording was (12 to 15 A)"
    assert said in flat(above.stderr)


@pytest.mark.thorough
def test_the_loop_takes_up_what_was_recorded_and_ends(bench):
    said = run(bench, LIMITS.replace("next: {", "next: {enough: 0.1, "))
    known = [json.loads((bench / "out" / "next.json").read_text())["known"]]
    for _ in range(8):
        rows = proposals(bench)
        if not rows:
            break
        for row in rows:
            measure(bench / "raw", row["name"], played(bench, row)[:, 1])
        said = run(bench, LIMITS.replace("next: {", "next: {enough: 0.1, "))
        assert said.exit_code == 0, said.output
        assert "New since the last proposal: " in flat(said.output)
        assert all(f"{row['name']} (proposed)" in flat(said.output) for row in rows)
        known.append(json.loads((bench / "out" / "next.json").read_text())["known"])

    assert "nough is known" in flat(said.output)
    assert known == sorted(known)
    assert known[-1] > known[0]
    # The inputs of earlier proposals are gone.
    assert list((bench / "out" / "next").glob("*.csv")) == []


def flat(text):
    return " ".join(text.split())


ONE_STEP = "name,kind,amplitude,frequency_Hz,duration_s\nsmall_step,step,0.5,,4\n"


def test_inputs_without_a_repeat_are_enough_but_one_repeat_is_asked_for(bench):
    (bench / "plan.csv").write_text(ONE_STEP)
    said = run(bench, "next: {plan: plan.csv}\n")

    assert said.exit_code == 0, said.output
    assert "the inputs are enough" in flat(said.output)
    assert "whether repeats differ is not known" in flat(said.output)
    (row,) = proposals(bench)
    assert row["name"] == "small_step_repeat_2"
    content = json.loads((bench / "out" / "next.json").read_text())
    assert content["repeats"] is None
    assert not content["is_enough"]


@pytest.mark.parametrize(("change", "repeats"), [(0.0, 1), (0.3, 3)])
def test_repeats_are_asked_for_until_their_spread_is_known(bench, change, repeats):
    (bench / "plan.csv").write_text(ONE_STEP)
    rng, taken = np.random.default_rng(5), []
    said = run(bench, "next: {plan: plan.csv, number: 1}\n")
    while rows := proposals(bench):
        (row,) = rows
        gain = 1.0 + change * rng.standard_normal()
        measure(bench / "raw", row["name"], played(bench, row)[:, 1], gain)
        taken.append(row["name"])
        said = run(bench, "next: {plan: plan.csv, number: 1}\n")

    assert said.exit_code == 0, said.output
    # One drive that stays as it is; one whose gain is drawn anew for each recording.
    assert taken == [f"small_step_repeat_{2 + k}" for k in range(repeats)]
    assert "nough is known: the best input" in flat(said.output)
    known = json.loads((bench / "out" / "next.json").read_text())["repeats"]
    assert known["n_repeats"] == repeats
    assert (known["spread"] > 2.0 * known["noise"]) == (change > 0.0)


def test_a_repeat_has_the_name_that_the_plan_has_for_it(bench):
    plan = ONE_STEP + "again,step,0.5,,4\n"
    (bench / "plan.csv").write_text(plan)
    said = run(bench, "next: {plan: plan.csv}\n")

    assert said.exit_code == 0, said.output
    (row,) = proposals(bench)
    assert row["name"] == "again"
    assert "is a repeat of small_step" in row["reason"]


def test_an_unchanged_folder_answers_from_the_results(bench):
    run(bench, LIMITS)
    before = (bench / "out" / "next.csv").read_bytes()

    again = run(bench, LIMITS)

    assert "unchanged since the last run" in again.output
    assert (bench / "out" / "next.csv").read_bytes() == before


def test_check_counts_what_is_on_offer_and_refuses_a_bad_plan(bench):
    config = bench / "bench.yaml"
    config.write_text(HEAD + "next: {plan: plan.csv}\n")
    asked = ["check", str(config), "--out", str(bench / "out"), "--no-timing"]
    head = "name,kind,amplitude,frequency_Hz,duration_s\n"
    (bench / "plan.csv").write_text(f"{head}a,sine,1,2,4\nb,sine,1,5,4\n")

    said = CliRunner().invoke(main, asked)
    assert said.exit_code == 0, said.output
    assert "2 inputs on offer, for coverage" in said.output
    (bench / "plan.csv").write_text(f"{head}a,saw,1,2,4\n")
    refused = CliRunner().invoke(main, asked)

    assert refused.exit_code == 1
    assert "plan.csv, row 2: kind: found 'saw'" in refused.stderr


def test_a_plan_is_chosen_from(bench):
    (bench / "plan.csv").write_text(
        "name,kind,amplitude,frequency_Hz,duration_s\n"
        "same,step,0.5,,4\n"
        "small_step,step,2,,4\n"
        "fast,sine,2,10,4\n"
    )
    result = run(bench, "next: {plan: plan.csv, number: 1}\n")

    assert result.exit_code == 0, result.output
    # One of the plan was recorded already; one tells what is known.
    assert [row["name"] for row in proposals(bench)] == ["fast"]


@pytest.mark.thorough
def test_parameters_ask_for_a_recording_that_excites_them(bench):
    (bench / "plan.csv").write_text(
        "name,kind,amplitude,frequency_Hz,duration_s\n"
        "tiny,step,0.01,,4\n"
        "rich,sine,1,3,4\n"
    )
    result = run(bench, "identify:\nnext: {plan: plan.csv, goal: parameters}\n")

    assert result.exit_code == 0, result.output
    assert [row["name"] for row in proposals(bench)] == ["rich"]
    assert "standard errors" in proposals(bench)[0]["reason"]


@pytest.mark.thorough
def test_what_other_recordings_tell_of_parameters_counts(bench):
    (bench / "plan.csv").write_text(
        "name,kind,amplitude,frequency_Hz,duration_s\none,sine,1,3,4\ntwo,sine,1,3,4\n"
    )
    asked = "identify:\nnext: {plan: plan.csv, goal: parameters, number: 1}\n"
    assert run(bench, asked).exit_code == 0
    (first,) = proposals(bench)
    before = json.loads((bench / "out" / "next.json").read_text())["known"]
    measure(bench / "raw", first["name"], played(bench, first)[:, 1])

    said = run(bench, asked)

    assert said.exit_code == 0, said.output
    (second,) = proposals(bench)
    now = json.loads((bench / "out" / "next.json").read_text())["known"]
    assert now < before
    # The second of two equal sines tells less than the first.
    assert float(second["gain"]) < float(first["gain"])
    assert f"{first['name']} (proposed)" in flat(said.output)


def test_what_changed_counts_what_is_there_now(bench):
    run(bench, LIMITS)
    row = proposals(bench)[0]
    measure(bench / "raw", row["name"], played(bench, row)[:, 1])
    said = flat(run(bench, LIMITS).output)
    assert f"New since the last proposal: {row['name']} (proposed)" in said
    (bench / "raw" / f"{row['name']}.csv").unlink()

    again = run(bench, LIMITS)

    assert "New since the last proposal" not in flat(again.output)


def test_what_another_goal_has_proposed_stays_to_be_played(bench):
    by_goal = {}
    for goal in ("coverage", "parameters", "coverage"):
        run(bench, f"identify:\n{LIMITS.replace('next: {', f'next: {{goal: {goal}, ')}")
        by_goal[goal] = {one["file"] for one in proposals(bench)}
        found = {f"next/{one.name}" for one in (bench / "out" / "next").glob("*.csv")}
        assert found == set().union(*by_goal.values())
    assert by_goal["coverage"] != by_goal["parameters"]


def test_another_input_under_a_planned_name_is_said(bench):
    run(bench, LIMITS)
    row = proposals(bench)[0]
    measure(bench / "raw", row["name"], 0.5 * (np.arange(N) > N // 20))

    said = run(bench, LIMITS)

    name = row["name"]
    assert f"{name}: its input is not what was to be played" in flat(said.stderr)
    # What was to be played stays on offer, under another name, until that is recorded.
    (again,) = [one for one in proposals(bench) if one["name"].startswith(f"{name}_")]
    assert again["input"] == row["input"]
    measure(bench / "raw", again["name"], played(bench, again)[:, 1])
    run(bench, LIMITS)
    assert again["name"] not in [one["name"] for one in proposals(bench)]


def test_inputs_of_other_limits_do_not_count_as_recorded(bench):
    measure(bench / "raw", "step_100", 0.5 * (np.arange(N) > N // 20))
    (bench / "plan.csv").write_text(
        "name,kind,amplitude,duration_s\nstep_100,step,2,4\n"
    )

    said = run(bench, "next: {plan: plan.csv}\n")

    assert "enough is known" not in flat(said.output)
    assert [one["name"] for one in proposals(bench)] == ["step_100_2"]


def test_inputs_far_beyond_what_was_recorded_are_questioned(bench):
    (bench / "plan.csv").write_text("name,kind,amplitude,duration_s\nbig,step,500,4\n")

    said = run(bench, "next: {plan: plan.csv}\n")

    assert "big reaches 500 A, recordings 0.5 A" in flat(said.stderr)


def test_limits_far_beyond_what_was_recorded_are_questioned(bench):
    said = run(
        bench, "next: {limits: {amplitude: 500.0, rate: 1.0e+5, duration_s: 4}}\n"
    )

    assert "inputs on offer are far larger than all recorded ones" in flat(said.stderr)


def test_a_duration_in_milliseconds_is_refused_at_once(bench):
    said = run(bench, "next: {limits: {amplitude: 4, rate: 400, duration_s: 100000}}\n")

    assert said.exit_code == 1
    assert "next.limits.duration_s: found 100000 s" in flat(said.stderr)
    assert "give it in seconds" in flat(said.stderr)


def test_a_range_in_another_unit_is_questioned(bench):
    asked = LIMITS.replace("next: {", "next: {output_range: [-50000, 50000], ")
    assert "hardly leaves anything out" in flat(
        run(bench, f"identify:\n{asked}").stderr
    )


@pytest.mark.parametrize(
    ("allowed", "least", "most"),
    # Of the whole catalogue, effects that hide are looked for longer.
    [("[actuator_lag, input_delay]", 0, 3), ("all", 5, 60)],
)
def test_check_foresees_how_long_a_diagnosis_lets_a_choice_take(
    bench, allowed, least, most
):
    # What is not compiled yet is not timed.
    simulate_drive(np.ones(10), DRIVE, sample_time_s=1e-3)
    config = bench / "bench.yaml"
    text = DIAGNOSIS.replace("[actuator_lag, input_delay]", allowed)
    config.write_text(text.replace("duration_s: 0.4", "duration_s: 4"))
    asked = ["check", str(config), "--out", str(bench / "out")]
    said = CliRunner().invoke(main, asked)
    assert said.exit_code == 0, said.output
    (row,) = re.findall(
        r"next +\d+ inputs on offer, for diagnosis +- +(.*)", said.output
    )
    assert least <= float(re.findall(r"[\d.]+", row)[-1]) <= most, row


DIAGNOSIS = """name: bench
recordings:
  files: raw/*.csv
  columns: {time: t, input: u, output: y}
simulation: {kind: drive, mass_kg: 0.3, damping_N_s_per_m: 15.0,
  stiffness_N_per_m: 1184.0, force_constant_N_per_A: 5.0}
diagnose: {effects: [actuator_lag, input_delay], max_effects: 1}
next: {goal: diagnosis, number: 1,
  limits: {amplitude: 4.0, rate: 2000, duration_s: 0.4}}
"""


def write_recording(folder, one):
    folder.mkdir(exist_ok=True)
    time = one.sample_time_s * np.arange(one.n_samples)
    rows = np.column_stack([time, one.input, one.output])
    head = {"header": "t,u,y", "comments": ""}
    np.savetxt(folder / f"{one.name}.csv", rows, delimiter=",", **head)


@pytest.mark.thorough
def test_a_proposed_recording_tells_two_candidates_apart(tmp_path):
    noise = 4e-4
    for one in slow_ramps(noise):
        write_recording(tmp_path / "raw", one)
    config = tmp_path / "bench.yaml"
    config.write_text(DIAGNOSIS)
    asked = ["next", str(config), "--out", str(tmp_path / "out"), "--jobs", "1"]

    first = CliRunner().invoke(main, asked)
    assert first.exit_code == 0, first.output
    (row,) = proposals(tmp_path)
    assert "times the noise" in row["reason"]
    assert float(row["gain"]) > 0.1
    u = played(tmp_path, row)[:, 1]
    lagging = replace(DRIVE, effects={"actuator_lag": {"time_constant_s": 0.002}})
    y = simulate_drive(u, lagging, sample_time_s=1e-3).output
    y = y + noise * np.random.default_rng(9).standard_normal(u.size)
    write_recording(tmp_path / "raw", Recording(row["name"], u, y, 1e-3))
    second = CliRunner().invoke(main, asked)

    assert second.exit_code == 0, second.output
    assert f"new since the last proposal: {row['name']}" in flat(second.output).lower()
    diagnosis = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert (diagnosis["verdict"], diagnosis["effects"][0]["id"]) == (
        "named",
        "actuator_lag",
    )
    assert "nough is known: the diagnosis says 'named'" in flat(second.output)


def answered(name, current, effects=None):
    """What a drive answers, with noise of its own."""
    rng = np.random.default_rng(list(name.encode()))
    drive = replace(DRIVE, effects=effects or {})
    read = simulate_drive(current, drive, sample_time_s=1e-3).output
    return Recording(
        name, current, read + 2e-5 * rng.standard_normal(current.size), 1e-3
    )


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("is_settled", "cut_at"),
    # Cut in mid-motion: a start that the diagnosis finds, and a further input has none of.
    [(False, 0), (True, 0), (True, 55)],
)
def test_the_candidates_of_a_diagnosis_foresee_the_travel(tmp_path, is_settled, cut_at):
    time = 1e-3 * np.arange(400)
    bump = np.interp(time, [0.04, 0.05, 0.24, 0.25], [0, 1, 1, 0])
    steps = [answered(f"step_{k}", 0.5 * k * bump) for k in (1, 2, 3)]
    steps[2] = replace(
        steps[2], input=steps[2].input[cut_at:], output=steps[2].output[cut_at:]
    )
    for one in steps if is_settled else slow_ramps(4e-4):
        write_recording(tmp_path / "raw", one)
    config = tmp_path / "bench.yaml"
    # 4 A move it by 17 mm, beyond which it swings by a quarter.
    text = DIAGNOSIS.replace("number: 1", "number: 20, output_range: [-0.012, 0.013]")
    if is_settled:
        text = text.replace("actuator_lag, input_delay", "one_sided_stop")
    config.write_text(text)
    asked = ["next", str(config), "--out", str(tmp_path / "out"), "--jobs", "1"]

    said = CliRunner().invoke(main, asked)

    assert said.exit_code == 0, said.output
    words = flat(said.output)
    assert "left out: the output is foreseen to leave -0.012 to 0.013 m" in words
    rows, reached = proposals(tmp_path), []
    for row in rows:
        u = played(tmp_path, row)[:, 1]
        reached.append(simulate_drive(u, DRIVE, sample_time_s=1e-3).output)
        told = row["reason"].rsplit("foreseen to go from ", 1)[1].split()
        assert float(told[0]) == pytest.approx(reached[-1].min(), abs=1e-3)
        assert float(told[2]) == pytest.approx(reached[-1].max(), abs=1e-3)
    assert min(one.min() for one in reached) > -0.0125
    # What the smaller inputs reach is used.
    assert 0.004 < max(one.max() for one in reached) < 0.0135


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("effects", "said"),
    [
        ({}, "nough is known: the diagnosis says 'none', and no input on offer would"),
        pytest.param(
            {"one_sided_stop": {"position_m": -0.008, "stiffness_N_per_m": 5000.0}},
            "nough is known: the diagnosis says 'named', and no input on offer would",
        ),
    ],
)  # fmt: skip
def test_an_effect_that_hides_is_looked_for_where_no_recording_was(
    tmp_path, effects, said
):
    time = 1e-3 * np.arange(400)
    for number, size in enumerate((1.0, 2.0, 3.0, 4.0)):
        current = size * np.interp(time, [0.04, 0.05, 0.24, 0.25], [0, 1, 1, 0])
        one = answered(f"step_{number}", current, effects)
        write_recording(tmp_path / "raw", one)
    config = tmp_path / "bench.yaml"
    config.write_text(DIAGNOSIS.replace("actuator_lag, input_delay", "one_sided_stop"))
    asked = ["next", str(config), "--out", str(tmp_path / "out"), "--jobs", "1"]

    first = CliRunner().invoke(main, asked)
    assert first.exit_code == 0, first.output
    assert "may hide behind the recordings (one_sided_stop)" in flat(first.output)
    (row,) = proposals(tmp_path)
    assert "would show one_sided_stop" in row["reason"]
    u = played(tmp_path, row)[:, 1]
    assert u.min() < -2.0
    write_recording(tmp_path / "raw", answered(row["name"], u, effects))
    second = CliRunner().invoke(main, asked)

    assert second.exit_code == 0, second.output
    assert said in flat(second.output)
    assert "1 before, 0 now" in flat(second.output)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "next: the section is missing; expected what could be recorded"),
        ("next:\n", "next.plan: missing; expected either plan"),
        ("next: {plan: p.csv, limits: {amplitude: 1, rate: 1, duration_s: 1}}\n",
         "next.plan: found 'p.csv'; expected either plan"),
        ("next: {plan: p.csv, goal: parameters}\n",
         "next.goal: found 'parameters'; expected coverage, or a section identify:"),
        ("next: {plan: p.csv, goal: diagnosis}\n",
         "next.goal: found 'diagnosis'; expected coverage, or a section simulation:"),
        ("next: {plan: p.csv, goal: speed}\n", "next.goal: found 'speed'"),
        (RANGE, "expected a model that foresees the output of an input; add identify:"),
        ("identify: {}\n" + RANGE.replace("-0.3, 0.9", "0.9, -0.3"),
         "next.output_range: found [0.9, -0.3]; expected two numbers, the lower one first"),
        ("next: {limits: {amplitude: 6, rate: 1, duration_s: 0.1}}\n",
         "next.limits: found amplitude 6 A, rate 1 A/s and 0.1 s"),
        ("next: {limits: {amplitude: -6, rate: 1, duration_s: 1}}\n",
         "next.limits.amplitude: found -6"),
    ],
)  # fmt: skip
def test_what_cannot_be_proposed_is_one_line(bench, text, said):
    result = run(bench, text, "-q")

    assert result.exit_code == 1
    assert said in result.stderr
    assert result.stderr.count("\n") == 1


def answer(values, gain=1.0):
    """What the drive of `measure` does without noise."""
    return lfilter([0.0, 0.2 * gain], [1.0, -0.8], values)


def test_inputs_whose_output_leaves_its_range_are_left_out(bench):
    said = run(bench, "identify: {}\n" + LIMITS.replace("{", "{number: 20, ", 1))
    assert said.exit_code == 0, said.output
    free = {row["name"]: answer(played(bench, row)[:, 1]) for row in proposals(bench)}

    said = run(bench, "identify: {}\n" + RANGE)

    assert said.exit_code == 0, said.output
    kept = {row["name"]: answer(played(bench, row)[:, 1]) for row in proposals(bench)}
    assert kept
    # The model is as good as noise of 0.01 lets it be.
    assert all(one.min() > -0.32 and one.max() < 0.92 for one in kept.values())
    assert any(one.min() < -0.5 or one.max() > 1.1 for one in free.values())
    assert "left out: the output is foreseen to leave -0.3 to 0.9" in flat(said.output)
    for row in proposals(bench):
        low, high = kept[row["name"]].min(), kept[row["name"]].max()
        told = row["reason"].rsplit("foreseen to go from ", 1)[1].split()
        assert float(told[0]) == pytest.approx(low, abs=0.03)
        assert float(told[2].rstrip(".")) == pytest.approx(high, abs=0.03)


def test_a_range_that_every_input_leaves_is_one_line(bench):
    said = run(bench, "identify: {}\n" + RANGE.replace("-0.3, 0.9", "-0.001, 0.001"))
    assert said.exit_code == 1
    assert "next.output_range: found -0.001 to 0.001" in flat(said.output)
    assert "every one of" in flat(said.output)


def test_under_a_controller_no_input_decides_the_output(bench):
    text = DIAGNOSIS.replace("number: 1", "output_range: [-1, 1]")
    text = text.replace("5.0}", "5.0, controller: {proportional_gain: 100}}")
    text = text.replace("output: y}", "output: y, reference: r}")
    (bench / "bench.yaml").write_text(text)
    said = CliRunner().invoke(main, ["next", str(bench / "bench.yaml")])
    assert said.exit_code == 1
    assert (
        "next.output_range: found [-1.0, 1.0]; expected a drive without" in said.output
    )


@pytest.mark.parametrize(
    "text",
    [
        "identify: {}\n" + RANGE,
        "identify: {}\n" + LIMITS.replace("{", "{goal: parameters, ", 1),
        DIAGNOSIS.replace("duration_s: 0.4", "duration_s: 4"),
    ],
)
def test_check_foresees_every_goal(bench, text):
    config = bench / "bench.yaml"
    config.write_text(text if text.startswith("name") else HEAD + text)
    asked = ["check", str(config), "--out", str(bench / "out"), "--no-timing"]
    said = CliRunner().invoke(main, asked)
    assert said.exit_code == 0, said.output
    assert re.search(r"next +\d+ inputs on offer", said.output)
