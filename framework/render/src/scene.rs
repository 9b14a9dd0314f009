//! Scene: ground, objects at poses, and light.
//! ```text
//! objects    bounding boxes in W, in a tree that is split at the median along the axis in which their centres spread most
//! a ray      ground first, then the tree with the remaining length, then unbounded objects
//! ```
//! At equal distance, the ground takes precedence over objects, and objects in the order in which they were added.

use crate::beam::Beam;
use crate::error::RenderError;
use crate::height_map::{HeightMap, Line, Region};
use crate::light::{Light, Look};
use linkwork_collision::{Shape, Target};
use linkwork_spatial::{Pose, Vec3};
use std::sync::Arc;

/// Maximum length of a ray, m.
pub const FAR: f64 = 1e7;

/// A geometry that several objects may share.
pub type Form = Arc<Target>;

/// Handle of an object of a scene. In masks 0 is nothing, 1 the ground, and the k-th object is k + 2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct ObjectId(usize);

impl ObjectId {
    /// Returns its number in a mask.
    #[must_use]
    pub fn in_mask(self) -> u16 {
        (self.0 + 2) as u16
    }
}

/// Number of the ground in a mask.
pub const GROUND: u16 = 1;

/// Most objects of a scene.
const OBJECTS_MAX: usize = u16::MAX as usize - 2;

struct Object {
    name: String,
    form: Form,
    look: Look,
    X_WO: Pose,
    /// Pose of the world in the object's frame.
    X_OW: Pose,
    lo: Vec3,
    hi: Vec3,
}

/// Result of a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Distance from the ray's origin, m.
    pub distance: f64,
    /// Unit normal against the ray, W. On the ground it is smoothed over the cells.
    pub normal: Vec3,
    /// [`GROUND`], or [`ObjectId::in_mask`].
    pub object: u16,
    /// True if the ray begins inside a solid; the distance is then 0.
    pub inside: bool,
}

/// A node of the tree over objects: a leaf refers to objects, other nodes to two nodes.
struct Branch {
    lo: Vec3,
    hi: Vec3,
    kind: Fork,
}

enum Fork {
    Leaf(Vec<u32>),
    Two(usize, usize),
}

/// Maximum number of objects in a leaf.
const LEAF: usize = 2;

/// Ground, objects and light. W is the common frame, with z up, such as that of a site.
#[derive(Default)]
pub struct Scene {
    ground: Option<(Arc<HeightMap>, Look)>,
    objects: Vec<Object>,
    tree: Vec<Branch>,
    /// Unbounded objects.
    endless: Vec<u32>,
    stale: bool,
    light: Light,
}

/// The geometry that the rays of a beam may hit, computed once for neighbouring pixels.
#[derive(Default)]
pub(crate) struct Candidates {
    regions: Vec<Region>,
    /// Work space.
    left: Vec<Region>,
    objects: Vec<u32>,
}

impl Scene {
    /// Creates a scene that contains only light.
    #[must_use]
    pub fn new(light: Light) -> Self {
        Self { light, ..Self::default() }
    }

    /// Returns the light.
    #[must_use]
    pub fn light(&self) -> &Light {
        &self.light
    }

    /// Sets the light, for example when the Sun has moved.
    pub fn set_light(&mut self, light: Light) {
        self.light = light;
    }

    /// Sets the ground and replaces an earlier one. Its texture is a function of x and y.
    ///
    /// # Errors
    /// An invalid albedo or texture.
    pub fn set_ground(&mut self, map: Arc<HeightMap>, look: Look) -> Result<(), RenderError> {
        look.check()?;
        self.ground = Some((map, look));
        Ok(())
    }

    /// Adds an object with its shape and the pose of the shape's frame in W.
    ///
    /// # Errors
    /// An invalid shape, pose or albedo; more objects than a mask can number.
    pub fn add(
        &mut self,
        name: &str,
        shape: &Shape,
        look: Look,
        X_WO: Pose,
    ) -> Result<ObjectId, RenderError> {
        let form = Target::new(shape).map_err(|faults| RenderError::Shape {
            object: name.into(),
            fault: faults.into_iter().next().unwrap_or(linkwork_collision::ShapeFault::Empty),
        })?;
        self.add_form(name, Arc::new(form), look, X_WO)
    }

