"""What the name of a column says: its role, how good a choice it is, its unit.

German and English, abbreviations and symbols of control engineering. Words of four and
more letters are also found inside longer ones (``Motorstrom``).
"""

import re
from dataclasses import dataclass

# The better choices first: current before command before voltage, and so on.
_INPUT = [
    "current",
    "strom",
    "amp",
    "amps",
    "ampere",
    "i",
    "iq",
    "im",
    "iz",
    "input",
    "eingang",
    "in",
    "u",
    "command",
    "cmd",
    "stell",
    "stellgroesse",
    "stellgröße",
    "stellwert",
    "excitation",
    "anregung",
    "drive",
    "pwm",
    "duty",
    "voltage",
    "spannung",
    "volt",
    "vir",
    "torque",
    "drehmoment",
    "moment",
    "force",
    "kraft",
    "pump",
    "valve",
    "ventil",
]
_OUTPUT = [
    "displacement",
    "position",
    "pos",
    "weg",
    "auslenkung",
    "hub",
    "stroke",
    "deflection",
    "lage",
    "y",
    "output",
    "ausgang",
    "out",
    "x",
    "z",
    "angle",
    "winkel",
    "phi",
    "theta",
    "rad",
    "distance",
    "abstand",
    "speed",
    "velocity",
    "vel",
    "geschwindigkeit",
    "drehzahl",
    "omega",
    "rpm",
    "qm",
    "q",
    "level",
    "fuellstand",
    "füllstand",
    "pressure",
    "druck",
    "temperature",
    "temperatur",
    "acceleration",
    "beschleunigung",
    "acc",
    "measured",
    "measurement",
]
_TIME = ["time", "zeit", "t", "timestamp", "tijd", "secs", "seconds", "sekunden", "sec"]
_REFERENCE = [
    "ref",
    "reference",
    "soll",
    "sollwert",
    "setpoint",
    "target",
    "desired",
    "demand",
    "qg",
    "qd",
    "führungsgrösse",
]
_COUNTER = [
    "index",
    "idx",
    "no",
    "nr",
    "number",
    "nummer",
    "sample",
    "samples",
    "count",
    "counter",
    "row",
    "id",
]
_SAMPLE_TIME = [
    "ts",
    "dt",
    "h",
    "tsamp",
    "sampletime",
    "samplingtime",
    "samplingperiod",
    "abtastzeit",
    "tvz",
    "tabtast",
]
_SAMPLE_RATE = [
    "fs",
    "samplerate",
    "samplingrate",
    "samplingfrequency",
    "samplefrequency",
    "abtastrate",
    "abtastfrequenz",
    "fabtast",
]

# Units as they stand behind an underscore; in brackets anything may stand.
_UNITS = {
    unit: unit
    for unit in [
        "A",
        "mA",
        "kA",
        "V",
        "mV",
        "kV",
        "N",
        "mN",
        "kN",
        "Nm",
        "mNm",
        "m",
        "mm",
        "cm",
        "um",
        "µm",
        "rad",
        "deg",
        "s",
        "ms",
        "us",
        "rpm",
        "bar",
        "Pa",
        "K",
    ]
} | {"rad_s": "rad/s", "m_s": "m/s", "mm_s": "mm/s", "m_per_s": "m/s"}
# What a unit in brackets says of the role, by its first word.
_INPUT_UNITS = {"a", "ma", "ka", "v", "mv", "kv", "n", "kn", "nm", "n m", "mnm", "%"}
_OUTPUT_UNITS = {
    *("m", "mm", "cm", "um", "µm", "rad", "deg", "°", "grad", "rad/s", "m/s", "mm/s"),
    *("rpm", "1/min", "u/min", "min^-1", "deg/s", "°/s", "inc", "ticks/s"),
}
# Seconds in one unit of a time column.
TIME_UNITS = {"s": 1.0, "sec": 1.0, "sek": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6}

ROLES = ("time", "input", "output", "reference", "counter")
_SHORTEST_INSIDE = 4


