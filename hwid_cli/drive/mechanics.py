"""Motion of a current-driven mass with spring, damper, dry friction and a contact.

``m x'' + c x' + k x + contact(x) = kt i(t) + friction``, the current held linearly
between samples. docs/method_simulation.md, eq. (G1) to (G8). Valid for a current sampled
fast enough that a straight line between samples describes it; the time of the events
is found to rounding, so the numbers do not depend on the sampling step.

Compiled loop of the mechanism's motion with events inside the step, nothing else.

Between two events (stop, break-away, crossing of a contact's edge) the mechanism is
linear and the force of the current a straight line in time, so the displacement is the
power series of that linear equation. Sub-steps are so short that the series is exact
to rounding, and so short that velocity and acceleration have the few zeros that the
event search relies on. docs/method_simulation.md, eq. (G5) to (G8).
"""

import numpy as np

from hwid_cli.compiled import compiled
from hwid_cli.records.mechanics import Mechanics

# Terms of the series. With h (c/m + sqrt(k/m)) <= LONGEST_PHASE the first term left out
# is below 0.5^17 / 17! = 2e-20 of the motion.
N_TERMS = 17
LONGEST_PHASE = 0.5

# Forces that cancel to this share of their size count as balanced: below it the sign of
# the rest is rounding, and starting to move on it could go on for ever.
BALANCE = 1e-13

# Events are located to this share of the searched stretch. It must exceed the distance
# of two neighbouring numbers, 2.2e-16, or the bisection would not end.
TIME_RESOLUTION = 4e-16

END, STOP, EDGE = 0, 1, 2


@compiled()
def propagate(
    force: np.ndarray,
    lengths: np.ndarray,
    linear: tuple[float, float, float],
    dry: tuple[float, float],
    contact: tuple[float, float, float],
    state: tuple[float, float],
) -> tuple[np.ndarray, np.ndarray]:
    """Return position and velocity at every corner of a force in straight lines.

    Parameters
    ----------
    force : ndarray, shape (n,), [N]
    lengths : ndarray, shape (n - 1,), [s]
        Time from each corner to the next.
    linear : tuple of mass [kg], damping [N s/m], stiffness [N/m]
    dry : tuple of Coulomb force [N], break-away force [N]
    contact : tuple of lower edge [m], upper edge [m], stiffness [N/m]
        The edges may be infinite.
    state : tuple of position [m], velocity [m/s] at the first sample
    """
    n = force.size
    positions = np.empty(n)
    velocities = np.empty(n)
    mass, damping, stiffness = linear
    rate = damping / mass + np.sqrt((stiffness + contact[2]) / mass)
    position, velocity = state
    direction = _sign(velocity)
    for i in range(n):
        positions[i] = position
        velocities[i] = velocity
        if i + 1 == n:
            break
        n_sub = max(1, int(np.ceil(lengths[i] * rate / LONGEST_PHASE)))
        h = lengths[i] / n_sub
        slope = (force[i + 1] - force[i]) / lengths[i]
        for j in range(n_sub):
            push = (force[i] + slope * (j * h), slope)
            moving = (position, velocity, direction)
            position, velocity, direction = _sub_step(
                moving, push, h, linear, dry, contact
            )
    return positions, velocities


@compiled()
def _sub_step(
    moving: tuple[float, float, float],
    push: tuple[float, float],
    left: float,
    linear: tuple[float, float, float],
    dry: tuple[float, float],
    contact: tuple[float, float, float],
) -> tuple[float, float, float]:
    """Return position, velocity and direction of sliding (0: at rest) one sub-step on."""
    x, v, direction = moving
    force, slope = push
    series = np.empty(N_TERMS)
    side = _side(x, direction, contact)
    while True:
        net, rounding = _net_force(x, side, force, linear, contact)
        if direction == 0.0:
            wait = _break_away_time(net, slope, dry[1] + rounding, left)
            if wait >= left:
                return x, 0.0, 0.0
            direction = _sign(net) if wait == 0.0 and net != 0.0 else _sign(slope)
            side = _side(x, direction, contact)
            force += slope * wait
            left -= wait
            continue
        _fill_series(
            series, x, v, net - direction * dry[0], slope, linear, contact, side
        )
        time, event = _first_event(series, direction, side, contact, left)
        x, v = _value(series, time), _slope(series, time)
        force += slope * time
        left -= time
        if event == END:
            return x, v, direction
        if event == EDGE:
            x = _edge_ahead(direction, side, contact)
            side += direction
        else:
            v = 0.0
            net, rounding = _net_force(x, side, force, linear, contact)
            turned = 0.0 if abs(net) <= dry[1] + rounding else _sign(net)
            if time == 0.0 and turned == direction:
                # Only rounding brings this about: rest until the next sub-step.
                return x, 0.0, 0.0
            direction = turned
            side = _side(x, direction, contact)


