/* A unit of FMI 2.0 (with -DVERSION=2) or 3.0 around `model.h`, which `fmi.py` generates: a table of variables, and the equations as C functions.
   Written from the standards; no header of another project.

   v[0] is the time; each variable has its values in v from `slot` on, texts have theirs in `text`. The interface returns an error for a variable of
   another type, for a parameter that is set after the start, and for a discrete input that is set in continuous-time mode (unless the environment
   has UNIT_LENIENT). */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#define API __attribute__((visibility("default")))
typedef int Status;
enum { OK = 0, ERROR = 3 };
enum { TEXT = 64 };
/* Kinds: d f (floats), c C s S i I l L (integers, unsigned ones in capitals), o (boolean), e (enumeration), t (text).
   Roles: p (parameter), u (continuous input), n (discrete input), x (state), y (anything else). */
typedef struct { uint32_t reference; char kind, role; int slot, size; } Var;
#include "model.h"

typedef struct {
    double v[SLOTS];
    char text[TEXTS][TEXT];
    int initialized, continuous, events, exchange;
} Unit;

static Status access(Unit *u, const char *kinds, const uint32_t *r, size_t n, double *values, size_t count, bool write) {
    size_t at = 0;
    for (size_t k = 0; k < n; k++) {
        const Var *var = NULL;
        for (int j = 0; j < VARS; j++)
            if (vars[j].reference == r[k] && strchr(kinds, vars[j].kind)) var = &vars[j];
        if (!var || at + (size_t)var->size > count) return ERROR;
        bool early = var->role == 'n' && u->continuous && !getenv("UNIT_LENIENT");
        if (write && ((var->role == 'p' && u->initialized) || early || var->role == 'y')) return ERROR;
        for (int j = 0; j < var->size; j++, at++) {
            if (write) u->v[var->slot + j] = values[at];
            else values[at] = u->v[var->slot + j];
        }
    }
    return at == count ? OK : ERROR;
}
static Status get(Unit *u, const char *kinds, const uint32_t *r, size_t n, double *values, size_t count) {
    if (u->initialized) model_outputs(u->v);
    return access(u, kinds, r, n, values, count, false);
}
static Status texts(Unit *u, const uint32_t *r, size_t n, const char **values, bool write) {
    for (size_t k = 0; k < n; k++) {
        const Var *var = NULL;
        for (int j = 0; j < VARS; j++)
            if (vars[j].reference == r[k] && vars[j].kind == 't') var = &vars[j];
        if (!var || (write && u->initialized)) return ERROR;
        if (write) strncpy(u->text[var->slot], values[k], TEXT - 1);
        else values[k] = u->text[var->slot];
    }
    return OK;
}
static Unit *make(const char *token, bool exchange, bool events) {
    if (strcmp(token, TOKEN)) return NULL;
    Unit *u = calloc(1, sizeof *u);
    u->exchange = exchange;
    u->events = events;
    model_defaults(u->v, u->text);
    return u;
}
static void started(Unit *u) {
    model_start(u->v, u->text);
    u->initialized = 1;
    /* Without event mode, the unit handles its events itself. */
    if (!u->exchange && !u->events) while (model_event(u->v)) {}
    model_outputs(u->v);
}
/* Steps of Runge and Kutta of the unit's own solver; with event mode, it stops at an event. Returns whether it stopped. */
static bool advance(Unit *u, double h) {
    double *v = u->v, t0 = v[0], from = t0;
    int count = (int)ceil(h / STEP - 1e-6);
    if (!u->events) while (model_event(v)) {}
    for (int i = 0; i <= count; i++) {
        static const double at[4] = {0, 0.5, 0.5, 1};
        /* The last step is tiny: importers read outputs before or after an event at the end, so there should be none. */
        double to = i < count ? t0 + (1 - 1e-6) * h * (i + 1) / count : t0 + h, d = to - from, x[STATES + 1], k[4][STATES + 1];
        for (int j = 0; j < STATES; j++) x[j] = v[X + j];
        for (int s = 0; s < 4; s++) {
            v[0] = from + at[s] * d;
            for (int j = 0; j < STATES; j++) v[X + j] = x[j] + (s ? at[s] * d * k[s - 1][j] : 0);
            model_rates(v);
            for (int j = 0; j < STATES; j++) k[s][j] = v[DX + j];
        }
        for (int j = 0; j < STATES; j++) v[X + j] = x[j] + d / 6 * (k[0][j] + 2 * k[1][j] + 2 * k[2][j] + k[3][j]);
        v[0] = from = to;
        if (u->events && model_due(v)) return true;
        if (!u->events) while (model_event(v)) {}
    }
    return false;
}
static Status indicators(Unit *u, double *z, size_t n) {
    if (n != INDICATORS) return ERROR;
    model_indicators(u->v, z);
    return OK;
}
static Status states(Unit *u, double *x, size_t n, bool write) {
    if (n != STATES) return ERROR;
    for (int j = 0; j < STATES; j++) {
        if (write) u->v[X + j] = x[j];
        else x[j] = u->v[X + j];
    }
    return OK;
}
static Status rates(Unit *u, double *x, size_t n) {
    if (n != STATES) return ERROR;
    model_rates(u->v);
    for (int j = 0; j < STATES; j++) x[j] = u->v[DX + j];
    return OK;
}

