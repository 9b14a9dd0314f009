//! One robot: its configuration, kinematics, forces and masses.

use crate::edge::{self, LwPose, Out, alone, apart, numbers, numbers_mut, value, vec3};
use crate::model::LwModel;
use crate::path::Swept;
use crate::reach::Closed;
use crate::status::{Fault, LwStatus, Message};
use linkwork_embedded::spatial::{Force, Motion};
use linkwork_embedded::{Closest, ColliderId, Object, Part, Push, Robot, RobotError, RobotModel};
use std::ffi::c_char;
use std::sync::{Mutex, PoisonError};

/// A robot, with the memory of its calls.
pub(crate) struct Instance {
    pub robot: Robot,
    /// Wrenches that the tips exert, from the last call.
    pub pushes: Vec<Push>,
    /// Chains of the last call, and the motions of their tips.
    pub asked: Vec<Part>,
    pub moved: Vec<Motion>,
    /// Closed forms of the parts.
    pub closed: Closed,
    /// The path that is checked in several calls.
    pub swept: Swept,
    /// Which joints of an object may move, from the last call.
    pub free: Vec<bool>,
    /// Pairs of colliders of the last call.
    pub near: Vec<Closest>,
    pub hits: Vec<(ColliderId, ColliderId)>,
    /// Colliders of the last call.
    pub padded: Vec<ColliderId>,
}

impl Instance {
    pub fn new(robot: Robot) -> Self {
        let room = robot.model().parts().len();
        let closed = Closed::of(robot.model());
        let swept = Swept::new(robot.model().nq());
        let model = robot.model();
        let joints = model.objects().filter_map(|o| model.object_multibody(o.0));
        let most = joints.map(|m| m.nv()).max().unwrap_or_default();
        let colliders = model.colliders().len();
        Self {
            robot,
            pushes: Vec::with_capacity(room),
            asked: Vec::with_capacity(room),
            moved: vec![Motion::zero(); room],
            closed,
            swept,
            free: Vec::with_capacity(most),
            near: Vec::new(),
            hits: Vec::new(),
            padded: Vec::with_capacity(colliders),
        }
    }

    pub fn model(&self) -> &RobotModel {
        self.robot.model()
    }

    pub fn part(&self, index: u32) -> Result<Part, Fault> {
        edge::part(self.model(), index)
    }

    pub fn object(&self, index: u32) -> Result<Object, Fault> {
        edge::object(self.model(), index)
    }
}

/// One instance of a model, with all memory of its calls. Use it from one thread at a time: a call that finds another one in progress returns
/// `LW_STATUS_BUSY`. Robots of one model are independent.
pub struct LwRobot {
    inner: Mutex<Instance>,
    message: Mutex<Message>,
}

impl LwRobot {
    pub(crate) fn parts(&self) -> (&Mutex<Instance>, &Mutex<Message>) {
        (&self.inner, &self.message)
    }

    fn give(robot: Robot) -> *mut Self {
        let (inner, message) = (Mutex::new(Instance::new(robot)), Mutex::new(Message::new()));
        let new = Self { inner, message };
        // On some systems a lock allocates at its first use, so use it once here.
        drop(new.inner.lock().unwrap_or_else(PoisonError::into_inner));
        drop(new.message.lock().unwrap_or_else(PoisonError::into_inner));
        Box::into_raw(Box::new(new))
    }
}

/// A wrench that the tip of a part exerts on its surroundings.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwPush {
    /// Moment about `at`, world axes, N m.
    pub moment: [f64; 3],
    /// Force, world axes, N.
    pub force: [f64; 3],
    /// Point of application in the tip's frame, m.
    pub at: [f64; 3],
    /// The part, a chain.
    pub part: u32,
}

/// Creates a robot of a model at its neutral configuration and writes it to `out`; free it with `lw_robot_free`. Allocates the memory of all later
/// calls.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_new(model: *const LwModel, out: *mut *mut LwRobot) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        edge::shared(model, LwModel::message, |m| {
            Out::new("out", out)?.set(LwRobot::give(Robot::new(&m.model)));
            Ok(())
        })
    }
}

/// Creates an independent robot with the same configuration, held objects and settings, and writes it to `out`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_clone(robot: *const LwRobot, out: *mut *mut LwRobot) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            Out::new("out", out)?.set(LwRobot::give(r.robot.clone()));
            Ok(())
        })
    }
}

