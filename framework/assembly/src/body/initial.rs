//! How a body starts: `initial: (angle: "5 deg", rate: 0)`, or poses and velocities.
use crate::schema::pose::{rotation, vector};
use crate::schema::read::{fields, list, number};
use crate::text::report::Cx;
use crate::text::value::{list as numbers, set};
use linkwork_multibody::{Hinge, Subhinge, SubhingeKind};
use linkwork_runtime::{Located, Value};
use linkwork_spatial::{Quat, Vec3};

/// Coordinates and rates of one hinge; neutral where nothing is written.
pub(crate) fn read(
    cx: &mut Cx,
    v: Option<&Located>,
    hinge: &Hinge,
    what: &str,
) -> (Vec<f64>, Vec<f64>) {
    let (mut q, mut rates) = (Vec::new(), Vec::new());
    for s in &hinge.subhinges {
        match s.kind {
            SubhingeKind::Free => q.extend([0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0]),
            SubhingeKind::Ball => q.extend([0.0, 0.0, 0.0, 1.0]),
            _ => q.extend(vec![0.0; s.kind.nq()]),
        }
        rates.extend(vec![0.0; s.kind.nv()]);
    }
    let Some(v) = v.filter(|v| v.value != Value::Null) else { return (q, rates) };
    let what = format!("{what}: `initial`");
    match hinge.subhinges.as_slice() {
        [s] if matches!(s.kind, SubhingeKind::Free) => {
            fields(cx, v, &what, &["position", "rotation", "velocity", "angular"]);
            free(cx, v, &what, &mut q, &mut rates);
        }
        [s] if matches!(s.kind, SubhingeKind::Ball) => {
            fields(cx, v, &what, &["rotation", "angular"]);
            let (R, w) = attitude(cx, v, &what);
            q.copy_from_slice(&[R.i, R.j, R.k, R.w]);
            rates.copy_from_slice(w.as_slice());
        }
        [s] if s.kind.nv() == 1 => {
            let slides = matches!(s.kind, SubhingeKind::Slider { .. });
            let (name, unit, per_second) =
                if slides { ("position", "m", "m/s") } else { ("angle", "rad", "rad/s") };
            fields(cx, v, &what, &[name, "rate"]);
            let mut read = |field: &str, unit: &str| {
                let x = v.get(field)?;
                number(cx, x, &format!("{what}: `{field}`"), unit)
            };
            q[0] = read(name, unit).unwrap_or(0.0);
            rates[0] = read("rate", per_second).unwrap_or(0.0);
        }
        [] => {
            let help =
                "a locked hinge has no coordinate: leave `initial` out or choose another hinge";
            cx.fault(v.origin, format!("{what} cannot be set for this hinge"), help);
        }
        chain if chain.iter().any(|s| s.kind.nv() > 1) => {
            whole_chain(cx, v, &what, chain, &mut q, &mut rates)
        }
        chain => {
            fields(cx, v, &what, &["coordinates", "rates"]);
            for (field, out, angle, length) in
                [("coordinates", &mut q, "rad", "m"), ("rates", &mut rates, "rad/s", "m/s")]
            {
                let Some(written) = v.get(field) else { continue };
                let items = list(cx, written, &format!("{what}: `{field}`")).to_vec();
                if items.len() != chain.len() {
                    let message = format!(
                        "{what}: `{field}` has {} numbers, the hinge has {}",
                        items.len(),
                        chain.len()
                    );
                    cx.fault(written.origin, message, "one for each subhinge, parent's side first");
                    continue;
                }
                for ((item, s), x) in items.iter().zip(chain).zip(out) {
                    let slides = matches!(s.kind, SubhingeKind::Slider { .. });
                    let unit = if slides { length } else { angle };
                    *x = number(cx, item, &format!("{what}: `{field}`"), unit).unwrap_or(0.0);
                }
            }
        }
    }
    (q, rates)
}