#if VERSION == 2
typedef struct { int needed, end, nominals, values, defined; double next; } Info;
API const char *fmi2GetVersion(void) { return "2.0"; }
API const char *fmi2GetTypesPlatform(void) { return "default"; }
API Status fmi2SetDebugLogging(Unit *u, int on, size_t n, const char *const *c) { (void)u, (void)on, (void)n, (void)c; return OK; }
API Unit *fmi2Instantiate(const char *name, int type, const char *token, const char *resources, const void *f, int visible, int logging) {
    (void)name, (void)resources, (void)f, (void)visible, (void)logging;
    return make(token, type == 0, false);
}
API void fmi2FreeInstance(Unit *u) { free(u); }
API Status fmi2SetupExperiment(Unit *u, int d, double tolerance, double start, int e, double stop) {
    (void)d, (void)tolerance, (void)e, (void)stop;
    u->v[0] = start;
    return OK;
}
API Status fmi2EnterInitializationMode(Unit *u) { (void)u; return OK; }
API Status fmi2ExitInitializationMode(Unit *u) { started(u); return OK; }
API Status fmi2Terminate(Unit *u) { (void)u; return OK; }
API Status fmi2Reset(Unit *u) { (void)u; return ERROR; }
API Status fmi2GetReal(Unit *u, const uint32_t *r, size_t n, double *v) { return get(u, "d", r, n, v, n); }
API Status fmi2SetReal(Unit *u, const uint32_t *r, size_t n, const double *v) { return access(u, "d", r, n, (double *)v, n, true); }
static Status whole2(Unit *u, const char *kinds, const uint32_t *r, size_t n, int *v, bool write) {
    for (size_t k = 0; k < n; k++) {
        double x = v[k];
        Status s = write ? access(u, kinds, r + k, 1, &x, 1, true) : get(u, kinds, r + k, 1, &x, 1);
        if (s) return s;
        v[k] = (int)x;
    }
    return OK;
}
API Status fmi2GetInteger(Unit *u, const uint32_t *r, size_t n, int *v) { return whole2(u, "ie", r, n, v, false); }
API Status fmi2SetInteger(Unit *u, const uint32_t *r, size_t n, const int *v) { return whole2(u, "ie", r, n, (int *)v, true); }
API Status fmi2GetBoolean(Unit *u, const uint32_t *r, size_t n, int *v) { return whole2(u, "o", r, n, v, false); }
API Status fmi2SetBoolean(Unit *u, const uint32_t *r, size_t n, const int *v) { return whole2(u, "o", r, n, (int *)v, true); }
API Status fmi2GetString(Unit *u, const uint32_t *r, size_t n, const char **v) { return texts(u, r, n, v, false); }
API Status fmi2SetString(Unit *u, const uint32_t *r, size_t n, const char *const *v) { return texts(u, r, n, (const char **)v, true); }
API Status fmi2DoStep(Unit *u, double t, double h, int no_prior) {
    (void)no_prior;
    if (fabs(t - u->v[0]) > 1e-9) return ERROR;
    advance(u, h);
    return OK;
}
API Status fmi2EnterEventMode(Unit *u) { u->continuous = 0; return OK; }
API Status fmi2NewDiscreteStates(Unit *u, Info *info) {
    memset(info, 0, sizeof *info);
    info->needed = info->values = model_event(u->v);
    info->next = model_next(u->v);
    info->defined = isfinite(info->next);
    return OK;
}
API Status fmi2EnterContinuousTimeMode(Unit *u) { u->continuous = 1; return OK; }
API Status fmi2CompletedIntegratorStep(Unit *u, int no_prior, int *event, int *end) {
    (void)u, (void)no_prior;
    *event = *end = 0;
    return OK;
}
API Status fmi2SetTime(Unit *u, double t) { u->v[0] = t; return OK; }
API Status fmi2SetContinuousStates(Unit *u, const double *x, size_t n) { return states(u, (double *)x, n, true); }
API Status fmi2GetContinuousStates(Unit *u, double *x, size_t n) { return states(u, x, n, false); }
API Status fmi2GetDerivatives(Unit *u, double *x, size_t n) { return rates(u, x, n); }
API Status fmi2GetEventIndicators(Unit *u, double *z, size_t n) { return indicators(u, z, n); }
API Status fmi2GetNominalsOfContinuousStates(Unit *u, double *x, size_t n) {
    (void)u;
    for (size_t k = 0; k < n; k++) x[k] = 1;
    return OK;
}
/* The interface requires these functions; the description states that they are not supported. */
#define LACKS(name) API Status name(void) { return ERROR; }
LACKS(fmi2GetFMUstate) LACKS(fmi2SetFMUstate) LACKS(fmi2FreeFMUstate) LACKS(fmi2SerializedFMUstateSize)
LACKS(fmi2SerializeFMUstate) LACKS(fmi2DeSerializeFMUstate) LACKS(fmi2GetDirectionalDerivative)
LACKS(fmi2SetRealInputDerivatives) LACKS(fmi2GetRealOutputDerivatives) LACKS(fmi2CancelStep) LACKS(fmi2GetStatus)
LACKS(fmi2GetRealStatus) LACKS(fmi2GetIntegerStatus) LACKS(fmi2GetBooleanStatus) LACKS(fmi2GetStringStatus)
#else
API const char *fmi3GetVersion(void) { return "3.0"; }
API Status fmi3SetDebugLogging(Unit *u, bool on, size_t n, const char *const *c) { (void)u, (void)on, (void)n, (void)c; return OK; }
API Unit *fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                       void *environment, void *logger) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)environment, (void)logger;
    return make(token, true, false);
}
API Unit *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging, bool events,
                                      bool early, const uint32_t *required, size_t n, void *environment, void *logger, void *update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)early, (void)required, (void)n, (void)environment, (void)logger, (void)update;
    return make(token, false, events);
}
API void fmi3FreeInstance(Unit *u) { free(u); }
API Status fmi3EnterInitializationMode(Unit *u, bool d, double tolerance, double start, bool e, double stop) {
    (void)d, (void)tolerance, (void)e, (void)stop;
    u->v[0] = start;
    return OK;
}
API Status fmi3ExitInitializationMode(Unit *u) { started(u); return OK; }
API Status fmi3Terminate(Unit *u) { (void)u; return OK; }
API Status fmi3Reset(Unit *u) { (void)u; return ERROR; }
#define TYPE(name, type, kinds)                                                                                  \
    API Status fmi3Get##name(Unit *u, const uint32_t *r, size_t n, type *v, size_t count) {                      \
        double x[256];                                                                                           \
        if (count > 256) return ERROR;                                                                           \
        Status s = get(u, kinds, r, n, x, count);                                                                \
        for (size_t k = 0; !s && k < count; k++) v[k] = (type)x[k];                                              \
        return s;                                                                                                \
    }                                                                                                            \
    API Status fmi3Set##name(Unit *u, const uint32_t *r, size_t n, const type *v, size_t count) {                \
        double x[256];                                                                                           \
        if (count > 256) return ERROR;                                                                           \
        for (size_t k = 0; k < count; k++) x[k] = (double)v[k];                                                  \
        return access(u, kinds, r, n, x, count, true);                                                           \
    }
