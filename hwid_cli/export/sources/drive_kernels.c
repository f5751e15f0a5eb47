/* Forces and steps of the drive: the loops of hwid's own simulation, translated. */

enum {
    MASS = 0,
    DAMPING = 1,
    STIFFNESS = 2,
    FORCE_CONSTANT = 3,
    FRICTION_FORWARD = 4,
    FRICTION_BACKWARD = 5,
    STATIC_EXCESS = 6,
    STRIBECK_VELOCITY = 7,
    HYSTERESIS_FORCE = 8,
    HYSTERESIS_YIELD = 9,
    DRAG = 10,
    CUBIC = 11,
    QUADRATIC = 12,
    STOP_POSITION = 13,
    STOP_STIFFNESS = 14,
    SIDE_POSITION = 15,
    SIDE_STIFFNESS = 16,
    SPRING_GAP = 17,
    GEAR_GAP = 18,
    GEAR_STIFFNESS = 19,
    GEAR_DAMPING_RATIO = 20,
    GEAR_DAMPING = 21,
    MOTOR_SHARE = 22,
    MOTOR_DAMPING_SHARE = 23,
    MOTOR_DAMPING = 24,
    OUTPUT_GAP = 25,
    MODE_MASS = 26,
    MODE_STIFFNESS = 27,
    MODE_DAMPING = 28,
    COGGING_FORCE = 29,
    COGGING_PERIOD = 30,
    COGGING_PHASE = 31,
    COGGING_ABOUT_MEAN = 32,
    COGGING_ORIGIN = 33,
    COGGING_REST = 34,
    LOAD = 35,
    DEAD_ZONE = 36,
    SATURATION = 37,
    RATE = 38,
    DELAY = 39,
    LAG = 40,
    SATURATION_LOSS = 41,
    SAG_LOSS = 42,
    THERMAL_LOSS = 43,
    THERMAL_TIME = 44,
    REFERENCE_CURRENT = 45,
    CLIP_LIMIT = 46,
    CLIP_SLOPE = 47,
    SENSOR_QUADRATIC = 48,
    SENSOR_CUBIC = 49,
    SENSOR_DRIFT = 50,
    REFERENCE_DISPLACEMENT = 51,
    PERIODIC_FORCE = 52,
    PERIODIC_FREQUENCY = 53,
    PERIODIC_PHASE = 54,
    RESISTANCE = 55,
    INDUCTANCE = 56,
    BACK_EMF = 57,
    POSITION_GAIN = 58,
    VELOCITY_GAIN = 59,
    COMMAND_LIMIT = 60,
    ZERO_ORDER_HOLD = 61,
    START_POSITION = 62,
    START_VELOCITY = 63,
    START_CURRENT = 64,
    IS_START_GIVEN = 65,
    OUTPUT_ZERO = 66,
    IS_COUPLED = 67,
    COUPLING_STIFFNESS = 68,
    COUPLING_SHARE = 69,
    COUPLING_DAMPING_RATIO = 70,
    COUPLING_DAMPING_SHARE = 71,
    SENSOR_AT_MOTOR = 72,
    OUTPUT_LIMIT = 73,
    HUM_AMPLITUDE = 74,
    HUM_FREQUENCY = 75,
    HUM_PHASE = 76,
    ECCENTRICITY = 77,
    ECCENTRIC_PERIOD = 78,
    ECCENTRIC_PHASE = 79,
    CLOCK_GAIN = 80,
    OUTPUT_IS_VELOCITY = 81,
    RESET_RATE = 82,
    PROPORTIONAL_GAIN = 83,
    INTEGRAL_GAIN = 84,
    DERIVATIVE_GAIN = 85,
    HAS_MORE = 86,
    HAS_FURTHER_EDGES = 87,
    HAS_ZERO_EDGE = 88,
    HAS_CONTACT = 89,
    HAS_SHAPE = 90,
    DRIVE_VARIES = 91,
    CAPTURE_TIME = 92,
    SPRING_SHARE = 93,
    DRIVE_SHARE = 94,
    WAVY_PERIOD = 95,
    WAVY_PHASE = 96,
    WAVY_FRICTION = 97,
    PRELOAD = 98,
    STOP_LOSS = 99,
    STOP_BEND = 100,
    SIDE_LOSS = 101,
    SIDE_BEND = 102,
    SECOND_POSITION = 103,
    SECOND_STIFFNESS = 104,
    SECOND_LOSS = 105,
    SECOND_BEND = 106,
    SECOND_COGGING_FORCE = 107,
    SECOND_COGGING_PERIOD = 108,
    SECOND_COGGING_PHASE = 109,
    GRAVITY_TORQUE = 110,
    GRAVITY_ANGLE = 111,
    GRAVITY_IS_SETTLED = 112,
    GRAVITY_REST = 113,
    RIPPLE_SHARE = 114,
    RIPPLE_PER_TURN = 115,
    RIPPLE_PHASE = 116,
    HYSTERESIS_RATIO = 117,
    HYSTERESIS_BEND = 118,
    OWN_PILE = 119,
    OWN_FORCE = 120,
    OWN_INPUT = 121,
    OWN_OUTPUT = 122,
    OWN_FRICTION = 123,
    OWN_WAVES = 124,
    OWN_TURNING = 125,
    OWN_FINENESS = 126,
    OWN_JUMPS = 127,
    OWN_BENDS = 128,
    SAMPLE_TIME = 129,
    LAG_DAMPING_RATIO = 130,
    SENSOR_LAG = 131,
    HAS_BRISTLES = 132,
    BRISTLE_VELOCITY = 133,
    BRISTLE_DAMPING = 134,
    BRISTLE_EXCESS = 135,
    SENSOR_LAG_DAMPING_RATIO = 136,
    IRON = 137,
    IS_STRIBECK_EXPONENTIAL = 138,
    STOP_DASHPOT = 139,
    SIDE_DASHPOT = 140,
    SECOND_DASHPOT = 141,
    LOOP_RESET = 142,
    GEAR_START = 143,
    OUTPUT_START = 144,
    START_WARMTH = 145,
    START_COMMAND = 146,
    N_SLOTS = 147,
    CONSTANT = 0,
    VARIABLE = 1,
    ADD = 2,
    SUBTRACT = 3,
    MULTIPLY = 4,
    DIVIDE = 5,
    POWER = 6,
    MAX = 7,
    MIN = 8,
    NEGATE = 9,
    SQUARE = 10,
    CUBE = 11,
    ABS = 12,
    SIGN = 13,
    HEAVISIDE = 14,
    SIN = 15,
    COS = 16,
    EXP = 17,
    LOG = 18,
    SQRT = 19,
    TAN = 20,
    ATAN = 21,
    SINH = 22,
    COSH = 23,
    TANH = 24,
    MOST_PIECES = 80,
    OWN_PIECES = 4,
    DRIVE = 0,
    OTHER = 4,
    WARMTH = 8,
    COMMAND = 9,
    COMMAND_RATE = 10,
    BEGUN = 11,
    N_PUSH = 12,
    N_ROOM = 23,
    ERROR_SUM = 0,
    LAST_ERROR = 1,
    HAS_ERROR = 2,
    LAST_X = 3,
    LAST_V = 4,
    LATE_X = 5,
    LATE_V = 6,
    PACE_X = 7,
    PACE_V = 8,
    N_CONTROL = 9,
    X = 0,
    V = 1,
    MOTOR_X = 2,
    MOTOR_V = 3,
    PART_X = 4,
    PART_V = 5,
    CIRCUIT = 6,
    N_STATE = 7,
    WAY = 0,
    TURNED_AT = 1,
    DEFLECTION = 2,
    LAGGED = 3,
    HEAT = 4,
    SIDE = 5,
    LAG_RATE = 6,
    LEVEL = 7,
    IN_STOP = 8,
    IN_SIDE = 9,
    IN_SECOND = 10,
    N_MEMORY = 11,
    MOST_TRIES = 120,
    NARROWING = 90,
    MOST_TURNS = 60,
    JUMP_POINTS = 2,
    OFFSET = 0,
    STEADY = 1,
    DRIVEN = 2,
    OTHERS = 6,
    N_INPUT = 9,
    N_COLUMNS = 17,
    FILLED = 16,
    N_TERMS = 20,
    FEW_TERMS = 12,
    LOCATING = 40,
    LEAVING = 0,
    REVERSAL = 1,
    EDGE = 2,
    _CONSTANT = 8,
    _SLOPE = 13,
    _BEND = 14,
    LENGTH = 0,
    SAMPLE = 1,
    FAR_FROM_LIMIT = 4,
    MOST_STEPS = 400,
    N_PIECE = 2,
    HALVINGS = 6,
    MANY_PIECES = 1000,
    MOST_EVENTS = 100
};

static const double half_weights[5] = {
    0.11846344252809464, 0.23931433524968315, 0.28444444444444433, 0.23931433524968315, 0.11846344252809464
};

static const double parts[20] = {
    1.0, 0.5, 0.3333333333333333, 0.25, 0.2, 0.16666666666666666, 0.14285714285714285, 0.125, 0.1111111111111111, 0.1, 0.09090909090909091, 0.08333333333333333, 0.07692307692307693, 0.07142857142857142, 0.06666666666666667, 0.0625, 0.058823529411764705, 0.05555555555555555, 0.05263157894736842, 0.05
};

static const double project[5][4] = {
    {1.2894120331738688, -8.230364182785971, 15.064857622504128, -8.309542827016658},
    {-0.15116237607962646, 8.084413237314822, -21.4431693953228, 13.983972897784664},
    {-0.42666666666666647, 4.266666666666665, -4.266666666666665, 0.0},
    {0.47405436369705767, -7.149993140023212, 20.508749298031194, -13.983972897784664},
    {-0.1856373541246325, 3.0292774188276894, -9.863770858545848, 8.309542827016658}
};

static const double shares[5] = {
    0.04691007703066802, 0.23076534494715845, 0.5, 0.7692346550528415, 0.9530899229693319
};

typedef struct { double m0; double m1; } tuple_dd;

typedef struct { double m0; double m1; double m2; } tuple_ddd;

typedef struct { double m0; double m1; double m2; double m3; } tuple_dddd;

typedef struct { int m0; double m1; } tuple_id;

typedef struct { int m0; double m1; double m2; double m3; double m4; double m5; } tuple_iddddd;

typedef struct { int m0; int m1; int m2; int m3; int m4; double m5; } tuple_iiiiid;

static double least(double a, double b)
{
    return b < a ? b : a;
}

static double most(double a, double b)
{
    return b > a ? b : a;
}

static double sign_of(double a)
{
    return a > 0.0 ? 1.0 : (a < 0.0 ? -1.0 : a);
}

static double drive_variable(int which, double x, double v, double u, double t, double way, double *p)
{
    if (which == 0) {
        return x;
    }
    if (which == 1) {
        return v;
    }
    if (which == 2) {
        return u;
    }
    if (which == 3) {
        return t;
    }
    return (which == 4) ? way : p[FORCE_CONSTANT];
}

static double drive_curved(int step, double a)
{
    if (step == EXP) {
        return exp(a);
    }
    if (step == LOG) {
        return log(a);
    }
    if (step == SQRT) {
        return sqrt(a);
    }
    if (step == TAN) {
        return tan(a);
    }
    if (step == ATAN) {
        return atan(a);
    }
    if (step == SINH) {
        return sinh(a);
    }
    return (step == COSH) ? cosh(a) : tanh(a);
}

static double drive_changed(int step, double a)
{
    if (step == NEGATE) {
        return -a;
    }
    if (step == SQUARE) {
        return a * a;
    }
    if (step == CUBE) {
        return (a * a) * a;
    }
    if (step == ABS) {
        return fabs(a);
    }
    if (step == SIGN) {
        return sign_of(a);
    }
    if (step == HEAVISIDE) {
        return 0.5 + (0.5 * sign_of(a));
    }
    if (step == SIN) {
        return sin(a);
    }
    if (step == COS) {
        return cos(a);
    }
    return drive_curved(step, a);
}

static double drive_combined(int step, double a, double b)
{
    if (step == ADD) {
        return a + b;
    }
    if (step == SUBTRACT) {
        return a - b;
    }
    if (step == MULTIPLY) {
        return a * b;
    }
    if (step == DIVIDE) {
        return a / b;
    }
    if (step == POWER) {
        return pow(a, b);
    }
    return (step == MAX) ? most(a, b) : least(a, b);
}

static double drive_formula_value(double at, double x, double v, double u, double t, double way, double *p)
{
    int start = 0;
    int bottom = 0;
    int top = 0;
    int n = 0;
    int step = 0;
    double number = 0.0;
    start = (int)(at);
    bottom = (int)(p[OWN_PILE]);
    top = bottom - 1;
    for (n = 0; n < (int)(p[start]); ++n) {
        step = (int)(p[(start + 1) + (2 * n)]);
        number = p[(start + 2) + (2 * n)];
        if (step == CONSTANT) {
            top += 1;
            p[top] = number;
        } else {
            if (step == VARIABLE) {
                top += 1;
                p[top] = drive_variable((int)(number), x, v, u, t, way, p);
            } else {
                if (step >= NEGATE) {
                    p[top] = drive_changed(step, p[top]);
                } else {
                    top -= 1;
                    p[top] = drive_combined(step, p[top], p[top + 1]);
                }
            }
        }
    }
    return p[bottom];
}

static int drive_delayed(int n, double sample_time, double *starts, double *ends, double before, double delay, double (*pieces)[3])
{
    int whole = 0;
    double part = 0.0;
    int count = 0;
    int at = 0;
    double slope = 0.0;
    double left = 0.0;
    whole = (int)(floor(delay / sample_time));
    part = delay - (whole * sample_time);
    count = 0;
    if (part > 0.0) {
        at = (n - whole) - 1;
        pieces[count][0] = part;
        if (at < 0) {
            pieces[count][1] = before;
            pieces[count][2] = before;
        } else {
            slope = (ends[at] - starts[at]) / sample_time;
            pieces[count][1] = ends[at] - (slope * part);
            pieces[count][2] = ends[at];
        }
        count += 1;
    }
    at = n - whole;
    left = sample_time - part;
    if (left > 0.0) {
        pieces[count][0] = left;
        if (at < 0) {
            pieces[count][1] = before;
            pieces[count][2] = before;
        } else {
            slope = (ends[at] - starts[at]) / sample_time;
            pieces[count][1] = starts[at];
            pieces[count][2] = starts[at] + (slope * left);
        }
        count += 1;
    }
    return count;
}

static int drive_through_formula(double (*pieces)[3], int count, double time, double *p)
{
    double at = 0.0;
    double end = 0.0;
    int j = 0;
    double length = 0.0;
    double first = 0.0;
    double last = 0.0;
    int k = 0;
    int row = 0;
    double low = 0.0;
    double high = 0.0;
    double before = 0.0;
    double after = 0.0;
    at = p[OWN_INPUT];
    end = time;
    for (j = 0; j < count; ++j) {
        end += pieces[j][0];
    }
    for (j = count - 1; j > -1; --j) {
        length = pieces[j][0];
        first = pieces[j][1];
        last = pieces[j][2];
        end -= length;
        for (k = OWN_PIECES - 1; k > -1; --k) {
            row = (OWN_PIECES * j) + k;
            low = (k + 0.0) / OWN_PIECES;
            high = (k + 1.0) / OWN_PIECES;
            before = first + (low * (last - first));
            after = first + (high * (last - first));
            pieces[row][0] = length / OWN_PIECES;
            pieces[row][1] = drive_formula_value(at, 0.0, 0.0, before, end + (low * length), 0.0, p);
            pieces[row][2] = drive_formula_value(at, 0.0, 0.0, after, end + (high * length), 0.0, p);
        }
    }
    return OWN_PIECES * count;
}

static int drive_split(double (*pieces)[3], int count, double level)
{
    double side = 0.0;
    int k1 = 0;
    double at = 0.0;
    int j = 0;
    double first = 0.0;
    double last = 0.0;
    int row = 0;
    int k = 0;
    double share = 0.0;
    double length = 0.0;
    for (k1 = 0; k1 < 2; ++k1) {
        static const double list1[2] = {-1.0, 1.0};
        side = list1[k1];
        at = side * level;
        j = 0;
        while ((j < count) && (count < MOST_PIECES)) {
            first = pieces[j][1];
            last = pieces[j][2];
            if (((first - at) * (last - at)) < 0.0) {
                for (row = count; row > j; --row) {
                    for (k = 0; k < 3; ++k) {
                        pieces[row][k] = pieces[row - 1][k];
                    }
                }
                count += 1;
                share = (at - first) / (last - first);
                length = pieces[j][0];
                pieces[j][0] = share * length;
                pieces[j][2] = at;
                pieces[j + 1][0] = (1.0 - share) * length;
                pieces[j + 1][1] = at;
                j += 1;
            }
            j += 1;
        }
    }
    return count;
}

static tuple_id drive_limit_rate(double (*pieces)[3], int count, double rate, double followed)
{
    int j = 0;
    double length = 0.0;
    double first = 0.0;
    double last = 0.0;
    double behind = 0.0;
    double slope = 0.0;
    double pace = 0.0;
    double closing = 0.0;
    double catch = 0.0;
    int row = 0;
    int k = 0;
    double met = 0.0;
    j = 0;
    while (j < count) {
        length = pieces[j][0];
        first = pieces[j][1];
        last = pieces[j][2];
        behind = first - followed;
        slope = (last - first) / length;
        if ((behind == 0.0) && (fabs(slope) <= rate)) {
            followed = last;
            j += 1;
            continue;
        }
        pace = ((behind > 0.0) || ((behind == 0.0) && (slope > 0.0))) ? rate : (-rate);
        closing = pace - slope;
        catch = ((closing * behind) > 0.0) ? (behind / closing) : HUGE_VAL;
        pieces[j][1] = followed;
        if ((catch < length) && (count < MOST_PIECES)) {
            for (row = count; row > j; --row) {
                for (k = 0; k < 3; ++k) {
                    pieces[row][k] = pieces[row - 1][k];
                }
            }
            count += 1;
            met = first + (slope * catch);
            pieces[j][0] = catch;
            pieces[j][2] = met;
            pieces[j + 1][0] = length - catch;
            pieces[j + 1][1] = met;
            pieces[j + 1][2] = last;
            followed = met;
        } else {
            followed = followed + (pace * length);
            pieces[j][2] = followed;
        }
        j += 1;
    }
    return (tuple_id){count, followed};
}

