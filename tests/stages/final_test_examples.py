"""Results of a final test that look like those of the published experiment."""

from functools import cache

import numpy as np

from hwid_cli.stages.coverage_matrix import ScoredModels
from hwid_cli.stages.test import score_table

STEPS = tuple(f"step_{n:02d}" for n in range(1, 16))
SINES = tuple(f"sine_{n:02d}" for n in range(1, 24))
KINDS = {name: name.split("_")[0] for name in (*STEPS, *SINES)}
TESTED_ON = ("step_05", "step_10", "sine_03")
LEVELS = ("step_06", "step_09", "step_01", "step_08")


@cache
def example_final_test(seed=1, n_chain=4):
    """38 recordings, 35 of them with models of their own, and a chain of groups."""
    rng = np.random.default_rng(seed)
    recordings = (*STEPS, *SINES)
    singles = [(name,) for name in recordings if name not in TESTED_ON]
    chain = [LEVELS[:n] for n in range(1, n_chain + 1)]
    groups = [*(one for one in singles if one not in chain), *chain]
    models = tuple(f"{'+'.join(group)}/{3 + len(group)}/7" for group in groups)
    is_own = np.array([[name in group for name in recordings] for group in groups])
    rmsd = np.where(
        is_own,
        rng.uniform(1e-4, 9e-3, is_own.shape),
        rng.lognormal(np.log(0.03), 0.7, is_own.shape),
    )
    rmsd[1, 20] = np.nan
    return score_table(
        ScoredModels(models, recordings, rmsd, is_own, 0.01),
        chain=models[len(models) - n_chain :],
        tested_on=TESTED_ON,
        distances=rng.uniform(0, 1, (38, 38)),
        unit="m",
    )
