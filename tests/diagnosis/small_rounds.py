"""Searches over sets of effects of a small drive, for tests."""

from hwid_cli.diagnosis.candidate import Baseline, Screened, fitted_drive
from hwid_cli.diagnosis.selection import SelectionCriteria
from hwid_cli.diagnosis.set_fits import Rounds
from tests.diagnosis.made_up_fits import CRITERIA
from tests.diagnosis.small_drive import fit, in_turn, problem, recordings, sizes, white
from tests.stages.diagnosed_drive import FRICTION

STIFFNESS = {"cubic_stiffness": {"stiffness_N_per_m3": 8e5}}
HELD_OUT = ("step_1", "sine_1", "sine_3")

FEW = (
    "coulomb_friction",
    "cubic_stiffness",
    "hysteresis",
    "input_dead_zone",
    "quadratic_drag",
    "stribeck_friction",
)


def rounds_of(effects, allowed, **options):
    of = problem(recordings(effects), held_out=HELD_OUT)
    scales = sizes(of, (31.0,))
    base = fit(of, scales=scales)
    return Rounds(
        **{
            "problem": of,
            "baseline": Baseline(fitted_drive(of.drive, base), scales, white()),
            "criteria": SelectionCriteria.of(of, white()),
            "base": base,
            "allowed": allowed,
            "run_tasks": in_turn,
            "on_round": lambda what, count: None,
            **options,
        }
    )


def rounds_of_fits():
    """Rounds that weigh made-up fits."""
    six = recordings()[:6]
    of = problem(six, held_out=[one.name for one in six[3:]])
    return rounds_of(FRICTION, FEW, problem=of, criteria=CRITERIA)


class Screenings:
    """Screenings that leave made-up multiples of what they left before."""

    def __init__(self, factors):
        self.factors, self.turns = factors, []

    def run(self, tasks, *, keep):
        assert keep
        self.turns.append([one.content["screened"][0] for one in tasks])
        return [self._screened(*one.content["screened"]) for one in tasks]

    def _screened(self, effect):
        turns = sum(effect in turn for turn in self.turns)
        return Screened((effect,), 1.0 * self.factors[effect] ** turns, ())
