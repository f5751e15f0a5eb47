/* Co-simulation unit of the Functional Mock-up Interface 2.0 around another unit.
 *
 * The other unit lies in the resources and does all the work. In steps of @sample_time@ s
 * it is given what the effects make of its motion, and its output what a sensor adds.
 * Variables and their references are those of the other unit.
 */
#define _POSIX_C_SOURCE 200809L
#include <math.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#if defined(_WIN32)
#include <windows.h>
#define OPEN_LIBRARY(path) ((void *)LoadLibraryA(path))
#define CLOSE_LIBRARY(library) FreeLibrary((HMODULE)(library))
#define FIND_SYMBOL(library, name) ((void *)GetProcAddress((HMODULE)(library), name))
#else
#include <dlfcn.h>
#define OPEN_LIBRARY(path) dlopen(path, RTLD_NOW | RTLD_LOCAL)
#define CLOSE_LIBRARY(library) dlclose(library)
#define FIND_SYMBOL(library, name) dlsym(library, name)
#endif

#include "effect.c"
#include "fmi2_types.h"

#define UNIT_GUID "@guid@"
#define BASE_GUID "@base_guid@"
/* Below the resources: the other unit as it was, and its binary. */
#define BASE_RESOURCES "/base/resources"
#define BASE_BINARY "/base/@binary@"
enum { UNIT_NAME_SIZE = 64, UNIT_PATH_SIZE = 4096, N_FITTED = @n_fitted@ };
enum { HAS_FORCE = @has_force@, HAS_VELOCITY = @has_velocity@, AT_FORCE = @at_force@ };
/* References of the other unit's variables. */
static const fmi2ValueReference input_at = @input_at@u, output_at = @output_at@u;
static const fmi2ValueReference force_at = @force_at@u, velocity_at = @velocity_at@u;
/* Parameters as they were fitted with the effects. */
static const fmi2ValueReference fitted_at[N_FITTED + 1] = {@fitted_at@};
static const fmi2Real fitted[N_FITTED + 1] = {@fitted@};

typedef struct {
    fmi2Component (*instantiate)(fmi2String, fmi2Type, fmi2String, fmi2String,
                                 const fmi2CallbackFunctions *, fmi2Boolean, fmi2Boolean);
    void (*free_instance)(fmi2Component);
    fmi2Status (*setup)(fmi2Component, fmi2Boolean, fmi2Real, fmi2Real, fmi2Boolean,
                        fmi2Real);
    fmi2Status (*enter)(fmi2Component);
    fmi2Status (*leave)(fmi2Component);
    fmi2Status (*terminate)(fmi2Component);
    fmi2Status (*reset)(fmi2Component);
    fmi2Status (*get_real)(fmi2Component, const fmi2ValueReference *, size_t, fmi2Real *);
    fmi2Status (*set_real)(fmi2Component, const fmi2ValueReference *, size_t,
                           const fmi2Real *);
    fmi2Status (*get_integer)(fmi2Component, const fmi2ValueReference *, size_t,
                              fmi2Integer *);
    fmi2Status (*set_integer)(fmi2Component, const fmi2ValueReference *, size_t,
                              const fmi2Integer *);
    fmi2Status (*get_boolean)(fmi2Component, const fmi2ValueReference *, size_t,
                              fmi2Boolean *);
    fmi2Status (*set_boolean)(fmi2Component, const fmi2ValueReference *, size_t,
                              const fmi2Boolean *);
    fmi2Status (*get_string)(fmi2Component, const fmi2ValueReference *, size_t,
                             fmi2String *);
    fmi2Status (*set_string)(fmi2Component, const fmi2ValueReference *, size_t,
                             const fmi2String *);
    fmi2Status (*step)(fmi2Component, fmi2Real, fmi2Real, fmi2Boolean);
    fmi2Status (*debug)(fmi2Component, fmi2Boolean, size_t, const fmi2String *);
} Base;

typedef struct {
    HWID_NAME(effect) effect;
    Base call;
    void *library;
    fmi2Component base;
    fmi2Real input, force;
    fmi2Real time;
    fmi2CallbackFunctions callbacks;
    char name[UNIT_NAME_SIZE];
} Unit;

