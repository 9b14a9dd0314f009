//! A consumer of a recorder that draws samples into a file, or in a viewer that listens.
use crate::batch::{Arrows, Curve, Frames, INSTANTS, TIMELINE};
use crate::eye::{Base, EYE};
use crate::ground::{self, Ground};
use crate::layout::{self, plot_path};
use crate::pictures::{self, Eye};
use crate::scene::{InUnit, Planet, Scene, Shape};
use crate::shapes::{self, When, entity, f3, shape_path};
use crate::strands::{self, Places, Strands};
use crate::stream::{self, RrdFile, VizError, Wrap};
use crate::trail::{Trail, color};
use linkwork_dynamics::{Tree, Workspace, kinematics};
use linkwork_multibody::{BodyId, NodeId};
use linkwork_plant::{PlanExt, ProgramExt};
use linkwork_runtime::{Consumer, Group, OVERLAY_PERIOD, Program, Sample, Seconds};
use linkwork_spatial::{Pose, Quat, Vec3};
use linkwork_surroundings::{Surface, Terrain};
use re_sdk::{AsComponents, EntityPath, RecordingStream, TimeCell};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Largest age of an instant before it is sent, to a file and to a live viewer.
const FRESH: [Duration; 2] = [Duration::from_secs(2), Duration::from_millis(40)];

/// Entity of the planet.
const PLANET: &str = "view/planet";

/// Height of the phase name over the followed body (m).
const LABEL: f32 = 5.0;
/// Colours of the curves of a panel. They repeat.
const CURVES: [[u8; 3]; 10] = [
    [0, 114, 178],
    [230, 159, 0],
    [0, 158, 115],
    [213, 94, 0],
    [86, 180, 233],
    [204, 121, 167],
    [240, 228, 66],
    [150, 75, 0],
    [190, 190, 190],
    [120, 94, 240],
];
/// Group of the overlays on the ground, after that of the samples.
const OVERLAYS: u32 = 1;

/// The parts of a plan that are shown, with resolved references, before a recording is opened.
pub struct View {
    pub(crate) scene: Scene,
    /// Names of the phases. They are shown only if there are several.
    names: Vec<String>,
    /// For each phase: its mechanism, and the bodies and nodes of the entities.
    pub(crate) phases: Vec<Option<Phase>>,
    /// Entities: the bodies, then the nodes.
    pub(crate) entities: Vec<EntityPath>,
    /// Names of the bodies, which are the first entities.
    pub(crate) bodies: Vec<String>,
    pub(crate) nodes: Vec<String>,
    /// Bodies with a trail, and whether they are external.
    pub(crate) trails: Vec<(usize, bool)>,
    follow: Option<usize>,
    /// Variables of the columns of a sample.
    pub(crate) columns: Vec<String>,
    /// First of the six columns of each arrow.
    pub(crate) arrows: Vec<usize>,
    /// Lines and jets.
    strands: Places,
    /// Entity, label, column and displayed unit of each curve.
    pub(crate) curves: Vec<(EntityPath, String, usize, InUnit)>,
    terrain: Vec<(EntityPath, Surface)>,
    /// Paths of the cameras, and of the parts with overlays on the ground.
    cameras: Vec<String>,
    overlays: Vec<String>,
}

/// The mechanism of one phase, and the frames of the entities in it; `None`: the phase does not have the body.
pub(crate) struct Phase {
    tree: Arc<Tree>,
    ws: Workspace,
    pub(crate) bodies: Vec<Option<BodyId>>,
    nodes: Vec<Option<NodeId>>,
}

impl View {
    /// Resolves everything that a scene shows. The group is for [`Recorder::start`](linkwork_runtime::Recorder::start).
    ///
    /// # Errors
    /// A variable does not exist.
    pub fn new(
        program: &Program,
        scene: &Scene,
        period: Seconds,
    ) -> Result<(View, Vec<Group>), VizError> {
        Ok(Self::look_up(program, scene, period)?)
    }

