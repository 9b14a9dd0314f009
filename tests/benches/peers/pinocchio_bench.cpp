// Times Pinocchio's recursive algorithms: nanoseconds per call, the best of several repeats over
// many random states. Usage: pinocchio_bench joints.txt [--count calls]
//
// With --count nothing is timed: each variant of each algorithm runs that many times inside the
// function `counted`, once to warm up and once more, and its name is printed. Callgrind tells how
// many instructions each run took (framework/dynamics/benches/counts.rs does this).
//
// The mechanism comes as one line a joint, parents first, so that only headers are needed (the
// parsers are in a library that may have been compiled with another Eigen):
//   free|pin  axis(3)  parent(0 = world, else line)  R(9, by rows)  p(3)  mass  com(3)  inertia(9)
// Placement in the parent joint; centre of mass and inertia about it in joint axes. A line
//   foot  joint
// names the joints whose frames get the Jacobian (the last one) and the compliance (all, six
// directions each). Where Pinocchio has variants, the fastest counts.
#include <pinocchio/fwd.hpp>
#define PINOCCHIO_ENABLE_UNSUPPORTED
#include <pinocchio/algorithm/aba-derivatives.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/centroidal.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/delassus.hpp>
#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/jacobian.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea-derivatives.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <random>
#include <string>
#include <vector>

namespace pin = pinocchio;

constexpr int kStates = 64;
constexpr int kRepeats = 15;
constexpr double kSlice = 0.01;  // The time of one repeat, s.

// The result is the best of several repeats, each over all states as often as fits the slice.
template <class F>
double best_ns(F&& call) {
  using Clock = std::chrono::steady_clock;
  const auto pass = [&](int loops) {
    const auto start = Clock::now();
    for (int loop = 0; loop < loops; ++loop)
      for (int state = 0; state < kStates; ++state) call(state);
    const std::chrono::duration<double> spent = Clock::now() - start;
    return spent.count() / (double(loops) * kStates);
  };
  const int loops = std::max(1, int(kSlice / (pass(1) * kStates)));
  double best = 1e300;
  for (int repeat = 0; repeat < kRepeats; ++repeat) best = std::min(best, pass(loops));
  return 1e9 * best;
}

// Callgrind only counts the instructions in this function.
__attribute__((noinline)) void counted(const std::function<void(int)>& call, int calls) {
  for (int i = 0; i < calls; ++i) call(i % kStates);
}

// Times the fastest variant of an algorithm, or runs each variant for callgrind.
struct Measure {
  int calls = 0;  // Zero means that the time is measured.

  template <class... F>
  void operator()(const char* what, F&&... variants) const {
    if (calls > 0) {
      (count(what, variants), ...);
    } else {
      say(what, std::min({best_ns(variants)...}));
    }
  }
  // Callgrind writes its counts at each return.
  __attribute__((noinline)) void count(const char* what,
                                       const std::function<void(int)>& call) const {
    for (int i = 0; i < calls; ++i) call(i % kStates);
    counted(call, calls);
    say(what, calls);
  }
  static void say(const char* what, double number) {
    std::printf("%s %.1f\n", what, number);
    std::fflush(stdout);
  }
};

pin::Model read_model(std::istream& in, std::vector<pin::JointIndex>& feet) {
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
    if (kind == "foot") {
      std::size_t joint;
      in >> joint;
      feet.push_back(joint);
      continue;
    }
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
  if (!feet.empty())
    model.addFrame(pin::Frame("foot", feet.back(), pin::SE3::Identity(), pin::OP_FRAME));
  return model;
}

