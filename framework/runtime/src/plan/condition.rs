//! Conditions over variables: `"Capsule.Aero.mach < 1.8 and time > 10 s"`, compiled to lanes once.
//!
//! ```text
//! any    = all { "or" all }                    the largest
//! all    = test { "and" test }                 the least
//! test   = sum ("<" | "<=" | ">" | ">=") sum   how far it holds: right − left, or left − right
//!        | sum                                 a truth value: holds above ½
//!        | "not" test
//!        | "(" any ")"
//! sum    = product { ("+" | "-") product }
//! product = factor { ("*" | "/") factor }
//! factor = "-" factor | number [unit] | "time" | "phase_time" | path | "abs(" sum ")" | "(" sum ")"
//! ```
//! A condition has a value and is true where the value is not negative; it therefore becomes true at the instant at which a continuous value reaches
//! zero. `<=` and `>=` are true if both sides are equal. `<` and `>` are then false: their value is the negative number next to zero. Both sides of a
//! test have the same quantity. A unit may have blanks: `10 N m`. `time` is the simulated time, `phase_time` the time since the present phase began.
use crate::author::units::Unit;
use crate::author::value::remedy;
use crate::author::variable::{Place, Variable};
use std::collections::BTreeMap;

/// A compiled condition.
#[derive(Clone, Debug, PartialEq)]
pub struct Condition {
    /// Text that the user wrote.
    pub text: String,
    /// Instructions in postfix order.
    code: Vec<Code>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Code {
    Number(f64),
    Time,
    PhaseTime,
    Value(Place),
    Negate,
    Abs,
    /// Replaces zero by the negative number next to it, so that a strict test is false there.
    Strict,
    Add,
    Subtract,
    Multiply,
    Divide,
    Least,
    Largest,
}

/// The times that a condition may test (s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Times {
    /// Simulated time.
    pub time: f64,
    /// Time since the present phase began.
    pub phase: f64,
}

/// Index for a variable that a phase does not have.
const ABSENT: Place = Place::Channel(u32::MAX);

/// Deepest stack of an evaluation; deeper conditions are rejected.
const DEPTH: usize = 16;
/// Maximum number of nested brackets, signs and `not`.
const NESTED: usize = 64;

/// Reason for which a condition was rejected.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("condition `{text}`: {message}")]
pub struct ConditionError {
    /// The condition.
    pub text: String,
    /// The fact.
    pub message: String,
    /// The remedy.
    pub help: String,
}

impl Condition {
    /// Reads a condition over these variables.
    ///
    /// # Errors
    /// The text has a syntax error (the first is returned), an unknown variable, or two sides of different quantities.
    pub fn parse(
        text: &str,
        variables: &BTreeMap<String, Variable>,
    ) -> Result<Condition, ConditionError> {
        Self::read(text, variables, false)
    }

    /// Reads a condition for a phase that may not have all of its variables: what tests a variable that is absent does not hold.
    ///
    /// # Errors
    /// The errors of [`Condition::parse`] except unknown variables.
    pub fn parse_partly(
        text: &str,
        variables: &BTreeMap<String, Variable>,
    ) -> Result<Condition, ConditionError> {
        Self::read(text, variables, true)
    }

    fn read(
        text: &str,
        variables: &BTreeMap<String, Variable>,
        partly: bool,
    ) -> Result<Condition, ConditionError> {
        let (code, depth, nested) = (Vec::new(), (0, 0), 0);
        let mut reader = Reader { text, rest: text, variables, partly, code, depth, nested };
        let result = reader.any().and_then(|()| {
            reader.space();
            match reader.rest {
                "" => Ok(()),
                rest => Err((
                    format!("`{rest}` is left over"),
                    "write tests such as `Body.angle < 10 deg`, joined by `and` or `or`".into(),
                )),
            }
        });
        let refuse = |message, help| ConditionError { text: text.to_string(), message, help };
        result.map_err(|(message, help)| refuse(message, help))?;
        if reader.depth.1 > DEPTH {
            let message = format!("it is nested more than {DEPTH} deep");
            return Err(refuse(message, "move a part of it into a model with a guard".into()));
        }
        Ok(Condition { text: text.to_string(), code: reader.code })
    }

