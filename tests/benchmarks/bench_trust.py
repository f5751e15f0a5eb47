"""How often the band of 90 % holds what is measured, and how wide it is.

``make bench-trust`` runs this file; ``--choose`` draws the plants by which the constants of
the band were chosen, without it others are drawn. Random plants (`trust_plants`): a model
of one recording, judged by others or by its own rest; the band on recordings that nothing
has used, of the same kind of input and of others, apart. Public measurements
(``HWID_REALDATA``) and the virtual gun by the same functions. ``--keep FILE`` writes each
plant as it comes, and what the file has is not computed again. ``--moving DRIFT`` lets the
recordings of the plants begin in the middle of a motion, behind a sensor that drifts: at
rest a start and an offset are known, here they are part of the error.
"""

import argparse
import json
import re
from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import permutations
from pathlib import Path

import numpy as np
from scipy.io import loadmat

from hwid_cli.model.fit import fit
from hwid_cli.records.experiment import CalibrateOptions
from hwid_cli.records.machines import GunMachine, GunPlan
from hwid_cli.records.model import Fit, FitOptions, Orders
from hwid_cli.records.recordings import RawRecording, Recording
from hwid_cli.records.trust import ModelTrust
from hwid_cli.stages.calibrate import calibrate_all
from hwid_cli.stages.simulate import simulate_machine
from hwid_cli.trust.band import band_of
from hwid_cli.trust.judged import (
    Judgement,
    calibrated,
    judgement,
    left_out,
    own_trust,
    trust_row,
)
from tests.benchmarks.real_data import ced, folder, tanks
from tests.benchmarks.trust_plants import INPUTS, STRUCTURES, plant_recordings

CHOOSING, REPORTING = 1000, 70_000
# Who judges: recordings by their place among those of a plant. The first is the model's.
JUDGES = {"two of its kind": (1, 2), "one of each of two kinds": (1, 5), "none": ()}
ORDERS = Orders(2, 2, 1)
# Samples cut off where recordings begin in motion.
BEGINNING = 300
HEAD = f"{'':34}{'recordings':>11}{'coverage':>10}{'10 % below':>11}{'width/error':>12}{'width/spread':>13}{'inside':>8}"

Row = tuple[float, float, float, float]


def row_of(known: ModelTrust, one: Judgement) -> list[Row]:
    """Coverage, width over error and over the output's spread, share inside."""
    spread = float(np.std(one.measured))
    if spread == 0.0:
        # An input that stays within a dead zone is no recording.
        return []
    band = band_of(known, one.terms, one.where)
    seen = trust_row(("", one.name, ""), one.measured, band)
    return [(seen.coverage, seen.width / seen.rmsd, seen.width / spread, seen.inside)]


def judged(found: Fit, own, judges, tests: Sequence[Recording]) -> list[Row]:
    """Rows of recordings that neither the fit nor its judges have used."""
    trust = own_trust(found, own)
    calibrating = [judgement(found.model, trust, one) for one in judges]
    known = calibrated(trust, calibrating or left_out(found, own))
    return [
        row
        for one in tests
        for row in row_of(known, judgement(found.model, trust, one))
    ]


def show(name: str, rows: Sequence[Row]) -> None:
    """One line of the table."""
    table = np.array(rows)
    coverage, per_error, per_spread, within = table.T
    print(
        f"{name:34}{len(table):11d}{coverage.mean():10.3f}{np.quantile(coverage, 0.1):11.2f}"
        f"{np.median(per_error):12.1f}{np.median(per_spread):13.3f}{within.mean():8.2f}",
        flush=True,
    )


def begun_in_motion(
    recordings: Sequence[Recording], drift: float, seed: int
) -> list[Recording]:
    """The rest of each recording; the drift is its deviation, in spreads of the output."""
    rng, found = np.random.default_rng([seed, 5]), []
    for one in recordings:
        y = one.output[BEGINNING:]
        slope = drift * np.std(y) * rng.standard_normal()
        y = y + slope * np.linspace(-1.0, 1.0, y.size)
        found.append(replace(one, input=one.input[BEGINNING:], output=y))
    return found


def plant(seed: int, structure: str, moving: float | None) -> dict[str, list[Row]]:
    """Rows of one random plant, by who judges, structure and kind of input."""
    rng = np.random.default_rng(seed)
    order = [str(one) for one in rng.permutation(INPUTS)]
    kinds = [order[0]] * 5 + [order[1], order[1], order[2]]
    recordings = plant_recordings(seed, structure, kinds)
    if moving is not None:
        recordings = begun_in_motion(recordings, moving, seed)
    options = FitOptions(units=int(rng.choice([5, 10])))
    model = fit(recordings[:1], ORDERS, options)
    if model.model is None:
        return {}
    word = "right" if structure == "right" else "wrong"
    trust = own_trust(model, recordings[:1])
    each = [judgement(model.model, trust, one) for one in recordings[1:]]
    found = {}
    for who, places in JUDGES.items():
        judges = [each[place - 1] for place in places]
        known = calibrated(trust, judges or left_out(model, recordings[:1]))
        others = each[6:] if 5 in places else each[4:]
        for kind, tests in (("same", each[2:4]), ("other", others)):
            rows = [row for one in tests for row in row_of(known, one)]
            found[f"{who}, {word}, {kind}"] = rows
    return found


