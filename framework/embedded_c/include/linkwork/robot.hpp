// The embedded robot model for C++17 and later: handles with destructors, exceptions instead of codes, spans instead of pointers with lengths. Every
// function is a call of robot.h, which documents it. Header only.
#ifndef LINKWORK_ROBOT_HPP
#define LINKWORK_ROBOT_HPP

#include <linkwork/robot.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>
#if __cplusplus >= 202002L
#include <span>
#else
#include <iterator>
#include <type_traits>
#endif

namespace linkwork {

#if __cplusplus >= 202002L
template <class T>
using Span = std::span<T>;
#else
// A non-owning view of contiguous numbers: the subset of std::span that is used here, because C++17 does not have std::span.
template <class T>
class Span {
 public:
  constexpr Span() noexcept = default;
  constexpr Span(T *data, std::size_t size) noexcept : data_(data), size_(size) {}
  // Views arrays, std::array, std::vector and everything else that has data() and size() of such numbers.
  template <class Numbers, class Element = std::remove_pointer_t<decltype(std::data(std::declval<Numbers &>()))>,
            class = std::enable_if_t<std::is_convertible_v<Element (*)[], T (*)[]>>>
  constexpr Span(Numbers &&numbers) noexcept : data_(std::data(numbers)), size_(std::size(numbers)) {}

  constexpr T *data() const noexcept { return data_; }
  constexpr std::size_t size() const noexcept { return size_; }
  constexpr bool empty() const noexcept { return size_ == 0; }
  constexpr T &front() const { return *data_; }
  constexpr Span first(std::size_t count) const { return {data_, count}; }
  constexpr T *begin() const noexcept { return data_; }
  constexpr T *end() const noexcept { return data_ + size_; }
  constexpr T &operator[](std::size_t i) const { return data_[i]; }

 private:
  T *data_ = nullptr;
  std::size_t size_ = 0;
};
#endif

// A failed call: its code, and the handle's message as what().
class Error : public std::runtime_error {
 public:
  Error(LwStatus status, const std::string &text) : std::runtime_error(text), status_(status) {}
  LwStatus status() const noexcept { return status_; }

 private:
  LwStatus status_;
};

namespace detail {

// Reads a text of the library. The first call returns its length. If another thread makes the message of a shared model longer between the two calls,
// the text is read again.
template <class Call>
std::string text(Call &&call, LwStatus &status) {
  std::string out;
  std::size_t wanted = 0;
  status = call(nullptr, 0, &wanted);
  while (status == LW_STATUS_LENGTH && wanted > out.size()) {
    out.resize(wanted);
    status = call(out.data(), out.size(), &wanted);
  }
  if (status != LW_STATUS_OK) return {};
  out.resize(wanted - 1);
  return out;
}

template <class Handle>
using MessageOf = LwStatus (*)(const Handle *, char *, std::size_t, std::size_t *);

template <class Handle>
void check(LwStatus status, const Handle *handle, MessageOf<Handle> message) {
  if (status == LW_STATUS_OK) return;
  std::string words = lw_status_text(status);
  // The message of a busy or missing handle does not belong to this call.
  if (handle != nullptr && status != LW_STATUS_BUSY) {
    LwStatus told;
    auto more = text([&](char *b, std::size_t n, std::size_t *w) { return message(handle, b, n, w); }, told);
    if (told == LW_STATUS_OK && !more.empty()) words = std::move(more);
  }
  throw Error(status, words);
}

template <auto Free>
struct Freed {
  template <class Handle>
  void operator()(Handle *handle) const noexcept {
    Free(handle);
  }
};

}  // namespace detail

namespace detail {

inline void copy(std::array<double, 3> from, double (&to)[3]) {
  for (std::size_t i = 0; i < 3; ++i) to[i] = from[i];
}

}  // namespace detail

// Creates a goal for position and orientation in the world.
inline LwGoal pose_goal(const LwPose &pose) {
  LwGoal goal{};
  goal.pose = pose;
  goal.weights[0] = goal.weights[1] = 1;
  goal.parts = LW_GOAL_POSITION | LW_GOAL_ORIENTATION;
  return goal;
}

// Creates a goal for the position alone, m, in the world.
inline LwGoal position_goal(std::array<double, 3> p) {
  LwGoal goal = pose_goal({{p[0], p[1], p[2]}, {0, 0, 0, 1}});
  goal.parts = LW_GOAL_POSITION;
  return goal;
}

// Returns a copy of the goal that requires only the plane through the position with this normal.
inline LwGoal on_plane(LwGoal goal, std::array<double, 3> normal) {
  detail::copy(normal, goal.direction);
  goal.parts |= LW_GOAL_PLANE;
  return goal;
}
// Returns a copy of the goal that requires only the line through the position along this direction.
inline LwGoal on_line(LwGoal goal, std::array<double, 3> direction) {
  detail::copy(direction, goal.direction);
  goal.parts |= LW_GOAL_LINE;
  return goal;
}
// Returns a copy of the goal with an axis of the tip along a direction, or within a cone about it, instead of an orientation.
inline LwGoal axis_along(LwGoal goal, std::array<double, 3> axis, std::array<double, 3> direction, double within = 0) {
  detail::copy(axis, goal.axis);
  detail::copy(direction, goal.towards);
  goal.within = within;
  goal.parts = (goal.parts & ~std::uint32_t{LW_GOAL_ORIENTATION}) | LW_GOAL_AXIS;
  return goal;
}
// Returns a copy of the goal with an axis of the tip that points at a point, or within a cone about it, instead of an orientation.
inline LwGoal axis_at(LwGoal goal, std::array<double, 3> axis, std::array<double, 3> point, double within = 0) {
  detail::copy(axis, goal.axis);
  detail::copy(point, goal.towards);
  goal.within = within;
  goal.parts = (goal.parts & ~std::uint32_t{LW_GOAL_ORIENTATION}) | LW_GOAL_LOOK_AT;
  return goal;
}

// Prefers configurations near the middle of the limits; number of starts as given.
inline LwPrefer centred(std::size_t starts = 1) { return {1, 0, 0, 1, starts, 400}; }
// Prefers configurations near the one that the search is given; number of starts as given.
inline LwPrefer near_given(std::size_t starts = 1) { return {0, 1, 0, 1, starts, 400}; }
// Prefers configurations far from singular ones; number of starts as given.
inline LwPrefer manipulable(std::size_t starts = 1) { return {0, 0, 1, 1, starts, 400}; }

// Tasks for rates or accelerations, with weight 1.
inline LwObjective tip_objective(std::uint32_t level, std::uint32_t part, std::array<double, 6> motion,
                       std::uint32_t rows = LW_ROWS_ALL, double length = 1) {
  LwObjective objective{};
  objective.kind = LW_OBJECTIVE_TIP;
  objective.level = level;
  objective.weight = 1;
  for (std::size_t i = 0; i < 6; ++i) objective.motion[i] = motion[i];
  objective.length = length;
  objective.part = part;
  objective.rows = rows;
  return objective;
}
inline LwObjective center_objective(std::uint32_t level, std::array<double, 3> motion) {
  LwObjective objective = tip_objective(level, 0, {0, 0, 0, motion[0], motion[1], motion[2]});
  objective.kind = LW_OBJECTIVE_CENTER;
  return objective;
}
// The array is not copied: it must exist during the call.
inline LwObjective posture_objective(std::uint32_t level, Span<const double> posture) {
  LwObjective objective = tip_objective(level, 0, {});
  objective.kind = LW_OBJECTIVE_POSTURE;
  objective.posture = posture.data();
  objective.posture_count = posture.size();
  return objective;
}

// Returns the corners of the support polygon of contact points, counter-clockwise. Allocates.
inline std::vector<std::array<double, 2>> support_polygon(std::vector<std::array<double, 2>> points) {
  std::vector<std::array<double, 2>> hull(points.size() + 1);
  std::size_t count = 0;
  detail::check<LwRobot>(lw_support_polygon(points.empty() ? nullptr : points.front().data(), points.size(),
                                            hull.front().data(), hull.size(), &count),
                         nullptr, lw_robot_message);
  hull.resize(count);
  return hull;
}
// Returns the distance of a point from the nearest edge of such a polygon, m; negative outside.
inline double support_margin(Span<const std::array<double, 2>> hull, std::array<double, 2> p) {
  double out = 0;
  detail::check<LwRobot>(
      lw_support_margin(hull.empty() ? nullptr : hull.front().data(), hull.size(), p.data(), &out), nullptr,
      lw_robot_message);
  return out;
}

// State of a robot: configuration and motion, at rest if no rates are given. The arrays are not copied: they must exist during the call.
inline LwMotionState motion_state(Span<const double> q, Span<const double> v = {},
                                  Span<const double> vdot = {}) {
  if (!v.empty() && !vdot.empty() && v.size() != vdot.size())
    throw Error(LW_STATUS_LENGTH, "`v` and `vdot` differ in length\n  help: give nv numbers each");
  return {q.data(), q.size(), v.empty() ? nullptr : v.data(), vdot.empty() ? nullptr : vdot.data(),
          v.empty() ? vdot.size() : v.size()};
}

// Returns the default effort of inverse kinematics.
inline LwEffort default_effort() {
  LwEffort out;
  lw_effort_default(&out);
  return out;
}

// Returns an upper bound for the kinematics evaluations of inverse kinematics of one chain with such a goal.
inline std::size_t worst_case_steps(const LwGoal &goal, const LwEffort *effort = nullptr) {
  std::size_t out = 0;
  const LwStatus status = lw_effort_worst_case_steps(effort, &goal, &out);
  if (status != LW_STATUS_OK) throw Error(status, lw_status_text(status));
  return out;
}

// Constant data of a robot. Threads may share one.
class Model {
 public:
  explicit Model(LwModel *owned) : handle_(owned) {}

