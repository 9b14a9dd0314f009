/* A test unit of FMI 3.0 with clocks, for model exchange and for co-simulation with event mode. Written from the standard; no header of another
   project.

   clock 1 (1)   periodic: each tick increments the slope of x, and its second tick starts the countdown
   clock 2 (2)   periodic: samples the input (10) into a sum
   clock 3 (3)   countdown of `AFTER` s
   clock 4 (4)   output: ticks whenever the number of all ticks is a multiple of three
   A clock or the sampled input that is set outside of event mode is an error. */
#include <math.h>
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <stdlib.h>
#include <string.h>
#define API __attribute__((visibility("default")))
#define AFTER 0.07
typedef int Status;
enum { OK = 0, ERROR = 3 };
typedef struct {
    double t, x, input, sum, interval;
    int32_t made[4], total;
    bool active[4], out, in_event, exchange;
    int qualifier;
} Unit;

static Unit *make(const char *token, bool exchange) {
    if (strcmp(token, GUID)) return NULL;
    Unit *u = calloc(1, sizeof *u);
    u->exchange = exchange;
    return u;
}
API const char *fmi3GetVersion(void) { return "3.0"; }
API Unit *fmi3InstantiateModelExchange(const char *name, const char *token, const char *resources, bool visible, bool logging,
                                       void *environment, void *logger) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)environment, (void)logger;
    return make(token, true);
}
API Unit *fmi3InstantiateCoSimulation(const char *name, const char *token, const char *resources, bool visible, bool logging, bool events,
                                      bool early, const uint32_t *required, size_t n, void *environment, void *logger, void *update) {
    (void)name, (void)resources, (void)visible, (void)logging, (void)early, (void)required, (void)n, (void)environment, (void)logger, (void)update;
    return events ? make(token, false) : NULL;
}
API void fmi3FreeInstance(Unit *u) { free(u); }
API Status fmi3EnterInitializationMode(Unit *u, bool d, double tolerance, double start, bool e, double stop) {
    (void)d, (void)tolerance, (void)e, (void)stop;
    u->t = start;
    return OK;
}
API Status fmi3ExitInitializationMode(Unit *u) { u->in_event = true; return OK; }
API Status fmi3Terminate(Unit *u) { (void)u; return OK; }
API Status fmi3EnterEventMode(Unit *u) { u->in_event = true; return OK; }
API Status fmi3EnterContinuousTimeMode(Unit *u) { u->in_event = false; return OK; }
API Status fmi3EnterStepMode(Unit *u) { u->in_event = false; return OK; }
API Status fmi3SetClock(Unit *u, const uint32_t *r, size_t n, const bool *v) {
    for (size_t k = 0; k < n; k++) {
        if (!u->in_event || r[k] < 1 || r[k] > 3) return ERROR;
        u->active[r[k]] = v[k];
    }
    return OK;
}
API Status fmi3GetClock(Unit *u, const uint32_t *r, size_t n, bool *v) {
    for (size_t k = 0; k < n; k++) {
        if (!u->in_event || r[k] != 4) return ERROR;
        v[k] = u->out;
    }
    return OK;
}
API Status fmi3GetIntervalDecimal(Unit *u, const uint32_t *r, size_t n, double *v, int *qualifiers) {
    for (size_t k = 0; k < n; k++) {
        if (!u->in_event || r[k] != 3) return ERROR;
        v[k] = u->interval;
        qualifiers[k] = u->qualifier;
        if (u->qualifier == 2) u->qualifier = 1;
    }
    return OK;
}
API Status fmi3UpdateDiscreteStates(Unit *u, bool *needed, bool *end, bool *nominals, bool *values, bool *defined, double *next) {
    if (!u->in_event) return ERROR;
    u->out = false;
    for (int k = 1; k < 4; k++) {
        if (!u->active[k]) continue;
        u->active[k] = false;
        u->made[k]++;
        if (++u->total % 3 == 0) u->out = true;
        if (k == 1 && u->made[1] == 2) { u->interval = AFTER; u->qualifier = 2; }
        if (k == 2) u->sum += u->input;
    }
    *needed = u->out;
    *end = *nominals = *values = *defined = false;
    *next = 0;
    return OK;
}
API Status fmi3GetFloat64(Unit *u, const uint32_t *r, size_t n, double *v, size_t count) {
    if (n != count) return ERROR;
    for (size_t k = 0; k < n; k++) v[k] = r[k] == 10 ? u->input : r[k] == 11 ? u->x : r[k] == 12 ? u->sum : u->made[1];
    return OK;
}
API Status fmi3SetFloat64(Unit *u, const uint32_t *r, size_t n, const double *v, size_t count) {
    if (n != 1 || count != 1 || r[0] != 10 || !u->in_event) return ERROR;
    u->input = v[0];
    return OK;
}
API Status fmi3GetInt32(Unit *u, const uint32_t *r, size_t n, int32_t *v, size_t count) {
    if (n != count) return ERROR;
    for (size_t k = 0; k < n; k++) v[k] = u->made[r[k] - 20];
    return OK;
}
API Status fmi3DoStep(Unit *u, double t, double h, bool no_prior, bool *event, bool *end, bool *early, double *reached) {
    (void)no_prior;
    if (u->in_event || fabs(t - u->t) > 1e-9) return ERROR;
    u->x += u->made[1] * h;
    u->t = t + h;
    *event = *end = *early = false;
    *reached = u->t;
    return OK;
}
API Status fmi3SetTime(Unit *u, double t) { u->t = t; return OK; }
API Status fmi3SetContinuousStates(Unit *u, const double *x, size_t n) { if (n != 1) return ERROR; u->x = x[0]; return OK; }
API Status fmi3GetContinuousStates(Unit *u, double *x, size_t n) { if (n != 1) return ERROR; x[0] = u->x; return OK; }
API Status fmi3GetContinuousStateDerivatives(Unit *u, double *x, size_t n) { if (n != 1) return ERROR; x[0] = u->made[1]; return OK; }
API Status fmi3CompletedIntegratorStep(Unit *u, bool no_prior, bool *event, bool *end) {
    (void)u, (void)no_prior;
    *event = *end = false;
    return OK;
}
