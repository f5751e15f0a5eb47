"""Units of signals: what a text says, and the factor from one unit to another.

Conversion is by pint, which is loaded only where a unit is not plain SI. An angle is no
plain number here: rad, deg and turns go into each other and into nothing else, so that a
frequency in Hz is not taken for an angular velocity.
"""

import re
from functools import cache, lru_cache
from typing import Any

import numpy as np

# What a drive's signals are, each with the SI unit that its numbers are converted to.
QUANTITIES = {
    "time": "s",
    "current": "A",
    "voltage": "V",
    "force": "N",
    "torque": "N m",
    "length": "m",
    "angle": "rad",
    "velocity": "m/s",
    "angular velocity": "rad/s",
    "acceleration": "m/s^2",
    "angular acceleration": "rad/s^2",
    "pressure": "Pa",
}
# Numbers that have no unit, or whose unit nobody wants to say.
UNITLESS = "-"
# Whole words, which instruments begin with a capital.
_WORDS = (
    *("Volts", "Millivolts", "Amperes", "Milliamps", "Milliamperes", "Newtons"),
    *("Meters", "Metres", "Millimeters", "Millimetres", "Micrometers", "Microns"),
    *("Degrees", "Radians", "Milliradians", "Milliseconds", "Microseconds"),
)
# How laboratories write units that pint reads otherwise or not at all.
_SPELLINGS = {
    **{word: word.lower() for word in _WORDS},
    "Nm": "N*m",
    "mNm": "mN*m",
    "kNm": "kN*m",
    "Ncm": "N*cm",
    "Nmm": "N*mm",
    "sek": "s",
    "Sek": "s",
    "secs": "s",
    "Second": "s",
    "Seconds": "s",
    "amp": "A",
    "amps": "A",
    "Amp": "A",
    "Amps": "A",
    "Ampere": "A",
    "Volt": "V",
    "Newton": "N",
    "°": "deg",
    "°/s": "deg/s",
    "1/min": "rpm",
    "min^-1": "rpm",
    "min-1": "rpm",
    "U/min": "rpm",
    "r/min": "rpm",
    "rev/min": "rpm",
    "RPM": "rpm",
    "Rpm": "rpm",
    "dps": "deg/s",
    "DEG": "deg",
    "rev": "turn",
    "mps": "m/s",
    "100ns": "tick_of_windows",
    "%": "percent",
}
# What nobody can tell, and what it may be.
_GRAD, _MIL = ("deg", "gon"), ("thou", "mrad")
_AMBIGUOUS = {
    **dict.fromkeys(("grad", "Grad", "gr"), _GRAD),
    **dict.fromkeys(("mil", "mils", "Mil", "Mils"), _MIL),
}
_UNITLESS_WORDS = ("", "-", "1", "none", "unitless", "dimensionless")
_RAISED = str.maketrans({"²": "^2", "³": "^3", "⁴": "^4", "⁻": "-", "¹": "1"})
_SYMBOL = r"[A-Za-z_\u00b5\u03bc°Ωµ]+(?:(?:\^|\*\*)?-?[1-4])?"
_FORM = re.compile(rf"{_SYMBOL}(?:[ */·.]{_SYMBOL}){{0,5}}")
# A unit with what it measures behind it, as TwinCAT writes.
_WITH_QUANTITY = re.compile(r"(\S+) \([A-Z][a-z ]+\)")
_LONGEST = 40
_DAY_S = 86_400.0
# Days since 1900 and since the year 0, and steps of 100 ns since 1601, of 1970 to 2080.
_DAYS = ((25_569.0, 66_000.0), (719_529.0, 760_000.0))
_FIRST_TICKS, _LAST_TICKS = 1.164e17, 1.52e17
# Of seconds of a day, no clock steps by less, [s]; of days, no measurement by more, [d].
_SHORTEST_STEP_S, _LONGEST_DAY_STEP = 2e-6, 1e-2
# A step is a round number within this share: days have eleven digits behind five, [-].
_SIMPLE = 1e-5


