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

// Inertias that no body has are read: moments that break the triangle inequality as they are, those below zero as 0, those without a mass not at all. `lw_model_doubtful` tells them.
#define LW_INERTIA_WARN 0

// Inertias that no body has are refused.
#define LW_INERTIA_PHYSICAL 1

// Principal moments need only not be negative, for published data that break the triangle inequality; others are refused.
#define LW_INERTIA_POSITIVE_MOMENTS 2

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

// An ellipsoid about the origin: `size` = half of its axes along x, y, z.
#define LW_SHAPE_ELLIPSOID 5

// The body does not move on its parent.
#define LW_HINGE_LOCKED 0

// It turns about `axis`: 1 number of q, rad.
#define LW_HINGE_PIN 1

// It slides along `axis`: 1 number of q, m.
#define LW_HINGE_SLIDER 2

// It turns about `axis` and advances along it by `pitch`: 1 number of q, rad.
#define LW_HINGE_SCREW 3

// It slides along `axis` and turns about it: 2 numbers of q, m and rad.
#define LW_HINGE_CYLINDRICAL 4

// It turns about `axis`, then about `second`, which moves with it: 2 numbers of q, rad.
#define LW_HINGE_UNIVERSAL 5

// It turns about the moving x, y and z axes: 3 numbers of q, rad.
#define LW_HINGE_GIMBAL 6

// It slides along x and y, then turns about z: 3 numbers of q, m and rad.
#define LW_HINGE_PLANAR 7

// Any rotation: 4 numbers of q, a quaternion x y z w, and 3 degrees of freedom.
#define LW_HINGE_BALL 8

// Any motion: 7 numbers of q, position and quaternion, and 6 degrees of freedom.
#define LW_HINGE_FREE 9

// Bodies that a hinge joins pass each other, except for pairs of `lw_builder_collide`: so it is at first.
#define LW_NEIGHBOURS_PASS 0

// They collide.
#define LW_NEIGHBOURS_COLLIDE 1

// All six rows of a Jacobian; the angular ones times a length.
#define LW_ROWS_ALL 0

// The three linear rows.
#define LW_ROWS_LINEAR 1

// The three angular rows.
#define LW_ROWS_ANGULAR 2

// The tip of a chain moves, in the world.
#define LW_WISH_TIP 0

// The centre of mass of all that moves, with what is held, moves.
#define LW_WISH_CENTER 1

// All degrees of freedom move.
#define LW_WISH_POSTURE 2

// The position of the goal counts.
#define LW_GOAL_POSITION 1

// The orientation of the goal counts.
#define LW_GOAL_ORIENTATION 2

// The goal is in the frame of the chain's base instead of the world.
#define LW_GOAL_IN_BASE 4

// Of the position only the plane through it with the normal `direction` counts.
#define LW_GOAL_PLANE 8

// Of the position only the line through it along `direction` counts.
#define LW_GOAL_LINE 16

// In place of an orientation `axis` points along the direction `towards`: all that welding and drilling ask for.
#define LW_GOAL_AXIS 32

// In place of an orientation `axis` looks at the point `towards`.
#define LW_GOAL_LOOK_AT 64

// In `LwTipGoal.seen_from`: in the world, or in the chain's base with `LW_GOAL_IN_BASE`.
#define LW_NO_PART UINT32_MAX

// Of `lw_robot_attach`: the object itself carries, none of its bodies.
#define LW_ITSELF UINT32_MAX

// The sum of squares of the forces is made small.
#define LW_BALANCE_EQUAL 0

// The sum of squares of the forces as shares of the limits of effort is made small.
#define LW_BALANCE_EFFORT 1

// The shapes of colliders themselves.
#define LW_DETAIL_FINE 0

// Their coarse shapes, where they have one.
#define LW_DETAIL_COARSE 1

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
  // A search, a path or a motion is asked for that was not begun.
  LW_STATUS_NO_SEARCH,
  // The inverse kinematics of the chain has no closed form.
  LW_STATUS_NO_CLOSED_FORM,
  // The start of inverse kinematics is outside the limits.
  LW_STATUS_OUTSIDE_LIMITS,
  // More than room was reserved for.
  LW_STATUS_NO_ROOM,
  // The object is held already, or attached to another one.
  LW_STATUS_HELD,
  // The object is not held, or attached to nothing.
  LW_STATUS_NOT_HELD,
  // The hand holds nothing, or not this object.
  LW_STATUS_EMPTY_HAND,
  // The hand holds this object already.
  LW_STATUS_HAND_FULL,
  // The second hand is not where its grasp says.
  LW_STATUS_LOOP_OPEN,
  // No configuration within limits closes what two hands hold, a loop or a coupling; or a call would open one.
  LW_STATUS_DOES_NOT_CLOSE,
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
  // The effort was used up; `lw_robot_resume_inverse_kinematics` goes on.
  LW_OUTCOME_UNFINISHED,
} LwOutcome;

// Whether a path is free.
typedef enum LwPathOutcome {
  // Proven free from end to end.
  LW_PATH_OUTCOME_FREE,
  // Two colliders touch.
  LW_PATH_OUTCOME_HIT,
  // Nothing touches where it was looked, and pieces as short as allowed could not be proven free.
  LW_PATH_OUTCOME_UNDECIDED,
  // The pieces asked for were used up; `lw_robot_path_free_on` goes on.
  LW_PATH_OUTCOME_UNFINISHED,
} LwPathOutcome;

// How a search for a way ended.
typedef enum LwPlanOutcome {
  // `lw_planner_path` gives it: free from end to end.
  LW_PLAN_OUTCOME_FOUND,
  // The start touches something.
  LW_PLAN_OUTCOME_BLOCKED_START,
  // The goal touches something.
  LW_PLAN_OUTCOME_BLOCKED_GOAL,
  // The room was used up. There may be a way, or none.
  LW_PLAN_OUTCOME_NOT_FOUND,
  // The places asked for were used up; `lw_planner_resume` goes on.
  LW_PLAN_OUTCOME_UNFINISHED,
} LwPlanOutcome;

// What a model is made of, while it is put together. For one thread at a time.
typedef struct LwBuilder LwBuilder;

// What never changes about a robot. Any number of threads may use it at once; the message is that of the last call of
// any of them that failed (`lw_model_clone` gives a thread a message of its own).
typedef struct LwModel LwModel;

// Memory of searches for ways of one chain. For robots of one model, and one call at a time.
typedef struct LwPlanner LwPlanner;

// Memory of predictions. For robots of one model, and one call at a time.
typedef struct LwPredictor LwPredictor;

// A problem of least squares in order of priority: unknowns x with bounds c x <= d, and levels A x = b, of which each takes nothing from those before. For one thread at a time.
typedef struct LwPriorities LwPriorities;

// Memory of rates for objectives. For robots of one model, and one call at a time.
typedef struct LwRateControl LwRateControl;

// One instance of a model, with all the memory that its calls take. For one thread at a time: a call that meets another one answers `LW_STATUS_BUSY`.
// Several robots of one model know nothing of each other.
typedef struct LwRobot LwRobot;

// The operational space of some tips, with its memory. For robots of one model, and one call at a time.
typedef struct LwTaskSpace LwTaskSpace;

// Memory of timings. For robots of one model, and one call at a time.
typedef struct LwTiming LwTiming;

// Memory of transfers. For robots of one model, and one call at a time.
typedef struct LwTransfer LwTransfer;

// Memory of forces for objectives with contacts. For robots of one model, and one call at a time.
typedef struct LwWholeBody LwWholeBody;

// A search of the whole, with its memory. For robots of one model, and one call at a time.
typedef struct LwWholeBodyIk LwWholeBodyIk;

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

// How a body moves on its parent. What does not count is zero.
typedef struct LwHinge {
  // One of `LW_HINGE_...`.
  uint32_t kind;
  // Of a pin, slider, screw, cylindrical or universal hinge, of any length but zero, in the hinge's frame.
  double axis[3];
  // The second axis of a universal hinge, of any length but zero.
  double second[3];
  // Of a screw: its advance, m/rad.
  double pitch;
} LwHinge;

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

