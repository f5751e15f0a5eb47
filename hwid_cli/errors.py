"""Errors that a user can act on; the command line shows them as one line.

A message names the place, the value found, what was expected, and the next step.
Wrong shapes inside the pure rooms stay ``ValueError``: they are our bugs, not the user's.
"""


class HwidError(Exception):
    """Base of every error that a user can mend."""


class ConfigError(HwidError):
    """The configuration says something that cannot be done."""


class MeasurementError(HwidError):
    """A measurement file cannot be used as it is."""


class MissingColumnError(MeasurementError):
    """A measurement file lacks a column that is asked for."""


class MissingLibraryError(MeasurementError):
    """A measurement file needs a library that is not installed."""


class CacheError(HwidError):
    """The cache or a results file cannot be read or written."""


class UntrustedFunctionError(CacheError):
    """Stored results hold Python that the user has not named."""


class WorkerError(HwidError):
    """A process that computes was killed, and killed again."""


class ModelFileError(HwidError):
    """An exported model cannot be used as it is."""


class SimulationError(HwidError):
    """A simulation of the user's does not run, or gives what is no answer."""


class NothingToDo(HwidError):
    """What was asked for cannot be done yet, and that is no fault: measurements lack."""