    /// Returns a value that is not negative if the condition is true, and NaN if a decisive variable is absent or NaN.
    #[inline]
    pub fn value(&self, t: Times, x: &[f64], d: &[f64], sig: &[f64]) -> f64 {
        self.margin(t, |place| match place {
            Place::X(k) => x[k as usize],
            Place::D(k) => d[k as usize],
            Place::Signal(k) => sig[k as usize],
            // Conditions of phases are read over the lanes of the phase's plan.
            Place::Channel(_) | Place::Phase(_) => f64::NAN,
        })
    }

    /// Returns whether the condition is true for the given value of each place. It is false if a decisive variable is NaN.
    #[inline]
    pub fn holds(&self, t: Times, value: impl Fn(Place) -> f64) -> bool {
        self.margin(t, value) >= 0.0
    }

    /// Returns a number that is not negative where it holds, with the value of each place; NaN where a variable that decides is NaN.
    #[inline]
    pub fn margin(&self, t: Times, value: impl Fn(Place) -> f64) -> f64 {
        let mut stack = [0.0_f64; DEPTH];
        let mut n = 0;
        for code in &self.code {
            let push = match *code {
                Code::Number(v) => v,
                Code::Time => t.time,
                Code::PhaseTime => t.phase,
                Code::Value(place) => value(place),
                Code::Negate | Code::Abs | Code::Strict => {
                    n -= 1;
                    match code {
                        Code::Abs => stack[n].abs(),
                        Code::Strict if stack[n] == 0.0 => -f64::MIN_POSITIVE,
                        Code::Strict => stack[n],
                        _ => -stack[n],
                    }
                }
                _ => {
                    n -= 2;
                    let (a, b) = (stack[n], stack[n + 1]);
                    match code {
                        Code::Add => a + b,
                        Code::Subtract => a - b,
                        Code::Multiply => a * b,
                        Code::Divide => a / b,
                        // If an operand of `and` is unknown, the condition does not hold; `min` would return
                        // the other operand.
                        Code::Least if a.is_nan() => a,
                        Code::Least if b.is_nan() => b,
                        Code::Least => a.min(b),
                        _ => a.max(b),
                    }
                }
            };
            stack[n] = push;
            n += 1;
        }
        stack[0]
    }

    /// Returns the lanes that the condition reads.
    pub fn places(&self) -> impl Iterator<Item = Place> + '_ {
        self.code.iter().filter_map(|c| match c {
            Code::Value(place) => Some(*place),
            _ => None,
        })
    }

    /// Returns whether it tests the time since the phase began.
    pub fn tests_phase_time(&self) -> bool {
        self.code.contains(&Code::PhaseTime)
    }

    /// Returns whether it tests the time.
    pub fn timed(&self) -> bool {
        self.code.iter().any(|c| matches!(c, Code::Time | Code::PhaseTime))
    }
}

type Refusal = (String, String);

struct Reader<'a> {
    text: &'a str,
    rest: &'a str,
    variables: &'a BTreeMap<String, Variable>,
    /// Accepts unknown variables as absent.
    partly: bool,
    code: Vec<Code>,
    /// Numbers on the stack: present and maximum.
    depth: (usize, usize),
    /// Brackets, signs and `not` that are open.
    nested: usize,
}

impl<'a> Reader<'a> {
    fn space(&mut self) {
        self.rest = self.rest.trim_start();
    }

