//! A recorder's consumer that draws rows: into a file, or in a viewer that listens.
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
use linkwork_runtime::{
    Consumer, Group, OVERLAY_PERIOD, Program, Sample, Seconds, ServiceObject, Surface,
};
use linkwork_spatial::{Pose, Quat, Vec3};
use re_sdk::{AsComponents, EntityPath, RecordingStream, TimeCell};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// How old an instant may be before it is sent, in a file and live.
const FRESH: [Duration; 2] = [Duration::from_secs(2), Duration::from_millis(40)];

/// The planet of a site.
const PLANET: &str = "view/planet";

/// Height of the name of the phase over the followed body (m).
const LABEL: f32 = 5.0;
/// Colours of the curves of a panel, in turn.
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
/// The group of what parts show on the ground, after that of the rows.
const OVERLAYS: u32 = 1;

/// What of a plan is shown: everything is looked up, nothing is opened.
pub struct View {
    pub(crate) scene: Scene,
    /// Names of the phases; one is no name.
    names: Vec<String>,
    /// For each phase: its mechanism, and which of its bodies and nodes the entities are.
    pub(crate) phases: Vec<Option<Phase>>,
    /// First the bodies, then the nodes.
    pub(crate) entities: Vec<EntityPath>,
    /// Among the entities.
    pub(crate) bodies: Vec<String>,
    pub(crate) nodes: Vec<String>,
    /// Bodies that leave a trail, and whether somebody else tells it.
    pub(crate) trails: Vec<(usize, bool)>,
    follow: Option<usize>,
    /// Variables of the columns of a row.
    pub(crate) columns: Vec<String>,
    /// First column of the six of each arrow.
    pub(crate) arrows: Vec<usize>,
    /// Lines and jets.
    strands: Places,
    /// Entity, label, column, how it is shown.
    pub(crate) curves: Vec<(EntityPath, String, usize, InUnit)>,
    terrain: Vec<(EntityPath, Surface)>,
    /// Paths of the cameras, and of the parts that show something on the ground.
    cameras: Vec<String>,
    overlays: Vec<String>,
}

/// The mechanism of one phase, and the frames of the entities in it; `None`: it has no such body.
pub(crate) struct Phase {
    tree: Arc<Tree>,
    ws: Workspace,
    pub(crate) bodies: Vec<Option<BodyId>>,
    nodes: Vec<Option<NodeId>>,
}

impl View {
    /// Looks up what a scene shows. The group is for [`Recorder::start`](linkwork_runtime::Recorder::start).
    ///
    /// # Errors
    /// A variable is unknown.
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
            if let ServiceObject::Terrain(t) = object
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

    /// The bodies and nodes of all phases, each once.
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

    /// The body of each node, among the entities, and X_BN: of nodes that are fixed to one rigid body in all phases.
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

    /// Opens an `.rrd` file and writes the blueprint and what does not move.
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

