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
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>
#if __cplusplus >= 202002L
#include <span>
#else
#include <iterator>
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

inline void copy(std::array<double, 3> from, double (&to)[3]) {
  for (std::size_t i = 0; i < 3; ++i) to[i] = from[i];
}

inline void require(bool met, const char *text) {
  if (!met) throw Error(LW_STATUS_LENGTH, text);
}

// The arguments of a function of robot.h for an argument of C++: a text, an array or a structure is a pointer, a span is a pointer and a length, an
// empty optional is NULL. Numbers and pointers remain what they are.
template <class T>
auto pass(const T &x) {
  if constexpr (std::is_class_v<T>) {
    return std::tuple(&x);
  } else {
    return std::tuple(x);
  }
}
inline auto pass(const std::string &x) { return std::tuple(x.c_str()); }
template <class T, std::size_t N>
auto pass(const std::array<T, N> &x) {
  return std::tuple(x.data());
}
template <class T>
auto pass(const std::optional<T> &x) {
  return std::tuple(x ? &*x : nullptr);
}
template <class T>
auto pass(const Span<T> &x) {
  return std::tuple(x.data(), x.size());
}
template <class T, std::size_t N>
auto pass(const Span<const std::array<T, N>> &x) {
  return std::tuple(x.empty() ? nullptr : x.front().data(), x.size());
}

// The pointer to which a function of robot.h writes a result.
template <class T>
T *result(T &x) {
  return &x;
}
template <class T, std::size_t N>
T *result(std::array<T, N> &x) {
  return x.data();
}

// Calls a function of robot.h.
template <class Function, class... Arguments>
LwStatus call(Function function, const Arguments &...arguments) {
  return std::apply(function, std::tuple_cat(pass(arguments)...));
}

// Calls a function without a handle and returns its result, the last argument in C.
template <class Result, class Function, class... Arguments>
Result ask(Function function, const Arguments &...arguments) {
  Result out{};
  check<LwRobot>(call(function, arguments..., result(out)), nullptr, lw_robot_message);
  return out;
}

template <auto Free>
struct Freed {
  template <class Handle>
  void operator()(Handle *handle) const noexcept {
    Free(handle);
  }
};

// Owns a handle with a message. `call` throws errors; `ask` also returns the result, the last argument in C.
template <class Handle, auto Free, auto Message>
class Owner {
 public:
  Handle *get() const noexcept { return handle_.get(); }

 protected:
  explicit Owner(Handle *owned) : handle_(owned) {}

  void check(LwStatus status) const { detail::check<Handle>(status, get(), Message); }
  template <class Function, class... Arguments>
  void call(Function function, const Arguments &...arguments) const {
    check(detail::call(function, get(), arguments...));
  }
  template <class Result, class Function, class... Arguments>
  Result ask(Function function, const Arguments &...arguments) const {
    Result out{};
    call(function, arguments..., result(out));
    return out;
  }

 private:
  std::unique_ptr<Handle, Freed<Free>> handle_;
};

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
  double *first = points.empty() ? nullptr : points.front().data();
  hull.resize(detail::ask<std::size_t>(lw_support_polygon, first, points.size(), hull.front().data(), hull.size()));
  return hull;
}
// Returns the distance of a point from the nearest edge of such a polygon, m; negative outside.
inline double support_margin(Span<const std::array<double, 2>> hull, std::array<double, 2> p) {
  return detail::ask<double>(lw_support_margin, hull, p);
}

// State of a robot: configuration and motion, at rest if no rates are given. The arrays are not copied: they must exist during the call.
inline LwMotionState motion_state(Span<const double> q, Span<const double> v = {},
                                  Span<const double> vdot = {}) {
  detail::require(v.empty() || vdot.empty() || v.size() == vdot.size(),
                  "`v` and `vdot` differ in length\n  help: give nv numbers each");
  return {q.data(), q.size(), v.empty() ? nullptr : v.data(), vdot.empty() ? nullptr : vdot.data(),
          v.empty() ? vdot.size() : v.size()};
}

// Returns the default effort of inverse kinematics.
inline LwEffort default_effort() {
  return detail::ask<LwEffort>(lw_effort_default);
}

// Returns an upper bound for the kinematics evaluations of inverse kinematics of one chain with such a goal.
inline std::size_t worst_case_steps(const LwGoal &goal, const LwEffort *effort = nullptr) {
  return detail::ask<std::size_t>(lw_effort_worst_case_steps, effort, goal);
}

// Constant data of a robot. Threads may share one.
class Model : public detail::Owner<LwModel, lw_model_free, lw_model_message> {
 public:
  explicit Model(LwModel *owned) : Owner(owned) {}

