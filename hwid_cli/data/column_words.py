"""What the name of a column says: its role, how good a choice it is, its unit.

German and English, abbreviations and symbols of control engineering. Words of four and
more letters are also found inside longer ones (``Motorstrom``).
"""

import re
from dataclasses import dataclass

from hwid_cli.data.units import split_unit

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
    "trq",
    "strm",
    "uq",
    "ua",
    "ia",
    *("heater", "heating", "heiz", "throttle", "drossel", "blower", "laser", "led"),
    *("power", "leistung"),
]
_OUTPUT = [
    "displacement",
    "disp",
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
    "erpm",
    "qm",
    "q",
    "level",
    "fuellstand",
    "füllstand",
    "pressure",
    "druck",
    "temperature",
    "temperatur",
    "temp",
    "acceleration",
    "beschleunigung",
    "acc",
    "velo",
    "n",
    "encoder",
    "resolver",
    "tacho",
    "lvdt",
    *(
        "contraction",
        "elongation",
        "extension",
        "strain",
        "dehnung",
        "flow",
        "durchfluss",
    ),
    *("thermocouple", "thermoelement", "photodiode", "detector", "microphone", "sound"),
    *("concentration", "konzentration", "height"),
]
# Outputs that may drive something else as well, as a fan's speed does a pressure.
_MAY_DRIVE = {
    *("speed", "velocity", "vel", "geschwindigkeit", "drehzahl", "rpm", "pressure"),
    *("druck", "flow", "durchfluss", "temperature", "temperatur", "temp"),
}
# Rank of a role that no word tells, but the unit.
OF_UNIT = 99
# Of several outputs these are hardly ever meant: how warm a machine is, how it shakes.
_HARDLY_MEANT = [
    "acceleration",
    "beschleunigung",
    "acc",
    "temperature",
    "temperatur",
    "temp",
]
# Words that say that something was measured: another word, or the unit, says what.
_MEASURED = [
    *("measured", "measurement", "istwert", "fb", "feedback"),
    *("transmitter", "sensor", "probe"),
]
_TIME = [
    *("time", "zeit", "t", "timestamp", "tijd", "secs", "seconds", "sekunden", "sec"),
    "stamp",
]
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
    "führungsgröße",
]
_ENDS_IN_REF = re.compile("[a-z]{1,3}ref")
# Whole numbers under such a name say which recording a row belongs to.
_RECORDINGS = [
    *("run", "trial", "recording", "experiment", "segment", "id", "series", "session"),
    *("versuch", "messung", "lauf", "durchgang", "serie", "aufnahme"),
]
# Words of what is wanted, where another word says of what: position command.
_WANTED = ["cmd", "command", "commanded", "set", "sp", "dem", "cmnd", "vorgabe"]
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
# What tells how a machine is and not how it moves; with a unit it may be a signal.
_STATES = [
    *("state", "status", "mode", "flag", "flags", "enable", "enabled", "ready", "bit"),
    *("zustand", "modus", "freigabe", "fault"),
]
# Currents and voltages of an axis, where the axis may stand apart: i_q.
_OF_AXES = {"iq", "uq", "ia", "ua"}
# What a unit in brackets says of the role, by its first word.
_INPUT_UNITS = {"a", "ma", "ka", "v", "mv", "kv", "n", "kn", "nm", "n m", "mnm", "%"}
_PLACE_UNITS = {"m", "mm", "cm", "um", "µm", "rad", "deg", "°", "grad"}
_OUTPUT_UNITS = {
    *("m", "mm", "cm", "um", "µm", "rad", "deg", "°", "grad", "rad/s", "m/s", "mm/s"),
    *("rpm", "1/min", "u/min", "min^-1", "deg/s", "°/s", "inc", "ticks/s"),
}
# Words that name a plug of an instrument and not a quantity, and units that do say it.
_PLUGS = {"in", "input", "eingang", "out", "output", "ausgang", "amp"}
# A light source shines on a process or measures a distance: the unit says which.
_SOURCES_OR_SENSORS = {"laser", "led"}
# What leaves one of these drives the machine: amp out.
_AMPLIFIERS = {
    *(
        "amp",
        "amplifier",
        "verstärker",
        "verstaerker",
        "generator",
        "gen",
        "awg",
        "dac",
    ),
}
# Words of a sensor whose signal an amplifier makes larger.
_SENSORS = {
    *("charge", "sensor", "strain", "load", "cell", "lock", "bridge", "photo", "mic"),
    *("gauge", "piezo", "probe", "ladung", "brücke", "microphone", "diode", "lvdt"),
}
# Words and units of numbers that nobody has calibrated.
_UNCALIBRATED = {"raw", "counts", "count", "cts", "adc", "lsb", "digits", "ticks"}
_CURRENT_UNITS = {"a", "ma", "ka"}
# What drives, wherever it is plugged in; a voltage may be that of any sensor.
_DRIVING_UNITS = {*_CURRENT_UNITS, "n", "kn", "nm", "n m", "mnm"}
# The same of a time.
_TIME_UNITS = {"s", "sec", "sek", "ms", "us", "µs"}

