"""Diagnoses as records, made up but of the shape that real ones have."""

from dataclasses import replace

import numpy as np

from hwid_cli.records.candidates import RankedCandidate
from hwid_cli.records.diagnosis import (
    BaseParameter,
    Diagnosis,
    FittedEffect,
    FittedParameter,
    Gap,
    LatentForce,
    NextExperiment,
    NoiseFloor,
    Overlay,
    Place,
    RecordingGap,
)

NAN = float("nan")
NOISE = 2.1e-5
FRICTION = FittedEffect(
    "coulomb_friction",
    "Dry friction of 0.81 N holds the drive and turns with its direction.",
    "-Fc sgn v, sticks while |F| <= Fc",
    (FittedParameter("force_N", 0.8123, 0.7902, 0.8344),),
)
DRAG = FittedEffect(
    "quadratic_drag",
    "A drag grows with the square of the velocity.",
    "-d v|v|",
    (FittedParameter("drag_N_s2_per_m2", 2.5),),
)
# Ids of the ranking with their held-out RMS over the noise and explained share.
RANKING = (
    (("coulomb_friction",), 1.01, 0.998),
    (("stribeck_friction",), 1.012, 0.997),
    (("asymmetric_friction",), 1.013, 0.996),
    (("hysteresis",), 6.1, 0.91),
    (("coulomb_friction", "quadratic_drag"), 8.0, 0.85),
    (("output_backlash",), 14.0, 0.6),
    (("force_constant_saturation", "asymmetric_friction", "second_mode"), 18.0, 0.3),
    (("quadratic_drag",), 20.0, 0.21),
    (("sensor_drift",), 22.2, 0.01),
    ((), 22.4, 0.0),
    (("voltage_limit",), 24.0, -0.4),
)

ROLES = {("coulomb_friction",): "diagnosis", ("stribeck_friction",): "rival"}


def recording_names(count):
    return tuple(f"{('step', 'sine', 'random')[n % 3]}_{n:02d}" for n in range(count))


def candidates():
    fitted = tuple(
        RankedCandidate(
            effects,
            forecast_share=max(0.0, share - 0.05),
            is_fitted=True,
            train_rms=0.99 * ratio * NOISE,
            held_out_rms=ratio * NOISE,
            bic_gain=1e4 * share,
            explained_share=share,
            improved_share=float(share > 0.0),
            whiteness=ratio,
            role=ROLES.get(effects, ""),
        )
        for effects, ratio, share in RANKING
    )
    rest = RankedCandidate(
        ("cogging",), 0.1, False, NAN, NAN, NAN, NAN, NAN, NAN, "not fitted"
    )
    return (*fitted, rest)


def gaps(count, seed=0):
    rng = np.random.default_rng(seed)
    return tuple(
        RecordingGap(
            name,
            name.split("_")[0],
            is_held_out=n % 3 == 0,
            rms_given=NOISE * 30 * (1 + rng.random()),
            rms_before=NOISE * 15 * (1 + rng.random()),
            rms_after=NOISE * (1 + 0.02 * rng.normal()),
        )
        for n, name in enumerate(recording_names(count))
    )


def overlay(name="step_00", n_samples=1500, seed=0):
    """A step that friction stops early, with noise."""
    rng = np.random.default_rng(seed)
    time = 1e-3 * np.arange(n_samples)
    current = np.where(time < 0.2, 0.0, 2.0)
    after_step = np.clip(time - 0.2, 0.0, None)
    swing = np.exp(-12.0 * after_step) * np.cos(60.0 * after_step)
    with_effects = 0.008 * (1.0 - swing)
    before = 0.0084 * (1.0 - np.exp(-9.0 * after_step) * np.cos(59.0 * after_step))
    measured = with_effects + NOISE * rng.normal(size=n_samples)
    return Overlay(name, time, current, measured, before, with_effects, NOISE)


