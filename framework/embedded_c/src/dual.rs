//! Two hands on one object: who holds it, loads shared, squeezed, and held by friction.

use crate::edge::{LwPose, Out, alone, numbers_mut, value, vec3};
use crate::robot::LwRobot;
use crate::status::{Fault, LwStatus};
use linkwork_embedded::spatial::Force;
use linkwork_embedded::{Balance, Friction, HandWeights};

/// The sum of squares of the forces is made small.
pub const LW_BALANCE_EQUAL: u32 = 0;
/// The sum of squares of the forces as shares of the limits of effort is made small.
pub const LW_BALANCE_EFFORT: u32 = 1;

/// A moment and a force.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwWrench {
    /// World axes, N m.
    pub moment: [f64; 3],
    /// World axes, N.
    pub force: [f64; 3],
}

impl From<Force> for LwWrench {
    fn from(f: Force) -> Self {
        Self { moment: f.moment.into(), force: f.force.into() }
    }
}

impl LwWrench {
    fn checked(&self) -> Result<Force, Fault> {
        Ok(Force::new(vec3("moment", &self.moment)?, vec3("force", &self.force)?))
    }
}

/// Who holds an object.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwHold {
    /// How many hands do: 0, 1 or 2. What is beyond is zero.
    pub count: u32,
    /// The hand that carries it in the mechanism, then the second: parts.
    pub hands: [u32; 2],
    /// Where the object is in the frames of their tips.
    pub at: [LwPose; 2],
}

/// How two hands share a load.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwShared {
    /// What the second hand does to the object, about its own tip.
    pub second: LwWrench,
    /// The sum that was made small.
    pub cost: f64,
    /// The greatest |tau| / limit over the joints of both chains that have a limit of effort; above 1 they cannot do it.
    pub largest_share: f64,
}

/// What two hands do to an object, told apart: first hand, then second, each about its own tip.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwHandWrenches {
    /// What moves the object.
    pub moving: [LwWrench; 2],
    /// What only squeezes it.
    pub squeezing: [LwWrench; 2],
    /// The sum, about the object's origin.
    pub net: LwWrench,
}

/// What a hand can hold by friction: a patch that is pressed evenly.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwFriction {
    /// Where it presses the object to, in the tip's axes; of any length but zero.
    pub normal: [f64; 3],
    /// Coefficient of friction, above zero.
    pub coefficient: f64,
    /// Radius of the patch that touches, m, above zero.
    pub radius: f64,
    /// Greatest normal force, N, above zero; infinite for none.
    pub most: f64,
}

/// What two hands do so that neither slips.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwGripped {
    /// On the object: first hand, then second, each about its own tip.
    pub wrenches: [LwWrench; 2],
    /// 0 when both hold. Else no wrenches do: the least force by which cones and limits would have to be wider, N; the wrenches are those that would hold then.
    pub shortfall: f64,
}

/// # Safety
/// The promises at the head of the crate.
unsafe fn both(p: *const LwWrench) -> Result<[Force; 2], Fault> {
    // SAFETY: the caller has two of them.
    let [a, b] = unsafe { value("wrenches", p.cast::<[LwWrench; 2]>()) }?;
    Ok([a.checked()?, b.checked()?])
}

/// Who holds an object, into `out`; nobody is an answer.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_hold(
    robot: *mut LwRobot,
    object: u32,
    out: *mut LwHold,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, object) = (Out::new("out", out)?, r.object(object)?);
            let none = LwPose { position: [0.0; 3], quaternion: [0.0; 4] };
            let mut told = LwHold { count: 0, hands: [0; 2], at: [none; 2] };
            if let Some(hold) = r.robot.hold(object)? {
                for (hand, X) in std::iter::once(hold.hand).chain(hold.second) {
                    let k = told.count as usize;
                    (told.hands[k], told.at[k]) = (hand.index() as u32, X.into());
                    told.count += 1;
                }
            }
            out.set(told);
            Ok(())
        })
    }
}

