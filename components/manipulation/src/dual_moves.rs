//! Moves of two hands: each goes its own way, or both take along what they hold between them.

use crate::arm::Load;
use crate::moves::{Move, Path, Written};
use linkwork_runtime::prelude::*;
use linkwork_spatial::Pose;

/// The way of a hand's tip, or of what both hold.
#[derive(Params, Clone, Debug)]
pub struct HandMotion {
    /// Where it is to be at the end; unwritten: where it is.
    #[param(unit = "m", default = None)]
    pub position: Option<Vec3>,
    /// Roll, pitch, yaw at the end; unwritten: as it is. What both hands hold has the axes of the move's frame when they take hold of it.
    #[param(unit = "rad", default = None)]
    pub rpy: Option<Vec3>,
    /// Instead of a line: it turns by this angle about `axis` through `axis_point`.
    #[param(unit = "rad", default = None)]
    pub turn: Option<f64>,
    /// A point of that axis.
    #[param(unit = "m", default = Vec3::zeros())]
    pub axis_point: Vec3,
    /// Direction of that axis.
    #[param(default = Vec3::z())]
    pub axis: Vec3,
    /// Force that it presses with beside what holds its pose.
    #[param(unit = "N", default = Vec3::zeros())]
    pub force: Vec3,
    /// Moment that it turns with.
    #[param(unit = "N m", default = Vec3::zeros())]
    pub moment: Vec3,
    /// Stiffness, N/m and N m/rad: it gives way as a spring with its damper. Unwritten: it tracks its pose, whatever the force.
    #[param(default = None, range = 0.0..)]
    pub stiffness: Option<[f64; 2]>,
    /// The move ends as soon as that spring, with its damper, pushes with more than this, and fails when nothing is felt; for a way
    /// with `stiffness`.
    #[param(unit = "N", default = None, range = 1e-6..)]
    pub touch: Option<f64>,
    /// The load that is held; unwritten: none.
    #[param(default = None)]
    pub holds: Option<String>,
    /// The gripper is told to be closed; both are while both hold one thing.
    #[param(default = false)]
    pub grip: bool,
}

/// One move. The move after it begins where the wanted poses stood when this one ended.
#[derive(Params, Clone, Debug)]
pub struct DualMove {
    /// Its name, for messages.
    pub name: String,
    /// How long the motion takes; afterwards the tips stay at their ends until they have arrived.
    #[param(unit = "s", range = 1e-3..=1e6)]
    pub duration: f64,
    /// The left tip's way; unwritten: it stays, with its gripper open.
    #[param(default = None)]
    pub left: Option<HandMotion>,
    /// The right tip's way; unwritten: it stays, with its gripper open.
    #[param(default = None)]
    pub right: Option<HandMotion>,
    /// The way of what both hands hold between them: of the point halfway between the tips. `left` and `right` are unwritten then.
    #[param(default = None)]
    pub both: Option<HandMotion>,
    /// work: ways are written in the frame of the work; base: in that of the base.
    #[param(default = Written::Work)]
    pub frame: Written,
    /// Force with which both hands press what they hold, at the least.
    #[param(unit = "N", default = 0.0, range = 0.0..)]
    pub squeeze: f64,
    /// The next move waits until the tips have arrived.
    #[param(default = true)]
    pub arrive: bool,
}

/// A way, ready to be evaluated.
#[derive(Clone, Debug)]
pub struct Track {
    /// Where it goes.
    pub path: Path,
    /// Stiffness of a way that gives way.
    pub stiffness: Option<[f64; 2]>,
    /// Force that ends the move, N.
    pub touch: Option<f64>,
    /// What is held, by its place among the loads.
    pub load: Option<usize>,
    /// The gripper is to be closed.
    pub grip: bool,
}

impl Track {
    /// The same where the work is seen so far beside; see [`Path::seen`].
    #[must_use]
    pub fn seen(&self, beside: &Vec3) -> Path {
        self.path.seen(beside)
    }
}

/// What moves in a move.
#[derive(Clone, Debug)]
pub enum Tracks {
    /// Each hand by itself: left, right.
    Apart(Box<[Track; 2]>),
    /// What both hold; its axes when they take hold of it are those of the move's frame, base axes.
    Together(Box<Track>, Quat),
}

impl Tracks {
    /// From a move; `work` is the frame of the work in the base.
    ///
    /// # Errors
    /// What [`Path::new`] refuses; `both` beside `left` or `right`, or without a load; a squeeze without `both`; one load in each hand.
    pub fn new(m: &DualMove, work: &Pose, loads: &[Load]) -> Result<Self, BuildError> {
        let fault = |fact: &str, help: &str| {
            Err(BuildError::new(format!("move `{}`: {fact}", m.name)).help(help).at("moves"))
        };
        let track = |way: &Option<HandMotion>| track(m, way.as_ref(), work, loads);
        if m.both.is_some() {
            if m.left.is_some() || m.right.is_some() {
                let help = "write `both`, or `left` and `right`";
                return fault("both hands move together, and one by itself", help);
            }
            let both = track(&m.both)?;
            if both.load.is_none() {
                return fault("both hands hold nothing", "write `holds`, the name of a load");
            }
            let axes = if m.frame == Written::Work { work.rotation } else { Quat::identity() };
            return Ok(Tracks::Together(Box::new(both), axes));
        }
        if m.squeeze > 0.0 {
            return fault("it squeezes, and no load is in both hands", "write `both`");
        }
        let (left, right) = (track(&m.left)?, track(&m.right)?);
        if left.load.is_some() && left.load == right.load {
            return fault("each hand holds the same load", "write `both`, or one of the two");
        }
        Ok(Tracks::Apart(Box::new([left, right])))
    }
}

fn track(
    m: &DualMove,
    way: Option<&HandMotion>,
    work: &Pose,
    loads: &[Load],
) -> Result<Track, BuildError> {
    let still = Move::stay(&m.name, m.duration);
    let of_hand = match way {
        None => still,
        Some(w) => Move {
            position: w.position,
            rpy: w.rpy,
            turn: w.turn,
            axis_point: w.axis_point,
            axis: w.axis,
            frame: m.frame,
            force: w.force,
            moment: w.moment,
            stiffness: w.stiffness,
            touch: w.touch,
            ..still
        },
    };
    Ok(Track {
        path: Path::new(&of_hand, work)?,
        stiffness: of_hand.stiffness,
        touch: of_hand.touch,
        load: Load::find(loads, way.and_then(|w| w.holds.as_deref()), &m.name)?,
        grip: way.is_some_and(|w| w.grip) || m.both.is_some(),
    })
}
