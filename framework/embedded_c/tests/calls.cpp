// Compares every call of robot.hpp with the call of robot.h that it wraps: both results must be bit-identical. Then it
// prints distances of shapes, which the calling test compares with those of the same robot made in Rust.
//   calls URDF
#include <linkwork/robot.hpp>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <string>
#include <tuple>
#include <vector>

using namespace linkwork;
using Numbers = std::vector<double>;

static void fail(const char *what, int line) {
  std::fprintf(stderr, "line %d: %s\n", line, what);
  std::exit(1);
}
#define CHECK(x) ((x) ? void() : fail(#x, __LINE__))
#define DO(call) CHECK((call) == LW_STATUS_OK)

// For values that consist of numbers only.
template <class T>
static bool same(const T &a, const T &b) {
  return std::memcmp(&a, &b, sizeof a) == 0;
}
static bool same(const Numbers &a, const Numbers &b) {
  bool some = false;
  for (double x : a) some |= x != 0;
  return some && a.size() == b.size() && std::memcmp(a.data(), b.data(), 8 * a.size()) == 0;
}

static auto of(const LwAnswer &x) { return std::tuple(x.position, x.orientation, x.kinematics, x.restart, x.outcome); }
static auto of(const LwBest &x) { return std::tuple(x.cost, x.solutions, x.kinematics, x.outcome); }
static auto of(const LwPath &x) { return std::tuple(x.at, x.pair.a, x.pair.b, x.outcome); }
static auto of(const LwPlan &x) { return std::tuple(x.rows, x.pair.a, x.pair.b, x.outcome); }
static auto of(const LwTimed &x) { return std::tuple(x.duration, x.part, x.share, x.found); }
static auto of(const LwTransferred &x) { return std::tuple(x.duration, x.value, x.dof, x.within_limits); }
static auto of(const LwClosest &x) {
  return std::tuple(x.distance, x.point_a[0], x.point_a[2], x.point_b[1], x.a, x.b, x.found);
}

template <class Call>
static void refused(LwStatus wanted, Call &&call) {
  try {
    call();
  } catch (const Error &e) {
    CHECK(e.status() == wanted);
    return;
  }
  fail("nothing was thrown", __LINE__);
}

static const std::array<std::array<double, 3>, 4> corners{
    {{-0.04, -0.03, -0.05}, {0.06, -0.02, -0.04}, {0.0, 0.05, -0.03}, {0.01, 0.0, 0.07}}};