static double drive_dead_zone(double value, double half)
{
    if (value > half) {
        return value - half;
    }
    if (value < (-half)) {
        return value + half;
    }
    return 0.0;
}

static tuple_id drive_command_pieces(int n, double time, double sample_time, double *starts, double *ends, double before, double *p, double followed, double (*pieces)[3])
{
    int count = 0;
    int j = 0;
    double limit = 0.0;
    if (p[DELAY] > 0.0) {
        count = drive_delayed(n, sample_time, starts, ends, before, p[DELAY], pieces);
    } else {
        pieces[0][0] = sample_time;
        pieces[0][1] = starts[n];
        pieces[0][2] = ends[n];
        count = 1;
    }
    if (p[OWN_INPUT] != 0.0) {
        count = drive_through_formula(pieces, count, time, p);
    }
    if (p[DEAD_ZONE] > 0.0) {
        count = drive_split(pieces, count, p[DEAD_ZONE]);
        for (j = 0; j < count; ++j) {
            pieces[j][1] = drive_dead_zone(pieces[j][1], p[DEAD_ZONE]);
            pieces[j][2] = drive_dead_zone(pieces[j][2], p[DEAD_ZONE]);
        }
    }
    limit = p[SATURATION];
    if (limit < HUGE_VAL) {
        count = drive_split(pieces, count, limit);
        for (j = 0; j < count; ++j) {
            pieces[j][1] = least(most(pieces[j][1], -limit), limit);
            pieces[j][2] = least(most(pieces[j][2], -limit), limit);
        }
    }
    if (p[RATE] < HUGE_VAL) {
        return drive_limit_rate(pieces, count, p[RATE], followed);
    }
    return (tuple_id){count, followed};
}

static int drive_is_untouched(double *p)
{
    return !((p[DELAY] > 0.0) || (p[OWN_INPUT] != 0.0) || (p[DEAD_ZONE] > 0.0) || (p[SATURATION] < HUGE_VAL) || (p[RATE] < HUGE_VAL));
}

static double drive_static_command(double value, double *p)
{
    double limit = 0.0;
    if (p[OWN_INPUT] != 0.0) {
        value = drive_formula_value(p[OWN_INPUT], 0.0, 0.0, value, 0.0, 0.0, p);
    }
    if (p[DEAD_ZONE] > 0.0) {
        value = drive_dead_zone(value, p[DEAD_ZONE]);
    }
    limit = p[SATURATION];
    return least(most(value, -limit), limit);
}

static int drive_depends_on_motion(double *p)
{
    return (p[RESISTANCE] > 0.0) || (p[CLIP_LIMIT] < HUGE_VAL);
}

static int drive_has_losses(double *p)
{
    return (p[SATURATION_LOSS] != 0.0) || (p[IRON] > 0.0) || (p[SAG_LOSS] != 0.0) || (p[THERMAL_LOSS] != 0.0);
}

static int drive_is_straight(double *p)
{
    int is_bent = 0;
    is_bent = p[THERMAL_LOSS] != 0.0;
    is_bent = is_bent || ((!drive_depends_on_motion(p)) && drive_has_losses(p));
    is_bent = is_bent || (p[LAG] > 0.0) || (p[PERIODIC_FORCE] != 0.0);
    return !is_bent;
}

static double drive_force_of(double current, double warmth, double *p)
{
    double share = 0.0;
    double loss = 0.0;
    double turn = 0.0;
    share = fabs(current) / p[REFERENCE_CURRENT];
    loss = ((p[SATURATION_LOSS] * share) + p[SAG_LOSS]) * share;
    loss += p[THERMAL_LOSS] * warmth;
    turn = p[IRON] * share;
    if (turn > 0.0) {
        loss += 1.0 - (tanh(turn) / turn);
    }
    return (p[FORCE_CONSTANT] * (1.0 - loss)) * current;
}

static tuple_dd drive_faded(double turns, double ratio)
{
    double square = 0.0;
    double spread = 0.0;
    double rest = 0.0;
    double held = 0.0;
    double added = 0.0;
    double slow = 0.0;
    double fast = 0.0;
    if (ratio <= 0.0) {
        return (tuple_dd){exp(-turns), 0.0};
    }
    square = (ratio * ratio) - 1.0;
    spread = sqrt(fabs(square));
    if (spread < 0.0001) {
        rest = exp((-ratio) * turns);
        return (tuple_dd){rest * (1.0 + (ratio * turns)), rest * turns};
    }
    if (square < 0.0) {
        rest = exp((-ratio) * turns);
        held = rest * cos(spread * turns);
        added = rest * sin(spread * turns);
    } else {
        slow = exp((spread - ratio) * turns);
        fast = exp((-(spread + ratio)) * turns);
        held = 0.5 * (slow + fast);
        added = 0.5 * (slow - fast);
    }
    added /= spread;
    return (tuple_dd){held + (ratio * added), added};
}

static void drive_prepare_push(double *room, double length, double *p)
{
    double turns = 0.0;
    double ratio = 0.0;
    int j = 0;
    tuple_dd t1 = {0};
    tuple_dd t2 = {0};
    int n = 0;
    double angle = 0.0;
    room[0] = length;
    if (p[LAG] > 0.0) {
        turns = length / p[LAG];
        ratio = p[LAG_DAMPING_RATIO];
        for (j = 0; j < 5; ++j) {
            t1 = drive_faded(shares[j] * turns, ratio);
            room[1 + j] = t1.m0;
            room[17 + j] = t1.m1;
        }
        t2 = drive_faded(turns, ratio);
        room[6] = t2.m0;
        room[22] = t2.m1;
    }
    if (p[THERMAL_LOSS] != 0.0) {
        room[7] = exp((-length) / p[THERMAL_TIME]);
        room[8] = sqrt(room[7]);
    }
    if (p[PERIODIC_FORCE] != 0.0) {
        for (n = 9; n < 17; ++n) {
            room[n] = 0.0;
        }
        for (j = 0; j < 5; ++j) {
            angle = ((6.283185307179586 * p[PERIODIC_FREQUENCY]) * shares[j]) * length;
            for (n = 0; n < 4; ++n) {
                room[9 + n] += project[j][n] * cos(angle);
                room[13 + n] += project[j][n] * sin(angle);
            }
        }
    }
}

static void drive_set_push(double *push, double *room, double *memory, tuple_dddd piece, double current_now, double *p)
{
    tuple_dddd t1 = {0};
    double time = 0.0;
    double length = 0.0;
    double first = 0.0;
    double last = 0.0;
    double lag = 0.0;
    double swing = 0.0;
    double ratio = 0.0;
    int depends = 0;
    int is_hot = 0;
    int is_force = 0;
    double rise = 0.0;
    double steady = 0.0;
    double fading = 0.0;
    double turning = 0.0;
    double pace = 0.0;
    int n = 0;
    double cold = 0.0;
    double square = 0.0;
    int j = 0;
    double share = 0.0;
    double value = 0.0;
    double gain = 0.0;
    double angle = 0.0;
    double sine = 0.0;
    double cosine = 0.0;
    double left = 0.0;
    double scale = 0.0;
    t1 = piece;
    time = t1.m0;
    length = t1.m1;
    first = t1.m2;
    last = t1.m3;
    if (room[0] != length) {
        drive_prepare_push(room, length, p);
    }
    lag = p[LAG];
    swing = p[PERIODIC_FORCE];
    ratio = p[LAG_DAMPING_RATIO];
    depends = drive_depends_on_motion(p);
    is_hot = p[THERMAL_LOSS] != 0.0;
    is_force = drive_has_losses(p) && (!depends);
    rise = last - first;
    steady = first;
    fading = 0.0;
    turning = 0.0;
    pace = 0.0;
    if (lag > 0.0) {
        pace = (rise * lag) / length;
        steady = first - pace;
        if (ratio > 0.0) {
            steady = first - ((2.0 * ratio) * pace);
            turning = memory[6] - pace;
        }
        fading = memory[3] - steady;
    }
    for (n = 0; n < 4; ++n) {
        push[DRIVE + n] = 0.0;
        push[OTHER + n] = 0.0;
    }
    push[OTHER] = p[LOAD];
    cold = memory[4];
    if (is_hot) {
        square = current_now / p[REFERENCE_CURRENT];
        square *= square;
        if (!depends) {
            square = 0.0;
            for (j = 0; j < 5; ++j) {
                share = (steady + (rise * shares[j])) + (fading * room[1 + j]);
                share += turning * room[17 + j];
                share /= p[REFERENCE_CURRENT];
                square += (half_weights[j] * share) * share;
            }
        }
        push[WARMTH] = square + ((cold - square) * room[8]);
        memory[4] = square + ((cold - square) * room[7]);
    }
    if ((lag > 0.0) || is_force) {
        for (j = 0; j < 5; ++j) {
            value = (steady + (rise * shares[j])) + (fading * room[1 + j]);
            value += turning * room[17 + j];
            if (is_force) {
                value = drive_force_of(value, cold + ((memory[4] - cold) * shares[j]), p);
            } else {
                if (!depends) {
                    value *= p[FORCE_CONSTANT];
                }
            }
            for (n = 0; n < 4; ++n) {
                push[DRIVE + n] += project[j][n] * value;
            }
        }
    } else {
        gain = depends ? 1.0 : p[FORCE_CONSTANT];
        push[DRIVE] = gain * first;
        push[DRIVE + 1] = gain * rise;
    }
    if (swing != 0.0) {
        angle = ((6.283185307179586 * p[PERIODIC_FREQUENCY]) * time) + p[PERIODIC_PHASE];
        sine = swing * sin(angle);
        cosine = swing * cos(angle);
        for (n = 0; n < 4; ++n) {
            push[OTHER + n] += (sine * room[9 + n]) + (cosine * room[13 + n]);
        }
    }
    memory[3] = last;
    if (lag > 0.0) {
        memory[3] = ((steady + rise) + (fading * room[6])) + (turning * room[22]);
        if (ratio > 0.0) {
            left = room[6] - ((2.0 * ratio) * room[22]);
            memory[6] = (pace - (fading * room[22])) + (turning * left);
        }
    }
    scale = 1.0;
    for (n = 1; n < 4; ++n) {
        scale /= length;
        push[DRIVE + n] *= scale;
        push[OTHER + n] *= scale;
    }
}

static void drive_set_moment(double *push, double time, double length, double first, double last)
{
    push[COMMAND] = first;
    push[COMMAND_RATE] = (last - first) / length;
    push[BEGUN] = time;
}

static double drive_value_of(double *push, int which, double done)
{
    double rest = 0.0;
    rest = push[which + 2] + (done * push[which + 3]);
    return push[which] + (done * (push[which + 1] + (done * rest)));
}

static int drive_turns_sign(double *push, double done, double h)
{
    double first = 0.0;
    first = sign_of(drive_value_of(push, DRIVE, done));
    return first != sign_of(drive_value_of(push, DRIVE, done + h));
}

static tuple_dddd drive_shift(double *push, int which, double done)
{
    double a = 0.0;
    double b = 0.0;
    double c = 0.0;
    double d = 0.0;
    a = push[which];
    b = push[which + 1];
    c = push[which + 2];
    d = push[which + 3];
    if (done == 0.0) {
        return (tuple_dddd){a, b, c, d};
    }
    return (tuple_dddd){a + (done * (b + (done * (c + (done * d))))), b + (done * ((2.0 * c) + ((3.0 * done) * d))), c + ((3.0 * done) * d), d};
}

static double drive_behind(double even, double *p)
{
    double ratio = 0.0;
    ratio = p[SENSOR_LAG_DAMPING_RATIO];
    return (ratio > 0.0) ? ((2.0 * ratio) * even) : even;
}

static tuple_dd drive_lagged(double late, double pace, double before, double now, double sample_time, double *p)
{
    double ratio = 0.0;
    tuple_dd t1 = {0};
    double held = 0.0;
    double added = 0.0;
    double even = 0.0;
    double off = 0.0;
    double turning = 0.0;
    double after = 0.0;
    ratio = p[SENSOR_LAG_DAMPING_RATIO];
    t1 = drive_faded(sample_time / p[SENSOR_LAG], ratio);
    held = t1.m0;
    added = t1.m1;
    even = ((now - before) * p[SENSOR_LAG]) / sample_time;
    off = (late - before) + drive_behind(even, p);
    turning = (ratio > 0.0) ? (pace - even) : 0.0;
    after = ((now - drive_behind(even, p)) + (off * held)) + (turning * added);
    return (tuple_dd){after, (even - (off * added)) + (turning * (held - ((2.0 * ratio) * added)))};
}

static tuple_dd drive_first_late(double now, double speed, double *p)
{
    double even = 0.0;
    even = speed * p[SENSOR_LAG];
    return (tuple_dd){now - drive_behind(even, p), even};
}

static double drive_sensed(double y, double lag, double speed, double command, double time, double *p)
{
    int is_velocity = 0;
    int is_pushed = 0;
    double phase = 0.0;
    double size = 0.0;
    double turn = 0.0;
    double own = 0.0;
    double share = 0.0;
    double angle = 0.0;
    double limit = 0.0;
    if (p[OUTPUT_ZERO] != 0.0) {
        y -= p[OUTPUT_ZERO];
    }
    is_velocity = p[OUTPUT_IS_VELOCITY] > 0.0;
    if (is_velocity && (p[OUTPUT_GAP] > 0.0)) {
        is_pushed = fabs(lag) >= ((1.0 - 1e-09) * p[OUTPUT_GAP]);
        speed = (is_pushed && ((lag * speed) > 0.0)) ? speed : 0.0;
    }
    if (p[ECCENTRICITY] != 0.0) {
        phase = p[ECCENTRIC_PHASE];
        size = p[ECCENTRICITY];
        turn = 6.283185307179586 / p[ECCENTRIC_PERIOD];
        speed *= 1.0 + ((size * turn) * cos((turn * y) + phase));
        y += size * (sin((turn * y) + phase) - sin(phase));
    }
    if (p[OWN_OUTPUT] != 0.0) {
        own = drive_formula_value(p[OWN_OUTPUT], y, speed, command, time, sign_of(speed), p);
        y = own;
        speed = own;
    }
    if (is_velocity) {
        y = speed;
    }
    if ((p[SENSOR_QUADRATIC] != 0.0) || (p[SENSOR_CUBIC] != 0.0)) {
        share = y / p[REFERENCE_DISPLACEMENT];
        y *= 1.0 + ((p[SENSOR_QUADRATIC] + (p[SENSOR_CUBIC] * share)) * share);
    }
    if (p[SENSOR_DRIFT] != 0.0) {
        y += p[SENSOR_DRIFT] * time;
    }
    if (p[HUM_AMPLITUDE] != 0.0) {
        angle = ((6.283185307179586 * p[HUM_FREQUENCY]) * time) + p[HUM_PHASE];
        y += p[HUM_AMPLITUDE] * sin(angle);
    }
    limit = p[OUTPUT_LIMIT];
    if (limit < HUGE_VAL) {
        y = least(most(y, -limit), limit);
    }
    return y;
}

static double drive_extreme(double x0, double v0, double x1, double v1)
{
    double a = 0.0;
    double b = 0.0;
    double root = 0.0;
    double half = 0.0;
    double t = 0.0;
    a = 3.0 * (((2.0 * (x0 - x1)) + v0) + v1);
    b = 2.0 * (((3.0 * (x1 - x0)) - (2.0 * v0)) - v1);
    root = sqrt(most((b * b) - ((4.0 * a) * v0), 0.0));
    half = (-0.5) * (b + ((b >= 0.0) ? root : (-root)));
    t = (half != 0.0) ? (v0 / half) : 0.5;
    if (!((0.0 <= t) && (t <= 1.0))) {
        t = (a != 0.0) ? (half / a) : 0.5;
    }
    t = least(most(t, 0.0), 1.0);
    return x0 + (t * (v0 + (t * ((0.5 * b) + ((t * a) / 3.0)))));
}

static int drive_is_closed(double *p)
{
    return (p[VELOCITY_GAIN] > 0.0) || (p[PROPORTIONAL_GAIN] > 0.0);
}

static tuple_dd drive_late(double x, double v, double sample_time, double *control, double *p)
{
    tuple_dd t1 = {0};
    double late_x = 0.0;
    double pace_x = 0.0;
    tuple_dd t2 = {0};
    double late_v = 0.0;
    double pace_v = 0.0;
    tuple_dd t3 = {0};
    tuple_dd t4 = {0};
    t1 = drive_first_late(x, v, p);
    late_x = t1.m0;
    pace_x = t1.m1;
    t2 = drive_first_late(v, 0.0, p);
    late_v = t2.m0;
    pace_v = t2.m1;
    if (control[HAS_ERROR] > 0.0) {
        t3 = drive_lagged(control[LATE_X], control[PACE_X], control[LAST_X], x, sample_time, p);
        late_x = t3.m0;
        pace_x = t3.m1;
        t4 = drive_lagged(control[LATE_V], control[PACE_V], control[LAST_V], v, sample_time, p);
        late_v = t4.m0;
        pace_v = t4.m1;
    }
    control[LAST_X] = x;
    control[LAST_V] = v;
    control[LATE_X] = late_x;
    control[LATE_V] = late_v;
    control[PACE_X] = pace_x;
    control[PACE_V] = pace_v;
    return (tuple_dd){late_x, late_v};
}

