//! `navigation.autonav`: drives a rover to its goals over traversable ground that its camera observes.
//! ```text
//! a new picture    its points → map → goodness → costs of the planner            (`rover`)
//! a sample         path from here, votes of the arcs → speed and turn rate, from the next sample on
//! ```
//! It replaces `control.waypoint_follower`: it has the same pose inputs and the same commands. It reads the field of `pictures` that it binds, or the
//! nearest one: a camera with true ranges, or a stereo pair. Points of a picture are placed with the true pose of the camera, or with its estimated
//! pose (`eye`, from `navigation.pose_estimator`).

use crate::arcs::{Arcs, Body};
use crate::assess::{Assessor, Limits};
use crate::ground::Disc;
use crate::hazard_map::HazardMap;
use crate::map::Grid;
use crate::rover::{Knowledge, Memory, Pose, Rover, Status};
use linkwork_render::Picture;
use linkwork_render::spatial::{Pose as Pose3, Vec3};
use linkwork_runtime::SharedField;
use linkwork_runtime::prelude::*;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// Goals, size of the rover, and limits of traversable ground.
#[derive(Params, Clone, Debug)]
pub struct AutoNavParams {
    /// Goals, W, m; visited in turn.
    #[param(unit = "m")]
    pub goals: Vec<[f64; 2]>,
    /// Distance at which a goal is reached.
    #[param(unit = "m", default = 0.5, range = 1e-3..)]
    pub tolerance: f64,
    /// Driving speed.
    #[param(unit = "m/s", range = 1e-4..)]
    pub speed: f64,
    /// Turn rate on the spot.
    #[param(unit = "rad/s", default = 0.12, range = 1e-4..)]
    pub spot_rate: f64,
    /// Maximum curvature of an arc, 1/m.
    #[param(default = 0.4, range = 1e-3..=100.0)]
    pub curvature: f64,
    /// Length of the rectangle around the rover, wheels included, centred on the input pose.
    #[param(unit = "m", range = 0.05..=10.0)]
    pub length: f64,
    /// Width of that rectangle.
    #[param(unit = "m", range = 0.05..=10.0)]
    pub width: f64,
    /// Step height from which the ground is a hazard. It must be less than what the wheels climb and the body clears. Default: 0.6 `wheel`.
    #[param(unit = "m", range = 1e-3..)]
    pub step: Option<f64>,
    /// Wheel diameter: steps are measured over this length.
    #[param(unit = "m", range = 0.01..)]
    pub wheel: f64,
    /// Tilt from which the ground is a hazard.
    #[param(unit = "rad", default = 0.436, range = 0.01..=1.5)]
    pub slope: f64,
    /// Roughness (RMS distance from a plane) from which the ground is a hazard. Default: 0.5 `wheel`.
    #[param(unit = "m", range = 1e-3..)]
    pub roughness: Option<f64>,
    /// Edge of a cell of the map.
    #[param(unit = "m", default = 0.1, range = 0.03..=1.0)]
    pub cell: f64,
    /// Maximum range of points that are used.
    #[param(unit = "m", default = 9.0, range = 0.1..)]
    pub sight: f64,
    /// A map cell that was not observed for longer than this is reset at its next observation. Default: never.
    #[param(unit = "s", default = None, range = 0.0..)]
    pub memory: Option<f64>,
    /// Start position, W, m. The ground around it is assumed free, because the camera does not see it. Default: no such ground.
    #[param(default = None)]
    pub start: Option<[f64; 3]>,
    /// Radius of that ground.
    #[param(unit = "m", default = 3.0, range = 0.0.., needs = "start")]
    pub start_radius: f64,
    /// Keep-out discs [x, y, radius] (m, W).
    #[param(unit = "m", default = Vec::new())]
    pub keep_out: Vec<[f64; 3]>,
    /// Keep-in rectangle of the rover's centre: minimum x and y, maximum x and y (m, W). Default: no limit.
    #[param(default = None)]
    pub keep_in: Option<[f64; 4]>,
    /// Tilt at which the rover stops.
    #[param(unit = "rad", default = 0.6, range = 0.0..)]
    pub tilt_max: f64,
    /// Slip at which the rover stops (above 1: never).
    #[param(default = 2.0, range = 0.0..)]
    pub slip_max: f64,
    /// Maximum waiting time without a path or an open move before the rover gives up.
    #[param(unit = "s", default = 20.0, range = 0.0..)]
    pub patience: f64,
    /// Maximum time without progress towards the goal along the path before the rover gives up.
    #[param(unit = "s", default = 400.0, range = 0.0..)]
    pub progress: f64,
}

