from dataclasses import replace

import numpy as np

from hwid_cli.records.model import (
    Fit,
    FitOptions,
    HammersteinWiener,
    Information,
    Orders,
    StaticMap,
)
from hwid_cli.report.fits import best_models_table, fits_ended
from hwid_cli.report.table import as_text

NONE = StaticMap("none", np.zeros(0))
MODEL = HammersteinWiener(NONE, np.ones(1), np.array([1.0, -0.5]), 1, NONE, 1e-3)


def assert_fits_the_screen(text):
    assert max(map(len, text.splitlines())) <= 80


def best_text(best, *, nk_is_delay=False):
    table = best_models_table(best, "m", nk_is_delay=nk_is_delay)
    return as_text([table], thesis_names=True)


def ended(counts, fits=()):
    return [one.text for one in fits_ended(counts, fits)]


def test_the_best_models_carry_both_names_and_the_linear_rmsd():
    fit = Fit(
        ("step_06",),
        Orders(3, 7, 1),
        FitOptions(),
        MODEL,
        "converged",
        "",
        rmsd=1.06e-4,
        fit_percent=99.125,
        linear_rmsd=float("nan"),
        information=Information(7500, 41, bic=-12345.6),
    )
    text = best_text([(fit,)])

    last = text.splitlines()[-1].split()
    assert last == [
        "step_06/3/7", "NLHW-Step-6-3-7-1", "1.06e-04", "99.12", "-", "41", "-12346",
    ]  # fmt: skip
    assert_fits_the_screen(text)


def test_output_maps_that_are_not_monotonic_are_named_below_the_best_models():
    fit = Fit(("step_06",), Orders(3, 7, 1), FitOptions(), MODEL, "converged", "")
    folded = replace(fit, output_folds=(0.25, 1.5, 3.0))

    assert "monotonic" not in best_text([(fit,)])
    text = best_text([(fit, folded), (folded,) * 4])
    note = " ".join(text[text.index("Output maps") :].split())
    assert note.startswith(
        "Output maps that are not monotonic, so that two positions give one output: "
        "step_06/3/7 (x = 0.25, 1.5, ... A); step_06/3/7"
    )
    assert note.endswith("1 more")
    assert_fits_the_screen(text)


def test_in_the_delay_reading_the_place_in_the_grid_is_the_delay():
    fit = Fit(("step_06",), Orders(3, 2, 7), FitOptions(), MODEL, "converged", "")
    last = best_text([(fit,)], nk_is_delay=True).splitlines()[-1]

    assert last.split()[:2] == ["step_06/3/7", "NLHW-Step-6-3-2-7"]


def test_the_status_line_counts_in_words():
    assert ended({"iteration_limit": 3}) == ["Fits: 3 stopped at the iteration limit"]
    assert ended({}) == ["Fits: none"]


def test_failed_fits_say_why_each_reason_once():
    failed = Fit(("a",), Orders(1, 1, 1), FitOptions(), None, "failed", "too short")
    other = replace(failed, message="the input is constant at 3")
    done = Fit(("a",), Orders(1, 1, 1), FitOptions(), MODEL, "converged", "")

    assert ended({}, [failed, done, other, failed])[1:] == [
        "Failed, 2 fits: too short",
        "Failed, 1 fit: the input is constant at 3",
    ]
    assert ended({}, [done])[1:] == []
    many = [replace(failed, message=str(number)) for number in range(5)]
    assert ended({}, many)[-1].startswith("More reasons: results.h5")
    assert best_text([]) == "No fit gave a model."


def test_a_robust_loss_is_told_beside_the_numbers_that_it_does_not_change():
    fit = Fit(("a",), Orders(1, 1, 1), FitOptions(loss="huber"), MODEL, "converged", "")
    assert "Huber's loss" in best_text([(fit,)])
    plain = replace(fit, options=FitOptions())
    assert "Huber" not in best_text([(plain,)])
