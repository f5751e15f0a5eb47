"""Hides laws in a machine with an integrator of its own, and asks for them back.

``python -m tests.laws.run_laws [--only NAME ...] [--noise 0.005 0.03] [--clean 60]
[--seed 11] [--write docs/laws_measured.md]``: the same recordings, the same residual force
and the same terms for the program, for pysindy and for pyoperon.
"""

import argparse
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from hwid_cli.diagnosis.diagnose import find, held_out_of
from hwid_cli.diagnosis.findings import describe
from hwid_cli.diagnosis.law_terms import library
from hwid_cli.diagnosis.problem import prepare
from hwid_cli.drive.formula import evaluate, parsed
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording
from tests.laws.machine import Base, Hidden, measured

DT, N = 1e-3, 900
TIME = DT * np.arange(N)
# Forces are so many times what the cases say: a gap is left at 3 % noise as well.
STRENGTH = 2.0
# By how much the simulation's parameters are off.
GIVEN = SimulationOptions(
    mass_kg=0.3,
    damping_N_s_per_m=13.0,
    stiffness_N_per_m=1100.0,
    force_constant_N_per_A=5.5,
)
# A law agrees in form where it explains this share of the force anywhere in the box.
LEAST_IN_BOX = 0.95
LEAST_EXPLAINED = 0.8


@dataclass(frozen=True)
class Case:
    """A hidden law.

    Parameters
    ----------
    force : callable
        Of x, v, u, t and the direction; or of x, v, u, t for what a sensor reads.
    forms : tuple of frozenset of str
        Kinds of terms that are the law, as the program names them.
    """

    force: object
    forms: tuple
    has_friction: bool = False
    is_sensor: bool = False

    @property
    def hidden(self):
        if self.is_sensor:
            return Hidden(sensor=self.force)
        return Hidden(self.strong, has_friction=self.has_friction)

    def strong(self, *at):
        return STRENGTH * self.force(*at)


def law(force, *forms, dry=False, sensor=False):
    kinds = tuple(frozenset(one if isinstance(one, tuple) else (one,)) for one in forms)
    return Case(force, kinds, dry, sensor)