    fn look_up(
        program: &Program,
        scene: &Scene,
        period: Seconds,
    ) -> Result<(View, Vec<Group>), Wrap> {
        let plan = &program.phases[0].plan;
        let mut places = Vec::new();
        let mut view = View {
            scene: scene.clone(),
            names: program.phases.iter().map(|p| p.name.clone()).collect(),
            phases: Vec::new(),
            entities: Vec::new(),
            bodies: Vec::new(),
            nodes: Vec::new(),
            trails: Vec::new(),
            follow: None,
            columns: Vec::new(),
            arrows: Vec::new(),
            strands: Places::default(),
            curves: Vec::new(),
            terrain: Vec::new(),
            cameras: Vec::new(),
            overlays: Vec::new(),
        };
        view.look_up_bodies(program);
        for arrow in &scene.arrows {
            view.arrows.push(places.len());
            for name in arrow.origin.iter().chain(&arrow.vector) {
                places.push(plan.variable(name)?.place);
                view.columns.push(name.clone());
            }
        }
        view.strands = Places::new(scene, &view.bodies, |name| {
            places.push(plan.variable(name)?.place);
            view.columns.push(name.to_owned());
            Ok::<usize, Wrap>(places.len() - 1)
        })?;
        for panel in &scene.panels {
            for (label, name, shown) in &panel.series {
                let path = EntityPath::from(plot_path(&panel.title))
                    .join(&EntityPath::from_single_string(label.clone()));
                view.curves.push((path, label.clone(), places.len(), *shown));
                places.push(plan.variable(name)?.place);
                view.columns.push(name.clone());
            }
        }
        for (path, object) in program.phases.iter().flat_map(|p| p.plan.services.iter()) {
            if let Some(t) = object.get::<dyn Terrain>()
                && !view.terrain.iter().any(|(known, _)| *known == entity(path))
            {
                view.terrain.push((entity(path), t.surface()));
            }
        }
        view.cameras = pictures::cameras(program);
        let (coordinates, shown) = (program.coordinates(), view.cameras.clone());
        let mut groups = vec![Group { period, places, coordinates, shown, ..Group::default() }];
        view.overlays = ground::overlays(program);
        if !view.overlays.is_empty() {
            let overlays = view.overlays.clone();
            groups.push(Group { period: OVERLAY_PERIOD, overlays, ..Group::default() });
        }
        Ok((view, groups))
    }

    /// Returns the bodies and nodes of all phases, each once.
    fn look_up_bodies(&mut self, program: &Program) {
        let mechanisms = || program.phases.iter().filter_map(|p| p.plan.mechanism());
        for m in mechanisms() {
            for body in m.multibody.bodies() {
                if !self.bodies.iter().any(|b| b == body.name()) {
                    self.bodies.push(body.name().to_owned());
                }
            }
        }
        let known = |n: &&String| mechanisms().any(|m| m.multibody.node(n).is_some());
        let nodes: Vec<&String> = self.scene.frames.iter().filter(known).collect();
        self.entities = self.bodies.iter().map(|b| entity(b)).collect();
        self.entities.extend(nodes.iter().map(|n| entity(&format!("{n}/axes"))));
        self.phases = (program.phases.iter())
            .map(|p| {
                let m = p.plan.mechanism()?;
                Some(Phase {
                    tree: m.tree.clone(),
                    ws: Workspace::new(&m.tree),
                    bodies: self.bodies.iter().map(|b| m.multibody.body(b)).collect(),
                    nodes: nodes.iter().map(|n| m.multibody.node(n)).collect(),
                })
            })
            .collect();
        self.nodes = nodes.into_iter().cloned().collect();
        let place = |name: &String| self.bodies.iter().position(|b| b == name);
        let trail = |b: &String| Some((place(b)?, false));
        self.trails = self.scene.trails.iter().filter_map(trail).collect();
        self.follow = self.scene.follow.as_ref().and_then(place);
    }

    /// Returns the index of each node's body among the entities, and X_BN, for nodes that are fixed to the same rigid body in all phases.
    pub(crate) fn nodes_on_bodies(&self) -> Vec<Option<(usize, Pose)>> {
        let of_phase = |phase: &Phase, k: usize| {
            let multibody = phase.tree.multibody();
            let node = multibody.get_node(phase.nodes[k]?);
            let body = multibody.get(node.body());
            let place = self.bodies.iter().position(|b| b == body.name());
            Some(place.filter(|_| body.modes().is_none()).map(|place| (place, node.pose())))
        };
        let of_node = |k: usize| {
            let mut all = self.phases.iter().flatten().filter_map(|p| of_phase(p, k));
            let first = all.next()?;
            first.filter(|first| all.all(|other| other == Some(*first)))
        };
        (0..self.nodes.len()).map(of_node).collect()
    }