  // Returns another handle of the same model, with its own message.
  Model clone() const { return Model(ask<LwModel *>(lw_model_clone)); }

  std::size_t nq() const { return pair(lw_model_sizes).first; }
  std::size_t nv() const { return pair(lw_model_sizes).second; }

  std::uint32_t part(const std::string &name) const { return ask<std::uint32_t>(lw_model_part, name); }
  std::uint32_t object(const std::string &name) const { return ask<std::uint32_t>(lw_model_object, name); }
  std::uint32_t body(const std::string &name) const { return ask<std::uint32_t>(lw_model_body, name); }
  std::uint32_t collider(const std::string &name) const { return ask<std::uint32_t>(lw_model_collider, name); }

  // Returns the numbers of coordinates and degrees of freedom of an object's joints.
  std::pair<std::size_t, std::size_t> object_sizes(std::uint32_t object) const {
    return pair(lw_model_object_sizes, object);
  }
  std::uint32_t object_body(std::uint32_t object, const std::string &name) const {
    return ask<std::uint32_t>(lw_model_object_body, object, name);
  }

  std::string collider_name(std::uint32_t id) const { return words(lw_model_collider_name, id); }

  // Returns the content of the files that the model does not use, one line each.
  std::string unused() const { return words(lw_model_unused); }
  // Returns warnings about mass properties of the file that no rigid body can have but that were read all the same.
  std::string doubtful() const { return words(lw_model_doubtful); }

  // Indices of a hinge's coordinates and degrees of freedom.
  struct Hinge {
    std::size_t in_q, q_count, in_v, v_count;
  };
  Hinge hinge(std::uint32_t body) const {
    Hinge h{};
    call(lw_model_hinge, body, &h.in_q, &h.q_count, &h.in_v, &h.v_count);
    return h;
  }
  Hinge object_hinge(std::uint32_t object, std::uint32_t body) const {
    Hinge h{};
    call(lw_model_object_hinge, object, body, &h.in_q, &h.q_count, &h.in_v, &h.v_count);
    return h;
  }

  // Returns the indices of a joint in q and among the degrees of freedom.
  std::pair<std::size_t, std::size_t> joint(const std::string &name) const { return pair(lw_model_joint, name); }

  // Returns the indices of a chain's degrees of freedom, which are the columns of its Jacobian.
  std::vector<std::size_t> dofs(std::uint32_t part) const {
    std::vector<std::size_t> out(ask<std::size_t>(lw_model_part_size, part));
    call(lw_model_part_dofs, part, Span<std::size_t>(out));
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
    call(lw_model_limits, out.first.data(), Span<double>(out.second));
    return out;
  }

  using Owner::check;

 private:
  template <class Function, class... Arguments>
  std::pair<std::size_t, std::size_t> pair(Function function, const Arguments &...arguments) const {
    std::pair<std::size_t, std::size_t> out;
    call(function, arguments..., &out.first, &out.second);
    return out;
  }

  template <class Function>
  std::vector<std::uint32_t> colliders(Function function, std::uint32_t of) const {
    std::size_t count = 0;
    const LwStatus status = function(get(), of, nullptr, 0, &count);
    if (status != LW_STATUS_NO_ROOM) check(status);
    std::vector<std::uint32_t> out(count);
    call(function, of, Span<std::uint32_t>(out), &count);
    return out;
  }

  template <class Function, class... Arguments>
  std::string words(Function function, Arguments... arguments) const {
    LwStatus status;
    const auto read = [&](char *b, std::size_t n, std::size_t *w) { return function(get(), arguments..., b, n, w); };
    auto out = detail::text(read, status);
    check(status);
    return out;
  }
};

// A model under construction.
class Builder : public detail::Owner<LwBuilder, lw_builder_free, lw_builder_message> {
  using At = std::optional<LwPose>;
  using Name = std::string;
  using Cells = std::array<std::uint32_t, 3>;
  using Points = Span<const std::array<double, 3>>;
  using Triangles = Span<const std::array<std::uint32_t, 3>>;
  using Center = std::array<double, 3>;
  using Inertia = std::array<double, 9>;

 public:
  Builder() : Owner(detail::ask<LwBuilder *>(lw_builder_new)) {}

