"""A drive and the path of its command, a polygon, for ``drive_oracle``."""

import math
from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Machine:
    """A drive; ``effects`` as in the configuration."""

    mass: float = 0.3
    damping: float = 15.1
    stiffness: float = 1184.0
    constant: float = 5.0
    reference: float = 5.0
    displacement: float = 0.02
    resistance: float = 0.0
    inductance: float = 0.0
    back_emf: float = 0.0
    effects: dict = field(default_factory=dict)

    def value(self, effect, name, default=0.0):
        return self.effects.get(effect, {}).get(name, default)

    @property
    def teeth_damping(self):
        """Damping of both masses that swing against each other on the teeth."""
        share = self.value("gear_backlash", "motor_share", 0.5)
        swinging = self.mass * share * (1 - share)
        stiffness = self.value("gear_backlash", "stiffness_N_per_m")
        ratio = self.value("gear_backlash", "contact_damping_ratio")
        return 2 * ratio * math.sqrt(stiffness * swinging)

    def has(self, *effects):
        return not self.effects.keys().isdisjoint(effects)


def command_path(machine, times, command):
    """Corners of the command behind delay, dead zone, saturation and rate limit."""
    end = times[-1]
    delay = machine.value("input_delay", "delay_s")
    if delay > 0:
        times = np.concatenate([[0.0], times + delay])
        command = np.concatenate([command[:1], command])
    width = machine.value("input_dead_zone", "threshold_A")
    times, command = _with_corners(times, command, width)
    command = np.sign(command) * np.maximum(abs(command) - width, 0.0)
    limit = machine.value("input_saturation", "limit_A", math.inf)
    times, command = _with_corners(times, command, limit)
    command = np.clip(command, -limit, limit)
    if machine.has("rate_limit"):
        rate = machine.value("rate_limit", "rate_A_per_s")
        times, command = _slowed(times, command, rate)
    kept = times <= end
    last = np.interp(end, times, command)
    return np.append(times[kept], end), np.append(command[kept], last)


def _with_corners(times, values, level):
    extra = []
    for n in range(len(times) - 1):
        rise = values[n + 1] - values[n]
        for at in (-level, level):
            if rise != 0 and min(values[n : n + 2]) < at < max(values[n : n + 2]):
                share = (at - values[n]) / rise
                extra.append(times[n] + share * (times[n + 1] - times[n]))
    every = np.unique(np.concatenate([times, extra]))
    return every, np.interp(every, times, values)


def _slowed(times, values, rate):
    """Follow a polygon with a limited rate."""
    out_times, out = [times[0]], [values[0]]
    for n in range(len(times) - 1):
        now, y = times[n], out[-1]
        slope = (values[n + 1] - values[n]) / (times[n + 1] - times[n])
        while now < times[n + 1]:
            gap = np.interp(now, times, values) - y
            if abs(gap) < 1e-12 and abs(slope) <= rate:
                stop, y = times[n + 1], values[n + 1]
            else:
                pace = math.copysign(rate, gap if abs(gap) >= 1e-12 else slope)
                meet = gap / (pace - slope) if pace != slope else math.inf
                is_met = abs(gap) >= 1e-12 and 0 < meet < times[n + 1] - now
                stop = now + meet if is_met else times[n + 1]
                y += pace * (stop - now)
            out_times.append(stop)
            out.append(y)
            now = stop
    return np.array(out_times), np.array(out)
