"""Models that the report looks at: their names, which ones, and how they look."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from hwid_cli.model.frequency_response import (
    frequency_response,
    response_frequencies,
    step_response,
    zeros,
)
from hwid_cli.model.linear_block import poles
from hwid_cli.model.map_curve import map_curve
from hwid_cli.model.pole_bound import is_within
from hwid_cli.records.model import Fit
from hwid_cli.records.recordings import Recording
from hwid_cli.records.report import ModelView, StoredResults
from hwid_cli.records.results import ModelScore
from hwid_cli.stages.order_grid import grid_place

# Models shown from all sides where there is no chain of groups.
_WIDEST = 3
# Length taken where no recording says another, [samples].
_USUAL_SAMPLES = 1000


@dataclass(frozen=True)
class _Shown:
    """A model that the report looks at, and what it covers."""

    name: str
    fit: Fit
    coverage: int
    of: int


def named_fits(stored: StoredResults) -> dict[str, Fit]:
    """Give all fits by the names of their models, those of groups too."""
    named = {}
    for fit in stored.fits:
        nb, nk = grid_place(fit, stored.nk_role)
        named[f"{fit.name}/{nb}/{nk}"] = fit
    if stored.search is not None:
        for group, found in zip(stored.search.groups, stored.search.fits, strict=True):
            # Groups of one recording are fits that are there already.
            if found is not None:
                named.setdefault(group.model_name, found)
    return named


def model_views(
    stored: StoredResults, scores: Sequence[ModelScore]
) -> tuple[ModelView, ...]:
    """Look at the chain of groups, or else at the widest models, from all sides.

    Parameters
    ----------
    scores : sequence of ModelScore
        The widest model of each recording.
    """
    shown = _shown(stored, scores, named_fits(stored))
    return tuple(_view(one, stored.recordings) for one in shown)


def _shown(
    stored: StoredResults, scores: Sequence[ModelScore], named: Mapping[str, Fit]
) -> list[_Shown]:
    """Choose the chain of groups, or else the widest models."""
    if stored.search is not None:
        of = len(stored.search.validated_on)
        return [
            _Shown(group.model_name, named[group.model_name], group.coverage, of)
            for group in stored.search.chain_groups
            if group.model_name in named
        ]
    of = len(stored.crossval.validated_on) if stored.crossval else 0
    widest = sorted(scores, key=lambda score: -score.coverage)[:_WIDEST]
    names = [f"{score.identified_on}/{score.nb}/{score.nk}" for score in widest]
    return [
        _Shown(name, named[name], score.coverage, of)
        for name, score in zip(names, widest, strict=True)
        if name in named and named[name].model is not None
    ]


def _view(shown: _Shown, recordings: Sequence[Recording]) -> ModelView:
    model = shown.fit.model
    if model is None:
        raise ValueError(f"{shown.name}: a fit without a model cannot be shown")
    longest = max((one.n_samples for one in recordings), default=_USUAL_SAMPLES)
    frequencies = response_frequencies(model, 1.0 / (longest * model.sample_time_s))
    return ModelView(
        model=shown.name,
        input_curve=map_curve(model.input_map),
        output_curve=map_curve(model.output_map),
        response=frequency_response(model, frequencies),
        poles=poles(model.denominator),
        zeros=zeros(model.numerator),
        delay=model.delay,
        is_stable=is_within(model.denominator, 1.0),
        rmsd=shown.fit.rmsd,
        coverage=shown.coverage,
        covers_of=shown.of,
        input_unit=model.input_unit,
        output_unit=model.output_unit,
        information=shown.fit.information,
        step=step_response(model),
        input_range=model.input_map.domain,
        block_range=model.output_map.domain,
    )