static double drive_controlled(double reference, double x, double v, double sample_time, double *control, double *p)
{
    tuple_dd t1 = {0};
    double error = 0.0;
    double gain = 0.0;
    double reset = 0.0;
    double total = 0.0;
    double wanted = 0.0;
    double rate = 0.0;
    double limit = 0.0;
    double given = 0.0;
    if (p[SENSOR_LAG] > 0.0) {
        t1 = drive_late(x, v, sample_time, control, p);
        x = t1.m0;
        v = t1.m1;
    }
    error = reference - x;
    gain = p[PROPORTIONAL_GAIN];
    reset = p[INTEGRAL_GAIN];
    if (p[VELOCITY_GAIN] > 0.0) {
        error = (p[POSITION_GAIN] * error) - v;
        gain = p[VELOCITY_GAIN];
        reset = gain * p[RESET_RATE];
    } else {
        if (p[OUTPUT_IS_VELOCITY] > 0.0) {
            error = reference - v;
        }
    }
    total = control[ERROR_SUM] + (sample_time * error);
    wanted = ((gain * error) + (reset * total)) + p[START_COMMAND];
    if ((p[DERIVATIVE_GAIN] != 0.0) && (control[HAS_ERROR] > 0.0)) {
        rate = (error - control[LAST_ERROR]) / sample_time;
        wanted += p[DERIVATIVE_GAIN] * rate;
    }
    control[LAST_ERROR] = error;
    control[HAS_ERROR] = 1.0;
    limit = p[COMMAND_LIMIT];
    given = least(most(wanted, -limit), limit);
    if (((wanted - given) * error) <= 0.0) {
        control[ERROR_SUM] = total;
    }
    return given;
}

static double drive_bristle_level(double v, double *p)
{
    double share = 0.0;
    if (p[BRISTLE_EXCESS] == 0.0) {
        return 1.0;
    }
    share = v / p[BRISTLE_VELOCITY];
    return 1.0 + (p[BRISTLE_EXCESS] * exp((-share) * share));
}

static double drive_bent(double ahead, double gone, double v, double *memory, double *p)
{
    double before = 0.0;
    double now = 0.0;
    double level = 0.0;
    double lost = 0.0;
    double off = 0.0;
    before = memory[LEVEL];
    now = drive_bristle_level(v, p);
    if (gone <= 0.0) {
        return ahead;
    }
    level = 0.5 * (before + now);
    lost = -expm1((-gone) / level);
    off = (ahead - before) * (1.0 - lost);
    return (now + off) - ((((now - before) * level) / gone) * lost);
}

static double drive_yielding(double ahead, double *p)
{
    double share = 0.0;
    share = pow(fabs(ahead), 1.0 + p[HYSTERESIS_BEND]);
    if (ahead < 0.0) {
        share *= (p[HYSTERESIS_RATIO] - 1.0) / (p[HYSTERESIS_RATIO] + 1.0);
    }
    return 1.0 - share;
}

static double drive_shape_step(double ahead, double h, double *p)
{
    double k1 = 0.0;
    double k2 = 0.0;
    double k3 = 0.0;
    double k4 = 0.0;
    k1 = drive_yielding(ahead, p);
    k2 = drive_yielding(ahead + ((0.5 * h) * k1), p);
    k3 = drive_yielding(ahead + ((0.5 * h) * k2), p);
    k4 = drive_yielding(ahead + (h * k3), p);
    return ahead + ((h / 6.0) * ((k1 + (2.0 * (k2 + k3))) + k4));
}

static double drive_left_to_yield(double left, double gone, double *p)
{
    double fading = 0.0;
    double bent = 0.0;
    fading = exp((-(1.0 + p[HYSTERESIS_BEND])) * gone);
    bent = ((0.5 * p[HYSTERESIS_BEND]) * left) * (1.0 - fading);
    return (left * fading) / (1.0 - bent);
}

static double drive_yielded_in_shape(double ahead, double gone, double *p)
{
    double count = 0.0;
    double h = 0.0;
    double left = 0.0;
    double step = 0.0;
    double after = 0.0;
    double rest = 0.0;
    count = ceil((gone * (1.0 + p[HYSTERESIS_BEND])) / 0.1);
    h = gone / most(count, 1.0);
    left = gone;
    while (left > (0.5 * h)) {
        if ((1.0 - ahead) < 0.001) {
            return 1.0 - drive_left_to_yield(1.0 - ahead, left, p);
        }
        step = h;
        after = drive_shape_step(ahead, step, p);
        if ((ahead < 0.0) && (after > 0.0)) {
            rest = (1.0 / drive_yielding(ahead, p)) + (4.0 / drive_yielding(0.5 * ahead, p));
            step = least(((-ahead) * (rest + 1.0)) / 6.0, h);
            after = drive_shape_step(0.0, h - step, p);
        }
        ahead = after;
        left -= h;
    }
    return least(ahead, 1.0);
}

static double drive_yielded(double x, double v, double *memory, double *p)
{
    double way = 0.0;
    double gone = 0.0;
    way = memory[WAY];
    if (way == 0.0) {
        return memory[DEFLECTION];
    }
    gone = fabs(x - memory[TURNED_AT]) / p[HYSTERESIS_YIELD];
    if (p[HAS_BRISTLES] != 0.0) {
        return way * drive_bent(way * memory[DEFLECTION], gone, v, memory, p);
    }
    if (p[HAS_SHAPE] != 0.0) {
        return way * drive_yielded_in_shape(way * memory[DEFLECTION], gone, p);
    }
    return way - ((way - memory[DEFLECTION]) * exp(-gone));
}

static double drive_bending(double v, double deflection, double *memory, double *p)
{
    return v * (1.0 - ((memory[WAY] * deflection) / drive_bristle_level(v, p)));
}

static void drive_remember(double x, double v, double *memory, double *p)
{
    double way = 0.0;
    double deflection = 0.0;
    way = memory[WAY];
    if (way == 0.0) {
        return;
    }
    deflection = drive_yielded(x, v, memory, p);
    if (p[HAS_BRISTLES] != 0.0) {
        memory[DEFLECTION] = deflection;
        memory[LEVEL] = drive_bristle_level(v, p);
        memory[TURNED_AT] = x;
        return;
    }
    memory[DEFLECTION] = ((1.0 - (way * deflection)) <= 1e-14) ? way : deflection;
    memory[TURNED_AT] = x;
}

static double drive_beyond(double x, double half_gap)
{
    if (x > half_gap) {
        return x - half_gap;
    }
    if (x < (-half_gap)) {
        return x + half_gap;
    }
    return 0.0;
}

static double drive_beyond_side(double x, double edge)
{
    double into = 0.0;
    into = x - edge;
    return ((into * edge) > 0.0) ? into : 0.0;
}

static double drive_cogging(double x, double *p)
{
    double angle = 0.0;
    double swing = 0.0;
    angle = (6.283185307179586 * (x - p[COGGING_ORIGIN])) / p[COGGING_PERIOD];
    swing = sin(angle + p[COGGING_PHASE]) - p[COGGING_REST];
    return p[COGGING_FORCE] * swing;
}

static double drive_second_cogging(double x, double *p)
{
    double angle = 0.0;
    double phase = 0.0;
    double rest = 0.0;
    angle = (6.283185307179586 * (x - p[COGGING_ORIGIN])) / p[SECOND_COGGING_PERIOD];
    phase = p[SECOND_COGGING_PHASE];
    rest = (p[COGGING_ABOUT_MEAN] == 0.0) ? sin(phase) : 0.0;
    return p[SECOND_COGGING_FORCE] * (sin(angle + phase) - rest);
}

static double drive_bent_motion(double into, double bend)
{
    if ((bend == 0.0) || (into == 0.0)) {
        return into;
    }
    return into * pow(fabs(into), bend);
}

static double drive_further_spring(double x, double *p)
{
    double force = 0.0;
    double into = 0.0;
    force = 0.0;
    if (p[GRAVITY_TORQUE] != 0.0) {
        force += p[GRAVITY_TORQUE] * sin(x + p[GRAVITY_ANGLE]);
        force -= p[GRAVITY_REST];
    }
    if (p[SECOND_STIFFNESS] > 0.0) {
        into = drive_beyond_side(x, p[SECOND_POSITION]);
        force += p[SECOND_STIFFNESS] * drive_bent_motion(into, p[SECOND_BEND]);
    }
    if (p[SECOND_COGGING_FORCE] != 0.0) {
        force -= drive_second_cogging(x, p);
    }
    return force;
}

static double drive_spring_force(double x, double *p)
{
    double free = 0.0;
    double force = 0.0;
    double into = 0.0;
    free = (p[SPRING_GAP] > 0.0) ? drive_beyond(x, p[SPRING_GAP]) : x;
    force = p[STIFFNESS] * free;
    force += (((p[CUBIC] * x) + p[QUADRATIC]) * x) * x;
    if (p[STOP_STIFFNESS] > 0.0) {
        into = drive_beyond(x, p[STOP_POSITION]);
        force += p[STOP_STIFFNESS] * drive_bent_motion(into, p[STOP_BEND]);
    }
    if (p[SIDE_STIFFNESS] > 0.0) {
        into = drive_beyond_side(x, p[SIDE_POSITION]);
        force += p[SIDE_STIFFNESS] * drive_bent_motion(into, p[SIDE_BEND]);
    }
    if (p[COGGING_FORCE] != 0.0) {
        force -= drive_cogging(x, p);
    }
    if (p[HAS_MORE] != 0.0) {
        force += drive_further_spring(x, p);
    }
    return force;
}

static int drive_is_stop_straight(double *p)
{
    return ((p[STOP_BEND] + p[STOP_LOSS]) + p[STOP_DASHPOT]) == 0.0;
}

static int drive_is_side_straight(double *p)
{
    return ((p[SIDE_BEND] + p[SIDE_LOSS]) + p[SIDE_DASHPOT]) == 0.0;
}

static int drive_reaches_side(double low, double high, double position)
{
    return (drive_beyond_side(low, position) != 0.0) || (drive_beyond_side(high, position) != 0.0);
}

static int drive_is_second_straight(double *p)
{
    double loss = 0.0;
    loss = p[SECOND_LOSS] + p[SECOND_DASHPOT];
    return (p[SECOND_BEND] + loss) == 0.0;
}

static double drive_spring_rate(double x, double low, double high, double *p)
{
    double stiffness = 0.0;
    double bend = 0.0;
    double edge = 0.0;
    stiffness = p[STIFFNESS];
    if ((p[CUBIC] != 0.0) || (p[QUADRATIC] != 0.0)) {
        bend = ((3.0 * p[CUBIC]) * x) + (2.0 * p[QUADRATIC]);
        stiffness += fabs(bend * x);
    }
    if (drive_is_stop_straight(p) && (most(high, -low) > p[STOP_POSITION])) {
        stiffness += p[STOP_STIFFNESS];
    }
    if (drive_is_side_straight(p) && drive_reaches_side(low, high, p[SIDE_POSITION])) {
        stiffness += p[SIDE_STIFFNESS];
    }
    if (p[HAS_MORE] != 0.0) {
        stiffness += fabs(p[GRAVITY_TORQUE]);
        stiffness += p[SPRING_SHARE] * p[STIFFNESS];
        edge = p[SECOND_POSITION];
        if (drive_is_second_straight(p) && drive_reaches_side(low, high, edge)) {
            stiffness += p[SECOND_STIFFNESS];
        }
    }
    return stiffness;
}

static double drive_damping_of(double elastic, double v, double side, double loss, double dashpot)
{
    double force = 0.0;
    force = elastic * most((loss * sign_of(elastic)) * v, -1.0);
    if ((dashpot > 0.0) && (side != 0.0)) {
        force += side * most((dashpot * side) * v, -fabs(elastic));
    }
    return force;
}

static double drive_contact_damping(double x, double v, double *memory, double *p)
{
    double force = 0.0;
    double into = 0.0;
    double elastic = 0.0;
    double loss = 0.0;
    double dashpot = 0.0;
    force = 0.0;
    if ((p[STOP_LOSS] + p[STOP_DASHPOT]) > 0.0) {
        into = drive_beyond(x, p[STOP_POSITION]);
        elastic = p[STOP_STIFFNESS] * drive_bent_motion(into, p[STOP_BEND]);
        loss = p[STOP_LOSS];
        dashpot = p[STOP_DASHPOT];
        force += drive_damping_of(elastic, v, memory[IN_STOP], loss, dashpot);
    }
    if ((p[SIDE_LOSS] + p[SIDE_DASHPOT]) > 0.0) {
        into = drive_beyond_side(x, p[SIDE_POSITION]);
        elastic = p[SIDE_STIFFNESS] * drive_bent_motion(into, p[SIDE_BEND]);
        loss = p[SIDE_LOSS];
        dashpot = p[SIDE_DASHPOT];
        force += drive_damping_of(elastic, v, memory[IN_SIDE], loss, dashpot);
    }
    if ((p[SECOND_LOSS] + p[SECOND_DASHPOT]) > 0.0) {
        into = drive_beyond_side(x, p[SECOND_POSITION]);
        elastic = p[SECOND_STIFFNESS] * drive_bent_motion(into, p[SECOND_BEND]);
        loss = p[SECOND_LOSS];
        dashpot = p[SECOND_DASHPOT];
        force += drive_damping_of(elastic, v, memory[IN_SECOND], loss, dashpot);
    }
    return force;
}

static void drive_touch(double x, double *memory, double *p)
{
    if (p[STOP_DASHPOT] > 0.0) {
        memory[IN_STOP] = sign_of(drive_beyond(x, p[STOP_POSITION]));
    }
    if (p[SIDE_DASHPOT] > 0.0) {
        memory[IN_SIDE] = sign_of(drive_beyond_side(x, p[SIDE_POSITION]));
    }
    if (p[SECOND_DASHPOT] > 0.0) {
        memory[IN_SECOND] = sign_of(drive_beyond_side(x, p[SECOND_POSITION]));
    }
}

static double drive_ripple(double angle, double *p)
{
    double turned = 0.0;
    turned = (p[RIPPLE_PER_TURN] * angle) + p[RIPPLE_PHASE];
    return 1.0 + (p[RIPPLE_SHARE] * sin(turned));
}

static double drive_bite(double twist, double speed, double *p)
{
    double into = 0.0;
    double force = 0.0;
    if (p[IS_COUPLED] > 0.0) {
        return (p[GEAR_STIFFNESS] * twist) + (p[GEAR_DAMPING] * speed);
    }
    into = drive_beyond(twist, p[GEAR_GAP]);
    force = (p[GEAR_STIFFNESS] * into) + (p[GEAR_DAMPING] * speed);
    if (into > 0.0) {
        return most(force, 0.0);
    }
    return (into < 0.0) ? least(force, 0.0) : 0.0;
}

static double drive_sliding_friction(double way, double v, double *p)
{
    double level = 0.0;
    double share = 0.0;
    level = (way > 0.0) ? p[FRICTION_FORWARD] : p[FRICTION_BACKWARD];
    if (p[STATIC_EXCESS] != 0.0) {
        share = fabs(v) / p[STRIBECK_VELOCITY];
        if (p[IS_STRIBECK_EXPONENTIAL] == 0.0) {
            share *= share;
        }
        level += p[STATIC_EXCESS] * exp(-share);
    }
    return level;
}

static double drive_friction_here(double x, double *p)
{
    double level = 0.0;
    double angle = 0.0;
    double free = 0.0;
    double load = 0.0;
    level = 0.0;
    if (p[WAVY_FRICTION] != 0.0) {
        angle = ((6.283185307179586 * x) / p[WAVY_PERIOD]) + p[WAVY_PHASE];
        level += p[WAVY_FRICTION] * sin(angle);
    }
    if (p[SPRING_SHARE] != 0.0) {
        free = (p[SPRING_GAP] > 0.0) ? drive_beyond(x, p[SPRING_GAP]) : x;
        load = p[STIFFNESS] * free;
        load += (((p[CUBIC] * x) + p[QUADRATIC]) * x) * x;
        level += p[SPRING_SHARE] * fabs(load);
    }
    return level;
}

static double drive_resisting(double x, double v, double *memory, double *p)
{
    double force = 0.0;
    double deflection = 0.0;
    double way = 0.0;
    force = (p[DAMPING] * v) + drive_spring_force(x, p);
    if (p[DRAG] != 0.0) {
        force += (p[DRAG] * v) * fabs(v);
    }
    if (p[HYSTERESIS_FORCE] != 0.0) {
        deflection = drive_yielded(x, v, memory, p);
        force += p[HYSTERESIS_FORCE] * deflection;
        if (p[BRISTLE_DAMPING] != 0.0) {
            force += p[BRISTLE_DAMPING] * drive_bending(v, deflection, memory, p);
        }
    }
    way = memory[WAY];
    if (way != 0.0) {
        force += way * drive_sliding_friction(way, v, p);
    }
    if (p[HAS_MORE] != 0.0) {
        force += (memory[SIDE] * p[PRELOAD]) + drive_contact_damping(x, v, memory, p);
        force += way * drive_friction_here(x, p);
    }
    return force;
}

static double drive_own_force(double x, double v, double way, double *push, double done, double *p)
{
    double at = 0.0;
    double u = 0.0;
    double t = 0.0;
    double forward = 0.0;
    at = p[OWN_FORCE];
    u = push[COMMAND] + (done * push[COMMAND_RATE]);
    t = push[BEGUN] + done;
    if (p[OWN_FRICTION] == 0.0) {
        return drive_formula_value(at, x, v, u, t, sign_of(v), p);
    }
    if (way != 0.0) {
        return drive_formula_value(at, x, v, u, t, way, p);
    }
    forward = drive_formula_value(at, x, 0.0, u, t, 1.0, p);
    return 0.5 * (forward + drive_formula_value(at, x, 0.0, u, t, -1.0, p));
}