static void tell(const fmi2CallbackFunctions *callbacks, fmi2String name,
                 fmi2String message)
{
    if (callbacks->logger != NULL) {
        callbacks->logger(callbacks->componentEnvironment, name, fmi2Error,
                          "logStatusError", "%s", message);
    }
}

static fmi2Status complain(Unit *unit, fmi2String message)
{
    tell(&unit->callbacks, unit->name, message);
    return fmi2Error;
}

#include "fmi2_refused.h"

/* Folder of a file URI: percent signs are decoded, a drive's letter stays. */
static int folder_of(char *path, fmi2String resources)
{
    const char *from = resources;
    size_t n = 0;
    if (from == NULL) {
        return 0;
    }
    if (strncmp(from, "file:", 5) == 0) {
        from += 5;
        if (strncmp(from, "//", 2) == 0) {
            from += 2;
            if (strncmp(from, "localhost/", 10) == 0) {
                from += 9;
            }
        }
#if defined(_WIN32)
        if (from[0] == '/' && from[1] != '\0' && from[2] == ':') {
            from += 1;
        }
#endif
    }
    while (*from != '\0' && n + 1 < UNIT_PATH_SIZE) {
        unsigned int code;
        if (*from == '%' && sscanf(from + 1, "%2x", &code) == 1) {
            path[n++] = (char)code;
            from += 3;
        } else {
            path[n++] = *from++;
        }
    }
    while (n > 1 && path[n - 1] == '/') {
        n -= 1;
    }
    path[n] = '\0';
    return *from == '\0';
}

static int symbol(void *library, const char *name, void *place)
{
    void *found = FIND_SYMBOL(library, name);
    memcpy(place, &found, sizeof found);
    return found != NULL;
}

static int open_base(Unit *unit, const char *path)
{
    Base *call = &unit->call;
    unit->library = OPEN_LIBRARY(path);
    return unit->library != NULL
        && symbol(unit->library, "fmi2Instantiate", &call->instantiate)
        && symbol(unit->library, "fmi2FreeInstance", &call->free_instance)
        && symbol(unit->library, "fmi2SetupExperiment", &call->setup)
        && symbol(unit->library, "fmi2EnterInitializationMode", &call->enter)
        && symbol(unit->library, "fmi2ExitInitializationMode", &call->leave)
        && symbol(unit->library, "fmi2Terminate", &call->terminate)
        && symbol(unit->library, "fmi2Reset", &call->reset)
        && symbol(unit->library, "fmi2GetReal", &call->get_real)
        && symbol(unit->library, "fmi2SetReal", &call->set_real)
        && symbol(unit->library, "fmi2GetInteger", &call->get_integer)
        && symbol(unit->library, "fmi2SetInteger", &call->set_integer)
        && symbol(unit->library, "fmi2GetBoolean", &call->get_boolean)
        && symbol(unit->library, "fmi2SetBoolean", &call->set_boolean)
        && symbol(unit->library, "fmi2GetString", &call->get_string)
        && symbol(unit->library, "fmi2SetString", &call->set_string)
        && symbol(unit->library, "fmi2DoStep", &call->step)
        && symbol(unit->library, "fmi2SetDebugLogging", &call->debug);
}

static fmi2Status begin_unit(Unit *unit)
{
    HWID_NAME(effect_init)(&unit->effect);
    unit->input = 0.0;
    unit->force = 0.0;
    return N_FITTED == 0 ? fmi2OK
                         : unit->call.set_real(unit->base, fitted_at, N_FITTED, fitted);
}

