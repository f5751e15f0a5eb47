"""A machine: base, hidden effects and recordings, and what its sensors and logger write."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy.interpolate import CubicSpline

from tests.machines.excitation import Signal
from tests.machines.hidden import Hidden
from tests.machines.integrate import Loop, closed_loop, open_loop
from tests.machines.plants import Base, MotorLaw, Plant


@dataclass(frozen=True)
class Answers:
    """Which diagnoses do a machine justice.

    Each answer is a list of effect ids; one that occurs twice is named twice. `full` ones
    may claim to be complete. `near` ones are the catalogue's kin of another law: they may
    claim it where what is left cannot be told from noise. `partial` ones are true, but
    lack something. `honest_refusal` says whether `unknown` is right, too.
    """

    full: Sequence[Sequence[str]] = ()
    near: Sequence[Sequence[str]] = ()
    partial: Sequence[Sequence[str]] = ()
    honest_refusal: bool = False


@dataclass
class Machine:
    """Everything that makes a folder of recordings."""

    name: str
    family: str
    story: str
    base: Base
    sample_s: float
    signals: list[Signal]
    # Size of the largest command (A, V), or of the largest reference in a closed loop.
    top: float
    hidden: list[Hidden] = field(default_factory=list)
    nuisances: list[Hidden] = field(default_factory=list)
    # Effects that the simulation has already.
    known: list[Hidden] = field(default_factory=list)
    answers: Answers = Answers()
    loop: Loop | None = None
    # Standard deviations as shares of the signals' rms, and the noise's colour.
    noise: float = 0.003
    input_noise: float = 0.0
    noise_correlation: float = 0.0
    jitter: float = 0.0
    repeated: float = 0.0
    outliers: float = 0.0
    # Shares of the longest recording at which recordings end.
    lengths: tuple[float, float] = (1.0, 1.0)
    warm_up: int = 0
    held_at: np.ndarray | float = 0.0
    cells: int = 6
    # Whether the simulation takes a voltage drive for a force with a damper.
    folded: bool = False
    # Factors on the base that the simulation gets, and more keys of the configuration's
    # sections `simulation` and `diagnose`.
    off: dict = field(default_factory=dict)
    simulation: dict = field(default_factory=dict)
    settings: dict = field(default_factory=dict)
    # Factors that turn SI into what the files hold, and the units' names.
    input_unit: tuple[str, float] = ("current_A", 1.0)
    output_unit: tuple[str, float] = ("displacement_m", 1.0)
    rng: np.random.Generator = field(default_factory=np.random.default_rng)


@dataclass(frozen=True)
class Recordings:
    """What was commanded and what is read: columns are recordings.

    `clean` is the reading without noise, within the sensor's range; `readings` is what the
    logger wrote.
    """

    times: np.ndarray
    commands: np.ndarray
    logged: np.ndarray
    clean: np.ndarray
    readings: np.ndarray
    lengths: np.ndarray
    noise_rms: float


def plant_of(machine: Machine, hidden: Sequence[Hidden]) -> Plant:
    """Equations of a machine with what is known of it and some of its effects."""
    hidden = [*machine.known, *hidden]
    base = machine.base
    dry = spring = None
    parts, torques, motor, on_load = [], [], None, False
    for one in hidden:
        base = one.base(base) if one.base else base
        dry, spring = one.dry or dry, one.spring or spring
        motor = one.motor or motor
        on_load |= one.sensor_on_load
        if one.part is not None:
            parts.append(one.part)
        if one.torque is not None:
            torques.append(one.torque)
    parts.sort(key=lambda part: type(part).__name__ != "SecondMass")
    if dry is not None and dry.on_load and not on_load:
        dry = replace(dry, on_load=False)
    shapes = [one.shape for one in hidden if one.shape]
    return Plant(
        base,
        _motor(base, torques, shapes, motor),
        parts,
        dry,
        sensor_on_load=on_load,
        spring=spring,
        held_at=machine.held_at if dry is not None else 0.0,
    )


def _motor(base, torques, shapes, motor):
    """Motor of a base, with laws for its torque and for its command."""
    kt = base.force_constant

    def torque(i, x, v):
        for shape in shapes:
            i = shape(i)
        if not torques:
            return kt * i
        # Each law is a share of the ideal force; several multiply.
        force = torques[0](kt, i, x, v)
        for law in torques[1:]:
            force = force * np.divide(
                law(kt, i, x, v), kt * i, out=np.ones_like(i), where=i != 0
            )
        return force

    if motor is not None:
        return motor(base, torque)
    if base.resistance is not None:
        return MotorLaw(lambda u, x, v: torque((u - kt * v) / base.resistance, x, v))
    return MotorLaw(torque)


def times_of(machine: Machine) -> np.ndarray:
    """Nominal times of the samples, in s."""
    return machine.sample_s * np.arange(machine.signals[0].values.size)


def read(machine: Machine, hidden: Sequence[Hidden], outputs: np.ndarray) -> np.ndarray:
    """What the sensor's law makes of positions."""
    for one in [*hidden, *machine.nuisances]:
        outputs = one.read(outputs) if one.read else outputs
    return outputs


