"""Stage ``test``: the final models on all recordings, those never used before included.

Judged are the widest model of each single recording and the best model of each group in
the chain that the search for groups followed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.campaign.cache import task_key
from hwid_cli.campaign.coverage_matrix import (
    JudgedModels,
    are_hard_to_cover,
    assign,
    count_covered_by,
    count_covers,
    smallest_set,
)
from hwid_cli.campaign.crossval import deviation_tasks
from hwid_cli.campaign.identify import recording_key
from hwid_cli.campaign.predictions import predict_all
from hwid_cli.campaign.ranking import best_of_each, score_models
from hwid_cli.campaign.runner import RunSettings, Task, run_tasks
from hwid_cli.maths.input_distance import input_distances
from hwid_cli.records.groups import ChainTrend, FinalTest, GroupSearch
from hwid_cli.records.model import Fit
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation

STAGE = "test"
STAGE_VERSION = 2


@dataclass(frozen=True, eq=False)
class FinalModels:
    """The models that the final test judges.

    Parameters
    ----------
    names : tuple of str
        ``step_06/3/7``; those of single recordings, then the chain.
    fits : tuple of Fit
        In the order of the names; each has a model.
    n_chain : int, [-]
        How many of them, the last ones, are the chain.
    """

    names: tuple[str, ...]
    fits: tuple[Fit, ...]
    n_chain: int

    @property
    def chain(self) -> tuple[str, ...]:
        """Names of the chain's models, level by level."""
        return self.names[len(self.names) - self.n_chain :]


def final_models(
    fits: Sequence[Fit], crossval: CrossValidation, search: GroupSearch | None
) -> FinalModels:
    """Choose the models to judge.

    Parameters
    ----------
    fits : sequence of Fit
        Of single recordings, of which the tensor was made, in the same order.
    crossval : CrossValidation
        Says which model of each recording is its widest.
    search : GroupSearch or None
        None if there was no search for groups; there is no chain then.

    Returns
    -------
    FinalModels
        The recording that the chain starts from is there with the chain's first model
        only: two of its models would count as two that cover. Recordings without any
        usable model are left out.
    """
    places = [
        (name, nb, nk)
        for name in crossval.identified_on
        for nb in crossval.nb
        for nk in crossval.nk
    ]
    by_place = dict(zip(places, fits, strict=True))
    singles = {
        f"{best.identified_on}/{best.nb}/{best.nk}": by_place[
            best.identified_on, best.nb, best.nk
        ]
        for best in best_of_each(score_models(fits, crossval), crossval.identified_on)
    }
    chain: dict[str, Fit] = {}
    if search is not None:
        found = {
            group.name: (group.model_name, fit)
            for group, fit in zip(search.groups, search.fits, strict=True)
            if fit is not None
        }
        chain = dict(found[name] for name in search.chain if name in found)
    grouped = {fit.identified_on for fit in chain.values()}
    alone = {k: fit for k, fit in singles.items() if fit.identified_on not in grouped}
    usable = {k: fit for k, fit in (alone | chain).items() if fit.model is not None}
    return FinalModels(
        tuple(usable), tuple(usable.values()), sum(name in chain for name in usable)
    )


def judge_models(
    models: FinalModels,
    recordings: Sequence[Recording],
    tested_on: Sequence[str],
    threshold: float,
    settings: RunSettings,
) -> FinalTest:
    """Judge the final models on every recording.

    Parameters
    ----------
    models : FinalModels
    recordings : sequence of Recording
        All of them.
    tested_on : sequence of str
        Those that nothing else has used.
    threshold : float, [output unit]
    settings : RunSettings

    Returns
    -------
    FinalTest
    """
    done = run_tasks(final_test_tasks(models, recordings), settings)
    # Tasks run over recordings, each with all models.
    rmsd = np.array([item.result.rmsd for item in done]).T.copy()
    names = tuple(recording.name for recording in recordings)
    is_own = np.array(
        [[name in fit.identified_on for name in names] for fit in models.fits],
        dtype=bool,
    ).reshape(rmsd.shape)
    return judge_table(
        JudgedModels(models.names, names, rmsd, is_own, threshold),
        chain=models.chain,
        tested_on=tested_on,
        distances=input_distances([recording.input for recording in recordings]),
        unit=recordings[0].output_unit,
    )


