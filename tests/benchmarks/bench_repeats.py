"""Does ``hwid next`` find that a machine answers otherwise in every recording?

``make bench-repeats`` runs this file. Random plants by equations of their own, integrated
here: a drag-and-spring drive with dry friction, a first-order lag behind a dead zone, and
two lags before a saturating sensor. Half of them change from recording to recording: gain,
stiffness or friction are drawn anew, by 1 to 30 %. Some have noise that is slow beside the
white one. ``hwid next`` is asked after each recording, and what it proposes is recorded,
until it says that enough is known. The plan is four to six inputs.

What is true is told by 60 further recordings of each input that was recorded, without
noise: their standard deviation around their mean. It matters where it is above the noise.

- false "enough": it matters, and the spread that is known is not within a factor of 2;
- needless: recordings after the first from which on the spread was within a factor of 2;
  where it does not matter, all repeats beside the first.

Until now "enough is known" knew of no repeats: then every plant that changes is a false one.
"""

import argparse
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from hwid_cli.records.experiment import NextOptions
from hwid_cli.records.next import NextRecordings, PlannedInput
from hwid_cli.records.recordings import Recording
from hwid_cli.stages.next import propose_next
from hwid_cli.stages.next_goals import ToChoose
from tests.benchmarks.trust_plants import INPUTS, SAMPLE_TIME_S, make_input

STRUCTURES = ("friction drive", "dead zone and lag", "lags and sensor")
_TRUE_REPEATS, _FACTOR, _MOST = 60, 2.0, 40


@dataclass(frozen=True)
class Plant:
    """A machine whose values are drawn anew for every recording.

    Parameters
    ----------
    answer : callable
        From an input and relative changes of three values to the output.
    change : ndarray, shape (3,), [-]
        Standard deviations of these changes.
    noise : tuple of float, [-]
        White, and slow (a first-order lag of 20 samples), as shares of the output.
    """

    answer: Callable[[np.ndarray, np.ndarray], np.ndarray]
    change: np.ndarray
    noise: tuple[float, float]


def _friction_drive(u: np.ndarray, by: np.ndarray, own: np.ndarray) -> np.ndarray:
    gain, stiffness, friction = (1 + 0.5 * own) * by
    x = v = 0.0
    y = np.zeros(u.size)
    for k, force in enumerate(gain * u):
        for _ in range(5):
            dry = 0.15 * friction * np.tanh(v / 0.05)
            v += 2e-3 * 40.0 * (force - stiffness * x - 0.15 * v - dry)
            x += 2e-3 * v
        y[k] = x
    return y


def _dead_zone_and_lag(u: np.ndarray, by: np.ndarray, own: np.ndarray) -> np.ndarray:
    gain, edge, pole = (1 + 0.5 * own) * by
    width = 0.2 * edge
    a = np.clip(0.93 * pole**0.1, 0.5, 0.99)
    return gain * lfilter([0, 1 - a], [1, -a], u - np.clip(u, -width, width))


def _lags_and_sensor(u: np.ndarray, by: np.ndarray, own: np.ndarray) -> np.ndarray:
    gain, bend, pole = (1 + 0.5 * own) * by
    a = np.clip(0.9 * pole**0.1, 0.5, 0.99)
    once = lfilter([0, 1 - a], [1, -a], gain * u)
    return np.tanh(0.5 * bend * lfilter([0, 0.2], [1, -0.8], once))


def random_plant(seed: int, size: float) -> Plant:
    """A plant whose values change by so much, relative, from recording to recording."""
    rng = np.random.default_rng([seed, 2711])
    own = rng.uniform(-1, 1, 3)
    law = (_friction_drive, _dead_zone_and_lag, _lags_and_sensor)[seed % 3]
    weights = rng.dirichlet(np.ones(3))
    slow = rng.choice([0.0, 0.0, 1.0])
    noise = rng.choice([0.002, 0.01, 0.03])
    return Plant(
        lambda u, change: law(u, np.maximum(1 + change, 0.1), own),
        size * weights / weights.max(),
        (noise, slow * noise),
    )


def record(
    plant: Plant, name: str, u: np.ndarray, rng: np.random.Generator
) -> Recording:
    """A recording of its own."""
    y = plant.answer(u, plant.change * rng.standard_normal(3))
    white, slow = np.array(plant.noise) * np.std(y)
    drift = lfilter([np.sqrt(1 - 0.95**2)], [1, -0.95], rng.standard_normal(u.size))
    y = y + white * rng.standard_normal(u.size) + slow * drift
    return Recording(name, u, y, SAMPLE_TIME_S)