@compiled()
def _net_force(
    x: float,
    side: float,
    force: float,
    linear: tuple[float, float, float],
    contact: tuple[float, float, float],
) -> tuple[float, float]:
    """Return the force without friction and damping, and what counts as balanced."""
    spring = linear[2] * x
    if side > 0.0:
        spring += contact[2] * (x - contact[1])
    elif side < 0.0:
        spring += contact[2] * (x - contact[0])
    return force - spring, BALANCE * (abs(force) + abs(spring))


@compiled()
def _break_away_time(net: float, slope: float, threshold: float, left: float) -> float:
    """Return when the net force leaves the band of stiction; ``left`` if it does not."""
    if abs(net) > threshold:
        return 0.0
    if slope == 0.0:
        return left
    return (threshold - net * _sign(slope)) / abs(slope)


@compiled()
def _fill_series(
    series: np.ndarray,
    x: float,
    v: float,
    drive: float,
    slope: float,
    linear: tuple[float, float, float],
    contact: tuple[float, float, float],
    side: float,
) -> None:
    """Fill the power series of the displacement for one linear stretch."""
    m, c, k = linear
    if side != 0.0:
        k += contact[2]
    series[0] = x
    series[1] = v
    series[2] = (drive - c * v) / (2.0 * m)
    series[3] = (slope - 2.0 * c * series[2] - k * v) / (6.0 * m)
    for n in range(2, N_TERMS - 2):
        pull = c * (n + 1) * series[n + 1] + k * series[n]
        series[n + 2] = -pull / (m * (n + 2) * (n + 1))


@compiled()
def _first_event(
    series: np.ndarray,
    direction: float,
    side: float,
    contact: tuple[float, float, float],
    left: float,
) -> tuple[float, int]:
    """Return time and kind of the first event while sliding in one direction."""
    time, event = _stop_time(series, direction, left)
    edge = _edge_ahead(direction, side, contact)
    # The velocity keeps its sign until the stop, so the edge is crossed at most once.
    if direction * (_value(series, time) - edge) > 0.0:
        return _crossing(series, 0, edge, direction, 0.0, time), EDGE
    return time, event


@compiled()
def _stop_time(series: np.ndarray, direction: float, left: float) -> tuple[float, int]:
    """Return when the velocity first changes its sign; ``left`` and END if never."""
    start = direction * series[2]
    end = direction * _bend(series, left)
    if direction * _slope(series, left) < 0.0:
        low = 0.0
        if direction * series[1] <= 0.0:
            # From rest the velocity first rises: look beyond its top.
            if start <= 0.0:
                return 0.0, STOP
            low = _crossing(series, 2, 0.0, -direction, 0.0, left)
        return _crossing(series, 1, 0.0, -direction, low, left), STOP
    if start < 0.0 < end and direction * series[1] > 0.0:
        # The velocity dips inside the sub-step; its acceleration has one zero there.
        lowest = _crossing(series, 2, 0.0, direction, 0.0, left)
        if direction * _slope(series, lowest) < 0.0:
            return _crossing(series, 1, 0.0, -direction, 0.0, lowest), STOP
    return left, END


@compiled()
def _crossing(
    series: np.ndarray, order: int, level: float, sense: float, low: float, high: float
) -> float:
    """Return by bisection where a derivative crosses a level in the given sense."""
    resolution = TIME_RESOLUTION * high
    while high - low > resolution:
        middle = 0.5 * (low + high)
        if order == 0:
            value = _value(series, middle)
        elif order == 1:
            value = _slope(series, middle)
        else:
            value = _bend(series, middle)
        if sense * (value - level) > 0.0:
            high = middle
        else:
            low = middle
    return high


