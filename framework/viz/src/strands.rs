//! Lines between bodies, and jets, drawn from poses and values.
//!
//! A line is expressed in the axes of the body at which it begins, so that it keeps its precision far from the origin of W. It is visible while both
//! of its ends exist, and bright while its pull variable is positive. An unknown value hides the line.
use crate::batch::time;
use crate::eye::Base;
use crate::scene::{End, Scene};
use crate::shapes::{entity, f3};
use crate::stream::Wrap;
use linkwork_spatial::{Pose, Vec3};
use re_sdk::{EntityPath, RecordingStream};
use re_sdk_types::archetypes::{Arrows3D, CoordinateFrame, LineStrips3D};
use re_sdk_types::components::{Color, LineStrip3D, Radius, TransformFrameId};

/// Opacity of a slack line relative to a taut one.
const SLACK: f32 = 0.3;

/// An end point with resolved references.
#[derive(Clone)]
enum At {
    /// Index of the body's entity, and the point on it. A body that no phase has never exists.
    Body(Option<usize>, Vec3),
    /// Index of the first of its three columns.
    Point(usize),
}

/// The data of an instant.
pub struct Instant<'a> {
    /// The frame in which moving objects are expressed.
    pub base: Base,
    /// Poses of the entities; `None`: the entity does not exist.
    pub poses: &'a [Option<Pose>],
    /// Value of a column; NaN: unknown.
    pub value: &'a dyn Fn(usize) -> f64,
}

impl At {
    fn point(&self, now: &Instant<'_>) -> Option<Vec3> {
        match self {
            At::Body(body, at) => Some(now.poses[(*body)?]?.transform_point(at)),
            At::Point(first) => {
                let p = Vec3::from([0, 1, 2].map(|k| (now.value)(first + k)));
                p.iter().all(|x| x.is_finite()).then_some(p)
            }
        }
    }
}

/// A line over an interval of time.
struct Line {
    entity: EntityPath,
    /// The body in whose axes it is drawn; without one, those of the base.
    base: Option<usize>,
    ends: [At; 2],
    /// Column of the pull variable.
    pull: Option<usize>,
    color: [u8; 4],
    shown: bool,
    t: Vec<i64>,
    strips: Vec<Vec<[f32; 3]>>,
    colors: Vec<Color>,
}

/// A jet over an interval of time.
struct Plume {
    entity: EntityPath,
    body: Option<usize>,
    at: [f32; 3],
    along: Vec3,
    by: usize,
    scale: f64,
    last: f64,
    t: Vec<i64>,
    vectors: Vec<[f32; 3]>,
}

/// Lines and jets with resolved references, before a recording is opened.
#[derive(Clone, Default)]
pub struct Places {
    lines: Vec<([At; 2], Option<usize>)>,
    plumes: Vec<(Option<usize>, usize)>,
}

impl Places {
    /// Resolves the bodies; `column` returns the column of a variable.
    ///
    /// # Errors
    /// A variable does not exist.
    pub fn new<E>(
        scene: &Scene,
        bodies: &[String],
        mut column: impl FnMut(&str) -> Result<usize, E>,
    ) -> Result<Places, E> {
        let place = |name: &str| bodies.iter().position(|b| b == name);
        let mut out = Places::default();
        for line in &scene.lines {
            let mut end = |end: &End| -> Result<At, E> {
                Ok(match end {
                    End::Body { body, at } => At::Body(place(body), *at),
                    End::Point([x, y, z]) => {
                        let first = column(x)?;
                        column(y)?;
                        column(z)?;
                        At::Point(first)
                    }
                })
            };
            let ends = [end(&line.ends[0])?, end(&line.ends[1])?];
            let pull = line.pull.as_deref().map(&mut column).transpose()?;
            out.lines.push((ends, pull));
        }
        for plume in &scene.plumes {
            out.plumes.push((place(&plume.body), column(&plume.by)?));
        }
        Ok(out)
    }
}

/// All lines and jets of a recording.
#[derive(Default)]
pub struct Strands {
    lines: Vec<Line>,
    plumes: Vec<Plume>,
}

fn color([r, g, b, a]: [u8; 4], part: f32) -> Color {
    Color::from_unmultiplied_rgba(r, g, b, (f32::from(a) * part) as u8)
}

