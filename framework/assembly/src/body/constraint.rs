//! Loops and couplings as written in a file.
//!
//! ```text
//! loop       frame of B in frame of A moves as its hinge permits;   frame = node · at
//! coupling   Σ factor · coordinate + Σ powers = constant;             mimic: a − ratio · of = offset
//! ```
use crate::body::hinge::hinge;
use crate::body::initial;
use crate::schema::describe::Schema;
use crate::schema::kind::{
    At, Kind, drive_number, flag, list_of, number, numbers, raw, table_of, text, word,
};
use crate::schema::record::{Presence, of, record};
use crate::text::report::Cx;
use crate::text::value::{Text, variant};
use linkwork_multibody::Hinge;
use linkwork_plant::Closing;
use linkwork_runtime::{Located, Value};
use linkwork_solvers::ConstraintMethod;
use linkwork_spatial::Pose;

record! {
    /// A hinge that closes a loop.
    pub(crate) struct LoopForm: "loop" {
        /// Body, node or `world` on one side.
        a: Option<Text> = text().wanted("write `a: \"a body or node\"`, or \"world\""),
        /// Body, node or `world` on the other side.
        b: Option<Text> = text().wanted("write `b: \"a body or node\"`, or \"world\""),
        /// The hinge's frame on the first side.
        at_a: Pose = of::<Pose>().or(Pose::identity()),
        /// The hinge's frame on the other side.
        at_b: Pose = of::<Pose>().or(Pose::identity()),
        /// The permitted motion; without a hinge, the frames are welded.
        hinge: Hinge = hinge().or(Hinge::locked()),
        /// The coordinates of the subhinge are prescribed.
        prescribed: bool = flag().or(false),
        /// The constraint method.
        solve: ConstraintMethod = constraint_method().or(ConstraintMethod::Auto),
        /// Handling of a gap at the start: `AtOnce` closes it at once, `AsFound` keeps it, `Over(time)` closes it over a time.
        closing: Option<Closing> = ClosingKind.or(None),
        /// Initial values of the prescribed coordinates.
        initial: Option<Located> = raw(initial::schema).maybe(),
        /// Documentation.
        doc: Option<Text> = text().maybe(),
    }
}
record! {
    /// A relation between hinge coordinates.
    pub(crate) struct CouplingForm: "coupling" {
        /// Coordinate → factor, or a list that keeps its order.
        terms: Option<Terms> = TermsKind.maybe(),
        /// Value of the sum of factor · coordinate.
        constant: Option<Located> = raw(|| drive_number("rad", "m").describe()).maybe(),
        /// Coordinate → factors of its square, cube and fourth power, which are added to the sum.
        powers: Vec<(Text, [f64; 3])> = table_of(numbers::<3>("")).or(Vec::new()),
        /// Short form: the coordinate that follows another.
        mimic: Option<Text> = text().maybe(),
        /// The coordinate that it follows.
        of: Option<Text> = text().maybe(),
        /// Ratio of the two coordinates.
        ratio: Option<f64> = number("").maybe(),
        /// Its value when the other is zero.
        offset: Option<Located> = raw(|| drive_number("rad", "m").describe()).maybe(),
        /// The constraint method.
        solve: ConstraintMethod = constraint_method().or(ConstraintMethod::Auto),
        /// Documentation.
        doc: Option<Text> = text().maybe(),
    }
}
record! {
    struct Term: "term" {
        /// Coordinate.
        of: Text = text().need("write (of: \"a body\", factor: 1)"),
        /// Factor.
        factor: f64 = number("").or(1.0),
    }
}

fn constraint_method() -> impl Kind<Of = ConstraintMethod> {
    word(&[
        ("Auto", ConstraintMethod::Auto),
        ("Embed", ConstraintMethod::Embed),
        ("Augment", ConstraintMethod::Augment),
    ])
}

/// `AtOnce`, which is `None`; `AsFound`; `Over("0.3 s")`.
struct ClosingKind;

impl Kind for ClosingKind {
    type Of = Option<Closing>;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Option<Closing>> {
        match &v.value {
            Value::Variant(name, time) if name == "Over" && time.value != Value::Null => {
                let time = number("s").positive().read(cx, time, at)?;
                return Some(Some(Closing::Over(time)));
            }
            Value::Variant(name, _) | Value::Text(name) if name == "Over" => {
                let message = format!("{}: `Over` lacks a time", at.what);
                cx.fault(v.origin, message, "write e.g. Over(\"0.3 s\")");
                return None;
            }
            Value::Variant(name, extra) if extra.value != Value::Null => {
                let message = format!("{}: `{name}` does not have arguments", at.what);
                cx.fault(extra.origin, message, "write AtOnce, AsFound or Over(\"0.3 s\")");
                return None;
            }
            _ => {}
        }
        plain_closing().read(cx, v, at)
    }
    fn write(&self, x: &Option<Closing>) -> Value {
        match x {
            Some(Closing::Over(time)) => variant("Over", Value::Number(*time)),
            plain => plain_closing().write(plain),
        }
    }
    fn describe(&self) -> Schema {
        let over = Schema::Variant("Over", Box::new(number("s").positive().describe()));
        Schema::Any(vec![plain_closing().describe(), over])
    }
}

