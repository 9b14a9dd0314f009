//! `contact: (..)` as written in a file.
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
    /// Non-smooth contact: settings of the solver, and collision rules.
    pub(crate) struct ContactForm: "contact" {
        /// Compliant contact instead of impulses: `true`, or its parameters.
        compliant: Option<CompliantSettings> = compliant().or(None),
        /// Greatest number of pairs of colliders that touch at the same time, for compliant contact (default: six for each collider, and at least 256).
        touching_max: Option<u32> = whole::<u32>(1, 100_000_000).maybe(),
        /// Path of the terrain with which bodies collide; `"none"`: no terrain (default: the only terrain of the simulation).
        terrain: Option<Text> = text().maybe(),
        /// Largest gap that is included in the contact problem.
        margin: f64 = number("m").at_least(0.0).or(USUAL.margin),
        /// Penetration that is not corrected.
        slop: f64 = number("m").at_least(0.0).or(USUAL.slop),
        /// Fraction of the remaining penetration that one step corrects.
        correction: f64 = number("").within(0.0, 1.0).or(USUAL.correction),
        /// Largest velocity of that correction.
        push_max: f64 = number("m/s").at_least(0.0).or(USUAL.push_max),
        /// Impact velocity below which there is no restitution.
        bounce_min: f64 = number("m/s").at_least(0.0).or(USUAL.bounce_min),
        /// Default friction coefficient of surfaces.
        friction: f64 = number("").at_least(0.0).or(linkwork_collision::Material::default().friction),
        /// Default coefficient of restitution of surfaces.
        restitution: f64 = number("").within(0.0, 1.0).or(linkwork_collision::Material::default().restitution),
        /// Default coefficient of rolling friction of surfaces.
        rolling_friction: f64 = number("m").at_least(0.0).or(0.0),
        /// Default coefficient of spinning friction of surfaces.
        spinning_friction: f64 = number("m").at_least(0.0).or(0.0),
        /// Whether limits of hinges are enforced.
        limits: bool = flag().or(true),
        /// Dry friction of coordinates: `"hinge:arm": "2 N m"`.
        dry: Vec<(Text, Located)> = table_of(raw(|| crate::schema::kind::drive_number("N m", "N").describe())).or(Vec::new()),
        /// Method for the complementarity problem.
        method: Method = word(&[
            ("Auto", Method::Auto),
            ("GaussSeidel", Method::GaussSeidel),
            ("Newton", Method::Newton),
            ("Lemke", Method::Lemke),
        ]).or(Method::default()),
        /// Tolerance of the solver, relative to the largest velocity at a contact.
        tolerance: f64 = number("").within(1e-15, 1.0).or(USUAL.solver.tolerance),
        /// Largest number of Gauss–Seidel sweeps.
        sweeps: u32 = whole(0, 1_000_000_000).or(USUAL.solver.sweeps),
        /// Largest number of Newton steps.
        steps: u32 = whole(0, 1_000_000_000).or(USUAL.solver.steps),
        /// Over-relaxation of Gauss–Seidel.
        relaxation: f64 = number("").within(1e-3, 1.999).or(USUAL.solver.relaxation),
        /// Number of edges of the friction pyramid for Lemke's method.
        directions: u32 = whole(3, 1_000_000_000).or(USUAL.solver.directions as u32),
        /// Whether bodies that a hinge or loop connects collide.
        neighbours: Neighbours = word(&[("Pass", Neighbours::Pass), ("Collide", Neighbours::Collide)])
            .or(Neighbours::default()),
        /// Pairs of bodies or colliders that do not collide.
        ignore: Vec<Vec<Text>> = list_of(list_of(text())).or(Vec::new()),
        /// Connected pairs that collide; `ignore` has priority.
        collide: Vec<Vec<Text>> = list_of(list_of(text())).or(Vec::new()),
        /// Pairs of bodies that report the force on the first from the second, or from `world`.
        pair_forces: Vec<Vec<Text>> = list_of(list_of(text())).or(Vec::new()),
        /// Contact properties of pairs of materials; the first match counts.
        pairs: Vec<PairForm> = list_of(of::<PairForm>()).or(Vec::new()),
        /// Documentation.
        doc: Option<Text> = text().maybe(),
    }
}
record! {
    /// Contact properties of two materials; omitted properties are those of all pairs.
    #[derive(Clone, Debug, PartialEq)]
    pub(crate) struct PairForm: "pair" {
        /// One material, the `material` of a collider; that of the ground is `terrain`.
        a: Option<Text> = text().wanted("write the `material` of a collider, or `terrain`"),
        /// The other material, which may be the same.
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
        /// Its damping, as a fraction of the stiffness.
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
        /// Damping, as a fraction of the stiffness.
        damping: number("s/m").at_least(0.0).or(CompliantSettings::default().damping),
        /// Stiffness of the bristles of a pair.
        bristle_stiffness: number("N/m").positive().or(CompliantSettings::default().bristle_stiffness),
        /// Damping of the bristles.
        bristle_damping: number("N s/m").at_least(0.0).or(CompliantSettings::default().bristle_damping),
        /// Relaxation time of the bristles of pairs that have separated.
        relaxation: number("s").positive().or(CompliantSettings::default().relaxation),
        /// Radius of the contact patch, for spinning friction.
        radius: number("m").at_least(0.0).or(CompliantSettings::default().radius),
    }
}

/// Reads `true`, `false`, or the parameters.
fn compliant() -> impl Kind<Of = Option<CompliantSettings>> {
    short(
        mapped(flag(), |on| on.then(CompliantSettings::default), |_| None),
        mapped(of::<CompliantSettings>(), Some, Clone::clone),
    )
}

impl PairForm {
    /// Returns the names of the given parameters of compliant contact.
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

    /// Returns the parameters of compliant contact, with those of all pairs as defaults.
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
    /// Returns the settings of the stepper.
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
