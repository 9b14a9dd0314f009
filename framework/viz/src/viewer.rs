//! The stream to Rerun: a tap's consumer that writes a file or feeds a live viewer.
use crate::layout::{self, plot_path};
use crate::scene::{Form, Scene, Shape};
use crate::terrain::Tiles;
use linkwork_dynamics::{Tree, Workspace, kinematics};
use linkwork_multibody::{BodyId, NodeId};
use linkwork_runtime::{Consumer, Group, Place, Plan, Seconds, ServiceObject, TapRow};
use linkwork_spatial::{Pose, Vec3};
use rerun::{EntityPath, RecordingStream, RecordingStreamBuilder};
use std::path::PathBuf;
use std::sync::Arc;

/// Where the stream goes.
#[derive(Clone, Debug)]
pub enum Sink {
    /// An `.rrd` file.
    File(PathBuf),
    /// A viewer that listens (`rerun+http://127.0.0.1:9876/proxy` unless given).
    Live(Option<String>),
    /// Both.
    Both(PathBuf, Option<String>),
}

/// The stream cannot be opened or written.
#[derive(Debug, thiserror::Error)]
#[error("rerun: {0}")]
pub struct VizError(String);

impl<E: std::error::Error> From<E> for Wrap {
    fn from(e: E) -> Wrap {
        Wrap(e.to_string())
    }
}
/// Any error of the SDK, as text.
struct Wrap(String);
impl From<Wrap> for VizError {
    fn from(w: Wrap) -> VizError {
        VizError(w.0)
    }
}

struct Trail {
    body: BodyId,
    path: EntityPath,
    points: Vec<[f32; 3]>,
    spacing: f64,
}

/// Draws rows.
pub struct Viewer {
    rec: RecordingStream,
    tree: Option<Arc<Tree>>,
    ws: Option<Workspace>,
    bodies: Vec<(BodyId, EntityPath)>,
    frames: Vec<(NodeId, EntityPath)>,
    trails: Vec<Trail>,
    /// Entity, first column of the six, scale, colour.
    arrows: Vec<(EntityPath, usize, f64, [u8; 4])>,
    /// Entity, column, factor.
    curves: Vec<(EntityPath, usize, f64)>,
    terrain: Vec<(EntityPath, Tiles)>,
    follow: Option<BodyId>,
}

/// `Rover.Hardware.Wheels.Wheel1/wheel` → `/Rover/Hardware/Wheels/Wheel1/wheel`.
fn entity(path: &str) -> EntityPath {
    let parts: Vec<&str> = path.split(['.', '/']).filter(|p| !p.is_empty()).collect();
    EntityPath::from(parts.into_iter().map(rerun::EntityPathPart::from).collect::<Vec<_>>())
}

impl Viewer {
    /// Opens the stream, sends the blueprint and what does not move. The group is for
    /// [`Tap::start`](linkwork_runtime::Tap::start).
    ///
    /// # Errors
    /// The stream cannot be opened, a mesh file cannot be read, or a variable is unknown.
    pub fn open(
        sink: &Sink,
        plan: &Plan,
        scene: &Scene,
        period: Seconds,
    ) -> Result<(Viewer, Vec<Group>), VizError> {
        Ok(Self::start(sink, plan, scene, period)?)
    }

