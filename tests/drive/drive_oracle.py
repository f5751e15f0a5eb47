"""The laws of the effects once more, solved by scipy: slow, exact, apart from the tool.

Written from the list of laws alone. The command is a polygon of few corners; between
two corners ``solve_ivp`` runs with tight tolerances and stops at every event.
"""

import math
from bisect import bisect_right
from functools import partial

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

from tests.drive.drive_oracle_machine import command_path

X, V, MOTOR_X, MOTOR_V, PART_X, PART_V, CIRCUIT, LAGGED, WARMTH, YIELDED, PACE, N = (
    range(12)
)
# Far below the tolerances of the tests: motions are 1e-2 m.
RELATIVE, ABSOLUTE = 1e-10, 1e-14
# Further than this from an edge an event is not looked at again, [s].
NUDGE = 1e-13
# Nearer than this to 0 the drive is at 0, [m].
AT_ZERO = 1e-12
# A preload catches what it would bring back to 0 within this time, [s]: half of the tool's.
CAUGHT_S = 1e-5


def simulate(machine, times, command, samples, start=None):
    """Position and velocity at the sample times."""
    times, command = command_path(machine, np.array(times), np.array(command))
    drive = _Run(machine, times, command)
    return drive.solve(samples, start)


class _Run:
    """One simulation: direction of sliding and the forces."""

    def __init__(self, machine, times, command):
        self.machine = machine
        self.times, self.command = times, command
        self.corners, self.heights = times.tolist(), command.tolist()
        self.way = 0.0
        self.is_dry = machine.has(
            "coulomb_friction", "asymmetric_friction", "stribeck_friction",
            "load_friction", "position_friction", "spring_preload",
        )  # fmt: skip
        # Side of a preload on which the drive is; 0 where it is held at 0.
        self.side = 0.0
        self.preload = machine.value("spring_preload", "force_N")
        self.origin = 0.0
        if machine.stiffness > 0:
            self.origin = self._rest(0.0, with_cogging=False)

    def current(self, t):
        # Asked for half a million times: numpy would take most of it to get going.
        n = bisect_right(self.corners, t)
        if n in (0, len(self.corners)):
            return self.heights[0 if n == 0 else -1]
        before, after = self.corners[n - 1 : n + 1]
        rise = self.heights[n] - self.heights[n - 1]
        return self.heights[n - 1] + (t - before) / (after - before) * rise

    def solve(self, samples, start):
        one = self.machine
        state = np.zeros(N)
        first = self.command[0]
        state[LAGGED] = first
        state[CIRCUIT] = first / one.resistance if one.resistance else 0.0
        drawn = state[CIRCUIT] if one.resistance else first
        if start is not None:
            state[X], state[V] = start
        elif one.stiffness > 0:
            state[X] = self._rest(drawn)
        state[MOTOR_X] = state[PART_X] = state[X]
        state[MOTOR_V] = state[PART_V] = state[V]
        if one.has("gear_backlash"):
            push = self._push(drawn, state)
            if push != 0:
                gap = one.value("gear_backlash", "half_gap_m")
                stiff = one.value("gear_backlash", "stiffness_N_per_m")
                state[MOTOR_X] += math.copysign(gap, push) + push / stiff
        self.side = float(np.sign(state[X]))
        self.way = float(np.sign(state[V]))
        positions, velocities = np.empty(len(samples)), np.empty(len(samples))
        done = 0
        for begin, end in zip(self.times[:-1], self.times[1:], strict=True):
            inside = samples[(samples >= begin) & (samples < end)]
            state, found = self._segment(state, begin, end, inside)
            count = len(inside)
            positions[done : done + count] = found[:, X]
            velocities[done : done + count] = found[:, V]
            done += count
        positions[done:], velocities[done:] = state[X], state[V]
        return positions, velocities

    def _segment(self, state, begin, end, samples):
        """Run from one corner of the command to the next."""
        found = np.empty((len(samples), N))
        now, filled = begin, 0
        while now < end:
            self._decide(now, state)
            if state[V] == 0.0 and self.way != 0.0:
                # Off zero, or a step out and back would look like no way at all.
                state = state + NUDGE * self._rate(now, state)
                now += NUDGE
            events = self._events(now, state)
            done = solve_ivp(
                self._rate, (now, end), state, "DOP853", events=events,
                rtol=RELATIVE, atol=ABSOLUTE, dense_output=True, max_step=0.005,
            )  # fmt: skip
            here = samples[filled:]
            here = here[here < done.t[-1]] if done.t[-1] < end else here
            if len(here):
                found[filled : filled + len(here)] = done.sol(here).T
                filled += len(here)
            now, state = done.t[-1], done.y[:, -1].copy()
            if done.status == 1:
                if len(done.t_events[0]) and self.way == 0.0:
                    self.way = float(np.sign(self._net(now, state, 0.0)))
                    self.side = self.way if state[X] == 0.0 else self.side
                elif len(done.t_events[0]):
                    state[V] = 0.0
                    self.way = 0.0
                elif self.preload and abs(state[X]) < AT_ZERO:
                    state, now = self._cross(now, state)
                else:
                    # Just beyond the edge, so that it is not found twice.
                    state = state + NUDGE * self._rate(now, state)
                    now += NUDGE
        return state, found

    def _cross(self, t, state):
        """At 0 with a preload: on to the other side, or held for good."""
        one = self.machine
        state[X], self.side = 0.0, 0.0
        way, self.way = self.way, 0.0
        net = self._net(t, state, 0.0)
        hold = self._level(math.copysign(1.0, net), t, state) + self.preload
        is_back_soon = abs(state[V]) * one.mass < (hold - net * way) * CAUGHT_S
        if abs(net) < hold and is_back_soon:
            state[V] = 0.0
            return state, t
        self.side = self.way = way
        return state + NUDGE * self._rate(t, state), t + NUDGE

    def _decide(self, t, state):
        """At rest: slide on where the force exceeds what friction holds."""
        if state[V] != 0.0 or self.way != 0.0:
            return
        net = self._net(t, state, 0.0)
        if abs(net) > self._held(net, t, state) + 1e-11:
            self.way = math.copysign(1.0, net)
            self.side = self.way if state[X] == 0.0 else self.side

    def _held(self, net, t, state):
        """What friction and a preload hold at rest."""
        level = self._level(math.copysign(1.0, net), t, state)
        return level + (self.preload if state[X] == 0.0 else 0.0)

    def _level(self, way, t, y):
        one, v = self.machine, y[V]
        level = one.value("coulomb_friction", "force_N")
        which = "force_forward_N" if way > 0 else "force_backward_N"
        level += one.value("asymmetric_friction", which)
        level += one.value("stribeck_friction", "force_N")
        excess = one.value("stribeck_friction", "static_excess_N")
        slow = one.value("stribeck_friction", "velocity_m_per_s", 1.0)
        # Bo and Pavelescu (1982): an exponent of 1 for some pairs of materials, 2 for others.
        curve = one.value("stribeck_friction", "curve", "gaussian")
        exponent = 1 if curve == "exponential" else 2
        level += excess * math.exp(-(abs(v / slow) ** exponent))
        if one.has("position_friction"):
            share = one.value("position_friction", "variation_share")
            angle = 2 * math.pi * y[X] / one.value("position_friction", "period_m")
            angle += one.value("position_friction", "phase_rad")
            level += one.value("position_friction", "force_N") * (
                1 + share * math.sin(angle)
            )
        if one.has("load_friction"):
            loads = {
                "spring": lambda: one.stiffness * y[X],
                "drive": lambda: self._push(self._wanted(t, y), y),
            }
            load = loads[one.value("load_friction", "load")]()
            level += one.value("load_friction", "force_N")
            level += one.value("load_friction", "load_share") * abs(load)
        return level

    def _events(self, now, state):
        """The first is the reversal (or break-away); the others are corners of forces."""
        way = self.way
        is_watched = self.is_dry or self.machine.has("hysteresis")
        if is_watched and way == 0.0:

            def leave(t, y):
                net = self._net(t, y, 0.0)
                return abs(net) - self._held(net, t, y) - 2e-11

            leave.terminal, leave.direction = True, 1
            turns = leave
        else:

            def turn(t, y):
                return y[V] if is_watched else 1.0

            turn.terminal, turn.direction = True, -way
            turns = turn
        edges = []
        for n in range(len(self._distances(now, state))):

            def edge(t, y, n=n):
                return self._distances(t, y)[n]

            edge.terminal = True
            edges.append(edge)
        return [turns, *edges]

    def _distances(self, t, y):
        """Zero where a force has a corner."""
        one, found = self.machine, self._edges_along(y)
        if one.has("spring_preload", "load_friction"):
            found.append(y[X] if y[X] != 0.0 else 1.0)
        if one.value("load_friction", "load") == "drive":
            found.append(self._push(self._wanted(t, y), y) or 1.0)
        if one.has("spring_gap"):
            edge = one.value("spring_gap", "half_gap_m")
            found += [y[X] - edge, y[X] + edge]
        if one.has("gear_backlash"):
            edge = one.value("gear_backlash", "half_gap_m")
            twist = y[MOTOR_X] - y[X]
            found += [twist - edge, twist + edge]
            if one.teeth_damping:
                ahead = one.teeth_damping * (y[MOTOR_V] - y[V])
                ahead /= one.value("gear_backlash", "stiffness_N_per_m")
                found += [twist - edge + ahead, twist + edge + ahead]
        if one.has("voltage_limit"):
            wanted = self._wanted(t, y) + self._back(y)
            edge = one.value("voltage_limit", "limit_A")
            found += [wanted - edge, wanted + edge]
        if one.has("quadratic_drag"):
            found.append(y[V] if y[V] != 0.0 else 1.0)
        return found

    def _edges_along(self, y):
        one, found = self.machine, []
        if one.has("end_stop"):
            edge = one.value("end_stop", "position_m")
            found += [y[X] - edge, y[X] + edge]
        for stop in ("one_sided_stop", "one_sided_stop:second"):
            if one.has(stop):
                found.append(y[X] - one.value(stop, "position_m"))
        return found

    def _speed(self, y):
        return y[MOTOR_V] if self.machine.has("gear_backlash") else y[V]

    def _back(self, y):
        return self.machine.value("voltage_limit", "slope_A_s_per_m") * self._speed(y)

    def _wanted(self, t, y):
        """Current before the voltage limit."""
        one = self.machine
        current = y[LAGGED] if one.has("actuator_lag") else self.current(t)
        if one.resistance and one.inductance:
            return y[CIRCUIT]
        if one.resistance:
            return (current - one.back_emf * self._speed(y)) / one.resistance
        return current

    def _push(self, current, y):
        """Force that a current makes."""
        one = self.machine
        if one.has("voltage_limit"):
            edge, back = one.value("voltage_limit", "limit_A"), self._back(y)
            current = min(max(current, -edge - back), edge - back)
        share = current / one.reference
        kept = (
            1 - one.value("force_constant_saturation", "loss_at_reference") * share**2
        )
        kept -= one.value("supply_sag", "loss_at_reference") * abs(share)
        kept -= one.value("thermal_gain_loss", "loss_at_reference") * y[WARMTH]
        angle = y[MOTOR_X] if one.has("gear_backlash") else y[X]
        angle *= one.value("torque_ripple", "per_turn")
        angle += one.value("torque_ripple", "phase_rad")
        kept *= 1 + one.value("torque_ripple", "share") * math.sin(angle)
        return one.constant * kept * current

    def _stop(self, name, into, speed):
        """Force of a stop at a depth, with the speed of going deeper."""
        one = self.machine
        depth = max(into, 0.0)
        force = one.value(name, "stiffness_N_per_m")
        force *= depth ** one.value(name, "exponent", 1.0)
        force *= max(1.0 + one.value(name, "damping_s_per_m") * speed, 0.0)
        if into <= 0.0:
            return force
        return max(force + one.value(name, "damping_N_s_per_m") * speed, 0.0)

    def _spring(self, x, with_cogging=True, v=0.0):
        one = self.machine
        gap = one.value("spring_gap", "half_gap_m")
        force = one.stiffness * math.copysign(max(abs(x) - gap, 0.0), x)
        force += one.value("cubic_stiffness", "stiffness_N_per_m3") * x**3
        force += one.value("quadratic_stiffness", "stiffness_N_per_m2") * x**2
        if one.has("end_stop"):
            into = abs(x) - one.value("end_stop", "position_m")
            side = math.copysign(1.0, x)
            force += side * self._stop("end_stop", into, side * v)
        for stop in ("one_sided_stop", "one_sided_stop:second"):
            if one.has(stop):
                edge = one.value(stop, "position_m")
                side = math.copysign(1.0, edge)
                force += side * self._stop(stop, (x - edge) * side, side * v)
        for teeth in ("cogging", "cogging:second"):
            if one.has(teeth) and with_cogging:
                q = one.value(teeth, "phase_rad")
                way = 2 * math.pi * (x - self.origin) / one.value(teeth, "period_m")
                swing = math.sin(way + q) - math.sin(q)
                force -= one.value(teeth, "amplitude_N") * swing
        angle = x + one.value("gravity", "angle_rad")
        return force + one.value("gravity", "torque_N_m") * math.sin(angle)

    def _rest(self, current, with_cogging=True):
        y = np.zeros(N)

        def away(x, side=0.0):
            y[X] = y[MOTOR_X] = x
            load = self.machine.value("constant_load", "force_N") - side * self.preload
            return self._push(current, y) + load - self._spring(x, with_cogging)

        if abs(away(0.0)) <= self.preload:
            return 0.0
        far = math.copysign(1e-5, away(0.0))
        away = partial(away, side=math.copysign(1.0, far))
        while away(far) * away(0.0) > 0:
            far *= 1.3
        return brentq(away, 0.0, far, xtol=1e-17, rtol=1e-14)

    def _net(self, t, y, way):
        """Force on the mass; ``way`` is the direction of sliding."""
        one, v = self.machine, y[V]
        push = self._push(self._wanted(t, y), y)
        if one.has("gear_backlash"):
            push = self._bite(y)
        net = push + one.value("constant_load", "force_N")
        rubbing = one.value("gear_backlash", "motor_damping_share")
        net -= (
            (1 - rubbing) * one.damping * v
            + self._spring(y[X], v=v)
            + self.side * self.preload
        )
        net -= one.value("quadratic_drag", "drag_N_s2_per_m2") * v * abs(v)
        net -= one.value("hysteresis", "force_N") * y[YIELDED]
        if one.has("periodic_force"):
            angle = 2 * math.pi * one.value("periodic_force", "frequency_Hz") * t
            angle += one.value("periodic_force", "phase_rad")
            net += one.value("periodic_force", "amplitude_N") * math.sin(angle)
        if one.has("second_mode"):
            net += self._pull(y)
        return net - (way * self._level(way, t, y) if way else 0.0)

    def _bite(self, y):
        """Spring and damper of the teeth, which push and never pull."""
        one = self.machine
        twist = y[MOTOR_X] - y[X]
        into = abs(twist) - one.value("gear_backlash", "half_gap_m")
        if into <= 0:
            return 0.0
        force = one.value("gear_backlash", "stiffness_N_per_m") * into
        force += one.teeth_damping * math.copysign(1.0, twist) * (y[MOTOR_V] - y[V])
        return math.copysign(max(force, 0.0), twist)

    def _pull(self, y):
        one = self.machine
        mass = one.value("second_mode", "mass_kg")
        turn = 2 * math.pi * one.value("second_mode", "frequency_Hz")
        drag = 2 * one.value("second_mode", "damping_ratio") * mass * turn
        return mass * turn**2 * (y[PART_X] - y[X]) + drag * (y[PART_V] - y[V])

    def _rate(self, t, y):
        one = self.machine
        out = np.zeros(N)
        mass = one.mass
        if one.has("gear_backlash"):
            inner = one.mass * one.value("gear_backlash", "motor_share", 0.5)
            mass -= inner
            out[MOTOR_X] = y[MOTOR_V]
            push = self._push(self._wanted(t, y), y)
            rubbing = one.value("gear_backlash", "motor_damping_share") * one.damping
            out[MOTOR_V] = (push - self._bite(y) - rubbing * y[MOTOR_V]) / inner
        is_held = (self.is_dry or one.has("hysteresis")) and self.way == 0.0
        if not is_held:
            out[X] = y[V]
            out[V] = self._net(t, y, self.way if self.is_dry else 0.0) / mass
        if one.has("second_mode"):
            out[PART_X] = y[PART_V]
            out[PART_V] = -self._pull(y) / one.value("second_mode", "mass_kg")
        if one.has("actuator_lag"):
            tau = one.value("actuator_lag", "time_constant_s")
            missing = (self.current(t) - y[LAGGED]) / tau
            ratio = one.value("actuator_lag", "damping_ratio")
            out[LAGGED] = y[PACE] if ratio else missing
            out[PACE] = (missing - 2 * ratio * y[PACE]) / tau if ratio else 0.0
        if one.has("thermal_gain_loss"):
            tau = one.value("thermal_gain_loss", "time_constant_s")
            out[WARMTH] = ((self._wanted(t, y) / one.reference) ** 2 - y[WARMTH]) / tau
        if one.has("hysteresis"):
            way = one.value("hysteresis", "yield_m", 1.0)
            ahead = y[YIELDED] * self.way
            ratio = one.value("hysteresis", "shape_ratio")
            share = (math.copysign(1.0, ahead) + ratio) / (1 + ratio)
            share *= abs(ahead) ** one.value("hysteresis", "exponent", 1.0)
            out[YIELDED] = y[V] * (1 - share) / way
        if one.resistance and one.inductance:
            wanted = y[LAGGED] if one.has("actuator_lag") else self.current(t)
            drop = one.back_emf * self._speed(y) + one.resistance * y[CIRCUIT]
            out[CIRCUIT] = (wanted - drop) / one.inductance
        return out