  // Returns another handle of the same model, with its own message.
  Model clone() const {
    LwModel *out = nullptr;
    check(lw_model_clone(get(), &out));
    return Model(out);
  }

  std::size_t nq() const { return sizes().first; }
  std::size_t nv() const { return sizes().second; }

  std::uint32_t part(const std::string &name) const { return find(lw_model_part, name); }
  std::uint32_t object(const std::string &name) const { return find(lw_model_object, name); }
  std::uint32_t body(const std::string &name) const { return find(lw_model_body, name); }
  std::uint32_t collider(const std::string &name) const { return find(lw_model_collider, name); }

  // Returns the numbers of coordinates and degrees of freedom of an object's joints.
  std::pair<std::size_t, std::size_t> object_sizes(std::uint32_t object) const {
    std::pair<std::size_t, std::size_t> out;
    check(lw_model_object_sizes(get(), object, &out.first, &out.second));
    return out;
  }
  std::uint32_t object_body(std::uint32_t object, const std::string &name) const {
    std::uint32_t out = 0;
    check(lw_model_object_body(get(), object, name.c_str(), &out));
    return out;
  }

  std::string collider_name(std::uint32_t id) const {
    return words([&](char *b, std::size_t n, std::size_t *w) { return lw_model_collider_name(get(), id, b, n, w); });
  }

  // Returns the content of the files that the model does not use, one line each.
  std::string unused() const {
    return words([&](char *b, std::size_t n, std::size_t *w) { return lw_model_unused(get(), b, n, w); });
  }
  // Returns warnings about mass properties of the file that no rigid body can have but that were read all the same.
  std::string doubtful() const {
    return words([&](char *b, std::size_t n, std::size_t *w) { return lw_model_doubtful(get(), b, n, w); });
  }

  // Indices of a hinge's coordinates and degrees of freedom.
  struct Hinge {
    std::size_t in_q, q_count, in_v, v_count;
  };
  Hinge hinge(std::uint32_t body) const {
    Hinge h{};
    check(lw_model_hinge(get(), body, &h.in_q, &h.q_count, &h.in_v, &h.v_count));
    return h;
  }
  Hinge object_hinge(std::uint32_t object, std::uint32_t body) const {
    Hinge h{};
    check(lw_model_object_hinge(get(), object, body, &h.in_q, &h.q_count, &h.in_v, &h.v_count));
    return h;
  }

  // Returns the indices of a joint in q and among the degrees of freedom.
  std::pair<std::size_t, std::size_t> joint(const std::string &name) const {
    std::pair<std::size_t, std::size_t> out;
    check(lw_model_joint(get(), name.c_str(), &out.first, &out.second));
    return out;
  }

  // Returns the indices of a chain's degrees of freedom, which are the columns of its Jacobian.
  std::vector<std::size_t> dofs(std::uint32_t part) const {
    std::size_t count = 0;
    check(lw_model_part_size(get(), part, &count));
    std::vector<std::size_t> out(count);
    check(lw_model_part_dofs(get(), part, out.data(), out.size()));
    return out;
  }

  // Return the colliders on the bodies of a part, and those of an object.
  std::vector<std::uint32_t> part_colliders(std::uint32_t part) const {
    return colliders(lw_model_part_colliders, part);
  }
  std::vector<std::uint32_t> object_colliders(std::uint32_t object) const {
    return colliders(lw_model_object_colliders, object);
  }

