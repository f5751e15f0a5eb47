"""Results of three small runs, made up so that every number is known."""

import numpy as np

from hwid_cli.records.groups import FinalTest, Group, GroupSearch, Join, Prediction
from hwid_cli.records.results import CrossValidation
from tests.store.record_examples import example_fit
from tools.reproduction_here import Results

STEPS = tuple(f"step_{n:02d}" for n in range(1, 16))
SINES = tuple(f"sine_{n:02d}" for n in range(1, 24))
TESTED_ON = ("step_05", "step_10", "step_11")
THRESHOLD = 0.01


def crossval_of(rmsd, names):
    """One model for each recording, on all of them."""
    shape = (len(rmsd), 1, 1, len(names))
    return CrossValidation(
        identified_on=tuple(names[: len(rmsd)]),
        nb=(2,),
        nk=(2,),
        nk_role="poles",
        validated_on=tuple(names),
        rmsd=np.asarray(rmsd, dtype=float).reshape(shape),
        status=np.full(shape, "ok"),
        unit="m",
        threshold=THRESHOLD,
    )


def group_of(recordings, coverage, *, is_kept=True):
    return Group(recordings, coverage, 3, 7, 0.002, 0.02, 100, 90, 80, is_kept=is_kept)


def join_of(names):
    if len(names) == 1:
        return Join(1, names[0], "", names[0])
    return Join(len(names), "+".join(names[:-1]), names[-1], "+".join(names))


def search_of(best, validated_on):
    """A chain that grows by one recording a level, and one worse group beside it."""
    groups, joins, chain = [], [], []
    for level, coverage in enumerate(best, start=1):
        names = tuple(validated_on[:level])
        groups.append(group_of(names, coverage))
        joins.append(join_of(names))
        chain.append("+".join(names))
        other = (*names[:-1], validated_on[level])
        groups.append(group_of(other, max(coverage - 1, 0), is_kept=False))
        joins.append(join_of(other))
    return GroupSearch(
        groups=tuple(groups),
        joins=tuple(joins),
        fits=(None,) * len(groups),
        validated_on=tuple(validated_on),
        rmsd=np.full((len(groups), len(validated_on)), 0.02),
        chain=tuple(chain),
        reason="the coverage no longer grows",
        join="experiments",
        unit="m",
        threshold=THRESHOLD,
    )


def final_of(rmsd, models, recordings, *, n_chain, tested_on=TESTED_ON, chosen=None):
    """The final test of models whose RMSDs are given."""
    rmsd = np.asarray(rmsd, dtype=float)
    on = [model.rsplit("/", 2)[0].split("+") for model in models]
    is_own = np.array([[name in names for name in recordings] for names in on])
    covered = rmsd < THRESHOLD
    best = [models[int(np.nanargmin(column))] for column in rmsd.T]
    chosen = tuple(dict.fromkeys(best)) if chosen is None else chosen
    return FinalTest(
        models=tuple(models),
        chain=tuple(models[len(models) - n_chain :]),
        recordings=tuple(recordings),
        tested_on=tested_on,
        rmsd=rmsd,
        is_own=is_own,
        covers=(covered & ~is_own).sum(axis=1),
        covered_by=(covered & ~is_own).sum(axis=0),
        uncovered=tuple(
            name
            for name, column in zip(recordings, covered.T, strict=True)
            if not column.any()
        ),
        hard_to_cover=(),
        assigned=tuple(best),
        smallest_set=chosen,
        assigned_in_set=tuple(best),
        predictions=tuple(
            Prediction(name, "b", 0.1, best[0], 0.1, best[0], 0.1, False, False)
            for name in recordings
        ),
        unit="m",
        threshold=THRESHOLD,
    )


def full_results(seed=3):
    """All stages of all runs, of the thesis's size, with random numbers."""
    rng = np.random.default_rng(seed)
    everything = STEPS + SINES
    validated_on = tuple(name for name in STEPS if name not in TESTED_ON)
    rmsd = 10.0 ** rng.uniform(-4.0, 0.0, size=(15, 15))
    rmsd[3, 4] = np.nan
    finals, searches = [], []
    for names, best in (
        (validated_on, (6, 7, 8, 8)),
        (SINES[:6] + validated_on, (9, 11, 14, 17, 18, 18)),
    ):
        chain = [f"{'+'.join(names[:n])}/10/10" for n in range(1, len(best) + 1)]
        singles = [f"{name}/2/2" for name in names[1:]]
        values = 10.0 ** rng.uniform(-4.0, 5.0, size=(len(singles + chain), 38))
        values[0, 0] = np.nan
        finals.append(final_of(values, singles + chain, everything, n_chain=len(chain)))
        searches.append(search_of(best, names))
    return Results(
        fits=tuple(example_fit(name, seed=n) for n, name in enumerate(STEPS)),
        crossval=crossval_of(rmsd, STEPS),
        search_1=searches[0],
        search_2=searches[1],
        final_1=finals[0],
        final_2=finals[1],
    )
