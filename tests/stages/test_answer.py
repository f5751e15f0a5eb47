"""Which model the report takes, worked out a second time from the tables themselves."""

from dataclasses import replace

import numpy as np
import pytest

from hwid_cli import FitOptions, Orders, Recording, fit
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.answer import ChosenMaps
from hwid_cli.records.experiment import OrderOptions, OrdersOptions
from hwid_cli.records.order import OrderAdvice
from hwid_cli.records.report import StoredResults
from hwid_cli.stages.answer import model_answer
from hwid_cli.stages.model_views import named_fits
from hwid_cli.stages.order import recommend_orders
from hwid_cli.tasks.cache import MemoryStore
from hwid_cli.tasks.runner import RunSettings, run_tasks
from tests.report.report_examples import (
    calibrated,
    calibrated_only,
    everything,
    with_results,
)


def run_here(tasks):
    return run_tasks(tasks, RunSettings(MemoryStore()))


@pytest.fixture(scope="module")
def stored():
    return everything(6, levels=2)


def answer_of(stored):
    return model_answer(stored, stored.crossval, run_here)


def without(stored, *stages):
    return with_results(stored, **dict.fromkeys(stages))


def test_without_a_model_there_is_no_answer():
    assert answer_of(calibrated_only()) is None


def test_the_test_recordings_say_how_good_it_is_and_choose_nothing(stored):
    final = stored.final_test
    found = answer_of(stored)

    assert found.is_unused
    assert found.recordings == final.tested_on
    assert not set(found.chosen_on) & set(final.tested_on)
    # Whatever the test recordings say, the same model is taken.
    worse = final.rmsd.copy()
    worse[:, [final.recordings.index(name) for name in final.tested_on]] = 9.0
    again = answer_of(with_results(stored, test=replace(final, rmsd=worse)))
    assert again.name == found.name


def test_the_end_of_the_chain_is_taken_and_a_single_model_where_there_is_none(stored):
    final = stored.final_test
    assert answer_of(stored).name == final.chain[-1]
    alone = answer_of(with_results(stored, test=replace(final, chain=())))

    # By hand: of models of one recording the widest on what is neither own nor tested.
    known = [
        n for n, name in enumerate(final.recordings) if name not in final.tested_on
    ]
    scores = {}
    for row, name in enumerate(final.models):
        others = [n for n in known if not final.is_own[row, n]]
        values = final.rmsd[row, others]
        if final.is_own[row].sum() == 1 and np.isfinite(values).all():
            covered = np.mean(values < final.threshold)
            scores[name] = (-covered, np.mean(np.log(values)))
    assert alone.name == min(scores, key=scores.get)


def test_without_a_test_the_widest_model_elsewhere_is_taken(stored):
    few = without(stored, "test", "group")
    tensor, found = few.crossval, answer_of(few)

    scores = {}
    for n, b, k in np.ndindex(tensor.rmsd.shape[:3]):
        others = [
            m
            for m, other in enumerate(tensor.validated_on)
            if other != tensor.identified_on[n]
        ]
        values = tensor.rmsd[n, b, k, others]
        name = f"{tensor.identified_on[n]}/{tensor.nb[b]}/{tensor.nk[k]}"
        if np.isfinite(values).all():
            covered = sum(values < tensor.threshold)
            scores[name] = (-covered, np.exp(np.mean(np.log(values))))
    assert found.name == min(scores, key=scores.get)
    assert not found.is_unused
    assert found.recordings == tuple(
        one.name for one in few.recordings if one.name not in found.own
    )


def test_the_advised_orders_are_those_of_the_command(stored):
    tensor = stored.crossval
    orders = OrdersOptions(tensor.nb, tensor.nk, "poles", None)
    advice = recommend_orders(
        stored.fits, tensor, stored.recordings, orders, OrderOptions()
    )

    assert isinstance(advice, OrderAdvice)
    assert answer_of(stored).advice == advice.overall


@pytest.mark.thorough
def test_a_level_with_its_noise_is_no_input_beyond_the_fit(stored):
    found = answer_of(stored)
    low, high = found.input_range
    rng = np.random.default_rng(1)

    def beyond(level):
        recordings = [
            replace(
                one, input=level + 1e-3 * (high - low) * rng.normal(size=one.input.size)
            )
            if one.name in found.recordings
            else one
            for one in stored.recordings
        ]
        calibrated = replace(stored.results["calibrate"], recordings=tuple(recordings))
        return answer_of(with_results(stored, calibrate=calibrated)).beyond

    assert (beyond(high) == 0.0).all()
    assert (beyond(high + 0.1 * (high - low)) == 1.0).all()


@pytest.mark.thorough
@pytest.mark.parametrize(("nb", "is_told"), [(0, True), (1, False)])
def test_maps_are_told_where_they_belong_to_the_advised_orders(stored, nb, is_told):
    advice = answer_of(stored).advice
    maps = ChosenMaps(advice.nb + nb, advice.nk, "saturation", "none")

    found = answer_of(replace(stored, chosen_maps=maps))
    assert (found.maps == maps) == is_told