  Builder &packages(const Name &folder) { return add(lw_builder_packages, folder); }
  Builder &keep_closures() { return add(lw_builder_keep_closures); }
  Builder &robot_file(const Name &path, std::uint32_t root = LW_ROOT_AS_WRITTEN,
                      std::uint32_t inertia = LW_INERTIA_WARN) {
    return add(lw_builder_robot_file, path, root, inertia);
  }
  Builder &robot_text(const Name &xml, std::uint32_t root = LW_ROOT_AS_WRITTEN,
                      std::uint32_t inertia = LW_INERTIA_WARN) {
    return add(lw_builder_robot_text, xml, root, inertia);
  }
  Builder &groups_file(const Name &path) { return add(lw_builder_groups_file, path); }
  Builder &groups_text(const Name &xml) { return add(lw_builder_groups_text, xml); }
  Builder &file_shapes() { return add(lw_builder_file_shapes); }
  Builder &chain(const Name &name, const Name &base, const Name &tip) { return add(lw_builder_chain, name, base, tip); }
  Builder &object(const Name &name, double mass, Center center, Inertia inertia) {
    return add(lw_builder_object, name, mass, center, inertia);
  }
  Builder &body(const Name &name, const Name &parent, const LwHinge &hinge, double mass, Center center,
                Inertia inertia, const At &at = std::nullopt) {
    return add(lw_builder_body, name, parent, hinge, at, mass, center, inertia);
  }
  Builder &object_body(const Name &name, const Name &parent, const LwHinge &hinge, double mass, Center center,
                       Inertia inertia, const At &at = std::nullopt) {
    return add(lw_builder_object_body, name, parent, hinge, at, mass, center, inertia);
  }
  // An infinite limit means that the hinge has no limit.
  Builder &limits(const Name &body, double lower, double upper, double rate = std::numeric_limits<double>::infinity(),
                  double effort = std::numeric_limits<double>::infinity()) {
    return add(lw_builder_limits, body, lower, upper, rate, effort);
  }
  Builder &shape(const Name &name, const Name &carrier, const LwShape &shape, const At &at = std::nullopt) {
    return add(lw_builder_shape, name, carrier, at, shape);
  }
  Builder &point_cloud(const Name &name, const Name &carrier, std::size_t room, const At &at = std::nullopt) {
    return add(lw_builder_point_cloud, name, carrier, at, room);
  }
  Builder &voxel_map(const Name &name, const Name &carrier, Cells cells, double edge, const At &at = std::nullopt) {
    return add(lw_builder_voxel_map, name, carrier, at, cells, edge);
  }
  Builder &hull(const Name &name, const Name &carrier, Points points, const At &at = std::nullopt) {
    return add(lw_builder_hull, name, carrier, at, points);
  }
  Builder &mesh(const Name &name, const Name &carrier, Points vertices, Triangles triangles,
                const At &at = std::nullopt) {
    return add(lw_builder_mesh, name, carrier, at, vertices, triangles);
  }
  Builder &height_field(const Name &name, const Name &carrier, std::size_t x, std::size_t y,
                        std::array<double, 2> spacing, Span<const double> heights, const At &at = std::nullopt) {
    return add(lw_builder_height_field, name, carrier, at, x, y, spacing, heights);
  }
  // Adds a coarse shape to a collider that was added before.
  Builder &coarse(const Name &name, const LwShape &shape) { return add(lw_builder_coarse, name, shape); }
  Builder &coarse_hull(const Name &name, Points points) { return add(lw_builder_coarse_hull, name, points); }
  Builder &coarse_mesh(const Name &name, Points vertices, Triangles triangles) {
    return add(lw_builder_coarse_mesh, name, vertices, triangles);
  }
  Builder &coarse_voxel_map(const Name &name, Cells cells, double edge, Span<const Cells> occupied) {
    return add(lw_builder_coarse_voxel_map, name, cells, edge, occupied);
  }
  Builder &collide(const Name &a, const Name &b) { return add(lw_builder_collide, a, b); }
  // Excludes all pairs of these bodies from collision checks.
  Builder &apart(Span<const std::string> bodies) {
    std::vector<const char *> names;
    for (const auto &name : bodies) names.push_back(name.c_str());
    return add(lw_builder_apart, names.data(), names.size());
  }
  Builder &neighbours(std::uint32_t neighbours) { return add(lw_builder_neighbours, neighbours); }
  Builder &ignore(const Name &a, const Name &b) { return add(lw_builder_ignore, a, b); }

  Model model() { return Model(ask<LwModel *>(lw_builder_model)); }

 private:
  template <class Function, class... Arguments>
  Builder &add(Function function, const Arguments &...arguments) {
    call(function, arguments...);
    return *this;
  }
};

// One instance of a model, for one thread at a time. After the constructor only clone, functions that return a vector, and exceptions allocate.
class Robot : public detail::Owner<LwRobot, lw_robot_free, lw_robot_message> {
  using Id = std::uint32_t;
  using In = Span<const double>;
  using Out = Span<double>;
  using At = std::optional<LwPose>;
  using Effort = std::optional<LwEffort>;
  using Wrenches = std::array<LwWrench, 2>;
  using Cells = Span<const std::array<std::uint32_t, 3>>;

 public:
  explicit Robot(const Model &model) : Owner(make(model)) {}