/// All numbers of q and β of a chain that holds a ball, in SI.
fn whole_chain(
    cx: &mut Cx,
    v: &Located,
    what: &str,
    chain: &[Subhinge],
    q: &mut [f64],
    rates: &mut [f64],
) {
    fields(cx, v, what, &["coordinates", "rates"]);
    for (field, out) in [("coordinates", &mut *q), ("rates", rates)] {
        let Some(written) = v.get(field) else { continue };
        let what = format!("{what}: `{field}`");
        let items = list(cx, written, &what).to_vec();
        if items.len() != out.len() {
            let message =
                format!("{what} has {} numbers, the hinge has {}", items.len(), out.len());
            let help = "a chain with a ball takes all its numbers; a quaternion is x, y, z, w";
            cx.fault(written.origin, message, help);
            return;
        }
        for (item, x) in items.iter().zip(out) {
            *x = number(cx, item, &what, "").unwrap_or(0.0);
        }
    }
    let mut at = 0;
    for s in chain {
        let end = at + s.kind.nq();
        let turn = &q[end.saturating_sub(4).max(at)..end];
        let length = turn.iter().map(|x| x * x).sum::<f64>().sqrt();
        if s.kind.nv() > 1 && !((length - 1.0).abs() < 1e-6) {
            let message = format!("{what}: a quaternion has length {length}, not 1");
            cx.fault(v.origin, message, "the order is x, y, z, w; divide by the length");
        }
        at = end;
    }
}

/// Rotation of the child in the parent and body rates in child axes.
fn attitude(cx: &mut Cx, v: &Located, what: &str) -> (Quat, Vec3) {
    let R = v.get("rotation").and_then(|r| rotation(cx, r, &format!("{what}: `rotation`")));
    let w = v.get("angular").and_then(|w| vector(cx, w, &format!("{what}: `angular`"), "rad/s"));
    (R.unwrap_or_else(Quat::identity), w.unwrap_or_else(Vec3::zeros))
}

/// Position and velocity in the parent's hinge frame, angular rates in the body's own axes.
fn free(cx: &mut Cx, v: &Located, what: &str, q: &mut [f64], rates: &mut [f64]) {
    let (R, w) = attitude(cx, v, what);
    let mut read = |field: &str, unit: &str| {
        let x = v.get(field)?;
        vector(cx, x, &format!("{what}: `{field}`"), unit)
    };
    let p = read("position", "m").unwrap_or_else(Vec3::zeros);
    let velocity = read("velocity", "m/s").unwrap_or_else(Vec3::zeros);
    q.copy_from_slice(&[p.x, p.y, p.z, R.i, R.j, R.k, R.w]);
    rates[..3].copy_from_slice(w.as_slice());
    // β holds the velocity in child axes.
    rates[3..].copy_from_slice((R.inverse() * velocity).as_slice());
}

/// A hinge's numbers of q in the words of its kind.
pub(crate) fn value(h: &Hinge, q: &[f64]) -> Value {
    let quat = |q: &[f64]| Value::Map(vec![("quat".to_owned(), numbers(q.iter().copied()).into())]);
    let mut out: Located = Value::Map(Vec::new()).into();
    let mut put = |key: &str, v: Value| set(&mut out, &[key.to_owned()], &v.into());
    match &h.subhinges[..] {
        [] => {}
        [s] if s.kind == SubhingeKind::Free && q.len() == 7 => {
            put("position", numbers(q[..3].iter().copied()));
            put("rotation", quat(&q[3..]));
        }
        [s] if s.kind == SubhingeKind::Ball => put("rotation", quat(q)),
        [s] if matches!(s.kind, SubhingeKind::Slider { .. }) => put("position", list1(q)),
        [s] if s.kind.nv() == 1 => put("angle", list1(q)),
        _ => put("coordinates", numbers(q.iter().copied())),
    }
    out.value
}

fn list1(q: &[f64]) -> Value {
    Value::Number(q.first().copied().unwrap_or(0.0))
}
