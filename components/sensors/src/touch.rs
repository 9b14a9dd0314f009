//! `sensors.touch`: the normal force of contacts in a zone of a body, such as a fingertip or the toe of a foot.
//! ```text
//! force = Σ fₖ over the contacts of the body whose point is in the zone, or whose line of action leaves the body through it      fₖ: normal force
//! ```
//! It is exact and has no dynamics. `sensors.contact_switch` reads all contacts of a body and has thresholds. The sum equals the sum of `touch` in MuJoCo.

use linkwork_runtime::ContactZone;
use linkwork_runtime::prelude::*;

/// Form of a zone.
#[derive(Params, Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZoneShape {
    /// An ellipsoid: its half axes are the size.
    Ellipsoid,
    /// A box: half of its edges are the size.
    Box,
    /// A cylinder about z: the size is its radius and half of its length.
    Cylinder,
    /// A capsule about z: the size is its radius and half of the length between the centres of its ends.
    Capsule,
}

/// The zone, about the origin of the site and in its axes.
#[derive(Params, Clone, Debug)]
pub struct TouchParams {
    /// Form of the zone.
    #[param(default = ZoneShape::Ellipsoid)]
    pub shape: ZoneShape,
    /// Size of the zone: half of its extents along x, y, z; for cylinders and capsules radius, half of the length, and a number without effect.
    pub size: [f64; 3],
}

/// Reading.
#[derive(Ports, Clone, Copy, Debug)]
pub struct TouchOut {
    /// Sum of the normal forces.
    #[port("N")]
    pub force: f64,
}

/// A touch sensor.
pub struct Touch {}

impl TouchParams {
    fn zone(&self) -> ContactZone {
        let [x, y, _] = self.size;
        match self.shape {
            ZoneShape::Ellipsoid => ContactZone::Ellipsoid(self.size),
            ZoneShape::Box => ContactZone::Box(self.size),
            ZoneShape::Cylinder => ContactZone::Cylinder([x, y]),
            ZoneShape::Capsule => ContactZone::Capsule([x, y]),
        }
    }
}

/// Sum of the normal forces of the contacts of a body in a zone, exact and continuous.
#[model("sensors.touch")]
impl SizedModel for Touch {
    type Params = TouchParams;

    fn ports(p: &TouchParams) -> SizedPorts {
        let load = PortSpec {
            bind: Some("site".into()),
            zone: Some(p.zone()),
            ..PortSpec::named("load", PortKind::ContactNormal, 1)
                .doc_of("The node of the zone; its body is the one that is touched.")
        };
        SizedPorts {
            feedthrough_inputs: vec![load],
            feedthrough_outputs: TouchOut::specs().into_iter().collect(),
            ..SizedPorts::default()
        }
    }

    fn build(p: TouchParams) -> Result<Self, BuildError> {
        let used = match p.shape {
            ZoneShape::Ellipsoid | ZoneShape::Box => &p.size[..],
            ZoneShape::Cylinder | ZoneShape::Capsule => &p.size[..2],
        };
        if let Some(wrong) = used.iter().find(|x| !(**x > 0.0 && x.is_finite())) {
            let fact = format!("a zone with the size {wrong} m contains no contact");
            return Err(BuildError::new(fact).help("write positive lengths in m").at("size"));
        }
        Ok(Touch {})
    }

    fn feedthrough(&self, u: &[f64], y: &mut [f64]) {
        y[0] = u[0];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zone_without_extent_is_refused() {
        let at = |shape, size| Touch::build(TouchParams { shape, size }).err().map(|e| e.message);
        assert!(at(ZoneShape::Box, [0.1, 0.0, 0.2]).unwrap().contains("the size 0 m"));
        assert!(at(ZoneShape::Capsule, [0.1, -0.1, 0.0]).unwrap().contains("-0.1"));
        assert!(at(ZoneShape::Cylinder, [0.1, 0.2, 0.0]).is_none());
        assert!(at(ZoneShape::Ellipsoid, [0.1, 0.2, f64::NAN]).is_some());
    }
}
