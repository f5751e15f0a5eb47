"""Equations of motion: one driven mass, and the parts that a machine may have beside it.

    m dv/dt = F_motor - c v - k x + sum of the parts' forces - dry friction

Every array has one entry for each recording. A part may have states of its own; a part
that carries a second mass may say that the sensor sits there.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import brentq

Law = Callable[..., np.ndarray]


@dataclass(frozen=True)
class Base:
    """What a simple simulation knows of a machine, in SI units (N m, rad where it turns).

    With a resistance the command is a voltage: R i = u - ke v, ke of the number of the
    force constant.
    """

    mass: float
    damping: float
    stiffness: float
    force_constant: float
    resistance: float | None = None


class Part:
    """A force on the driven mass, with `size` states of its own."""

    size = 0

    def start(self, x: np.ndarray) -> np.ndarray:
        """States at rest at x."""
        return np.zeros((self.size, x.size))

    def act(self, t, x, v, z) -> tuple[np.ndarray, np.ndarray | None]:
        """Force on the driven mass, and time derivatives of the part's states."""
        raise NotImplementedError

    def settle(self, z: np.ndarray) -> None:
        """Put states that overshot a limit back on it, at the end of a cell."""


@dataclass
class Force(Part):
    """A force that is a formula of time, position and velocity."""

    law: Law

    def act(self, t, x, v, z):
        return self.law(t, x, v), None


@dataclass
class LuGre(Part):
    """Bristles that bend before they slide (Canudas de Wit and others, 1995).

    Stiffness of a bristle in N/m, its damping in N s/m, sliding and breaking friction in N.
    """

    bristle: float
    bristle_damping: float
    sliding: float
    breaking: float
    velocity: float
    size = 1

    def act(self, t, x, v, z):
        level = self.sliding + (self.breaking - self.sliding) * np.exp(
            -((v / self.velocity) ** 2)
        )
        bend = v - self.bristle * np.abs(v) / level * z[0]
        return -(self.bristle * z[0] + self.bristle_damping * bend), bend[None]


@dataclass
class MaxwellSlip(Part):
    """Springs side by side, each of which slips at a force of its own."""

    stiffness: np.ndarray
    limit: np.ndarray

    def __post_init__(self):
        self.size = self.stiffness.size
        self.reach = (self.limit / self.stiffness)[:, None]

    def act(self, t, x, v, z):
        bend = np.clip(z, -self.reach, self.reach)
        slips = (np.abs(z) >= self.reach) & (z * v > 0)
        return -(self.stiffness[:, None] * bend).sum(axis=0), np.where(slips, 0.0, v)

    def settle(self, z):
        np.clip(z, -self.reach, self.reach, out=z)


@dataclass
class Dahl(Part):
    """Friction that builds up over a way after each reversal."""

    force: float
    way: float
    size = 1

    def act(self, t, x, v, z):
        return -self.force * z[0], ((v - np.abs(v) * z[0]) / self.way)[None]


@dataclass
class Relaxing(Part):
    """Springs in series with dashpots: creep, or damping of a fractional order.

    Stiffness in N/m and time constant in s of each.
    """

    stiffness: np.ndarray
    time_constant: np.ndarray

    def __post_init__(self):
        self.size = self.stiffness.size

    def start(self, x):
        return np.repeat(x[None], self.size, axis=0)

    def act(self, t, x, v, z):
        pull = self.stiffness[:, None] * (z - x)
        return pull.sum(axis=0), (x - z) / self.time_constant[:, None]


@dataclass
class Thixotropic(Part):
    """Grease that thins while it is sheared and recovers at rest."""

    damping: float
    recovery_s: float
    way: float
    size = 1

    def start(self, x):
        return np.ones((1, x.size))

    def act(self, t, x, v, z):
        change = (1.0 - z[0]) / self.recovery_s - z[0] * np.abs(v) / self.way
        return -self.damping * z[0] * v, change[None]


@dataclass
class SecondMass(Part):
    """A second mass behind a spring that may have play; it may carry a ground spring.

    `half_gap` in m; within the play nothing pulls. `hardening` in 1/m^2 stiffens the spring.
    `own_damping` and `own_stiffness` act between the second mass and the ground.
    """

    mass: float
    stiffness: float
    damping: float
    half_gap: float = 0.0
    own_damping: float = 0.0
    own_stiffness: float = 0.0
    hardening: float = 0.0
    size = 2

    def start(self, x):
        return np.stack([x, np.zeros_like(x)])

    def act(self, t, x, v, z):
        bend, rate = x - z[0], v - z[1]
        if self.half_gap > 0:
            beyond = bend - np.clip(bend, -self.half_gap, self.half_gap)
            pull = np.where(
                beyond != 0, self.stiffness * beyond + self.damping * rate, 0.0
            )
            # Teeth push; they do not pull.
            pull = np.where(pull * beyond > 0, pull, 0.0)
        else:
            pull = (
                self.stiffness * bend * (1.0 + self.hardening * bend**2)
                + self.damping * rate
            )
        own = -self.own_damping * z[1] - self.own_stiffness * z[0]
        return -pull, np.stack([z[1], (pull + own) / self.mass])


class Motor:
    """Force of the motor; `size` states of its own."""

    size = 0

    def act(self, u, x, v, z) -> tuple[np.ndarray, np.ndarray | None]:
        """Force on the driven mass, and time derivatives of the motor's states."""
        raise NotImplementedError


