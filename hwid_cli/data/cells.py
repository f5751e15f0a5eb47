"""What stands in the cells of a table: numbers, times of day, words for no number.

Numbers may have a decimal comma and marks between thousands. A column keeps to one way
of writing; a cell that could be read in two ways is refused, not guessed.
"""

import datetime as dt
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

import numpy as np

# What instruments write where a signal is out of range, in lower case.
OVER_RANGE_WORDS = frozenset(
    [
        *("∞", "+∞", "-∞", "overflow", "+overflow", "-overflow", "overrange"),
        *("over range", "underrange", "under range", "overload", "ovld", "ol", "o.l"),
        *("-ol", "+ol", "clipped"),
    ]
)
# What programs write where they have no number, in lower case.
MISSING_WORDS = OVER_RANGE_WORDS | frozenset(
    [
        *("", "nan", "na", "n/a", "n.a.", "null", "none", "-", "--", "---", "-nan"),
        # Spreadsheets, in English and German.
        *("#n/a", "#nv", "#div/0!", "#value!", "#wert!", "#num!", "#zahl!", "#null!"),
        *("#ref!", "#bezug!", "#name?"),
        # Historians of plants and OPC servers.
        *("bad", "bad input", "no data", "i/o timeout", "comm fail"),
        *("calc failed", "not connect", "scan off", "pt created"),
        *("invalid", "no result", "bad quality"),
        # The library of C under Windows.
        *("1.#qnan", "-1.#qnan", "1.#ind", "-1.#ind", "nan(ind)", "-nan(ind)"),
    ]
)
_DAY_S = 86_400.0
# Always with a point: other signs around a D are a code.
_FORTRAN = re.compile(r"[-+]?(?:\d+\.\d*|\.\d+)[dD][-+]?\d{1,3}")
# Marks between thousands that are no decimal mark; the blanks are those of typography.
_APART = re.compile(r"(?<=\d)[ '\u2019\u00a0\u202f](?=\d{3}(?:\D|$))")
_GROUPED = {
    ",": re.compile(r"[-+]?\d{1,3}(?:,\d{3})+(?:\.\d*)?"),
    ".": re.compile(r"[-+]?\d{1,3}(?:\.\d{3})+(?:,\d*)?"),
}
_TIME_OF_DAY = (
    r"(?:(?P<h>\d{1,2}):(?P<m>\d{2}):(?P<s>\d{2})(?:[.,:;](?P<f>\d{1,12}))?"
    # Minutes and seconds, if a fraction shows what they are.
    r"|(?P<m2>\d{1,2}):(?P<s2>\d{2})[.,](?P<f2>\d{1,12}))"
)
_MONTHS = (
    *(("jan",), ("feb",), ("mar", "mär", "mrz"), ("apr",), ("may", "mai"), ("jun",)),
    *(("jul",), ("aug",), ("sep",), ("oct", "okt"), ("nov",), ("dec", "dez")),
)
_MONTH = {name: number for number, one in enumerate(_MONTHS, 1) for name in one}
_STAMP = re.compile(
    r"(?:(?:(?P<y>\d{4})[-/.](?P<mo>\d{1,2})[-/.](?P<d>\d{1,2})"
    r"|(?P<a>\d{1,2})(?P<mark>[./-])(?P<b>\d{1,2})[./-](?P<y2>\d{4})"
    # Two digits of a year stand behind points: others have several orders.
    r"|(?P<d3>\d{1,2})\.(?P<mo3>\d{1,2})\.(?P<y3>\d{2})"
    rf"|(?P<d4>\d{{1,2}})[-. ]+(?P<month>(?i:{'|'.join(_MONTH)}))[a-zä]*[-. ]+(?P<y4>\d{{4}}|\d{{2}})"
    r")[T ]\s*)?"
    + _TIME_OF_DAY
    + r"\s*(?P<half>[AaPp][Mm])?(?P<zone>Z|[+-]\d{2}:?\d{2})?"
)
# A time with its unit behind, as MATLAB writes durations.
_DURATION = re.compile(
    r"([-+]?\d+(?:[.,]\d*)?(?:[eE][-+]?\d+)?) ?(us|µs|ms|s|sec|min|hr)"
)
# A time of IEC 61131-3: T#1s200ms.
_IEC = re.compile(
    r"(?:T|TIME|LT|LTIME)#((?:\d+(?:\.\d+)?(?:ms|us|ns|d|h|m|s)_?)+)", re.I
)
_IEC_PART = re.compile(r"(\d+(?:\.\d+)?)(ms|us|ns|d|h|m|s)", re.I)
_IEC_SECONDS = {
    "d": 86_400.0, "h": 3600.0, "m": 60.0, "s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9,
}  # fmt: skip
_IN_UNIT = {"us": 1e6, "µs": 1e6, "ms": 1e3, "s": 1.0, "sec": 1.0}
_SECONDS = {"min": 60.0, "hr": 3600.0}


@dataclass(frozen=True)
class Writing:
    """How a column writes its numbers.

    Parameters
    ----------
    decimal : str
        ``.`` or ``,``; empty while no cell has shown it.
    thousands : str
        The mark between thousands; empty for none.
    """

    decimal: str = ""
    thousands: str = ""


