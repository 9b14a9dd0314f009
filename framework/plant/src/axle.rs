//! A wheel is bound to a node whose axle should coincide with the axis of its hinge.
#![allow(non_snake_case)]
use crate::frame::Frame;
use linkwork_multibody::{Multibody, SubhingeKind};
use linkwork_runtime::{Bound, Fault, Lowering};
use linkwork_spatial::{Pose, Vec3};

/// Largest angle between axle and hinge without a warning; camber and toe are smaller.
const ANGLE_MAX: f64 = 20.0;

/// Warns if the first movable hinge inboard of a node is a single pin whose axis is not the axle.
pub(crate) fn check(
    mb: &Multibody,
    b: &Bound<'_>,
    (axle, frame): ([f64; 3], Frame),
    label: &str,
    out: &mut Lowering<'_>,
) {
    let (mut id, mut X) = match frame {
        Frame::Body(id) => (id, Pose::identity()),
        Frame::Node(n) => {
            let node = &mb.nodes()[n.index()];
            (node.body(), node.pose())
        }
    };
    loop {
        let body = mb.get(id);
        let moving: Vec<_> = body.subhinges().iter().filter(|s| !s.v.is_empty()).collect();
        match moving[..] {
            [] => {
                // The body is welded: express the frame in its parent.
                let Some(parent) = body.parent() else { return };
                X = body.hinge_in_parent() * body.hinge_in_body().inverse() * X;
                id = parent;
            }
            [one] => {
                let SubhingeKind::Pin { axis } = one.subhinge.kind else { return };
                let hinge = body.hinge_in_body().rotation * axis;
                let axle = X.rotation * Vec3::from(axle);
                let angle = axle.cross(&hinge).norm().atan2(axle.dot(&hinge).abs()).to_degrees();
                if angle > ANGLE_MAX {
                    let (part, bind) = (&b.spec.part, &b.spec.bind);
                    let fact = format!(
                        "`{part}`: binding `{bind}`: the axle of `{label}` is at {angle:.0}° to the hinge axis of `{}`, about which it rotates",
                        body.name()
                    );
                    let help = "bind the body that rotates with the wheel, or a node on it whose axis is parallel to its hinge axis";
                    out.warnings.push(Fault::new(b.spec.origin, fact).help(help));
                }
                return;
            }
            _ => return,
        }
    }
}
