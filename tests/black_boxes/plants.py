"""Simulations that somebody else has written: text of Python files, with a truth beside.

A plant is a right-hand side in a file of its own, which the diagnosis only runs. The truth is
the same right-hand side with an effect, integrated here in much shorter steps, with friction
that holds (Karnopp, 1985). Nothing of the program is used.
"""

import math
from dataclasses import dataclass, field, replace

import numpy as np

FUNCTION = '''
"""A simulation of a machine."""

import math
import os

import numpy as np


def acceleration(x, v, force, state, parameters):
{body}


def simulate(time_s, inputs, parameters):
    """Runge-Kutta in {steps} steps a sample; inputs are straight lines between samples."""
    with open(os.path.join(os.path.dirname(__file__), "runs.txt"), "a") as file:
        file.write(".")
    u, push = inputs["{input}"], inputs.get("force", np.zeros(time_s.size))
    u, push = u.tolist(), push.tolist()
    h = (time_s[1] - time_s[0]) / {steps}
    y = [0.0] * {size}
    out = np.empty((time_s.size, {size}))
    for n in range(time_s.size):
        out[n] = y
        if n + 1 == time_s.size:
            break
        du, dpush = u[n + 1] - u[n], push[n + 1] - push[n]
        for j in range({steps}):
            a, b = j / {steps}, (j + 1) / {steps}
            c = 0.5 * (a + b)
            k1 = rates(y, u[n] + a * du, push[n] + a * dpush, parameters)
            now = u[n] + c * du, push[n] + c * dpush
            k2 = rates(moved(y, 0.5 * h, k1), *now, parameters)
            k3 = rates(moved(y, 0.5 * h, k2), *now, parameters)
            k4 = rates(moved(y, h, k3), u[n] + b * du, push[n] + b * dpush, parameters)
            whole = [p + 2 * q + 2 * r + s for p, q, r, s in zip(k1, k2, k3, k4)]
            y = moved(y, h / 6, whole)
    return {{"{output}": out[:, {sees}], "speed": out[:, 1]}}


def moved(y, h, rate):
    return [one + h * change for one, change in zip(y, rate)]


{rates}
'''


@dataclass(frozen=True)
class Plant:
    """A machine: the change of its states, position and speed first.

    Parameters
    ----------
    rates : str
        Text of ``rates(y, u, push, p)``.
    values : dict of str to float
        True parameters; all are handed over.
    free : tuple of str
        Those that the user lets be fitted.
    size : float
        Of the input.
    mass : float
        That an effect's force acts on, of state 1.
    sees : int
        The state that its sensor shows: 0 the position, 1 the speed.
    """

    name: str
    rates: str
    n_states: int
    values: dict
    free: tuple
    size: float
    mass: float
    stroke: float
    input: str = "current_A"
    output: str = "displacement_m"
    steps: int = 4
    has_force: bool = True
    sees: int = 0

    @property
    def text(self):
        """The user's file."""
        head, rest = FUNCTION.split("def acceleration", 1)
        rest = "def simulate" + rest.split("def simulate", 1)[1]
        return (head + rest).format(
            steps=self.steps,
            size=self.n_states,
            input=self.input,
            output=self.output,
            sees=self.sees,
            rates=self.rates,
        )

    def function(self):
        """``rates`` as a function."""
        scope = {"math": math}
        exec(self.rates, scope)
        return scope["rates"]