  // Returns lower and upper limits of all degrees of freedom.
  std::pair<std::vector<double>, std::vector<double>> limits() const {
    std::pair<std::vector<double>, std::vector<double>> out{nv(), nv()};
    check(lw_model_limits(get(), out.first.data(), out.second.data(), out.first.size()));
    return out;
  }

  LwModel *get() const noexcept { return handle_.get(); }
  void check(LwStatus status) const { detail::check<LwModel>(status, get(), lw_model_message); }

 private:
  std::pair<std::size_t, std::size_t> sizes() const {
    std::pair<std::size_t, std::size_t> out;
    check(lw_model_sizes(get(), &out.first, &out.second));
    return out;
  }

  template <class Call>
  std::vector<std::uint32_t> colliders(Call call, std::uint32_t of) const {
    std::size_t count = 0;
    const LwStatus status = call(get(), of, nullptr, 0, &count);
    if (status != LW_STATUS_NO_ROOM) check(status);
    std::vector<std::uint32_t> out(count);
    check(call(get(), of, out.data(), out.size(), &count));
    return out;
  }

  template <class Find>
  std::uint32_t find(Find call, const std::string &name) const {
    std::uint32_t out = 0;
    check(call(get(), name.c_str(), &out));
    return out;
  }

  template <class Call>
  std::string words(Call &&call) const {
    LwStatus status;
    auto out = detail::text(call, status);
    check(status);
    return out;
  }

  std::unique_ptr<LwModel, detail::Freed<lw_model_free>> handle_;
};

// A model under construction.
class Builder {
 public:
  Builder() {
    LwBuilder *out = nullptr;
    detail::check<LwBuilder>(lw_builder_new(&out), nullptr, lw_builder_message);
    handle_.reset(out);
  }

  Builder &packages(const std::string &folder) { return check(lw_builder_packages(get(), folder.c_str())); }
  Builder &keep_closures() { return check(lw_builder_keep_closures(get())); }
  Builder &robot_file(const std::string &path, std::uint32_t root = LW_ROOT_AS_WRITTEN,
                      std::uint32_t inertia = LW_INERTIA_WARN) {
    return check(lw_builder_robot_file(get(), path.c_str(), root, inertia));
  }
  Builder &robot_text(const std::string &xml, std::uint32_t root = LW_ROOT_AS_WRITTEN,
                      std::uint32_t inertia = LW_INERTIA_WARN) {
    return check(lw_builder_robot_text(get(), xml.c_str(), root, inertia));
  }
  Builder &groups_file(const std::string &path) { return check(lw_builder_groups_file(get(), path.c_str())); }
  Builder &groups_text(const std::string &xml) { return check(lw_builder_groups_text(get(), xml.c_str())); }
  Builder &file_shapes() { return check(lw_builder_file_shapes(get())); }
  Builder &chain(const std::string &name, const std::string &base, const std::string &tip) {
    return check(lw_builder_chain(get(), name.c_str(), base.c_str(), tip.c_str()));
  }
  Builder &object(const std::string &name, double mass, std::array<double, 3> center, std::array<double, 9> inertia) {
    return check(lw_builder_object(get(), name.c_str(), mass, center.data(), inertia.data()));
  }
  Builder &body(const std::string &name, const std::string &parent, const LwHinge &hinge, double mass,
                std::array<double, 3> center, std::array<double, 9> inertia,
                const std::optional<LwPose> &at = std::nullopt) {
    return check(lw_builder_body(get(), name.c_str(), parent.c_str(), &hinge, at ? &*at : nullptr, mass, center.data(),
                                 inertia.data()));
  }
  Builder &object_body(const std::string &name, const std::string &parent, const LwHinge &hinge, double mass,
                       std::array<double, 3> center, std::array<double, 9> inertia,
                       const std::optional<LwPose> &at = std::nullopt) {
    return check(lw_builder_object_body(get(), name.c_str(), parent.c_str(), &hinge, at ? &*at : nullptr, mass,
                                        center.data(), inertia.data()));
  }
  // An infinite limit means that the hinge has no limit.
  Builder &limits(const std::string &body, double lower, double upper,
                  double rate = std::numeric_limits<double>::infinity(),
                  double effort = std::numeric_limits<double>::infinity()) {
    return check(lw_builder_limits(get(), body.c_str(), lower, upper, rate, effort));
  }
  Builder &shape(const std::string &name, const std::string &carrier, const LwShape &shape,
                 const std::optional<LwPose> &at = std::nullopt) {
    return check(lw_builder_shape(get(), name.c_str(), carrier.c_str(), at ? &*at : nullptr, &shape));
  }
  Builder &point_cloud(const std::string &name, const std::string &carrier, std::size_t room,
                       const std::optional<LwPose> &at = std::nullopt) {
    return check(lw_builder_point_cloud(get(), name.c_str(), carrier.c_str(), at ? &*at : nullptr, room));
  }
  Builder &voxel_map(const std::string &name, const std::string &carrier, std::array<std::uint32_t, 3> cells,
                     double edge, const std::optional<LwPose> &at = std::nullopt) {
    return check(lw_builder_voxel_map(get(), name.c_str(), carrier.c_str(), at ? &*at : nullptr, cells.data(), edge));
  }
  Builder &hull(const std::string &name, const std::string &carrier, Span<const std::array<double, 3>> points,
                const std::optional<LwPose> &at = std::nullopt) {
    return check(lw_builder_hull(get(), name.c_str(), carrier.c_str(), at ? &*at : nullptr, first(points), points.size()));
  }
  Builder &mesh(const std::string &name, const std::string &carrier, Span<const std::array<double, 3>> vertices,
                Span<const std::array<std::uint32_t, 3>> triangles, const std::optional<LwPose> &at = std::nullopt) {
    return check(lw_builder_mesh(get(), name.c_str(), carrier.c_str(), at ? &*at : nullptr, first(vertices),
                                 vertices.size(), first(triangles), triangles.size()));
  }
  Builder &height_field(const std::string &name, const std::string &carrier, std::size_t x, std::size_t y,
                        std::array<double, 2> spacing, Span<const double> heights,
                        const std::optional<LwPose> &at = std::nullopt) {
    return check(lw_builder_height_field(get(), name.c_str(), carrier.c_str(), at ? &*at : nullptr, x, y,
                                         spacing.data(), heights.data(), heights.size()));
  }
  // Adds a coarse shape to a collider that was added before.
  Builder &coarse(const std::string &name, const LwShape &shape) {
    return check(lw_builder_coarse(get(), name.c_str(), &shape));
  }
  Builder &coarse_hull(const std::string &name, Span<const std::array<double, 3>> points) {
    return check(lw_builder_coarse_hull(get(), name.c_str(), first(points), points.size()));
  }
  Builder &coarse_mesh(const std::string &name, Span<const std::array<double, 3>> vertices,
                       Span<const std::array<std::uint32_t, 3>> triangles) {
    return check(lw_builder_coarse_mesh(get(), name.c_str(), first(vertices), vertices.size(), first(triangles),
                                        triangles.size()));
  }
  Builder &coarse_voxel_map(const std::string &name, std::array<std::uint32_t, 3> cells, double edge,
                            Span<const std::array<std::uint32_t, 3>> occupied) {
    return check(lw_builder_coarse_voxel_map(get(), name.c_str(), cells.data(), edge, first(occupied),
                                             occupied.size()));
  }
  Builder &collide(const std::string &a, const std::string &b) {
    return check(lw_builder_collide(get(), a.c_str(), b.c_str()));
  }
  // Excludes all pairs of these bodies from collision checks.
  Builder &apart(Span<const std::string> bodies) {
    std::vector<const char *> names;
    for (const auto &name : bodies) names.push_back(name.c_str());
    return check(lw_builder_apart(get(), names.data(), names.size()));
  }
  Builder &neighbours(std::uint32_t neighbours) { return check(lw_builder_neighbours(get(), neighbours)); }
  Builder &ignore(const std::string &a, const std::string &b) {
    return check(lw_builder_ignore(get(), a.c_str(), b.c_str()));
  }

