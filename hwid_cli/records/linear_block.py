"""The linear block: its orders, and one that the user gives."""

import math
from dataclasses import dataclass, replace

import numpy as np


@dataclass(frozen=True, order=True)
class Orders:
    """Orders of the linear block B(q)/F(q), as in MATLAB's ``[nb nf nk]``.

    Parameters
    ----------
    nb : int, [-]
        Number of numerator coefficients, at least 1.
    nf : int, [-]
        Number of poles, at least 0.
    nk : int, [samples]
        Delay from input to output, at least 0.

    Raises
    ------
    ValueError
        If an order is out of its range.
    """

    nb: int
    nf: int
    nk: int

    def __post_init__(self) -> None:
        for name, least in (("nb", 1), ("nf", 0), ("nk", 0)):
            value = getattr(self, name)
            if value != int(value) or value < least:
                raise ValueError(f"{name} must be an integer >= {least}, got {value!r}")
            object.__setattr__(self, name, int(value))

    @property
    def n_state(self) -> int:
        """Number of past values that the linear block remembers."""
        return max(self.nf, self.nb + self.nk - 1)

    def contains(self, smaller: "Orders") -> bool:
        """Tell whether every model of some orders is also one of these.

        Parameters
        ----------
        smaller : Orders

        Returns
        -------
        bool

        Examples
        --------
        >>> Orders(3, 2, 1).contains(Orders(2, 2, 2))
        True
        >>> Orders(2, 2, 2).contains(Orders(2, 2, 1))
        False
        """
        return (
            smaller.nf <= self.nf
            and self.nk <= smaller.nk
            and smaller.nk + smaller.nb <= self.nk + self.nb
        )


@dataclass(frozen=True)
class LinearBlock:
    """A linear block B/F that the user gives, in the units of the data.

    Parameters
    ----------
    numerator : tuple of float, length nb, [output unit / input unit]
        Coefficients of ``q^-delay ... q^-(delay + nb - 1)``. With an output map of a
        free gain any unit does.
    denominator : tuple of float, length nf + 1, [-]
        Coefficients of ``q^0 ... q^-nf``; the first is 1.
    delay : int, [samples]
        nk.
    frozen : bool
        Whether the fit keeps the block as it is; else it is one more start.

    Raises
    ------
    ValueError
        If the numbers are no linear block.
    """

    numerator: tuple[float, ...]
    denominator: tuple[float, ...]
    delay: int = 1
    frozen: bool = False

    def __post_init__(self) -> None:
        for name in ("numerator", "denominator"):
            values = tuple(float(value) for value in getattr(self, name))
            if not all(math.isfinite(value) for value in values):
                raise ValueError(f"{name} must be finite numbers, got {list(values)}")
            object.__setattr__(self, name, values)
        if not any(self.numerator):
            raise ValueError(
                f"numerator must have a coefficient other than 0, got "
                f"{list(self.numerator)}"
            )
        if not self.denominator or self.denominator[0] != 1.0:
            raise ValueError(
                f"denominator must start with 1, got {list(self.denominator)}; divide "
                "both by its first coefficient"
            )
        if self.delay != int(self.delay) or self.delay < 0:
            raise ValueError(f"delay must be an integer >= 0, got {self.delay!r}")

    @property
    def orders(self) -> Orders:
        """Orders ``[nb nf nk]``."""
        return Orders(len(self.numerator), len(self.denominator) - 1, self.delay)

    @property
    def pole_radius(self) -> float:
        """Distance of the outermost pole from zero; 0 without poles."""
        return float(np.max(np.abs(np.roots(self.denominator)), initial=0.0))

    def in_units(self, input_unit: float, output_unit: float) -> "LinearBlock":
        """Give the same block for signals that are divided by these units.

        Parameters
        ----------
        input_unit, output_unit : float
            Positive.

        Returns
        -------
        LinearBlock
        """
        factor = input_unit / output_unit
        return replace(self, numerator=tuple(b * factor for b in self.numerator))
