"""How many recordings it takes to cover what all of a plan cover, chosen and by chance.

``make bench-next`` runs this file. The plan is every recording that there is: the 38 steps
and sines of the virtual gun, the 12 recordings of the motor HSM150 (``HWID_REALDATA``).
Some of them are taken, one model is fitted to these together, and the coverage is the
number of all recordings on which its RMSD is below the threshold, as in the tables of a
chain (its own included). Taken are the first k of an order: that of ``hwid next``, which
sees inputs only; that of the plan, which on the gun is the thesis's; and random ones. Shown
is the least k whose coverage is 90 % of that of all recordings together. The motor was
given every command three times; of equal commands ``hwid next`` takes the one that the plan
lists first, so its order is that of several listings, each by chance. All pairs of its
recordings are fitted, which tells whether two could do at all. ``--keep FILE`` writes each
fitted set as it comes, and what the file has is not fitted again.

Beside it, without a joint fit: a set covers what the model of one of its recordings covers,
from the matrix of all models on all recordings. That is another quantity, which grows with
every recording and costs nothing more for another order.
"""

import argparse
import json
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.io import loadmat

from hwid_cli.model.fit import fit_without_standard_errors
from hwid_cli.model.scores import rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.experiment import CalibrateOptions, NextOptions
from hwid_cli.records.machines import GunMachine, GunPlan
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.next import NextRecordings, PlannedInput
from hwid_cli.records.recordings import RawRecording, Recording
from hwid_cli.stages.calibrate import calibrate_all
from hwid_cli.stages.next import propose_next
from hwid_cli.stages.next_goals import ToChoose
from hwid_cli.stages.simulate import simulate_machine
from hwid_cli.trust.choice import chosen_by_gain
from hwid_cli.trust.content import content, joined, value_edges, visited_share
from tests.benchmarks.real_data import folder

# Combination Models 1 and 2 of the thesis (T3.4.1, T3.4.2), in its order: recordings 1 to
# 15 are the steps, 16 to 38 the sines. Chosen with the outputs in view.
THESIS = {"Model 1": (6, 9, 1, 8), "Model 2": (20, 16, 9, 5, 35, 7)}
# Looked at, of 38: between them it would take too long to look.
COUNTS = (1, 2, 3, 4, 5, 6, 8, 10, 11, 12, 15, 18, 22, 26, 30, 34, 38)
REACHED = 0.9
# Below this an input on offer is not worth recording: the default of next.enough.
ENOUGH = 0.01
QUARTILES = (0.25, 0.5, 0.75)


def averaged(one: Recording, count: int) -> Recording:
    """Means of so many samples each."""
    n = one.n_samples // count * count
    u, y = (
        values[:n].reshape(-1, count).mean(axis=1) for values in (one.input, one.output)
    )
    return replace(one, input=u, output=y, sample_time_s=count * one.sample_time_s)


GUN_PLAN = (
    *(f"step_{k:02d}" for k in range(1, 16)),
    *(f"sine_{k:02d}" for k in range(1, 24)),
)


def gun(names: Sequence[str] = GUN_PLAN, seed: int = 1) -> list[Recording]:
    """The 15 steps and 23 sines of the thesis's plan, ten samples averaged."""
    plan = replace(GunPlan(), only=tuple(names))
    machine = replace(GunMachine(), plan=plan, seed=seed)
    step_s = machine.plan.sample_time_s
    raws = [
        RawRecording(one.name, one.input, one.output, step_s, one.kind)
        for one in simulate_machine(machine)
    ]
    recipe = CalibrateOptions(
        step=("cut", "output_offset"),
        sine=("cut", "input_offset", "output_offset", "recut"),
        samples=7500,
    )
    return [averaged(one, 10) for one in calibrate_all(raws, recipe)[0]]


