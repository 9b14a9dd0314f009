//! Moves of two hands: each hand follows its own path, or both carry an object that they hold between them.

use crate::arm::Load;
use crate::moves::{Move, Path, Written};
use linkwork_runtime::prelude::*;
use linkwork_spatial::Pose;

/// Motion of the tip of one hand, or of the object that both hands hold.
#[derive(Params, Clone, Debug)]
pub struct HandMotion {
    /// Target position at the end of the move. Default: the position at its start.
    #[param(unit = "m", default = None)]
    pub position: Option<Vec3>,
    /// Target roll, pitch, yaw at the end of the move. Default: the attitude at its start. An object in both hands has the axes of the move's `frame`
    /// at the moment of grasping.
    #[param(unit = "rad", default = None)]
    pub rpy: Option<Vec3>,
    /// Angle of an arc about `axis` through `axis_point`, instead of a line.
    #[param(unit = "rad", default = None)]
    pub turn: Option<f64>,
    /// Point on the axis of the arc.
    #[param(unit = "m", default = Vec3::zeros(), needs = "turn")]
    pub axis_point: Vec3,
    /// Direction of the axis of the arc.
    #[param(default = Vec3::z(), needs = "turn")]
    pub axis: Vec3,
    /// Feedforward force that is added to the force that controls the pose.
    #[param(unit = "N", default = Vec3::zeros())]
    pub force: Vec3,
    /// Feedforward moment.
    #[param(unit = "N m", default = Vec3::zeros())]
    pub moment: Vec3,
    /// Stiffness in translation (N/m) and rotation (N m/rad) of a compliant motion: a spring with damper instead of tracking. Default: tracking of
    /// the pose, independent of the contact force.
    #[param(default = None, range = 0.0..)]
    pub stiffness: Option<[f64; 2]>,
    /// The move ends as soon as the spring and damper push with more than this force. If the force is not reached within `patience`, the move fails.
    /// Requires `stiffness`.
    #[param(unit = "N", default = None, range = 1e-6..)]
    pub touch: Option<f64>,
    /// Name of the load that is held during the move. Default: none.
    #[param(default = None)]
    pub holds: Option<String>,
    /// Gripper command: closed. While both hands hold one object, both grippers are commanded closed.
    #[param(default = false)]
    pub grip: bool,
}

/// One move of both hands. The next move begins at the commanded poses at the end of this one.
#[derive(Params, Clone, Debug)]
pub struct DualMove {
    /// Name of the move, for messages.
    pub name: String,
    /// Duration of the motion. Afterwards the commanded poses stay at the targets until the tips have arrived.
    #[param(unit = "s", range = 1e-3..=1e6)]
    pub duration: f64,
    /// Motion of the left tip. Default: it stays, with its gripper open.
    #[param(default = None)]
    pub left: Option<HandMotion>,
    /// Motion of the right tip. Default: it stays, with its gripper open.
    #[param(default = None)]
    pub right: Option<HandMotion>,
    /// Motion of the object that both hands hold, at the point halfway between the tips. Excludes `left` and `right`.
    #[param(default = None)]
    pub both: Option<HandMotion>,
    /// Frame of positions, axes and forces: `work` is the frame of the work, `base` the frame of the arms' base.
    #[param(default = Written::Work)]
    pub frame: Written,
    /// Minimum squeeze: the force with which both hands press the object.
    #[param(unit = "N", default = 0.0, range = 0.0..)]
    pub squeeze: f64,
    /// Whether the next move waits until the tips have arrived.
    #[param(default = true)]
    pub arrive: bool,
}

/// Motion of a hand or an object, ready to be evaluated.
#[derive(Clone, Debug)]
pub struct Track {
    /// Path.
    pub path: Path,
    /// Stiffness of a compliant motion, N/m and N m/rad; `None`: tracking.
    pub stiffness: Option<[f64; 2]>,
    /// Contact force that ends the move, N.
    pub touch: Option<f64>,
    /// Index of the held load.
    pub load: Option<usize>,
    /// Gripper command: closed.
    pub grip: bool,
}

impl Track {
    /// Returns the path shifted by the observed offset of the work (m, base axes); see [`Path::seen`].
    #[must_use]
    pub fn seen(&self, beside: &Vec3) -> Path {
        self.path.seen(beside)
    }
}

/// The motions of a move.
#[derive(Clone, Debug)]
pub enum Tracks {
    /// Each hand separately: left, right.
    Apart(Box<[Track; 2]>),
    /// The object in both hands, and the rotation of its axes in the base at the moment of grasping (the axes of the move's frame).
    Together(Box<Track>, Quat),
}

impl Tracks {
    /// Prepares the motions of a move; `work` is the pose of the work in the base.
    ///
    /// # Errors
    /// Returns the errors of [`Path::new`], and an error if `both` is combined with `left` or `right` or has no load, if `squeeze` is set without
    /// `both`, or if each hand holds the same load.
    pub fn new(m: &DualMove, work: &Pose, loads: &[Load]) -> Result<Self, BuildError> {
        let fault = |fact: &str, help: &str| {
            Err(BuildError::new(format!("move `{}`: {fact}", m.name)).help(help).at("moves"))
        };
        let track = |way: &Option<HandMotion>| track(m, way.as_ref(), work, loads);
        if m.both.is_some() {
            if m.left.is_some() || m.right.is_some() {
                let help = "write `both`, or `left` and `right`";
                return fault("`both` excludes `left` and `right`", help);
            }
            let both = track(&m.both)?;
            if both.load.is_none() {
                return fault("`both` has no load", "write `holds`, the name of a load");
            }
            let axes = if m.frame == Written::Work { work.rotation } else { Quat::identity() };
            return Ok(Tracks::Together(Box::new(both), axes));
        }
        if m.squeeze > 0.0 {
            return fault("`squeeze` needs a load in both hands", "write `both`");
        }
        let (left, right) = (track(&m.left)?, track(&m.right)?);
        if left.load.is_some() && left.load == right.load {
            return fault(
                "`left` and `right` hold the same load",
                "write `both`, or give the load to one hand only",
            );
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
