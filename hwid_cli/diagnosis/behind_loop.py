"""What a controller's command hardly shows: recordings whose output alone differs.

Under a controller its command is compared, and noise of the sensor makes a derivative part
loud: a load in one recording may be lost in it, and stand out in the output.
docs/method_diagnosis.md, below eq. (D1a).
"""

import numpy as np

from hwid_cli.diagnosis.candidate import rebuilt
from hwid_cli.diagnosis.differences import differences_rms
from hwid_cli.diagnosis.parameters import simulate_at
from hwid_cli.diagnosis.problem import DiagnosisProblem
from hwid_cli.drive.effect import Scales
from hwid_cli.records.candidates import CandidateFit

# An output stands out beyond so many times its noise, and so many times what is usual.
_FAR, _UNUSUAL = 10.0, 3.0


def unseen_in_command(
    problem: DiagnosisProblem, chosen: CandidateFit, scales: Scales
) -> tuple[str, ...]:
    """Say in which recordings the output differs though the command is compared.

    Parameters
    ----------
    chosen : CandidateFit
        What the verdict rests on.

    Returns
    -------
    tuple of str
        One sentence, or none.
    """
    if not problem.compares_command or not chosen.is_usable:
        return ()
    motions = simulate_at(problem, *rebuilt(problem, chosen, scales))
    ratios = np.array(
        [
            _over_noise(one.output - motion.output, one.output)
            for one, motion in zip(problem.signals, motions, strict=True)
        ]
    )
    least = max(_FAR, _UNUSUAL * float(np.median(ratios)))
    rows = np.flatnonzero(ratios > least)
    if rows.size == 0:
        return ()
    worst = int(rows[np.argmax(ratios[rows])])
    names = ", ".join(problem.signals[row].name for row in rows)
    return (
        f"the output of {names} differs by up to {ratios[worst]:.3g} times its noise "
        f"(of the others by about {np.median(ratios):.2g}), and only the controller's "
        "command is compared, which hardly shows it: diagnose again without "
        "simulation.controller and the reference, behind the logged input",
    )


def _over_noise(left: np.ndarray, measured: np.ndarray) -> float:
    """RMS over the noise of a signal; 0 where it shows none, or the drive ran away."""
    noise = differences_rms([measured], 0.0)
    if noise <= 0 or not np.isfinite(left).all():
        return 0.0
    return float(np.sqrt(np.mean((left - left.mean()) ** 2))) / noise
