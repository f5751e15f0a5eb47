"""A slow probe in a heater's simulation, beside a plain least-squares fit of all of it."""

import numpy as np
import pytest
import scipy

from hwid_cli import Recording
from hwid_cli.diagnosis.foreign import diagnose_foreign
from hwid_cli.diagnosis.simulator import Simulator
from hwid_cli.records.experiment import DiagnoseOptions
from hwid_cli.records.programs import Capabilities, FreeParameter, SimulatorRun
from tests.diagnosis.test_foreign import Count

STEP_S, N = 4.0, 400
TRUE = {
    "block": 63.0, "plate": 141.0, "conduction": 1.25, "loss": 1.4, "radiation": 1.2e-9,
}  # fmt: skip
# All 10 to 50 % off: the turns do not begin near their end.
GIVEN = {
    "block": 78.0, "plate": 195.0, "conduction": 1.56, "loss": 1.95, "radiation": 1.3e-9,
}  # fmt: skip
RESISTANCE = 10.0
PROBE_S = 25.0
NOISE = 0.2


def plate(values, voltages):
    """Rise of a plate behind a heated block; the voltage is held between samples."""
    block, rise, found = 0.0, 0.0, [0.0]
    for power in voltages[:-1] ** 2 / RESISTANCE:
        for _ in range(2):
            flow = values["conduction"] * (block - rise)
            hot = (rise + 295) ** 4 - 295**4
            lost = values["loss"] * rise + values["radiation"] * hot
            block += STEP_S / 2 * (power - flow) / values["block"]
            rise += STEP_S / 2 * (flow - lost) / values["plate"]
        found.append(rise)
    return np.array(found)


def behind_a_probe(rise, time_constant):
    """A first-order lag of straight lines between the samples, exactly."""
    a = np.exp(-STEP_S / time_constant)
    late = 1 - time_constant / STEP_S * (1 - a)
    return scipy.signal.lfilter([late, 1 - a - late], [1, -a], rise)


def voltages():
    rng = np.random.default_rng(5)
    on = np.arange(N) >= 10
    for size in (20.0, 32.0, 40.0):
        yield size * (on & (np.arange(N) < 250))
    for _ in range(3):
        yield np.repeat(rng.uniform(8.0, 40.0, N // 25), 25) * on


def recordings():
    rng = np.random.default_rng(2)
    return [
        Recording(
            f"run_{row}", voltage,
            behind_a_probe(plate(TRUE, voltage), PROBE_S) + NOISE * rng.standard_normal(N),
            STEP_S, kind="step" if row < 3 else "other", input_unit="V", output_unit="K",
        )
        for row, voltage in enumerate(voltages())
    ]  # fmt: skip


def by_least_squares(train):
    """All parameters at once: the probe's time constant, its deviation, and the RMS."""

    def errors(shares):
        values = dict(zip(GIVEN, shares[:-1] * list(GIVEN.values()), strict=True))
        return np.concatenate(
            [
                behind_a_probe(plate(values, one.input), 20.0 * shares[-1]) - one.output
                for one in train
            ]
        )

    found = scipy.optimize.least_squares(errors, np.ones(len(GIVEN) + 1))
    variance = np.mean(found.fun**2)
    covariance = np.linalg.inv(found.jac.T @ found.jac) * variance
    deviation = np.sqrt(covariance[-1, -1])
    return 20.0 * found.x[-1], 20.0 * deviation, np.sqrt(variance)


@pytest.mark.thorough
def test_a_slow_probe_is_named_and_is_as_uncertain_as_all_parameters_leave_it():
    free = {one: FreeParameter(GIVEN[one], (0.2 * GIVEN[one], 5 * GIVEN[one]))
            for one in GIVEN}  # fmt: skip
    simulator = Simulator(
        Capabilities(run=True, parameters=True),
        lambda request: SimulatorRun(
            plate(request.parameters, request.input), np.zeros(0)
        ),
        {}, free, GIVEN,
    )  # fmt: skip
    given = recordings()
    options = DiagnoseOptions(
        effects=("sensor_lag", "actuator_lag", "input_delay"), hold_out=("run_1",)
    )
    found = diagnose_foreign(given, simulator, options, Count(), lambda what, n: None)
    assert (found.verdict, found.complete) == ("named", True)
    (effect,) = found.effects
    assert effect.id == "sensor_lag"
    (lag,) = effect.parameters
    train = [one for one in given if one.name != "run_1"]
    value, deviation, rms = by_least_squares(train)
    # The same squares, so the same place; turns of stand-in and simulation end before.
    assert lag.value == pytest.approx(value, abs=0.5 * deviation)
    # What its last run leaves beyond that fit, in squares of the noise.
    more = len(train) * N * (found.after.train_rms**2 - rms**2) / NOISE**2
    assert -1.0 < more < 5.0
    low, high = lag.low, lag.high
    assert high - low == pytest.approx(2 * 1.96 * deviation, rel=0.2)
    # Without the simulation's parameters it would be several times narrower.
    assert deviation > 0.02 * PROBE_S
