"""A diagnosis in memory, for programs that hold recordings and write no results."""

from collections.abc import Sequence

from hwid_cli.campaign.cache import MemoryStore
from hwid_cli.campaign.diagnose import diagnose_all
from hwid_cli.campaign.runner import RunSettings, Workers
from hwid_cli.campaign.selection import select_recordings
from hwid_cli.errors import ConfigError
from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.records.experiment import DiagnoseOptions, SimulationOptions
from hwid_cli.records.recordings import Recording


def diagnose(
    recordings: Sequence[Recording],
    simulation: SimulationOptions,
    options: DiagnoseOptions | None = None,
    *,
    jobs: int | None = 1,
) -> Diagnosis:
    """Find what a simulation of a drive lacks, beside recordings of it.

    Parameters
    ----------
    recordings : sequence of Recording
        Inputs in ampere and outputs in metre unless the simulation is of other units;
        every name once.
    simulation : SimulationOptions
        The physics model, in SI units.
    options : DiagnoseOptions, optional
        Which recordings take part and are held out, which effects may be named.
    jobs : int or None, [-]
        Processes; None means one for each core.

    Returns
    -------
    Diagnosis
        What ``hwid diagnose`` writes to ``diagnosis.json``: ``verdict``, ``effects``
        with their parameters, ``explained_share``, ``summary`` in words, and more.

    Raises
    ------
    ConfigError
        If the options name unknown recordings or leave none to train on.
    ValueError
        If two recordings have one name.

    Examples
    --------
    The simulation's spring is too soft; nothing else is wrong:

    >>> import numpy as np
    >>> from scipy import signal
    >>> from hwid_cli import Recording, SimulationOptions, diagnose
    >>> rng, time_s = np.random.default_rng(1), 1e-3 * np.arange(400)
    >>> plant = signal.lti([5.0], [0.3, 15.0, 1184.0])
    >>> def measured(size):
    ...     current = size * (time_s > 0.05)
    ...     position = signal.lsim(plant, current, time_s)[1]
    ...     noise = 2e-5 * rng.standard_normal(400)
    ...     return Recording(f"step_{size}", current, position + noise, 1e-3)
    >>> simulation = SimulationOptions(
    ...     mass_kg=0.3,
    ...     damping_N_s_per_m=15.0,
    ...     stiffness_N_per_m=1000.0,
    ...     force_constant_N_per_A=5.0,
    ... )
    >>> diagnosis = diagnose([measured(size) for size in (1, 2, -3)], simulation)
    >>> diagnosis.verdict
    'parameters'
    >>> stiffness = next(p for p in diagnosis.base if p.name == "stiffness_N_per_m")
    >>> abs(stiffness.after - 1184.0) < 5.0
    True
    """
    options = options or DiagnoseOptions()
    names = [one.name for one in recordings]
    for name in names:
        if names.count(name) > 1:
            raise ValueError(f"two recordings are named {name!r}")
    chosen = select_recordings(recordings, options.recordings, key="recordings")
    if not isinstance(options.hold_out, str):
        held_out = select_recordings(chosen, options.hold_out, key="hold_out")
        if len(held_out) == len(chosen):
            raise ConfigError(
                f"hold_out: names all {len(chosen)} recordings; expected at least one "
                "left to train on; take one out, or give 'auto'"
            )
    settings = RunSettings(MemoryStore(), Workers(jobs))
    return diagnose_all(chosen, simulation, options, settings, lambda what, total: None)
