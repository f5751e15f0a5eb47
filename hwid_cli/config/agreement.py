"""What the keys of one configuration must agree on, beyond the rules of each."""

from collections.abc import Callable, Collection, Iterator
from typing import NamedTuple

from hwid_cli.config.faults import Fault, Place, missing, wrong
from hwid_cli.config.own_effects import own_effect_faults
from hwid_cli.config.simulation_checks import (
    cascade_faults,
    circuit_faults,
    controller_faults,
    effect_circuit_faults,
    effect_faults,
    held_out_faults,
    known_faults,
    named_effect_faults,
    simulated_faults,
    simulation_faults,
)
from hwid_cli.data.units import factor_between, is_unitless, quantity_of
from hwid_cli.files.messages import name_fault
from hwid_cli.records.experiment import (
    AS_FILE,
    MOST_PAIRS,
    Experiment,
    NextOptions,
    RecordingsOptions,
)
from hwid_cli.records.model import LinearBlock, Orders

# Lists of recordings that may not hold a test recording, and what they do with it.
_SEEN_BEFORE_TEST = (
    ("identify", "recordings", "identifies"),
    ("crossval", "recordings", "validates"),
    ("group", "start", "starts groups"),
    ("group", "candidates", "is a candidate"),
    ("group", "validate", "validates"),
)


_EXAMPLES = {
    "time": "s, ms or us",
    "input": "A, mA or V",
    "output": "m, mm, rad or deg",
}


class _Agreement(NamedTuple):
    """A rule over several keys, and these keys (or their sections)."""

    faults: Callable[[Experiment], Iterator[Fault]]
    keys: str


def disagreements(
    experiment: Experiment, left_out: Collection[Place] = ()
) -> Iterator[Fault]:
    """Whatever makes the values of a configuration unusable together.

    Parameters
    ----------
    left_out : collection of tuple
        Places of keys that were at fault and are not looked at: a rule that compares one
        of them has nothing to say.
    """
    for agreement in _AGREEMENTS:
        compared = [tuple(key.split(".")) for key in agreement.keys.split()]
        if not any(_overlap(one, two) for one in compared for two in left_out):
            yield from agreement.faults(experiment)


def _overlap(one: Place, two: Place) -> bool:
    """Whether one place is the other, or lies in it."""
    length = min(len(one), len(two))
    return one[:length] == two[:length]


def _name(experiment: Experiment) -> Iterator[Fault]:
    fault = name_fault(experiment.name)
    if fault:
        expected = f"a name that can be a folder (letters, digits, - and _): {fault}"
        yield wrong(("name",), experiment.name, expected)


def _columns(experiment: Experiment) -> Iterator[Fault]:
    options = experiment.recordings
    if options is None:
        return
    taken: dict[object, str] = {}
    for name in ("time", "input", "output", "reference", "output_time"):
        column = getattr(options.columns, name)
        if column is None:
            continue
        is_of_output = name in ("output", "output_time")
        if is_of_output and options.columns.output_file is not None:
            continue
        if column in taken:
            yield Fault(
                ("recordings", "columns", name),
                f"found {column!r}, which is the {taken[column]} too",
                "another column",
            )
        taken[column] = name


def _output_file(experiment: Experiment) -> Iterator[Fault]:
    options = experiment.recordings
    change = None if options is None else options.columns.output_file
    if change is None:
        return
    if len(change) != 2 or change[0] == change[1]:
        yield Fault(
            ("recordings", "columns", "output_file"),
            f"found {list(change)!r}",
            "two different texts: what the name of the input's file has, and that of the "
            "output's file in its place",
            "write [CH1, CH2] or the like",
        )