def judge_table(
    judged: JudgedModels,
    *,
    chain: Sequence[str],
    tested_on: Sequence[str],
    distances: np.ndarray,
    unit: str,
) -> FinalTest:
    """Read the final test's result off a table of RMSDs.

    Parameters
    ----------
    judged : JudgedModels
    chain : sequence of str
        The last of the models: those of the chain, level by level.
    tested_on : sequence of str
        Recordings that nothing else has used.
    distances : ndarray, shape (n_recordings, n_recordings), [-]
        Between the inputs of the recordings.
    unit : str
        Of the output.

    Returns
    -------
    FinalTest
    """
    names, covered = judged.recordings, judged.covered
    chosen = smallest_set(judged.rmsd, judged.threshold)
    in_set = replace(
        judged,
        models=tuple(judged.models[n] for n in chosen),
        rmsd=judged.rmsd[chosen],
        is_own=judged.is_own[chosen],
    )
    is_known = ~np.isin(names, tested_on)
    return FinalTest(
        models=judged.models,
        chain=tuple(chain),
        recordings=names,
        tested_on=_named(names, ~is_known),
        rmsd=judged.rmsd,
        is_own=judged.is_own,
        covers=count_covers(covered, judged.is_own),
        covered_by=count_covered_by(covered, judged.is_own),
        uncovered=_named(names, np.sum(covered, axis=0) == 0),
        hard_to_cover=_named(names, are_hard_to_cover(covered, judged.is_own)),
        assigned=_assigned(judged),
        smallest_set=in_set.models,
        assigned_in_set=_assigned(in_set),
        predictions=predict_all(in_set, distances, is_known),
        unit=unit,
        threshold=judged.threshold,
    )


def final_test_tasks(
    models: FinalModels, recordings: Sequence[Recording]
) -> tuple[Task, ...]:
    """List the tasks: all models on one recording each.

    Parameters
    ----------
    models : FinalModels
    recordings : sequence of Recording

    Returns
    -------
    tuple of Task
    """
    contents = [recording_key(recording) for recording in recordings]
    return deviation_tasks(
        [fit.model for fit in models.fits], recordings, contents, "final models"
    )


def final_test_key(
    models: FinalModels,
    recordings: Sequence[Recording],
    tested_on: Sequence[str],
    threshold: float,
) -> str:
    """Content key of the whole stage: its RMSDs and all that is read off them.

    Parameters
    ----------
    models : FinalModels
    recordings : sequence of Recording
    tested_on : sequence of str
    threshold : float, [output unit]

    Returns
    -------
    str
    """
    settings = {
        "rmsds": [task.key for task in final_test_tasks(models, recordings)],
        "models": models.names,
        "identified_on": [fit.identified_on for fit in models.fits],
        "chain": models.chain,
        "recordings": [recording.name for recording in recordings],
        "tested_on": sorted(tested_on),
        "threshold": threshold,
    }
    return task_key(STAGE, STAGE_VERSION, settings, [])


def chain_trend(final: FinalTest, kinds: Mapping[str, str]) -> ChainTrend:
    """Follow the chain: its RMSD on the test recordings and what it covers.

    Parameters
    ----------
    final : FinalTest
    kinds : mapping of str to str
        Kind of each recording by its name.

    Returns
    -------
    ChainTrend
        Own recordings count in the coverage, as in the published chain tables: a longer
        chain has more of them, and what it has learnt is covered, too.
    """
    rows = [final.models.index(name) for name in final.chain]
    rmsd = final.rmsd[rows]
    is_tested = np.isin(final.recordings, final.tested_on)
    of_recording = np.array([kinds[name] for name in final.recordings])
    present = tuple(dict.fromkeys(of_recording.tolist()))
    covered = rmsd < final.threshold
    return ChainTrend(
        models=final.chain,
        tested_rmsd=tuple(np.mean(rmsd[:, is_tested], axis=1).tolist()),
        kinds=present,
        coverage=np.array(
            [np.sum(covered[:, of_recording == kind], axis=1) for kind in present]
        ).T,
    )


def _named(names: Sequence[str], chosen: np.ndarray) -> tuple[str, ...]:
    return tuple(name for name, is_it in zip(names, chosen, strict=True) if is_it)


def _assigned(judged: JudgedModels) -> tuple[str, ...]:
    """Name the best model for each recording; empty where there is none."""
    return tuple("" if n < 0 else judged.models[n] for n in assign(judged.rmsd))
