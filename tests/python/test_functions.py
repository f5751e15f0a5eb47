"""Functions on records give what the commands store."""

import numpy as np
import pytest

from hwid_cli import (
    DiagnoseOptions,
    FitOptions,
    GroupOptions,
    HwidError,
    OrdersOptions,
    Recording,
    crossval,
    diagnose,
    fit,
    fit_grid,
    group,
    identify,
)
from hwid_cli.errors import ConfigError
from hwid_cli.model.simulate import validation_output
from hwid_cli.records.model import Orders
from tests.diagnosis.small_drive import recordings as drive_recordings
from tests.diagnosis.small_drive import simulation

ORDERS = OrdersOptions(nb=(1, 2), nk=(1, 2))
OPTIONS = FitOptions(units=3, starts=1, max_iterations=6)


def made(name, seed):
    """A saturated first-order plant, in its own loop."""
    rng = np.random.default_rng(seed)
    u = np.repeat(rng.uniform(-1, 1, 20), 15)
    y = np.zeros(300)
    for k in range(1, 300):
        y[k] = 0.8 * y[k - 1] + 0.2 * np.tanh(2 * u[k - 1])
    return Recording(name, u, y + 1e-4 * rng.standard_normal(300), 1e-3)


RECORDINGS = [made("a", 1), made("b", 2), made("c", 3)]


@pytest.fixture(scope="module")
def grid():
    return fit_grid(RECORDINGS[:2], ORDERS, OPTIONS)


def test_a_grid_holds_every_pair_of_every_recording(grid):
    found = [(one.name, one.orders.nb, one.orders.nf) for one in grid]

    assert found == [(name, nb, nf) for name in "ab" for nb in (1, 2) for nf in (1, 2)]
    assert (len(grid), grid[0].name, grid.names) == (8, "a", ("a", "b"))
    # The first fit of a grid begins with nothing, as a fit alone.
    alone = fit([RECORDINGS[0]], Orders(1, 1, 1), OPTIONS)
    assert grid[0].rmsd == alone.rmsd


@pytest.mark.thorough
def test_identify_is_the_same_and_tells_of_its_progress(grid, capsys):
    told = []
    again = identify(
        RECORDINGS[:2], ORDERS, OPTIONS, progress=lambda *said: told.append(said)
    )

    assert [one.rmsd for one in again] == [one.rmsd for one in grid]
    assert told == [("fits", n, 8) for n in range(1, 9)]
    assert capsys.readouterr() == ("", "")


def test_progress_is_shown_on_stderr(grid, capsys):
    crossval(grid, RECORDINGS, progress=True)
    said = capsys.readouterr()

    assert said.out == ""
    assert said.err.endswith("6 of 6 pairs".ljust(60) + "\n")


def test_a_cross_validation_is_a_simulation_of_every_model(grid):
    found = crossval(grid, RECORDINGS, threshold=0.02)

    assert found.rmsd.shape == (2, 2, 2, 3)
    assert found.threshold == 0.02
    left = RECORDINGS[2].output - validation_output(grid[5].model, RECORDINGS[2])
    assert found.rmsd[1, 0, 1, 2] == pytest.approx(np.sqrt(np.mean(left**2)))


@pytest.mark.thorough
def test_groups_are_searched_over_the_recordings_asked_for(grid):
    options = GroupOptions(candidates=("a", "b"), max_level=2, keep={"best": True})
    told = []
    found = group(
        grid, RECORDINGS, options,
        threshold=0.01, progress=lambda *said: told.append(said),
    )  # fmt: skip

    assert {one.name for one in found.groups} >= {"a", "b"}
    assert found.validated_on == ("a", "b", "c")
    assert "fits of level 1" in {what for what, _, _ in told}
    with pytest.raises(ConfigError, match="candidates: no recording 'z'"):
        group(grid, RECORDINGS, GroupOptions(candidates=("z",)))


def test_a_diagnosis_tells_what_it_does():
    told = []
    found = diagnose(
        drive_recordings(),
        simulation(stiffness_N_per_m=1000.0),
        DiagnoseOptions(effects=("coulomb_friction",), max_effects=1),
        progress=lambda what, done, total: told.append(what),
    )

    assert found.verdict == "parameters"
    assert told[0] == "base"
    assert "verdict parameters" in repr(found)
    assert len(repr(found)) < 200


@pytest.mark.parametrize(
    ("given", "error", "words"),
    [
        (RECORDINGS[0], TypeError, r"give \[recording\] for one"),
        ([1.0], TypeError, "sequence of Recording"),
        ([RECORDINGS[0], RECORDINGS[0]], ValueError, "two recordings are named 'a'"),
        ([], ValueError, "at least one"),
    ],
)
def test_what_is_no_recording_is_refused(given, error, words):
    with pytest.raises(error, match=words):
        fit_grid(given, ORDERS)


def test_every_record_says_what_it_is_in_a_line(grid):
    shown = [
        *(RECORDINGS[0], grid, grid[0], grid[0].model),
        crossval(grid, RECORDINGS),
    ]
    for one in shown:
        assert len(repr(one)) < 200, repr(one)
        assert repr(one).startswith(f"<{type(one).__name__} ")
        assert "<table>" in one._repr_html_()
    assert "samples 300 every 0.001 s" in repr(RECORDINGS[0])
    odd = Recording("<script>", np.arange(3.0), np.arange(3.0), 1.0)
    assert "<script>" not in odd._repr_html_()


def test_numbers_become_a_frame(grid):
    frame = RECORDINGS[0].to_frame()
    assert list(frame.columns) == ["time_s", "input", "output"]
    assert frame["time_s"].iloc[-1] == pytest.approx(0.299)
    assert list(grid.to_frame()["rmsd"]) == [one.rmsd for one in grid]
    table = crossval(grid, RECORDINGS).to_frame()
    assert len(table) == 24
    with pytest.raises(HwidError, match="to_frame: not for a HammersteinWiener"):
        grid[0].model.to_frame()


def test_records_are_drawn(grid):
    titles = [axis.get_title() for axis in grid.plot().axes]
    assert titles[:2] == ["RMSD of a", "RMSD of b"]
    (line,) = RECORDINGS[0].plot().axes[1].lines
    np.testing.assert_array_equal(line.get_ydata(), RECORDINGS[0].output)
    measured, simulated = grid[0].plot(recording=RECORDINGS[1]).axes[0].lines
    np.testing.assert_array_equal(measured.get_ydata(), RECORDINGS[1].output)
    assert not np.array_equal(simulated.get_ydata(), RECORDINGS[1].output)
    assert len(grid[0].plot().axes) == 2
    assert crossval(grid, RECORDINGS).plot().axes
