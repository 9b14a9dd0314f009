/* The embedded robot model for C11: see README.md. Made of the Rust sources by cbindgen: a change here is lost. */

#ifndef LINKWORK_ROBOT_H
#define LINKWORK_ROBOT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

// The roots of the file are connected to the world as its format defines (URDF: welded).
#define LW_ROOT_AS_WRITTEN 0

// The roots of the file are welded to the world.
#define LW_ROOT_FIXED 1

// The roots of the file move freely.
#define LW_ROOT_FREE 2

// The roots of the file move in the xy plane of the world.
#define LW_ROOT_PLANAR 3

// Inertias that no rigid body can have are read: moments that violate the triangle inequality unchanged, negative moments as 0, and inertias without
// mass are ignored. `lw_model_doubtful` lists them.
#define LW_INERTIA_WARN 0

// Inertias that no rigid body can have are errors.
#define LW_INERTIA_PHYSICAL 1

// Principal moments may violate the triangle inequality, as in some published data, but must not be negative.
#define LW_INERTIA_POSITIVE_MOMENTS 2

// A sphere about the origin: `size` = radius, unused, unused.
#define LW_SHAPE_SPHERE 0

// A box about the origin: `size` = half of its edges along x, y, z.
#define LW_SHAPE_BOX 1

// A capsule along the z axis: `size` = radius, half of the length of its axis, unused.
#define LW_SHAPE_CAPSULE 2

// A cylinder along the z axis: `size` = radius, half of its length, unused.
#define LW_SHAPE_CYLINDER 3

// The half space z <= 0: `size` is unused.
#define LW_SHAPE_HALF_SPACE 4

// An ellipsoid about the origin: `size` = half of its axes along x, y, z.
#define LW_SHAPE_ELLIPSOID 5

// The body is welded to its parent.
#define LW_HINGE_LOCKED 0

// Rotation about `axis`: 1 number of q, rad.
#define LW_HINGE_PIN 1

// Translation along `axis`: 1 number of q, m.
#define LW_HINGE_SLIDER 2

// Rotation about `axis` with an advance along it of `pitch`: 1 number of q, rad.
#define LW_HINGE_SCREW 3

// Translation along `axis` and rotation about it: 2 numbers of q, m and rad.
#define LW_HINGE_CYLINDRICAL 4

// Rotation about `axis`, then about `second`, which moves with the body: 2 numbers of q, rad.
#define LW_HINGE_UNIVERSAL 5

// Rotation about the moving x, y and z axes: 3 numbers of q, rad.
#define LW_HINGE_GIMBAL 6

// Translation along x and y, then rotation about z: 3 numbers of q, m and rad.
#define LW_HINGE_PLANAR 7

// Any rotation: 4 numbers of q, a quaternion x y z w, and 3 degrees of freedom.
#define LW_HINGE_BALL 8

// Any motion: 7 numbers of q, position and quaternion, and 6 degrees of freedom.
#define LW_HINGE_FREE 9

// Bodies that a hinge joins are not checked against each other, except for pairs of `lw_builder_collide`. This is the default.
#define LW_NEIGHBOURS_PASS 0

// Bodies that a hinge joins are checked against each other.
#define LW_NEIGHBOURS_COLLIDE 1

// All six rows of a Jacobian; the angular rows are multiplied by a length.
#define LW_ROWS_ALL 0

// The three linear rows.
#define LW_ROWS_LINEAR 1

// The three angular rows.
#define LW_ROWS_ANGULAR 2

// Task: motion of the tip of a chain, in the world.
#define LW_OBJECTIVE_TIP 0

// Task: motion of the centre of mass of all moving bodies, including held objects.
#define LW_OBJECTIVE_CENTER 1

// Task: motion of all degrees of freedom.
#define LW_OBJECTIVE_POSTURE 2

// The goal has a position.
#define LW_GOAL_POSITION 1

// The goal has an orientation.
#define LW_GOAL_ORIENTATION 2

// The goal is in the frame of the chain's base instead of the world.
#define LW_GOAL_IN_BASE 4

// The position must lie in the plane through the given position with the normal `direction`.
#define LW_GOAL_PLANE 8

// The position must lie on the line through the given position along `direction`.
#define LW_GOAL_LINE 16

// Instead of an orientation, `axis` points along the direction `towards`, for example for welding and drilling.
#define LW_GOAL_AXIS 32

// Instead of an orientation, `axis` points at the point `towards`.
#define LW_GOAL_LOOK_AT 64

// In `LwTipGoal.seen_from`: the goal is in the world, or in the chain's base with `LW_GOAL_IN_BASE`.
#define LW_NO_PART UINT32_MAX

// Argument of `lw_robot_attach`: the object itself carries, not one of the bodies that hang on it.
#define LW_ITSELF UINT32_MAX

// Minimize the sum of squares of the forces.
#define LW_BALANCE_EQUAL 0

// Minimize the sum of squares of the forces divided by the effort limits.
#define LW_BALANCE_EFFORT 1

// Use the fine shapes of colliders.
#define LW_DETAIL_FINE 0

// Use the coarse shapes of colliders that have one.
#define LW_DETAIL_COARSE 1

// Result of a call. After every code except `LW_STATUS_OK` nothing has been changed or written, unless a function's documentation says otherwise.
typedef enum LwStatus {
  // The call succeeded.
  LW_STATUS_OK,
  // A pointer is NULL.
  LW_STATUS_NULL,
  // A pointer is not aligned to its type.
  LW_STATUS_MISALIGNED,
  // Memory to read and memory to write overlap.
  LW_STATUS_OVERLAP,
  // A text is not UTF-8.
  LW_STATUS_TEXT,
  // An array, or memory for a text, does not have the required length.
  LW_STATUS_LENGTH,
  // A number is NaN or infinite.
  LW_STATUS_NOT_FINITE,
  // A number is outside its range.
  LW_STATUS_OUT_OF_RANGE,
  // The name does not exist.
  LW_STATUS_UNKNOWN,
  // The part, object, body or collider does not belong to this model.
  LW_STATUS_FOREIGN,
  // The part is not a chain.
  LW_STATUS_NOT_A_CHAIN,
  // There is no search, path or motion to continue or to read.
  LW_STATUS_NO_SEARCH,
  // The inverse kinematics of the chain has no closed form.
  LW_STATUS_NO_CLOSED_FORM,
  // The start of inverse kinematics is outside the limits.
  LW_STATUS_OUTSIDE_LIMITS,
  // More items than were reserved.
  LW_STATUS_NO_ROOM,
  // A hand already holds the object, or it is attached to another one.
  LW_STATUS_HELD,
  // No hand holds the object, or it is not attached to another one.
  LW_STATUS_NOT_HELD,
  // The hand does not hold this object.
  LW_STATUS_EMPTY_HAND,
  // The hand already holds an object.
  LW_STATUS_HAND_FULL,
  // The second hand is not at the pose that its grasp requires.
  LW_STATUS_LOOP_OPEN,
  // No configuration within limits closes the loop of two hands, a loop or a coupling of the mechanism; or a call would open one.
  LW_STATUS_DOES_NOT_CLOSE,
  // Equations have no unique solution.
  LW_STATUS_SINGULAR,
  // Files, parts, objects or shapes do not form a valid model.
  LW_STATUS_MODEL,
  // Another thread is in a call with this handle. The handle's message does not change.
  LW_STATUS_BUSY,
  // A bug in this library: a call with this handle panicked. All later calls with this robot or builder return this code.
  LW_STATUS_PANICKED,
} LwStatus;

// Result of a search.
typedef enum LwOutcome {
  // The goal is met within the tolerances.
  LW_OUTCOME_MET,
  // No start led to the goal. This is the nearest configuration of all starts.
  LW_OUTCOME_NEAREST,
  // The limit of evaluations was reached; `lw_robot_resume_inverse_kinematics` continues.
  LW_OUTCOME_UNFINISHED,
} LwOutcome;

// Result of a collision check of a path.
typedef enum LwPathOutcome {
  // The whole path is proven free.
  LW_PATH_OUTCOME_FREE,
  // Two colliders touch.
  LW_PATH_OUTCOME_HIT,
  // No collision was found, but some pieces of the minimum length could not be proven free.
  LW_PATH_OUTCOME_UNDECIDED,
  // The requested number of pieces was checked; `lw_robot_path_free_on` continues.
  LW_PATH_OUTCOME_UNFINISHED,
} LwPathOutcome;

// Result of path planning.
typedef enum LwPlanOutcome {
  // A path was found that is free from end to end; `lw_planner_path` returns it.
  LW_PLAN_OUTCOME_FOUND,
  // The start is in collision.
  LW_PLAN_OUTCOME_BLOCKED_START,
  // The goal is in collision.
  LW_PLAN_OUTCOME_BLOCKED_GOAL,
  // The memory was used up. A path may or may not exist.
  LW_PLAN_OUTCOME_NOT_FOUND,
  // The requested number of samples was used; `lw_planner_resume` continues.
  LW_PLAN_OUTCOME_UNFINISHED,
} LwPlanOutcome;

// A model under construction. Use it from one thread at a time.
typedef struct LwBuilder LwBuilder;

// Constant data of a robot. Any number of threads may use it at once. The message is that of the last failed call of any of them; `lw_model_clone`
// gives a thread a handle with its own message.
typedef struct LwModel LwModel;

// Memory of path planning for one chain. Use it for robots of one model, with one call at a time.
typedef struct LwPlanner LwPlanner;

// Memory of state prediction. Use it for robots of one model, with one call at a time.
typedef struct LwPredictor LwPredictor;

// A prioritized least-squares problem: unknowns x with bounds c x <= d, and levels A x = b. A level never degrades the levels before it. Use it from
// one thread at a time.
typedef struct LwPriorities LwPriorities;

// Memory of a rate controller. Use it for robots of one model, with one call at a time.
typedef struct LwRateControl LwRateControl;

// One instance of a model, with all memory of its calls. Use it from one thread at a time: a call that finds another one in progress returns
// `LW_STATUS_BUSY`. Robots of one model are independent.
typedef struct LwRobot LwRobot;

// Operational space of some tips, with its memory. Use it for robots of one model, with one call at a time.
typedef struct LwTaskSpace LwTaskSpace;

// Memory of time parameterizations. Use it for robots of one model, with one call at a time.
typedef struct LwTiming LwTiming;