  Model model() {
    LwModel *out = nullptr;
    check(lw_builder_model(get(), &out));
    return Model(out);
  }

  LwBuilder *get() const noexcept { return handle_.get(); }

 private:
  template <class T, std::size_t N>
  static const T *first(Span<const std::array<T, N>> rows) {
    return rows.empty() ? nullptr : rows.front().data();
  }

  Builder &check(LwStatus status) {
    detail::check<LwBuilder>(status, get(), lw_builder_message);
    return *this;
  }

  std::unique_ptr<LwBuilder, detail::Freed<lw_builder_free>> handle_;
};

// One instance of a model, for one thread at a time. After the constructor only clone, functions that return a vector, and exceptions allocate.
class Robot {
 public:
  explicit Robot(const Model &model) {
    LwRobot *out = nullptr;
    model.check(lw_robot_new(model.get(), &out));
    handle_.reset(out);
  }

  // Returns an independent robot with the same configuration, held objects and settings.
  Robot clone() const {
    LwRobot *out = nullptr;
    check(lw_robot_clone(get(), &out));
    return Robot(out);
  }

  void q(Span<double> out) const { check(lw_robot_q(get(), out.data(), out.size())); }
  void set_q(Span<const double> q) { check(lw_robot_set_q(get(), q.data(), q.size())); }
  void clamp(Span<double> q) const { check(lw_robot_clamp(get(), q.data(), q.size())); }
  void set_gravity(std::array<double, 3> g) { check(lw_robot_set_gravity(get(), g.data())); }

  LwPose tip_pose(std::uint32_t part) { return pose(lw_robot_tip_pose, part); }
  LwPose base_pose(std::uint32_t part) { return pose(lw_robot_base_pose, part); }
  LwPose body_pose(std::uint32_t body) { return pose(lw_robot_body_pose, body); }
  LwPose object_pose(std::uint32_t object) { return pose(lw_robot_object_pose, object); }
  void jacobian(std::uint32_t part, Span<double> J) { check(lw_robot_jacobian(get(), part, J.data(), J.size())); }
  void whole_jacobian(std::uint32_t part, Span<double> J) {
    check(lw_robot_whole_jacobian(get(), part, J.data(), J.size()));
  }

  // The `gradient` is over the chain's degrees of freedom, or empty.
  LwManipulability manipulability(std::uint32_t part, std::uint32_t rows = LW_ROWS_ALL, double length = 1,
                                  Span<double> gradient = {}) {
    LwManipulability out;
    check(lw_robot_manipulability(get(), part, rows, length, &out, gradient.data(), gradient.size()));
    return out;
  }
  // Returns the residual, rad/s and m/s.
  std::array<double, 2> rates(std::uint32_t part, std::array<double, 6> twist, Span<double> v) {
    std::array<double, 2> out;
    check(lw_robot_rates(get(), part, twist.data(), v.data(), v.size(), out.data()));
    return out;
  }

  LwAnswer inverse_kinematics(std::uint32_t part, const LwGoal &goal, Span<double> q,
                 const std::optional<LwEffort> &effort = std::nullopt) {
    LwAnswer out;
    check(lw_robot_inverse_kinematics(get(), part, &goal, effort ? &*effort : nullptr, q.data(), q.size(), &out));
    return out;
  }
  // Returns configurations one after the other, q.size() numbers each; held: -1, or the index among the degrees of freedom of the hinge that keeps its value.
  std::vector<double> inverse_kinematics_all(std::uint32_t part, const LwGoal &goal, Span<const double> q, std::int64_t held = -1) {
    constexpr std::size_t most = 8;
    std::vector<double> out(most * q.size());
    std::size_t count = 0;
    check(lw_robot_inverse_kinematics_all(get(), part, held, &goal, q.data(), q.size(), out.data(), most, &count));
    out.resize(count * q.size());
    return out;
  }
  LwBest inverse_kinematics_best(std::uint32_t part, const LwGoal &goal, const LwPrefer &prefer, Span<double> q,
                    const std::optional<LwEffort> &effort = std::nullopt) {
    LwBest out;
    check(lw_robot_inverse_kinematics_best(get(), part, &goal, &prefer, effort ? &*effort : nullptr, q.data(), q.size(), &out));
    return out;
  }
  LwAnswer resume_inverse_kinematics(std::uint32_t part, std::size_t kinematics, Span<double> q) {
    LwAnswer out;
    check(lw_robot_resume_inverse_kinematics(get(), part, kinematics, q.data(), q.size(), &out));
    return out;
  }