int main(int argc, char** argv) {
  std::ifstream file(argc > 1 ? argv[1] : "");
  Measure measure;
  if (argc == 4 && std::string(argv[2]) == "--count") measure.calls = std::atoi(argv[3]);
  if (!file || (argc != 2 && measure.calls <= 0)) {
    std::fprintf(stderr, "usage: %s joints.txt [--count calls]\n", argv[0]);
    return 2;
  }
  std::vector<pin::JointIndex> feet;
  const pin::Model model = read_model(file, feet);
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
    q.push_back(pin::integrate(model, pin::neutral(model), vector(model.nv)));
    v.push_back(vector(model.nv));
    x.push_back(vector(model.nv));
  }
  const auto local = pin::Convention::LOCAL, world = pin::Convention::WORLD;

  double sum = 0.0;
  std::printf("dof %d\n", model.nv);
  measure("kinematics", [&](int i) {
    pin::forwardKinematics(model, data, q[i], v[i]);
    sum += data.oMi.back().translation()[0];
  });
  measure("inverse", [&](int i) { sum += pin::rnea(model, data, q[i], v[i], x[i])[0]; });
  measure(
      "forward", [&](int i) { sum += pin::aba(model, data, q[i], v[i], x[i], local)[0]; },
      [&](int i) { sum += pin::aba(model, data, q[i], v[i], x[i], world)[0]; });
  measure(
      "mass_matrix", [&](int i) { sum += pin::crba(model, data, q[i], local)(0, 0); },
      [&](int i) { sum += pin::crba(model, data, q[i], world)(0, 0); });
  measure("inverse_mass", [&](int i) { sum += pin::computeMinverse(model, data, q[i])(0, 0); });
  if (!feet.empty()) {
    const pin::JointIndex foot = feet.back();
    const pin::FrameIndex frame = model.getFrameId("foot");
    pin::Data::Matrix6x J = pin::Data::Matrix6x::Zero(6, model.nv);
    measure(
        "jacobian",
        [&](int i) {
          pin::computeJointJacobian(model, data, q[i], foot, J);
          sum += J(0, 0);
        },
        [&](int i) {
          pin::computeFrameJacobian(model, data, q[i], frame, pin::LOCAL_WORLD_ALIGNED, J);
          sum += J(0, 0);
        });
  }
  measure(
      "centroidal",
      [&](int i) { sum += pin::computeCentroidalMap(model, data, q[i])(0, 0); },
      [&](int i) { sum += pin::ccrba(model, data, q[i], v[i])(0, 0); });
  measure("d_inverse", [&](int i) {
    pin::computeRNEADerivatives(model, data, q[i], v[i], x[i]);
    sum += data.dtau_dq(0, 0);
  });
  measure("d_forward", [&](int i) {
    pin::computeABADerivatives(model, data, q[i], v[i], x[i]);
    sum += data.ddq_dq(0, 0);
  });
  if (!feet.empty()) {
    std::vector<pin::RigidConstraintModel> contacts;
    for (const pin::JointIndex foot : feet)
      contacts.emplace_back(pin::CONTACT_6D, model, foot, pin::SE3::Identity(), pin::LOCAL);
    std::vector<pin::RigidConstraintData> contact_data;
    for (const auto& contact : contacts) contact_data.emplace_back(contact);
    pin::Data constrained(model);
    pin::initPvDelassus(model, constrained, contacts);
    const int n = 6 * int(feet.size());
    Eigen::MatrixXd delassus = Eigen::MatrixXd::Zero(n, n);
    const auto inverse = [&](bool pv) {
      return [&, pv](int i) {
        pin::computeDampedDelassusMatrixInverse(model, constrained, q[i], contacts, contact_data,
                                                delassus, 1e-6, false, pv);
        sum += delassus(0, 0);
      };
    };
    const auto matrix = [&](int i) {
      pin::computeDelassusMatrix(model, constrained, q[i], contacts, contact_data, delassus);
      sum += delassus(0, 0);
    };
    // The damped inverse is another product of the same recursion, in case it were cheaper.
    measure("compliance", matrix, inverse(true), inverse(false));
  }
  if (!std::isfinite(sum)) std::fprintf(stderr, "not finite\n");
  return 0;
}
