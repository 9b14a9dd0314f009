/* A model for test units, as plain C: a mass on a spring and damper (MODEL 1), a ball that falls
   and bounces (MODEL 2). The two interfaces are in fmi2.c and fmi3.c.

   spring:  m a = f - k x - c v          states x, v; output a sees the input f at once
   ball:    a = -g; at h = 0 with v < 0: v <- -e v, n <- n + 1; `lamp` goes on at `on_at` (time event)
            and the input `floor` (whole number, metres below 0) is read at events only          */
#include <math.h>
#include <stddef.h>
#include <stdlib.h>
#include <string.h>

/* References of the reals and whole numbers. */
enum { R_TIME, R_X, R_V, R_DX, R_DV, R_P1, R_P2, R_P3, R_IN, R_OUT, R_COUNT };
enum { I_N = 20, I_LAMP = 21, I_FLOOR = 22, I_FAULT = 23, I_BASE = 20, I_COUNT = 4 };

typedef struct {
    double real[R_COUNT];
    int whole[I_COUNT];
    double on_at;
    int initialized;
} Model;

/* What a unit is told to do wrong: `fault`. */
enum { FINE, BAD_INIT, BAD_STEP, BAD_NAN, BAD_DISCARD, BAD_FATAL, BAD_END, BAD_EVENT };

static void model_defaults(Model *m) {
    memset(m, 0, sizeof *m);
#if MODEL == 1
    m->real[R_X] = 1.0;  /* x */
    m->real[R_P1] = 1.0; /* mass */
    m->real[R_P2] = 4.0; /* stiffness */
    m->real[R_P3] = 0.4; /* damping */
#else
    m->real[R_X] = 1.0;   /* height */
    m->real[R_P1] = 9.81; /* gravity */
    m->real[R_P2] = 0.8;  /* restitution */
    m->real[R_P3] = 0.25; /* on_at */
#endif
}

static void model_rates(Model *m) {
    double *r = m->real;
    r[R_DX] = r[R_V];
#if MODEL == 1
    r[R_DV] = (r[R_IN] - r[R_P2] * r[R_X] - r[R_P3] * r[R_V]) / r[R_P1];
    r[R_OUT] = r[R_DV];
#else
    r[R_DV] = -r[R_P1];
    r[R_OUT] = r[R_X] + m->whole[I_FLOOR - I_BASE];
#endif
    if (m->whole[I_FAULT - I_BASE] == BAD_NAN && r[R_TIME] > 0.05) r[R_X] = r[R_OUT] = NAN;
}

static double model_indicator(const Model *m) {
    /* The sign is also that of the side after an impact: the unit keeps its own small offset. */
    return m->real[R_X] + m->whole[I_FLOOR - I_BASE];
}

/* One pass of an event; gives 1 when something changed. */
static int model_event(Model *m) {
    int changed = 0;
#if MODEL == 2
    if (model_indicator(m) <= 0 && m->real[R_V] < 0) {
        m->real[R_X] = -m->whole[I_FLOOR - I_BASE] + 1e-14;
        m->real[R_V] = -m->real[R_P2] * m->real[R_V];
        m->whole[I_N - I_BASE]++;
        changed = 1;
    }
    if (!m->whole[I_LAMP - I_BASE] && m->real[R_TIME] >= m->real[R_P3]) {
        m->whole[I_LAMP - I_BASE] = 1;
        changed = 1;
    }
#endif
    return changed;
}

/* One step of the unit's own solver: `STEPS` steps of Runge and Kutta, or of the closed form. */
enum { STEPS = 4 };
static void model_advance(Model *m, double h) {
    double *r = m->real, t0 = r[R_TIME];
    int i, s;
#if MODEL == 2
    double end = t0 + h, t = t0;
    for (i = 0; i < 100 && t < end; i++) {
        double g = r[R_P1], v = r[R_V], x = model_indicator(m), hit;
        hit = (v + sqrt(v * v + 2 * g * (x > 0 ? x : 0))) / g;
        if (t + hit > end) hit = end - t;
        r[R_X] += v * hit - g * hit * hit / 2;
        r[R_V] -= g * hit;
        t += hit;
        r[R_TIME] = t;
        if (t < end) r[R_X] = -m->whole[I_FLOOR - I_BASE]; /* rounding of the root */
        while (model_event(m)) {}
    }
    r[R_TIME] = end;
    (void)s;
#else
    for (i = 0; i < STEPS; i++) {
        double d = h / STEPS, x0 = r[R_X], v0 = r[R_V], kx[4], kv[4];
        static const double at[4] = {0, 0.5, 0.5, 1};
        for (s = 0; s < 4; s++) {
            r[R_X] = x0 + (s ? at[s] * d * kx[s - 1] : 0);
            r[R_V] = v0 + (s ? at[s] * d * kv[s - 1] : 0);
            model_rates(m);
            kx[s] = r[R_DX];
            kv[s] = r[R_DV];
        }
        r[R_X] = x0 + d / 6 * (kx[0] + 2 * kx[1] + 2 * kx[2] + kx[3]);
        r[R_V] = v0 + d / 6 * (kv[0] + 2 * kv[1] + 2 * kv[2] + kv[3]);
    }
    r[R_TIME] = t0 + h;
#endif
    model_rates(m);
}

/* Status of a step, by what the unit is told to do wrong: 0 fine, 2 discard, 3 error, 4 fatal. */
static int model_status(const Model *m) {
    if (m->real[R_TIME] < 0.05) return 0;
    switch (m->whole[I_FAULT - I_BASE]) {
    case BAD_STEP: return 3;
    case BAD_DISCARD: return 2;
    case BAD_FATAL: return 4;
    default: return 0;
    }
}
