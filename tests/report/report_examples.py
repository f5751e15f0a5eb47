"""Results of all stages as records, made up but of the shape that real ones have."""

import json
from dataclasses import replace

import numpy as np

from hwid_cli.records.groups import (
    FinalTest,
    Group,
    GroupSearch,
    Join,
    Prediction,
)
from hwid_cli.records.model import Fit, FitOptions, HammersteinWiener, Orders, StaticMap
from hwid_cli.records.recordings import Calibrated, CalibrationLog, Recording
from hwid_cli.records.report import StageRun, StoredResults
from hwid_cli.records.results import CrossValidation
from tests.report.diagnosis_examples import named

THRESHOLD = 0.01
NB, NK = (1, 2), (1, 2)


def names(count=15):
    return tuple(f"step_{number:02d}" for number in range(1, count + 1))


def model(seed=0, nb=1, nf=2):
    rng = np.random.default_rng(seed)
    points = np.linspace(-1.0, 8.0, 6)
    values = points + 0.3 * rng.normal(size=6)
    pair = 0.95 * np.exp(0.1j * np.array([1.0, -1.0]))
    poles = np.concatenate([pair, 0.4 + 0.1 * np.arange(max(0, nf - 2))])[:nf]
    denominator = np.real(np.poly(poles)) if nf > 1 else np.array([1.0, -0.9])
    numerator = np.full(nb, denominator.sum() / nb)
    return HammersteinWiener(
        StaticMap("piecewise_linear", np.append(points, values), (-0.5, 7.5)),
        numerator,
        denominator,
        1,
        StaticMap("polynomial", np.array([0.1, 0.2, 0.01]), (-0.5, 7.5)),
        5e-3,
    )


def fit(identified_on, nb=1, nf=2, rmsd=1e-4, seed=0):
    return Fit(
        identified_on=identified_on,
        orders=Orders(nb, nf, 1),
        options=FitOptions(),
        model=model(seed, nb, nf),
        status="converged",
        message="",
        rmsd=rmsd,
        fit_percent=99.0,
        is_stable=True,
    )


def recording(name, seed=0, n_samples=240):
    level = 1.0 + seed % 5
    current = np.where(np.arange(n_samples) < 30, 0.0, level)
    time = np.clip(np.arange(n_samples) - 30, 0, None)
    rng = np.random.default_rng(seed)
    output = 0.1 * level * (1 - 0.97**time * np.cos(0.15 * time))
    output = output + 1e-4 * rng.normal(size=n_samples)
    return Recording(name, current, output, 5e-3, "step", f"{seed:064x}")


def log(name, n_samples=240):
    """Twenty samples were cut before, 20 and 15 behind, and one was damaged."""
    steps, raw = ("cut", "output_offset"), (n_samples + 40, n_samples + 35)
    cut_input, damaged, cut_output = np.zeros(40), [9.0], np.full(35, 0.01)
    removed = np.concatenate([cut_input, damaged, cut_output])
    return CalibrationLog(
        *(name, steps, 20, n_samples, *raw),
        output_offset=0.01,
        repaired_input=(3,),
        removed=removed,
    )


def crossval(count=15, seed=1):
    who = names(count)
    rng = np.random.default_rng(seed)
    rmsd = 10 ** rng.uniform(-3.4, -0.4, (count, len(NB), len(NK), count))
    own = np.arange(count)
    rmsd[own, :, :, own] = 10 ** rng.uniform(-4, -3, (count, len(NB), len(NK)))
    rmsd[0, 0, 0, 2] = np.nan
    status = np.where(np.isnan(rmsd), "not finite", "ok")
    return CrossValidation(who, NB, NK, "poles", who, rmsd, status, "m", THRESHOLD)


def fits(count=15):
    tensor = crossval(count).rmsd
    return tuple(
        fit((name,), nb, nk, rmsd=float(tensor[n, b, k, n]), seed=n)
        for n, name in enumerate(names(count))
        for b, nb in enumerate(NB)
        for k, nk in enumerate(NK)
    )


def n_tested(count):
    return count // 5


def group_search(count=12, start=4, kept=8, levels=4):
    """Search over some levels in which coverage grows and then stands still."""
    who = names(count)
    rng = np.random.default_rng(3)
    groups, joins, bases = [], [], [(name,) for name in who[:start]]
    tried = [((), name) for name in who[:start]]
    for level in range(1, levels + 1):
        of_level = []
        for base, add_on in tried:
            members = (*base, add_on)
            covered = int(np.clip(3 + 1.5 * level + rng.normal(), 0, 8))
            joins.append(Join(level, "+".join(base), add_on, "+".join(members)))
            of_level.append((members, covered))
        of_level_sorted = sorted(of_level, key=lambda one: -one[1])
        best = {members for members, _ in of_level_sorted[:kept]}
        is_last = level == levels
        for members, covered in of_level:
            groups.append(
                Group(
                    recordings=members,
                    coverage=covered,
                    nb=2,
                    nk=2,
                    rmsd=10 ** rng.uniform(-4, -3),
                    validation_rmsd=0.1,
                    n_models=4,
                    n_self_passed=3,
                    n_cross_passed=2,
                    is_kept=members in best and not is_last,
                )
            )
        bases = [members for members, _ in of_level_sorted[:kept]]
        tried = [(base, one) for base in bases for one in who if one not in base]
    last = max((g for g in groups if g.level == levels), key=lambda g: g.coverage)
    chain = tuple("+".join(last.recordings[: n + 1]) for n in range(levels))
    rmsd = 10 ** rng.uniform(-3.5, -1, (len(groups), len(who)))
    return GroupSearch(
        groups=tuple(groups),
        joins=tuple(joins),
        fits=tuple(
            fit(one.recordings, 2, 2, rmsd=one.rmsd, seed=number)
            for number, one in enumerate(groups)
        ),
        validated_on=who,
        rmsd=rmsd,
        chain=chain,
        reason="the coverage did not grow from level 3 to level 4",
        join="concatenate",
        unit="m",
        threshold=THRESHOLD,
    )


