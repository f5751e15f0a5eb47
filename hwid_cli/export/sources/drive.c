/* @title@
 *
 * Physics simulation of a drive: @effects@.
 * @about@
 *
 * Call hwid_init once, then hwid_step once every @sample_time@ s with the input
 * [@input_unit@]; it returns what the sensor reads [@output_unit@] at the same instant:
 *
 *     hwid_state state;
 *     hwid_init(&state);
 *     y = hwid_step(&state, u);
 *
 * The drive starts at rest in equilibrium with the first input. The input is @hold@
 * between samples. Once the simulation runs away, everything is NaN.
 *
 * C99, no heap, no other files than the mathematical library. Several models in one
 * program need names of their own: -D'HWID_NAME(x)=left_##x' makes left_init of
 * hwid_init. With HWID_DECLARE_ONLY this file is its own header.
 */
#ifndef HWID_NAME
#define HWID_NAME(name) hwid_##name
#endif

/* Parameters, motion, memory of friction and command, and the commands of a while. */
typedef struct {
    double p[@n_slots@];
    double motion[@n_state@];
    double memory[@n_memory@];
    double room[@n_room@];
    double control[@n_control@];
    double starts[@n_history@];
    double ends[@n_history@];
    double before;
    double followed;
    double previous;
    double played;
    double sensed;
    double late;
    double pace;
    double position;
    double velocity;
    double beside; /* A force on the mass beside the drive's own, held [N]. */
    long sample;
    int listed;
    int trusted;
} HWID_NAME(state);

void HWID_NAME(init)(HWID_NAME(state) *state);
double HWID_NAME(step)(HWID_NAME(state) *state, double u);

#ifndef HWID_DECLARE_ONLY
#include <math.h>

@kernels@
/* Pieces of the command that are looked at together, as far as limits of steps go. */
enum { MANY_TOGETHER = 1000, FAR_FROM_LIMIT_PIECES = 4, N_HISTORY = @n_history@ };

static const double sample_time = @sample_time@;
static const double parameters[@n_slots@] = {@parameters@};

typedef tuple_iiiiid drive_kind;

/* As far into a piece as nothing happens, without inner states. */
static double glide_plain(HWID_NAME(state) *s, double *push, double length, double step,
                          drive_kind kind)
{
    double *p = s->p, *state = s->motion, *memory = s->memory;
    const double way = memory[WAY];
    const int is_held = kind.m3 && way == 0.0;
    double low = -HUGE_VAL, high = HUGE_VAL, slow = 0.0, steady, done = 0.0;
    double x = state[X], v = state[V];
    tuple_iddddd corner = {0, p[STIFFNESS], 0.0, 0.0, 0.0, 0.0};
    if (kind.m1) {
        const tuple_dd range = drive_bounds(x, p);
        low = range.m0;
        high = range.m1;
        corner = drive_corner_of(state, 0.0, p);
    }
    steady = drive_steady_force(memory, p) - corner.m2;
    if (p[STATIC_EXCESS] != 0.0) {
        slow = 5.0 * p[STRIBECK_VELOCITY];
    }
    if (is_held) {
        if (drive_excess(state, memory, push, 0.0, p).m1 > 0.0
            || drive_excess(state, memory, push, length, p).m1 > 0.0
            || (p[DRIVE_SHARE] > 0.0 && drive_turns_sign(push, 0.0, length))) {
            return 0.0;
        }
        return length;
    }
    while (done < length) {
        const double left = length - done;
        double h = left;
        int is_curved = kind.m2;
        tuple_dd next;
        if (kind.m4 && !is_curved) {
            state[X] = x;
            state[V] = v;
            is_curved = drive_is_curved_here(state, memory, p);
        }
        if (is_curved) {
            if (s->trusted <= 0) {
                double limit;
                state[X] = x;
                state[V] = v;
                limit = drive_step_limit(state, memory, push, done, 0, p);
                limit = most(limit, length / MOST_STEPS);
                if (limit < left) {
                    h = left / ceil(left / limit);
                } else if (limit > 2.0 * left && !kind.m4) {
                    s->trusted = FAR_FROM_LIMIT_PIECES;
                }
            }
            next = drive_step_plain(x, v, memory, push, done, h, p);
            if (p[DRIVE_SHARE] > 0.0 && drive_turns_sign(push, done, h)) {
                break;
            }
        } else {
            const tuple_dddd one = drive_shift(push, DRIVE, done);
            const tuple_dddd two = drive_shift(push, OTHER, done);
            const tuple_dddd all = {one.m0 + two.m0 + steady, one.m1 + two.m1,
                                    one.m2 + two.m2, one.m3 + two.m3};
            if (h > step * (1.0 + 1e-9) || fabs(h - step) < 1e-9 * step) {
                h = step;
            }
            next = drive_sum_plain(x, v, all, h, corner.m1, kind.m5, p);
            if (kind.m3 && way * next.m1 < slow) {
                break;
            }
        }
        if ((kind.m3 && way * next.m1 < 0.0) || next.m0 < low || next.m0 > high) {
            break;
        }
        x = next.m0;
        v = next.m1;
        if (p[HAS_SHAPE] != 0.0) {
            drive_remember(x, v, memory, p);
        }
        done = h >= left * (1.0 - 1e-12) ? length : done + h;
    }
    state[X] = x;
    state[V] = v;
    return done;
}