    /// Opens an `.rrd` file and writes the blueprint and the static objects.
    ///
    /// # Errors
    /// The file cannot be written, or a mesh file cannot be read.
    pub fn file(self, path: &Path) -> Result<Viewer, VizError> {
        let (rec, file) = RrdFile::open(path, &self.scene.title)?;
        let mut viewer = Viewer::open(self, rec, FRESH[0])?;
        viewer.file = Some(file);
        viewer.send()?;
        Ok(viewer)
    }

    /// Returns a consumer that connects to a viewer in its own thread at its first sample (default address: `rerun+http://127.0.0.1:9876/proxy`), so
    /// a viewer that does not answer does not delay anything else.
    ///
    /// # Errors
    /// The address is not valid.
    pub fn live(self, url: Option<&str>) -> Result<impl Consumer + 'static, VizError> {
        let uri = stream::address(url)?;
        let open = move || {
            let rec = stream::live(uri, &self.scene.title)?;
            Viewer::open(self, rec, FRESH[1])
        };
        Ok(Live { open: Some(open), viewer: None })
    }
}

/// A viewer that is opened in the thread of its recorder.
struct Live<F> {
    open: Option<F>,
    viewer: Option<Viewer>,
}

impl<F: FnOnce() -> Result<Viewer, Wrap> + Send> Consumer for Live<F> {
    fn row(&mut self, row: &Sample) -> Result<(), String> {
        if let Some(open) = self.open.take() {
            self.viewer = Some(open().map_err(|e| format!("rerun: {}", e.0))?);
        }
        self.viewer.as_mut().map_or(Ok(()), |v| v.row(row))
    }
    fn finish(&mut self) -> Result<(), String> {
        self.viewer.as_mut().map_or(Ok(()), Viewer::finish)
    }
}

/// Draws samples.
pub struct Viewer {
    rec: RecordingStream,
    file: Option<RrdFile>,
    phases: Vec<Option<Phase>>,
    /// Phase of the last sample. Its name is shown if there are several phases.
    phase: Option<u32>,
    names: Vec<String>,
    /// Shapes that do not exist in all phases.
    passing: Vec<Shape>,
    /// Phase changes that are not sent yet: time (ns), from, to.
    entered: Vec<(i64, Option<u32>, u32)>,
    /// Poses of the entities in the last sample that contained them.
    poses: Vec<Pose>,
    frames: Frames,
    /// The frame in which moving objects are expressed.
    base: Base,
    trails: Vec<Trail>,
    /// First of the six columns, and scale.
    arrows: Vec<(Arrows, usize, f64)>,
    strands: Strands,
    /// Column and displayed unit.
    curves: Vec<(Curve, usize, InUnit)>,
    ground: Ground,
    /// Index of the followed body among the entities.
    follow: Option<usize>,
    cameras: Vec<Eye>,
    planet: Option<Planet>,
    /// Nodes whose axes are drawn.
    pub(crate) node_names: Vec<String>,
    /// Data that are sent rarely, with their times (ns). They are sent after the poses of the same interval.
    seldom: Vec<(i64, EntityPath, Box<dyn AsComponents + Send>)>,
    /// Number of instants that are not sent yet, and the time of the last ones.
    waiting: usize,
    sent: Instant,
    fresh: Duration,
}

