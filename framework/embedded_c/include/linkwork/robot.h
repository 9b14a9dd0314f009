/* The embedded robot model for C11: see README.md. Made of the Rust sources by cbindgen: a change here is lost. */

#ifndef LINKWORK_ROBOT_H
#define LINKWORK_ROBOT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// The roots of the file hang on the world as the format says (URDF: welded).
#define LW_ROOT_AS_WRITTEN 0

// The roots of the file are welded to the world.
#define LW_ROOT_FIXED 1

// The roots of the file move freely.
#define LW_ROOT_FREE 2

// The roots of the file move in the xy plane of the world.
#define LW_ROOT_PLANAR 3

// Inertias that no body has are refused.
#define LW_INERTIA_PHYSICAL 0

// Principal moments need only not be negative, for published data that break the triangle inequality.
#define LW_INERTIA_POSITIVE_MOMENTS 1

// A ball about the origin: `size` = radius, unused, unused.
#define LW_SHAPE_SPHERE 0

// A box about the origin: `size` = half of its edges along x, y, z.
#define LW_SHAPE_BOX 1

// All within a radius of a segment on the z axis: `size` = radius, half of the segment, unused.
#define LW_SHAPE_CAPSULE 2

// A cylinder about the z axis: `size` = radius, half of its length, unused.
#define LW_SHAPE_CYLINDER 3

// All points with z <= 0: `size` unused.
#define LW_SHAPE_HALF_SPACE 4

// The body does not move on its parent.
#define LW_HINGE_LOCKED 0

// It turns about an axis.
#define LW_HINGE_PIN 1

// It slides along an axis.
#define LW_HINGE_SLIDER 2

// The position of the goal counts.
#define LW_GOAL_POSITION 1

// The orientation of the goal counts.
#define LW_GOAL_ORIENTATION 2

// The goal is in the frame of the chain's base instead of the world.
#define LW_GOAL_IN_BASE 4

// What came of a call. Everything but `LW_STATUS_OK` means that nothing was changed or written, except where a
// function says otherwise.
typedef enum LwStatus {
  // Done.
  LW_STATUS_OK,
  // A pointer is NULL.
  LW_STATUS_NULL,
  // A pointer is not aligned to its type.
  LW_STATUS_MISALIGNED,
  // Memory to read and memory to write overlap.
  LW_STATUS_OVERLAP,
  // A text is not UTF-8.
  LW_STATUS_TEXT,
  // An array, or memory for a text, has another length than it must have.
  LW_STATUS_LENGTH,
  // A number is NaN or infinite.
  LW_STATUS_NOT_FINITE,
  // A number is outside its range.
  LW_STATUS_OUT_OF_RANGE,
  // Nothing has this name.
  LW_STATUS_UNKNOWN,
  // A part, object, body or collider that this model has not.
  LW_STATUS_FOREIGN,
  // The part is no chain.
  LW_STATUS_NOT_A_CHAIN,
  // A search is to go on that was not begun.
  LW_STATUS_NO_SEARCH,
  // The inverse kinematics of the chain has no closed form.
  LW_STATUS_NO_CLOSED_FORM,
  // The start of inverse kinematics is outside the limits.
  LW_STATUS_OUTSIDE_LIMITS,
  // More than room was reserved for.
  LW_STATUS_NO_ROOM,
  // The object is held already.
  LW_STATUS_HELD,
  // The object is not held.
  LW_STATUS_NOT_HELD,
  // The hand holds nothing, or not this object.
  LW_STATUS_EMPTY_HAND,
  // The hand holds this object already.
  LW_STATUS_HAND_FULL,
  // The second hand is not where its grasp says.
  LW_STATUS_LOOP_OPEN,
  // Equations have no solution.
  LW_STATUS_SINGULAR,
  // Files, parts, objects or shapes make no model.
  LW_STATUS_MODEL,
  // Another thread is in a call with this handle. The handle's message stays as it is.
  LW_STATUS_BUSY,
  // A mistake in this library: a call with this handle panicked. A robot or builder answers nothing else from then on.
  LW_STATUS_PANICKED,
} LwStatus;

