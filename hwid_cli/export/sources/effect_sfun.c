/* S-function of Simulink with what a simulation lacks (effect.c beside it).
 *
 *     mex effect_sfun.c
 *
 * Inputs: the input of the simulation, its position, its velocity. Outputs: what acts on
 * the simulation until the next step (effect.c says where), and what the sensor reads.
 */
#define S_FUNCTION_NAME effect_sfun
#define S_FUNCTION_LEVEL 2
#include "simstruc.h"

#include <stdlib.h>

#include "effect.c"

enum { SFUN_INPUTS = 3, SFUN_OUTPUTS = 2 };

typedef struct {
    HWID_NAME(effect) effect;
    int is_moving;
} Memory;

static void mdlInitializeSizes(SimStruct *S)
{
    int n;
    ssSetNumSFcnParams(S, 0);
    if (ssGetNumSFcnParams(S) != ssGetSFcnParamsCount(S)) {
        return;
    }
    if (!ssSetNumInputPorts(S, SFUN_INPUTS) || !ssSetNumOutputPorts(S, SFUN_OUTPUTS)) {
        return;
    }
    for (n = 0; n < SFUN_INPUTS; ++n) {
        ssSetInputPortWidth(S, n, 1);
        ssSetInputPortDirectFeedThrough(S, n, 1);
    }
    for (n = 0; n < SFUN_OUTPUTS; ++n) {
        ssSetOutputPortWidth(S, n, 1);
    }
    ssSetNumPWork(S, 1);
    ssSetNumSampleTimes(S, 1);
}

static void mdlInitializeSampleTimes(SimStruct *S)
{
    ssSetSampleTime(S, 0, sample_time);
    ssSetOffsetTime(S, 0, 0.0);
}

#define MDL_START
static void mdlStart(SimStruct *S)
{
    Memory *memory = (Memory *)calloc(1, sizeof(Memory));
    if (memory == NULL) {
        ssSetErrorStatus(S, "no memory for the effects");
        return;
    }
    HWID_NAME(effect_init)(&memory->effect);
    ssSetPWorkValue(S, 0, memory);
}

static void mdlOutputs(SimStruct *S, int_T tid)
{
    Memory *memory = (Memory *)ssGetPWorkValue(S, 0);
    const double u = *ssGetInputPortRealSignalPtrs(S, 0)[0];
    const double x = *ssGetInputPortRealSignalPtrs(S, 1)[0];
    const double v = *ssGetInputPortRealSignalPtrs(S, 2)[0];
    (void)tid;
    if (!memory->is_moving) {
        HWID_NAME(effect_start)(&memory->effect, u, x);
        memory->is_moving = 1;
    } else {
        (void)HWID_NAME(effect_see)(&memory->effect, x, v);
    }
    *ssGetOutputPortRealSignal(S, 1) =
        shown(memory->effect.drive.p, x, v) + memory->effect.reading;
    *ssGetOutputPortRealSignal(S, 0) = HWID_NAME(effect_act)(&memory->effect, u);
}

static void mdlTerminate(SimStruct *S)
{
    free(ssGetPWorkValue(S, 0));
    ssSetPWorkValue(S, 0, NULL);
}

#ifdef MATLAB_MEX_FILE
#include "simulink.c"
#else
#include "cg_sfun.h"
#endif