impl Viewer {
    /// Sends the blueprint and the static objects.
    fn open(view: View, rec: RecordingStream, fresh: Duration) -> Result<Viewer, Wrap> {
        let scene = &view.scene;
        // Do not log the wall clock, because the recording is over simulated time.
        rec.set_log_time_enabled(false);
        rec.set_log_tick_enabled(false);
        rec.log_static("/", &re_sdk_types::archetypes::ViewCoordinates::RIGHT_HAND_Z_UP())?;
        // The view is relative to a frame that moves with the followed body, so the camera keeps its offset at any time at which the recording is
        // opened.
        let base = view.follow.map_or(Base::World, |_| Base::Eye(Pose::identity()));
        // A simulation without a machine and a world has only curves.
        let machine = !view.entities.is_empty() || !scene.shapes.is_empty();
        let world = !view.terrain.is_empty() || scene.planet.is_some() || !scene.markers.is_empty();
        let space = (machine || world).then(|| base.path());
        layout::send(&rec, scene, space.as_ref(), &view.cameras)?;
        let (passing, lasting): (Vec<Shape>, Vec<Shape>) =
            scene.shapes.iter().cloned().partition(|s| !s.phases.is_empty());
        for shape in &lasting {
            shapes::send(&rec, shape, When::Always)?;
        }
        for path in &view.entities[view.bodies.len()..] {
            rec.log_static(path.clone(), &re_sdk_types::archetypes::TransformAxes3D::new(0.3))?;
        }
        let trail =
            |(body, told): &(usize, bool)| Trail::new(*body, &view.bodies[*body], *told, &base);
        let trails: Vec<Trail> = view.trails.iter().map(trail).collect();
        let framed = trails.iter().filter(|t| t.frame().is_some()).map(|t| t.path.clone());
        let frames = Frames::new(view.entities.iter().cloned().chain(framed), &base);
        let mut arrows = Vec::new();
        for (arrow, first) in scene.arrows.iter().zip(&view.arrows) {
            let drawn = Arrows::open(&rec, entity(&arrow.path), arrow.color, &base)?;
            arrows.push((drawn, *first, arrow.scale));
        }
        let strands = Strands::open(&rec, scene, view.strands, &view.entities, &base)?;
        let mut curves = Vec::new();
        let mut of_panel = 0;
        let mut panel = None;
        for (path, label, column, shown) in view.curves {
            of_panel = if panel == path.parent() { of_panel + 1 } else { 0 };
            panel = path.parent();
            let [r, g, b] = CURVES[of_panel % CURVES.len()];
            let style = re_sdk_types::archetypes::SeriesLines::new()
                .with_names([label.as_str()])
                .with_colors([re_sdk_types::components::Color::from_rgb(r, g, b)]);
            rec.log_static(path.clone(), &style)?;
            curves.push((Curve::new(path), column, shown));
        }
        let (sink, clear) = ground::room(view.terrain.iter().map(|(_, surface)| surface));
        let ground = Ground::new(view.terrain, scene.ground, view.overlays);
        // Send this after the first poses, because a view whose frame is not known yet places its camera
        // elsewhere.
        let seldom = ground.coarse().into_iter().map(|(path, mesh)| (0, path, mesh)).collect();
        if !scene.markers.is_empty() {
            let points =
                re_sdk_types::archetypes::Points3D::new(scene.markers.iter().map(|m| f3(&m.at)))
                    .with_labels(scene.markers.iter().map(|m| m.label.as_str()))
                    .with_colors([re_sdk_types::components::Color::from_rgb(40, 200, 255)])
                    .with_radii([0.12]);
            rec.log_static("markers", &points)?;
        }
        if let Some(planet) = &scene.planet {
            rec.log_static(PLANET, &planet.mesh(sink, clear))?;
        }
        Ok(Viewer {
            rec,
            file: None,
            poses: vec![Pose::identity(); view.entities.len()],
            phases: view.phases,
            phase: None,
            names: view.names,
            passing,
            entered: Vec::new(),
            frames,
            base,
            trails,
            arrows,
            strands,
            curves,
            ground,
            follow: view.follow,
            cameras: view.cameras.into_iter().map(Eye::new).collect(),
            planet: view.scene.planet,
            node_names: view.nodes,
            seldom,
            waiting: 0,
            sent: now(),
            fresh,
        })
    }

