"""What a machine has and a simple simulation of it leaves out, each with its true numbers.

A `Hidden` says where it enters: a part, dry friction, the motor's torque, the command on its
way to the motor, or the sensor. `effect` is an id of the catalogue where the law is the
catalogue's own, else a word of this suite; `parameters` holds the true values under the
catalogue's names where the law is the catalogue's.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.signal import lfilter

from tests.machines.plants import (
    Base,
    Dahl,
    Dry,
    Force,
    Heating,
    LuGre,
    MaxwellSlip,
    Motor,
    Part,
    Relaxing,
    SecondMass,
    Thixotropic,
    Winding,
)


@dataclass(frozen=True)
class Hidden:
    """One effect, and the place where it enters."""

    effect: str
    parameters: dict = field(default_factory=dict)
    part: Part | None = None
    dry: Dry | None = None
    # (force constant, current, x, v) -> force
    torque: Callable | None = None
    # (base, torque) -> motor
    motor: Callable[[Base, Callable], Motor] | None = None
    # current -> current, at once
    shape: Callable | None = None
    # (commands on a fine grid, its step in s) -> commands
    chain: Callable | None = None
    # x -> reading, at once
    read: Callable | None = None
    # (times in s, readings) -> readings, on a fine grid
    sensor: Callable | None = None
    # readings with noise -> readings
    digits: Callable | None = None
    spring: Callable | None = None
    base: Callable[[Base], Base] | None = None
    clock_skew: float = 0.0
    sensor_on_load: bool = False


# Friction


def coulomb(force: float, on_load: bool = False) -> Hidden:
    """Dry friction of one size, in N."""
    dry = Dry(lambda x, v, side, drive, spring: np.full_like(x, force), on_load)
    return Hidden("coulomb_friction", {"force_N": force}, dry=dry)


def asymmetric(forward: float, backward: float) -> Hidden:
    """Dry friction of two sizes, in N."""
    dry = Dry(lambda x, v, side, drive, spring: np.where(side > 0, forward, backward))
    return Hidden(
        "asymmetric_friction",
        {"force_forward_N": forward, "force_backward_N": backward},
        dry=dry,
    )


def stribeck(
    force: float, excess: float, velocity: float, exponent: float = 2.0
) -> Hidden:
    """Dry friction that falls from force + excess at rest; another exponent is another law."""

    def level(x, v, side, drive, spring):
        return force + excess * np.exp(-(np.abs(v / velocity) ** exponent))

    if exponent != 2.0:
        return Hidden("stribeck of another exponent", dry=Dry(level))
    numbers = {
        "force_N": force,
        "static_excess_N": excess,
        "velocity_m_per_s": velocity,
    }
    return Hidden("stribeck_friction", numbers, dry=Dry(level))


def worm(force: float, share: float) -> Hidden:
    """Dry friction that grows with the motor's force, as in a worm gear."""

    def level(x, v, side, drive, spring):
        return force + share * np.abs(drive)

    numbers = {"force_N": force, "load_share": share}
    return Hidden("load_friction", numbers, dry=Dry(level))


def wedge(force: float, share: float) -> Hidden:
    """Dry friction that grows with the spring's force."""

    def level(x, v, side, drive, spring):
        return force + share * np.abs(spring)

    numbers = {"force_N": force, "load_share": share}
    return Hidden("load_friction", numbers, dry=Dry(level))


def uneven_way(force: float, share: float, period: float, phase: float) -> Hidden:
    """Dry friction that varies along the way."""

    def level(x, v, side, drive, spring):
        return force * (1.0 + share * np.sin(2.0 * np.pi * x / period + phase))

    numbers = {"force_N": force, "variation_share": share, "period_m": period}
    return Hidden("position_friction", numbers, dry=Dry(level))


def lugre(
    sliding: float, breaking: float, velocity: float, way: float, mass: float
) -> Hidden:
    """Bristles that give way over `way` m, damped well."""
    bristle = sliding / way
    part = LuGre(bristle, 0.6 * np.sqrt(bristle * mass), sliding, breaking, velocity)
    return Hidden("LuGre friction", part=part)


def maxwell_slip(force: float, way: float, elements: int) -> Hidden:
    """Springs that slip one after the other until `force` N is reached, after about `way` m."""
    limits = np.full(elements, force / elements)
    reach = way * np.linspace(0.2, 1.8, elements)
    return Hidden("Maxwell slip friction", part=MaxwellSlip(limits / reach, limits))


def dahl(force: float, way: float) -> Hidden:
    """Friction that builds up over a way."""
    return Hidden(
        "hysteresis", {"force_N": force, "yield_m": way}, part=Dahl(force, way)
    )