def quantity_of(unit: str) -> str:
    """Say which of ``QUANTITIES`` a unit measures.

    Returns
    -------
    str
        Empty for a unit that is not known, or of something else.

    Examples
    --------
    >>> quantity_of("mm"), quantity_of("1/min"), quantity_of("furlong"), quantity_of("inc")
    ('length', 'angular velocity', 'length', '')
    >>> quantity_of("Hz"), quantity_of("N m"), quantity_of("kN")
    ('', 'torque', 'force')
    """
    for quantity, plain in QUANTITIES.items():
        if unit == plain:
            return quantity
    roots = _roots(unit)
    if roots is None:
        return ""
    return next((one for one, si in QUANTITIES.items() if _roots(si) == roots), "")


def factor_between(unit: str, target: str) -> float | None:
    """Give the number of targets in one unit.

    Returns
    -------
    float or None, [target/unit]
        None where a unit is not known, or the two measure different things.

    Examples
    --------
    >>> factor_between("mA", "A"), factor_between("mm", "rad")
    (0.001, None)
    >>> factor_between("ticks", "ticks")
    1.0
    """
    if unit == target:
        return 1.0
    if _roots(unit) is None or _roots(unit) != _roots(target):
        return None
    registry = _registry()
    one, none = (registry.Quantity(size, _spelt(unit)) for size in (1.0, 0.0))
    # Such as degrees Celsius, whose zero lies elsewhere.
    if none.to(_spelt(target)).magnitude != 0.0:
        return None
    return float(one.to(_spelt(target)).magnitude)


def is_unitless(unit: str) -> bool:
    """Whether a text says that numbers have no unit."""
    return unit.strip() in _UNITLESS_WORDS


def readings_of(unit: str) -> tuple[str, ...]:
    """Units that a text may mean, where it means several; empty where it does not.

    Examples
    --------
    >>> readings_of("mils"), readings_of("mm")
    (('thou', 'mrad'), ())
    """
    return _AMBIGUOUS.get(unit.strip(), ())


def in_unit(values: Any, unit: str, target: str) -> Any:
    """Convert numbers; a division keeps decimal fractions more exact than a factor.

    Parameters
    ----------
    values : ndarray or float, any shape, [unit]
        Finite or not.
    unit, target : str
        Of the same quantity.

    Raises
    ------
    ValueError
        If they are not.
    """
    factor = factor_between(unit, target)
    if factor is None:
        raise ValueError(f"{unit!r} is no {target!r}")
    inverse = factor_between(target, unit)
    if inverse is not None and inverse > 1.0 and inverse.is_integer():
        return values / inverse
    return values * factor


def unit_of_dates(values: Any) -> str:
    """Unit of times that count from a date long ago, told from their size.

    Parameters
    ----------
    values : ndarray, shape (n,)

    Returns
    -------
    str
        Empty where they are something else. Seconds since 1970 have ten digits these
        days; days are those of spreadsheets (since 1900) or of MATLAB's ``datenum``
        (since the year 0); ``100ns`` are those of Windows (since 1601).

    Examples
    --------
    >>> seconds = 0.002 * np.arange(100)
    >>> unit_of_dates(1.7e9 + seconds), unit_of_dates(45413.5 + seconds / 86400)
    ('s', 'd')
    >>> unit_of_dates(45413.5 + seconds)
    ''
    """
    if len(values) == 0:
        return ""
    first = float(values[0])
    for unit, size in (("s", 1.0), ("ms", 1e3), ("us", 1e6), ("ns", 1e9)):
        if 1e9 * size < first < 2.5e9 * size:
            return unit
    if _FIRST_TICKS < first < _LAST_TICKS:
        return "100ns"
    is_day = any(begin < first < end for begin, end in _DAYS)
    return "d" if is_day and _steps_in_days(values) else ""


