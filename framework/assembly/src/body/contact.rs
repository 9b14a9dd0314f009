//! `contact: (..)` as written.
use crate::schema::kind::{
    Kind, flag, list_of, mapped, number, raw, short, table_of, text, whole, word,
};
use crate::schema::record::{Presence, of, record};
use crate::text::value::Text;
use linkwork_collision::Neighbours;
use linkwork_runtime::Located;
use linkwork_solvers::contact::Method;
use linkwork_solvers::{CompliantSettings, ContactSettings};
use std::sync::LazyLock;

static USUAL: LazyLock<ContactSettings> = LazyLock::new(ContactSettings::default);

record! {
    /// Non-smooth contact: how it is solved and who meets whom.
    pub(crate) struct ContactForm: "contact" {
        /// Smooth forces instead of impulses: `true`, or their numbers.
        compliant: Option<CompliantSettings> = compliant().or(None),
        /// Path of the terrain that bodies meet; `"none"`: they meet none. Unwritten: the only one.
        terrain: Option<Text> = text().maybe(),
        /// Gaps that are looked at.
        margin: f64 = number("m").at_least(0.0).or(USUAL.margin),
        /// Penetration that is left alone.
        slop: f64 = number("m").at_least(0.0).or(USUAL.slop),
        /// Part of the rest of it that is worked off in a step.
        correction: f64 = number("").within(0.0, 1.0).or(USUAL.correction),
        /// At most so fast.
        push_max: f64 = number("m/s").at_least(0.0).or(USUAL.push_max),
        /// Slower impacts do not bounce.
        bounce_min: f64 = number("m/s").at_least(0.0).or(USUAL.bounce_min),
        /// Coefficient of friction of surfaces that say nothing.
        friction: f64 = number("").at_least(0.0).or(linkwork_collision::Material::default().friction),
        /// Coefficient of restitution of surfaces that say nothing.
        restitution: f64 = number("").within(0.0, 1.0).or(linkwork_collision::Material::default().restitution),
        /// Coefficient of rolling friction of surfaces that say nothing.
        rolling_friction: f64 = number("m").at_least(0.0).or(0.0),
        /// Coefficient of spinning friction of surfaces that say nothing.
        spinning_friction: f64 = number("m").at_least(0.0).or(0.0),
        /// Whether limits of hinges hold.
        limits: bool = flag().or(true),
        /// Dry friction of coordinates: `"hinge:arm": "2 N m"`.
        dry: Vec<(Text, Located)> = table_of(raw(|| crate::schema::kind::drive_number("N m", "N").describe())).or(Vec::new()),
        /// How the complementarity problem is solved.
        method: Method = word(&[
            ("Auto", Method::Auto),
            ("GaussSeidel", Method::GaussSeidel),
            ("Newton", Method::Newton),
            ("Lemke", Method::Lemke),
        ]).or(Method::default()),
        /// When it stops, as part of the largest velocity at a contact.
        tolerance: f64 = number("").within(1e-15, 1.0).or(USUAL.solver.tolerance),
        /// Sweeps of Gauss–Seidel at most.
        sweeps: u32 = whole(0, 1_000_000_000).or(USUAL.solver.sweeps),
        /// Steps of Newton at most.
        steps: u32 = whole(0, 1_000_000_000).or(USUAL.solver.steps),
        /// Over-relaxation of Gauss–Seidel.
        relaxation: f64 = number("").within(1e-3, 1.999).or(USUAL.solver.relaxation),
        /// Edges of the friction pyramid of Lemke.
        directions: u32 = whole(3, 1_000_000_000).or(USUAL.solver.directions as u32),
        /// Whether bodies joined by a hinge or loop meet.
        neighbours: Neighbours = word(&[("Pass", Neighbours::Pass), ("Collide", Neighbours::Collide)])
            .or(Neighbours::default()),
        /// Pairs of bodies or colliders that do not meet.
        ignore: Vec<Vec<Text>> = list_of(list_of(text())).or(Vec::new()),
        /// Neighbours that meet; `ignore` goes before.
        collide: Vec<Vec<Text>> = list_of(list_of(text())).or(Vec::new()),
        /// Pairs of bodies that report the force on the first from the second, or from `world`.
        pair_forces: Vec<Vec<Text>> = list_of(list_of(text())).or(Vec::new()),
        /// What pairs of materials do to each other; the first that fits counts.
        pairs: Vec<PairForm> = list_of(of::<PairForm>()).or(Vec::new()),
        /// Documentation.
        doc: Option<Text> = text().maybe(),
    }
}
record! {
    /// What two materials do to each other; what is not written is as for all pairs.
    #[derive(Clone, Debug, PartialEq)]
    pub(crate) struct PairForm: "pair" {
        /// One material, as `material` of colliders names it; that of the ground is `terrain`.
        a: Option<Text> = text().wanted("write the `material` of a collider, or `terrain`"),
        /// The other, or the same.
        b: Option<Text> = text().wanted("write the `material` of a collider, or `terrain`"),
        /// Coefficient of friction.
        friction: Option<f64> = number("").at_least(0.0).maybe(),
        /// Coefficient of restitution.
        restitution: Option<f64> = number("").within(0.0, 1.0).maybe(),
        /// Coefficient of rolling friction.
        rolling_friction: Option<f64> = number("m").at_least(0.0).maybe(),
        /// Coefficient of spinning friction.
        spinning_friction: Option<f64> = number("m").at_least(0.0).maybe(),
        /// Stiffness of compliant contact, N/m^exponent.
        stiffness: Option<f64> = number("").positive().maybe(),
        /// Exponent of its penetration.
        exponent: Option<f64> = number("").within(1.0, 10.0).maybe(),
        /// Its damping, as part of the stiffness.
        damping: Option<f64> = number("s/m").at_least(0.0).maybe(),
        /// Stiffness of its bristles.
        bristle_stiffness: Option<f64> = number("N/m").positive().maybe(),
        /// Their damping.
        bristle_damping: Option<f64> = number("N s/m").at_least(0.0).maybe(),
    }
}
record! {
    for CompliantSettings: "compliant contact" {
        /// Stiffness of the Hunt–Crossley normal force, N/m^exponent.
        stiffness: number("").positive().or(CompliantSettings::default().stiffness),
        /// Exponent of the penetration.
        exponent: number("").within(1.0, 10.0).or(CompliantSettings::default().exponent),
        /// Damping, as part of the stiffness.
        damping: number("s/m").at_least(0.0).or(CompliantSettings::default().damping),
        /// Stiffness of the bristles of a pair.
        bristle_stiffness: number("N/m").positive().or(CompliantSettings::default().bristle_stiffness),
        /// Damping of the bristles.
        bristle_damping: number("N s/m").at_least(0.0).or(CompliantSettings::default().bristle_damping),
        /// Time in which bristles of pairs that parted relax.
        relaxation: number("s").positive().or(CompliantSettings::default().relaxation),
        /// Radius of a contact point, for drilling friction.
        radius: number("m").at_least(0.0).or(CompliantSettings::default().radius),
    }
}