  void feed_forward(Span<const double> v, Span<const double> vdot, Span<double> tau,
                    Span<const LwPush> pushes = {}) {
    if (v.size() != vdot.size() || v.size() != tau.size())
      throw Error(LW_STATUS_LENGTH, "`v`, `vdot` and `tau` differ in length\n  help: give nv numbers each");
    check(lw_robot_feed_forward(get(), v.data(), vdot.data(), v.size(), pushes.data(), pushes.size(), tau.data()));
  }
  // The joints of a held object move: `rates`, `accelerations` and `forces` have one number for each of their degrees of freedom.
  void feed_forward_with_object(Span<const double> v, Span<const double> vdot, std::uint32_t object,
                         Span<const double> rates, Span<const double> accelerations, Span<double> tau,
                         Span<double> forces, Span<const LwPush> pushes = {}) {
    if (v.size() != vdot.size() || v.size() != tau.size())
      throw Error(LW_STATUS_LENGTH, "`v`, `vdot` and `tau` differ in length\n  help: give nv numbers each");
    if (rates.size() != accelerations.size() || rates.size() != forces.size())
      throw Error(LW_STATUS_LENGTH, "`rates`, `accelerations` and `forces` differ in length\n  help: give a number for each joint");
    check(lw_robot_feed_forward_with_object(get(), v.data(), vdot.data(), v.size(), object, rates.data(), accelerations.data(),
                                     rates.size(), pushes.data(), pushes.size(), tau.data(), forces.data()));
  }
  void held_still(Span<double> tau, Span<const LwPush> pushes = {}) {
    check(lw_robot_held_still(get(), pushes.data(), pushes.size(), tau.data(), tau.size()));
  }
  // The `tips` have six numbers for each part.
  void bias(Span<const double> v, Span<double> tau, Span<const std::uint32_t> parts = {},
            Span<double> tips = {}) {
    if (v.size() != tau.size() || tips.size() != 6 * parts.size())
      throw Error(LW_STATUS_LENGTH, "`v` and `tau`, or `parts` and `tips`, do not fit\n  help: give nv numbers each, and six for each part");
    check(lw_robot_bias(get(), v.data(), v.size(), parts.data(), parts.size(), tau.data(), tips.data()));
  }
  void mass_matrix(Span<double> M) { check(lw_robot_mass_matrix(get(), M.data(), M.size())); }
  // Returns the mass, kg, and its centre in the world, m.
  std::pair<double, std::array<double, 3>> center_of_mass() {
    std::pair<double, std::array<double, 3>> out;
    check(lw_robot_center_of_mass(get(), &out.first, out.second.data()));
    return out;
  }

  LwInertia composite_inertia(std::uint32_t body) {
    LwInertia out;
    check(lw_robot_composite_inertia(get(), body, &out));
    return out;
  }
  // Returns the momentum, angular, then linear, about the centre of mass.
  std::array<double, 6> momentum(Span<const double> v) {
    std::array<double, 6> out;
    check(lw_robot_momentum(get(), v.data(), v.size(), out.data()));
    return out;
  }
  void centroidal_matrix(Span<double> A) { check(lw_robot_centroidal_matrix(get(), A.data(), A.size())); }

  LwHold hold(std::uint32_t object) {
    LwHold out;
    check(lw_robot_hold(get(), object, &out));
    return out;
  }
  // Two hands on one object; wrenches are those of the first hand, then of the second hand.
  LwShared balance(std::uint32_t object, std::uint32_t balance, Span<double> tau) {
    LwShared out;
    check(lw_robot_balance(get(), object, balance, tau.data(), tau.size(), &out));
    return out;
  }
  std::array<LwWrench, 2> squeeze(std::uint32_t object, double force, Span<double> tau) {
    std::array<LwWrench, 2> out;
    check(lw_robot_squeeze(get(), object, force, tau.data(), tau.size(), out.data()));
    return out;
  }
  void add_hand_wrenches(std::uint32_t object, const std::array<LwWrench, 2> &wrenches, Span<double> tau) {
    check(lw_robot_add_hand_wrenches(get(), object, wrenches.data(), tau.data(), tau.size()));
  }
  // The weights are for the first hand, the second hand, and 1 N m relative to 1 N.
  LwHandWrenches split_hand_wrenches(std::uint32_t object, const std::array<LwWrench, 2> &wrenches,
                             std::array<double, 3> weights) {
    LwHandWrenches out;
    check(lw_robot_split_hand_wrenches(get(), object, wrenches.data(), weights.data(), &out));
    return out;
  }
  LwGripped grip(std::uint32_t object, const std::array<LwWrench, 2> &wrenches,
                 const std::array<LwFriction, 2> &friction) {
    LwGripped out;
    check(lw_robot_grip(get(), object, wrenches.data(), friction.data(), &out));
    return out;
  }

  void put(std::uint32_t object, const LwPose &at) { check(lw_robot_put(get(), object, &at)); }
  // Grasps at the object's current pose, or at the given pose in the tip's frame.
  void grasp(std::uint32_t hand, std::uint32_t object, const std::optional<LwPose> &at = std::nullopt) {
    check(lw_robot_grasp(get(), hand, object, at ? &*at : nullptr));
  }
  void update_grasp(std::uint32_t hand, std::uint32_t object, const LwPose &at) {
    check(lw_robot_update_grasp(get(), hand, object, &at));
  }
  void release(std::uint32_t hand, std::uint32_t object) { check(lw_robot_release(get(), hand, object)); }
  void ungrasp(std::uint32_t object) { check(lw_robot_ungrasp(get(), object)); }
  void attach(std::uint32_t object, std::uint32_t on, std::uint32_t body = LW_ITSELF,
              const std::optional<LwPose> &at = std::nullopt) {
    check(lw_robot_attach(get(), object, on, body, at ? &*at : nullptr));
  }
  void detach(std::uint32_t object) { check(lw_robot_detach(get(), object)); }