def _steps_in_days(values: Any) -> bool:
    """Whether steps are so short, or so odd, that they are shares of a day."""
    step = float(np.median(np.diff(values))) if len(values) > 1 else 0.0
    if not 0.0 < step < _LONGEST_DAY_STEP:
        return False
    return step < _SHORTEST_STEP_S or (
        _is_simple(step * _DAY_S) and not _is_simple(step)
    )


def _is_simple(step: float) -> bool:
    return abs(float(f"{step:.3g}") - step) <= _SIMPLE * step


@cache
def _registry() -> Any:
    # Half a second: loaded where it is needed.
    import pint

    registry: Any = pint.UnitRegistry()
    registry.define("tick_of_windows = 1e-7 second")
    return registry


def _spelt(unit: str) -> str:
    """A unit as pint reads it."""
    text = unit.strip().translate(_RAISED)
    text = _SPELLINGS.get(text, text)
    text = re.sub(r"(?<=[A-Za-z\u00b5\u03bc°Ω])(?:\^|\*\*)?(-?\d)", r"**\1", text)
    return re.sub(r"(?<=\D)[·.](?=\D)", "*", text)


@cache
def _roots(unit: str) -> str | None:
    """The unit in base units; None where it is not known."""
    text = unit.strip().translate(_RAISED)
    if len(text) > _LONGEST or text in _AMBIGUOUS:
        return None
    text = _SPELLINGS.get(text, text)
    if not _FORM.fullmatch(text):
        return None
    try:
        base = _registry().Quantity(1.0, _spelt(text)).to_root_units()
    # pint raises whatever its parser stumbles on.
    except Exception:
        return None
    return str(base.units) if base.magnitude > 0 else None


# What base units are made of, in the order of ``base_exponents``.
_DIMENSIONS = ("[mass]", "[length]", "[time]", "[current]")


@cache
def base_exponents(unit: str) -> tuple[tuple[float, ...], float] | None:
    """Exponents of kg, m, s and A in a unit, and the factor to these; an angle has none.

    Returns
    -------
    exponents : tuple of float
    factor : float
        1 for a unit of the SI.
    None
        Instead of both, where the unit is not known or is of something else.

    Examples
    --------
    >>> base_exponents("N/m"), base_exponents("mm")
    (((1.0, 0.0, -2.0, 0.0), 1.0), ((0.0, 1.0, 0.0, 0.0), 0.001))
    """
    if is_unitless(unit):
        return (0.0, 0.0, 0.0, 0.0), 1.0
    if len(unit) > _LONGEST or unit.strip() in _AMBIGUOUS:
        return None
    if not re.fullmatch(r"[A-Za-z0-9µΩ°μ ./*^()-]+", unit):
        return None
    try:
        base = _registry().Quantity(1.0, _spelt(unit)).to_base_units()
    # pint raises whatever its parser stumbles on.
    except Exception:
        return None
    found = dict(base.dimensionality)
    if set(found) - set(_DIMENSIONS):
        return None
    exponents = tuple(float(found.get(one, 0.0)) for one in _DIMENSIONS)
    return exponents, float(base.magnitude)


