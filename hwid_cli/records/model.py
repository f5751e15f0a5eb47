"""The Hammerstein-Wiener model, the options of a fit, its result, and how well it is known."""

from dataclasses import dataclass, field, replace
from typing import Annotated

import numpy as np

from hwid_cli.records.maps import MAP_KINDS, MapOptions, OwnFunction, StaticMap
from hwid_cli.records.recordings import frozen_vector
from hwid_cli.records.rules import (
    NO_KEY,
    SAMPLE_TIME,
    STORED_NUMBERS,
    FileLimit,
    Integer,
    Number,
    OneOf,
    Refusal,
    Refused,
    check_fields,
)
from hwid_cli.records.shown import Shown
from hwid_cli.records.stored import ADDED_LATER


@dataclass(frozen=True, order=True)
class Orders:
    """Orders of the linear block B(q)/F(q), as in MATLAB's ``[nb nf nk]``.

    Parameters
    ----------
    nb : int, [-]
        Number of numerator coefficients, at least 1.
    nf : int, [-]
        Number of poles, at least 0.
    nk : int, [samples]
        Delay from input to output, at least 0.

    Raises
    ------
    ValueError
        If an order is out of its range.
    """

    nb: int
    nf: int
    nk: int

    def __post_init__(self) -> None:
        for name, least in (("nb", 1), ("nf", 0), ("nk", 0)):
            value = getattr(self, name)
            if value != int(value) or value < least:
                raise ValueError(f"{name} must be an integer >= {least}, got {value!r}")
            object.__setattr__(self, name, int(value))

    @property
    def n_state(self) -> int:
        """Number of past values that the linear block remembers."""
        return max(self.nf, self.nb + self.nk - 1)

    def contains(self, smaller: "Orders") -> bool:
        """Tell whether every model of some orders is also one of these.

        Examples
        --------
        >>> Orders(3, 2, 1).contains(Orders(2, 2, 2))
        True
        >>> Orders(2, 2, 2).contains(Orders(2, 2, 1))
        False
        """
        return (
            smaller.nf <= self.nf
            and self.nk <= smaller.nk
            and smaller.nk + smaller.nb <= self.nk + self.nb
        )


@dataclass(frozen=True)
class LinearBlock:
    """A linear block B/F that the user gives, in the units of the data.

    Parameters
    ----------
    numerator : tuple of float, length nb, [output unit / input unit]
        Coefficients of ``q^-delay ... q^-(delay + nb - 1)``. With an output map of a
        free gain any unit does.
    denominator : tuple of float, length nf + 1, [-]
        Coefficients of ``q^0 ... q^-nf``; the first is 1.
    delay : int, [samples]
        nk.
    frozen : bool
        Whether the fit keeps the block as it is; else it is one more start.

    Raises
    ------
    ValueError
        If the numbers are no linear block.
    """

    numerator: Annotated[tuple[float, ...], Number(words="finite numbers")]
    denominator: Annotated[tuple[float, ...], Number(words="finite numbers")]
    delay: Annotated[int, Integer(least=0), FileLimit(100_000)] = 1
    frozen: bool = False

    def __post_init__(self) -> None:
        for name in ("numerator", "denominator"):
            values = tuple(float(value) for value in getattr(self, name))
            object.__setattr__(self, name, values)
        check_fields(self)
        if not any(self.numerator):
            said = "must have a coefficient other than 0, got {}"
            raise Refused(Refusal(list(self.numerator), key=("numerator",), said=said))
        if not self.denominator or self.denominator[0] != 1.0:
            said = "must start with 1, got {}; divide both by its first coefficient"
            raise Refused(
                Refusal(list(self.denominator), key=("denominator",), said=said)
            )

    @property
    def orders(self) -> Orders:
        """Orders ``[nb nf nk]``."""
        return Orders(len(self.numerator), len(self.denominator) - 1, self.delay)

    @property
    def pole_radius(self) -> float:
        """Distance of the outermost pole from zero; 0 without poles."""
        return float(np.max(np.abs(np.roots(self.denominator)), initial=0.0))

    def in_units(self, input_unit: float, output_unit: float) -> "LinearBlock":
        """Give the same block for signals that are divided by these units.

        Parameters
        ----------
        input_unit, output_unit : float
            Positive.
        """
        factor = input_unit / output_unit
        return replace(self, numerator=tuple(b * factor for b in self.numerator))