// How a search ended.
typedef enum LwOutcome {
  // The goal is met within the tolerances.
  LW_OUTCOME_MET,
  // No start led there: this is the nearest of all.
  LW_OUTCOME_NEAREST,
  // The effort was used up; `lw_robot_reach_on` goes on.
  LW_OUTCOME_UNFINISHED,
} LwOutcome;

// What a model is made of, while it is put together. For one thread at a time.
typedef struct LwBuilder LwBuilder;

// What never changes about a robot. Any number of threads may use it at once; the message is that of the last call of
// any of them that failed (`lw_model_clone` gives a thread a message of its own).
typedef struct LwModel LwModel;

// One instance of a model, with all the memory that its calls take. For one thread at a time: a call that meets another one answers `LW_STATUS_BUSY`.
// Several robots of one model know nothing of each other.
typedef struct LwRobot LwRobot;

// A pose: where a frame is in another.
typedef struct LwPose {
  // x, y, z, m.
  double position[3];
  // x, y, z, w; of length 1 within 1e-6.
  double quaternion[4];
} LwPose;

// A shape in its own frame.
typedef struct LwShape {
  // One of `LW_SHAPE_...`.
  uint32_t kind;
  // Lengths, m, as the kind says; those that are not used are zero.
  double size[3];
} LwShape;

// A wrench that the tip of a part exerts on something.
typedef struct LwPush {
  // Moment about `at`, world axes, N m.
  double moment[3];
  // Force, world axes, N.
  double force[3];
  // Where, in the tip's frame, m.
  double at[3];
  // The part, a chain.
  uint32_t part;
} LwPush;

// When inverse kinematics is content, and how long it tries: in work, never in time.
typedef struct LwEffort {
  // Greatest error of position, m, and of orientation, rad.
  double tolerances[2];
  // Steps from one start.
  size_t steps;
  // Starts elsewhere, the same ones each time.
  size_t restarts;
  // Evaluations of the kinematics in one call, at most.
  size_t kinematics;
} LwEffort;

// Where a tip is to be.
typedef struct LwGoal {
  // Where; what does not count is not read.
  struct LwPose pose;
  // What 1 m and 1 rad count in the sum of squares; positive.
  double weights[2];
  // A sum of `LW_GOAL_...`.
  uint32_t parts;
} LwGoal;

// What inverse kinematics answers beside q.
typedef struct LwAnswer {
  // How far the tip is from the goal, m; not defined when unfinished.
  double position;
  // The same, rad.
  double orientation;
  // Evaluations of the kinematics since the search began.
  size_t kinematics;
  // Which start led there; 0 is the given one.
  size_t restart;
  // How it ended.
  enum LwOutcome outcome;
} LwAnswer;

// Two colliders.
typedef struct LwPair {
  // The first.
  uint32_t a;
  // The second.
  uint32_t b;
} LwPair;

// The nearest pair of colliders.
typedef struct LwClosest {
  // m, padding counted; negative when they overlap.
  double distance;
  // On the first, world, m.
  double point_a[3];
  // On the second, world, m.
  double point_b[3];
  // The first collider.
  uint32_t a;
  // The second collider.
  uint32_t b;
  // Whether there is such a pair; else the rest is zero.
  bool found;
} LwClosest;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// The words of a code, for ever: do not free them. Any number may be asked for; "unknown code" where it is none.
const char *lw_status_text(int32_t code);

// The version of this library, as `major.minor.patch`, for ever: do not free it.
const char *lw_version(void);

// A builder of nothing yet, into `out`; free it with `lw_builder_free`.
enum LwStatus lw_builder_new(struct LwBuilder **out);

// Frees a builder; NULL is none. Models that it made stay.
void lw_builder_free(struct LwBuilder *builder);

// The message of the last call with this builder that failed: place, fact and remedy; empty when none did. Copies it with its zero into
// `buffer` of `room` bytes, and for how many there must be room into `wanted` (NULL: not asked for).
// `LW_STATUS_LENGTH` when it is cut.
enum LwStatus lw_builder_message(const struct LwBuilder *builder,
                                 char *buffer,
                                 size_t room,
                                 size_t *wanted);

// A folder that holds packages, for `package://name/..` in files that are read afterwards.
enum LwStatus lw_builder_packages(struct LwBuilder *builder, const char *folder);

