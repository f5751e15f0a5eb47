"""Compare a diagnosis with the truth; one flat record per case."""

import math

from tests.blind.effects import CATALOGUE

# Effects that a reader would look for in the same place of the drive.
FAMILIES = {
    "friction": (
        "coulomb_friction",
        "asymmetric_friction",
        "stribeck_friction",
        "hysteresis",
        "quadratic_drag",
    ),
    "spring": (
        "cubic_stiffness",
        "quadratic_stiffness",
        "end_stop",
        "one_sided_stop",
        "spring_gap",
        "cogging",
        "constant_load",
    ),
    "play": ("gear_backlash", "output_backlash"),
    "current": ("input_dead_zone", "input_saturation", "rate_limit", "voltage_limit"),
    "timing": ("input_delay", "actuator_lag"),
    "force constant": ("force_constant_saturation", "supply_sag", "thermal_gain_loss"),
    "sensor": ("sensor_quadratic", "sensor_cubic", "sensor_drift"),
    "second mass": ("second_mode",),
    "disturbance": ("periodic_force",),
    "change": ("parameter_change",),
}
FAMILY_OF = {effect: name for name, ids in FAMILIES.items() for effect in ids}
# Drawn for the machine, but not among the parameters that a diagnosis must report.
NOT_REPORTED = {"motor_share", "contact_damping_ratio", "phase", "which"}
# Laws whose size is counted at the largest reading: the power with which the number
# grows with that reading.
_POWERS_OF_CURRENT = {
    "force_constant_saturation": 2,
    "supply_sag": 1,
    "thermal_gain_loss": 2,
}
_POWERS_OF_DISPLACEMENT = {"sensor_quadratic": 1, "sensor_cubic": 2}


def score(truth, diagnosis):
    """How a diagnosis did; ``diagnosis`` is None where the program failed."""
    hidden = [one["id"] for one in truth["effects"]]
    found = diagnosis or {}
    named = [one["id"] for one in found.get("effects", [])]
    outcome = {
        "case": truth["case"],
        "suite": truth["suite"],
        "plan": truth["plan"],
        "nuisance": truth["nuisance"],
        "hidden": hidden,
        "noise_percent": truth["noise_percent"],
        "gap_share": truth["gap"]["share_of_motion"],
        "gap_to_noise": truth["gap"]["to_noise"],
        "verdict": found.get("verdict", "failed"),
        "complete": found.get("complete"),
        "named": sorted(named),
        "ambiguous_with": found.get("ambiguous_with", []),
        "result": result_of(truth, diagnosis),
        "family_right": _family_right(truth, found, named),
        "errors": {},
        "covered": {},
        "seconds": found.get("seconds"),
    }
    if diagnosis is not None:
        outcome |= _gaps(found["gap"], truth["noise_sigma_m"])
        if outcome["result"] == "right" and set(hidden) <= set(CATALOGUE):
            outcome["errors"], outcome["covered"] = parameter_errors(truth, found)
    return outcome


def result_of(truth, diagnosis):
    """``right``, ``wrong``, ``ambiguous`` (truth among the candidates), ``refused``.

    Where nothing of the catalogue is hidden, every name is wrong and the honest answer is
    right: ``parameters`` or ``none`` without a cause, anything but a name with one.
    """
    if diagnosis is None:
        return "failed"
    verdict = diagnosis["verdict"]
    acceptable = [frozenset(one) for one in truth["acceptable"]]
    named = frozenset(one["id"] for one in diagnosis["effects"])
    if verdict == "named":
        return "right" if named in acceptable else "wrong"
    if not truth["effects"]:
        has_no_gap = verdict in {"parameters", "none"}
        return "right" if has_no_gap or truth["nuisance"] else "refused"
    if not acceptable:
        return "right"
    if verdict == "ambiguous":
        sets = {named} | {
            frozenset([one] if isinstance(one, str) else one)
            for one in diagnosis["ambiguous_with"]
        }
        return "ambiguous" if sets & set(acceptable) else "refused"
    return "refused"


def _family_right(truth, found, named):
    if found.get("verdict") != "named":
        return False
    families = sorted(FAMILY_OF.get(one, one) for one in named)
    return any(
        families == sorted(FAMILY_OF.get(one, one) for one in names)
        for names in truth["acceptable"]
    )


def _gaps(gap, sigma_m):
    """Held-out gap before and after, against the noise that was really added."""
    before = gap["before"]["held_out_rms"]
    after = gap["after"]["held_out_rms"]
    excess = before**2 - sigma_m**2
    return {
        "before_to_noise": before / sigma_m,
        "after_to_noise": after / sigma_m,
        "closed": 1 - (after**2 - sigma_m**2) / excess if excess > 0 else None,
        "noise_found": gap["noise_rms"] / sigma_m,
    }


def parameter_errors(truth, diagnosis):
    """Relative error of every reported parameter, and whether its interval covers."""
    errors, covered = {}, {}
    reported = {one["id"]: one["parameters"] for one in diagnosis["effects"]}
    for one in truth["effects"]:
        values = expected(one["id"], one["parameters"], truth, diagnosis)
        for name, value in values.items():
            key = f"{one['id']}.{name}"
            entry = reported[one["id"]].get(name)
            if not isinstance(entry, dict) or not _is_number(entry.get("value")):
                errors[key] = math.inf
                continue
            errors[key] = abs(entry["value"] / value - 1)
            if entry.get("ci95"):
                low, high = entry["ci95"]
                covered[key] = bool(low <= value <= high)
        if one["id"] == "parameter_change":
            which = str(reported[one["id"]].get("which"))
            right = one["parameters"]["which"] in which
            errors["parameter_change.which"] = 0.0 if right else math.inf
    return errors, covered


def expected(effect, parameters, truth, diagnosis):
    """The values that a diagnosis should report.

    Sizes at the largest reading are counted at the largest one in the recordings that
    the program trained on, the spread of a parameter over the same recordings.
    """
    train = [
        truth["recordings"][name]
        for name in diagnosis["recordings"]["train"]
        if name in truth["recordings"]
    ] or list(truth["recordings"].values())
    values = {k: v for k, v in parameters.items() if k not in NOT_REPORTED}
    if effect in _POWERS_OF_CURRENT:
        largest = max(one["largest_A"] for one in train)
        scale = (largest / truth["reference_A"]) ** _POWERS_OF_CURRENT[effect]
        values["loss_at_reference"] *= scale
    if effect in _POWERS_OF_DISPLACEMENT:
        largest = max(one["largest_m"] for one in train)
        scale = (largest / truth["reference_m"]) ** _POWERS_OF_DISPLACEMENT[effect]
        values["coefficient"] *= scale
    if effect == "parameter_change":
        factors = [one["factor"] for one in train]
        mean = sum(factors) / len(factors)
        square = sum((one - mean) ** 2 for one in factors) / len(factors)
        values["spread"] = math.sqrt(square) / mean
    return values


def _is_number(value):
    return isinstance(value, int | float) and math.isfinite(value)
