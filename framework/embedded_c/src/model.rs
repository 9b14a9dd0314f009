//! Constant data of a robot, and its names.

use crate::call::{calls, indices};
use crate::edge::{self, Out, list, numbers_mut, write_text};
use crate::status::{Fault, LwStatus, Message};
use linkwork_embedded::{ColliderId, Object, Part, RobotError, RobotModel};
use std::ffi::c_char;
use std::sync::{Arc, Mutex};

/// Constant data of a robot. Any number of threads may use it at once. The message is that of the last failed call of any of them; `lw_model_clone`
/// gives a thread a handle with its own message.
pub struct LwModel {
    pub(crate) model: Arc<RobotModel>,
    message: Mutex<Message>,
}

impl LwModel {
    pub(crate) fn give(model: Arc<RobotModel>) -> *mut Self {
        Box::into_raw(Box::new(Self { model, message: Mutex::new(Message::new()) }))
    }

    pub(crate) fn message(&self) -> &Mutex<Message> {
        &self.message
    }
}

indices! {
    Part, LwModel, |m, c| edge::part(&m.model, c);
    Object, LwModel, |m, c| edge::object(&m.model, c);
}

/// Describes a name that does not exist, with the existing names or their number.
fn unknown<'a>(kind: &str, name: &str, all: impl ExactSizeIterator<Item = &'a str>) -> Fault {
    let help = match all.len() {
        0 => "the model has none".to_owned(),
        n if n > 40 => format!("correct the name; the model has {n} others"),
        _ => format!("one of: {}", all.collect::<Vec<_>>().join(", ")),
    };
    Fault::Unknown(format!("there is no {kind} `{name}`\n  help: {help}"))
}

/// Returns the numbers of coordinates and rates of an object's joints, without the root: zero for a rigid object.
pub(crate) fn object_sizes(m: &RobotModel, object: Object) -> Result<(usize, usize), Fault> {
    let Some(bodies) = m.object_multibody(object) else { return Ok((0, 0)) };
    let root = bodies.body_ids().next().ok_or(RobotError::ForeignHandle)?;
    let root = bodies.get(root);
    Ok((bodies.nq() - root.q().len(), bodies.nv() - root.v().len()))
}

/// # Safety
/// The conditions in the crate documentation apply.
unsafe fn colliders(
    all: impl Iterator<Item = ColliderId>,
    out: *mut u32,
    room: usize,
    count: Out<usize>,
) -> Result<(), Fault> {
    let all: Vec<u32> = all.map(|id| id.index() as u32).collect();
    // SAFETY: guaranteed by the caller.
    unsafe { list("colliders", all.into_iter(), numbers_mut("out", out, room, room)?, count) }
}

calls![
    /// Writes another handle of the same model, with its own message, to `out`. O(1).
    fn lw_model_clone(m: &LwModel, out: Out<*mut LwModel>) {
        out.set(LwModel::give(m.model.clone()));
    }

    /// Frees this handle of a model; NULL has no effect. Robots of the model remain valid.
    fn lw_model_free(model: *mut LwModel);
];

/// Like `lw_builder_message`, for a model.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn lw_model_message(
    model: *const LwModel,
    buffer: *mut c_char,
    room: usize,
    wanted: *mut usize,
) -> LwStatus {
    // SAFETY: guaranteed by the caller.
    unsafe { edge::message(model, LwModel::message, buffer, room, wanted) }
}

