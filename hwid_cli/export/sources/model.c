/* @title@
 *
 * Hammerstein-Wiener model: a static map, a linear block B/F, a static map.
 * @about@
 *
 * Call hwid_init once, then hwid_step once every @sample_time@ s with the input
 * [@input_unit@]; it returns the output [@output_unit@] at the same instant:
 *
 *     hwid_state state;
 *     hwid_init(&state);
 *     y = hwid_step(&state, u);
 *
 * hwid_init          starts by the model's own rule: @rule@
 * hwid_init_empty    starts with an empty linear block
 * hwid_init_steady   starts in equilibrium with the first input
 *
 * C99, no heap, no other files than the mathematical library. Several models in one
 * program need names of their own: -D'HWID_NAME(x)=left_##x' makes left_init of
 * hwid_init. With HWID_DECLARE_ONLY this file is its own header.
 */
#ifndef HWID_NAME
#define HWID_NAME(name) hwid_##name
#endif

/* Past of the linear block, newest values first. */
typedef struct {
    double w[@size_w@];
    double forced[@size_f@];
    double free[@size_f@];
    long sample;
    int is_steady;
    int has_free;
} HWID_NAME(state);

void HWID_NAME(init)(HWID_NAME(state) *state);
void HWID_NAME(init_empty)(HWID_NAME(state) *state);
void HWID_NAME(init_steady)(HWID_NAME(state) *state);
double HWID_NAME(step)(HWID_NAME(state) *state, double u);

#ifndef HWID_DECLARE_ONLY
#include <math.h>

@input_map@
@output_map@
/* B in q^-@nk@ ..., F in q^-1 ... filled up with zeros, and the response to the initial
 * state. */
static const double numerator[@nb@] = {@numerator@};
static const double denominator[@size_f@] = {@denominator@};
static const double free_response[@size_c@] = {@free_response@};
static const double static_gain = @static_gain@;

/* One value of a recursive filter, whose past outputs it moves on. */
static double recursion(double value, double *past)
{
    int j;
    /* In the order of 'hwid predict', so that the last bit is the same. */
    for (j = @size_f@ - 4; j >= 0; j -= 4) {
        value -= denominator[j + 3] * past[j + 3] + denominator[j + 2] * past[j + 2];
        value -= denominator[j + 1] * past[j + 1];
        value -= denominator[j] * past[j];
    }
    /* What has died away is zero: subnormal numbers are slow. */
    if (fabs(value) < 1e-200) {
        value = 0.0;
    }
    for (j = @size_f@ - 1; j > 0; --j) {
        past[j] = past[j - 1];
    }
    past[0] = value;
    return value;
}

static void begin(HWID_NAME(state) *state, int is_steady, int has_free)
{
    int j;
    for (j = 0; j < @size_w@; ++j) {
        state->w[j] = 0.0;
    }
    for (j = 0; j < @size_f@; ++j) {
        state->forced[j] = 0.0;
        state->free[j] = 0.0;
    }
    state->sample = 0;
    state->is_steady = is_steady;
    state->has_free = has_free;
}

void HWID_NAME(init)(HWID_NAME(state) *state)
{
    begin(state, @is_steady@, @has_free@);
}

void HWID_NAME(init_empty)(HWID_NAME(state) *state)
{
    begin(state, 0, 0);
}

void HWID_NAME(init_steady)(HWID_NAME(state) *state)
{
    begin(state, 1, 0);
}

double HWID_NAME(step)(HWID_NAME(state) *state, double u)
{
    int j;
    double forced = 0.0, pulse = 0.0;
    const double w = input_map(u);
    if (state->sample == 0 && state->is_steady) {
        for (j = 0; j < @size_w@; ++j) {
            state->w[j] = w;
        }
        for (j = 0; j < @size_f@; ++j) {
            state->forced[j] = w * static_gain;
        }
    }
    for (j = @size_w@ - 1; j > 0; --j) {
        state->w[j] = state->w[j - 1];
    }
    state->w[0] = w;
    for (j = 0; j < @nb@; ++j) {
        forced += numerator[j] * state->w[@nk@ + j];
    }
    forced = recursion(forced, state->forced);
    if (state->has_free) {
        if (state->sample < @n_free@) {
            pulse = free_response[state->sample];
        }
        pulse = recursion(pulse, state->free);
    }
    if (state->sample <= @n_free@) {
        state->sample += 1;
    }
    return output_map(forced + pulse);
}
#endif
