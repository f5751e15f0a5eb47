from hwid_cli.report.progress import StageProgress


def test_without_a_terminal_nothing_is_shown_and_counts_are_kept(capsys):
    with StageProgress("identify", 3, "fits", is_silent=False) as progress:
        progress.advance(from_cache=True)
        progress.advance(from_cache=False)
        progress.advance(from_cache=False)

    assert (progress.from_cache, progress.computed) == (1, 2)
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", "")


def test_another_round_goes_on_counting(capsys):
    with StageProgress("diagnose", 0, "tasks", is_silent=False) as progress:
        progress.begin_round("diagnose: base", 2)
        progress.advance(from_cache=False)
        progress.advance(from_cache=True)
        progress.begin_round("diagnose: candidates", 1)
        progress.advance(from_cache=False)

    assert (progress.from_cache, progress.computed) == (1, 2)
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", "")


def test_a_round_has_its_own_name_and_total():
    progress = StageProgress("diagnose", 0, "tasks", is_silent=True)
    progress.advance(from_cache=False)
    progress.begin_round("diagnose: candidates", 3)
    progress.advance(from_cache=False)

    (task,) = progress._bar.tasks
    assert (task.description, task.total, task.completed) == (
        "diagnose: candidates",
        3,
        1,
    )
    # The rate is that of the round.
    assert task.fields["computed"] == 1


def test_what_has_passed_and_what_is_left_each_have_their_word():
    progress = StageProgress("identify", 10, "fits", is_silent=True)
    (task,) = progress._bar.tasks
    now = [100.0]
    progress._bar.get_time = lambda: now[0]
    task._get_time = lambda: now[0]
    task.start_time = 100.0
    for _ in range(5):
        now[0] += 8.0
        progress.advance(from_cache=False)

    column = progress._bar.columns[-1]
    assert str(column.render(task)) == "40 s passed, 40 s left"


def test_what_is_under_way_is_told_in_words():
    progress = StageProgress("stage 2 of 2 diagnose", 0, "tasks", is_silent=True)
    assert progress.text == "stage 2 of 2 diagnose"
    progress.begin_round("stage 2 of 2 diagnose: pairs", 9)
    progress.advance(from_cache=False)
    assert progress.text == "stage 2 of 2 diagnose: pairs: 1 of 9 tasks"
