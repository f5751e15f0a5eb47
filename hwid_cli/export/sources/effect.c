/* @title@
 *
 * What a simulation lacks, beside the simulation itself: @effects@.
 * @about@
 *
 * The simulation goes on in steps of @sample_time@ s. Before each of them hwid_effect_act
 * takes its input [@input_unit@] in the coming step, and returns @acts_as@; after
 * it hwid_effect_see takes position [@way_unit@] and velocity, and returns what the sensor
 * reads [@output_unit@]. One of the two may be NAN where nobody knows it:
 *
 *     hwid_effect effect;
 *     hwid_effect_init(&effect);
 *     hwid_effect_start(&effect, u, x);
 *     for (;;) {
 *         f = hwid_effect_act(&effect, u);
 *         (a step of @sample_time@ s with u and f, from x and v to x and v)
 *         y = hwid_effect_see(&effect, x, v);
 *     }
 *
 * A drive stands for the simulation within a step: mass @mass@, damping @damping@,
 * stiffness @stiffness@, force of the input @gain@. A further force, which each step
 * corrects, makes it move as the simulation does. C99, no heap, no other files than the
 * mathematical library.
 */
@drive@
#ifndef HWID_EFFECT_H
#define HWID_EFFECT_H
typedef struct {
    HWID_NAME(state) drive;
    double offset;   /* Position of the simulation less that of the drive. */
    double velocity; /* Of the simulation, as it was seen last. */
    double reading;  /* What the sensor adds. */
} HWID_NAME(effect);
#endif

void HWID_NAME(effect_init)(HWID_NAME(effect) *effect);
void HWID_NAME(effect_start)(HWID_NAME(effect) *effect, double u, double x);
double HWID_NAME(effect_act)(HWID_NAME(effect) *effect, double u);
double HWID_NAME(effect_see)(HWID_NAME(effect) *effect, double x, double v);

#ifndef HWID_DECLARE_ONLY
/* Mass, damping, stiffness and force of the input, without any effect. */
static const double plain_mass = @mass@, plain_damping = @damping@;
static const double plain_stiffness = @stiffness@, plain_gain = @gain@;
/* Shares of what one step was wrong by that correct the next one: with the velocity at
 * hand, and without it, where more would swing. */
static const double seen_share = 0.7, guessed_share = 0.6;

void HWID_NAME(effect_init)(HWID_NAME(effect) *effect)
{
    HWID_NAME(init)(&effect->drive);
    effect->offset = 0.0;
    effect->velocity = 0.0;
    effect->reading = 0.0;
}

/* What a sensor without effects shows of a position and a velocity. */
static double shown(const double *p, double x, double v)
{
    return p[OUTPUT_IS_VELOCITY] > 0.0 ? v : x;
}

static void effect_read(HWID_NAME(effect) *effect, double x0, double v0)
{
    HWID_NAME(state) *drive = &effect->drive;
    const double *p = drive->p;
    if (p[OUTPUT_GAP] > 0.0 && drive->sample > 0) {
        drive->played = played(drive, x0, v0);
    } else if (!(p[OUTPUT_GAP] > 0.0)) {
        drive->played = drive->position;
    }
    effect->reading = reading(drive) - shown(p, drive->position, drive->velocity);
}

void HWID_NAME(effect_start)(HWID_NAME(effect) *effect, double u, double x)
{
    HWID_NAME(state) *drive = &effect->drive;
    begin(drive, u);
    drive->position = drive->motion[X];
    drive->velocity = drive->motion[V];
    drive->previous = u;
    effect->offset = isnan(x) ? 0.0 : x - drive->position;
    effect->velocity = 0.0;
    effect_read(effect, drive->position, drive->velocity);
}

double HWID_NAME(effect_act)(HWID_NAME(effect) *effect, double u)
{
    HWID_NAME(state) *drive = &effect->drive;
    const drive_kind kind = drive_kind_of(drive->p);
    const double x = drive->position, v = effect->velocity, way = drive->memory[WAY];
    double impulse;
    /* Friction holds what the step before has left of a velocity. */
    drive->motion[X] = x;
    drive->motion[V] = kind.m3 && way * v <= 0.0 ? 0.0 : v;
    drive->listed = 0;
    drive->trusted = 0;
    drive->previous = u;
    drive->sample += 1;
    interval(drive, u, u);
    impulse = plain_mass * (drive->motion[V] - v)
        + plain_damping * (drive->motion[X] - x)
        + plain_stiffness * 0.5 * (drive->motion[X] + x) * sample_time;
    return (impulse / sample_time - plain_gain * u - drive->beside)@in_unit@;
}

double HWID_NAME(effect_see)(HWID_NAME(effect) *effect, double x, double v)
{
    HWID_NAME(state) *drive = &effect->drive;
    const double x0 = drive->position, v0 = drive->velocity;
    const double gone = 0.5 * (effect->velocity + v) * sample_time;
    const double here = isnan(x) ? x0 + gone : x - effect->offset;
    const double late = (here - drive->motion[X]) / sample_time;
    const int is_known = !isnan(v);
    const double now = is_known ? v : drive->motion[V] + late;
    const double wrong = is_known ? v - drive->motion[V] : late;
    drive->beside += (is_known ? seen_share : guessed_share) * plain_mass * wrong
        / sample_time;
    drive->position = here;
    drive->velocity = now;
    effect->velocity = now;
    effect_read(effect, x0, v0);
    return shown(drive->p, x, v) + effect->reading;
}
#endif
