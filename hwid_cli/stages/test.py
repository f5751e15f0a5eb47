"""Stage ``test``: the final models on all recordings, those never used before included.

Judged are the widest model of each single recording and the best model of each group in
the chain that the search for groups followed.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from hwid_cli.errors import ConfigError
from hwid_cli.records.check import StagePlan
from hwid_cli.records.experiment import Experiment, FinalTestOptions
from hwid_cli.records.groups import (
    ChainTrend,
    FinalTest,
    GroupSearch,
    SingleModels,
    SpoiltJoin,
)
from hwid_cli.records.model import Fit
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.records.trust import TrustOnTests
from hwid_cli.report import final_test
from hwid_cli.report.table import Block
from hwid_cli.report.thesis_names import names_of_groups
from hwid_cli.report.trust import trust_table
from hwid_cli.stages.coverage_matrix import (
    ScoredModels,
    are_hard_to_cover,
    assign,
    count_covered_by,
    count_covers,
    smallest_set,
)
from hwid_cli.stages.crossval import deviation_tasks
from hwid_cli.stages.fit_seconds import (
    PAIR_BYTES,
    TASK_SECONDS,
    counted,
    fit_seconds,
    middle_orders,
)
from hwid_cli.stages.identify import recording_key, recordings_with_models
from hwid_cli.stages.joint_seconds import joint_plan
from hwid_cli.stages.predictions import predict_all
from hwid_cli.stages.ranking import best_of_each, score_models
from hwid_cli.stages.selection import select_recordings
from hwid_cli.stages.stage import Context, Planning, Runner, Stage, in_results
from hwid_cli.stages.trust import trust_task
from hwid_cli.store.final_test_results import (
    read_final_test,
    write_assignment_csv,
    write_coverage_matrix_csv,
    write_final_test,
    write_test_csv,
    write_trust_csv,
)
from hwid_cli.store.result_files import Provenance
from hwid_cli.tasks.cache import task_key
from hwid_cli.tasks.runner import RunSettings, Task, run_tasks
from hwid_cli.trust.input_distance import input_distances
from hwid_cli.trust.judged import PARTS

NAME = "test"
STAGE_VERSION = 7
# Of fewer recordings none can be told to contradict the others.
_FEWEST_JOINED = 3
# A recording stands alone where it is this many times as far from the others as usual; how
# far counts at most, over the standard deviation of the output, [-].
_STANDS_OUT, _FARTHEST = 3.0, 3.0


@dataclass(frozen=True, eq=False)
class FinalModels:
    """The models that the final test scores.

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
    """Choose the models to score.

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


def score_final_models(
    models: FinalModels,
    recordings: Sequence[Recording],
    tested_on: Sequence[str],
    threshold: float,
    settings: RunSettings,
) -> FinalTest:
    """Judge the final models on every recording.

    Parameters
    ----------
    recordings : sequence of Recording
        All of them.
    tested_on : sequence of str
        Those that nothing else has used.
    threshold : float, [output unit]
    """
    done = run_tasks(final_test_tasks(models, recordings), settings)
    # Tasks run over recordings, each with all models.
    rmsd = np.array([item.result.rmsd for item in done]).T.copy()
    names = tuple(recording.name for recording in recordings)
    is_own = np.array(
        [[name in fit.identified_on for name in names] for fit in models.fits],
        dtype=bool,
    ).reshape(rmsd.shape)
    return score_table(
        ScoredModels(models.names, names, rmsd, is_own, threshold),
        chain=models.chain,
        tested_on=tested_on,
        distances=input_distances([recording.input for recording in recordings]),
        unit=recordings[0].output_unit,
    )


def score_table(
    scored: ScoredModels,
    *,
    chain: Sequence[str],
    tested_on: Sequence[str],
    distances: np.ndarray,
    unit: str,
) -> FinalTest:
    """Read the final test's result off a table of RMSDs.

    Parameters
    ----------
    chain : sequence of str
        The last of the models: those of the chain, level by level.
    tested_on : sequence of str
        Recordings that nothing else has used.
    distances : ndarray, shape (n_recordings, n_recordings), [-]
        Between the inputs of the recordings.
    unit : str
        Of the output.
    """
    names, covered = scored.recordings, scored.covered
    chosen = smallest_set(scored.rmsd, scored.threshold)
    in_set = replace(
        scored,
        models=tuple(scored.models[n] for n in chosen),
        rmsd=scored.rmsd[chosen],
        is_own=scored.is_own[chosen],
    )
    is_known = ~np.isin(names, tested_on)
    return FinalTest(
        models=scored.models,
        chain=tuple(chain),
        recordings=names,
        tested_on=_named(names, ~is_known),
        rmsd=scored.rmsd,
        is_own=scored.is_own,
        covers=count_covers(covered, scored.is_own),
        covered_by=count_covered_by(covered, scored.is_own),
        uncovered=_named(names, np.sum(covered, axis=0) == 0),
        hard_to_cover=_named(names, are_hard_to_cover(covered, scored.is_own)),
        assigned=_assigned(scored),
        smallest_set=in_set.models,
        assigned_in_set=_assigned(in_set),
        predictions=predict_all(in_set, distances, is_known),
        unit=unit,
        threshold=scored.threshold,
    )


def final_test_tasks(
    models: FinalModels, recordings: Sequence[Recording]
) -> tuple[Task, ...]:
    """List the tasks: all models on one recording each."""
    contents = [recording_key(recording) for recording in recordings]
    return deviation_tasks(
        [fit.model for fit in models.fits], recordings, contents, "final models"
    )


def final_test_key(
    models: FinalModels,
    recordings: Sequence[Recording],
    tested_on: Sequence[str],
    threshold: float,
    options: FinalTestOptions,
) -> str:
    """Content key of the whole stage: its RMSDs and all that is read off them.

    Parameters
    ----------
    threshold : float, [output unit]
    """
    settings = {
        "rmsds": [task.key for task in final_test_tasks(models, recordings)],
        "models": models.names,
        "identified_on": [fit.identified_on for fit in models.fits],
        "chain": models.chain,
        "recordings": [recording.name for recording in recordings],
        "tested_on": sorted(tested_on),
        "threshold": threshold,
        "options": options,
    }
    return task_key(NAME, STAGE_VERSION, settings, [])


def chain_trend(final: FinalTest, kinds: Mapping[str, str]) -> ChainTrend:
    """Follow the chain: its RMSD on the test recordings and what it covers.

    Parameters
    ----------
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
        singles=single_models(final),
    )