// Memory of transfers. Use it for robots of one model, with one call at a time.
typedef struct LwTransfer LwTransfer;

// Memory of a whole-body controller. Use it for robots of one model, with one call at a time.
typedef struct LwWholeBody LwWholeBody;

// Solver for whole-body inverse kinematics, with its memory. Use it for robots of one model, with one call at a time.
typedef struct LwWholeBodyIk LwWholeBodyIk;

// A pose of a frame in another frame.
typedef struct LwPose {
  // Position x, y, z, m.
  double position[3];
  // Quaternion x, y, z, w; of length 1 within 1e-6.
  double quaternion[4];
} LwPose;

// A shape in its own frame.
typedef struct LwShape {
  // One of `LW_SHAPE_...`.
  uint32_t kind;
  // Dimensions, m, as defined by the kind; unused ones are zero.
  double size[3];
} LwShape;

// Hinge between a body and its parent. Unused fields must be zero.
typedef struct LwHinge {
  // One of `LW_HINGE_...`.
  uint32_t kind;
  // Axis of a pin, slider, screw, cylindrical or universal hinge, of any length except zero, in the hinge's frame.
  double axis[3];
  // The second axis of a universal hinge, of any length except zero.
  double second[3];
  // Pitch of a screw, m/rad.
  double pitch;
} LwHinge;

// A wrench that the tip of a part exerts on its surroundings.
typedef struct LwPush {
  // Moment about `at`, world axes, N m.
  double moment[3];
  // Force, world axes, N.
  double force[3];
  // Point of application in the tip's frame, m.
  double at[3];
  // The part, a chain.
  uint32_t part;
} LwPush;

// Manipulability of a tip at one configuration. For joint rates of length 1 the tip's speed along a unit vector u is at most 1 / sqrt(sum of (a_k .
// u / s_k)^2). For joint forces of length 1 its force is at most 1 / sqrt(sum of (a_k . u)^2 s_k^2). Here a_k are the axes and s_k the singular
// values.
typedef struct LwManipulability {
  // The product of the singular values; 0 at a singular configuration.
  double w;
  // Singular values, largest first; for three rows the last three are zero.
  double singular_values[6];
  // Six rows of six, row after row. Column k is the axis of singular value k over the selected rows, angular ones first if there are six. For
  // three rows only the upper left 3 by 3 block is used.
  double axes[36];
} LwManipulability;

// Impedance of a tip: a spring and a damper between the tip and its desired motion.
typedef struct LwImpedance {
  // Desired pose of the tip in the world.
  struct LwPose pose;
  // Desired twist of the tip: angular (rad/s), linear (m/s), at its origin, world axes.
  double twist[6];
  // Desired acceleration of the tip, rad/s^2 and m/s^2.
  double acceleration[6];
  // Stiffness about world x, y, z (N m/rad), then along x, y, z (N/m); not negative.
  double stiffness[6];
  // Damping in the same order (N m s/rad, N s/m); not negative.
  double damping[6];
} LwImpedance;

// One task: desired rates (`lw_rate_control_solve`) or desired accelerations (`lw_whole_body_solve`). Fields that its kind does not use are not
// read.
typedef struct LwObjective {
  // One of `LW_OBJECTIVE_..`.
  uint32_t kind;
  // Priority level. Lower levels come first; tasks of the same level are met together in the least-squares sense.
  uint32_t level;
  // Weight within its level; above zero.
  double weight;
  // Tip and centre of mass: desired angular (rad/s or rad/s^2), then linear motion (m/s or m/s^2), world axes; at the tip's origin. The centre of
  // mass uses only the linear part.
  double motion[6];
  // Tip: length that scales angular rows, m, if all rows are selected.
  double length;
  // Tip: the chain.
  uint32_t part;
  // Tip: selected rows, one of `LW_ROWS_..`.
  uint32_t rows;
  // Posture: rates or accelerations of all degrees of freedom.
  const double *posture;
  // Posture: number of values, nv.
  size_t posture_count;
} LwObjective;

// A chain whose manipulability must not fall below a limit.
typedef struct LwGuard {
  // Smallest permitted w (`lw_robot_manipulability` of all six rows with length 1 m).
  double least;
  // The chain.
  uint32_t part;
} LwGuard;

// A contact point of a tip that presses on a surface and does not slip.
typedef struct LwTouch {
  // Point of application in the tip's frame, m.
  double at[3];
  // Normal of the surface, towards the robot, of length 1, world axes.
  double normal[3];
  // Friction coefficient, above zero.
  double friction;
  // Largest normal force, N, above zero; infinite for no limit.
  double most;
  // The chain whose tip is in contact.
  uint32_t part;
} LwTouch;

// Residuals of a whole-body solution. All zero: all requirements are met.
typedef struct LwBalanced {
  // Forces that the contacts cannot provide: Euclidean norm of the residual forces at degrees of freedom without an actuator, N m and N.
  double unbalanced;
  // Residual acceleration of contact points, m/s^2; not zero if contacts contradict each other.
  double slipping;
  // Fraction by which all effort and normal force limits would have to be larger.
  double shortfall;
} LwBalanced;

// Tolerances and limits of the work of inverse kinematics. The work is counted, not timed.
typedef struct LwEffort {
  // Largest errors of position, m, and of orientation, rad.
  double tolerances[2];
  // Maximum number of steps from one start.
  size_t steps;
  // Number of additional starts, the same for each search. A quarter of them is used for a position that is out of reach because of the link
  // lengths.
  size_t restarts;
  // Maximum number of kinematics evaluations in one call.
  size_t kinematics;
} LwEffort;

// Goal of a tip. Fields that are not selected in `parts` are not read.
typedef struct LwGoal {
  // Position and orientation.
  struct LwPose pose;
  // Weights of 1 m and 1 rad in the sum of squares; positive.
  double weights[2];
  // A sum of `LW_GOAL_...`.
  uint32_t parts;
  // Normal of a plane or direction of a line, of length 1, in the frame of the pose.
  double direction[3];
  // The pointing axis, of length 1, in the tip's frame. The rotation about it is free.
  double axis[3];
  // Its target: a direction of length 1, or a point, m, in the frame of the pose.
  double towards[3];
  // Half of the opening angle of the cone about the target in which every direction is accepted, rad, 0 to pi; 0: only the target itself.
  double within;
} LwGoal;

// Result of inverse kinematics, in addition to q.
typedef struct LwAnswer {
  // Residual distance of the tip from its goal, m; undefined when unfinished.
  double position;
  // Residual angle, rad; undefined when unfinished.
  double orientation;
  // Kinematics evaluations since the search began.
  size_t kinematics;
  // Index of the start that led there; 0 is the given start.
  size_t restart;
  // Result of the search.
  enum LwOutcome outcome;
} LwAnswer;

// Secondary cost of configurations that meet a goal, and the amount of search. The cost is `centred` / 2 times the sum of ((q - middle) / (upper -
// lower))^2, plus `near` / 2 times the sum of ((q - given) / (upper - lower))^2, minus `manipulable` times ln w.
typedef struct LwPrefer {
  // Weight of the distance from the middle of the limits; not negative.
  double centred;
  // Weight of the distance from the configuration that the search is given; not negative.
  double near;
  // Weight of ln w (`lw_robot_manipulability`); not negative. One of the three weights must be above zero.
  double manipulable;
  // Length that scales angular rows in w, m; above zero.
  double length;
  // Number of starts: the given one and others, the same for each search; at least one is made.
  size_t starts;
  // Maximum number of kinematics evaluations for the improvement of each solution; usually 400.
  size_t steps;
} LwPrefer;

// Result of a search with a secondary cost.
typedef struct LwBest {
  // The minimized cost; infinite when the goal is not met.
  double cost;
  // Number of starts that led to the goal.
  size_t solutions;
  // Total number of kinematics evaluations.
  size_t kinematics;
  // `LW_OUTCOME_MET`, or `LW_OUTCOME_NEAREST` when no start led to the goal.
  enum LwOutcome outcome;
} LwBest;

// Goal of the tip of a chain, one of several.
typedef struct LwTipGoal {
  // The goal of its tip.
  struct LwGoal goal;
  // The chain.
  uint32_t part;
  // The chain relative to whose tip the goal is given, even if that tip moves; `LW_NO_PART`: none.
  uint32_t seen_from;
} LwTipGoal;

// Rank and mobility of a closed loop.
typedef struct LwClosure {
  // Number of equations of the loop.
  uint32_t rows;
  // Number of independent equations in this configuration.
  uint32_t rank;
  // Remaining degrees of freedom of the chains and joints in the loop.
  uint32_t mobility;
} LwClosure;

// The hands that hold an object.
typedef struct LwHold {
  // Number of hands: 0, 1 or 2. Unused entries are zero.
  uint32_t count;
  // The hand that carries it in the mechanism, then the second hand, as parts.
  uint32_t hands[2];
  // Pose of the object in the frames of the hands' tips.
  struct LwPose at[2];
} LwHold;

// A moment and a force.
typedef struct LwWrench {
  // Moment, world axes, N m.
  double moment[3];
  // Force, world axes, N.
  double force[3];
} LwWrench;

// Result of load sharing between two hands.
typedef struct LwShared {
  // Wrench of the second hand on the object, about this hand's tip.
  struct LwWrench second;
  // The minimized sum.
  double cost;
  // The largest |tau| / limit over all joints of both chains that have an effort limit. Above 1 the joints cannot exert these forces.
  double largest_share;
} LwShared;

// Wrenches of two hands on an object, separated: first hand, then second hand, each about its own tip.
typedef struct LwHandWrenches {
  // The part that moves the object.
  struct LwWrench moving[2];
  // The part that only squeezes it.
  struct LwWrench squeezing[2];
  // Net wrench, about the object's origin.
  struct LwWrench net;
} LwHandWrenches;

// Friction contact of a hand: a patch with uniform pressure.
typedef struct LwFriction {
  // Direction in which the hand presses on the object, in the tip's axes; any length except zero.
  double normal[3];
  // Coefficient of friction, above zero.
  double coefficient;
  // Radius of the contact patch, m, above zero.
  double radius;
  // Largest normal force, N, above zero; infinite for no limit.
  double most;
} LwFriction;

