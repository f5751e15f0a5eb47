"""How long a choice of further recordings will take, for each of its goals."""

import time
from collections.abc import Sequence
from math import nan

from hwid_cli.diagnosis.diagnose import allowed_effects, problem_of
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.drive.simulation import are_loops_compiled, simulate_drive
from hwid_cli.records.experiment import SimulationOptions
from hwid_cli.records.next import PlannedInput
from hwid_cli.stages.diagnose import given_by
from hwid_cli.stages.fit_seconds import SECONDS_PER_SIMULATED_SAMPLE
from hwid_cli.stages.order_grid import candidate_orders
from hwid_cli.stages.stage import Planning

# Seconds for each sample of a table of what an input visits (measured, 1200 to 50 000
# samples), and how often one is made of each input.
_SECONDS_PER_TABLED_SAMPLE, _TABLES_OF_EACH = 4e-7, 4
# Runs of a drive on an input that tell two candidates apart: one of each, and the
# derivatives of the rival, [-].
_RUNS_OF_TWO = 12
# Start values of a hidden effect, mean of the catalogue; each is run on all recordings and
# on all inputs on offer, [-].
_STARTS_OF_EACH = 9
# What a run takes beside the motion, [s], and the motion of a drive with an effect over
# that of the drive alone, [-] (measured, 400 and 4000 samples).
_AROUND_RUN_S, _WITH_EFFECT = 5e-4, 3.0


def choice_seconds(
    planning: Planning, offered: Sequence[PlannedInput], goal: str
) -> tuple[float, float]:
    """How long a choice takes, at least and at most.

    Returns
    -------
    tuple of float, [s]
        The second is NaN where the first says it all, both where nothing may be timed.
    """
    known = sum(one.n_samples for one in planning.recordings)
    on_offer = sum(one.values.size for one in offered)
    if goal == "diagnosis":
        return _of_diagnosis(planning, offered)
    seconds = _TABLES_OF_EACH * _SECONDS_PER_TABLED_SAMPLE * (known + on_offer)
    if goal == "parameters":
        grid = candidate_orders(planning.experiment.orders)
        linear = max(one.nb + one.nf for _, _, one in grid)
        # A place and a value of each corner of both maps.
        n_parameters = linear + 4 * (planning.experiment.fit.units + 1)
        seconds += SECONDS_PER_SIMULATED_SAMPLE * n_parameters * (known + on_offer)
    return seconds, nan


def _of_diagnosis(
    planning: Planning, offered: Sequence[PlannedInput]
) -> tuple[float, float]:
    """Two candidates are told apart, or every effect is looked for that is not named."""
    given = given_by(planning.experiment, planning.recordings, planning.logs)
    # A first run compiles its loops, which would be all that is timed.
    is_timed = planning.may_time and are_loops_compiled()
    if not (is_timed and isinstance(given.simulation, SimulationOptions)):
        return nan, nan
    problem = problem_of(given.recordings, given.simulation, given.options)
    each = _WITH_EFFECT * _seconds_per_sample(problem)

    def runs_on(sizes: Sequence[int]) -> float:
        return _AROUND_RUN_S * len(sizes) + each * sum(sizes)

    on_offer = runs_on([one.values.size for one in offered])
    known = runs_on([one.n_samples for one in given.recordings])
    n_effects = len(allowed_effects(problem, given.options))
    least = _RUNS_OF_TWO * on_offer
    return least, least + n_effects * _STARTS_OF_EACH * (known + on_offer)


def _seconds_per_sample(problem: DiagnosisProblem) -> float:
    """How long the drive takes for a sample of its motion, [s]."""
    longest = max(problem.signals, key=lambda one: one.driven_by.size)
    step = longest.sample_time_s
    # The first call loads the compiled loops, which no later one does.
    simulate_drive(longest.driven_by[:2], problem.drive, sample_time_s=step)
    start = time.process_time()
    simulate_drive(longest.driven_by, problem.drive, sample_time_s=step)
    return (time.process_time() - start) / longest.driven_by.size