@compiled()
def _edge_ahead(
    direction: float, side: float, contact: tuple[float, float, float]
) -> float:
    """Return the contact edge that the motion reaches next; infinite if none."""
    if direction > 0.0 and side <= 0.0:
        return contact[1] if side == 0.0 else contact[0]
    if direction < 0.0 and side >= 0.0:
        return contact[0] if side == 0.0 else contact[1]
    return direction * np.inf


@compiled()
def _side(x: float, direction: float, contact: tuple[float, float, float]) -> float:
    """Return 1 beyond the upper edge, -1 beyond the lower one, else 0."""
    if x > contact[1] or (x == contact[1] and direction > 0.0):
        return 1.0
    if x < contact[0] or (x == contact[0] and direction < 0.0):
        return -1.0
    return 0.0


@compiled()
def _value(series: np.ndarray, time: float) -> float:
    """Return the sum of the series."""
    total = 0.0
    for n in range(N_TERMS - 1, -1, -1):
        total = total * time + series[n]
    return total


@compiled()
def _slope(series: np.ndarray, time: float) -> float:
    """Return the first derivative of the series."""
    total = 0.0
    for n in range(N_TERMS - 1, 0, -1):
        total = total * time + n * series[n]
    return total


@compiled()
def _bend(series: np.ndarray, time: float) -> float:
    """Return the second derivative of the series."""
    total = 0.0
    for n in range(N_TERMS - 1, 1, -1):
        total = total * time + n * (n - 1) * series[n]
    return total


@compiled()
def _sign(value: float) -> float:
    """Return -1, 0 or 1."""
    if value > 0.0:
        return 1.0
    if value < 0.0:
        return -1.0
    return 0.0


def simulate_motion(
    command_A: np.ndarray,
    mechanics: Mechanics,
    *,
    sample_time_s: float,
    limit_A: float = np.inf,
    position_m: float = 0.0,
    velocity_m_per_s: float = 0.0,
) -> tuple[np.ndarray, np.ndarray]:
    """Displacement and velocity that a command of current causes.

    Parameters
    ----------
    command_A : ndarray, shape (n_samples,), [A]
        Held linearly between samples.
    sample_time_s : float, [s]
    limit_A : float, [A]
        The amplifier cuts the command there, on both sides and between samples too.
    position_m, velocity_m_per_s : float, [m], [m/s]
        State at the first sample.

    Returns
    -------
    displacement : ndarray, shape (n_samples,), [m]
    velocity : ndarray, shape (n_samples,), [m/s]

    Raises
    ------
    ValueError
        If the command is not 1-D and finite, or the sample time not positive.

    References
    ----------
    docs/method_simulation.md, eq. (G1) to (G9).
    """
    command = np.ascontiguousarray(command_A, dtype=np.float64)
    if command.ndim != 1 or not np.isfinite(command).all():
        raise ValueError("command_A must be 1-D and finite")
    if not sample_time_s > 0:
        raise ValueError(f"sample_time_s must be positive, got {sample_time_s!r}")
    samples = np.arange(command.size)
    corners = _corners(command, limit_A)
    current = np.clip(np.interp(corners, samples, command), -limit_A, limit_A)
    friction = mechanics.friction
    lower, upper = _edges(mechanics)
    displacement, velocity = propagate(
        float(mechanics.force_constant_N_per_A) * current,
        float(sample_time_s) * np.diff(corners),
        (
            float(mechanics.mass_kg),
            float(mechanics.damping_N_s_per_m),
            float(mechanics.stiffness_N_per_m),
        ),
        (float(friction.coulomb_N), float(friction.break_away_N)),
        (lower, upper, float(mechanics.contact.stiffness_N_per_m)),
        (float(position_m), float(velocity_m_per_s)),
    )
    at = np.searchsorted(corners, samples)
    return displacement[at], velocity[at]