/* The same with inner states. */
static double glide_inner(HWID_NAME(state) *s, double *push, double length, double step,
                          drive_kind kind)
{
    double *p = s->p, *state = s->motion, *memory = s->memory;
    const int is_held = kind.m3 && memory[WAY] == 0.0;
    double trial[N_STATE], inputs[N_INPUT], done = 0.0;
    tuple_iddddd corner;
    int n;
    if (kind.m2 || kind.m4
        || (is_held && drive_excess(state, memory, push, 0.0, p).m1 > 0.0)) {
        return 0.0;
    }
    for (n = 0; n < N_INPUT; ++n) {
        inputs[n] = 0.0;
    }
    corner = drive_corner_of(state, push[DRIVE], p);
    while (done < length) {
        const double left = length - done;
        double h = left;
        if (h > step * (1.0 + 1e-9) || fabs(h - step) < 1e-9 * step) {
            h = step;
        }
        drive_set_inputs(inputs, memory, push, done, p);
        drive_sum_series(state, trial, inputs, h, corner, is_held, kind.m5, p);
        if (is_held) {
            if (drive_excess(trial, memory, push, done + h, p).m1 > 0.0) {
                return done;
            }
        } else if (kind.m3 && memory[WAY] * trial[V] < 0.0) {
            return done;
        }
        if (kind.m1) {
            const double command = drive_value_of(push, DRIVE, done + h);
            if (drive_corner_of(trial, command, p).m0 != corner.m0) {
                return done;
            }
        }
        for (n = 0; n < N_STATE; ++n) {
            state[n] = trial[n];
        }
        done = h >= left * (1.0 - 1e-12) ? length : done + h;
    }
    return length;
}

/* One straight piece of the command. */
static void move_along(HWID_NAME(state) *s, double *push, double length, double step,
                       drive_kind kind)
{
    double trial[N_STATE], inputs[N_INPUT], done;
    int n;
    done = kind.m0 ? glide_inner(s, push, length, step, kind)
                   : glide_plain(s, push, length, step, kind);
    if (done >= length) {
        s->trusted -= s->trusted > 0;
        return;
    }
    s->trusted = 0;
    for (n = 0; n < N_STATE; ++n) {
        trial[n] = s->motion[n];
    }
    for (n = 0; n < N_INPUT; ++n) {
        inputs[n] = 0.0;
    }
    drive_move_piece(s->motion, trial, s->memory, push, done, length, step, kind, inputs,
                     s->p);
}

/* One sampling interval, from the previous command to this one. */
static void interval(HWID_NAME(state) *s, double first, double last)
{
    double *p = s->p;
    const int is_single = drive_is_closed(p)
        || (drive_depends_on_motion(p) && p[THERMAL_LOSS] != 0.0);
    const double gain = drive_depends_on_motion(p) ? 1.0 : p[FORCE_CONSTANT];
    const double now = is_single ? drive_drawn_current(first, s->motion, p) : 0.0;
    double rows[MOST_PIECES][3], push[N_PUSH];
    double time = (double)(s->sample - 1) * sample_time;
    const drive_kind kind = drive_kind_of(p);
    const double step = drive_longest_step(sample_time, kind, p);
    int n, count = 1;
    for (n = 0; n + 1 < N_HISTORY; ++n) {
        s->starts[n] = s->starts[n + 1];
        s->ends[n] = s->ends[n + 1];
    }
    s->starts[N_HISTORY - 1] = first;
    s->ends[N_HISTORY - 1] = last;
    rows[0][0] = sample_time;
    rows[0][1] = first;
    rows[0][2] = last;
    if (!drive_is_untouched(p)) {
        const tuple_id made = drive_command_pieces(
            N_HISTORY - 1, time, sample_time, s->starts, s->ends, s->before, p, s->followed,
            rows);
        count = made.m0;
        s->followed = made.m1;
    }
    for (n = 0; n < N_PUSH; ++n) {
        push[n] = 0.0;
    }
    for (n = 0; n < count; ++n) {
        const double length = rows[n][0];
        if (length <= 0.0) {
            continue;
        }
        drive_set_moment(push, time, length, rows[n][1], rows[n][2]);
        if (drive_is_straight(p)) {
            push[DRIVE] = gain * rows[n][1];
            push[OTHER] = p[LOAD];
            push[DRIVE + 1] = gain * (rows[n][2] - rows[n][1]) / length;
        } else {
            const tuple_dddd piece = {time, length, rows[n][1], rows[n][2]};
            drive_set_push(push, s->room, s->memory, piece, now, p);
        }
        push[OTHER] += s->beside;
        time += length;
        s->listed += 1;
        move_along(s, push, length, step, kind);
    }
    if (is_single || s->listed > MANY_TOGETHER) {
        s->listed = 0;
        s->trusted = 0;
    }
}