def drag(coefficient: float) -> Hidden:
    """Resistance of air, in N s^2/m^2."""
    part = Force(lambda t, x, v: -coefficient * v * np.abs(v))
    return Hidden("quadratic_drag", {"drag_N_s2_per_m2": coefficient}, part=part)


def grease(damping: float, recovery_s: float, way: float) -> Hidden:
    """Grease that thins while it is sheared."""
    return Hidden("thixotropic grease", part=Thixotropic(damping, recovery_s, way))


# Springs, contacts and loads


def cubic(stiffness: float) -> Hidden:
    """Hardening spring, in N/m^3."""
    part = Force(lambda t, x, v: -stiffness * x**3)
    return Hidden("cubic_stiffness", {"stiffness_N_per_m3": stiffness}, part=part)


def one_softer_side(stiffness: float) -> Hidden:
    """Spring that is stiffer to one side, in N/m^2."""
    part = Force(lambda t, x, v: -stiffness * x**2)
    return Hidden("quadratic_stiffness", {"stiffness_N_per_m2": stiffness}, part=part)


def sinh_spring(stiffness: float, bend: float) -> Hidden:
    """Spring k / b sinh(b x) instead of k x."""
    spring = lambda x: -stiffness / bend * np.sinh(bend * x)  # noqa: E731
    return Hidden("sinh spring", spring=spring)


def stops(position: float, stiffness: float) -> Hidden:
    """Equal stops on both sides."""

    def law(t, x, v):
        return -stiffness * (x - np.clip(x, -position, position))

    numbers = {"position_m": position, "stiffness_N_per_m": stiffness}
    return Hidden("end_stop", numbers, part=Force(law))


def stop(position: float, stiffness: float) -> Hidden:
    """A stop on the side of the sign of its position."""
    side = np.sign(position)

    def law(t, x, v):
        return -stiffness * side * np.maximum(0.0, side * (x - position))

    numbers = {"position_m": position, "stiffness_N_per_m": stiffness}
    return Hidden("one_sided_stop", numbers, part=Force(law))


def hunt_crossley(position: float, stiffness: float, loss: float) -> Hidden:
    """Contact of round bodies beyond a position: K d^1.5 (1 + 1.5 a d'), in SI units."""

    def law(t, x, v):
        depth = np.maximum(0.0, x - position)
        return -np.maximum(0.0, stiffness * depth**1.5 * (1.0 + 1.5 * loss * v))

    return Hidden("Hunt-Crossley contact", part=Force(law))


def clearance(half_gap: float, stiffness: float) -> Hidden:
    """The base's spring acts only beyond a clearance."""

    def spring(x):
        return -stiffness * (x - np.clip(x, -half_gap, half_gap))

    return Hidden("spring_gap", {"half_gap_m": half_gap}, spring=spring)


def preload(force: float, over: float) -> Hidden:
    """Springs set against each other: `force` N to leave the middle, built up over `over` m."""
    part = Force(lambda t, x, v: -force * np.clip(x / over, -1.0, 1.0))
    return Hidden("spring_preload", {"force_N": force}, part=part)


def unbalance(torque: float, angle: float) -> Hidden:
    """Unbalanced arm, N m, at `angle` rad from hanging where x is zero."""
    part = Force(lambda t, x, v: -torque * np.sin(x + angle))
    return Hidden("gravity", {"torque_N_m": torque, "angle_rad": angle}, part=part)


def weight(force: float) -> Hidden:
    """Constant force, in N."""
    part = Force(lambda t, x, v: np.full_like(x, force))
    return Hidden("constant_load", {"force_N": force}, part=part)


def teeth(harmonics: list[tuple[float, float, float]]) -> Hidden:
    """Cogging: amplitude in N, period in m and phase in rad of each harmonic."""

    def law(t, x, v):
        waves = [
            a * (np.sin(2 * np.pi * x / p + q) - np.sin(q)) for a, p, q in harmonics
        ]
        return np.sum(waves, axis=0)

    if len(harmonics) > 1:
        return Hidden("cogging of two harmonics", part=Force(law))
    amplitude, period, _ = harmonics[0]
    return Hidden(
        "cogging", {"amplitude_N": amplitude, "period_m": period}, part=Force(law)
    )


def creep(stiffness: float, times: np.ndarray) -> Hidden:
    """Springs with dashpots, equally stiff, of times spread over the recording."""
    return Hidden("creep", part=Relaxing(np.full(times.size, stiffness), times))