TYPE(Float64, double, "d") TYPE(Float32, float, "f") TYPE(Int8, int8_t, "c") TYPE(UInt8, uint8_t, "C")
TYPE(Int16, int16_t, "s") TYPE(UInt16, uint16_t, "S") TYPE(Int32, int32_t, "i") TYPE(UInt32, uint32_t, "I")
TYPE(Int64, int64_t, "le") TYPE(UInt64, uint64_t, "L") TYPE(Boolean, bool, "o")
API Status fmi3GetString(Unit *u, const uint32_t *r, size_t n, const char **v, size_t count) { (void)count; return texts(u, r, n, v, false); }
API Status fmi3SetString(Unit *u, const uint32_t *r, size_t n, const char *const *v, size_t count) { (void)count; return texts(u, r, n, (const char **)v, true); }
API Status fmi3DoStep(Unit *u, double t, double h, bool no_prior, bool *event, bool *end, bool *early, double *reached) {
    (void)no_prior;
    *end = false;
    if (fabs(t - u->v[0]) > 1e-9) return ERROR;
    *event = *early = advance(u, h);
    *reached = u->v[0];
    return OK;
}
API Status fmi3EnterEventMode(Unit *u) { u->continuous = 0; return OK; }
API Status fmi3EnterStepMode(Unit *u) { (void)u; return OK; }
API Status fmi3UpdateDiscreteStates(Unit *u, bool *needed, bool *end, bool *nominals, bool *values, bool *defined, double *next) {
    *end = *nominals = false;
    *needed = *values = model_event(u->v);
    *next = model_next(u->v);
    *defined = isfinite(*next);
    return OK;
}
API Status fmi3EnterContinuousTimeMode(Unit *u) { u->continuous = 1; return OK; }
API Status fmi3CompletedIntegratorStep(Unit *u, bool no_prior, bool *event, bool *end) {
    (void)u, (void)no_prior;
    *event = *end = false;
    return OK;
}
API Status fmi3SetTime(Unit *u, double t) { u->v[0] = t; return OK; }
API Status fmi3SetContinuousStates(Unit *u, const double *x, size_t n) { return states(u, (double *)x, n, true); }
API Status fmi3GetContinuousStates(Unit *u, double *x, size_t n) { return states(u, x, n, false); }
API Status fmi3GetContinuousStateDerivatives(Unit *u, double *x, size_t n) { return rates(u, x, n); }
API Status fmi3GetEventIndicators(Unit *u, double *z, size_t n) { return indicators(u, z, n); }
API Status fmi3GetNominalsOfContinuousStates(Unit *u, double *x, size_t n) {
    (void)u;
    for (size_t k = 0; k < n; k++) x[k] = 1;
    return OK;
}
API Status fmi3GetNumberOfContinuousStates(Unit *u, size_t *n) { (void)u; *n = STATES; return OK; }
API Status fmi3GetNumberOfEventIndicators(Unit *u, size_t *n) { (void)u; *n = INDICATORS; return OK; }
#define LACKS(name) API Status name(void) { return ERROR; }
LACKS(fmi3GetFMUState) LACKS(fmi3SetFMUState) LACKS(fmi3FreeFMUState) LACKS(fmi3SerializedFMUStateSize)
LACKS(fmi3SerializeFMUState) LACKS(fmi3DeserializeFMUState) LACKS(fmi3GetDirectionalDerivative) LACKS(fmi3GetAdjointDerivative)
LACKS(fmi3GetBinary) LACKS(fmi3SetBinary) LACKS(fmi3GetClock) LACKS(fmi3SetClock) LACKS(fmi3GetNumberOfVariableDependencies)
LACKS(fmi3GetVariableDependencies) LACKS(fmi3GetIntervalDecimal) LACKS(fmi3GetIntervalFraction) LACKS(fmi3GetShiftDecimal)
LACKS(fmi3GetShiftFraction) LACKS(fmi3SetIntervalDecimal) LACKS(fmi3SetIntervalFraction) LACKS(fmi3SetShiftDecimal)
LACKS(fmi3SetShiftFraction) LACKS(fmi3EvaluateDiscreteStates) LACKS(fmi3EnterConfigurationMode) LACKS(fmi3ExitConfigurationMode)
LACKS(fmi3GetOutputDerivatives) LACKS(fmi3InstantiateScheduledExecution) LACKS(fmi3ActivateModelPartition)
#endif