def plants(
    count: int, first: int, keep: Path | None, moving: float | None
) -> dict[str, list[Row]]:
    """Random plants, right and wrong structure in turn; the rows of each line."""
    known = {}
    if keep is not None and keep.is_file():
        lines = [json.loads(one) for one in keep.read_text().splitlines()]
        known = {one["seed"]: one["rows"] for one in lines}
    found: dict[str, list[Row]] = {}
    for number in range(count):
        structure = structure_of(number)
        seed = first + number
        if seed not in known:
            known[seed] = plant(seed, structure, moving)
            if keep is not None:
                with keep.open("a") as file:
                    file.write(json.dumps({"seed": seed, "rows": known[seed]}) + "\n")
        for name, rows in known[seed].items():
            found.setdefault(name, []).extend(rows)
    print(f"\n{count} random plants from seed {first}\n{HEAD}")
    order = [f"{who}, {word}" for who in JUDGES for word in ("right", "wrong")]
    for name in sorted(found, key=lambda one: order.index(one.rpartition(",")[0])):
        show(name, found[name])
        if name.startswith("none") and name.endswith("same"):
            coverage = np.array(found[name])[:, 0]
            print(
                f"  half of these hold {np.median(coverage):.3f} or more, "
                f"{np.mean(coverage == 1.0):.0%} hold every sample"
            )
    return found


def joint(count: int, first: int) -> dict[str, list[Row]]:
    """Models of five recordings of two kinds together, judged by leaving each out."""
    found: dict[str, list[Row]] = {}
    for number in range(count):
        structure = structure_of(number)
        seed = first + number
        rng = np.random.default_rng(seed)
        one, two, three = (str(kind) for kind in rng.permutation(INPUTS)[:3])
        recordings = plant_recordings(
            seed, structure, [one] * 5 + [two] * 4 + [three] * 2
        )
        own = [*recordings[:3], *recordings[5:7]]
        options = FitOptions(units=int(rng.choice([5, 10])))
        model = fit(own, ORDERS, options)
        if model.model is None:
            continue
        word = "right" if structure == "right" else "wrong"
        tests = {"same": [*recordings[3:5], *recordings[7:9]], "other": recordings[9:]}
        known = calibrated(own_trust(model, own), left_out(model, own))
        for kind, unseen in tests.items():
            for test in unseen:
                rows = row_of(known, judgement(model.model, known, test))
                found.setdefault(f"{word}, {kind}", []).extend(rows)
    return found


def show_joint(count: int, first: int) -> None:
    """The table of models of five recordings."""
    print(f"\n{count} random plants, models of five recordings\n{HEAD}")
    for name, rows in joint(count, first).items():
        show(name, rows)


