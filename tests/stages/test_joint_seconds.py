"""How long a fit of several recordings takes, told from some that are timed."""

import numpy as np
import pytest

from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording
from hwid_cli.stages import fit_seconds


@pytest.mark.parametrize(
    ("lengths", "n_fitted"),
    # Two folds of three kinds of maps; of many recordings six, and parts of long ones.
    [((400, 600), 3), ((400,) * 20, 30), ((40_000, 40_000), 3), ((500,), 3)],
)
def test_some_fits_stand_for_all_recordings(monkeypatch, lengths, n_fitted):
    clock, fitted = [0.0], []

    def fit(recordings, orders, options):
        if options.max_iterations > 1:
            fitted.append([one.n_samples for one in recordings])
        clock[0] += 1e-3 * sum(one.n_samples for one in recordings)

    monkeypatch.setattr(fit_seconds, "fit", fit)
    monkeypatch.setattr(fit_seconds.time, "process_time", lambda: clock[0])
    rng = np.random.default_rng(1)
    recordings = [
        Recording(f"run_{row}", rng.normal(size=n), np.zeros(n), 1e-3)
        for row, n in enumerate(lengths)
    ]
    found = fit_seconds.joint_seconds(recordings, Orders(1, 2, 1), FitOptions())
    # A millisecond for each sample of all of them.
    assert found == pytest.approx(1e-3 * sum(lengths))
    assert len(fitted) == (6 if len(lengths) > 1 else 3)
    assert sum(map(len, fitted)) == n_fitted * (2 if len(lengths) == 2 else 1)
    assert max(map(max, fitted)) <= 10_000