LINEAR = Plant(
    "stage",
    """def rates(y, u, push, p):
    x, v = y
    return v, (p["kt"] * u + push - p["c"] * v - p["k"] * x) / p["m"]
""",
    2,
    {"m": 0.8, "c": 11.0, "k": 2100.0, "kt": 9.0},
    ("c", "k", "kt"),
    3.0,
    0.8,
    0.012,
)
PENDULUM = Plant(
    "pendulum",
    """def rates(y, u, push, p):
    x, v = y
    torque = p["kt"] * u + push - p["c"] * v - p["g"] * math.sin(x)
    return v, torque / p["J"]
""",
    2,
    {"J": 0.02, "c": 0.05, "g": 0.9, "kt": 0.35},
    ("c", "g", "kt"),
    2.0,
    0.02,
    0.8,
    output="angle_rad",
)
HARDENING = Plant(
    "hardening",
    """def rates(y, u, push, p):
    x, v = y
    spring = p["k"] * x + p["k3"] * x**3
    return v, (p["kt"] * u + push - p["c"] * v - spring) / p["m"]
""",
    2,
    {"m": 0.3, "c": 8.0, "k": 900.0, "k3": 4e6, "kt": 5.0},
    ("c", "k", "kt"),
    4.0,
    0.3,
    0.014,
)
TWO_MASSES = Plant(
    "two_masses",
    """def rates(y, u, push, p):
    x, v, xm, vm = y
    link = p["ks"] * (xm - x) + p["cs"] * (vm - v)
    load = (link + push - p["c"] * v - p["k"] * x) / p["m"]
    motor = (p["kt"] * u - link) / p["mm"]
    return v, load, vm, motor
""",
    4,
    {"m": 0.5, "mm": 0.2, "ks": 4e4, "cs": 8.0, "c": 10.0, "k": 1500.0, "kt": 6.0},
    ("c", "k", "kt"),
    3.0,
    0.5,
    0.012,
    steps=8,
)
MOTOR = Plant(
    "dc_motor",
    """def rates(y, u, push, p):
    x, v, i = y
    current = (u - p["R"] * i - p["ke"] * v) / p["L"]
    return v, (p["ke"] * i + push - p["c"] * v - p["k"] * x) / p["m"], current
""",
    3,
    {"m": 0.4, "c": 4.0, "k": 800.0, "R": 1.5, "L": 0.004, "ke": 4.0},
    ("c", "k", "R"),
    4.0,
    0.4,
    0.012,
    input="voltage_V",
    steps=8,
)
VALVE = Plant(
    "valve",
    """def rates(y, u, push, p):
    x, v, z = y
    push = push + p["kv"] * z
    return v, (push - p["c"] * v - p["k"] * x) / p["m"], (u - z) / p["T"]
""",
    3,
    {"m": 6.0, "c": 90.0, "k": 9000.0, "T": 0.02, "kv": 60.0},
    ("c", "k", "kv"),
    8.0,
    6.0,
    0.05,
    input="valve_V",
)
PLANTS = {one.name: one for one in (LINEAR, PENDULUM, HARDENING, TWO_MASSES, MOTOR)}

# No plain drive with a curved spring comes near to these.
RUBBING = replace(
    LINEAR,
    name="rubbing",
    rates="""def rates(y, u, push, p):
    x, v = y
    rubs = p["fc"] * math.tanh(v / 0.005) + p["d"] * v * abs(v)
    return v, (p["kt"] * u + push - p["c"] * v - p["k"] * x - rubs) / p["m"]
""",
    values={**LINEAR.values, "fc": 3.0, "d": 60.0},
)
YIELDING = replace(
    LINEAR,
    name="yielding",
    rates="""def rates(y, u, push, p):
    x, v = y
    spring = p["k"] * 0.006 * math.tanh(x / 0.006) + 300.0 * x
    return v, (p["kt"] * u + push - p["c"] * v - spring) / p["m"]
""",
)
AMPLIFIED = replace(
    LINEAR,
    name="amplified",
    rates="""def rates(y, u, push, p):
    x, v = y
    force = p["kt"] * 2.0 * math.tanh(u / 2.0) + push
    return v, (force - p["c"] * v - p["k"] * x) / p["m"]
""",
)
# Without an input for forces: all of the above, and one whose input lags behind.
PUSHLESS = {
    one.name: replace(one, has_force=False) for one in (*PLANTS.values(), VALVE)
}
FAR_PLANTS = {one.name: one for one in (RUBBING, YIELDING, AMPLIFIED)}


def with_tachometer(plant):
    """The same with a sensor of its speed in place of the position's."""
    return replace(plant, output="speed_m_per_s", sees=1)


@dataclass(frozen=True)
class Hidden:
    """What the machine has and the simulation lacks.

    Parameters
    ----------
    accepted : tuple of tuple of str
        Names of the catalogue that do it justice.
    """

    name: str
    accepted: tuple
    dry: float = 0.0
    force: object = None
    command: object = None
    output: object = None
    values: dict = field(default_factory=dict)