def half_order(strength: float, times: np.ndarray) -> Hidden:
    """Damping of order one half within a band of times, in N s^0.5/m."""
    return Hidden("fractional damping", part=Relaxing(strength * times**-0.5, times))


def shaker(amplitude: float, frequency: float, phases: np.ndarray) -> Hidden:
    """Vibration of the floor or a pump, with a phase of its own in each recording."""

    def law(t, x, v):
        return amplitude * np.sin(2 * np.pi * frequency * t + phases)

    numbers = {"amplitude_N": amplitude, "frequency_Hz": frequency}
    return Hidden("periodic_force", numbers, part=Force(law))


def wandering_force(walk: np.ndarray, step_s: float) -> Hidden:
    """A force that wanders: rows of a random walk, straight in between."""
    columns = np.arange(walk.shape[1])

    def law(t, x, v):
        at = np.clip(t / step_s, 0, len(walk) - 1.001)
        low = at.astype(int)
        return walk[low, columns] + (at - low) * (
            walk[low + 1, columns] - walk[low, columns]
        )

    return Hidden("wandering force", part=Force(law))


def breathing_spring(stiffness: float, share: float, rate: float, phases) -> Hidden:
    """Stiffness that swings with time while nobody looks, rate in rad/s."""

    def law(t, x, v):
        return -stiffness * share * np.sin(rate * t + phases) * x

    return Hidden("stiffness that varies in time", part=Force(law))


# Motor and amplifier


def saturating_force(current: float) -> Hidden:
    """Iron saturates: the force follows I tanh(i / I)."""
    return Hidden(
        "tanh saturation",
        torque=lambda kt, i, x, v: kt * current * np.tanh(i / current),
    )


def quadratic_loss(loss: float, reference: float) -> Hidden:
    """The force constant falls with the square of the current."""
    return Hidden(
        "force_constant_saturation",
        {"loss_at_reference": loss},
        torque=lambda kt, i, x, v: kt * (1.0 - loss * (i / reference) ** 2) * i,
    )


def sag(loss: float, reference: float) -> Hidden:
    """The supply sags with the size of the current."""
    return Hidden(
        "supply_sag",
        {"loss_at_reference": loss},
        torque=lambda kt, i, x, v: kt * (1.0 - loss * np.abs(i) / reference) * i,
    )


def ripple(share: float, per_turn: float, phase: float) -> Hidden:
    """The force constant swings along the turn."""
    return Hidden(
        "torque_ripple",
        {"share": share, "per_turn": per_turn},
        torque=lambda kt, i, x, v: (
            kt * i * (1.0 + share * np.sin(per_turn * x + phase))
        ),
    )


def six_step(pole_pairs: float, phase: float) -> Hidden:
    """Block commutation by Hall sensors: the tops of a rectified three-phase wave."""
    sector = np.pi / 3.0

    def torque(kt, i, x, v):
        angle = np.mod(pole_pairs * x + phase, sector) - 0.5 * sector
        return kt * i * np.cos(angle) * np.pi / 3.0

    return Hidden("six-step ripple", torque=torque)


def reluctance(bias: float, gap: float, strength: float) -> Hidden:
    """A magnet's pull, strength ((I0 + i) / (g - x))^2, less that without command."""

    def torque(kt, i, x, v):
        return strength * (((bias + i) / (gap - x)) ** 2 - (bias / gap) ** 2)

    return Hidden("quadratic magnet", torque=torque)


def warming(loss: float, reference: float, time_constant_s: float) -> Hidden:
    """The motor warms up and loses force."""
    return Hidden(
        "thermal_gain_loss",
        {"loss_at_reference": loss, "time_constant_s": time_constant_s},
        motor=lambda base, torque: Heating(
            base.force_constant, loss, reference, time_constant_s
        ),
    )


def winding(inductance: float) -> Hidden:
    """The winding's inductance, in H."""

    def motor(base, torque):
        return Winding(base.resistance, inductance, base.force_constant, torque)

    return Hidden("winding_inductance", {"inductance_H": inductance}, motor=motor)


def current_limit(limit: float) -> Hidden:
    """The amplifier cuts the current."""
    return Hidden(
        "input_saturation",
        {"limit_A": limit},
        shape=lambda i: np.clip(i, -limit, limit),
    )


def speed_limit(limit: float, slope: float) -> Hidden:
    """At speed the supply voltage leaves less current: |i + s v| <= I."""
    return Hidden(
        "voltage_limit",
        {"limit_A": limit, "slope_A_s_per_m": slope},
        torque=lambda kt, i, x, v: (
            kt * np.clip(i, -limit - slope * v, limit - slope * v)
        ),
    )