    /// Adds an object whose geometry is shared with other objects.
    ///
    /// # Errors
    /// Like [`Scene::add`].
    pub fn add_form(
        &mut self,
        name: &str,
        form: Form,
        look: Look,
        X_WO: Pose,
    ) -> Result<ObjectId, RenderError> {
        if self.objects.len() == OBJECTS_MAX {
            return Err(RenderError::Objects { object: name.into(), max: OBJECTS_MAX });
        }
        look.check()?;
        let id = ObjectId(self.objects.len());
        let (lo, hi) = form.bounds();
        self.objects.push(Object {
            name: name.into(),
            form,
            look,
            X_WO: Pose::identity(),
            X_OW: Pose::identity(),
            lo,
            hi,
        });
        match self.set_pose(id, X_WO) {
            Ok(()) => Ok(id),
            Err(e) => {
                self.objects.pop();
                Err(e)
            }
        }
    }

    /// Moves an object of this scene. Call [`Scene::settle`] before casting rays.
    ///
    /// # Errors
    /// An invalid pose.
    pub fn set_pose(&mut self, id: ObjectId, X_WO: Pose) -> Result<(), RenderError> {
        let object = &mut self.objects[id.0];
        check_pose(&object.name, &X_WO)?;
        (object.X_WO, object.X_OW) = (X_WO, X_WO.inverse());
        let (lo, hi) = object.form.bounds();
        if lo.iter().chain(hi.iter()).all(|v| v.is_finite()) {
            let middle = X_WO.transform_point(&(0.5 * (lo + hi)));
            let half = X_WO.rotation.to_rotation_matrix().matrix().abs() * (0.5 * (hi - lo));
            let half = half.add_scalar(1e-9 * (1.0 + middle.amax()));
            (object.lo, object.hi) = (middle - half, middle + half);
        }
        self.stale = true;
        Ok(())
    }

    /// Moves all objects, in the order in which they were added.
    ///
    /// # Errors
    /// An invalid pose.
    pub fn move_all(&mut self, poses: impl Iterator<Item = Pose>) -> Result<(), RenderError> {
        poses.enumerate().take(self.objects.len()).try_for_each(|(k, X_WO)| {
            if self.objects[k].X_WO == X_WO { Ok(()) } else { self.set_pose(ObjectId(k), X_WO) }
        })
    }

    /// Returns the name of an object by its number in a mask.
    #[must_use]
    pub fn name(&self, object: u16) -> Option<&str> {
        match object {
            GROUND => Some("ground"),
            k => self.objects.get((k as usize).checked_sub(2)?).map(|o| o.name.as_str()),
        }
    }

    /// Returns the semantic class by the number in a mask; 0 for nothing.
    #[must_use]
    pub fn class(&self, object: u16) -> u16 {
        self.look(object).map_or(0, |l| l.class)
    }

    pub(crate) fn look(&self, object: u16) -> Option<&Look> {
        match object {
            GROUND => self.ground.as_ref().map(|(_, look)| look),
            k => self.objects.get((k as usize).checked_sub(2)?).map(|o| &o.look),
        }
    }

    /// Transforms a point of W to the frame in which an object's texture is defined.
    pub(crate) fn local(&self, object: u16, p_W: &Vec3) -> Vec3 {
        match (object as usize).checked_sub(2).and_then(|k| self.objects.get(k)) {
            Some(o) => o.X_OW.transform_point(p_W),
            None => Vec3::new(p_W.x, p_W.y, 0.0),
        }
    }

    /// Updates the tree with objects that were added or moved. O(n log n); has no effect when none were.
    pub fn settle(&mut self) {
        if !self.stale {
            return;
        }
        self.stale = false;
        self.tree.clear();
        let finite = |k: &u32| {
            let o = &self.objects[*k as usize];
            o.lo.iter().chain(o.hi.iter()).all(|v| v.is_finite())
        };
        let (ended, endless) = (0..self.objects.len() as u32).partition(finite);
        self.endless = endless;
        let ended: Vec<u32> = ended;
        if !ended.is_empty() {
            self.grow(ended);
        }
    }

