//! One robot: its configuration, kinematics, forces and masses.

use crate::call::{calls, indices};
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

    pub fn collider(&self, index: u32) -> Result<ColliderId, Fault> {
        let found = self.model().colliders().nth(index as usize).map(|c| c.0);
        Ok(found.ok_or(RobotError::ForeignHandle)?)
    }

    pub fn object(&self, index: u32) -> Result<Object, Fault> {
        edge::object(self.model(), index)
    }
}

indices! {
    Part, Instance, |r, c| r.part(c);
    Object, Instance, |r, c| r.object(c);
    ColliderId, Instance, |r, c| r.collider(c);
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

calls![
    /// Creates a robot of a model at its neutral configuration and writes it to `out`; free it with `lw_robot_free`. Allocates the memory of all later
    /// calls.
    fn lw_robot_new(m: &LwModel, out: Out<*mut LwRobot>) {
        out.set(LwRobot::give(Robot::new(&m.model)));
    }
];

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

calls![
    /// Frees a robot; NULL has no effect.
    fn lw_robot_free(robot: *mut LwRobot);
];

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

calls![
    /// Writes the configuration to `q` (`n` = nq).
    fn lw_robot_q(r: &mut LwRobot, q: *mut f64, n: usize) {
        numbers_mut("q", q, n, r.model().nq())?.copy_from_slice(r.robot.q());
    }

    /// Sets the configuration to `q` (`n` = nq). Limits are not checked.
    fn lw_robot_set_q(r: &mut LwRobot, q: *const f64, n: usize) {
        let q = numbers("q", q, n, r.model().nq())?;
        r.robot.set_q(q)?;
    }

    /// Moves `q` (`n` = nq) to the nearest configuration within all limits, in place.
    fn lw_robot_clamp(r: &mut LwRobot, q: *mut f64, n: usize) {
        let q = numbers_mut("q", q, n, r.model().nq())?;
        r.robot.clamp(q)?;
    }

    /// Sets the acceleration of gravity (3 numbers), world axes, m/s^2. Default: 9.81 m/s^2 along -z.
    fn lw_robot_set_gravity(r: &mut LwRobot, g: *const f64) {
        let g = value("g", g.cast::<[f64; 3]>())?;
        r.robot.set_gravity(vec3("g", &g)?)?;
    }

    /// Writes the pose of the tip of a chain in the world at the robot's q. Computes only the bodies between the world and the tip.
    fn lw_robot_tip_pose(r: &mut LwRobot, part: Part, out: Out<LwPose>) {
        out.set(r.robot.tip_pose(part)?.into());
    }

    /// Writes the pose of a body in the world at the robot's q.
    fn lw_robot_body_pose(r: &mut LwRobot, body: u32, out: Out<LwPose>) {
        let id = r.model().multibody().body_ids().nth(body as usize);
        out.set(r.robot.body_pose(id.ok_or(RobotError::ForeignHandle)?).into());
    }

    /// Writes the Jacobian of a chain at the robot's q to `J` (6 rows of its m degrees of freedom, row after row; `n` = 6 m). It maps rates to the
    /// velocity of its tip relative to its base, angular rows (rad/s) first, at the tip's origin, world axes.
    fn lw_robot_jacobian(r: &mut LwRobot, part: Part, J: *mut f64, n: usize) {
        let J = numbers_mut("J", J, n, 6 * r.model().dofs(part)?.len())?;
        r.robot.jacobian(part, J)?;
    }

    /// Writes the Jacobian of a chain's tip over the whole mechanism to `J` (6 rows of nv; `n` = 6 nv). It includes the degrees of freedom that carry the
    /// chain.
    fn lw_robot_whole_jacobian(r: &mut LwRobot, part: Part, J: *mut f64, n: usize) {
        let J = numbers_mut("J", J, n, 6 * r.model().nv())?;
        r.robot.whole_jacobian(part, J)?;
    }

    /// Computes forces `tau` (`n` = nv; N m or N) for rates `v` and accelerations `vdot` (`n` = nv each) at the robot's q, including held objects, while
    /// the tips exert wrenches. The number of `pushes` is at most the number of parts.
    fn lw_robot_feed_forward(
        r: &mut LwRobot,
        v: *const f64,
        vdot: *const f64,
        n: usize,
        pushes: *const LwPush,
        push_count: usize,
        tau: *mut f64,
    ) {
        apart(("v", v, n), ("tau", tau, n))?;
        apart(("vdot", vdot, n), ("tau", tau, n))?;
        let nv = r.model().nv();
        let (v, vdot) = (numbers("v", v, n, nv)?, numbers("vdot", vdot, n, nv)?);
        take_pushes(r, pushes, push_count)?;
        let tau = numbers_mut("tau", tau, n, nv)?;
        r.robot.feed_forward(v, vdot, &r.pushes, tau)?;
    }

    /// Computes forces `tau` (`n` = nv) that hold the robot's q at rest, including held objects, while the tips exert wrenches: as in
    /// `lw_robot_feed_forward`.
    fn lw_robot_held_still(
        r: &mut LwRobot,
        pushes: *const LwPush,
        push_count: usize,
        tau: *mut f64,
        n: usize,
    ) {
        take_pushes(r, pushes, push_count)?;
        let tau = numbers_mut("tau", tau, n, r.model().nv())?;
        r.robot.held_still(&r.pushes, tau)?;
    }

    /// Writes the mass matrix at the robot's q, including held objects, to `M` (nv rows of nv, row after row; `n` = nv nv).
    fn lw_robot_mass_matrix(r: &mut LwRobot, M: *mut f64, n: usize) {
        let nv = r.model().nv();
        let M = numbers_mut("M", M, n, nv * nv)?;
        r.robot.mass_matrix(M)?;
    }

    /// Writes the mass of all moving bodies, including held objects, kg, to `mass` (may be NULL), and their centre of mass at the robot's q, world, m, to
    /// `center` (3 numbers).
    fn lw_robot_center_of_mass(r: &mut LwRobot, mass: Option<Out<f64>>, center: *mut f64) {
        let center = Out::new("center", center.cast::<[f64; 3]>())?;
        let (sum, at) = r.robot.center_of_mass();
        center.set(at.into());
        if let Some(mass) = mass {
            mass.set(sum);
        }
    }
];

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