    /// A consumer that connects to a viewer in its own thread, at its first row
    /// (`rerun+http://127.0.0.1:9876/proxy` unless an address is given): a viewer that does not
    /// answer holds up nobody else.
    ///
    /// # Errors
    /// The address is none.
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

/// Draws rows.
pub struct Viewer {
    rec: RecordingStream,
    file: Option<RrdFile>,
    phases: Vec<Option<Phase>>,
    /// The phase of the last row; its name is shown when there are several.
    phase: Option<u32>,
    names: Vec<String>,
    /// Shapes that are not there in all phases.
    passing: Vec<Shape>,
    /// Changes of phase that are not sent yet: time (ns), from, to.
    entered: Vec<(i64, Option<u32>, u32)>,
    /// Poses of the entities, as of the last row that had them.
    poses: Vec<Pose>,
    frames: Frames,
    /// In which what moves is told.
    base: Base,
    trails: Vec<Trail>,
    /// First column of the six, scale.
    arrows: Vec<(Arrows, usize, f64)>,
    strands: Strands,
    /// Column, how it is shown.
    curves: Vec<(Curve, usize, InUnit)>,
    ground: Ground,
    /// Among the entities.
    follow: Option<usize>,
    cameras: Vec<Eye>,
    planet: Option<Planet>,
    /// Nodes whose axes are drawn.
    pub(crate) node_names: Vec<String>,
    /// What is seldom sent, and its times (ns): it comes after the poses of its stretch of time.
    seldom: Vec<(i64, EntityPath, Box<dyn AsComponents + Send>)>,
    /// Instants that are not sent yet, and when the last were.
    waiting: usize,
    sent: Instant,
    fresh: Duration,
}

impl Viewer {
    /// Sends the blueprint and what does not move.
    fn open(view: View, rec: RecordingStream, fresh: Duration) -> Result<Viewer, Wrap> {
        let scene = &view.scene;
        // No stamps of the wall clock: a recording is of simulated time.
        rec.set_log_time_enabled(false);
        rec.set_log_tick_enabled(false);
        rec.log_static("/", &re_sdk_types::archetypes::ViewCoordinates::RIGHT_HAND_Z_UP())?;
        // The view is from a frame that goes with the followed body: the eye is where it was put, at whatever time
        // the recording is opened.
        let base = view.follow.map_or(Base::World, |_| Base::Eye(Pose::identity()));
        // A simulation without a machine and a world has nothing but curves to look at.
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
        // After the first poses: a view that does not yet know its frame puts its eye elsewhere.
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

    /// The phase of an instant (ns): when it is another, its shapes come and the others go. Whether it is another.
    pub(crate) fn enter(&mut self, t: i64, phase: u32) -> bool {
        let before = self.phase.replace(phase);
        if before != Some(phase) && !self.passing.is_empty() {
            self.entered.push((t, before, phase));
        }
        before != Some(phase)
    }

    /// Shapes of a phase instead of those of the one before.
    fn change(&self, t: i64, before: Option<u32>, phase: u32) -> Result<(), Wrap> {
        // What goes leaves a nanosecond before: where a clearing and a new pose of one entity have the same time, the viewer keeps the
        // clearing and draws the shape at the origin of its body.
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

    /// The name of the phase, over the followed body.
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

    /// Poses of the entities at an instant (ns); one that is not there stays where it was seen last.
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

    /// Lines and jets at an instant (ns); a value that is not known is NaN.
    pub(crate) fn strands(&mut self, t: i64, poses: &[Option<Pose>], value: &dyn Fn(usize) -> f64) {
        self.strands.push(t, &strands::Instant { base: self.base, poses, value });
    }

    /// An arrow at an instant (ns), from its six numbers. In a phase without it there is nothing to point at: it has no length.
    pub(crate) fn arrow(&mut self, k: usize, t: i64, v: &[f64]) {
        let (arrow, _, scale) = &mut self.arrows[k];
        if v.iter().any(|v| v.is_nan()) {
            return arrow.shorten(t);
        }
        let (origin, vector) = (Vec3::new(v[0], v[1], v[2]), Vec3::new(v[3], v[4], v[5]) * *scale);
        arrow.push(t, &self.base, &origin, &vector);
    }

    /// A value of a curve at an instant (ns), in SI.
    pub(crate) fn curve(&mut self, k: usize, t: i64, value: f64) {
        let (curve, _, shown) = &mut self.curves[k];
        curve.push(t, shown.of(value));
    }

    /// What a camera saw at an instant (ns): a PNG file.
    pub(crate) fn picture(&mut self, t: i64, camera: &str, png: Vec<u8>) {
        let image = re_sdk_types::archetypes::EncodedImage::from_file_contents(png);
        self.seldom.push((t, pictures::image(camera), Box::new(image)));
    }

    /// What a part shows on the ground: tiles, and the way that it plans. They are drawn when the instant is whole.
    pub(crate) fn ground(&mut self) -> &mut Ground {
        &mut self.ground
    }

    /// What parts showed on the ground up to an instant (ns).
    pub(crate) fn ground_changes(&mut self, t: i64) {
        let changes = self.ground.changes();
        self.seldom.extend(changes.into_iter().map(|(path, what)| (t, path, what)));
    }

    /// An instant is whole: it is sent with others.
    pub(crate) fn passed(&mut self) -> Result<(), Wrap> {
        self.waiting += 1;
        if self.waiting >= INSTANTS || self.sent.elapsed() >= self.fresh {
            self.send()?;
        }
        Ok(())
    }

    /// Sends what has been gathered, poses first.
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

/// The wall clock: when rows are sent, never what they say.
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