  // Returns an independent robot with the same configuration, held objects and settings.
  Robot clone() const { return Robot(ask<LwRobot *>(lw_robot_clone)); }

  void q(Out out) const { call(lw_robot_q, out); }
  void set_q(In q) { call(lw_robot_set_q, q); }
  void clamp(Out q) const { call(lw_robot_clamp, q); }
  void set_gravity(std::array<double, 3> g) { call(lw_robot_set_gravity, g); }

  LwPose tip_pose(Id part) { return ask<LwPose>(lw_robot_tip_pose, part); }
  LwPose base_pose(Id part) { return ask<LwPose>(lw_robot_base_pose, part); }
  LwPose body_pose(Id body) { return ask<LwPose>(lw_robot_body_pose, body); }
  LwPose object_pose(Id object) { return ask<LwPose>(lw_robot_object_pose, object); }
  void jacobian(Id part, Out J) { call(lw_robot_jacobian, part, J); }
  void whole_jacobian(Id part, Out J) { call(lw_robot_whole_jacobian, part, J); }

  // The `gradient` is over the chain's degrees of freedom, or empty.
  LwManipulability manipulability(Id part, std::uint32_t rows = LW_ROWS_ALL, double length = 1, Out gradient = {}) {
    LwManipulability out;
    call(lw_robot_manipulability, part, rows, length, &out, gradient);
    return out;
  }
  // Returns the residual, rad/s and m/s.
  std::array<double, 2> rates(Id part, std::array<double, 6> twist, Out v) {
    return ask<std::array<double, 2>>(lw_robot_rates, part, twist, v);
  }

  LwAnswer inverse_kinematics(Id part, const LwGoal &goal, Out q, const Effort &effort = std::nullopt) {
    return ask<LwAnswer>(lw_robot_inverse_kinematics, part, goal, effort, q);
  }
  // Returns configurations one after the other, q.size() numbers each; held: -1, or the index among the degrees of freedom of the hinge that keeps its value.
  std::vector<double> inverse_kinematics_all(Id part, const LwGoal &goal, In q, std::int64_t held = -1) {
    constexpr std::size_t most = 8;
    std::vector<double> out(most * q.size());
    const auto count = ask<std::size_t>(lw_robot_inverse_kinematics_all, part, held, goal, q, out.data(), most);
    out.resize(count * q.size());
    return out;
  }
  LwBest inverse_kinematics_best(Id part, const LwGoal &goal, const LwPrefer &prefer, Out q,
                                 const Effort &effort = std::nullopt) {
    return ask<LwBest>(lw_robot_inverse_kinematics_best, part, goal, prefer, effort, q);
  }
  LwAnswer resume_inverse_kinematics(Id part, std::size_t kinematics, Out q) {
    return ask<LwAnswer>(lw_robot_resume_inverse_kinematics, part, kinematics, q);
  }

  void feed_forward(In v, In vdot, Out tau, Span<const LwPush> pushes = {}) {
    detail::require(v.size() == vdot.size() && v.size() == tau.size(),
                    "`v`, `vdot` and `tau` differ in length\n  help: give nv numbers each");
    call(lw_robot_feed_forward, v.data(), vdot, pushes, tau.data());
  }
  // The joints of a held object move: `rates`, `accelerations` and `forces` have one number for each of their degrees of freedom.
  void feed_forward_with_object(In v, In vdot, Id object, In rates, In accelerations, Out tau, Out forces,
                                Span<const LwPush> pushes = {}) {
    detail::require(v.size() == vdot.size() && v.size() == tau.size(),
                    "`v`, `vdot` and `tau` differ in length\n  help: give nv numbers each");
    detail::require(rates.size() == accelerations.size() && rates.size() == forces.size(),
                    "`rates`, `accelerations` and `forces` differ in length\n  help: give a number for each joint");
    call(lw_robot_feed_forward_with_object, v.data(), vdot, object, rates.data(), accelerations, pushes, tau.data(),
         forces.data());
  }
  void held_still(Out tau, Span<const LwPush> pushes = {}) { call(lw_robot_held_still, pushes, tau); }
  // The `tips` have six numbers for each part.
  void bias(In v, Out tau, Span<const std::uint32_t> parts = {}, Out tips = {}) {
    detail::require(v.size() == tau.size() && tips.size() == 6 * parts.size(),
                    "`v` and `tau`, or `parts` and `tips`, do not fit\n  help: give nv numbers each, and six for each part");
    call(lw_robot_bias, v, parts, tau.data(), tips.data());
  }
  void mass_matrix(Out M) { call(lw_robot_mass_matrix, M); }
  // Returns the mass, kg, and its centre in the world, m.
  std::pair<double, std::array<double, 3>> center_of_mass() {
    std::pair<double, std::array<double, 3>> out;
    call(lw_robot_center_of_mass, &out.first, out.second.data());
    return out;
  }