  bool collides(Span<const double> q) {
    bool out = false;
    check(lw_robot_collides(get(), q.data(), q.size(), &out, nullptr));
    return out;
  }
  std::optional<LwPair> first_hit(Span<const double> q) {
    bool hit = false;
    LwPair out{};
    check(lw_robot_collides(get(), q.data(), q.size(), &hit, &out));
    return hit ? std::optional(out) : std::nullopt;
  }
  std::optional<LwClosest> clearance(Span<const double> q, double limit) {
    LwClosest out;
    check(lw_robot_clearance(get(), q.data(), q.size(), limit, &out));
    return out.found ? std::optional(out) : std::nullopt;
  }
  std::optional<LwClosest> distance(Span<const double> q, std::uint32_t a, std::uint32_t b) {
    LwClosest out;
    check(lw_robot_distance(get(), q.data(), q.size(), a, b, &out));
    return out.found ? std::optional(out) : std::nullopt;
  }
  // Returns all checked pairs within the limit; allocates.
  std::vector<LwClosest> distances(Span<const double> q, double limit) {
    return list<LwClosest>([&](LwClosest *p, std::size_t room, std::size_t *count) {
      return lw_robot_distances(get(), q.data(), q.size(), limit, p, room, count);
    });
  }
  // Returns all pairs that touch; allocates.
  std::vector<LwPair> hits(Span<const double> q) {
    return list<LwPair>([&](LwPair *p, std::size_t room, std::size_t *count) {
      return lw_robot_hits(get(), q.data(), q.size(), p, room, count);
    });
  }
  LwPath path_free(Span<const double> qa, Span<const double> qb, double least = 1e-3,
                   std::size_t pieces = SIZE_MAX) {
    if (qa.size() != qb.size())
      throw Error(LW_STATUS_LENGTH, "`qa` and `qb` differ in length\n  help: give nq numbers each");
    LwPath out;
    check(lw_robot_path_free(get(), qa.data(), qb.data(), qa.size(), least, pieces, &out));
    return out;
  }
  LwPath path_free_on(std::size_t pieces = SIZE_MAX) {
    LwPath out;
    check(lw_robot_path_free_on(get(), pieces, &out));
    return out;
  }
  // The argument `q` has rows of nq numbers, `out` one value for each row.
  void collides_all(Span<const double> q, Span<bool> out) {
    check(lw_robot_collides_all(get(), q.data(), q.size(), out.data(), out.size()));
  }
  void set_detail(std::uint32_t detail) { check(lw_robot_set_detail(get(), detail)); }
  void set_detail_of(std::uint32_t collider, std::uint32_t detail) {
    check(lw_robot_set_detail_of(get(), collider, detail));
  }
  bool looks_at(std::uint32_t a, std::uint32_t b) {
    bool out = false;
    check(lw_robot_looks_at(get(), a, b, &out));
    return out;
  }
  LwPose object_body_pose(std::uint32_t object, std::uint32_t body) {
    LwPose out;
    check(lw_robot_object_body_pose(get(), object, body, &out));
    return out;
  }
  /// Loop of both hands on an object.
  LwClosure closure(std::uint32_t object) {
    LwClosure out;
    check(lw_robot_closure(get(), object, &out));
    return out;
  }
  /// Loop of a hand that is welded to a body of an object; `free`: not 0 for joints of the object that may move.
  LwClosure closure(std::uint32_t hand, std::uint32_t object, std::uint32_t body, Span<const std::uint8_t> free) {
    LwClosure out;
    check(lw_robot_closure_onto(get(), hand, object, body, free.data(), free.size(), &out));
    return out;
  }
  void object_jacobian(std::uint32_t object, std::uint32_t body, Span<double> J) {
    check(lw_robot_object_jacobian(get(), object, body, J.data(), J.size()));
  }
  void mass_matrix_with_object(std::uint32_t object, Span<double> M) {
    check(lw_robot_mass_matrix_with_object(get(), object, M.data(), M.size()));
  }
  void object_q(std::uint32_t object, Span<double> q) {
    check(lw_robot_object_q(get(), object, q.data(), q.size()));
  }
  void set_object_q(std::uint32_t object, Span<const double> q) {
    check(lw_robot_set_object_q(get(), object, q.data(), q.size()));
  }
  void pad(std::uint32_t collider, double padding) { check(lw_robot_pad(get(), collider, padding)); }
  void pad_all(Span<const std::uint32_t> colliders, double padding) {
    check(lw_robot_pad_all(get(), colliders.data(), colliders.size(), padding));
  }
  void hide(std::uint32_t collider) { check(lw_robot_hide(get(), collider)); }
  void show(std::uint32_t collider) { check(lw_robot_show(get(), collider)); }
  /// x, y, z, radius of each point.
  void set_points(std::uint32_t cloud, Span<const std::array<double, 4>> points) {
    check(lw_robot_set_points(get(), cloud, points.empty() ? nullptr : points.front().data(), points.size()));
  }
  void set_cells(std::uint32_t map, Span<const std::array<std::uint32_t, 3>> cells) {
    check(lw_robot_set_cells(get(), map, cells.empty() ? nullptr : cells.front().data(), cells.size()));
  }
  void free_cells(std::uint32_t map, Span<const std::array<std::uint32_t, 3>> cells) {
    check(lw_robot_free_cells(get(), map, cells.empty() ? nullptr : cells.front().data(), cells.size()));
  }
  bool cell(std::uint32_t map, std::array<std::uint32_t, 3> cell) {
    bool out = false;
    check(lw_robot_cell(get(), map, cell.data(), &out));
    return out;
  }
  // Returns the number of points of a cloud, or of occupied cells of a map.
  std::size_t count(std::uint32_t collider) {
    std::size_t out = 0;
    check(lw_robot_count(get(), collider, &out));
    return out;
  }
  void clear_cells(std::uint32_t map) { check(lw_robot_clear_cells(get(), map)); }
  void look_at(std::uint32_t a, std::uint32_t b) { check(lw_robot_look_at(get(), a, b)); }
  void allow(std::uint32_t a, std::uint32_t b) { check(lw_robot_allow(get(), a, b)); }
  void by_rule(std::uint32_t a, std::uint32_t b) { check(lw_robot_by_rule(get(), a, b)); }

  LwRobot *get() const noexcept { return handle_.get(); }
  void check(LwStatus status) const { detail::check<LwRobot>(status, get(), lw_robot_message); }

 private:
  explicit Robot(LwRobot *owned) : handle_(owned) {}

  template <class T, class Call>
  std::vector<T> list(Call &&call) {
    std::vector<T> out;
    std::size_t count = 0;
    LwStatus status = call(nullptr, 0, &count);
    if (status == LW_STATUS_NO_ROOM) {
      out.resize(count);
      status = call(out.data(), out.size(), &count);
    }
    check(status);
    return out;
  }

  LwPose pose(LwStatus (*call)(LwRobot *, std::uint32_t, LwPose *), std::uint32_t id) {
    LwPose out;
    check(call(get(), id, &out));
    return out;
  }

  std::unique_ptr<LwRobot, detail::Freed<lw_robot_free>> handle_;
};

// Memory for calls with robots of one model, created once, for one thread at a time. Errors are reported by the robot.

// The operational space of tips: six rows for each tip, angular before linear.
class TaskSpace {
 public:
  TaskSpace(Robot &robot, Span<const std::uint32_t> parts) {
    LwTaskSpace *out = nullptr;
    robot.check(lw_task_space_new(robot.get(), parts.data(), parts.size(), &out));
    handle_.reset(out);
  }
  void compliance(Robot &robot, Span<double> out) {
    robot.check(lw_task_space_compliance(robot.get(), get(), out.data(), out.size()));
  }
  void inertia(Robot &robot, Span<double> out) {
    robot.check(lw_task_space_inertia(robot.get(), get(), out.data(), out.size()));
  }
  void forces(Robot &robot, Span<const double> v, Span<const double> a, Span<double> tau,
              Span<const double> rest = {}) {
    same(v, tau, rest);
    robot.check(lw_task_space_forces(robot.get(), get(), v.data(), v.size(), a.data(), a.size(),
                                     rest.empty() ? nullptr : rest.data(), tau.data()));
  }
  void impedance(Robot &robot, Span<const double> v, Span<const LwImpedance> springs, Span<double> tau,
                 Span<const double> rest = {}) {
    same(v, tau, rest);
    robot.check(lw_task_space_impedance(robot.get(), get(), v.data(), v.size(), springs.data(), springs.size(),
                                        rest.empty() ? nullptr : rest.data(), tau.data()));
  }
  LwTaskSpace *get() const noexcept { return handle_.get(); }