def hsm150() -> tuple[list[Recording], list[np.ndarray]]:
    """Current and speed of the motor, twenty samples averaged, as its configuration has it.

    Beside them the torques that were commanded: the measured current is noisier than the
    steps are large, and what is played next is no measurement.
    """
    found, commands = [], []
    for path in sorted((folder() / "hsm150_motor").glob("*.mat")):
        data = loadmat(path)["data"]
        step_s = float(np.median(np.diff(data[:, 0])))
        found.append(averaged(Recording(path.stem, data[:, 6], data[:, 3], step_s), 20))
        asked = Recording(path.stem, data[:, 4], data[:, 3], step_s)
        commands.append(averaged(asked, 20).input)
    return found, commands


class Coverage:
    """Coverage of the joint model of some recordings; each set is fitted once."""

    counts: Sequence[int] = COUNTS

    def __init__(
        self, recordings: Sequence[Recording], orders: Orders, options: FitOptions
    ) -> None:
        self.recordings, self.orders, self.options = recordings, orders, options
        self.threshold, self.known, self.keep = 0.0, {}, None

    def under(self, threshold: float) -> "Coverage":
        """The same fits with another threshold."""
        other = type(self)(self.recordings, self.orders, self.options)
        other.threshold, other.known, other.keep = threshold, self.known, self.keep
        return other

    def kept_in(self, path: Path, name: str) -> "Coverage":
        """Take over what a file has of this plan, and add to it."""
        self.keep = (path, name)
        for line in path.read_text().splitlines() if path.is_file() else ():
            one = json.loads(line)
            if one["plan"] == name:
                self.known[tuple(one["set"])] = np.array(one["rmsd"], dtype=float)
        return self

    def rmsds(self, chosen: Sequence[int]) -> np.ndarray:
        """RMSD of the model of the chosen ones on all recordings."""
        key = tuple(sorted(int(one) for one in chosen))
        if key not in self.known:
            taken = [self.recordings[place] for place in key]
            model = fit_without_standard_errors(taken, self.orders, self.options).model
            found = np.full(len(self.recordings), np.inf)
            if model is not None:
                outputs = [validation_output(model, one) for one in self.recordings]
                pairs = zip(self.recordings, outputs, strict=True)
                found = np.array([rmsd(one.output, y) for one, y in pairs])
            self.known[key] = found
            if self.keep is not None:
                path, name = self.keep
                row = {"plan": name, "set": list(key), "rmsd": found.tolist()}
                with path.open("a") as file:
                    file.write(json.dumps(row) + "\n")
        return self.known[key]

    def of(self, chosen: Sequence[int]) -> int:
        """Number of all recordings that the model of the chosen ones covers."""
        return int(np.sum(self.rmsds(chosen) < self.threshold))

    def needed(self, order: Sequence[int], wanted: float, most: int = 0) -> int:
        """Least count, of those looked at, whose coverage is at least that wanted.

        With ``most`` no larger count is looked at, and it stands for all that need more.
        """
        most = most or len(self.recordings)
        for count in (k for k in self.counts if k < most):
            if self.of(order[:count]) >= wanted:
                return count
        return most


class CoverageOfSingles(Coverage):
    """Coverage by the models of single recordings, without a joint fit."""

    counts = range(1, 100)

    def of(self, chosen: Sequence[int]) -> int:
        """Number of all recordings that one of the chosen ones' models covers."""
        table = [self.rmsds([one]) < self.threshold for one in chosen]
        return int(np.any(table, axis=0).sum())


def proposed(inputs: Sequence[np.ndarray]) -> tuple[list[int], int]:
    """Order of ``hwid next``, and after how many it says that enough is known."""
    edges = value_edges(inputs)
    tables = [content(one, edges) for one in inputs]
    reachable = joined(tables)

    def gain(known: np.ndarray, more: np.ndarray) -> float:
        both = visited_share(joined([known, more]), reachable)
        return both - visited_share(known, reachable)

    found = chosen_by_gain(
        joined([]), tables, gain, lambda a, b: joined([a, b]), len(tables)
    )
    enough = next((k for k, (_, by) in enumerate(found) if by < ENOUGH), len(found))
    return [place for place, _ in found], enough


