//! `manipulation.shearing`: two blades on a pin that cut a round wire.
//! ```text
//! blades         origin on the pin, y along it, z along the edge; blade b is rotated by φ about y
//! s              lever of the wire: its position along the bisector of both edges
//! g = 2 s tan(φ/2)                     distance of the edges there
//! F = k (2 R − g − h)₊                 while the wire is between the edges and h < 2 R: equal and opposite, across that line
//! ḣ = (F − τ A(h))₊ / η                h: penetration of both edges together
//! A(h) = R² (θ − sin θ cos θ),  cos θ = h/R − 1        remaining section
//! ```
//! The wire is sheared: its resistance is the shear strength times the remaining section, with the maximum at the start. Elastic blades and a viscous
//! term keep the force smooth; η should be small compared with τ R divided by the closing rate.
//!
//! The wire lies along the pin. The wire yields sideways: edge b moves it to edge a, so that forces act only on the edges, and it does not slide
//! along them. It is caught if edge b reaches it from outside while it is on the inner side of edge a. The lever of the force is valid for a nearly
//! closed jaw.

use linkwork_runtime::prelude::*;

/// Blades and wire.
#[derive(Params, Clone, Debug)]
pub struct ShearingParams {
    /// Radius of the wire.
    #[param(unit = "m", range = 1e-6..)]
    pub radius: f64,
    /// Shear strength of the wire.
    #[param(unit = "Pa", range = 1.0..)]
    pub strength: f64,
    /// Length of the blades from the pin.
    #[param(unit = "m", range = 1e-6..)]
    pub blades: f64,
    /// Distance by which the wire can yield to an edge.
    #[param(unit = "m", default = 5e-3, range = 0.0..)]
    pub sideways: f64,
    /// Stiffness of both edges with the wire's skin.
    #[param(unit = "N/m", default = 2e6, range = 1.0..)]
    pub stiffness: f64,
    /// Viscous force per penetration rate of both edges, in addition to the shearing force.
    #[param(unit = "N s/m", default = 1e3, range = 1e-3..)]
    pub viscosity: f64,
}

/// Blades and wire.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ShearingIn {
    /// Blade a: origin on the pin, y along it, z along the edge.
    #[port(bind = "a")]
    pub a: NodeState,
    /// Blade b: like blade a, rotated by φ about y.
    #[port(bind = "b")]
    pub b: NodeState,
    /// Point of the wire's axis at the cut.
    #[port(bind = "wire")]
    pub wire: NodeState,
}

/// Loads and progress.
#[derive(Ports, Clone, Copy, Debug)]
pub struct ShearingOut {
    /// Wrench on blade a.
    #[port(bind = "a")]
    pub on_a: Wrench,
    /// Wrench on blade b.
    #[port(bind = "b")]
    pub on_b: Wrench,
    /// Force of each edge on the wire.
    #[port("N")]
    pub force: f64,
    /// Cut fraction of the wire's thickness: 1 when it is cut through.
    #[port("1")]
    pub cut: f64,
    /// Opening angle φ of the jaw.
    #[port("rad")]
    pub opening: f64,
    /// Penetration rate of both edges.
    #[port("m/s")]
    pub feed: f64,
}

/// The cut.
#[derive(State, Clone, Copy, Debug)]
pub struct Depth {
    /// Penetration of both edges together.
    #[port("m")]
    pub depth: f64,
}

/// The wire in the jaw.
#[derive(State, Clone, Copy, Debug)]
pub struct Caught {
    /// The wire was in the jaw when edge b reached it.
    #[port("1")]
    pub caught: bool,
}

/// Edge b and the wire.
#[derive(Ports, Clone, Copy, Debug)]
pub struct WireGaps {
    /// Distance of edge b from the undisturbed wire, for the event at which the edge reaches it.
    #[port("m", falling)]
    pub closes: f64,
    /// This distance again, for the event at which the edge leaves the wire.
    #[port("m", rising)]
    pub opens: f64,
}

/// Index in [`WireGaps`] of the guard at which the edge reaches the wire.
const CLOSES: usize = 0;

/// Blades that cut a wire.
pub struct Shearing {
    p: ShearingParams,
}

/// The jaw and the wire in it.
struct Jaw {
    opening: f64,
    /// Lever of the undisturbed wire, and distances of its axis from both edges, inside the jaw.
    lever: f64,
    from: [f64; 2],
    /// Distance of the edges at that lever.
    gap: f64,
    /// Direction from edge a to edge b across the bisector, W; and direction along it.
    across: Vec3,
    along: Vec3,
}