    fn start(
        sink: &Sink,
        plan: &Plan,
        scene: &Scene,
        period: Seconds,
    ) -> Result<(Viewer, Vec<Group>), Wrap> {
        let rec = stream(sink, &scene.title)?;
        rec.disable_timeline("log_time");
        rec.disable_timeline("log_tick");
        rec.log_static("/", &rerun::ViewCoordinates::RIGHT_HAND_Z_UP())?;
        let mut places = Vec::new();
        let mut viewer = Viewer {
            rec,
            tree: None,
            ws: None,
            bodies: Vec::new(),
            frames: Vec::new(),
            trails: Vec::new(),
            arrows: Vec::new(),
            curves: Vec::new(),
            terrain: Vec::new(),
            follow: None,
        };
        if let Some(m) = plan.mechanism() {
            let mb = &m.multibody;
            places.extend((0..mb.nq() + mb.nv()).map(|k| Place::X((m.x + k) as u32)));
            viewer.tree = Some(m.tree.clone());
            viewer.ws = Some(Workspace::new(&m.tree));
            viewer.bodies =
                mb.body_ids().zip(mb.bodies()).map(|(i, b)| (i, entity(b.name()))).collect();
            let node = |n: &String| Some((mb.node(n)?, entity(&format!("{n}/axes"))));
            viewer.frames = scene.frames.iter().filter_map(node).collect();
            let trail = |b: &String| {
                Some(Trail {
                    body: mb.body(b)?,
                    path: entity(&format!("trails/{b}")),
                    points: Vec::new(),
                    spacing: 0.05,
                })
            };
            viewer.trails = scene.trails.iter().filter_map(trail).collect();
            viewer.follow = scene.follow.as_ref().and_then(|b| mb.body(b));
        }
        let mut target = Vec3::zeros();
        if let (Some(m), Some(ws), Some(body)) = (plan.mechanism(), &mut viewer.ws, viewer.follow) {
            kinematics(&m.tree, ws, &m.q, &m.v);
            target = ws.body_pose(&m.tree, body).position;
        }
        // The viewer tracks what has an extent: a shape, not a bare transform.
        let tracked = scene.follow.as_ref().map(|b| {
            let shape = scene.shapes.iter().find(|s| s.body == *b);
            shape.map_or_else(|| entity(b), shape_path)
        });
        layout::send(&viewer.rec, scene, tracked, target)?;
        for shape in &scene.shapes {
            viewer.shape(shape)?;
        }
        for (_, path) in &viewer.frames {
            viewer.rec.log_static(path.clone(), &rerun::TransformAxes3D::new(0.3))?;
        }
        for arrow in &scene.arrows {
            let first = places.len();
            for name in arrow.origin.iter().chain(&arrow.vector) {
                places.push(plan.variable(name)?.place);
            }
            viewer.arrows.push((entity(&arrow.path), first, arrow.scale, arrow.color));
        }
        for panel in &scene.panels {
            for (label, name, factor) in &panel.series {
                let mut path = EntityPath::from(plot_path(&panel.title));
                path = path.join(&EntityPath::from_single_string(label.clone()));
                let style = rerun::SeriesLines::new().with_names([label.as_str()]);
                viewer.rec.log_static(path.clone(), &style)?;
                viewer.curves.push((path, places.len(), *factor));
                places.push(plan.variable(name)?.place);
            }
        }
        for (path, object) in plan.services.iter() {
            if let ServiceObject::Terrain(t) = object
                && let Some(tiles) = Tiles::new(t.surface())
            {
                let path = entity(path);
                viewer.rec.set_duration_secs("sim_time", 0.0);
                for (k, mesh) in tiles.coarse() {
                    viewer.rec.log(path.join(&format!("tile{k}").into()), &mesh)?;
                }
                viewer.terrain.push((path, tiles));
            }
        }
        if !scene.markers.is_empty() {
            let at = scene.markers.iter().map(|m| f3(&m.at));
            let points = rerun::Points3D::new(at)
                .with_labels(scene.markers.iter().map(|m| m.label.as_str()))
                .with_colors([rerun::Color::from_rgb(40, 200, 255)])
                .with_radii([0.12]);
            viewer.rec.log_static("markers", &points)?;
        }
        Ok((viewer, vec![Group { period, places }]))
    }

    fn shape(&self, shape: &Shape) -> Result<(), Wrap> {
        let path = shape_path(shape);
        let fill = rerun::FillMode::Solid;
        let [r, g, b, a] = shape.color;
        let color = rerun::Color::from_unmultiplied_rgba(r, g, b, a);
        match &shape.form {
            Form::Box(size) => {
                let boxes = rerun::Boxes3D::from_half_sizes([f3(&(size * 0.5))])
                    .with_fill_mode(fill)
                    .with_colors([color]);
                self.rec.log_static(path.clone(), &boxes)?;
            }
            Form::Sphere(radius) => {
                let ball = rerun::Ellipsoids3D::from_half_sizes([[*radius as f32; 3]])
                    .with_fill_mode(fill)
                    .with_colors([color]);
                self.rec.log_static(path.clone(), &ball)?;
            }
            Form::Cylinder { radius, length } => {
                let body =
                    rerun::Cylinders3D::from_lengths_and_radii([*length as f32], [*radius as f32])
                        .with_fill_mode(fill)
                        .with_colors([color]);
                self.rec.log_static(path.clone(), &body)?;
            }
            Form::Capsule { radius, length } => {
                let body =
                    rerun::Capsules3D::from_lengths_and_radii([*length as f32], [*radius as f32])
                        .with_translations([[0.0, 0.0, -0.5 * *length as f32]])
                        .with_fill_mode(fill)
                        .with_colors([color]);
                self.rec.log_static(path.clone(), &body)?;
            }
            Form::Mesh { file, scale } => {
                let mut input = std::io::BufReader::new(
                    std::fs::File::open(file)
                        .map_err(|e| Wrap(format!("{}: {e}", file.display())))?,
                );
                let stl = stl_io::read_stl(&mut input)
                    .map_err(|e| Wrap(format!("{}: {e}", file.display())))?;
                let points = stl.vertices.iter().map(|v| [0, 1, 2].map(|k| v[k] * *scale as f32));
                let faces = stl.faces.iter().map(|f| f.vertices.map(|i| i as u32));
                let mesh =
                    rerun::Mesh3D::new(points).with_triangle_indices(faces).with_albedo_factor(
                        rerun::datatypes::Rgba32::from_unmultiplied_rgba(r, g, b, a),
                    );
                self.rec.log_static(path.clone(), &mesh)?;
            }
        }
        self.rec.log_static(path, &transform(&shape.pose))?;
        Ok(())
    }

