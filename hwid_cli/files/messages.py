"""Which texts may stand in names, in messages and on a screen; and values in messages.

Names of recordings come from file names, which may hold anything but a slash. They go
into tables, file names, HDF5 groups and pages, so they must be plain.
"""

import unicodedata
from reprlib import Repr

# Control, unpaired surrogates; line and paragraph ends.
_REFUSED_CATEGORIES = {"Cc", "Cs", "Zl", "Zp"}
# Marks that turn the direction of what follows: a name would read as another one.
_TURNING = set("\u200e\u200f\u202a\u202b\u202c\u202d\u202e\u2066\u2067\u2068\u2069")
# A cell that begins so is a formula to a spreadsheet.
_FORMULA_STARTS = "=+-@"
_NO_FILE_NAME = set('/\\:*?"<>|')
# In UTF-8. Figures are named after recordings; a file name holds 255, its temporary one
# 42 more than the name.
LONGEST_NAME = 200
_SHOWN = Repr()
_SHOWN.maxstring = _SHOWN.maxother = 80
_SHOWN.maxlong = 40
_SHOWN.maxlist = _SHOWN.maxdict = _SHOWN.maxset = 6


def is_plain(text: str) -> bool:
    r"""Say whether a text holds nothing that a screen would obey.

    Examples
    --------
    >>> is_plain("Messung 1 µm"), is_plain("red \x1b[31m")
    (True, False)
    """
    is_usual = text.isascii() and text.isprintable()
    return is_usual or not any(map(_is_refused, text))


def escaped(text: str) -> str:
    r"""Give a text with everything visible that a screen would obey.

    Examples
    --------
    >>> escaped("run\x1b[2J")
    'run\\x1b[2J'
    """
    if is_plain(text):
        return text
    return "".join(ascii(sign)[1:-1] if _is_refused(sign) else sign for sign in text)


def shown(value: object) -> str:
    """Give a value as a message shows it: on one line, cut where it is long.

    Examples
    --------
    >>> shown("x" * 1000)[:5], len(shown("x" * 1000))
    ("'xxxx", 80)
    """
    # Integers beyond this have no decimal text in Python.
    if isinstance(value, int) and abs(value) > 10**4000:
        return "an integer of more than 4000 digits"
    return escaped(_SHOWN.repr(value))


def name_fault(name: str) -> str:
    """Say what keeps a text from being the name of a recording.

    Returns
    -------
    str
        What was expected instead; empty where nothing is wrong.

    Examples
    --------
    >>> name_fault("step_06")
    ''
    >>> name_fault("=1+1")
    "a name that does not begin with one of '= + - @ .'"
    """
    if not is_plain(name):
        return "a name without control characters"
    if not name or name != name.strip():
        return "a name without blanks at its ends"
    if name[0] in f"{_FORMULA_STARTS}.":
        return f"a name that does not begin with one of '{' '.join(_FORMULA_STARTS)} .'"
    if set(name) & _NO_FILE_NAME:
        return f"a name without {' '.join(sorted(_NO_FILE_NAME))}"
    if len(name.encode()) > LONGEST_NAME:
        return f"a name of at most {LONGEST_NAME} bytes"
    return ""


def _is_refused(sign: str) -> bool:
    return unicodedata.category(sign) in _REFUSED_CATEGORIES or sign in _TURNING
