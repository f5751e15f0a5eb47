"""The mass on a spring in a fitted linear block, and what a lag beside it leaves.

The block B/F was fitted to samples, so its poles z tell those of the machine,
s = log(z) / T. Two of them are taken for a mass with a damper and a spring, or one for a
damper and a spring without a mass:

    (s - s1) (s - s2) = s^2 + c s + k          s - s1 = s + k, of which c is 1

Changed by factors they have other roots, and other poles of the block; the poles left
are a lag that stays. A mass answers fast pushes alike whatever its spring, so
the gain follows by

    B' = B prod phi(s_i') / prod phi(s_i),     phi(s) = (exp(s T) - 1) / s,

over the changed damper where there is no mass. docs/any_simulation.md.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from hwid_cli.records.model import HammersteinWiener

STIFFNESS, DAMPING = "stiffness", "damping"
# A pair that swings is the mass, unless a pole is so many times slower: then the pair is
# a further one, or fits noise, [-].
_SLOWEST_SHARE = 10.0
# A pole so near 1 integrates: there is no spring. Rounding parts two of them by 1e-8, [-].
_INTEGRATES = 1e-7
# Numerators of a mass, of one pole and of two, with gain 1: of a force that is joined by
# lines, and of one that is held and shows a sample later. The two poles are those of slow
# motion, whose samples are a spline's.
_JOINED = {1: (1 / 2, 1 / 2), 2: (1 / 6, 4 / 6, 1 / 6)}
_HELD = {1: (1.0,), 2: (1 / 2, 1 / 2)}


@dataclass(frozen=True, eq=False)
class BlockMass:
    """A mass with its damper and spring, and the lag beside it.

    Parameters
    ----------
    poles : ndarray, shape (n,), complex, [1/s]
        One or two; none where the block has no such.
    rest : ndarray, shape (n_rest + 1,)
        Denominator of the lag in powers of q^-1.
    denominator : ndarray, shape (n + n_rest + 1,)
        Of mass and lag together.
    sample_time_s : float, [s]
    scale : float, [-]
        Gain of the block over that of the model.
    """

    poles: np.ndarray
    rest: np.ndarray
    denominator: np.ndarray
    sample_time_s: float
    scale: float = 1.0

    @property
    def names(self) -> tuple[str, ...]:
        """Of the factors it has: those of what pulls back, and of what brakes."""
        stiff, damped = self._stiffness_and_damping()
        least = _INTEGRATES / self.sample_time_s
        has = (STIFFNESS, stiff > least**self.poles.size), (DAMPING, damped > least)
        return tuple(name for name, is_there in has if is_there)

    def _stiffness_and_damping(self) -> tuple[float, float]:
        if not self.poles.size:
            return 0.0, 0.0
        coefficients = np.real(np.poly(self.poles))
        # Of a damper without a mass its own coefficient is the first one.
        return float(coefficients[-1]), float(coefficients[-2])

    def changed(self, factors: Mapping[str, float]) -> "BlockMass":
        """With another spring and damper.

        Parameters
        ----------
        factors : mapping of str to float, [-]
            Of ``names``; what is missing has not changed.
        """
        stiff, damped = self._stiffness_and_damping()
        by_stiffness = factors.get(STIFFNESS, 1.0)
        by_damping = factors.get(DAMPING, 1.0)
        if not self.poles.size or by_stiffness == 1.0 == by_damping:
            return self
        stiff, damped = by_stiffness * stiff, by_damping * damped
        has_mass = self.poles.size == 2
        poles = np.roots([1.0, damped, stiff] if has_mass else [damped, stiff])
        scale = self._held(poles) / self._held(self.poles)
        scale /= 1.0 if has_mass else by_damping
        whole = np.convolve(_of_samples(poles, self.sample_time_s), self.rest)
        return replace(self, poles=poles, denominator=whole, scale=self.scale * scale)

    def _held(self, poles: np.ndarray) -> float:
        """The product of phi over poles, [s^n]."""
        step = self.sample_time_s
        # Its limit at a pole of zero is T.
        safe = np.where(poles == 0.0, 1.0, poles)
        each = np.where(poles == 0.0, step, np.expm1(safe * step) / safe)
        return float(np.real(np.prod(each)))

    def force_block(
        self, numerator: np.ndarray, delay: int
    ) -> tuple[np.ndarray, np.ndarray, int]:
        """What a force at the mass passes through.

        Parameters
        ----------
        numerator : ndarray, shape (n,)
            Of the model.
        delay : int, [samples]
            Of the model's input; a force has one of them at most.

        Returns
        -------
        tuple
            Numerator, denominator and delay of that block.
        """
        late = min(delay, 1)
        if self.rest.size == 1 or not self.poles.size:
            return self.scale * numerator, self.denominator, late
        gain = self.scale * float(numerator.sum()) / float(self.rest.sum())
        shape = (_HELD if late else _JOINED)[self.poles.size]
        own = _of_samples(self.poles, self.sample_time_s)
        return gain * np.array(shape), own, late


def mass_of_block(model: HammersteinWiener) -> BlockMass:
    """Find the mass in the block of a model."""
    step = model.sample_time_s
    found = np.roots(model.denominator).astype(complex)
    # A pole at or left of zero is none of a motion that is slow beside the samples.
    usable = np.flatnonzero(found.real > 0.0)
    poles = np.log(found[usable]) / step
    poles[np.abs(poles) * step < _INTEGRATES] = 0.0
    chosen = _slow_ones(poles)
    rest = np.delete(found, usable[chosen])
    left = np.atleast_1d(np.real(np.poly(rest)))
    return BlockMass(poles[chosen], left, model.denominator, step)


def _of_samples(poles: np.ndarray, sample_time_s: float) -> np.ndarray:
    """Denominator in powers of q^-1 of poles in 1/s."""
    return np.real(np.poly(np.exp(poles * sample_time_s)))


def _slow_ones(poles: np.ndarray) -> list[int]:
    """Places of the pair that swings, or of the slowest poles that do not.

    Parameters
    ----------
    poles : ndarray, shape (n,), complex, [1/s]
    """
    order = [int(at) for at in np.argsort(np.abs(poles), kind="stable")]
    slowest = float(np.abs(poles).min(initial=np.inf))
    swinging = [at for at in order if poles[at].imag != 0.0]
    if swinging and abs(poles[swinging[0]]) <= _SLOWEST_SHARE * slowest:
        first = swinging[0]
        (second,) = np.flatnonzero(poles == poles[first].conjugate())[:1]
        return [first, int(second)]
    return [at for at in order if poles[at].imag == 0.0][:2]
