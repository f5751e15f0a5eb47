"""Write ``docs/effects.md``, its figures and the table of effects in ``configs/README.md``.

All from the catalogue. ``python tools/effects_document.py`` writes them, with ``--check``
it only says whether the text is out of date (exit code 1).
"""

import argparse
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from pathlib import Path

# Run as a file, Python looks for modules beside it and not in the project.
sys.path.insert(0, str(Path(__file__).parents[1]))

from hwid_cli.drive.catalogue import CATALOGUE, configured_effects, public_id
from hwid_cli.drive.effect import Effect, Parameter, Scales, Stated
from hwid_cli.report.diagnosis import quantity_and_unit
from tools.effects_figures import SCALES, draw

DOCS = Path(__file__).parents[1] / "docs"
README = Path(__file__).parents[1] / "configs" / "README.md"
TABLE_HEAD = "| id | law | parameters |\n|---|---|---|\n"
# Of a table in which it is no end of a cell.
BAR = r"\|"
DOCUMENT, FIGURES = DOCS / "effects.md", DOCS / "figures" / "effects"
ENTERS = {
    "command": "the command, before it becomes a current",
    "force": "the force that the current makes",
    "motion": "the forces on the mass",
    "output": "the sensor",
}
# Symbols of the scales.
SYMBOLS = {
    "displacement_m": "X",
    "velocity_m_per_s": "V",
    "current_A": "I",
    "current_rate_A_per_s": "R",
    "stroke_m": "S",
    "force_N": "F",
    "mass_kg": "M",
    "natural_Hz": "fn",
    "sample_time_s": "Ts",
    "duration_s": "T",
    "resistance_ohm": "Ro",
    "reading": "Y",
}
HEAD = """# Effects

Every effect that `hwid diagnose` knows, made from the catalogue by `tools/effects_document.py`. Equations are in SI units; x displacement,
v velocity, i current. The method is in [method_diagnosis.md](method_diagnosis.md).

Each figure shows the drive without and with the effect (left; two steps, then a sine) and what a simulation without it would
lack along that motion (right): a force, or an error of the sensor.

Start values and bounds of the search scale with the recordings: X largest displacement, V largest velocity, I largest current,
R largest rate of the current, S stroke, F = kt I, M mass, fn natural frequency, Ts sample time, T longest recording, Ro resistance,
Y largest reading of the sensor (X, or V where a velocity is measured).

In equations Iref and xr are what losses and errors at the reference count from: the largest current and output of the training
recordings, unless `simulation.reference_current_A` and `reference_displacement_m` say otherwise. `per_turn`, the n of sin(n x + p), counts
periods of a turn where x is an angle in rad, and is 2 pi over the period in m on a straight axis. Laws with a memory start settled at the first
sample (the current of a lag is what is commanded there, a delay and a rate limit have had it before), heating starts cold. Shares of a damper or of friction, s in equations of two
bodies, are those of the body that the motor moves (`motor_damping_share` and the like). Where an effect has several equations, what stands in brackets behind one asks for it in `simulation.effects`:
a word (`curve: tanh`), or one of the parameters that it alone has; with none of them the first is meant.

x counts from the zero of the output, after `calibrate` and less the zero of the sensor where a diagnosis finds one; so do the angles that count along the way (`phase_rad`, `angle_rad`), and the middle of a play, a stop to both sides, a preload and a clearance. Angles in time count from the first sample of a recording.
S is the longest way of one recording, from its smallest to its largest reading; fn that of mass and spring, and at least 2 / T, which it is on a free axis.
"""
CHANGE = "parameter_change"
CHANGE_SENTENCE = (
    "The stiffness, the force constant, the damping or the mass (a load) differs from recording to recording by more than chance. "
    "Each recording gets its own value; the report gives which parameter and the relative standard deviation (`spread`)."
)


def effects_by_public_id() -> dict[str, list[Effect]]:
    """Entries of the catalogue by their public ids, the simplest first.

    Returns
    -------
    dict of str to list of Effect
        Without ``parameter_change``, of which there is one for each parameter.
    """
    found: dict[str, list[Effect]] = {}
    for one in CATALOGUE.values():
        if public_id(one.id) != CHANGE:
            found.setdefault(public_id(one.id), []).append(one)
    return found