def taken_until_enough(
    recordings: Sequence[Recording],
    inputs: Sequence[np.ndarray],
    first: int,
    repeat: Callable[[str, int], Recording | None],
) -> tuple[list[str], NextRecordings]:
    """Ask ``hwid next``, record what it proposes, and ask again; the names and its end.

    Parameters
    ----------
    repeat : callable
        From a name that the plan does not have and how many there were to a recording.
    """
    names = [one.name for one in recordings]
    plan = tuple(
        PlannedInput(name, u, name) for name, u in zip(names, inputs, strict=True)
    )
    own = {
        one.name: replace(one, input=u)
        for one, u in zip(recordings, inputs, strict=True)
    }
    taken = [own[names[first]]]
    options, further = NextOptions(number=1), 0
    while True:
        found = propose_next(ToChoose(options, tuple(taken), plan), None)
        if found.is_enough:
            break
        name = found.proposals[0].name
        more = own.get(name) or repeat(name, further)
        if more is None:
            break
        further += name not in own
        taken.append(more)
    return [one.name for one in taken], found


class Listing(NamedTuple):
    """What ``hwid next`` proposes of a plan whose rows are listed in some order.

    Parameters
    ----------
    order : list of int
        By inputs alone.
    inputs : int
        After so many of them the inputs are enough.
    taken : list of int
        Until enough is known, repeats too.
    """

    order: list[int]
    inputs: int
    taken: list[int]


def listings(
    recordings: Sequence[Recording], inputs: Sequence[np.ndarray], draws: int
) -> Iterator[Listing]:
    """The same for rows in random orders."""
    for seed in range(draws):
        rows = np.random.default_rng([27, seed]).permutation(len(inputs))
        listed = [inputs[row] for row in rows]
        order, enough = proposed(listed)
        names, _ = taken_until_enough(
            [recordings[row] for row in rows], listed, order[0], lambda *_: None
        )
        places = {one.name: place for place, one in enumerate(recordings)}
        chosen = [places[name] for name in names]
        yield Listing([int(rows[place]) for place in order], enough, chosen)


def gun_repeat(name: str, count: int) -> Recording:
    """The same input on another day of the virtual gun."""
    (one,) = gun([name.partition("_repeat_")[0]], seed=1000 + count)
    return replace(one, name=name)


def show(
    name: str, coverage: Coverage, inputs: Sequence[np.ndarray], draws: int
) -> None:
    """The table of one plan."""
    total = len(coverage.recordings)
    everything = coverage.of(range(total))
    wanted = REACHED * everything
    order, enough = proposed(inputs)
    print(
        f"\n{name}: {total} recordings; all together cover {everything}, wanted {wanted:.1f}"
    )
    print(
        f"hwid next: {coverage.needed(order, wanted)} recordings, in the order "
        + ", ".join(coverage.recordings[place].name for place in order[:8]),
        flush=True,
    )
    print(
        f"  the inputs are enough after {enough}; they cover {coverage.of(order[:enough])}"
    )
    print(f"the plan's own order: {coverage.needed(range(total), wanted)}", flush=True)
    for model, chain in THESIS.items() if name.startswith("virtual gun") else ():
        first = [number - 1 for number in chain]
        rest = [place for place in range(total) if place not in first]
        print(
            f"the thesis's {model} covers {coverage.of(first)} with {len(first)} "
            f"recordings, as many of hwid next cover {coverage.of(order[: len(first)])}; "
            f"with the rest of the plan behind it: {coverage.needed(first + rest, wanted)}",
            flush=True,
        )
    # The aim is half of the median, and the upper quartile lies further out.
    most = min(total, 4 * coverage.needed(order, wanted))
    counts = []
    for seed in range(draws):
        random = np.random.default_rng([26, seed]).permutation(total)
        counts.append(coverage.needed(random, wanted, most))
        if seed % 5 == 4 or seed == draws - 1:
            print(f"{seed + 1} random orders: {quartiles(counts, most)}", flush=True)


