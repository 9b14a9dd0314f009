/* An arm reaches for a cup, plans a collision-free path and its time parameterization, takes the cup, and asks what it weighs.
 *   cc -I include examples/arm.c liblinkwork_robot.a -lpthread -ldl -lm -o arm && ./arm examples
 */
#include <linkwork/robot.h>

#include <stdio.h>
#include <stdlib.h>

enum { NV = 3, ROWS = 16 };

/* What a handle says of its last failure ends the program. */
#define TRY(call, handle_message, handle)                                    \
  do {                                                                       \
    LwStatus status = (call);                                                \
    if (status != LW_STATUS_OK) {                                            \
      char text[4096] = "";                                                  \
      handle_message((handle), text, sizeof text, NULL);                     \
      fprintf(stderr, "%s: %s: %s\n", #call, lw_status_text(status), text);  \
      exit(1);                                                               \
    }                                                                        \
  } while (0)
#define BUILD(call) TRY(call, lw_builder_message, builder)
#define NAME(call) TRY(call, lw_model_message, model)
#define ROBOT(call) TRY(call, lw_robot_message, robot)

static void print(const char *what, const double *x, size_t n) {
  printf("%s", what);
  for (size_t i = 0; i < n; ++i) printf(" %.17g", x[i]);
  printf("\n");
}

int main(int argc, char **argv) {
  if (argc != 2) {
    fprintf(stderr, "usage: %s FOLDER of arm.urdf and arm.srdf\n", argv[0]);
    return 2;
  }
  char path[4096];

  /* Set-up: files, the cup, a shelf, and a model of them all. */
  LwBuilder *builder = NULL;
  if (lw_builder_new(&builder) != LW_STATUS_OK) return 1;
  snprintf(path, sizeof path, "%s/arm.urdf", argv[1]);
  BUILD(lw_builder_robot_file(builder, path, LW_ROOT_FIXED, LW_INERTIA_WARN));
  snprintf(path, sizeof path, "%s/arm.srdf", argv[1]);
  BUILD(lw_builder_groups_file(builder, path));
  BUILD(lw_builder_file_shapes(builder));
  const double center[3] = {0.0, 0.0, 0.0};
  const double inertia[9] = {2e-3, 0, 0, 0, 2e-3, 0, 0, 0, 1e-3};
  BUILD(lw_builder_object(builder, "cup", 0.4, center, inertia));
  const LwShape can = {LW_SHAPE_CYLINDER, {0.04, 0.05, 0.0}};
  BUILD(lw_builder_shape(builder, "can", "cup", NULL, &can));
  const LwShape board = {LW_SHAPE_BOX, {0.1, 0.4, 0.02}};
  const LwPose above = {{0.6, 0.0, 0.9}, {0.0, 0.0, 0.0, 1.0}};
  BUILD(lw_builder_shape(builder, "shelf", "world", &above, &board));
  LwModel *model = NULL;
  BUILD(lw_builder_model(builder, &model));
  char warnings[2000]; /* masses of the file that no body has */
  lw_model_doubtful(model, warnings, sizeof warnings, NULL);
  if (warnings[0]) fprintf(stderr, "warning: %s\n", warnings);
  lw_builder_free(builder);

  /* Names once. */
  uint32_t arm, cup;
  size_t nq, nv;
  NAME(lw_model_part(model, "arm", &arm));
  NAME(lw_model_object(model, "cup", &cup));
  NAME(lw_model_sizes(model, &nq, &nv));
  if (nq != NV || nv != NV) return 1;

  LwRobot *robot = NULL;
  NAME(lw_robot_new(model, &robot));

  /* Memory of calls that not every robot makes. */
  LwRateControl *control = NULL;
  LwPlanner *planner = NULL;
  LwTiming *timing = NULL;
  ROBOT(lw_rate_control_new(robot, 1, 1, &control));
  ROBOT(lw_planner_new(robot, arm, 100, &planner));
  ROBOT(lw_timing_new(robot, ROWS, 40 * ROWS, &timing));

  /* From here on nothing is allocated. */
  double q[NV] = {0.3, 0.8, -1.1}, tau[NV], J[6 * NV], M[NV * NV], mass, at[3];
  ROBOT(lw_robot_set_q(robot, q, NV));
  LwPose tip;
  ROBOT(lw_robot_tip_pose(robot, arm, &tip));
  print("tip", tip.position, 3);
  ROBOT(lw_robot_jacobian(robot, arm, J, 6 * NV));
  print("jacobian", J, 6 * NV);

  const LwGoal goal = {.pose.position = {0.5, 0.2, 0.5}, .weights = {1.0, 1.0}, .parts = LW_GOAL_POSITION};
  LwAnswer answer;
  ROBOT(lw_robot_inverse_kinematics(robot, arm, &goal, NULL, q, NV, &answer));
  if (answer.outcome != LW_OUTCOME_MET) {
    fprintf(stderr, "not reached: %g m are missing\n", answer.position);
    return 1;
  }
  print("q", q, NV);
  ROBOT(lw_robot_set_q(robot, q, NV));

  /* Upwards within limits, and not into a singular configuration. */
  LwManipulability able;
  ROBOT(lw_robot_manipulability(robot, arm, LW_ROWS_LINEAR, 0.0, &able, NULL, 0));
  print("manipulability", &able.w, 1);
  const LwObjective upwards = {
      .kind = LW_OBJECTIVE_TIP, .weight = 1.0, .motion = {0, 0, 0, 0, 0, 0.2}, .part = arm, .rows = LW_ROWS_LINEAR};
  const LwGuard guard = {.least = 0.01, .part = arm};
  double rates[NV];
  ROBOT(lw_rate_control_solve(robot, control, &upwards, 1, 0.05, &guard, 1, rates, NV, NULL, 0));
  print("rates", rates, NV);

  /* The cup stands beside the hand. Plan a collision-free path to another configuration, and evaluate its trajectory at 0.3 s. */
  const double home[NV] = {1.2, 0.4, -0.9}, most[NV] = {4.0, 4.0, 4.0};
  double rows[ROWS * NV], on_the_path[3 * NV];
  const LwPose beside = {{0.62, 0.25, 0.5}, {0.0, 0.0, 0.0, 1.0}};
  ROBOT(lw_robot_put(robot, cup, &beside));
  LwPlan found;
  ROBOT(lw_planner_plan(robot, planner, q, home, NV, NULL, SIZE_MAX, &found));
  if (found.outcome != LW_PLAN_OUTCOME_FOUND || found.rows > ROWS) return 1;
  ROBOT(lw_planner_path(robot, planner, rows, found.rows * NV));
  const LwMotionLimits limits = {.acceleration = most, .n = NV};
  LwTimed timed;
  ROBOT(lw_timing_plan(robot, timing, rows, found.rows * NV, &limits, 0.0, &timed));
  if (!timed.found) return 1;
  print("duration", &timed.duration, 1);
  ROBOT(lw_timing_at(robot, timing, 0.3, on_the_path, NV, on_the_path + NV, on_the_path + 2 * NV, NV));
  print("on_the_path", on_the_path, 3 * NV);

  ROBOT(lw_robot_held_still(robot, NULL, 0, tau, NV));
  print("empty", tau, NV);
  const LwPose in_hand = {{0.1, 0.0, 0.0}, {0.0, 0.0, 0.0, 1.0}};
  ROBOT(lw_robot_grasp(robot, arm, cup, &in_hand));
  ROBOT(lw_robot_held_still(robot, NULL, 0, tau, NV));
  print("loaded", tau, NV);
  const double v[NV] = {0.1, -0.2, 0.3}, vdot[NV] = {1.0, 0.5, -0.5};
  ROBOT(lw_robot_feed_forward(robot, v, vdot, NV, NULL, 0, tau));
  print("moving", tau, NV);
  ROBOT(lw_robot_mass_matrix(robot, M, NV * NV));
  print("mass_matrix", M, NV * NV);
  ROBOT(lw_robot_center_of_mass(robot, &mass, at));
  print("mass", &mass, 1);
  print("center", at, 3);

  bool hit;
  LwPair pair;
  LwClosest closest;
  ROBOT(lw_robot_collides(robot, q, NV, &hit, NULL));
  ROBOT(lw_robot_clearance(robot, q, NV, 10.0, &closest));
  if (hit || !closest.found) return 1;
  print("clearance", &closest.distance, 1);
  const double up[NV] = {0.0, 1.2, -1.2};
  ROBOT(lw_robot_collides(robot, up, NV, &hit, &pair));
  if (hit) {
    char a[64], b[64];
    NAME(lw_model_collider_name(model, pair.a, a, sizeof a, NULL));
    NAME(lw_model_collider_name(model, pair.b, b, sizeof b, NULL));
    printf("touch %s %s\n", a, b);
  }
  ROBOT(lw_robot_ungrasp(robot, cup));

  /* A mistake is a code and a message. */
  const LwStatus status = lw_robot_set_q(robot, q, 2);
  char text[256];
  lw_robot_message(robot, text, sizeof text, NULL);
  printf("refused %d: %s\n", (int)status, text);

  lw_rate_control_free(control);
  lw_planner_free(planner);
  lw_timing_free(timing);
  lw_robot_free(robot);
  lw_model_free(model);
  return 0;
}
