/* Test units of FMI 3.0: the functions of both interfaces around model.h. Written from the standard;
   no header of another project. `both` (reference 30) is an array of x and v. */
#include "model.h"
#include <stdbool.h>
#include <stdint.h>
#define API __attribute__((visibility("default")))
typedef int Status;
typedef void (*Logger)(void *, int, const char *, const char *);
/* With `events`, the unit stops at the impact of the ball and leaves it to event mode. */
typedef struct { Model model; Logger logger; void *environment; bool events, in_event; } Instance;
enum { BOTH = 30 };

static void say(Instance *i, const char *text) { i->logger(i->environment, 3, "error", text); }

static void *make(const char *token, const char *resources, void *environment, Logger logger) {
    size_t n = strlen(resources);
    if (strcmp(token, GUID)) {
        logger(environment, 3, "error", "the token is of another model");
        return NULL;
    }
    if (!n || resources[0] != '/' || resources[n - 1] != '/') return NULL;
    Instance *i = calloc(1, sizeof *i);
    i->logger = logger;
    i->environment = environment;
    model_defaults(&i->model);
    return i;
}
API const char *fmi3GetVersion(void) { return "3.0"; }
API void *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible,
                                      bool logging, bool events, bool early, const uint32_t *required,
                                      size_t n, void *environment, Logger logger, void *intermediate) {
    (void)name, (void)visible, (void)logging, (void)required, (void)n, (void)intermediate;
    Instance *i = make(token, resources, environment, logger);
    if (i) i->events = i->in_event = events && early;
    return i;
}
API void *fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible,
                                       bool logging, void *environment, Logger logger) {
    (void)name, (void)visible, (void)logging;
    return make(token, resources, environment, logger);
}
API void fmi3FreeInstance(Instance *i) { free(i); }
API Status fmi3EnterInitializationMode(Instance *i, bool d, double tol, double start, bool e, double stop) {
    (void)d, (void)tol, (void)e, (void)stop;
    i->model.real[R_TIME] = start;
    if (i->model.whole[I_FAULT - I_BASE] == BAD_INIT) { say(i, "the ball is square"); return 3; }
    return 0;
}
API Status fmi3ExitInitializationMode(Instance *i) { i->model.initialized = 1; model_rates(&i->model); return 0; }
API Status fmi3Terminate(Instance *i) { (void)i; return 0; }
API Status fmi3GetFloat64(Instance *i, const uint32_t *r, size_t n, double *v, size_t nv) {
    model_rates(&i->model);
    if (n == 1 && r[0] == BOTH) {
        if (nv != 2) return 3;
        memcpy(v, &i->model.real[R_X], 2 * sizeof *v);
        return 0;
    }
    for (size_t k = 0; k < n; k++) { if (r[k] >= R_COUNT) return 3; v[k] = i->model.real[r[k]]; }
    return 0;
}
API Status fmi3SetFloat64(Instance *i, const uint32_t *r, size_t n, const double *v, size_t nv) {
    if (nv != n) return 3;
    for (size_t k = 0; k < n; k++) { if (r[k] >= R_COUNT) return 3; i->model.real[r[k]] = v[k]; }
    return 0;
}
API Status fmi3GetInt32(Instance *i, const uint32_t *r, size_t n, int32_t *v, size_t nv) {
    (void)nv;
    for (size_t k = 0; k < n; k++) v[k] = i->model.whole[r[k] - I_BASE];
    return 0;
}
API Status fmi3SetInt32(Instance *i, const uint32_t *r, size_t n, const int32_t *v, size_t nv) {
    (void)nv;
    if (i->events && i->model.initialized && !i->in_event) { say(i, "a discrete input outside of event mode"); return 3; }
    for (size_t k = 0; k < n; k++) i->model.whole[r[k] - I_BASE] = v[k];
    return 0;
}
API Status fmi3GetBoolean(Instance *i, const uint32_t *r, size_t n, bool *v, size_t nv) {
    (void)nv;
    for (size_t k = 0; k < n; k++) v[k] = i->model.whole[r[k] - I_BASE];
    return 0;
}
API Status fmi3GetFMUState(Instance *i, void **state) {
    *state = malloc(sizeof(Model));
    memcpy(*state, &i->model, sizeof(Model));
    return 0;
}
API Status fmi3SetFMUState(Instance *i, void *state) { memcpy(&i->model, state, sizeof(Model)); return 0; }
API Status fmi3FreeFMUState(Instance *i, void **state) { (void)i; free(*state); *state = NULL; return 0; }
API Status fmi3SerializedFMUStateSize(Instance *i, void *s, size_t *n) { (void)i, (void)s; *n = sizeof(Model); return 0; }
API Status fmi3SerializeFMUState(Instance *i, void *s, uint8_t *to, size_t n) {
    (void)i;
    if (n < sizeof(Model)) return 3;
    memcpy(to, s, sizeof(Model));
    return 0;
}
API Status fmi3DeserializeFMUState(Instance *i, const uint8_t *from, size_t n, void **s) {
    if (n != sizeof(Model)) { say(i, "a state of another size"); return 3; }
    *s = malloc(n);
    memcpy(*s, from, n);
    return 0;
}
/* Co-simulation. */
API Status fmi3DoStep(Instance *i, double t, double h, bool no_prior, bool *event, bool *end, bool *early, double *reached) {
    (void)no_prior;
    *event = *end = *early = false;
    if (fabs(t - i->model.real[R_TIME]) > 1e-9) { say(i, "a step from another time"); return 3; }
    Status s = model_status(&i->model);
    if (s) { say(i, "the step failed"); return s; }
#if MODEL == 2
    if (i->events) {
        double *r = i->model.real, g = r[R_P1], v = r[R_V], x = model_indicator(&i->model);
        double hit = (v + sqrt(v * v + 2 * g * (x > 0 ? x : 0))) / g;
        if (i->in_event) { say(i, "a step in event mode"); return 3; }
        *event = *early = hit < h;
        if (hit > h) hit = h;
        r[R_X] = *event ? -i->model.whole[I_FLOOR - I_BASE] : r[R_X] + v * hit - g * hit * hit / 2;
        r[R_V] -= g * hit;
        *reached = r[R_TIME] = t + hit;
        model_rates(&i->model);
        return 0;
    }
#endif
    model_advance(&i->model, h);
    *reached = t + h;
    *end = i->model.whole[I_FAULT - I_BASE] == BAD_END && i->model.real[R_TIME] > 0.05;
    return 0;
}
/* Model exchange. */
API Status fmi3EnterEventMode(Instance *i) { i->in_event = true; return 0; }
API Status fmi3EnterStepMode(Instance *i) { i->in_event = false; return 0; }
API Status fmi3UpdateDiscreteStates(Instance *i, bool *needed, bool *end, bool *nominals, bool *values, bool *defined, double *next) {
    *end = *nominals = *defined = false;
    *needed = *values = model_event(&i->model);
#if MODEL == 2
    *defined = !i->model.whole[I_LAMP - I_BASE];
    *next = i->model.real[R_P3];
#endif
    return 0;
}
API Status fmi3EnterContinuousTimeMode(Instance *i) { (void)i; return 0; }
API Status fmi3CompletedIntegratorStep(Instance *i, bool no_prior, bool *event, bool *end) {
    (void)i, (void)no_prior;
    *event = *end = false;
    return 0;
}
API Status fmi3SetTime(Instance *i, double t) { i->model.real[R_TIME] = t; return 0; }
API Status fmi3SetContinuousStates(Instance *i, const double *x, size_t n) {
    if (n != 2) return 3;
    memcpy(&i->model.real[R_X], x, 2 * sizeof *x);
    return 0;
}
API Status fmi3GetContinuousStates(Instance *i, double *x, size_t n) {
    if (n != 2) return 3;
    memcpy(x, &i->model.real[R_X], 2 * sizeof *x);
    return 0;
}
API Status fmi3GetContinuousStateDerivatives(Instance *i, double *x, size_t n) {
    if (n != 2) return 3;
    model_rates(&i->model);
    memcpy(x, &i->model.real[R_DX], 2 * sizeof *x);
    return model_status(&i->model);
}
API Status fmi3GetEventIndicators(Instance *i, double *z, size_t n) {
    if (n != 1) return 3;
    z[0] = model_indicator(&i->model);
    return 0;
}