def quartiles(counts: Sequence[int], most: int) -> str:
    """Median and quartiles of counts that were not followed beyond the largest."""
    low, middle, high = (
        f"{'at least ' if one >= most else ''}{one:g}"
        for one in np.quantile(counts, QUARTILES)
    )
    return f"median {middle}, quartiles {low} to {high}"


def show_repeats(
    coverage: Coverage, commands: Sequence[np.ndarray], draws: int
) -> None:
    """What chance among equal commands changes, and which pairs of recordings do."""
    total = len(coverage.recordings)
    wanted = REACHED * coverage.of(range(total))
    found = list(listings(coverage.recordings, commands, draws))
    counts = [coverage.needed(one.order, wanted) for one in found]
    covered = [coverage.of(one.order[: one.inputs]) for one in found]
    after = [coverage.of(one.taken) for one in found]
    taken = [len(one.taken) for one in found]
    print(f"hwid next, plan listed in {draws} orders: {quartiles(counts, total + 1)}")
    print(
        f"  the inputs are enough after {sorted({one.inputs for one in found})}; they "
        f"cover {quartiles(covered, total + 1)}\n"
        f"  enough is known after {quartiles(taken, total + 1)}; they cover "
        f"{quartiles(after, total + 1)}"
    )
    levels = [one.name.rpartition("_")[0] for one in coverage.recordings]
    does: dict[str, list[bool]] = {}
    for first, second in combinations(range(total), 2):
        of = " and ".join(dict.fromkeys((levels[first], levels[second])))
        does.setdefault(of, []).append(coverage.of([first, second]) >= wanted)
    for of, each in does.items():
        print(f"  pairs of {of}: {sum(each)} of {len(each)} do", flush=True)


def both(
    name: str,
    joint: Coverage,
    inputs: Sequence[np.ndarray],
    threshold: float,
    draws: int,
) -> None:
    """The table of one plan by single models, and by joint ones."""
    singles = CoverageOfSingles(joint.recordings, joint.orders, joint.options)
    singles.known, singles.keep = joint.known, joint.keep
    under = singles.under(threshold)
    show(f"{name}, models of single recordings", under, inputs, draws)
    show(name, joint.under(threshold), inputs, draws)


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--draws", type=int, default=30)
    parser.add_argument("--only", choices=["gun", "hsm150"])
    parser.add_argument("--keep", type=Path)
    chosen = parser.parse_args()
    joint = FitOptions(join="experiments")
    if chosen.only != "gun" and folder().is_dir():
        options = replace(joint, units=3, initial_state="steady")
        recordings, commands = hsm150()
        motor = Coverage(recordings, Orders(1, 1, 1), options)
        if chosen.keep:
            motor.kept_in(chosen.keep, "HSM150")
        # Repeats of one level differ by up to 60: below that chance decides.
        for threshold in (20.0, 60.0):
            name = f"HSM150 below {threshold:g}"
            both(name, motor, commands, threshold, chosen.draws)
            show_repeats(motor.under(threshold), commands, chosen.draws)
    if chosen.only != "hsm150":
        recordings = gun()
        machine = Coverage(recordings, Orders(3, 4, 1), joint)
        if chosen.keep:
            machine.kept_in(chosen.keep, "gun")
        inputs = [one.input for one in recordings]
        names, end = taken_until_enough(
            recordings, inputs, proposed(inputs)[0][0], gun_repeat
        )
        print(
            f"virtual gun: {len(names)} recordings, {', '.join(names)}: {end.sentence}"
        )
        both("virtual gun", machine, inputs, 0.01, chosen.draws)


if __name__ == "__main__":
    main()