    fn gather(&mut self, row: &Sample) -> Result<(), Wrap> {
        let t = row.ns.cast_signed();
        if row.group == OVERLAYS {
            self.ground.show(&row.overlays);
            self.ground_changes(t);
            return Ok(());
        }
        if self.enter(t, row.phase) && self.names.len() > 1 {
            self.name_phase(t, row.phase);
        }
        if let Some(Some(phase)) = self.phases.get_mut(row.phase as usize) {
            let Phase { tree, ws, bodies, nodes } = phase;
            let (nq, nv) = (tree.nq(), tree.nv());
            let (q, v) = row.values[row.values.len() - nq - nv..].split_at(nq);
            kinematics(tree, ws, q, v);
            let now = bodies.iter().map(|b| b.map(|b| ws.body_pose(tree, b)));
            let now = now.chain(nodes.iter().map(|n| n.map(|n| ws.node_pose(tree, n))));
            let now: Vec<Option<Pose>> = now.collect();
            self.poses(t, &now);
            self.strands(t, &now, &|column| row.values[column]);
        }
        for k in 0..self.arrows.len() {
            let first = self.arrows[k].1;
            self.arrow(k, t, &row.values[first..first + 6]);
        }
        for k in 0..self.curves.len() {
            let column = self.curves[k].1;
            self.curve(k, t, row.values[column]);
        }
        for (camera, shown) in self.cameras.iter_mut().zip(&row.shown) {
            let new = shown.iter().flat_map(|shown| camera.look(shown, &self.base));
            self.seldom.extend(new.map(|(path, what)| (t, path, what)));
        }
        self.passed()
    }

    /// Sets the phase of an instant (ns). Returns whether it has changed; then the shapes of the new phase replace the others.
    pub(crate) fn enter(&mut self, t: i64, phase: u32) -> bool {
        let before = self.phase.replace(phase);
        if before != Some(phase) && !self.passing.is_empty() {
            self.entered.push((t, before, phase));
        }
        before != Some(phase)
    }

    /// Replaces the shapes of the previous phase by those of another.
    fn change(&self, t: i64, before: Option<u32>, phase: u32) -> Result<(), Wrap> {
        // Shapes are removed one nanosecond earlier: if the removal and a new pose of an entity have the same time, the viewer keeps the removal and
        // draws the shape at the origin of its body.
        self.rec.set_time(TIMELINE, TimeCell::from_duration_nanos(t - 1));
        let there = |s: &Shape, k: u32| s.phases.get(k as usize).is_none_or(|there| *there);
        let was = |s: &Shape| before.is_some_and(|k| there(s, k));
        for shape in self.passing.iter().filter(|s| was(s) && !there(s, phase)) {
            self.rec.log(shape_path(shape), &re_sdk_types::archetypes::Clear::flat())?;
        }
        self.rec.set_time(TIMELINE, TimeCell::from_duration_nanos(t));
        for shape in self.passing.iter().filter(|s| there(s, phase) && !was(s)) {
            shapes::send(&self.rec, shape, When::FromNow)?;
        }
        Ok(())
    }

    /// Shows the name of the phase over the followed body.
    fn name_phase(&mut self, t: i64, phase: u32) {
        if self.follow.is_none() {
            return;
        }
        let name = self.names[phase as usize].replace('_', " ");
        let label = re_sdk_types::archetypes::Points3D::new([[0.0, 0.0, LABEL]])
            .with_labels([name])
            .with_show_labels(true)
            .with_colors([color(phase)])
            .with_radii([re_sdk_types::components::Radius::new_ui_points(2.0)]);
        self.seldom.push((t, entity(&format!("{EYE}/phase")), Box::new(label)));
    }

    /// Adds poses of the entities at an instant (ns). An entity that does not exist keeps its last pose.
    pub(crate) fn poses(&mut self, t: i64, now: &[Option<Pose>]) {
        for (pose, now) in self.poses.iter_mut().zip(now) {
            *pose = now.unwrap_or(*pose);
        }
        if let Some(body) = self.follow {
            let p = self.poses[body].position;
            let level = self.planet.map_or_else(Quat::identity, |planet| planet.level(&p));
            self.base = Base::Eye(Pose::new(level, p));
        }
        for trail in &mut self.trails {
            if trail.add(&self.poses[trail.body].position, self.phase.unwrap_or(0)) {
                for (path, strips) in trail.changes() {
                    self.seldom.push((t, path, Box::new(strips)));
                }
            }
        }
        let trails = self.trails.iter().filter_map(Trail::frame);
        self.frames.push(t, &self.base, self.poses.iter().copied().chain(trails));
        if let Some(body) = self.follow {
            let p = self.poses[body].position;
            let near = self.ground.approach(p.x, p.y);
            self.seldom.extend(near.into_iter().map(|(path, mesh)| (t, path, mesh)));
        }
    }