/// Frees a robot; NULL has no effect.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_free(robot: *mut LwRobot) {
    // SAFETY: guaranteed by the caller.
    unsafe { edge::free(robot) }
}

/// Like `lw_builder_message`, for a robot. May be called while another thread is in a call with the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_message(
    robot: *const LwRobot,
    buffer: *mut c_char,
    room: usize,
    wanted: *mut usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { edge::message(robot, |r| &r.message, buffer, room, wanted) }
}

/// Writes the configuration to `q` (`n` = nq).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_q(robot: *mut LwRobot, q: *mut f64, n: usize) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            numbers_mut("q", q, n, r.model().nq())?.copy_from_slice(r.robot.q());
            Ok(())
        })
    }
}

/// Sets the configuration to `q` (`n` = nq). Limits are not checked.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_q(robot: *mut LwRobot, q: *const f64, n: usize) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let q = numbers("q", q, n, r.model().nq())?;
            Ok(r.robot.set_q(q)?)
        })
    }
}

/// Moves `q` (`n` = nq) to the nearest configuration within all limits, in place.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_clamp(robot: *mut LwRobot, q: *mut f64, n: usize) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let q = numbers_mut("q", q, n, r.model().nq())?;
            Ok(r.robot.clamp(q)?)
        })
    }
}

/// Sets the acceleration of gravity (3 numbers), world axes, m/s^2. Default: 9.81 m/s^2 along -z.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_gravity(robot: *mut LwRobot, g: *const f64) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let g = value("g", g.cast::<[f64; 3]>())?;
            Ok(r.robot.set_gravity(vec3("g", &g)?)?)
        })
    }
}

/// Writes the pose of the tip of a chain in the world at the robot's q. Computes only the bodies between the world and the tip.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_tip_pose(
    robot: *mut LwRobot,
    part: u32,
    out: *mut LwPose,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, part) = (Out::new("out", out)?, r.part(part)?);
            out.set(r.robot.tip_pose(part)?.into());
            Ok(())
        })
    }
}

/// Writes the pose of a body in the world at the robot's q.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_body_pose(
    robot: *mut LwRobot,
    body: u32,
    out: *mut LwPose,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let id = r.model().multibody().body_ids().nth(body as usize);
            out.set(r.robot.body_pose(id.ok_or(RobotError::ForeignHandle)?).into());
            Ok(())
        })
    }
}

/// Writes the Jacobian of a chain at the robot's q to `J` (6 rows of its m degrees of freedom, row after row; `n` = 6 m). It maps rates to the
/// velocity of its tip relative to its base, angular rows (rad/s) first, at the tip's origin, world axes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_jacobian(
    robot: *mut LwRobot,
    part: u32,
    J: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let part = r.part(part)?;
            let J = numbers_mut("J", J, n, 6 * r.model().dofs(part)?.len())?;
            Ok(r.robot.jacobian(part, J)?)
        })
    }
}

/// Writes the Jacobian of a chain's tip over the whole mechanism to `J` (6 rows of nv; `n` = 6 nv). It includes the degrees of freedom that carry the
/// chain.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_whole_jacobian(
    robot: *mut LwRobot,
    part: u32,
    J: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let part = r.part(part)?;
            let J = numbers_mut("J", J, n, 6 * r.model().nv())?;
            Ok(r.robot.whole_jacobian(part, J)?)
        })
    }
}

/// Computes forces `tau` (`n` = nv; N m or N) for rates `v` and accelerations `vdot` (`n` = nv each) at the robot's q, including held objects, while
/// the tips exert wrenches. The number of `pushes` is at most the number of parts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_feed_forward(
    robot: *mut LwRobot,
    v: *const f64,
    vdot: *const f64,
    n: usize,
    pushes: *const LwPush,
    push_count: usize,
    tau: *mut f64,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            apart(("v", v, n), ("tau", tau, n))?;
            apart(("vdot", vdot, n), ("tau", tau, n))?;
            let nv = r.model().nv();
            let (v, vdot) = (numbers("v", v, n, nv)?, numbers("vdot", vdot, n, nv)?);
            take_pushes(r, pushes, push_count)?;
            let tau = numbers_mut("tau", tau, n, nv)?;
            Ok(r.robot.feed_forward(v, vdot, &r.pushes, tau)?)
        })
    }
}

