from hwid_cli.report.progress import StageProgress


def test_without_a_terminal_nothing_is_shown_and_counts_are_kept(capsys):
    with StageProgress("identify", 3, "fits", is_silent=False) as progress:
        progress.advance(from_cache=True)
        progress.advance(from_cache=False)
        progress.advance(from_cache=False)

    assert (progress.from_cache, progress.computed) == (1, 2)
    captured = capsys.readouterr()
    assert (captured.out, captured.err) == ("", "")
