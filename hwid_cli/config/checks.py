"""What the keys of one configuration must agree on, beyond the type of each."""

import math

from hwid_cli.config.bounds import check_bounds
from hwid_cli.config.requirements import (
    require,
    require_distinct,
    require_known,
)
from hwid_cli.config.simulation_checks import check_simulation
from hwid_cli.errors import ConfigError
from hwid_cli.files.messages import did_you_mean, name_fault
from hwid_cli.records.experiment import (
    NK_ROLES,
    RECIPE_STEPS,
    CalibrateOptions,
    Experiment,
    GroupOptions,
    OrdersOptions,
    RecordingsOptions,
)
from hwid_cli.records.model import LinearBlock, Orders
from hwid_cli.records.recordings import KINDS

_KEEP = ("top", "best", "coverage_at_least")
# Lists of recordings that may not hold a test recording, and what they do with it.
_SEEN_BEFORE_TEST = (
    ("identify", "recordings", "identifies"),
    ("crossval", "recordings", "validates"),
    ("group", "start", "starts groups"),
    ("group", "candidates", "is a candidate"),
    ("group", "validate", "validates"),
)


def check_experiment(experiment: Experiment) -> None:
    """Refuse a configuration whose values cannot be used together.

    Parameters
    ----------
    experiment : Experiment
        ``source`` names the file in messages.

    Raises
    ------
    ConfigError
        For the first value that cannot be used.
    """
    file = experiment.source
    _check_name(experiment.name, file)
    check_bounds(experiment)
    if experiment.recordings is not None:
        _check_recordings(experiment.recordings, file)
    if experiment.calibrate is not None:
        _check_calibrate(experiment.calibrate, file)
    _check_orders(experiment.orders, file)
    check_block(experiment, file)
    if experiment.fit.delays and experiment.orders.nk_role == "delay":
        raise ConfigError(
            f"{file}: fit.delays: found {list(experiment.fit.delays)}; expected none with "
            "orders.nk_role: delay, where the grid tries the delays; remove one of the two"
        )
    if experiment.crossval is not None:
        require(
            experiment.crossval.threshold > 0,
            f"{file}: crossval.threshold",
            experiment.crossval.threshold,
            "a number > 0",
        )
    if experiment.order is not None:
        require(
            experiment.order.tolerance >= 0,
            f"{file}: order.tolerance",
            experiment.order.tolerance,
            "a number >= 0",
        )
        for units in experiment.order.units:
            require(units >= 2, f"{file}: order.units", units, "integers >= 2")
    if experiment.group is not None:
        _check_group(experiment.group, file)
    check_simulation(experiment)
    _check_name_lists(experiment, file)
    _check_test(experiment, file)


def _check_name(name: str, file: str) -> None:
    require(
        not name_fault(name),
        f"{file}: name",
        name,
        f"a name that can be a folder (letters, digits, - and _): {name_fault(name)}",
    )


def _check_recordings(options: RecordingsOptions, file: str) -> None:
    at = f"{file}: recordings"
    for name in ("files", "exclude"):
        for pattern in getattr(options, name):
            require(pattern != "", f"{at}.{name}", pattern, "a file name or pattern")
    require(len(options.files) > 0, f"{at}.files", [], "at least one name or pattern")
    _check_columns(options, at)
    require_known(options.kind, KINDS, f"{at}.kind")
    for name in ("input_scale", "output_scale"):
        scale = getattr(options, name)
        require(scale != 0, f"{at}.{name}", scale, "a number other than 0")
    require(
        options.sampling_tolerance > 0,
        f"{at}.sampling_tolerance",
        options.sampling_tolerance,
        "a share of the sample time > 0, such as 0.01",
    )
    first, last = options.first_sample, options.last_sample
    require(first >= 0, f"{at}.first_sample", first, "an integer >= 0")
    require(
        last is None or last > first,
        f"{at}.last_sample",
        last,
        f"an integer > first_sample = {first}",
    )
    require(options.average >= 1, f"{at}.average", options.average, "an integer >= 1")
    _check_parts(options, at)


