// Times Pinocchio's forward dynamics with closed loops: nanoseconds per call for every algorithm and
// proximal parameter that reaches the accelerations given with the states.
// Usage: pinocchio_constrained mechanism.txt
//
// Joints are lines as in pinocchio_bench.cpp. Then
//   loop  rows(3|6)  joint A(0 = world)  R(9) p(3)  joint B  R(9) p(3)
//   state  q  v  tau  accelerations          (rates and forces of a free joint: [linear; angular])
// Printed: a line for each algorithm and parameter: name, mu, greatest relative difference of the
// accelerations, nanoseconds (or - where the difference is beyond the tolerance).
#include <pinocchio/fwd.hpp>
#define PINOCCHIO_ENABLE_UNSUPPORTED
#include <pinocchio/algorithm/constrained-dynamics.hpp>
#include <pinocchio/algorithm/loop-constrained-aba.hpp>
#include <pinocchio/algorithm/pv.hpp>
#include <pinocchio/constraints.hpp>
#include <pinocchio/multibody.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <string>
#include <vector>

namespace pin = pinocchio;

constexpr int kRepeats = 9;
constexpr double kSlice = 0.005;  // The time of one repeat, s.
constexpr double kTolerance = 1e-6;  // A variant with a larger difference is not timed.
constexpr double kAccuracy = 1e-10;
constexpr int kIterations = 50;

using Models = std::vector<pin::RigidConstraintModel>;
using Datas = std::vector<pin::RigidConstraintData>;
using Vectors = std::vector<Eigen::VectorXd>;

struct Mechanism {
  pin::Model model;
  Models loops;
  Vectors q, v, tau, a;
};

