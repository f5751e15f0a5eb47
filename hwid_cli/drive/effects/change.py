"""Declarations of effects: what differs between recordings. docs/method_diagnosis.md.

A configuration states the public effect ``parameter_change``; a diagnosis tries one
entry for each parameter of the base that may change.
"""

from hwid_cli.drive.effect import NOT_NEGATIVE, Effect, Parameter, Stated
from hwid_cli.records.drive import CHANGING

_TRIALS = {
    "stiffness": (-0.1, -0.03, 0.0, 0.03, 0.1),
    "force_constant": (-0.1, -0.03, 0.0, 0.03, 0.1),
    "damping": (-0.2, -0.06, 0.0, 0.06, 0.2),
    "mass": (-0.3, -0.1, 0.0, 0.1, 0.3),
}

EFFECTS = tuple(
    Effect(
        id=f"parameter_change:{which}",
        sentence=f"the {which.replace('_', ' ')} differs between recordings",
        equation=f"{which} -> {which} (1 + s_r) in recording r",
        enters="motion",
        parameters=(
            # Relative to the parameter's own value; a logarithm, so that no change is 0.
            Parameter(
                f"log_{which}",
                lambda scales: (0.0,),
                lambda scales: (-1.5, 1.5),
                is_positive=False,
                is_own=True,
                trials=_TRIALS[which],
                places=(which.upper(),),
                is_factor=True,
                default=0.0,
            ),
        ),
        stated=(
            Stated("which", words=CHANGING),
            Stated("spread", limits=(NOT_NEGATIVE,)),
        ),
        words={"which": which},
        confused_with={"force_constant_saturation": "repeats of the same recording"},
        # A free axis hardly tells a load from another force constant.
        needs_spring=which == "stiffness",
        is_of_base=True,
    )
    for which in CHANGING
)
