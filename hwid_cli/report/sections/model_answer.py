"""The answer of an identification: which model to take, and how good it is elsewhere."""

from shlex import quote

import numpy as np

from hwid_cli.records.answer import ModelAnswer
from hwid_cli.records.report import ReportContents, SimulatedRecording
from hwid_cli.report.charts import (
    Chart,
    Curve,
    Panel,
    thinned,
    thinned_note,
    thinned_places,
    thinning,
)
from hwid_cli.report.closing import (
    LINEAR_KEYS,
    NEXT_KEYS,
    UNDECIDED_MAPS,
    linear_is,
    narrow_band_clause,
    spoilt_clause,
    why_other_orders,
)
from hwid_cli.report.dots import Dot, DotGroup, DotRow, Dots
from hwid_cli.report.formats import as_sentence, counted, listed, with_unit
from hwid_cli.report.map_words import fit_keys, map_words
from hwid_cli.report.page import Answer, PageBlock, marked_if_changed
from hwid_cli.report.simulation_note import simulation_note
from hwid_cli.report.terms import NK_WORDS

# Recordings that the answer draws, and points of its curves.
_MOST_ROWS, _MOST_POINTS = 6, 2000
# Height of its charts, [pixels].
_HEIGHT = 170
# Shares of samples beyond what the fit has visited that need no word, [-].
_FEW = 0.005
# Noise below this share of the RMSD needs no word either, [-].
_NO_NOISE = 1e-3
# The model of the recommended orders is worth a look below this share of the RMSD, [-].
_FAR_NEARER = 0.8
# Stages whose results choose the model.
_STAGES = ("identify", "crossval", "group", "test")


def model_answer(contents: ReportContents) -> Answer | None:
    """Name the model to take, with its error on recordings that its fit has not seen."""
    found = contents.answer
    if found is None:
        return None
    blocks = [one for one in (_errors(found), _overlay(contents, found)) if one]
    answer = Answer(
        "Which model describes the drive, and how well where it was not fitted?",
        _verdict(found),
        is_settled=_is_settled(found),
        details=(
            _model(found),
            f"{_orders(found, contents.stored.nk_role)} {_trust(found)}".strip(),
        ),
        blocks=tuple(blocks),
        next_steps=_next(found, contents),
    )
    return marked_if_changed(answer, contents, _STAGES)


def _is_settled(found: ModelAnswer) -> bool:
    """Whether the model stays below the threshold wherever it was validated."""
    if found.is_linear_better or not found.is_usable:
        return False
    if not found.rmsd.size or not np.isfinite(found.rmsd).all():
        return False
    return bool(np.isnan(found.threshold) or (found.rmsd < found.threshold).all())


def _verdict(found: ModelAnswer) -> str:
    if not found.recordings:
        return (
            f"Take {found.name}. All recordings were needed to fit it, so nothing says yet "
            "how good it is elsewhere."
        )
    where = counted(len(found.recordings), "recording")
    unused = "never used" if found.is_unused else "that its fit has not seen"
    if not found.is_usable:
        return _nothing_to_take(found, f"{where} {unused}")
    if found.is_linear_better:
        mean = "mean RMSD" if len(found.recordings) > 1 else "RMSD"
        linear = with_unit(found.linear_mean_rmsd, found.unit)
        own = with_unit(found.mean_rmsd, found.unit)
        how = linear_is(found.linear_mean_rmsd, found.mean_rmsd)
        return (
            f"A linear model is {how}: {mean} {linear}, with the maps of "
            f"the configuration {own}, on {where} {unused}. Those are not worth it here."
        )
    start = f"Take {found.name}"
    if found.is_above_threshold:
        limit = with_unit(found.threshold, found.unit)
        start = f"Not below the threshold of {limit} yet: {found.name}"
    sentence = f"{start}: fit {_median(found.fit_percent)} on {where} {unused}"
    if np.isfinite(found.linear_fit_percent).any():
        sentence += f" (linear: {_median(found.linear_fit_percent)})"
    if found.linear_mean_rmsd < found.mean_rmsd:
        sentence += (
            "; over all recordings but its own it leaves "
            f"{found.linear_ratio:.2g} times as much as the linear model"
        )
    return f"{sentence}."


def _other_maps(found: ModelAnswer) -> str:
    """What to try where a linear model is better than the maps of the configuration."""
    if found.maps is None or not found.maps.has_maps:
        return f"For linear models put {LINEAR_KEYS} into fit, then"
    if found.has_these_maps:
        return f"{UNDECIDED_MAPS}, then"
    return f"To try other maps put {fit_keys(found.maps)} into fit, then"


def _nothing_to_take(found: ModelAnswer, on: str) -> str:
    """Say that the mean of the output would be closer than any model."""
    own, linear = _median(found.fit_percent), found.linear_fit_percent
    also = f" (linear: {_median(linear)})" if np.isfinite(linear).any() else ""
    return (
        f"No model to take: {found.name} has a fit of {own}{also} on {on}; a constant has 0 %. "
        "Are input and output the right columns?"
    )