// The robot, from a URDF, MJCF or SDF file. `root`: one of `LW_ROOT_...`; `inertia`: one of `LW_INERTIA_...`. Loops and couplings are refused: the
// model is a tree. Shapes are read by `lw_builder_file_shapes`.
enum LwStatus lw_builder_robot_file(struct LwBuilder *builder,
                                    const char *path,
                                    uint32_t root,
                                    uint32_t inertia);

// As `lw_builder_robot_file`, from the text of such a file.
enum LwStatus lw_builder_robot_text(struct LwBuilder *builder,
                                    const char *xml,
                                    uint32_t root,
                                    uint32_t inertia);

// Parts and pairs that do not collide, from an SRDF file: each group is a part. After the robot.
enum LwStatus lw_builder_groups_file(struct LwBuilder *builder, const char *path);

// As `lw_builder_groups_file`, from the text of such a file.
enum LwStatus lw_builder_groups_text(struct LwBuilder *builder, const char *xml);

// The collision shapes of the robot's file, as colliders with their names, or `body/number`. After the robot. Shapes that a collider
// cannot be (mesh files, ellipsoids) are refused: give such bodies shapes by `lw_builder_shape`.
enum LwStatus lw_builder_file_shapes(struct LwBuilder *builder);

// A part: the chain of bodies after `base` (a body, or "world") up to `tip`.
enum LwStatus lw_builder_chain(struct LwBuilder *builder,
                               const char *name,
                               const char *base,
                               const char *tip);

// An object that hands may hold, rigid unless bodies hang on it (`lw_builder_object_body`): mass (kg), centre of mass (3 numbers, m) and inertia about it (9 numbers, row after row, kg m^2), in the
// object's axes.
enum LwStatus lw_builder_object(struct LwBuilder *builder,
                                const char *name,
                                double mass,
                                const double *center,
                                const double *inertia);

// A body that hangs on an object, or on another such body (`parent`), by a hinge at `at` in the parent's frame (NULL: at its origin), where the body's own origin is. `hinge`: one of
// `LW_HINGE_..`; `axis` (3 numbers, of any length but zero; unused, and may be NULL, for `LW_HINGE_LOCKED`). Mass properties as of `lw_builder_object`.
enum LwStatus lw_builder_object_body(struct LwBuilder *builder,
                                     const char *name,
                                     const char *parent,
                                     uint32_t hinge,
                                     const double *axis,
                                     const struct LwPose *at,
                                     double mass,
                                     const double *center,
                                     const double *inertia);

// A shape for collisions, `at` (NULL: at the origin) in the frame of `carrier`: a body, an object or a body that hangs on one, or "world".
enum LwStatus lw_builder_shape(struct LwBuilder *builder,
                               const char *name,
                               const char *carrier,
                               const struct LwPose *at,
                               const struct LwShape *shape);

// A cloud of points, each a ball of its own radius, as a sensor sees them: none at first, with room for `room` of them. They are given by
// `lw_robot_set_points`. `at` and `carrier` as of `lw_builder_shape`.
enum LwStatus lw_builder_point_cloud(struct LwBuilder *builder,
                                     const char *name,
                                     const char *carrier,
                                     const struct LwPose *at,
                                     size_t room);

// A voxel map: `cells` (3 numbers) cubes along x, y, z from the origin of its frame, with the edge `edge` (m), all free at first.
// `lw_robot_set_cells` changes them. `at` and `carrier` as of `lw_builder_shape`.
enum LwStatus lw_builder_voxel_map(struct LwBuilder *builder,
                                   const char *name,
                                   const char *carrier,
                                   const struct LwPose *at,
                                   const uint32_t *cells,
                                   double edge);

// Two that do not collide: each the name of a collider or of a body, which stands for all its colliders.
enum LwStatus lw_builder_ignore(struct LwBuilder *builder,
                                const char *a,
                                const char *b);

// Checks everything and makes the model, into `out`; free it with `lw_model_free`. The builder stays, and may make others. All mistakes are in the message.
enum LwStatus lw_builder_model(struct LwBuilder *builder,
                               struct LwModel **out);

// The same model by another handle with a message of its own, into `out`. O(1).
enum LwStatus lw_model_clone(const struct LwModel *model, struct LwModel **out);

// Frees this handle of a model; NULL is none. Robots of the model stay.
void lw_model_free(struct LwModel *model);

