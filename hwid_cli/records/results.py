"""Results of whole stages: the cross-validation tensor and the tables read off it."""

from dataclasses import dataclass, field
from typing import Annotated

import numpy as np

from hwid_cli.records.model import Orders
from hwid_cli.records.rules import ArrayOf, Distances
from hwid_cli.records.shown import Shown
from hwid_cli.records.stored import ADDED_LATER
from hwid_cli.records.trust import TrustOnTests


@dataclass(frozen=True, eq=False, repr=False)
class CrossValidation(Shown):
    """RMSD of every model on every recording.

    Parameters
    ----------
    nb, nk : tuple of int
        The two axes of the order grid, as the configuration names them.
    nk_role : str
        ``poles``: orders are ``[nb, nk, 1]``; ``delay``: ``[nb, nf, nk]``.
    rmsd : ndarray, shape (n, nb, nk, m), [unit]
        NaN where there is no usable model or its output is not finite.
    status : ndarray of str, shape (n, nb, nk, m)
        ``ok`` or why the RMSD is missing.
    unit : str
        Unit of the output.
    threshold : float, [unit]
        A model covers a recording when its RMSD lies below.
    bands : TrustOnTests
        How the bands of 90 % of the widest models did, each told by the other recordings.
    """

    identified_on: tuple[str, ...]
    nb: tuple[int, ...]
    nk: tuple[int, ...]
    nk_role: str
    validated_on: tuple[str, ...]
    rmsd: Annotated[np.ndarray, Distances()]
    status: Annotated[np.ndarray, ArrayOf("UO", "words")]
    unit: str
    threshold: float
    bands: TrustOnTests = field(default=TrustOnTests(), metadata=ADDED_LATER)

    def __post_init__(self) -> None:
        shape = (
            len(self.identified_on),
            len(self.nb),
            len(self.nk),
            len(self.validated_on),
        )
        if self.rmsd.shape != shape or self.status.shape != shape:
            raise ValueError(
                f"rmsd {self.rmsd.shape} and status {self.status.shape} must have "
                f"shape {shape}"
            )

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Name and what there is of it."""
        return (
            ("models", str(self.rmsd[..., 0].size)),
            ("of recordings", str(len(self.identified_on))),
            ("on recordings", str(len(self.validated_on))),
            ("threshold", f"{self.threshold:g} {self.unit}"),
        )


@dataclass(frozen=True)
class ModelScore:
    """One model and how it did.

    Parameters
    ----------
    nb, nk : int
        Its place in the order grid.
    rmsd : float, [output unit]
        On its own recording.
    coverage : int, [-]
        Recordings on which its RMSD lies below the threshold.
    orders : Orders
        Those of the model; its delay may be another one than the grid's.
    """

    identified_on: str
    nb: int
    nk: int
    rmsd: float
    coverage: int
    orders: Orders