/// Pose of the rover.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AutoNavIn {
    /// x in W.
    #[port("m")]
    pub x: f64,
    /// y in W.
    #[port("m")]
    pub y: f64,
    /// Heading from x towards y.
    #[port("rad")]
    pub heading: f64,
    /// Angle of the deck to the horizontal.
    #[port("rad", default = 0.0)]
    pub tilt: f64,
    /// Slip, 0 to 1.
    #[port("1", default = 0.0)]
    pub slip: f64,
    /// Estimated position of the camera, W.
    #[port("m", default = Vec3::zeros())]
    pub eye: Vec3,
    /// Estimated attitude of the camera: lens (x right, y down, z ahead) to W.
    #[port(default = Quat::identity())]
    pub eye_attitude: Quat,
    /// Whether pictures are placed with the estimated camera pose, interpolated to their instant. Otherwise the true camera pose is used.
    #[port("1", default = false)]
    pub eye_given: bool,
    /// Whether the estimated camera pose is valid. Pictures before that are ignored.
    #[port("1", default = true)]
    pub eye_known: bool,
}

/// Drive command and progress.
#[derive(Ports, Clone, Copy, Debug)]
pub struct AutoNavOut {
    /// Commanded forward speed.
    #[port("m/s")]
    pub speed: f64,
    /// Commanded turn rate, to the left.
    #[port("rad/s")]
    pub turn_rate: f64,
    /// Index of the current goal; the number of goals when all are reached.
    #[port("1")]
    pub goal: f64,
    /// Straight-line distance to the current goal.
    #[port("m")]
    pub distance: f64,
    /// All goals are reached.
    #[port("1")]
    pub done: bool,
    /// The rover has given up or was stopped by a limit.
    #[port("1")]
    pub stopped: bool,
    /// The drive is over: all goals are reached, or the rover has given up.
    #[port("1")]
    pub ended: bool,
    /// Status, the index in `Status::ALL`: 1 driving, 2 arrived, then the reasons for giving up (10: the rover started in an obstacle).
    #[port("1")]
    pub status: f64,
    /// Number of pictures that were processed.
    #[port("1")]
    pub pictures: f64,
    /// Area of the mapped ground.
    #[port("m^2")]
    pub mapped: f64,
}

/// State of the navigation.
#[derive(Clone, Default, Serialize, Deserialize)]
pub struct Mind {
    picture: View<Picture>,
    knowledge: Knowledge,
    memory: Memory,
    /// Index of the current goal.
    goal: usize,
    /// Number of the last processed picture, and count of processed pictures.
    last: u64,
    taken: u64,
    /// Time (s) and estimated pose of the camera at the last two samples.
    eyes: [Option<(f64, Pose3)>; 2],
    /// Area of the mapped ground, m². It is recomputed only when the map has grown.
    mapped: f64,
    /// Speed and turn rate.
    command: [f64; 2],
    /// Distance to the goal, m.
    distance: f64,
}

impl Mind {
    /// Records the estimated pose of the camera at a time (s).
    fn place_eye(&mut self, time: f64, eye: Pose3) {
        self.eyes = [self.eyes[1], Some((time, eye))];
    }

    /// Returns the interpolated camera pose at a time (s) between the last two samples. New pictures always lie in that interval.
    fn eye(&self, time: f64) -> Option<Pose3> {
        let at = |(t, eye): &(f64, Pose3)| (*t == time).then_some(*eye);
        let [Some((t0, from)), Some((t1, to))] = &self.eyes else {
            return self.eyes[1].as_ref().and_then(at);
        };
        if !(*t0..=*t1).contains(&time) {
            return None;
        }
        let share = (time - t0) / (t1 - t0);
        let turn = (from.rotation.inverse() * to.rotation).scaled_axis();
        Some(Pose3::new(
            from.rotation * Quat::from_scaled_axis(turn * share),
            from.position + (to.position - from.position) * share,
        ))
    }
}