sgn, ab = np.sign, np.abs
CASES = {
    "x v": law(lambda x, v, u, t, w: -400 * x * v, "x*v"),
    "|x| v": law(lambda x, v, u, t, w: -400 * ab(x) * v, "abs(x)*v"),
    "x^2 v": law(lambda x, v, u, t, w: -35000 * x**2 * v, "x**2*v"),
    "x |v|": law(lambda x, v, u, t, w: -350 * x * ab(v), "x*abs(v)"),
    "x v |v|": law(lambda x, v, u, t, w: -600 * x * v * ab(v), "x*v*abs(v)"),
    "x |x|": law(lambda x, v, u, t, w: -12000 * x * ab(x), "x*abs(x)"),
    "x^5": law(lambda x, v, u, t, w: -6e9 * x**5, "x**5"),
    "sqrt x": law(lambda x, v, u, t, w: -14 * np.sqrt(ab(x)) * sgn(x), "abs(x)**0.5*sign(x)"),
    "x^1.5": law(lambda x, v, u, t, w: -1500 * ab(x) ** 1.5 * sgn(x), "abs(x)**1.5*sign(x)"),
    "v^3": law(lambda x, v, u, t, w: -55 * v**3, "v**3"),
    "v^1.5": law(lambda x, v, u, t, w: -10 * ab(v) ** 1.5 * sgn(v), "abs(v)**1.5*sign(v)"),
    "sqrt v": law(lambda x, v, u, t, w: -2.5 * np.sqrt(ab(v)) * sgn(v), "abs(v)**0.5*sign(v)"),
    "|x|, one side stiffer": law(lambda x, v, u, t, w: -120 * ab(x), "abs(x)"),
    "|u|, one sign more": law(lambda x, v, u, t, w: 0.4 * ab(u), "abs(u)"),
    "u x^2": law(lambda x, v, u, t, w: -2000 * u * x**2, "u*x**2"),
    "u |x|": law(lambda x, v, u, t, w: -45 * u * ab(x), "u*abs(x)"),
    "u v": law(lambda x, v, u, t, w: 1.5 * u * v, "u*v"),
    "|u| v": law(lambda x, v, u, t, w: -1.5 * ab(u) * v, "abs(u)*v"),
    "t v": law(lambda x, v, u, t, w: -8 * t * v, "t*v"),
    "t x": law(lambda x, v, u, t, w: -200 * t * x, "t*x"),
    "friction + x": law(
        lambda x, v, u, t, w: -(1.0 + 60 * x) * w, ("sign(v)", "x*sign(v)"), dry=True
    ),
    "friction + x^2": law(
        lambda x, v, u, t, w: -(0.8 + 6000 * x**2) * w, ("sign(v)", "x**2*sign(v)"), dry=True
    ),
    "friction and |u| v": law(
        lambda x, v, u, t, w: -0.6 * w - 1.0 * ab(u) * v, ("sign(v)", "abs(u)*v"), dry=True
    ),
    "friction that grows": law(
        lambda x, v, u, t, w: -(0.4 + 1.2 * t) * w, ("sign(v)", "t*sign(v)"), dry=True
    ),
    "friction and x v": law(
        lambda x, v, u, t, w: -0.8 * w - 350 * x * v, ("sign(v)", "x*v"), dry=True
    ),
    "friction and v^3": law(
        lambda x, v, u, t, w: -0.8 * w - 45 * v**3, ("sign(v)", "v**3"), dry=True
    ),
    "x |x| and u v": law(
        lambda x, v, u, t, w: -10000 * x * ab(x) + 1.5 * u * v, ("x*abs(x)", "u*v")
    ),
    "beyond a speed": law(
        lambda x, v, u, t, w: -10 * np.maximum(ab(v) - 0.25, 0) * sgn(v), "beyond a speed"
    ),
    "an eddy brake": law(
        lambda x, v, u, t, w: -14 * v / (1 + (v / 0.25) ** 2), "brakes less beyond a speed"
    ),
    "a magnet beside the way": law(
        lambda x, v, u, t, w: 1.2 / (1 + ((x - 0.004) / 0.0015) ** 2), "peaks at a place"
    ),
    "air near a wall": law(
        lambda x, v, u, t, w: 0.6 * np.exp(-x / 0.008), "fades along the way"
    ),
    "a magnet across a gap": law(
        lambda x, v, u, t, w: 1.5 / (1 - x / 0.05) ** 2, "pulls across a gap ahead"
    ),
    "a coil across a gap": law(
        lambda x, v, u, t, w: 0.25 * u**2 / (1 + x / 0.05) ** 2, "input pulls across a gap behind"
    ),
    "waves of damping": law(
        lambda x, v, u, t, w: -7 * np.sin(2 * np.pi * x / 0.007) * v, "wave*v sin", ("wave*v sin", "wave*v cos")
    ),
    "a late sensor": law(lambda x, v, u, t: x - 0.003 * v, "v", sensor=True),
    "a sensor of two sides": law(lambda x, v, u, t: x + 0.03 * ab(x), "abs(x)", sensor=True),
    "a sensor that fades": law(lambda x, v, u, t: x - 0.05 * t * x, "t*x", sensor=True),
}  # fmt: skip


def signals(rng):
    """Steps, sines and sums of sines after a rest."""
    on = TIME > 0.05
    for share in (0.5, -0.8, 1.0):
        yield "step", f"step_{share}", 3 * share * (on & (TIME < 0.55))
    for frequency, share in ((1.5, 0.9), (3, 0.5), (4, 1.0), (7, 0.8)):
        turns = frequency * (TIME - 0.05)
        yield "sine", f"sine_{frequency}", 3 * share * np.sin(2 * np.pi * turns) * on
    for count in (1, 2):
        waves = sum(
            np.sin(2 * np.pi * f * TIME + rng.uniform(0, 6)) for f in (1, 2, 4, 6, 9)
        )
        yield "random", f"multi_{count}", 1.2 * waves * on


def recordings(hidden, noise, seed):
    """What a noisy sensor reads of the machine; noise as a share of the largest reading."""
    rng = np.random.default_rng(seed)
    plain = [
        (kind, name, u, measured(u, DT, Base(), hidden)[0])
        for kind, name, u in signals(rng)
    ]
    largest = max(float(np.max(np.abs(y))) for *_, y in plain)
    return [
        Recording(name, u, y + noise * largest * rng.standard_normal(N), DT, kind=kind)
        for kind, name, u, y in plain
    ]


def in_turn(tasks, *, keep):
    return [one.function(*one.arguments) for one in tasks]


