import io

import pytest
from rich.console import Console

from hwid_cli.report import progress as progress_module
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


@pytest.mark.parametrize("width", [80, 140])
def test_a_long_text_leaves_room_for_the_counts(monkeypatch, width):
    screen = io.StringIO()
    # A bar is drawn on a terminal that can move its cursor; a server's often cannot.
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(
        progress_module,
        "Console",
        lambda **_: Console(file=screen, width=width, force_terminal=True),
    )
    text = "stage 2 of 2 diagnose: sets of 2 effects (so far coulomb_friction, 8.4 times the noise)"
    with StageProgress("", 9, "tasks", is_silent=False) as progress:
        progress.begin_round(text, 9)
        progress.advance(from_cache=False)
        progress._bar.refresh()
    shown = screen.getvalue()
    assert "1/9" in shown
    assert ("8.4 times the noise" in shown) == (width == 140)
    # What is cut there is whole where lines are written.
    assert progress.text.startswith(text)