def _clock(experiment: Experiment) -> Iterator[Fault]:
    options = experiment.recordings
    if options is None or options.columns.time is not None:
        return
    if options.sample_time_s is None:
        yield Fault(
            ("recordings", "sample_time_s"),
            "missing, and columns.time too",
            "one of them",
            "name the time column or give the sample time",
        )
    if options.columns.output_time is not None:
        yield Fault(
            ("recordings", "columns", "output_time"),
            f"found {options.columns.output_time!r}",
            "columns.time too, the clock of the input",
            "name it, or call this one time",
        )
    if options.resample:
        yield Fault(
            ("recordings", "resample"),
            "found true",
            "a time column to resample by",
            "name it in columns.time",
        )


def _units(experiment: Experiment) -> Iterator[Fault]:
    """Units of columns that nobody knows, or that another key contradicts."""
    options = experiment.recordings
    if options is None:
        return
    for role in ("time", "input", "output"):
        unit, place = getattr(options.units, role), ("recordings", "units", role)
        if unit is None or unit == AS_FILE or is_unitless(unit):
            continue
        if not quantity_of(unit) or (role == "time") != (quantity_of(unit) == "time"):
            expected = f"a unit such as {_EXAMPLES[role]}"
            if role == "time":
                yield wrong(place, unit, expected)
            else:
                step = f"correct it; what needs no conversion is recordings.{role}_unit"
                yield wrong(place, unit, expected, step)
        elif role == "time" and options.columns.time is None:
            yield wrong(
                place,
                unit,
                "recordings.columns.time too, because sample_time_s is in seconds",
                "name the column of time, or remove this key",
            )
        elif role != "time":
            yield from _unit_of_side(role, unit, options)


def _unit_of_side(role: str, unit: str, options: RecordingsOptions) -> Iterator[Fault]:
    place, label = ("recordings", "units", role), getattr(options, f"{role}_unit")
    if label is not None and factor_between(unit, label) is None:
        yield wrong(
            place,
            unit,
            f"a unit that goes into recordings.{role}_unit, {label!r}",
            "correct one of the two",
        )
    scale = getattr(options, f"{role}_scale")
    if abs(scale) != 1.0:
        yield wrong(
            ("recordings", f"{role}_scale"),
            scale,
            f"1 or -1 beside recordings.units.{role}, which converts already",
            "remove one of the two",
        )


def _range(experiment: Experiment) -> Iterator[Fault]:
    options = experiment.recordings
    if options is None or options.last_sample is None:
        return
    first = options.first_sample
    if options.last_sample <= first:
        expected = f"an integer > first_sample = {first}"
        yield wrong(("recordings", "last_sample"), options.last_sample, expected)


def _parts(experiment: Experiment) -> Iterator[Fault]:
    options = experiment.recordings
    if options is None:
        return
    for name, bounds in options.parts.items():
        place = ("recordings", "parts", name)
        if name_fault(name) or "+" in name:
            yield wrong(place, name, "a name of letters, digits, - and _")
        elif len(bounds) != 2 or not 0 <= bounds[0] < bounds[1]:
            yield wrong(
                place,
                bounds,
                "[first, last + 1]: two samples counted from 0, the second one larger",
            )


def _cut_or_parts(experiment: Experiment) -> Iterator[Fault]:
    options = experiment.recordings
    if options is None or not options.parts:
        return
    if options.first_sample != 0 or options.last_sample is not None:
        name = "first_sample" if options.first_sample else "last_sample"
        yield wrong(
            ("recordings", name),
            getattr(options, name),
            "no such key beside recordings.parts, which says what is used",
            "remove one of the two",
        )


def _pairs_of_orders(experiment: Experiment) -> Iterator[Fault]:
    options = experiment.orders
    pairs = len(options.nb) * len(options.nk)
    if pairs > MOST_PAIRS:
        yield Fault(
            ("orders",),
            f"found {len(options.nb)} values of nb and {len(options.nk)} of nk, "
            f"{pairs} pairs",
            f"at most {MOST_PAIRS}",
            "narrow the ranges, or list fewer values, as nb: [1, 2, 5, 10, 20]",
        )


