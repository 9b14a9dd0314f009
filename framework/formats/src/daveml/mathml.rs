//! Content MathML of `calculation`: converts elements to an expression over the variables.
//!
//! Supported: cn (decimal, e-notation, rational), ci, csymbol atan2, constants, arithmetic, powers, roots, logarithms, circular and hyperbolic
//! functions and their inverses, comparisons, logic, piecewise. True is 1, false is 0; a condition is true if it is not 0. Other elements are errors.

use crate::error::{FaultKind, FileFault};
use crate::xml::Element;

/// An expression over the values of the variables.
#[derive(Clone, Debug)]
pub(super) enum Expression {
    Number(f64),
    Variable(usize),
    One(fn(f64) -> f64, Box<Expression>),
    Two(fn(f64, f64) -> f64, Box<[Expression; 2]>),
    /// Folded from the left.
    Many(fn(f64, f64) -> f64, Vec<Expression>),
    /// The function compares each pair of neighbours.
    Chain(fn(f64, f64) -> bool, Vec<Expression>),
    /// Value and condition, then the value otherwise (NaN if there is none).
    Piecewise(Vec<(Expression, Expression)>, Option<Box<Expression>>),
}

impl Expression {
    pub fn value(&self, v: &[f64]) -> f64 {
        match self {
            Expression::Number(x) => *x,
            Expression::Variable(k) => v[*k],
            Expression::One(f, a) => f(a.value(v)),
            Expression::Two(f, ab) => f(ab[0].value(v), ab[1].value(v)),
            Expression::Many(f, all) => {
                let mut values = all.iter().map(|e| e.value(v));
                let first = values.next().unwrap_or(0.0);
                values.fold(first, f)
            }
            Expression::Chain(holds, all) => {
                let ok = all.windows(2).all(|w| holds(w[0].value(v), w[1].value(v)));
                f64::from(u8::from(ok))
            }
            Expression::Piecewise(pieces, otherwise) => {
                let found = pieces.iter().find(|(_, when)| when.value(v) != 0.0);
                match (found, otherwise) {
                    (Some((value, _)), _) => value.value(v),
                    (None, Some(e)) => e.value(v),
                    (None, None) => f64::NAN,
                }
            }
        }
    }

    /// Adds the variables of the expression, some of them several times.
    pub fn variables(&self, out: &mut Vec<usize>) {
        match self {
            Expression::Number(_) => {}
            Expression::Variable(k) => out.push(*k),
            Expression::One(_, a) => a.variables(out),
            Expression::Two(_, ab) => ab.iter().for_each(|e| e.variables(out)),
            Expression::Many(_, all) | Expression::Chain(_, all) => {
                all.iter().for_each(|e| e.variables(out));
            }
            Expression::Piecewise(pieces, otherwise) => {
                for (value, when) in pieces {
                    value.variables(out);
                    when.variables(out);
                }
                otherwise.iter().for_each(|e| e.variables(out));
            }
        }
    }
}

/// Returns a function of one number.
fn one(name: &str) -> Option<fn(f64) -> f64> {
    Some(match name {
        "abs" => f64::abs,
        "floor" => f64::floor,
        "ceiling" => f64::ceil,
        "exp" => f64::exp,
        "ln" => f64::ln,
        "sin" => f64::sin,
        "cos" => f64::cos,
        "tan" => f64::tan,
        "sec" => |x| 1.0 / x.cos(),
        "csc" => |x| 1.0 / x.sin(),
        "cot" => |x| 1.0 / x.tan(),
        "arcsin" => f64::asin,
        "arccos" => f64::acos,
        "arctan" => f64::atan,
        "sinh" => f64::sinh,
        "cosh" => f64::cosh,
        "tanh" => f64::tanh,
        "arcsinh" => f64::asinh,
        "arccosh" => f64::acosh,
        "arctanh" => f64::atanh,
        "not" => |x| f64::from(u8::from(x == 0.0)),
        _ => return None,
    })
}

fn two(name: &str) -> Option<fn(f64, f64) -> f64> {
    Some(match name {
        "divide" => |a, b| a / b,
        "power" => f64::powf,
        "rem" => |a, b| a % b,
        "quotient" => |a, b| (a / b).trunc(),
        "atan2" => f64::atan2,
        _ => return None,
    })
}