  LwInertia composite_inertia(Id body) { return ask<LwInertia>(lw_robot_composite_inertia, body); }
  // Returns the momentum, angular, then linear, about the centre of mass.
  std::array<double, 6> momentum(In v) { return ask<std::array<double, 6>>(lw_robot_momentum, v); }
  void centroidal_matrix(Out A) { call(lw_robot_centroidal_matrix, A); }

  LwHold hold(Id object) { return ask<LwHold>(lw_robot_hold, object); }
  // Two hands on one object; wrenches are those of the first hand, then of the second hand.
  LwShared balance(Id object, std::uint32_t balance, Out tau) {
    return ask<LwShared>(lw_robot_balance, object, balance, tau);
  }
  Wrenches squeeze(Id object, double force, Out tau) { return ask<Wrenches>(lw_robot_squeeze, object, force, tau); }
  void add_hand_wrenches(Id object, const Wrenches &wrenches, Out tau) {
    call(lw_robot_add_hand_wrenches, object, wrenches, tau);
  }
  // The weights are for the first hand, the second hand, and 1 N m relative to 1 N.
  LwHandWrenches split_hand_wrenches(Id object, const Wrenches &wrenches, std::array<double, 3> weights) {
    return ask<LwHandWrenches>(lw_robot_split_hand_wrenches, object, wrenches, weights);
  }
  LwGripped grip(Id object, const Wrenches &wrenches, const std::array<LwFriction, 2> &friction) {
    return ask<LwGripped>(lw_robot_grip, object, wrenches, friction);
  }

  void put(Id object, const LwPose &at) { call(lw_robot_put, object, at); }
  // Grasps at the object's current pose, or at the given pose in the tip's frame.
  void grasp(Id hand, Id object, const At &at = std::nullopt) { call(lw_robot_grasp, hand, object, at); }
  void update_grasp(Id hand, Id object, const LwPose &at) { call(lw_robot_update_grasp, hand, object, at); }
  void release(Id hand, Id object) { call(lw_robot_release, hand, object); }
  void ungrasp(Id object) { call(lw_robot_ungrasp, object); }
  void attach(Id object, Id on, Id body = LW_ITSELF, const At &at = std::nullopt) {
    call(lw_robot_attach, object, on, body, at);
  }
  void detach(Id object) { call(lw_robot_detach, object); }

  bool collides(In q) {
    bool out = false;
    call(lw_robot_collides, q, &out, nullptr);
    return out;
  }
  std::optional<LwPair> first_hit(In q) {
    bool hit = false;
    LwPair out{};
    call(lw_robot_collides, q, &hit, &out);
    return hit ? std::optional(out) : std::nullopt;
  }
  std::optional<LwClosest> clearance(In q, double limit) { return found(ask<LwClosest>(lw_robot_clearance, q, limit)); }
  std::optional<LwClosest> distance(In q, Id a, Id b) { return found(ask<LwClosest>(lw_robot_distance, q, a, b)); }
  // Returns all checked pairs within the limit; allocates.
  std::vector<LwClosest> distances(In q, double limit) { return list<LwClosest>(lw_robot_distances, q, limit); }
  // Returns all pairs that touch; allocates.
  std::vector<LwPair> hits(In q) { return list<LwPair>(lw_robot_hits, q); }
  LwPath path_free(In qa, In qb, double least = 1e-3, std::size_t pieces = SIZE_MAX) {
    detail::require(qa.size() == qb.size(), "`qa` and `qb` differ in length\n  help: give nq numbers each");
    return ask<LwPath>(lw_robot_path_free, qa.data(), qb, least, pieces);
  }
  LwPath path_free_on(std::size_t pieces = SIZE_MAX) { return ask<LwPath>(lw_robot_path_free_on, pieces); }
  // The argument `q` has rows of nq numbers, `out` one value for each row.
  void collides_all(In q, Span<bool> out) { call(lw_robot_collides_all, q, out); }
  void set_detail(std::uint32_t detail) { call(lw_robot_set_detail, detail); }
  void set_detail_of(Id collider, std::uint32_t detail) { call(lw_robot_set_detail_of, collider, detail); }
  bool looks_at(Id a, Id b) { return ask<bool>(lw_robot_looks_at, a, b); }
  LwPose object_body_pose(Id object, Id body) { return ask<LwPose>(lw_robot_object_body_pose, object, body); }
  /// Loop of both hands on an object.
  LwClosure closure(Id object) { return ask<LwClosure>(lw_robot_closure, object); }
  /// Loop of a hand that is welded to a body of an object; `free`: not 0 for joints of the object that may move.
  LwClosure closure(Id hand, Id object, Id body, Span<const std::uint8_t> free) {
    return ask<LwClosure>(lw_robot_closure_onto, hand, object, body, free);
  }
  void object_jacobian(Id object, Id body, Out J) { call(lw_robot_object_jacobian, object, body, J); }
  void mass_matrix_with_object(Id object, Out M) { call(lw_robot_mass_matrix_with_object, object, M); }
  void object_q(Id object, Out q) { call(lw_robot_object_q, object, q); }
  void set_object_q(Id object, In q) { call(lw_robot_set_object_q, object, q); }
  void pad(Id collider, double padding) { call(lw_robot_pad, collider, padding); }
  void pad_all(Span<const std::uint32_t> colliders, double padding) { call(lw_robot_pad_all, colliders, padding); }
  void hide(Id collider) { call(lw_robot_hide, collider); }
  void show(Id collider) { call(lw_robot_show, collider); }
  /// x, y, z, radius of each point.
  void set_points(Id cloud, Span<const std::array<double, 4>> points) { call(lw_robot_set_points, cloud, points); }
  void set_cells(Id map, Cells cells) { call(lw_robot_set_cells, map, cells); }
  void free_cells(Id map, Cells cells) { call(lw_robot_free_cells, map, cells); }
  bool cell(Id map, std::array<std::uint32_t, 3> cell) { return ask<bool>(lw_robot_cell, map, cell); }
  // Returns the number of points of a cloud, or of occupied cells of a map.
  std::size_t count(Id collider) { return ask<std::size_t>(lw_robot_count, collider); }
  void clear_cells(Id map) { call(lw_robot_clear_cells, map); }
  void look_at(Id a, Id b) { call(lw_robot_look_at, a, b); }
  void allow(Id a, Id b) { call(lw_robot_allow, a, b); }
  void by_rule(Id a, Id b) { call(lw_robot_by_rule, a, b); }

