//! One robot: its configuration, kinematics, forces, masses.

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
    /// What the tips push, as the last call gave it.
    pub pushes: Vec<Push>,
    /// Chains that the last call named, and how their tips move.
    pub asked: Vec<Part>,
    pub moved: Vec<Motion>,
    /// Closed forms of the parts.
    pub closed: Closed,
    /// The path that is looked at in portions.
    pub swept: Swept,
    /// Which joints of an object may move, as the last call said.
    pub free: Vec<bool>,
    /// Pairs of colliders of the last call.
    pub near: Vec<Closest>,
    pub hits: Vec<(ColliderId, ColliderId)>,
    /// Colliders that the last call named.
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

/// One instance of a model, with all the memory that its calls take. For one thread at a time: a call that meets another one answers `LW_STATUS_BUSY`.
/// Several robots of one model know nothing of each other.
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
        // A lock may take memory at its first use on some systems.
        drop(new.inner.lock().unwrap_or_else(PoisonError::into_inner));
        drop(new.message.lock().unwrap_or_else(PoisonError::into_inner));
        Box::into_raw(Box::new(new))
    }
}

/// A wrench that the tip of a part exerts on something.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwPush {
    /// Moment about `at`, world axes, N m.
    pub moment: [f64; 3],
    /// Force, world axes, N.
    pub force: [f64; 3],
    /// Where, in the tip's frame, m.
    pub at: [f64; 3],
    /// The part, a chain.
    pub part: u32,
}

/// A robot of a model at its neutral configuration, into `out`; free it with `lw_robot_free`. All memory of later calls is taken here.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_new(model: *const LwModel, out: *mut *mut LwRobot) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        edge::shared(model, LwModel::message, |m| {
            Out::new("out", out)?.set(LwRobot::give(Robot::new(&m.model)));
            Ok(())
        })
    }
}

/// A robot of its own with the same configuration, held objects and settings, into `out`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_clone(robot: *const LwRobot, out: *mut *mut LwRobot) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            Out::new("out", out)?.set(LwRobot::give(r.robot.clone()));
            Ok(())
        })
    }
}

/// Frees a robot; NULL is none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_free(robot: *mut LwRobot) {
    // SAFETY: the caller's promises.
    unsafe { edge::free(robot) }
}

/// As `lw_builder_message`, of a robot. May be called while another thread is in a call with the robot.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_message(
    robot: *const LwRobot,
    buffer: *mut c_char,
    room: usize,
    wanted: *mut usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe { edge::message(robot, |r| &r.message, buffer, room, wanted) }
}

/// The configuration, into `q` (`n` = nq).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_q(robot: *mut LwRobot, q: *mut f64, n: usize) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            numbers_mut("q", q, n, r.model().nq())?.copy_from_slice(r.robot.q());
            Ok(())
        })
    }
}

/// Another configuration `q` (`n` = nq), within limits or not.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_q(robot: *mut LwRobot, q: *const f64, n: usize) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let q = numbers("q", q, n, r.model().nq())?;
            Ok(r.robot.set_q(q)?)
        })
    }
}

/// The nearest to `q` (`n` = nq) that is within all limits, in place.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_clamp(robot: *mut LwRobot, q: *mut f64, n: usize) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let q = numbers_mut("q", q, n, r.model().nq())?;
            Ok(r.robot.clamp(q)?)
        })
    }
}

/// The acceleration of free fall (3 numbers), world axes, m/s^2; 9.81 down z at first.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_set_gravity(robot: *mut LwRobot, g: *const f64) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let g = value("g", g.cast::<[f64; 3]>())?;
            Ok(r.robot.set_gravity(vec3("g", &g)?)?)
        })
    }
}

/// Where the tip of a chain is in the world at the robot's q. Moves the bodies from the world to the tip and no others.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_tip_pose(
    robot: *mut LwRobot,
    part: u32,
    out: *mut LwPose,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, part) = (Out::new("out", out)?, r.part(part)?);
            out.set(r.robot.tip_pose(part)?.into());
            Ok(())
        })
    }
}

/// Where a body is in the world at the robot's q.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_body_pose(
    robot: *mut LwRobot,
    body: u32,
    out: *mut LwPose,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("out", out)?;
            let id = r.model().multibody().body_ids().nth(body as usize);
            out.set(r.robot.body_pose(id.ok_or(RobotError::ForeignHandle)?).into());
            Ok(())
        })
    }
}

/// The Jacobian of a chain at the robot's q, into `J` (6 rows of its m degrees of freedom, row after row; `n` = 6 m): rates to the
/// velocity of its tip relative to its base, angular rows (rad/s) first, at the tip's origin, world axes.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_jacobian(
    robot: *mut LwRobot,
    part: u32,
    J: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let part = r.part(part)?;
            let J = numbers_mut("J", J, n, 6 * r.model().dofs(part)?.len())?;
            Ok(r.robot.jacobian(part, J)?)
        })
    }
}

/// The Jacobian of a chain's tip in the whole mechanism, into `J` (6 rows of nv; `n` = 6 nv): what carries the chain counts, too.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_whole_jacobian(
    robot: *mut LwRobot,
    part: u32,
    J: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let part = r.part(part)?;
            let J = numbers_mut("J", J, n, 6 * r.model().nv())?;
            Ok(r.robot.whole_jacobian(part, J)?)
        })
    }
}

/// Forces, into `tau` (`n` = nv; N m or N), for rates `v` and accelerations `vdot` (`n` = nv each) at the robot's q, with what is held, while tips push: at most as many `pushes` as the
/// model has parts.
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
    // SAFETY: the caller's promises.
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

/// Forces, into `tau` (`n` = nv), that hold the robot's q still, with what is held, while tips push: as `lw_robot_feed_forward`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_held_still(
    robot: *mut LwRobot,
    pushes: *const LwPush,
    push_count: usize,
    tau: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
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
/// The promises at the head of the crate.
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
        // SAFETY: the caller has `count` of them; one by one, since none of them may be there.
        let p = unsafe { value("pushes", p.wrapping_add(k)) }?;
        let wrench = Force::new(vec3("moment", &p.moment)?, vec3("force", &p.force)?);
        r.pushes.push(Push { part: r.part(p.part)?, wrench, at: vec3("at", &p.at)? });
    }
    Ok(())
}

/// The mass matrix at the robot's q with what is held, into `M` (nv rows of nv, row after row; `n` = nv nv).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_mass_matrix(
    robot: *mut LwRobot,
    M: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let nv = r.model().nv();
            let M = numbers_mut("M", M, n, nv * nv)?;
            Ok(r.robot.mass_matrix(M)?)
        })
    }
}

/// The mass of all that moves with what is held, kg, into `mass` (NULL: not asked for), and its centre at the robot's q, world, m, into `center` (3 numbers).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_center_of_mass(
    robot: *mut LwRobot,
    mass: *mut f64,
    center: *mut f64,
) -> LwStatus {
    // SAFETY: the caller's promises.
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
        // SAFETY: a handle of this library, freed at the end; memory of its own for the message.
        unsafe {
            let held = alone(robot, LwRobot::parts, |_| {
                // Another call with the same handle meanwhile.
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
            assert!(text.contains("mistake in the library"), "{text}");
            lw_robot_free(robot);
        }
    }
}