    /// Adds lines and jets at an instant (ns); an unknown value is NaN.
    pub(crate) fn strands(&mut self, t: i64, poses: &[Option<Pose>], value: &dyn Fn(usize) -> f64) {
        self.strands.push(t, &strands::Instant { base: self.base, poses, value });
    }

    /// Adds an arrow at an instant (ns), from its six numbers. In a phase in which they do not exist, its length is zero.
    pub(crate) fn arrow(&mut self, k: usize, t: i64, v: &[f64]) {
        let (arrow, _, scale) = &mut self.arrows[k];
        if v.iter().any(|v| v.is_nan()) {
            return arrow.shorten(t);
        }
        let (origin, vector) = (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]) * *scale);
        arrow.push(t, &self.base, &origin, &vector);
    }

    /// Adds a value of a curve at an instant (ns), in SI.
    pub(crate) fn curve(&mut self, k: usize, t: i64, value: f64) {
        let (curve, _, shown) = &mut self.curves[k];
        curve.push(t, shown.of(value));
    }

    /// Adds the image of a camera at an instant (ns): a PNG file.
    pub(crate) fn picture(&mut self, t: i64, camera: &str, png: Vec<u8>) {
        let image = re_sdk_types::archetypes::EncodedImage::from_file_contents(png);
        self.seldom.push((t, pictures::image(camera), Box::new(image)));
    }

    /// Returns the ground, for overlays (tiles and planned paths). They are drawn when the instant is complete.
    pub(crate) fn ground(&mut self) -> &mut Ground {
        &mut self.ground
    }

    /// Adds the changes of the overlays on the ground up to an instant (ns).
    pub(crate) fn ground_changes(&mut self, t: i64) {
        let changes = self.ground.changes();
        self.seldom.extend(changes.into_iter().map(|(path, what)| (t, path, what)));
    }

    /// Ends an instant; it is sent together with others.
    pub(crate) fn passed(&mut self) -> Result<(), Wrap> {
        self.waiting += 1;
        if self.waiting >= INSTANTS || self.sent.elapsed() >= self.fresh {
            self.send()?;
        }
        Ok(())
    }

    /// Sends the collected data, poses first.
    fn send(&mut self) -> Result<(), Wrap> {
        self.frames.send(&self.rec)?;
        for (arrow, ..) in &mut self.arrows {
            arrow.send(&self.rec)?;
        }
        self.strands.send(&self.rec)?;
        for (curve, ..) in &mut self.curves {
            curve.send(&self.rec)?;
        }
        for (t, before, phase) in std::mem::take(&mut self.entered) {
            self.change(t, before, phase)?;
        }
        for (t, path, what) in self.seldom.drain(..) {
            self.rec.set_time(TIMELINE, TimeCell::from_duration_nanos(t));
            self.rec.log(path, &*what)?;
        }
        (self.waiting, self.sent) = (0, now());
        match &self.file {
            Some(file) => {
                self.rec.flush_blocking()?;
                file.flush()
            }
            None => Ok(self.rec.flush_async()?),
        }
    }

    pub(crate) fn end(&mut self) -> Result<(), Wrap> {
        let sent = self.send();
        match &self.file {
            Some(file) => sent.and(file.finish()),
            None => sent.and_then(|()| Ok(self.rec.flush_blocking()?)),
        }
    }
}

/// The wall clock determines when samples are sent, never their content.
#[allow(clippy::disallowed_methods)]
fn now() -> Instant {
    Instant::now()
}

impl Consumer for Viewer {
    fn row(&mut self, row: &Sample) -> Result<(), String> {
        self.gather(row).map_err(|e| format!("rerun: {}", e.0))
    }
    fn flush(&mut self) -> Result<(), String> {
        self.send().map_err(|e| format!("rerun: {}", e.0))
    }
    fn finish(&mut self) -> Result<(), String> {
        self.end().map_err(|e| format!("rerun: {}", e.0))
    }
}
