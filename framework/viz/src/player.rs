//! Draws a log without a run: poses of bodies and values of variables at their own times.
//!
//! [`Viewer`] does the drawing. A log contains the poses of bodies but not the coordinates of the mechanism, so the axes of a node are computed from
//! the pose of its body, if the body is rigid.
use crate::stream::VizError;
use crate::viewer::{View, Viewer};
use linkwork_runtime::OverlayTile;
use linkwork_spatial::Pose;
use std::collections::BTreeMap;
use std::path::Path;

/// A number, and the time (ns) of its sample.
type LastValue = Option<(u64, f64)>;

/// A value remains valid for this duration (ns) after its last sample, for lines and jets, because a log does not contain the start of a phase
/// without their part.
const HELD: u64 = 1_000_000_000;

/// Draws samples into a recording, in the order of time.
pub struct Player {
    viewer: Viewer,
    /// Index of each body among the entities.
    bodies: BTreeMap<String, usize>,
    /// For each node the index of its body among the entities, and X_BN.
    nodes: Vec<Option<(usize, Pose)>>,
    /// Poses of the entities at the present instant.
    poses: Vec<Option<Pose>>,
    /// Columns of a variable; an arrow and a curve can use the same variable.
    columns: BTreeMap<String, Vec<usize>>,
    values: Vec<LastValue>,
    /// First column of each arrow.
    arrows: Vec<usize>,
    /// Column of each curve, and the time of its last sample (ns).
    curves: Vec<(usize, Option<u64>)>,
    /// The instant of `poses` while its lines and jets are not drawn yet.
    posed: Option<u64>,
    /// The present instant. Arrows, lines and jets are drawn when it is complete, because its poses and values arrive in any order.
    now: Option<u64>,
}

/// The objects of a scene that were not drawn.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NotShown {
    /// Variables of arrows and curves without a sample.
    pub variables: Vec<String>,
    /// Nodes on flexible bodies, or on different bodies in different phases. Their axes stay at the origin.
    pub nodes: Vec<String>,
}

impl Player {
    /// Opens an `.rrd` file and writes the blueprint and the static objects.
    ///
    /// # Errors
    /// The file cannot be written, or a mesh file cannot be read.
    pub fn open(view: View, path: &Path) -> Result<Player, VizError> {
        let bodies = view.bodies.iter().cloned().zip(0..).collect();
        let nodes = view.nodes_on_bodies();
        let mut columns: BTreeMap<String, Vec<usize>> = BTreeMap::new();
        for (k, name) in view.columns.iter().enumerate() {
            columns.entry(name.clone()).or_default().push(k);
        }
        let (values, poses) =
            (vec![None; view.columns.len()], vec![None; view.bodies.len() + nodes.len()]);
        let arrows = view.arrows.clone();
        let curves = view.curves.iter().map(|(_, _, column, _)| (*column, None)).collect();
        let viewer = view.file(path)?;
        let now = None;
        let posed = None;
        Ok(Player { viewer, bodies, nodes, poses, columns, values, arrows, curves, posed, now })
    }

    /// Adds poses X_WB of bodies by name at a time (ns). Other bodies keep their poses. Bodies that are not in the scene are ignored.
    ///
    /// # Errors
    /// The recording cannot be written.
    pub fn poses(&mut self, ns: u64, bodies: &[(String, Pose)]) -> Result<(), VizError> {
        self.at(ns)?;
        self.poses.fill(None);
        for (name, pose) in bodies {
            if let Some(k) = self.bodies.get(name) {
                self.poses[*k] = Some(*pose);
            }
        }
        let (bodies, nodes) = self.poses.split_at_mut(self.bodies.len());
        for (now, node) in nodes.iter_mut().zip(&self.nodes) {
            *now = node.and_then(|(body, pose)| Some(bodies[body]? * pose));
        }
        // A log does not contain its phase; the shapes of the first phase are shown.
        self.viewer.enter(ns.cast_signed(), 0);
        self.viewer.poses(ns.cast_signed(), &self.poses);
        self.posed = Some(ns);
        Ok(())
    }