/// `true`, `false`, or the numbers.
fn compliant() -> impl Kind<Of = Option<CompliantSettings>> {
    short(
        mapped(flag(), |on| on.then(CompliantSettings::default), |_| None),
        mapped(of::<CompliantSettings>(), Some, Clone::clone),
    )
}

impl PairForm {
    /// Names of what is written of compliant contact.
    pub fn compliant(&self) -> Vec<&'static str> {
        let all = [
            ("stiffness", self.stiffness),
            ("exponent", self.exponent),
            ("damping", self.damping),
            ("bristle_stiffness", self.bristle_stiffness),
            ("bristle_damping", self.bristle_damping),
        ];
        all.into_iter().filter_map(|(name, x)| x.map(|_| name)).collect()
    }

    /// The constants of compliant contact, with those of all pairs where nothing is written.
    pub fn over(&self, usual: CompliantSettings) -> CompliantSettings {
        CompliantSettings {
            stiffness: self.stiffness.unwrap_or(usual.stiffness),
            exponent: self.exponent.unwrap_or(usual.exponent),
            damping: self.damping.unwrap_or(usual.damping),
            bristle_stiffness: self.bristle_stiffness.unwrap_or(usual.bristle_stiffness),
            bristle_damping: self.bristle_damping.unwrap_or(usual.bristle_damping),
            ..usual
        }
    }
}

impl ContactForm {
    /// What the stepper is told.
    pub fn settings(&self) -> ContactSettings {
        let mut out = USUAL.clone();
        (out.margin, out.slop, out.correction) = (self.margin, self.slop, self.correction);
        (out.push_max, out.bounce_min) = (self.push_max, self.bounce_min);
        if !self.limits {
            out.limits = linkwork_solvers::JointLimits::Ignore;
        }
        let solver = &mut out.solver;
        (solver.method, solver.tolerance, solver.relaxation) =
            (self.method, self.tolerance, self.relaxation);
        (solver.sweeps, solver.steps, solver.directions) =
            (self.sweeps, self.steps, self.directions as usize);
        out
    }
}
