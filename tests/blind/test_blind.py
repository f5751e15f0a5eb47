"""A short blind test: truths that the program sees as files only."""

import pytest

from tests.blind.cases import make_case
from tests.blind.run_blind import score_of

# Ten recordings at 0.5 % noise hold less than the full plan; the standard errors of
# these parameters stay below 3 % there.
LARGEST_ERROR = 0.10
# The shapes of the last are simulated one after the other in each of its fits.
NAMED = ("coulomb_friction", "cubic_stiffness", "input_dead_zone", "output_backlash")


def short_case(*effects, suite="full", **fields):
    return make_case(suite, effects, 7, plan="short", **fields)


def only_outcome(case, folder, **options):
    (outcome,) = score_of([case], folder, **options)
    assert outcome["failure"] == ""
    return outcome


# The case outside the catalogue has its figures rendered.
@pytest.mark.slow
@pytest.mark.usefixtures("blank_figures")
@pytest.mark.parametrize("effect", NAMED)
def test_a_hidden_effect_is_named_measured_and_removed(effect, tmp_path):
    outcome = only_outcome(short_case(effect), tmp_path)

    assert outcome["verdict"] == "named", outcome
    assert outcome["named"] == [effect]
    assert max(outcome["errors"].values()) < LARGEST_ERROR
    # The held-out gap falls to the noise: 1 + 3 / sqrt(2 n) with n = 4000 samples is
    # 1.03; the parameters add a little.
    assert outcome["before_to_noise"] > 1.5
    assert outcome["after_to_noise"] < 1.06


@pytest.mark.thorough
@pytest.mark.usefixtures("blank_figures")
def test_wrong_parameters_alone_are_no_missing_effect(tmp_path):
    outcome = only_outcome(short_case(suite="clean"), tmp_path)

    assert outcome["verdict"] == "parameters", outcome
    assert outcome["named"] == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "max_effects",
    # The search for sets of effects that explain what none can takes most of a minute.
    [1, 3],
)
def test_what_is_outside_the_catalogue_gets_no_name(max_effects, tmp_path):
    case = short_case("random_force", suite="outside", acceptable=())

    outcome = only_outcome(case, tmp_path, max_effects=max_effects)

    assert outcome["verdict"] in {"unknown", "ambiguous"}, outcome