    fn take(&mut self, token: &str) -> bool {
        self.space();
        match self.rest.strip_prefix(token) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    /// `and`, `or`: a whole word.
    fn word(&mut self, word: &str) -> bool {
        self.space();
        let Some(rest) = self.rest.strip_prefix(word) else { return false };
        if rest.starts_with(|c: char| c.is_alphanumeric() || "_.".contains(c)) {
            return false;
        }
        self.rest = rest;
        true
    }

    fn emit(&mut self, code: Code) {
        let change = match code {
            Code::Number(_) | Code::Time | Code::PhaseTime | Code::Value(_) => 1,
            Code::Negate | Code::Abs | Code::Strict => 0,
            _ => -1,
        };
        self.depth.0 = self.depth.0.saturating_add_signed(change);
        self.depth.1 = self.depth.1.max(self.depth.0);
        self.code.push(code);
    }

    /// Reads what is one level deeper.
    fn deeper<T>(&mut self, read: fn(&mut Self) -> Result<T, Refusal>) -> Result<T, Refusal> {
        self.nested += 1;
        let done = match self.nested > NESTED {
            true => Err((
                format!("more than {NESTED} brackets, signs and `not` are within each other"),
                "remove redundant ones, or move a part of the condition into a model with a guard"
                    .into(),
            )),
            false => read(self),
        };
        self.nested -= 1;
        done
    }

    fn any(&mut self) -> Result<(), Refusal> {
        self.all()?;
        while self.word("or") {
            self.all()?;
            self.emit(Code::Largest);
        }
        Ok(())
    }

    fn all(&mut self) -> Result<(), Refusal> {
        self.test()?;
        while self.word("and") {
            self.test()?;
            self.emit(Code::Least);
        }
        Ok(())
    }

    fn test(&mut self) -> Result<(), Refusal> {
        if self.word("not") {
            self.deeper(Self::test)?;
            self.emit(Code::Negate);
            self.emit(Code::Strict);
            return Ok(());
        }
        // `(a < b or c < d)` and `(a + b) * 2 < c` begin alike: try the first form, and backtrack for
        // the second.
        let (rest, length, depth) = (self.rest, self.code.len(), self.depth);
        if self.take("(") && self.deeper(Self::any).is_ok() && self.take(")") {
            let rest = self.rest.trim_start();
            if !rest.starts_with(|c: char| "<>+-*/".contains(c)) {
                return Ok(());
            }
        }
        (self.rest, self.depth) = (rest, depth);
        self.code.truncate(length);
        let left = self.sum()?;
        let tests = ["<=", ">=", "<", ">"];
        let Some(test) = tests.into_iter().find(|t| self.take(t)) else {
            if self.take("=") || self.take("!=") {
                return Err((
                    "`=` and `!=` are not supported in conditions".into(),
                    "write `<=` and `>=`, joined by `and`, because a continuous value is equal to a number only for an instant".into(),
                ));
            }
            // A truth value alone is a complete test.
            let truth = left == Unit::ANY || left == Unit::ONE;
            let ends = self.rest.is_empty() || self.rest.starts_with([')', 'a', 'o']);
            if !(truth && ends && self.code[length..].iter().any(|c| matches!(c, Code::Value(_)))) {
                return Err((
                    format!("a test is missing before `{}`", self.rest),
                    "write e.g. `… < 3 m/s`".into(),
                ));
            }
            self.emit(Code::Number(0.5));
            self.emit(Code::Subtract);
            self.emit(Code::Strict);
            return Ok(());
        };
        let right = self.sum()?;
        self.same(&left, &right, test)?;
        self.emit(Code::Subtract);
        if test.starts_with('<') {
            self.emit(Code::Negate);
        }
        if test.len() == 1 {
            self.emit(Code::Strict);
        }
        Ok(())
    }

    fn same(&self, a: &Unit, b: &Unit, what: &str) -> Result<(), Refusal> {
        if a.same_quantity(b) {
            return Ok(());
        }
        Err((
            format!("the two sides of `{what}` are different quantities"),
            "give the number the unit of the variable, as in `10 deg` or `3 m/s`".into(),
        ))
    }

    fn sum(&mut self) -> Result<Unit, Refusal> {
        let unit = self.product()?;
        loop {
            let (what, code) = match () {
                () if self.take("+") => ("+", Code::Add),
                () if self.take("-") => ("-", Code::Subtract),
                () => return Ok(unit),
            };
            let next = self.product()?;
            self.same(&unit, &next, what)?;
            self.emit(code);
        }
    }

    fn product(&mut self) -> Result<Unit, Refusal> {
        let mut unit = self.factor()?;
        loop {
            let (sign, code) = match () {
                () if self.take("*") => (1, Code::Multiply),
                () if self.take("/") => (-1, Code::Divide),
                () => return Ok(unit),
            };
            let next = self.factor()?;
            if unit == Unit::ANY || next == Unit::ANY {
                unit = Unit::ANY;
            } else {
                for (a, b) in unit.exponents.iter_mut().zip(next.exponents) {
                    *a = a.saturating_add(b.saturating_mul(sign));
                }
            }
            self.emit(code);
        }
    }

    fn factor(&mut self) -> Result<Unit, Refusal> {
        if self.take("-") {
            let unit = self.deeper(Self::factor)?;
            self.emit(Code::Negate);
            return Ok(unit);
        }
        let abs = self.take("abs(");
        if abs || self.take("(") {
            let unit = self.deeper(Self::sum)?;
            if !self.take(")") {
                return Err(("a `)` is missing".into(), "close every bracket".into()));
            }
            if abs {
                self.emit(Code::Abs);
            }
            return Ok(unit);
        }
        self.space();
        if self.rest.starts_with(|c: char| c.is_ascii_digit() || c == '.') {
            return self.number();
        }
        self.variable()
    }

    fn number(&mut self) -> Result<Unit, Refusal> {
        let bytes = self.rest.as_bytes();
        let digits = |mut i: usize| {
            let digit = |k: usize| bytes.get(k).is_some_and(u8::is_ascii_digit);
            // An underscore between two digits is ignored, as in all other numbers of a file.
            let parts =
                |k: usize| bytes.get(k) == Some(&b'_') && k > 0 && digit(k - 1) && digit(k + 1);
            while digit(i) || bytes.get(i) == Some(&b'.') || parts(i) {
                i += 1;
            }
            i
        };
        let mut end = digits(0);
        if end < bytes.len() && matches!(bytes[end], b'e' | b'E') {
            let sign = usize::from(bytes.get(end + 1).is_some_and(|b| matches!(b, b'+' | b'-')));
            let exponent = digits(end + 1 + sign);
            if exponent > end + 1 + sign {
                end = exponent;
            }
        }
        let (number, rest) = self.rest.split_at(end);
        let Ok(value) = number.replace('_', "").parse::<f64>() else {
            return Err((
                format!("`{number}` is not a number"),
                "write e.g. `1.8` or `3e5`".into(),
            ));
        };
        self.rest = rest;
        let after = rest.trim_start();
        let stop = |c: char| c.is_whitespace() || "<>()+-,".contains(c);
        let word = after.split(stop).next().unwrap_or_default();
        let word = word.trim_end_matches(['*', '/']);
        let unit = match word {
            "" | "and" | "or" => None,
            _ if !word.starts_with(|c: char| c.is_alphabetic() || c == '°' || c == '%') => None,
            _ => Some(Unit::parse(word).map_err(|e| {
                (e.to_string(), "write a unit such as `m/s`, `deg` or `km`".to_string())
            })?),
        };
        let unit = match unit {
            None => Unit::ONE,
            Some(unit) => self.longer(unit, after, word.len()),
        };
        self.emit(Code::Number(unit.to_si(value)));
        Ok(unit)
    }

    /// Reads a unit of one or more words, such as `N m` or `N m s/rad`.
    fn longer(&mut self, mut unit: Unit, after: &'a str, mut end: usize) -> Unit {
        loop {
            let next = after[end..].trim_start();
            let stop = |c: char| c.is_whitespace() || "<>()+-,".contains(c);
            let word = next.split(stop).next().unwrap_or_default();
            let word = word.trim_end_matches(['*', '/']);
            let letters = word.starts_with(|c: char| c.is_alphabetic() || c == '°');
            let to = after.len() - next.len() + word.len();
            if !letters || matches!(word, "and" | "or" | "not") || to == end {
                break;
            }
            let Ok(longer) = Unit::parse(&after[..to]) else { break };
            (unit, end) = (longer, to);
        }
        self.rest = &after[end..];
        unit
    }

    fn variable(&mut self) -> Result<Unit, Refusal> {
        let part = |c: char| c.is_alphanumeric() || "_.[]".contains(c);
        let end = self.rest.find(|c| !part(c)).unwrap_or(self.rest.len());
        let (path, rest) = self.rest.split_at(end);
        if path.is_empty() {
            let found = self.rest.chars().next().map_or("the end".into(), |c| format!("`{c}`"));
            let at = self.text.len() - self.rest.len();
            return Err((
                format!("a number or a variable is missing at {found} (character {})", at + 1),
                "write e.g. `Capsule.Aero.mach < 1.8`".into(),
            ));
        }
        self.rest = rest;
        if path == "time" || path == "phase_time" {
            self.emit(if path == "time" { Code::Time } else { Code::PhaseTime });
            return Ok(Unit::parse("s").unwrap_or(Unit::ONE));
        }
        let Some(v) = self.variables.get(path) else {
            if self.partly {
                self.emit(Code::Value(ABSENT));
                return Ok(Unit::ANY);
            }
            let known: Vec<&str> = self.variables.keys().map(String::as_str).collect();
            return Err((
                format!("there is no variable `{path}`"),
                remedy(path, "variables", &known),
            ));
        };
        self.emit(Code::Value(v.place));
        Ok(Unit::parse(&v.unit).unwrap_or(Unit::ONE))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::author::ports::PortKind;
    use crate::author::variable::Role;

    fn variables() -> BTreeMap<String, Variable> {
        let v = |place, unit: &'static str| Variable {
            place,
            role: Role::Output,
            unit: unit.into(),
            doc: "".into(),
            kind: PortKind::Numbers,
            part: "".into(),
        };
        [
            ("A.mach".to_string(), v(Place::Signal(0), "1")),
            ("A.speed".to_string(), v(Place::X(0), "m/s")),
            ("Arm.rate[1]".to_string(), v(Place::D(0), "rad/s")),
        ]
        .into()
    }

    const AT: Times = Times { time: 7.0, phase: 2.0 };

    fn value(text: &str) -> f64 {
        let c = Condition::parse(text, &variables()).unwrap_or_else(|e| panic!("{e}: {}", e.help));
        c.value(AT, &[30.0], &[-2.0], &[1.5])
    }

    #[test]
    fn conditions_are_distances_from_the_instant_they_hold() {
        assert_eq!(value("A.mach < 1.8"), 1.8 - 1.5);
        assert_eq!(value("A.mach >= 1.8"), 1.5 - 1.8);
        assert_eq!(value("A.speed > 36 km/h"), 30.0 - 36.0 * (1000.0 / 3600.0));
        assert_eq!(value("time > 10 s"), -3.0);
        assert_eq!(value("time > 5s and A.mach < 1.8"), 1.8_f64 - 1.5);
        assert_eq!(value("time > 5 s or A.mach < 1"), 2.0);
        assert_eq!(value("(A.speed + 2 m/s) * 2 < 100 m/s"), 36.0);
        assert_eq!(value("abs(Arm.rate[1]) > 1 rad/s and (time < 1 s or time > 6 s)"), 1.0);
        assert_eq!(value("-A.speed / 2 s < -3 m/s^2"), 12.0);
        assert_eq!(value("A.mach * 1e2 > 1.2e+2"), 30.0);
    }

    /// With equal sides, tests with equality are true and strict tests are false; `not` turns one into the other.
    #[test]
    fn equality_holds_where_it_is_written() {
        let holds = |text: &str| value(text) >= 0.0;
        for (text, expected) in [
            ("A.mach <= 1.5", true),
            ("A.mach >= 1.5", true),
            ("A.mach < 1.5", false),
            ("A.mach > 1.5", false),
            ("not A.mach < 1.5", true),
            ("not A.mach <= 1.5", false),
            ("A.mach <= 1.5 and time > 5 s", true),
            ("A.mach < 1.5 or time > 7 s", false),
            ("A.mach < 1.5 or time >= 7 s", true),
            ("phase_time >= 2 s and phase_time <= 2 s", true),
            ("phase_time > 2 s", false),
            ("A.mach", true),
            ("not A.mach", false),
            ("A.mach and not (A.mach or time < 1 s)", false),
        ] {
            assert_eq!(holds(text), expected, "{text}");
        }
    }

    #[test]
    fn units_may_have_blanks() {
        let torque = Variable { unit: "N m".into(), ..variables()["A.mach"].clone() };
        let all = [("M.torque".to_string(), torque)].into();
        let value = |text: &str| {
            let c = Condition::parse(text, &all).unwrap_or_else(|e| panic!("{e}: {}", e.help));
            c.value(AT, &[], &[], &[1.5])
        };
        assert_eq!(value("M.torque < 10 N m"), 8.5);
        assert_eq!(value("M.torque < 10 N m and time > 1 s"), 6.0);
        assert_eq!(value("M.torque < 2 N m s / 1 s"), 0.5);
        assert_eq!(value("M.torque + 1 N m > 2 kN mm"), 0.5);
    }

    #[test]
    fn what_a_phase_has_not_does_not_hold() {
        let of = |text: &str| {
            let c = Condition::parse(text, &variables()).unwrap();
            c.margin(AT, |place| if place == Place::Signal(0) { f64::NAN } else { 30.0 })
        };
        for text in ["A.mach < 1", "A.mach > 1", "A.mach < 1 and A.speed > 1 m/s"] {
            assert!(of(text).is_nan(), "{text}");
        }
        assert!(of("A.speed > 1 m/s and A.mach < 1").is_nan());
        assert_eq!(of("A.speed > 1 m/s or A.mach < 1"), 29.0);
        assert_eq!(of("A.mach < 1 or A.speed > 1 m/s"), 29.0);
    }

    #[test]
    fn underscores_part_digits() {
        let c = Condition::parse("A.speed < 1_00.000_5 m/s", &variables()).unwrap();
        assert!((c.margin(AT, |_| 30.0) - 70.0005).abs() < 1e-12);
    }

    #[test]
    fn mistakes_say_what_is_wrong() {
        for (text, part) in [
            ("A.mach < 3 m/s", "different quantities"),
            ("A.speed < 3", "different quantities"),
            ("A.speed", "a test is missing"),
            ("A.mach A.mach", "a test is missing"),
            ("A.mach = 1", "not supported in conditions"),
            ("A.speed < 1 m/s m", "different quantities"),
            ("1", "a test is missing"),
            ("A.mack < 1", "there is no variable `A.mack`"),
            ("A.mach < ", "is missing at the end"),
            ("A.mach < 1 A", "different quantities"),
            ("A.mach < 1 foo", "is not a unit"),
            ("A.mach < 1 and", "is missing at the end"),
            ("(A.mach < 1", "is missing"),
            ("A.mach < 1 )", "is left over"),
            ("A.speed + 1 kg > 2 m/s", "different quantities"),
        ] {
            let e = Condition::parse(text, &variables()).unwrap_err();
            assert!(e.to_string().contains(part), "{text}: {e}");
            assert!(!e.help.is_empty(), "{text}");
        }
        let deep = format!("{}A.mach{} < 1", "(1 + ".repeat(20), ")".repeat(20));
        assert!(Condition::parse(&deep, &variables()).unwrap_err().to_string().contains("deep"));
        // Text of any depth must return an error instead of overflowing the stack.
        for open in ["(", "not ", "-", "- (", "abs(", "(not ", "A.mach < (", "A.mach < -"] {
            for n in [60, 100, 1_000_000] {
                let e = Condition::parse(&open.repeat(n), &variables()).unwrap_err();
                assert!(!e.message.is_empty(), "{n} times `{open}`: {e}");
            }
        }
        let many = format!("{}A.mach < 1", "not ".repeat(100));
        let e = Condition::parse(&many, &variables()).unwrap_err();
        assert!(e.to_string().contains("more than 64"), "{e}");
    }
}
