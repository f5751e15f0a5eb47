"""Records as tables and figures, for notebooks."""

from collections.abc import Callable, Sequence
from html import escape
from importlib import import_module
from typing import Any

import numpy as np

from hwid_cli.errors import HwidError
from hwid_cli.model.map_curve import map_curve
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.diagnosis import Diagnosis
from hwid_cli.records.fit_grid import FitGrid
from hwid_cli.records.groups import FinalTest, GroupSearch
from hwid_cli.records.model import Fit
from hwid_cli.records.recordings import Recording
from hwid_cli.records.results import CrossValidation
from hwid_cli.records.units import behind
from hwid_cli.stages.order_grid import grid_place

Rows = list[dict[str, Any]]


def as_html(title: str, facts: Sequence[tuple[str, str]]) -> str:
    """Write what a record says of itself as a table.

    Examples
    --------
    >>> as_html("Fit", [("name", "'<r1>'")])[:46]
    '<table><caption>Fit</caption><tr><th>name</th>'
    """
    rows = "".join(
        f"<tr><th>{escape(label)}</th><td>{escape(text)}</td></tr>"
        for label, text in facts
    )
    return f"<table><caption>{escape(title)}</caption>{rows}</table>"


def to_frame(record: Any) -> Any:
    """Give the numbers of a record as a table of pandas."""
    try:
        pandas = import_module("pandas")
    except ImportError as error:
        raise HwidError(
            "to_frame: pandas is not installed; install it ('pip install pandas')"
        ) from error
    return pandas.DataFrame(_of(record, _ROWS, "to_frame")(record))


def plot(record: Any, **options: Any) -> Any:
    """Draw a record; returns the figure."""
    return _of(record, _PLOTS, "plot")(record, **options)


def _of(record: Any, known: dict[type, Callable[..., Any]], what: str) -> Any:
    if type(record) not in known:
        names = ", ".join(one.__name__ for one in known)
        raise HwidError(f"{what}: not for a {type(record).__name__}; only for {names}")
    return known[type(record)]


def _recording_rows(one: Recording) -> dict[str, np.ndarray]:
    time = one.sample_time_s * np.arange(one.n_samples)
    return {"time_s": time, "input": one.input, "output": one.output}


def _fit_rows(fits: Sequence[Fit]) -> Rows:
    return [
        {
            "name": one.name,
            "nb": one.orders.nb,
            "nf": one.orders.nf,
            "nk": one.orders.nk,
            "status": one.status,
            "rmsd": one.rmsd,
            "fit_percent": one.fit_percent,
            "linear_rmsd": one.linear_rmsd,
            "aic": one.information.aic,
            "bic": one.information.bic,
        }
        for one in fits
    ]


def _crossval_rows(one: CrossValidation) -> Rows:
    return [
        {
            "identified_on": one.identified_on[n],
            "nb": one.nb[b],
            "nk": one.nk[k],
            "validated_on": one.validated_on[m],
            "rmsd": one.rmsd[n, b, k, m],
            "status": one.status[n, b, k, m],
        }
        for n, b, k, m in np.ndindex(one.rmsd.shape)
    ]


def _group_rows(one: GroupSearch) -> Rows:
    return [
        {
            "group": group.name,
            "level": group.level,
            "coverage": group.coverage,
            "model": group.model_name,
            "rmsd": group.rmsd,
            "validation_rmsd": group.validation_rmsd,
            "in_chain": group.name in one.chain,
        }
        for group in one.groups
    ]


def _test_rows(one: FinalTest) -> Rows:
    return [
        {
            "model": one.models[n],
            "recording": one.recordings[m],
            "rmsd": one.rmsd[n, m],
            "is_own": one.is_own[n, m],
            "is_test": one.recordings[m] in one.tested_on,
        }
        for n, m in np.ndindex(one.rmsd.shape)
    ]


def _diagnosis_rows(one: Diagnosis) -> Rows:
    return [
        {
            "effect": effect.id,
            "parameter": parameter.name,
            "value": parameter.text or parameter.value,
            "low": parameter.low,
            "high": parameter.high,
        }
        for effect in one.effects
        for parameter in effect.parameters
    ]


def _axes(count: int, *, shares_x: bool = False) -> tuple[Any, Any]:
    """A figure with plots one above the other, without a window of its own."""
    figure = import_module("matplotlib.figure").Figure(
        figsize=(7.0, 2.2 * count + 0.6), layout="constrained"
    )
    return figure, figure.subplots(count, 1, sharex=shares_x, squeeze=False)[:, 0]