// Wrenches of two hands under which neither slips.
typedef struct LwGripped {
  // Wrenches on the object: first hand, then second hand, each about its own tip.
  struct LwWrench wrenches[2];
  // 0 if neither hand slips. Otherwise no such wrenches exist, and this is the smallest force, N, by which cones and limits would have to be
  // enlarged; `wrenches` are those for the enlarged cones.
  double shortfall;
} LwGripped;

// The inertia of a rigid body.
typedef struct LwInertia {
  // Mass, kg.
  double mass;
  // From the origin to the centre of mass, m.
  double center[3];
  // Inertia about the origin (not about the centre of mass), row after row, kg m^2.
  double inertia[9];
} LwInertia;

// Two colliders.
typedef struct LwPair {
  // The first collider.
  uint32_t a;
  // The second collider.
  uint32_t b;
} LwPair;

// Distance of two colliders.
typedef struct LwClosest {
  // Distance, m, including padding; negative for overlap.
  double distance;
  // Closest point on the first collider, world, m.
  double point_a[3];
  // Closest point on the second collider, world, m.
  double point_b[3];
  // The first collider.
  uint32_t a;
  // The second collider.
  uint32_t b;
  // True if there is such a pair; otherwise all other fields are zero.
  bool found;
} LwClosest;

// Result of a collision check of a path, with its position.
typedef struct LwPath {
  // Position on the path, from 0 at its start to 1 at its end, where two colliders touch, or of the first undecided piece; otherwise 0.
  double at;
  // The two colliders that touch there; otherwise zero.
  struct LwPair pair;
  // The result.
  enum LwPathOutcome outcome;
} LwPath;

// Settings of path planning.
typedef struct LwSearch {
  // Seed of the random samples. The same seed gives the same path.
  uint64_t seed;
  // Longest piece, as the largest change of one coordinate, rad or m; above zero.
  double step;
  // Fraction of a piece that is not halved again, as in `lw_robot_path_free`.
  double least;
} LwSearch;

// Result of path planning, with the size of the path.
typedef struct LwPlan {
  // Number of configurations, including both ends; 0 when no path was found.
  size_t rows;
  // The two colliders that touch at a blocked end; otherwise zero.
  struct LwPair pair;
  // Result of the search.
  enum LwPlanOutcome outcome;
} LwPlan;

// Limits of a motion: one number for each degree of freedom, above zero, infinite for no limit. All arrays have the same length.
typedef struct LwMotionLimits {
  // Rate limits, rad/s or m/s; NULL: those of the model.
  const double *rate;
  // Acceleration limits, rad/s^2 or m/s^2; NULL: no limits.
  const double *acceleration;
  // Jerk limits, rad/s^3 or m/s^3; NULL: no limits.
  const double *jerk;
  // Effort limits, N m or N; NULL: those of the model. If all are infinite, no dynamics is computed.
  const double *effort;
  // Length of the arrays, nv.
  size_t n;
} LwMotionLimits;

// Result of a time parameterization.
typedef struct LwTimed {
  // Duration of the motion, s.
  double duration;
  // If no motion keeps the limits: position on the path where they cannot be kept, as a fraction of its length (`lw_timing_place`).
  double part;
  // If no motion keeps the limits: smallest factor for all limits of acceleration and effort with which a motion exists.
  double share;
  // True if a motion keeps the limits. Fields that do not apply are zero.
  bool found;
} LwTimed;

// State of a robot: configuration and motion.
typedef struct LwMotionState {
  // Configuration.
  const double *q;
  // Length of `q`, nq.
  size_t nq;
  // Rates; NULL: at rest.
  const double *v;
  // Accelerations; NULL: zero.
  const double *vdot;
  // Length of `v` and `vdot`, nv.
  size_t nv;
} LwMotionState;

// Result of planning a transfer.
typedef struct LwTransferred {
  // Duration of the motion, s.
  double duration;
  // If the motion leaves the position limits of a coordinate: its extreme value, rad or m.
  double value;
  // If the motion leaves the position limits of a coordinate: index of that coordinate among the degrees of freedom.
  size_t dof;
  // True if all coordinates stay within their limits. Fields that do not apply are zero.
  bool within_limits;
} LwTransferred;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

// Returns the text of a code; do not free it. Returns "unknown code" for a number that is not a code.
const char *lw_status_text(int32_t code);

// Returns the version of this library as `major.minor.patch`; do not free it.
const char *lw_version(void);

// Creates an empty builder and writes it to `out`; free it with `lw_builder_free`.
enum LwStatus lw_builder_new(struct LwBuilder **out);

// Frees a builder; NULL has no effect. Models that it made remain valid.
void lw_builder_free(struct LwBuilder *builder);

// Copies the message of the last failed call with this builder, with its terminating zero, into `buffer` of `room` bytes: place, fact and remedy;
// empty when no call failed. Writes the required size to `wanted` (may be NULL). Returns `LW_STATUS_LENGTH` when the message is cut.
enum LwStatus lw_builder_message(const struct LwBuilder *builder,
                                 char *buffer,
                                 size_t room,
                                 size_t *wanted);

// Adds a folder with packages, for `package://name/..` in files that are read afterwards.
enum LwStatus lw_builder_packages(struct LwBuilder *builder, const char *folder);

// Keeps the loops and couplings of the robot, such as joints that mimic others. Call it before the robot is read. `lw_whole_body_ik_solve` and
// `lw_whole_body_ik_best` keep them closed. Kinematics, collisions, masses and forces are those of the tree at the given q, as if every coordinate had
// its own motor. Functions that would open a loop return `LW_STATUS_DOES_NOT_CLOSE`: searches, rates and paths of a chain that takes part in one,
// paths between configurations, tasks, operational space, predictions and transfers. `lw_robot_path_free` and `lw_timing_plan` support linear
// couplings, such as joints that mimic others; in the latter these joints have no motor.
enum LwStatus lw_builder_keep_closures(struct LwBuilder *builder);

// Reads the robot from a URDF, MJCF or SDF file. `root`: one of `LW_ROOT_...`; `inertia`: one of `LW_INERTIA_...`. Loops and couplings, such as
// joints that mimic others, are errors unless `lw_builder_keep_closures` was called. Call `lw_builder_file_shapes` to add the shapes of the file.
enum LwStatus lw_builder_robot_file(struct LwBuilder *builder,
                                    const char *path,
                                    uint32_t root,
                                    uint32_t inertia);

// Like `lw_builder_robot_file`, but reads the text of such a file.
enum LwStatus lw_builder_robot_text(struct LwBuilder *builder,
                                    const char *xml,
                                    uint32_t root,
                                    uint32_t inertia);

// Adds parts and disabled pairs of collisions from an SRDF file; each group is a part. Call it after the robot is read.
enum LwStatus lw_builder_groups_file(struct LwBuilder *builder,
                                     const char *path);

// Like `lw_builder_groups_file`, but reads the text of such a file.
enum LwStatus lw_builder_groups_text(struct LwBuilder *builder, const char *xml);

// Adds the collision shapes of the robot's file as colliders with their names, or `body/number`. Call it after the robot is read. Shapes that are
// not supported as colliders (meshes that are neither STL nor OBJ, ellipsoids) are errors: give such bodies shapes with `lw_builder_shape`,
// `lw_builder_hull` or `lw_builder_mesh`.
enum LwStatus lw_builder_file_shapes(struct LwBuilder *builder);

// Adds a part: the chain of bodies after `base` (a body, or "world") up to `tip`.
enum LwStatus lw_builder_chain(struct LwBuilder *builder,
                               const char *name,
                               const char *base,
                               const char *tip);

// Adds an object that hands may hold. It is rigid unless bodies hang on it (`lw_builder_object_body`). Mass (kg), centre of mass (3 numbers, m) and
// inertia about it (9 numbers, row after row, kg m^2) are in the object's axes.
enum LwStatus lw_builder_object(struct LwBuilder *builder,
                                const char *name,
                                double mass,
                                const double *center,
                                const double *inertia);

// Adds a collision shape at the pose `at` (NULL: at the origin) in the frame of `carrier`: a body, an object, a body that hangs on an object, or
// "world".
enum LwStatus lw_builder_shape(struct LwBuilder *builder,
                               const char *name,
                               const char *carrier,
                               const struct LwPose *at,
                               const struct LwShape *shape);

// Adds a point cloud for sensor data. Each point is a sphere with its own radius. It is empty at first and has memory for `room` points, which
// `lw_robot_set_points` sets. `at` and `carrier` as in `lw_builder_shape`.
enum LwStatus lw_builder_point_cloud(struct LwBuilder *builder,
                                     const char *name,
                                     const char *carrier,
                                     const struct LwPose *at,
                                     size_t room);

// Adds a voxel map: `cells` (3 numbers) cubes along x, y, z from the origin of its frame, with edge length `edge` (m). All cells are free at first;
// `lw_robot_set_cells` changes them. `at` and `carrier` as in `lw_builder_shape`.
enum LwStatus lw_builder_voxel_map(struct LwBuilder *builder,
                                   const char *name,
                                   const char *carrier,
                                   const struct LwPose *at,
                                   const uint32_t *cells,
                                   double edge);

// Checks everything, makes the model and writes it to `out`; free it with `lw_model_free`. The builder can be used again. The message lists all
// faults.
enum LwStatus lw_builder_model(struct LwBuilder *builder,
                               struct LwModel **out);

// Adds a body of the robot, connected to `parent` (a body, or "world") by `hinge` (NULL: welded) at the pose `at` in the parent's frame (NULL: at
// its origin). The hinge is at the body's origin. Mass properties as in `lw_builder_object`; a body with zero mass, centre and inertia is a frame.
// With such bodies a robot needs no file; after a file they are added to its bodies. A hinge with one degree of freedom is found with
// `lw_model_joint` under the body's name, every hinge with `lw_model_hinge`.
enum LwStatus lw_builder_body(struct LwBuilder *builder,
                              const char *name,
                              const char *parent,
                              const struct LwHinge *hinge,
                              const struct LwPose *at,
                              double mass,
                              const double *center,
                              const double *inertia);

// Adds a body that hangs on an object, or on another such body (`parent`), by `hinge` (NULL: welded) at the pose `at` in the parent's frame (NULL:
// at its origin). The hinge is at the body's origin. Mass properties as in `lw_builder_object`. `lw_model_object_hinge` returns the indices of its
// coordinates.
enum LwStatus lw_builder_object_body(struct LwBuilder *builder,
                                     const char *name,
                                     const char *parent,
                                     const struct LwHinge *hinge,
                                     const struct LwPose *at,
                                     double mass,
                                     const double *center,
                                     const double *inertia);