ROLES = ("time", "input", "output", "reference", "counter")
_SHORTEST_INSIDE = 4
# What drives what in a drive, by words of an input: further down is nearer to the motion.
_CHAIN = (
    (
        "command",
        "cmd",
        "stell",
        "stellgroesse",
        "stellgröße",
        "stellwert",
        "pwm",
        "duty",
    ),
    ("voltage", "spannung", "volt", "vir", "u", "uq", "ua"),
    ("current", "strom", "strm", "amp", "amps", "ampere", "i", "iq", "im", "iz", "ia"),
    ("torque", "drehmoment", "moment", "trq", "force", "kraft"),
)
# Places in it of the two ends of a circuit.
VOLTAGE, CURRENT = 1, 2
# The same of units.
_CHAIN_UNITS = (
    (),
    ("v", "mv", "kv"),
    ("a", "ma", "ka"),
    ("n", "kn", "nm", "n m", "mnm"),
)


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


def meaning_of(title: str, stated: str = "") -> Meaning:
    """What the name of a column says.

    Parameters
    ----------
    stated : str
        Unit that the file states beside the name.

    Examples
    --------
    >>> meaning_of("Motorstrom [A]")
    Meaning(role='input', rank=1, unit='A', rest='')
    >>> meaning_of("position_mm").role, meaning_of("position_mm").unit
    ('output', 'mm')
    >>> meaning_of("Amp Out", "mA").role, meaning_of("Encoder In", "um").role
    ('input', 'output')
    >>> meaning_of("pos_ref_rad").role, meaning_of("u2").rest
    ('reference', '2')
    >>> meaning_of("DriveState").role, meaning_of("drive_current").role
    ('counter', 'input')
    >>> meaning_of("i_q").role, meaning_of("q_motor").role
    ('input', 'output')
    """
    bare, unit = split_unit(title)
    words = _with_axes(_words(bare))
    unit = stated or unit
    is_reference = any(
        _rank(word, _REFERENCE) is not None or _ENDS_IN_REF.fullmatch(word)
        for word in words
    )
    # The port of a block, of which the path says the name: Ref/Out1.
    is_reference |= any(word in _REFERENCE for word in _words_of_path(bare))
    role, rank, used = "", OF_UNIT, ""
    # A whole word says more than a letter: the current of an axis q is none of its places.
    whole = [word for word in words if len(word) > 1]
    for name, known, some in (
        ("time", _TIME, whole),
        ("output", _OUTPUT, whole),
        ("input", _INPUT, whole),
        ("time", _TIME, words),
        ("output", _OUTPUT, words),
        ("input", _INPUT, words),
        ("output", _MEASURED, words),
        ("counter", _COUNTER, words),
    ):
        for word in some:
            found = _rank(word, known)
            if found is not None and not role:
                role, rank, used = name, found, word
    if role == "output" and (last := _rank(used, _HARDLY_MEANT)) is not None:
        rank = OF_UNIT + 1 + last
    if not unit and any(word in _STATES for word in words):
        role, rank, used = "counter", OF_UNIT, ""
    if role == "time" and used == "t" and _is_temperature(words, unit):
        role, rank = "output", OF_UNIT + len(_HARDLY_MEANT)
    elif unit and (not role or _is_contradicted(role, used, unit)):
        role, rank, used = _role_of_unit(unit), OF_UNIT, ""
    elif used in _PLUGS and _AMPLIFIERS & set(words) and not _SENSORS & set(words):
        role, rank, used = "input", _INPUT.index("amp"), "amp"
    is_wanted = any(word in _WANTED and word != used for word in words)
    if is_reference or is_wanted:
        # A wanted current is what drives the machine; a wanted position is no output.
        role, rank = ("input", rank + 50) if role == "input" else ("reference", rank)
    numbers = "".join(re.findall(r"\d+", bare))
    others = [word for word in words if word != used and not word.isdecimal()]
    return Meaning(role, rank, unit, " ".join([*others, numbers]).strip())