    fn grow(&mut self, mut of: Vec<u32>) -> usize {
        let bounds = |o: &Object| (o.lo, o.hi);
        let all = of.iter().map(|k| bounds(&self.objects[*k as usize]));
        let far = Vec3::repeat(f64::INFINITY);
        let (lo, hi) = all.fold((far, -far), |(a, b), (lo, hi)| (a.inf(&lo), b.sup(&hi)));
        let at = self.tree.len();
        if of.len() <= LEAF {
            self.tree.push(Branch { lo, hi, kind: Fork::Leaf(of) });
            return at;
        }
        let middle = |k: &u32| {
            let o = &self.objects[*k as usize];
            o.lo + o.hi
        };
        let spread = of.iter().map(middle).fold((far, -far), |(a, b), m| (a.inf(&m), b.sup(&m)));
        let axis = (spread.1 - spread.0).imax();
        of.sort_by(|a, b| middle(a)[axis].total_cmp(&middle(b)[axis]).then(a.cmp(b)));
        let rest = of.split_off(of.len() / 2);
        self.tree.push(Branch { lo, hi, kind: Fork::Leaf(vec![]) });
        let (a, b) = (self.grow(of), self.grow(rest));
        self.tree[at].kind = Fork::Two(a, b);
        at
    }

    /// Returns the first hit along a ray from `origin` along the unit vector `direction`, both in W, within `max` (m, at most [`FAR`]). Returns
    /// `None` also for a ray with NaN. Objects that were added or moved after the last [`Scene::settle`] may be missed.
    #[must_use]
    pub fn cast(&self, origin: &Vec3, direction: &Vec3, max: f64) -> Option<Hit> {
        let hit = self.first(origin, direction, max)?;
        Some(self.with_normal(hit, origin, direction))
    }

    /// Like [`Scene::cast`], but without the normal if the ground is hit.
    fn first(&self, origin: &Vec3, direction: &Vec3, max: f64) -> Option<Hit> {
        let finite = origin.iter().chain(direction.iter()).all(|v| v.is_finite());
        if !finite || !(max >= 0.0) {
            return None;
        }
        let max = max.min(FAR);
        let mut best = self.ground.as_ref().and_then(|(map, _)| {
            let line = Line::new(origin, direction);
            Some(ground_hit(map.cast(&line, &[map.root()], max)?))
        });
        let mut stack = [0usize; 64];
        let mut left = usize::from(!self.tree.is_empty());
        let inverse = direction.map(|v| 1.0 / v);
        while left > 0 {
            left -= 1;
            let branch = &self.tree[stack[left]];
            let limit = best.map_or(max, |b| b.distance);
            if !through(&branch.lo, &branch.hi, origin, &inverse, limit) {
                continue;
            }
            match &branch.kind {
                Fork::Leaf(objects) => {
                    objects
                        .iter()
                        .for_each(|k| self.try_object(*k, origin, direction, max, &mut best));
                }
                Fork::Two(a, b) => {
                    (stack[left], stack[left + 1]) = (*b, *a);
                    left += 2;
                }
            }
        }
        self.endless.iter().for_each(|k| self.try_object(*k, origin, direction, max, &mut best));
        best
    }

    /// Checks the light, and that all objects are in the tree.
    pub(crate) fn check(&self) -> Result<(), RenderError> {
        self.light.check()?;
        if self.stale { Err(RenderError::Unsettled) } else { Ok(()) }
    }

    /// Returns true if a ray is blocked; used for shadows.
    #[must_use]
    pub fn blocked(&self, origin: &Vec3, direction: &Vec3, max: f64) -> bool {
        self.first(origin, direction, max).is_some()
    }

