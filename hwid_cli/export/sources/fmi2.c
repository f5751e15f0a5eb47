/* Co-simulation unit of the Functional Mock-up Interface 2.0 around a model.
 *
 * Only what the interface demands. At a communication point the output answers to the
 * input that is set there; a step moves the model on by its sample time.
 */
#include <math.h>
#include <stddef.h>
#include <string.h>

#include "model.c"
#include "fmi2_types.h"

#define UNIT_SAMPLE_TIME @sample_time@
#define UNIT_GUID "@guid@"
#define UNIT_NAME_SIZE 64
enum { UNIT_INPUT = 0, UNIT_OUTPUT = 1, UNIT_INITIAL_STATE = 2 };
enum { UNIT_FITTED = 0, UNIT_EMPTY = 1, UNIT_STEADY = 2 };

typedef struct {
    HWID_NAME(state) model;
    fmi2Real input;
    fmi2Integer initial_state;
    fmi2Real time;
    fmi2CallbackFunctions call;
    char name[UNIT_NAME_SIZE];
} Unit;

static fmi2Status complain(Unit *unit, fmi2String message)
{
    if (unit->call.logger != NULL) {
        unit->call.logger(unit->call.componentEnvironment, unit->name, fmi2Error,
                          "logStatusError", "%s", message);
    }
    return fmi2Error;
}

#include "fmi2_refused.h"

static void begin_unit(Unit *unit)
{
#if @has_starts@
    if (unit->initial_state == UNIT_EMPTY) {
        HWID_NAME(init_empty)(&unit->model);
        return;
    }
    if (unit->initial_state == UNIT_STEADY) {
        HWID_NAME(init_steady)(&unit->model);
        return;
    }
#endif
    HWID_NAME(init)(&unit->model);
}

FMI_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                                          const fmi2String categories[])
{
    (void)c; (void)on; (void)n; (void)categories;
    return fmi2OK;
}

FMI_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type,
                                         fmi2String guid, fmi2String resources,
                                         const fmi2CallbackFunctions *functions,
                                         fmi2Boolean visible, fmi2Boolean logging)
{
    Unit *unit;
    (void)resources; (void)visible; (void)logging;
    if (type != fmi2CoSimulation || functions == NULL || guid == NULL
        || strcmp(guid, UNIT_GUID) != 0) {
        return NULL;
    }
    unit = (Unit *)functions->allocateMemory(1, sizeof(Unit));
    if (unit == NULL) {
        return NULL;
    }
    memset(unit, 0, sizeof(Unit));
    unit->call = *functions;
    strncpy(unit->name, name == NULL ? "" : name, UNIT_NAME_SIZE - 1);
    begin_unit(unit);
    return unit;
}

FMI_EXPORT void fmi2FreeInstance(fmi2Component c)
{
    if (c != NULL) {
        ((Unit *)c)->call.freeMemory(c);
    }
}