// As `lw_builder_message`, of a model.
enum LwStatus lw_model_message(const struct LwModel *model,
                               char *buffer,
                               size_t room,
                               size_t *wanted);

// What the files say and the model does not use, one line each: as `lw_builder_message`.
enum LwStatus lw_model_unused(const struct LwModel *model,
                              char *buffer,
                              size_t room,
                              size_t *wanted);

// Numbers of q into `nq`, degrees of freedom into `nv`.
enum LwStatus lw_model_sizes(const struct LwModel *model, size_t *nq, size_t *nv);

// The part of that name, into `out`: its place among the parts, from 0.
enum LwStatus lw_model_part(const struct LwModel *model, const char *name, uint32_t *out);

// The object of that name, into `out`: its place among the objects, from 0.
enum LwStatus lw_model_object(const struct LwModel *model, const char *name, uint32_t *out);

// The body of that name, into `out`: its place among the bodies, from 0.
enum LwStatus lw_model_body(const struct LwModel *model, const char *name, uint32_t *out);

// The collider of that name, into `out`: its place in the order of names, from 0.
enum LwStatus lw_model_collider(const struct LwModel *model, const char *name, uint32_t *out);

// The name of a collider: as `lw_builder_message`.
enum LwStatus lw_model_collider_name(const struct LwModel *model,
                                     uint32_t collider,
                                     char *buffer,
                                     size_t room,
                                     size_t *wanted);

// The places in q and among the degrees of freedom of a joint with one coordinate, by the name that the file gives it.
enum LwStatus lw_model_joint(const struct LwModel *model,
                             const char *name,
                             size_t *in_q,
                             size_t *in_v);

// How many degrees of freedom a chain has, into `count`: the columns of its Jacobian.
enum LwStatus lw_model_part_size(const struct LwModel *model, uint32_t part, size_t *count);

// The places of a chain's degrees of freedom among all, into `dofs` of length `n` (`lw_model_part_size`).
enum LwStatus lw_model_part_dofs(const struct LwModel *model,
                                 uint32_t part,
                                 size_t *dofs,
                                 size_t n);

// Limits of the degrees of freedom with one coordinate, rad or m, into `lower` and `upper` (`n` = nv each); infinite where there is none.
enum LwStatus lw_model_limits(const struct LwModel *model,
                              double *lower,
                              double *upper,
                              size_t n);

// A robot of a model at its neutral configuration, into `out`; free it with `lw_robot_free`. All memory of later calls is taken here.
enum LwStatus lw_robot_new(const struct LwModel *model,
                           struct LwRobot **out);

// A robot of its own with the same configuration, held objects and settings, into `out`.
enum LwStatus lw_robot_clone(const struct LwRobot *robot, struct LwRobot **out);

// Frees a robot; NULL is none.
void lw_robot_free(struct LwRobot *robot);

// As `lw_builder_message`, of a robot. May be called while another thread is in a call with the robot.
enum LwStatus lw_robot_message(const struct LwRobot *robot,
                               char *buffer,
                               size_t room,
                               size_t *wanted);

// The configuration, into `q` (`n` = nq).
enum LwStatus lw_robot_q(struct LwRobot *robot, double *q, size_t n);

// Another configuration `q` (`n` = nq), within limits or not.
enum LwStatus lw_robot_set_q(struct LwRobot *robot, const double *q, size_t n);

// The nearest to `q` (`n` = nq) that is within all limits, in place.
enum LwStatus lw_robot_clamp(struct LwRobot *robot, double *q, size_t n);

// The acceleration of free fall (3 numbers), world axes, m/s^2; 9.81 down z at first.
enum LwStatus lw_robot_set_gravity(struct LwRobot *robot, const double *g);

// Where the tip of a chain is in the world at the robot's q. Moves the bodies from the world to the tip and no others.
enum LwStatus lw_robot_tip_pose(struct LwRobot *robot,
                                uint32_t part,
                                struct LwPose *out);

// Where a body is in the world at the robot's q.
enum LwStatus lw_robot_body_pose(struct LwRobot *robot, uint32_t body, struct LwPose *out);

// The Jacobian of a chain at the robot's q, into `J` (6 rows of its m degrees of freedom, row after row; `n` = 6 m): rates to the
// velocity of its tip relative to its base, angular rows (rad/s) first, at the tip's origin, world axes.
enum LwStatus lw_robot_jacobian(struct LwRobot *robot,
                                uint32_t part,
                                double *J,
                                size_t n);