fn plain_closing() -> impl Kind<Of = Option<Closing>> {
    word(&[("AtOnce", None), ("AsFound", Some(Closing::AsFound))])
}

/// Coordinates with their factors.
pub(crate) enum Terms {
    /// A map, whose order is not relevant.
    Map(Vec<(Text, f64)>),
    /// A list, whose order is kept.
    List(Vec<(Text, f64)>),
}

struct TermsKind;

impl Kind for TermsKind {
    type Of = Terms;
    fn read(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<Terms> {
        if matches!(v.value, Value::List(_)) {
            let terms = list_of(of::<Term>()).read(cx, v, at)?;
            return Some(Terms::List(terms.into_iter().map(|t| (t.of, t.factor)).collect()));
        }
        table_of(number("")).read(cx, v, at).map(Terms::Map)
    }
    fn write(&self, x: &Terms) -> Value {
        match x {
            Terms::Map(terms) => table_of(number("")).write(terms),
            Terms::List(terms) => {
                let term = |(of, factor): &(Text, f64)| {
                    let mut fields = vec![("of".to_string(), text().write(of).into())];
                    fields.push(("factor".to_string(), Value::Number(*factor).into()));
                    Value::Map(fields).into()
                };
                Value::List(terms.iter().map(term).collect())
            }
        }
    }
    fn describe(&self) -> Schema {
        Schema::Any(vec![table_of(number("")).describe(), list_of(of::<Term>()).describe()])
    }
}

impl CouplingForm {
    /// Returns coordinates and factors, and whether their order is kept; adds faults if they are missing or written twice.
    pub fn terms(&self, cx: &mut Cx, v: &Located, at: &At<'_>) -> Option<(Vec<(Text, f64)>, bool)> {
        let origin = at.origin.unwrap_or(v.origin);
        let short = ["mimic", "of", "ratio", "offset"].into_iter().find(|f| v.get(f).is_some());
        if let Some(odd) = short {
            let other = ["terms", "constant", "powers"].into_iter().find(|f| v.get(f).is_some());
            if let Some(other) = other {
                let message = format!("{} has both `{other}` and `{odd}`", at.what);
                let help = "write (terms: {..}, constant: ..) or (mimic: .., of: ..)";
                cx.fault(origin, message, help);
                return None;
            }
            for field in ["mimic", "of"].into_iter().filter(|f| v.get(f).is_none()) {
                let help =
                    "write (mimic: \"a\", of: \"b\", ratio: 1, offset: 0): a = ratio · b + offset";
                cx.fault(origin, format!("{} lacks `{field}`", at.what), help);
            }
            let (a, b) = (self.mimic.clone()?, self.of.clone()?);
            return Some((vec![(a, 1.0), (b, -self.ratio.unwrap_or(1.0))], true));
        }
        match &self.terms {
            Some(Terms::List(terms)) => Some((terms.clone(), true)),
            Some(Terms::Map(terms)) if !terms.is_empty() => Some((terms.clone(), false)),
            None if v.get("terms").is_some_and(|t| t.value != Value::Null) => None,
            _ => {
                let help = "write `terms: { \"left\": 1, \"right\": 1 }`: Σ factor · coordinate = constant";
                cx.fault(origin, format!("{} lacks `terms`", at.what), help);
                None
            }
        }
    }

    /// Returns the constant, in the unit of the sum if all terms have the same unit; `slides` marks terms that are lengths.
    pub fn constant(&self, cx: &mut Cx, slides: &[bool], at: &At<'_>) -> Option<f64> {
        if let Some(offset) = &self.offset {
            let slides = slides.first() == Some(&true);
            let at = at.field("offset").sliding(slides);
            return drive_number("rad", "m").read(cx, offset, &at);
        }
        let Some(constant) = &self.constant else { return Some(0.0) };
        let at = at.field("constant");
        match (slides.iter().all(|s| *s), slides.iter().any(|s| *s)) {
            (true, true) => number("m").read(cx, constant, &at),
            (_, false) => number("rad").read(cx, constant, &at),
            _ => number("").read(cx, constant, &at),
        }
    }
}