def test_whether_the_model_has_the_recommended_maps_is_told(stored):
    advice, asked = answer_of(stored).advice, stored.fits[0].options
    of_input, of_output = asked.of_input.kind, asked.of_output.kind

    def has_them(*maps):
        chosen = ChosenMaps(advice.nb, advice.nk, *maps)
        return answer_of(replace(stored, chosen_maps=chosen)).has_these_maps

    assert has_them(of_input, of_output)
    assert not has_them("dead_zone", of_output)
    # The same kinds of another size are other maps.
    assert not has_them(of_input, of_output, 29, 29)


def test_the_recommended_orders_are_judged_where_the_model_is(stored):
    few = without(stored, "test", "group")
    found = answer_of(few)
    place = found.advice.nb, found.advice.nk
    own = [
        one
        for one in few.fits
        if one.identified_on == found.own and (one.orders.nb, one.orders.nf) == place
    ]
    judges = [one for one in few.recordings if one.name in found.recordings]
    by_hand = [
        np.sqrt(np.mean((one.output - validation_output(own[0].model, one)) ** 2))
        for one in judges
    ]

    assert found.advised_rmsd == pytest.approx(np.mean(by_hand), rel=1e-12)
    assert named_fits(few)[found.advised_name] is own[0]


@pytest.mark.thorough
def test_the_noise_is_that_of_the_recordings_that_judge(stored):
    found = answer_of(stored)
    rng = np.random.default_rng(3)
    size = 0.1 * float(np.std(stored.recordings[0].output))
    noisy = tuple(
        replace(one, output=one.output + size * rng.standard_normal(one.output.size))
        for one in stored.recordings
    )
    calibrated = replace(stored.results["calibrate"], recordings=noisy)
    results = {**stored.results, "calibrate": calibrated}
    louder = answer_of(replace(stored, results=results))
    assert louder.recordings == found.recordings
    # Differences of some hundred samples tell it to about a tenth.
    assert louder.noise_rms == pytest.approx(size, rel=0.25)
    assert found.noise_rms < 0.1 * size


def test_without_a_tensor_the_best_fit_is_taken_and_simulated_elsewhere(stored):
    few = without(stored, "test", "group", "crossval")
    found = answer_of(few)

    assert found.chosen_on == ()
    assert found.advice is None
    assert np.isnan(found.threshold)
    assert len(found.recordings) == len(few.recordings) - 1


def saturated(name, seed, largest):
    """A first-order lag behind a saturation, by a loop of its own."""
    rng = np.random.default_rng(seed)
    current = np.repeat(largest * rng.uniform(-1, 1, 40), 12)
    state, output = 0.0, []
    for one in current:
        output.append(state)
        state = 0.8 * state + 0.2 * np.clip(one, -1.0, 1.0)
    noise = 1e-3 * rng.standard_normal(current.size)
    return Recording(name, current, np.array(output) + noise, 1e-3, "step", "0" * 64)


@pytest.fixture(scope="module")
def of_saturation():
    """One fit of a drive that saturates, and a recording beyond what it has seen."""
    known, wider = saturated("a", 1, 2.0), saturated("b", 2, 3.0)
    maps = FitOptions(input_map="saturation", output_map="none")
    found = fit([known], Orders(1, 1, 1), maps)
    results = {"calibrate": replace(calibrated(("x",)), recordings=(known, wider))}
    stored = StoredResults("s", "{}", "poles", results=results | {"identify": (found,)})
    return model_answer(stored, None, run_here), known, wider


def test_the_linear_model_beside_it_misses_the_saturation(of_saturation):
    found, _, _ = of_saturation

    assert found.recordings == ("b",)
    # Noise is 1e-3, and beyond the visited input the map is extrapolated; least squares
    # without a map cannot come near a clipped input.
    assert 0.9e-3 < found.rmsd[0] < 5e-3
    assert found.linear_rmsd[0] > 0.1
    assert found.linear.input_map.kind == found.linear.output_map.kind == "none"
    assert found.linear.orders == found.model.orders


def test_what_lies_beyond_the_visited_input_is_counted(of_saturation):
    found, known, wider = of_saturation

    assert found.input_range == (known.input.min(), known.input.max())
    low, high = found.input_range
    expected = np.mean((wider.input < low) | (wider.input > high))
    assert found.beyond[0] == pytest.approx(expected)
    assert 0.1 < expected < 0.9


def test_a_linear_model_has_none_beside_it():
    known, other = saturated("a", 1, 0.9), saturated("b", 2, 0.9)
    found = fit(
        [known], Orders(1, 1, 1), FitOptions(input_map="none", output_map="none")
    )
    results = {"calibrate": replace(calibrated(("x",)), recordings=(known, other))}
    stored = StoredResults("s", "{}", "poles", results=results | {"identify": (found,)})
    found = model_answer(stored, None, run_here)

    assert found.linear is None
    assert np.isnan(found.linear_rmsd).all()
