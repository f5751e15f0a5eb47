from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex

from hwid_cli.report.figures.diagnosis import diagnosis_figures
from hwid_cli.report.figures.diagnosis_bars import (
    ranking_figure,
    shortened,
    shown_candidates,
    where_figure,
)
from hwid_cli.report.figures.style import BLUE, GREY, ORANGE, as_png
from tests.report.diagnosis_examples import NAN, NOISE, named


def rows_of(axes):
    return [label.get_text() for label in axes.get_yticklabels()]


def legend_of(figure):
    return [text.get_text() for one in figure.legends for text in one.get_texts()]


def test_the_ranking_marks_the_chosen_candidate_and_its_rivals():
    found = named()
    figure = ranking_figure(found)
    errors, shares = figure.axes
    colours = [to_hex(one) for one in errors.collections[0].get_facecolors()]

    assert rows_of(errors)[:2] == ["coulomb_friction", "stribeck_friction"]
    assert colours[:3] == [one.lower() for one in (BLUE, ORANGE, GREY)]
    bold = [one for one in errors.get_yticklabels() if one.get_fontweight() == "bold"]
    assert [one.get_text() for one in bold] == ["coulomb_friction"]
    ratios = errors.collections[0].get_offsets()[:, 0]
    shown = shown_candidates(found)
    np.testing.assert_allclose(ratios, [one.held_out_rms / NOISE for one in shown])
    assert errors.get_xlabel() == "held-out RMS over noise [-]"
    assert shares.get_xlabel() == "share of the excess error explained [%]"
    assert [text.get_text() for text in shares.texts] == ["-40 %"]
    assert legend_of(figure) == ["chosen", "cannot be told from it", "others"]


def test_many_candidates_leave_room_for_the_chosen_and_the_base():
    found = named()
    chosen, *others = found.candidates[:-1]
    base = next(one for one in others if not one.effects)
    crowd = [replace(others[0], effects=(f"effect_{n}",)) for n in range(30)]
    shown = shown_candidates(replace(found, candidates=(*crowd, base, chosen)))

    assert len(shown) == 12
    assert shown[-2:] == (base, chosen)


def test_candidates_without_numbers_or_noise_are_drawn():
    found = named()
    blank = [
        replace(one, held_out_rms=NAN, explained_share=NAN) for one in found.candidates
    ]
    noise = replace(found.noise, rms=0.0)
    figure = ranking_figure(replace(found, candidates=tuple(blank), noise=noise))

    assert as_png(figure)
    assert figure.axes[0].get_xlabel() == "held-out RMS [m]"


def test_the_places_are_bars_with_their_shares():
    figure = where_figure(named(43))
    titles = [axes.get_title(loc="left") for axes in figure.axes]

    assert titles == [
        "what the missing force follows",
        "segments of the steps",
        "harmonics of the sines",
        "recordings",
    ]
    variable, segment, _, recordings = figure.axes
    assert rows_of(variable) == ["velocity", "direction", "current"]
    assert [text.get_text() for text in variable.texts] == ["55 %", "51 %", "5 %"]
    assert [bar.get_width() for bar in segment.patches] == pytest.approx(
        [40.0, 30.0, 20.0, 10.0]
    )
    assert len(recordings.patches) == 8
    assert variable.get_xlabel() == "share of the missing force's variance [%]"
    assert segment.get_xlabel() == "share of the excess error [%]"


def test_places_without_a_share_are_left_out():
    found = named()
    blank = tuple(replace(one, share=NAN) for one in found.places)

    assert "diagnosis_where" not in diagnosis_figures(replace(found, places=blank))


def test_the_middle_of_a_long_name_is_left_out():
    assert shortened("abcdefghijklmnopqrstuvwxyz", 12) == "abcdef...xyz"
    assert shortened("abcdefghijkl", 12) == "abcdefghijkl"