fn many(name: &str) -> Option<fn(f64, f64) -> f64> {
    Some(match name {
        "plus" => |a, b| a + b,
        "times" => |a, b| a * b,
        "min" => f64::min,
        "max" => f64::max,
        "and" => |a, b| f64::from(u8::from(a != 0.0 && b != 0.0)),
        "or" => |a, b| f64::from(u8::from(a != 0.0 || b != 0.0)),
        "xor" => |a, b| f64::from(u8::from((a != 0.0) != (b != 0.0))),
        _ => return None,
    })
}

fn chain(name: &str) -> Option<fn(f64, f64) -> bool> {
    Some(match name {
        "lt" => |a, b| a < b,
        "gt" => |a, b| a > b,
        "leq" => |a, b| a <= b,
        "geq" => |a, b| a >= b,
        "eq" => |a, b| a == b,
        "neq" => |a, b| a != b,
        _ => return None,
    })
}

/// Data for reading a formula.
pub(super) struct Formulas<'a> {
    /// Index of a variable by its `varID`.
    pub find: &'a dyn Fn(&str) -> Option<usize>,
    /// The remedy for an unknown variable.
    pub nearest: &'a dyn Fn(&str) -> String,
    pub faults: &'a mut Vec<FileFault>,
}

impl Formulas<'_> {
    fn fault(&mut self, e: &Element, kind: FaultKind) -> Option<Expression> {
        self.faults.push(FileFault { place: e.place(), kind });
        None
    }

    fn bad(&mut self, e: &Element, text: &str, expected: &str) -> Option<Expression> {
        let kind = FaultKind::BadValue {
            what: format!("<{}>", e.name),
            text: text.into(),
            expected: expected.into(),
            help: "correct the formula at this position".into(),
        };
        self.fault(e, kind)
    }

    /// Reads the formula of a `<math>` element.
    pub fn math(&mut self, math: &Element) -> Option<Expression> {
        math.touch();
        match &math.children[..] {
            [only] => self.read(only),
            all => {
                let text = format!("{} elements", all.len());
                self.bad(math, &text, "one formula")
            }
        }
    }

    fn read(&mut self, e: &Element) -> Option<Expression> {
        e.touch_all();
        // A prefix may replace the namespace of `<math>`.
        let name = e.name.rsplit(':').next().unwrap_or_default();
        match name {
            "cn" => self.number(e),
            "ci" => match (self.find)(&e.text) {
                Some(k) => Some(Expression::Variable(k)),
                None => {
                    let kind = FaultKind::UnknownName {
                        what: "<ci>".into(),
                        kind: "variable",
                        name: e.text.clone(),
                        help: (self.nearest)(&e.text),
                    };
                    self.fault(e, kind)
                }
            },
            "pi" => Some(Expression::Number(std::f64::consts::PI)),
            "exponentiale" => Some(Expression::Number(std::f64::consts::E)),
            "true" => Some(Expression::Number(1.0)),
            "false" => Some(Expression::Number(0.0)),
            "notanumber" => Some(Expression::Number(f64::NAN)),
            "infinity" => Some(Expression::Number(f64::INFINITY)),
            "apply" => self.apply(e),
            "piecewise" => self.piecewise(e),
            _ => self.unknown(e, name),
        }
    }

    fn unknown(&mut self, e: &Element, name: &str) -> Option<Expression> {
        let kind = FaultKind::Unsupported {
            what: format!("<{name}> of MathML is not supported"),
            help: "write the formula with arithmetic, elementary functions, comparisons and \
                   <piecewise>"
                .into(),
        };
        self.fault(e, kind)
    }

    fn number(&mut self, e: &Element) -> Option<Expression> {
        let kind = e.attr("type").unwrap_or("real").to_string();
        let parse = |t: &str| t.trim().parse::<f64>().ok().filter(|x| x.is_finite());
        let found = match kind.as_str() {
            "real" | "integer" | "double" => parse(&e.text),
            // <cn type="e-notation">1.2<sep/>-3</cn>: the parser joins both texts with white space
            // between them.
            "e-notation" => {
                let mut parts = e.text.split_whitespace();
                match (parts.next(), parts.next(), parts.next()) {
                    (Some(a), Some(b), None) => parse(&format!("{a}e{b}")),
                    (Some(a), None, None) => parse(a),
                    _ => None,
                }
            }
            "rational" => {
                let parts: Vec<f64> = e.text.split_whitespace().filter_map(parse).collect();
                match parts[..] {
                    [a, b] if b != 0.0 => Some(a / b),
                    _ => None,
                }
            }
            other => {
                let other = other.to_string();
                return self.bad(e, &other, "of type real, integer, rational or e-notation");
            }
        };
        match found {
            Some(x) => Some(Expression::Number(x)),
            None => {
                let text = e.text.clone();
                self.bad(e, &text, "a number")
            }
        }
    }

    fn arguments(&mut self, all: &[Element]) -> Option<Vec<Expression>> {
        // Read all arguments before returning, so that all mistakes are reported.
        let read: Vec<Option<Expression>> = all.iter().map(|e| self.read(e)).collect();
        read.into_iter().collect()
    }

    fn apply(&mut self, e: &Element) -> Option<Expression> {
        let Some((operator, rest)) = e.children.split_first() else {
            return self.bad(e, "empty", "an operator and its arguments");
        };
        let name = operator.name.rsplit(':').next().unwrap_or_default();
        let name = match name {
            // The operator is in the text: <csymbol definitionURL="…#atan2">atan2</csymbol> or <ci
            // type="function">atan2</ci>.
            "csymbol" | "ci" => operator.text.as_str(),
            other => other,
        };
        if name == "piecewise" && rest.is_empty() {
            // Files of NASA wrap the piecewise element in an <apply> without an operator.
            return self.read(operator);
        }
        let qualifier = |q: &str| rest.iter().position(|c| c.name.rsplit(':').next() == Some(q));
        if let Some(k) = qualifier("degree").or_else(|| qualifier("logbase")) {
            return self.qualified(e, name, rest, k);
        }
        let mut args = self.arguments(rest)?;
        let count = args.len();
        let wrong = |this: &mut Self, wanted: &str| {
            this.bad(e, &format!("<{name}> of {count} arguments"), wanted)
        };
        if name == "minus" && count == 1 {
            return Some(Expression::One(|x| -x, Box::new(args.remove(0))));
        }
        if let Some(f) = many(name) {
            let empty = args.is_empty();
            return if empty {
                wrong(self, "one or more")
            } else {
                Some(Expression::Many(f, args))
            };
        }
        if let Some(f) = chain(name) {
            let few = count < 2;
            return if few { wrong(self, "two or more") } else { Some(Expression::Chain(f, args)) };
        }
        let pair: Option<fn(f64, f64) -> f64> =
            if name == "minus" { Some(|a, b| a - b) } else { two(name) };
        if let Some(f) = pair {
            return match <[Expression; 2]>::try_from(args) {
                Ok(ab) => Some(Expression::Two(f, Box::new(ab))),
                Err(_) => wrong(self, "two"),
            };
        }
        let single: Option<fn(f64) -> f64> = match name {
            "root" => Some(f64::sqrt),
            "log" => Some(f64::log10),
            other => one(other),
        };
        match (single, count) {
            (Some(f), 1) => Some(Expression::One(f, Box::new(args.remove(0)))),
            (Some(_), _) => wrong(self, "one"),
            (None, _) => self.unknown(operator, name),
        }
    }

    /// `<root/><degree>3</degree>x`, `<log/><logbase>2</logbase>x`.
    fn qualified(
        &mut self,
        e: &Element,
        name: &str,
        rest: &[Element],
        k: usize,
    ) -> Option<Expression> {
        rest[k].touch_all();
        let others: Vec<&Element> =
            rest.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, c)| c).collect();
        let (&[argument], [inner]) = (&others[..], &rest[k].children[..]) else {
            return self.bad(e, name, "one argument and one qualifier");
        };
        let (argument, inner) = (self.read(argument), self.read(inner));
        let f: fn(f64, f64) -> f64 = match name {
            // An odd root of a negative number is negative.
            "root" => |x, n| if n == 3.0 { x.cbrt() } else { x.powf(1.0 / n) },
            "log" => |x, base| x.ln() / base.ln(),
            _ => return self.unknown(e, name),
        };
        Some(Expression::Two(f, Box::new([argument?, inner?])))
    }

    fn piecewise(&mut self, e: &Element) -> Option<Expression> {
        let mut pieces = Vec::new();
        let mut otherwise = None;
        for c in &e.children {
            let name = c.name.rsplit(':').next().unwrap_or_default();
            match (name, &c.children[..]) {
                ("piece", [value, when]) => {
                    let (value, when) = (self.read(value), self.read(when));
                    pieces.push((value?, when?));
                }
                ("otherwise", [value]) => otherwise = Some(Box::new(self.read(value)?)),
                _ => {
                    return self.bad(c, name, "<piece> of a value and a condition, or <otherwise>");
                }
            }
        }
        if pieces.is_empty() {
            return self.bad(e, "without a <piece>", "one or more");
        }
        Some(Expression::Piecewise(pieces, otherwise))
    }
}