// Sets the limits of each pin, slider and screw in the hinge of a body that was added before: smallest and largest coordinate, rad or m; largest
// rate, rad/s or m/s; largest effort, N m or N. Infinite for no limit. They replace limits of the file.
enum LwStatus lw_builder_limits(struct LwBuilder *builder,
                                const char *body,
                                double lower,
                                double upper,
                                double rate,
                                double effort);

// Adds the convex hull of `n` points (3 numbers each, m) that are not all in one plane. `at` and `carrier` as in `lw_builder_shape`.
enum LwStatus lw_builder_hull(struct LwBuilder *builder,
                              const char *name,
                              const char *carrier,
                              const struct LwPose *at,
                              const double *points,
                              size_t n);

// Adds a triangle mesh: `vertex_count` corners (3 numbers each, m), and `triangle_count` triangles (3 indices of corners each, from 0,
// counter-clockwise seen from outside). Only its outside collides. A convex hull is faster and more robust where it fits. Every robot uses 8 bytes
// for each triangle of the largest mesh. `at` and `carrier` as in `lw_builder_shape`.
enum LwStatus lw_builder_mesh(struct LwBuilder *builder,
                              const char *name,
                              const char *carrier,
                              const struct LwPose *at,
                              const double *vertices,
                              size_t vertex_count,
                              const uint32_t *triangles,
                              size_t triangle_count);

// Adds terrain: heights (z, m) of `x` by `y` points (at least 2 each) on a grid that is centred on the origin, `spacing` (2 numbers, m) apart along
// x and y. It is solid below, without limit. `heights`: `n` = x y numbers, the row of lowest y first; NaN where there is no ground. Memory as in
// `lw_builder_mesh`. `at` and `carrier` as in `lw_builder_shape`.
enum LwStatus lw_builder_height_field(struct LwBuilder *builder,
                                      const char *name,
                                      const char *carrier,
                                      const struct LwPose *at,
                                      size_t x,
                                      size_t y,
                                      const double *spacing,
                                      const double *heights,
                                      size_t n);

// Adds a coarse shape to a collider that was added before, by name, in the same frame, for `LW_DETAIL_COARSE`. It should be simpler than the fine
// shape and enclose it.
enum LwStatus lw_builder_coarse(struct LwBuilder *builder,
                                const char *name,
                                const struct LwShape *shape);

// Like `lw_builder_coarse`, with the convex hull of `n` points (3 numbers each, m) as the coarse shape.
enum LwStatus lw_builder_coarse_hull(struct LwBuilder *builder,
                                     const char *name,
                                     const double *points,
                                     size_t n);

// Like `lw_builder_coarse`, with a triangle mesh as the coarse shape, as in `lw_builder_mesh`.
enum LwStatus lw_builder_coarse_mesh(struct LwBuilder *builder,
                                     const char *name,
                                     const double *vertices,
                                     size_t vertex_count,
                                     const uint32_t *triangles,
                                     size_t triangle_count);

// Like `lw_builder_coarse`, with cubes as the coarse shape: a grid of `cells` (3 numbers) cubes along x, y, z from the origin of the frame, with
// edge length `edge` (m), of which `n` are occupied; `occupied` has three indices of each, from 0. They do not change: `lw_robot_set_cells` changes
// only a collider's fine shape.
enum LwStatus lw_builder_coarse_voxel_map(struct LwBuilder *builder,
                                          const char *name,
                                          const uint32_t *cells,
                                          double edge,
                                          const uint32_t *occupied,
                                          size_t n);

// Excludes a pair from collision checks. Each is the name of a collider, or of a body for all its colliders.
enum LwStatus lw_builder_ignore(struct LwBuilder *builder,
                                const char *a,
                                const char *b);

// Includes a pair in collision checks although a hinge joins them or they are in the same group of `lw_builder_apart`. `lw_builder_ignore` takes
// precedence. Names as there.
enum LwStatus lw_builder_collide(struct LwBuilder *builder,
                                 const char *a,
                                 const char *b);

// Adds a group of `n` bodies, by name, that are not checked against each other.
enum LwStatus lw_builder_apart(struct LwBuilder *builder, const char *const *bodies, size_t n);

// Selects the rule for bodies that a hinge with fewer than six degrees of freedom joins: one of `LW_NEIGHBOURS_...`.
enum LwStatus lw_builder_neighbours(struct LwBuilder *builder,
                                    uint32_t neighbours);

// Writes another handle of the same model, with its own message, to `out`. O(1).
enum LwStatus lw_model_clone(const struct LwModel *model, struct LwModel **out);

// Frees this handle of a model; NULL has no effect. Robots of the model remain valid.
void lw_model_free(struct LwModel *model);

// Like `lw_builder_message`, for a model.
enum LwStatus lw_model_message(const struct LwModel *model,
                               char *buffer,
                               size_t room,
                               size_t *wanted);

// Copies the content of the files that the model does not use, one line each, like `lw_builder_message`.
enum LwStatus lw_model_unused(const struct LwModel *model,
                              char *buffer,
                              size_t room,
                              size_t *wanted);

// Copies warnings about mass properties in the robot's file that no rigid body can have but that were read all the same (`LW_INERTIA_WARN`), one
// line each with link and numbers, like `lw_builder_message`; empty when there are none.
enum LwStatus lw_model_doubtful(const struct LwModel *model,
                                char *buffer,
                                size_t room,
                                size_t *wanted);

// Writes the number of coordinates to `nq` and the number of degrees of freedom to `nv`.
enum LwStatus lw_model_sizes(const struct LwModel *model, size_t *nq, size_t *nv);

// Writes the index of the part with this name, from 0, to `out`.
enum LwStatus lw_model_part(const struct LwModel *model, const char *name, uint32_t *out);

// Writes the index of the object with this name, from 0, to `out`.
enum LwStatus lw_model_object(const struct LwModel *model, const char *name, uint32_t *out);

// Writes the number of coordinates of an object's joints to `nq` and their number of degrees of freedom to `nv`; 0 for a rigid object.
enum LwStatus lw_model_object_sizes(const struct LwModel *model,
                                    uint32_t object,
                                    size_t *nq,
                                    size_t *nv);

// Writes the index of the body with this name among the object itself and the bodies that hang on it to `out`.
enum LwStatus lw_model_object_body(const struct LwModel *model,
                                   uint32_t object,
                                   const char *name,
                                   uint32_t *out);

// Writes the index of the body with this name, from 0, to `out`.
enum LwStatus lw_model_body(const struct LwModel *model, const char *name, uint32_t *out);

// Writes the index of the collider with this name, from 0 in alphabetical order, to `out`.
enum LwStatus lw_model_collider(const struct LwModel *model, const char *name, uint32_t *out);

// Copies the name of a collider, like `lw_builder_message`.
enum LwStatus lw_model_collider_name(const struct LwModel *model,
                                     uint32_t collider,
                                     char *buffer,
                                     size_t room,
                                     size_t *wanted);

// Writes the indices in q and among the degrees of freedom of a joint with one coordinate, by its name in the file, or by the name of a body of
// `lw_builder_body`.
enum LwStatus lw_model_joint(const struct LwModel *model,
                             const char *name,
                             size_t *in_q,
                             size_t *in_v);

// Writes the indices of a body's hinge: first index and number in q (`in_q`, `q_count`) and among the degrees of freedom (`in_v`, `v_count`). The
// numbers are zero for a welded body.
enum LwStatus lw_model_hinge(const struct LwModel *model,
                             uint32_t body,
                             size_t *in_q,
                             size_t *q_count,
                             size_t *in_v,
                             size_t *v_count);

// Like `lw_model_hinge`, for a body that hangs on an object (`lw_model_object_body`). The indices refer to the joints of that object. The object
// itself has none.
enum LwStatus lw_model_object_hinge(const struct LwModel *model,
                                    uint32_t object,
                                    uint32_t body,
                                    size_t *in_q,
                                    size_t *q_count,
                                    size_t *in_v,
                                    size_t *v_count);

// Writes the number of degrees of freedom of a chain, which is the number of columns of its Jacobian, to `count`.
enum LwStatus lw_model_part_size(const struct LwModel *model,
                                 uint32_t part,
                                 size_t *count);

// Writes the indices of a chain's degrees of freedom among all to `dofs` of length `n` (`lw_model_part_size`).
enum LwStatus lw_model_part_dofs(const struct LwModel *model,
                                 uint32_t part,
                                 size_t *dofs,
                                 size_t n);

// Writes the colliders on the bodies of a part, sorted by name, to `out`, and their number to `count`. If there are more than `room`, returns
// `LW_STATUS_NO_ROOM` and writes only `count`.
enum LwStatus lw_model_part_colliders(const struct LwModel *model,
                                      uint32_t part,
                                      uint32_t *out,
                                      size_t room,
                                      size_t *count);

// Like `lw_model_part_colliders`, for an object, including colliders on bodies that hang on it.
enum LwStatus lw_model_object_colliders(const struct LwModel *model,
                                        uint32_t object,
                                        uint32_t *out,
                                        size_t room,
                                        size_t *count);

// Writes the limits of the degrees of freedom with one coordinate, rad or m, to `lower` and `upper` (`n` = nv each); infinite for no limit.
enum LwStatus lw_model_limits(const struct LwModel *model,
                              double *lower,
                              double *upper,
                              size_t n);

// Creates a robot of a model at its neutral configuration and writes it to `out`; free it with `lw_robot_free`. Allocates the memory of all later
// calls.
enum LwStatus lw_robot_new(const struct LwModel *model,
                           struct LwRobot **out);

// Creates an independent robot with the same configuration, held objects and settings, and writes it to `out`.
enum LwStatus lw_robot_clone(const struct LwRobot *robot,
                             struct LwRobot **out);

// Frees a robot; NULL has no effect.
void lw_robot_free(struct LwRobot *robot);

// Like `lw_builder_message`, for a robot. May be called while another thread is in a call with the robot.
enum LwStatus lw_robot_message(const struct LwRobot *robot,
                               char *buffer,
                               size_t room,
                               size_t *wanted);