FMI_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean hasTolerance,
                                          fmi2Real tolerance, fmi2Real start,
                                          fmi2Boolean hasStop, fmi2Real stop)
{
    (void)hasTolerance; (void)tolerance; (void)hasStop; (void)stop;
    ((Unit *)c)->time = start;
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    begin_unit((Unit *)c);
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    (void)c;
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    Unit *unit = (Unit *)c;
    unit->input = 0.0;
    unit->initial_state = UNIT_FITTED;
    unit->time = 0.0;
    begin_unit(unit);
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[],
                                  size_t n, fmi2Real value[])
{
    Unit *unit = (Unit *)c;
    size_t i;
    for (i = 0; i < n; ++i) {
        if (vr[i] == UNIT_INPUT) {
            value[i] = unit->input;
        } else if (vr[i] == UNIT_OUTPUT) {
            /* A look ahead: the state itself stays at this point. */
            HWID_NAME(state) ahead;
            ahead = unit->model;
            value[i] = HWID_NAME(step)(&ahead, unit->input);
        } else {
            return complain(unit, "unknown value reference of a real variable");
        }
    }
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[],
                                  size_t n, const fmi2Real value[])
{
    Unit *unit = (Unit *)c;
    size_t i;
    for (i = 0; i < n; ++i) {
        if (vr[i] != UNIT_INPUT) {
            return complain(unit, "this real variable cannot be set");
        }
        unit->input = value[i];
    }
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2GetInteger(fmi2Component c, const fmi2ValueReference vr[],
                                     size_t n, fmi2Integer value[])
{
    Unit *unit = (Unit *)c;
    size_t i;
    for (i = 0; i < n; ++i) {
        if (vr[i] != UNIT_INITIAL_STATE) {
            return complain(unit, "unknown value reference of an integer variable");
        }
        value[i] = unit->initial_state;
    }
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2SetInteger(fmi2Component c, const fmi2ValueReference vr[],
                                     size_t n, const fmi2Integer value[])
{
    Unit *unit = (Unit *)c;
    size_t i;
    for (i = 0; i < n; ++i) {
        if (vr[i] != UNIT_INITIAL_STATE || value[i] < UNIT_FITTED || value[i] > UNIT_STEADY) {
            return complain(unit, "initial_state must be 0, 1 or 2");
        }
        unit->initial_state = value[i];
    }
    return fmi2OK;
}

#define NO_VARIABLES(verb, type, kind) \
    FMI_EXPORT fmi2Status verb(fmi2Component c, const fmi2ValueReference vr[], \
                               size_t n, kind value[]) \
    { \
        (void)vr; (void)value; \
        return n == 0 ? fmi2OK : complain((Unit *)c, "there is no " type " variable"); \
    }
NO_VARIABLES(fmi2GetBoolean, "boolean", fmi2Boolean)
NO_VARIABLES(fmi2SetBoolean, "boolean", const fmi2Boolean)
NO_VARIABLES(fmi2GetString, "string", fmi2String)
NO_VARIABLES(fmi2SetString, "string", const fmi2String)

FMI_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size,
                                 fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    Unit *unit = (Unit *)c;
    const double samples = floor(size / UNIT_SAMPLE_TIME + 0.5);
    double i;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (samples < 1.0 || fabs(size - samples * UNIT_SAMPLE_TIME) > 1e-6 * UNIT_SAMPLE_TIME) {
        return complain(unit, "the step must be a multiple of the sample time, "
                              "@sample_time@ s");
    }
    for (i = 0.0; i < samples; i += 1.0) {
        (void)HWID_NAME(step)(&unit->model, unit->input);
    }
    unit->time = time + size;
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2GetFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    Unit *unit = (Unit *)c;
    if (*state == NULL) {
        *state = unit->call.allocateMemory(1, sizeof(Unit));
    }
    if (*state == NULL) {
        return complain(unit, "no memory for a state");
    }
    memcpy(*state, unit, sizeof(Unit));
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2SetFMUstate(fmi2Component c, fmi2FMUstate state)
{
    memcpy(c, state, sizeof(Unit));
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2FreeFMUstate(fmi2Component c, fmi2FMUstate *state)
{
    if (*state != NULL) {
        ((Unit *)c)->call.freeMemory(*state);
        *state = NULL;
    }
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2SerializedFMUstateSize(fmi2Component c, fmi2FMUstate state,
                                                 size_t *size)
{
    (void)state; (void)size;
    return complain((Unit *)c, "states cannot be serialized");
}

FMI_EXPORT fmi2Status fmi2SerializeFMUstate(fmi2Component c, fmi2FMUstate state,
                                            fmi2Byte bytes[], size_t size)
{
    (void)state; (void)bytes; (void)size;
    return complain((Unit *)c, "states cannot be serialized");
}

FMI_EXPORT fmi2Status fmi2DeSerializeFMUstate(fmi2Component c, const fmi2Byte bytes[],
                                              size_t size, fmi2FMUstate *state)
{
    (void)bytes; (void)size; (void)state;
    return complain((Unit *)c, "states cannot be serialized");
}