// The Jacobian of a chain's tip in the whole mechanism, into `J` (6 rows of nv; `n` = 6 nv): what carries the chain counts, too.
enum LwStatus lw_robot_whole_jacobian(struct LwRobot *robot,
                                      uint32_t part,
                                      double *J,
                                      size_t n);

// Forces, into `tau` (`n` = nv; N m or N), for rates `v` and accelerations `vdot` (`n` = nv each) at the robot's q, with what is held, while tips push: at most as many `pushes` as the
// model has parts.
enum LwStatus lw_robot_feed_forward(struct LwRobot *robot,
                                    const double *v,
                                    const double *vdot,
                                    size_t n,
                                    const struct LwPush *pushes,
                                    size_t push_count,
                                    double *tau);

// Forces, into `tau` (`n` = nv), that hold the robot's q still, with what is held, while tips push: as `lw_robot_feed_forward`.
enum LwStatus lw_robot_held_still(struct LwRobot *robot,
                                  const struct LwPush *pushes,
                                  size_t push_count,
                                  double *tau,
                                  size_t n);

// The mass matrix at the robot's q with what is held, into `M` (nv rows of nv, row after row; `n` = nv nv).
enum LwStatus lw_robot_mass_matrix(struct LwRobot *robot,
                                   double *M,
                                   size_t n);

// The mass of all that moves with what is held, kg, into `mass` (NULL: not asked for), and its centre at the robot's q, world, m, into `center` (3 numbers).
enum LwStatus lw_robot_center_of_mass(struct LwRobot *robot,
                                      double *mass,
                                      double *center);

// The effort that `lw_robot_reach` takes for NULL: 1e-9 m and rad, 100 steps from each of 65 starts, no other bound.
enum LwStatus lw_effort_default(struct LwEffort *out);

// Moves the chain's numbers in `q` (`n` = nq; in: where to start, within limits; out: the solution, or the nearest configuration) until its tip meets the goal, within
// limits. The robot's own q does not change. *Not reached* is an answer, not an error. `effort`: NULL for the default.
enum LwStatus lw_robot_reach(struct LwRobot *robot,
                             uint32_t part,
                             const struct LwGoal *goal,
                             const struct LwEffort *effort,
                             double *q,
                             size_t n,
                             struct LwAnswer *answer);

// Goes on with the last search of a chain for so many evaluations of its kinematics. The same steps are taken in whatever portions.
enum LwStatus lw_robot_reach_on(struct LwRobot *robot,
                                uint32_t part,
                                size_t kinematics,
                                double *q,
                                size_t n,
                                struct LwAnswer *answer);

// All configurations within limits that bring the tip of an arm of six or seven hinges with a closed form to a pose, into `solutions` (`rows` times `n` = nq
// numbers; 8 rows are always enough), those nearest to `q` (`n`) first, and how many there are into `count`: none is an answer, not an error. `q` says where
// what carries the arm is, and of whole turns which are meant. `held`: the place in β of that hinge of seven which stays as it is in `q`; -1: the library chooses it.
enum LwStatus lw_robot_reach_all(struct LwRobot *robot,
                                 uint32_t part,
                                 int64_t held,
                                 const struct LwGoal *goal,
                                 const double *q,
                                 size_t n,
                                 double *solutions,
                                 size_t rows,
                                 size_t *count);

// Where an object is in the world: in the hand, or where it was put or let go last.
enum LwStatus lw_robot_object_pose(struct LwRobot *robot, uint32_t object, struct LwPose *out);

// Puts an object that nobody holds somewhere in the world.
enum LwStatus lw_robot_put(struct LwRobot *robot, uint32_t object, const struct LwPose *at);

// Takes an object with a hand (a chain: its tip), at a pose in the tip's frame, or where it is now (NULL). A second hand closes a loop, and has to
// be where its grasp says within 1e-6 m and rad.
enum LwStatus lw_robot_grasp(struct LwRobot *robot,
                             uint32_t hand,
                             uint32_t object,
                             const struct LwPose *at);

