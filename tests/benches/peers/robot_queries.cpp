// Times what a robot's software asks of a model, with Pinocchio (kinematics, dynamics) and coal (shapes): collisions with the
// AABB tree and pair by pair, all distances; a body appended to a copy of the model; inverse dynamics with a load.
// Usage: robot_queries scene.txt
//
// The scene, words and numbers separated by white space:
//   bodies N  weld|pin|slider axis(3) parent x y z qx qy qz qw mass com(3) inertia(9)
//             parents first, counted from 1, 0 is the world; where the joint is in the parent; inertia about the centre of mass
//   shapes N  body kind size... x y z qx qy qz qw
//             box hx hy hz | sphere r | capsule r h | cylinder r h | hull n x y z...     halves
//   pairs N   i j ...                   places of shapes
//   rows N    configurations
//   load      body mass com(3) inertia(9)
// Prints one line of names and numbers, µs a configuration or a call, and `hits` with one digit for each configuration.
// libcoal and libpinocchio are made for any x86-64 processor and so is this program: Eigen's alignment has to be theirs.
#include <coal/broadphase/broadphase_dynamic_AABB_tree.h>
#include <coal/collision.h>
#include <coal/distance.h>
#include <coal/shape/convex.h>
#include <coal/shape/geometric_shapes.h>

#include <pinocchio/algorithm/joint-configuration.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/rnea.hpp>
#include <pinocchio/multibody.hpp>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <iostream>
#include <memory>
#include <set>
#include <string>
#include <vector>

namespace pin = pinocchio;

// The result is in microseconds per call. It is the median of groups of ten calls, so that other programs on the
// processor do not affect it. All calls are repeated until there are a hundred groups.
template <class F>
double us(int calls, F&& call) {
  std::vector<double> pieces;
  while (pieces.size() < 100)
    for (int from = 0; from < calls; from += 10) {
      const int to = std::min(calls, from + 10);
      const auto start = std::chrono::steady_clock::now();
      for (int i = from; i < to; ++i) call(i);
      const std::chrono::duration<double> spent = std::chrono::steady_clock::now() - start;
      pieces.push_back(1e6 * spent.count() / (to - from));
    }
  std::sort(pieces.begin(), pieces.end());
  return pieces[pieces.size() / 2];
}

// Stops at the first pair in contact; pairs that are excluded are skipped.
struct First : coal::CollisionCallBackBase {
  const std::vector<char>* meet = nullptr;
  std::size_t shapes = 0;
  coal::CollisionRequest request;
  coal::CollisionResult result;
  bool hit = false;
  bool collide(coal::CollisionObject* a, coal::CollisionObject* b) override {
    const auto i = reinterpret_cast<std::size_t>(a->getUserData());
    const auto j = reinterpret_cast<std::size_t>(b->getUserData());
    if (!(*meet)[i * shapes + j]) return false;
    result.clear();
    hit = coal::collide(a, b, request, result) > 0;
    return hit;
  }
};