# Units that stand behind an underscore; in brackets anything may stand.
_SUFFIXES = {
    unit: unit
    for unit in [
        *("A", "mA", "uA", "kA", "V", "mV", "kV", "N", "mN", "kN", "Nm", "mNm", "Ncm"),
        *("m", "mm", "cm", "um", "µm", "rad", "mrad", "deg"),
        *("s", "ms", "us", "µs", "rpm", "bar", "mbar", "Pa", "hPa", "kPa", "MPa", "K"),
        *("m/s", "mm/s", "rad/s", "deg/s", "1/s", "1/min", "m/s^2"),
        *("W", "kW", "Hz", "kHz", "degC", "l/min", "L/min", "ml/min", "l/h"),
    ]
} | {
    "lpm": "l/min",
    "l_min": "l/min",
    "ml_min": "ml/min",
    "mmps": "mm/s",
    "mps": "m/s",
    "radps": "rad/s",
    "degps": "deg/s",
    "pct": "%",
    "percent": "%",
    "rad_s": "rad/s",
    "m_s": "m/s",
    "mm_s": "mm/s",
    "deg_s": "deg/s",
    "m_per_s": "m/s",
    "mm_per_s": "mm/s",
    "rad_per_s": "rad/s",
    "deg_per_s": "deg/s",
    "m/s2": "m/s^2",
    "N_m": "N m",
    "sec": "s",
    "seconds": "s",
    "msec": "ms",
    "amps": "A",
    "volts": "V",
    "degrees": "deg",
    "radians": "rad",
    "meters": "m",
    "metres": "m",
}
# Counts of encoders and converters, and shares: units between brackets of any kind, though
# nobody can convert them.
_COUNTS = (
    *("%", "cnt", "cnts", "count", "counts", "inc", "incs", "incr", "increments"),
    *("ink", "inkr", "inkremente", "cts", "lsb", "digits", "pulses", "ticks", "steps"),
)
# What is measured beside a drive: units between round brackets too, as labels.
_LABELS = (
    *("°c", "degc", "deg c", "celsius", "°f", "degf", "k", "g", "mg", "kg", "mt"),
    *("l/min", "l/h", "l/s", "ml/min", "m3/h", "m³/h", "slpm", "sccm", "gpm", "gauss"),
    *("%fs", "% fs", "%fso", "ppm", "db", "hz", "khz", "w", "kw", "va", "ohm", "ω"),
    *("mv/v", "µstrain", "ustrain", "µe", "µm/m", "strain", "t/cm", "lx"),
)
# What is followed by a member is the place in an array: run(2).current.
_BRACKET = re.compile(r"([\[(])\s*([^\])]*?)\s*[\])](?!\.\w)")
_LONGEST_FIRST = sorted(_SUFFIXES.items(), key=lambda pair: -len(pair[0]))
_BEHIND = re.compile(r"(?:[/,]|(?:^| )in )\s*([A-Za-zµ°%]{1,4})$")
# Arguments of a function, not units: x[k], i(t).
_ARGUMENTS = ("t", "k", "n", "i", "j", "z", "x")
# A letter behind a symbol may be an index: theta_m is the motor's angle, i_s the stator's
# current. It is a unit behind those that are measured in it.
_SYMBOLS = re.compile(r".{0,2}|alpha|beta|gamma|omega|phi|psi|theta|tau", re.IGNORECASE)
_MEASURED_IN = {
    "s": ("t",),
    "A": ("i", "iq", "id"),
    "V": ("u", "uq", "ud"),
    "N": ("f",),
    "m": ("x", "y", "z", "s", "l", "h"),
    "W": ("p",),
}


# Behind a name of time alone: elsewhere "min" is the least of something, "h" an index.
_LONG_TIMES = re.compile(
    r"(?:.*(?:time|zeit|elapsed)|t)_(?:(min)(?:utes|uten|s)?|(h)(?:ours?|rs?)?|(d)(?:ays?)?)",
    re.IGNORECASE,
)
# What ticks, in front of what it counts from.
_TICKS_IN_FRONT = re.compile(r"(ms|us|ns)(?=[_ ])", re.IGNORECASE)
# A column of time may be named by its unit alone.
_NAMES_OF_TIME = {
    **{unit: unit for unit in ("ms", "us", "µs", "ns", "sec", "msec")},
    "millis": "ms",
    "micros": "us",
}


@lru_cache(maxsize=256)
def split_unit(title: str) -> tuple[str, str]:
    """Take the unit off the name of a column.

    Returns
    -------
    bare, unit : str
        The unit as it stands there, empty where there is none.

    Examples
    --------
    >>> split_unit("current [mA]"), split_unit("t_ms"), split_unit("U/V")
    (('current ', 'mA'), ('t', 'ms'), ('U', 'V'))
    >>> split_unit("speed_m/s"), split_unit("pressure_kPa")
    (('speed', 'm/s'), ('pressure', 'kPa'))
    >>> split_unit("run(1).current")
    ('run(1).current', '')
    """
    bracket = _BRACKET.search(title)
    if bracket and bracket[2]:
        return title[: bracket.start()] + title[bracket.end() :], bracket[2]
    for suffix, unit in _LONGEST_FIRST:
        if title.endswith(f"_{suffix}") and len(title) > len(suffix) + 1:
            return title[: -len(suffix) - 1], unit
    worded = _BEHIND.search(title)
    if worded and worded[1] in _SUFFIXES:
        return title[: worded.start()], worded[1]
    return title, ""