impl Store for Mind {
    const READS: Option<&'static str> = <View<Picture> as Store>::READS;
    fn see(&mut self, shown: Option<&SharedField>) {
        self.picture.see(shown);
    }
}

/// Navigation software: one rover configuration for each goal.
pub struct AutoNav {
    /// Edge of a cell of the map, m.
    cell: f64,
    judge: Assessor,
    rovers: Vec<Rover>,
}

/// Navigates a rover: maps and assesses the ground that its camera observes, plans paths to its goals by Field D*, and selects arcs by votes.
#[model("navigation.autonav")]
impl Model for AutoNav {
    type Params = AutoNavParams;
    type FeedthroughInputs = AutoNavIn;
    type Outputs = AutoNavOut;
    type Store = Mind;

    fn without_effect(&self, wired: IsWired<'_>) -> Judged {
        let stops = "the rover never stops at this limit";
        let estimate = |input: &str| {
            (wired(input) && !wired("eye_given")).then(|| {
                BuildError::new(
                    "`eye_given` has no wire, so pictures are placed with the true camera pose",
                )
                .help("wire `eye_given` of the estimator, too")
            })
        };
        vec![
            (Judge::Param("tilt_max"), unwired(wired, "tilt", stops)),
            (Judge::Param("slip_max"), unwired(wired, "slip", stops)),
            (Judge::Input("eye"), estimate("eye")),
            (Judge::Input("eye_attitude"), estimate("eye_attitude")),
            (Judge::Input("eye_known"), estimate("eye_known")),
        ]
    }
    fn build(p: AutoNavParams) -> Result<Self, BuildError> {
        if p.goals.is_empty() {
            return Err(BuildError::new("`goals` is empty")
                .at("goals")
                .help("write for example [[40, 0]], in metres"));
        }
        if !p.goals.iter().flatten().all(|v| v.is_finite()) {
            return Err(BuildError::new("a goal is not finite").at("goals").help("in metres"));
        }
        if let Some(disc) =
            p.keep_out.iter().find(|d| !(d[2] >= 0.0 && d.iter().all(|v| v.is_finite())))
        {
            let fact = format!("{disc:?} is not a disc");
            return Err(BuildError::new(fact)
                .at("keep_out")
                .help("write [x, y, radius] in metres, with a radius of 0 or more"));
        }
        let anywhere = [f64::NEG_INFINITY, f64::NEG_INFINITY, f64::INFINITY, f64::INFINITY];
        let keep_in = p.keep_in.unwrap_or(anywhere);
        if !(keep_in[0] < keep_in[2] && keep_in[1] < keep_in[3]) {
            let fact = format!("{keep_in:?} is not a rectangle");
            return Err(BuildError::new(fact)
                .at("keep_in")
                .help("write [minimum x, minimum y, maximum x, maximum y] in metres"));
        }
        // The number of discs on the long axis that cover the rectangle is the length-to-width ratio, rounded up,
        // plus one.
        let discs = 1 + (p.length / p.width).ceil().clamp(1.0, 16.0) as usize;
        let body = Body { length: p.length, width: p.width, discs };
        let arcs = Arcs {
            count: 23,
            curvature_max: p.curvature,
            length: 4.0 / 2.8 * p.length,
            step: 2.0 * p.cell,
            near: 1.0 / 2.8 * p.length,
            leave: 0.3,
            share: 0.4,
            scale: 4.0,
            turn_cost: 1.0,
            stop_cost: 1.0,
            back_cost: 3.0,
            hysteresis: 0.03,
            body,
        };
        let limits = Limits {
            radius: body.radius() + 1.5 * p.cell,
            step_width: p.wheel,
            tilt: p.slope,
            roughness: p.roughness.unwrap_or(0.5 * p.wheel),
            step: p.step.unwrap_or(0.6 * p.wheel),
            seen: 0.4,
        };
        let judge = Assessor::new(p.cell, limits).map_err(|e| BuildError::of(&e).at("cell"))?;
        let start = p.start.map(|[x, y, _]| [x, y, p.start_radius]);
        let free: Vec<Disc> = start.into_iter().collect();
        let rover = |goal: &[f64; 2]| Rover {
            goal: *goal,
            tolerance: p.tolerance,
            speed: p.speed,
            spot_rate: p.spot_rate,
            tilt_max: p.tilt_max,
            slip_max: p.slip_max,
            patience: p.patience,
            progress: p.progress,
            weight: 2.0,
            unknown: 0.7,
            coarse: 3,
            margin: 15.0,
            keep_in,
            look_ahead: 3.0,
            body_margin: p.cell,
            sight: p.sight,
            keep_out: p.keep_out.clone(),
            free: free.clone(),
            grid: Grid { cell: p.cell, memory: p.memory.unwrap_or(f64::INFINITY) },
            arcs,
        };
        Ok(AutoNav { cell: p.cell, rovers: p.goals.iter().map(rover).collect(), judge })
    }

