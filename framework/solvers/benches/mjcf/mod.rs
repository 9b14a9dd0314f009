//! Writes a scene as MJCF.

use crate::scenes::{FRICTION, Meet, Scene};
use linkwork_collision::{ColliderSpec, Shape};
use linkwork_dynamics::multibody::{BodyId, Multibody};
use linkwork_dynamics::spatial::Pose;
use std::fmt::Write as _;

/// Returns the model, with bodies in Linkwork's order, so that coordinates have the same indices.
pub fn model(s: &Scene) -> String {
    let bits = if s.meet == Meet::All { (1, 1) } else { (1, 0) };
    let (solid, field) = ground(s);
    let mut t = format!(
        "<mujoco><compiler angle=\"radian\" autolimits=\"true\" balanceinertia=\"false\"/>\n\
         <option timestep=\"{}\" gravity=\"0 0 -9.81\"/>\n<asset>{field}</asset>\n\
         <default><geom friction=\"{FRICTION} 0 0\" condim=\"3\" contype=\"{}\" \
         conaffinity=\"{}\"/></default>\n<worldbody>\n{solid}\n",
        s.h, bits.0, bits.1
    );
    for (i, b) in s.mbs.bodies().iter().enumerate() {
        if b.parent().is_none() {
            body(&mut t, s, i);
        }
    }
    t += "</worldbody>\n<equality>\n";
    for c in s.mbs.couplings() {
        let name = |i: usize| s.mbs.bodies()[c.bodies[i].index()].name();
        let ratio = -c.terms[1].2 / c.terms[0].2;
        writeln!(
            t,
            "<joint joint1=\"{}\" joint2=\"{}\" polycoef=\"0 {ratio} 0 0 0\"/>",
            name(0),
            name(1)
        )
        .expect("text");
    }
    t + "</equality></mujoco>\n"
}

/// Returns positions, rates and applied forces.
pub fn state(s: &Scene) -> String {
    let (mut q, mut v, mut f) = (s.q.clone(), s.v.clone(), s.applied.clone());
    for b in s.mbs.bodies().iter().filter(|b| b.v().len() == 6) {
        // MuJoCo has quaternions with w first, and rates [v; ω].
        q[b.q()][3..].rotate_right(1);
        v[b.v()].rotate_left(3);
        f[b.v()].rotate_left(3);
    }
    let all = q.iter().chain(&v).chain(&f);
    all.map(|x| format!("{x:e}\n")).collect()
}

fn ground(s: &Scene) -> (String, String) {
    let bits = "contype=\"1\" conaffinity=\"1\"";
    match &s.ground.fine {
        Shape::HeightField { x, y, spacing, heights } => {
            let top = heights.iter().fold(0.0_f64, |a, h| a.max(*h));
            let rows: Vec<String> = heights.iter().map(|h| format!("{:e}", h / top)).collect();
            let (rx, ry) = (0.5 * spacing[0] * (*x - 1) as f64, 0.5 * spacing[1] * (*y - 1) as f64);
            // Elevation rows start at the far side of y.
            let mut text = String::new();
            for row in rows.chunks(*x).rev() {
                text += &row.join(" ");
                text.push('\n');
            }
            (
                format!("<geom type=\"hfield\" hfield=\"field\" {bits}/>"),
                format!(
                    "<hfield name=\"field\" nrow=\"{y}\" ncol=\"{x}\" size=\"{rx} {ry} {top:e} 1\" \
                     elevation=\"{text}\"/>"
                ),
            )
        }
        _ => (format!("<geom type=\"plane\" size=\"0 0 1\" {bits}/>"), String::new()),
    }
}

fn place(X: &Pose) -> String {
    let (p, r) = (X.position, X.rotation);
    format!(
        "pos=\"{:e} {:e} {:e}\" quat=\"{:e} {:e} {:e} {:e}\"",
        p.x, p.y, p.z, r.w, r.i, r.j, r.k
    )
}

fn body(t: &mut String, s: &Scene, index: usize) {
    let mbs: &Multibody = &s.mbs;
    let b = &mbs.bodies()[index];
    let put = |t: &mut String, line: &str| writeln!(t, "{line}").expect("text");
    put(t, &format!("<body name=\"{}\" {}>", b.name(), place(&b.hinge_in_parent())));
    match b.subhinges()[0].subhinge.kind.axis() {
        None => put(t, "<freejoint/>"),
        Some(axis) => {
            put(
                t,
                &format!(
                    "<joint name=\"{}\" type=\"hinge\" axis=\"{} {} {}\" armature=\"{}\" \
                     damping=\"{}\"/>",
                    b.name(),
                    axis.x,
                    axis.y,
                    axis.z,
                    s.armature,
                    s.damping[b.v().start]
                ),
            );
        }
    }
    let (I, c) = (b.inertia(), b.inertia().com());
    let J = I.inertia_com();
    put(
        t,
        &format!(
            "<inertial pos=\"{:e} {:e} {:e}\" mass=\"{:e}\" fullinertia=\"{:e} {:e} {:e} {:e} {:e} \
             {:e}\"/>",
            c.x,
            c.y,
            c.z,
            I.mass(),
            J[(0, 0)],
            J[(1, 1)],
            J[(2, 2)],
            J[(0, 1)],
            J[(0, 2)],
            J[(1, 2)]
        ),
    );
    for shape in s.shapes.iter().filter(|x| x.body == b.name()) {
        put(t, &geom(shape));
    }
    for (i, child) in mbs.bodies().iter().enumerate() {
        if child.parent().map(BodyId::index) == Some(index) {
            body(t, s, i);
        }
    }
    put(t, "</body>");
}

fn geom(shape: &ColliderSpec) -> String {
    let what = match &shape.fine {
        Shape::Sphere { radius } => format!("type=\"sphere\" size=\"{radius}\""),
        Shape::Box { half } => format!("type=\"box\" size=\"{} {} {}\"", half.x, half.y, half.z),
        Shape::Capsule { radius, half_length } => {
            format!("type=\"capsule\" size=\"{radius} {half_length}\"")
        }
        Shape::Cylinder { radius, half_length } => {
            format!("type=\"cylinder\" size=\"{radius} {half_length}\"")
        }
        other => panic!("{other:?} is not written"),
    };
    format!("<geom {what} {}/>", place(&shape.pose))
}