fn jaw(u: &ShearingIn) -> Jaw {
    let R = u.a.rotation;
    let at = R.inverse() * (u.wire.position - u.a.position);
    let edge = R.inverse() * (u.b.rotation * Vec3::z());
    let opening = edge.x.atan2(edge.z);
    let (sin, cos) = (0.5 * opening).sin_cos();
    let (along, across) = (Vec3::new(sin, 0.0, cos), Vec3::new(cos, 0.0, -sin));
    let lever = at.dot(&along);
    let gap = 2.0 * lever * (0.5 * opening).tan();
    let from = [at.x, at.z * opening.sin() - at.x * opening.cos()];
    Jaw { opening, lever, from, gap, across: R * across, along: R * along }
}

impl Shearing {
    /// Returns the remaining section of the wire, m².
    fn left(&self, depth: f64) -> f64 {
        let R = self.p.radius;
        let theta = (depth / R - 1.0).clamp(-1.0, 1.0).acos();
        R * R * (theta - theta.sin() * theta.cos())
    }
}

/// Two blades on a pin that shear a round wire: forces on the blades and depth of the cut.
#[model("manipulation.shearing")]
impl Model for Shearing {
    type Params = ShearingParams;
    type FeedthroughInputs = ShearingIn;
    type FeedthroughOutputs = ShearingOut;
    type State = Depth;
    type DiscreteState = Caught;
    type Guards = WireGaps;
    fn feedthrough(&self, x: &Depth, d: &Caught, u: &ShearingIn) -> ShearingOut {
        let (p, jaw) = (&self.p, jaw(u));
        let whole = d.caught && x.depth < 2.0 * p.radius;
        let deep = 2.0 * p.radius - jaw.gap - x.depth;
        let force = if whole { p.stiffness * deep.max(0.0) } else { 0.0 };
        let place = u.a.position + jaw.along * jaw.lever;
        let on = |from: Vec3, force: Vec3| Wrench { moment: (place - from).cross(&force), force };
        let over = force - p.strength * self.left(x.depth);
        ShearingOut {
            on_a: on(u.a.position, -jaw.across * force),
            on_b: on(u.b.position, jaw.across * force),
            force,
            cut: (x.depth / (2.0 * p.radius)).min(1.0),
            opening: jaw.opening,
            feed: if whole && over > 0.0 { over / p.viscosity } else { 0.0 },
        }
    }
    fn derivatives(&self, y: &ShearingOut) -> Depth {
        Depth { depth: y.feed }
    }
    fn guards(&self, u: &ShearingIn) -> WireGaps {
        let gap = jaw(u).from[1] - self.p.radius;
        WireGaps { closes: gap, opens: gap }
    }
    fn handle_event(&self, fired: Fired<'_>, x: &Depth, u: &ShearingIn) -> (Depth, Caught) {
        let jaw = jaw(u);
        // An opening edge releases the wire or passes it outside. At the start the edges may already be in the wire.
        let closing = fired.fell(CLOSES);
        let R = self.p.radius;
        let inside = jaw.from[0] > -R && jaw.from[0] < R + self.p.sideways;
        let reached = jaw.lever > 0.0 && jaw.lever < self.p.blades;
        (*x, Caught { caught: closing && inside && reached })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn copper() -> Shearing {
        Shearing {
            p: ShearingParams {
                radius: 1.5e-3,
                strength: 150e6,
                blades: 0.03,
                sideways: 5e-3,
                stiffness: 1e7,
                viscosity: 1e3,
            },
        }
    }

    fn node(position: Vec3, rotation: Quat) -> NodeState {
        NodeState { position, rotation, angular: Vec3::zeros(), velocity: Vec3::zeros() }
    }

    /// A jaw somewhere, that opens by φ at `rate`, with the wire at (x, z) in it.
    fn at(opening: f64, x: f64, z: f64, rate: f64) -> ShearingIn {
        let R = Quat::from_euler_angles(0.3, -0.5, 1.1);
        let pin = Vec3::new(0.4, 0.2, 0.7);
        let mut b = node(pin, R * Quat::from_axis_angle(&Vec3::y_axis(), opening));
        b.angular = R * Vec3::y() * rate;
        let wire = node(pin + R * Vec3::new(x, 0.001, z), Quat::identity());
        ShearingIn { a: node(pin, R), b, wire }
    }

    /// Returns the inputs with the wire at the lever s, in the middle.
    fn jaw_at(opening: f64, s: f64) -> ShearingIn {
        let (sin, cos) = (0.5 * opening).sin_cos();
        at(opening, s * sin, s * cos, 0.0)
    }

    fn look(depth: f64, u: &ShearingIn) -> ShearingOut {
        let d = Caught { caught: true };
        copper().feedthrough(&Depth { depth }, &d, u)
    }

    /// The forces of the edges on each other through the wire add up to zero, and open the jaw at the lever of the wire.
    #[test]
    fn edges_are_pressed_apart_alike() {
        let opening = 2.0 * (1.4e-3_f64 / 0.02).atan();
        let u = jaw_at(opening, 0.02);
        let y = look(0.0, &u);
        assert!((y.force - 1e7 * 0.2e-3).abs() < 1e-6, "{}", y.force);
        assert!((y.opening - opening).abs() < 1e-12);
        assert!((y.on_a.force + y.on_b.force).norm() < 1e-9);
        assert!((y.on_a.moment + y.on_b.moment).norm() < 1e-9, "both about the pin");
        let pin = u.a.rotation * Vec3::y();
        assert!((y.on_b.moment.dot(&pin) - y.force * 0.02).abs() < 1e-9);
        assert_eq!(look(0.0, &jaw_at(0.5, 0.02)).force, 0.0, "wide open");
    }

    /// It takes the shear strength times the section; all work of cutting slowly is that of shearing: ∫ τ A dh = τ π R³.
    #[test]
    fn the_work_of_a_cut_is_that_of_its_section() {
        let m = copper();
        let (tau, R) = (m.p.strength, m.p.radius);
        assert!((m.left(0.0) - PI * R * R).abs() < 1e-15 && m.left(2.0 * R).abs() < 1e-15);
        assert!((m.left(R) - 0.5 * PI * R * R).abs() < 1e-15);
        // While the tool closes at 1 mm/s, its force is proportional to the remaining section.
        let (mut depth, mut work, mut most, mut t, h) = (0.0, 0.0, 0.0_f64, 0.0, 2e-5);
        while depth < 2.0 * R && t < 10.0 {
            t += h;
            let opening = 2.0 * ((R - 0.5e-3 * t) / 0.02).atan();
            let y = look(depth, &jaw_at(opening, 0.02));
            depth += h * y.feed;
            work += y.force * y.feed * h;
            most = most.max(y.force);
        }
        let whole = tau * PI * R.powi(3);
        println!("{work} of {whole} J, {most} N");
        assert!((work / whole - 1.0).abs() < 2e-2, "{work} {whole}");
        assert!((most / (tau * PI * R * R) - 1.0).abs() < 2e-2, "{most}");
        let y = look(2.0 * R, &jaw_at(0.0, 0.02));
        assert!(y.force == 0.0 && y.cut == 1.0, "it is two");
    }

    #[test]
    fn too_weak_a_hand_dents_and_does_not_cut() {
        let opening = 2.0 * (1.48e-3_f64 / 0.02).atan();
        let y = look(0.0, &jaw_at(opening, 0.02));
        assert!(y.force > 50.0 && y.force < 150e6 * PI * 1.5e-3 * 1.5e-3 && y.feed == 0.0);
    }

    /// Only a wire that is in the jaw when it closes is cut.
    #[test]
    fn only_what_is_between_the_edges_is_caught() {
        let m = copper();
        let (x, d) = (Depth { depth: 0.0 }, Caught { caught: false });
        // Edge b touches a wire at (x, z) at this opening.
        let touch = |x: f64, z: f64| x.atan2(z) + (1.5e-3 / x.hypot(z)).asin();
        let caught = |x0: f64, z: f64, rate: f64| {
            let u = at(touch(x0, z), x0, z, rate);
            assert!(m.guards(&u).closes.abs() < 1e-12);
            let way = |rate| if rate < 0.0 { Fired::falling(CLOSES) } else { Fired::rising(1) };
            m.handle_event(way(rate), &x, &u).1.caught
        };
        assert!(caught(0.0, 0.02, -1.0) && caught(4e-3, 0.02, -1.0));
        assert!(!caught(-2e-3, 0.02, -1.0), "behind edge a");
        assert!(!caught(7e-3, 0.02, -1.0), "it does not give way so far");
        assert!(!caught(0.0, 0.031, -1.0), "beyond the blades");
        assert!(!caught(4e-3, 0.02, 1.0), "opening lets it go");
        let y = m.feedthrough(&x, &d, &jaw_at(0.05, 0.02));
        assert!(y.force == 0.0 && y.feed == 0.0);
    }
}