  using Owner::check;

 private:
  explicit Robot(LwRobot *owned) : Owner(owned) {}

  static LwRobot *make(const Model &model) {
    LwRobot *out = nullptr;
    model.check(lw_robot_new(model.get(), &out));
    return out;
  }

  static std::optional<LwClosest> found(const LwClosest &out) { return out.found ? std::optional(out) : std::nullopt; }

  template <class T, class Function, class... Arguments>
  std::vector<T> list(Function function, const Arguments &...arguments) {
    std::vector<T> out;
    std::size_t count = 0;
    LwStatus status = detail::call(function, get(), arguments..., Span<T>(), &count);
    if (status == LW_STATUS_NO_ROOM) {
      out.resize(count);
      status = detail::call(function, get(), arguments..., Span<T>(out), &count);
    }
    check(status);
    return out;
  }
};

namespace detail {

// Memory for calls with robots of one model, created once, for one thread at a time. Errors are reported by the robot.
template <class Handle, auto Free>
class Tool {
 public:
  Handle *get() const noexcept { return handle_.get(); }

 protected:
  template <class Make, class... Arguments>
  Tool(Robot &robot, Make make, const Arguments &...arguments) {
    Handle *out = nullptr;
    robot.check(detail::call(make, robot.get(), arguments..., &out));
    handle_.reset(out);
  }

  template <class Function, class... Arguments>
  void call(Robot &robot, Function function, const Arguments &...arguments) {
    robot.check(detail::call(function, robot.get(), get(), arguments...));
  }
  template <class Result, class Function, class... Arguments>
  Result ask(Robot &robot, Function function, const Arguments &...arguments) {
    Result out{};
    call(robot, function, arguments..., &out);
    return out;
  }

 private:
  std::unique_ptr<Handle, Freed<Free>> handle_;
};

}  // namespace detail

// The operational space of tips: six rows for each tip, angular before linear.
class TaskSpace : public detail::Tool<LwTaskSpace, lw_task_space_free> {
 public:
  TaskSpace(Robot &robot, Span<const std::uint32_t> parts) : Tool(robot, lw_task_space_new, parts) {}
  void compliance(Robot &robot, Span<double> out) { call(robot, lw_task_space_compliance, out); }
  void inertia(Robot &robot, Span<double> out) { call(robot, lw_task_space_inertia, out); }
  void forces(Robot &robot, Span<const double> v, Span<const double> a, Span<double> tau,
              Span<const double> rest = {}) {
    same(v, tau, rest);
    call(robot, lw_task_space_forces, v, a, rest.empty() ? nullptr : rest.data(), tau.data());
  }
  void impedance(Robot &robot, Span<const double> v, Span<const LwImpedance> springs, Span<double> tau,
                 Span<const double> rest = {}) {
    same(v, tau, rest);
    call(robot, lw_task_space_impedance, v, springs, rest.empty() ? nullptr : rest.data(), tau.data());
  }