class TwoWaysError(ValueError):
    """A cell is written in another way than others of its column, or in two ways."""


def plain_number(cell: str) -> float | None:
    """Read a number with a decimal point, or None; Python's own 1_000 is none in a file.

    Examples
    --------
    >>> plain_number("1e-3"), plain_number("1_0"), plain_number("off")
    (0.001, None, None)
    >>> plain_number("1.0D-03")  # Fortran's double precision
    0.001
    """
    try:
        return None if "_" in cell else float(cell)
    except ValueError:
        if _FORTRAN.fullmatch(cell):
            return float(cell.replace("D", "E").replace("d", "e"))
        return None


def is_word(cell: str) -> bool:
    """Whether a cell holds something else than a number, a time or nothing."""
    return (
        cell.lower() not in MISSING_WORDS
        and plain_number(cell) is None
        and not is_stamp(cell)
        and not is_grouped(cell)
    )


def number_in(cell: str, writing: Writing) -> float | None:
    """Read a number in the way in which its column writes them; None if it is none.

    Raises
    ------
    TwoWaysError
        If the cell has the other decimal mark.

    Examples
    --------
    >>> number_in("1.234,5", Writing(",", ".")), number_in("1,5", Writing(","))
    (1234.5, 1.5)
    """
    if writing.decimal != ",":
        found = plain_number(cell)
        if found is not None:
            return found
    if not cell or not any(mark in cell for mark in ",. '\u2019\u00a0\u202f"):
        return plain_number(cell)
    text = _APART.sub("", cell)
    if writing.thousands and writing.thousands in text:
        if not _GROUPED[writing.thousands].fullmatch(text):
            raise TwoWaysError
        text = text.replace(writing.thousands, "")
    other = {",": ".", ".": ","}.get(writing.decimal or ".", ",")
    if other in text and plain_number(text.replace(",", ".")) is not None:
        raise TwoWaysError
    return plain_number(text.replace(",", ".") if writing.decimal == "," else text)


def is_grouped(cell: str) -> bool:
    """Whether a cell holds a number with a decimal comma or marks between thousands."""
    text = _APART.sub("", cell)
    if any(pattern.fullmatch(text) for pattern in _GROUPED.values()):
        return True
    is_decimal = text.count(",") <= 1 and (text != cell or "," in text)
    return is_decimal and plain_number(text.replace(",", ".")) is not None


def writing_of(cells: Iterable[str], *, known: Writing | None = None) -> Writing:
    """Find out how a column writes its numbers.

    Parameters
    ----------
    known : Writing or None
        What earlier cells have shown.

    Raises
    ------
    TwoWaysError
        With the number of the cell as its argument, if no one way fits them all, or two
        ways do.

    Examples
    --------
    >>> writing_of(["1,5", "2"]), writing_of(["1,234.5", "2.5"])
    (Writing(decimal=',', thousands=''), Writing(decimal='.', thousands=','))
    """
    found = known or Writing()
    commas: list[tuple[int, str]] = []
    pointed, others = -1, []
    for number, raw in enumerate(cells):
        cell = _APART.sub("", raw) if raw else raw
        if "," not in cell and "." not in cell:
            others.append(cell)
            continue
        if plain_number(cell) is None and not is_grouped(cell):
            continue
        if cell.count(",") + cell.count(".") > 1:
            found = _agreed(found, _of_groups(cell), number)
        elif "," in cell:
            commas.append((number, cell))
        else:
            pointed = number if pointed < 0 else pointed
    return _settled(found, commas, pointed, others)


def _of_groups(cell: str) -> Writing:
    """Writing that a number with several marks shows."""
    last = max(",.", key=cell.rfind)
    first = {",": ".", ".": ","}[last]
    # Marks between thousands only, or a decimal mark behind them.
    return Writing(first, last) if cell.count(last) > 1 else Writing(last, first)


def _agreed(found: Writing, shown: Writing, number: int) -> Writing:
    if found.decimal not in ("", shown.decimal):
        raise TwoWaysError(number)
    if found.thousands not in ("", shown.thousands):
        raise TwoWaysError(number)
    return shown


def _settled(
    found: Writing, commas: list[tuple[int, str]], pointed: int, others: list[str]
) -> Writing:
    """Writing of a column whose other cells have one mark each, or none."""
    if found.decimal == "." and not found.thousands and commas:
        raise TwoWaysError(commas[0][0])
    if found.decimal == "," and pointed >= 0 and not found.thousands:
        raise TwoWaysError(pointed)
    if found.decimal:
        return found
    if commas and pointed >= 0:
        raise TwoWaysError(max(commas[0][0], pointed))
    if commas:
        grouped = _GROUPED[","]
        is_short = any(re.fullmatch(r"[-+]?\d{1,3}", one) for one in others)
        is_zero = any(re.match(r"[-+]?0", cell) for _, cell in commas)
        if (
            is_short
            and not is_zero
            and all(grouped.fullmatch(cell) for _, cell in commas)
        ):
            # 999 and 1,000: thousands, or a decimal comma with zeros left out.
            raise TwoWaysError(commas[0][0])
        return replace(found, decimal=",")
    return replace(found, decimal=".") if pointed >= 0 else found


