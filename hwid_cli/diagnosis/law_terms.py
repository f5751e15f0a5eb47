"""Named terms that a law may be made of, in displacement, velocity, input and time.

What is proportional to displacement, velocity or input is a matter of the base.
docs/method_diagnosis.md, eq. (D35).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from itertools import product

import numpy as np

from hwid_cli.drive.effect import Scales
from hwid_cli.drive.formula import evaluate, names, parsed

# Shares of the largest displacement and velocity at which a law may set in.
_PLACES = (0.3, 0.5, 0.7)
_SPEEDS = (0.3, 0.6)
# The same of a speed beyond which a brake holds less.
_BRAKE = 0.5
# The same at which a force levels off.
_BENDS = (0.15, 0.4)
# The same at which it peaks, to either side, and how wide a peak is.
_PEAKS, _WIDTHS = (0.1, 0.35, 0.7), (0.1, 0.3)
# Gaps across which a force pulls; a motion never closes them.
_GAPS = (1.4, 2.5)
_MOST_WAVES = 2
# Exponents that a power is tried with before it is refined.
_POWERS = (0.5, 1.5, 2.0, 3.0, 5.0)


@dataclass(frozen=True)
class Term:
    """One term without its coefficient.

    Parameters
    ----------
    formula : str
        In x, v, u, t and the names of its shape.
    exponents : tuple of float
        Of m, s and the input's unit in it.
    shape : mapping of str to tuple of (float, str)
        Values and units of what is fitted beside the coefficient: thresholds, periods.
        No unit stands for that of the input.
    family : str
        Terms of one family differ in their shape only.
    """

    formula: str
    exponents: tuple[float, float, float]
    shape: Mapping[str, tuple[float, str]] = field(default_factory=dict)
    family: str = ""

    @property
    def kind(self) -> str:
        """Its family, or itself where it has none."""
        return self.family or self.formula

    @property
    def variables(self) -> set[str]:
        """Which of x, v, u and t it depends on."""
        return names(parsed(self.formula)) - set(self.shape)

    def values(self, at: Mapping[str, np.ndarray]) -> np.ndarray:
        """The term along a motion.

        Parameters
        ----------
        at : mapping of str to ndarray, shape (n_samples,)
            ``x``, ``v``, ``u`` and ``t``.

        Returns
        -------
        ndarray, shape (n_samples,)
        """
        shape = {name: value for name, (value, _) in self.shape.items()}
        return np.asarray(evaluate(parsed(self.formula), {**at, **shape}))


def coefficient_unit(term: Term, of: str, units: tuple[str, str]) -> str:
    """Unit of a term's coefficient.

    Parameters
    ----------
    of : str
        Unit of what the law gives.
    units : tuple of str
        Of the displacement and of the input.

    Examples
    --------
    >>> coefficient_unit(Term("x*abs(v)", (2.0, -1.0, 0.0)), "N", ("m", "A"))
    'N s/m^2'
    >>> coefficient_unit(Term("sign(v)", (0.0, 0.0, 0.0)), "N", ("m", "A"))
    'N'
    """
    above = [] if of == "1" else [of]
    below = []
    length, source = units
    for unit, exponent in zip((length, "s", source), term.exponents, strict=True):
        left = -exponent
        size = "" if abs(left) == 1 else f"^{abs(left):g}"
        if left > 0:
            above.append(unit + size)
        elif left < 0:
            below.append(unit + size)
    text = " ".join(above) or "1"
    if not below:
        return text
    return f"{text}/{below[0]}" if len(below) == 1 else f"{text}/({' '.join(below)})"


def library(scales: Scales) -> tuple[Term, ...]:
    """Terms of a force.

    Parameters
    ----------
    scales : Scales
        Of the fitted base: sizes, and periods along the way and in time that it leaves.
    """
    found = [*_powers("x"), *_powers("v"), *_products(), *_of_input(), *_of_time()]
    found += [*_thresholds(scales), *_waves(scales), *_swings(scales)]
    return tuple(found)


def readings(scales: Scales) -> tuple[Term, ...]:
    """Terms of what a sensor reads beside the displacement."""
    waves = [one for one in _waves(scales) if one.variables == {"x"}]
    return (
        *_powers("x"),
        Term("abs(x)", (1, 0, 0)),
        Term("v", (1, -1, 0)),
        Term("abs(v)", (1, -1, 0)),
        Term("sign(v)", (0, 0, 0)),
        Term("t", (0, 1, 0)),
        Term("t*x", (1, 1, 0)),
        Term("u", (0, 0, 1)),
        Term("x*v", (2, -1, 0)),
        *waves,
    )


def _powers(name: str) -> Iterator[Term]:
    time = -1.0 if name == "v" else 0.0
    yield Term(f"sign({name})", (0, 0, 0))
    yield Term(f"abs({name})", (1, time, 0))
    yield Term(f"{name}**2", (2, 2 * time, 0))
    for power in _POWERS:
        text = f"abs({name})**{power:g}*sign({name})"
        if power == 2:
            text = f"{name}*abs({name})"
        elif power in (3, 5):
            text = f"{name}**{power:g}"
        yield Term(text, (power, power * time, 0), family=f"power of {name}")


def _products() -> Iterator[Term]:
    ways = (("x", 1), ("abs(x)", 1), ("x**2", 2), ("x*abs(x)", 2))
    speeds = (("sign(v)", 0), ("v", 1), ("abs(v)", 1), ("v*abs(v)", 2))
    for way, length in ways:
        for speed, power in speeds:
            yield Term(f"{way}*{speed}", (length + power, -power, 0))


def _of_input() -> Iterator[Term]:
    yield Term("abs(u)", (0, 0, 1))
    yield Term("u*abs(u)", (0, 0, 2))
    yield Term("u**2", (0, 0, 2))
    yield Term("u**3", (0, 0, 3))
    for other, length, time in (
        ("x", 1, 0), ("abs(x)", 1, 0), ("x**2", 2, 0), ("v", 1, -1), ("abs(v)", 1, -1),
    ):  # fmt: skip
        yield Term(f"u*{other}", (length, time, 1))
    yield Term("abs(u)*x", (1, 0, 1))
    yield Term("abs(u)*v", (1, -1, 1))
    yield Term("abs(u)*sign(v)", (0, 0, 1))


def _of_time() -> Iterator[Term]:
    for other, length, time, source in (
        ("", 0, 0, 0), ("*x", 1, 0, 0), ("*v", 1, -1, 0), ("*sign(v)", 0, 0, 0),
        ("*u", 0, 0, 1),
    ):  # fmt: skip
        yield Term(f"t{other}", (length, time + 1, source))


def _thresholds(scales: Scales) -> Iterator[Term]:
    for share in _PLACES:
        a = {"a": (share * scales.displacement_m, "m")}
        yield Term("Max(x - a, 0)", (1, 0, 0), a, "beyond a place")
        yield Term("Max(-x - a, 0)", (1, 0, 0), a, "below a place")
        yield Term("Max(abs(x) - a, 0)*sign(x)", (1, 0, 0), a, "beyond two places")
    for share in _SPEEDS:
        a = {"a": (share * scales.velocity_m_per_s, "m/s")}
        yield Term("Max(abs(v) - a, 0)*sign(v)", (1, -1, 0), a, "beyond a speed")
        a = {"a": (share * scales.current_A, "")}
        yield Term("Max(abs(u) - a, 0)*sign(u)", (0, 0, 1), a, "beyond an input")
    # Eddy currents and slip: beyond a speed they brake less. One start alone: two such terms
    # together follow any curve, and a small speed imitates dry friction.
    a = {"a": (_BRAKE * scales.velocity_m_per_s, "m/s")}
    yield Term("v/(1 + (v/a)**2)", (1, -1, 0), a, "brakes less beyond a speed")
    for share in _BENDS:
        a = {"a": (share * scales.displacement_m, "m")}
        yield Term("tanh(x/a)", (0, 0, 0), a, "levels off")
        # Air, magnetic and contact forces near a wall, on either side.
        yield Term("exp(-x/a)", (0, 0, 0), a, "fades along the way")
        yield Term("exp(x/a)", (0, 0, 0), a, "grows along the way")
    for share, width in product(_PEAKS, _WIDTHS):
        # A magnet, a detent, a worn place.
        a = {
            "a": (share * scales.displacement_m, "m"),
            "b": (width * scales.displacement_m, "m"),
        }
        yield Term("1/(1 + ((x - a)/b)**2)", (0, 0, 0), a, "peaks at a place")
        yield Term("1/(1 + ((x + a)/b)**2)", (0, 0, 0), a, "peaks at a place below")
    for share in _GAPS:
        # Magnets, plates and coils that pull across a gap, to either side.
        a = {"a": (share * scales.displacement_m, "m")}
        for sign, side in (("-", "ahead"), ("+", "behind")):
            near = f"/(1 {sign} x/a)**2"
            yield Term(f"1{near}", (0, 0, 0), a, f"pulls across a gap {side}")
            family = f"input pulls across a gap {side}"
            yield Term(f"u**2{near}", (0, 0, 2), a, family)
    yield Term("Heaviside(x)*sign(v)", (0, 0, 0))
    yield Term("Heaviside(v)*v**2", (2, -2, 0))


def _waves(scales: Scales) -> Iterator[Term]:
    for wave in scales.waves[:_MOST_WAVES]:
        period = {"l": (wave.period_m, "m")}
        for other, length, time in (("", 0, 0), ("*sign(v)", 0, 0), ("*v", 1, -1)):
            for turn in ("sin", "cos"):
                text = f"{turn}(2*pi*x/l){other}"
                yield Term(text, (length, time, 0), period, f"wave{other} {turn}")


def _swings(scales: Scales) -> Iterator[Term]:
    for frequency in scales.frequencies_Hz[:_MOST_WAVES]:
        shape = {"f": (frequency, "1/s")}
        for other, length in (("", 0), ("*x", 1)):
            for turn in ("sin", "cos"):
                text = f"{turn}(2*pi*f*t){other}"
                yield Term(text, (length, 0, 0), shape, f"swing{other} {turn}")
