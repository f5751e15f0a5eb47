"""A wrong score is seen, and what judges a model has no part in it."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.records.recordings import Recording
from hwid_cli.stages import crossval
from tests.diagnosis import small_drive
from tests.numerics.plants import GRID, identified, measured, validated
from tests.stages.diagnosed_drive import FRICTION, diagnosed, parameters

NAMES = ("a", "b", "c")


@pytest.fixture(scope="module")
def data():
    return [measured(name, seed) for seed, name in enumerate(NAMES)]


@pytest.fixture(scope="module")
def fits(data):
    return identified(data)


def along(xs, ys, values):
    """Straight lines from point to point, the outer ones going on."""
    slopes = np.diff(ys) / np.diff(xs)
    place = np.clip(np.searchsorted(xs, values) - 1, 0, slopes.size - 1)
    return ys[place] + slopes[place] * (values - xs[place])


def output_by_hand(model, current):
    """Free-run output from the numbers of a model, without the package's code."""

    def through(table, values):
        law = np.split(table.parameters, 2)
        lines = table.extrapolation
        beyond = (lines.arguments, lines.values)
        inside = np.any(
            [(values >= low) & (values <= high) for low, high in lines.stretches],
            axis=0,
        )
        return np.where(inside, *(along(*one, values) for one in (law, beyond)))

    numerator = np.r_[np.zeros(model.delay), model.numerator]
    inner = lfilter(numerator, model.denominator, through(model.input_map, current))
    return through(model.output_map, inner)


def scores_by_hand(fits, recordings):
    models = [one.model for one in fits]
    scores = [
        np.sqrt(np.mean((one.output - output_by_hand(model, one.input)) ** 2))
        for model in models
        for one in recordings
    ]
    return np.reshape(scores, (len(NAMES), 1, len(GRID.nk), len(recordings)))


def is_honest(tensor, fits, recordings):
    """Whether every score is what its model and its recording say; to rounding."""
    return np.allclose(tensor.rmsd, scores_by_hand(fits, recordings), rtol=1e-9, atol=0)


def test_every_score_is_the_closed_form_from_the_models_numbers(fits, data):
    assert is_honest(validated(fits, data), fits, data)


@pytest.mark.parametrize("bias", [1e-3, -1e-6, 1e-8])
def test_a_bias_in_the_scoring_is_seen(fits, data, bias, monkeypatch):
    true = crossval.rmsd

    monkeypatch.setattr(
        crossval, "rmsd", lambda measured, simulated: true(measured, simulated + bias)
    )

    assert not is_honest(validated(fits, data), fits, data)


@pytest.mark.parametrize("bias", [1e-3, -2e-5])
def test_an_offset_of_the_model_shows_with_its_closed_form(fits, data, bias):
    model = fits[0].model
    xs, ys = np.split(model.output_map.parameters, 2)
    lines = model.output_map.extrapolation
    table = replace(
        model.output_map,
        parameters=np.r_[xs, ys + bias],
        extrapolation=replace(lines, values=lines.values + bias),
    )
    biased = replace(fits[0], model=replace(model, output_map=table))
    found = validated([biased, *fits[1:]], data).rmsd[0, 0, 0]

    for one, value in zip(data, found, strict=True):
        error = output_by_hand(model, one.input) - one.output
        expected = np.sqrt(np.mean(error**2) + 2 * bias * np.mean(error) + bias**2)
        assert value == pytest.approx(expected, rel=1e-9)


def test_a_score_that_is_no_number_says_why(fits, data):
    wild = replace(fits[0].model, denominator=np.array([1.0, -50.0]))
    scores = validated([replace(fits[0], model=wild), *fits[1:]], data)

    assert np.isnan(scores.rmsd[0, 0, 0]).all()
    np.testing.assert_array_equal(np.isnan(scores.rmsd), scores.status != "ok")
    assert (scores.status[0, 0, 0] == "not finite").all()


@pytest.mark.thorough
def test_recordings_that_judge_change_no_model(fits, data):
    """Models of a and b where c is as it was, reversed, of noise, or gone."""
    noise = np.random.default_rng(9).standard_normal((2, 300))
    c = data[2]
    others = [
        [replace(c, input=c.input[::-1], output=c.output[::-1])],
        [Recording("c", *noise, 1e-3)],
        [],
    ]
    for judges in others:
        mixed = identified([*judges, *data[:2]])[-4:]
        for before, after in zip(fits[:4], mixed, strict=True):
            assert after.rmsd == before.rmsd
            for part in ("numerator", "denominator"):
                np.testing.assert_array_equal(
                    getattr(after.model, part), getattr(before.model, part)
                )


def test_the_order_of_those_who_judge_changes_no_score(fits, data):
    straight = validated(fits, data).rmsd
    turned = validated(fits, data[::-1]).rmsd

    np.testing.assert_array_equal(turned[..., ::-1], straight)


@pytest.mark.slow
def test_held_out_recordings_change_no_parameter_of_a_diagnosis():
    found = small_drive.recordings(FRICTION)
    names = tuple(one.name for one in found[-2:])
    rng = np.random.default_rng(4)
    other = [
        replace(one, output=one.output + 1e-5 * rng.standard_normal(one.n_samples))
        if one.name in names
        else one
        for one in found
    ]
    first = diagnosed(found, hold_out=names)
    second = diagnosed(other, hold_out=names)

    assert first.verdict == second.verdict == "named"
    assert second.after.held_out_rms != first.after.held_out_rms
    assert second.after.train_rms == first.after.train_rms
    assert parameters(second.effects[0]) == parameters(first.effects[0])
    assert [one.after for one in second.base] == [one.after for one in first.base]
