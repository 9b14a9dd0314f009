/* Test units of FMI 2.0: the functions of both interfaces around model.h. Written from the standard;
   no header of another project. */
#include "model.h"
#define API __attribute__((visibility("default")))
typedef int Status;
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*finished)(void *, int);
    void *environment;
} Callbacks;
typedef struct { int needed, terminate, nominals, values, defined; double next; } EventInfo;
typedef struct { Model model; const Callbacks *callbacks; char name[64]; } Instance;

static void say(Instance *i, const char *text) {
    i->callbacks->logger(i->callbacks->environment, i->name, 3, "error", text);
}

API const char *fmi2GetTypesPlatform(void) { return "default"; }
API const char *fmi2GetVersion(void) { return "2.0"; }
API void *fmi2Instantiate(const char *name, int type, const char *guid, const char *resources,
                          const Callbacks *callbacks, int visible, int logging) {
    (void)type, (void)visible, (void)logging;
    if (strcmp(guid, GUID)) {
        callbacks->logger(callbacks->environment, name, 3, "error", "the guid is of another model");
        return NULL;
    }
    if (strncmp(resources, "file:///", 8)) return NULL;
    Instance *i = callbacks->allocate(1, sizeof *i);
    i->callbacks = callbacks;
    strncpy(i->name, name, 63);
    model_defaults(&i->model);
    return i;
}
API void fmi2FreeInstance(Instance *i) { i->callbacks->release(i); }
API Status fmi2SetupExperiment(Instance *i, int d, double tol, double start, int e, double stop) {
    (void)d, (void)tol, (void)e, (void)stop;
    i->model.real[R_TIME] = start;
    return 0;
}
API Status fmi2EnterInitializationMode(Instance *i) {
    if (i->model.whole[I_FAULT - I_BASE] == BAD_INIT) {
        say(i, "the spring is upside down");
        return 3;
    }
    return 0;
}
API Status fmi2ExitInitializationMode(Instance *i) {
    i->model.initialized = 1;
    model_rates(&i->model);
    return 0;
}
API Status fmi2Terminate(Instance *i) { (void)i; return 0; }
API Status fmi2GetReal(Instance *i, const unsigned *r, size_t n, double *v) {
    model_rates(&i->model);
    for (size_t k = 0; k < n; k++) { if (r[k] >= R_COUNT) return 3; v[k] = i->model.real[r[k]]; }
    return 0;
}
API Status fmi2SetReal(Instance *i, const unsigned *r, size_t n, const double *v) {
    for (size_t k = 0; k < n; k++) { if (r[k] >= R_COUNT) return 3; i->model.real[r[k]] = v[k]; }
    return 0;
}
API Status fmi2GetInteger(Instance *i, const unsigned *r, size_t n, int *v) {
    for (size_t k = 0; k < n; k++) v[k] = i->model.whole[r[k] - I_BASE];
    return 0;
}
API Status fmi2SetInteger(Instance *i, const unsigned *r, size_t n, const int *v) {
    for (size_t k = 0; k < n; k++) i->model.whole[r[k] - I_BASE] = v[k];
    return 0;
}
API Status fmi2GetBoolean(Instance *i, const unsigned *r, size_t n, int *v) {
    return fmi2GetInteger(i, r, n, v);
}
API Status fmi2SetBoolean(Instance *i, const unsigned *r, size_t n, const int *v) {
    return fmi2SetInteger(i, r, n, v);
}
API Status fmi2SetString(Instance *i, const unsigned *r, size_t n, const char *const *v) {
    (void)i, (void)v;
    // A test describes one text, which has no effect.
    return n == 1 && r[0] == 40 ? 0 : 3;
}
API Status fmi2GetFMUstate(Instance *i, void **state) {
    *state = malloc(sizeof(Model));
    memcpy(*state, &i->model, sizeof(Model));
    return 0;
}
API Status fmi2SetFMUstate(Instance *i, void *state) { memcpy(&i->model, state, sizeof(Model)); return 0; }
API Status fmi2FreeFMUstate(Instance *i, void **state) { (void)i; free(*state); *state = NULL; return 0; }
API Status fmi2SerializedFMUstateSize(Instance *i, void *s, size_t *n) { (void)i, (void)s; *n = sizeof(Model); return 0; }
API Status fmi2SerializeFMUstate(Instance *i, void *s, char *to, size_t n) {
    (void)i;
    if (n < sizeof(Model)) return 3;
    memcpy(to, s, sizeof(Model));
    return 0;
}
API Status fmi2DeSerializeFMUstate(Instance *i, const char *from, size_t n, void **s) {
    if (n != sizeof(Model)) { say(i, "a state of another size"); return 3; }
    *s = malloc(n);
    memcpy(*s, from, n);
    return 0;
}
/* Co-simulation. */
API Status fmi2DoStep(Instance *i, double t, double h, int no_prior) {
    (void)no_prior;
    if (fabs(t - i->model.real[R_TIME]) > 1e-9) { say(i, "a step from another time"); return 3; }
    Status s = model_status(&i->model);
    if (s) { say(i, "the step failed"); return s; }
    model_advance(&i->model, h);
    return 0;
}
/* Model exchange. */
API Status fmi2EnterEventMode(Instance *i) { return i->model.whole[I_FAULT - I_BASE] == BAD_EVENT && i->model.real[R_TIME] > 0 ? 3 : 0; }
API Status fmi2NewDiscreteStates(Instance *i, EventInfo *e) {
    memset(e, 0, sizeof *e);
    e->needed = model_event(&i->model);
    e->values = e->needed;
#if MODEL == 2
    e->defined = !i->model.whole[I_LAMP - I_BASE];
    e->next = i->model.real[R_P3];
#endif
    return 0;
}
API Status fmi2EnterContinuousTimeMode(Instance *i) { (void)i; return 0; }
API Status fmi2CompletedIntegratorStep(Instance *i, int no_prior, int *event, int *end) {
    (void)no_prior;
    *event = 0;
    *end = i->model.whole[I_FAULT - I_BASE] == BAD_END && i->model.real[R_TIME] > 0.05;
    return 0;
}
API Status fmi2SetTime(Instance *i, double t) { i->model.real[R_TIME] = t; return 0; }
API Status fmi2SetContinuousStates(Instance *i, const double *x, size_t n) {
    if (n != 2) return 3;
    memcpy(&i->model.real[R_X], x, 2 * sizeof *x);
    return 0;
}
API Status fmi2GetContinuousStates(Instance *i, double *x, size_t n) {
    if (n != 2) return 3;
    memcpy(x, &i->model.real[R_X], 2 * sizeof *x);
    return 0;
}
API Status fmi2GetDerivatives(Instance *i, double *x, size_t n) {
    if (n != 2) return 3;
    model_rates(&i->model);
    memcpy(x, &i->model.real[R_DX], 2 * sizeof *x);
    Status s = model_status(&i->model);
    if (s) say(i, "no rates today");
    return s;
}
API Status fmi2GetEventIndicators(Instance *i, double *z, size_t n) {
    if (n != 1) return 3;
    z[0] = model_indicator(&i->model);
    return 0;
}