// Writes the configuration to `q` (`n` = nq).
enum LwStatus lw_robot_q(struct LwRobot *robot, double *q, size_t n);

// Sets the configuration to `q` (`n` = nq). Limits are not checked.
enum LwStatus lw_robot_set_q(struct LwRobot *robot, const double *q, size_t n);

// Moves `q` (`n` = nq) to the nearest configuration within all limits, in place.
enum LwStatus lw_robot_clamp(struct LwRobot *robot, double *q, size_t n);

// Sets the acceleration of gravity (3 numbers), world axes, m/s^2. Default: 9.81 m/s^2 along -z.
enum LwStatus lw_robot_set_gravity(struct LwRobot *robot, const double *g);

// Writes the pose of the tip of a chain in the world at the robot's q. Computes only the bodies between the world and the tip.
enum LwStatus lw_robot_tip_pose(struct LwRobot *robot,
                                uint32_t part,
                                struct LwPose *out);

// Writes the pose of a body in the world at the robot's q.
enum LwStatus lw_robot_body_pose(struct LwRobot *robot, uint32_t body, struct LwPose *out);

// Writes the Jacobian of a chain at the robot's q to `J` (6 rows of its m degrees of freedom, row after row; `n` = 6 m). It maps rates to the
// velocity of its tip relative to its base, angular rows (rad/s) first, at the tip's origin, world axes.
enum LwStatus lw_robot_jacobian(struct LwRobot *robot,
                                uint32_t part,
                                double *J,
                                size_t n);

// Writes the Jacobian of a chain's tip over the whole mechanism to `J` (6 rows of nv; `n` = 6 nv). It includes the degrees of freedom that carry the
// chain.
enum LwStatus lw_robot_whole_jacobian(struct LwRobot *robot,
                                      uint32_t part,
                                      double *J,
                                      size_t n);

// Computes forces `tau` (`n` = nv; N m or N) for rates `v` and accelerations `vdot` (`n` = nv each) at the robot's q, including held objects, while
// the tips exert wrenches. The number of `pushes` is at most the number of parts.
enum LwStatus lw_robot_feed_forward(struct LwRobot *robot,
                                    const double *v,
                                    const double *vdot,
                                    size_t n,
                                    const struct LwPush *pushes,
                                    size_t push_count,
                                    double *tau);

// Computes forces `tau` (`n` = nv) that hold the robot's q at rest, including held objects, while the tips exert wrenches: as in
// `lw_robot_feed_forward`.
enum LwStatus lw_robot_held_still(struct LwRobot *robot,
                                  const struct LwPush *pushes,
                                  size_t push_count,
                                  double *tau,
                                  size_t n);

// Writes the mass matrix at the robot's q, including held objects, to `M` (nv rows of nv, row after row; `n` = nv nv).
enum LwStatus lw_robot_mass_matrix(struct LwRobot *robot,
                                   double *M,
                                   size_t n);

// Writes the mass of all moving bodies, including held objects, kg, to `mass` (may be NULL), and their centre of mass at the robot's q, world, m, to
// `center` (3 numbers).
enum LwStatus lw_robot_center_of_mass(struct LwRobot *robot,
                                      double *mass,
                                      double *center);

// Writes the pose of the base of a chain in the world at the robot's q. It is the frame of goals with `LW_GOAL_IN_BASE`.
enum LwStatus lw_robot_base_pose(struct LwRobot *robot,
                                 uint32_t part,
                                 struct LwPose *out);

// Writes the manipulability of a chain at the robot's q to `out`. `rows`: one of `LW_ROWS_..`; `length`: length that scales angular rows, m, if all
// six are selected (otherwise it is not read). Writes its gradient over the chain's degrees of freedom to `gradient` (`n`: `lw_model_part_size`;
// NULL and 0: not written); zero where the measure is zero.
enum LwStatus lw_robot_manipulability(struct LwRobot *robot,
                                      uint32_t part,
                                      uint32_t rows,
                                      double length,
                                      struct LwManipulability *out,
                                      double *gradient,
                                      size_t n);

// Computes rates of a chain at the robot's q for which its tip moves with `twist` as closely as possible, and writes them to the chain's entries of
// `v` (`n` = nv; the others do not change). `twist` has 6 numbers: angular, rad/s, then linear, m/s; at the tip's origin, world axes, relative to
// the chain's base. Of all such rates the smallest are chosen, within rate limits, and not outward at a limit of a coordinate. Writes the residual
// to `residual` (2 numbers, rad/s and m/s; may be NULL). For several tasks, and guards, use `lw_rate_control_solve`.
enum LwStatus lw_robot_rates(struct LwRobot *robot,
                             uint32_t part,
                             const double *twist,
                             double *v,
                             size_t n,
                             double *residual);

// Creates the operational space of the tips of chains (`count` of them, at least one), in this order, and writes it to `out`; free it with
// `lw_task_space_free`. It works with every robot of the same model. It has six rows for each tip: angular, then linear, of the tip's origin, world
// axes.
enum LwStatus lw_task_space_new(struct LwRobot *robot,
                                const uint32_t *parts,
                                size_t count,
                                struct LwTaskSpace **out);

// Frees an operational space; NULL has no effect.
void lw_task_space_free(struct LwTaskSpace *space);

// Writes the inverse of the task inertia at the robot's q, including held objects, to `out` (rows times rows, row after row; `n` = their product):
// accelerations of the tips for unit wrenches on them. Returns `LW_STATUS_SINGULAR` when a coordinate moves no mass.
enum LwStatus lw_task_space_compliance(struct LwRobot *robot,
                                       struct LwTaskSpace *space,
                                       double *out,
                                       size_t n);

// Writes the task inertia at the robot's q, including held objects, to `out` as in `lw_task_space_compliance`: kg m^2 and kg. Returns
// `LW_STATUS_SINGULAR` also where the tips cannot move independently.
enum LwStatus lw_task_space_inertia(struct LwRobot *robot,
                                    struct LwTaskSpace *space,
                                    double *out,
                                    size_t n);

// Computes forces `tau` (`n` = nv) at the robot's q and rates `v` (`n`) that give the tips the accelerations `a` (`rows` numbers: six for each tip,
// rad/s^2 and m/s^2), including gravity and held objects. The forces `rest` (`n`; may be NULL) are added in the null space, where they do not
// accelerate any tip. Returns `LW_STATUS_SINGULAR` where the tips cannot move independently.
enum LwStatus lw_task_space_forces(struct LwRobot *robot,
                                   struct LwTaskSpace *space,
                                   const double *v,
                                   size_t n,
                                   const double *a,
                                   size_t rows,
                                   const double *rest,
                                   double *tau);

// Computes forces `tau` (`n` = nv) at the robot's q and rates `v` (`n`) that give each tip an impedance: `count` springs, one for each tip in the
// order of the parts. `rest` and `LW_STATUS_SINGULAR` as in `lw_task_space_forces`. Because no force is measured, the apparent inertia is that of
// the tips.
enum LwStatus lw_task_space_impedance(struct LwRobot *robot,
                                      struct LwTaskSpace *space,
                                      const double *v,
                                      size_t n,
                                      const struct LwImpedance *springs,
                                      size_t count,
                                      const double *rest,
                                      double *tau);

// Creates the memory of `lw_rate_control_solve` for up to `objectives` tasks and `chains` guarded chains (at most 1024 each) and writes it to `out`;
// free it with `lw_rate_control_free`. It works with every robot of the same model.
enum LwStatus lw_rate_control_new(struct LwRobot *robot,
                                  size_t objectives,
                                  size_t guards,
                                  struct LwRateControl **out);

// Frees the memory; NULL has no effect.
void lw_rate_control_free(struct LwRateControl *control);

// Computes rates `v` (`n` = nv) at the robot's q: within rate limits, as near to each task as the tasks of lower levels allow, and the smallest of
// all such rates. Within `horizon` (s, above zero; use a few control periods) a limit of a coordinate, or the smallest manipulability of each of the
// `guard_count` chains in `guards`, may at most just be reached, so a chain slows down towards a singular configuration. Writes the weighted
// residual |J v - desired| of each level, in order, to `residuals` (`levels`: number of different levels; NULL and 0: not written). A coordinate
// outside its limits returns as fast as its rate limit allows. Returns `LW_STATUS_SINGULAR` when guards contradict each other.
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

// Creates the memory of `lw_whole_body_solve` for up to `touches` contact points and `objectives` tasks (at most 1024 each) and writes it to `out`; free
// it with `lw_whole_body_free`. It works with every robot of the same model.
enum LwStatus lw_whole_body_new(struct LwRobot *robot,
                                size_t touches,
                                size_t objectives,
                                struct LwWholeBody **out);

// Frees the memory; NULL has no effect.
void lw_whole_body_free(struct LwWholeBody *body);

// Computes forces `tau` and accelerations `vdot` at the robot's q and rates `v`, and forces on the robot at the `touch_count` contact points,
// `forces` (3 numbers each, world axes, N). Priorities are: balance of the degrees of freedom without an actuator, contacts that do not slip,
// limits, the tasks (accelerations) by levels, and minimum effort. `effort`: effort limits, N m and N; zero for no actuator, infinite for no limit.
// `v`, `effort`, `tau`, `vdot`: `n` = nv each. Requirements that cannot be met are not an error: `out` contains the residuals of the best solution.
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

// Computes the support polygon of `n` contact points (2 numbers each: x, y, m, in a level plane), above which the centre of mass must be. Writes the
// corners of their convex hull, counter-clockwise, to `hull` (room for n + 1), and their number to `count`: two for points on a line, one for
// coincident points. Sorts `points`; points with NaN or infinity are ignored. There is no handle and no message.
enum LwStatus lw_support_polygon(double *points,
                                 size_t n,
                                 double *hull,
                                 size_t room,
                                 size_t *count);

// Writes the distance of a point `p` (2 numbers: x, y, m) from the nearest edge of a polygon with `n` corners (2 numbers each, counter-clockwise) to
// `margin`, m; negative outside, minus infinity without corners. There is no handle and no message.
enum LwStatus lw_support_margin(const double *hull,
                                size_t n,
                                const double *p,
                                double *margin);

// Writes the effort that `lw_robot_inverse_kinematics` uses for NULL: 1e-9 m and rad, 100 steps from each of 65 starts, no other limit.
enum LwStatus lw_effort_default(struct LwEffort *out);