    fn try_object(&self, k: u32, o: &Vec3, d: &Vec3, max: f64, best: &mut Option<Hit>) {
        let object = &self.objects[k as usize];
        let limit = best.map_or(max, |b| b.distance);
        let (o, d) = (object.X_OW.transform_point(o), object.X_OW.transform_vector(d));
        let number = ObjectId(k as usize).in_mask();
        let Some((distance, n)) = object.form.cast(&o, &d, limit) else { return };
        // At equal distance choose the object that was added first, independent of the order in which the tree is traversed.
        if best
            .is_none_or(|b| distance < b.distance || (distance == b.distance && number < b.object))
        {
            let normal = object.X_WO.transform_vector(&n);
            *best = Some(Hit { distance, normal, object: number, inside: distance == 0.0 });
        }
    }

    /// Collects the geometry that the rays of a beam may hit.
    pub(crate) fn candidates(&self, beam: &Beam, out: &mut Candidates) {
        if let Some((map, _)) = &self.ground {
            map.regions(beam, &mut out.regions, &mut out.left);
        }
        out.objects.clear();
        let meets = |k: &u32| {
            let o = &self.objects[*k as usize];
            beam.meets(&o.lo, &o.hi)
        };
        let ended = self.tree.iter().flat_map(|b| match &b.kind {
            Fork::Leaf(objects) if beam.meets(&b.lo, &b.hi) => objects.as_slice(),
            _ => &[],
        });
        out.objects.extend(ended.filter(|k| meets(k)));
        out.objects.extend(&self.endless);
        out.objects.sort_unstable();
    }

    /// Like [`Scene::cast`] among candidates, but without the normal if the ground is hit; see [`Scene::with_normal`].
    #[inline]
    pub(crate) fn cast_among(&self, among: &Candidates, o: &Vec3, d: &Vec3) -> Option<Hit> {
        let mut best = self.ground.as_ref().and_then(|(map, _)| {
            Some(ground_hit(map.cast(&Line::new(o, d), &among.regions, FAR)?))
        });
        among.objects.iter().for_each(|k| self.try_object(*k, o, d, FAR, &mut best));
        best
    }

    /// Adds the normal to a hit on the ground.
    #[inline]
    pub(crate) fn with_normal(&self, hit: Hit, o: &Vec3, d: &Vec3) -> Hit {
        match &self.ground {
            Some((map, _)) if hit.object == GROUND => {
                let p = o + d * hit.distance;
                let n = map.normal(p.x, p.y);
                Hit { normal: if n.dot(d) > 0.0 { -n } else { n }, ..hit }
            }
            _ => hit,
        }
    }

    /// Returns true if a point (W) is inside a solid object or below the ground.
    #[must_use]
    pub fn is_inside(&self, p_W: &Vec3) -> bool {
        let below = self.ground.as_ref().and_then(|(map, _)| map.height(p_W.x, p_W.y));
        below.is_some_and(|h| p_W.z < h)
            || self.objects.iter().any(|o| {
                let p = o.X_OW.transform_point(p_W);
                o.form.cast(&p, &Vec3::z(), 0.0).is_some_and(|(t, n)| t == 0.0 && n == -Vec3::z())
            })
    }
}

/// Returns a hit on the ground; its normal is computed only on request.
fn ground_hit(distance: f64) -> Hit {
    Hit { distance, normal: Vec3::zeros(), object: GROUND, inside: false }
}

/// Returns true if a ray passes a box within a length. A ray that lies exactly in a face (0 · ∞) counts as passing.
fn through(lo: &Vec3, hi: &Vec3, o: &Vec3, inverse: &Vec3, max: f64) -> bool {
    let (mut from, mut to) = (0.0f64, max);
    for k in 0..3 {
        let (a, b) = ((lo[k] - o[k]) * inverse[k], (hi[k] - o[k]) * inverse[k]);
        // `max` and `min` ignore NaN.
        from = from.max(a.min(b));
        to = to.min(a.max(b));
    }
    from <= to
}

/// Checks that a pose is finite and its quaternion has unit length.
pub(crate) fn check_pose(what: &str, X: &Pose) -> Result<(), RenderError> {
    let length = X.rotation.coords.norm();
    match X.is_finite() && (length - 1.0).abs() < 1e-6 {
        true => Ok(()),
        false => Err(RenderError::Pose { what: what.into() }),
    }
}