calls![
    /// Copies the content of the files that the model does not use, one line each, like `lw_builder_message`.
    fn lw_model_unused(m: &LwModel, buffer: *mut c_char, room: usize, wanted: *mut usize) {
        write_text(&m.model.unused().join("\n"), buffer, room, wanted)?;
    }

    /// Copies warnings about mass properties in the robot's file that no rigid body can have but that were read all the same (`LW_INERTIA_WARN`), one
    /// line each with link and numbers, like `lw_builder_message`; empty when there are none.
    fn lw_model_doubtful(m: &LwModel, buffer: *mut c_char, room: usize, wanted: *mut usize) {
        write_text(&m.model.doubtful().join("\n"), buffer, room, wanted)?;
    }

    /// Writes the number of coordinates to `nq` and the number of degrees of freedom to `nv`.
    fn lw_model_sizes(m: &LwModel, nq: Out<usize>, nv: Out<usize>) {
        nq.set(m.model.nq());
        nv.set(m.model.nv());
    }

    /// Writes the index of the part with this name, from 0, to `out`.
    fn lw_model_part(m: &LwModel, name: &str, out: Out<u32>) {
        let found = m.model.part(name);
        let found = found.ok_or_else(|| unknown("part", name, m.model.parts().map(|p| p.1)))?;
        out.set(found.index() as u32);
    }

    /// Writes the index of the object with this name, from 0, to `out`.
    fn lw_model_object(m: &LwModel, name: &str, out: Out<u32>) {
        let found = m.model.object(name);
        let all = || m.model.objects().map(|o| o.1);
        out.set(found.ok_or_else(|| unknown("object", name, all()))?.index() as u32);
    }

    /// Writes the number of coordinates of an object's joints to `nq` and their number of degrees of freedom to `nv`; 0 for a rigid object.
    fn lw_model_object_sizes(m: &LwModel, object: Object, nq: Out<usize>, nv: Out<usize>) {
        let (q, v) = object_sizes(&m.model, object)?;
        nq.set(q);
        nv.set(v);
    }

    /// Writes the index of the body with this name among the object itself and the bodies that hang on it to `out`.
    fn lw_model_object_body(m: &LwModel, object: Object, name: &str, out: Out<u32>) {
        let bodies = m.model.object_multibody(object);
        let all = bodies.map_or(&[][..], |m| m.bodies());
        let names = || all.iter().map(|b| b.name());
        let found = bodies.and_then(|m| m.body(name));
        let found = found.ok_or_else(|| unknown("body of the object", name, names()))?;
        out.set(found.index() as u32);
    }

    /// Writes the index of the body with this name, from 0, to `out`.
    fn lw_model_body(m: &LwModel, name: &str, out: Out<u32>) {
        let mbs = m.model.multibody();
        let all = || mbs.bodies().iter().map(|b| b.name());
        out.set(mbs.body(name).ok_or_else(|| unknown("body", name, all()))?.index() as u32);
    }

    /// Writes the index of the collider with this name, from 0 in alphabetical order, to `out`.
    fn lw_model_collider(m: &LwModel, name: &str, out: Out<u32>) {
        let all = || m.model.colliders().map(|c| c.1);
        let found = m.model.collider(name).ok_or_else(|| unknown("collider", name, all()))?;
        out.set(found.index() as u32);
    }

    /// Copies the name of a collider, like `lw_builder_message`.
    fn lw_model_collider_name(
        m: &LwModel,
        collider: u32,
        buffer: *mut c_char,
        room: usize,
        wanted: *mut usize,
    ) {
        let found = m.model.colliders().nth(collider as usize);
        write_text(found.ok_or(RobotError::ForeignHandle)?.1, buffer, room, wanted)?;
    }

    /// Writes the indices in q and among the degrees of freedom of a joint with one coordinate, by its name in the file, or by the name of a body of
    /// `lw_builder_body`.
    fn lw_model_joint(m: &LwModel, name: &str, in_q: Out<usize>, in_v: Out<usize>) {
        let none = || {
            let help = "give the name of a joint of the file, or of an added body, that has one coordinate";
            Fault::Unknown(format!(
                "there is no joint `{name}` with one coordinate\n  help: {help}"
            ))
        };
        let (q, v) = m.model.coordinate(name).ok_or_else(none)?;
        in_q.set(q);
        in_v.set(v);
    }

    /// Writes the indices of a body's hinge: first index and number in q (`in_q`, `q_count`) and among the degrees of freedom (`in_v`, `v_count`). The
    /// numbers are zero for a welded body.
    fn lw_model_hinge(
        m: &LwModel,
        body: u32,
        in_q: Out<usize>,
        q_count: Out<usize>,
        in_v: Out<usize>,
        v_count: Out<usize>,
    ) {
        let b = m.model.multibody().bodies().get(body as usize);
        let b = b.ok_or(RobotError::ForeignHandle)?;
        in_q.set(b.q().start);
        q_count.set(b.q().len());
        in_v.set(b.v().start);
        v_count.set(b.v().len());
    }

    /// Like `lw_model_hinge`, for a body that hangs on an object (`lw_model_object_body`). The indices refer to the joints of that object. The object
    /// itself has none.
    fn lw_model_object_hinge(
        m: &LwModel,
        object: Object,
        body: u32,
        in_q: Out<usize>,
        q_count: Out<usize>,
        in_v: Out<usize>,
        v_count: Out<usize>,
    ) {
        let bodies = m.model.object_multibody(object);
        let all = bodies.map_or(&[][..], |m| m.bodies());
        let (root, b) = (all.first(), all.get(body as usize));
        let (root, b) = root.zip(b).ok_or(RobotError::ForeignHandle)?;
        // The root comes first, and its coordinates do not belong to a joint.
        let own = body != 0;
        in_q.set(b.q().start.saturating_sub(root.q().len()));
        q_count.set(if own { b.q().len() } else { 0 });
        in_v.set(b.v().start.saturating_sub(root.v().len()));
        v_count.set(if own { b.v().len() } else { 0 });
    }

    /// Writes the number of degrees of freedom of a chain, which is the number of columns of its Jacobian, to `count`.
    fn lw_model_part_size(m: &LwModel, part: Part, count: Out<usize>) {
        count.set(m.model.dofs(part)?.len());
    }

    /// Writes the indices of a chain's degrees of freedom among all to `dofs` of length `n` (`lw_model_part_size`).
    fn lw_model_part_dofs(m: &LwModel, part: Part, dofs: *mut usize, n: usize) {
        let all = m.model.dofs(part)?;
        numbers_mut("dofs", dofs, n, all.len())?.copy_from_slice(all);
    }

    /// Writes the colliders on the bodies of a part, sorted by name, to `out`, and their number to `count`. If there are more than `room`, returns
    /// `LW_STATUS_NO_ROOM` and writes only `count`.
    fn lw_model_part_colliders(
        m: &LwModel,
        part: Part,
        out: *mut u32,
        room: usize,
        count: Out<usize>,
    ) {
        colliders(m.model.colliders_of_part(part)?, out, room, count)?;
    }

    /// Like `lw_model_part_colliders`, for an object, including colliders on bodies that hang on it.
    fn lw_model_object_colliders(
        m: &LwModel,
        object: Object,
        out: *mut u32,
        room: usize,
        count: Out<usize>,
    ) {
        colliders(m.model.colliders_of_object(object)?, out, room, count)?;
    }

    /// Writes the limits of the degrees of freedom with one coordinate, rad or m, to `lower` and `upper` (`n` = nv each); infinite for no limit.
    fn lw_model_limits(m: &LwModel, lower: *mut f64, upper: *mut f64, n: usize) {
        edge::apart(("lower", lower.cast_const(), n), ("upper", upper, n))?;
        let nv = m.model.nv();
        let lower = numbers_mut("lower", lower, n, nv)?;
        let upper = numbers_mut("upper", upper, n, nv)?;
        lower.fill(f64::NEG_INFINITY);
        upper.fill(f64::INFINITY);
        for (_, s) in m.model.multibody().subhinges().filter(|s| s.1.q.len() == 1) {
            lower[s.v.start] = s.subhinge.limits.lower;
            upper[s.v.start] = s.subhinge.limits.upper;
        }
    }
];