    /// Returns whether the scene shows this variable.
    pub fn shows(&self, variable: &str) -> bool {
        self.columns.contains_key(variable)
    }

    /// Adds the value of a variable (SI) at a time (ns). A curve shows every value; an arrow is drawn when all of its six numbers have the same time.
    ///
    /// # Errors
    /// The recording cannot be written.
    pub fn value(&mut self, ns: u64, variable: &str, value: f64) -> Result<(), VizError> {
        let Some(columns) = self.columns.get(variable).cloned() else { return Ok(()) };
        self.at(ns)?;
        for column in &columns {
            self.values[*column] = Some((ns, value));
        }
        let t = ns.cast_signed();
        for (k, (column, drawn)) in self.curves.iter_mut().enumerate() {
            if columns.contains(column) && drawn.replace(ns) != Some(ns) {
                self.viewer.curve(k, t, value);
            }
        }
        Ok(())
    }

    /// Adds the image of a camera at a time (ns): a PNG file.
    ///
    /// # Errors
    /// The recording cannot be written.
    pub fn picture(&mut self, ns: u64, camera: &str, png: Vec<u8>) -> Result<(), VizError> {
        self.at(ns)?;
        self.viewer.picture(ns.cast_signed(), camera, png);
        Ok(())
    }

    /// Adds the overlay of a part on a tile of the ground from a time (ns) on.
    ///
    /// # Errors
    /// The recording cannot be written.
    pub fn tile(&mut self, ns: u64, part: &str, tile: OverlayTile) -> Result<(), VizError> {
        self.at(ns)?;
        self.viewer.ground().lay(part, tile);
        Ok(())
    }

    /// Adds the path that a part plans from a time (ns) on: x and y of its corners (m, W).
    ///
    /// # Errors
    /// The recording cannot be written.
    pub fn way(&mut self, ns: u64, part: &str, corners: &[[f64; 2]]) -> Result<(), VizError> {
        self.at(ns)?;
        self.viewer.ground().way(part, corners);
        Ok(())
    }

    /// Begins another instant.
    fn at(&mut self, ns: u64) -> Result<(), VizError> {
        if let Some(before) = self.now.replace(ns).filter(|before| *before != ns) {
            self.whole(before);
            self.viewer.passed()?;
        }
        Ok(())
    }

    /// Draws an instant (ns), which is complete.
    fn whole(&mut self, ns: u64) {
        for (k, first) in self.arrows.iter().enumerate() {
            let six = self.values[*first..*first + 6].iter().flatten();
            let told: Vec<f64> = six.filter(|told| told.0 == ns).map(|told| told.1).collect();
            if told.len() == 6 {
                self.viewer.arrow(k, ns.cast_signed(), &told);
            }
        }
        self.strands();
        self.viewer.ground_changes(ns.cast_signed());
    }

    /// Draws the lines and jets of the last instant with poses, with values of this instant or shortly before.
    fn strands(&mut self) {
        let Some(ns) = self.posed.take() else { return };
        let values = &self.values;
        let value = |column: usize| match values[column] {
            Some((told, value)) if ns.saturating_sub(told) <= HELD => value,
            _ => f64::NAN,
        };
        self.viewer.strands(ns.cast_signed(), &self.poses, &value);
    }

    /// Completes the recording.
    ///
    /// # Errors
    /// The recording cannot be written.
    pub fn finish(mut self) -> Result<NotShown, VizError> {
        if let Some(now) = self.now {
            self.whole(now);
        }
        self.viewer.end()?;
        let untold = |columns: &Vec<usize>| columns.iter().all(|c| self.values[*c].is_none());
        let variables = self.columns.iter().filter(|(_, c)| untold(c)).map(|(n, _)| n.clone());
        let names = self.viewer.node_names.iter().zip(&self.nodes);
        let nodes = names.filter(|(_, node)| node.is_none()).map(|(name, _)| name.clone());
        Ok(NotShown { variables: variables.collect(), nodes: nodes.collect() })
    }
}
