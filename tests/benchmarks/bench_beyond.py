"""How far models hold beyond the recording of their fit, and which rule makes them.

``python -m tests.benchmarks.bench_beyond [--plants N] [--choose]``. First block: random
plants of orders 1 to 4, a model and the linear model of the same orders fitted to one
recording (a step, levels, a sine, a multisine), judged on five other recordings of the
plant; how often the model is more than 2 and 10 times as far off as the linear one, for
every kind of map. Second: the plants of `bench_wide` with larger inputs, whose true maps
are known there. Third: steps of the virtual gun on each other. The rule was chosen on
the plants that ``--choose`` shows; the others were drawn afterwards.
"""

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.signal import lfilter

from hwid_cli.model.extrapolation import ExtrapolationRule, extrapolated, for_search
from hwid_cli.model.fit import fit, fit_without_standard_errors
from hwid_cli.model.linear_block import filtered, free_response
from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import estimated_state, validation_output
from hwid_cli.model.static_map import evaluate
from hwid_cli.records.model import FitOptions, HammersteinWiener, Orders
from hwid_cli.records.recordings import Recording
from tests.benchmarks.bench_warm_start import measured_steps
from tests.benchmarks.bench_wide import (
    INPUT_MAPS,
    OUTPUT_MAPS,
    WidePlant,
    signal,
    wide_plant,
)
from tests.benchmarks.plants import linear_block

# A model and the recording of its fit, to a model that goes on by another rule.
Way = Callable[[HammersteinWiener, Recording], HammersteinWiener]


def by_rule(trust: float, back: float) -> Way:
    """The rule of the program with other distances."""

    def way(model: HammersteinWiener, own: Recording) -> HammersteinWiener:
        bare = for_search(model)
        w = evaluate(bare.input_map, own.input)
        steady = bare.initial_state == "steady"
        x = filtered(w, bare.numerator, bare.denominator, bare.delay, steady=steady)
        x = x + free_response(estimated_state(bare, own), bare.denominator, x.size)
        return extrapolated(bare, own.input, x, rule=ExtrapolationRule(trust, back))

    return way


FOR_EVER = 1e3
WAYS: dict[str, Way] = {
    "law of the kind": lambda model, own: for_search(model),
    "local slope": by_rule(FOR_EVER, 0.125),
    "line at once": by_rule(0.0, 0.125),
    **{
        f"{trust:g} x seen, back in {back:g}": by_rule(trust, back)
        for trust in (0.5, 1.0, 2.0, 4.0)
        for back in (0.05, 0.125, 0.25)
    },
    "as it is": lambda model, own: model,
}
USED = ("law of the kind", "as it is")
GAINS = (1.3, 2.0)
# Fits below this say nothing, wherever they are used.
LEAST_FIT = 90.0
# Orders of the steps' models, and the threshold of the thesis.
ORDERS = tuple(Orders(n, n, 1) for n in (1, 2, 4, 7))
THRESHOLD_M = 0.01

# Recordings of one plant: those that a model is fitted to, and those beside them.
TRAINING = ("step", "levels", "sine", "multisine")
JUDGES = (*TRAINING, "opposite step", "half step")
LARGEST, N_SAMPLES, LEAD_IN = 2.0, 1000, 100
# Noise of the output over its deviation, and of the measured input over its largest.
OUTPUT_NOISE, INPUT_NOISE = 0.01, 0.005
# Seeds on which the rule was chosen, and the first of those that report.
CHOOSING, REPORTING = range(120), 5000
KINDS = (
    ("piecewise_linear", "piecewise_linear"),
    ("cubic_spline", "cubic_spline"),
    ("polynomial", "polynomial"),
    ("sigmoid_network", "sigmoid_network"),
    ("wavelet_network", "wavelet_network"),
    ("piecewise_constant", "piecewise_linear"),
    ("saturation", "piecewise_linear"),
    ("dead_zone", "piecewise_linear"),
)


@dataclass(frozen=True, eq=False)
class Plant:
    """A plant's orders and its recordings by their inputs."""

    orders: Orders
    recordings: dict[str, Recording]


