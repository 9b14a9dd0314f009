// Steps a model in MuJoCo and says how fast and how well.
// Usage: mujoco_steps model.xml state.txt steps
//
// state.txt: positions, rates and applied forces of all coordinates, in the model's order. Printed:
//   steps_per_second contacts penetration energy_start energy_end drift constraint
// The mean number of contacts and the greatest penetration (m) in the second half, mechanical energy
// (J), the farthest that a body moves in the last tenth (m), the greatest error of a joint equality.
// The time is the best of five runs; what is measured is taken in a run of its own.
#include <math.h>
#include <mujoco/mujoco.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static double now(void) {
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return t.tv_sec + 1e-9 * t.tv_nsec;
}

static int read_numbers(FILE* f, mjtNum* to, int n) {
  for (int i = 0; i < n; ++i)
    if (fscanf(f, "%lf", &to[i]) != 1) return 0;
  return 1;
}

static double energy(const mjModel* m, mjData* d) {
  mj_forward(m, d);
  mj_energyPos(m, d);
  mj_energyVel(m, d);
  return d->energy[0] + d->energy[1];
}

int main(int argc, char** argv) {
  char error[1000] = "";
  if (argc != 4) {
    fprintf(stderr, "usage: %s model.xml state.txt steps\n", argv[0]);
    return 2;
  }
  mjModel* m = mj_loadXML(argv[1], NULL, error, sizeof error);
  FILE* f = fopen(argv[2], "r");
  const int steps = atoi(argv[3]);
  if (!m || !f || steps <= 0) {
    fprintf(stderr, "%s\n", error);
    return 1;
  }
  mjData* start = mj_makeData(m);
  if (!read_numbers(f, start->qpos, m->nq) || !read_numbers(f, start->qvel, m->nv) ||
      !read_numbers(f, start->qfrc_applied, m->nv)) {
    fprintf(stderr, "state: %d positions and %d rates wanted\n", (int)m->nq, (int)m->nv);
    return 1;
  }
  fclose(f);
  mjData* d = mj_makeData(m);
  double best = 1e300;
  for (int run = 0; run < 5; ++run) {
    mj_copyData(d, m, start);
    const double t = now();
    for (int i = 0; i < steps; ++i) mj_step(m, d);
    best = fmin(best, now() - t);
  }
  mj_copyData(d, m, start);
  const double before = energy(m, d);
  mj_copyData(d, m, start);
  mjtNum* place = malloc(sizeof(mjtNum) * 3 * m->nbody);
  double contacts = 0.0, depth = 0.0, off = 0.0;
  for (int i = 0; i < steps; ++i) {
    if (i == steps - steps / 10) memcpy(place, d->xpos, sizeof(mjtNum) * 3 * m->nbody);
    mj_step(m, d);
    for (int e = 0; e < d->ne; ++e) off = fmax(off, fabs(d->efc_pos[e]));
    if (i < steps / 2) continue;
    for (int c = 0; c < d->ncon; ++c) depth = fmax(depth, -d->contact[c].dist);
    contacts += d->ncon;
  }
  double drift = 0.0;
  for (int b = 0; b < m->nbody; ++b) {
    mjtNum s[3];
    mju_sub3(s, d->xpos + 3 * b, place + 3 * b);
    drift = fmax(drift, mju_norm3(s));
  }
  printf("%.1f %.2f %.6e %.6f %.6f %.6e %.6e\n", steps / best, contacts / (steps - steps / 2), depth,
         before, energy(m, d), drift, off);
  return 0;
}