def standing(meaning: Meaning) -> int:
    """Order among columns of one role, the most likely first, [-].

    What is measured in a unit of length or angle is a place whatever it is called, and
    places are what a drive is for: they stand before its speeds and pressures.

    Examples
    --------
    >>> piston, pressure = meaning_of("piston [mm]"), meaning_of("Druck A [bar]")
    >>> standing(piston) < standing(pressure), standing(pressure) == pressure.rank
    (True, True)
    """
    is_place = meaning.role == "output" and meaning.unit.lower() in _PLACE_UNITS
    if meaning.rank == OF_UNIT and is_place:
        return _OUTPUT.index("abstand")
    return meaning.rank


def counts_recordings(title: str) -> bool:
    """Whether the name of a column says which recording a row belongs to.

    Examples
    --------
    >>> counts_recordings("run_id"), counts_recordings("Versuch Nr."), counts_recordings("i")
    (True, True, False)
    """
    return any(word in _RECORDINGS for word in _words(title))


def is_uncalibrated(title: str, unit: str) -> bool:
    """Whether a name or a unit says that numbers are those of a converter.

    Examples
    --------
    >>> is_uncalibrated("Level1 [raw]", ""), is_uncalibrated("level", "cm")
    (True, False)
    """
    return bool(_UNCALIBRATED & {unit.lower(), *_words(title)})


def may_drive(meaning: Meaning) -> bool:
    """Whether a name of an output is one of an input as often.

    Examples
    --------
    >>> may_drive(meaning_of("pressure_kPa")), may_drive(meaning_of("position_mm"))
    (True, False)
    """
    if meaning.role != "output" or meaning.rank == OF_UNIT:
        return False
    return meaning.rank > OF_UNIT or _OUTPUT[meaning.rank] in _MAY_DRIVE


def _role_of_unit(unit: str) -> str:
    plain = unit.lower()
    if plain in _TIME_UNITS:
        return "time"
    if plain in _INPUT_UNITS and unit != "nm":
        return "input"
    return "output" if plain in _OUTPUT_UNITS else ""


def _is_contradicted(role: str, word: str, unit: str) -> bool:
    """Whether a current leaves a plug ``out``, or a position comes in at one."""
    says = "input" if unit.lower() in _DRIVING_UNITS and unit != "nm" else ""
    says = "output" if unit.lower() in _OUTPUT_UNITS else says
    # A letter stands for many things; what is measured in A is none of them but a current.
    may_be_either = word in _PLUGS or word in _SOURCES_OR_SENSORS or len(word) == 1
    return may_be_either and says not in ("", role)


def _is_temperature(words: list[str], unit: str) -> bool:
    """Whether a letter T stands for a temperature, by its unit or in its name."""
    named = {"temp", "temperature", "temperatur", "celsius", "kelvin", "degc"}
    is_degree = "deg" in words and "c" in words
    return (
        unit.lower() in ("°c", "k", "degc", "deg c")
        or is_degree
        or bool(named & set(words))
    )


def _words(title: str) -> list[str]:
    """Lower-case words of a name, split at marks, digits and capitals."""
    member = title.replace("/", ".").rstrip(". ").split(".")[-1]
    spaced = re.sub(r"([a-zäöü])([A-ZÄÖÜ])", r"\1 \2", member)
    return [word.lower() for word in re.findall(r"[^\W\d_]+|\d+", spaced)]


def _with_axes(words: list[str]) -> list[str]:
    """Words with the axis of a current or a voltage joined to it: i_q is no position."""
    joined: list[str] = []
    for word in words:
        if joined and joined[-1] + word in _OF_AXES:
            joined[-1] += word
        else:
            joined.append(word)
    return joined


def _words_of_path(title: str) -> list[str]:
    """Lower-case words of the members above the last one."""
    above = title.split("/")[:-1]
    return [word for member in above for word in _words(member)]


def _rank(word: str, known: list[str]) -> int | None:
    for rank, one in enumerate(known):
        if word == one or (len(one) >= _SHORTEST_INSIDE and one in word):
            return rank
    return None


def place_in_chain(title: str, stated: str = "") -> int:
    """Say how near to the motion an input acts.

    Parameters
    ----------
    stated : str
        Unit that the file states beside the name.

    Returns
    -------
    int, [-]
        From 0, a command, to 3, a force; -1 where nothing says it.

    Examples
    --------
    >>> place_in_chain("U_motor"), place_in_chain("Motorstrom"), place_in_chain("CH1")
    (1, 2, -1)
    """
    bare, unit = split_unit(title)
    words = _words(bare)
    for place, known in enumerate(_CHAIN):
        if any(_rank(word, list(known)) is not None for word in words):
            return place
    plain = (stated or unit).lower()
    return next((n for n, units in enumerate(_CHAIN_UNITS) if plain in units), -1)