// Another pose of a held object in the tip's frame of a hand that holds it, as an estimator found it.
enum LwStatus lw_robot_update_grasp(struct LwRobot *robot,
                                    uint32_t hand,
                                    uint32_t object,
                                    const struct LwPose *at);

// One hand lets go of an object: it stays in the other hand, or where it is in the world.
enum LwStatus lw_robot_release(struct LwRobot *robot, uint32_t hand, uint32_t object);

// All hands let go of an object: it stays where it is in the world.
enum LwStatus lw_robot_ungrasp(struct LwRobot *robot, uint32_t object);

// Coordinates of the joints of an object into `q` (`n`: how many it has), in the order of its bodies: depth first, siblings by name.
enum LwStatus lw_robot_object_q(struct LwRobot *robot,
                                uint32_t object,
                                double *q,
                                size_t n);

// Other coordinates of the joints of an object, held or not: `q` (`n`: how many it has). The load of the hand that carries it follows.
enum LwStatus lw_robot_set_object_q(struct LwRobot *robot,
                                    uint32_t object,
                                    const double *q,
                                    size_t n);

// As `lw_robot_feed_forward` (`v`, `vdot`, `tau`: `n` = nv each) while the joints of a held object move: `rates` and `accelerations` of theirs, and into `forces` what they take
// (`m` each: how many it has). Joints of other objects stand still.
enum LwStatus lw_robot_feed_forward_with(struct LwRobot *robot,
                                         const double *v,
                                         const double *vdot,
                                         size_t n,
                                         uint32_t object,
                                         const double *rates,
                                         const double *accelerations,
                                         size_t m,
                                         const struct LwPush *pushes,
                                         size_t push_count,
                                         double *tau,
                                         double *forces);

// Whether two colliders that meet touch or overlap at `q` (`n` = nq), padding counted, into `out`; what hands hold goes with them. A pair that touches into
// `pair` (NULL: not asked for), where there is one.
enum LwStatus lw_robot_collides(struct LwRobot *robot,
                                const double *q,
                                size_t n,
                                bool *out,
                                struct LwPair *pair);

// The nearest pair of colliders that meet at `q` (`n` = nq), within `limit` (m, may be infinite), into `out`. Takes memory until that of contact points
// has its size, and where cylinders overlap.
enum LwStatus lw_robot_clearance(struct LwRobot *robot,
                                 const double *q,
                                 size_t n,
                                 double limit,
                                 struct LwClosest *out);

// Thickness around a collider from now on, m.
enum LwStatus lw_robot_pad(struct LwRobot *robot, uint32_t collider, double padding);

// Hides a collider from now on; `lw_robot_show` shows it again.
enum LwStatus lw_robot_hide(struct LwRobot *robot, uint32_t collider);

// Shows a collider from now on.
enum LwStatus lw_robot_show(struct LwRobot *robot, uint32_t collider);

// A pair is looked at from now on, whatever the rules and hands say.
enum LwStatus lw_robot_look_at(struct LwRobot *robot, uint32_t a, uint32_t b);

// A pair is not looked at from now on, whatever the rules and hands say: the two may touch.
enum LwStatus lw_robot_allow(struct LwRobot *robot, uint32_t a, uint32_t b);

// A pair is left to the rules and hands again.
enum LwStatus lw_robot_by_rule(struct LwRobot *robot, uint32_t a, uint32_t b);

// Other points of a cloud instead of those that it has: x, y, z, radius (m) of each of the `n`, one after the other, in the collider's frame. On a failure
// those of before stay.
enum LwStatus lw_robot_set_points(struct LwRobot *robot,
                                  uint32_t collider,
                                  const double *points,
                                  size_t n);

// Makes cells of a voxel map occupied: indices along x, y, z from 0 of each of the `n`, one after the other. On a failure nothing has changed.
enum LwStatus lw_robot_set_cells(struct LwRobot *robot,
                                 uint32_t collider,
                                 const uint32_t *cells,
                                 size_t n);

// Makes cells of a voxel map free: as `lw_robot_set_cells`.
enum LwStatus lw_robot_free_cells(struct LwRobot *robot,
                                  uint32_t collider,
                                  const uint32_t *cells,
                                  size_t n);

// Makes all cells of a voxel map free.
enum LwStatus lw_robot_clear_cells(struct LwRobot *robot, uint32_t collider);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* LINKWORK_ROBOT_H */