def _check_parts(options: RecordingsOptions, at: str) -> None:
    for name, bounds in options.parts.items():
        place = f"{at}.parts.{name}"
        require(
            not name_fault(name) and "+" not in name,
            place,
            name,
            "a name of letters, digits, - and _",
        )
        require(
            len(bounds) == 2 and 0 <= bounds[0] < bounds[1],
            place,
            list(bounds),
            "[first, last + 1]: two samples counted from 0, the second one larger",
        )
    is_cut = options.first_sample != 0 or options.last_sample is not None
    if options.parts and is_cut:
        name = "first_sample" if options.first_sample else "last_sample"
        raise ConfigError(
            f"{at}.{name}: found {getattr(options, name)}; expected no such key beside "
            "recordings.parts, which says what is used; remove one of the two"
        )


def _check_columns(options: RecordingsOptions, at: str) -> None:
    columns = options.columns
    taken: dict[object, str] = {}
    for name in ("time", "input", "output", "reference"):
        column = getattr(columns, name)
        if column is None:
            continue
        if isinstance(column, int):
            require(column >= 0, f"{at}.columns.{name}", column, "a number >= 0")
        if column in taken:
            raise ConfigError(
                f"{at}.columns.{name}: found {column!r}, which is the {taken[column]} "
                "too; expected another column"
            )
        taken[column] = name
    step = options.sample_time_s
    if step is None and columns.time is None:
        raise ConfigError(
            f"{at}.sample_time_s: missing, and columns.time too; expected one of them; "
            "name the time column or give the sample time"
        )
    require(
        step is None or (math.isfinite(step) and step > 0),
        f"{at}.sample_time_s",
        step,
        "a number of seconds > 0",
    )
    if options.resample and columns.time is None:
        raise ConfigError(
            f"{at}.resample: found true; expected a time column to resample by; "
            "name it in columns.time"
        )


def _check_calibrate(options: CalibrateOptions, file: str) -> None:
    at = f"{file}: calibrate"
    for kind in KINDS:
        recipe = getattr(options, kind)
        require_known(recipe, RECIPE_STEPS, f"{at}.{kind}")
        require_distinct(recipe, f"{at}.{kind}")
    require(
        options.samples is None or options.samples >= 1,
        f"{at}.samples",
        options.samples,
        "an integer >= 1",
    )
    require(
        options.rest_samples >= 1,
        f"{at}.rest_samples",
        options.rest_samples,
        "an integer >= 1",
    )


def _check_orders(options: OrdersOptions, file: str) -> None:
    at = f"{file}: orders"
    if options.nk_role not in NK_ROLES:
        raise ConfigError(
            f"{at}.nk_role: found {options.nk_role!r}; "
            f"{did_you_mean(options.nk_role, NK_ROLES)}"
        )
    for name, least in (("nb", 1), ("nk", 0)):
        axis = getattr(options, name)
        require(len(axis) > 0, f"{at}.{name}", [], "at least one order")
        require(min(axis) >= least, f"{at}.{name}", min(axis), f"orders >= {least}")
        require_distinct(axis, f"{at}.{name}")
    if options.nk_role == "delay":
        if options.nf is None:
            raise ConfigError(
                f"{at}.nf: missing; expected the number of poles, because nk_role is "
                "delay; add the key"
            )
        require(options.nf >= 0, f"{at}.nf", options.nf, "an integer >= 0")
    elif options.nf is not None:
        raise ConfigError(
            f"{at}.nf: found {options.nf}; expected no such key, because with nk_role "
            "poles the number of poles is nk; remove it or set nk_role: delay"
        )


def _check_group(options: GroupOptions, file: str) -> None:
    at = f"{file}: group.keep"
    require_known(options.keep, _KEEP, at)
    require(
        len(options.keep) == 1, at, options.keep, f"exactly one of {', '.join(_KEEP)}"
    )
    ((rule, value),) = options.keep.items()
    if rule == "best":
        require(value is True, f"{at}.best", value, "true")
    else:
        counts = value if isinstance(value, tuple) else (value,)
        is_count = [not isinstance(n, bool) and n >= 1 for n in counts]
        require(
            bool(counts) and all(is_count),
            f"{at}.{rule}",
            value,
            "an integer >= 1, or one for each level",
        )
    require(
        options.max_level >= 1,
        f"{file}: group.max_level",
        options.max_level,
        "an integer >= 1",
    )