@dataclass(frozen=True, eq=False)
class Uncertainty:
    """Standard errors of a model's parameters, or the reason why there are none.

    Parameters
    ----------
    names : tuple of str
        Parameter names, such as ``b[0]``, ``f[1]``, ``input_map.value[3]``.
    standard_errors : ndarray, shape (n_parameters,)
        In the units of the parameters; NaN where the data do not determine one.
    reason : str
        Why some or all are missing; empty if all exist.
    flat : tuple of str
        What the data do not tell, or hardly: one sentence for each direction in which
        parameters can move together, with the reason where there is one to tell.
    """

    names: tuple[str, ...] = ()
    standard_errors: np.ndarray = field(default_factory=lambda: np.zeros(0))
    reason: str = ""
    flat: tuple[str, ...] = field(default=(), metadata=ADDED_LATER)

    def __post_init__(self) -> None:
        object.__setattr__(
            self,
            "standard_errors",
            frozen_vector(self.standard_errors, "standard_errors"),
        )


@dataclass(frozen=True, eq=False)
class ParameterCovariance:
    """Covariance of a model's parameters.

    Parameters
    ----------
    names : tuple of str
        As in ``Uncertainty``.
    matrix : ndarray, shape (n_parameters, n_parameters)
        In the units of the parameters; rows and columns of NaN where the data do not
        determine one.
    """

    names: tuple[str, ...]
    matrix: np.ndarray


_NAN = float("nan")


@dataclass(frozen=True)
class Information:
    """Criteria that weigh a fit's error against the number of its parameters.

    Only differences between models of the same recordings mean anything. They take the
    residuals for white; where these are not, they choose too many parameters.

    Parameters
    ----------
    n_samples : int, [samples]
        Of all recordings of the fit.
    n_parameters : int, [-]
        That the data determine: shared gains, a shared offset, outermost break-points and
        flat directions do not count, initial states do.
    aic, aicc, bic : float, [-]
        Criteria of Akaike, the same corrected for few samples, and of Schwarz. The lowest
        is the best; minus infinity where nothing is left of the residuals.
    fpe : float, [output unit squared]
        Variance of the error on new data of the same kind (Akaike's final prediction
        error), here of the free-run simulation.
    """

    n_samples: int = 0
    n_parameters: int = 0
    aic: float = _NAN
    aicc: float = _NAN
    bic: float = _NAN
    fpe: float = _NAN


INITIAL_STATES = ("zero", "steady", "estimated")
JOINS = ("concatenate", "experiments")
LOSSES = ("squared", "huber")
FIT_STATUSES = ("converged", "iteration_limit", "stalled", "failed")


