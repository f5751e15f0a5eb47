"""Models with every kind of map, every initial-state rule and many orders."""

import subprocess

import numpy as np
import pytest

from hwid_cli.export.c_source import c_source
from hwid_cli.export.contents import completed
from hwid_cli.model import static_map
from hwid_cli.model.extrapolation import extrapolated_map
from hwid_cli.model.static_map import RULES
from hwid_cli.records.experiment import Columns
from hwid_cli.records.exported import ModelCard
from hwid_cli.records.maps import StaticMap
from hwid_cli.records.model import HammersteinWiener
from tests.model.plants import MAPS

# Prints the output for each input that it reads; 1 empty, 2 steady, else by the rule.
MAIN = """
#include <stdio.h>
#include <stdlib.h>
#include "model.c"

int main(int argc, char **argv)
{
    static hwid_state state;
    const int start = argc > 1 ? atoi(argv[1]) : 0;
    double u;
    if (start == 1) {
        hwid_init_empty(&state);
    } else if (start == 2) {
        hwid_init_steady(&state);
    } else {
        hwid_init(&state);
    }
    while (fread(&u, sizeof u, 1, stdin) == 1) {
        const double y = hwid_step(&state, u);
        fwrite(&y, sizeof y, 1, stdout);
    }
    return 0;
}
"""
STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion")
# Those that leave the program for C.
KINDS = tuple(kind for kind, rule in RULES.items() if rule.portable.c is not None)
STARTS = {"fitted": 0, "empty": 1, "steady": 2}


def example_map(kind, rng, scale=1.0):
    """Map of a kind over -scale to scale."""
    count = int(rng.integers(3, 9))
    rising = np.sort(rng.uniform(-0.9, 0.9, count))
    network = (
        rng.uniform(-0.8, 0.8, count),
        rng.uniform(0.1, 0.6, count),
        rng.normal(0, 0.3, count),
        rng.normal(0, 1, 2),
    )
    parameters = {
        "piecewise_linear": np.concatenate([rising, rng.normal(0, 1, count)]),
        "polynomial": rng.normal(0, 0.5, count),
        "sigmoid_network": np.concatenate(network),
        "wavelet_network": np.concatenate(network),
        "cubic_spline": np.concatenate([[-0.8, 0.9], rng.normal(0, 1, count)]),
        "piecewise_constant": np.concatenate([rising, rng.normal(0, 1, count + 1)]),
    }.get(kind)
    if parameters is None:
        # Kinds whose parameters are always as many: the example of all other tests.
        return static_map.stretch(MAPS[kind], scale / MAPS[kind].domain[1])
    if kind != "polynomial":
        parameters = parameters * scale
    return StaticMap(kind, parameters, (-scale, scale))


def extrapolated_example(one):
    """Map that is extrapolated across a gap and beyond what samples visited."""
    width = one.domain[1]
    visited = np.r_[np.linspace(-0.7, -0.2, 30), np.linspace(0.05, 0.8, 30)]
    return extrapolated_map(one, width * visited)


def example_model(seed, *, kinds=None, nb=2, nf=2, nk=1, rule="estimated"):
    """Stable model with random numbers; maps of odd seeds are extrapolated."""
    rng = np.random.default_rng(seed)
    kinds = kinds or ("piecewise_linear", "sigmoid_network")
    radius, angle = rng.uniform(0.3, 0.9, nf), rng.uniform(0, np.pi, nf)
    pairs = [
        p
        for r, a in zip(radius[: nf // 2], angle, strict=False)
        for p in (r * np.exp(1j * a), r * np.exp(-1j * a))
    ]
    found = [*pairs, *radius[nf // 2 :][: nf % 2]]
    denominator = np.real(np.poly(found)) if found else np.ones(1)
    n_state = max(nf, nb + nk - 1)
    first, numerator = example_map(kinds[0], rng), rng.normal(0, 1, nb)
    maps = (first, example_map(kinds[1], rng, 3.0))
    if seed % 2:
        maps = tuple(extrapolated_example(one) for one in maps)
    return HammersteinWiener(
        maps[0],
        numerator,
        denominator,
        nk,
        maps[1],
        1e-3,
        rule,
        rng.normal(0, 1, n_state) if rule == "estimated" else np.zeros(0),
    )


def exported_of(model, name="step_06/3/7", **card):
    columns = Columns(input="current_A", output="displacement_m", time="time_s")
    card = {"input_range": (-1.5, 1.5), **card}
    return completed(
        ModelCard(name, "NLHW-Step-6-3-7-1", columns, **card),
        model,
    )


def example_input(seed, n=400):
    rng = np.random.default_rng(seed)
    steps = np.repeat(rng.uniform(-1.5, 1.5, n // 20), 20)
    return steps + 0.1 * rng.normal(size=steps.size)


def compiled(folder, source, main=MAIN):
    """Program around a model's C source."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "model.c").write_text(source)
    (folder / "main.c").write_text(main)
    done = subprocess.run(
        ["cc", *STRICT, "-O1", "-o", "run", "main.c", "-lm"],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        pytest.fail(done.stderr)
    return folder / "run"


def c_output(program, signal, start="fitted"):
    done = subprocess.run(
        [str(program), str(STARTS[start])],
        input=np.asarray(signal, dtype=np.float64).tobytes(),
        capture_output=True,
        check=True,
    )
    return np.frombuffer(done.stdout)


def c_program(folder, exported):
    return compiled(folder, c_source(exported))


def deviation(found, expected):
    """Largest difference over the largest value."""
    assert found.shape == expected.shape
    # Behind a dead zone an output may be nothing but zeros.
    largest = float(np.max(np.abs(expected))) or 1.0
    return float(np.max(np.abs(found - expected))) / largest
