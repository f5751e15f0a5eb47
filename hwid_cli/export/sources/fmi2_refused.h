/* Functions of the Functional Mock-up Interface 2.0 that every unit answers alike: what it
 * is, and what it does not do. Needs the unit's own Unit and complain.
 */
FMI_EXPORT const char *fmi2GetTypesPlatform(void)
{
    return "default";
}

FMI_EXPORT const char *fmi2GetVersion(void)
{
    return "2.0";
}

FMI_EXPORT fmi2Status fmi2CancelStep(fmi2Component c)
{
    return complain((Unit *)c, "there is no step to cancel");
}

#define NO_STATUS(verb, kind) \
    FMI_EXPORT fmi2Status verb(fmi2Component c, const fmi2StatusKind s, kind *value) \
    { \
        (void)c; (void)s; (void)value; \
        return fmi2Discard; \
    }
NO_STATUS(fmi2GetStatus, fmi2Status)
NO_STATUS(fmi2GetIntegerStatus, fmi2Integer)
NO_STATUS(fmi2GetBooleanStatus, fmi2Boolean)
NO_STATUS(fmi2GetStringStatus, fmi2String)

FMI_EXPORT fmi2Status fmi2GetRealStatus(fmi2Component c, const fmi2StatusKind s,
                                        fmi2Real *value)
{
    if (s != fmi2LastSuccessfulTime) {
        return fmi2Discard;
    }
    *value = ((Unit *)c)->time;
    return fmi2OK;
}

FMI_EXPORT fmi2Status fmi2SetRealInputDerivatives(fmi2Component c,
                                                  const fmi2ValueReference vr[],
                                                  size_t n, const fmi2Integer order[],
                                                  const fmi2Real value[])
{
    (void)vr; (void)order; (void)value;
    return n == 0 ? fmi2OK : complain((Unit *)c, "inputs are held in a step");
}

FMI_EXPORT fmi2Status fmi2GetRealOutputDerivatives(fmi2Component c,
                                                   const fmi2ValueReference vr[],
                                                   size_t n, const fmi2Integer order[],
                                                   fmi2Real value[])
{
    (void)vr; (void)order; (void)value;
    return n == 0 ? fmi2OK : complain((Unit *)c, "outputs have no derivatives");
}

FMI_EXPORT fmi2Status fmi2GetDirectionalDerivative(fmi2Component c,
                                                   const fmi2ValueReference unknown[],
                                                   size_t n_unknown,
                                                   const fmi2ValueReference known[],
                                                   size_t n_known,
                                                   const fmi2Real seed[],
                                                   fmi2Real value[])
{
    (void)unknown; (void)n_unknown; (void)known; (void)n_known; (void)seed; (void)value;
    return complain((Unit *)c, "there are no directional derivatives");
}
