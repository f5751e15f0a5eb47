"""Where the numbers of a table begin, and what stands above them: names, units, settings.

Instruments write preambles: what was measured, with which range, at which interval. Some
write them above the columns, some beside them, some in pairs of columns. The columns
that hold numbers further down tell where the table begins; the rows above are read by
their words.
"""

import re
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cache, lru_cache
from itertools import pairwise

from hwid_cli.data.cells import MISSING_WORDS, is_grouped, is_stamp, plain_number
from hwid_cli.data.column_words import counts_recordings
from hwid_cli.data.units import bare_unit, factor_between, looks_like_unit, split_unit

# Words in front of a row of names, of units; letters only, in lower case.
_NAME_WORDS = frozenset(
    [
        *("name", "names", "channelname", "channel", "channels", "path", "signal"),
        *("signals", "signalname", "variable", "kanal", "kanalname", "spurname"),
        *("label", "symbolname", "tracename", "source"),
    ]
)
_UNIT_WORDS = frozenset(
    [
        *("unit", "units", "einheit", "einheiten", "verticalunits", "yunitlabel"),
        *("yunit", "vunit"),
    ]
)
# Words beside a table of a time and a signal that say the unit of one of the two.
_BESIDE = {
    **dict.fromkeys(("horizontalunits", "horizontalunit", "hunit"), 0),
    **dict.fromkeys(("verticalunits", "verticalunit", "vunit", "yunit"), 1),
}
# Words in front of rows that say something else about each column.
_OTHER_WORDS = frozenset(
    [
        *("datatype", "type", "description", "quantity", "mode", "variablesize"),
        *("comment", "symbolbased", "symbolcomment", "indexgroup", "indexoffset"),
        *("netid", "port", "offset", "bitmask", "coupling"),
        *("samples", "date", "hunit", "horizontalunits", "horizontalunit"),
    ]
)
# How a logger made the numbers of each column from its readings.
_PROCESSED = frozenset(
    [
        *("smp", "avg", "min", "max", "std", "tot", "wvc", "med", "smm", "mom", "cov"),
        *("sample", "average", "mean", "minimum", "maximum", "total"),
    ]
)
# Words in front of factors by which whole numbers become quantities.
_SCALE_WORDS = frozenset(
    [
        *("scale", "scaling", "scalefactor", "factor", "faktor", "skalierung", "slope"),
        *("skalierungsfaktor", "umrechnungsfaktor", "resolution", "auflösung", "lsb"),
    ]
)
_STARTS_WORD = "x0"
_TIME_WORDS = frozenset(("time", "zeit", "timestamp", "t", "x", "xvalue"))
_INTERVAL_WORDS = frozenset(
    [
        *("ts", "dt", "h", "tsamp", "sampletime", "samplingtime", "samplingperiod"),
        *("interval", "abtastzeit", "tvz", "tabtast", "sampleinterval", "deltax"),
        *("samplinginterval", "samplingtimeinterval", "increment", "xincr"),
        *("xincrement", "sampleperiod", "abtastintervall", "abtastperiode", "deltat"),
        *("timestep", "zykluszeit", "cycletime", "timeinterval", "timeincrement"),
        *("wfincrement", "stepsize", "tinterval", "hresolution"),
    ]
)
# These say a sample time where a unit of time stands behind the number.
_MAYBE_INTERVAL_WORDS = frozenset(("resolution", "auflösung", "period", "periode"))
_RATE_WORDS = frozenset(
    [
        *("fs", "samplerate", "samplingrate", "samplingfrequency", "samplefrequency"),
        *("abtastrate", "abtastfrequenz", "fabtast", "scanrate", "datarate"),
    ]
)
_TIME_ENDINGS = ("s", "ms", "us")
_RATE_UNITS = {
    **dict.fromkeys(("hz", "s/s", "sa/s", "1/s"), 1.0),
    **dict.fromkeys(("khz", "ks/s", "ksa/s"), 1e3),
    **dict.fromkeys(("mhz", "ms/s", "msa/s"), 1e6),
}
_SETTING = re.compile(r"\s*(.{1,60}?)\s*[:=]\s*([-+0-9.,eE]+)\s*([A-Za-zµμ/]{0,6})\s*")
_SAID = re.compile(r"(\w[\w .]{0,20}?)\s*[:=]\s*(\S.{1,80})")
# Rows below the first one of a table, and how many of them may be damaged.
_ROWS_BELOW, _MOST_DAMAGED = 5, 1
# Rows of a table's beginning in which settings may stand beside the numbers.
_MOST_ROWS_BESIDE = 40