    fn draw(&mut self, row: &TapRow) -> Result<(), Wrap> {
        self.rec.set_duration_secs("sim_time", row.t);
        if let (Some(tree), Some(ws)) = (&self.tree, &mut self.ws) {
            let (nq, nv) = (tree.nq(), tree.nv());
            kinematics(tree, ws, &row.values[..nq], &row.values[nq..nq + nv]);
            for (id, path) in &self.bodies {
                self.rec.log(path.clone(), &transform(&ws.body_pose(tree, *id)))?;
            }
            for (id, path) in &self.frames {
                self.rec
                    .log(path.clone(), &transform_absolute(ws, tree, *id, path, &self.bodies))?;
            }
            for trail in &mut self.trails {
                let p = ws.body_pose(tree, trail.body).position;
                if trail.add(&p) {
                    let strip = rerun::LineStrips3D::new([trail.points.clone()])
                        .with_colors([rerun::Color::from_rgb(255, 230, 60)])
                        .with_radii([0.015]);
                    self.rec.log(trail.path.clone(), &strip)?;
                }
            }
            if let Some(body) = self.follow {
                let p = ws.body_pose(tree, body).position;
                for (path, tiles) in &mut self.terrain {
                    for (k, mesh) in tiles.approach(p.x, p.y, 4.0) {
                        self.rec.log(path.join(&format!("tile{k}").into()), &mesh)?;
                    }
                }
            }
        }
        for (path, first, scale, [r, g, b, a]) in &self.arrows {
            let v = &row.values[*first..first + 6];
            let origin = [v[0] as f32, v[1] as f32, v[2] as f32];
            let vector = [3, 4, 5].map(|k| (v[k] * scale) as f32);
            let arrow = rerun::Arrows3D::from_vectors([vector])
                .with_origins([origin])
                .with_colors([rerun::Color::from_unmultiplied_rgba(*r, *g, *b, *a)])
                .with_radii([0.02]);
            self.rec.log(path.clone(), &arrow)?;
        }
        for (path, column, factor) in &self.curves {
            self.rec.log(path.clone(), &rerun::Scalars::single(row.values[*column] * factor))?;
        }
        Ok(())
    }
}

impl Trail {
    /// Adds a point that is far enough from the last; thins out when there are very many.
    fn add(&mut self, p: &Vec3) -> bool {
        if let Some(last) = self.points.last() {
            let d = Vec3::new(
                p.x - f64::from(last[0]),
                p.y - f64::from(last[1]),
                p.z - f64::from(last[2]),
            );
            if d.norm() < self.spacing {
                return false;
            }
        }
        if self.points.len() >= 1000 {
            let thin: Vec<_> = self.points.iter().step_by(2).copied().collect();
            self.points = thin;
            self.spacing *= 2.0;
        }
        self.points.push(f3(p));
        true
    }
}

impl Consumer for Viewer {
    fn row(&mut self, row: &TapRow) -> Result<(), String> {
        self.draw(row).map_err(|e| format!("rerun: {}", e.0))
    }
    fn finish(&mut self) -> Result<(), String> {
        self.rec.flush_blocking().map_err(|e| format!("rerun: {e}"))
    }
}

fn stream(sink: &Sink, title: &str) -> Result<RecordingStream, Wrap> {
    let name = format!("linkwork {title}");
    let builder =
        RecordingStreamBuilder::new(rerun::external::re_log_types::ApplicationId::try_from(name)?);
    let live = "rerun+http://127.0.0.1:9876/proxy".to_string();
    Ok(match sink {
        Sink::File(path) => builder.save(path)?,
        Sink::Live(url) => builder.connect_grpc_opts(url.clone().unwrap_or(live))?,
        Sink::Both(path, url) => {
            let file = rerun::sink::FileSink::new(path)?;
            let url: rerun::external::re_uri::ProxyUri = url.clone().unwrap_or(live).parse()?;
            builder.set_sinks((file, rerun::sink::GrpcSink::new(url)))?
        }
    })
}

fn shape_path(shape: &Shape) -> EntityPath {
    entity(&shape.body).join(&entity(&format!("shapes/{}", shape.name)))
}

fn f3(v: &Vec3) -> [f32; 3] {
    [v.x as f32, v.y as f32, v.z as f32]
}

fn transform(pose: &Pose) -> rerun::Transform3D {
    let q = pose.rotation;
    let q = rerun::Quaternion::from_xyzw([q.i as f32, q.j as f32, q.k as f32, q.w as f32]);
    rerun::Transform3D::from_translation_rotation(f3(&pose.position), q)
}

/// A node's pose relative to the body entity that it is shown under (or to W).
fn transform_absolute(
    ws: &Workspace,
    tree: &Tree,
    node: NodeId,
    path: &EntityPath,
    bodies: &[(BodyId, EntityPath)],
) -> rerun::Transform3D {
    let pose = ws.node_pose(tree, node);
    match bodies.iter().find(|(_, b)| path.starts_with(b)) {
        Some((id, _)) => transform(&(ws.body_pose(tree, *id).inverse() * pose)),
        None => transform(&pose),
    }
}
