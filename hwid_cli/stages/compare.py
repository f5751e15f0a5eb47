"""``compare``: several models, wherever they come from, on the same recordings."""

from collections.abc import Sequence

import numpy as np

from hwid_cli.errors import ConfigError
from hwid_cli.model.scores import fit_percent, rmsd
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.comparison import Comparison, NamedModel, ShownRecording
from hwid_cli.records.recordings import Recording
from hwid_cli.tasks.task import one_thread

# Sample times that differ by less are the same clock, [-].
_SAME_CLOCK = 1e-6


def compare_models(
    models: Sequence[NamedModel], recordings: Sequence[Recording]
) -> Comparison:
    """Simulate every model on every recording, by the model's own rule for the start.

    Parameters
    ----------
    models : sequence of NamedModel
        At least one.
    recordings : sequence of Recording
        At least one.

    Raises
    ------
    ConfigError
        If a model has another sample time or other units than the recordings.
    """
    for one in models:
        _check_fits_in(one, recordings[0])
    shape = (len(models), len(recordings))
    deviation, percent = np.full(shape, np.nan), np.full(shape, np.nan)
    with one_thread():
        for m, recording in enumerate(recordings):
            outputs = _outputs(models, recording)
            for n, simulated in enumerate(outputs):
                deviation[n, m] = rmsd(recording.output, simulated)
                percent[n, m] = fit_percent(recording.output, simulated)
        widest = recordings[_most_different(deviation)]
        shown = ShownRecording(
            name=widest.name,
            time_s=widest.sample_time_s * np.arange(widest.n_samples),
            input=widest.input,
            measured=widest.output,
            simulated=np.array(_outputs(models, widest)),
        )
    return Comparison(
        models=tuple(models),
        recordings=tuple(one.name for one in recordings),
        is_own=np.array(
            [[one.name in of.identified_on for one in recordings] for of in models]
        ),
        rmsd=deviation,
        fit_percent=percent,
        input_unit=recordings[0].input_unit,
        output_unit=recordings[0].output_unit,
        shown=shown,
    )


def _outputs(models: Sequence[NamedModel], recording: Recording) -> list[np.ndarray]:
    return [validation_output(one.model, recording) for one in models]


def _most_different(deviation: np.ndarray) -> int:
    """Recording on which the worst model is the most times worse than the best."""
    least = np.min(deviation, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = np.max(deviation, axis=0) / least
    return int(np.argmax(np.where(np.isfinite(spread), spread, 0.0)))


def _check_fits_in(one: NamedModel, recording: Recording) -> None:
    model = one.model
    step, own = recording.sample_time_s, model.sample_time_s
    if abs(own - step) > _SAME_CLOCK * step:
        raise ConfigError(
            f"{one.name}: has a sample time of {own:g} s; expected {step:g} s as in the "
            "recordings, because models are discrete; compare on recordings of its own "
            "sample time"
        )
    for side in ("input", "output"):
        found, expected = (getattr(of, f"{side}_unit") for of in (model, recording))
        if found != expected:
            raise ConfigError(
                f"{one.name}: its {side} is in {found}; expected {expected} as in the "
                f"recordings; set recordings.{side}_scale and {side}_unit alike"
            )
