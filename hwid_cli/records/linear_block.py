"""The linear block: its orders, and one that the user gives."""

from dataclasses import dataclass


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