def _median(values: np.ndarray) -> str:
    """``93.1 %``, over what is finite."""
    known = values[np.isfinite(values)]
    if not known.size:
        return "without a finite output"
    return f"{float(np.median(known)):.1f}\N{NO-BREAK SPACE}%"


def _spread(found: ModelAnswer) -> str:
    """From where to where the fit goes, beside that of the linear model."""
    ranges = []
    for name, values in (
        ("this model", found.fit_percent),
        ("the best linear one", found.linear_fit_percent),
    ):
        known = values[np.isfinite(values)]
        if known.size > 1:
            ranges.append(
                f"{name} {known.min():.1f} to {known.max():.1f}\N{NO-BREAK SPACE}%"
            )
    return f" Fit: {'; '.join(ranges)}." if ranges else ""


def _model(found: ModelAnswer) -> str:
    """What the model is, and how its error stands to the threshold."""
    orders = found.model.orders
    maps = [
        one.kind.replace("_", " ")
        for one in (found.model.input_map, found.model.output_map)
    ]
    text = (
        f"{found.name}: nb = {counted(orders.nb, 'coefficient')} of the numerator, nf = "
        f"{counted(orders.nf, 'pole')}, {counted(orders.nk, 'sample')} of delay; input map {maps[0]}, "
        f"output map {maps[1]}, fitted to {listed(found.own)}."
    )
    if found.rmsd.size and np.isfinite(found.threshold):
        below = int(np.sum(found.rmsd < found.threshold))
        text += (
            f" {below} of {found.rmsd.size} below the threshold of "
            f"{with_unit(found.threshold, found.unit)}."
        )
    if found.spoilt is not None:
        text += f" {as_sentence(spoilt_clause(found.spoilt, found.unit))}"
    return text + _noise(found) + _spread(found)


def _noise(found: ModelAnswer) -> str:
    """How much of the RMSD is noise, where that is worth a word."""
    if not found.noise_rms >= _NO_NOISE * found.mean_rmsd:
        return ""
    size = with_unit(found.noise_rms, found.unit)
    return (
        f" The noise of these recordings is about {size} (sixth differences, as if white): "
        "no model comes below that."
    )


def _orders(found: ModelAnswer, nk_role: str) -> str:
    """Recommended orders and maps."""
    if found.advice is None:
        return ""
    one = found.advice
    text = (
        f"Recommended for new fits: nb = {one.nb}, nk = {one.nk} "
        f"{NK_WORDS.get(nk_role, nk_role)}"
    )
    why = why_other_orders("this model", found.place, (one.nb, one.nk))
    if why and found.is_usable and not found.is_linear_better:
        text += f" ({why})"
    elif (one.best_nb, one.best_nk) != (one.nb, one.nk):
        text += (
            f" (the smallest within {100 * (one.evidence.factor - 1):.2g} % of the best, "
            f"{one.best_nb}/{one.best_nk})"
        )
    return f"{text}.{_at_these(found)}{_recommended_maps(found)}"


def _recommended_maps(found: ModelAnswer) -> str:
    """Recommended maps, and why the model has others where it does."""
    maps = found.maps
    if maps is None or not found.is_usable:
        return ""
    if not maps.has_maps:
        return " Recommended maps: none."
    pair = (
        map_words(maps.input_map, maps.input_units),
        map_words(maps.output_map, maps.output_units),
    )
    text = f" Recommended maps: {pair[0]} and {pair[1]}"
    if found.is_linear_better:
        text += " (chosen on other recordings than those that judge here)"
    elif found.own_maps:
        text += (
            ", for models of one recording; those of this model came closest to recordings "
            "left out of it in turn"
        )
    return f"{text}."


def _at_these(found: ModelAnswer) -> str:
    """How far off the recommended orders are on the recordings that judge the model."""
    if not np.isfinite(found.advised_rmsd):
        return ""
    if found.advised_rmsd == found.mean_rmsd:
        return " Those of this model."
    advised, own = (
        with_unit(one, found.unit) for one in (found.advised_rmsd, found.mean_rmsd)
    )
    mean = "mean RMSD" if len(found.recordings) > 1 else "RMSD"
    return f" At these orders, {found.advised_name}, the {mean} is {advised}, that of this model {own}.{_nearer(found)}"


def _nearer(found: ModelAnswer) -> str:
    """Point to the model of the recommended orders where it is far nearer."""
    if not found.advised_rmsd < _FAR_NEARER * found.mean_rmsd:
        return ""
    return (
        f" Look at {found.advised_name} too: it does not win where models are chosen."
    )


def _trust(found: ModelAnswer) -> str:
    low, high = found.input_range
    unit = found.model.input_unit
    text = f"Its fit has visited inputs from {with_unit(low, unit)} to {with_unit(high, unit)}"
    if found.beyond.size and float(found.beyond.max()) > _FEW:
        worst = int(np.argmax(found.beyond))
        text += (
            f"; {found.recordings[worst]} leaves that range for "
            f"{100 * float(found.beyond[worst]):.0f}\N{NO-BREAK SPACE}% of its samples"
        )
    text += "."
    if narrow := narrow_band_clause(found.held):
        text += f" {as_sentence(narrow)}"
    return text