/// Computes forces `tau` (`n` = nv) that hold the robot's q at rest, including held objects, while the tips exert wrenches: as in
/// `lw_robot_feed_forward`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_held_still(
    robot: *mut LwRobot,
    pushes: *const LwPush,
    push_count: usize,
    tau: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            take_pushes(r, pushes, push_count)?;
            let tau = numbers_mut("tau", tau, n, r.model().nv())?;
            Ok(r.robot.held_still(&r.pushes, tau)?)
        })
    }
}

/// Copies pushes into the robot's memory.
///
/// # Safety
/// The conditions in the crate documentation apply.
pub(crate) unsafe fn take_pushes(
    r: &mut Instance,
    p: *const LwPush,
    count: usize,
) -> Result<(), Fault> {
    let room = r.model().parts().len();
    if count > room {
        return Err(RobotError::NoRoom { what: "pushes", wanted: count, room }.into());
    }
    r.pushes.clear();
    for k in 0..count {
        // SAFETY: the caller has `count` of them; they are read one by one, because `count` may be zero.
        let p = unsafe { value("pushes", p.wrapping_add(k)) }?;
        let wrench = Force::new(vec3("moment", &p.moment)?, vec3("force", &p.force)?);
        r.pushes.push(Push { part: r.part(p.part)?, wrench, at: vec3("at", &p.at)? });
    }
    Ok(())
}

/// Writes the mass matrix at the robot's q, including held objects, to `M` (nv rows of nv, row after row; `n` = nv nv).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_mass_matrix(
    robot: *mut LwRobot,
    M: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let nv = r.model().nv();
            let M = numbers_mut("M", M, n, nv * nv)?;
            Ok(r.robot.mass_matrix(M)?)
        })
    }
}

/// Writes the mass of all moving bodies, including held objects, kg, to `mass` (may be NULL), and their centre of mass at the robot's q, world, m, to
/// `center` (3 numbers).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_center_of_mass(
    robot: *mut LwRobot,
    mass: *mut f64,
    center: *mut f64,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let center = Out::new("center", center.cast::<[f64; 3]>())?;
            let mass = if mass.is_null() { None } else { Some(Out::new("mass", mass)?) };
            let (sum, at) = r.robot.center_of_mass();
            center.set(at.into());
            if let Some(mass) = mass {
                mass.set(sum);
            }
            Ok(())
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;
    use linkwork_embedded::ModelSpec;
    use linkwork_embedded::multibody::Builder;

    #[test]
    fn what_panics_once_answers_nothing_else() {
        let spec = ModelSpec { mechanism: Builder::new(), ..ModelSpec::default() };
        let robot = LwRobot::give(Robot::new(&RobotModel::new(&spec).unwrap()));
        let mut text = [0; 400];
        // SAFETY: a handle of this library, freed at the end; the message has its own memory.
        unsafe {
            let held = alone(robot, LwRobot::parts, |_| {
                // Make another call with the same handle meanwhile.
                let busy = std::thread::scope(|s| {
                    let address = robot.expose_provenance();
                    let call = move || {
                        let robot = std::ptr::with_exposed_provenance_mut(address);
                        lw_robot_set_q(robot, std::ptr::null(), 0)
                    };
                    s.spawn(call).join().unwrap()
                });
                assert_eq!(busy, LwStatus::Busy);
                Ok(())
            });
            assert_eq!(held, LwStatus::Ok);
            assert_eq!(lw_robot_set_q(robot, std::ptr::null(), 0), LwStatus::Ok);
            assert_eq!(alone(robot, LwRobot::parts, |_| panic!("on purpose")), LwStatus::Panicked);
            assert_eq!(lw_robot_set_q(robot, std::ptr::null(), 0), LwStatus::Panicked);
            let told = lw_robot_message(robot, text.as_mut_ptr(), text.len(), std::ptr::null_mut());
            assert_eq!(told, LwStatus::Ok);
            let text = std::ffi::CStr::from_ptr(text.as_ptr()).to_str().unwrap();
            assert!(text.contains("bug in the library"), "{text}");
            lw_robot_free(robot);
        }
    }
}