    fn outputs(&self, store: &Mind) -> AutoNavOut {
        let done = store.goal == self.rovers.len();
        let status = store.memory.status;
        let stopped = !done && !status.goes_on();
        let place = Status::ALL.iter().position(|s| *s == status).unwrap_or(0);
        AutoNavOut {
            speed: store.command[0],
            turn_rate: store.command[1],
            goal: store.goal as f64,
            distance: store.distance,
            done,
            stopped,
            ended: done || stopped,
            status: place as f64,
            pictures: store.taken as f64,
            mapped: store.mapped,
        }
    }

    fn overlay(&self, mind: &Mind) -> Option<SharedOverlay> {
        let rover = self.rovers.get(mind.goal).or(self.rovers.last())?;
        Some(Arc::new(HazardMap::of(rover, &self.judge, &mind.knowledge, &mind.memory)))
    }

    fn update(&self, clock: &Clock, u: &AutoNavIn, store: &mut Mind) {
        let place = [u.x, u.y, u.heading];
        let Some(rover) = self.rovers.get(store.goal) else { return };
        if u.eye_given && u.eye_known {
            store.place_eye(clock.t, Pose3::new(u.eye_attitude, u.eye));
        }
        if let Some(picture) =
            store.picture.get().filter(|p| p.number != store.last && p.number > 0)
        {
            let at = if u.eye_given { store.eye(picture.time) } else { Some(picture.pose) };
            let points: Vec<Vec3> = at.into_iter().flat_map(|at| picture.points_from(at)).collect();
            (store.last, store.taken) = (picture.number, store.taken + 1);
            rover.see(&self.judge, &mut store.knowledge, &points, place, picture.time);
            store.mapped = store.knowledge.seen() as f64 * self.cell * self.cell;
        }
        let pose = Pose { place, tilt: u.tilt, slip: u.slip };
        let Mind { knowledge, memory, .. } = store;
        let sees = store.taken > 0;
        store.command = rover.decide(&self.judge, knowledge, memory, &pose, clock.t, sees);
        store.distance = (u.x - rover.goal[0]).hypot(u.y - rover.goal[1]);
        if store.memory.status == Status::Arrived {
            store.goal += 1;
            if store.goal < self.rovers.len() {
                // The next goal needs a new planner; the map is kept.
                store.knowledge.planner = None;
                store.memory = Memory { status: Status::Driving, ..Memory::default() };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_placed_where_the_camera_was_at_its_instant() {
        let mut mind = Mind::default();
        let at = |x: f64, turn: f64| {
            Pose3::new(Quat::from_scaled_axis(Vec3::z() * turn), Vec3::new(x, 2.0 * x, 1.0))
        };
        assert_eq!(mind.eye(1.0), None);
        mind.place_eye(1.0, at(0.0, 0.0));
        assert_eq!((mind.eye(1.0), mind.eye(0.9)), (Some(at(0.0, 0.0)), None));
        mind.place_eye(1.2, at(0.1, 0.04));
        mind.place_eye(1.4, at(0.3, -0.02));
        // The pose is unknown before and after the last two samples.
        assert_eq!((mind.eye(1.1), mind.eye(1.41)), (None, None));
        let eye = mind.eye(1.25).unwrap();
        let want = at(0.15, 0.025);
        assert!((eye.position - want.position).norm() < 1e-12);
        assert!(eye.rotation.angle_to(&want.rotation) < 1e-9);
    }
}
