from hwid_cli.config.problems import config_problems

GOOD = """
name: a
recordings: {files: "*.csv", columns: {input: u, output: y}, sample_time_s: 1}
identify:
"""


def test_a_sound_file_has_no_problem(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(GOOD)
    problems, experiment = config_problems(path)

    assert problems == ()
    assert experiment.name == "a"


def test_the_rest_is_given_where_the_data_can_still_be_read(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(
        GOOD + "crossval: {treshold: 1}\ntest: {}\ngroup: {keep: {tpo: 1}}\n"
    )
    problems, experiment = config_problems(path)

    places = [problem.split(": ")[1] for problem in problems]
    assert sorted(places) == ["crossval.treshold", "group.keep", "test.recordings"]
    assert experiment.recordings.columns.input == "u"


def test_the_rest_is_not_given_where_reading_is_at_fault(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(GOOD.replace("input: u", "inptu: u"))
    problems, experiment = config_problems(path)

    assert "did you mean 'input'" in problems[0]
    assert experiment is None


def test_what_is_no_yaml_is_one_problem(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text("name: [")
    problems, experiment = config_problems(path)

    assert len(problems) == 1
    assert experiment is None


def test_what_only_follows_from_a_problem_is_not_told(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(
        GOOD
        + "orders: {nb: 2, nk: 2}\nfit:\n  linear_block: {numerator: [1, 2], "
        + "denominator: [2, -1, 0.1]}\n  input_map: {file: none.py, name: f}\n"
        + "crossval: {treshold: 1}\n"
    )
    problems, experiment = config_problems(path)

    places = [problem.split(": ")[1] for problem in problems]
    assert sorted(places) == [
        "crossval.treshold",
        "fit.input_map.file",
        "fit.linear_block.denominator",
    ]
    assert experiment.fit.linear_block is None


def test_all_faults_are_told_at_once(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(
        GOOD
        + "fit: {units: ten, starts: 0, join: no, bla: 1}\n"
        + "group: {keep: {top: 0}, max_level: 0}\n"
        + "simulation: {mass_kg: 0, inductance_H: 1}\n"
        + "diagnose: {effects: [cogging, coging], hold_out: []}\n"
    )
    problems, _ = config_problems(path)

    assert [problem.split(": ")[1] for problem in problems] == [
        "fit.bla",
        "fit.units",
        "fit.join",
        "fit.starts",
        "group.max_level",
        "simulation.mass_kg",
        "diagnose.hold_out",
        "group.keep.top",
        "simulation.inductance_H",
        "diagnose.effects",
    ]
    assert all(problem.startswith(f"{path}: ") for problem in problems)


def test_what_compares_with_a_faulty_key_is_not_told(tmp_path):
    path = tmp_path / "a.yaml"
    # With the default in place of the misspelt word, nf would be one too many.
    path.write_text(GOOD + "orders: {nk_role: dely, nf: 2}\n")
    problems, _ = config_problems(path)

    assert len(problems) == 1
    assert "orders.nk_role: found 'dely'; did you mean 'delay'?" in problems[0]


def test_faults_are_found_whatever_the_messages_say(tmp_path, monkeypatch):
    from hwid_cli.config import faults

    path = tmp_path / "a.yaml"
    path.write_text(GOOD + "test:\nfit: {units: 1, linear_block: {numerator: [1]}}\n")
    before, rest = config_problems(path)
    monkeypatch.setattr(faults.Fault, "message", lambda self, file: "wrong")
    after, same = config_problems(path)

    assert len(before) == 3
    assert after == ("wrong",) * 3
    assert same == rest


def test_an_anchor_is_at_fault_in_one_of_its_places_only(tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(
        GOOD.replace("identify:", "identify: &names {recordings: [a], threshold: 1}")
        + "crossval: *names\n"
    )
    problems, experiment = config_problems(path)

    assert len(problems) == 1
    assert "identify.threshold: unknown key; did you mean 'crossval.thr" in problems[0]
    assert experiment.crossval.threshold == 1.0
