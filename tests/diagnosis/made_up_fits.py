"""Made-up fits for selection: six recordings of 100 samples, the last three held out."""

from types import SimpleNamespace

import numpy as np

from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.records.candidates import CandidateFit, ParameterRef
from hwid_cli.records.drive import StandIn
from tests.diagnosis.small_drive import white

HELD_OUT = np.array([False] * 3 + [True] * 3)
# Noise of size 1: a sum of squares of 100 is noise alone.
CRITERIA = SelectionCriteria(np.full(6, 100), HELD_OUT, white(1.0))
# What a drive that stands for a simulation is asked of these recordings.
PROBLEM = SimpleNamespace(
    drive=StandIn(1.0, 1.0, 1.0, 1.0),
    signals=[
        SimpleNamespace(name=str(n), is_held_out=is_held_out, compared=np.ones(100))
        for n, is_held_out in enumerate(HELD_OUT)
    ],
)


def made_up(effects, sse, *, parameters=1, whiteness=3.0, neighbour=0.0, own=None):
    """A fit with one sum of squares for all recordings, or one for each."""
    n = 3 + parameters
    own = np.zeros((6, 0)) if own is None else np.asarray(own, float)[:, None]
    return CandidateFit(
        effects=tuple(effects),
        names=tuple(ParameterRef("n", str(j)) for j in range(n)),
        values=np.ones(n),
        own_names=(ParameterRef("parameter_change:damping", "log_damping"),)
        * own.shape[1],
        own=own,
        sse=np.broadcast_to(np.asarray(sse, float), 6).copy(),
        whiteness=whiteness,
        neighbour=neighbour,
        iterations=3,
        has_converged=True,
    )


def base(sse=400.0, **options):
    """The base alone."""
    return made_up((), sse, parameters=0, **options)