def _next(found: ModelAnswer, contents: ReportContents) -> tuple[tuple[str, str], ...]:
    steps = []
    if contents.stored.crossval is None:
        steps.append(("Validate all models:", "hwid crossval CONFIG"))
    elif found.maps is None:
        steps.append(("Maps and orders, and why:", "hwid order CONFIG"))
    elif found.is_usable and not found.has_these_maps and not found.is_linear_better:
        steps.append(
            (
                f"For the recommended maps put {fit_keys(found.maps)} into fit, then",
                "hwid run CONFIG",
            )
        )
    if not found.is_usable:
        steps.append(
            ("Look at columns and signs, set recordings.columns:", "hwid check CONFIG")
        )
    elif found.is_linear_better:
        linear = f"hwid export CONFIG --model {quote(found.linear_name)} --format json"
        steps[:0] = [
            ("Take the linear model elsewhere:", linear),
            (_other_maps(found), "hwid run CONFIG"),
        ]
    else:
        steps += _as_it_is(found)
    if contents.stored.diagnosis is None:
        steps.append(
            (
                "Ask what a physics simulation of the drive lacks: add simulation: to the configuration, then",
                "hwid diagnose CONFIG",
            )
        )
    return tuple(steps)


def _as_it_is(found: ModelAnswer) -> list[tuple[str, str]]:
    """Take the model, after what may still bring it below the threshold."""
    export = f"hwid export CONFIG --model {quote(found.name)} --format json"
    if not found.is_above_threshold:
        return [("Take it elsewhere:", export)]
    return [
        (f"Which recordings are missing; needs {NEXT_KEYS}:", "hwid next CONFIG"),
        ("Take it as it is:", export),
    ]


def _errors(found: ModelAnswer) -> Dots | None:
    """RMSD of the model and of the linear one on recordings that they have not seen."""
    if not found.recordings:
        return None
    order = np.argsort(-np.nan_to_num(found.rmsd, nan=np.inf), kind="stable")
    rows = []
    for place in order[:_MOST_ROWS]:
        pairs = ((found.linear_rmsd, "linear"), (found.rmsd, "taken"))
        dots = tuple(
            Dot(float(values[place]), role, with_unit(values[place], found.unit))
            for values, role in pairs
        )
        rows.append(DotRow(found.recordings[place], dots))
    left_out = len(order) - len(rows)
    worst = f"The {_MOST_ROWS} worst; {left_out} more lie below. " if left_out else ""
    legend = [("taken", "this model")]
    if np.isfinite(found.linear_rmsd).any():
        legend.append(("linear", "the best linear model"))
    note = simulation_note(found.model.initial_state, is_validation=True)
    reference, said = None, ""
    if np.isfinite(found.threshold):
        threshold = with_unit(found.threshold, found.unit)
        reference = (found.threshold, f"threshold {threshold}")
        said = f"Dashed: the threshold, {threshold}. "
    return Dots(
        label=f"RMSD [{found.unit}]",
        groups=(DotGroup("", tuple(rows)),),
        sentence=f"{worst}{said}{note}",
        alt="RMSD of the model and of a linear one on recordings that the fit has not seen",
        legend=tuple(legend),
        reference=reference,
        is_log=True,
        is_narrow=True,
    )


def _overlay(contents: ReportContents, found: ModelAnswer) -> PageBlock | None:
    """The recording of median fit, measured and simulated."""
    name = found.recordings[found.median_place] if found.recordings else found.own[0]
    for one in contents.simulated:
        if one.recording.name == name:
            return _overlay_chart(one, found)
    return None


def _overlay_chart(one: SimulatedRecording, found: ModelAnswer) -> Chart | None:
    recording = one.recording
    chosen = thinning(recording.n_samples, _MOST_POINTS, one.detail)
    outputs = {other.model: other.output for other in one.others} | {
        one.model: one.output
    }
    curves = [Curve("measured", thinned(recording.output, chosen), "measured")]
    for model, role, label in (
        (found.linear_name, "linear", "linear"),
        (found.name, "taken", "this model"),
    ):
        if model in outputs and np.isfinite(outputs[model]).all():
            curves.append(Curve(label, thinned(outputs[model], chosen), role))
    what = "of median fit" if len(found.recordings) > 2 else "not seen by the fit"
    if not found.recordings:
        what = "of the fit itself"
    panel = Panel(f"output y [{recording.output_unit}]", tuple(curves), _HEIGHT)
    return Chart(
        name=recording.name,
        at=recording.sample_time_s * thinned_places(chosen),
        label="time t [s]",
        panels=(panel,),
        sentence=f"{recording.name}, {what}: measured and simulated.{thinned_note(chosen)}",
        alt=f"Measured and simulated output of {recording.name} over time",
        detail=(
            recording.sample_time_s * one.detail[0],
            recording.sample_time_s * one.detail[1],
        ),
    )