// Searches for coordinates of a chain within limits for which its tip meets the goal. `q` (`n` = nq) is the start, within limits, on input, and the
// solution or the nearest configuration on output; only the chain's coordinates change. The robot's own q does not change. If the goal cannot be
// met, this is a result, not an error. `effort`: NULL for the default.
enum LwStatus lw_robot_inverse_kinematics(struct LwRobot *robot,
                                          uint32_t part,
                                          const struct LwGoal *goal,
                                          const struct LwEffort *effort,
                                          double *q,
                                          size_t n,
                                          struct LwAnswer *answer);

// Like `lw_robot_inverse_kinematics`, but from several starts, and each solution is improved among the configurations that meet the goal; the result is written
// to `best`. `restarts` of the effort has no effect; its `kinematics` bounds the sum of all evaluations. If no start leads to the goal, `q` is the
// nearest configuration of the last start.
enum LwStatus lw_robot_inverse_kinematics_best(struct LwRobot *robot,
                                               uint32_t part,
                                               const struct LwGoal *goal,
                                               const struct LwPrefer *prefer,
                                               const struct LwEffort *effort,
                                               double *q,
                                               size_t n,
                                               struct LwBest *best);

// Continues the last search of a chain for up to `kinematics` evaluations of its kinematics. The result does not depend on how the evaluations are
// divided into calls.
enum LwStatus lw_robot_resume_inverse_kinematics(struct LwRobot *robot,
                                                 uint32_t part,
                                                 size_t kinematics,
                                                 double *q,
                                                 size_t n,
                                                 struct LwAnswer *answer);

// Computes all configurations within limits that bring the tip of an arm with six or seven hinges and a closed form to a pose. Writes them to
// `solutions` (`rows` times `n` = nq numbers; 8 rows are always sufficient), sorted by distance from `q` (`n`), and their number to `count`; zero is
// a result, not an error. `q` gives the configuration of the bodies that carry the arm, and the revolution of each angle. `held`: index in β of the
// hinge of a seven-axis arm that keeps its value in `q`; -1: automatic.
enum LwStatus lw_robot_inverse_kinematics_all(struct LwRobot *robot,
                                              uint32_t part,
                                              int64_t held,
                                              const struct LwGoal *goal,
                                              const double *q,
                                              size_t n,
                                              double *solutions,
                                              size_t rows,
                                              size_t *count);

// Creates the memory of `lw_whole_body_ik_solve` for up to `goals` goals (at most 1024) and two hands on every object and writes it to `out`; free it
// with `lw_whole_body_ik_free`. It works with every robot of the same model.
enum LwStatus lw_whole_body_ik_new(struct LwRobot *robot,
                                   size_t goals,
                                   struct LwWholeBodyIk **out);

// Frees the memory; NULL has no effect.
void lw_whole_body_ik_free(struct LwWholeBodyIk *search);

// Keeps the hinges of a part's bodies at their values in later searches. Ends a search in progress.
enum LwStatus lw_whole_body_ik_keep(struct LwRobot *robot,
                                    struct LwWholeBodyIk *search,
                                    uint32_t part);

// Lets the hinges of a part's bodies move again.
enum LwStatus lw_whole_body_ik_release(struct LwRobot *robot,
                                       struct LwWholeBodyIk *search,
                                       uint32_t part);

// Searches for a configuration within limits in which every tip meets its goal; all bodies that carry the tips may move. `q` (`n` = nq) is the
// start, within limits, on input, and the solution or the nearest configuration on output. Objects in two hands of the robot are in both hands in
// the result, and loops and couplings are closed; without goals the search only closes what is open. `effort`: NULL for the default. Position and
// orientation of `answer` are the largest residuals of all goals; those of each goal, m and rad, are written to `residuals` (`m` = 2 `goal_count`;
// NULL and 0: not written). Returns `LW_STATUS_DOES_NOT_CLOSE` if no configuration closes everything: `q` is then the configuration with the
// smallest closure error, which position and orientation of `answer` contain.
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

// Continues the search for up to `kinematics` evaluations of the kinematics. The result does not depend on how the evaluations are divided into
// calls. Results are written as in `lw_whole_body_ik_solve`.
enum LwStatus lw_whole_body_ik_resume(struct LwRobot *robot,
                                      struct LwWholeBodyIk *search,
                                      size_t kinematics,
                                      double *q,
                                      size_t n,
                                      double *residuals,
                                      size_t m,
                                      struct LwAnswer *answer);

// Like `lw_whole_body_ik_solve`, but from several starts, and each solution is improved among the configurations that meet all goals with everything
// closed: near the middle of the limits of all that moves, and far from singular configurations of the goals' chains. Writes the result to `best`.
// `restarts` of the effort has no effect; its `kinematics` bounds the sum of all evaluations. The robot's own q does not change.
enum LwStatus lw_whole_body_ik_best(struct LwRobot *robot,
                                    struct LwWholeBodyIk *search,
                                    const struct LwTipGoal *goals,
                                    size_t goal_count,
                                    const struct LwPrefer *prefer,
                                    const struct LwEffort *effort,
                                    double *q,
                                    size_t n,
                                    struct LwBest *best);

// Writes an upper bound for the kinematics evaluations of `lw_whole_body_ik_solve` with these goals to `steps`, for every start, all values of the
// goals and everything that the hands may hold; SIZE_MAX if it is larger.
enum LwStatus lw_whole_body_ik_worst_case_steps(struct LwRobot *robot,
                                                struct LwWholeBodyIk *search,
                                                const struct LwTipGoal *goals,
                                                size_t goal_count,
                                                const struct LwEffort *effort,
                                                size_t *steps);

// Writes an upper bound for the kinematics evaluations of `lw_robot_inverse_kinematics` with such a goal to `steps`, for every chain, every start and all values
// of the goal; SIZE_MAX if it is larger. Real-time callers can rely on it; most searches take one hundredth of it. `effort`: NULL for the default.
enum LwStatus lw_effort_worst_case_steps(const struct LwEffort *effort,
                                         const struct LwGoal *goal,
                                         size_t *steps);

// Writes the pose of an object in the world: in the hand, on its carrier, or where it was placed or released last.
enum LwStatus lw_robot_object_pose(struct LwRobot *robot,
                                   uint32_t object,
                                   struct LwPose *out);

// Moves an object that no hand holds to a pose in the world.
enum LwStatus lw_robot_put(struct LwRobot *robot, uint32_t object, const struct LwPose *at);

// Grasps an object with a hand (the tip of a chain), at a pose in the tip's frame, or at its current pose (NULL). A second hand closes a loop and
// must be within 1e-6 m and rad of the pose that its grasp requires.
enum LwStatus lw_robot_grasp(struct LwRobot *robot,
                             uint32_t hand,
                             uint32_t object,
                             const struct LwPose *at);

// Changes the pose of a held object in the tip's frame of a hand that holds it, for example to the value of an estimator.
enum LwStatus lw_robot_update_grasp(struct LwRobot *robot,
                                    uint32_t hand,
                                    uint32_t object,
                                    const struct LwPose *at);

// Releases an object from one hand. It stays in the other hand, or keeps its pose in the world.
enum LwStatus lw_robot_release(struct LwRobot *robot, uint32_t hand, uint32_t object);

// Releases an object from all hands. It keeps its pose in the world.
enum LwStatus lw_robot_ungrasp(struct LwRobot *robot, uint32_t object);

// Attaches an object that no hand holds to another object, such as a battery to its driver or a wheel to its hub. `body`: the body of the other
// object that carries it, or `LW_ITSELF`. `at`: its pose in the frame of the carrier, or its current pose (NULL). It then moves with the carrier,
// and a hand that holds the carrier carries both.
enum LwStatus lw_robot_attach(struct LwRobot *robot,
                              uint32_t object,
                              uint32_t on,
                              uint32_t body,
                              const struct LwPose *at);

// Detaches an object. It keeps its pose in the world.
enum LwStatus lw_robot_detach(struct LwRobot *robot, uint32_t object);

// Writes the coordinates of an object's joints to `q` (`n`: their number), in the order of its bodies: depth first, siblings by name.
enum LwStatus lw_robot_object_q(struct LwRobot *robot,
                                uint32_t object,
                                double *q,
                                size_t n);

// Sets the coordinates of an object's joints, whether it is held or not: `q` (`n`: their number). Updates the load of the hand that carries it.
enum LwStatus lw_robot_set_object_q(struct LwRobot *robot,
                                    uint32_t object,
                                    const double *q,
                                    size_t n);

// Like `lw_robot_feed_forward` (`v`, `vdot`, `tau`: `n` = nv each), while the joints of a held object move with `rates` and `accelerations`. Writes
// the forces at these joints to `forces` (`m` each: the object's degrees of freedom). Joints of other objects do not move.
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

// Computes rank and mobility of the loop of two hands on an object at the robot's q.
enum LwStatus lw_robot_closure(struct LwRobot *robot, uint32_t object, struct LwClosure *out);

// Computes rank and mobility of the loop that a hand closes if it, or the object in it, is welded to a body of an object (`lw_model_object_body`) in
// the current configuration, such as a key in a lock. `free` (n: the object's degrees of freedom): 1 for joints of the object that may move, 0 for
// fixed ones.
enum LwStatus lw_robot_closure_onto(struct LwRobot *robot,
                                    uint32_t hand,
                                    uint32_t object,
                                    uint32_t body,
                                    const uint8_t *free,
                                    size_t n,
                                    struct LwClosure *out);

// Writes the Jacobian of a body of an object (6 rows of its m degrees of freedom, row after row; `n` = 6 m). It maps rates of the object's joints to
// the angular, then linear velocity of the body relative to the object's base, at the body's origin, world axes.
enum LwStatus lw_robot_object_jacobian(struct LwRobot *robot,
                                       uint32_t object,
                                       uint32_t body,
                                       double *J,
                                       size_t n);

// Writes the pose in the world of a body that hangs on an object (`lw_model_object_body`).
enum LwStatus lw_robot_object_body_pose(struct LwRobot *robot,
                                        uint32_t object,
                                        uint32_t body,
                                        struct LwPose *out);

// Writes the mass matrix at the robot's q, with the m joints of an object that it holds in the last rows and columns, to `M` (nv + m rows of nv + m,
// row after row; `n` = (nv + m)^2). Joints of other objects do not move.
enum LwStatus lw_robot_mass_matrix_with_object(struct LwRobot *robot,
                                               uint32_t object,
                                               double *M,
                                               size_t n);