def document() -> str:
    """Text of the document.

    Returns
    -------
    str
    """
    entries = effects_by_public_id()
    rows = [
        f"| [{name}](#{name}) | {_sentence(same)} |" for name, same in entries.items()
    ]
    rows.append(f"| [{CHANGE}](#{CHANGE}) | a parameter differs between recordings |")
    parts = [HEAD, "\n".join(["| id | what it is |", "|---|---|", *rows])]
    parts += [_section(name, same) for name, same in entries.items()]
    parts.append(_change())
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


def _section(name: str, entries: Sequence[Effect]) -> str:
    first = entries[0]
    known = {one.name: one for entry in entries for one in entry.parameters}
    lines = [
        f"## {name}",
        "",
        _claim(entries),
        "",
        *(f"    {law}" for law in _laws(entries)),
        "",
        "| parameter | unit | starts | bounds |",
        "|---|---|---|---|",
        *(_row(one) for one in known.values()),
        "",
        f"Enters {ENTERS[first.enters]}.",
    ]
    if first.contains:
        names = ", ".join(f"`{one}`" for one in first.contains)
        lines[-1] += f" Contains {names} as a limit."
    if all(one.needs_spring for one in entries):
        lines[-1] += " Means nothing on a free axis."
    if any(one.needs_circuit for one in entries):
        lines[-1] += " Means nothing where the input is the current."
    if any(one.beside for one in entries):
        lines[-1] += " May occur twice."
    for one in entries:
        if one.words:
            said = ", ".join(f"`{key}: {word}`" for key, word in one.words.items())
            lines[-1] += f" {_claim([one])[:-1]}: {said}."
    # The simplest entry says it best.
    lines += _rivals(entries[::-1])
    lines += ["", f"![{name}](figures/effects/{name}.png)"]
    return "\n".join(lines)


def _laws(entries: Sequence[Effect]) -> list[str]:
    """Different laws of entries with one public id, each with what asks for it."""
    plain = {one.name for one in entries[0].parameters}
    asked = {one.equation: "" for one in reversed(entries)}
    for one in reversed(entries):
        further = [f"`{key.name}`" for key in one.parameters if key.name not in plain]
        said = [f"`{key}: {word}`" for key, word in one.words.items()]
        asked[one.equation] = ", ".join(said or further)
    laws = dict.fromkeys(one.equation for one in entries)
    return [f"{law}   ({asked[law]})" if asked[law] else law for law in laws]


def _sentence(entries: Sequence[Effect]) -> str:
    """What it is; of entries that a word tells apart, what each is."""
    told = [one.sentence for one in entries if one.words] or [entries[0].sentence]
    return "; or ".join(told)


def _claim(entries: Sequence[Effect]) -> str:
    sentence = _sentence(entries)
    return f"{sentence[0].upper()}{sentence[1:]}."


def _change() -> str:
    changes = [one for one in CATALOGUE.values() if public_id(one.id) == CHANGE]
    lines = [f"## {CHANGE}", "", CHANGE_SENTENCE, ""]
    lines += [f"    {one.equation}" for one in changes]
    return "\n".join([*lines, *_rivals(changes)])


def _rivals(entries: Sequence[Effect]) -> list[str]:
    others = {
        other: what for one in entries for other, what in one.confused_with.items()
    }
    if not others:
        return []
    rows = [f"- `{other}`; told apart by {what}." for other, what in others.items()]
    return ["", "Looks like:", "", *rows]


def _row(parameter: Parameter) -> str:
    name, unit = parameter.name, quantity_and_unit(parameter.name)[1]
    notes = [] if parameter.default is None else [f"{parameter.default:g} if left out"]
    notes += ["own value in every recording"] if parameter.is_own else []
    shown = f"{name} ({'; '.join(notes)})" if notes else name
    return f"| {shown} | {unit} | {_starts(parameter)} | {_bounds(parameter)} |"


