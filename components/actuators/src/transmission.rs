//! Transmissions of actuators and tendons: a weighted sum of joint coordinates, a line that is stretched over sites, or a wrench on a site.
//! ```text
//! joints    l = Σ cᵢ qᵢ,               l̇ = Σ cᵢ q̇ᵢ,                        τᵢ = cᵢ f
//! line      l = c Σ |pₖ₊₁ − pₖ|,       l̇ = c Σ uₖ · (vₖ₊₁ − vₖ),            Fₖ = c f (uₖ₋₁ − uₖ)
//! wrench    l̇ = g_f · Rᵀ v + g_m · Rᵀ ω,        l = g_f · Rᵀ p + g_m · θ,         F = f R g_f, M = f R g_m
//! ```
//! A wrench g = (g_f, g_m) acts on site 1. If there is a second site, R is the rotation of that site, p and θ (a rotation vector in its axes) are the
//! pose of site 1 in it, v and ω are the velocity relative to it, and the opposite wrench acts on it at the same point. Otherwise R is the rotation of
//! site 1, v and ω are its velocity, and l = 0.
//! uₖ points from site k to the next, and is 0 if two sites coincide. Virtual work: f l̇ = Σ τᵢ q̇ᵢ, or Σ Fₖ · vₖ.

use linkwork_runtime::Lane;
use linkwork_runtime::prelude::*;

/// Maximum number of joints or sites of one transmission.
const MOST: usize = 256;

/// Lanes of the state of a joint, and of a site.
const JOINT: usize = <HingeState as Lane>::N;
const SITE: usize = <NodeState as Lane>::N;
/// Lanes of the load of a site.
const LOAD: usize = <Wrench as Lane>::N;

/// A transmission; with `sites` above 0 it is a line, whose only factor is its gear, or a wrench.
pub(crate) struct Transmission<'a> {
    pub factors: &'a [f64],
    pub sites: u32,
    pub wrench: Option<[f64; 6]>,
}

impl Transmission<'_> {
    fn ports(
        &self,
        names: [&str; 2],
        kinds: [(PortKind, usize); 2],
        docs: [&'static str; 2],
    ) -> Vec<PortSpec> {
        let line = usize::from(self.sites > 0);
        let count = if self.sites > 0 { self.sites as usize } else { self.factors.len() };
        let ((kind, lanes), binding) = (kinds[line], ["joint", "site"][line]);
        let port = |k: usize| {
            let mut port = PortSpec::named(format!("{}{k}", names[line]), kind, lanes);
            port.bind = Some(format!("{binding}{k}").into());
            port.doc_of(docs[line])
        };
        (1..=count.min(MOST)).map(port).collect()
    }

    /// Input ports `joint1`, `joint2`, .. or `site1`, `site2`, ..
    pub fn inputs(&self) -> Vec<PortSpec> {
        let kinds = [(PortKind::HingeState, JOINT), (PortKind::NodeState, SITE)];
        self.ports(
            ["joint", "site"],
            kinds,
            [
                "A joint whose coordinate is a term of the sum.",
                "A site through which the line passes.",
            ],
        )
    }

    /// Output ports `torque1`, `torque2`, .. or `load1`, `load2`, ..
    pub fn outputs(&self) -> Vec<PortSpec> {
        let kinds = [(PortKind::HingeTorque, 1), (PortKind::Wrench, LOAD)];
        let docs = ["Torque on the joint (sliders: N).", "Force on the site."];
        self.ports(["torque", "load"], kinds, docs)
    }

    /// Returns length and rate; `u` contains the states of the joints or sites.
    pub fn motion(&self, u: &[f64]) -> [f64; 2] {
        if let Some(gear) = self.wrench {
            return relative(gear, u);
        }
        if self.sites == 0 {
            let states = u.chunks_exact(JOINT).map(HingeState::get);
            let all = self.factors.iter().zip(states);
            return all.fold([0.0; 2], |[l, v], (c, s)| [l + c * s.angle, v + c * s.rate]);
        }
        let [l, v] = segments(u)
            .fold([0.0; 2], |[l, v], (step, direction, rate)| [l + step, v + direction.dot(&rate)]);
        [self.factors[0] * l, self.factors[0] * v]
    }

    /// Writes the torques or loads of a force along the transmission.
    pub fn load(&self, u: &[f64], force: f64, y: &mut [f64]) {
        if self.sites == 0 {
            y.iter_mut().zip(self.factors).for_each(|(t, c)| *t = c * force);
            return;
        }
        y.fill(0.0);
        if let Some(gear) = self.wrench {
            return wrenches(gear, u, force, y);
        }
        let force = self.factors[0] * force;
        for (k, (_, direction, _)) in segments(u).enumerate() {
            for (site, sign) in [(k, -force), (k + 1, force)] {
                let own = &mut y[site * LOAD..][..LOAD];
                let mut load = Wrench::get(own);
                load.force += direction * sign;
                load.put(own);
            }
        }
    }

    /// Rejects lists that are empty, too long or not finite.
    pub fn check(&self) -> Result<(), BuildError> {
        let wrong = |fact: String, help: &str, at: &str| {
            Err(BuildError::new(fact).help(help.to_string()).at(at))
        };
        let n = self.factors.len();
        let line = self.sites > 0;
        if n == 0 || n > MOST || (line && n > 1) {
            let help = "write one factor for each of 1 to 256 joints, e.g. factors: [1] with bind: { \"joint1\": \"hinge:..\" }; with `sites`, write exactly one";
            return wrong(format!("{n} factors"), help, "factors");
        }
        if let Some(gear) = self.wrench {
            if self.factors != [1.0] {
                let help = "write factors: [1], and multiply the numbers of `wrench` instead";
                return wrong("`factors` do not act on a `wrench`".to_string(), help, "factors");
            }
            if !gear.iter().all(|c| c.is_finite()) {
                return wrong(
                    "a component of `wrench` is not finite".into(),
                    "write numbers",
                    "wrench",
                );
            }
            if !(1..=2).contains(&self.sites) {
                let help = "write sites: 1, or 2 for a wrench between two sites";
                return wrong(
                    format!("`sites` is {}, but a wrench acts on 1 or 2 sites", self.sites),
                    help,
                    "sites",
                );
            }
            return Ok(());
        }
        if self.sites == 1 || self.sites as usize > MOST {
            let help =
                "write 2 to 256, with bind: { \"site1\": \"node:..\", \"site2\": \"node:..\" }";
            return wrong(
                format!("`sites` is {}, but a line passes through at least 2 sites", self.sites),
                help,
                "sites",
            );
        }
        if self.factors.iter().any(|c| !c.is_finite()) {
            return wrong("a factor is not finite".into(), "write numbers", "factors");
        }
        Ok(())
    }
}