def dead_zone(threshold: float, soft: bool = False) -> Hidden:
    """Small currents make no force; a soft one rounds the corners off."""
    if soft:
        return Hidden(
            "soft dead zone", shape=lambda i: i - threshold * np.tanh(i / threshold)
        )
    return Hidden(
        "input_dead_zone",
        {"threshold_A": threshold},
        shape=lambda i: i - np.clip(i, -threshold, threshold),
    )


def dead_time(volts: float, resistance: float, back_emf: float) -> Hidden:
    """PWM dead time: a voltage against the current, which does not flow below it.

    Command and motor in volts; the current has no time constant.
    """

    def torque(kt, i, x, v):
        drop = resistance * i
        return kt * (drop - np.clip(drop, -volts, volts)) / resistance

    return Hidden("PWM dead time", torque=torque)


def slew(rate: float) -> Hidden:
    """The amplifier's current changes no faster, in A/s."""
    # Parts of a cell, for the instant at which the current catches up.
    parts = 16

    def chain(values, step_s):
        limited, most = values.copy(), rate * step_s / parts
        for k in range(1, len(values)):
            now, rise = limited[k - 1], (values[k] - values[k - 1]) / parts
            for part in range(1, parts + 1):
                target = values[k - 1] + part * rise
                now = now + np.clip(target - now, -most, most)
            limited[k] = now
        return limited

    return Hidden("rate_limit", {"rate_A_per_s": rate}, chain=chain)


def delay(time_s: float) -> Hidden:
    """The command acts later."""

    def chain(values, step_s):
        k = np.arange(len(values))
        return np.stack(
            [np.interp(k - time_s / step_s, k, one) for one in values.T], axis=1
        )

    return Hidden("input_delay", {"delay_s": time_s}, chain=chain)


def _lagged(values: np.ndarray, step_s: float, time_s: float) -> np.ndarray:
    """A first-order lag of straight pieces, exactly."""
    a = np.exp(-step_s / time_s)
    b = 1.0 - (1.0 - a) * time_s / step_s
    later, now = b, 1.0 - a - b
    return values[0] + lfilter([later, now], [1.0, -a], values - values[0], axis=0)


def lag(time_s: float) -> Hidden:
    """The current follows the command with a first-order lag."""
    return Hidden(
        "actuator_lag",
        {"time_constant_s": time_s},
        chain=lambda values, step_s: _lagged(values, step_s, time_s),
    )


def two_lags(first_s: float, second_s: float) -> Hidden:
    """An amplifier of second order: two lags, one after the other."""

    def chain(values, step_s):
        return _lagged(_lagged(values, step_s, first_s), step_s, second_s)

    return Hidden("second-order amplifier", chain=chain)


# Couplings


def appendage(
    mass: float, frequency: float, damping_ratio: float, hardening: float = 0.0
) -> Hidden:
    """A flexible part beside the machine's mass."""
    rate = 2.0 * np.pi * frequency
    part = SecondMass(
        mass, mass * rate**2, 2.0 * damping_ratio * mass * rate, hardening=hardening
    )
    if hardening:
        return Hidden("hardening appendage", part=part)
    numbers = {
        "mass_kg": mass,
        "frequency_Hz": frequency,
        "damping_ratio": damping_ratio,
    }
    return Hidden("second_mode", numbers, part=part)


def _split(motor_share: float) -> Callable[[Base], Base]:
    """The driven mass is the motor's share; spring and damper go to the load."""

    def change(base):
        return Base(
            base.mass * motor_share, 0.0, 0.0, base.force_constant, base.resistance
        )

    return change


def shaft(
    base: Base, stiffness: float, motor_share: float, damping_ratio: float, at: str
) -> Hidden:
    """Motor and load on a flexible shaft, sensor at the `motor` or at the `load`.

    Spring and damper of the base are on the side of the sensor.
    """
    one, other = base.mass * motor_share, base.mass * (1.0 - motor_share)
    damping = 2.0 * damping_ratio * np.sqrt(stiffness * one * other / base.mass)
    numbers = {"stiffness_N_per_m": stiffness, "motor_share": motor_share}
    if at == "load":
        part = SecondMass(
            other,
            stiffness,
            damping,
            own_damping=base.damping,
            own_stiffness=base.stiffness,
        )
        return Hidden(
            "elastic_coupling",
            numbers,
            part=part,
            base=_split(motor_share),
            sensor_on_load=True,
        )

    def lighter(whole):
        return Base(
            whole.mass * motor_share,
            whole.damping,
            whole.stiffness,
            whole.force_constant,
            whole.resistance,
        )

    return Hidden(
        "elastic_coupling",
        numbers,
        part=SecondMass(other, stiffness, damping),
        base=lighter,
    )