def latent_force(variable="velocity", unit="m/s", n_bins=16, seed=0):
    rng = np.random.default_rng(seed)
    at = np.linspace(-0.6, 0.6, n_bins)
    law = -0.81 * np.tanh(at / 0.05)
    mean = law + 0.05 * rng.normal(size=n_bins)
    return LatentForce(variable, unit, at, mean, np.full(n_bins, 0.12), law)


def places(names):
    about = (
        ("variable", "velocity", 0.55, "The missing force follows the velocity: 55 %."),
        ("segment", "fall", 0.4, "40 % of the error sits in the fall of the steps."),
        ("segment", "hold", 0.3, ""),
        ("segment", "rise", 0.2, ""),
        ("segment", "rest", 0.1, ""),
        (
            "harmonic",
            "fundamental",
            0.7,
            "The error of the sines is at their frequency.",
        ),
        ("harmonic", "odd", 0.25, ""),
        ("variable", "direction", 0.51, "Its sign follows the direction of motion."),
        ("variable", "current", 0.05, "Hardly any of it follows the current."),
        ("amplitude", "sine", NAN, "It grows with amplitude to the power 0.1."),
    )
    found = [
        Place(
            one, variable, share, NAN, sentence or f"{100 * share:.0f} % in {variable}."
        )
        for one, variable, share, sentence in about
    ]
    shares = np.linspace(1.0, 0.1, len(names))
    for name, share in zip(names, shares / shares.sum(), strict=True):
        sentence = f"{100 * share:.0f} % of the excess error is in {name}."
        found.append(Place("recording", name, float(share), 3e-4, sentence))
    return tuple(found)


def named(count=9):
    """Dry friction, found in some recordings."""
    names = recording_names(count)
    ends = ("damping_N_s_per_m", "stiffness_N_per_m", "force_constant_N_per_A")
    values = ((15.0, 17.2, 15.1), (1184.0, 1210.0, 1185.0), (0.0, 0.2, 0.1))
    return Diagnosis(
        verdict="named",
        complete=True,
        summary="The simulation lacks dry friction of 0.81 N; with it, what is left on "
        "held-out recordings is noise.",
        effects=(FRICTION,),
        ambiguous_with=("stribeck_friction", "hysteresis+cogging"),
        noise=NoiseFloor(
            NOISE, "rest", 0.0, False, (1.0,), "Noise of 2.1e-05 m, seen at rest."
        ),
        given=Gap(7.1e-4, 7.4e-4, 35.2),
        before=Gap(4.4e-4, 4.7e-4, 22.4),
        after=Gap(2.09e-5, 2.12e-5, 1.0095),
        explained_share=0.998,
        base=tuple(
            BaseParameter(name, *row) for name, row in zip(ends, values, strict=True)
        ),
        places=places(names),
        not_observable=("supply voltage: the input is the current.", "heating"),
        next_experiment=NextExperiment(
            "a slow triangle of 0.5 A", "it shows sticking."
        ),
        train=tuple(names[n] for n in range(count) if n % 3),
        held_out=names[::3],
        candidates=candidates(),
        gaps=gaps(count),
        overlays=tuple(overlay(name, seed=n) for n, name in enumerate(names[::3][:4])),
        latent_force=(latent_force(), latent_force("direction", "-", 2, 1)),
    )


def unknown(count=9):
    """A gap without a name."""
    found = named(count)
    return replace(
        found,
        verdict="unknown",
        complete=False,
        summary="A gap remains that no known effect explains.",
        effects=(),
        ambiguous_with=(),
        after=found.before,
        explained_share=0.0,
        candidates=tuple(replace(one, role="") for one in found.candidates),
        latent_force=tuple(replace(one, law=np.empty(0)) for one in found.latent_force),
    )


def nothing_missing(verdict="none"):
    """No gap, or one that other parameters close: nothing to draw but the recordings."""
    gap = Gap(2.09e-5, 2.1e-5, 1.0)
    return replace(
        unknown(6),
        verdict=verdict,
        complete=True,
        summary="Nothing is missing.",
        before=unknown().given,
        after=gap,
        places=(),
        candidates=(),
        overlays=(),
        latent_force=(),
        next_experiment=NextExperiment("", ""),
    )