static tuple_dd drive_net_forces(double x, double v, double x_motor, double v_motor, double force, double *memory, double *push, double done, double *p)
{
    double motor = 0.0;
    double rubbing = 0.0;
    double teeth = 0.0;
    double net = 0.0;
    motor = 0.0;
    rubbing = motor;
    if (p[DRIVE_VARIES] != 0.0) {
        force *= drive_ripple(x_motor, p);
        rubbing = (memory[WAY] * p[DRIVE_SHARE]) * fabs(force);
    }
    if (p[GEAR_STIFFNESS] > 0.0) {
        teeth = drive_bite(x_motor - x, v_motor - v, p);
        motor = (force - teeth) - (p[MOTOR_DAMPING] * v_motor);
        motor /= p[MOTOR_SHARE] * p[MASS];
        force = teeth;
    }
    net = (force + drive_value_of(push, OTHER, done)) - drive_resisting(x, v, memory, p);
    if (rubbing != 0.0) {
        net -= rubbing;
    }
    if (p[OWN_FORCE] != 0.0) {
        net += drive_own_force(x, v, memory[WAY], push, done, p);
    }
    return (tuple_dd){net, motor};
}

static double drive_wanted_current(double command, double *state, double *p)
{
    double speed = 0.0;
    if (p[RESISTANCE] <= 0.0) {
        return command;
    }
    if (p[INDUCTANCE] > 0.0) {
        return state[CIRCUIT];
    }
    speed = (p[GEAR_STIFFNESS] > 0.0) ? state[MOTOR_V] : state[V];
    return (command - (p[BACK_EMF] * speed)) / p[RESISTANCE];
}

static double drive_drawn_current(double command, double *state, double *p)
{
    double speed = 0.0;
    double middle = 0.0;
    double limit = 0.0;
    double current = 0.0;
    speed = (p[GEAR_STIFFNESS] > 0.0) ? state[MOTOR_V] : state[V];
    middle = (-p[CLIP_SLOPE]) * speed;
    limit = p[CLIP_LIMIT];
    current = drive_wanted_current(command, state, p);
    return least(most(current, middle - limit), middle + limit);
}

static tuple_dddd drive_acceleration(double *state, double *memory, double *push, double done, double *p)
{
    double x = 0.0;
    double v = 0.0;
    int has_motor = 0;
    double force = 0.0;
    double rate = 0.0;
    double speed = 0.0;
    double voltage = 0.0;
    double x_motor = 0.0;
    double v_motor = 0.0;
    tuple_dd t1 = {0};
    double net = 0.0;
    double motor = 0.0;
    double mass = 0.0;
    double mode = 0.0;
    double pull = 0.0;
    x = state[X];
    v = state[V];
    has_motor = p[GEAR_STIFFNESS] > 0.0;
    force = drive_value_of(push, DRIVE, done);
    rate = 0.0;
    if (drive_depends_on_motion(p)) {
        speed = has_motor ? state[MOTOR_V] : v;
        if (p[INDUCTANCE] > 0.0) {
            voltage = force - (p[BACK_EMF] * speed);
            rate = voltage - (p[RESISTANCE] * state[CIRCUIT]);
            rate /= p[INDUCTANCE];
        }
        force = drive_force_of(drive_drawn_current(force, state, p), push[WARMTH], p);
    }
    x_motor = has_motor ? state[MOTOR_X] : x;
    v_motor = has_motor ? state[MOTOR_V] : v;
    t1 = drive_net_forces(x, v, x_motor, v_motor, force, memory, push, done, p);
    net = t1.m0;
    motor = t1.m1;
    mass = p[MASS];
    if (has_motor) {
        mass -= p[MOTOR_SHARE] * mass;
    }
    mode = 0.0;
    if (p[MODE_MASS] > 0.0) {
        pull = p[MODE_STIFFNESS] * (state[PART_X] - x);
        pull += p[MODE_DAMPING] * (state[PART_V] - v);
        net += pull;
        mode = (-pull) / p[MODE_MASS];
    }
    return (tuple_dddd){net / mass, motor, mode, rate};
}

static double drive_own_friction(double x, double *push, double done, double *p)
{
    double at = 0.0;
    double u = 0.0;
    double t = 0.0;
    double backward = 0.0;
    at = p[OWN_FORCE];
    u = push[COMMAND] + (done * push[COMMAND_RATE]);
    t = push[BEGUN] + done;
    backward = drive_formula_value(at, x, 0.0, u, t, -1.0, p);
    return 0.5 * (backward - drive_formula_value(at, x, 0.0, u, t, 1.0, p));
}

static double drive_own_force_at_rest(double x, double command, double *p)
{
    double at = 0.0;
    double forward = 0.0;
    double backward = 0.0;
    double low = 0.0;
    double high = 0.0;
    at = p[OWN_FORCE];
    forward = drive_formula_value(at, x, 0.0, command, 0.0, 1.0, p);
    backward = drive_formula_value(at, x, 0.0, command, 0.0, -1.0, p);
    low = least(forward, backward);
    high = most(forward, backward);
    return least(most(0.0, low), high);
}

static double drive_moved_mass(double *p)
{
    if (p[GEAR_STIFFNESS] > 0.0) {
        return p[MASS] * (1.0 - p[MOTOR_SHARE]);
    }
    return p[MASS];
}

static int drive_is_force_curved(double *p)
{
    return (p[CUBIC] != 0.0) || (p[QUADRATIC] != 0.0) || (p[COGGING_FORCE] != 0.0) || (p[DRAG] != 0.0) || (p[GRAVITY_TORQUE] != 0.0) || (p[SECOND_COGGING_FORCE] != 0.0) || (p[WAVY_FRICTION] != 0.0) || (p[SPRING_SHARE] != 0.0) || (p[DRIVE_VARIES] != 0.0) || (p[OWN_FORCE] != 0.0) || (p[HAS_BRISTLES] != 0.0);
}

static int drive_has_dry_friction(double *p)
{
    double level = 0.0;
    level = most(p[FRICTION_FORWARD], p[FRICTION_BACKWARD]);
    level += (p[PRELOAD] + p[SPRING_SHARE]) + p[DRIVE_SHARE];
    level += p[OWN_FRICTION];
    return (level > 0.0) || (p[STATIC_EXCESS] != 0.0);
}

static double drive_drive_now(double *state, double *push, double done, double *p)
{
    int has_motor = 0;
    double force = 0.0;
    has_motor = p[GEAR_STIFFNESS] > 0.0;
    force = drive_value_of(push, DRIVE, done);
    if (drive_depends_on_motion(p)) {
        force = drive_force_of(drive_drawn_current(force, state, p), push[WARMTH], p);
    }
    return force * drive_ripple(has_motor ? state[MOTOR_X] : state[X], p);
}

static double drive_held_further(double *state, double *push, double done, double *p)
{
    double level = 0.0;
    level = drive_friction_here(state[X], p);
    if (state[X] == 0.0) {
        level += p[PRELOAD];
    }
    if (p[DRIVE_SHARE] != 0.0) {
        level += p[DRIVE_SHARE] * fabs(drive_drive_now(state, push, done, p));
    }
    if (p[OWN_FRICTION] != 0.0) {
        level += drive_own_friction(state[X], push, done, p);
    }
    return level;
}

static double drive_surplus(double net, double *p)
{
    int way = 0;
    way = (net > 0.0) ? FRICTION_FORWARD : FRICTION_BACKWARD;
    return fabs(net) - most(p[way] + p[STATIC_EXCESS], 0.0);
}

static double drive_speed_of_excess(double times, double *p)
{
    if (p[IS_STRIBECK_EXPONENTIAL] != 0.0) {
        times *= times;
    }
    return times * p[STRIBECK_VELOCITY];
}

static int drive_is_anywhere(double *p)
{
    return (p[STIFFNESS] <= 0.0) && (p[CUBIC] <= 0.0);
}

static double drive_resting_force(double x, double current, double *p)
{
    double limit = 0.0;
    double warmth = 0.0;
    double constant = 0.0;
    double force = 0.0;
    int _ = 0;
    double turned = 0.0;
    limit = p[CLIP_LIMIT];
    warmth = p[START_WARMTH];
    constant = drive_force_of(least(most(current, -limit), limit), warmth, p);
    force = constant;
    if ((p[RIPPLE_SHARE] != 0.0) && (p[GEAR_STIFFNESS] > 0.0)) {
        for (_ = 0; _ < MOST_TURNS; ++_) {
            turned = sign_of(force) * p[GEAR_GAP];
            turned += force / p[GEAR_STIFFNESS];
            force = constant * drive_ripple(x + turned, p);
        }
    } else {
        if (p[RIPPLE_SHARE] != 0.0) {
            force *= drive_ripple(x, p);
        }
    }
    return force;
}

static double drive_command_at(double current, double *p)
{
    return (p[RESISTANCE] > 0.0) ? (current * p[RESISTANCE]) : current;
}

static double drive_away(double x, double side, double current, int has_cogging, double *p)
{
    double force = 0.0;
    double left = 0.0;
    force = drive_resting_force(x, current, p) + p[LOAD];
    left = (force - (side * p[PRELOAD])) - drive_spring_force(x, p);
    if ((!has_cogging) && (p[COGGING_FORCE] != 0.0)) {
        left -= drive_cogging(x, p);
    }
    if ((!has_cogging) && (p[SECOND_COGGING_FORCE] != 0.0)) {
        left -= drive_second_cogging(x, p);
    }
    if (p[OWN_FORCE] != 0.0) {
        left += drive_own_force_at_rest(x, drive_command_at(current, p), p);
    }
    return left;
}

static double drive_resting_point(double current, int has_cogging, double *p)
{
    double force = 0.0;
    double side = 0.0;
    double stiffness = 0.0;
    double far = 0.0;
    double near = 0.0;
    int _ = 0;
    double middle = 0.0;
    if (drive_is_anywhere(p)) {
        return p[START_POSITION];
    }
    force = drive_resting_force(0.0, current, p) + p[LOAD];
    force -= p[GRAVITY_TORQUE] * sin(p[GRAVITY_ANGLE]);
    force += p[GRAVITY_REST];
    if (p[OWN_FORCE] != 0.0) {
        force += drive_own_force_at_rest(0.0, drive_command_at(current, p), p);
    }
    if (fabs(force) <= p[PRELOAD]) {
        return 0.0;
    }
    side = sign_of(force);
    force -= side * p[PRELOAD];
    stiffness = p[STIFFNESS];
    stiffness += cbrt((most(p[CUBIC], 0.0) * force) * force);
    far = (0.001 * force) / stiffness;
    near = 0.0;
    for (_ = 0; _ < MOST_TRIES; ++_) {
        if ((drive_away(far, side, current, has_cogging, p) * force) <= 0.0) {
            break;
        }
        near = far;
        far *= 1.3;
    }
    for (_ = 0; _ < NARROWING; ++_) {
        middle = 0.5 * (near + far);
        if ((drive_away(middle, side, current, has_cogging, p) * force) > 0.0) {
            near = middle;
        } else {
            far = middle;
        }
    }
    return far;
}

static int drive_has_teeth(double *p)
{
    return (p[GEAR_STIFFNESS] > 0.0) && (p[IS_COUPLED] <= 0.0);
}

static int drive_count_edges(double *p)
{
    int count = 0;
    int slot = 0;
    int k1 = 0;
    int k2 = 0;
    count = 0;
    for (k1 = 0; k1 < 3; ++k1) {
        static const int list1[3] = {STOP_STIFFNESS, SIDE_STIFFNESS, SPRING_GAP};
        slot = list1[k1];
        count += p[slot] > 0.0;
    }
    for (k2 = 0; k2 < 3; ++k2) {
        static const int list2[3] = {SECOND_STIFFNESS, HAS_ZERO_EDGE, DRIVE_SHARE};
        slot = list2[k2];
        count += p[slot] > 0.0;
    }
    count += drive_has_teeth(p);
    count += p[CLIP_LIMIT] < HUGE_VAL;
    return count;
}

static int drive_side(double x, double edge)
{
    if (x > edge) {
        return 2;
    }
    if (x < (-edge)) {
        return 0;
    }
    return 1;
}

static double drive_pushing(double *state, double command, double *p)
{
    return drive_depends_on_motion(p) ? drive_drawn_current(command, state, p) : command;
}

static int drive_further_corner(int code, double *state, double command, double *p)
{
    double x = 0.0;
    double edge = 0.0;
    x = state[X];
    if (p[SECOND_STIFFNESS] > 0.0) {
        edge = p[SECOND_POSITION];
        code *= 3;
        if (((x - edge) * edge) > 0.0) {
            code += 1;
        }
    }
    if (p[HAS_ZERO_EDGE] != 0.0) {
        code = (3 * code) + drive_side(x, 0.0);
    }
    if (p[DRIVE_SHARE] > 0.0) {
        code = (3 * code) + drive_side(drive_pushing(state, command, p), 0.0);
    }
    return code;
}

static tuple_iddddd drive_corner_of(double *state, double command, double *p)
{
    double x = 0.0;
    int code = 0;
    double stiffness = 0.0;
    double offset = 0.0;
    double teeth = 0.0;
    double teeth_offset = 0.0;
    double clip = 0.0;
    int side = 0;
    double edge = 0.0;
    double force = 0.0;
    double speed = 0.0;
    double wanted = 0.0;
    x = state[X];
    code = 0;
    stiffness = p[STIFFNESS];
    offset = 0.0;
    teeth = 0.0;
    teeth_offset = 0.0;
    clip = 0.0;
    if (p[SPRING_GAP] > 0.0) {
        side = drive_side(x, p[SPRING_GAP]);
        code = side;
        if (side == 1) {
            stiffness = 0.0;
        }
        offset = ((1 - side) * stiffness) * p[SPRING_GAP];
    }
    if (p[STOP_STIFFNESS] > 0.0) {
        side = drive_side(x, p[STOP_POSITION]);
        code = (3 * code) + side;
        if (side != 1) {
            stiffness += p[STOP_STIFFNESS];
            offset += ((1 - side) * p[STOP_STIFFNESS]) * p[STOP_POSITION];
        }
    }
    if (p[SIDE_STIFFNESS] > 0.0) {
        edge = p[SIDE_POSITION];
        code *= 3;
        if (((x - edge) * edge) > 0.0) {
            code += 1;
            stiffness += p[SIDE_STIFFNESS];
            offset -= p[SIDE_STIFFNESS] * edge;
        }
    }
    if (p[HAS_FURTHER_EDGES] != 0.0) {
        code = drive_further_corner(code, state, command, p);
        if (((x - p[SECOND_POSITION]) * p[SECOND_POSITION]) > 0.0) {
            stiffness += p[SECOND_STIFFNESS];
            offset -= p[SECOND_STIFFNESS] * p[SECOND_POSITION];
        }
    }
    if (p[IS_COUPLED] > 0.0) {
        teeth = p[GEAR_STIFFNESS];
    }
    if (drive_has_teeth(p)) {
        force = drive_bite(state[MOTOR_X] - x, state[MOTOR_V] - state[V], p);
        side = 1 + (int)(sign_of(force));
        code = (3 * code) + side;
        if (side != 1) {
            teeth = p[GEAR_STIFFNESS];
            teeth_offset = ((1 - side) * teeth) * p[GEAR_GAP];
        }
    }
    if (p[CLIP_LIMIT] < HUGE_VAL) {
        speed = (p[GEAR_STIFFNESS] > 0.0) ? state[MOTOR_V] : state[V];
        wanted = drive_wanted_current(command, state, p) + (p[CLIP_SLOPE] * speed);
        side = drive_side(wanted, p[CLIP_LIMIT]);
        code = (3 * code) + side;
        clip = side - 1.0;
    }
    return (tuple_iddddd){code, stiffness, offset, teeth, teeth_offset, clip};
}

static double drive_inside(double x, double edge, int side)
{
    if (side == 1) {
        return edge - fabs(x);
    }
    return (side == 2) ? (x - edge) : ((-edge) - x);
}

static double drive_inside_teeth(double *state, int side, double *p)
{
    double twist = 0.0;
    double ahead = 0.0;
    double forward = 0.0;
    double backward = 0.0;
    twist = state[MOTOR_X] - state[X];
    ahead = p[GEAR_DAMPING] / p[GEAR_STIFFNESS];
    ahead *= state[MOTOR_V] - state[V];
    forward = least(twist, twist + ahead) - p[GEAR_GAP];
    backward = least(-twist, (-twist) - ahead) - p[GEAR_GAP];
    if (side == 1) {
        return -most(forward, backward);
    }
    return (side == 2) ? forward : backward;
}

