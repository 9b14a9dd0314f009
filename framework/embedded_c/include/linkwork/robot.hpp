// The embedded robot model for C++20: handles that free themselves, exceptions instead of codes, spans instead of pointers
// with lengths. Everything is a call of robot.h, where each is described. Header only.
#ifndef LINKWORK_ROBOT_HPP
#define LINKWORK_ROBOT_HPP

#include <linkwork/robot.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace linkwork {

// A call that did nothing: its code, and as what() the handle's message.
class Error : public std::runtime_error {
 public:
  Error(LwStatus status, const std::string &text) : std::runtime_error(text), status_(status) {}
  LwStatus status() const noexcept { return status_; }

 private:
  LwStatus status_;
};

namespace detail {

// A text of the library, whose call tells first how long it is. Between the two calls another thread may lengthen
// the message of a shared model: then it is asked again.
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
  // The message of a handle in use elsewhere, or of none, is not of this call.
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

// A goal of position alone, m, in the world.
inline LwGoal position_goal(std::array<double, 3> p) {
  return {{{p[0], p[1], p[2]}, {0, 0, 0, 1}}, {1, 1}, LW_GOAL_POSITION};
}

// A goal of position and orientation in the world.
inline LwGoal pose_goal(const LwPose &pose) { return {pose, {1, 1}, LW_GOAL_POSITION | LW_GOAL_ORIENTATION}; }

// The default effort of inverse kinematics.
inline LwEffort default_effort() {
  LwEffort out;
  lw_effort_default(&out);
  return out;
}

// What never changes about a robot. Threads may share one.
class Model {
 public:
  explicit Model(LwModel *owned) : handle_(owned) {}

  // The same model by another handle, with a message of its own.
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

  std::string collider_name(std::uint32_t id) const {
    return words([&](char *b, std::size_t n, std::size_t *w) { return lw_model_collider_name(get(), id, b, n, w); });
  }

  // What the files say and the model does not use, one line each.
  std::string unused() const {
    return words([&](char *b, std::size_t n, std::size_t *w) { return lw_model_unused(get(), b, n, w); });
  }

  // Places of a joint in q and among the degrees of freedom.
  std::pair<std::size_t, std::size_t> joint(const std::string &name) const {
    std::pair<std::size_t, std::size_t> out;
    check(lw_model_joint(get(), name.c_str(), &out.first, &out.second));
    return out;
  }

  // Places of a chain's degrees of freedom: the columns of its Jacobian.
  std::vector<std::size_t> dofs(std::uint32_t part) const {
    std::size_t count = 0;
    check(lw_model_part_size(get(), part, &count));
    std::vector<std::size_t> out(count);
    check(lw_model_part_dofs(get(), part, out.data(), out.size()));
    return out;
  }

  // Lower and upper limits of all degrees of freedom.
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

// What a model is made of, while it is put together.
class Builder {
 public:
  Builder() {
    LwBuilder *out = nullptr;
    detail::check<LwBuilder>(lw_builder_new(&out), nullptr, lw_builder_message);
    handle_.reset(out);
  }