def _corners(command: np.ndarray, limit: float) -> np.ndarray:
    """Return every sample, and where the line between two of them crosses a limit."""
    found = [np.arange(command.size, dtype=float)]
    first, last = command[:-1], command[1:]
    for level in (-limit, limit):
        (rows,) = np.nonzero((first - level) * (last - level) < 0)
        share = (level - first[rows]) / (last[rows] - first[rows])
        found.append(rows + share)
    return np.unique(np.concatenate(found))


def spring_force(position_m: np.ndarray, mechanics: Mechanics) -> np.ndarray:
    """Force with which spring and contact push back.

    Parameters
    ----------
    position_m : ndarray, any shape, [m]

    Returns
    -------
    ndarray, same shape, [N]
        Positive for a positive displacement.

    References
    ----------
    docs/method_simulation.md, eq. (G4).
    """
    beyond = _beyond_edge(position_m, mechanics)
    stiffness = mechanics.contact.stiffness_N_per_m
    return mechanics.stiffness_N_per_m * np.asarray(position_m) + stiffness * beyond


def energy(
    position_m: np.ndarray, velocity_m_per_s: np.ndarray, mechanics: Mechanics
) -> np.ndarray:
    """Energy in mass, spring and contact.

    Parameters
    ----------
    position_m : ndarray, any shape, [m]
    velocity_m_per_s : ndarray, same shape, [m/s]

    Returns
    -------
    ndarray, same shape, [J]

    References
    ----------
    docs/method_simulation.md, eq. (G10).
    """
    beyond = _beyond_edge(position_m, mechanics)
    return 0.5 * (
        mechanics.mass_kg * np.square(velocity_m_per_s)
        + mechanics.stiffness_N_per_m * np.square(position_m)
        + mechanics.contact.stiffness_N_per_m * np.square(beyond)
    )


def static_position(force_N: float, mechanics: Mechanics) -> float:
    """Position in which spring and contact balance a force, friction left out.

    Parameters
    ----------
    force_N : float, [N]
    mechanics : Mechanics
        With a spring.

    Returns
    -------
    float, [m]

    Raises
    ------
    ValueError
        If there is no spring: a free axis has no such position.

    References
    ----------
    docs/method_simulation.md, eq. (G4) solved for x.

    Examples
    --------
    >>> from hwid_cli.records.mechanics import Contact
    >>> arm = Mechanics(stiffness_N_per_m=100.0, contact=Contact(0.2, 300.0))
    >>> static_position(10.0, arm), static_position(40.0, arm)
    (0.1, 0.25)
    """
    stiffness = mechanics.stiffness_N_per_m
    if not stiffness > 0:
        raise ValueError("stiffness_N_per_m must be positive for a static position")
    free = force_N / stiffness
    lower, upper = _edges(mechanics)
    edge = min(max(free, lower), upper)
    # Beyond an edge the main spring carries the force up to it, both springs the rest.
    both = stiffness + mechanics.contact.stiffness_N_per_m
    return edge + (force_N - stiffness * edge) / both


def rest_range(current_A: float, mechanics: Mechanics) -> tuple[float, float]:
    """Positions in which stiction holds the mass under a constant current.

    Parameters
    ----------
    current_A : float, [A]
    mechanics : Mechanics
        With a spring.

    Returns
    -------
    lowest, highest : float, [m]

    References
    ----------
    docs/method_simulation.md, eq. (G3) and (G4).
    """
    force = mechanics.force_constant_N_per_A * current_A
    hold = mechanics.friction.break_away_N
    return (
        static_position(force - hold, mechanics),
        static_position(force + hold, mechanics),
    )


def _edges(mechanics: Mechanics) -> tuple[float, float]:
    """Return where the contact begins below and above; infinite if it does not."""
    contact = mechanics.contact
    edge = float(contact.position_m) if contact.stiffness_N_per_m > 0 else np.inf
    return (-edge if contact.both_sides else -np.inf), edge


def _beyond_edge(position_m: np.ndarray, mechanics: Mechanics) -> np.ndarray:
    """Return how far positions lie beyond the contact's edges, with sign."""
    lower, upper = _edges(mechanics)
    position = np.asarray(position_m, dtype=float)
    return position - np.clip(position, lower, upper)