def _check_name_lists(experiment: Experiment, file: str) -> None:
    for section, name, _ in (*_SEEN_BEFORE_TEST, ("test", "recordings", "tests")):
        names = _listed(experiment, section, name)
        if names is not None:
            at = f"{file}: {section}.{name}"
            require(len(names) > 0, at, [], "at least one recording")
            require_distinct(names, at)


def _check_test(experiment: Experiment, file: str) -> None:
    held_out = _listed(experiment, "test", "recordings") or ()
    for section, name, what_it_does in _SEEN_BEFORE_TEST:
        both = sorted(set(held_out) & set(_listed(experiment, section, name) or ()))
        if both:
            raise ConfigError(
                f"{file}: test.recordings: {both[0]!r} {what_it_does} too "
                f"({section}.{name}); expected recordings that are used nowhere else; "
                "take it out of one of the two lists"
            )


def _listed(experiment: Experiment, section: str, name: str) -> tuple[str, ...] | None:
    return getattr(getattr(experiment, section), name, None)


def check_block(experiment: Experiment, file: str) -> None:
    """Refuse a linear block that no fit of the grid can begin with or keep.

    Parameters
    ----------
    file : str
        Configuration file, for the message.

    Raises
    ------
    ConfigError
    """
    block = experiment.fit.linear_block
    if block is None:
        return
    if block.frozen:
        _check_frozen(block, experiment, file)
    else:
        _check_place(block, experiment, file)


def _check_frozen(block: LinearBlock, experiment: Experiment, file: str) -> None:
    """A frozen block must fill the grid, and its poles lie where they may."""
    grid = experiment.orders
    own, at = block.orders, f"{file}: fit.linear_block"
    counts_poles = grid.nk_role == "poles"
    second = own.nf if counts_poles else own.nk
    other = ("delay", own.nk, 1) if counts_poles else ("poles", own.nf, grid.nf)
    word, found, wanted = other
    if (grid.nb, grid.nk) != ((own.nb,), (second,)):
        raise ConfigError(
            f"{at}: found a frozen block of {own.nb} numerator coefficients, {own.nf} "
            f"poles and delay {own.nk}; expected the orders of the grid; set orders: "
            f"{{nb: {own.nb}, nk: {second}}}"
        )
    if found != wanted:
        raise ConfigError(
            f"{at}: found {word} {found}; expected {wanted} as in the grid of "
            f"orders.nk_role: {grid.nk_role}; set orders: {{nb: {own.nb}, nf: {own.nf}, "
            f"nk: {own.nk}, nk_role: delay}}"
        )
    radius = experiment.fit.largest_pole_radius
    if block.pole_radius >= radius:
        raise ConfigError(
            f"{at}.denominator: found a pole at radius {block.pole_radius:.4g}; expected "
            f"all poles of a frozen block inside radius {radius:g}; correct the "
            "coefficients, or set frozen: false, which draws them in"
        )


def _check_place(block: LinearBlock, experiment: Experiment, file: str) -> None:
    """A block that is a start must be contained in some orders of the grid."""
    grid, own = experiment.orders, block.orders
    counts_poles = grid.nk_role == "poles"
    delays = experiment.fit.delays or ((1,) if counts_poles else grid.nk)
    n_poles = max(grid.nk) if counts_poles else grid.nf or 0
    if not any(Orders(max(grid.nb), n_poles, nk).contains(own) for nk in delays):
        raise ConfigError(
            f"{file}: fit.linear_block: found {own.nb} numerator coefficients, {own.nf} "
            f"poles and delay {own.nk}, which no orders of the grid contain; expected a "
            "block of smaller or equal orders; widen orders.nb and the poles, or leave the block out"
        )
