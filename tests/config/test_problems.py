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