// How well a tip moves and pushes at one configuration. For rates of length 1 the tip's speed along a unit vector u is at most
// 1 / sqrt(sum of (a_k . u / s_k)^2); for forces of the joints of length 1 its force is at most 1 / sqrt(sum of (a_k . u)^2 s_k^2), with the axes a_k and singular values s_k.
typedef struct LwManipulability {
  // The product of the singular values; 0 at a singular configuration.
  double w;
  // Greatest first; for three rows the last three are zero.
  double singular_values[6];
  // Six rows of six, row after row: column k is the axis of singular value k over the rows chosen, angular ones first where there are six.
  // For three rows only the upper left 3 by 3 is used.
  double axes[36];
} LwManipulability;

// A spring and a damper between a tip and where it should be.
typedef struct LwImpedance {
  // Where the tip should be, in the world.
  struct LwPose pose;
  // How it should move there: angular (rad/s), linear (m/s), at its origin, world axes.
  double twist[6];
  // And accelerate, rad/s^2 and m/s^2.
  double acceleration[6];
  // About world x, y, z (N m/rad), along x, y, z (N/m); not negative.
  double stiffness[6];
  // About and along the same (N m s/rad, N s/m); not negative.
  double damping[6];
} LwImpedance;

// One thing that is asked, of rates (`lw_rate_control_solve`) or of accelerations (`lw_whole_body_solve`). What its kind does not use is not read.
typedef struct LwObjective {
  // One of `LW_WISH_..`.
  uint32_t kind;
  // Lower ones come first; those of one level are met together, in the sense of least squares.
  uint32_t level;
  // What it counts within its level; above zero.
  double weight;
  // Of a tip and of the centre of mass: angular (rad/s or rad/s^2), then linear (m/s or m/s^2), world axes; of a tip at its origin, of the centre the linear ones alone.
  double motion[6];
  // Of a tip: what 1 rad counts, m, where all rows count.
  double length;
  // Of a tip: the chain.
  uint32_t part;
  // Of a tip: which rows count, one of `LW_ROWS_..`.
  uint32_t rows;
  // Of a posture: rates or accelerations of all degrees of freedom.
  const double *posture;
  // How many numbers the posture has: nv.
  size_t posture_count;
} LwObjective;

// A chain whose manipulability is not to fall below a number.
typedef struct LwGuard {
  // The least w (`lw_robot_manipulability` of all six rows with length 1 m).
  double least;
  // The chain.
  uint32_t part;
} LwGuard;

// A point of a tip that presses on something and does not slip.
typedef struct LwTouch {
  // Where, in the tip's frame, m.
  double at[3];
  // Normal of what it touches, towards the robot, of length 1, world axes.
  double normal[3];
  // Friction coefficient, above zero.
  double friction;
  // Greatest normal force, N, above zero; infinite for none.
  double most;
  // The chain whose tip touches.
  uint32_t part;
} LwTouch;

// How far a whole body could do what it was asked. All zero: it could.
typedef struct LwBalanced {
  // What contacts cannot carry: root of the sum of squares of forces at degrees of freedom that nothing drives, N m and N.
  double unbalanced;
  // Accelerations of what should stand still, m/s^2: contacts that contradict each other.
  double slipping;
  // By which share all limits of effort and of normal forces would have to be larger.
  double shortfall;
} LwBalanced;

// When inverse kinematics is content, and how long it tries: in work, never in time.
typedef struct LwEffort {
  // Greatest error of position, m, and of orientation, rad.
  double tolerances[2];
  // Steps from one start.
  size_t steps;
  // Starts elsewhere, the same ones each time; a quarter of them for the nearest to a position that is out of reach by the lengths of links.
  size_t restarts;
  // Evaluations of the kinematics in one call, at most.
  size_t kinematics;
} LwEffort;