def structure_of(number: int) -> str:
    """Right and wrong structures in turn."""
    wrong = STRUCTURES[1:]
    return "right" if number % 2 == 0 else wrong[number // 2 % len(wrong)]


def show_chance(who: str, count: int, plants_of: dict[str, list[Row]]) -> None:
    """What so few recordings of the random plants hold on average, by chance.

    Recordings of its own kind, with a right and a wrong structure, judged by as much.
    """
    coverage = np.array(
        [
            row[0]
            for word in ("right", "wrong")
            for row in plants_of[f"{who}, {word}, same"]
        ]
    )
    rng = np.random.default_rng(26)
    means = rng.choice(coverage, (10_000, count)).mean(axis=1)
    low, high = np.quantile(means, [0.025, 0.975])
    print(
        f"  {count} of {coverage.size} such recordings of the plants, which hold "
        f"{coverage.mean():.3f}: {low:.2f} to {high:.3f} (95 % of draws)",
        flush=True,
    )


def hsm150(order: tuple[int, ...]) -> list[Row]:
    """A repeat of each level is the model's, another one judges, the last one tests.

    Parameters
    ----------
    order : tuple of int
        Numbers of the three repeats in these roles.
    """
    recordings = {}
    for path in sorted((folder() / "hsm150_motor").glob("*.mat")):
        rows = loadmat(path)["data"]
        u, y = (
            rows[: rows.shape[0] // 20 * 20, at].reshape(-1, 20).mean(axis=1)
            for at in (6, 3)
        )
        step = 20 * float(np.median(np.diff(rows[:, 0])))
        recordings[path.stem] = Recording(path.stem, u, y, step)
    found = []
    options = FitOptions(units=3, initial_state="steady")
    fitted, judge, test = (f"_{number}" for number in order)
    for name, own in recordings.items():
        if not name.endswith(fitted):
            continue
        sign = re.match("idf_[a-z]+", name)[0]
        same = [k for k in recordings if k.startswith(sign) and k != name]
        judges = [recordings[k] for k in same if k.endswith(judge)]
        tests = [recordings[k] for k in same if k.endswith(test)]
        model = fit([own], Orders(1, 1, 1), options)
        found += judged(model, [own], judges, tests)
    return found


def coupled_drives() -> dict[str, list[Row]]:
    """Each of the five recordings of CED is a model's, and each other one tests."""
    read = [loadmat(folder() / "ced" / f"DATA{name}.MAT") for name in ("PRBS", "UNIF")]
    recordings = [
        Recording(name, data[f"u{at}"].ravel(), data[f"z{at}"].ravel(), 0.02)
        for name, data, places in zip(
            "PU", read, (("1", "2", "3"), ("11", "12")), strict=True
        )
        for at in places
    ]
    found: dict[str, list[Row]] = {"same": [], "other": []}
    for own in recordings:
        model = fit([own], Orders(2, 3, 1), FitOptions(units=5))
        for one in recordings:
            if one is not own:
                kind = "same" if one.name == own.name else "other"
                found[kind] += judged(model, [own], [], [one])
    return found


def both_tanks() -> list[Row]:
    """Each of the two recordings of the tanks is a model's, and the other one tests."""
    data = tanks(folder())
    pair = data.train[0], data.exams[0].recording
    found = []
    for own, one in (pair, pair[::-1]):
        model = fit([own], Orders(2, 3, 1), FitOptions(units=5))
        found += judged(model, [own], [], [one])
    return found


def public(benchmark: Callable) -> list[Row]:
    """Official splits: the training recordings are the model's, nothing else judges."""
    data = benchmark(folder())
    found = []
    for place, own in enumerate(data.train):
        options = FitOptions(units=5)
        model = fit([own], Orders(2, 3, 1), options)
        exam = data.exams[place]
        whole = exam.recording
        # Where the exam goes on from the training, its beginning has been seen.
        unseen = replace(
            whole, input=whole.input[exam.known :], output=whole.output[exam.known :]
        )
        found += judged(model, [own], [], [unseen])
    return found


def every_split() -> dict[str, list[Row]]:
    """The same recordings in every other role: more of them, which are not independent."""
    drives = coupled_drives()
    return {
        "HSM150, repeats in all six orders": [
            row for order in permutations((1, 2, 3)) for row in hsm150(order)
        ],
        "CED, one for another of its kind": drives["same"],
        "CED, one for another of the other kind": drives["other"],
        "cascaded tanks, either for the other": both_tanks(),
    }


def gun() -> dict[str, list[Row]]:
    """Steps and sines of the virtual gun: models of a step, judged by other steps."""
    names = [f"step_{k:02d}" for k in range(1, 16)] + [
        f"sine_{k:02d}" for k in range(1, 24)
    ]
    machine = replace(GunMachine(), plan=replace(GunPlan(), only=tuple(names)))
    raws = [
        RawRecording(
            one.name, one.input, one.output, machine.plan.sample_time_s, one.kind
        )
        for one in simulate_machine(machine)
    ]
    recipe = CalibrateOptions(
        step=("cut", "output_offset"),
        sine=("cut", "input_offset", "output_offset", "recut"),
        samples=7500,
    )
    recordings = {one.name: one for one in calibrate_all(raws, recipe)[0]}
    rng = np.random.default_rng(26)
    found: dict[str, list[Row]] = {}
    steps = names[:15]
    for own in steps:
        others = [str(one) for one in rng.permutation([n for n in steps if n != own])]
        model = fit([recordings[own]], Orders(3, 4, 1))
        tests = {
            "same": others[2:6],
            "other": [str(one) for one in rng.permutation(names[15:])[:4]],
        }
        for kind, chosen in tests.items():
            unseen = [recordings[one] for one in chosen]
            for count in (2, 8):
                # The four after the first two are the tests.
                names_of_judges = [*others[:2], *others[6:]][:count]
                judges = [recordings[one] for one in names_of_judges]
                rows = judged(model, [recordings[own]], judges, unseen)
                found.setdefault(f"{kind}, {count} judges", []).extend(rows)
    return found


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--plants", type=int, default=320)
    parser.add_argument("--choose", action="store_true")
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--moving", type=float, metavar="DRIFT")
    parser.add_argument("--only", choices=["plants", "joint", "real", "gun"])
    chosen = parser.parse_args()
    found: dict[str, list[Row]] = {}
    if chosen.only in (None, "plants"):
        first = CHOOSING if chosen.choose else REPORTING
        found = plants(chosen.plants, first, chosen.keep, chosen.moving)
    if chosen.only in (None, "joint"):
        show_joint(chosen.plants // 2, CHOOSING if chosen.choose else REPORTING)
    if chosen.only in (None, "real"):
        print(f"\nmeasured\n{HEAD}")
        if folder().is_dir():
            for name, rows, who in (
                ("HSM150", hsm150((1, 2, 3)), "two of its kind"),
                ("CED", public(ced), "none"),
                ("cascaded tanks", public(tanks), "none"),
            ):
                show(name, rows)
                if found:
                    show_chance(who, len(rows), found)
            for name, rows in every_split().items():
                show(name, rows)
        else:
            print("no data: set HWID_REALDATA")
    if chosen.only in (None, "gun"):
        print(f"\nvirtual gun\n{HEAD}")
        for kind, rows in gun().items():
            show(f"models of a step, {kind}", rows)


if __name__ == "__main__":
    main()