FMI_EXPORT fmi2Component fmi2Instantiate(fmi2String name, fmi2Type type,
                                         fmi2String guid, fmi2String resources,
                                         const fmi2CallbackFunctions *functions,
                                         fmi2Boolean visible, fmi2Boolean logging)
{
    static const char base_resources[] = BASE_RESOURCES;
    char path[UNIT_PATH_SIZE + sizeof BASE_BINARY], *uri;
    Unit *unit;
    if (type != fmi2CoSimulation || functions == NULL || guid == NULL
        || strcmp(guid, UNIT_GUID) != 0) {
        return NULL;
    }
    if (!folder_of(path, resources)) {
        tell(functions, name, "no fmuResourceLocation; expected the folder with the unit "
                              "that this one is built around");
        return NULL;
    }
    strcat(path, BASE_BINARY);
    unit = (Unit *)calloc(1, sizeof(Unit));
    uri = (char *)malloc(strlen(resources) + sizeof base_resources);
    if (unit == NULL || uri == NULL) {
        free(unit);
        free(uri);
        return NULL;
    }
    strcpy(uri, resources);
    while (strlen(uri) > 1 && uri[strlen(uri) - 1] == '/') {
        uri[strlen(uri) - 1] = '\0';
    }
    strcat(uri, base_resources);
    unit->callbacks = *functions;
    strncpy(unit->name, name == NULL ? "" : name, UNIT_NAME_SIZE - 1);
    if (!open_base(unit, path)) {
        tell(functions, name, "the binary below resources" BASE_BINARY
                              " cannot be loaded, or lacks functions of FMI 2.0");
        free(uri);
        free(unit);
        return NULL;
    }
    unit->base = unit->call.instantiate(unit->name, fmi2CoSimulation, BASE_GUID, uri,
                                        &unit->callbacks, visible, logging);
    free(uri);
    if (unit->base == NULL || begin_unit(unit) > fmi2Warning) {
        free(unit);
        return NULL;
    }
    return unit;
}

FMI_EXPORT void fmi2FreeInstance(fmi2Component c)
{
    Unit *unit = (Unit *)c;
    if (unit != NULL) {
        unit->call.free_instance(unit->base);
        CLOSE_LIBRARY(unit->library);
        free(unit);
    }
}

FMI_EXPORT fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n,
                                          const fmi2String categories[])
{
    return ((Unit *)c)->call.debug(((Unit *)c)->base, on, n, categories);
}

FMI_EXPORT fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean hasTolerance,
                                          fmi2Real tolerance, fmi2Real start,
                                          fmi2Boolean hasStop, fmi2Real stop)
{
    Unit *unit = (Unit *)c;
    unit->time = start;
    return unit->call.setup(unit->base, hasTolerance, tolerance, start, hasStop, stop);
}

FMI_EXPORT fmi2Status fmi2EnterInitializationMode(fmi2Component c)
{
    return ((Unit *)c)->call.enter(((Unit *)c)->base);
}


FMI_EXPORT fmi2Status fmi2Terminate(fmi2Component c)
{
    return ((Unit *)c)->call.terminate(((Unit *)c)->base);
}

FMI_EXPORT fmi2Status fmi2Reset(fmi2Component c)
{
    Unit *unit = (Unit *)c;
    const fmi2Status status = unit->call.reset(unit->base);
    unit->time = 0.0;
    return status > fmi2Warning ? status : begin_unit(unit);
}

/* Motion of the other unit now; NAN for what it does not give. */
static fmi2Status look(Unit *unit, fmi2Real *x, fmi2Real *v)
{
    const int is_velocity = unit->effect.drive.p[OUTPUT_IS_VELOCITY] > 0.0;
    fmi2Status status;
    *x = *v = NAN;
    status = unit->call.get_real(unit->base, &output_at, 1, is_velocity ? v : x);
    if (!is_velocity && HAS_VELOCITY && status <= fmi2Warning) {
        status = unit->call.get_real(unit->base, &velocity_at, 1, v);
    }
    return status;
}

/* At rest in equilibrium with the input that was set before. */
FMI_EXPORT fmi2Status fmi2ExitInitializationMode(fmi2Component c)
{
    Unit *unit = (Unit *)c;
    fmi2Status status = unit->call.leave(unit->base);
    fmi2Real x, v;
    if (status <= fmi2Warning) {
        status = look(unit, &x, &v);
    }
    if (status <= fmi2Warning) {
        HWID_NAME(effect_start)(&unit->effect, unit->input, x);
    }
    return status;
}

FMI_EXPORT fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[],
                                  size_t n, fmi2Real value[])
{
    Unit *unit = (Unit *)c;
    const fmi2Status status = unit->call.get_real(unit->base, vr, n, value);
    size_t i;
    for (i = 0; i < n && status <= fmi2Warning; ++i) {
        if (vr[i] == output_at) {
            value[i] += unit->effect.reading;
        }
    }
    return status;
}