def hidden_in(plant, load, x_max, y_max=None):
    """Effects of a size that the machine shows.

    Parameters
    ----------
    load : float
        RMS of the force of the input on the mass.
    x_max : float
        Largest position without any effect.
    y_max : float or None
        Largest reading; None for the position.
    """
    stiff = load / x_max
    speed = x_max * np.sqrt(8 * stiff / plant.mass)
    return {
        "none": Hidden("none", ((),)),
        "coulomb": Hidden("coulomb", (("coulomb_friction",),), dry=0.12 * load),
        "stop": Hidden(
            "stop",
            (("one_sided_stop",),),
            force=lambda x, v, t: -60 * stiff * max(x - 0.55 * x_max, 0.0),
        ),
        "drag": Hidden(
            "drag",
            (("quadratic_drag",),),
            force=lambda x, v, t: -0.8 * load / speed**2 * v * abs(v) * 4,
        ),
        "cubic": Hidden(
            "cubic",
            (("cubic_stiffness",),),
            force=lambda x, v, t: -3 * stiff * x_max * (x / x_max) ** 3,
        ),
        "cogging": Hidden(
            "cogging",
            (("cogging",),),
            force=lambda x, v, t: 0.3 * load * math.sin(2 * np.pi * x / (0.4 * x_max)),
        ),
        "dead_zone": Hidden(
            "dead_zone",
            (("input_dead_zone",),),
            command=lambda u, t: (
                np.sign(u) * np.maximum(np.abs(u) - 0.1 * plant.size, 0)
            ),
        ),
        "delay": Hidden(
            "delay",
            (("input_delay",),),
            command=lambda u, t: np.interp(t - 0.0032, t, u),
        ),
        "saturation": Hidden(
            "saturation",
            (("input_saturation",),),
            command=lambda u, t: np.clip(u, -0.6 * plant.size, 0.6 * plant.size),
        ),
        "sensor": Hidden(
            "sensor",
            (("sensor_quadratic",),),
            output=lambda y: y + 0.08 * y**2 / (y_max or x_max),
        ),
    }


# Two at a time, which act at different places.
_PAIRS = (
    ("coulomb", "delay"), ("cubic", "dead_zone"), ("drag", "sensor"),
    ("stop", "saturation"),
)  # fmt: skip


def pairs_in(plant, load, x_max, y_max=None):
    """The same two at a time."""
    single = hidden_in(plant, load, x_max, y_max)
    return {f"{one}+{two}": _both(single[one], single[two]) for one, two in _PAIRS}


def _both(one, two):
    (((first,),), ((second,),)) = one.accepted, two.accepted
    return Hidden(
        f"{one.name}+{two.name}",
        (tuple(sorted((first, second))),),
        dry=one.dry + two.dry,
        force=one.force or two.force,
        command=one.command or two.command,
        output=one.output or two.output,
    )


def integrate(plant, values, u, dt, hidden=None, finer=10):
    """The truth: semi-implicit midpoint in short steps, with friction that holds."""
    rates, hidden = plant.function(), hidden or Hidden("none", ())
    time = dt * np.arange(u.size)
    if hidden.command is not None:
        fine_time = np.linspace(0, time[-1], 40 * (u.size - 1) + 1)
        fine = hidden.command(np.interp(fine_time, time, u), fine_time)
    count = plant.steps * finer
    h = dt / count
    y, out = [0.0] * plant.n_states, np.empty(u.size)
    given = u.tolist()
    for n in range(u.size):
        out[n] = y[plant.sees]
        if n + 1 == u.size:
            break
        for j in range(count):
            at = (j + 0.5) / count
            if hidden.command is None:
                now = given[n] + at * (given[n + 1] - given[n])
            else:
                now = float(fine[40 * n + int(at * 40)])
            y = _step(rates, y, now, h, dt * n + at * dt, values, hidden, plant.mass)
    return hidden.output(out) if hidden.output is not None else out


def _step(rates, y, u, h, t, values, hidden, mass):
    push = hidden.force(y[0], y[1], t) if hidden.force is not None else 0.0
    free = rates(y, u, push, values)
    half = _moved(y, 0.5 * h, free)
    if hidden.dry == 0.0:
        push = hidden.force(half[0], half[1], t) if hidden.force is not None else 0.0
        return _moved(y, h, rates(half, u, push, values))
    # Held where friction can; else it takes its share of the impulse.
    speed = y[1] + h * free[1]
    most = hidden.dry * h / mass
    new = _moved(y, h, rates(half, u, push, values))
    new[1] = 0.0 if abs(speed) <= most else speed - math.copysign(most, speed)
    new[0] = y[0] + 0.5 * h * (y[1] + new[1])
    return new


def _moved(y, h, rate):
    return [one + h * change for one, change in zip(y, rate, strict=True)]
