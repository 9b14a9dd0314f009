//! Closed forms for a lander: whether it tips over its leading feet, and the stroke of its honeycomb.
//! ```text
//! plastic impact at the edge of the feet, R ahead of and h below the centre of mass:
//!     ω = m (v_h h − v_v R)/(I + m (h² + R²))
//!     tips when ½ (I + m (h² + R²)) ω² > m g (√(h² + R²) − h)      R: to the edge of the polygon of the feet
//! on a slope: tips at rest where tan(slope) > R/h
//! honeycomb of constant force F, n legs at once: stroke = ½ m v²/(n F − m g), deceleration n F/m − g
//! ```

/// A lander on flat ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lander {
    /// Mass, kg.
    pub mass: f64,
    /// Inertia about the centre of mass, across the motion, kg m².
    pub inertia: f64,
    /// Height h of the centre of mass above the feet, m.
    pub height: f64,
    /// Horizontal distance R from the centre of mass to the line through the leading feet, m.
    pub radius: f64,
}

impl Lander {
    /// Inertia about the edge.
    fn about_edge(&self) -> f64 {
        self.inertia + self.mass * (self.height.powi(2) + self.radius.powi(2))
    }

    /// Energy (J) that the lander lacks to tip over after an impact with a horizontal and a vertical speed (m/s), under gravity (m/s²); negative: it
    /// tips over.
    pub fn margin(&self, along: f64, down: f64, gravity: f64) -> f64 {
        let turn = self.mass * (along * self.height - down * self.radius) / self.about_edge();
        let spent = if turn > 0.0 { 0.5 * self.about_edge() * turn * turn } else { 0.0 };
        let reach = self.height.hypot(self.radius);
        self.mass * gravity * (reach - self.height) - spent
    }

    /// Horizontal speed (m/s) at which it just tips over, for a vertical speed.
    pub fn tipping_speed(&self, down: f64, gravity: f64) -> f64 {
        let reach = self.height.hypot(self.radius);
        let turn = (2.0 * self.mass * gravity * (reach - self.height) / self.about_edge()).sqrt();
        (turn * self.about_edge() / self.mass + down * self.radius) / self.height
    }

    /// Slope (rad) on which it tips over from rest.
    pub fn tipping_slope(&self) -> f64 {
        self.radius.atan2(self.height)
    }
}

/// Stroke (m) and deceleration (m/s²) of legs of constant force that all touch down at the same time; `None`: they never stop the lander.
pub fn crush(mass: f64, speed: f64, gravity: f64, legs: f64, force: f64) -> Option<(f64, f64)> {
    let net = legs * force - mass * gravity;
    (net > 0.0).then(|| (0.5 * mass * speed * speed / net, net / mass))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lander_tips_at_the_golden_speed_and_slope() {
        let l = Lander { mass: 600.0, inertia: 500.0, height: 1.1, radius: 1.6 };
        let v = l.tipping_speed(0.0, 3.71);
        assert!((v - 4.874285120020599).abs() < 1e-13, "{v}");
        assert!((l.tipping_slope().to_degrees() - 55.4914770123316).abs() < 1e-12);
        assert!(l.margin(v - 1e-6, 0.0, 3.71) > 0.0 && l.margin(v + 1e-6, 0.0, 3.71) < 0.0);
        // Vertical speed presses the trailing feet onto the ground, so the lander tips less easily.
        assert!(l.tipping_speed(1.0, 3.71) > v);
        assert!(l.margin(0.5, 3.0, 3.71) == l.margin(0.0, 0.0, 3.71));
    }

    #[test]
    fn honeycomb_takes_the_energy() {
        let (stroke, a) = crush(600.0, 2.4, 3.71, 3.0, 4500.0).unwrap();
        assert!((stroke - 0.15327301756253325).abs() < 1e-15 && (a - 18.79).abs() < 1e-12);
        assert!((2.4 / a - 0.12772751463544438).abs() < 1e-15);
        assert_eq!(crush(600.0, 2.4, 3.71, 1.0, 2000.0), None);
    }
}