def _delay_grid(experiment: Experiment) -> Iterator[Fault]:
    options = experiment.orders
    if options.nk_role == "delay" and options.nf is None:
        yield missing(("orders", "nf"), "the number of poles, because nk_role is delay")
    if options.nk_role != "delay" and options.nf is not None:
        yield wrong(
            ("orders", "nf"),
            options.nf,
            "no such key, because with nk_role poles the number of poles is nk",
            "remove it or set nk_role: delay",
        )
    if options.nk_role == "delay" and experiment.fit.delays:
        yield wrong(
            ("fit", "delays"),
            experiment.fit.delays,
            "none with orders.nk_role: delay, where the grid tries the delays",
            "remove one of the two",
        )


def _linear_block(experiment: Experiment) -> Iterator[Fault]:
    """A linear block that some fit of the grid can begin with, or keep."""
    block = experiment.fit.linear_block
    if block is None:
        return
    if block.frozen:
        yield from _frozen_block(block, experiment)
    else:
        yield from _contained_block(block, experiment)


def _frozen_block(block: LinearBlock, experiment: Experiment) -> Iterator[Fault]:
    """A frozen block must fill the grid, and its poles lie where they may."""
    grid = experiment.orders
    own, place = block.orders, ("fit", "linear_block")
    counts_poles = grid.nk_role == "poles"
    second = own.nf if counts_poles else own.nk
    other = ("delay", own.nk, 1) if counts_poles else ("poles", own.nf, grid.nf)
    word, found, wanted = other
    if (grid.nb, grid.nk) != ((own.nb,), (second,)):
        yield Fault(
            place,
            f"found a frozen block of {own.nb} numerator coefficients, {own.nf} poles "
            f"and delay {own.nk}",
            "the orders of the grid",
            f"set orders: {{nb: {own.nb}, nk: {second}}}",
        )
    elif found != wanted:
        yield Fault(
            place,
            f"found {word} {found}",
            f"{wanted} as in the grid of orders.nk_role: {grid.nk_role}",
            f"set orders: {{nb: {own.nb}, nf: {own.nf}, nk: {own.nk}, nk_role: delay}}",
        )
    radius = experiment.fit.largest_pole_radius
    if block.pole_radius >= radius:
        yield Fault(
            (*place, "denominator"),
            f"found a pole at radius {block.pole_radius:.4g}",
            f"all poles of a frozen block inside radius {radius:g}",
            "correct the coefficients, or set frozen: false, which draws them in",
        )


def _contained_block(block: LinearBlock, experiment: Experiment) -> Iterator[Fault]:
    """A block that is a start must be contained in some orders of the grid."""
    grid, own = experiment.orders, block.orders
    counts_poles = grid.nk_role == "poles"
    delays = experiment.fit.delays or ((1,) if counts_poles else grid.nk)
    n_poles = max(grid.nk) if counts_poles else grid.nf or 0
    if not any(Orders(max(grid.nb), n_poles, nk).contains(own) for nk in delays):
        yield Fault(
            ("fit", "linear_block"),
            f"found {own.nb} numerator coefficients, {own.nf} poles and delay "
            f"{own.nk}, which no orders of the grid contain",
            "a block of smaller or equal orders",
            "widen orders.nb and the poles, or leave the block out",
        )


def _keep(experiment: Experiment) -> Iterator[Fault]:
    if experiment.group is None:
        return
    keep, place = experiment.group.keep, ("group", "keep")
    if len(keep) != 1:
        yield wrong(place, keep, "exactly one of top, best, coverage_at_least")
        return
    ((rule, value),) = keep.items()
    if rule == "best":
        if value is not True:
            yield wrong((*place, rule), value, "true")
        return
    counts = value if isinstance(value, tuple) else (value,)
    is_count = [not isinstance(n, bool) and n >= 1 for n in counts]
    if not counts or not all(is_count):
        yield wrong((*place, rule), value, "an integer >= 1, or one for each level")


