//! Two hands on one object: current hold, load sharing, squeezing, and grasp by friction.

use crate::call::calls;
use crate::edge::{LwPose, Out, numbers_mut, value, vec3};
use crate::robot::LwRobot;
use crate::status::Fault;
use linkwork_embedded::spatial::Force;
use linkwork_embedded::{Balance, Friction, HandWeights, Object};

/// Minimize the sum of squares of the forces.
pub const LW_BALANCE_EQUAL: u32 = 0;
/// Minimize the sum of squares of the forces divided by the effort limits.
pub const LW_BALANCE_EFFORT: u32 = 1;

/// A moment and a force.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwWrench {
    /// Moment, world axes, N m.
    pub moment: [f64; 3],
    /// Force, world axes, N.
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

/// The hands that hold an object.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwHold {
    /// Number of hands: 0, 1 or 2. Unused entries are zero.
    pub count: u32,
    /// The hand that carries it in the mechanism, then the second hand, as parts.
    pub hands: [u32; 2],
    /// Pose of the object in the frames of the hands' tips.
    pub at: [LwPose; 2],
}

/// Result of load sharing between two hands.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwShared {
    /// Wrench of the second hand on the object, about this hand's tip.
    pub second: LwWrench,
    /// The minimized sum.
    pub cost: f64,
    /// The largest |tau| / limit over all joints of both chains that have an effort limit. Above 1 the joints cannot exert these forces.
    pub largest_share: f64,
}

/// Wrenches of two hands on an object, separated: first hand, then second hand, each about its own tip.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwHandWrenches {
    /// The part that moves the object.
    pub moving: [LwWrench; 2],
    /// The part that only squeezes it.
    pub squeezing: [LwWrench; 2],
    /// Net wrench, about the object's origin.
    pub net: LwWrench,
}

/// Friction contact of a hand: a patch with uniform pressure.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwFriction {
    /// Direction in which the hand presses on the object, in the tip's axes; any length except zero.
    pub normal: [f64; 3],
    /// Coefficient of friction, above zero.
    pub coefficient: f64,
    /// Radius of the contact patch, m, above zero.
    pub radius: f64,
    /// Largest normal force, N, above zero; infinite for no limit.
    pub most: f64,
}

/// Wrenches of two hands under which neither slips.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LwGripped {
    /// Wrenches on the object: first hand, then second hand, each about its own tip.
    pub wrenches: [LwWrench; 2],
    /// 0 if neither hand slips. Otherwise no such wrenches exist, and this is the smallest force, N, by which cones and limits would have to be
    /// enlarged; `wrenches` are those for the enlarged cones.
    pub shortfall: f64,
}

/// # Safety
/// The conditions in the crate documentation apply.
unsafe fn both(p: *const LwWrench) -> Result<[Force; 2], Fault> {
    // SAFETY: the caller has two of them.
    let [a, b] = unsafe { value("wrenches", p.cast::<[LwWrench; 2]>()) }?;
    Ok([a.checked()?, b.checked()?])
}

calls![
    /// Writes the hands that hold an object to `out`; none is not an error.
    fn lw_robot_hold(r: &mut LwRobot, object: Object, out: Out<LwHold>) {
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
    }

    /// Shares the load of an object between the two hands that hold it, at the robot's q. `tau` (`n` = nv) contains forces with the object on the first
    /// hand on input, as `lw_robot_feed_forward` computes them, and forces of both hands for the same motion on output; only those of the two chains
    /// change. `balance`: one of `LW_BALANCE_..`. Hands may pull as well as press; `lw_robot_grip` considers friction. Returns `LW_STATUS_NOT_HELD` or
    /// `LW_STATUS_EMPTY_HAND` without two hands; `LW_STATUS_OUT_OF_RANGE` when `LW_BALANCE_EFFORT` needs the effort limit of a joint that has none.
    fn lw_robot_balance(
        r: &mut LwRobot,
        object: Object,
        balance: u32,
        tau: *mut f64,
        n: usize,
        out: Out<LwShared>,
    ) {
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
    }

    /// Adds to `tau` (`n` = nv) forces that press the two hands of an object towards each other with `force` (N) along the line between their tips, at
    /// the robot's q. The net wrench on the object is zero. Writes the wrenches of both hands on the object to `wrenches` (2: first hand, then second
    /// hand, each about its tip). Returns `LW_STATUS_SINGULAR` when both tips are at the same point.
    fn lw_robot_squeeze(
        r: &mut LwRobot,
        object: Object,
        force: f64,
        tau: *mut f64,
        n: usize,
        wrenches: *mut LwWrench,
    ) {
        let out = Out::new("wrenches", wrenches.cast::<[LwWrench; 2]>())?;
        let tau = numbers_mut("tau", tau, n, r.model().nv())?;
        out.set(r.robot.squeeze(object, force, tau)?.map(LwWrench::from));
    }

    /// Adds to `tau` (`n` = nv) the forces with which the two hands of an object exert `wrenches` on it (2: first hand, then second hand, each about its
    /// tip), at the robot's q.
    fn lw_robot_add_hand_wrenches(
        r: &mut LwRobot,
        object: Object,
        wrenches: *const LwWrench,
        tau: *mut f64,
        n: usize,
    ) {
        let wrenches = both(wrenches)?;
        let tau = numbers_mut("tau", tau, n, r.model().nv())?;
        r.robot.add_hand_wrenches(object, &wrenches, tau)?;
    }

    /// Separates the wrenches of two hands on an object (2: first hand, then second hand, each about its tip) into the part that moves it, with the
    /// smallest weighted sum of squares, and the part that only squeezes it; writes both to `out`. `weights` (3 numbers, above zero): first hand, second
    /// hand, and 1 N m relative to 1 N (1/m^2).
    fn lw_robot_split_hand_wrenches(
        r: &mut LwRobot,
        object: Object,
        wrenches: *const LwWrench,
        weights: *const f64,
        out: Out<LwHandWrenches>,
    ) {
        let wrenches = both(wrenches)?;
        let [a, b, moment] = value("weights", weights.cast::<[f64; 3]>())?;
        let weights = HandWeights { hands: [a, b], moment };
        let told = r.robot.split_hand_wrenches(object, &wrenches, &weights)?;
        out.set(LwHandWrenches {
            moving: told.moving.map(LwWrench::from),
            squeezing: told.squeezing.map(LwWrench::from),
            net: told.net.into(),
        });
    }

    /// Computes wrenches of two hands on an object under which neither slips, at the robot's q, and writes them to `out`. They are the nearest to
    /// `wrenches` (2: first hand, then second hand, each about its tip) with the same net wrench. `friction` (2): the contact of each hand.
    fn lw_robot_grip(
        r: &mut LwRobot,
        object: Object,
        wrenches: *const LwWrench,
        friction: *const LwFriction,
        out: Out<LwGripped>,
    ) {
        let wrenches = both(wrenches)?;
        let friction = value("friction", friction.cast::<[LwFriction; 2]>())?;
        let friction = friction.map(|f| {
            let LwFriction { normal, coefficient, radius, most } = f;
            Friction { normal: normal.into(), coefficient, radius, most }
        });
        let told = r.robot.grip(object, &wrenches, &friction)?;
        let wrenches = told.wrenches.map(LwWrench::from);
        out.set(LwGripped { wrenches, shortfall: told.shortfall });
    }
];