 private:
  static void same(Span<const double> v, Span<double> tau, Span<const double> rest) {
    if (v.size() != tau.size() || (!rest.empty() && rest.size() != v.size()))
      throw Error(LW_STATUS_LENGTH, "`v`, `tau` and `rest` differ in length\n  help: give nv numbers each");
  }

  std::unique_ptr<LwTaskSpace, detail::Freed<lw_task_space_free>> handle_;
};

// A goal of one of several tips: in the world (or in its base), or relative to the tip of another chain.
inline LwTipGoal tip_goal(std::uint32_t part, const LwGoal &goal, std::uint32_t seen_from = LW_NO_PART) {
  return {goal, part, seen_from};
}

// Inverse kinematics of several tips at once; objects in two hands stay in both hands.
class WholeBodyIk {
 public:
  WholeBodyIk(Robot &robot, std::size_t goals) {
    LwWholeBodyIk *out = nullptr;
    robot.check(lw_whole_body_ik_new(robot.get(), goals, &out));
    handle_.reset(out);
  }
  void keep(Robot &robot, std::uint32_t part) { robot.check(lw_whole_body_ik_keep(robot.get(), get(), part)); }
  void release(Robot &robot, std::uint32_t part) { robot.check(lw_whole_body_ik_release(robot.get(), get(), part)); }
  // The `residuals` are m and rad of each goal, or empty.
  LwAnswer solve(Robot &robot, Span<const LwTipGoal> goals, Span<double> q,
                 const LwEffort *effort = nullptr, Span<double> residuals = {}) {
    LwAnswer out;
    robot.check(lw_whole_body_ik_solve(robot.get(), get(), goals.data(), goals.size(), effort, q.data(), q.size(),
                                     residuals.data(), residuals.size(), &out));
    return out;
  }
  LwAnswer resume(Robot &robot, std::size_t kinematics, Span<double> q, Span<double> residuals = {}) {
    LwAnswer out;
    robot.check(lw_whole_body_ik_resume(robot.get(), get(), kinematics, q.data(), q.size(), residuals.data(),
                                     residuals.size(), &out));
    return out;
  }
  LwBest best(Robot &robot, Span<const LwTipGoal> goals, const LwPrefer &prefer, Span<double> q,
              const LwEffort *effort = nullptr) {
    LwBest out;
    robot.check(lw_whole_body_ik_best(robot.get(), get(), goals.data(), goals.size(), &prefer, effort, q.data(), q.size(),
                                    &out));
    return out;
  }
  std::size_t worst_case_steps(Robot &robot, Span<const LwTipGoal> goals, const LwEffort *effort = nullptr) {
    std::size_t out = 0;
    robot.check(lw_whole_body_ik_worst_case_steps(robot.get(), get(), goals.data(), goals.size(), effort, &out));
    return out;
  }
  LwWholeBodyIk *get() const noexcept { return handle_.get(); }

 private:
  std::unique_ptr<LwWholeBodyIk, detail::Freed<lw_whole_body_ik_free>> handle_;
};

// Rate control for tasks in order of priority, which avoids limits and singular configurations.
class RateControl {
 public:
  RateControl(Robot &robot, std::size_t objectives, std::size_t guards = 0) {
    LwRateControl *out = nullptr;
    robot.check(lw_rate_control_new(robot.get(), objectives, guards, &out));
    handle_.reset(out);
  }
  // The `residuals` have one number for each level, or are empty.
  void solve(Robot &robot, Span<const LwObjective> objectives, double horizon, Span<double> v,
             Span<const LwGuard> guards = {}, Span<double> residuals = {}) {
    robot.check(lw_rate_control_solve(robot.get(), get(), objectives.data(), objectives.size(), horizon, guards.data(),
                                      guards.size(), v.data(), v.size(), residuals.data(), residuals.size()));
  }
  LwRateControl *get() const noexcept { return handle_.get(); }

 private:
  std::unique_ptr<LwRateControl, detail::Freed<lw_rate_control_free>> handle_;
};

// Whole-body control for tasks in order of priority, with contacts that press and do not slip.
class WholeBody {
 public:
  WholeBody(Robot &robot, std::size_t touches, std::size_t objectives) {
    LwWholeBody *out = nullptr;
    robot.check(lw_whole_body_new(robot.get(), touches, objectives, &out));
    handle_.reset(out);
  }
  // The `forces` have three numbers for each contact point.
  LwBalanced solve(Robot &robot, Span<const double> v, Span<const double> effort,
                   Span<const LwTouch> touches, Span<const LwObjective> objectives, Span<double> tau,
                   Span<double> vdot, Span<double> forces) {
    if (v.size() != effort.size() || v.size() != tau.size() || v.size() != vdot.size())
      throw Error(LW_STATUS_LENGTH, "`v`, `effort`, `tau` and `vdot` differ in length\n  help: give nv numbers each");
    if (forces.size() != 3 * touches.size())
      throw Error(LW_STATUS_LENGTH, "`forces` does not fit\n  help: give three numbers for each touch");
    LwBalanced out;
    robot.check(lw_whole_body_solve(robot.get(), get(), v.data(), effort.data(), v.size(), touches.data(),
                                    touches.size(), objectives.data(), objectives.size(), tau.data(), vdot.data(),
                                    forces.data(), &out));
    return out;
  }
  LwWholeBody *get() const noexcept { return handle_.get(); }

 private:
  std::unique_ptr<LwWholeBody, detail::Freed<lw_whole_body_free>> handle_;
};

// State prediction for estimators: state and covariance after a step.
class Predictor {
 public:
  explicit Predictor(Robot &robot) {
    LwPredictor *out = nullptr;
    robot.check(lw_predictor_new(robot.get(), &out));
    handle_.reset(out);
  }
  void step(Robot &robot, Span<double> q, Span<double> v, Span<double> covariance,
            Span<const double> tau, Span<const double> density, double step) {
    if (v.size() != tau.size() || v.size() != density.size() || covariance.size() != 4 * v.size() * v.size())
      throw Error(LW_STATUS_LENGTH, "`v`, `covariance`, `tau` and `density` do not fit\n  help: give nv, (2 nv)^2, nv and nv numbers");
    robot.check(lw_predictor_step(robot.get(), get(), q.data(), q.size(), v.data(), v.size(), covariance.data(),
                                  tau.data(), density.data(), step));
  }
  void transition(Robot &robot, Span<double> F) {
    robot.check(lw_predictor_transition(robot.get(), get(), F.data(), F.size()));
  }
  LwPredictor *get() const noexcept { return handle_.get(); }