static const std::array<std::array<std::uint32_t, 3>, 4> triangles{{{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {2, 0, 3}}};

static Model model_of(const char *path) {
  const std::array<double, 9> inertia{0.02, 0, 0.001, 0, 0.03, 0, 0.001, 0, 0.025};
  const std::array<double, 3> center{0.01, -0.02, 0.03};
  const auto at = [](double x, double y, double z) { return LwPose{{x, y, z}, {0, 0, 0, 1}}; };
  const LwShape fore{LW_SHAPE_CAPSULE, {0.04, 0.1, 0}};
  Builder builder;
  builder.robot_file(path, LW_ROOT_FIXED).chain("left", "torso", "left_hand").chain("right", "torso", "right_hand");
  builder.object("beam", 1.5, center, inertia).object("pliers", 1.5, center, inertia);
  builder.object_body("jaw", "pliers", {LW_HINGE_PIN, {0, 1, 0}, {}, 0}, 1.5, center, inertia, at(0, 0, 0.1));
  builder.shape("left_fore", "left4", fore).shape("right_fore", "right4", fore);
  builder.hull("left_palm", "left_hand", corners).mesh("right_palm", "right_hand", corners, triangles);
  builder.height_field("ground", "world", 3, 3, {2, 2}, Numbers{0, 0.01, 0, 0.02, 0.05, 0.01, 0, 0.02, 0.03}, at(0, 0, -1));
  builder.shape("post", "world", {LW_SHAPE_BOX, {0.03, 0.04, 0.3}}, at(0.72, 0.2, 0.75));
  builder.voxel_map("map", "world", {4, 4, 4}, 0.1);
  builder.coarse("left_palm", {LW_SHAPE_SPHERE, {0.12, 0, 0}}).coarse_hull("right_palm", corners);
  return builder.model();
}

struct Case {
  Model model;
  Robot robot;
  LwRobot *r;
  std::uint32_t left, right, beam, pliers;
  Numbers q{0.1, 0.2, -0.4, 0.9, 0.3, 0.5, -0.2, -0.1, -0.5, 1.0, -0.2, 0.4, 0.3};
  Numbers v{0.3, -0.2, 0.5, 0.1, -0.4, 0.2, 0.6, -0.1, 0.3, -0.5, 0.2, 0.1, -0.3};
  Numbers a{-0.7, 0.4, 0.2, -0.9, 0.3, 0.8, -0.1, 0.5, -0.6, 0.2, 0.7, -0.2, 0.4};
  std::array<double, 6> twist{0.1, -0.2, 0.3, 0.05, 0.15, -0.1};

  explicit Case(const char *path) : model(model_of(path)), robot(model), r(robot.get()) {
    left = model.part("left"), right = model.part("right");
    beam = model.object("beam"), pliers = model.object("pliers");
    robot.set_q(q);
  }
};

static void tips(Case &c) {
  LwPose base;
  DO(lw_robot_base_pose(c.r, c.right, &base));
  CHECK(same(base, c.robot.base_pose(c.right)));
  Numbers g(6), h(6);
  LwManipulability m;
  DO(lw_robot_manipulability(c.r, c.left, LW_ROWS_ALL, 0.4, &m, g.data(), 6));
  CHECK(same(m, c.robot.manipulability(c.left, LW_ROWS_ALL, 0.4, h)) && same(g, h));
  DO(lw_robot_manipulability(c.r, c.left, LW_ROWS_ALL, 1, &m, nullptr, 0));
  CHECK(same(m, c.robot.manipulability(c.left)));
  Numbers x(13), y(13);
  std::array<double, 2> residual;
  DO(lw_robot_rates(c.r, c.left, c.twist.data(), x.data(), 13, residual.data()));
  CHECK(same(residual, c.robot.rates(c.left, c.twist, y)) && same(x, y));

  // The functions for goals must give the same numbers as a goal that is written field by field.
  const LwPose at{{0.6, 0.3, 0.5}, {0, 0, 0, 1}};
  LwGoal goal{at, {1, 1}, LW_GOAL_POSITION | LW_GOAL_PLANE | LW_GOAL_AXIS, {1, 0, 0}, {0, 0, 1}, {0, 0, -1}, 0.2};
  const LwGoal plane = axis_along(on_plane(pose_goal(at), {1, 0, 0}), {0, 0, 1}, {0, 0, -1}, 0.2);
  const LwGoal line = axis_at(on_line(position_goal({0.6, 0.3, 0.5}), {1, 0, 0}), {0, 0, 1}, {0.9, 0.4, 0.2});
  for (const LwGoal &made : {plane, line}) {
    LwAnswer answer;
    LwBest best;
    x = y = c.q;
    DO(lw_robot_inverse_kinematics(c.r, c.left, &goal, nullptr, x.data(), 13, &answer));
    CHECK(answer.outcome == LW_OUTCOME_MET);
    CHECK(of(answer) == of(c.robot.inverse_kinematics(c.left, made, y)) && same(x, y));
    x = y = c.q;
    const LwPrefer prefer{1, 0, 0, 1, 2, 400};
    DO(lw_robot_inverse_kinematics_best(c.r, c.left, &goal, &prefer, nullptr, x.data(), 13, &best));
    CHECK(of(best) == of(c.robot.inverse_kinematics_best(c.left, made, centred(2), y)) && same(x, y));
    goal = {at, {1, 1}, LW_GOAL_POSITION | LW_GOAL_LINE | LW_GOAL_LOOK_AT, {1, 0, 0}, {0, 0, 1}, {0.9, 0.4, 0.2}, 0};
  }
  const LwPrefer far = manipulable(3);
  CHECK(near_given(2).near == 1 && near_given(2).centred == 0 && near_given(2).manipulable == 0 && near_given(2).starts == 2);
  CHECK(far.manipulable == 1 && far.near == 0 && far.centred == 0 && far.length == 1 && far.starts == 3);
}

static void together(Case &c) {
  WholeBodyIk search(c.robot, 2);
  LwPose at = c.robot.tip_pose(c.left);
  at.position[0] -= 0.02;
  const std::array goals{tip_goal(c.left, pose_goal(at)), tip_goal(c.right, position_goal({0.1, -0.3, 0.05}), c.left)};
  CHECK(goals[0].part == c.left && goals[0].seen_from == LW_NO_PART && goals[1].seen_from == c.left);
  LwEffort effort = default_effort();
  effort.restarts = 2;
  Numbers x = c.q, y = c.q, left(4), more(4);
  LwAnswer answer;
  DO(lw_whole_body_ik_solve(c.r, search.get(), goals.data(), 2, &effort, x.data(), 13, left.data(), 4, &answer));
  CHECK(of(answer) == of(search.solve(c.robot, goals, y, &effort, more)) && same(x, y) && same(left, more));
  effort.kinematics = 1;
  y = c.q;
  search.solve(c.robot, goals, y, &effort);
  CHECK(of(answer) == of(search.resume(c.robot, 1u << 30, y)) && same(x, y));
  std::size_t steps = 0;
  DO(lw_whole_body_ik_worst_case_steps(c.r, search.get(), goals.data(), 2, &effort, &steps));
  CHECK(steps == search.worst_case_steps(c.robot, goals, &effort) && steps >= answer.kinematics);
  DO(lw_effort_worst_case_steps(&effort, &goals[0].goal, &steps));
  CHECK(steps == worst_case_steps(goals[0].goal, &effort) && steps > 1);
  refused(LW_STATUS_OUT_OF_RANGE, [] { worst_case_steps(LwGoal{{}, {1, 1}, 4096, {}, {}, {}, 0}); });
  const LwPrefer prefer{1, 0, 0, 1, 2, 50};
  LwBest best;
  x = y = c.q;
  DO(lw_whole_body_ik_best(c.r, search.get(), goals.data(), 2, &prefer, nullptr, x.data(), 13, &best));
  CHECK(of(best) == of(search.best(c.robot, goals, prefer, y)) && same(x, y));
  // Kept degrees of freedom do not move.
  search.keep(c.robot, c.right);
  y = c.q;
  search.solve(c.robot, Span<const LwTipGoal>(goals).first(1), y);
  for (int i = 7; i < 13; ++i) CHECK(y[i] == c.q[i]);
  search.release(c.robot, c.right);
  refused(LW_STATUS_NO_SEARCH, [&] { search.resume(c.robot, 1, y); });
}

static void spaces(Case &c) {
  const std::array<std::uint32_t, 2> parts{c.right, c.left};
  TaskSpace space(c.robot, parts);
  Numbers x(144), y(144), tau(13), wanted(13), twelve(12, 0.3);
  DO(lw_task_space_compliance(c.r, space.get(), x.data(), 144));
  space.compliance(c.robot, y);
  CHECK(same(x, y));
  DO(lw_task_space_inertia(c.r, space.get(), x.data(), 144));
  space.inertia(c.robot, y);
  CHECK(same(x, y));
  for (const Numbers &rest : {Numbers{}, c.a}) {
    const double *p = rest.empty() ? nullptr : rest.data();
    DO(lw_task_space_forces(c.r, space.get(), c.v.data(), 13, twelve.data(), 12, p, wanted.data()));
    space.forces(c.robot, c.v, twelve, tau, rest);
    CHECK(same(tau, wanted));
    LwImpedance spring{{{0.5, 0.1, 0.6}, {0, 0, 0, 1}}, {}, {}, {1, 1, 1, 9, 9, 9}, {1, 1, 1, 3, 3, 3}};
    const std::array springs{spring, spring};
    DO(lw_task_space_impedance(c.r, space.get(), c.v.data(), 13, springs.data(), 2, p, wanted.data()));
    space.impedance(c.robot, c.v, springs, tau, rest);
    CHECK(same(tau, wanted));
  }
  refused(LW_STATUS_LENGTH, [&] { space.forces(c.robot, c.v, twelve, Span<double>(tau).first(12)); });
  refused(LW_STATUS_LENGTH, [&] { space.forces(c.robot, c.v, Span<double>(twelve).first(6), tau); });

  const std::array objectives{tip_objective(1, c.left, c.twist, LW_ROWS_LINEAR), center_objective(0, {0.02, 0.01, 0}),
                          posture_objective(2, c.a)};
  CHECK(objectives[0].kind == LW_OBJECTIVE_TIP && objectives[0].part == c.left && objectives[0].motion[4] == c.twist[4]);
  CHECK(objectives[1].kind == LW_OBJECTIVE_CENTER && objectives[1].level == 0 && objectives[1].motion[3] == 0.02);
  CHECK(objectives[2].posture == c.a.data() && objectives[2].posture_count == 13);
  RateControl control(c.robot, 3, 1);
  const LwGuard guard{0.05, c.right};
  Numbers left(3), more(3);
  DO(lw_rate_control_solve(c.r, control.get(), objectives.data(), 3, 0.05, &guard, 1, wanted.data(), 13, left.data(), 3));
  control.solve(c.robot, objectives, 0.05, tau, {&guard, 1}, more);
  CHECK(same(tau, wanted) && same(left, more));
  control.solve(c.robot, objectives, 0.05, tau);
  const Numbers effort(13, 80);
  const LwTouch touch{{0.05, 0, 0.01}, {0, 0, 1}, 0.6, 200, c.right};
  WholeBody body(c.robot, 1, 3);
  Numbers vdot(13), moves(13), f(3), pressed(3);
  LwBalanced told;
  DO(lw_whole_body_solve(c.r, body.get(), c.v.data(), effort.data(), 13, &touch, 1, objectives.data(), 3, wanted.data(),
                         moves.data(), pressed.data(), &told));
  CHECK(same(told, body.solve(c.robot, c.v, effort, {&touch, 1}, objectives, tau, vdot, f)));
  CHECK(same(tau, wanted) && same(vdot, moves) && same(f, pressed));
}

static void hands(Case &c) {
  LwPose at = c.robot.tip_pose(c.left);
  c.robot.put(c.beam, at);
  c.robot.grasp(c.left, c.beam);
  c.robot.grasp(c.right, c.beam);
  const LwHold hold = c.robot.hold(c.beam);
  CHECK(hold.count == 2 && hold.hands[0] == c.left && hold.hands[1] == c.right);
  Numbers tau(13), wanted(13);
  c.robot.feed_forward(c.v, c.a, tau);
  wanted = tau;
  LwShared shared;
  DO(lw_robot_balance(c.r, c.beam, LW_BALANCE_EFFORT, wanted.data(), 13, &shared));
  CHECK(same(shared, c.robot.balance(c.beam, LW_BALANCE_EFFORT, tau)) && same(tau, wanted));
  std::array<LwWrench, 2> wrenches;
  DO(lw_robot_squeeze(c.r, c.beam, 25, wanted.data(), 13, wrenches.data()));
  CHECK(same(wrenches, c.robot.squeeze(c.beam, 25, tau)) && same(tau, wanted));
  wrenches[1].moment[0] = 0.4;
  DO(lw_robot_add_hand_wrenches(c.r, c.beam, wrenches.data(), wanted.data(), 13));
  c.robot.add_hand_wrenches(c.beam, wrenches, tau);
  CHECK(same(tau, wanted));
  const std::array<double, 3> weights{1, 3, 50};
  LwHandWrenches apart;
  DO(lw_robot_split_hand_wrenches(c.r, c.beam, wrenches.data(), weights.data(), &apart));
  CHECK(same(apart, c.robot.split_hand_wrenches(c.beam, wrenches, weights)));
  const std::array friction{LwFriction{{0, -1, 0}, 0.6, 0.03, 300}, LwFriction{{0, 1, 0.1}, 0.5, 0.02, 200}};
  LwGripped gripped;
  DO(lw_robot_grip(c.r, c.beam, wrenches.data(), friction.data(), &gripped));
  CHECK(same(gripped, c.robot.grip(c.beam, wrenches, friction)));

  LwInertia inertia;
  const auto torso = c.model.body("torso");
  DO(lw_robot_composite_inertia(c.r, torso, &inertia));
  CHECK(same(inertia, c.robot.composite_inertia(torso)));
  std::array<double, 6> p;
  DO(lw_robot_momentum(c.r, c.v.data(), 13, p.data()));
  CHECK(same(p, c.robot.momentum(c.v)));
  Numbers A(78), B(78), tips(12), moved(12);
  DO(lw_robot_centroidal_matrix(c.r, A.data(), 78));
  c.robot.centroidal_matrix(B);
  CHECK(same(A, B));
  const std::array<std::uint32_t, 2> parts{c.right, c.left};
  DO(lw_robot_bias(c.r, c.v.data(), 13, parts.data(), 2, wanted.data(), tips.data()));
  c.robot.bias(c.v, tau, parts, moved);
  CHECK(same(tau, wanted) && same(tips, moved));
  refused(LW_STATUS_LENGTH, [&] { c.robot.bias(c.v, tau, parts); });
  c.robot.ungrasp(c.beam);

  Predictor one(c.robot), two(c.robot);
  Numbers q = c.q, v = c.v, P(676), density(13, 0.01), F(676), q2 = q, v2 = v, P2(676), F2(676);
  DO(lw_predictor_step(c.r, one.get(), q.data(), 13, v.data(), 13, P.data(), c.a.data(), density.data(), 0.01));
  two.step(c.robot, q2, v2, P2, c.a, density, 0.01);
  CHECK(same(q, q2) && same(v, v2) && same(P, P2));
  DO(lw_predictor_transition(c.r, one.get(), F.data(), 676));
  two.transition(c.robot, F2);
  CHECK(same(F, F2));

  CHECK(c.model.object_sizes(c.pliers) == std::pair(std::size_t{1}, std::size_t{1}));
  c.robot.grasp(c.right, c.pliers, at);
  c.robot.set_object_q(c.pliers, Numbers{0.4});
  const auto jaw = c.model.object_body(c.pliers, "jaw");
  DO(lw_robot_object_body_pose(c.r, c.pliers, jaw, &at));
  CHECK(same(at, c.robot.object_body_pose(c.pliers, jaw)));
  Numbers J(6), K(6);
  DO(lw_robot_object_jacobian(c.r, c.pliers, jaw, J.data(), 6));
  c.robot.object_jacobian(c.pliers, jaw, K);
  CHECK(same(J, K));
  LwClosure left_onto;
  const std::array<std::uint8_t, 1> moves{1};
  DO(lw_robot_closure_onto(c.r, c.left, c.pliers, jaw, moves.data(), 1, &left_onto));
  const LwClosure onto = c.robot.closure(c.left, c.pliers, jaw, moves);
  CHECK(onto.rows == 6 && onto.rank == left_onto.rank && onto.mobility == left_onto.mobility);
  Numbers M(196), N(196);
  DO(lw_robot_mass_matrix_with_object(c.r, c.pliers, M.data(), 196));
  c.robot.mass_matrix_with_object(c.pliers, N);
  CHECK(same(M, N));
  c.robot.ungrasp(c.pliers);
  // Attached to the jaw by C and by C++, the beam is at the same place.
  LwPose by_c;
  const LwPose on_jaw{{0.1, 0.2, 0.3}, {0, 0, 0, 1}};
  DO(lw_robot_attach(c.r, c.beam, c.pliers, jaw, &on_jaw));
  DO(lw_robot_object_pose(c.r, c.beam, &by_c));
  DO(lw_robot_detach(c.r, c.beam));
  c.robot.attach(c.beam, c.pliers, jaw, on_jaw);
  CHECK(same(c.robot.object_pose(c.beam).position, by_c.position));
  c.robot.detach(c.beam);
  refused(LW_STATUS_NOT_HELD, [&] { c.robot.detach(c.beam); });
  // Restore the state that the Rust test has.
  c.robot.put(c.beam, {{0, 0, 0}, {0, 0, 0, 1}});
  c.robot.set_object_q(c.pliers, Numbers{0.0});
}

static void motions(Case &c) {
  Numbers goal = c.q;
  goal[1] = -0.6;
  LwPath path;
  DO(lw_robot_path_free(c.r, c.q.data(), goal.data(), 13, 1e-3, SIZE_MAX, &path));
  CHECK(path.outcome == LW_PATH_OUTCOME_HIT && of(path) == of(c.robot.path_free(c.q, goal)));
  CHECK(c.robot.path_free(c.q, goal, 1e-3, 0).outcome == LW_PATH_OUTCOME_UNFINISHED);
  CHECK(of(path) == of(c.robot.path_free_on()));
  Planner one(c.robot, c.left, 400), two(c.robot, c.left, 400);
  const LwSearch search{7, 0.4, 1e-2};
  LwPlan way;
  DO(lw_planner_plan(c.r, one.get(), c.q.data(), goal.data(), 13, &search, SIZE_MAX, &way));
  CHECK(way.outcome == LW_PLAN_OUTCOME_FOUND && of(way) == of(two.plan(c.robot, c.q, goal, search)));
  CHECK(two.plan(c.robot, c.q, goal, search, 0).outcome == LW_PLAN_OUTCOME_UNFINISHED);
  CHECK(of(way) == of(two.resume(c.robot)));
  Numbers rows(13 * way.rows), more(13 * way.rows);
  DO(lw_planner_path(c.r, one.get(), rows.data(), rows.size()));
  two.path(c.robot, more);
  CHECK(same(rows, more));

  const Numbers bent(13, 3.0), jerk(13, 30.0);
  const LwMotionLimits limits{nullptr, bent.data(), jerk.data(), nullptr, 13};
  Timing timing(c.robot, way.rows, 40 * way.rows), other(c.robot, way.rows, 40 * way.rows);
  LwTimed timed;
  DO(lw_timing_plan(c.r, timing.get(), rows.data(), rows.size(), &limits, 0.02, &timed));
  CHECK(timed.found && of(timed) == of(other.plan(c.robot, rows, limits, 0.02)));
  Numbers q(13), v(13), a(13), q2(13), v2(13), a2(13);
  DO(lw_timing_at(c.r, timing.get(), 0.3, q.data(), 13, v.data(), a.data(), 13));
  other.at(c.robot, 0.3, q2, v2, a2);
  CHECK(same(q, q2) && same(v, v2) && same(a, a2));
  DO(lw_timing_place(c.r, timing.get(), 0.4, q.data(), 13));
  other.place(c.robot, 0.4, q2);
  CHECK(same(q, q2));
  DO(lw_timing_path_free(c.r, timing.get(), 1e-3, &path));
  CHECK(of(path) == of(other.path_free(c.robot)));
  CHECK(other.plan(c.robot, rows).found);

  Transfer from(c.robot), to(c.robot);
  const LwMotionState begin{c.q.data(), 13, c.v.data(), c.a.data(), 13}, end{goal.data(), 13, nullptr, nullptr, 0};
  LwTransferred told;
  DO(lw_transfer_plan(c.r, from.get(), &begin, &end, &limits, &told));
  CHECK(of(told) == of(to.plan(c.robot, motion_state(c.q, c.v, c.a), motion_state(goal), limits)));
  DO(lw_transfer_at(c.r, from.get(), 0.3, q.data(), 13, v.data(), a.data(), 13));
  to.at(c.robot, 0.3, q2, v2, a2);
  CHECK(same(q, q2) && same(v, v2) && same(a, a2));
  refused(LW_STATUS_LENGTH, [&] { to.at(c.robot, 0.3, q2, v2, Span<double>(a2).first(12)); });
}

static void shapes(Case &c) {
  const auto palm = c.model.collider("left_palm"), post = c.model.collider("post"), map = c.model.collider("map");
  LwClosest closest;
  DO(lw_robot_distance(c.r, c.q.data(), 13, palm, post, &closest));
  CHECK(of(closest) == of(*c.robot.distance(c.q, palm, post)));
  Numbers beside = c.q;
  beside[1] = -0.2;
  const auto hits = c.robot.hits(beside);
  CHECK(!hits.empty() && hits.front().a < hits.front().b && c.robot.hits(c.q).empty());
  CHECK(c.robot.looks_at(palm, post));
  c.robot.allow(palm, post);
  CHECK(!c.robot.looks_at(palm, post));
  c.robot.by_rule(palm, post);
  Numbers rows = c.q;
  rows.insert(rows.end(), beside.begin(), beside.end());
  bool told[2]{true, false};
  c.robot.collides_all(rows, told);
  CHECK(!told[0] && told[1]);
  const auto own = c.model.part_colliders(c.left);
  CHECK(own.size() > 1 && c.model.object_colliders(c.beam).empty());
  const double apart = c.robot.distance(c.q, palm, post)->distance;
  c.robot.pad_all(own, 0.004);
  CHECK(std::abs(apart - 0.004 - c.robot.distance(c.q, palm, post)->distance) < 1e-9);
  c.robot.pad_all(own, 0);
  c.robot.set_detail_of(palm, LW_DETAIL_COARSE);
  CHECK(apart != c.robot.distance(c.q, palm, post)->distance);
  c.robot.set_detail_of(palm, LW_DETAIL_FINE);
  const std::array<std::array<std::uint32_t, 3>, 1> cells{{{1, 2, 3}}};
  c.robot.set_cells(map, cells);
  CHECK(c.robot.cell(map, {1, 2, 3}) && !c.robot.cell(map, {3, 2, 1}) && c.robot.count(map) == 1);
  c.robot.clear_cells(map);
  for (auto detail : {LW_DETAIL_FINE, LW_DETAIL_COARSE}) {
    c.robot.set_detail(detail);
    for (const LwClosest &pair : c.robot.distances(c.q, 0.6)) std::printf("%u %u %.17g\n", pair.a, pair.b, pair.distance);
  }
}

static void feet() {
  std::vector<std::array<double, 2>> points{{0, 0}, {1, 0}, {0.3, 0.2}, {1, 2}, {0, 2}}, all = points;
  double hull[12], margin;
  std::size_t count;
  DO(lw_support_polygon(points.front().data(), 5, hull, 6, &count));
  const auto corners = support_polygon(all);
  CHECK(count == 4 && corners.size() == 4 && std::memcmp(hull, corners.data(), 64) == 0);
  const double p[2]{0.3, 0.4};
  DO(lw_support_margin(hull, 4, p, &margin));
  CHECK(margin == support_margin(corners, {0.3, 0.4}) && margin > 0.29 && margin < 0.31);
}

static void numbers() {
  Priorities one(2, 2, 1), two(2, 2, 1);
  const Numbers c{0.3, 1}, A{1, 2, 0.5, -1}, b{3, 1};
  double residual;
  std::size_t left;
  DO(lw_priorities_bound(one.get(), c.data(), 2, 0.2));
  DO(lw_priorities_level(one.get(), A.data(), b.data(), 1, &residual, &left));
  two.bound(c, 0.2);
  const auto told = two.level(Span<const double>(A).first(2), Span<const double>(b).first(1));
  CHECK(told == std::pair(residual, left) && left == 1);
  Numbers x(2), y(2);
  DO(lw_priorities_x(one.get(), x.data(), 2));
  two.x(y);
  CHECK(same(x, y));
  two.begin();
  two.level(A, b);
  two.x(y);
  CHECK(y != x);
  refused(LW_STATUS_LENGTH, [&] { two.level(A, Span<const double>(b).first(1)); });
  const Numbers normal{2, 0.5, 0.5, 1}, right{1, 3};
  Numbers s(2), t(2);
  DO(lw_bounded(normal.data(), right.data(), 2, -1, 2.5, 200, 1e-12, s.data(), &left));
  CHECK(left == bounded(normal, right, -1, 2.5, t) && same(s, t) && t[1] == 2.5);
}

// The mechanism is made without a file, with rules and coarse shapes: three balls in a row on sliders, of which the
// first carries the others.
static void mechanisms() {
  const std::array<double, 9> inertia{0.02, 0, 0, 0, 0.03, 0, 0, 0, 0.025};
  const std::array<double, 3> center{0.01, -0.02, 0.03};
  const LwHinge slide{LW_HINGE_SLIDER, {1, 0, 0}, {}, 0};
  Builder builder;
  builder.keep_closures();  // The mechanism has no closures, so this changes nothing.
  builder.body("a", "world", slide, 1, center, inertia).body("b", "a", slide, 1, center, inertia);
  builder.body("c", "b", slide, 1, center, inertia, LwPose{{0, 0, 0}, {0, 0, 0, 1}}).limits("b", -2, 3, 0.5);
  for (const char *name : {"a", "b", "c"}) builder.shape(std::string("in ") + name, name, {LW_SHAPE_SPHERE, {0.1, 0, 0}});
  builder.object("toy", 1, center, inertia).object_body("lid", "toy", {LW_HINGE_BALL, {}, {}, 0}, 1, center, inertia);
  const std::array<std::string, 2> group{"a", "c"};
  builder.neighbours(LW_NEIGHBOURS_COLLIDE).apart(group);
  const std::array<std::array<std::uint32_t, 3>, 1> cube{{{0, 0, 0}}};
  builder.coarse_mesh("in a", corners, triangles).coarse_voxel_map("in c", {1, 1, 1}, 0.3, cube);
  const Model model = builder.model();
  CHECK(model.doubtful().empty());
  LwModel *m = model.get();
  const auto b = model.body("b");
  std::size_t in_q, q_count, in_v, v_count;
  DO(lw_model_hinge(m, b, &in_q, &q_count, &in_v, &v_count));
  const auto hinge = model.hinge(b);
  CHECK(hinge.in_q == in_q && hinge.q_count == q_count && hinge.in_v == in_v && hinge.v_count == v_count);
  CHECK(in_q == 1 && q_count == 1 && model.joint("b") == std::pair(in_q, in_v));
  const auto toy = model.object("toy"), lid = model.object_body(toy, "lid");
  DO(lw_model_object_hinge(m, toy, lid, &in_q, &q_count, &in_v, &v_count));
  const auto turns = model.object_hinge(toy, lid);
  CHECK(turns.in_q == in_q && turns.q_count == q_count && turns.in_v == in_v && turns.v_count == v_count);
  CHECK(q_count == 4 && v_count == 3);
  CHECK(model.limits().first[1] == -2 && model.limits().second[1] == 3);
  // First c is on a, and b is elsewhere; then b is on a.
  Robot robot(model);
  const Numbers c_on_a{0, 1, -1}, b_on_a{0, 0, 1}, near{0, 1, 0.35};
  CHECK(!robot.collides(c_on_a) && robot.collides(b_on_a) && !robot.collides(near));
  Robot both(builder.collide("a", "c").model());
  CHECK(both.collides(c_on_a));
  // The cube of c ends 0.3 from its origin. It touches b, which is 0.35 away and has a ball of 0.1.
  both.set_detail(LW_DETAIL_COARSE);
  const Numbers before{-1, 1, -0.35};
  CHECK(both.collides(before));
  both.set_detail(LW_DETAIL_FINE);
  CHECK(!both.collides(before));
}

int main(int argc, char **argv) {
  if (argc != 2) return 2;
  try {
    Case c(argv[1]);
    tips(c);
    together(c);
  spaces(c);
    hands(c);
    motions(c);
    shapes(c);
    feet();
    mechanisms();
    numbers();
  } catch (const std::exception &e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 1;
  }
}