def unit_in_name(title: str, role: str) -> str:
    """Read the unit that the name of a column says, where it surely is one.

    Parameters
    ----------
    role : str
        ``time``, ``input`` or ``output``.

    Returns
    -------
    str
        Empty where the name says none. One that is not known comes back as it stands, if
        it is in square brackets; counts and percents are in round ones, too.

    Examples
    --------
    >>> unit_in_name("position_mm", "output"), unit_in_name("I (mA)", "input")
    ('mm', 'mA')
    >>> unit_in_name("x[k]", "output"), unit_in_name("position [inc]", "output")
    ('', 'inc')
    >>> unit_in_name("theta_m", "output"), unit_in_name("current_A", "output")
    ('', 'A')
    >>> unit_in_name("ms_today", "time"), unit_in_name("ms_today", "output")
    ('ms', '')
    >>> unit_in_name("time_min", "time"), unit_in_name("t_min", "output")
    ('min', '')
    """
    bare, unit = split_unit(title)
    if role == "time" and (named := _unit_of_time(title.strip())):
        return named
    if not unit:
        return ""
    bracket = _BRACKET.search(title)
    if bracket and bracket[2]:
        if unit == "1" and title.endswith("(1)") and " " not in title:
            # The place in an array: u(1).
            return ""
        if is_unitless(unit):
            return UNITLESS
        if unit in _ARGUMENTS or not re.search(r"[^\W\d]|[%°]", unit):
            return ""
        is_label = unit.lower() in (*_COUNTS, *_LABELS) or bool(readings_of(unit))
        is_known = bool(quantity_of(unit)) or is_label
        return unit if is_known or bracket[1] == "[" else ""
    if role == "time" and quantity_of(unit) != "time":
        return ""
    symbol = bare.strip().lower()
    if len(unit) == 1 and symbol and _SYMBOLS.fullmatch(symbol):
        return unit if symbol in _MEASURED_IN.get(unit, ()) else ""
    return unit


def _unit_of_time(title: str) -> str:
    """Unit that the name of a column of time says in ways that no other one does."""
    if title in _NAMES_OF_TIME:
        return _NAMES_OF_TIME[title]
    if long := _LONG_TIMES.fullmatch(title):
        return next(one for one in long.groups() if one).lower()
    first = _TICKS_IN_FRONT.match(title)
    return first[1].lower() if first else ""


def looks_like_unit(text: str) -> bool:
    """Whether a cell above numbers holds a unit, in brackets or without.

    Examples
    --------
    >>> [looks_like_unit(text) for text in ("[mm]", "mA", "1/min", "-")]
    [True, True, True, True]
    >>> [looks_like_unit(text) for text in ("t", "position", "")]
    [False, False, False]
    """
    bare = bare_unit(text)
    if is_unitless(bare):
        return bool(bare)
    return bool(quantity_of(bare)) and bare not in _ARGUMENTS


def bare_unit(text: str) -> str:
    """Take the brackets off a unit, and what it measures from behind it.

    Examples
    --------
    >>> bare_unit("[mm]"), bare_unit("mm (Length)"), bare_unit("(V)")
    ('mm', 'mm', 'V')
    """
    bare = text.strip()
    if len(bare) > 1 and bare[0] in "[(" and bare[-1] in "])":
        bare = bare[1:-1].strip()
    with_quantity = _WITH_QUANTITY.fullmatch(bare)
    return with_quantity[1] if with_quantity else bare