int main(int argc, char** argv) {
  if (argc < 2) return std::fprintf(stderr, "usage: robot_queries scene.txt\n"), 2;
  std::ifstream in(argv[1]);
  std::string word;
  const auto expect = [&](const char* wanted) {
    if (!(in >> word) || word != wanted) {
      std::fprintf(stderr, "error: `%s` where `%s` is due\n", word.c_str(), wanted);
      std::exit(1);
    }
  };
  const auto numbers = [&](auto m) {
    for (int i = 0; i < m.size(); ++i) in >> m.data()[i];
    return m;
  };
  const auto read_pose = [&] {
    const auto x = numbers(Eigen::Matrix<double, 7, 1>());
    return pin::SE3(Eigen::Quaterniond(x[6], x[3], x[4], x[5]).normalized(), x.head<3>());
  };
  const auto read_inertia = [&] {
    double mass = 0;
    in >> mass;
    const auto com = numbers(Eigen::Vector3d());
    return pin::Inertia(mass, com, numbers(Eigen::Matrix3d()));
  };

  // The place of each body is its joint, and its pose in the joint.
  struct Place {
    pin::JointIndex joint;
    pin::SE3 pose;
  };
  pin::Model model;
  std::vector<Place> body{{0, pin::SE3::Identity()}};
  int bodies = 0;
  expect("bodies");
  in >> bodies;
  for (int b = 0; b < bodies; ++b) {
    std::size_t parent = 0;
    in >> word;
    const auto axis = numbers(Eigen::Vector3d());
    in >> parent;
    const pin::SE3 X = body[parent].pose * read_pose();
    const pin::Inertia own = read_inertia();
    const pin::JointIndex on = body[parent].joint;
    const std::string name = "j" + std::to_string(b);
    if (word == "weld")
      body.push_back({on, X});
    else if (word == "slider")
      body.push_back({model.addJoint(on, pin::JointModelPrismaticUnaligned(axis), X, name), pin::SE3::Identity()});
    else if (axis == Eigen::Vector3d::UnitX())
      body.push_back({model.addJoint(on, pin::JointModelRX(), X, name), pin::SE3::Identity()});
    else if (axis == Eigen::Vector3d::UnitY())
      body.push_back({model.addJoint(on, pin::JointModelRY(), X, name), pin::SE3::Identity()});
    else if (axis == Eigen::Vector3d::UnitZ())
      body.push_back({model.addJoint(on, pin::JointModelRZ(), X, name), pin::SE3::Identity()});
    else
      body.push_back({model.addJoint(on, pin::JointModelRevoluteUnaligned(axis), X, name), pin::SE3::Identity()});
    model.appendBodyToJoint(body.back().joint, own, body.back().pose);
  }
  pin::Data data(model);

  expect("shapes");
  int shapes = 0;
  in >> shapes;
  std::vector<std::unique_ptr<coal::CollisionObject>> objects;
  std::vector<pin::JointIndex> joint(shapes);
  std::vector<pin::SE3> place(shapes);
  for (int i = 0; i < shapes; ++i) {
    std::string kind;
    std::size_t on = 0;
    in >> on >> kind;
    double a = 0, b = 0, c = 0;
    std::shared_ptr<coal::CollisionGeometry> shape;
    if (kind == "box") {
      in >> a >> b >> c;
      shape = std::make_shared<coal::Box>(2 * a, 2 * b, 2 * c);
    } else if (kind == "sphere") {
      in >> a;
      shape = std::make_shared<coal::Sphere>(a);
    } else if (kind == "capsule") {
      in >> a >> b;
      shape = std::make_shared<coal::Capsule>(a, 2 * b);
    } else if (kind == "cylinder") {
      in >> a >> b;
      shape = std::make_shared<coal::Cylinder>(a, 2 * b);
    } else if (kind == "hull") {
      int count = 0;
      in >> count;
      auto points = std::make_shared<std::vector<coal::Vec3s>>(count);
      for (coal::Vec3s& p : *points) in >> p[0] >> p[1] >> p[2];
      shape.reset(coal::ConvexBase::convexHull(points, unsigned(count), true, nullptr));
    } else {
      return std::fprintf(stderr, "error: no shape `%s`\n", kind.c_str()), 1;
    }
    joint[i] = body[on].joint;
    place[i] = body[on].pose * read_pose();
    objects.push_back(std::make_unique<coal::CollisionObject>(shape));
    objects.back()->setUserData(reinterpret_cast<void*>(std::size_t(i)));
  }

  expect("pairs");
  int pairs = 0;
  in >> pairs;
  std::vector<std::pair<int, int>> pair(pairs);
  std::vector<char> meet(std::size_t(shapes) * shapes, 0);
  for (auto& [i, j] : pair) {
    in >> i >> j;
    meet[i * shapes + j] = meet[j * shapes + i] = 1;
  }

  expect("rows");
  int rows = 0;
  in >> rows;
  std::vector<Eigen::VectorXd> q;
  for (int k = 0; k < rows; ++k) q.push_back(numbers(Eigen::VectorXd(model.nq)));

  expect("load");
  std::size_t on = 0;
  in >> on;
  const Place hand = body[on];
  const pin::Inertia load = read_inertia();
  if (!in) return std::fprintf(stderr, "error: the scene ends too early\n"), 1;

  const auto move = [&](int k) {
    pin::forwardKinematics(model, data, q[k]);
    for (int i = 0; i < shapes; ++i) {
      const pin::SE3 X = data.oMi[joint[i]] * place[i];
      objects[i]->setTransform(X.rotation(), X.translation());
      objects[i]->computeAABB();
    }
  };

  coal::DynamicAABBTreeCollisionManager tree;
  for (auto& o : objects) tree.registerObject(o.get());
  move(0);
  tree.setup();
  First first;
  first.meet = &meet;
  first.shapes = std::size_t(shapes);
  std::string hits(rows, '0');
  const double tree_us = us(rows, [&](int k) {
    move(k);
    tree.update();
    first.hit = false;
    tree.collide(&first);
    hits[k] = first.hit ? '1' : '0';
  });

  // There is one functor for each pair, as in Pinocchio's geometry data; bounding boxes are tested
  // first.
  std::vector<coal::ComputeCollision> collide;
  std::vector<coal::ComputeDistance> distance;
  for (const auto& [i, j] : pair) {
    collide.emplace_back(objects[i]->collisionGeometryPtr(), objects[j]->collisionGeometryPtr());
    distance.emplace_back(objects[i]->collisionGeometryPtr(), objects[j]->collisionGeometryPtr());
  }
  const coal::CollisionRequest request;
  coal::CollisionResult result;
  int found = 0;
  const auto touch = [&](int k) {
    const auto& [i, j] = pair[k];
    if (!objects[i]->getAABB().overlap(objects[j]->getAABB())) return false;
    result.clear();
    return collide[k](objects[i]->getTransform(), objects[j]->getTransform(), request, result) > 0;
  };
  const double stop_us = us(rows, [&](int k) {
    move(k);
    for (int p = 0; p < pairs; ++p)
      if (touch(p)) {
        ++found;
        break;
      }
  });
  const double all_us = us(rows, [&](int k) {
    move(k);
    for (int p = 0; p < pairs; ++p) found += touch(p);
  });
  const coal::DistanceRequest nearest;
  coal::DistanceResult apart;
  double sum = 0;
  const double distances_us = us(rows, [&](int k) {
    move(k);
    for (int p = 0; p < pairs; ++p) {
      const auto& [i, j] = pair[p];
      apart.clear();
      sum += distance[p](objects[i]->getTransform(), objects[j]->getTransform(), nearest, apart);
    }
  });

  // The documented way to add a body in the hand is another model, which needs its own data.
  std::size_t joints = 0;
  const double grasp_us = us(200, [&](int) {
    pin::Model with = model;
    with.appendBodyToJoint(hand.joint, load, hand.pose);
    const pin::Data own(with);
    joints += own.oMi.size();
  });
  pin::Model with = model;
  with.appendBodyToJoint(hand.joint, load, hand.pose);
  pin::Data own(with);
  const Eigen::VectorXd v = Eigen::VectorXd::LinSpaced(model.nv, -0.5, 0.7), a = 2.0 * v;
  const double rnea_us = us(20 * rows, [&](int k) { sum += pin::rnea(with, own, q[k % rows], v, a)[0]; });

  std::printf("tree %.4f stop %.4f all %.4f distances %.4f grasp %.4f rnea %.4f hits %s\n", tree_us, stop_us, all_us,
              distances_us, grasp_us, rnea_us, hits.c_str());
  // The output prevents that the compiler removes the computations.
  std::fprintf(stderr, "%d %zu %g\n", found, joints, sum);
}