static double drive_margin(double *state, double command, int corner, double *p)
{
    double x = 0.0;
    double left = 0.0;
    double speed = 0.0;
    double wanted = 0.0;
    double edge = 0.0;
    double into = 0.0;
    double gap = 0.0;
    x = state[X];
    left = HUGE_VAL;
    if (p[CLIP_LIMIT] < HUGE_VAL) {
        speed = (p[GEAR_STIFFNESS] > 0.0) ? state[MOTOR_V] : state[V];
        wanted = drive_wanted_current(command, state, p) + (p[CLIP_SLOPE] * speed);
        left = drive_inside(wanted, p[CLIP_LIMIT], corner % 3) / p[CLIP_LIMIT];
        corner /= 3;
    }
    if (drive_has_teeth(p)) {
        left = least(left, drive_inside_teeth(state, corner % 3, p) / p[GEAR_GAP]);
        corner /= 3;
    }
    if (p[DRIVE_SHARE] > 0.0) {
        left = least(left, drive_inside(drive_pushing(state, command, p), 0.0, corner % 3));
        corner /= 3;
    }
    if (p[HAS_ZERO_EDGE] != 0.0) {
        left = least(left, drive_inside(x, 0.0, corner % 3));
        corner /= 3;
    }
    if (p[SECOND_STIFFNESS] > 0.0) {
        edge = p[SECOND_POSITION];
        into = (x - edge) * sign_of(edge);
        left = least(left, (((corner % 3) == 1) ? into : (-into)) / fabs(edge));
        corner /= 3;
    }
    if (p[SIDE_STIFFNESS] > 0.0) {
        edge = p[SIDE_POSITION];
        into = (x - edge) * sign_of(edge);
        left = least(left, (((corner % 3) == 1) ? into : (-into)) / fabs(edge));
        corner /= 3;
    }
    if (p[STOP_STIFFNESS] > 0.0) {
        edge = p[STOP_POSITION];
        left = least(left, drive_inside(x, edge, corner % 3) / edge);
        corner /= 3;
    }
    if (p[SPRING_GAP] > 0.0) {
        gap = p[SPRING_GAP];
        left = least(left, drive_inside(x, gap, corner) / gap);
    }
    return left;
}

static tuple_ddd drive_runge_kutta_stage(int stage, double h)
{
    if (stage == 0) {
        return (tuple_ddd){0.0, 1.0, 0.5 * h};
    }
    if (stage == 3) {
        return (tuple_ddd){h, 1.0, 0.5 * h};
    }
    return (tuple_ddd){0.5 * h, 2.0, (stage == 2) ? h : (0.5 * h)};
}

static int drive_is_wound(double *p)
{
    int is_winding = 0;
    is_winding = (p[RESISTANCE] > 0.0) && (p[INDUCTANCE] > 0.0);
    return is_winding && (p[CLIP_LIMIT] == HUGE_VAL);
}

static double drive_slow_pace(double fast, double phase, double *p)
{
    return least(fast, (2.0 * phase) / p[SAMPLE_TIME]);
}

static double drive_rate_of_winding(double fast, double *state, double *memory, double *push, double done, double *p)
{
    double slow = 0.0;
    int has_motor = 0;
    double speed = 0.0;
    tuple_dddd t1 = {0};
    double gain = 0.0;
    double motor = 0.0;
    tuple_dddd t2 = {0};
    double value = 0.0;
    double trend = 0.0;
    double across = 0.0;
    double drop = 0.0;
    double unsettled = 0.0;
    double share = 0.0;
    slow = drive_slow_pace(fast, 0.3, p);
    if ((slow == fast) || ((p[DRIVE_VARIES] == 0.0) && (!drive_has_losses(p)))) {
        return slow;
    }
    has_motor = p[GEAR_STIFFNESS] > 0.0;
    speed = has_motor ? state[MOTOR_V] : state[V];
    t1 = drive_acceleration(state, memory, push, done, p);
    gain = t1.m0;
    motor = t1.m1;
    t2 = drive_shift(push, DRIVE, done);
    value = t2.m0;
    trend = t2.m1;
    across = value - (p[BACK_EMF] * speed);
    trend -= p[BACK_EMF] * (has_motor ? motor : gain);
    drop = p[RESISTANCE] * state[CIRCUIT];
    unsettled = fabs((drop - across) + (trend / fast));
    share = unsettled / most(fabs(drop) + fabs(across), 1e-300);
    return most(slow, fast * sqrt(sqrt(least(share, 1.0))));
}

static tuple_dd drive_pushed_by_current(double pace, int is_held, double *p)
{
    double motor = 0.0;
    if (p[GEAR_STIFFNESS] > 0.0) {
        motor = p[MASS] * p[MOTOR_SHARE];
        return (tuple_dd){0.0, p[FORCE_CONSTANT] / (pace * motor)};
    }
    return (tuple_dd){is_held ? 0.0 : (p[FORCE_CONSTANT] / (pace * p[MASS])), 0.0};
}

static tuple_dddd drive_fading(double turns)
{
    double rest = 0.0;
    double first = 0.0;
    double second = 0.0;
    double third = 0.0;
    double term = 0.0;
    int n = 0;
    rest = exp(-turns);
    if (turns > 1.0) {
        first = (1.0 - rest) / turns;
        second = (1.0 - first) / turns;
        return (tuple_dddd){rest, first, second, (0.5 - second) / turns};
    }
    third = 0.0;
    term = 1.0 / 6.0;
    for (n = 4; n < 18; ++n) {
        third += term;
        term *= (-turns) / n;
    }
    second = 0.5 - (turns * third);
    return (tuple_dddd){rest, 1.0 - (turns * second), second, third};
}

static void drive_step_wound(double *state, double *trial, double *memory, double *push, double done, double h, int is_held, double *p)
{
    double pace = 0.0;
    tuple_dd t1 = {0};
    double of_mass = 0.0;
    double of_motor = 0.0;
    tuple_dddd t2 = {0};
    double half = 0.0;
    double half1 = 0.0;
    tuple_dddd t3 = {0};
    double whole = 0.0;
    double whole1 = 0.0;
    double whole2 = 0.0;
    double whole3 = 0.0;
    double outer = 0.0;
    double inner = 0.0;
    double first = 0.0;
    double i0 = 0.0;
    double i = 0.0;
    double x0 = 0.0;
    double v0 = 0.0;
    double xm0 = 0.0;
    double vm0 = 0.0;
    double rate0 = 0.0;
    double di = 0.0;
    double dx = 0.0;
    double dv = 0.0;
    double dxm = 0.0;
    double dvm = 0.0;
    double dxp = 0.0;
    double dvp = 0.0;
    int n = 0;
    int stage = 0;
    tuple_ddd t4 = {0};
    double after = 0.0;
    double weight = 0.0;
    double way = 0.0;
    tuple_dddd t5 = {0};
    double a = 0.0;
    double am = 0.0;
    double ap = 0.0;
    double rise = 0.0;
    double rate = 0.0;
    double t6 = 0.0;
    double t7 = 0.0;
    double v = 0.0;
    double vp = 0.0;
    double vm = 0.0;
    double t8 = 0.0;
    double t9 = 0.0;
    double t10 = 0.0;
    double t11 = 0.0;
    double t12 = 0.0;
    double t13 = 0.0;
    pace = p[RESISTANCE] / p[INDUCTANCE];
    t1 = drive_pushed_by_current(pace, is_held, p);
    of_mass = t1.m0;
    of_motor = t1.m1;
    t2 = drive_fading((0.5 * pace) * h);
    half = t2.m0;
    half1 = t2.m1;
    t3 = drive_fading(pace * h);
    whole = t3.m0;
    whole1 = t3.m1;
    whole2 = t3.m2;
    whole3 = t3.m3;
    half1 *= 0.5 * h;
    outer = (whole1 - (3.0 * whole2)) + (4.0 * whole3);
    inner = 2.0 * (whole2 - (2.0 * whole3));
    first = state[CIRCUIT];
    i0 = first;
    i = first;
    x0 = state[X] - ((of_mass / pace) * i);
    v0 = state[V] + (of_mass * i);
    xm0 = state[MOTOR_X] - ((of_motor / pace) * i);
    vm0 = state[MOTOR_V] + (of_motor * i);
    rate0 = 0.0;
    di = rate0;
    dx = rate0;
    dv = rate0;
    dxm = rate0;
    dvm = rate0;
    dxp = rate0;
    dvp = rate0;
    for (n = 0; n < N_STATE; ++n) {
        trial[n] = state[n];
    }
    for (stage = 0; stage < 4; ++stage) {
        t4 = drive_runge_kutta_stage(stage, h);
        after = t4.m0;
        weight = t4.m1;
        way = t4.m2;
        t5 = drive_acceleration(trial, memory, push, done + after, p);
        a = t5.m0;
        am = t5.m1;
        ap = t5.m2;
        rise = t5.m3;
        rate = rise + (pace * i);
        t6 = a + (of_mass * rise);
        t7 = am + (of_motor * rise);
        a = t6;
        am = t7;
        v = trial[V] - ((of_mass / pace) * rise);
        vp = trial[PART_V];
        vm = trial[MOTOR_V] - ((of_motor / pace) * rise);
        if (is_held) {
            a = 0.0;
            v = a;
        }
        t8 = dx + (weight * v);
        t9 = dv + (weight * a);
        t10 = dxm + (weight * vm);
        dx = t8;
        dv = t9;
        dxm = t10;
        t11 = dvm + (weight * am);
        t12 = dxp + (weight * vp);
        t13 = dvp + (weight * ap);
        dvm = t11;
        dxp = t12;
        dvp = t13;
        if (stage == 0) {
            rate0 = rate;
            di = outer * rate;
            first = (half * i0) + (half1 * rate);
            i = first;
        } else {
            if (stage == 1) {
                di += inner * rate;
                i = (half * i0) + (half1 * rate);
            } else {
                if (stage == 2) {
                    di += inner * rate;
                    i = (half * first) + (half1 * ((2.0 * rate) - rate0));
                } else {
                    i = (whole * i0) + (h * (di + (((4.0 * whole3) - whole2) * rate)));
                    way = h / 6.0;
                    v = dx;
                    a = dv;
                    vm = dxm;
                    am = dvm;
                    vp = dxp;
                    ap = dvp;
                }
            }
        }
        trial[CIRCUIT] = i;
        trial[X] = (x0 + (way * v)) + ((of_mass / pace) * i);
        trial[V] = (v0 + (way * a)) - (of_mass * i);
        trial[MOTOR_X] = (xm0 + (way * vm)) + ((of_motor / pace) * i);
        trial[MOTOR_V] = (vm0 + (way * am)) - (of_motor * i);
        trial[PART_X] = state[PART_X] + (way * vp);
        trial[PART_V] = state[PART_V] + (way * ap);
    }
    if (of_motor == 0.0) {
        trial[MOTOR_X] = trial[X];
        trial[MOTOR_V] = trial[V];
    }
}

static int drive_is_always_curved(double *p)
{
    return drive_is_force_curved(p) || (drive_depends_on_motion(p) && drive_has_losses(p));
}

static int drive_touches(double x, double *p)
{
    int is_in_second = 0;
    if ((!drive_is_stop_straight(p)) && (drive_beyond(x, p[STOP_POSITION]) != 0.0)) {
        return 1;
    }
    if ((!drive_is_side_straight(p)) && (drive_beyond_side(x, p[SIDE_POSITION]) != 0.0)) {
        return 1;
    }
    is_in_second = drive_beyond_side(x, p[SECOND_POSITION]) != 0.0;
    return is_in_second && (!drive_is_second_straight(p));
}

static int drive_is_curved_here(double *state, double *memory, double *p)
{
    double speed = 0.0;
    double gone = 0.0;
    if (p[STATIC_EXCESS] != 0.0) {
        speed = memory[WAY] * state[V];
        if ((memory[WAY] != 0.0) && (speed < drive_speed_of_excess(6.1, p))) {
            return 1;
        }
    }
    if ((p[HYSTERESIS_FORCE] != 0.0) && (memory[WAY] != 0.0)) {
        if ((p[HAS_SHAPE] != 0.0) && (memory[WAY] != memory[DEFLECTION])) {
            return 1;
        }
        gone = fabs(state[X] - memory[TURNED_AT]);
        if ((p[HAS_SHAPE] == 0.0) && (gone < (37.0 * p[HYSTERESIS_YIELD]))) {
            return 1;
        }
    }
    return (p[HAS_CONTACT] != 0.0) && drive_touches(state[X], p);
}

static double drive_rate_of_contact(double into, double v, double mass, tuple_dddd law)
{
    tuple_dddd t1 = {0};
    double stiffness = 0.0;
    double bend = 0.0;
    double loss = 0.0;
    double dashpot = 0.0;
    double exponent = 0.0;
    double energy = 0.0;
    double deep = 0.0;
    double steep = 0.0;
    double damping = 0.0;
    t1 = law;
    stiffness = t1.m0;
    bend = t1.m1;
    loss = t1.m2;
    dashpot = t1.m3;
    if ((into == 0.0) || (((bend + loss) + dashpot) == 0.0)) {
        return 0.0;
    }
    exponent = 1.0 + bend;
    energy = ((((0.5 * (exponent + 1.0)) * mass) * v) * v) / stiffness;
    deep = fabs(into) + pow(energy, 1.0 / (exponent + 1.0));
    steep = (stiffness * pow(deep, bend)) * (1.0 + (loss * fabs(v)));
    damping = ((loss * steep) * deep) + dashpot;
    return 2.0 * (sqrt((exponent * steep) / mass) + (damping / mass));
}

static double drive_contact_rate(double x, double low, double high, double v, double mass, double *p)
{
    double into = 0.0;
    double loss = 0.0;
    double dashpot = 0.0;
    tuple_dddd law = {0};
    double rate = 0.0;
    into = drive_beyond(x, p[STOP_POSITION]);
    if ((into == 0.0) && (most(high, -low) > p[STOP_POSITION])) {
        into = 1e-300;
    }
    loss = p[STOP_LOSS];
    dashpot = p[STOP_DASHPOT];
    law = (tuple_dddd){p[STOP_STIFFNESS], p[STOP_BEND], loss, dashpot};
    rate = drive_rate_of_contact(into, v, mass, law);
    into = drive_beyond_side(x, p[SIDE_POSITION]);
    if ((into == 0.0) && drive_reaches_side(low, high, p[SIDE_POSITION])) {
        into = 1e-300;
    }
    loss = p[SIDE_LOSS];
    dashpot = p[SIDE_DASHPOT];
    law = (tuple_dddd){p[SIDE_STIFFNESS], p[SIDE_BEND], loss, dashpot};
    rate += drive_rate_of_contact(into, v, mass, law);
    into = drive_beyond_side(x, p[SECOND_POSITION]);
    if ((into == 0.0) && drive_reaches_side(low, high, p[SECOND_POSITION])) {
        into = 1e-300;
    }
    loss = p[SECOND_LOSS];
    dashpot = p[SECOND_DASHPOT];
    law = (tuple_dddd){p[SECOND_STIFFNESS], p[SECOND_BEND], loss, dashpot};
    return rate + drive_rate_of_contact(into, v, mass, law);
}

static tuple_dd drive_places_ahead(double *state, double *memory, double *push, double done, double *p)
{
    double x = 0.0;
    double v = 0.0;
    double stiffness = 0.0;
    double time = 0.0;
    double ahead = 0.0;
    double further = 0.0;
    x = state[X];
    v = state[V];
    stiffness = p[STOP_STIFFNESS] + p[SIDE_STIFFNESS];
    if ((stiffness + p[SECOND_STIFFNESS]) == 0.0) {
        return (tuple_dd){x, x};
    }
    time = p[SAMPLE_TIME];
    ahead = x + (time * v);
    further = ahead + (((0.5 * time) * time) * drive_acceleration(state, memory, push, done, p).m0);
    return (tuple_dd){least(x, least(ahead, further)), most(x, most(ahead, further))};
}

static tuple_dd drive_further_stiffness(double *state, double *push, double done, double *p)
{
    double waves = 0.0;
    double stiffness = 0.0;
    double turn = 0.0;
    double force = 0.0;
    waves = 0.0;
    stiffness = waves;
    if (p[SECOND_COGGING_FORCE] != 0.0) {
        turn = 6.283185307179586 / p[SECOND_COGGING_PERIOD];
        stiffness += fabs(p[SECOND_COGGING_FORCE]) * turn;
        waves += turn;
    }
    if (p[WAVY_FRICTION] != 0.0) {
        turn = 6.283185307179586 / p[WAVY_PERIOD];
        stiffness += fabs(p[WAVY_FRICTION]) * turn;
        waves += turn;
    }
    if (p[RIPPLE_SHARE] != 0.0) {
        turn = p[RIPPLE_PER_TURN];
        force = fabs(drive_drive_now(state, push, done, p));
        stiffness += (fabs(p[RIPPLE_SHARE]) * force) * turn;
        waves += turn;
    }
    return (tuple_dd){stiffness, waves};
}

static double drive_rate_of_inner(double *state, double *memory, double *push, double done, double mass, double *p)
{
    double rate = 0.0;
    double both = 0.0;
    double fast = 0.0;
    rate = 0.0;
    if (p[MODE_MASS] > 0.0) {
        both = (1.0 / p[MODE_MASS]) + (1.0 / mass);
        rate += sqrt(p[MODE_STIFFNESS] * both) + (p[MODE_DAMPING] * both);
    }
    if (p[INDUCTANCE] > 0.0) {
        fast = p[RESISTANCE] / p[INDUCTANCE];
        if (drive_is_wound(p)) {
            fast = drive_rate_of_winding(fast, state, memory, push, done, p);
        }
        rate += fast;
    }
    return rate;
}

static double drive_rate_of_bending(double *state, double *memory, double mass, double *p)
{
    double v = 0.0;
    double force = 0.0;
    double level = 0.0;
    double slope = 0.0;
    double stiffness = 0.0;
    double speed = 0.0;
    double rate = 0.0;
    double falls = 0.0;
    v = state[V];
    force = fabs(p[HYSTERESIS_FORCE]);
    level = drive_bristle_level(v, p);
    if (fabs(v) > (6.1 * p[BRISTLE_VELOCITY])) {
        level = 1.0;
    }
    slope = fabs(1.0 - ((memory[WAY] * memory[DEFLECTION]) / level));
    stiffness = (force * slope) / p[HYSTERESIS_YIELD];
    speed = fabs(v) / p[HYSTERESIS_YIELD];
    rate = sqrt(stiffness / mass) + ((p[BRISTLE_DAMPING] * slope) / mass);
    rate += (0.6 * speed) * sqrt(sqrt(least(0.5 * slope, 1.0)));
    if (level > 1.0) {
        falls = (force * p[BRISTLE_EXCESS]) / (mass * p[BRISTLE_VELOCITY]);
        rate += least(falls, sqrt(falls * speed));
    }
    return rate;
}