impl Strands {
    /// Sends the static data. `entities`: the bodies first. Lines between points in W are expressed in a base.
    pub fn open(
        rec: &RecordingStream,
        scene: &Scene,
        places: Places,
        entities: &[EntityPath],
        base: &Base,
    ) -> Result<Strands, Wrap> {
        let mut out = Strands::default();
        let frame = |of: Option<usize>| {
            let path = of.map_or_else(|| base.path(), |body| entities[body].clone());
            CoordinateFrame::new(TransformFrameId::from_entity_path(&path))
        };
        for (line, (ends, pull)) in scene.lines.iter().zip(places.lines) {
            let base = ends.iter().find_map(|e| match e {
                At::Body(body, _) => *body,
                At::Point(_) => None,
            });
            let entity = entity(&format!("lines/{}", line.path));
            rec.log_static(entity.clone(), &frame(base))?;
            let look = LineStrips3D::update_fields().with_radii([Radius::new_ui_points(1.5)]);
            rec.log_static(entity.clone(), &look)?;
            let (t, strips, colors) = (Vec::new(), Vec::new(), Vec::new());
            let (color, shown) = (line.color, false);
            out.lines.push(Line { entity, base, ends, pull, color, shown, t, strips, colors });
        }
        for (plume, (body, by)) in scene.plumes.iter().zip(places.plumes) {
            let entity = entity(&format!("plumes/{}", plume.path));
            rec.log_static(entity.clone(), &frame(body))?;
            let look = Arrows3D::update_fields()
                .with_colors([color(plume.color, 1.0)])
                .with_origins([f3(&plume.at)])
                .with_radii([Radius::new_scene_units(0.06)]);
            rec.log_static(entity.clone(), &look)?;
            let (at, along, scale) = (f3(&plume.at), plume.along, plume.scale);
            let (t, vectors) = (Vec::new(), Vec::new());
            out.plumes.push(Plume { entity, body, at, along, by, scale, last: 0.0, t, vectors });
        }
        Ok(out)
    }

    /// Adds an instant (ns).
    pub fn push(&mut self, t: i64, now: &Instant<'_>) {
        for line in &mut self.lines {
            let pull = line.pull.map(now.value);
            let ends = line.ends.each_ref().map(|e| e.point(now));
            let base = line.base.map_or(Some(now.base), |b| now.poses[b].map(Base::Eye));
            let there = !pull.is_some_and(f64::is_nan);
            match (ends, base) {
                ([Some(a), Some(b)], Some(base)) if there => {
                    let own = |p: Vec3| f3(&base.point(&p));
                    let part = if pull.is_none_or(|p| p > 0.0) { 1.0 } else { SLACK };
                    line.t.push(t);
                    line.strips.push(vec![own(a), own(b)]);
                    line.colors.push(color(line.color, part));
                    line.shown = true;
                }
                _ if line.shown => {
                    line.t.push(t);
                    line.strips.push(Vec::new());
                    line.colors.push(color(line.color, 0.0));
                    line.shown = false;
                }
                _ => {}
            }
        }
        for plume in &mut self.plumes {
            let there = plume.body.is_some_and(|body| now.poses[body].is_some());
            let value = Some((now.value)(plume.by)).filter(|v| there && v.is_finite());
            let length = value.unwrap_or(0.0).max(0.0) * plume.scale;
            if length != plume.last {
                plume.t.push(t);
                plume.vectors.push(f3(&(plume.along * length)));
                plume.last = length;
            }
        }
    }

    /// Sends the collected data.
    pub fn send(&mut self, rec: &RecordingStream) -> Result<(), Wrap> {
        for line in self.lines.iter_mut().filter(|l| !l.t.is_empty()) {
            let columns = LineStrips3D::update_fields()
                .with_strips(line.strips.drain(..).map(LineStrip3D::from))
                .with_colors(line.colors.drain(..))
                .columns_of_unit_batches()?;
            rec.send_columns(line.entity.clone(), [time(line.t.drain(..))], columns)?;
        }
        for plume in self.plumes.iter_mut().filter(|p| !p.t.is_empty()) {
            let origins = std::iter::repeat_n(plume.at, plume.t.len());
            let columns = Arrows3D::update_fields()
                .with_vectors(plume.vectors.drain(..))
                .with_origins(origins)
                .columns_of_unit_batches()?;
            rec.send_columns(plume.entity.clone(), [time(plume.t.drain(..))], columns)?;
        }
        Ok(())
    }
}
