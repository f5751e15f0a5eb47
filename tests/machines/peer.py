"""What a capable user would write in a day: a latent force, and sparse regression on it.

``python -m tests.machines.peer --seeds NAME --work DIR [--write FILE.md]`` on the folders
that ``run_machines`` has left in DIR. The given drive is simulated by a Kalman smoother with
the missing force as a random walk; the smoothed force is regressed on the motion, and terms
of a library are added one by one while the Bayesian criterion falls. It is given what the
program has to find out: the true noise. It answers with the effects that its first term
stands for, which is right where one of them is hidden.

References: Rauch, Tung and Striebel (1965); Alvarez, Luengo and Lawrence (2009), latent
force models; Brunton, Proctor and Kutz (2016), sparse regression of dynamics.
"""

import argparse
import json
from dataclasses import dataclass
from pathlib import Path

import click
import numpy as np
import yaml
from scipy.linalg import expm

from tests.machines.bench import SEEDS
from tests.machines.score import answers

# Variances of the force's steps that are tried, as shares of the largest force squared.
WALKS = np.logspace(-8, 0, 9)
# A term counts where the criterion falls by this much, and at most so many terms.
LEAST_GAIN = 10.0
MOST_TERMS = 4


@dataclass(frozen=True)
class Smoothed:
    """One recording as the smoother sees it; arrays of shape (n_samples,)."""

    time: np.ndarray
    drive: np.ndarray
    x: np.ndarray
    v: np.ndarray
    force: np.ndarray


def smooth(time, drive, output, base, noise, walk) -> tuple[Smoothed, float]:
    """Position, velocity and missing force, and the log-likelihood of the readings.

    Parameters
    ----------
    base : tuple of mass, damping, stiffness
    walk : float, [N^2 per sample]
    """
    mass, damping, stiffness = base
    step = time[1] - time[0]
    rates = np.zeros((4, 4))
    rates[0, 1] = 1.0
    rates[1] = [-stiffness / mass, -damping / mass, 1.0 / mass, 1.0 / mass]
    whole = expm(rates * step)
    turn, gain = whole[:3, :3], whole[:3, 3]
    steps = np.diag([0.0, 0.0, walk])
    force = np.abs(drive).max() + 1e-300
    state = np.array([output[0], 0.0, 0.0])
    spread = np.diag([noise**2, 1e-12, force**2])
    n, likelihood = len(output), 0.0
    before, after = np.empty((n, 3)), np.empty((n, 3))
    wide, narrow = np.empty((n, 3, 3)), np.empty((n, 3, 3))
    for k in range(n):
        if k:
            state = turn @ state + gain * 0.5 * (drive[k - 1] + drive[k])
            spread = turn @ spread @ turn.T + steps
        before[k], wide[k] = state, spread
        variance = spread[0, 0] + noise**2
        missed = output[k] - state[0]
        likelihood -= 0.5 * (missed**2 / variance + np.log(variance))
        share = spread[:, 0] / variance
        state = state + share * missed
        spread = spread - np.outer(share, spread[0])
        after[k], narrow[k] = state, spread
    for k in range(n - 2, -1, -1):
        back = narrow[k] @ turn.T @ np.linalg.pinv(wide[k + 1])
        after[k] = after[k] + back @ (after[k + 1] - before[k + 1])
    return Smoothed(time, drive, after[:, 0], after[:, 1], after[:, 2]), likelihood