@dataclass(frozen=True)
class Meaning:
    """What a name says.

    Parameters
    ----------
    role : str
        One of ``ROLES``; empty where it says nothing.
    rank : int, [-]
        0 for the most usual word of that role.
    unit : str
        Empty where none is named.
    rest : str
        What is left of the name without the word: columns that belong together share it.
    """

    role: str
    rank: int
    unit: str
    rest: str


def meaning_of(title: str) -> Meaning:
    """What the name of a column says.

    Parameters
    ----------
    title : str

    Returns
    -------
    Meaning

    Examples
    --------
    >>> meaning_of("Motorstrom [A]")
    Meaning(role='input', rank=1, unit='A', rest='')
    >>> meaning_of("position_mm").role, meaning_of("position_mm").unit
    ('output', 'mm')
    >>> meaning_of("pos_ref_rad").role, meaning_of("u2").rest
    ('reference', '2')
    """
    bare, unit = _split_unit(title)
    words = _words(bare)
    is_reference = any(_rank(word, _REFERENCE) is not None for word in words)
    role, rank, used = "", 99, ""
    for name, known in (
        ("time", _TIME),
        ("output", _OUTPUT),
        ("input", _INPUT),
        ("counter", _COUNTER),
    ):
        for word in words:
            found = _rank(word, known)
            if found is not None and not role:
                role, rank, used = name, found, word
    if not role and unit:
        role = _role_of_unit(unit)
    if is_reference:
        # A wanted current is what drives the machine; a wanted position is no output.
        role, rank = ("input", rank + 50) if role == "input" else ("reference", rank)
    numbers = "".join(re.findall(r"\d+", bare))
    others = [word for word in words if word != used and not word.isdecimal()]
    return Meaning(role, rank, unit, " ".join([*others, numbers]).strip())


def sample_time_named(title: str, value: float) -> float | None:
    """Sample time that a single number of a file states.

    Parameters
    ----------
    title : str
    value : float

    Returns
    -------
    float or None, [s]
        None where the name means something else.

    Examples
    --------
    >>> sample_time_named("fs", 200.0), sample_time_named("kp", 200.0)
    (0.005, None)
    """
    word = re.sub(r"[^a-zäöü]", "", title.split(".")[-1].lower())
    if not value > 0:
        return None
    if word in _SAMPLE_TIME:
        return value
    # A rate has fewer digits than its reciprocal.
    return float(f"{1.0 / value:.9g}") if word in _SAMPLE_RATE else None


def _split_unit(title: str) -> tuple[str, str]:
    """Name without its unit, and the unit."""
    bracket = re.search(r"[\[(]\s*([^\])]*?)\s*[\])]", title)
    if bracket and bracket[1]:
        return title[: bracket.start()] + title[bracket.end() :], bracket[1]
    worded = re.search(r"(?:/| in )\s*([A-Za-zµ°%]{1,4})$", title)
    if worded and worded[1] in _UNITS:
        return title[: worded.start()], worded[1]
    for suffix, unit in sorted(_UNITS.items(), key=lambda pair: -len(pair[0])):
        if title.endswith(f"_{suffix}") and len(title) > len(suffix) + 1:
            return title[: -len(suffix) - 1], unit
    return title, ""


def _role_of_unit(unit: str) -> str:
    plain = unit.lower()
    if plain in TIME_UNITS:
        return "time"
    if plain in _INPUT_UNITS and unit != "nm":
        return "input"
    return "output" if plain in _OUTPUT_UNITS else ""


def _words(title: str) -> list[str]:
    """Lower-case words of a name, split at marks, digits and capitals."""
    member = title.replace("/", ".").split(".")[-1]
    spaced = re.sub(r"([a-zäöü])([A-ZÄÖÜ])", r"\1 \2", member)
    return [word.lower() for word in re.findall(r"[^\W\d_]+|\d+", spaced)]


def _rank(word: str, known: list[str]) -> int | None:
    for rank, one in enumerate(known):
        if word == one or (len(one) >= _SHORTEST_INSIDE and one in word):
            return rank
    return None
