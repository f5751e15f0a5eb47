"""Places in what the compiled loops carry from step to step."""

# State: mass, motor, appendage, current of the circuit.
X, V, MOTOR_X, MOTOR_V, PART_X, PART_V, CIRCUIT, N_STATE = range(8)
# Memory: direction of sliding (0 at rest), position and deflection at the last reversal,
# current after the lag, temperature, side of a preload (0 held at 0), rate of a
# second-order lag, how far bristles yield at the speed of the last step, and on which
# side the drive touches stops with a dashpot.
(
    WAY, TURNED_AT, DEFLECTION, LAGGED, HEAT, SIDE, LAG_RATE, LEVEL,
    IN_STOP, IN_SIDE, IN_SECOND, N_MEMORY,
) = range(12)  # fmt: skip