 private:
  static void same(Span<const double> v, Span<double> tau, Span<const double> rest) {
    detail::require(v.size() == tau.size() && (rest.empty() || rest.size() == v.size()),
                    "`v`, `tau` and `rest` differ in length\n  help: give nv numbers each");
  }
};

// A goal of one of several tips: in the world (or in its base), or relative to the tip of another chain.
inline LwTipGoal tip_goal(std::uint32_t part, const LwGoal &goal, std::uint32_t seen_from = LW_NO_PART) {
  return {goal, part, seen_from};
}

// Inverse kinematics of several tips at once; objects in two hands stay in both hands.
class WholeBodyIk : public detail::Tool<LwWholeBodyIk, lw_whole_body_ik_free> {
 public:
  WholeBodyIk(Robot &robot, std::size_t goals) : Tool(robot, lw_whole_body_ik_new, goals) {}
  void keep(Robot &robot, std::uint32_t part) { call(robot, lw_whole_body_ik_keep, part); }
  void release(Robot &robot, std::uint32_t part) { call(robot, lw_whole_body_ik_release, part); }
  // The `residuals` are m and rad of each goal, or empty.
  LwAnswer solve(Robot &robot, Span<const LwTipGoal> goals, Span<double> q, const LwEffort *effort = nullptr,
                 Span<double> residuals = {}) {
    return ask<LwAnswer>(robot, lw_whole_body_ik_solve, goals, effort, q, residuals);
  }
  LwAnswer resume(Robot &robot, std::size_t kinematics, Span<double> q, Span<double> residuals = {}) {
    return ask<LwAnswer>(robot, lw_whole_body_ik_resume, kinematics, q, residuals);
  }
  LwBest best(Robot &robot, Span<const LwTipGoal> goals, const LwPrefer &prefer, Span<double> q,
              const LwEffort *effort = nullptr) {
    return ask<LwBest>(robot, lw_whole_body_ik_best, goals, prefer, effort, q);
  }
  std::size_t worst_case_steps(Robot &robot, Span<const LwTipGoal> goals, const LwEffort *effort = nullptr) {
    return ask<std::size_t>(robot, lw_whole_body_ik_worst_case_steps, goals, effort);
  }
};

// Rate control for tasks in order of priority, which avoids limits and singular configurations.
class RateControl : public detail::Tool<LwRateControl, lw_rate_control_free> {
 public:
  RateControl(Robot &robot, std::size_t objectives, std::size_t guards = 0)
      : Tool(robot, lw_rate_control_new, objectives, guards) {}
  // The `residuals` have one number for each level, or are empty.
  void solve(Robot &robot, Span<const LwObjective> objectives, double horizon, Span<double> v,
             Span<const LwGuard> guards = {}, Span<double> residuals = {}) {
    call(robot, lw_rate_control_solve, objectives, horizon, guards, v, residuals);
  }
};

// Whole-body control for tasks in order of priority, with contacts that press and do not slip.
class WholeBody : public detail::Tool<LwWholeBody, lw_whole_body_free> {
 public:
  WholeBody(Robot &robot, std::size_t touches, std::size_t objectives)
      : Tool(robot, lw_whole_body_new, touches, objectives) {}
  // The `forces` have three numbers for each contact point.
  LwBalanced solve(Robot &robot, Span<const double> v, Span<const double> effort, Span<const LwTouch> touches,
                   Span<const LwObjective> objectives, Span<double> tau, Span<double> vdot, Span<double> forces) {
    detail::require(v.size() == effort.size() && v.size() == tau.size() && v.size() == vdot.size(),
                    "`v`, `effort`, `tau` and `vdot` differ in length\n  help: give nv numbers each");
    detail::require(forces.size() == 3 * touches.size(),
                    "`forces` does not fit\n  help: give three numbers for each touch");
    return ask<LwBalanced>(robot, lw_whole_body_solve, v.data(), effort, touches, objectives, tau.data(), vdot.data(),
                           forces.data());
  }
};

// State prediction for estimators: state and covariance after a step.
class Predictor : public detail::Tool<LwPredictor, lw_predictor_free> {
 public:
  explicit Predictor(Robot &robot) : Tool(robot, lw_predictor_new) {}
  void step(Robot &robot, Span<double> q, Span<double> v, Span<double> covariance, Span<const double> tau,
            Span<const double> density, double step) {
    const std::size_t nv = v.size();
    detail::require(nv == tau.size() && nv == density.size() && covariance.size() == 4 * nv * nv,
                    "`v`, `covariance`, `tau` and `density` do not fit\n  help: give nv, (2 nv)^2, nv and nv numbers");
    call(robot, lw_predictor_step, q, v, covariance.data(), tau.data(), density.data(), step);
  }
  void transition(Robot &robot, Span<double> F) { call(robot, lw_predictor_transition, F); }
};