@dataclass(frozen=True)
class FitOptions:
    """How a model is fitted; part of every cached result's key.

    Parameters
    ----------
    input_map, output_map : str
        One of ``MAP_KINDS``.
    units : int, [-]
        Break-points, network units, knots or levels of both maps.
    input_units, output_units : int or None, [-]
        The same for one of the maps; None means ``units``.
    degree : int, [-]
        Degree of a polynomial map.
    initial_state : str
        ``zero``: the linear block starts empty. ``steady``: it starts in equilibrium
        with the first input. ``estimated``: its free response is fitted too.
    join : str
        How several recordings make one fit: ``concatenate`` puts them one after the
        other, ``experiments`` gives each its own initial state.
    free_break_points : bool
        Whether break-points move in the last phase of the fit.
    max_iterations : int, [-]
        Limit for each phase of the search from one start.
    starts : int, [-]
        Number of linear starts that are screened.
    input_function, output_function : OwnFunction or None
        The functions of maps that are ``own_function``.
    loss : str
        How residuals count in the search: ``squared``, or ``huber``, which takes large
        ones for outliers.
    linear_block : LinearBlock or None
        One that is known. Frozen it stays bit by bit, and only maps and initial states
        are fitted; else it is one more start for all orders that contain it.
    largest_pole_radius : float, [-]
        No pole lies further from zero; with 1 poles may stand on the unit circle.
    delays : tuple of int, [samples]
        Delays that are tried; the one of the orders where there are none. The result's
        orders say which one was found.
    """

    input_map: Annotated[str, OneOf(MAP_KINDS)] = "piecewise_linear"
    output_map: Annotated[str, OneOf(MAP_KINDS)] = "piecewise_linear"
    units: Annotated[int, Integer(least=2), FileLimit(1000)] = 10
    degree: Annotated[int, Integer(least=1), FileLimit(100)] = 5
    initial_state: Annotated[str, OneOf(INITIAL_STATES)] = "estimated"
    join: Annotated[str, OneOf(JOINS)] = "concatenate"
    free_break_points: bool = True
    max_iterations: Annotated[int, Integer(least=1), FileLimit(1_000_000)] = 60
    starts: Annotated[int, Integer(least=1), FileLimit(1000)] = 6
    input_units: Annotated[int | None, Integer(least=1), FileLimit(1000)] = None
    output_units: Annotated[int | None, Integer(least=1), FileLimit(1000)] = None
    input_function: OwnFunction | None = field(default=None, metadata=NO_KEY)
    output_function: OwnFunction | None = field(default=None, metadata=NO_KEY)
    loss: Annotated[str, OneOf(LOSSES)] = field(default="squared", metadata=ADDED_LATER)
    linear_block: LinearBlock | None = None
    largest_pole_radius: Annotated[float, Number(above=0, most=1)] = field(
        default=1.0, metadata=ADDED_LATER
    )
    delays: Annotated[
        tuple[int, ...], Integer(least=0, words="integers >= 0"), FileLimit(100_000)
    ] = field(default=(), metadata=ADDED_LATER)

    def __post_init__(self) -> None:
        check_fields(self)
        delays = tuple(sorted({int(value) for value in self.delays}))
        object.__setattr__(self, "delays", delays)
        if self.delays and self.keeps_block:
            expected = "empty beside a frozen linear block"
            raise Refused(Refusal(list(self.delays), expected, ("delays",)))
        for side in ("input", "output"):
            try:
                getattr(self, f"of_{side}")
            except Refused as error:
                # What a map refuses, under the name of the key that asked for it.
                (key,) = error.refusal.key
                named = replace(error.refusal, key=(f"{side}_{key}",))
                raise Refused(named) from None

    def delays_for(self, orders: Orders) -> tuple[int, ...]:
        """Delays that a fit of some orders tries, that of the orders first if it may.

        Returns
        -------
        tuple of int, [samples]
        """
        delays = self.delays or (orders.nk,)
        return tuple(sorted(delays, key=lambda nk: (nk != orders.nk, nk)))

    @property
    def keeps_block(self) -> bool:
        """Whether the linear block is given and stays as it is."""
        return self.linear_block is not None and self.linear_block.frozen

    @property
    def has_maps(self) -> bool:
        """Whether a nonlinear model is asked for."""
        return {self.input_map, self.output_map} != {"none"}

    @property
    def of_input(self) -> MapOptions:
        """What is asked of the input map."""
        units = self.units if self.input_units is None else self.input_units
        return MapOptions(self.input_map, units, self.degree, self.input_function)

    @property
    def of_output(self) -> MapOptions:
        """What is asked of the output map."""
        units = self.units if self.output_units is None else self.output_units
        return MapOptions(self.output_map, units, self.degree, self.output_function)

    def in_units(self, input_unit: float, output_unit: float) -> "FitOptions":
        """Give the same options for data that are divided by these units.

        Parameters
        ----------
        input_unit, output_unit : float
            Positive.

        Returns
        -------
        FitOptions
            Own functions and a given linear block mean the same as before.
        """
        block = self.linear_block
        return replace(
            self,
            input_function=_in_unit(self.input_function, input_unit),
            output_function=_in_unit(self.output_function, output_unit),
            linear_block=block and block.in_units(input_unit, output_unit),
        )


def _in_unit(function: OwnFunction | None, unit: float) -> OwnFunction | None:
    return None if function is None else replace(function, unit=function.unit / unit)