static double drive_rate_in_shape(double *state, double *memory, double mass, double *p)
{
    double ahead = 0.0;
    double exponent = 0.0;
    double slope = 0.0;
    double stiffness = 0.0;
    double fading = 0.0;
    double speed = 0.0;
    ahead = memory[WAY] * memory[DEFLECTION];
    if ((memory[WAY] == 0.0) || ((1.0 - ahead) <= 1e-14)) {
        return 0.0;
    }
    exponent = 1.0 + p[HYSTERESIS_BEND];
    slope = most(drive_yielding(ahead, p), 1.0 - ahead);
    stiffness = (slope * fabs(p[HYSTERESIS_FORCE])) / p[HYSTERESIS_YIELD];
    fading = least(0.5 * slope, 1.0);
    speed = (exponent * fabs(state[V])) / p[HYSTERESIS_YIELD];
    return sqrt(stiffness / mass) + ((0.6 * speed) * sqrt(sqrt(fading)));
}

static double drive_rate_of_yielding(double *state, double *memory, double mass, double *p)
{
    double gone = 0.0;
    double fading = 0.0;
    double stiffness = 0.0;
    double speed = 0.0;
    if (p[HAS_BRISTLES] != 0.0) {
        return drive_rate_of_bending(state, memory, mass, p);
    }
    if (p[HAS_SHAPE] != 0.0) {
        return drive_rate_in_shape(state, memory, mass, p);
    }
    gone = fabs(state[X] - memory[TURNED_AT]) / p[HYSTERESIS_YIELD];
    if (gone >= 37.0) {
        return 0.0;
    }
    fading = exp(-gone);
    stiffness = (2.0 * fabs(p[HYSTERESIS_FORCE])) / p[HYSTERESIS_YIELD];
    speed = fabs(state[V]) / p[HYSTERESIS_YIELD];
    return sqrt((stiffness * fading) / mass) + ((0.6 * speed) * sqrt(sqrt(fading)));
}

static int drive_may_jump(double *state, double *memory, double *push, double done, double *p)
{
    double at = 0.0;
    double x = 0.0;
    double v = 0.0;
    double time = 0.0;
    double pull = 0.0;
    double reach = 0.0;
    double here = 0.0;
    int n = 0;
    double place = 0.0;
    at = p[OWN_JUMPS];
    if (at == 0.0) {
        return 1;
    }
    x = state[X];
    v = state[V];
    time = 6.0 * p[SAMPLE_TIME];
    pull = drive_acceleration(state, memory, push, done, p).m0;
    reach = time * (fabs(v) + ((0.5 * time) * fabs(pull)));
    here = drive_formula_value(at, x, v, 0.0, 0.0, 0.0, p);
    for (n = -JUMP_POINTS; n < JUMP_POINTS + 1; ++n) {
        place = x + ((n * reach) / JUMP_POINTS);
        if (drive_formula_value(at, place, v, 0.0, 0.0, 0.0, p) != here) {
            return 1;
        }
    }
    return 0;
}

static double drive_rate_of_own(double *state, double *memory, double *push, double done, double mass, double *p)
{
    double x = 0.0;
    double v = 0.0;
    double way = 0.0;
    double dx = 0.0;
    double dv = 0.0;
    double here = 0.0;
    double stiffness = 0.0;
    double way_on = 0.0;
    double ahead = 0.0;
    double edge = 0.0;
    double damping = 0.0;
    double rate = 0.0;
    x = state[X];
    v = state[V];
    way = memory[WAY];
    dx = 0.0001 * p[REFERENCE_DISPLACEMENT];
    dv = 0.0001 * (fabs(v) + (30.0 * p[REFERENCE_DISPLACEMENT]));
    if (((way * v) < dv) && (way < 0.0)) {
        dv = -dv;
    }
    here = drive_own_force(x, v, way, push, done, p);
    stiffness = fabs(drive_own_force(x + dx, v, way, push, done, p) - here) / dx;
    if (p[OWN_BENDS] > 0.0) {
        way_on = (6.0 * p[SAMPLE_TIME]) * v;
        if (fabs(way_on) > dx) {
            ahead = drive_own_force(x + way_on, v, way, push, done, p);
            edge = drive_own_force((x + way_on) + dx, v, way, push, done, p);
            stiffness = most(stiffness, fabs(edge - ahead) / dx);
        }
    }
    damping = (drive_own_force(x, v + dv, way, push, done, p) - here) / dv;
    rate = sqrt(stiffness / mass) + (fabs(damping) / mass);
    rate += ((0.12 * p[OWN_WAVES]) * fabs(v)) + (0.12 * p[OWN_TURNING]);
    if ((p[OWN_FINENESS] > 0.0) && drive_may_jump(state, memory, push, done, p)) {
        rate += (0.3 * p[OWN_FINENESS]) / p[SAMPLE_TIME];
    }
    return rate;
}

static double drive_step_limit(double *state, double *memory, double *push, double done, int is_exponential, double *p)
{
    double mass = 0.0;
    double x = 0.0;
    double v = 0.0;
    double speed = 0.0;
    tuple_dd t1 = {0};
    double low = 0.0;
    double high = 0.0;
    double stiffness = 0.0;
    double damping = 0.0;
    double resistance = 0.0;
    double turn = 0.0;
    double turning = 0.0;
    tuple_dd t2 = {0};
    double more = 0.0;
    double rate = 0.0;
    double pull = 0.0;
    double ahead = 0.0;
    double fast = 0.0;
    double slow = 0.0;
    mass = drive_moved_mass(p);
    x = state[X];
    v = state[V];
    speed = fabs(v);
    t1 = drive_places_ahead(state, memory, push, done, p);
    low = t1.m0;
    high = t1.m1;
    stiffness = drive_spring_rate(x, low, high, p);
    damping = p[DAMPING] + ((2.0 * fabs(p[DRAG])) * speed);
    if (!is_exponential) {
        if (p[GEAR_STIFFNESS] > 0.0) {
            mass = least(mass, p[MASS] - mass);
            if (fabs(state[MOTOR_X] - x) > p[GEAR_GAP]) {
                stiffness += p[GEAR_STIFFNESS];
                damping += p[GEAR_DAMPING];
            }
        }
        if (p[CLIP_LIMIT] < HUGE_VAL) {
            damping += p[FORCE_CONSTANT] * p[CLIP_SLOPE];
        }
        if (p[RESISTANCE] > 0.0) {
            resistance = p[RESISTANCE];
            damping += (p[FORCE_CONSTANT] * p[BACK_EMF]) / resistance;
        }
    }
    if (p[COGGING_FORCE] != 0.0) {
        turn = 6.283185307179586 / p[COGGING_PERIOD];
        stiffness += fabs(p[COGGING_FORCE]) * turn;
        damping += ((0.12 * mass) * turn) * speed;
    }
    turning = 0.0;
    if ((p[HAS_MORE] != 0.0) || (p[DRIVE_VARIES] != 0.0)) {
        t2 = drive_further_stiffness(state, push, done, p);
        more = t2.m0;
        turning = t2.m1;
        stiffness += more;
        turning *= 0.12 * speed;
    }
    rate = (sqrt(stiffness / mass) + (damping / mass)) + turning;
    if (p[DRAG] != 0.0) {
        pull = fabs(drive_acceleration(state, memory, push, done, p).m0);
        ahead = drive_acceleration(state, memory, push, p[SAMPLE_TIME], p).m0;
        fast = 2.0 * sqrt((fabs(p[DRAG]) * most(pull, fabs(ahead))) / mass);
        if ((fast * p[SAMPLE_TIME]) > 1.0) {
            rate += fast;
        }
    }
    if (p[HAS_CONTACT] != 0.0) {
        rate += drive_contact_rate(x, low, high, v, mass, p);
    }
    if (!is_exponential) {
        rate += drive_rate_of_inner(state, memory, push, done, mass, p);
    } else {
        if (p[INDUCTANCE] > 0.0) {
            rate += drive_slow_pace(p[RESISTANCE] / p[INDUCTANCE], 0.3, p);
        }
    }
    if (p[HYSTERESIS_FORCE] != 0.0) {
        rate += drive_rate_of_yielding(state, memory, mass, p);
    }
    if (p[OWN_FORCE] != 0.0) {
        rate += drive_rate_of_own(state, memory, push, done, mass, p);
    }
    slow = p[BRISTLE_VELOCITY];
    if ((p[BRISTLE_EXCESS] != 0.0) && (speed < (6.1 * slow))) {
        pull = fabs(drive_acceleration(state, memory, push, done, p).m0);
        rate += (0.5 * pull) / slow;
    }
    if ((p[STATIC_EXCESS] != 0.0) && (memory[WAY] != 0.0)) {
        slow = p[STRIBECK_VELOCITY];
        if (speed < drive_speed_of_excess(6.1, p)) {
            pull = fabs(drive_acceleration(state, memory, push, done, p).m0);
            rate += (fabs(p[STATIC_EXCESS]) / (mass * slow)) + ((0.5 * pull) / slow);
        }
    }
    return 0.3 / most(rate, 1e-09);
}

static tuple_dd drive_step_varying(double x, double v, double *memory, double *push, double done, double h, double *p)
{
    double inverse = 0.0;
    double xs = 0.0;
    double vs = 0.0;
    double x1 = 0.0;
    double v1 = 0.0;
    int stage = 0;
    tuple_ddd t1 = {0};
    double after = 0.0;
    double weight = 0.0;
    double way = 0.0;
    double at = 0.0;
    double drive = 0.0;
    double net = 0.0;
    double slope = 0.0;
    inverse = 1.0 / p[MASS];
    xs = x;
    vs = v;
    x1 = x;
    v1 = v;
    for (stage = 0; stage < 4; ++stage) {
        t1 = drive_runge_kutta_stage(stage, h);
        after = t1.m0;
        weight = t1.m1;
        way = t1.m2;
        at = done + after;
        drive = drive_value_of(push, DRIVE, at) * drive_ripple(xs, p);
        net = (drive + drive_value_of(push, OTHER, at)) - drive_resisting(xs, vs, memory, p);
        net -= (memory[WAY] * p[DRIVE_SHARE]) * fabs(drive);
        if (p[OWN_FORCE] != 0.0) {
            net += drive_own_force(xs, vs, memory[WAY], push, at, p);
        }
        slope = vs;
        weight *= h / 6.0;
        x1 += weight * slope;
        v1 += (weight * net) * inverse;
        xs = x + (way * slope);
        vs = v + ((way * net) * inverse);
    }
    return (tuple_dd){x1, v1};
}

static tuple_dd drive_step_in_drag(double x, double v, double free, double h, double *p)
{
    double slow = 0.0;
    double impulse = 0.0;
    double root = 0.0;
    double speed = 0.0;
    slow = p[MASS] / h;
    impulse = free + (slow * v);
    slow += p[DAMPING];
    root = sqrt((slow * slow) + ((4.0 * p[DRAG]) * fabs(impulse)));
    speed = (2.0 * impulse) / (slow + root);
    return (tuple_dd){x + (h * speed), speed};
}

static tuple_dd drive_step_plain(double x, double v, double *memory, double *push, double done, double h, double *p)
{
    double half = 0.0;
    double inverse = 0.0;
    tuple_dddd t1 = {0};
    double a0 = 0.0;
    double b0 = 0.0;
    double c0 = 0.0;
    double d0 = 0.0;
    tuple_dddd t2 = {0};
    double a1 = 0.0;
    double b1 = 0.0;
    double c1 = 0.0;
    double d1 = 0.0;
    double first = 0.0;
    double b = 0.0;
    double c = 0.0;
    double d = 0.0;
    double middle = 0.0;
    double last = 0.0;
    double free = 0.0;
    double fast = 0.0;
    double k1 = 0.0;
    double v2 = 0.0;
    double k2 = 0.0;
    double v3 = 0.0;
    double k3 = 0.0;
    double v4 = 0.0;
    double k4 = 0.0;
    double sixth = 0.0;
    if (p[HAS_CONTACT] != 0.0) {
        drive_touch(x, memory, p);
    }
    if ((p[DRIVE_VARIES] != 0.0) || (p[OWN_FORCE] != 0.0)) {
        return drive_step_varying(x, v, memory, push, done, h, p);
    }
    half = 0.5 * h;
    inverse = 1.0 / p[MASS];
    t1 = drive_shift(push, DRIVE, done);
    a0 = t1.m0;
    b0 = t1.m1;
    c0 = t1.m2;
    d0 = t1.m3;
    t2 = drive_shift(push, OTHER, done);
    a1 = t2.m0;
    b1 = t2.m1;
    c1 = t2.m2;
    d1 = t2.m3;
    first = a0 + a1;
    b = b0 + b1;
    c = c0 + c1;
    d = d0 + d1;
    middle = first + (half * (b + (half * (c + (half * d)))));
    last = first + (h * (b + (h * (c + (h * d)))));
    if (p[DRAG] > 0.0) {
        free = last - drive_resisting(x, 0.0, memory, p);
        fast = (fabs(v) * p[DRAG]) + sqrt(fabs(free) * p[DRAG]);
        if ((((2.0 * fast) * h) * inverse) > 2.0) {
            return drive_step_in_drag(x, v, free, h, p);
        }
    }
    k1 = (first - drive_resisting(x, v, memory, p)) * inverse;
    v2 = v + (half * k1);
    k2 = (middle - drive_resisting(x + (half * v), v2, memory, p)) * inverse;
    v3 = v + (half * k2);
    k3 = (middle - drive_resisting(x + (half * v2), v3, memory, p)) * inverse;
    v4 = v + (h * k3);
    k4 = (last - drive_resisting(x + (h * v3), v4, memory, p)) * inverse;
    sixth = h / 6.0;
    return (tuple_dd){x + (sixth * ((v + (2.0 * (v2 + v3))) + v4)), v + (sixth * ((k1 + (2.0 * (k2 + k3))) + k4))};
}

static void drive_step_coupled(double *state, double *trial, double *memory, double *push, double done, double h, int is_held, double *p)
{
    double load = 0.0;
    double x0 = 0.0;
    double v0 = 0.0;
    double xm0 = 0.0;
    double vm0 = 0.0;
    double x = 0.0;
    double v = 0.0;
    double xm = 0.0;
    double vm = 0.0;
    double dvm = 0.0;
    double dx = 0.0;
    double dv = 0.0;
    double dxm = 0.0;
    int stage = 0;
    tuple_ddd t1 = {0};
    double after = 0.0;
    double weight = 0.0;
    double way = 0.0;
    double at = 0.0;
    double force = 0.0;
    tuple_dd t2 = {0};
    double net = 0.0;
    double motor = 0.0;
    double speed = 0.0;
    double gain = 0.0;
    int n = 0;
    double sixth = 0.0;
    load = p[MASS];
    load -= p[MOTOR_SHARE] * load;
    x0 = state[X];
    v0 = state[V];
    xm0 = state[MOTOR_X];
    vm0 = state[MOTOR_V];
    x = x0;
    v = v0;
    xm = xm0;
    vm = vm0;
    dvm = 0.0;
    dx = dvm;
    dv = dvm;
    dxm = dvm;
    for (stage = 0; stage < 4; ++stage) {
        t1 = drive_runge_kutta_stage(stage, h);
        after = t1.m0;
        weight = t1.m1;
        way = t1.m2;
        at = done + after;
        force = drive_value_of(push, DRIVE, at);
        t2 = drive_net_forces(x, v, xm, vm, force, memory, push, at, p);
        net = t2.m0;
        motor = t2.m1;
        speed = v;
        gain = net / load;
        if (is_held) {
            gain = 0.0;
            speed = gain;
        }
        dx += weight * speed;
        dv += weight * gain;
        dxm += weight * vm;
        dvm += weight * motor;
        x = x0 + (way * speed);
        v = v0 + (way * gain);
        xm = xm0 + (way * vm);
        vm = vm0 + (way * motor);
    }
    for (n = 0; n < N_STATE; ++n) {
        trial[n] = state[n];
    }
    sixth = h / 6.0;
    trial[X] = x0 + (sixth * dx);
    trial[V] = v0 + (sixth * dv);
    trial[MOTOR_X] = xm0 + (sixth * dxm);
    trial[MOTOR_V] = vm0 + (sixth * dvm);
}

static void drive_step_all(double *state, double *trial, double *memory, double *push, double done, double h, int is_held, double *p)
{
    int each = 0;
    int n = 0;
    int stage = 0;
    tuple_ddd t1 = {0};
    double after = 0.0;
    double weight = 0.0;
    double way = 0.0;
    tuple_dddd t2 = {0};
    double a = 0.0;
    double motor = 0.0;
    double part = 0.0;
    double circuit = 0.0;
    double total[N_STATE];
    double slope[N_STATE];
    if (p[HAS_CONTACT] != 0.0) {
        drive_touch(state[X], memory, p);
    }
    if ((p[MODE_MASS] == 0.0) && (!drive_depends_on_motion(p))) {
        drive_step_coupled(state, trial, memory, push, done, h, is_held, p);
        return;
    }
    if (drive_is_wound(p)) {
        drive_step_wound(state, trial, memory, push, done, h, is_held, p);
        return;
    }
    for (each = 0; each < N_STATE; ++each) {
        total[each] = 0.0;
    }
    for (each = 0; each < N_STATE; ++each) {
        slope[each] = 0.0;
    }
    for (n = 0; n < N_STATE; ++n) {
        trial[n] = state[n];
    }
    for (stage = 0; stage < 4; ++stage) {
        t1 = drive_runge_kutta_stage(stage, h);
        after = t1.m0;
        weight = t1.m1;
        way = t1.m2;
        t2 = drive_acceleration(trial, memory, push, done + after, p);
        a = t2.m0;
        motor = t2.m1;
        part = t2.m2;
        circuit = t2.m3;
        slope[0] = trial[V];
        slope[1] = a;
        if (is_held) {
            slope[0] = 0.0;
            slope[1] = 0.0;
        }
        slope[2] = trial[MOTOR_V];
        slope[3] = motor;
        slope[4] = trial[PART_V];
        slope[5] = part;
        slope[6] = circuit;
        for (n = 0; n < N_STATE; ++n) {
            total[n] += weight * slope[n];
            trial[n] = state[n] + (way * slope[n]);
        }
    }
    for (n = 0; n < N_STATE; ++n) {
        trial[n] = state[n] + ((h / 6.0) * total[n]);
    }
}