def searched(found):
    """Findings of the program with the catalogue left out."""
    options = DiagnoseOptions(laws="only")
    problem = prepare(found, GIVEN, options, held_out_of(found, options))
    return find(problem, options, in_turn, lambda what, total: None)


def box(findings, n=4000):
    """States anywhere in the box of the recordings, each variable for itself."""
    rng = np.random.default_rng(5)
    missing = findings.scales.missing.variables
    return {
        name: rng.uniform(*np.quantile(values, (0.01, 0.99)), n)
        for name, values in missing.items()
    }


def agreement(case, states, values):
    """Share of the true force that a formula has, but for what is the base's."""
    x, v, u, t = (states[name] for name in "xvut")
    if case.is_sensor:
        true = case.force(x, v, u, t)
    else:
        true = case.strong(x, v, u, t, np.sign(v))
    base = np.column_stack([np.ones(x.size), x, v, u])
    base = np.linalg.qr(base / np.max(np.abs(base), axis=0))[0]
    wanted, given = (one - base @ (base.T @ one) for one in (true, values))
    return 1 - float(np.sum((wanted - given) ** 2) / np.sum(wanted**2))


def form_of(findings):
    """Terms of the law: formulas, families where a shape is fitted."""
    found = set()
    for one in findings.law.terms:
        is_power = one.term.family.startswith("power of ")
        has_shape = one.term.family and not is_power
        found.add(one.term.family if has_shape else one.term.formula)
    return frozenset(found)


def with_pysindy(findings, case, states):
    """Sequentially thresholded least squares of the same residual force on the terms."""
    import pysindy

    missing = findings.scales.missing
    terms = library(findings.scales)

    def columns(at):
        linear = [at["x"], at["v"], at["u"]]
        rest = [np.broadcast_to(one.values(at), at["x"].shape) for one in terms]
        return np.column_stack([np.ones(at["x"].size), *linear, *rest])

    matrix = columns(missing.variables)
    sizes = np.sqrt(np.mean(matrix**2, axis=0))
    sizes[sizes == 0] = 1.0
    scale = float(np.std(missing.force)) or 1.0
    best = None
    half = np.arange(matrix.shape[0]) % 2 == 0
    for threshold in (0.05, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8):
        optimizer = pysindy.STLSQ(threshold=threshold, alpha=1e-3)
        optimizer.fit(matrix[half] / sizes, missing.force[half, None] / scale)
        weights = np.ravel(optimizer.coef_)
        left = missing.force[~half] / scale - matrix[~half] / sizes @ weights
        used = np.count_nonzero(weights[4:])
        # The criterion with a hundred samples that count: neighbours go together.
        cost = np.log(np.mean(left**2)) + np.log(100) / 100 * used
        if best is None or cost < best[0]:
            best = cost, weights
    weights = best[1] / sizes * scale
    values = columns(states) @ weights
    form = frozenset(
        one.formula for one, weight in zip(terms, weights[4:], strict=True) if weight
    )
    return form, agreement(case, states, values)


def with_pyoperon(findings, case, states, seconds):
    """Genetic programming on the same residual force."""
    from pyoperon.sklearn import SymbolicRegressor

    missing = findings.scales.missing
    names = "xvut"
    inputs = np.column_stack([missing.variables[one] for one in names])
    sizes = np.std(inputs, axis=0)
    scale = float(np.std(missing.force)) or 1.0
    model = SymbolicRegressor(
        allowed_symbols="add,sub,mul,div,constant,variable,abs,square,sqrt,sin,tanh",
        objectives=["r2", "length"],
        max_length=25,
        population_size=500,
        pool_size=500,
        generations=1000,
        max_time=seconds,
        n_threads=1,
        random_state=1,
    )
    model.fit(inputs / sizes, missing.force / scale)
    at = np.column_stack([states[one] for one in names])
    values = np.nan_to_num(model.predict(at / sizes) * scale)
    return agreement(case, states, values)


