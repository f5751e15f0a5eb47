import numpy as np
import pytest
from scipy.signal import lfilter

from hwid_cli.model.extrapolation import for_search, outlined_model
from hwid_cli.model.fit import fit
from hwid_cli.model.simulate import simulate, validation_output
from hwid_cli.model.uncertainty import with_standard_errors
from hwid_cli.records.model import FitOptions, Orders
from hwid_cli.records.recordings import Recording


def recording(u, *, noise=0.0, seed=0):
    y = lfilter([0.0, 0.5], [1.0, -0.5], u)
    rng = np.random.default_rng(seed)
    return Recording("a", u, y + noise * rng.standard_normal(u.size), 1e-3)


@pytest.fixture(scope="module")
def noisy_line():
    u = np.random.default_rng(5).uniform(-1.0, 1.0, 600)
    return recording(u, noise=0.02)


@pytest.fixture(scope="module")
def fitted(noisy_line):
    return fit([noisy_line], Orders(1, 1, 1))


def test_fits_of_noisy_lines_go_on_as_lines():
    near = np.random.default_rng(5).uniform(-1.0, 1.0, 600)
    u = np.random.default_rng(6).uniform(-3.0, 3.0, 1000)
    true = recording(u).output

    def error(model):
        return np.std(simulate(model, u, initial_state=np.zeros(1)) - true)

    noisy = [recording(near, noise=0.02, seed=seed) for seed in range(6)]
    models = [fit([one], Orders(1, 1, 1)).model for one in noisy]
    errors = [error(one) for one in models]
    last_segments = [error(for_search(one)) for one in models]

    assert max(errors) < 0.1 * np.std(true)
    # Single ones are luck: over twelve seeds the sums come to 0.59.
    assert sum(errors) < 0.7 * sum(last_segments)


def test_a_fit_says_what_its_model_gives(fitted, noisy_line):
    error = validation_output(fitted.model, noisy_line) - noisy_line.output

    assert fitted.rmsd == pytest.approx(np.sqrt(np.mean(error**2)), rel=1e-9)


@pytest.mark.parametrize("role", ["starts", "contained"])
def test_a_search_goes_on_from_what_the_parameters_say(role, fitted, noisy_line):
    orders = Orders(1, 1, 1) if role == "starts" else Orders(1, 2, 1)
    short = FitOptions(max_iterations=3)

    one, other = (
        fit([noisy_line], orders, short, **{role: [model]})
        for model in (fitted.model, for_search(fitted.model))
    )

    assert one.rmsd <= fitted.rmsd * (1.0 + 1e-9)
    assert one.rmsd == other.rmsd
    np.testing.assert_array_equal(
        one.model.input_map.parameters, other.model.input_map.parameters
    )


def test_standard_errors_are_those_of_the_parameters(fitted, noisy_line):
    again = with_standard_errors(fitted, [noisy_line])

    assert again.uncertainty.names == fitted.uncertainty.names
    np.testing.assert_allclose(
        again.uncertainty.standard_errors,
        fitted.uncertainty.standard_errors,
        rtol=1e-6,
    )


def test_break_points_and_values_alone_give_the_same_to_the_last_bit(fitted):
    u = np.linspace(-4.0, 4.0, 200)
    plain = outlined_model(fitted.model)

    assert plain.input_map.extrapolation is None
    assert simulate(plain, u).tolist() == simulate(fitted.model, u).tolist()