def library(parts: list[Smoothed]) -> list[tuple[tuple[str, ...], np.ndarray]]:
    """Terms, each as columns that enter together, with the effects that they stand for."""
    x, v, u, t = (
        np.concatenate([getattr(one, name) for one in parts])
        for name in ("x", "v", "drive", "time")
    )
    rate = np.concatenate([np.gradient(one.drive, one.time) for one in parts])
    jerk = np.concatenate(
        [np.gradient(np.gradient(one.v, one.time), one.time) for one in parts]
    )
    reach, fast = np.abs(x).max(), np.abs(v).max()
    push = np.abs(u).max()
    way = np.tanh(v / (0.01 * fast))
    terms = [
        (("coulomb_friction", "hysteresis"), way),
        (("stribeck_friction",), way * np.exp(-np.abs(v) / (0.05 * fast))),
        (("asymmetric_friction",), np.column_stack([way, np.abs(way)])),
        (("load_friction",), way * np.abs(x)),
        (("load_friction",), way * np.abs(u)),
        (("quadratic_drag",), v * np.abs(v)),
        (("cubic_stiffness",), x**3),
        (("quadratic_stiffness",), x**2),
        (("spring_preload",), np.tanh(x / (0.01 * reach))),
        (("spring_gap",), np.clip(x, -0.05 * reach, 0.05 * reach)),
        (("constant_load",), np.ones_like(x)),
        (("gravity",), np.column_stack([np.sin(x), np.cos(x)])),
        (("force_constant_saturation",), u**3),
        (("supply_sag", "force_constant_saturation"), u * np.abs(u)),
        (("input_dead_zone",), np.clip(u, -0.05 * push, 0.05 * push)),
        (("input_delay", "actuator_lag", "winding_inductance", "rate_limit"), rate),
        (("elastic_coupling", "second_mode", "gear_backlash"), jerk),
        (("thermal_gain_loss",), t * u),
        (("sensor_drift",), t),
        (("input_dead_zone",), np.tanh(u / (0.01 * push))),
    ]
    for share in (0.6, 0.75, 0.9):
        edge = share * reach
        over, under = np.maximum(x - edge, 0.0), np.minimum(x + edge, 0.0)
        terms += [
            (("end_stop",), over + under),
            (("one_sided_stop",), over),
            (("one_sided_stop",), under),
            (
                ("input_saturation", "voltage_limit"),
                u - np.clip(u, -share * push, share * push),
            ),
        ]
    for turns in (2, 3, 5, 8, 12, 20, 32):
        angle = np.pi * turns * x / reach
        waves = np.column_stack([np.sin(angle), np.cos(angle)])
        terms += [
            (("cogging",), waves),
            (("position_friction",), way[:, None] * waves),
            (("torque_ripple",), u[:, None] * waves),
        ]
    for hertz in strongest_lines(parts):
        angle = 2.0 * np.pi * hertz * t
        waves = np.column_stack([np.sin(angle), np.cos(angle)])
        terms.append((("periodic_force", "sensor_hum"), waves))
    return [
        (names, one[:, None] if one.ndim == 1 else one)
        for names, one in terms
        if np.isfinite(one).all()
    ]


def strongest_lines(parts: list[Smoothed]) -> list[float]:
    """The two strongest frequencies of the missing force of the longest recording, [Hz]."""
    longest = max(parts, key=lambda one: len(one.time))
    size = np.abs(np.fft.rfft(longest.force - longest.force.mean()))
    frequencies = np.fft.rfftfreq(len(longest.time), longest.time[1] - longest.time[0])
    return [float(frequencies[k]) for k in np.argsort(size[1:])[::-1][:2] + 1]


def chosen_terms(parts: list[Smoothed]) -> list[tuple[str, ...]]:
    """Effects of the terms that the criterion takes, in the order in which it does."""
    force = np.concatenate([one.force for one in parts])
    known = np.column_stack(
        [
            np.concatenate([getattr(one, name) for one in parts])
            for name in ("x", "v", "drive")
        ]
    )
    # Neighbouring values of a smoothed force say the same: fewer count.
    centred = force - force.mean()
    lag_one = float(centred[1:] @ centred[:-1]) / (float(centred @ centred) + 1e-300)
    count = max(len(force) * (1.0 - lag_one) / (1.0 + lag_one), 30.0)

    def criterion(columns: np.ndarray) -> float:
        scaled = columns / (np.linalg.norm(columns, axis=0) + 1e-300)
        left = force - scaled @ np.linalg.lstsq(scaled, force, rcond=None)[0]
        return count * np.log(left @ left + 1e-300) + columns.shape[1] * np.log(count)

    taken: list[tuple[str, ...]] = []
    terms, columns = library(parts), known
    best = criterion(columns)
    while terms and len(taken) < MOST_TERMS:
        found = [criterion(np.column_stack([columns, one])) for _, one in terms]
        first = int(np.argmin(found))
        if found[first] > best - LEAST_GAIN:
            break
        best = found[first]
        names, one = terms.pop(first)
        taken.append(names)
        columns = np.column_stack([columns, one])
    return taken