def _test(experiment: Experiment) -> Iterator[Fault]:
    held_out = _listed(experiment, "test", "recordings") or ()
    for section, name, what_it_does in _SEEN_BEFORE_TEST:
        both = sorted(set(held_out) & set(_listed(experiment, section, name) or ()))
        if both:
            yield Fault(
                ("test", "recordings"),
                f"{both[0]!r} {what_it_does} too ({section}.{name})",
                "recordings that are used nowhere else",
                "take it out of one of the two lists",
            )


# What a goal cannot do without.
_NEEDED_BY_GOAL = {"parameters": "identify", "diagnosis": "simulation"}


def _next(experiment: Experiment) -> Iterator[Fault]:
    options = experiment.next
    if options is None:
        return
    offers = (options.plan, options.limits)
    if offers.count(None) != 1:
        expected = "either plan (a table of recordings) or limits, to design them"
        if None in offers:
            yield missing(("next", "plan"), expected, "add one of them")
        else:
            yield wrong(
                ("next", "plan"), options.plan, expected, "take one of them out"
            )
    section = _NEEDED_BY_GOAL.get(options.goal)
    if section is not None and getattr(experiment, section) is None:
        expected = f"coverage, or a section {section}: for this goal"
        yield wrong(("next", "goal"), options.goal, expected, f"add {section}:")
    if options.output_range is not None:
        yield from _foreseen(experiment, options)


def _foreseen(experiment: Experiment, options: NextOptions) -> Iterator[Fault]:
    """What tells the output of an input that nobody has played."""
    place, found = ("next", "output_range"), list(options.output_range or ())
    if options.goal == "coverage" and experiment.identify is None:
        expected = "a model that foresees the output of an input"
        yield wrong(place, found, expected, "add identify:")
    if options.goal == "diagnosis" and getattr(
        experiment.simulation, "controller", None
    ):
        expected = "a drive without a controller, whose output an input alone decides"
        yield wrong(place, found, expected, "take it out")


def _listed(experiment: Experiment, section: str, name: str) -> tuple[str, ...] | None:
    return getattr(getattr(experiment, section), name, None)


_GRID = "orders fit.delays fit.largest_pole_radius"
_AGREEMENTS = (
    _Agreement(_name, "name"),
    _Agreement(_columns, "recordings.columns"),
    _Agreement(_output_file, "recordings.columns.output_file"),
    _Agreement(_clock, "recordings.columns.time recordings.sample_time_s"),
    _Agreement(
        _units,
        "recordings.units recordings.columns.time recordings.input_unit "
        "recordings.output_unit recordings.input_scale recordings.output_scale",
    ),
    _Agreement(_range, "recordings.first_sample recordings.last_sample"),
    _Agreement(_parts, "recordings.parts"),
    _Agreement(_cut_or_parts, "recordings.first_sample recordings.last_sample"),
    _Agreement(_pairs_of_orders, "orders.nb orders.nk"),
    _Agreement(_delay_grid, "orders.nk_role orders.nf fit.delays"),
    _Agreement(_linear_block, f"{_GRID} fit.linear_block"),
    _Agreement(_keep, "group.keep"),
    _Agreement(circuit_faults, "simulation.resistance_ohm"),
    _Agreement(controller_faults, "simulation.controller recordings.columns.reference"),
    _Agreement(cascade_faults, "simulation.controller simulation.output"),
    _Agreement(effect_faults, "simulation.effects own_effects"),
    _Agreement(own_effect_faults, "own_effects simulation.resistance_ohm"),
    _Agreement(effect_circuit_faults, "simulation.effects simulation.resistance_ohm"),
    _Agreement(known_faults, "simulation.known"),
    _Agreement(simulated_faults, "simulation recordings.columns.simulated"),
    _Agreement(simulation_faults, "simulation"),
    _Agreement(named_effect_faults, "diagnose.effects own_effects"),
    _Agreement(held_out_faults, "diagnose.recordings diagnose.hold_out"),
    _Agreement(_test, "test identify crossval group"),
    _Agreement(_next, "next identify simulation"),
)
