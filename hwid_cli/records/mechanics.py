"""Parameters of a current-driven mechanism: mass, spring, damper, friction, contact."""

from dataclasses import dataclass, field
from typing import Annotated

from hwid_cli.records.rules import (
    NOT_NEGATIVE,
    POSITIVE,
    Refusal,
    Refused,
    check_fields,
)


@dataclass(frozen=True)
class Friction:
    """Dry friction with two levels.

    Parameters
    ----------
    coulomb_N : float, [N]
        Force against the motion while sliding.
    break_away_N : float, [N]
        Force that must be exceeded to start from rest; at least ``coulomb_N``.
    """

    coulomb_N: Annotated[float, NOT_NEGATIVE] = 4.8
    break_away_N: float = 7.2

    def __post_init__(self) -> None:
        check_fields(self)
        if not self.break_away_N >= self.coulomb_N:
            expected = f"at least coulomb_N = {self.coulomb_N!r}"
            raise Refused(Refusal(self.break_away_N, expected, ("break_away_N",)))


@dataclass(frozen=True)
class Contact:
    """A spring that acts only beyond a position.

    Parameters
    ----------
    position_m : float, [m]
        Where it begins, counted from the position without current.
    stiffness_N_per_m : float, [N/m]
        Stiffness on top of the main spring; 0 for no contact.
    both_sides : bool
        Whether there is one at ``-position_m`` too.
    """

    position_m: Annotated[float, POSITIVE] = 0.33
    stiffness_N_per_m: Annotated[float, NOT_NEGATIVE] = 1000.0
    both_sides: bool = False

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class Mechanics:
    """A current-driven mass with spring, damper, dry friction and a contact.

    Parameters
    ----------
    mass_kg : float, [kg]
    damping_N_s_per_m : float, [N s/m]
    stiffness_N_per_m : float, [N/m]
        0 for a free axis.
    force_constant_N_per_A : float, [N/A]
    """

    mass_kg: Annotated[float, POSITIVE] = 2.0
    damping_N_s_per_m: Annotated[float, NOT_NEGATIVE] = 15.0
    stiffness_N_per_m: Annotated[float, NOT_NEGATIVE] = 968.0
    force_constant_N_per_A: float = 48.4
    friction: Friction = field(default_factory=Friction)
    contact: Contact = field(default_factory=Contact)

    def __post_init__(self) -> None:
        check_fields(self)
