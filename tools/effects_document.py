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

from hwid_cli.drive.catalogue import (
    CATALOGUE,
    configured_effects,
    public_id,
    word_of,
)
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
"""
CHANGE_SENTENCE = (
    "The stiffness, the force constant or the damping differs from recording to recording by more than chance. "
    "Each recording gets its own value; the report gives which parameter and the relative standard deviation (`spread`)."
)


def plain_effects() -> list[Effect]:
    """Effects with parameters of their own, by the first entry of each public id.

    Returns
    -------
    list of Effect
        All but ``parameter_change``, of which there is one for each parameter.
    """
    first = {public_id(one.id): one for one in reversed(CATALOGUE.values())}
    return [first[name] for name in configured_effects() if name != "parameter_change"]


def entries_of(public: str) -> list[Effect]:
    """Entries of the catalogue with a public id.

    Parameters
    ----------
    public : str
        Public id.
    """
    return [one for one in CATALOGUE.values() if public_id(one.id) == public]


def document() -> str:
    """Text of the document.

    Returns
    -------
    str
    """
    plain = plain_effects()
    rows = [f"| {_link(one)} | {_short(one)} |" for one in plain]
    rows.append(
        "| [parameter_change](#parameter_change) | a parameter differs between recordings |"
    )
    parts = [HEAD, "\n".join(["| id | what it is |", "|---|---|", *rows])]
    parts += [_section(one) for one in plain]
    parts.append(_change())
    return "\n\n".join(part.strip("\n") for part in parts) + "\n"


def _link(effect: Effect) -> str:
    name = public_id(effect.id)
    return f"[{name}](#{name})"


def _short(effect: Effect) -> str:
    """What all entries of an id have in common."""
    return effect.sentence.partition(";")[0] if word_of(effect.id) else effect.sentence


def _section(effect: Effect) -> str:
    name = public_id(effect.id)
    entries = entries_of(name)
    lines = [f"## {name}", ""]
    for one in entries:
        told = word_of(one.id)
        word = f"`{told[0]}: {told[1]}`: " if told else ""
        lines += [f"{word}{_claim(one)}", "", f"    {one.equation}", ""]
    lines += [
        "| parameter | unit | starts | bounds |",
        "|---|---|---|---|",
        *(_row(one) for one in effect.parameters),
        "",
        f"Enters {ENTERS[effect.enters]}.",
    ]
    if effect.contains:
        names = ", ".join(f"`{one}`" for one in effect.contains)
        lines[-1] += f" Contains {names} as a limit."
    if effect.needs_spring:
        lines[-1] += " Means nothing on a free axis."
    if effect.needs_circuit:
        lines[-1] += " Means nothing where the input is the current."
    lines += _rivals(entries)
    lines += ["", f"![{name}](figures/effects/{name}.png)"]
    return "\n".join(lines)


def _claim(effect: Effect) -> str:
    return f"{effect.sentence[0].upper()}{effect.sentence[1:]}."


def _change() -> str:
    changes = entries_of("parameter_change")
    lines = ["## parameter_change", "", CHANGE_SENTENCE, ""]
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
        name: " Or: ".join(f"{_claim(one)} {one.equation}" for one in entries_of(name))
        for name in configured_effects()
    }
    laws["parameter_change"] = "A parameter differs between recordings."
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
    for effect in plain_effects():
        draw(effect, FIGURES / f"{public_id(effect.id)}.png")
    return 0


if __name__ == "__main__":
    sys.exit(main())
