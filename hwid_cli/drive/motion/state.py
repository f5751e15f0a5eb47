"""Places in what the compiled loops carry from step to step."""

# State: mass, motor, appendage, current of the circuit.
X, V, MOTOR_X, MOTOR_V, PART_X, PART_V, CIRCUIT, N_STATE = range(8)
# Memory: direction of sliding (0 at rest), position and deflection at the last reversal,
# current after the lag, temperature, side of a preload (0 held at 0), rate of a
# second-order lag, and how far bristles yield at the speed of the last step.
(
    WAY, TURNED_AT, DEFLECTION, LAGGED, HEAT, SIDE, LAG_RATE, LEVEL, N_MEMORY,
) = range(9)  # fmt: skip