// Where a tip is to be. What does not count is not read.
typedef struct LwGoal {
  // Where.
  struct LwPose pose;
  // What 1 m and 1 rad count in the sum of squares; positive.
  double weights[2];
  // A sum of `LW_GOAL_...`.
  uint32_t parts;
  // Normal of a plane or direction of a line, of length 1, in the frame of the pose.
  double direction[3];
  // The axis that points somewhere, of length 1, in the tip's frame. The turn about it is free.
  double axis[3];
  // To where: a direction of length 1, or a point, m, in the frame of the pose.
  double towards[3];
  // Half of the angle of the cone about it within which any direction will do, rad, 0 to pi; 0: the direction itself.
  double within;
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

// What is liked among configurations that meet a goal, and how hard to look: the least of `centred` / 2 times the sum of ((q - middle) / (upper - lower))^2, and `near` / 2 times that of ((q - given) / (upper - lower))^2, less `manipulable` times ln w.
typedef struct LwPrefer {
  // What distance from the middle of the limits counts; not negative.
  double centred;
  // What distance from the configuration that the search is given counts; not negative.
  double near;
  // What ln w counts (`lw_robot_manipulability`); not negative, and one of the three above zero.
  double manipulable;
  // What 1 rad counts in w, m; above zero.
  double length;
  // Starts: the given one and others, the same ones each time; at least one is made.
  size_t starts;
  // Evaluations of the kinematics to improve each solution, at most; 400 is usual.
  size_t steps;
} LwPrefer;

// The best of several solutions.
typedef struct LwBest {
  // What was made small; infinite when the goal is not met.
  double cost;
  // Starts that led to the goal.
  size_t solutions;
  // Evaluations of the kinematics in all.
  size_t kinematics;
  // Met, or nearest when no start led there.
  enum LwOutcome outcome;
} LwBest;

// Where the tip of a chain is to be, beside others.
typedef struct LwTipGoal {
  // What is asked of its tip.
  struct LwGoal goal;
  // The chain.
  uint32_t part;
  // The chain at whose tip the goal is seen, wherever it goes; `LW_NO_PART`: none.
  uint32_t seen_from;
} LwTipGoal;

// What a closed loop leaves.
typedef struct LwClosure {
  // Rows of the loop's equations.
  uint32_t rows;
  // How many of them are independent here.
  uint32_t rank;
  // Degrees of freedom that are left to the chains and joints of the loop.
  uint32_t mobility;
} LwClosure;

// Who holds an object.
typedef struct LwHold {
  // How many hands do: 0, 1 or 2. What is beyond is zero.
  uint32_t count;
  // The hand that carries it in the mechanism, then the second: parts.
  uint32_t hands[2];
  // Where the object is in the frames of their tips.
  struct LwPose at[2];
} LwHold;

// A moment and a force.
typedef struct LwWrench {
  // World axes, N m.
  double moment[3];
  // World axes, N.
  double force[3];
} LwWrench;

// How two hands share a load.
typedef struct LwShared {
  // What the second hand does to the object, about its own tip.
  struct LwWrench second;
  // The sum that was made small.
  double cost;
  // The greatest |tau| / limit over the joints of both chains that have a limit of effort; above 1 they cannot do it.
  double largest_share;
} LwShared;

// What two hands do to an object, told apart: first hand, then second, each about its own tip.
typedef struct LwHandWrenches {
  // What moves the object.
  struct LwWrench moving[2];
  // What only squeezes it.
  struct LwWrench squeezing[2];
  // The sum, about the object's origin.
  struct LwWrench net;
} LwHandWrenches;

// What a hand can hold by friction: a patch that is pressed evenly.
typedef struct LwFriction {
  // Where it presses the object to, in the tip's axes; of any length but zero.
  double normal[3];
  // Coefficient of friction, above zero.
  double coefficient;
  // Radius of the patch that touches, m, above zero.
  double radius;
  // Greatest normal force, N, above zero; infinite for none.
  double most;
} LwFriction;

// What two hands do so that neither slips.
typedef struct LwGripped {
  // On the object: first hand, then second, each about its own tip.
  struct LwWrench wrenches[2];
  // 0 when both hold. Else no wrenches do: the least force by which cones and limits would have to be wider, N; the wrenches are those that would hold then.
  double shortfall;
} LwGripped;

// The inertia of a rigid body.
typedef struct LwInertia {
  // kg.
  double mass;
  // From the origin to the centre of mass, m.
  double center[3];
  // About the origin (not about the centre), row after row, kg m^2.
  double inertia[9];
} LwInertia;

// Two colliders.
typedef struct LwPair {
  // The first.
  uint32_t a;
  // The second.
  uint32_t b;
} LwPair;

// How near two colliders are.
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

// What is told of a path.
typedef struct LwPath {
  // Which part of the way, from 0 at its start to 1: where two touch, or the first piece that is undecided; else 0.
  double at;
  // Two that touch there; else zero.
  struct LwPair pair;
  // What came of it.
  enum LwPathOutcome outcome;
} LwPath;

// How to look for a way.
typedef struct LwSearch {
  // Of the random places: the same seed gives the same way.
  uint64_t seed;
  // Longest piece, as the greatest change of one coordinate, rad or m; above zero.
  double step;
  // Pieces of a piece that are not cut again, as of `lw_robot_path_free`.
  double least;
} LwSearch;

// What is told of a way.
typedef struct LwPlan {
  // How many configurations it has, both ends counted; 0 when none was found.
  size_t rows;
  // Two that touch at a blocked end; else zero.
  struct LwPair pair;
  // How the search ended.
  enum LwPlanOutcome outcome;
} LwPlan;

// Limits of a motion: a number for each degree of freedom, above zero, infinite for none. All arrays have the same length.
typedef struct LwMotionLimits {
  // rad/s or m/s; NULL: those of the model.
  const double *rate;
  // rad/s^2 or m/s^2; NULL: none.
  const double *acceleration;
  // rad/s^3 or m/s^3; NULL: none.
  const double *jerk;
  // N m or N; NULL: those of the model. Where all are infinite no dynamics is computed.
  const double *effort;
  // nv.
  size_t n;
} LwMotionLimits;

// What a timing ends with.
typedef struct LwTimed {
  // s.
  double duration;
  // When no motion keeps the limits: where on the way it becomes impossible, as a part of its length (`lw_timing_place`).
  double part;
  // Then: the least number by which all limits of acceleration and effort would have to be multiplied.
  double share;
  // Whether a motion keeps the limits. What does not apply is zero.
  bool found;
} LwTimed;

// Where a robot is, and how it moves.
typedef struct LwMotionState {
  // Configuration.
  const double *q;
  // nq.
  size_t nq;
  // Rates; NULL: at rest.
  const double *v;
  // Accelerations; NULL: none.
  const double *vdot;
  // nv.
  size_t nv;
} LwMotionState;

// What a transfer ends with.
typedef struct LwTransferred {
  // s.
  double duration;
  // When it leaves the limits of a coordinate: how far it comes, rad or m.
  double value;
  // Then: the place of that coordinate among the degrees of freedom.
  size_t dof;
  // Whether all coordinates stay within their limits. What does not apply is zero.
  bool within_limits;
} LwTransferred;

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

// Before the robot is read: its loops and couplings, such as joints that mimic others, are kept. `lw_whole_body_ik_solve` and `lw_whole_body_ik_best` keep them closed. Kinematics, collisions,
// masses and forces are those of the tree at the q given, as if every coordinate had a motor of its own. What would open them is `LW_STATUS_DOES_NOT_CLOSE`: searches, rates and ways of a
// chain that takes part in them, ways between configurations, objectives, operational space, predictions, timings and transfers.
enum LwStatus lw_builder_keep_closures(struct LwBuilder *builder);

// The robot, from a URDF, MJCF or SDF file. `root`: one of `LW_ROOT_...`; `inertia`: one of `LW_INERTIA_...`. Loops and couplings, such as
// joints that mimic others, are refused, but after `lw_builder_keep_closures`. Shapes are read by `lw_builder_file_shapes`.
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
// cannot be (meshes that are neither STL nor OBJ, ellipsoids) are refused: give such bodies shapes by `lw_builder_shape`, `lw_builder_hull` or `lw_builder_mesh`.
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

// Checks everything and makes the model, into `out`; free it with `lw_model_free`. The builder stays, and may make others. All mistakes are in the message.
enum LwStatus lw_builder_model(struct LwBuilder *builder,
                               struct LwModel **out);

// A body of the robot, on `parent` (a body, or "world") by `hinge` (NULL: welded) at `at` in the parent's frame (NULL: at its origin), where the body's own origin is. Mass properties as of `lw_builder_object`; mass,
// centre and inertia of zero: a frame. With bodies a robot needs no file; after a file they are added to its bodies. A hinge of one degree of freedom is found by `lw_model_joint` under the
// body's name, any by `lw_model_hinge`.
enum LwStatus lw_builder_body(struct LwBuilder *builder,
                              const char *name,
                              const char *parent,
                              const struct LwHinge *hinge,
                              const struct LwPose *at,
                              double mass,
                              const double *center,
                              const double *inertia);

// A body that hangs on an object, or on another such body (`parent`), by `hinge` (NULL: welded) at `at` in the parent's frame (NULL: at its origin), where the body's own origin is. Mass properties as of
// `lw_builder_object`. `lw_model_object_hinge` tells where its numbers are.
enum LwStatus lw_builder_object_body(struct LwBuilder *builder,
                                     const char *name,
                                     const char *parent,
                                     const struct LwHinge *hinge,
                                     const struct LwPose *at,
                                     double mass,
                                     const double *center,
                                     const double *inertia);

// Limits of the hinge of a body that was added before, of each of its pins, sliders and screws: least and greatest coordinate, rad or m; greatest rate, rad/s or m/s; greatest effort, N m or N. Infinite where there
// is none. Takes the place of those of the file.
enum LwStatus lw_builder_limits(struct LwBuilder *builder,
                                const char *body,
                                double lower,
                                double upper,
                                double rate,
                                double effort);

// The convex hull of `n` points (3 numbers each, m) that are not all in one plane. `at` and `carrier` as of `lw_builder_shape`.
enum LwStatus lw_builder_hull(struct LwBuilder *builder,
                              const char *name,
                              const char *carrier,
                              const struct LwPose *at,
                              const double *points,
                              size_t n);

// A surface of triangles: `vertex_count` corners (3 numbers each, m), and `triangle_count` triangles (3 indices of corners each, from 0, counter-clockwise seen from outside). Only its outside pushes; a
// hull is faster and better where it fits. Every robot takes 8 bytes for each triangle of the largest. `at` and `carrier` as of `lw_builder_shape`.
enum LwStatus lw_builder_mesh(struct LwBuilder *builder,
                              const char *name,
                              const char *carrier,
                              const struct LwPose *at,
                              const double *vertices,
                              size_t vertex_count,
                              const uint32_t *triangles,
                              size_t triangle_count);

// Terrain: heights (z, m) of `x` by `y` points (at least 2 each) on a grid that is centred on the origin, `spacing` (2 numbers, m) apart along x and y, solid below without end. `heights`: `n` = x y numbers, the row
// of lowest y first; NaN where there is no ground. Memory as of `lw_builder_mesh`. `at` and `carrier` as of `lw_builder_shape`.
enum LwStatus lw_builder_height_field(struct LwBuilder *builder,
                                      const char *name,
                                      const char *carrier,
                                      const struct LwPose *at,
                                      size_t x,
                                      size_t y,
                                      const double *spacing,
                                      const double *heights,
                                      size_t n);

// Gives the collider of a name, added before, a coarse shape in the same frame, for `LW_DETAIL_COARSE`: simpler, and around its own.
enum LwStatus lw_builder_coarse(struct LwBuilder *builder,
                                const char *name,
                                const struct LwShape *shape);

// As `lw_builder_coarse`, with the convex hull of `n` points (3 numbers each, m) as the coarse shape.
enum LwStatus lw_builder_coarse_hull(struct LwBuilder *builder,
                                     const char *name,
                                     const double *points,
                                     size_t n);

// As `lw_builder_coarse`, with a surface of triangles as the coarse shape: as of `lw_builder_mesh`.
enum LwStatus lw_builder_coarse_mesh(struct LwBuilder *builder,
                                     const char *name,
                                     const double *vertices,
                                     size_t vertex_count,
                                     const uint32_t *triangles,
                                     size_t triangle_count);

// As `lw_builder_coarse`, with cubes as the coarse shape: a grid of `cells` (3 numbers) of them along x, y, z from the origin of the frame, with the edge `edge` (m), of which `n` are occupied: `occupied` has three
// indices of each, from 0. They stay as they are: `lw_robot_set_cells` changes a collider's own shape.
enum LwStatus lw_builder_coarse_voxel_map(struct LwBuilder *builder,
                                          const char *name,
                                          const uint32_t *cells,
                                          double edge,
                                          const uint32_t *occupied,
                                          size_t n);

// Two that do not collide: each the name of a collider or of a body, which stands for all its colliders.
enum LwStatus lw_builder_ignore(struct LwBuilder *builder,
                                const char *a,
                                const char *b);

// Two that collide though a hinge joins them or they are of one group of `lw_builder_apart`, as of `lw_builder_ignore`, which goes before.
enum LwStatus lw_builder_collide(struct LwBuilder *builder,
                                 const char *a,
                                 const char *b);

// A group of `n` bodies, by name, of which none collides with another.
enum LwStatus lw_builder_apart(struct LwBuilder *builder, const char *const *bodies, size_t n);

// What happens between bodies that a hinge of fewer than six degrees of freedom joins: one of `LW_NEIGHBOURS_...`.
enum LwStatus lw_builder_neighbours(struct LwBuilder *builder,
                                    uint32_t neighbours);

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

// Warnings: mass properties of the robot's file that no body has and that were read all the same (`LW_INERTIA_WARN`), one line each with link and numbers; empty when there are none: as `lw_builder_message`.
enum LwStatus lw_model_doubtful(const struct LwModel *model,
                                char *buffer,
                                size_t room,
                                size_t *wanted);

// Numbers of q into `nq`, degrees of freedom into `nv`.
enum LwStatus lw_model_sizes(const struct LwModel *model, size_t *nq, size_t *nv);

// The part of that name, into `out`: its place among the parts, from 0.
enum LwStatus lw_model_part(const struct LwModel *model, const char *name, uint32_t *out);

// The object of that name, into `out`: its place among the objects, from 0.
enum LwStatus lw_model_object(const struct LwModel *model, const char *name, uint32_t *out);

// How many coordinates the joints of an object have, into `nq`, and degrees of freedom, into `nv`: 0 when it is rigid.
enum LwStatus lw_model_object_sizes(const struct LwModel *model,
                                    uint32_t object,
                                    size_t *nq,
                                    size_t *nv);

// The body of that name among those that hang on an object by hinges, and the object itself, into `out`.
enum LwStatus lw_model_object_body(const struct LwModel *model,
                                   uint32_t object,
                                   const char *name,
                                   uint32_t *out);

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

// The places in q and among the degrees of freedom of a joint with one coordinate, by the name that the file gives it, or of a body of `lw_builder_body` by its name.
enum LwStatus lw_model_joint(const struct LwModel *model,
                             const char *name,
                             size_t *in_q,
                             size_t *in_v);

// Where the hinge of a body has its numbers: the first in q into `in_q` and how many into `q_count`, among the degrees of freedom into `in_v` and `v_count`. A welded one has none.
enum LwStatus lw_model_hinge(const struct LwModel *model,
                             uint32_t body,
                             size_t *in_q,
                             size_t *q_count,
                             size_t *in_v,
                             size_t *v_count);

// As `lw_model_hinge`, of a body that hangs on an object (`lw_model_object_body`): the places are those among the numbers of that object's joints. The object itself has none.
enum LwStatus lw_model_object_hinge(const struct LwModel *model,
                                    uint32_t object,
                                    uint32_t body,
                                    size_t *in_q,
                                    size_t *q_count,
                                    size_t *in_v,
                                    size_t *v_count);

// How many degrees of freedom a chain has, into `count`: the columns of its Jacobian.
enum LwStatus lw_model_part_size(const struct LwModel *model, uint32_t part, size_t *count);

// The places of a chain's degrees of freedom among all, into `dofs` of length `n` (`lw_model_part_size`).
enum LwStatus lw_model_part_dofs(const struct LwModel *model,
                                 uint32_t part,
                                 size_t *dofs,
                                 size_t n);

// The colliders on the bodies of a part, in the order of names, into `out`, and how many there are into `count`. Where they are more than `room`, `LW_STATUS_NO_ROOM`, and `count` alone is written.
enum LwStatus lw_model_part_colliders(const struct LwModel *model,
                                      uint32_t part,
                                      uint32_t *out,
                                      size_t room,
                                      size_t *count);

// As `lw_model_part_colliders`, of an object, those on its bodies among them.
enum LwStatus lw_model_object_colliders(const struct LwModel *model,
                                        uint32_t object,
                                        uint32_t *out,
                                        size_t room,
                                        size_t *count);

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

// Where the base of a chain is in the world at the robot's q: the frame of goals with `LW_GOAL_IN_BASE`.
enum LwStatus lw_robot_base_pose(struct LwRobot *robot,
                                 uint32_t part,
                                 struct LwPose *out);

// Manipulability of a chain at the robot's q, into `out`. `rows`: one of `LW_ROWS_..`; `length`: what 1 rad counts, m, where all six count (else it is not read). Its gradient over the
// chain's degrees of freedom into `gradient` (`n`: `lw_model_part_size`; NULL and 0: not asked for); zero where the measure is zero.
enum LwStatus lw_robot_manipulability(struct LwRobot *robot,
                                      uint32_t part,
                                      uint32_t rows,
                                      double length,
                                      struct LwManipulability *out,
                                      double *gradient,
                                      size_t n);

// Rates of a chain at the robot's q, into its places of `v` (`n` = nv; the others stay), for which its tip moves as nearly as it can by `twist` (6 numbers: angular, rad/s, then
// linear, m/s; at the tip's origin, world axes, seen from the chain's base): of all such rates the least, within limits of rate, and not outward at a limit of a coordinate. What is missing
// into `missing` (2 numbers, rad/s and m/s; NULL: not asked for). For several objectives, and guards, see `lw_rate_control_solve`.
enum LwStatus lw_robot_rates(struct LwRobot *robot,
                             uint32_t part,
                             const double *twist,
                             double *v,
                             size_t n,
                             double *missing);

// The operational space of the tips of chains (`count` of them, at least one), in this order, into `out`; free it with `lw_task_space_free`. It serves every robot of the same model. Its rows are
// six for each tip: angular, then linear, of the tip's origin, world axes.
enum LwStatus lw_task_space_new(struct LwRobot *robot,
                                const uint32_t *parts,
                                size_t count,
                                struct LwTaskSpace **out);

// Frees an operational space; NULL is none.
void lw_task_space_free(struct LwTaskSpace *space);

// The inverse of the task inertia at the robot's q with what is held, into `out` (rows times rows, row after row; `n` = their product): accelerations of the tips for unit wrenches on
// them. `LW_STATUS_SINGULAR` when a coordinate has nothing to move.
enum LwStatus lw_task_space_compliance(struct LwRobot *robot,
                                       struct LwTaskSpace *space,
                                       double *out,
                                       size_t n);

// The task inertia at the robot's q with what is held, into `out` as of `lw_task_space_compliance`: kg m^2 and kg. `LW_STATUS_SINGULAR` also where the tips cannot move independently.
enum LwStatus lw_task_space_inertia(struct LwRobot *robot,
                                    struct LwTaskSpace *space,
                                    double *out,
                                    size_t n);

// Forces, into `tau` (`n` = nv), at the robot's q and rates `v` (`n`) that give the tips the accelerations `a` (`rows` numbers: six for each tip, rad/s^2 and m/s^2), gravity and what is
// held counted, while `rest` (`n`; NULL: none) acts as far as it moves no tip. `LW_STATUS_SINGULAR` where the tips cannot move independently.
enum LwStatus lw_task_space_forces(struct LwRobot *robot,
                                   struct LwTaskSpace *space,
                                   const double *v,
                                   size_t n,
                                   const double *a,
                                   size_t rows,
                                   const double *rest,
                                   double *tau);

// Forces, into `tau` (`n` = nv), at the robot's q and rates `v` (`n`) that make each tip a spring and damper to where it should be: `count` springs, one for each tip in the order of the parts.
// `rest` and `LW_STATUS_SINGULAR` as of `lw_task_space_forces`. The inertia that is felt is that of the tips: no force is measured.
enum LwStatus lw_task_space_impedance(struct LwRobot *robot,
                                      struct LwTaskSpace *space,
                                      const double *v,
                                      size_t n,
                                      const struct LwImpedance *springs,
                                      size_t count,
                                      const double *rest,
                                      double *tau);

// Memory of `lw_rate_control_solve` with room for so many objectives and guarded chains (1024 each at most), into `out`; free it with `lw_rate_control_free`. It serves every robot of the same model.
enum LwStatus lw_rate_control_new(struct LwRobot *robot,
                                  size_t objectives,
                                  size_t guards,
                                  struct LwRateControl **out);

// Frees it; NULL is none.
void lw_rate_control_free(struct LwRateControl *control);

// Rates, into `v` (`n` = nv), at the robot's q: within limits of rate, as near to each objective as those of lower levels allow, and of all such rates the least. A limit of a coordinate may be reached in
// the time `horizon` (s, above zero: a few periods of the control) at the earliest; so may the least manipulability of each of the `guard_count` chains in `guards`: towards a singular
// configuration a chain slows down. What is missing, |J v - asked| with weights, into `residuals`, a number for each level in their order (`levels`: how many different ones there are; NULL
// and 0: not asked for). A coordinate outside its limits comes back as fast as it may.
// `LW_STATUS_SINGULAR` when guards contradict each other.
enum LwStatus lw_rate_control_solve(struct LwRobot *robot,
                                    struct LwRateControl *control,
                                    const struct LwObjective *objectives,
                                    size_t wish_count,
                                    double horizon,
                                    const struct LwGuard *guards,
                                    size_t guard_count,
                                    double *v,
                                    size_t n,
                                    double *residuals,
                                    size_t levels);

// Memory of `lw_whole_body_solve` with room for so many touching points and objectives (1024 each at most), into `out`; free it with `lw_whole_body_free`. It serves every robot of the same model.
enum LwStatus lw_whole_body_new(struct LwRobot *robot,
                                size_t touches,
                                size_t objectives,
                                struct LwWholeBody **out);

// Frees it; NULL is none.
void lw_whole_body_free(struct LwWholeBody *body);

// Forces into `tau`, accelerations into `vdot`, at the robot's q and rates `v`, and forces on the robot at the `touch_count` touching points into `forces` (3 numbers each, world axes, N):
// first the balance of what nothing drives, then contacts that do not slip, then limits, then the objectives (accelerations) by levels, at last the least effort. `effort`: limits of force, N m
// and N; zero where nothing drives, infinite for none. `v`, `effort`, `tau`, `vdot`: `n` = nv each. What could not be done is an answer, in `out`, with the best motion there is.
enum LwStatus lw_whole_body_solve(struct LwRobot *robot,
                                  struct LwWholeBody *body,
                                  const double *v,
                                  const double *effort,
                                  size_t n,
                                  const struct LwTouch *touches,
                                  size_t touch_count,
                                  const struct LwObjective *objectives,
                                  size_t wish_count,
                                  double *tau,
                                  double *vdot,
                                  double *forces,
                                  struct LwBalanced *out);

// Where the centre of mass may be above `n` touching points (2 numbers each: x, y, m, in a level plane): the corners of their hull, counter-clockwise, into `hull` (room for n + 1 of them), and how
// many there are into `count`: two for points on a line, one for points that are all the same. `points` are put in order meanwhile; those that are no numbers count as none.
// No handle has a message of it.
enum LwStatus lw_support_polygon(double *points,
                                 size_t n,
                                 double *hull,
                                 size_t room,
                                 size_t *count);

// How far a place `p` (2 numbers: x, y, m) is inside a polygon with `n` corners (2 numbers each, counter-clockwise), into `margin`: the distance to its nearest edge, m, negative outside. Of
// no corner it is minus infinity. No handle has a message of it.
enum LwStatus lw_support_margin(const double *hull,
                                size_t n,
                                const double *p,
                                double *margin);

// The effort that `lw_robot_inverse_kinematics` takes for NULL: 1e-9 m and rad, 100 steps from each of 65 starts, no other bound.
enum LwStatus lw_effort_default(struct LwEffort *out);

// Moves the chain's numbers in `q` (`n` = nq; in: where to start, within limits; out: the solution, or the nearest configuration) until its tip meets the goal, within
// limits. The robot's own q does not change. *Not reached* is an answer, not an error. `effort`: NULL for the default.
enum LwStatus lw_robot_inverse_kinematics(struct LwRobot *robot,
                                          uint32_t part,
                                          const struct LwGoal *goal,
                                          const struct LwEffort *effort,
                                          double *q,
                                          size_t n,
                                          struct LwAnswer *answer);

// As `lw_robot_inverse_kinematics`, from several starts, each improved among the configurations that meet the goal, into `best`. `restarts` of the effort does not count; its `kinematics` bounds all
// evaluations together. When no start leads there, `q` is the nearest of the last of them.
enum LwStatus lw_robot_inverse_kinematics_best(struct LwRobot *robot,
                                               uint32_t part,
                                               const struct LwGoal *goal,
                                               const struct LwPrefer *prefer,
                                               const struct LwEffort *effort,
                                               double *q,
                                               size_t n,
                                               struct LwBest *best);

// Goes on with the last search of a chain for so many evaluations of its kinematics. The same steps are taken in whatever portions.
enum LwStatus lw_robot_resume_inverse_kinematics(struct LwRobot *robot,
                                                 uint32_t part,
                                                 size_t kinematics,
                                                 double *q,
                                                 size_t n,
                                                 struct LwAnswer *answer);

// All configurations within limits that bring the tip of an arm of six or seven hinges with a closed form to a pose, into `solutions` (`rows` times `n` = nq
// numbers; 8 rows are always enough), those nearest to `q` (`n`) first, and how many there are into `count`: none is an answer, not an error. `q` says where
// what carries the arm is, and of whole turns which are meant. `held`: the place in β of that hinge of seven which stays as it is in `q`; -1: the library chooses it.
enum LwStatus lw_robot_inverse_kinematics_all(struct LwRobot *robot,
                                              uint32_t part,
                                              int64_t held,
                                              const struct LwGoal *goal,
                                              const double *q,
                                              size_t n,
                                              double *solutions,
                                              size_t rows,
                                              size_t *count);

// Memory of `lw_whole_body_ik_solve` with room for so many goals (1024 at most) and two hands on every object, into `out`; free it with `lw_whole_body_ik_free`. It serves every robot of the same model.
enum LwStatus lw_whole_body_ik_new(struct LwRobot *robot,
                                   size_t goals,
                                   struct LwWholeBodyIk **out);

// Frees it; NULL is none.
void lw_whole_body_ik_free(struct LwWholeBodyIk *search);

// Keeps the hinges of a part's bodies where they are in searches from now on. A search that was begun ends.
enum LwStatus lw_whole_body_ik_keep(struct LwRobot *robot,
                                    struct LwWholeBodyIk *search,
                                    uint32_t part);

// Lets them move again.
enum LwStatus lw_whole_body_ik_release(struct LwRobot *robot,
                                       struct LwWholeBodyIk *search,
                                       uint32_t part);

// Moves `q` (`n` = nq; in: where to start, within limits; out: the solution, or the nearest configuration) until every tip meets its goal, within limits, with all that carries them. What two
// hands of the robot hold now is held in the answer, and loops and couplings are closed; without goals it closes what is open. `effort`: NULL for the default. Of `answer` position and
// orientation are the greatest of all goals; those of each, m and rad, go into `residuals` (`m` = 2 `goal_count`; NULL and 0: not asked for).
// `LW_STATUS_DOES_NOT_CLOSE` where nothing closes all: `q` is then where it is least open, position and orientation of `answer` are how far.
enum LwStatus lw_whole_body_ik_solve(struct LwRobot *robot,
                                     struct LwWholeBodyIk *search,
                                     const struct LwTipGoal *goals,
                                     size_t goal_count,
                                     const struct LwEffort *effort,
                                     double *q,
                                     size_t n,
                                     double *residuals,
                                     size_t m,
                                     struct LwAnswer *answer);

// Goes on with the search for so many evaluations of the kinematics. The same steps are taken in whatever portions. Answers as `lw_whole_body_ik_solve`.
enum LwStatus lw_whole_body_ik_resume(struct LwRobot *robot,
                                      struct LwWholeBodyIk *search,
                                      size_t kinematics,
                                      double *q,
                                      size_t n,
                                      double *residuals,
                                      size_t m,
                                      struct LwAnswer *answer);

// As `lw_whole_body_ik_solve`, from several starts, each improved among the configurations that meet all goals with everything closed, into `best`: near the middle of the limits of all that
// moves, and far from singular configurations of the goals' chains. `restarts` of the effort does not count; its `kinematics` bounds all evaluations together. The robot's own q does not change.
enum LwStatus lw_whole_body_ik_best(struct LwRobot *robot,
                                    struct LwWholeBodyIk *search,
                                    const struct LwTipGoal *goals,
                                    size_t goal_count,
                                    const struct LwPrefer *prefer,
                                    const struct LwEffort *effort,
                                    double *q,
                                    size_t n,
                                    struct LwBest *best);

// Evaluations of the kinematics after which `lw_whole_body_ik_solve` has ended for these goals at the latest, whatever the start, the goals' numbers and what hands hold, into `steps`; SIZE_MAX for more.
enum LwStatus lw_whole_body_ik_worst_case_steps(struct LwRobot *robot,
                                                struct LwWholeBodyIk *search,
                                                const struct LwTipGoal *goals,
                                                size_t goal_count,
                                                const struct LwEffort *effort,
                                                size_t *steps);

// Evaluations of the kinematics after which `lw_robot_inverse_kinematics` has ended for such a goal at the latest, whatever the chain, the start and the goal's numbers, into `steps`; SIZE_MAX for more.
// What a caller in real time counts on; most searches take a hundredth of it. `effort`: NULL for the default.
enum LwStatus lw_effort_worst_case_steps(const struct LwEffort *effort,
                                         const struct LwGoal *goal,
                                         size_t *steps);

// Where an object is in the world: in the hand, where it is attached, or where it was put or let go last.
enum LwStatus lw_robot_object_pose(struct LwRobot *robot,
                                   uint32_t object,
                                   struct LwPose *out);

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

// Attaches an object that no hand holds to another one: a battery to its driver, a wheel to its hub. `body`: the body of that one that carries it, or `LW_ITSELF`. `at`: its pose in the frame
// of what carries it, or where it is now (NULL). It then goes with that, and the hand that holds that carries both.
enum LwStatus lw_robot_attach(struct LwRobot *robot,
                              uint32_t object,
                              uint32_t on,
                              uint32_t body,
                              const struct LwPose *at);

// Takes an object off what it is attached to: it stays where it is in the world.
enum LwStatus lw_robot_detach(struct LwRobot *robot, uint32_t object);

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
enum LwStatus lw_robot_feed_forward_with_object(struct LwRobot *robot,
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

// What the loop of two hands on an object leaves at the robot's q.
enum LwStatus lw_robot_closure(struct LwRobot *robot, uint32_t object, struct LwClosure *out);

// What is left when a hand, with what it holds, is welded to a body of an object (`lw_model_object_body`) as both stand: a key in a lock. `free` (n: the object's degrees of
// freedom): which of its joints may move, 0 for those that stand.
enum LwStatus lw_robot_closure_onto(struct LwRobot *robot,
                                    uint32_t hand,
                                    uint32_t object,
                                    uint32_t body,
                                    const uint8_t *free,
                                    size_t n,
                                    struct LwClosure *out);

// The Jacobian of a body of an object (6 rows of its m degrees of freedom, row after row; `n` = 6 m): rates of the object's joints to the angular, then linear velocity of the body relative
// to where the object is held or stands, at the body's origin, world axes.
enum LwStatus lw_robot_object_jacobian(struct LwRobot *robot,
                                       uint32_t object,
                                       uint32_t body,
                                       double *J,
                                       size_t n);

// Where a body that hangs on an object (`lw_model_object_body`) is in the world.
enum LwStatus lw_robot_object_body_pose(struct LwRobot *robot,
                                        uint32_t object,
                                        uint32_t body,
                                        struct LwPose *out);

// The mass matrix at the robot's q with the m joints of an object that it holds in the last rows and columns, into `M` (nv + m rows of nv + m, row after row; `n` = their product). Joints of
// other objects stand still.
enum LwStatus lw_robot_mass_matrix_with_object(struct LwRobot *robot,
                                               uint32_t object,
                                               double *M,
                                               size_t n);

// Who holds an object, into `out`; nobody is an answer.
enum LwStatus lw_robot_hold(struct LwRobot *robot, uint32_t object, struct LwHold *out);

// Shares the load of an object between the two hands that hold it, at the robot's q: `tau` (`n` = nv; in: forces with the object on the first hand, as `lw_robot_feed_forward` gives
// them; out: forces of both hands for the same motion; only those of the two chains change). `balance`: one of `LW_BALANCE_..`. The shares may pull as well as press:
// `lw_robot_grip` knows friction. `LW_STATUS_NOT_HELD`, `LW_STATUS_EMPTY_HAND` without two hands; `LW_STATUS_OUT_OF_RANGE` where a joint has no limit of effort to take a share of.
enum LwStatus lw_robot_balance(struct LwRobot *robot,
                               uint32_t object,
                               uint32_t balance,
                               double *tau,
                               size_t n,
                               struct LwShared *out);

// Adds to `tau` (`n` = nv) what presses the two hands of an object towards each other with `force` (N) along the line between their tips, at the robot's q; the object feels no net wrench.
// What both do to it into `wrenches` (2: first hand, then second, each about its tip). `LW_STATUS_SINGULAR` when both tips are at one place.
enum LwStatus lw_robot_squeeze(struct LwRobot *robot,
                               uint32_t object,
                               double force,
                               double *tau,
                               size_t n,
                               struct LwWrench *wrenches);

// Adds to `tau` (`n` = nv) the forces with which the two hands of an object exert `wrenches` on it (2: first hand, then second, each about its tip), at the robot's q.
enum LwStatus lw_robot_add_hand_wrenches(struct LwRobot *robot,
                                         uint32_t object,
                                         const struct LwWrench *wrenches,
                                         double *tau,
                                         size_t n);

// Tells the wrenches of two hands on an object (2: first hand, then second, each about its tip) apart into `out`: what moves it, of least weighted sum of squares, and what only squeezes
// it. `weights` (3 numbers, above zero): of the first hand, of the second, and of 1 N m against 1 N (1/m^2).
enum LwStatus lw_robot_split_hand_wrenches(struct LwRobot *robot,
                                           uint32_t object,
                                           const struct LwWrench *wrenches,
                                           const double *weights,
                                           struct LwHandWrenches *out);

// Wrenches of two hands on an object under which neither slips, into `out`: those nearest to `wrenches` (2: first hand, then second, each about its tip) with the same net wrench, at the
// robot's q. `friction` (2): what each hand can hold.
enum LwStatus lw_robot_grip(struct LwRobot *robot,
                            uint32_t object,
                            const struct LwWrench *wrenches,
                            const struct LwFriction *friction,
                            struct LwGripped *out);

// The composite inertia of a body at the robot's q, into `out`: that of all that it carries and itself, with what is held, as if they were one; about the body's origin, world axes.
enum LwStatus lw_robot_composite_inertia(struct LwRobot *robot,
                                         uint32_t body,
                                         struct LwInertia *out);

// Momentum about the centre of mass at the robot's q and rates `v` (`n` = nv), with what is held, into `out` (6 numbers: angular, kg m^2/s, then linear, kg m/s; world axes).
enum LwStatus lw_robot_momentum(struct LwRobot *robot,
                                const double *v,
                                size_t n,
                                double *out);

// The centroidal momentum matrix at the robot's q, with what is held, into `A` (6 rows of nv, row after row; `n` = 6 nv): rates to what `lw_robot_momentum` gives. Its last three rows,
// divided by the mass of `lw_robot_center_of_mass`, are the Jacobian of the centre of mass.
enum LwStatus lw_robot_centroidal_matrix(struct LwRobot *robot,
                                         double *A,
                                         size_t n);

// Forces of rates and gravity, into `tau`, at the robot's q and rates `v` (`n` = nv each), with what is held: what is left of the equations of motion without accelerations. Accelerations that the
// tips of `count` chains (at most as many as the model has parts) have while no rate changes into `tips` (6 numbers each: angular, rad/s^2, then linear, m/s^2, of the tip's origin, world axes).
enum LwStatus lw_robot_bias(struct LwRobot *robot,
                            const double *v,
                            size_t n,
                            const uint32_t *parts,
                            size_t count,
                            double *tau,
                            double *tips);

// Memory of `lw_predictor_step`, into `out`; free it with `lw_predictor_free`. It serves every robot of the same model.
enum LwStatus lw_predictor_new(struct LwRobot *robot,
                               struct LwPredictor **out);

// Frees it; NULL is none.
void lw_predictor_free(struct LwPredictor *predictor);

// A state of an estimator goes on by `step` seconds, in place: `q` (`nq`), rates `v` (`nv`) and the `covariance` of their errors (2 nv rows of 2 nv, row after row: errors of q along v, then
// those of v), under the forces `tau` (`nv`) and white noise of these with the spectral densities `density` (`nv`; (N m)^2 s and N^2 s; not negative), with what is held and the robot's
// gravity. By the midpoint rule, of second order. The robot's own q does not matter. `LW_STATUS_SINGULAR` where a joint has nothing to move.
enum LwStatus lw_predictor_step(struct LwRobot *robot,
                                struct LwPredictor *predictor,
                                double *q,
                                size_t nq,
                                double *v,
                                size_t nv,
                                double *covariance,
                                const double *tau,
                                const double *density,
                                double step);

// How errors before the last step became errors after it, into `F` (2 nv rows of 2 nv, row after row; `n` = 4 nv nv): zero before the first one.
enum LwStatus lw_predictor_transition(struct LwRobot *robot,
                                      struct LwPredictor *predictor,
                                      double *F,
                                      size_t n);

// Whether two colliders that meet touch or overlap at `q` (`n` = nq), padding counted, into `out`; what hands hold goes with them. A pair that touches into
// `pair` (NULL: not asked for), where there is one.
enum LwStatus lw_robot_collides(struct LwRobot *robot,
                                const double *q,
                                size_t n,
                                bool *out,
                                struct LwPair *pair);

// Whether two colliders that meet touch or overlap at each of many configurations, `q` (`n` = rows · nq numbers, row after row), into `out` (`rows`): each answer is that of
// `lw_robot_collides`. Other threads may take part of the rows with clones of the robot.
enum LwStatus lw_robot_collides_all(struct LwRobot *robot,
                                    const double *q,
                                    size_t n,
                                    bool *out,
                                    size_t rows);

// The nearest pair of colliders that meet at `q` (`n` = nq), within `limit` (m, may be infinite), into `out`.
enum LwStatus lw_robot_clearance(struct LwRobot *robot,
                                 const double *q,
                                 size_t n,
                                 double limit,
                                 struct LwClosest *out);

// The distance of two colliders at `q` (`n` = nq), whether they meet, and are shown, or not, with the nearest points, into `out`; padding counted. Not `found` where one is a cloud or a map with nothing in it, or
// both have no end.
enum LwStatus lw_robot_distance(struct LwRobot *robot,
                                const double *q,
                                size_t n,
                                uint32_t a,
                                uint32_t b,
                                struct LwClosest *out);

// The distances of all pairs that are looked at and within `limit` (m, may be infinite) at `q` (`n` = nq), in the order of colliders, into `out`, and how many there are into `count`. Where they are more
// than `room`, `LW_STATUS_NO_ROOM`, and `count` alone is written. Takes memory until that of pairs has its size.
enum LwStatus lw_robot_distances(struct LwRobot *robot,
                                 const double *q,
                                 size_t n,
                                 double limit,
                                 struct LwClosest *out,
                                 size_t room,
                                 size_t *count);

// All pairs that touch or overlap at `q` (`n` = nq), into `pairs`, and how many there are into `count`; padding counted. Where they are more than `room`, `LW_STATUS_NO_ROOM`, and `count`
// alone is written. Takes memory until that of pairs has its size. Whether there is any, `lw_robot_collides` tells sooner.
enum LwStatus lw_robot_hits(struct LwRobot *robot,
                            const double *q,
                            size_t n,
                            struct LwPair *pairs,
                            size_t room,
                            size_t *count);

// Which shapes all questions of collisions take from now on: one of `LW_DETAIL_..`; the fine ones at first.
enum LwStatus lw_robot_set_detail(struct LwRobot *robot,
                                  uint32_t detail);

// As `lw_robot_set_detail`, of one collider.
enum LwStatus lw_robot_set_detail_of(struct LwRobot *robot, uint32_t collider, uint32_t detail);

// Whether a pair is looked at now when both are shown, into `out`.
enum LwStatus lw_robot_looks_at(struct LwRobot *robot, uint32_t a, uint32_t b, bool *out);

// Thickness around a collider from now on, m.
enum LwStatus lw_robot_pad(struct LwRobot *robot, uint32_t collider, double padding);

// As `lw_robot_pad`, of `n` colliders at once: those of a part (`lw_model_part_colliders`) or of an object. All of them, or on a mistake none.
// Takes memory for more names than there are colliders.
enum LwStatus lw_robot_pad_all(struct LwRobot *robot,
                               const uint32_t *colliders,
                               size_t n,
                               double padding);

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

// Whether a cell of a voxel map (3 indices along x, y, z from 0) is occupied now, into `out`.
enum LwStatus lw_robot_cell(struct LwRobot *robot,
                            uint32_t collider,
                            const uint32_t *cell,
                            bool *out);

// How many points a cloud has now, or occupied cells a voxel map, into `count`.
enum LwStatus lw_robot_count(struct LwRobot *robot, uint32_t collider, size_t *count);

// Whether the way from `qa` to `qb` (`n` = nq each) touches nothing, all coordinates moving in proportion, into `out`: proven, not sampled; what hands hold goes with them. Pieces shorter than
// `least` (a part of the way, 1e-9 to 1; 1e-3 is usual) are not cut again. At most so many `pieces` are looked at (SIZE_MAX: all). The robot's own q does not matter.
// `LW_STATUS_OUT_OF_RANGE` also for an end beyond the limits of a slider.
enum LwStatus lw_robot_path_free(struct LwRobot *robot,
                                 const double *qa,
                                 const double *qb,
                                 size_t n,
                                 double least,
                                 size_t pieces,
                                 struct LwPath *out);

// Goes on with the path of the last `lw_robot_path_free` that was left unfinished, for so many pieces, with the robot as it was then. Portions do not change the answer.
// `LW_STATUS_NO_SEARCH` when there is none.
enum LwStatus lw_robot_path_free_on(struct LwRobot *robot,
                                    size_t pieces,
                                    struct LwPath *out);

// Memory of searches for ways of a chain of pins, sliders and screws, with room for so many configurations (2 to 1048576) in each of two trees, into `out`; free it with `lw_planner_free`.
// It serves every robot of the same model.
enum LwStatus lw_planner_new(struct LwRobot *robot,
                             uint32_t part,
                             size_t configurations,
                             struct LwPlanner **out);

// Frees it; NULL is none.
void lw_planner_free(struct LwPlanner *planner);

// Looks for a free way of the chain from `start` to `goal` (`n` = nq each, within limits; they differ in the chain's coordinates alone) with at most so many random `places` in this call
// (SIZE_MAX: until it ends), into `out`. `search`: NULL for seed 1, steps of 0.5 and pieces down to 1e-3. What hands hold goes with them; the robot's own q does not matter. *Not found*
// is an answer, not an error.
enum LwStatus lw_planner_plan(struct LwRobot *robot,
                              struct LwPlanner *planner,
                              const double *start,
                              const double *goal,
                              size_t n,
                              const struct LwSearch *search,
                              size_t places,
                              struct LwPlan *out);

// Goes on with an unfinished search for at most so many random places, with the robot as it was at its begin. Portions do not change what is found.
enum LwStatus lw_planner_resume(struct LwRobot *robot,
                                struct LwPlanner *planner,
                                size_t places,
                                struct LwPlan *out);

// The way that was found last, into `way`: configurations (nq numbers each) from the start to the goal, one after the other, between which all coordinates move in proportion; `n`: nq times the
// `rows` of `LwPlan`.
enum LwStatus lw_planner_path(struct LwRobot *robot,
                              struct LwPlanner *planner,
                              double *way,
                              size_t n);

// Memory of `lw_timing_plan` for ways of so many configurations (at least 2) in so many sections (at least 8 for each, 1048576 at most; twenty are few, a hundred are many), into `out`; free it with
// `lw_timing_free`. It serves every robot of the same model.
enum LwStatus lw_timing_new(struct LwRobot *robot,
                            size_t configurations,
                            size_t sections,
                            struct LwTiming **out);

// Frees it; NULL is none.
void lw_timing_free(struct LwTiming *timing);

// Times a way from rest to rest as fast as limits allow, into `out`: whole configurations (nq numbers each) one after the other in `way` (`n` numbers), as `lw_planner_path` gives them. Where `round` is
// zero the motion stands still at each corner; else corners are rounded so that no point is farther than `round` from the way (root of the sum of squares of coordinates, rad and m): then
// ask `lw_timing_path_free`. `limits`: NULL for those of the model; limits of jerk do not count. With what is held; the robot's own q does not matter. *No motion keeps the limits* is an answer,
// not an error. A call that fails may forget the way that was timed before.
enum LwStatus lw_timing_plan(struct LwRobot *robot,
                             struct LwTiming *timing,
                             const double *way,
                             size_t n,
                             const struct LwMotionLimits *limits,
                             double round,
                             struct LwTimed *out);

// Configuration into `q` (`nq`), rates into `v` and accelerations into `vdot` (`nv` each) at a time, s, of the way that was timed last: before its beginning and after its end it stands still.
// `LW_STATUS_NO_SEARCH` when there is none.
enum LwStatus lw_timing_at(struct LwRobot *robot,
                           struct LwTiming *timing,
                           double time,
                           double *q,
                           size_t nq,
                           double *v,
                           double *vdot,
                           size_t nv);

// The configuration, into `q` (`n` = nq), at a part (0 to 1) of the length of the way that was given last.
enum LwStatus lw_timing_place(struct LwRobot *robot,
                              struct LwTiming *timing,
                              double part,
                              double *q,
                              size_t n);

// Whether the way that was given last touches nothing, with its corners as they are rounded, into `out`: as `lw_robot_path_free`, whose `least` counts for each piece; never unfinished.
enum LwStatus lw_timing_path_free(struct LwRobot *robot,
                                  struct LwTiming *timing,
                                  double least,
                                  struct LwPath *out);

// Memory of `lw_transfer_plan`, into `out`; free it with `lw_transfer_free`. It serves every robot of the same model.
enum LwStatus lw_transfer_new(struct LwRobot *robot,
                              struct LwTransfer **out);

// Frees it; NULL is none.
void lw_transfer_free(struct LwTransfer *transfer);

// The fastest motion between two states within limits of rate, acceleration and jerk, all coordinates arriving together, into `out`; limits of effort do not count, and nothing is asked of
// colliders. Every coordinate that moves needs limits of rate, acceleration and jerk; those of ball and free hinges have to be the same at both ends, and at rest.
// `LW_STATUS_SINGULAR` where the search fails by round-off (the one failure that allocates): then, too, the motion of before is gone.
enum LwStatus lw_transfer_plan(struct LwRobot *robot,
                               struct LwTransfer *transfer,
                               const struct LwMotionState *from,
                               const struct LwMotionState *to,
                               const struct LwMotionLimits *limits,
                               struct LwTransferred *out);

// Configuration into `q` (`nq`), rates into `v` and accelerations into `vdot` (`nv` each) at a time, s, of the transfer that was planned last: after its end the rates there go on.
// `LW_STATUS_NO_SEARCH` when there is none.
enum LwStatus lw_transfer_at(struct LwRobot *robot,
                             struct LwTransfer *transfer,
                             double time,
                             double *q,
                             size_t nq,
                             double *v,
                             double *vdot,
                             size_t nv);

// A problem of `n` unknowns with room for so many `rows` in one level and so many `bounds` (1024 each at most), into `out`; free it with `lw_priorities_free`. No later call allocates.
enum LwStatus lw_priorities_new(size_t n,
                                size_t rows,
                                size_t bounds,
                                struct LwPriorities **out);

// Frees it; NULL is none.
void lw_priorities_free(struct LwPriorities *problem);

// As `lw_builder_message`, of a problem.
enum LwStatus lw_priorities_message(const struct LwPriorities *problem,
                                    char *buffer,
                                    size_t room,
                                    size_t *wanted);

// Begins anew: no bounds, no levels, x = 0.
enum LwStatus lw_priorities_begin(struct LwPriorities *problem);

// A bound c x <= `most` (infinite: none) that all levels afterwards keep: `c` has `n` numbers. Give bounds before the first level.
enum LwStatus lw_priorities_bound(struct LwPriorities *problem,
                                  const double *c,
                                  size_t n,
                                  double most);

// The next level: `A` (`rows` times n numbers, row after row) and `b` (`rows`), met in the sense of least squares as far as bounds and the levels before leave it. How far it is from being met, |A x - b|, into `residual`, and
// how many directions of x are left for levels afterwards into `left` (NULL: not asked for). `LW_STATUS_SINGULAR` when bounds contradict each other or what levels before have settled: begin anew.
enum LwStatus lw_priorities_level(struct LwPriorities *problem,
                                  const double *A,
                                  const double *b,
                                  size_t rows,
                                  double *residual,
                                  size_t *left);

// The unknowns that meet all levels until now as well as can be, into `x` (`n`).
enum LwStatus lw_priorities_x(struct LwPriorities *problem, double *x, size_t n);

// Moves `s` (`n` numbers) to the minimum of s N s / 2 - r s between `lower` and `upper`, from where it is: `normal` is N (n rows of n, row after row, symmetric with a positive diagonal), `right` r
// (`n`). It ends after `most` iterations of an active set (sweeps, above 64 numbers), or when no number alone would move by more than `settled`; how many it took into `sweeps` (NULL: not asked for). Cost of each: n^2. No handle has a message of it.
enum LwStatus lw_bounded(const double *normal,
                         const double *right,
                         size_t n,
                         double lower,
                         double upper,
                         size_t most,
                         double settled,
                         double *s,
                         size_t *sweeps);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* LINKWORK_ROBOT_H */