  Builder &packages(const std::string &folder) { return check(lw_builder_packages(get(), folder.c_str())); }
  Builder &robot_file(const std::string &path, std::uint32_t root = LW_ROOT_AS_WRITTEN,
                      std::uint32_t inertia = LW_INERTIA_PHYSICAL) {
    return check(lw_builder_robot_file(get(), path.c_str(), root, inertia));
  }
  Builder &robot_text(const std::string &xml, std::uint32_t root = LW_ROOT_AS_WRITTEN,
                      std::uint32_t inertia = LW_INERTIA_PHYSICAL) {
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
  Builder &object_body(const std::string &name, const std::string &parent, std::uint32_t hinge,
                       std::array<double, 3> axis, double mass, std::array<double, 3> center,
                       std::array<double, 9> inertia, const std::optional<LwPose> &at = std::nullopt) {
    return check(lw_builder_object_body(get(), name.c_str(), parent.c_str(), hinge, axis.data(), at ? &*at : nullptr,
                                        mass, center.data(), inertia.data()));
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
  Builder &check(LwStatus status) {
    detail::check<LwBuilder>(status, get(), lw_builder_message);
    return *this;
  }

  std::unique_ptr<LwBuilder, detail::Freed<lw_builder_free>> handle_;
};

// One instance of a model, for one thread at a time. After the constructor no call allocates (but clone, clearance and exceptions).
class Robot {
 public:
  explicit Robot(const Model &model) {
    LwRobot *out = nullptr;
    model.check(lw_robot_new(model.get(), &out));
    handle_.reset(out);
  }

  // A robot of its own with the same configuration, held objects and settings.
  Robot clone() const {
    LwRobot *out = nullptr;
    check(lw_robot_clone(get(), &out));
    return Robot(out);
  }

  void q(std::span<double> out) const { check(lw_robot_q(get(), out.data(), out.size())); }
  void set_q(std::span<const double> q) { check(lw_robot_set_q(get(), q.data(), q.size())); }
  void clamp(std::span<double> q) const { check(lw_robot_clamp(get(), q.data(), q.size())); }
  void set_gravity(std::array<double, 3> g) { check(lw_robot_set_gravity(get(), g.data())); }

  LwPose tip_pose(std::uint32_t part) { return pose(lw_robot_tip_pose, part); }
  LwPose body_pose(std::uint32_t body) { return pose(lw_robot_body_pose, body); }
  LwPose object_pose(std::uint32_t object) { return pose(lw_robot_object_pose, object); }
  void jacobian(std::uint32_t part, std::span<double> J) { check(lw_robot_jacobian(get(), part, J.data(), J.size())); }
  void whole_jacobian(std::uint32_t part, std::span<double> J) {
    check(lw_robot_whole_jacobian(get(), part, J.data(), J.size()));
  }

  LwAnswer reach(std::uint32_t part, const LwGoal &goal, std::span<double> q,
                 const std::optional<LwEffort> &effort = std::nullopt) {
    LwAnswer out;
    check(lw_robot_reach(get(), part, &goal, effort ? &*effort : nullptr, q.data(), q.size(), &out));
    return out;
  }
  // Configurations one after the other, q.size() numbers each; held: -1, or the place in β of the hinge that stays as it is.
  std::vector<double> reach_all(std::uint32_t part, const LwGoal &goal, std::span<const double> q, std::int64_t held = -1) {
    constexpr std::size_t most = 8;
    std::vector<double> out(most * q.size());
    std::size_t count = 0;
    check(lw_robot_reach_all(get(), part, held, &goal, q.data(), q.size(), out.data(), most, &count));
    out.resize(count * q.size());
    return out;
  }
  LwAnswer reach_on(std::uint32_t part, std::size_t kinematics, std::span<double> q) {
    LwAnswer out;
    check(lw_robot_reach_on(get(), part, kinematics, q.data(), q.size(), &out));
    return out;
  }

  void feed_forward(std::span<const double> v, std::span<const double> vdot, std::span<double> tau,
                    std::span<const LwPush> pushes = {}) {
    if (v.size() != vdot.size() || v.size() != tau.size())
      throw Error(LW_STATUS_LENGTH, "`v`, `vdot` and `tau` differ in length\n  help: give nv numbers each");
    check(lw_robot_feed_forward(get(), v.data(), vdot.data(), v.size(), pushes.data(), pushes.size(), tau.data()));
  }
  // While the joints of a held object move: `rates`, `accelerations`, `forces` have a number for each of them.
  void feed_forward_with(std::span<const double> v, std::span<const double> vdot, std::uint32_t object,
                         std::span<const double> rates, std::span<const double> accelerations, std::span<double> tau,
                         std::span<double> forces, std::span<const LwPush> pushes = {}) {
    if (v.size() != vdot.size() || v.size() != tau.size())
      throw Error(LW_STATUS_LENGTH, "`v`, `vdot` and `tau` differ in length\n  help: give nv numbers each");
    if (rates.size() != accelerations.size() || rates.size() != forces.size())
      throw Error(LW_STATUS_LENGTH, "`rates`, `accelerations` and `forces` differ in length\n  help: give a number for each joint");
    check(lw_robot_feed_forward_with(get(), v.data(), vdot.data(), v.size(), object, rates.data(), accelerations.data(),
                                     rates.size(), pushes.data(), pushes.size(), tau.data(), forces.data()));
  }
  void held_still(std::span<double> tau, std::span<const LwPush> pushes = {}) {
    check(lw_robot_held_still(get(), pushes.data(), pushes.size(), tau.data(), tau.size()));
  }
  void mass_matrix(std::span<double> M) { check(lw_robot_mass_matrix(get(), M.data(), M.size())); }
  // kg, and the centre in the world, m.
  std::pair<double, std::array<double, 3>> center_of_mass() {
    std::pair<double, std::array<double, 3>> out;
    check(lw_robot_center_of_mass(get(), &out.first, out.second.data()));
    return out;
  }

  void put(std::uint32_t object, const LwPose &at) { check(lw_robot_put(get(), object, &at)); }
  // Where the object is now, unless a pose in the tip's frame is given.
  void grasp(std::uint32_t hand, std::uint32_t object, const std::optional<LwPose> &at = std::nullopt) {
    check(lw_robot_grasp(get(), hand, object, at ? &*at : nullptr));
  }
  void update_grasp(std::uint32_t hand, std::uint32_t object, const LwPose &at) {
    check(lw_robot_update_grasp(get(), hand, object, &at));
  }
  void release(std::uint32_t hand, std::uint32_t object) { check(lw_robot_release(get(), hand, object)); }
  void ungrasp(std::uint32_t object) { check(lw_robot_ungrasp(get(), object)); }

  bool collides(std::span<const double> q) {
    bool out = false;
    check(lw_robot_collides(get(), q.data(), q.size(), &out, nullptr));
    return out;
  }
  std::optional<LwPair> first_hit(std::span<const double> q) {
    bool hit = false;
    LwPair out{};
    check(lw_robot_collides(get(), q.data(), q.size(), &hit, &out));
    return hit ? std::optional(out) : std::nullopt;
  }
  std::optional<LwClosest> clearance(std::span<const double> q, double limit) {
    LwClosest out;
    check(lw_robot_clearance(get(), q.data(), q.size(), limit, &out));
    return out.found ? std::optional(out) : std::nullopt;
  }
  void object_q(std::uint32_t object, std::span<double> q) {
    check(lw_robot_object_q(get(), object, q.data(), q.size()));
  }
  void set_object_q(std::uint32_t object, std::span<const double> q) {
    check(lw_robot_set_object_q(get(), object, q.data(), q.size()));
  }
  void pad(std::uint32_t collider, double padding) { check(lw_robot_pad(get(), collider, padding)); }
  void hide(std::uint32_t collider) { check(lw_robot_hide(get(), collider)); }
  void show(std::uint32_t collider) { check(lw_robot_show(get(), collider)); }
  /// Each x, y, z, radius.
  void set_points(std::uint32_t cloud, std::span<const std::array<double, 4>> points) {
    check(lw_robot_set_points(get(), cloud, points.empty() ? nullptr : points.front().data(), points.size()));
  }
  void set_cells(std::uint32_t map, std::span<const std::array<std::uint32_t, 3>> cells) {
    check(lw_robot_set_cells(get(), map, cells.empty() ? nullptr : cells.front().data(), cells.size()));
  }
  void free_cells(std::uint32_t map, std::span<const std::array<std::uint32_t, 3>> cells) {
    check(lw_robot_free_cells(get(), map, cells.empty() ? nullptr : cells.front().data(), cells.size()));
  }
  void clear_cells(std::uint32_t map) { check(lw_robot_clear_cells(get(), map)); }
  void look_at(std::uint32_t a, std::uint32_t b) { check(lw_robot_look_at(get(), a, b)); }
  void allow(std::uint32_t a, std::uint32_t b) { check(lw_robot_allow(get(), a, b)); }
  void by_rule(std::uint32_t a, std::uint32_t b) { check(lw_robot_by_rule(get(), a, b)); }

  LwRobot *get() const noexcept { return handle_.get(); }

 private:
  explicit Robot(LwRobot *owned) : handle_(owned) {}
  void check(LwStatus status) const { detail::check<LwRobot>(status, get(), lw_robot_message); }

  LwPose pose(LwStatus (*call)(LwRobot *, std::uint32_t, LwPose *), std::uint32_t id) {
    LwPose out;
    check(call(get(), id, &out));
    return out;
  }

  std::unique_ptr<LwRobot, detail::Freed<lw_robot_free>> handle_;
};

}  // namespace linkwork

#endif  // LINKWORK_ROBOT_HPP