def row_of(name, case, noise, seed, seconds):
    """One hidden law at one noise, found by the program and by two others."""
    began = time.time()
    found = recordings(case.hidden, noise, seed)
    made = time.time()
    findings = searched(found)
    told = describe(findings)
    own = time.time() - made
    states = box(findings)
    form, right, in_box = "", False, float("nan")
    if told.law is not None:
        right = form_of(findings) in case.forms
        at = evaluate(parsed(told.law.formula), states)
        if told.law.acts_on == "input":
            gain = next(
                one.after for one in told.base if one.name.startswith("force_c")
            )
            at = gain * (at - states["u"])
        in_box = agreement(case, states, np.broadcast_to(at, states["x"].shape))
        form = told.law.formula
    elif told.verdict == "named":
        form = "+".join(one.id for one in told.effects)
    row = {
        "law": name, "noise": noise, "verdict": told.verdict, "formula": form,
        "right": right, "explained": told.explained_share, "in box": in_box,
        "before": told.before.ratio_to_noise, "after": told.after.ratio_to_noise,
        "seconds": own,
    }  # fmt: skip
    if not case.is_sensor:
        sindy_form, row["pysindy in box"] = with_pysindy(findings, case, states)
        row["pysindy right"] = sindy_form in case.forms
        row["pysindy terms"] = len(sindy_form)
        row["pyoperon in box"] = with_pyoperon(findings, case, states, seconds)
    row["made"] = made - began
    return row


def clean_row(noise, seed):
    """A machine that lacks nothing, with parameters that are off."""
    told = describe(searched(recordings(Hidden(), noise, seed)))
    return told.verdict


def summary(rows):
    """Figures by noise."""
    lines = []
    for noise in sorted({one["noise"] for one in rows}):
        some = [one for one in rows if one["noise"] == noise]
        right = [one for one in some if one["right"]]
        explained = [one for one in right if one["explained"] >= LEAST_EXPLAINED]
        forces = [one for one in some if "pysindy right" in one]
        n = len(forces)
        lines.append(
            f"noise {100 * noise:g} %: right form {len(right)} of {len(some)}, of which "
            f"{len(explained)} explain at least 80 % of the held-out gap; wrong laws "
            f"{sum(one['verdict'] == 'law' and not one['right'] for one in some)}, "
            f"refused {sum(one['verdict'] not in ('law', 'named') for one in some)}; of "
            f"{n} forces, right anywhere in the box (share >= {LEAST_IN_BOX}): this "
            f"{sum(one['in box'] >= LEAST_IN_BOX for one in forces)}, pysindy "
            f"{sum(one['pysindy in box'] >= LEAST_IN_BOX for one in forces)} (right form "
            f"{sum(one['pysindy right'] for one in forces)}), pyoperon "
            f"{sum(one['pyoperon in box'] >= LEAST_IN_BOX for one in forces)}"
        )
    return lines


def shown(value):
    if isinstance(value, bool):
        return "yes" if value else "no"
    return f"{value:.3g}" if isinstance(value, float) else str(value)


def main():
    """Run what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", nargs="+", default=[])
    parser.add_argument("--noise", nargs="+", type=float, default=[0.005, 0.03])
    parser.add_argument("--clean", type=int, default=50)
    parser.add_argument("--seed", type=int, default=11)
    parser.add_argument(
        "--seconds", type=int, default=4, help="of pyoperon for one law"
    )
    parser.add_argument("--write", type=Path)
    options = parser.parse_args()
    rows = []
    for name, case in CASES.items():
        if options.only and name not in options.only:
            continue
        for noise in options.noise:
            row = row_of(name, case, noise, options.seed, options.seconds)
            rows.append(row)
            print(
                *(f"{key}={shown(one)}" for key, one in row.items()),
                sep=" | ",
                flush=True,
            )
    words = [
        clean_row(noise, 1000 + seed)
        for seed in range(options.clean // len(options.noise))
        for noise in options.noise
    ]
    lines = summary(rows)
    if words:
        counts = {word: words.count(word) for word in sorted(set(words))}
        lines.append(f"clean machines: {counts}")
    print(*lines, sep="\n")
    if options.write and rows:
        options.write.write_text(as_markdown(rows, lines))


def as_markdown(rows, lines):
    """Table of all laws."""
    heads = [
        "law", "noise", "verdict", "formula", "right", "explained", "in box", "after",
        "pysindy right", "pysindy terms", "pysindy in box", "pyoperon in box",
    ]  # fmt: skip
    table = ["| " + " | ".join(heads) + " |", "|" + "---|" * len(heads)]
    for one in rows:
        cells = [shown(one.get(head, "-")).replace("|", "\\|") for head in heads]
        table.append("| " + " | ".join(cells) + " |")
    return "\n".join([*(f"- {line}" for line in lines), "", *table]) + "\n"


if __name__ == "__main__":
    main()