 private:
  std::unique_ptr<LwPredictor, detail::Freed<lw_predictor_free>> handle_;
};

// Path planning for a chain.
class Planner {
 public:
  Planner(Robot &robot, std::uint32_t part, std::size_t configurations) {
    LwPlanner *out = nullptr;
    robot.check(lw_planner_new(robot.get(), part, configurations, &out));
    handle_.reset(out);
  }
  LwPlan plan(Robot &robot, Span<const double> start, Span<const double> goal,
             const std::optional<LwSearch> &search = std::nullopt, std::size_t places = SIZE_MAX) {
    if (start.size() != goal.size())
      throw Error(LW_STATUS_LENGTH, "`start` and `goal` differ in length\n  help: give nq numbers each");
    LwPlan out;
    robot.check(lw_planner_plan(robot.get(), get(), start.data(), goal.data(), start.size(),
                                search ? &*search : nullptr, places, &out));
    return out;
  }
  LwPlan resume(Robot &robot, std::size_t places = SIZE_MAX) {
    LwPlan out;
    robot.check(lw_planner_resume(robot.get(), get(), places, &out));
    return out;
  }
  // The `path` has nq numbers for each configuration.
  void path(Robot &robot, Span<double> path) {
    robot.check(lw_planner_path(robot.get(), get(), path.data(), path.size()));
  }
  LwPlanner *get() const noexcept { return handle_.get(); }

 private:
  std::unique_ptr<LwPlanner, detail::Freed<lw_planner_free>> handle_;
};

// Time parameterization of paths.
class Timing {
 public:
  Timing(Robot &robot, std::size_t configurations, std::size_t sections) {
    LwTiming *out = nullptr;
    robot.check(lw_timing_new(robot.get(), configurations, sections, &out));
    handle_.reset(out);
  }
  LwTimed plan(Robot &robot, Span<const double> path, const std::optional<LwMotionLimits> &limits = std::nullopt,
               double round = 0) {
    LwTimed out;
    robot.check(
        lw_timing_plan(robot.get(), get(), path.data(), path.size(), limits ? &*limits : nullptr, round, &out));
    return out;
  }
  void at(Robot &robot, double time, Span<double> q, Span<double> v, Span<double> vdot) {
    if (v.size() != vdot.size())
      throw Error(LW_STATUS_LENGTH, "`v` and `vdot` differ in length\n  help: give nv numbers each");
    robot.check(lw_timing_at(robot.get(), get(), time, q.data(), q.size(), v.data(), vdot.data(), v.size()));
  }
  void place(Robot &robot, double part, Span<double> q) {
    robot.check(lw_timing_place(robot.get(), get(), part, q.data(), q.size()));
  }
  LwPath path_free(Robot &robot, double least = 1e-3) {
    LwPath out;
    robot.check(lw_timing_path_free(robot.get(), get(), least, &out));
    return out;
  }
  LwTiming *get() const noexcept { return handle_.get(); }

 private:
  std::unique_ptr<LwTiming, detail::Freed<lw_timing_free>> handle_;
};

// Jerk-limited motions between any two states.
class Transfer {
 public:
  explicit Transfer(Robot &robot) {
    LwTransfer *out = nullptr;
    robot.check(lw_transfer_new(robot.get(), &out));
    handle_.reset(out);
  }
  LwTransferred plan(Robot &robot, const LwMotionState &from, const LwMotionState &to, const LwMotionLimits &limits) {
    LwTransferred out;
    robot.check(lw_transfer_plan(robot.get(), get(), &from, &to, &limits, &out));
    return out;
  }
  void at(Robot &robot, double time, Span<double> q, Span<double> v, Span<double> vdot) {
    if (v.size() != vdot.size())
      throw Error(LW_STATUS_LENGTH, "`v` and `vdot` differ in length\n  help: give nv numbers each");
    robot.check(lw_transfer_at(robot.get(), get(), time, q.data(), q.size(), v.data(), vdot.data(), v.size()));
  }
  LwTransfer *get() const noexcept { return handle_.get(); }

 private:
  std::unique_ptr<LwTransfer, detail::Freed<lw_transfer_free>> handle_;
};

// Prioritized least squares: unknowns x with bounds c x <= most, and levels A x = b. A level never degrades the levels before it.
class Priorities {
 public:
  Priorities(std::size_t n, std::size_t rows, std::size_t bounds) : n_(n) {
    LwPriorities *out = nullptr;
    detail::check<LwPriorities>(lw_priorities_new(n, rows, bounds, &out), nullptr, lw_priorities_message);
    handle_.reset(out);
  }
  void begin() { check(lw_priorities_begin(get())); }
  void bound(Span<const double> c, double most) {
    check(lw_priorities_bound(get(), c.data(), c.size(), most));
  }
  // |A x - b|, and the number of directions of x that remain.
  std::pair<double, std::size_t> level(Span<const double> A, Span<const double> b) {
    if (A.size() != n_ * b.size())
      throw Error(LW_STATUS_LENGTH, "`A` and `b` do not fit\n  help: give a row of unknowns for each number of `b`");
    std::pair<double, std::size_t> out;
    check(lw_priorities_level(get(), A.data(), b.data(), b.size(), &out.first, &out.second));
    return out;
  }
  void x(Span<double> x) { check(lw_priorities_x(get(), x.data(), x.size())); }
  LwPriorities *get() const noexcept { return handle_.get(); }

 private:
  void check(LwStatus status) const { detail::check<LwPriorities>(status, get(), lw_priorities_message); }

  std::size_t n_;
  std::unique_ptr<LwPriorities, detail::Freed<lw_priorities_free>> handle_;
};

// Moves s to the minimum of s N s / 2 - r s between two limits; returns the number of iterations (sweeps, for more than 64 numbers).
inline std::size_t bounded(Span<const double> normal, Span<const double> right, double lower, double upper,
                           Span<double> s, std::size_t most = 200, double settled = 1e-12) {
  if (right.size() != s.size() || normal.size() != s.size() * s.size())
    throw Error(LW_STATUS_LENGTH, "`normal`, `right` and `s` do not fit\n  help: give n n, n and n numbers");
  std::size_t sweeps = 0;
  detail::check<LwRobot>(
      lw_bounded(normal.data(), right.data(), s.size(), lower, upper, most, settled, s.data(), &sweeps), nullptr,
      lw_robot_message);
  return sweeps;
}

}  // namespace linkwork

#endif  // LINKWORK_ROBOT_HPP