// Writes the hands that hold an object to `out`; none is not an error.
enum LwStatus lw_robot_hold(struct LwRobot *robot, uint32_t object, struct LwHold *out);

// Shares the load of an object between the two hands that hold it, at the robot's q. `tau` (`n` = nv) contains forces with the object on the first
// hand on input, as `lw_robot_feed_forward` computes them, and forces of both hands for the same motion on output; only those of the two chains
// change. `balance`: one of `LW_BALANCE_..`. Hands may pull as well as press; `lw_robot_grip` considers friction. Returns `LW_STATUS_NOT_HELD` or
// `LW_STATUS_EMPTY_HAND` without two hands; `LW_STATUS_OUT_OF_RANGE` when `LW_BALANCE_EFFORT` needs the effort limit of a joint that has none.
enum LwStatus lw_robot_balance(struct LwRobot *robot,
                               uint32_t object,
                               uint32_t balance,
                               double *tau,
                               size_t n,
                               struct LwShared *out);

// Adds to `tau` (`n` = nv) forces that press the two hands of an object towards each other with `force` (N) along the line between their tips, at
// the robot's q. The net wrench on the object is zero. Writes the wrenches of both hands on the object to `wrenches` (2: first hand, then second
// hand, each about its tip). Returns `LW_STATUS_SINGULAR` when both tips are at the same point.
enum LwStatus lw_robot_squeeze(struct LwRobot *robot,
                               uint32_t object,
                               double force,
                               double *tau,
                               size_t n,
                               struct LwWrench *wrenches);

// Adds to `tau` (`n` = nv) the forces with which the two hands of an object exert `wrenches` on it (2: first hand, then second hand, each about its
// tip), at the robot's q.
enum LwStatus lw_robot_add_hand_wrenches(struct LwRobot *robot,
                                         uint32_t object,
                                         const struct LwWrench *wrenches,
                                         double *tau,
                                         size_t n);

// Separates the wrenches of two hands on an object (2: first hand, then second hand, each about its tip) into the part that moves it, with the
// smallest weighted sum of squares, and the part that only squeezes it; writes both to `out`. `weights` (3 numbers, above zero): first hand, second
// hand, and 1 N m relative to 1 N (1/m^2).
enum LwStatus lw_robot_split_hand_wrenches(struct LwRobot *robot,
                                           uint32_t object,
                                           const struct LwWrench *wrenches,
                                           const double *weights,
                                           struct LwHandWrenches *out);

// Computes wrenches of two hands on an object under which neither slips, at the robot's q, and writes them to `out`. They are the nearest to
// `wrenches` (2: first hand, then second hand, each about its tip) with the same net wrench. `friction` (2): the contact of each hand.
enum LwStatus lw_robot_grip(struct LwRobot *robot,
                            uint32_t object,
                            const struct LwWrench *wrenches,
                            const struct LwFriction *friction,
                            struct LwGripped *out);

// Writes the composite inertia of a body at the robot's q to `out`: the inertia of the body, everything that it carries, and held objects, as one
// rigid body; about the body's origin, world axes.
enum LwStatus lw_robot_composite_inertia(struct LwRobot *robot,
                                         uint32_t body,
                                         struct LwInertia *out);

// Writes the momentum about the centre of mass at the robot's q and rates `v` (`n` = nv), including held objects, to `out` (6 numbers: angular, kg
// m^2/s, then linear, kg m/s; world axes).
enum LwStatus lw_robot_momentum(struct LwRobot *robot,
                                const double *v,
                                size_t n,
                                double *out);

// Writes the centroidal momentum matrix at the robot's q, including held objects, to `A` (6 rows of nv, row after row; `n` = 6 nv). It maps rates to
// the result of `lw_robot_momentum`. Its last three rows, divided by the mass of `lw_robot_center_of_mass`, are the Jacobian of the centre of mass.
enum LwStatus lw_robot_centroidal_matrix(struct LwRobot *robot,
                                         double *A,
                                         size_t n);

// Writes the bias forces (velocity terms and gravity, without accelerations) at the robot's q and rates `v` to `tau` (`n` = nv each), including held
// objects. Writes the tip accelerations of `count` chains (at most as many as the model has parts) at constant rates to `tips` (6 numbers each:
// angular, rad/s^2, then linear, m/s^2, of the tip's origin, world axes).
enum LwStatus lw_robot_bias(struct LwRobot *robot,
                            const double *v,
                            size_t n,
                            const uint32_t *parts,
                            size_t count,
                            double *tau,
                            double *tips);

// Creates the memory of `lw_predictor_step` and writes it to `out`; free it with `lw_predictor_free`. It works with every robot of the same model.
enum LwStatus lw_predictor_new(struct LwRobot *robot,
                               struct LwPredictor **out);

// Frees the memory; NULL has no effect.
void lw_predictor_free(struct LwPredictor *predictor);

// Predicts the state of an estimator over `step` seconds, in place: `q` (`nq`), rates `v` (`nv`) and the `covariance` of their errors (2 nv rows of
// 2 nv, row after row: errors of q along v, then errors of v). It moves under the forces `tau` (`nv`), white force noise with the spectral densities
// `density` (`nv`; (N m)^2 s and N^2 s; not negative), held objects and the robot's gravity. The midpoint rule of second order is used. The robot's
// own q has no effect. Returns `LW_STATUS_SINGULAR` where a joint moves no mass.
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

// Writes the transition matrix of the last step to `F` (2 nv rows of 2 nv, row after row; `n` = 4 nv nv), which maps errors before the step to
// errors after it; zero before the first step.
enum LwStatus lw_predictor_transition(struct LwRobot *robot,
                                      struct LwPredictor *predictor,
                                      double *F,
                                      size_t n);

// Writes to `out` whether two colliders of a checked pair touch or overlap at `q` (`n` = nq), including padding. Held objects move with the hands.
// If there is a pair that touches, writes it to `pair` (may be NULL).
enum LwStatus lw_robot_collides(struct LwRobot *robot,
                                const double *q,
                                size_t n,
                                bool *out,
                                struct LwPair *pair);

// Writes to `out` (`rows` values) whether checked colliders touch or overlap at each of many configurations, `q` (`n` = rows · nq numbers, row after
// row). Each result equals that of `lw_robot_collides`. Other threads may process part of the rows with clones of the robot.
enum LwStatus lw_robot_collides_all(struct LwRobot *robot,
                                    const double *q,
                                    size_t n,
                                    bool *out,
                                    size_t rows);

// Writes the closest checked pair of colliders at `q` (`n` = nq) within `limit` (m, may be infinite) to `out`.
enum LwStatus lw_robot_clearance(struct LwRobot *robot,
                                 const double *q,
                                 size_t n,
                                 double limit,
                                 struct LwClosest *out);

// Writes the distance of two colliders at `q` (`n` = nq) with the closest points to `out`, including padding. It does not matter whether the pair is
// checked or shown. `found` is false when one of them is an empty cloud or map, or both are unbounded.
enum LwStatus lw_robot_distance(struct LwRobot *robot,
                                const double *q,
                                size_t n,
                                uint32_t a,
                                uint32_t b,
                                struct LwClosest *out);

// Writes the distances of all checked pairs within `limit` (m, may be infinite) at `q` (`n` = nq) to `out`, sorted by colliders, and their number to
// `count`. If there are more than `room`, returns `LW_STATUS_NO_ROOM` and writes only `count`. Allocates until the internal list of pairs has
// reached its size.
enum LwStatus lw_robot_distances(struct LwRobot *robot,
                                 const double *q,
                                 size_t n,
                                 double limit,
                                 struct LwClosest *out,
                                 size_t room,
                                 size_t *count);

// Writes all pairs that touch or overlap at `q` (`n` = nq), including padding, to `pairs`, and their number to `count`. If there are more than
// `room`, returns `LW_STATUS_NO_ROOM` and writes only `count`. Allocates until the internal list of pairs has reached its size. `lw_robot_collides`
// is faster if you only need to know whether there is a collision.
enum LwStatus lw_robot_hits(struct LwRobot *robot,
                            const double *q,
                            size_t n,
                            struct LwPair *pairs,
                            size_t room,
                            size_t *count);

// Selects the shapes for all later collision queries: one of `LW_DETAIL_..`; default: fine.
enum LwStatus lw_robot_set_detail(struct LwRobot *robot, uint32_t detail);

// Like `lw_robot_set_detail`, for one collider.
enum LwStatus lw_robot_set_detail_of(struct LwRobot *robot, uint32_t collider, uint32_t detail);

// Writes to `out` whether a pair is checked for collisions while both colliders are shown.
enum LwStatus lw_robot_looks_at(struct LwRobot *robot, uint32_t a, uint32_t b, bool *out);

// Sets the padding around a collider, m.
enum LwStatus lw_robot_pad(struct LwRobot *robot, uint32_t collider, double padding);

// Like `lw_robot_pad`, for `n` colliders at once, for example those of a part (`lw_model_part_colliders`) or of an object. After an error no padding
// has changed. Allocates if there are more names than colliders.
enum LwStatus lw_robot_pad_all(struct LwRobot *robot,
                               const uint32_t *colliders,
                               size_t n,
                               double padding);

// Hides a collider, so that it is not checked; `lw_robot_show` shows it again.
enum LwStatus lw_robot_hide(struct LwRobot *robot, uint32_t collider);

// Shows a hidden collider again.
enum LwStatus lw_robot_show(struct LwRobot *robot, uint32_t collider);

// Enables the collision check of a pair, regardless of the rules and of held objects.
enum LwStatus lw_robot_look_at(struct LwRobot *robot, uint32_t a, uint32_t b);

// Disables the collision check of a pair, regardless of the rules and of held objects, so that the two may touch.
enum LwStatus lw_robot_allow(struct LwRobot *robot,
                             uint32_t a,
                             uint32_t b);

// Removes the override of a pair, so that the rules and held objects decide again.
enum LwStatus lw_robot_by_rule(struct LwRobot *robot, uint32_t a, uint32_t b);