def answer(folder: Path) -> list[tuple[str, ...]]:
    """Effects of the chosen terms for one machine's folder."""
    given = yaml.safe_load((folder / "experiment.yaml").read_text())["simulation"]
    truth = json.loads((folder / "truth.json").read_text())
    base = tuple(
        float(given[name])
        for name in ("mass_kg", "damping_N_s_per_m", "stiffness_N_per_m")
    )
    gain = given["force_constant_N_per_A"] / (given.get("resistance_ohm") or 1.0)
    if given.get("resistance_ohm"):
        emf = given.get("back_emf_V_s_per_m") or given["force_constant_N_per_A"]
        base = (base[0], base[1] + gain * emf, base[2])
    signals = []
    for path in sorted((folder / "recordings").glob("*.csv")):
        columns = np.loadtxt(path, delimiter=",", skiprows=1)
        signals.append((columns[:, 0], gain * columns[:, 1], columns[:, 2]))
    largest = max(np.abs(drive).max() for _, drive, _ in signals)

    def total(share: float) -> float:
        walk = share * largest**2
        return sum(
            smooth(*one, base, truth["noise_rms"], walk)[1] for one in signals[:3]
        )

    walk = max(WALKS, key=total) * largest**2
    parts = [smooth(*one, base, truth["noise_rms"], walk)[0] for one in signals]
    return chosen_terms(parts)


def outcome(truth: dict, found: list[tuple[str, ...]]) -> str:
    """``right``, ``wrong`` or ``nothing``; on a clean machine ``right`` or ``false alarm``."""
    if truth["family"] == "clean":
        return "false alarm" if found else "right"
    if not found:
        return "nothing"
    accepted = {
        one for many in answers(truth, "full", "near", "partial") for one in many
    }
    return "right" if set(found[0]) & accepted else "wrong"


def document(rows: list[dict], seeds: str) -> str:
    """The page: shares first, then one line for each machine."""
    hidden = [row for row in rows if row["family"] not in ("clean", "outside")]
    clean = [row for row in rows if row["family"] == "clean"]
    lines = [
        f"# Latent force and sparse regression on {len(rows)} machines, seeds `{seeds}`",
        "",
        "What a capable user would write in a day (`tests/machines/peer.py`): a Kalman smoother for the missing force, a greedy regression on a library of terms.",
        "It is given the true noise, and is right where its first term stands for an effect that is hidden; values, intervals and completeness are not asked for.",
        "",
        "| machines with an effect of the catalogue | number |",
        "|---|---|",
        *(
            f"| {word} | {sum(row['outcome'] == word for row in hidden)} of {len(hidden)} |"
            for word in ("right", "wrong", "nothing")
        ),
        f"| clean machines with a false alarm | {sum(row['outcome'] == 'false alarm' for row in clean)} of {len(clean)} |",
        "",
        "| machine | hidden | first term | outcome |",
        "|---|---|---|---|",
        *(
            f"| {row['name']} | {' + '.join(row['hidden']) or '-'} | {' or '.join(row['found'][0]) if row['found'] else '-'} | {row['outcome']} |"
            for row in rows
        ),
    ]
    return "\n".join(lines) + "\n"


def main() -> None:
    """Answer for every folder, and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", choices=list(SEEDS), required=True)
    parser.add_argument("--work", type=Path, required=True)
    parser.add_argument("--write", type=Path, help="markdown file of the table")
    chosen = parser.parse_args()
    rows = []
    for path in sorted(chosen.work.glob("*/truth.json")):
        truth, found = json.loads(path.read_text()), answer(path.parent)
        told = {name: truth[name] for name in ("name", "family", "hidden")}
        rows.append({**told, "found": found, "outcome": outcome(truth, found)})
        click.echo(f"{truth['name']}: {rows[-1]['outcome']} ({found})")
    text = document(rows, chosen.seeds)
    if chosen.write:
        chosen.write.write_text(text)
    click.echo(text)


if __name__ == "__main__":
    main()