@dataclass(frozen=True, eq=False, repr=False)
class HammersteinWiener(Shown):
    """``w = f(u)``, ``x = B(q)/F(q) w``, ``y = g(x)``.

    Parameters
    ----------
    input_map : StaticMap
        f, from the input unit to w.
    numerator : ndarray, shape (nb,), [-]
        Coefficients of ``q^-nk ... q^-(nk + nb - 1)``.
    denominator : ndarray, shape (nf + 1,), [-]
        Coefficients of ``q^0 ... q^-nf``; the first is 1.
    delay : int, [samples]
        nk.
    output_map : StaticMap
        g, from x to the output unit.
    sample_time_s : float, [s]
    initial_state : str
        Rule by which a simulation starts; one of ``INITIAL_STATES``.
    free_response : ndarray, shape (n_state,) or (0,), [x]
        With ``estimated``: x gains ``C(q)/F(q)`` times a unit pulse at the first
        sample; these are C's coefficients for the first recording of the fit.
    """

    input_map: StaticMap
    numerator: Annotated[np.ndarray, STORED_NUMBERS]
    denominator: Annotated[np.ndarray, STORED_NUMBERS]
    delay: int
    output_map: StaticMap
    sample_time_s: Annotated[float, SAMPLE_TIME]
    initial_state: Annotated[str, OneOf(INITIAL_STATES)] = "zero"
    free_response: Annotated[np.ndarray, STORED_NUMBERS] = field(
        default_factory=lambda: np.zeros(0)
    )
    input_unit: str = "A"
    output_unit: str = "m"

    def __post_init__(self) -> None:
        for name in ("numerator", "denominator", "free_response"):
            object.__setattr__(self, name, frozen_vector(getattr(self, name), name))
        if self.denominator.size == 0 or self.denominator[0] != 1.0:
            raise ValueError("denominator must start with 1")

    def check_stored(self) -> None:
        """Refuse orders that no model has, or a start that is not of its orders.

        Raises
        ------
        ValueError
        """
        n_state, found = self.orders.n_state, self.free_response.size
        if found not in (0, n_state):
            expected = f"{n_state} numbers, or none"
            raise Refused(Refusal(f"{found} numbers", expected, ("free_response",)))

    @property
    def orders(self) -> Orders:
        """Orders ``[nb nf nk]`` of the linear block."""
        return Orders(self.numerator.size, self.denominator.size - 1, self.delay)

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Name and what there is of it."""
        return (
            (
                "orders",
                f"{self.numerator.size} {self.denominator.size - 1} {self.delay}",
            ),
            ("input map", f"{self.input_map.kind}"),
            ("output map", f"{self.output_map.kind}"),
            ("sample time", f"{self.sample_time_s:g} s"),
        )


@dataclass(frozen=True, eq=False, repr=False)
class Fit(Shown):
    """The result of one fit, successful or not.

    Parameters
    ----------
    identified_on : tuple of str
        Names of the recordings, in the order in which they were joined.
    orders : Orders
        With the delay that was found, where several were tried.
    model : HammersteinWiener or None
        None where no usable model was found.
    status : str
        One of ``FIT_STATUSES``; only ``failed`` has no model.
    message : str
        Why the search stopped, for people.
    iterations : int, [-]
        Iterations of the winning start, all phases together.
    rmsd : float, [output unit]
        Over all recordings of the fit; NaN if failed.
    fit_percent : float, [%]
        ``100 (1 - norm(y - y_hat) / norm(y - mean(y)))``; NaN if failed.
    linear_rmsd : float, [output unit]
        RMSD of the best linear output-error model of the same orders found on the way;
        NaN where the fit began with models and needed none.
    poles : ndarray of complex, shape (nf,), [-]
    is_stable : bool
        Whether no pole lies outside the unit circle; a free axis has one on it.
    information : Information
        AIC, BIC and FPE; NaN if failed.
    output_folds : tuple of float, [x]
        Where the output map turns back, by more than the residuals and within the range
        of nearly all samples; empty for a monotonic one.
    """

    identified_on: tuple[str, ...]
    orders: Orders
    options: FitOptions
    model: HammersteinWiener | None
    status: str
    message: str
    iterations: int = 0
    rmsd: float = float("nan")
    fit_percent: float = float("nan")
    linear_rmsd: float = float("nan")
    poles: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=complex))
    is_stable: bool = False
    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    information: Information = field(default_factory=Information, metadata=ADDED_LATER)
    output_folds: tuple[float, ...] = field(default=(), metadata=ADDED_LATER)

    def __post_init__(self) -> None:
        if self.status not in FIT_STATUSES:
            raise ValueError(
                f"status {self.status!r} is none of {', '.join(FIT_STATUSES)}"
            )
        if (self.model is None) != (self.status == "failed"):
            raise ValueError("a fit has no model exactly when it failed")

    @property
    def name(self) -> str:
        """Name of the recordings that were joined, ``step_06+step_09``."""
        return "+".join(self.identified_on)

    def facts(self) -> tuple[tuple[str, str], ...]:
        """Name and what there is of it."""
        return (
            ("name", repr(self.name)),
            ("orders", f"{self.orders.nb} {self.orders.nf} {self.orders.nk}"),
            ("status", self.status),
            ("RMSD", f"{self.rmsd:.3g}"),
            ("fit", f"{self.fit_percent:.2f} %"),
        )