/// Returns force and moment of a gear in the axes of the world, and the reference site, if there is one.
fn turned(gear: [f64; 6], u: &[f64]) -> (NodeState, Option<NodeState>, [Vec3; 2]) {
    let mut sites = u.chunks_exact(SITE).map(NodeState::get);
    let site = sites.next().unwrap_or_else(NodeState::identity);
    let reference = sites.next();
    let axes = reference.as_ref().unwrap_or(&site).rotation;
    let [fx, fy, fz, mx, my, mz] = gear;
    (site, reference, [axes * Vec3::new(fx, fy, fz), axes * Vec3::new(mx, my, mz)])
}

/// Returns length and rate along a wrench.
fn relative(gear: [f64; 6], u: &[f64]) -> [f64; 2] {
    let (site, reference, [force, moment]) = turned(gear, u);
    let Some(r) = reference else {
        return [0.0, force.dot(&site.velocity) + moment.dot(&site.angular)];
    };
    let arm = site.position - r.position;
    let turn = r.rotation * (r.rotation.inverse() * site.rotation).scaled_axis();
    let velocity = site.velocity - r.velocity - r.angular.cross(&arm);
    [
        force.dot(&arm) + moment.dot(&turn),
        force.dot(&velocity) + moment.dot(&(site.angular - r.angular)),
    ]
}

/// Writes the loads of a wrench on its site, and of the opposite wrench on the reference site.
fn wrenches(gear: [f64; 6], u: &[f64], by: f64, y: &mut [f64]) {
    let (site, reference, [force, moment]) = turned(gear, u);
    let (force, moment) = (force * by, moment * by);
    let mut loads = y.chunks_exact_mut(LOAD);
    if let Some(own) = loads.next() {
        let mut load = Wrench::get(own);
        (load.force, load.moment) = (force, moment);
        load.put(own);
    }
    if let (Some(own), Some(r)) = (loads.next(), reference) {
        let mut load = Wrench::get(own);
        load.force = -force;
        load.moment = -moment - (site.position - r.position).cross(&force);
        load.put(own);
    }
}

/// Returns length, direction and velocity difference of each segment of a line.
fn segments(u: &[f64]) -> impl Iterator<Item = (f64, Vec3, Vec3)> {
    let sites = || u.chunks_exact(SITE).map(NodeState::get);
    sites().zip(sites().skip(1)).map(|(a, b)| {
        let step = b.position - a.position;
        let length = step.norm();
        let direction = if length > 0.0 { step / length } else { Vec3::zeros() };
        (length, direction, b.velocity - a.velocity)
    })
}

/// Rejects a pair that is not in order.
pub(crate) fn ordered(pair: Option<[f64; 2]>, name: &'static str) -> Result<(), BuildError> {
    match pair {
        Some([lower, upper]) if !(lower <= upper) => {
            Err(BuildError::new(format!("{lower} is above {upper}"))
                .help("write [lower, upper]")
                .at(name))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_of_a_line_do_its_work_and_add_up_to_nothing() {
        let line = Transmission { factors: &[1.5], sites: 3, wrench: None };
        assert!(line.check().is_ok());
        let mut u = vec![0.0; 3 * SITE];
        let places = [[0.0, 0.0, 0.0], [0.3, 0.4, 0.0], [0.3, 0.4, 1.2]];
        let rates = [[0.1, -0.2, 0.3], [0.5, 0.1, -0.4], [-0.3, 0.2, 0.7]];
        for k in 0..3 {
            let mut s = NodeState::identity();
            (s.position, s.velocity) = (places[k].into(), rates[k].into());
            s.put(&mut u[k * SITE..][..SITE]);
        }
        let [l, v] = line.motion(&u);
        assert!((l - 1.5 * 1.7).abs() < 1e-15, "{l}");
        let mut y = vec![9.0; 3 * LOAD];
        line.load(&u, 2.0, &mut y);
        let loads: Vec<Wrench> = y.chunks_exact(LOAD).map(Wrench::get).collect();
        let power: f64 = loads.iter().zip(rates).map(|(f, v)| f.force.dot(&Vec3::from(v))).sum();
        assert!((power - 2.0 * v).abs() < 1e-14, "{power} {v}");
        assert!(loads.iter().map(|f| f.force).sum::<Vec3>().norm() < 1e-15);
        // A force that lengthens the line pushes the first site away from the second.
        assert!((loads[0].force - Vec3::new(-0.6, -0.8, 0.0) * 3.0).norm() < 1e-14);
        for (factors, sites) in [(&[1.0, 2.0][..], 2), (&[1.0], 1), (&[], 2), (&[f64::NAN], 0)] {
            assert!(Transmission { factors, sites, wrench: None }.check().is_err());
        }
    }
}