def is_stamp(cell: str) -> bool:
    """Whether a cell holds a date with its time, a time of day, or a time with its unit.

    Examples
    --------
    >>> is_stamp("2024-05-01T12:00:00.125Z"), is_stamp("12:00:00,5"), is_stamp("12:00")
    (True, True, False)
    >>> is_stamp("01-May-2024 12:00:00.125"), is_stamp("1.25 sec"), is_stamp("1.25 mm")
    (True, True, False)
    >>> is_stamp("11-Mar-24 08:00:00"), is_stamp("T#1s200ms"), is_stamp("10:10:59;120")
    (True, True, True)
    """
    if ":" in cell:
        return _STAMP.fullmatch(cell) is not None
    return any(form.fullmatch(cell) is not None for form in (_DURATION, _IEC))


def stamps_in_seconds(cells: Iterable[str]) -> tuple[np.ndarray, dict[int, str]]:
    """Seconds since the midnight before the first of some stamps.

    Returns
    -------
    ndarray, shape (n,), [s]
        NaN where a cell holds no stamp.
    dict of int to str
        Those cells, by number.
    """
    days, seconds, others = [], [], {}
    for number, cell in enumerate(cells):
        match = _STAMP.fullmatch(cell)
        day, second = (0, _duration(cell)) if match is None else _instant(match)
        if second != second:
            others[number] = cell
        days.append(day)
        seconds.append(second)
    known = [day for day, second in zip(days, seconds, strict=True) if second == second]
    first = known[0] if known else 0
    values = (np.array(days, dtype=float) - first) * _DAY_S + np.array(seconds)
    return values if any(known) else _past_midnight(values), others


def _duration(cell: str) -> float:
    if iec := _IEC.fullmatch(cell):
        parts = _IEC_PART.findall(iec[1])
        return sum(float(value) * _IEC_SECONDS[unit.lower()] for value, unit in parts)
    match = _DURATION.fullmatch(cell)
    if match is None:
        return np.nan
    value, unit = float(match[1].replace(",", ".")), match[2]
    # A division keeps decimal fractions more exact than a factor.
    return value * _SECONDS[unit] if unit in _SECONDS else value / _IN_UNIT[unit]


def _instant(match: re.Match[str]) -> tuple[int, float]:
    """Day (0 without a date) and seconds of it."""
    part = match.groupdict()
    hour = int(part["h"] or 0)
    if part["half"]:
        hour = hour % 12 + (12 if part["half"].lower() == "pm" else 0)
    minute, whole, digits = (part[one] or part[f"{one}2"] or "0" for one in "msf")
    second = 3600.0 * hour + 60.0 * int(minute) + int(whole) + float(f"0.{digits}")
    if part["zone"] and part["zone"] != "Z":
        sign = -1.0 if part["zone"][0] == "+" else 1.0
        zone = part["zone"][1:].replace(":", "")
        second += sign * 60.0 * (60 * int(zone[:2]) + int(zone[2:]))
    return _day(part), second


def _day(part: dict[str, str | None]) -> int:
    if part["y"]:
        fields = [int(part[name] or 0) for name in ("y", "mo", "d")]
    elif part["y2"]:
        one, other = int(part["a"] or 0), int(part["b"] or 0)
        # Slashes are American, unless the first number can be no month.
        is_american = part["mark"] == "/" and one <= 12
        month, day = (one, other) if is_american else (other, one)
        fields = [int(part["y2"]), month, day]
    elif part["y3"]:
        fields = [2000 + int(part["y3"]), int(part["mo3"] or 0), int(part["d3"] or 0)]
    elif part["y4"]:
        month = _MONTH[(part["month"] or "").lower()]
        year = int(part["y4"])
        fields = [year if year > 99 else 2000 + year, month, int(part["d4"] or 0)]
    else:
        return 0
    try:
        return dt.date(*fields).toordinal()
    except ValueError:
        return 0


def _past_midnight(values: np.ndarray) -> np.ndarray:
    """Times of day that go on behind midnight."""
    steps = np.diff(values, prepend=values[:1])
    return values + _DAY_S * np.cumsum(np.nan_to_num(steps) < -0.5 * _DAY_S)


def stamp_reader() -> Callable[[Iterable[str]], tuple[np.ndarray, dict[int, str]]]:
    """Make a reader of stamps that come block by block.

    Returns
    -------
    callable
        As ``stamps_in_seconds``; all blocks count from the midnight of the first.
    """
    origin: list[str] = []

    def read(cells: Iterable[str]) -> tuple[np.ndarray, dict[int, str]]:
        cells = list(cells)
        if not origin:
            origin.extend([cell for cell in cells if is_stamp(cell)][:1])
        # What was read last stands in front: it says the day.
        values, others = stamps_in_seconds([*origin, *cells])
        return values[len(origin) :], {
            number - len(origin): cell for number, cell in others.items()
        }

    return read
