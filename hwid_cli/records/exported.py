"""A model that leaves the program: what it is, and what a user elsewhere must know of it."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from hwid_cli.records.drive import Drive
from hwid_cli.records.experiment import Columns, FileUnits
from hwid_cli.records.model import HammersteinWiener
from hwid_cli.records.recordings import frozen_vector
from hwid_cli.records.trust import ModelTrust

# How a prediction may start: by the model's own rule, empty, or in equilibrium.
STARTS_OF_PREDICTIONS = ("fitted", "empty", "steady")


@dataclass(frozen=True)
class ModelCard:
    """What belongs to an exported model besides its equations.

    Parameters
    ----------
    name : str
        ``step_06/3/7``; ``simulation`` for a physics simulation.
    title : str
        The name in the form of the published tables.
    columns : Columns
        Where time, input and output stand in measurement files.
    input_range : tuple of float, [input unit]
        Lowest and highest input of the recordings that the model was made of.
    input_scale, output_scale : float
        What the columns of a file are multiplied by to be in these units.
    file_units : FileUnits or None
        Units of these columns before that, where they are known; None in files of earlier
        versions, which do not say it.
    origin : mapping
        Configuration, hashes of the data, the fit, versions; plain data.
    """

    name: str
    title: str
    columns: Columns
    input_range: tuple[float, float]
    input_unit: str = "A"
    output_unit: str = "m"
    input_scale: float = 1.0
    output_scale: float = 1.0
    file_units: FileUnits | None = None
    origin: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class ExportedModel:
    """A Hammerstein-Wiener model outside of the results.

    Parameters
    ----------
    static_gain : float, [-]
        Of the linear block at zero frequency; infinite with a pole at 1.
    trust : ModelTrust or None
        What is known of its errors; None in files of earlier versions.
    """

    card: ModelCard
    model: HammersteinWiener
    static_gain: float
    trust: ModelTrust | None = None

    @property
    def sample_time_s(self) -> float:
        """Of the model, in seconds."""
        return self.model.sample_time_s

    @property
    def initial_state(self) -> str | None:
        """Rule of the model's fit; one of ``model.INITIAL_STATES``."""
        return self.model.initial_state


@dataclass(frozen=True, eq=False)
class ExportedSimulation:
    """A physics simulation outside of the results.

    Parameters
    ----------
    sample_time_s : float, [s]
        Of the recordings that it was compared with.
    slots : ndarray, shape (n_slots,)
        All parameters as the compiled simulation reads them.
    trust : ModelTrust or None
        What is known of its errors; None in files of earlier versions.
    """

    card: ModelCard
    drive: Drive
    sample_time_s: float
    slots: np.ndarray = field(default_factory=lambda: np.zeros(0))
    trust: ModelTrust | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "slots", frozen_vector(self.slots, "slots"))

    @property
    def initial_state(self) -> str | None:
        """None: a drive starts at rest, not by the rule of a fit."""
        return None


Exported = ExportedModel | ExportedSimulation