def gear(
    base: Base, half_gap: float, stiffness: float, motor_share: float, at: str
) -> Hidden:
    """Motor and load with play between them, sensor at the `motor` or at the `load`.

    The spring is on the load; so is the damper where the sensor is, else it is shared.
    """
    load = base.mass * (1.0 - motor_share)
    damping = 0.3 * np.sqrt(stiffness * load)
    own = base.damping if at == "load" else 0.5 * base.damping
    part = SecondMass(
        load,
        stiffness,
        damping,
        half_gap,
        own_damping=own,
        own_stiffness=base.stiffness,
    )

    def split(whole):
        return replace(_split(motor_share)(whole), damping=whole.damping - own)

    if at == "load":
        numbers = {"half_gap_m": half_gap}
        return Hidden(
            "gear_backlash", numbers, part=part, base=split, sensor_on_load=True
        )
    return Hidden("gear backlash seen from the motor", part=part, base=split)


def changed(name: str, factors: np.ndarray) -> Hidden:
    """A base parameter with a factor of its own in every recording."""
    fields = {"stiffness": "stiffness", "force_constant": "force_constant"}

    def change(base):
        numbers = dict(vars(base))
        numbers[fields[name]] = numbers[fields[name]] * factors
        return Base(**numbers)

    return Hidden(
        "parameter_change", {"which": name, "spread": float(factors.std())}, base=change
    )


# Sensors


def play(half_gap: float) -> Hidden:
    """The measured place follows only at the ends of a play."""

    def sensor(times, readings):
        seen = readings.copy()
        for k in range(1, len(readings)):
            seen[k] = np.clip(
                seen[k - 1], readings[k] - half_gap, readings[k] + half_gap
            )
        return seen

    return Hidden("output_backlash", {"half_gap_m": half_gap}, sensor=sensor)


def eccentric(amplitude: float, period: float, phase: float) -> Hidden:
    """An encoder disc that is not centred."""

    def read(x):
        return x + amplitude * (np.sin(2 * np.pi * x / period + phase) - np.sin(phase))

    numbers = {"amplitude_m": amplitude, "period_m": period}
    return Hidden("sensor_eccentricity", numbers, read=read)


def clipped(limit: float) -> Hidden:
    """The sensor's range ends."""
    return Hidden(
        "sensor_saturation",
        {"limit_m": limit},
        digits=lambda y: np.clip(y, -limit, limit),
    )


def hum(amplitude: float, frequency: float, phases: np.ndarray) -> Hidden:
    """Mains hum in the sensor alone."""

    def sensor(times, readings):
        return readings + amplitude * np.sin(
            2 * np.pi * frequency * times[:, None] + phases
        )

    numbers = {"amplitude_m": amplitude, "frequency_Hz": frequency}
    return Hidden("sensor_hum", numbers, sensor=sensor)


def bent(coefficient: float, reference: float) -> Hidden:
    """The sensor reads one side larger."""
    return Hidden(
        "sensor_quadratic",
        {"coefficient": coefficient},
        read=lambda x: x + coefficient * x**2 / reference,
    )


def rolled_off(coefficient: float, reference: float) -> Hidden:
    """The sensor bends alike to both sides."""
    return Hidden(
        "sensor_cubic",
        {"coefficient": coefficient},
        read=lambda x: x * (1.0 + coefficient * (x / reference) ** 2),
    )


def drift(rate: float) -> Hidden:
    """The sensor's zero runs away, in m/s."""

    def sensor(times, readings):
        return readings + rate * times[:, None]

    return Hidden("sensor_drift", {"drift_m_per_s": rate}, sensor=sensor)


def slow_sensor(time_s: float) -> Hidden:
    """The sensor follows with a first-order lag."""

    def sensor(times, readings):
        return _lagged(readings, times[1] - times[0], time_s)

    return Hidden("lagging sensor", sensor=sensor)


def wrong_clock(ratio: float) -> Hidden:
    """The output's logger runs fast by a share."""
    return Hidden("clock_skew", {"ratio": 1.0 + ratio}, clock_skew=ratio)


# Nuisances: no effect of the machine


def offset(zeros: np.ndarray | float) -> Hidden:
    """Zero of the sensor, one number or one for each recording."""
    return Hidden("sensor offset", read=lambda x: x + zeros)


def coarse(step: float) -> Hidden:
    """Smallest difference that the sensor shows."""
    return Hidden("coarse sensor", digits=lambda y: step * np.round(y / step))
