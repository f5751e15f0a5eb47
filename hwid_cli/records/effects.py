"""Names of the effects that a drive's simulation may hold, and of their parameters."""

# Every parameter that an effect has to state; the law of each is in docs/effects.md.
EFFECT_PARAMETERS: dict[str, tuple[str, ...]] = {
    "coulomb_friction": ("force_N",),
    "asymmetric_friction": ("force_forward_N", "force_backward_N"),
    "stribeck_friction": ("force_N", "static_excess_N", "velocity_m_per_s"),
    "hysteresis": ("force_N", "yield_m"),
    "quadratic_drag": ("drag_N_s2_per_m2",),
    "cubic_stiffness": ("stiffness_N_per_m3",),
    "quadratic_stiffness": ("stiffness_N_per_m2",),
    "end_stop": ("position_m", "stiffness_N_per_m"),
    "one_sided_stop": ("position_m", "stiffness_N_per_m"),
    "spring_gap": ("half_gap_m",),
    "gear_backlash": ("half_gap_m", "stiffness_N_per_m"),
    "output_backlash": ("half_gap_m",),
    "second_mode": ("mass_kg", "frequency_Hz", "damping_ratio"),
    "cogging": ("amplitude_N", "period_m"),
    "constant_load": ("force_N",),
    "input_dead_zone": ("threshold_A",),
    "input_saturation": ("limit_A",),
    "rate_limit": ("rate_A_per_s",),
    "input_delay": ("delay_s",),
    "actuator_lag": ("time_constant_s",),
    "force_constant_saturation": ("loss_at_reference",),
    "supply_sag": ("loss_at_reference",),
    "thermal_gain_loss": ("loss_at_reference", "time_constant_s"),
    "voltage_limit": ("limit_A", "slope_A_s_per_m"),
    "sensor_quadratic": ("coefficient",),
    "sensor_cubic": ("coefficient",),
    "sensor_drift": ("drift_m_per_s",),
    "periodic_force": ("amplitude_N", "frequency_Hz"),
    "parameter_change": ("which", "spread"),
}
# What an effect may state beyond that; 0, or half of the mass, where it does not.
OPTIONAL_PARAMETERS: dict[str, tuple[str, ...]] = {
    "cogging": ("phase_rad",),
    "periodic_force": ("phase_rad",),
    "gear_backlash": ("motor_share",),
}
# Parameters that a law divides by, or that have no meaning at 0 or below.
POSITIVE_PARAMETERS: dict[str, tuple[str, ...]] = {
    "stribeck_friction": ("velocity_m_per_s",),
    "hysteresis": ("yield_m",),
    "end_stop": ("position_m",),
    "spring_gap": ("half_gap_m",),
    "gear_backlash": ("half_gap_m", "stiffness_N_per_m", "motor_share"),
    "output_backlash": ("half_gap_m",),
    "second_mode": ("mass_kg", "frequency_Hz"),
    "cogging": ("period_m",),
    "input_dead_zone": ("threshold_A",),
    "input_saturation": ("limit_A",),
    "rate_limit": ("rate_A_per_s",),
    "input_delay": ("delay_s",),
    "actuator_lag": ("time_constant_s",),
    "thermal_gain_loss": ("time_constant_s",),
    "voltage_limit": ("limit_A",),
    "periodic_force": ("frequency_Hz",),
}
# Parameters that only switch their law off at 0.
NOT_NEGATIVE_PARAMETERS: dict[str, tuple[str, ...]] = {
    "coulomb_friction": ("force_N",),
    "asymmetric_friction": ("force_forward_N", "force_backward_N"),
    "stribeck_friction": ("force_N",),
    "hysteresis": ("force_N",),
    "end_stop": ("stiffness_N_per_m",),
    "one_sided_stop": ("stiffness_N_per_m",),
    "second_mode": ("damping_ratio",),
    "voltage_limit": ("slope_A_s_per_m",),
    "parameter_change": ("spread",),
}
# Parameters that are a word and no number.
WORD_PARAMETERS: dict[str, tuple[str, ...]] = {"parameter_change": ("which",)}
