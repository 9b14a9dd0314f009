// Times Pinocchio's recursive algorithms on one URDF: nanoseconds per call, the best of several
// repeats over many random states. Usage: pinocchio_bench robot.urdf [free]
#include <pinocchio/fwd.hpp>
#include <pinocchio/algorithm/aba.hpp>
#include <pinocchio/algorithm/crba.hpp>
#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>
#include <pinocchio/parsers/urdf.hpp>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <random>
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

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s robot.urdf [free]\n", argv[0]);
    return 2;
  }
  pin::Model model;
  const bool free_base = argc > 2 && std::strcmp(argv[2], "free") == 0;
  if (free_base)
    pin::urdf::buildModel(argv[1], pin::JointModelFreeFlyer(), model);
  else
    pin::urdf::buildModel(argv[1], model);
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
  std::printf("kinematics %.1f\ninverse %.1f\nforward %.1f\nmass_matrix %.1f\n", fk, rnea, aba, crba);
  return 0;
}
