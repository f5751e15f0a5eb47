"""Whether what a run of a foreign simulation gave is an answer."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from hwid_cli.errors import SimulationError
from hwid_cli.files.suggestions import did_you_mean
from hwid_cli.records.programs import RunRequest, SimulatorRun


def checked_run(
    outputs: Mapping[str, np.ndarray], options: Any, request: RunRequest
) -> SimulatorRun:
    """Outputs that the diagnosis needs, out of all that a run gave.

    Parameters
    ----------
    outputs : mapping of str to ndarray
        By name.
    options : PythonSimulation, FmuSimulation or CommandSimulation
        Which of them is what.

    Raises
    ------
    SimulationError
        If one is missing, of another length, or not finite.
    """
    found = {}
    for key in ("output", "velocity"):
        name = getattr(options, key)
        if name is None:
            found[key] = np.zeros(0)
            continue
        if name not in outputs:
            raise failed(
                request,
                f"gave {_listed(outputs)}; expected {name!r} "
                f"(simulation.{key}); {did_you_mean(name, list(outputs))}",
            )
        found[key] = _checked(outputs[name], name, request)
    return SimulatorRun(found["output"], found["velocity"])


def _checked(values: np.ndarray, name: str, request: RunRequest) -> np.ndarray:
    if values.shape != request.input.shape:
        raise failed(
            request,
            f"gave {name!r} of shape {values.shape}; expected {request.input.shape}, one "
            "value for each time",
        )
    wrong = np.flatnonzero(~np.isfinite(values))
    if wrong.size:
        at = int(wrong[0])
        raise failed(
            request,
            f"gave {name!r} = {values[at]} at {at * request.sample_time_s:g} s; expected "
            "finite numbers; narrow simulation.parameters bounds or mend the simulation",
        )
    return np.array(values, dtype=np.float64)


def failed(request: RunRequest, reason: str) -> SimulationError:
    """What to say of a run that gave no answer.

    Parameters
    ----------
    reason : str
        Follows the name of the run.
    """
    values = ", ".join(f"{key}={one:g}" for key, one in request.parameters.items())
    with_them = f" with {values}" if values else ""
    return SimulationError(
        f"simulation: run of recording {request.name!r}{with_them}: {reason}"
    )


def _listed(names: Mapping[str, object]) -> str:
    return ", ".join(repr(str(one)) for one in names) or "nothing"