@dataclass(frozen=True)
class Outcome:
    """What the loop came to.

    Parameters
    ----------
    ratios : list of float, [-]
        Known over true spread after each repeat; NaN where none is known.
    true, noise : float, [output unit]
    """

    n_inputs: int
    ratios: list[float]
    true: float
    noise: float

    @property
    def matters(self) -> bool:
        """Whether the machine changes by more than its noise."""
        return self.true > self.noise

    @property
    def is_false(self) -> bool:
        """Whether the spread is not known at the end."""
        return self.matters and not _is_near(self.ratios[-1])

    @property
    def needless(self) -> int:
        """Repeats without which as much was known."""
        if self.is_false:
            return 0
        if not self.matters:
            return len(self.ratios) - 1
        far = [k for k, ratio in enumerate(self.ratios) if not _is_near(ratio)]
        return len(self.ratios) - 1 - (far[-1] + 1 if far else 0)


def _is_near(ratio: float) -> bool:
    return 1 / _FACTOR < ratio < _FACTOR


def played_out(seed: int, size: float) -> Outcome:
    """Ask, record what is proposed, and ask again, until enough is known."""
    rng = np.random.default_rng([seed, 5])
    plant = random_plant(seed, size)
    kinds = rng.choice(INPUTS, rng.integers(4, 7))
    plan = tuple(
        PlannedInput(f"{kind}_{k}", make_input(kind, rng, 2.0), kind)
        for k, kind in enumerate(kinds)
    )
    recordings = [record(plant, plan[0].name, plan[0].values, rng)]
    spreads, inputs = [], 1
    for _ in range(_MOST):
        found = _asked(recordings, plan)
        if found.repeats is not None:
            spreads.append(found.repeats.spread)
        if found.is_enough:
            break
        one = found.proposals[0]
        inputs += one.name in {row.name for row in plan}
        recordings.append(record(plant, one.name, one.values, rng))
    true, noise = _truth(plant, recordings, plan, rng)
    total = np.hypot(true, noise)
    return Outcome(inputs, [one / total for one in spreads] or [np.nan], true, noise)


def _asked(
    recordings: list[Recording], plan: tuple[PlannedInput, ...]
) -> NextRecordings:
    options = NextOptions(number=1)
    return propose_next(ToChoose(options, tuple(recordings), plan), None)


def _truth(
    plant: Plant,
    recordings: list[Recording],
    plan: tuple[PlannedInput, ...],
    rng: np.random.Generator,
) -> tuple[float, float]:
    """Root mean squares of what changes and of the noise, over all recorded inputs."""
    squares, noises = [], []
    names = {one.name for one in recordings}
    for row in (one for one in plan if one.name in names):
        outputs = np.array(
            [
                plant.answer(row.values, plant.change * rng.standard_normal(3))
                for _ in range(_TRUE_REPEATS)
            ]
        )
        squares.append(np.mean(np.var(outputs, axis=0, ddof=1)))
        noises.append(np.sum(np.square(plant.noise)) * np.mean(np.var(outputs, axis=1)))
    return float(np.sqrt(np.mean(squares))), float(np.sqrt(np.mean(noises)))


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plants", type=int, default=40)
    parser.add_argument("--seed", type=int, default=80000)
    parser.add_argument("--each", action="store_true", help="a line for each plant")
    chosen = parser.parse_args()
    print(
        "| change | matters | false enough | repeats: median (most) | needless: mean |"
    )
    for size in (0.0, 0.01, 0.03, 0.1, 0.3):
        found = []
        for seed in range(chosen.seed, chosen.seed + chosen.plants):
            found.append(played_out(seed, size))
            if chosen.each:
                one = found[-1]
                print(
                    seed,
                    one.n_inputs,
                    one.matters,
                    np.round(one.ratios, 2),
                    one.needless,
                )
        repeats = [len(one.ratios) for one in found]
        print(
            f"| {size:g} | {sum(one.matters for one in found)} of {len(found)} "
            f"| {sum(one.is_false for one in found)} "
            f"| {np.median(repeats):g} ({max(repeats)}) "
            f"| {np.mean([one.needless for one in found]):.2f} |",
            flush=True,
        )


if __name__ == "__main__":
    main()