// Replaces the points of a cloud: x, y, z, radius (m) of each of the `n` points, one after the other, in the collider's frame. After an error the
// points have not changed.
enum LwStatus lw_robot_set_points(struct LwRobot *robot,
                                  uint32_t collider,
                                  const double *points,
                                  size_t n);

// Sets cells of a voxel map to occupied: indices along x, y, z from 0 of each of the `n` cells, one after the other. After an error nothing has
// changed.
enum LwStatus lw_robot_set_cells(struct LwRobot *robot,
                                 uint32_t collider,
                                 const uint32_t *cells,
                                 size_t n);

// Sets cells of a voxel map to free; arguments as in `lw_robot_set_cells`.
enum LwStatus lw_robot_free_cells(struct LwRobot *robot,
                                  uint32_t collider,
                                  const uint32_t *cells,
                                  size_t n);

// Sets all cells of a voxel map to free.
enum LwStatus lw_robot_clear_cells(struct LwRobot *robot, uint32_t collider);

// Writes to `out` whether a cell of a voxel map (3 indices along x, y, z from 0) is occupied.
enum LwStatus lw_robot_cell(struct LwRobot *robot,
                            uint32_t collider,
                            const uint32_t *cell,
                            bool *out);

// Writes the number of points of a cloud, or of occupied cells of a voxel map, to `count`.
enum LwStatus lw_robot_count(struct LwRobot *robot, uint32_t collider, size_t *count);

// Checks whether the path from `qa` to `qb` (`n` = nq each) is free of collisions while all coordinates move in proportion, and writes the result to
// `out`. The result is proven, not sampled. Held objects move with the hands. Pieces shorter than `least` (a fraction of the path, 1e-9 to 1;
// usually 1e-3) are not halved again. Checks at most `pieces` pieces (SIZE_MAX: all). The robot's own q has no effect. Returns
// `LW_STATUS_OUT_OF_RANGE` also for an end beyond the limits of a slider.
enum LwStatus lw_robot_path_free(struct LwRobot *robot,
                                 const double *qa,
                                 const double *qb,
                                 size_t n,
                                 double least,
                                 size_t pieces,
                                 struct LwPath *out);

// Continues the check of the last `lw_robot_path_free` that is unfinished, for up to `pieces` pieces. The robot must hold the same objects. The
// result does not depend on the number of calls. Returns `LW_STATUS_NO_SEARCH` when there is no unfinished check.
enum LwStatus lw_robot_path_free_on(struct LwRobot *robot,
                                    size_t pieces,
                                    struct LwPath *out);

// Creates the memory of path planning for a chain of pins, sliders and screws, with room for `configurations` (2 to 1048576) in each of two trees,
// and writes it to `out`; free it with `lw_planner_free`. It works with every robot of the same model.
enum LwStatus lw_planner_new(struct LwRobot *robot,
                             uint32_t part,
                             size_t configurations,
                             struct LwPlanner **out);

// Frees the memory; NULL has no effect.
void lw_planner_free(struct LwPlanner *planner);

// Searches for a collision-free path of the chain from `start` to `goal` (`n` = nq each, within limits; they may differ only in the chain's
// coordinates) with at most `places` random samples in this call (SIZE_MAX: no limit), and writes the result to `out`. `search`: NULL for seed 1,
// steps of 0.5 and pieces down to 1e-3. Held objects move with the hands; the robot's own q has no effect. If no path is found, this is a result,
// not an error.
enum LwStatus lw_planner_plan(struct LwRobot *robot,
                              struct LwPlanner *planner,
                              const double *start,
                              const double *goal,
                              size_t n,
                              const struct LwSearch *search,
                              size_t places,
                              struct LwPlan *out);

// Continues an unfinished search with at most `places` random samples. The robot must hold the same objects as at the beginning. The result does not
// depend on the number of calls.
enum LwStatus lw_planner_resume(struct LwRobot *robot,
                                struct LwPlanner *planner,
                                size_t places,
                                struct LwPlan *out);

// Writes the path that was found last to `path`: configurations (nq numbers each) from the start to the goal, one after the other, between which all
// coordinates move in proportion. `n`: nq times the `rows` of `LwPlan`.
enum LwStatus lw_planner_path(struct LwRobot *robot,
                              struct LwPlanner *planner,
                              double *path,
                              size_t n);

// Creates the memory of `lw_timing_plan` for paths of up to `configurations` configurations (at least 2) in up to `sections` sections (at least 8
// for each configuration, at most 1048576; 20 are coarse, 100 are fine) and writes it to `out`; free it with `lw_timing_free`. It works with every
// robot of the same model.
enum LwStatus lw_timing_new(struct LwRobot *robot,
                            size_t configurations,
                            size_t sections,
                            struct LwTiming **out);

// Frees the memory; NULL has no effect.
void lw_timing_free(struct LwTiming *timing);

// Computes the fastest motion along a path from rest to rest within limits, and writes the result to `out`. `path` (`n` numbers) contains whole
// configurations (nq numbers each) one after the other, as `lw_planner_path` writes them. With `round` = 0 the motion stops at each corner. Otherwise
// corners are rounded so that no point is farther than `round` from the path (Euclidean distance of coordinates, rad and m); call
// `lw_timing_path_free` afterwards. `limits`: NULL for those of the model; jerk limits are not considered. Held objects are included; the robot's
// own q has no effect. Joints that mimic others have no motor: their forces count at the joints that they follow. If no motion keeps the
// limits, this is a result, not an error. A call that fails may discard the previous motion.
enum LwStatus lw_timing_plan(struct LwRobot *robot,
                             struct LwTiming *timing,
                             const double *path,
                             size_t n,
                             const struct LwMotionLimits *limits,
                             double round,
                             struct LwTimed *out);

// Writes the configuration to `q` (`nq`), rates to `v` and accelerations to `vdot` (`nv` each) of the last motion at a time, s. Before its beginning
// and after its end the robot is at rest. Returns `LW_STATUS_NO_SEARCH` when there is no motion.
enum LwStatus lw_timing_at(struct LwRobot *robot,
                           struct LwTiming *timing,
                           double time,
                           double *q,
                           size_t nq,
                           double *v,
                           double *vdot,
                           size_t nv);

// Writes the configuration at a fraction (0 to 1) of the length of the last path to `q` (`n` = nq).
enum LwStatus lw_timing_place(struct LwRobot *robot,
                              struct LwTiming *timing,
                              double part,
                              double *q,
                              size_t n);

// Checks the last path, with its corners as they are rounded, for collisions and writes the result to `out`, as `lw_robot_path_free` does; `least`
// is a fraction of each piece, and the result is never unfinished.
enum LwStatus lw_timing_path_free(struct LwRobot *robot,
                                  struct LwTiming *timing,
                                  double least,
                                  struct LwPath *out);

// Creates the memory of `lw_transfer_plan` and writes it to `out`; free it with `lw_transfer_free`. It works with every robot of the same model.
enum LwStatus lw_transfer_new(struct LwRobot *robot,
                              struct LwTransfer **out);

// Frees the memory; NULL has no effect.
void lw_transfer_free(struct LwTransfer *transfer);

// Computes the fastest motion between two states within limits of rate, acceleration and jerk, with all coordinates arriving at the same time, and
// writes the result to `out`. Effort limits are not considered, and collisions are not checked. Every coordinate that moves needs limits of rate,
// acceleration and jerk; those of ball and free hinges must be equal at both ends and at rest. Returns `LW_STATUS_SINGULAR` where the search fails
// by round-off (the only failure that allocates); the previous motion is then discarded, too.
enum LwStatus lw_transfer_plan(struct LwRobot *robot,
                               struct LwTransfer *transfer,
                               const struct LwMotionState *from,
                               const struct LwMotionState *to,
                               const struct LwMotionLimits *limits,
                               struct LwTransferred *out);

// Writes the configuration to `q` (`nq`), rates to `v` and accelerations to `vdot` (`nv` each) of the last transfer at a time, s. After its end the
// rates there stay constant. Returns `LW_STATUS_NO_SEARCH` when there is no transfer.
enum LwStatus lw_transfer_at(struct LwRobot *robot,
                             struct LwTransfer *transfer,
                             double time,
                             double *q,
                             size_t nq,
                             double *v,
                             double *vdot,
                             size_t nv);

// Creates a problem of `n` unknowns with up to `rows` rows in one level and up to `bounds` bounds (at most 1024 each) and writes it to `out`; free
// it with `lw_priorities_free`. Later calls do not allocate.
enum LwStatus lw_priorities_new(size_t n,
                                size_t rows,
                                size_t bounds,
                                struct LwPriorities **out);

// Frees the problem; NULL has no effect.
void lw_priorities_free(struct LwPriorities *problem);

// Like `lw_builder_message`, for a problem.
enum LwStatus lw_priorities_message(const struct LwPriorities *problem,
                                    char *buffer,
                                    size_t room,
                                    size_t *wanted);

// Starts a new problem: no bounds, no levels, x = 0.
enum LwStatus lw_priorities_begin(struct LwPriorities *problem);

// Adds the bound c x <= `most` (infinite: no bound) for all later levels; `c` has `n` numbers. Add bounds before the first level.
enum LwStatus lw_priorities_bound(struct LwPriorities *problem,
                                  const double *c,
                                  size_t n,
                                  double most);

// Adds and solves the next level: `A` (`rows` times n numbers, row after row) and `b` (`rows`), in the least-squares sense within the bounds and
// without degrading earlier levels. Writes the residual |A x - b| to `residual`, and the number of directions of x that remain for later levels to
// `left` (may be NULL). Returns `LW_STATUS_SINGULAR` when bounds contradict each other or earlier levels; start a new problem then.
enum LwStatus lw_priorities_level(struct LwPriorities *problem,
                                  const double *A,
                                  const double *b,
                                  size_t rows,
                                  double *residual,
                                  size_t *left);

// Writes the solution of all levels so far to `x` (`n`).
enum LwStatus lw_priorities_x(struct LwPriorities *problem, double *x, size_t n);

// Moves `s` (`n` numbers) from its current value to the minimum of s N s / 2 - r s between `lower` and `upper`. `normal` is N (n rows of n, row
// after row, symmetric with a positive diagonal), `right` is r (`n`). Ends after `most` iterations of an active-set method (sweeps, for more than 64
// numbers), or when no number would move by more than `settled` on its own. Writes the number of iterations to `sweeps` (may be NULL). Each costs
// n^2. There is no handle and no message.
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