@dataclass(frozen=True)
class TableHead:
    """What stands above the numbers.

    Parameters
    ----------
    body : int
        First of the rows that holds numbers; as many as there are rows if none does.
    numeric : tuple of int
        Columns that hold numbers or times.
    texts : tuple of int
        Columns that hold words.
    names : tuple of str
        By column; empty where it has none.
    name_row : int
        Row that they stand in; -1 if there are none.
    units : dict of int to str
        By column, where a row of units says one.
    settings : tuple of (str, float), [s]
        Sample times that the rows state, with the words in front of them.
    scales : dict of int to float
        By column, where a row of factors states another one than 1.
    starts : dict of int to float, [s]
        By column, where a row states when each begins (LabVIEW's X0).
    said : dict of int to str
        By column, what a row above says of it: of ``CH1`` that it is the current.
    """

    body: int
    numeric: tuple[int, ...] = ()
    texts: tuple[int, ...] = ()
    names: tuple[str, ...] = ()
    name_row: int = -1
    units: dict[int, str] = field(default_factory=dict)
    settings: tuple[tuple[str, float], ...] = ()
    scales: dict[int, float] = field(default_factory=dict)
    said: dict[int, str] = field(default_factory=dict)
    starts: dict[int, float] = field(default_factory=dict)


def sample_time_named(title: str, value: float, unit: str = "") -> float | None:
    """Sample time that a single number states.

    Parameters
    ----------
    title : str
        What stands in front of it.
    unit : str
        What stands behind it; empty for one in brackets in the title, else seconds or
        hertz.

    Returns
    -------
    float or None, [s]
        None where the words mean something else.

    Examples
    --------
    >>> sample_time_named("fs", 200.0), sample_time_named("kp", 200.0)
    (0.005, None)
    >>> sample_time_named("Sampling time interval(ms)", 0.5)
    0.0005
    >>> sample_time_named("sample_rate_Hz", 500.0), sample_time_named("dt_ms", 2.0)
    (0.002, 0.002)
    """
    bare, in_title = split_unit(title.split(".")[-1])
    stem, _, last = bare.rpartition("_")
    if stem and not in_title and (last.lower() in _RATE_UNITS or last in _TIME_ENDINGS):
        bare, in_title = stem, last
    word = re.sub(r"[^a-zäöü]", "", bare.lower())
    said = (unit or in_title).strip()
    if not 0 < value < float("inf"):
        return None
    in_time = factor_between(said, "s") if said else None
    # What a rate says may stand as its interval already.
    of_time = _RATE_WORDS | _MAYBE_INTERVAL_WORDS
    if word in _INTERVAL_WORDS or (word in of_time and in_time is not None):
        factor = in_time if said else 1.0
        return None if factor is None else float(f"{value * factor:.12g}")
    if word in _RATE_WORDS:
        factor = _RATE_UNITS.get(said.lower(), 1.0)
        # A rate has fewer digits than its reciprocal.
        return float(f"{1.0 / (value * factor):.9g}")
    return None


def is_value(cell: str) -> bool:
    """Whether a cell may stand in a column of numbers: a number, a time, a missing one."""
    return cell.lower() in MISSING_WORDS or is_quantity(cell)


def is_quantity(cell: str) -> bool:
    """Whether a cell holds a number in any way of writing, or a time.

    Examples
    --------
    >>> [is_quantity(one) for one in ("1.5", "1,5", "1.234,5", "12:00:00.5", "CH1", "")]
    [True, True, True, True, False, False]
    """
    # A head asks the same of a cell several times; long ones are no numbers.
    return _holds_quantity(cell) if len(cell) <= _LONGEST_KEPT else _is_quantity(cell)


def _is_quantity(cell: str) -> bool:
    if not cell or cell.lower() in MISSING_WORDS:
        return False
    if plain_number(cell) is not None or is_stamp(cell):
        return True
    return is_grouped(cell)


_LONGEST_KEPT = 40
_holds_quantity = lru_cache(maxsize=8192)(_is_quantity)