def single_models(final: FinalTest) -> SingleModels | None:
    """The models of single recordings beside a group; None where there is none.

    The one that is nearest on the test recordings is there too: tables show it, and who
    reads them asks why it was not chosen.
    """
    chosen = best_single(final)
    if chosen < 0:
        return None
    is_tested = np.isin(final.recordings, final.tested_on)
    mean = np.mean(final.rmsd[:, is_tested], axis=1)
    singles = np.flatnonzero(final.is_own.sum(axis=1) == 1)
    nearest = int(
        min(singles, key=lambda place: np.nan_to_num(mean[place], nan=np.inf))
    )
    return SingleModels(
        final.models[chosen],
        float(mean[chosen]),
        final.models[nearest],
        float(mean[nearest]),
    )


def best_single(final: FinalTest) -> int:
    """Find the best model of a single recording without a look at the test.

    Returns
    -------
    int
        Place among the models: the one that covers the largest share of the recordings
        that are neither its own nor for the test; of these the lowest mean logarithm of
        the RMSD there. Where nothing but the test was left out of the fits, the lowest
        RMSD on its own recording. -1 where there is none.
    """
    is_known = ~np.isin(final.recordings, final.tested_on)
    # Of one recording all models are, and it alone can choose.
    is_alone = np.count_nonzero(is_known) == 1
    found = []
    for place in np.flatnonzero(final.is_own.sum(axis=1) == 1):
        is_judge = is_known if is_alone else is_known & ~final.is_own[place]
        others = final.rmsd[place, is_judge]
        if others.size and np.isfinite(others).all():
            share = float(np.mean(others < final.threshold))
            # An RMSD of zero is the best there is.
            with np.errstate(divide="ignore"):
                order = float(np.mean(np.log(others)))
            found.append((-share, order, int(place)))
    return min(found)[-1] if found else -1


def _named(names: Sequence[str], chosen: np.ndarray) -> tuple[str, ...]:
    return tuple(name for name, is_it in zip(names, chosen, strict=True) if is_it)


