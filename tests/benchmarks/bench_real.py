"""Hammerstein-Wiener fits of public benchmarks with their official splits.

``make bench-real`` runs this file. Everything is chosen from training data alone (see
`real_selection`); test outputs are only scored. Published: Champneys, Beintema, Toth,
Schoukens, Rogers, IFAC-PapersOnLine 58(15), 2024 (arXiv 2405.10779).
"""

import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

from hwid_cli.model.fit import fit
from hwid_cli.records.model import FitOptions, Orders
from tests.benchmarks.real_data import (
    METHODS,
    Benchmark,
    ced,
    emps,
    error,
    folder,
    silverbox,
    tanks,
)
from tests.benchmarks.real_selection import Setting, judge, select

JOINED = FitOptions(join="experiments")
INPUT_MAPS = (
    {"input_map": "none"},
    {"input_map": "saturation"},
    {"input_map": "piecewise_linear", "input_units": 4},
)
OUTPUT_MAPS = (
    {"output_map": "none"},
    {"output_map": "saturation"},
    {"output_map": "polynomial"},
    {"output_map": "piecewise_linear", "output_units": 4},
    {"output_map": "piecewise_linear", "output_units": 6},
    {"output_map": "piecewise_linear", "output_units": 10},
    {"output_map": "cubic_spline", "output_units": 5},
    {"output_map": "cubic_spline", "output_units": 8},
    {"output_map": "sigmoid_network", "output_units": 3},
)
# Small recordings afford a full look; large ones with a wrong structure do not need it.
WIDE = (
    [
        Orders(nb, nf, nk)
        for nf in range(1, 7)
        for nb in range(1, nf + 1)
        for nk in (0, 1, 2)
    ],
    [JOINED] + [replace(JOINED, **f, **g) for f, g in product(INPUT_MAPS, OUTPUT_MAPS)],
)
NARROW = (
    [Orders(n, n, nk) for n in (2, 3) for nk in (0, 1)],
    [JOINED]
    + [
        replace(JOINED, **f, **g)
        for f, g in product(INPUT_MAPS[:1], (OUTPUT_MAPS[0], *OUTPUT_MAPS[2:5:2]))
    ],
)


def run(title: str, benchmark: Benchmark, candidates: tuple) -> float:
    """Choose, fit to all training data, print a row for each test; the rule's score."""
    begun = time.perf_counter()
    best, count = select(*candidates, lambda setting: judge(benchmark.train, setting))
    seconds = time.perf_counter() - begun
    begun = time.perf_counter()
    result = fit(benchmark.train, best.setting.orders, best.setting.options)
    fit_s = time.perf_counter() - begun
    print(
        f"\n{title}: {described(best.setting)}; {best.n_parameters} parameters; "
        f"{count} candidates in {seconds:.0f} s, the fit {fit_s:.2f} s; "
        f"score {best.score:.3f}"
    )
    if result.model is None:
        print(f"no model: {result.message}")
        return best.score
    scale = benchmark.per_unit
    print(f"training RMSE {scale * result.rmsd:.4g} {benchmark.unit}")
    for exam in benchmark.exams:
        row(exam.name, scale * error(result.model, exam), exam.published)
    return best.score


def coupled_drives(both: Benchmark) -> None:
    """One model for both records, and one for each; training data say which to take."""
    joint = run("CED, one joint model", both, WIDE)
    own = [
        run(
            f"{one.name}, a model of its own",
            replace(both, train=(one,), exams=(exam,)),
            WIDE,
        )
        for one, exam in zip(both.train, both.exams, strict=True)
    ]
    mean = sum(own) / len(own)
    choice = "the joint model" if joint < mean else "a model for each"
    print(f"\nCED: scores {joint:.3f} joint, {mean:.3f} each its own: {choice}")


def described(setting: Setting) -> str:
    """Orders and maps in a few words."""
    orders, options = setting.orders, setting.options
    sides = [
        one.kind if one.kind in ("none", "saturation") else f"{one.kind} {size}"
        for one in (options.of_input, options.of_output)
        for size in [one.degree if one.kind == "polynomial" else one.units]
    ]
    return f"[{orders.nb} {orders.nf} {orders.nk}], {sides[0]} -> {sides[1]}"


def row(name: str, ours: float, published: Sequence[float]) -> None:
    """One test beside the published errors."""
    others = "".join(f"{one:11.4g}" for one in published)
    print(f"{name:26}{ours:9.4g}{others}{ours / published[0]:13.2f}")


def main() -> None:
    """All benchmarks that are there."""
    where = folder()
    if not where.is_dir():
        print(f"{where} not found: no real data; name their folder in HWID_REALDATA")
        return
    print(
        f"{'test':26}{'hwid':>9}{''.join(f'{one:>11}' for one in METHODS)}  ours/linear"
    )
    coupled_drives(ced(where))
    run("Cascaded tanks", tanks(where), WIDE)
    if "--right-structures-only" in sys.argv:
        return
    run(
        "Silverbox (wrong structure: a spring inside the loop)",
        silverbox(where),
        NARROW,
    )
    run("EMPS (wrong structure: friction inside a closed loop)", emps(where), NARROW)


if __name__ == "__main__":
    main()
