"""What ``from hwid_cli import ...`` gives, for type checkers: the same as ``_PUBLIC``."""

from hwid_cli.errors import HwidError as HwidError
from hwid_cli.export.loading import load_model as load_model
from hwid_cli.model.fit import fit as fit
from hwid_cli.model.scores import fit_percent as fit_percent
from hwid_cli.model.scores import rmsd as rmsd
from hwid_cli.model.simulate import simulate as simulate
from hwid_cli.model.uncertainty import parameter_covariance as parameter_covariance
from hwid_cli.python.estimator import (
    HammersteinWienerRegressor as HammersteinWienerRegressor,
)
from hwid_cli.python.functions import crossval as crossval
from hwid_cli.python.functions import diagnose as diagnose
from hwid_cli.python.functions import fit_grid as fit_grid
from hwid_cli.python.functions import group as group
from hwid_cli.python.functions import identify as identify
from hwid_cli.records.diagnosis import Diagnosis as Diagnosis
from hwid_cli.records.experiment import Columns as Columns
from hwid_cli.records.experiment import DiagnoseOptions as DiagnoseOptions
from hwid_cli.records.experiment import GroupOptions as GroupOptions
from hwid_cli.records.experiment import OrdersOptions as OrdersOptions
from hwid_cli.records.experiment import SimulationOptions as SimulationOptions
from hwid_cli.records.fit_grid import FitGrid as FitGrid
from hwid_cli.records.maps import MapFunction as MapFunction
from hwid_cli.records.maps import OwnFunction as OwnFunction
from hwid_cli.records.model import Fit as Fit
from hwid_cli.records.model import FitOptions as FitOptions
from hwid_cli.records.model import HammersteinWiener as HammersteinWiener
from hwid_cli.records.model import Orders as Orders
from hwid_cli.records.recordings import Recording as Recording
from hwid_cli.stages.single_recording import load_recording as load_recording

__version__: str
__all__: list[str]