def _assigned(scored: ScoredModels) -> tuple[str, ...]:
    """Name the best model for each recording; empty where there is none."""
    return tuple("" if n < 0 else scored.models[n] for n in assign(scored.rmsd))


@dataclass(frozen=True, eq=False)
class _Given:
    """Models, all recordings, those that nothing else has used, and what was asked."""

    models: FinalModels
    recordings: tuple[Recording, ...]
    tested_on: tuple[str, ...]
    threshold: float
    options: FinalTestOptions

    @property
    def key(self) -> str:
        """Content key of the final test."""
        return final_test_key(
            self.models, self.recordings, self.tested_on, self.threshold, self.options
        )


def _choose(context: Context) -> _Given:
    experiment, results = context.experiment, context.results
    options = _options(experiment)
    recordings, crossval = results["calibrate"].recordings, results["crossval"]
    tested = select_recordings(
        recordings,
        options.recordings,
        key=f"{experiment.source}: test.recordings",
    )
    models = final_models(results["identify"], crossval, results.get("group"))
    if not models.names:
        raise ConfigError(
            f"{experiment.source}: orders: no recording has a usable model; expected at "
            "least one to test; widen the orders or change fit"
        )
    names = tuple(recording.name for recording in tested)
    return _Given(models, recordings, names, crossval.threshold, options)


def _options(experiment: Experiment) -> FinalTestOptions:
    if experiment.test is None:
        raise ConfigError(
            f"{experiment.source}: test: the section is missing; expected the recordings "
            "that nothing else uses; add it, such as 'test: {recordings: [step_05, "
            "step_10]}'"
        )
    return experiment.test


def _compute(given: _Given, runner: Runner) -> FinalTest:
    with runner.tasks(len(given.recordings), "recordings") as settings:
        final = score_final_models(
            given.models, given.recordings, given.tested_on, given.threshold, settings
        )
    tasks = _trust_tasks(given, final)
    with runner.tasks(len(tasks), "models", part="bands") as settings:
        found = [item.result for item in run_tasks(tasks, settings)]
    rows = tuple(row for one in found for row in one.rows)
    # The first one is the model to take.
    shown = found[0].shown if found else None
    return replace(final, trust=TrustOnTests(rows, shown))


def _trust_tasks(given: _Given, final: FinalTest) -> list[Task]:
    """List the tasks: bands of each model that the test recommends."""
    taken = taken_model(final)
    first = () if taken < 0 else (final.models[taken],)
    asked = dict.fromkeys((*first, *final.smallest_set, *final.chain))
    fits = dict(zip(given.models.names, given.models.fits, strict=True))
    return [
        trust_task(name, fits[name], given.recordings, given.tested_on)
        for name in asked
    ]


def taken_model(final: FinalTest) -> int:
    """Place of the model to take: the chain's last, else the best of a single recording.

    Returns
    -------
    int, [-]
        -1 where there is none.
    """
    single = best_single(final)
    if not final.chain:
        return single
    joined = final.models.index(final.chain[-1])
    return single if _is_beaten(final, joined, single) else joined


def _is_beaten(final: FinalTest, joined: int, single: int) -> bool:
    """Whether a single model predicts better than a joined one follows its own recordings.

    What a fit has seen it is nearer to than to anything else: a recording among its own
    must contradict the others.
    """
    if single < 0 or final.is_own[joined].sum() < _FEWEST_JOINED:
        return False
    own, unseen = _both_off(final, joined, single)
    return bool(np.isfinite(unseen) and unseen < own)


def _both_off(final: FinalTest, joined: int, single: int) -> tuple[float, float]:
    """Geometric mean RMSD of both over the joined one's own that the single has not seen."""
    is_judge = final.is_own[joined] & ~final.is_own[single]
    if not is_judge.any():
        return np.nan, np.nan
    # An RMSD of zero is the best there is.
    with np.errstate(divide="ignore"):
        logs = np.mean(np.log(final.rmsd[[joined, single]][:, is_judge]), axis=1)
    return float(np.exp(logs[0])), float(np.exp(logs[1]))


def spoilt_join(final: FinalTest, recordings: Sequence[Recording]) -> SpoiltJoin | None:
    """The joined model that was not taken, and the recording that may have spoilt it.

    Returns
    -------
    SpoiltJoin or None
        None where the chain's last model is taken, or there is no chain.
    """
    if not final.chain:
        return None
    single, joined = best_single(final), final.models.index(final.chain[-1])
    if not _is_beaten(final, joined, single):
        return None
    own, unseen = _both_off(final, joined, single)
    return SpoiltJoin(final.models[joined], own, unseen, _suspect(final, recordings))