@dataclass
class MotorLaw(Motor):
    """A motor whose force is a formula of current, position and velocity."""

    law: Law

    def act(self, u, x, v, z):
        return self.law(u, x, v), None


@dataclass
class Winding(Motor):
    """A voltage drives the current: L di/dt = u - R i - ke v; `torque` is a formula of
    current, position and velocity."""

    resistance: float
    inductance: float
    back_emf: float
    torque: Law
    size = 1

    def act(self, u, x, v, z):
        change = (u - self.resistance * z[0] - self.back_emf * v) / self.inductance
        return self.torque(z[0], x, v), change[None]


@dataclass
class Heating(Motor):
    """A motor that loses a share of its force as it warms with the square of the current."""

    force_constant: float
    loss: float
    reference: float
    time_constant_s: float
    size = 1

    def act(self, u, x, v, z):
        change = ((u / self.reference) ** 2 - z[0]) / self.time_constant_s
        return self.force_constant * (1.0 - self.loss * z[0]) * u, change[None]


@dataclass
class Dry:
    """Dry friction: its size while sliding to `side`, from position, velocity, side,
    motor force and spring force. `on_load` puts it on a part's second mass."""

    level: Law
    on_load: bool = False


@dataclass
class Plant:
    """A machine's equations, ready to be integrated."""

    base: Base
    motor: Motor
    parts: Sequence[Part] = ()
    dry: Dry | None = None
    sensor_on_load: bool = False
    spring: Law | None = None
    # Where each recording rests beside its equilibrium, in m; friction holds it there.
    held_at: np.ndarray | float = 0.0
    rows: list[slice] = field(init=False)

    def __post_init__(self):
        first, self.rows = 2 + self.motor.size, []
        self.load_row = None
        for part in self.parts:
            self.rows.append(slice(first, first + part.size))
            if isinstance(part, SecondMass) and self.load_row is None:
                self.load_row, self.load = first, part
            first += part.size
        self.n_states = first
        on_load = self.dry is not None and self.dry.on_load
        self.slider = None if self.dry is None else 1
        self.sliding_mass = self.base.mass
        if on_load:
            self.slider, self.sliding_mass = self.load_row + 1, self.load.mass

    def _free(self, t, state, command):
        """Rates without dry friction, force of the motor, force of the spring."""
        x, v = state[0], state[1]
        rates = np.empty_like(state)
        rates[0] = v
        drive, change = self.motor.act(command, x, v, state[2 : 2 + self.motor.size])
        if change is not None:
            rates[2 : 2 + self.motor.size] = change
        spring = -self.base.stiffness * x if self.spring is None else self.spring(x)
        force = drive + spring - self.base.damping * v
        for part, rows in zip(self.parts, self.rows, strict=True):
            push, change = part.act(t, x, v, state[rows])
            force = force + push
            if change is not None:
                rates[rows] = change
        rates[1] = force / self.base.mass
        return rates, drive, spring

    def rates(self, t, state, command, mode):
        """Time derivative of the state; `mode` is the side to which each column slides."""
        rates, drive, spring = self._free(t, state, command)
        row = self.slider
        if row is not None:
            level = self.dry.level(state[row - 1], state[row], mode, drive, spring)
            slowed = rates[row] - mode * level / self.sliding_mass
            rates[row] = np.where(mode == 0, 0.0, slowed)
        return rates

    def grip(self, t, state, command):
        """Force on the slider without friction, and the friction that can hold it."""
        rates, drive, spring = self._free(t, state, command)
        row = self.slider
        force = rates[row] * self.sliding_mass
        nothing = np.zeros_like(force)
        return force, self.dry.level(
            state[row - 1], nothing, np.sign(force), drive, spring
        )

    def start(self, command):
        """At rest where the forces balance, or as far beside it as friction holds it."""
        x = np.zeros_like(command)
        for column in range(command.size):
            x[column] = self._balance(command, column)
        x = x + self.held_at
        state = np.zeros((self.n_states, command.size))
        state[0] = x
        for part, rows in zip(self.parts, self.rows, strict=True):
            state[rows] = part.start(x)
        return state

    def _balance(self, command, column):
        """Position in which a column is at rest, found from zero outwards."""

        def force(x):
            state = np.zeros((self.n_states, command.size))
            state[0] = x
            for part, rows in zip(self.parts, self.rows, strict=True):
                state[rows] = part.start(state[0])
            return self._free(0.0, state, command)[0][1][column] * self.base.mass

        at_zero = force(0.0)
        if abs(at_zero) < 1e-12 * np.max(self.base.force_constant):
            return 0.0
        reach = 1e-9
        while force(reach) * at_zero > 0 and force(-reach) * at_zero > 0:
            reach *= 2.0
            if reach > 1e6:
                return 0.0
        other = reach if force(reach) * at_zero <= 0 else -reach
        return brentq(force, 0.0, other, xtol=1e-15)

    def settle(self, state):
        """Let the parts put back what overshot in a cell."""
        for part, rows in zip(self.parts, self.rows, strict=True):
            part.settle(state[rows])

    def output(self, state):
        """Position of the place that is measured."""
        return state[self.load_row] if self.sensor_on_load else state[0]