def _plot_recording(one: Recording) -> Any:
    figure, (above, below) = _axes(2, shares_x=True)
    time = one.sample_time_s * np.arange(one.n_samples)
    above.plot(time, one.input)
    above.set(ylabel=f"input{behind(one.input_unit)}", title=one.name)
    below.plot(time, one.output)
    below.set(ylabel=f"output{behind(one.output_unit)}", xlabel="time s")
    return figure


def _plot_fit(one: Fit, recording: Recording | None = None) -> Any:
    """Both static maps, or measured against simulated output of a recording."""
    if one.model is None:
        raise HwidError(f"plot: {one.name} has no model: {one.message}")
    if recording is None:
        figure, axes = _axes(2)
        sides = (("input", one.model.input_map), ("output", one.model.output_map))
        for axis, (side, static_map) in zip(axes, sides, strict=True):
            curve = map_curve(static_map)
            axis.plot(curve.argument, curve.value)
            axis.set(ylabel=f"{side} map", title=one.name if side == "input" else "")
        return figure
    figure, (axis,) = _axes(1)
    time = recording.sample_time_s * np.arange(recording.n_samples)
    simulated = validation_output(one.model, recording)
    axis.plot(time, recording.output, label="measured")
    axis.plot(time, simulated, "--", label="simulated")
    axis.set(xlabel="time s", ylabel=f"output{behind(recording.output_unit)}")
    axis.set_title(f"{one.name} on {recording.name}")
    axis.legend()
    return figure


def _plot_grid(one: FitGrid) -> Any:
    """RMSD over the grid, a plot for each recording."""
    orders = one.orders
    figure, axes = _axes(len(one.names))
    for axis, name in zip(axes, one.names, strict=True):
        values = np.full((len(orders.nb), len(orders.nk)), np.nan)
        for fit in one.fits:
            if fit.name == name:
                nb, nk = grid_place(fit, orders.nk_role)
                values[orders.nb.index(nb), orders.nk.index(nk)] = fit.rmsd
        _heat(axis, values, (orders.nk, orders.nb), f"RMSD of {name}")
    return figure


def _plot_crossval(one: CrossValidation) -> Any:
    """The best RMSD of each recording's models on every recording."""
    figure, (axis,) = _axes(1)
    with np.errstate(invalid="ignore"):
        best = np.min(np.where(np.isnan(one.rmsd), np.inf, one.rmsd), axis=(1, 2))
    _heat(axis, best, (one.validated_on, one.identified_on), f"RMSD {one.unit}")
    axis.set(xlabel="validated on", ylabel="identified on")
    return figure


def _heat(axis: Any, values: np.ndarray, names: tuple[Any, Any], title: str) -> None:
    image = axis.imshow(values, aspect="auto", origin="lower")
    axis.set_xticks(range(len(names[0])), [str(one) for one in names[0]])
    axis.set_yticks(range(len(names[1])), [str(one) for one in names[1]])
    axis.set(xlabel="nk", ylabel="nb", title=title)
    axis.figure.colorbar(image, ax=axis)


def _plot_diagnosis(one: Diagnosis) -> Any:
    """The held-out recording that the simulation missed most, before and after."""
    overlay = one.overlays[0]
    figure, (above, below) = _axes(2, shares_x=True)
    above.plot(overlay.time_s, overlay.measured, label="measured")
    above.plot(overlay.time_s, overlay.before, "--", label="simulated before")
    above.plot(overlay.time_s, overlay.after, ":", label="simulated after")
    above.set(title=f"{overlay.name}: {one.verdict}", ylabel=one.output_unit)
    above.legend()
    below.plot(overlay.time_s, overlay.measured - overlay.before, "--", label="before")
    below.plot(overlay.time_s, overlay.measured - overlay.after, ":", label="after")
    below.set(xlabel="time s", ylabel=f"gap {one.output_unit}")
    below.legend()
    return figure


_ROWS: dict[type, Callable[..., Any]] = {
    Recording: _recording_rows,
    Fit: lambda one: _fit_rows([one]),
    FitGrid: lambda one: _fit_rows(one.fits),
    CrossValidation: _crossval_rows,
    GroupSearch: _group_rows,
    FinalTest: _test_rows,
    Diagnosis: _diagnosis_rows,
}
_PLOTS: dict[type, Callable[..., Any]] = {
    Recording: _plot_recording,
    Fit: _plot_fit,
    FitGrid: _plot_grid,
    CrossValidation: _plot_crossval,
    Diagnosis: _plot_diagnosis,
}