def _suspect(final: FinalTest, recordings: Sequence[Recording]) -> str:
    """The recording that stands alone: nothing predicts it, and it predicts nothing."""
    sizes = {one.name: float(np.std(one.output)) or 1.0 for one in recordings}
    known = [
        n for n, name in enumerate(final.recordings) if name not in final.tested_on
    ]
    share = final.rmsd / np.array([sizes[name] for name in final.recordings])
    share = np.minimum(np.nan_to_num(share, nan=_FARTHEST), _FARTHEST)
    is_single = final.is_own.sum(axis=1) == 1
    apart = {}
    for place in known:
        of_it = is_single & final.is_own[:, place]
        by_others = share[is_single & ~of_it, place]
        others = [n for n in known if n != place]
        if of_it.any() and others and by_others.size:
            off = min(by_others.min(), share[of_it][:, others].min())
            apart[final.recordings[place]] = float(off)
    if len(apart) < _FEWEST_JOINED:
        return ""
    worst = max(apart, key=lambda name: apart[name])
    usual = float(np.median(list(apart.values())))
    return worst if apart[worst] > _STANDS_OUT * usual else ""


def _write_csv(
    out: Path, _: _Given, final: FinalTest, __: Provenance | None, ___: bool
) -> None:
    write_test_csv(out / "test.csv", final)
    write_assignment_csv(out / "assignment.csv", final)
    write_coverage_matrix_csv(out / "coverage_matrix.csv", final)
    write_trust_csv(out / "trust.csv", final.trust.rows)


def _tables(context: Context, final: FinalTest) -> list[Block]:
    """The chain, the coverage matrix, the smallest set and the predictions."""
    blocks: list[Block] = []
    if final.chain:
        recordings = context.results["calibrate"].recordings
        kinds = {recording.name: recording.kind for recording in recordings}
        trend = chain_trend(final, kinds)
        search = context.results.get("group")
        names = names_of_groups(search) if context.experiment.thesis_names else {}
        blocks += [
            final_test.chain_on_tests_table(final, trend),
            final_test.chain_coverage_table(final, trend, names),
            *final_test.chain_tables(final, trend, kinds),
        ]
    return [
        *blocks,
        final_test.coverage_matrix_table(final),
        *final_test.gap_sentences(final),
        final_test.smallest_set_table(final),
        final_test.prediction_table(final),
        *([trust_table(final.trust.rows)] if final.trust.rows else []),
    ]


def _plan(planning: Planning) -> tuple[StagePlan, ...]:
    experiment, n = planning.experiment, len(planning.recordings)
    used = recordings_with_models(planning.recordings, experiment)
    # Nothing but parts of a single recording can judge how far its model is right.
    least = most = TASK_SECONDS * n
    reason = ""
    if len(used) == 1:
        orders, units = middle_orders(experiment.orders), experiment.fit.units
        each = fit_seconds(planning.cost, orders, used[0].n_samples, units=units)
        least = most = PARTS * each
    elif together := joint_plan(experiment, planning.recordings, planning.cost):
        # One task: its fits are not shared.
        least, most = (least + one for one in together.bands)
        reason = "the maps and orders that fit slowest are chosen"
    what, size = counted(n, "recording"), n * PAIR_BYTES
    return (StagePlan(NAME, what, n, None, least, size, most, reason),)


STAGE = Stage(
    name=NAME,
    needs=("calibrate", "identify", "crossval"),
    needs_where_named=("group",),
    sections=("test",),
    require=_options,
    choose=_choose,
    key=lambda given: given.key,
    compute=_compute,
    storage=in_results(
        NAME,
        read_final_test,
        lambda path, given, result, origin: write_final_test(path, result, origin),
    ),
    summary=lambda given, final, is_stored: (
        f"{counted(len(final.recordings), 'recording')} from the cache, 0 computed"
        if is_stored
        else ""
    ),
    write_files=_write_csv,
    tables=_tables,
    files=(
        "results.h5",
        "test.csv",
        "assignment.csv",
        "coverage_matrix.csv",
        "trust.csv",
    ),
    plan=_plan,
)