static double drive_fastest(double *p)
{
    double mass = 0.0;
    double stiffness = 0.0;
    double damping = 0.0;
    double share = 0.0;
    double rate = 0.0;
    double both = 0.0;
    mass = p[MASS];
    stiffness = p[STIFFNESS];
    if (drive_is_stop_straight(p)) {
        stiffness += p[STOP_STIFFNESS];
    }
    if (drive_is_side_straight(p)) {
        stiffness += p[SIDE_STIFFNESS];
    }
    if (drive_is_second_straight(p)) {
        stiffness += p[SECOND_STIFFNESS];
    }
    damping = p[DAMPING];
    if (p[GEAR_STIFFNESS] > 0.0) {
        share = p[MOTOR_SHARE];
        mass *= least(share, 1.0 - share);
        stiffness += p[GEAR_STIFFNESS];
        damping += p[GEAR_DAMPING] + p[MOTOR_DAMPING];
    }
    if (p[CLIP_LIMIT] < HUGE_VAL) {
        damping += p[FORCE_CONSTANT] * p[CLIP_SLOPE];
    }
    if (p[RESISTANCE] > 0.0) {
        damping += (p[FORCE_CONSTANT] * p[BACK_EMF]) / p[RESISTANCE];
    }
    rate = sqrt(stiffness / mass) + (damping / mass);
    if (p[MODE_MASS] > 0.0) {
        both = (1.0 / p[MODE_MASS]) + (1.0 / mass);
        rate += sqrt(p[MODE_STIFFNESS] * both);
        rate += p[MODE_DAMPING] * both;
    }
    if (p[INDUCTANCE] > 0.0) {
        rate += p[RESISTANCE] / p[INDUCTANCE];
    }
    return rate;
}

static double drive_coefficient(double *inputs, int first, int n, double at)
{
    double d = 0.0;
    double c = 0.0;
    double b = 0.0;
    double a = 0.0;
    d = inputs[first + 3];
    if (n == 3) {
        return d;
    }
    c = inputs[first + 2];
    if (n == 2) {
        return c + ((3.0 * at) * d);
    }
    b = inputs[first + 1];
    if (n == 1) {
        return b + (at * ((2.0 * c) + ((3.0 * at) * d)));
    }
    a = (first == DRIVEN) ? inputs[first] : 0.0;
    return a + (at * (b + (at * (c + (at * d)))));
}

static void drive_sum_series(double *state, double *out, double *inputs, double length, tuple_iddddd corner, int is_held, double rate, double *p)
{
    tuple_iddddd t1 = {0};
    double k = 0.0;
    double offset = 0.0;
    double teeth = 0.0;
    double teeth_offset = 0.0;
    double clip = 0.0;
    int has_motor = 0;
    int has_mode = 0;
    double resistance = 0.0;
    double inductance = 0.0;
    int is_current = 0;
    double gain = 0.0;
    double emf = 0.0;
    double damping = 0.0;
    double k2 = 0.0;
    double c2 = 0.0;
    double inner = 0.0;
    double mass = 0.0;
    double part = 0.0;
    double teeth_damping = 0.0;
    double motor_damping = 0.0;
    int count = 0;
    double h = 0.0;
    int n_terms = 0;
    int n = 0;
    int turn = 0;
    double at = 0.0;
    double x = 0.0;
    double v = 0.0;
    double xm = 0.0;
    double vm = 0.0;
    double xp = 0.0;
    double vp = 0.0;
    double i = 0.0;
    double power = 0.0;
    double drive = 0.0;
    double other = 0.0;
    double one = 0.0;
    double step = 0.0;
    double speed = 0.0;
    double di = 0.0;
    double current = 0.0;
    double force = 0.0;
    double am = 0.0;
    double bite = 0.0;
    double net = 0.0;
    double ap = 0.0;
    double pull = 0.0;
    t1 = corner;
    k = t1.m1;
    offset = t1.m2;
    teeth = t1.m3;
    teeth_offset = t1.m4;
    clip = t1.m5;
    has_motor = p[GEAR_STIFFNESS] > 0.0;
    has_mode = p[MODE_MASS] > 0.0;
    resistance = p[RESISTANCE];
    inductance = p[INDUCTANCE];
    is_current = (resistance > 0.0) || (p[CLIP_LIMIT] < HUGE_VAL);
    gain = is_current ? p[FORCE_CONSTANT] : 1.0;
    emf = p[BACK_EMF];
    damping = p[DAMPING];
    k2 = p[MODE_STIFFNESS];
    c2 = p[MODE_DAMPING];
    inner = has_motor ? (p[MOTOR_SHARE] * p[MASS]) : 1.0;
    mass = has_motor ? (p[MASS] - inner) : p[MASS];
    part = has_mode ? p[MODE_MASS] : 1.0;
    teeth_damping = (teeth > 0.0) ? p[GEAR_DAMPING] : 0.0;
    motor_damping = p[MOTOR_DAMPING];
    count = (int)most(1, (int)(ceil((length * rate) / 1.0)));
    h = length / count;
    n_terms = ((h * rate) <= 0.25) ? FEW_TERMS : N_TERMS;
    for (n = 0; n < N_STATE; ++n) {
        out[n] = state[n];
    }
    for (turn = 0; turn < count; ++turn) {
        at = turn * h;
        x = out[0];
        v = out[1];
        xm = out[2];
        vm = out[3];
        xp = out[4];
        vp = out[5];
        i = out[6];
        power = 1.0;
        for (n = 0; n < n_terms; ++n) {
            drive = 0.0;
            other = 0.0;
            one = 0.0;
            if (n < 4) {
                drive = drive_coefficient(inputs, DRIVEN, n, at) * power;
                other = drive_coefficient(inputs, OTHERS - 1, n, at) * power;
                power *= h;
            }
            if (n == 0) {
                one = inputs[OFFSET];
                other += inputs[STEADY];
            }
            step = h * parts[n];
            speed = has_motor ? vm : v;
            di = 0.0;
            current = drive;
            if (resistance > 0.0) {
                if (inductance > 0.0) {
                    di = ((drive - (emf * speed)) - (resistance * i)) / inductance;
                    current = i;
                } else {
                    current = (drive - (emf * speed)) / resistance;
                }
            }
            if (clip != 0.0) {
                current = ((clip * p[CLIP_LIMIT]) * one) - (p[CLIP_SLOPE] * speed);
            }
            force = gain * current;
            am = 0.0;
            if (has_motor) {
                bite = ((teeth * (xm - x)) + (teeth_offset * one)) + (teeth_damping * (vm - v));
                am = ((force - bite) - (motor_damping * vm)) / inner;
                force = bite;
            }
            net = (((force + other) - (offset * one)) - (damping * v)) - (k * x);
            ap = 0.0;
            if (has_mode) {
                pull = (k2 * (xp - x)) + (c2 * (vp - v));
                net += pull;
                ap = (-pull) / part;
            }
            if (is_held) {
                x = 0.0;
                v = 0.0;
            } else {
                x = step * v;
                v = (step * net) / mass;
            }
            xm = step * vm;
            vm = step * am;
            xp = step * vp;
            vp = step * ap;
            i = step * di;
            out[0] += x;
            out[1] += v;
            out[2] += xm;
            out[3] += vm;
            out[4] += xp;
            out[5] += vp;
            out[6] += i;
        }
    }
}

static tuple_dd drive_sum_plain(double x, double v, tuple_dddd inputs, double length, double stiffness, double rate, double *p)
{
    tuple_dddd t1 = {0};
    double a = 0.0;
    double b = 0.0;
    double c = 0.0;
    double d = 0.0;
    double per_mass = 0.0;
    double t2 = 0.0;
    double damping = 0.0;
    double t3 = 0.0;
    int count = 0;
    double h = 0.0;
    int n_terms = 0;
    int _ = 0;
    double dx = 0.0;
    double dv = 0.0;
    double one = 0.0;
    double two = 0.0;
    double force = 0.0;
    double power = 0.0;
    int n = 0;
    double push = 0.0;
    double step = 0.0;
    double t4 = 0.0;
    double t5 = 0.0;
    t1 = inputs;
    a = t1.m0;
    b = t1.m1;
    c = t1.m2;
    d = t1.m3;
    per_mass = 1.0 / p[MASS];
    t2 = p[DAMPING] * per_mass;
    t3 = stiffness * per_mass;
    damping = t2;
    stiffness = t3;
    count = (int)most(1, (int)(ceil((length * rate) / 1.0)));
    h = length / count;
    n_terms = ((h * rate) <= 0.25) ? FEW_TERMS : N_TERMS;
    for (_ = 0; _ < count; ++_) {
        dx = h * v;
        dv = h * (((a * per_mass) - (damping * v)) - (stiffness * x));
        one = x + dx;
        two = v + dv;
        force = b * per_mass;
        power = h;
        for (n = 1; n < n_terms; ++n) {
            push = 0.0;
            if (n < 4) {
                push = force * power;
                force = ((n == 1) ? c : d) * per_mass;
                power *= h;
            }
            step = h * parts[n];
            t4 = step * dv;
            t5 = step * ((push - (damping * dv)) - (stiffness * dx));
            dx = t4;
            dv = t5;
            one += dx;
            two += dv;
        }
        x = one;
        v = two;
        a += h * (b + (h * (c + (h * d))));
        b += h * ((2.0 * c) + ((3.0 * h) * d));
        c += (3.0 * h) * d;
    }
    return (tuple_dd){x, v};
}

static double drive_steady_force(double *memory, double *p)
{
    double way = 0.0;
    double force = 0.0;
    double level = 0.0;
    way = memory[WAY];
    if (way == 0.0) {
        force = (-p[HYSTERESIS_FORCE]) * memory[DEFLECTION];
    } else {
        level = (way > 0.0) ? p[FRICTION_FORWARD] : p[FRICTION_BACKWARD];
        force = (-way) * (level + p[HYSTERESIS_FORCE]);
    }
    if (p[PRELOAD] > 0.0) {
        force -= memory[SIDE] * p[PRELOAD];
    }
    return force;
}

static int drive_stays(double *p)
{
    return p[GEAR_STIFFNESS] == 0.0;
}

static void drive_set_inputs(double *inputs, double *memory, double *push, double done, double *p)
{
    tuple_dddd t1 = {0};
    double a = 0.0;
    double b = 0.0;
    double c = 0.0;
    double d = 0.0;
    tuple_dddd t2 = {0};
    t1 = drive_shift(push, DRIVE, done);
    a = t1.m0;
    b = t1.m1;
    c = t1.m2;
    d = t1.m3;
    inputs[DRIVEN] = a;
    inputs[DRIVEN + 1] = b;
    inputs[DRIVEN + 2] = c;
    inputs[DRIVEN + 3] = d;
    t2 = drive_shift(push, OTHER, done);
    a = t2.m0;
    b = t2.m1;
    c = t2.m2;
    d = t2.m3;
    inputs[OFFSET] = 1.0;
    inputs[STEADY] = a + drive_steady_force(memory, p);
    inputs[OTHERS] = b;
    inputs[OTHERS + 1] = c;
    inputs[OTHERS + 2] = d;
}

static void drive_advance(double *state, double *trial, double *memory, double *push, double done, double h, tuple_iddddd corner, int is_held, tuple_iiiiid kind, double *inputs, double *p)
{
    tuple_iiiiid t1 = {0};
    int has_inner = 0;
    int is_curved = 0;
    int is_curved_at_times = 0;
    double rate = 0.0;
    tuple_dddd cubic = {0};
    tuple_dd t2 = {0};
    double x = 0.0;
    double v = 0.0;
    tuple_dd t3 = {0};
    t1 = kind;
    has_inner = t1.m0;
    is_curved = t1.m2;
    is_curved_at_times = t1.m4;
    rate = t1.m5;
    if (is_held && (!has_inner)) {
        trial[X] = state[X];
        trial[V] = state[V];
        return;
    }
    if (is_held && drive_stays(p)) {
        is_curved = 0;
    } else {
        if (is_curved_at_times && (!is_curved)) {
            is_curved = drive_is_curved_here(state, memory, p);
        }
    }
    if (!is_curved) {
        drive_set_inputs(inputs, memory, push, done, p);
        if (has_inner) {
            drive_sum_series(state, trial, inputs, h, corner, is_held, rate, p);
        } else {
            cubic = (tuple_dddd){(inputs[DRIVEN] + inputs[STEADY]) - corner.m2, inputs[DRIVEN + 1] + inputs[OTHERS], inputs[DRIVEN + 2] + inputs[OTHERS + 1], inputs[DRIVEN + 3] + inputs[OTHERS + 2]};
            t2 = drive_sum_plain(state[X], state[V], cubic, h, corner.m1, rate, p);
            x = t2.m0;
            v = t2.m1;
            trial[X] = x;
            trial[V] = v;
        }
        if (is_held || (p[STATIC_EXCESS] == 0.0)) {
            return;
        }
        if ((memory[WAY] * trial[V]) > drive_speed_of_excess(5.0, p)) {
            return;
        }
    }
    if (has_inner) {
        drive_step_all(state, trial, memory, push, done, h, is_held, p);
    } else {
        t3 = drive_step_plain(state[X], state[V], memory, push, done, h, p);
        x = t3.m0;
        v = t3.m1;
        trial[X] = x;
        trial[V] = v;
    }
}

static tuple_dd drive_excess(double *state, double *memory, double *push, double done, double *p)
{
    double net = 0.0;
    double more = 0.0;
    net = drive_acceleration(state, memory, push, done, p).m0 * drive_moved_mass(p);
    more = drive_surplus(net, p) - (1e-12 * p[FORCE_CONSTANT]);
    if ((p[HAS_MORE] != 0.0) || (p[DRIVE_SHARE] > 0.0)) {
        more -= drive_held_further(state, push, done, p);
    }
    return (tuple_dd){net, more};
}

static void drive_set_off(double *state, double *memory, double way, double *p)
{
    memory[WAY] = way;
    if ((p[HAS_ZERO_EDGE] != 0.0) && (state[X] == 0.0)) {
        state[X] = way * 1e-100;
        memory[SIDE] = way;
    }
}

static void drive_pass_zero(double *state, double *memory, double *push, double done, double *p)
{
    double x = 0.0;
    double way = 0.0;
    tuple_dd t1 = {0};
    double net = 0.0;
    double more = 0.0;
    double back = 0.0;
    x = state[X];
    way = memory[WAY];
    if ((way == 0.0) || (sign_of(x) == memory[SIDE])) {
        return;
    }
    if (p[PRELOAD] > 0.0) {
        state[X] = 0.0;
        memory[WAY] = 0.0;
        memory[SIDE] = 0.0;
        t1 = drive_excess(state, memory, push, done, p);
        net = t1.m0;
        more = t1.m1;
        back = (fabs(net) - more) - (net * way);
        if ((more <= 0.0) && ((fabs(state[V]) * drive_moved_mass(p)) < (back * p[CAPTURE_TIME]))) {
            state[V] = 0.0;
            return;
        }
        state[X] = x;
        memory[WAY] = way;
    }
    drive_set_off(state, memory, way, p);
    memory[SIDE] = sign_of(state[X]);
}

static void drive_stop(double *state, double *memory, double *push, double done, double *p)
{
    tuple_dd t1 = {0};
    double net = 0.0;
    double more = 0.0;
    state[V] = 0.0;
    if (p[HYSTERESIS_FORCE] != 0.0) {
        memory[DEFLECTION] = drive_yielded(state[X], 0.0, memory, p);
        memory[TURNED_AT] = state[X];
    }
    memory[WAY] = 0.0;
    t1 = drive_excess(state, memory, push, done, p);
    net = t1.m0;
    more = t1.m1;
    if (more > 0.0) {
        drive_set_off(state, memory, sign_of(net), p);
    }
}

