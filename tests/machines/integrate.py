"""Motion of a plant: Runge-Kutta steps of order four, all recordings side by side.

A state has one row for each quantity and one column for each recording. Time is cut into
cells, several to a sample; in a cell the command runs in a straight line. Dry friction is
no smooth force: a column slides forward (+1), backward (-1) or sticks (0). Where a sliding
column comes to rest, or a sticking one breaks away, inside a cell, the instant is found
by bisection and the rest of the cell is integrated anew from there.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

# Halvings of a cell when an event is located: a millionth of a cell.
HALVINGS = 20
# More events of one cell than this are a column that chatters: it sticks.
MOST_EVENTS = 30


class Moving(Protocol):
    """What the integrator asks of a plant."""

    slider: int | None

    def start(self, command: np.ndarray) -> np.ndarray:
        """State at rest, one column for each recording."""

    def rates(self, t, state, command, mode) -> np.ndarray:
        """Time derivative of the state."""

    def grip(self, t, state, command) -> tuple[np.ndarray, np.ndarray]:
        """Force on the slider without friction, and the friction that can hold it."""

    def settle(self, state) -> None:
        """Put back what overshot a limit in a cell, in place."""

    def output(self, state) -> np.ndarray:
        """What a perfect sensor would read."""


@dataclass
class Cell:
    """A stretch of time in which the command of each recording is a straight line."""

    time_s: float
    step_s: float
    first: np.ndarray
    last: np.ndarray

    def step(self, plant, state, mode, span) -> np.ndarray:
        """One Runge-Kutta step from share `span[0]` to `span[1]` of the cell."""
        begin, end = span
        h = self.step_s * (end - begin)
        times = [
            self.time_s + self.step_s * (begin + part * (end - begin))
            for part in (0, 0.5, 1)
        ]
        rise = self.last - self.first
        inputs = [
            self.first + rise * (begin + part * (end - begin)) for part in (0, 0.5, 1)
        ]
        k1 = plant.rates(times[0], state, inputs[0], mode)
        k2 = plant.rates(times[1], state + 0.5 * h * k1, inputs[1], mode)
        k3 = plant.rates(times[1], state + 0.5 * h * k2, inputs[1], mode)
        k4 = plant.rates(times[2], state + h * k3, inputs[2], mode)
        return state + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)

    def leaves_mode(self, plant, state, mode, at) -> np.ndarray:
        """Columns that must not go on sliding, or sticking, as they do."""
        command = self.first + (self.last - self.first) * at
        reversed_ = (mode != 0) & (state[plant.slider] * mode < 0)
        if not (mode == 0).any():
            return reversed_
        force, hold = plant.grip(self.time_s + self.step_s * at, state, command)
        return reversed_ | ((mode == 0) & (np.abs(force) > hold))

    def new_mode(self, plant, state, at) -> np.ndarray:
        """Whether a column at rest sticks, or which way it starts."""
        command = self.first + (self.last - self.first) * at
        force, hold = plant.grip(self.time_s + self.step_s * at, state, command)
        return np.where(np.abs(force) > hold, np.sign(force), 0.0)

    def advance(self, plant, state, mode) -> tuple[np.ndarray, np.ndarray]:
        """State and modes at the end of the cell."""
        state, mode = self._to_end(plant, state, mode)
        plant.settle(state)
        return state, mode

    def _to_end(self, plant, state, mode):
        """State and modes at the end of the cell, events located."""
        begin, end = np.zeros_like(mode), np.ones_like(mode)
        arrived = self.step(plant, state, mode, (begin, end))
        if plant.slider is None:
            return arrived, mode
        for _ in range(MOST_EVENTS):
            leaving = self.leaves_mode(plant, arrived, mode, end)
            if not leaving.any():
                return arrived, mode
            low, high = np.where(leaving, begin, end), end.copy()
            for _ in range(HALVINGS):
                middle = np.where(leaving, 0.5 * (low + high), end)
                tried = self.step(plant, state, mode, (begin, middle))
                early = ~self.leaves_mode(plant, tried, mode, middle)
                low = np.where(leaving & early, middle, low)
                high = np.where(leaving & ~early, middle, high)
            state = self.step(plant, state, mode, (begin, high))
            state[plant.slider] = np.where(leaving, 0.0, state[plant.slider])
            mode = np.where(leaving, self.new_mode(plant, state, high), mode)
            begin = high
            arrived = self.step(plant, state, mode, (begin, end))
        mode = np.where(leaving, 0.0, mode)
        arrived[plant.slider] = np.where(leaving, 0.0, arrived[plant.slider])
        return arrived, mode


def first_mode(plant: Moving, state: np.ndarray, command: np.ndarray) -> np.ndarray:
    """Modes of columns that start at rest."""
    quiet = np.zeros(command.size)
    if plant.slider is None:
        return quiet
    return Cell(0.0, 1.0, command, command).new_mode(plant, state, quiet)


def open_loop(
    plant: Moving, first: np.ndarray, last: np.ndarray, step_s: float
) -> np.ndarray:
    """Output of a plant at every border of a cell.

    Parameters
    ----------
    first, last : ndarray, shape (n_cells, n_recordings)
        Command at the beginning and at the end of every cell, straight in between.
    step_s : float, [s]
        Length of a cell.
    """
    state = plant.start(first[0])
    mode = first_mode(plant, state, first[0])
    outputs = np.empty((len(first) + 1, first.shape[1]))
    outputs[0] = plant.output(state)
    for k in range(len(first)):
        cell = Cell(k * step_s, step_s, first[k], last[k])
        state, mode = cell.advance(plant, state, mode)
        outputs[k + 1] = plant.output(state)
    return outputs


@dataclass(frozen=True)
class Loop:
    """A position controller that runs once a sample and holds its command.

    ``delay_samples`` is the time it takes to compute, in whole samples.
    """

    proportional: float
    derivative: float
    integral: float
    limit: float
    delay_samples: int = 0


def closed_loop(
    plant: Moving,
    loop: Loop,
    references: np.ndarray,
    time: tuple[float, int],
    measure: Callable[[int, np.ndarray], np.ndarray],
) -> tuple[np.ndarray, np.ndarray]:
    """Commands and measured outputs of a plant under position control, at the samples.

    Parameters
    ----------
    references : ndarray, shape (n_samples, n_recordings)
    time : tuple
        Sample time in seconds, and the number of cells to a sample.
    measure : callable
        What the sensor reads at a sample, from its number and the true output.
    """
    sample_s, cells = time
    rest = np.zeros(references.shape[1])
    state = plant.start(rest)
    mode = first_mode(plant, state, rest)
    commands, outputs = np.empty_like(references), np.empty_like(references)
    total, before = rest.copy(), None
    waiting = [rest] * loop.delay_samples
    for k, target in enumerate(references):
        outputs[k] = measure(k, plant.output(state))
        error = target - outputs[k]
        slope = rest if before is None else (error - before) / sample_s
        before = error
        raw = (
            loop.proportional * error + loop.derivative * slope + loop.integral * total
        )
        commands[k] = np.clip(raw, -loop.limit, loop.limit)
        total = total + np.where(np.abs(raw) < loop.limit, error * sample_s, 0.0)
        waiting.append(commands[k])
        held = waiting.pop(0)
        for j in range(cells):
            cell = Cell(
                k * sample_s + j * sample_s / cells, sample_s / cells, held, held
            )
            state, mode = cell.advance(plant, state, mode)
    return commands, outputs