Mechanism read(std::istream& in) {
  Mechanism out;
  pin::Model& model = out.model;
  const auto matrix = [&](auto& m) {
    for (int i = 0; i < m.rows(); ++i)
      for (int j = 0; j < m.cols(); ++j) in >> m(i, j);
  };
  const auto place = [&] {
    Eigen::Matrix3d R;
    Eigen::Vector3d p;
    matrix(R);
    matrix(p);
    return pin::SE3(R, p);
  };
  std::string kind;
  while (in >> kind) {
    if (kind == "loop") {
      int rows;
      pin::JointIndex a, b;
      in >> rows >> a;
      const pin::SE3 A = place();
      in >> b;
      const pin::SE3 B = place();
      // Constrained ABA requires that the first joint is not the world.
      const auto type = rows == 3 ? pin::CONTACT_3D : pin::CONTACT_6D;
      if (a == 0)
        out.loops.emplace_back(type, model, b, B, a, A, pin::LOCAL);
      else
        out.loops.emplace_back(type, model, a, A, b, B, pin::LOCAL);
    } else if (kind == "state") {
      Eigen::VectorXd q(model.nq), v(model.nv), tau(model.nv), a(model.nv);
      matrix(q);
      matrix(v);
      matrix(tau);
      matrix(a);
      out.q.push_back(q);
      out.v.push_back(v);
      out.tau.push_back(tau);
      out.a.push_back(a);
    } else {
      Eigen::Vector3d axis, com;
      Eigen::Matrix3d inertia;
      pin::JointIndex parent;
      double mass;
      matrix(axis);
      in >> parent;
      const pin::SE3 X = place();
      in >> mass;
      matrix(com);
      matrix(inertia);
      const std::string name = "j" + std::to_string(model.njoints);
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
  }
  return out;
}

// Checks and then times one variant: `call(state)` returns the accelerations.
template <class F>
void measure(const char* name, double mu, const Mechanism& m, F&& call) {
  const int states = int(m.q.size());
  double off = 0.0;
  for (int i = 0; i < states; ++i) {
    const Eigen::VectorXd& a = call(i);
    const double d = (a - m.a[i]).lpNorm<Eigen::Infinity>() / m.a[i].lpNorm<Eigen::Infinity>();
    if (!(d <= off)) off = d;  // The comparison is true for NaN, which is kept.
    if (!std::isfinite(off)) break;
  }
  if (!(off <= kTolerance)) {
    std::printf("%s %.0e %.1e -\n", name, mu, off);
    return;
  }
  using Clock = std::chrono::steady_clock;
  const auto pass = [&](int loops) {
    const auto start = Clock::now();
    for (int loop = 0; loop < loops; ++loop)
      for (int i = 0; i < states; ++i) call(i);
    const std::chrono::duration<double> spent = Clock::now() - start;
    return spent.count() / (double(loops) * states);
  };
  const int loops = std::max(1, int(kSlice / (pass(1) * states)));
  double best = 1e300;
  for (int repeat = 0; repeat < kRepeats; ++repeat) best = std::min(best, pass(loops));
  std::printf("%s %.0e %.1e %.1f\n", name, mu, off, 1e9 * best);
  std::fflush(stdout);
}

// Constrained ABA and PV support only loops to the world, all of one kind.
template <class Loop>
void to_world(const Mechanism& m) {
  using LoopData = typename Loop::ConstraintData;
  std::vector<Loop> loops;
  for (const auto& l : m.loops) {
    if (l.joint2_id != 0) return;
    loops.emplace_back(m.model, l.joint1_id, l.joint1_placement, 0, l.joint2_placement);
  }
  std::vector<LoopData> d;
  for (const auto& loop : loops) d.emplace_back(loop);
  for (const double mu : {1e-10, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4}) {
    pin::Data data(m.model);
    pin::initPvSolver(m.model, data, loops);
    measure("constrainedABA", mu, m, [&](int i) -> const Eigen::VectorXd& {
      pin::ProximalSettings settings(kAccuracy, mu, kIterations);
      return pin::constrainedABA(m.model, data, m.q[i], m.v[i], m.tau[i], loops, d, settings);
    });
  }
  pin::Data data(m.model);
  pin::initPvSolver(m.model, data, loops);
  measure("pv", 0.0, m, [&](int i) -> const Eigen::VectorXd& {
    pin::ProximalSettings settings(kAccuracy, 0.0, kIterations);
    return pin::pv(m.model, data, m.q[i], m.v[i], m.tau[i], loops, d, settings);
  });
}

int main(int argc, char** argv) {
  std::ifstream file(argc == 2 ? argv[1] : "");
  if (!file) {
    std::fprintf(stderr, "usage: %s mechanism.txt\n", argv[0]);
    return 2;
  }
  const Mechanism m = read(file);
  const auto datas = [&] {
    Datas d;
    for (const auto& loop : m.loops) d.emplace_back(loop);
    return d;
  };
  std::printf("dof %d states %d\n", m.model.nv, int(m.q.size()));
  for (const double mu : {0.0, 1e-12, 1e-10, 1e-8, 1e-6}) {
    pin::Data data(m.model);
    Datas d = datas();
    pin::initConstraintDynamics(m.model, data, m.loops, d);
    measure("constraintDynamics", mu, m, [&](int i) -> const Eigen::VectorXd& {
      pin::ProximalSettings settings(kAccuracy, mu, kIterations);
      return pin::constraintDynamics(m.model, data, m.q[i], m.v[i], m.tau[i], m.loops, d,
                                     settings);
    });
  }
  for (const double mu : {1e-10, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4}) {
    pin::Data data(m.model);
    Datas d = datas();
    pin::computeJointMinimalOrdering(m.model, data, m.loops);
    measure("lcaba", mu, m, [&](int i) -> const Eigen::VectorXd& {
      pin::ProximalSettings settings(kAccuracy, mu, kIterations);
      return pin::lcaba(m.model, data, m.q[i], m.v[i], m.tau[i], m.loops, d, settings);
    });
  }
  if (m.loops.front().type == pin::CONTACT_3D)
    to_world<pin::PointAnchorConstraintModel>(m);
  else
    to_world<pin::FrameAnchorConstraintModel>(m);
  return 0;
}
