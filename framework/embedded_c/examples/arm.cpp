// The same example as arm.c, in C++17.
//   c++ -std=c++17 -I include examples/arm.cpp liblinkwork_robot.a -lpthread -ldl -lm -o arm && ./arm examples
#include <linkwork/robot.hpp>

#include <cstdio>
#include <iostream>
#include <limits>
#include <string>
#include <vector>

using namespace linkwork;

static void print(const char *what, linkwork::Span<const double> x) {
  std::printf("%s", what);
  for (double value : x) std::printf(" %.17g", value);
  std::printf("\n");
}

static void run(const std::string &folder) {
  Builder builder;
  builder.robot_file(folder + "/arm.urdf", LW_ROOT_FIXED).groups_file(folder + "/arm.srdf").file_shapes();
  builder.object("cup", 0.4, {0, 0, 0}, {2e-3, 0, 0, 0, 2e-3, 0, 0, 0, 1e-3});
  builder.shape("can", "cup", {LW_SHAPE_CYLINDER, {0.04, 0.05, 0.0}});
  builder.shape("shelf", "world", {LW_SHAPE_BOX, {0.1, 0.4, 0.02}}, LwPose{{0.6, 0.0, 0.9}, {0, 0, 0, 1}});
  const Model model = builder.model();
  // Report inertias in the file that no rigid body can have.
  if (const auto warnings = model.doubtful(); !warnings.empty()) std::cerr << "warning: " << warnings << "\n";
  const auto arm = model.part("arm");
  const auto cup = model.object("cup");

  Robot robot(model);
  const auto nv = model.nv();
  std::vector<double> q{0.3, 0.8, -1.1}, tau(nv), J(6 * nv), M(nv * nv);
  robot.set_q(q);
  print("tip", robot.tip_pose(arm).position);
  robot.jacobian(arm, J);
  print("jacobian", J);

  const LwAnswer answer = robot.inverse_kinematics(arm, position_goal({0.5, 0.2, 0.5}), q);
  if (answer.outcome != LW_OUTCOME_MET) throw std::runtime_error("not reached");
  print("q", q);
  robot.set_q(q);

  const LwManipulability able = robot.manipulability(arm, LW_ROWS_LINEAR);
  print("manipulability", {&able.w, 1});
  RateControl control(robot, 1, 1);
  const LwObjective up = tip_objective(0, arm, {0, 0, 0, 0, 0, 0.2}, LW_ROWS_LINEAR);
  const LwGuard guard{0.01, arm};
  std::vector<double> rates(nv);
  control.solve(robot, {&up, 1}, 0.05, rates, {&guard, 1});
  print("rates", rates);

  robot.put(cup, LwPose{{0.62, 0.25, 0.5}, {0, 0, 0, 1}});
  Planner planner(robot, arm, 100);
  const LwPlan found = planner.plan(robot, q, std::vector{1.2, 0.4, -0.9});
  if (found.outcome != LW_PLAN_OUTCOME_FOUND) throw std::runtime_error("no path");
  std::vector<double> path(found.rows * nv), at(nv), v(nv), vdot(nv);
  planner.path(robot, path);
  Timing timing(robot, 16, 640);
  const std::vector<double> most(nv, 4.0);
  const LwTimed timed = timing.plan(robot, path, LwMotionLimits{nullptr, most.data(), nullptr, nullptr, nv});
  if (!timed.found) throw std::runtime_error("no motion");
  print("duration", {&timed.duration, 1});
  timing.at(robot, 0.3, at, v, vdot);
  at.insert(at.end(), v.begin(), v.end());
  at.insert(at.end(), vdot.begin(), vdot.end());
  print("on_the_path", at);

  robot.held_still(tau);
  print("empty", tau);
  robot.grasp(arm, cup, LwPose{{0.1, 0, 0}, {0, 0, 0, 1}});
  robot.held_still(tau);
  print("loaded", tau);
  robot.feed_forward(std::vector{0.1, -0.2, 0.3}, std::vector{1.0, 0.5, -0.5}, tau);
  print("moving", tau);
  robot.mass_matrix(M);
  print("mass_matrix", M);
  const auto [mass, center] = robot.center_of_mass();
  print("mass", {&mass, 1});
  print("center", center);

  const auto closest = robot.clearance(q, 10.0);
  if (robot.collides(q) || !closest) throw std::runtime_error("the hand is in the shelf");
  print("clearance", {&closest->distance, 1});
  // A clone is an independent robot: it still holds the cup after the first robot has released it.
  Robot other = robot.clone();
  robot.ungrasp(cup);
  if (const auto pair = other.first_hit(std::vector{0.0, 1.2, -1.2}))
    std::cout << "touch " << model.collider_name(pair->a) << " " << model.collider_name(pair->b) << std::endl;

  try {
    robot.set_q(linkwork::Span<double>(q).first(2));
  } catch (const Error &e) {
    std::cout << "refused " << e.status() << ": " << e.what() << std::endl;
  }
}

int main(int argc, char **argv) {
  if (argc != 2) {
    std::cerr << "usage: " << argv[0] << " FOLDER of arm.urdf and arm.srdf\n";
    return 2;
  }
  try {
    run(argv[1]);
  } catch (const std::exception &e) {
    std::cerr << e.what() << std::endl;
    return 1;
  }
}