def read_head(
    rows: Sequence[Sequence[str]],
    *,
    wanted: Collection[str] = (),
    comments: Collection[int] = (),
) -> TableHead:
    """Read what stands above the numbers of a table.

    Parameters
    ----------
    rows : sequence of sequence of str
        The first rows of a file, without blanks around the cells.
    wanted : collection of str
        Names of columns that somebody asks for: the row that has them all is the row of
        names.
    comments : collection of int
        Rows that are marked as comments: they name columns only where nothing else does.
    """
    numeric, texts = _kinds_of_columns(rows, comments)
    body = _first_row(rows, numeric, comments)
    plain = [number for number in range(body) if number not in comments]
    # A comment of fewer cells says something else.
    width = max(numeric, default=-1) + 1
    noted = [n for n in range(body) if n in comments and len(rows[n]) >= width]
    # A title may have more words than there are columns.
    noted = [n for n in noted if len(rows[n]) == width] or noted
    asked = [n for n in (*plain[::-1], *noted[::-1]) if set(wanted) <= set(rows[n])]
    units: dict[int, str] = {}
    name_row, names = -1, []
    for above in (plain, noted):
        name_row, found = _name_row(rows, above, numeric, is_named=bool(noted))
        units = {**found, **units}
        if name_row >= 0:
            break
    if wanted and asked:
        name_row = asked[0]
    if name_row >= 0:
        names = _named(rows, name_row, numeric, units)
        if not units and _are_rows_named(rows[body:], len(names)):
            names = ["", *names]
    if names and not units and not any(split_unit(one)[1] for one in names):
        units = _units_above(rows[:name_row], numeric)
    if not names and not units:
        units = _units_beside(rows, numeric)
    said = _said_of(rows[:body], names)
    for place, text in said.items():
        if place in numeric and (unit := split_unit(text)[1]):
            units.setdefault(place, unit)
    return TableHead(
        body,
        numeric,
        texts,
        tuple(names),
        name_row,
        units,
        settings=_settings(rows, body, numeric),
        scales=_scales(rows[:body], numeric),
        starts=_starts(rows[:body], numeric),
        said=said,
    )


def _units_beside(
    rows: Sequence[Sequence[str]], numeric: Sequence[int]
) -> dict[int, str]:
    """Units of a time and a signal that stand in words beside them, as Tektronix writes."""
    if len(numeric) != 2:
        return {}
    found: dict[int, str] = {}
    for row in rows[:_MOST_ROWS_BESIDE]:
        beside = row[: numeric[0]]
        for title, unit in pairwise(beside):
            place = _BESIDE.get(_letters(title))
            if place is not None and looks_like_unit(unit):
                found[numeric[place]] = bare_unit(unit)
    return found


def _said_of(rows: Sequence[Sequence[str]], names: Sequence[str]) -> dict[int, str]:
    """What rows such as ``CH1: current [mA]`` say of columns, by column."""
    found: dict[int, str] = {}
    for row in rows:
        cells = [cell for cell in row if cell]
        written = _SAID.fullmatch(cells[0]) if len(cells) == 1 else None
        # A setting is a number, a name has letters.
        if written is None or not re.search(r"[^\W\d]", written[2]):
            continue
        for place, name in enumerate(names):
            if name and _channel(name) == _channel(written[1]):
                found.setdefault(place, written[2])
    return found


def _channel(name: str) -> str:
    """Name of a channel without the word for it, in small letters: CH1, Channel 1, 1."""
    bare = split_unit(name)[0].strip().lower()
    return re.sub(r"^(?:channel|kanal|chan|ch)[\s_.]*(?=\w)", "", bare)


def _are_rows_named(body: Sequence[Sequence[str]], names: int) -> bool:
    """Whether rows begin with their number, above which no name stands, as R writes."""
    first = [row[0] for row in body[:_ROWS_BELOW] if len(row) == names + 1]
    return first == [str(number + 1) for number in range(_ROWS_BELOW)]


