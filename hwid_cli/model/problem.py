"""Recordings as the experiments of one fit, centred and divided by their size.

References
----------
docs/method.md, section "The search".
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from hwid_cli.model import sensitivities
from hwid_cli.model.candidates import FitData
from hwid_cli.model.levenberg_marquardt import Search
from hwid_cli.model.normalise import displaced, rescaled
from hwid_cli.model.robust import plain, with_loss
from hwid_cli.model.static_map import RULES
from hwid_cli.records.model import FitOptions, HammersteinWiener
from hwid_cli.records.recordings import Recording

# Distance of a signal's middle from zero, as a multiple of half its range, from which on
# its mean is subtracted: nearer to zero no digits are lost.
_FAR = 4.0


@dataclass(frozen=True, eq=False)
class FitProblem:
    """Scaled experiments and what they were divided by.

    Parameters
    ----------
    experiments : tuple of FitData
        Of size about one.
    input_scale : float, [input unit]
    output_scale : float, [output unit]
    input_offset, output_offset : float
        What was subtracted first, in the units of the recordings.
    """

    experiments: tuple[FitData, ...]
    input_scale: float
    output_scale: float
    input_offset: float = 0.0
    output_offset: float = 0.0

    @property
    def is_centred(self) -> bool:
        """Whether an offset was subtracted."""
        return self.input_offset != 0.0 or self.output_offset != 0.0

    def of_data(self, model: HammersteinWiener) -> HammersteinWiener | None:
        """Model of the experiments for the recordings as they are.

        Returns
        -------
        HammersteinWiener or None
            None where no model of its kinds of maps has their offsets.
        """
        in_units = rescaled(model, self.input_scale, self.output_scale)
        return displaced(in_units, self.input_offset, self.output_offset)

    def of_experiments(self, model: HammersteinWiener) -> HammersteinWiener | None:
        """Model of the recordings for the experiments; the other way round.

        Returns
        -------
        HammersteinWiener or None
        """
        centred = displaced(model, -self.input_offset, -self.output_offset)
        if centred is None:
            return None
        return rescaled(centred, 1.0 / self.input_scale, 1.0 / self.output_scale)


def joined(recordings: Sequence[Recording], options: FitOptions) -> tuple[FitData, ...]:
    """Recordings joined as the options say.

    Returns
    -------
    tuple of FitData
        In the units of the recordings.
    """
    if options.join == "experiments":
        return tuple(FitData(one.input, one.output) for one in recordings)
    return (
        FitData(
            np.concatenate([one.input for one in recordings]),
            np.concatenate([one.output for one in recordings]),
        ),
    )


def scaled(
    recordings: Sequence[Recording], options: FitOptions, *, centred: bool = True
) -> FitProblem:
    """Experiments divided by their size, so that one damping suits all.

    Parameters
    ----------
    centred : bool
        Whether offsets far beyond the movement are subtracted first, where the maps can
        take them up again.
    """
    experiments = joined(recordings, options)
    inputs = np.concatenate([one.input for one in experiments])
    outputs = np.concatenate([one.output for one in experiments])
    input_offset = output_offset = 0.0
    if centred:
        takes_input, takes_output = _takes_offsets(options)
        input_offset = _offset(inputs) if takes_input else 0.0
        output_offset = _offset(outputs) if takes_output else 0.0
    input_scale = float(np.max(np.abs(inputs - input_offset)))
    output_scale = float(np.std(outputs - output_offset))
    divided = [
        FitData(
            (one.input - input_offset) / input_scale,
            (one.output - output_offset) / output_scale,
        )
        for one in experiments
    ]
    return FitProblem(
        with_loss(divided, options),
        input_scale,
        output_scale,
        input_offset,
        output_offset,
    )


def offset_left(recordings: Sequence[Recording], options: FitOptions) -> str:
    """Say that a signal has an offset that models of these maps do not take up.

    Returns
    -------
    str
        Empty where they do, or where there is none.
    """
    experiments = joined(recordings, options)
    for side, takes in zip(("input", "output"), _takes_offsets(options), strict=True):
        offset = _offset(np.concatenate([getattr(one, side) for one in experiments]))
        if offset != 0.0 and not takes:
            return (
                f"the {side} stays near {offset:.4g}, far from zero, and these maps have no "
                "constant for it: subtract it, or choose maps with a free shape"
            )
    return ""


def _offset(signal: np.ndarray) -> float:
    """Mean of a signal that stays far from zero; else zero."""
    low, high = float(signal.min()), float(signal.max())
    if abs(low + high) < _FAR * (high - low):
        return 0.0
    return low + float(np.mean(signal - low))


def _takes_offsets(options: FitOptions) -> tuple[bool, bool]:
    """Whether models of these options can take up offsets of input and output."""
    before, after = RULES[options.input_map], RULES[options.output_map]
    rests = options.initial_state != "zero"
    # A block that starts empty answers another constant with a transient.
    takes_input = before.displaced is not None
    if before.passes_constants:
        takes_input = rests and after.displaced is not None and after.raised is not None
    takes_output = after.raised is not None
    if after.passes_constants:
        takes_output = rests and before.raised is not None
    return takes_input, takes_output


def rmsd(search: Search, problem: FitProblem) -> float:
    """RMSD of a search's model, whatever loss it was found with.

    Returns
    -------
    float, [output unit]
    """
    samples = sum(one.output.size for one in problem.experiments)
    cost = search.cost
    if problem.experiments[0].threshold < np.inf:
        cost = sensitivities.cost(search.candidate, plain(problem.experiments))
    return float(np.sqrt(cost / samples)) * problem.output_scale