// Path planning for a chain.
class Planner : public detail::Tool<LwPlanner, lw_planner_free> {
 public:
  Planner(Robot &robot, std::uint32_t part, std::size_t configurations)
      : Tool(robot, lw_planner_new, part, configurations) {}
  LwPlan plan(Robot &robot, Span<const double> start, Span<const double> goal,
              const std::optional<LwSearch> &search = std::nullopt, std::size_t places = SIZE_MAX) {
    detail::require(start.size() == goal.size(), "`start` and `goal` differ in length\n  help: give nq numbers each");
    return ask<LwPlan>(robot, lw_planner_plan, start.data(), goal, search, places);
  }
  LwPlan resume(Robot &robot, std::size_t places = SIZE_MAX) { return ask<LwPlan>(robot, lw_planner_resume, places); }
  // The `path` has nq numbers for each configuration.
  void path(Robot &robot, Span<double> path) { call(robot, lw_planner_path, path); }
};

// Time parameterization of paths.
class Timing : public detail::Tool<LwTiming, lw_timing_free> {
 public:
  Timing(Robot &robot, std::size_t configurations, std::size_t sections)
      : Tool(robot, lw_timing_new, configurations, sections) {}
  LwTimed plan(Robot &robot, Span<const double> path, const std::optional<LwMotionLimits> &limits = std::nullopt,
               double round = 0) {
    return ask<LwTimed>(robot, lw_timing_plan, path, limits, round);
  }
  void at(Robot &robot, double time, Span<double> q, Span<double> v, Span<double> vdot) {
    detail::require(v.size() == vdot.size(), "`v` and `vdot` differ in length\n  help: give nv numbers each");
    call(robot, lw_timing_at, time, q, v.data(), vdot);
  }
  void place(Robot &robot, double part, Span<double> q) { call(robot, lw_timing_place, part, q); }
  LwPath path_free(Robot &robot, double least = 1e-3) { return ask<LwPath>(robot, lw_timing_path_free, least); }
};

// Jerk-limited motions between any two states.
class Transfer : public detail::Tool<LwTransfer, lw_transfer_free> {
 public:
  explicit Transfer(Robot &robot) : Tool(robot, lw_transfer_new) {}
  LwTransferred plan(Robot &robot, const LwMotionState &from, const LwMotionState &to, const LwMotionLimits &limits) {
    return ask<LwTransferred>(robot, lw_transfer_plan, from, to, limits);
  }
  void at(Robot &robot, double time, Span<double> q, Span<double> v, Span<double> vdot) {
    detail::require(v.size() == vdot.size(), "`v` and `vdot` differ in length\n  help: give nv numbers each");
    call(robot, lw_transfer_at, time, q, v.data(), vdot);
  }
};

// Prioritized least squares: unknowns x with bounds c x <= most, and levels A x = b. A level never degrades the levels before it.
class Priorities : public detail::Owner<LwPriorities, lw_priorities_free, lw_priorities_message> {
 public:
  Priorities(std::size_t n, std::size_t rows, std::size_t bounds)
      : Owner(detail::ask<LwPriorities *>(lw_priorities_new, n, rows, bounds)), n_(n) {}
  void begin() { call(lw_priorities_begin); }
  void bound(Span<const double> c, double most) { call(lw_priorities_bound, c, most); }
  // |A x - b|, and the number of directions of x that remain.
  std::pair<double, std::size_t> level(Span<const double> A, Span<const double> b) {
    detail::require(A.size() == n_ * b.size(),
                    "`A` and `b` do not fit\n  help: give a row of unknowns for each number of `b`");
    std::pair<double, std::size_t> out;
    call(lw_priorities_level, A.data(), b, &out.first, &out.second);
    return out;
  }
  void x(Span<double> x) { call(lw_priorities_x, x); }

 private:
  std::size_t n_;
};

// Moves s to the minimum of s N s / 2 - r s between two limits; returns the number of iterations (sweeps, for more than 64 numbers).
inline std::size_t bounded(Span<const double> normal, Span<const double> right, double lower, double upper,
                           Span<double> s, std::size_t most = 200, double settled = 1e-12) {
  detail::require(right.size() == s.size() && normal.size() == s.size() * s.size(),
                  "`normal`, `right` and `s` do not fit\n  help: give n n, n and n numbers");
  return detail::ask<std::size_t>(lw_bounded, normal.data(), right, lower, upper, most, settled, s.data());
}

}  // namespace linkwork

#endif  // LINKWORK_ROBOT_HPP
