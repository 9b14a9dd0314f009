//! Groups of wheels with equal contact parameters: each group has its own parameter of the created assembly.
use super::find::{DetectedVehicle, FoundWheel};
use super::n;
use std::fmt::Write;

/// Radii that differ by less than this fraction are equal, because radii of meshes are measured.
const SAME_RADIUS: f64 = 0.01;
/// The same for widths.
const SAME_WIDTH: f64 = 0.1;

/// Wheels of one size, which all roll or all slide.
struct Group {
    size: [f64; 2],
    slides: Option<f64>,
    bodies: Vec<String>,
}

/// The groups of a vehicle; the first driven wheel is in the first group.
pub(super) struct Sizes(Vec<Group>);

fn close(a: f64, b: f64, within: f64) -> bool {
    (a - b).abs() <= within * a.max(b)
}

impl Group {
    fn fits(&self, w: &FoundWheel) -> bool {
        self.slides == w.slides
            && close(self.size[0], w.size[0], SAME_RADIUS)
            && close(self.size[1], w.size[1], SAME_WIDTH)
    }
}

impl Sizes {
    /// Groups the wheels of a vehicle.
    pub(super) fn of(found: &DetectedVehicle) -> Sizes {
        let mut groups: Vec<Group> = Vec::new();
        let driven = found.wheels.iter().filter(|w| w.driven);
        for w in driven.chain(found.wheels.iter().filter(|w| !w.driven)) {
            let body = w.body.clone();
            match groups.iter_mut().find(|g| g.fits(w)) {
                Some(group) => group.bodies.push(body),
                None => groups.push(Group { size: w.size, slides: w.slides, bodies: vec![body] }),
            }
        }
        Sizes(groups)
    }

    fn index(&self, w: &FoundWheel) -> usize {
        self.0.iter().position(|g| g.fits(w)).unwrap_or(0)
    }

    /// Returns the radius of a wheel's group, m.
    pub(super) fn radius(&self, w: &FoundWheel) -> f64 {
        self.0[self.index(w)].size[0]
    }

    /// Returns the options with which all wheels drive on soil.
    pub(super) fn on_soil(&self) -> String {
        let mut out = String::from("--set Rover.contact=mobility.wheel_soil");
        for (k, g) in self.0.iter().enumerate() {
            let number = if k == 0 { String::new() } else { format!("_{}", k + 1) };
            let [radius, width] = g.size.map(n);
            let _ = write!(
                out,
                " --set 'Rover.contact_params{number}={{ \"radius\": {radius}, \"width\": {width} }}'"
            );
        }
        out
    }

    /// Returns the parameter of an array element that selects its contact parameters; the first group is the default.
    pub(super) fn parameter(&self, w: &FoundWheel) -> String {
        match self.index(w) {
            0 => String::new(),
            k => format!(", \"contact_params\": \"$contact_params_{}\"", k + 1),
        }
    }

    /// Returns the parameters of the created assembly for all groups but the first. `common` holds the stiffness and damping of the contact.
    pub(super) fn parameters(&self, common: &str) -> String {
        let mut out = String::new();
        for (k, g) in self.0.iter().enumerate().skip(1) {
            let [radius, width] = g.size.map(n);
            let friction = n(g.slides.unwrap_or(super::RUBBER));
            let bodies: Vec<String> = g.bodies.iter().map(|b| format!("`{b}`")).collect();
            let what = match g.slides {
                Some(_) => ", which slides over the ground",
                None => "",
            };
            let _ = write!(
                out,
                "\n        \"contact_params_{}\": (default: {{ \"radius\": {radius}, \"width\": {width}, {common}, \"friction\": {friction} }}, doc: \"Parameters of the contact of {}{what}.\"),",
                k + 1,
                bodies.join(", ")
            );
        }
        out
    }

    /// Returns `wheels` and `radius` of `place`.
    pub(super) fn placed(&self, found: &DetectedVehicle) -> [String; 2] {
        let radius = n(self.0[0].size[0]);
        let names = |driven: bool, part: &str| {
            let of = found.wheels.iter().filter(|w| w.driven == driven).enumerate();
            let one = |(k, w): (usize, &FoundWheel)| {
                (format!("\"Rover.{part}{}/hub\"", k + 1), n(self.radius(w)))
            };
            of.map(one).collect::<Vec<_>>()
        };
        let all = [names(true, "Wheel"), names(false, "Idle")].concat();
        if all.iter().all(|(_, r)| *r == radius) {
            let idle = found.wheels.iter().any(|w| !w.driven);
            let idle = if idle { ", \"Rover.Idle*/hub\"" } else { "" };
            return [format!("\"Rover.Wheel*/hub\"{idle}"), radius];
        }
        let (names, radii): (Vec<String>, Vec<String>) = all.into_iter().unzip();
        [names.join(", "), format!("[{}]", radii.join(", "))]
    }
}