/* Play at the output, also around a turning point between two samples. */
static double played(HWID_NAME(state) *s, double x0, double v0)
{
    const double gap = s->p[OUTPUT_GAP], x1 = s->position;
    double y = s->played;
    v0 *= sample_time;
    if (v0 * (sample_time * s->velocity) < 0.0) {
        const double extreme = drive_extreme(x0, v0, x1, sample_time * s->velocity);
        y = least(most(y, extreme - gap), extreme + gap);
    }
    return least(most(y, x1 - gap), x1 + gap);
}

/* What the sensor reads. */
static double reading(HWID_NAME(state) *s)
{
    double *p = s->p;
    const double now = drive_sensed(s->played, s->position - s->played, s->velocity,
                                    s->previous, sample_time * (double)s->sample, p);
    tuple_dd next;
    if (!(p[SENSOR_LAG] > 0.0)) {
        return now;
    }
    next = s->sample == 0
        ? drive_first_late(now, p[OUTPUT_IS_VELOCITY] > 0.0 ? 0.0 : s->velocity, p)
        : drive_lagged(s->late, s->pace, s->sensed, now, sample_time, p);
    s->late = next.m0;
    s->pace = next.m1;
    s->sensed = now;
    return s->late;
}

void HWID_NAME(init)(HWID_NAME(state) *state)
{
    int n;
    for (n = 0; n < @n_slots@; ++n) {
        state->p[n] = parameters[n];
    }
    for (n = 0; n < N_STATE; ++n) {
        state->motion[n] = 0.0;
    }
    for (n = 0; n < N_MEMORY; ++n) {
        state->memory[n] = 0.0;
    }
    for (n = 0; n < N_ROOM; ++n) {
        state->room[n] = 0.0;
    }
    for (n = 0; n < N_CONTROL; ++n) {
        state->control[n] = 0.0;
    }
    state->beside = 0.0;
    state->sample = 0;
    state->listed = 0;
    state->trusted = 0;
}

/* At rest in equilibrium with the first command. */
static void begin(HWID_NAME(state) *state, double command)
{
    int n;
    state->before = command;
    state->followed = drive_start(state->motion, state->memory, command, 0.0, sample_time,
                                  state->p);
    for (n = 0; n < N_HISTORY; ++n) {
        state->starts[n] = command;
        state->ends[n] = command;
    }
    state->played = state->motion[state->p[SENSOR_AT_MOTOR] > 0.0 ? MOTOR_X : X];
    state->played += state->p[OUTPUT_START] * state->p[OUTPUT_GAP];
}

double HWID_NAME(step)(HWID_NAME(state) *state, double u)
{
    double *p = state->p;
    const int is_closed = drive_is_closed(p);
    const int is_held = is_closed || p[ZERO_ORDER_HOLD] > 0.0;
    const double x0 = state->position, v0 = state->velocity;
    if (state->sample == 0) {
        begin(state, is_closed ? 0.0 : u);
    } else if (isfinite(state->position)) {
        interval(state, state->previous, is_held ? state->previous : u);
    }
    state->position = state->motion[p[SENSOR_AT_MOTOR] > 0.0 ? MOTOR_X : X];
    state->velocity = state->motion[p[SENSOR_AT_MOTOR] > 0.0 ? MOTOR_V : V];
    if (!isfinite(state->position)) {
        state->position = NAN;
        state->velocity = NAN;
        state->motion[X] = NAN;
    }
    if (state->sample > 0 && p[OUTPUT_GAP] > 0.0) {
        state->played = played(state, x0, v0);
    }
    state->previous = u;
    if (is_closed) {
        state->previous = drive_controlled(u, state->position, state->velocity,
                                           sample_time, state->control, p);
    }
    if (!(p[OUTPUT_GAP] > 0.0)) {
        state->played = state->position;
    }
    u = reading(state);
    state->sample += 1;
    return u;
}
#endif
