"""What the terms of a law are in the catalogue.

docs/method_diagnosis.md, eq. (D37).
"""

import re
from collections.abc import Collection, Mapping

from hwid_cli.records.diagnosis import Law

# What terms are in the catalogue, by their kinds; a wave has two parts.
_EFFECTS: Mapping[frozenset[str], str] = {
    frozenset({"sign(v)"}): "coulomb_friction",
    frozenset({"v*abs(v)"}): "quadratic_drag",
    frozenset({"x**3"}): "cubic_stiffness",
    frozenset({"x**2"}): "quadratic_stiffness",
    frozenset({"sign(x)"}): "spring_preload",
    frozenset({"Max(x - a, 0)"}): "one_sided_stop",
    frozenset({"Max(-x - a, 0)"}): "one_sided_stop",
    frozenset({"Max(abs(x) - a, 0)*sign(x)"}): "end_stop",
    frozenset({"u*abs(u)"}): "supply_sag",
    frozenset({"u**3"}): "force_constant_saturation",
    frozenset({"sin(2*pi*x/l)", "cos(2*pi*x/l)"}): "cogging",
    frozenset({"sin(2*pi*x/l)"}): "cogging",
    frozenset({"sin(2*pi*f*t)", "cos(2*pi*f*t)"}): "periodic_force",
    frozenset({"sin(2*pi*f*t)"}): "periodic_force",
    frozenset({"sign(v)", "abs(x)*sign(v)"}): "load_friction:spring",
    frozenset({"sign(v)", "abs(u)*sign(v)"}): "load_friction:drive",
}  # fmt: skip
_OF_READING: Mapping[frozenset[str], str] = {
    frozenset({"x**2"}): "sensor_quadratic",
    frozenset({"x**3"}): "sensor_cubic",
    frozenset({"t"}): "sensor_drift",
}


# Terms that are an effect beside others too: forces against the motion.
_AGAINST_MOTION = ("sign(v)", "v*abs(v)")
# Where they come back in this share of resampled recordings, and beside no other term of
# the velocity alone: friction and a drag of another exponent make up for each other.
_LEAST_INCLUSION = 0.9
_VARIABLE = re.compile(r"\b[xvut]\b")


def known_terms(law: Law) -> dict[str, str]:
    """Terms of a law that are effects of the catalogue by themselves.

    Returns
    -------
    dict of str to str
        Ids of the effects by the terms with their coefficients.
    """
    of_velocity = {
        one.term for one in law.terms if set(_VARIABLE.findall(one.term)) == {"v"}
    }
    is_alone = of_velocity <= set(_AGAINST_MOTION)
    if law.acts_on != "force" or not is_alone:
        return {}
    return {
        f"{one.value:.4g}*{one.term}": _EFFECTS[frozenset({one.term})]
        for one in law.terms
        if one.term in _AGAINST_MOTION
        and one.high < 0
        and one.inclusion >= _LEAST_INCLUSION
    }


def effects_of(terms: Collection[str], acts_on: str) -> tuple[str, ...]:
    """Effects of the catalogue that the terms of a law are.

    Parameters
    ----------
    terms : collection of str
        Formulas, with names for their periods and thresholds.
    acts_on : str
        ``force``, ``input`` or ``output``.

    Returns
    -------
    tuple of str
        Ids; empty where some terms are no effect.
    """
    left = set(terms)
    known = _OF_READING if acts_on == "output" else _EFFECTS
    found = []
    for kinds, effect in sorted(known.items(), key=lambda item: -len(item[0])):
        if kinds <= left:
            found.append(effect)
            left -= kinds
    return () if left else tuple(sorted(found))
