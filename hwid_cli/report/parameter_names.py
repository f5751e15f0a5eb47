"""Names of parameters that end in their unit, taken apart for people."""

# What a unit in a name is made of.
_UNITS = {"N", "m", "kg", "A", "V", "H", "ohm", "s", "Hz", "rad", "deg"}
_PER = "per"


def quantity_and_unit(name: str) -> tuple[str, str]:
    """Take the name of a parameter apart.

    Parameters
    ----------
    name : str

    Returns
    -------
    quantity : str
        In words.
    unit : str
        A dash where there is none.

    Examples
    --------
    >>> quantity_and_unit("drag_N_s2_per_m2")
    ('drag', 'N s^2/m^2')
    >>> quantity_and_unit("position_gain_per_s"), quantity_and_unit("damping_ratio")
    (('position gain', '1/s'), ('damping ratio', '-'))
    """
    words = name.split("_")
    first = len(words)
    # The first word is never a unit: it says what the number is.
    while first > 1 and _is_unit(words[first - 1]):
        first -= 1
    above, _, below = "_".join(words[first:]).partition(_PER)
    unit = _product(above) or "1"
    if below:
        unit += f"/{_product(below)}"
    return " ".join(words[:first]), unit if first < len(words) else "-"


def _is_unit(word: str) -> bool:
    return word == _PER or word.rstrip("234") in _UNITS


def _product(words: str) -> str:
    """``_N_s2_`` as ``N s^2``."""
    parts = [word for word in words.split("_") if word]
    return " ".join(
        f"{part[:-1]}^{part[-1]}" if part[-1].isdigit() else part for part in parts
    )
