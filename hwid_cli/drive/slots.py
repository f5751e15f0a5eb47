"""Places of the parameters in the vector that the compiled loops read.

Effects name the places that they fill in their declarations; ``make drive-source`` puts
those that are not here yet at the end, so that the others keep their numbers. A parameter
that is switched off is 0, except where the comment says infinite.
"""

(
    MASS,
    DAMPING,
    STIFFNESS,
    FORCE_CONSTANT,
    FRICTION_FORWARD,
    FRICTION_BACKWARD,
    STATIC_EXCESS,
    STRIBECK_VELOCITY,
    HYSTERESIS_FORCE,
    HYSTERESIS_YIELD,
    DRAG,
    CUBIC,
    QUADRATIC,
    STOP_POSITION,
    STOP_STIFFNESS,
    SIDE_POSITION,
    SIDE_STIFFNESS,
    SPRING_GAP,
    GEAR_GAP,
    GEAR_STIFFNESS,
    GEAR_DAMPING_RATIO,
    GEAR_DAMPING,  # set by the simulation: of the teeth, in contact
    MOTOR_SHARE,
    MOTOR_DAMPING_SHARE,
    MOTOR_DAMPING,  # set by the simulation: of the damping, beside a motor of its own
    OUTPUT_GAP,
    MODE_MASS,
    MODE_STIFFNESS,
    MODE_DAMPING,
    COGGING_FORCE,
    COGGING_PERIOD,
    COGGING_PHASE,
    COGGING_ABOUT_MEAN,  # 1 where its mean along the way is zero
    COGGING_ORIGIN,  # set by the simulation: where the drive rests without current
    COGGING_REST,  # set by the simulation: sine of the phase
    LOAD,
    DEAD_ZONE,
    SATURATION,  # infinite
    RATE,  # infinite
    DELAY,
    LAG,
    SATURATION_LOSS,
    SAG_LOSS,
    THERMAL_LOSS,
    THERMAL_TIME,
    REFERENCE_CURRENT,
    CLIP_LIMIT,  # infinite
    CLIP_SLOPE,
    SENSOR_QUADRATIC,
    SENSOR_CUBIC,
    SENSOR_DRIFT,
    REFERENCE_DISPLACEMENT,
    PERIODIC_FORCE,
    PERIODIC_FREQUENCY,
    PERIODIC_PHASE,
    RESISTANCE,
    INDUCTANCE,
    BACK_EMF,
    POSITION_GAIN,
    VELOCITY_GAIN,
    COMMAND_LIMIT,  # infinite
    ZERO_ORDER_HOLD,
    START_POSITION,  # used where nothing holds a position, or where it is estimated
    START_VELOCITY,
    START_CURRENT,  # beyond what rests there: of a lag's output, or in the winding
    IS_START_GIVEN,
    OUTPUT_ZERO,  # position at which the sensor reads 0
    IS_COUPLED,  # set by the simulation: the teeth are an elastic coupling
    COUPLING_STIFFNESS,
    COUPLING_SHARE,
    COUPLING_DAMPING_RATIO,
    COUPLING_DAMPING_SHARE,
    SENSOR_AT_MOTOR,
    OUTPUT_LIMIT,  # infinite
    HUM_AMPLITUDE,
    HUM_FREQUENCY,
    HUM_PHASE,
    ECCENTRICITY,
    ECCENTRIC_PERIOD,
    ECCENTRIC_PHASE,
    CLOCK_GAIN,  # of the output, over the input's clock
    OUTPUT_IS_VELOCITY,
    RESET_RATE,
    PROPORTIONAL_GAIN,
    INTEGRAL_GAIN,
    DERIVATIVE_GAIN,
    # Set by the simulation: what it has of what few drives have.
    HAS_MORE,  # a force on the mass
    HAS_FURTHER_EDGES,  # a further corner of a force
    HAS_ZERO_EDGE,  # a force with a corner at 0
    HAS_CONTACT,  # a stop whose force is curved
    HAS_SHAPE,  # a hysteresis of another shape than Dahl's
    DRIVE_VARIES,  # a force of the motor that varies, or friction that follows it
    CAPTURE_TIME,  # a preload catches a drive at 0 that it would stop within it
    SPRING_SHARE,
    DRIVE_SHARE,
    WAVY_PERIOD,
    WAVY_PHASE,
    WAVY_FRICTION,
    PRELOAD,
    STOP_LOSS,
    STOP_BEND,
    SIDE_LOSS,
    SIDE_BEND,
    SECOND_POSITION,
    SECOND_STIFFNESS,
    SECOND_LOSS,
    SECOND_BEND,
    SECOND_COGGING_FORCE,
    SECOND_COGGING_PERIOD,
    SECOND_COGGING_PHASE,
    GRAVITY_TORQUE,
    GRAVITY_ANGLE,
    GRAVITY_IS_SETTLED,  # 1 where it counts from the start
    GRAVITY_REST,  # set by the simulation: what has settled at the start
    RIPPLE_SHARE,
    RIPPLE_PER_TURN,
    RIPPLE_PHASE,
    HYSTERESIS_RATIO,
    HYSTERESIS_BEND,
    # Formulas of the user's own stand behind the places; 0 for none.
    OWN_PILE,  # room to work in
    OWN_FORCE,  # where the formula begins
    OWN_INPUT,
    OWN_OUTPUT,
    OWN_FRICTION,  # set: the force jumps with the direction of motion
    OWN_WAVES,  # fastest turn of the force along the way, [rad/m]
    OWN_TURNING,  # and in time, [rad/s]
    OWN_FINENESS,  # steps in a sample, at least
    OWN_JUMPS,  # where the formula begins that tells the sides of jumps; 0: anywhere
    OWN_BENDS,  # set: the force has corners
    SAMPLE_TIME,  # set by the simulation
    LAG_DAMPING_RATIO,
    SENSOR_LAG,
    HAS_BRISTLES,  # set by the simulation: a hysteresis whose level falls with the speed
    BRISTLE_VELOCITY,
    BRISTLE_DAMPING,
    BRISTLE_EXCESS,
    SENSOR_LAG_DAMPING_RATIO,
    IRON,  # how far iron is driven at the reference current
    IS_STRIBECK_EXPONENTIAL,  # 1 where the excess falls as exp(-|v| / vs)
    STOP_DASHPOT,
    SIDE_DASHPOT,
    SECOND_DASHPOT,
    LOOP_RESET,  # rate at which what drives beside the spring is summed up
    GEAR_START,
    OUTPUT_START,
    START_WARMTH,
    START_COMMAND,  # what a controller's sum has gathered before
    N_SLOTS,
) = range(148)