FMI_EXPORT fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[],
                                  size_t n, const fmi2Real value[])
{
    Unit *unit = (Unit *)c;
    size_t i;
    for (i = 0; i < n; ++i) {
        if (vr[i] == input_at) {
            unit->input = value[i];
        } else if (HAS_FORCE && vr[i] == force_at) {
            unit->force = value[i];
        }
    }
    return unit->call.set_real(unit->base, vr, n, value);
}

#define PASSED_ON(verb, call_of, kind) \
    FMI_EXPORT fmi2Status verb(fmi2Component c, const fmi2ValueReference vr[], \
                               size_t n, kind value[]) \
    { \
        return ((Unit *)c)->call.call_of(((Unit *)c)->base, vr, n, value); \
    }
PASSED_ON(fmi2GetInteger, get_integer, fmi2Integer)
PASSED_ON(fmi2SetInteger, set_integer, const fmi2Integer)
PASSED_ON(fmi2GetBoolean, get_boolean, fmi2Boolean)
PASSED_ON(fmi2SetBoolean, set_boolean, const fmi2Boolean)
PASSED_ON(fmi2GetString, get_string, fmi2String)
PASSED_ON(fmi2SetString, set_string, const fmi2String)

/* One step with what the effects make of it. */
static fmi2Status move_on(Unit *unit, fmi2Real time)
{
    const double more = HWID_NAME(effect_act)(&unit->effect, unit->input);
    const fmi2Real u = unit->input + (AT_FORCE ? 0.0 : more);
    const fmi2Real force = unit->force + more;
    fmi2Real x, v;
    fmi2Status status = unit->call.set_real(unit->base, &input_at, 1, &u);
    if (AT_FORCE && status <= fmi2Warning) {
        status = unit->call.set_real(unit->base, &force_at, 1, &force);
    }
    if (status <= fmi2Warning) {
        status = unit->call.step(unit->base, time, sample_time, 1);
    }
    if (status <= fmi2Warning) {
        status = look(unit, &x, &v);
    }
    if (status <= fmi2Warning) {
        (void)HWID_NAME(effect_see)(&unit->effect, x, v);
    }
    return status;
}

FMI_EXPORT fmi2Status fmi2DoStep(fmi2Component c, fmi2Real time, fmi2Real size,
                                 fmi2Boolean noSetFMUStatePriorToCurrentPoint)
{
    Unit *unit = (Unit *)c;
    const double steps = floor(size / sample_time + 0.5);
    fmi2Status status = fmi2OK;
    double i;
    (void)noSetFMUStatePriorToCurrentPoint;
    if (steps < 1.0 || fabs(size - steps * sample_time) > 1e-6 * sample_time * steps) {
        return complain(unit, "the step must be a multiple of @sample_time@ s");
    }
    for (i = 0.0; i < steps && status <= fmi2Warning; i += 1.0) {
        status = move_on(unit, time + i * sample_time);
    }
    if (status <= fmi2Warning) {
        status = unit->call.set_real(unit->base, &input_at, 1, &unit->input);
    }
    if (HAS_FORCE && status <= fmi2Warning) {
        status = unit->call.set_real(unit->base, &force_at, 1, &unit->force);
    }
    unit->time = time + size;
    return status;
}

#define NO_STATES(verb, arguments) \
    FMI_EXPORT fmi2Status verb arguments \
    { \
        return complain((Unit *)c, "states cannot be saved"); \
    }
NO_STATES(fmi2GetFMUstate, (fmi2Component c, fmi2FMUstate *state))
NO_STATES(fmi2SetFMUstate, (fmi2Component c, fmi2FMUstate state))
NO_STATES(fmi2FreeFMUstate, (fmi2Component c, fmi2FMUstate *state))
NO_STATES(fmi2SerializedFMUstateSize, (fmi2Component c, fmi2FMUstate state, size_t *size))
NO_STATES(fmi2SerializeFMUstate,
          (fmi2Component c, fmi2FMUstate state, fmi2Byte bytes[], size_t size))
NO_STATES(fmi2DeSerializeFMUstate,
          (fmi2Component c, const fmi2Byte bytes[], size_t size, fmi2FMUstate *state))