static double drive_time_of(int event, double *state, double *trial, double *memory, double *push, double done, double h, tuple_iddddd corner, int is_held, tuple_iiiiid kind, double *inputs, double *p)
{
    double way = 0.0;
    double low = 0.0;
    double high = 0.0;
    double at_high = 0.0;
    double at_low = 0.0;
    int is_found = 0;
    double enough = 0.0;
    double weight_high = 0.0;
    double weight_low = 0.0;
    int last = 0;
    double time = 0.0;
    int n = 0;
    double one = 0.0;
    double two = 0.0;
    double value = 0.0;
    double there = 0.0;
    int is_passed = 0;
    way = memory[WAY];
    low = 0.0;
    high = h;
    at_high = 0.0;
    at_low = at_high;
    is_found = (event != REVERSAL) || ((way * state[V]) > 0.0);
    if (event == REVERSAL) {
        at_low = way * state[V];
        at_high = way * trial[V];
    } else {
        if (event == LEAVING) {
            at_low = -drive_excess(state, memory, push, done, p).m1;
            at_high = -drive_excess(trial, memory, push, done + h, p).m1;
        } else {
            at_low = drive_margin(state, drive_value_of(push, DRIVE, done), corner.m0, p);
            at_high = drive_margin(trial, drive_value_of(push, DRIVE, done + h), corner.m0, p);
        }
    }
    enough = 1e-13 * (fabs(at_low) + fabs(at_high));
    weight_high = 1.0;
    weight_low = weight_high;
    last = 0;
    time = h;
    for (n = 0; n < 2 * LOCATING; ++n) {
        if ((!is_found) || (at_low <= at_high) || (n > LOCATING)) {
            time = 0.5 * (low + high);
        } else {
            one = weight_low * at_low;
            two = weight_high * at_high;
            time = low + (((high - low) * one) / (one - two));
        }
        if ((high - low) <= (1e-12 * h)) {
            time = high;
        }
        drive_advance(state, trial, memory, push, done, time, corner, is_held, kind, inputs, p);
        if (time == high) {
            break;
        }
        if (event == REVERSAL) {
            value = way * trial[V];
        } else {
            if (event == LEAVING) {
                value = -drive_excess(trial, memory, push, done + time, p).m1;
            } else {
                there = drive_value_of(push, DRIVE, done + time);
                value = drive_margin(trial, there, corner.m0, p);
                if (value == 0.0) {
                    is_passed = drive_corner_of(trial, there, p).m0 != corner.m0;
                    value = is_passed ? (-1e-300) : 1e-300;
                }
            }
        }
        if (value > 0.0) {
            is_found = 1;
            weight_low = 1.0;
            weight_high *= (last == 1) ? 0.5 : 1.0;
            low = time;
            at_low = value;
            last = 1;
        } else {
            weight_high = 1.0;
            weight_low *= (last == (-1)) ? 0.5 : 1.0;
            high = time;
            at_high = value;
            last = -1;
        }
        if ((fabs(value) <= enough) && is_found && ((event != EDGE) || (value < 0.0))) {
            break;
        }
    }
    if (!is_found) {
        return 0.0;
    }
    if (event == REVERSAL) {
        trial[V] = 0.0;
    }
    return time;
}

static tuple_dd drive_bounds(double x, double *p)
{
    double low = 0.0;
    double high = 0.0;
    int n = 0;
    double edge = 0.0;
    low = -HUGE_VAL;
    high = HUGE_VAL;
    for (n = 0; n < 5; ++n) {
        edge = HUGE_VAL;
        if ((n < 2) && (p[SPRING_GAP] > 0.0)) {
            edge = p[SPRING_GAP];
        }
        if (((2 <= n) && (n < 4)) && (p[STOP_STIFFNESS] > 0.0)) {
            edge = p[STOP_POSITION];
        }
        if ((n == 4) && (p[SIDE_STIFFNESS] > 0.0)) {
            edge = p[SIDE_POSITION];
        }
        if (edge == HUGE_VAL) {
            continue;
        }
        if ((n % 2) == 1) {
            edge = -edge;
        }
        if ((x > edge) || ((x == edge) && (edge < 0.0))) {
            low = most(low, edge);
        } else {
            high = least(high, edge);
        }
    }
    if (p[SECOND_STIFFNESS] > 0.0) {
        edge = p[SECOND_POSITION];
        if ((x > edge) || ((x == edge) && (edge < 0.0))) {
            low = most(low, edge);
        } else {
            high = least(high, edge);
        }
    }
    if (p[HAS_ZERO_EDGE] != 0.0) {
        if (x > 0.0) {
            low = most(low, 1e-200);
        } else {
            if (x < 0.0) {
                high = least(high, -1e-200);
            }
        }
    }
    return (tuple_dd){low, high};
}

static tuple_iiiiid drive_kind_of(double *p)
{
    int has_inner = 0;
    int is_watched = 0;
    int at_times = 0;
    has_inner = (p[GEAR_STIFFNESS] > 0.0) || (p[MODE_MASS] > 0.0) || drive_depends_on_motion(p);
    is_watched = drive_has_dry_friction(p) || (p[HYSTERESIS_FORCE] != 0.0);
    at_times = (p[STATIC_EXCESS] != 0.0) || (p[HYSTERESIS_FORCE] != 0.0);
    at_times = at_times || (p[HAS_CONTACT] != 0.0);
    return (tuple_iiiiid){has_inner, drive_count_edges(p) > 0, drive_is_always_curved(p), is_watched, at_times, drive_fastest(p)};
}

static double drive_longest_step(double sample_time, tuple_iiiiid kind, double *p)
{
    tuple_iiiiid t1 = {0};
    int has_inner = 0;
    int has_edges = 0;
    int is_curved = 0;
    int is_watched = 0;
    int is_curved_at_times = 0;
    double rate = 0.0;
    double count = 0.0;
    double fast = 0.0;
    double halves = 0.0;
    t1 = kind;
    has_inner = t1.m0;
    has_edges = t1.m1;
    is_curved = t1.m2;
    is_watched = t1.m3;
    is_curved_at_times = t1.m4;
    rate = t1.m5;
    count = 1.0;
    if (has_edges || is_watched) {
        if (drive_is_wound(p)) {
            fast = p[RESISTANCE] / p[INDUCTANCE];
            rate += drive_slow_pace(fast, 0.5, p) - fast;
        }
        count = ceil((sample_time * rate) / 0.5);
        count = least(most(count, 1.0), MOST_STEPS);
        if (has_inner && (is_curved || is_curved_at_times)) {
            halves = 1.0;
            while (halves < count) {
                halves *= 2.0;
            }
            count = halves;
        }
    }
    return sample_time / count;
}

static void drive_couple(double *p)
{
    double stiffness = 0.0;
    double teeth = 0.0;
    double share = 0.0;
    double rubbing = 0.0;
    stiffness = p[COUPLING_STIFFNESS];
    teeth = p[GEAR_STIFFNESS];
    if (stiffness <= 0.0) {
        return;
    }
    share = p[COUPLING_SHARE];
    rubbing = p[COUPLING_DAMPING_SHARE];
    if (teeth > 0.0) {
        stiffness *= teeth / (stiffness + teeth);
        share = 0.5 * (share + p[MOTOR_SHARE]);
        rubbing = 0.5 * (rubbing + p[MOTOR_DAMPING_SHARE]);
    } else {
        p[IS_COUPLED] = 1.0;
    }
    p[GEAR_STIFFNESS] = stiffness;
    p[MOTOR_SHARE] = share;
    p[MOTOR_DAMPING_SHARE] = rubbing;
    p[GEAR_DAMPING_RATIO] += p[COUPLING_DAMPING_RATIO];
}

static void drive_take_stock(double sample_time, double *p)
{
    int has_zero_edge = 0;
    int has_edges = 0;
    double contact = 0.0;
    int has_second = 0;
    int has_more = 0;
    int has_shape = 0;
    int has_bristles = 0;
    int varies = 0;
    p[CAPTURE_TIME] = 0.02 * sample_time;
    p[SAMPLE_TIME] = sample_time;
    has_zero_edge = (p[PRELOAD] > 0.0) || (p[SPRING_SHARE] > 0.0);
    p[HAS_ZERO_EDGE] = has_zero_edge ? 1.0 : 0.0;
    has_edges = has_zero_edge || (p[DRIVE_SHARE] > 0.0);
    has_edges = has_edges || (p[SECOND_STIFFNESS] > 0.0);
    p[HAS_FURTHER_EDGES] = has_edges ? 1.0 : 0.0;
    contact = (p[STOP_BEND] + p[SIDE_BEND]) + p[SECOND_BEND];
    contact += (p[STOP_LOSS] + p[SIDE_LOSS]) + p[SECOND_LOSS];
    contact += p[STOP_DASHPOT] + p[SIDE_DASHPOT];
    contact += p[SECOND_DASHPOT];
    p[HAS_CONTACT] = (contact > 0.0) ? 1.0 : 0.0;
    has_second = p[SECOND_STIFFNESS] > 0.0;
    has_second = has_second || (p[SECOND_COGGING_FORCE] != 0.0);
    has_more = has_zero_edge || has_second || (contact > 0.0);
    has_more = has_more || (p[GRAVITY_TORQUE] != 0.0);
    has_more = has_more || (p[WAVY_FRICTION] != 0.0);
    has_more = has_more || (p[OWN_FRICTION] != 0.0);
    p[HAS_MORE] = has_more ? 1.0 : 0.0;
    has_shape = (p[HYSTERESIS_BEND] != 0.0) || (p[HYSTERESIS_RATIO] != 0.0);
    has_bristles = (p[BRISTLE_EXCESS] != 0.0) || (p[BRISTLE_DAMPING] != 0.0);
    p[HAS_BRISTLES] = has_bristles ? 1.0 : 0.0;
    p[HAS_SHAPE] = (has_shape || has_bristles) ? 1.0 : 0.0;
    varies = (p[RIPPLE_SHARE] != 0.0) || (p[DRIVE_SHARE] > 0.0);
    p[DRIVE_VARIES] = varies ? 1.0 : 0.0;
}

static double drive_start(double *state, double *memory, double command, double force, double sample_time, double *p)
{
    int has_winding = 0;
    double current = 0.0;
    double angle = 0.0;
    double swinging = 0.0;
    double driving = 0.0;
    int is_placed = 0;
    double t1 = 0.0;
    double t2 = 0.0;
    double ahead = 0.0;
    double t3 = 0.0;
    double t4 = 0.0;
    drive_couple(p);
    drive_take_stock(sample_time, p);
    command = drive_static_command(command, p);
    has_winding = (p[RESISTANCE] > 0.0) && (p[INDUCTANCE] > 0.0);
    memory[LAGGED] = command;
    memory[LAGGED] += has_winding ? 0.0 : p[START_CURRENT];
    current = memory[LAGGED];
    if (p[RESISTANCE] > 0.0) {
        current /= p[RESISTANCE];
        current += has_winding ? p[START_CURRENT] : 0.0;
        state[CIRCUIT] = current;
    }
    if (p[COGGING_ABOUT_MEAN] == 0.0) {
        p[COGGING_REST] = sin(p[COGGING_PHASE]);
    }
    if (p[GRAVITY_IS_SETTLED] > 0.0) {
        angle = p[START_POSITION] + p[GRAVITY_ANGLE];
        p[GRAVITY_REST] = p[GRAVITY_TORQUE] * sin(angle);
    }
    if (p[STIFFNESS] > 0.0) {
        p[COGGING_ORIGIN] = drive_resting_point(0.0, 0, p);
    }
    if (p[IS_START_GIVEN] > 0.0) {
        state[X] = p[START_POSITION];
        state[V] = p[START_VELOCITY];
    } else {
        p[LOAD] += force;
        state[X] = drive_resting_point(current, 1, p);
        p[LOAD] -= force;
    }
    if (p[GEAR_STIFFNESS] > 0.0) {
        swinging = (p[MASS] * p[MOTOR_SHARE]) * (1.0 - p[MOTOR_SHARE]);
        p[GEAR_DAMPING] = 2.0 * p[GEAR_DAMPING_RATIO];
        p[GEAR_DAMPING] *= sqrt(p[GEAR_STIFFNESS] * swinging);
        p[MOTOR_DAMPING] = p[MOTOR_DAMPING_SHARE] * p[DAMPING];
        p[DAMPING] -= p[MOTOR_DAMPING];
    }
    driving = drive_resting_force(state[X], current, p);
    state[MOTOR_X] = state[X];
    if ((p[GEAR_STIFFNESS] > 0.0) && (driving != 0.0)) {
        state[MOTOR_X] += sign_of(driving) * p[GEAR_GAP];
        state[MOTOR_X] += driving / p[GEAR_STIFFNESS];
    } else {
        if (p[GEAR_STIFFNESS] > 0.0) {
            state[MOTOR_X] += p[GEAR_START] * p[GEAR_GAP];
        }
    }
    is_placed = (p[IS_START_GIVEN] > 0.0) || drive_is_anywhere(p);
    if ((p[SENSOR_AT_MOTOR] > 0.0) && is_placed) {
        t1 = (2.0 * state[X]) - state[MOTOR_X];
        t2 = state[X];
        state[X] = t1;
        state[MOTOR_X] = t2;
    }
    if (is_placed) {
        ahead = p[OUTPUT_START] * p[OUTPUT_GAP];
        t3 = state[X] - ahead;
        t4 = state[MOTOR_X] - ahead;
        state[X] = t3;
        state[MOTOR_X] = t4;
    }
    state[MOTOR_V] = state[V];
    state[PART_X] = state[X];
    state[PART_V] = state[V];
    memory[HEAT] = p[START_WARMTH];
    memory[SIDE] = sign_of(state[X]);
    memory[TURNED_AT] = state[X];
    memory[LEVEL] = drive_bristle_level(state[V], p);
    memory[WAY] = sign_of(state[V]);
    if (memory[WAY] != 0.0) {
        drive_set_off(state, memory, memory[WAY], p);
    }
    return command;
}

static void drive_move_piece(double *state, double *trial, double *memory, double *push, double done, double length, double step, tuple_iiiiid kind, double *inputs, double *p)
{
    tuple_iiiiid t1 = {0};
    int has_edges = 0;
    int is_curved = 0;
    int is_watched = 0;
    int is_curved_at_times = 0;
    tuple_iddddd corner = {0};
    int events = 0;
    int is_stuck = 0;
    double left = 0.0;
    double h = 0.0;
    int is_held = 0;
    int is_wild = 0;
    tuple_dd t2 = {0};
    double net = 0.0;
    double more = 0.0;
    double limit = 0.0;
    int is_turned = 0;
    int event = 0;
    int is_leaving = 0;
    int stage = 0;
    tuple_iddddd there = {0};
    double when = 0.0;
    int n = 0;
    double way = 0.0;
    t1 = kind;
    has_edges = t1.m1;
    is_curved = t1.m2;
    is_watched = t1.m3;
    is_curved_at_times = t1.m4;
    corner = drive_corner_of(state, drive_value_of(push, DRIVE, done), p);
    events = 0;
    is_stuck = 0;
    while (done < length) {
        left = length - done;
        h = (left <= step) ? left : (left / ceil(left / step));
        is_held = is_watched && (memory[WAY] == 0.0);
        is_wild = events > MOST_EVENTS;
        if (is_held && (!is_wild) && (!is_stuck)) {
            t2 = drive_excess(state, memory, push, done, p);
            net = t2.m0;
            more = t2.m1;
            if (more > 0.0) {
                drive_set_off(state, memory, sign_of(net), p);
                if (has_edges) {
                    corner = drive_corner_of(state, drive_value_of(push, DRIVE, done), p);
                }
                is_held = 0;
                events += 1;
            }
        }
        if ((is_curved || is_curved_at_times) && (!(is_held && drive_stays(p)))) {
            limit = drive_step_limit(state, memory, push, done, 0, p);
            limit = most(limit, length / MOST_STEPS);
            if (limit < h) {
                h = left / ceil(left / limit);
            }
        }
        drive_advance(state, trial, memory, push, done, h, corner, is_held, kind, inputs, p);
        is_turned = is_watched && (!is_held) && ((memory[WAY] * trial[V]) < 0.0);
        event = -1;
        if (is_turned) {
            event = REVERSAL;
        } else {
            if (is_held && (!is_stuck)) {
                more = drive_excess(trial, memory, push, done + h, p).m1;
                event = (more > 0.0) ? LEAVING : (-1);
            }
        }
        is_stuck = 0;
        is_leaving = (event == LEAVING) && (!is_wild);
        for (stage = 0; stage < 2; ++stage) {
            if (stage == 1) {
                event = -1;
                if (has_edges) {
                    there = drive_corner_of(trial, drive_value_of(push, DRIVE, done + h), p);
                    event = (there.m0 != corner.m0) ? EDGE : (-1);
                }
            }
            if ((event < 0) || is_wild) {
                continue;
            }
            events += 1;
            when = drive_time_of(event, state, trial, memory, push, done, h, corner, is_held, kind, inputs, p);
            if ((when == 0.0) && (event == REVERSAL)) {
                is_stuck = 1;
                break;
            }
            if (event == EDGE) {
                is_leaving = is_leaving && (when == h);
                is_turned = is_turned && (when == h);
                trial[V] = is_turned ? 0.0 : trial[V];
            }
            h = when;
        }
        if ((p[DRIVE_SHARE] > 0.0) && is_held && (event == EDGE)) {
            is_leaving = drive_excess(trial, memory, push, done + h, p).m1 > 0.0;
            if (is_leaving) {
                h = drive_time_of(LEAVING, state, trial, memory, push, done, h, corner, is_held, kind, inputs, p);
            }
        }
        if (is_stuck) {
            state[V] = 0.0;
            memory[WAY] = 0.0;
            if ((p[HAS_ZERO_EDGE] != 0.0) && (fabs(state[X]) <= 1e-100)) {
                state[X] = 0.0;
                memory[SIDE] = 0.0;
                corner = drive_corner_of(state, drive_value_of(push, DRIVE, done), p);
            }
            continue;
        }
        for (n = 0; n < N_STATE; ++n) {
            state[n] = trial[n];
        }
        done = (h >= (left * (1.0 - 1e-12))) ? length : (done + h);
        if (p[HAS_SHAPE] != 0.0) {
            drive_remember(state[X], state[V], memory, p);
        }
        if (is_leaving) {
            way = sign_of(drive_excess(state, memory, push, done, p).m0);
            drive_set_off(state, memory, way, p);
        }
        if (is_turned && is_wild) {
            memory[WAY] = sign_of(state[V]);
        } else {
            if (is_turned) {
                drive_stop(state, memory, push, done, p);
            }
        }
        if (p[HAS_ZERO_EDGE] != 0.0) {
            drive_pass_zero(state, memory, push, done, p);
        }
        if (has_edges) {
            corner = drive_corner_of(state, drive_value_of(push, DRIVE, done), p);
        }
    }
}