def _fine_commands(machine, hidden, commands, cells):
    """Commands at both ends of every cell, after the amplifier's dynamics."""
    step_s = machine.sample_s / cells
    if machine.loop is not None:
        first = np.repeat(commands, cells, axis=0)
        for one in hidden:
            first = one.chain(first, step_s) if one.chain else first
        return first, first
    at = np.arange((len(commands) - 1) * cells + 1) / cells
    lead = machine.warm_up * cells
    fine = np.stack(
        [np.interp(at, np.arange(len(commands)), one) for one in commands.T], axis=1
    )
    fine = np.concatenate([np.zeros((lead, fine.shape[1])), fine])
    for one in hidden:
        fine = one.chain(fine, step_s) if one.chain else fine
    return fine[:-1], fine[1:]


def clean_readings(
    machine: Machine,
    hidden: Sequence[Hidden],
    commands: np.ndarray,
    *,
    times: np.ndarray | None = None,
    cells: int | None = None,
) -> np.ndarray:
    """Readings without noise of a machine with some of its effects.

    Parameters
    ----------
    commands : ndarray, shape (n_samples, n_recordings)
    times : ndarray, shape (n_samples, n_recordings), [s], optional
        Where not the nominal times of the samples.
    cells : int, optional
        Cells to a sample, where not the machine's own.
    """
    cells = cells or machine.cells
    step_s = machine.sample_s / cells
    first, last = _fine_commands(machine, hidden, commands, cells)
    fine = open_loop(plant_of(machine, hidden), first, last, step_s)
    fine = read(machine, hidden, fine[machine.warm_up * cells :])
    fine_times = step_s * np.arange(len(fine))
    for one in [*hidden, *machine.nuisances]:
        fine = one.sensor(fine_times, fine) if one.sensor else fine
    skew = sum(one.clock_skew for one in hidden)
    if times is None and skew == 0:
        return fine[::cells][: len(commands)]
    nominal = (
        times_of(machine)[:, None] + np.zeros_like(commands) if times is None else times
    )
    asked = np.minimum(nominal * (1.0 + skew), fine_times[-1])
    columns = [
        CubicSpline(fine_times, y)(t) for y, t in zip(fine.T, asked.T, strict=True)
    ]
    return np.stack(columns, axis=1)


def _noise_size(machine, swing):
    """Noise in the output's unit, from the rms of a motion."""
    return machine.noise * float(np.sqrt(np.mean((swing - swing[0]) ** 2)))


def _white(machine, shape):
    """Noise of rms 1, coloured as the machine's is."""
    noise = machine.rng.normal(size=shape)
    a = machine.noise_correlation
    for k in range(1, shape[0] if a else 0):
        noise[k] = a * noise[k - 1] + np.sqrt(1.0 - a * a) * noise[k]
    return noise


def record(machine: Machine) -> Recordings:
    """Run a machine once and log it."""
    wanted = machine.top * np.stack([one.values for one in machine.signals], axis=1)
    nominal = times_of(machine)[:, None] + np.zeros_like(wanted)
    times, commands = nominal, wanted
    if machine.loop is not None:
        noise_rms = _noise_size(machine, wanted)
        noise = noise_rms * _white(machine, wanted.shape)
        commands, _ = _closed(machine, wanted, noise)
    elif machine.jitter:
        late = machine.jitter * machine.rng.uniform(-1, 1, wanted.shape)
        times = nominal + machine.sample_s * late
        times[0] = 0.0
    clean = clean_readings(
        machine, machine.hidden, commands, times=times if machine.jitter else None
    )
    if machine.loop is None:
        noise_rms = _noise_size(machine, clean)
        noise = noise_rms * _white(machine, wanted.shape)
    logged = commands
    if machine.jitter:
        pairs = zip(times.T, commands.T, strict=True)
        logged = np.stack([np.interp(t, nominal[:, 0], u) for t, u in pairs], axis=1)
    size = machine.input_noise * np.sqrt(np.mean(commands**2))
    logged = logged + size * machine.rng.normal(size=wanted.shape)
    readings = _digits(machine, clean + noise, noise_rms)
    for one in machine.hidden:
        clean = one.digits(clean) if one.digits else clean
    share = machine.rng.uniform(*machine.lengths, wanted.shape[1])
    lengths = np.maximum(300, share * len(wanted)).astype(int)
    return Recordings(times, commands, logged, clean, readings, lengths, noise_rms)


def _closed(machine, references, noise):
    """Commands and readings of a machine whose controller sees the noisy readings."""
    late = sum(one.parameters.get("delay_s", 0.0) for one in machine.hidden)
    loop = replace(machine.loop, delay_samples=round(late / machine.sample_s))

    def measure(k, outputs):
        return read(machine, machine.hidden, outputs) + noise[k]

    plant = plant_of(machine, machine.hidden)
    return closed_loop(
        plant, loop, references, (machine.sample_s, machine.cells), measure
    )


def _digits(machine, readings, noise_rms):
    """What the logger makes of noisy readings."""
    rng = machine.rng
    for one in [*machine.hidden, *machine.nuisances]:
        readings = one.digits(readings) if one.digits else readings
    if machine.outliers:
        hit = rng.random(readings.shape) < machine.outliers
        readings = readings + hit * rng.normal(size=readings.shape) * 15.0 * noise_rms
    if machine.repeated:
        again = rng.random(readings.shape) < machine.repeated
        for k in range(1, len(readings)):
            readings[k] = np.where(again[k], readings[k - 1], readings[k])
    return readings