def excitation(kind: str, rng: np.random.Generator) -> np.ndarray:
    """Input of a recording that begins at rest."""
    n = N_SAMPLES - LEAD_IN
    if kind.endswith("step"):
        level = {"step": 1.0, "opposite step": -1.0, "half step": 0.5}[kind]
        moved = np.full(n, level)
    elif kind == "levels":
        moved = np.repeat(rng.choice(rng.uniform(-1.0, 1.0, 6), n // 60), 60)
    elif kind == "sine":
        period = np.exp(rng.uniform(np.log(60.0), np.log(400.0)))
        moved = np.sin(2.0 * np.pi * np.arange(n) / period)
    else:
        turns = 8.0 * np.pi * np.arange(n) / n
        lines = (1, 2, 3, 5, 8, 13)
        moved = sum(np.sin(k * turns + rng.uniform(0.0, 2.0 * np.pi)) for k in lines)
        moved = moved / np.max(np.abs(moved))
    return LARGEST * np.concatenate([np.zeros(LEAD_IN), moved])


def plant(seed: int) -> Plant:
    """Plant number `seed`, at rest where its input is zero."""
    rng = np.random.default_rng([seed, 31337])
    nf = int(rng.integers(1, 5))
    numerator, denominator = linear_block(
        rng, nf, radii=(0.5, 0.97), angles=(0.02, 1.2), reals=(0.3, 0.97)
    )
    f = list(INPUT_MAPS.values())[rng.integers(len(INPUT_MAPS))]
    g = list(OUTPUT_MAPS.values())[rng.integers(len(OUTPUT_MAPS))]
    ripple = INPUT_NOISE * LARGEST * float(rng.random() < 0.5)
    rest = np.zeros(1)

    def response(u: np.ndarray) -> np.ndarray:
        w = f(u) - f(rest)
        return g(lfilter(np.r_[0.0, numerator], denominator, w)) - g(rest)

    noise = OUTPUT_NOISE * np.std(response(excitation("multisine", rng)))
    recordings = {}
    for kind in JUDGES:
        u = excitation(kind, rng)
        y = response(u) + noise * rng.standard_normal(u.size)
        measured = u + ripple * rng.standard_normal(u.size)
        recordings[kind] = Recording(kind, measured, y, 1e-3)
    return Plant(Orders(numerator.size, nf, 1), recordings)


@dataclass(frozen=True, eq=False)
class Judged:
    """Errors over those of the linear model, by recording, and over the fit's own."""

    ratios: list[float]
    own: float


def judged(
    one: Plant, on: str, kinds: tuple[str, str], ways: dict[str, Way]
) -> Iterator[tuple[str, Judged]]:
    """What each way makes of a model of one recording on all others."""
    own = one.recordings[on]
    others = [r for name, r in one.recordings.items() if name != on]
    none = FitOptions(input_map="none", output_map="none")
    asked = FitOptions(input_map=kinds[0], output_map=kinds[1])
    linear = fit_without_standard_errors([own], one.orders, none).model
    found = fit_without_standard_errors([own], one.orders, asked)
    if found.model is None or linear is None:
        return
    floor = [error(linear, other) for other in others]
    for name, way in ways.items():
        model = way(found.model, own)
        ratios = [
            error(model, other) / least
            for other, least in zip(others, floor, strict=True)
        ]
        yield name, Judged(ratios, error(model, own) / found.rmsd)


def error(model: HammersteinWiener, recording: Recording) -> float:
    """RMSD; infinite where the model diverges."""
    with np.errstate(over="ignore", invalid="ignore"):
        found = rmsd(recording.output, validation_output(model, recording))
    return found if np.isfinite(found) else np.inf


def of_recordings(seeds: range, kinds: tuple[str, str], ways: dict[str, Way]) -> None:
    """Shares beyond the linear model, by the recording of the fit."""
    found: dict[str, dict[str, list[Judged]]] = {
        name: {on: [] for on in TRAINING} for name in ways
    }
    for seed in seeds:
        one = plant(seed)
        for on in TRAINING:
            for name, result in judged(one, on, kinds, ways):
                found[name][on].append(result)
    print(f"\n{kinds[0]} -> {kinds[1]}, {len(seeds)} plants: % beyond 2 / 10 x linear")
    heads = "".join(f"{on:>15}" for on in (*TRAINING, "all"))
    print(f"{'':26}{heads}{'geo. mean':>11}{'own':>8}")
    for name, by_training in found.items():
        rows = [np.array([r.ratios for r in by_training[on]]) for on in TRAINING]
        cells = [*rows, np.concatenate(rows)]
        line = "".join(
            f"{100 * np.mean(part > 2.0):9.1f} /{100 * np.mean(part > 10.0):4.1f}"
            for part in cells
        )
        mean = np.exp(np.mean(np.log(np.minimum(cells[-1], 1e6))))
        own = max(r.own for part in by_training.values() for r in part)
        print(f"{name:26}{line}{mean:11.3f}{own:8.4f}", flush=True)


def larger(plant: WidePlant, gain: float, seed: int) -> Recording:
    """Noise-free recording of a plant with a larger input of another kind."""
    rng = np.random.default_rng([seed, 99])
    u = gain * signal(int(rng.integers(4)), 2000, rng)
    numerator = np.r_[np.zeros(plant.orders.nk), plant.numerator]
    x = lfilter(numerator, plant.denominator, INPUT_MAPS[plant.maps[0]](u))
    return Recording("larger", u, OUTPUT_MAPS[plant.maps[1]](x), 1.0)


def of_larger_inputs(count: int) -> None:
    """Error beyond the data of plants whose extrapolation is known."""
    errors: dict[float, list[list[float]]] = {gain: [] for gain in GAINS}
    for seed in range(count):
        plant = wide_plant(seed)
        # What an exponential does beyond its data nobody can tell from the data.
        if plant.maps[1] == "exponential":
            continue
        found = fit([plant.recording], plant.orders)
        if found.model is None or found.fit_percent < LEAST_FIT:
            continue
        models = [way(found.model, plant.recording) for way in WAYS.values()]
        for gain in GAINS:
            one = larger(plant, gain, seed)
            errors[gain].append(
                [
                    rmsd(one.output, validation_output(model, one)) / np.std(one.output)
                    for model in models
                ]
            )
    n = len(errors[GAINS[0]])
    print(f"\n{n} plants, larger inputs: error as a share of the output's deviation")
    print(f"{'':26}{'input x 1.3: median, ratio':>30}{'x 2: median, ratio':>24}")
    for number, name in enumerate(WAYS):
        line = f"{name:26}"
        for gain, width in zip(GAINS, (20, 14), strict=True):
            table = np.array(errors[gain])
            ratio = np.exp(np.mean(np.log(table[:, number] / table[:, 0])))
            line += f"{np.median(table[:, number]):{width}.4f}{ratio:10.2f}"
        print(line)


def of_steps() -> None:
    """RMSD of the gun's steps on each other."""
    steps = [replace(one) for one in measured_steps().values()]
    scores: list[list[list[float]]] = [[] for _ in WAYS]
    for one in steps:
        others = [step for step in steps if step is not one]
        for orders in ORDERS:
            model = fit([one], orders).model
            if model is None:
                continue
            for number, way in enumerate(WAYS.values()):
                way_on = way(model, one)
                scores[number].append([error(way_on, other) for other in others])
    print(f"\n{len(steps)} steps of the gun on each other, {len(ORDERS)} orders")
    print(f"{'':26}{'median RMSD, mm':>18}{'90 %':>9}{'below 10 mm':>14}")
    for name, found in zip(WAYS, scores, strict=True):
        values = np.array(found)
        middle, high = 1e3 * np.quantile(values, [0.5, 0.9])
        share = np.mean(values < THRESHOLD_M)
        print(f"{name:26}{middle:18.1f}{high:9.0f}{share:14.1%}")


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--plants", type=int, default=40)
    parser.add_argument("--larger", type=int, default=300)
    parser.add_argument("--choose", action="store_true")
    given = parser.parse_args()
    seeds = range(REPORTING, REPORTING + given.plants)
    used = {name: WAYS[name] for name in USED}
    if given.choose:
        seeds, used = CHOOSING[: given.plants], WAYS
    for kinds in KINDS:
        of_recordings(seeds, kinds, used)
    of_larger_inputs(given.larger)
    of_steps()


if __name__ == "__main__":
    main()