def final_test(count=15, levels=4):
    used = count - n_tested(count)
    search, who = group_search(used, levels=levels), names(count)
    models = tuple(f"{name}/2/2" for name in (*who[:used], *search.chain[1:]))
    chain = (f"{search.chain[0]}/2/2", *models[used:])
    rng = np.random.default_rng(5)
    rmsd = 10 ** rng.uniform(-3.3, -0.6, (len(models), count))
    rmsd[1, 3] = np.nan
    rmsd[:, 2] = 0.05
    is_own = np.array(
        [[name in one.rsplit("/", 2)[0].split("+") for name in who] for one in models]
    )
    rmsd[is_own] = 1e-3
    rmsd[2, 2] = 0.05
    tested = who[used:]
    for level, one in enumerate(chain):
        spread = 0.2 * np.arange(len(tested))
        rmsd[models.index(one), used:] = 10 ** (-1.2 - 0.4 * level + spread)
    covered = (rmsd < THRESHOLD) & ~is_own
    assigned = tuple(models[row] for row in np.nanargmin(rmsd, axis=0))
    smallest = tuple(dict.fromkeys(assigned))[:3]
    rows = [models.index(one) for one in smallest]
    in_set = tuple(smallest[row] for row in np.nanargmin(rmsd[rows], axis=0))
    predictions = tuple(
        Prediction(
            name,
            who[n - 1],
            0.1 * n,
            in_set[n - 1],
            float(rmsd[models.index(in_set[n - 1]), n]),
            in_set[n],
            float(rmsd[models.index(in_set[n]), n]),
            bool(rmsd[models.index(in_set[n - 1]), n] < THRESHOLD),
            bool(rmsd[models.index(in_set[n]), n] < THRESHOLD),
        )
        for n, name in enumerate(who)
    )
    return FinalTest(
        models=models,
        chain=chain,
        recordings=who,
        tested_on=tested,
        rmsd=rmsd,
        is_own=is_own,
        covers=covered.sum(axis=1),
        covered_by=covered.sum(axis=0),
        uncovered=("step_03",),
        hard_to_cover=("step_01", "step_03"),
        assigned=assigned,
        smallest_set=smallest,
        assigned_in_set=in_set,
        predictions=predictions,
        unit="m",
        threshold=THRESHOLD,
    )


DIAGNOSIS = {
    "verdict": "named",
    "complete": True,
    "effects": [
        {
            "id": "coulomb_friction",
            "sentence": "Dry friction holds the drive.",
            "equation": "-Fc sgn v",
            "parameters": {"force_N": {"value": 0.81, "ci95": [0.79, 0.83]}},
        }
    ],
    "ambiguous_with": ["stribeck_friction", ["hysteresis", "cogging"]],
    "gap": {
        "noise_rms": 2.1e-5,
        "before": {"train_rms": 1e-3, "held_out_rms": 2e-3, "ratio_to_noise": 50},
        "after": {"train_rms": 2e-5, "held_out_rms": 2.2e-5, "ratio_to_noise": 1.0},
        "explained_share": 0.99,
    },
    "where": [{"variable": "velocity", "share": 0.5, "sentence": "Near standstill."}],
    "not_observable": ["cogging"],
    "next_experiment": {"input": "a slow ramp", "reason": "it shows the stick"},
}


def stages(*which):
    versions = {"hwid": "0.1.0", "python": "3.12", "numpy": "2.0"}
    return tuple(StageRun(one, 64 * "a", 1.25, versions) for one in which)


def calibrated(who):
    recordings = tuple(recording(name, n) for n, name in enumerate(who))
    return Calibrated(recordings, tuple(log(name) for name in who), "")


def with_results(stored, **changed):
    """Stored results with those of some stages replaced."""
    return replace(stored, results={**stored.results, **changed})


def everything(count=15, levels=4):
    """Results of every stage; a fifth of the recordings only test."""
    who = names(count)
    return StoredResults(
        name="example",
        config=json.dumps({"name": "example"}, indent=2),
        nk_role="poles",
        stages=stages("calibrate", "identify", "crossval", "group", "test"),
        results={
            "calibrate": calibrated(who),
            "identify": fits(count - n_tested(count)),
            "crossval": crossval(count - n_tested(count)),
            "group": group_search(count - n_tested(count), levels=levels),
            "test": final_test(count, levels),
            "diagnose": named(),
        },
        diagnosis=DIAGNOSIS,
    )


def calibrated_only():
    who = names(2)
    return StoredResults(
        name="example",
        config="{}",
        nk_role="poles",
        stages=stages("calibrate"),
        results={"calibrate": calibrated(who)},
    )
