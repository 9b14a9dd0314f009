//! Lines between bodies, and jets: what spans the gap between what is drawn as bodies, from their poses and from values.
//!
//! A line stands in the axes of the body at which it begins, so that far from the origin of W it keeps its digits. It is
//! there where both of its ends are, and bright where what pulls it is above zero; a value that is not known is that of no
//! line.
use crate::batch::time;
use crate::eye::Base;
use crate::scene::{End, Scene};
use crate::shapes::{entity, f3};
use crate::stream::Wrap;
use linkwork_spatial::{Pose, Vec3};
use re_sdk::{EntityPath, RecordingStream};
use re_sdk_types::archetypes::{Arrows3D, CoordinateFrame, LineStrips3D};
use re_sdk_types::components::{Color, LineStrip3D, Radius, TransformFrameId};

/// Opacity of a slack line, of that of a taut one.
const SLACK: f32 = 0.3;

/// An end, looked up.
#[derive(Clone)]
enum At {
    /// Entity of the body, and the point on it; a body that nobody has is never there.
    Body(Option<usize>, Vec3),
    /// First of the three columns.
    Point(usize),
}

/// What a viewer knows of an instant.
pub struct Instant<'a> {
    /// In which what moves is told.
    pub base: Base,
    /// Poses of the entities; `None`: not there.
    pub poses: &'a [Option<Pose>],
    /// Value of a column; NaN: not known.
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

/// A line over a stretch of time.
struct Line {
    entity: EntityPath,
    /// Whose axes it is drawn in; those of what moves without one.
    base: Option<usize>,
    ends: [At; 2],
    /// Column of what pulls.
    pull: Option<usize>,
    color: [u8; 4],
    shown: bool,
    t: Vec<i64>,
    strips: Vec<Vec<[f32; 3]>>,
    colors: Vec<Color>,
}

/// A jet over a stretch of time.
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

/// Looked up, and not yet in a recording.
#[derive(Clone, Default)]
pub struct Places {
    lines: Vec<([At; 2], Option<usize>)>,
    plumes: Vec<(Option<usize>, usize)>,
}

impl Places {
    /// Finds the bodies; `column` gives a variable a column.
    ///
    /// # Errors
    /// A variable is unknown.
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
    /// Sends what does not change. `entities`: the bodies first; lines of no body are told in a base.
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

    /// Sends what has been gathered.
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