def readme(text: str) -> str:
    """Text of ``configs/README.md`` with today's table of effects.

    Parameters
    ----------
    text : str
        With any table.

    Returns
    -------
    str
    """
    before, _, rest = text.partition(TABLE_HEAD)
    after = rest[rest.index("\n\n") :]
    laws = {
        name: f"{_claim(same)} {'; or '.join(_laws(same))}"
        for name, same in effects_by_public_id().items()
    }
    laws[CHANGE] = "A parameter differs between recordings."
    rows = [
        f"| `{name}` | {laws[name].replace('|', BAR)} | {_keys(keys)} |"
        for name, keys in configured_effects().items()
    ]
    return before + TABLE_HEAD + "\n".join(rows) + after


def _keys(keys: Sequence[Stated]) -> str:
    """What has to be stated, then what may be left out, in brackets."""
    needed = [_key(one) for one in keys if one.is_needed]
    others = [_key(one) for one in keys if not one.is_needed]
    return ", ".join(needed) + (f" ({', '.join(others)})" if others else "")


def _key(one: Stated) -> str:
    words = ", ".join(f"`{word}`" for word in one.words)
    return f"`{one.name}`" + (f" ({words})" if words else "")


def _starts(parameter: Parameter) -> str:
    if parameter.starts(SCALES) == SCALES.frequencies_Hz:
        return "highest lines in the spectrum of the error"
    return _law_around(parameter.center, parameter.starts)


def _bounds(parameter: Parameter) -> str:
    low, high = parameter.bounds(SCALES)
    if math.isinf(low) and math.isinf(high):
        return "above 0" if parameter.is_positive else "none"
    ends = [
        _law_around(
            parameter.center, lambda scales, n=n: (parameter.bounds(scales)[n],)
        )
        for n in (0, 1)
    ]
    return " to ".join(ends)


def _law_around(center: float, rule: Callable[[Scales], Sequence[float]]) -> str:
    law = _law(lambda scales: [one - center for one in rule(scales)])
    return f"{center:g} + ({law})" if center and " x " in law else _law(rule)


def _law(rule: Callable[[Scales], Sequence[float]]) -> str:
    """A rule as numbers times scales, found by doubling one scale after the other."""
    here = rule(SCALES)
    above, below, value = [], [], 1.0
    for field in fields(Scales):
        if field.name not in SYMBOLS:
            continue
        size = getattr(SCALES, field.name)
        doubled = rule(replace(SCALES, **{field.name: 2 * size}))
        pairs = zip(here, doubled, strict=True)
        powers = [math.log2(new / old) for old, new in pairs if old != 0]
        power = round(powers[0]) if powers else 0
        value *= size**power
        symbol = SYMBOLS[field.name] + (f"^{abs(power)}" if abs(power) > 1 else "")
        if power:
            (above if power > 0 else below).append(symbol)
    numbers = ", ".join(f"{one / value:.3g}" for one in here)
    product = " ".join(above) + (f" / ({' '.join(below)})" if below else "")
    if below and not above:
        product = f"1{product}"
    product = product.replace("(", "").replace(")", "") if len(below) == 1 else product
    return f"{numbers} x {product.strip()}" if above or below else numbers


def main(arguments: Sequence[str] | None = None) -> int:
    """Write or check the document.

    Parameters
    ----------
    arguments : sequence of str or None
        None takes those of the command line.

    Returns
    -------
    int
        Exit code: 0 done, 1 out of date.
    """
    parser = argparse.ArgumentParser(description="Write docs/effects.md.")
    parser.add_argument("--check", action="store_true", help="write nothing")
    chosen = parser.parse_args(arguments)
    texts = {DOCUMENT: document(), README: readme(README.read_text())}
    if chosen.check:
        old = [
            path
            for path, text in texts.items()
            if not path.exists() or path.read_text() != text
        ]
        for path in old:
            sys.stderr.write(f"{path} is out of date; run this without --check\n")
        return int(bool(old))
    for path, text in texts.items():
        path.write_text(text)
    FIGURES.mkdir(parents=True, exist_ok=True)
    for name, same in effects_by_public_id().items():
        draw(same[0], FIGURES / f"{name}.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