/// Shares the load of an object between the two hands that hold it, at the robot's q: `tau` (`n` = nv; in: forces with the object on the first hand, as `lw_robot_feed_forward` gives
/// them; out: forces of both hands for the same motion; only those of the two chains change). `balance`: one of `LW_BALANCE_..`. The shares may pull as well as press:
/// `lw_robot_grip` knows friction. `LW_STATUS_NOT_HELD`, `LW_STATUS_EMPTY_HAND` without two hands; `LW_STATUS_OUT_OF_RANGE` where a joint has no limit of effort to take a share of.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_balance(
    robot: *mut LwRobot,
    object: u32,
    balance: u32,
    tau: *mut f64,
    n: usize,
    out: *mut LwShared,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, object) = (Out::new("out", out)?, r.object(object)?);
            let balance = match balance {
                LW_BALANCE_EQUAL => Balance::Equal,
                LW_BALANCE_EFFORT => Balance::Effort,
                value => {
                    let (what, help) = ("balance", "one of LW_BALANCE_..");
                    return Err(Fault::Choice { what, value, help });
                }
            };
            let tau = numbers_mut("tau", tau, n, r.model().nv())?;
            let told = r.robot.balance(object, balance, tau)?;
            let (cost, largest_share) = (told.cost, told.largest_share);
            out.set(LwShared { second: told.second.into(), cost, largest_share });
            Ok(())
        })
    }
}

/// Adds to `tau` (`n` = nv) what presses the two hands of an object towards each other with `force` (N) along the line between their tips, at the robot's q; the object feels no net wrench.
/// What both do to it into `wrenches` (2: first hand, then second, each about its tip). `LW_STATUS_SINGULAR` when both tips are at one place.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_squeeze(
    robot: *mut LwRobot,
    object: u32,
    force: f64,
    tau: *mut f64,
    n: usize,
    wrenches: *mut LwWrench,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let out = Out::new("wrenches", wrenches.cast::<[LwWrench; 2]>())?;
            let object = r.object(object)?;
            let tau = numbers_mut("tau", tau, n, r.model().nv())?;
            out.set(r.robot.squeeze(object, force, tau)?.map(LwWrench::from));
            Ok(())
        })
    }
}

/// Adds to `tau` (`n` = nv) the forces with which the two hands of an object exert `wrenches` on it (2: first hand, then second, each about its tip), at the robot's q.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_add_hand_wrenches(
    robot: *mut LwRobot,
    object: u32,
    wrenches: *const LwWrench,
    tau: *mut f64,
    n: usize,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (wrenches, object) = (both(wrenches)?, r.object(object)?);
            let tau = numbers_mut("tau", tau, n, r.model().nv())?;
            Ok(r.robot.add_hand_wrenches(object, &wrenches, tau)?)
        })
    }
}

/// Tells the wrenches of two hands on an object (2: first hand, then second, each about its tip) apart into `out`: what moves it, of least weighted sum of squares, and what only squeezes
/// it. `weights` (3 numbers, above zero): of the first hand, of the second, and of 1 N m against 1 N (1/m^2).
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_split_hand_wrenches(
    robot: *mut LwRobot,
    object: u32,
    wrenches: *const LwWrench,
    weights: *const f64,
    out: *mut LwHandWrenches,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, object) = (Out::new("out", out)?, r.object(object)?);
            let wrenches = both(wrenches)?;
            let [a, b, moment] = value("weights", weights.cast::<[f64; 3]>())?;
            let weights = HandWeights { hands: [a, b], moment };
            let told = r.robot.split_hand_wrenches(object, &wrenches, &weights)?;
            out.set(LwHandWrenches {
                moving: told.moving.map(LwWrench::from),
                squeezing: told.squeezing.map(LwWrench::from),
                net: told.net.into(),
            });
            Ok(())
        })
    }
}

/// Wrenches of two hands on an object under which neither slips, into `out`: those nearest to `wrenches` (2: first hand, then second, each about its tip) with the same net wrench, at the
/// robot's q. `friction` (2): what each hand can hold.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_robot_grip(
    robot: *mut LwRobot,
    object: u32,
    wrenches: *const LwWrench,
    friction: *const LwFriction,
    out: *mut LwGripped,
) -> LwStatus {
    // SAFETY: the caller's promises.
    unsafe {
        alone(robot, LwRobot::parts, |r| {
            let (out, object) = (Out::new("out", out)?, r.object(object)?);
            let wrenches = both(wrenches)?;
            let friction = value("friction", friction.cast::<[LwFriction; 2]>())?;
            let friction = friction.map(|f| {
                let LwFriction { normal, coefficient, radius, most } = f;
                Friction { normal: normal.into(), coefficient, radius, most }
            });
            let told = r.robot.grip(object, &wrenches, &friction)?;
            let wrenches = told.wrenches.map(LwWrench::from);
            out.set(LwGripped { wrenches, shortfall: told.shortfall });
            Ok(())
        })
    }
}
