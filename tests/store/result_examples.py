"""Small results of every stage, for tests of their files."""

import numpy as np

from hwid_cli.records.recordings import CalibrationLog, Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.store.result_files import Provenance

PROVENANCE = Provenance(
    key="k1", config={"name": "tiny", "orders": {"nb": [1, 2]}}, inputs={"r10": "ff"}
)


def recordings():
    rng = np.random.default_rng(1)
    return tuple(
        Recording(name, rng.normal(size=9), rng.normal(size=9), 0.001, "sine", "ff")
        for name in ("r2", "r10", "r1.5 µ")
    )


def logs():
    return tuple(
        CalibrationLog(r.name, ("cut",), 3, 9, 15, 14, 0.1, 0.2, 7.5, (4,), ())
        for r in recordings()
    )


def crossval(unit="m"):
    rng = np.random.default_rng(2)
    rmsd = rng.normal(size=(2, 3, 1, 4)) ** 2
    rmsd[0, 1, 0, 2] = np.nan
    status = np.where(np.isnan(rmsd), "not finite", "ok")
    names = ("step_2", "step_10", "µ", "step_2+step_10")
    return CrossValidation(
        names[:2], (1, 2, 5), (3,), "poles", names, rmsd, status, unit, 0.01
    )
