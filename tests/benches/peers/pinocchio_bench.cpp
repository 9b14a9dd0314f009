// Times Pinocchio's recursive algorithms: nanoseconds per call, the best of several repeats over
// many random states. Usage: pinocchio_bench joints.txt
//
// The mechanism comes as one line a joint, parents first, so that only headers are needed (the
// parsers are in a library that may have been compiled with another Eigen):
//   free|pin  axis(3)  parent(0 = world, else line)  R(9, by rows)  p(3)  mass  com(3)  inertia(9)
// Placement in the parent joint; centre of mass and inertia about it in joint axes.
#include <pinocchio/fwd.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <random>
#include <string>
#include <vector>

namespace pin = pinocchio;

constexpr int kStates = 256;
constexpr int kLoops = 16;
constexpr int kRepeats = 25;

template <class F>
double best_ns(F&& call) {
  double best = 1e300;
  for (int repeat = 0; repeat < kRepeats; ++repeat) {
    const auto start = std::chrono::steady_clock::now();
    for (int loop = 0; loop < kLoops; ++loop)
      for (int state = 0; state < kStates; ++state) call(state);
    const std::chrono::duration<double, std::nano> spent = std::chrono::steady_clock::now() - start;
    best = std::min(best, spent.count() / (kLoops * kStates));
  }
  return best;
}

pin::Model read_model(std::istream& in) {
  pin::Model model;
  std::string kind;
  Eigen::Vector3d axis, p, com;
  Eigen::Matrix3d R, inertia;
  std::size_t parent;
  double mass;
  const auto read = [&](auto& m) {
    for (int i = 0; i < m.rows(); ++i)
      for (int j = 0; j < m.cols(); ++j) in >> m(i, j);
  };
  for (int line = 1; in >> kind; ++line) {
    read(axis);
    in >> parent;
    read(R);
    read(p);
    in >> mass;
    read(com);
    read(inertia);
    const pin::SE3 X(R, p);
    const std::string name = "j" + std::to_string(line);
    pin::JointIndex id;
    if (kind == "free")
      id = model.addJoint(parent, pin::JointModelFreeFlyer(), X, name);
    else if (axis == Eigen::Vector3d::UnitX())
      id = model.addJoint(parent, pin::JointModelRX(), X, name);
    else if (axis == Eigen::Vector3d::UnitY())
      id = model.addJoint(parent, pin::JointModelRY(), X, name);
    else if (axis == Eigen::Vector3d::UnitZ())
      id = model.addJoint(parent, pin::JointModelRZ(), X, name);
    else
      id = model.addJoint(parent, pin::JointModelRevoluteUnaligned(axis), X, name);
    model.appendBodyToJoint(id, pin::Inertia(mass, com, inertia), pin::SE3::Identity());
  }
  return model;
}

int main(int argc, char** argv) {
  std::ifstream file(argc > 1 ? argv[1] : "");
  if (!file) {
    std::fprintf(stderr, "usage: %s joints.txt\n", argv[0]);
    return 2;
  }
  const pin::Model model = read_model(file);
  pin::Data data(model);

  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> number(-1.0, 1.0);
  const auto vector = [&](int n) {
    Eigen::VectorXd x(n);
    for (int i = 0; i < n; ++i) x[i] = number(random);
    return x;
  };
  std::vector<Eigen::VectorXd> q, v, x;
  for (int i = 0; i < kStates; ++i) {
    // Continuous joints are (cos, sin) here: integrating from the neutral configuration is valid
    // for every joint type.
    q.push_back(pin::integrate(model, pin::neutral(model), vector(model.nv)));
    v.push_back(vector(model.nv));
    x.push_back(vector(model.nv));
  }

  double sum = 0.0;
  const double fk = best_ns([&](int i) {
    pin::forwardKinematics(model, data, q[i], v[i]);
    sum += data.oMi.back().translation()[0];
  });
  const double rnea = best_ns([&](int i) { sum += pin::rnea(model, data, q[i], v[i], x[i])[0]; });
  const double aba = std::min(
      best_ns([&](int i) {
        sum += pin::aba(model, data, q[i], v[i], x[i], pin::Convention::LOCAL)[0];
      }),
      best_ns([&](int i) {
        sum += pin::aba(model, data, q[i], v[i], x[i], pin::Convention::WORLD)[0];
      }));
  const double crba = std::min(
      best_ns([&](int i) { sum += pin::crba(model, data, q[i], pin::Convention::LOCAL)(0, 0); }),
      best_ns([&](int i) { sum += pin::crba(model, data, q[i], pin::Convention::WORLD)(0, 0); }));
  if (!std::isfinite(sum)) std::fprintf(stderr, "not finite\n");
  std::printf("dof %d\n", model.nv);
  std::printf("kinematics %.1f\ninverse %.1f\nforward %.1f\nmass_matrix %.1f\n", fk, rnea, aba, crba);
  return 0;
}