def _kinds_of_columns(
    rows: Sequence[Sequence[str]], comments: Collection[int]
) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Columns of numbers and columns of words, told from the last half of the rows."""
    kept = [row for number, row in enumerate(rows) if number not in comments]
    lower = kept[len(kept) // 2 :]
    numeric, texts = [], []
    for place in range(max((len(row) for row in lower), default=0)):
        cells = [row[place] for row in lower if place < len(row) and row[place]]
        values = sum(is_quantity(cell) for cell in cells)
        missing = sum(cell.lower() in MISSING_WORDS for cell in cells)
        if values and 2 * (values + missing) >= len(cells):
            numeric.append(place)
        elif len(cells) > missing:
            texts.append(place)
    return tuple(numeric), tuple(texts)


def _first_row(
    rows: Sequence[Sequence[str]], numeric: Sequence[int], comments: Collection[int]
) -> int:
    """First row whose columns of numbers hold numbers."""
    plain = [number for number in range(len(rows)) if number not in comments]

    @cache
    def is_of_table(number: int) -> bool:
        return _is_of_table(rows[number], numeric)

    def is_other(number: int) -> bool:
        return any(rows[number]) and not is_of_table(number)

    # A row of a preamble may look like one of the table; those below it do not, or it has
    # few of its cells, as the date at which a trend begins.
    def possible() -> Iterator[int]:
        for place, number in enumerate(plain):
            below = plain[place + 1 : place + 1 + _ROWS_BELOW]
            if is_of_table(number) and sum(map(is_other, below)) <= _MOST_DAMAGED:
                yield number

    filled = (number for number in possible() if _is_filled(rows[number], numeric))
    first = next(filled, next(possible(), len(rows)))
    if not numeric or first == len(rows):
        return len(rows)
    # A damaged row at the beginning is no preamble: words alone stand above it, or
    # nothing at all.
    begin = first
    for number in [n for n in plain if n < first][::-1]:
        cells = [cell for cell in _cells(rows[number], numeric) if cell]
        if not any(map(is_quantity, cells)):
            return begin if 2 * len(cells) >= len(numeric) else first
        if not is_quantity(_cells(rows[number], numeric)[0]):
            return first
        begin = number
    return begin


def _is_filled(row: Sequence[str], numeric: Sequence[int]) -> bool:
    """Whether a row has at least half of its numbers."""
    return 2 * sum(map(bool, _cells(row, numeric))) >= len(numeric)


def _is_of_table(row: Sequence[str], numeric: Sequence[int]) -> bool:
    cells = _cells(row, numeric)
    return all(map(is_value, cells)) and any(map(is_quantity, cells))


def _cells(row: Sequence[str], places: Sequence[int]) -> list[str]:
    return [row[place] if place < len(row) else "" for place in places]


def _name_row(
    rows: Sequence[Sequence[str]],
    above: Sequence[int],
    numeric: Sequence[int],
    *,
    is_named: bool,
) -> tuple[int, dict[int, str]]:
    """Row of names (-1 if there is none), and units by column.

    Parameters
    ----------
    is_named : bool
        Whether the names may stand elsewhere: then a lone row may hold units.
    """
    units: dict[int, str] = {}
    fallback = -1
    for number in reversed(above):
        row = rows[number]
        cells = [cell for cell in _cells(row, numeric) if cell]
        if 2 * len(cells) < len(numeric) or all(map(is_quantity, cells)):
            continue
        if number != above[0] and all(_letters(cell) in _PROCESSED for cell in cells):
            continue
        key = _letters(next(cell for cell in row if cell))
        # In front of the columns, or of each pair of them, stands what a row is about.
        is_about = bool(row[0]) and (0 not in numeric or row.count(row[0]) > 1)
        # A word for time in front of each pair is the name of its clock.
        is_about &= 0 not in numeric or key not in _TIME_WORDS
        is_about |= key in _OTHER_WORDS | _SCALE_WORDS or _is_title(row)
        # The same setting of all columns is no name.
        is_about |= len(set(cells[1:])) == 1 and bool(_SAID.fullmatch(cells[-1]))
        states_clock = key in _INTERVAL_WORDS | _RATE_WORDS
        is_about |= states_clock and all(map(is_quantity, filter(None, row[1:])))
        if key in _UNIT_WORDS:
            units = {**_units_of(row, numeric), **units}
            continue
        is_other = key in _OTHER_WORDS
        is_units = _is_unit_row(cells) or _is_below_names(rows, above, number, numeric)
        if (is_named or number != above[0]) and not is_other and is_units:
            units = {**_units_of(row, numeric), **units}
        elif not is_about or key in _NAME_WORDS:
            upper = above[: above.index(number)]
            return number, {**_stated_units(rows, upper, numeric), **units}
        fallback = number if fallback < 0 else fallback
    # A lone row of units is one of names too, unless others stand elsewhere.
    return -1 if is_named and units else fallback, units


def _is_below_names(
    rows: Sequence[Sequence[str]],
    above: Sequence[int],
    number: int,
    numeric: Sequence[int],
) -> bool:
    """Whether a row with a unit says the same of two columns, below one that names each."""
    place = above.index(number)
    if not place:
        return False
    here, names = (_cells(rows[n], numeric) for n in (number, above[place - 1]))
    words = [cell for cell in here if cell]
    if not any(map(looks_like_unit, words)):
        return False
    is_full = all(names) and not any(map(is_quantity, names))
    return is_full and len(set(words)) < len(words) and len(set(names)) == len(names)


def _is_title(row: Sequence[str]) -> bool:
    """Whether a row says which recording follows: run 2: step."""
    cells = [cell for cell in row if cell]
    is_numbered = len(cells) > 1 and cells[1].lstrip("#")[:1].isdigit()
    return is_numbered and counts_recordings(cells[0])


def _stated_units(
    rows: Sequence[Sequence[str]], above: Sequence[int], numeric: Sequence[int]
) -> dict[int, str]:
    """Units of rows that begin with a word for units."""
    found: dict[int, str] = {}
    for number in above:
        row = rows[number]
        if _letters(next((cell for cell in row if cell), "")) in _UNIT_WORDS:
            found |= _units_of(row, numeric)
    return found


def _units_above(
    above: Sequence[Sequence[str]], numeric: Sequence[int]
) -> dict[int, str]:
    """Units in brackets behind other names of most columns, further up."""
    for row in reversed(above):
        cells = dict(zip(numeric, _cells(row, numeric), strict=True))
        found = {n: unit for n, cell in cells.items() if (unit := split_unit(cell)[1])}
        if 2 * len(found) > len(numeric):
            return found
    return {}


def _named(
    rows: Sequence[Sequence[str]],
    number: int,
    numeric: Sequence[int],
    units: dict[int, str],
) -> list[str]:
    """Names of a row; a key in front of pairs of columns is none, nor is a unit of time.

    Some loggers write the unit of time into the row of the names, below the word time.
    """
    row = list(rows[number])
    key = _letters(next((cell for cell in row if cell), ""))
    is_key = key in _NAME_WORDS and (0 not in numeric or row.count(row[0]) > 1)
    names = ["" if is_key and _letters(cell) == key else cell for cell in row]
    over = rows[number - 1] if number else []
    for place in numeric[:1]:
        word = over[place] if place < len(over) else ""
        own = bare_unit(names[place]) if place < len(names) else ""
        if _letters(word) in _TIME_WORDS and factor_between(own, "s") is not None:
            units.setdefault(place, own)
            names[place] = word
    return names


def _scales(above: Sequence[Sequence[str]], numeric: Sequence[int]) -> dict[int, float]:
    """Factors of rows that begin with a word for them."""
    found = {}
    for row in above:
        if row and _letters(row[0]) in _SCALE_WORDS:
            for place, cell in zip(numeric, _cells(row, numeric), strict=True):
                value = plain_number(cell.replace(",", "."))
                if value is not None and value not in (0.0, 1.0):
                    found[place] = value
    return found


def _starts(above: Sequence[Sequence[str]], numeric: Sequence[int]) -> dict[int, float]:
    """Times at which columns begin, of a row that states them."""
    row = next((one for one in above if one and one[0].lower() == _STARTS_WORD), [])
    found = {}
    for place, cell in zip(numeric, _cells(row, numeric), strict=True):
        value = plain_number(cell.replace(",", "."))
        if value is not None:
            found[place] = value
    return found


def _is_unit_row(cells: Sequence[str]) -> bool:
    """Whether most cells are units: 'second' is a unit and a word."""
    known = sum(map(looks_like_unit, cells))
    numbers = any(plain_number(cell) is not None for cell in cells)
    return known > 0 and 2 * known >= len(cells) and not numbers


def _units_of(row: Sequence[str], numeric: Sequence[int]) -> dict[int, str]:
    cells = dict(zip(numeric, _cells(row, numeric), strict=True))
    return {
        place: bare_unit(cell)
        for place, cell in cells.items()
        if cell and _letters(cell) not in _UNIT_WORDS
    }


def _letters(cell: str) -> str:
    return re.sub(r"[^a-zäöü]", "", split_unit(cell)[0].lower())


def _settings(
    rows: Sequence[Sequence[str]], body: int, numeric: Sequence[int]
) -> tuple[tuple[str, float], ...]:
    """Sample times that stand above the table or beside it."""
    found: list[tuple[str, float]] = []
    for number, row in enumerate(rows[: max(body, _MOST_ROWS_BESIDE)]):
        below = rows[number + 1] if number + 1 < len(rows) else []
        for place, cell in enumerate(row):
            if not cell or (number >= body and place in numeric):
                continue
            written = _SETTING.fullmatch(cell)
            if written:
                found += _setting(written[1], written[2], written[3])
            elif plain_number(cell) is None:
                behind = row[place + 1] if place + 1 < len(row) else ""
                under = below[place] if place < len(below) else ""
                after = row[place + 2] if place + 2 < len(row) else ""
                unit = after if factor_between(after, "s") is not None else ""
                is_under = number + 1 >= body or place in numeric
                value = behind if is_quantity(behind) or is_under else under
                found += _setting(cell, value, unit)
    return tuple(dict.fromkeys(found))


def _setting(title: str, cell: str, unit: str) -> list[tuple[str, float]]:
    value = plain_number(cell.replace(",", "."))
    if value is None or len(title) > 60:
        return []
    step_s = sample_time_named(title, value, unit)
    return [] if step_s is None else [(title, step_s)]
