//! Arithmetic with parameters: `$track / 2`, `-$x`, `$radius + 5 cm`. Units are propagated.
use linkwork_runtime::Unit;

/// A number in SI with its unit; a number without a unit takes that of the other summand.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Quantity {
    pub value: f64,
    pub exponents: [i8; 8],
    pub bare: bool,
}

impl Quantity {
    pub fn bare(value: f64) -> Quantity {
        Quantity { value, exponents: [0; 8], bare: true }
    }

    pub fn unit(&self) -> Unit {
        Unit { exponents: self.exponents, scale: 1.0, offset: 0.0 }
    }
}

/// Returns a name, or an element of its list (from 0), as a number, or why it is not a number.
pub(crate) type Lookup<'a> = &'a dyn Fn(&str, Option<usize>) -> Result<Quantity, String>;

/// Evaluates an expression; the error describes the mistake in the text.
pub(crate) fn evaluate(text: &str, lookup: Lookup<'_>) -> Result<Quantity, String> {
    let mut p = Parser { rest: text, lookup, depth: 0 };
    let value = p.sum()?;
    p.blank();
    if !p.rest.is_empty() {
        return Err(format!("`{}` is unexpected at the end", p.rest));
    }
    if !value.value.is_finite() {
        return Err(format!("the result is {}", value.value));
    }
    Ok(value)
}

struct Parser<'t> {
    rest: &'t str,
    lookup: Lookup<'t>,
    depth: usize,
}

impl<'t> Parser<'t> {
    fn blank(&mut self) {
        self.rest = self.rest.trim_start();
    }

    fn eat(&mut self, c: char) -> bool {
        self.blank();
        match self.rest.strip_prefix(c) {
            Some(rest) => {
                self.rest = rest;
                true
            }
            None => false,
        }
    }

    fn word(&mut self, more: fn(char) -> bool) -> &'t str {
        let end = self.rest.find(|c| !more(c)).unwrap_or(self.rest.len());
        let (word, rest) = self.rest.split_at(end);
        self.rest = rest;
        word
    }

    fn sum(&mut self) -> Result<Quantity, String> {
        let mut left = self.product()?;
        loop {
            let sign = if self.eat('+') {
                1.0
            } else if self.eat('-') {
                -1.0
            } else {
                return Ok(left);
            };
            let right = self.product()?;
            if !left.bare && !right.bare && left.exponents != right.exponents {
                return Err(format!("{} and {} cannot be added", left.unit(), right.unit()));
            }
            let exponents = if left.bare { right.exponents } else { left.exponents };
            let bare = left.bare && right.bare;
            left = Quantity { value: left.value + sign * right.value, exponents, bare };
        }
    }

    fn product(&mut self) -> Result<Quantity, String> {
        let mut left = self.factor()?;
        loop {
            let divide = if self.eat('*') {
                false
            } else if self.eat('/') {
                true
            } else {
                return Ok(left);
            };
            let right = self.factor()?;
            let mut exponents = left.exponents;
            for (e, r) in exponents.iter_mut().zip(right.exponents) {
                *e = e.saturating_add(if divide { -r } else { r });
            }
            let value = if divide { left.value / right.value } else { left.value * right.value };
            left = Quantity { value, exponents, bare: left.bare && right.bare };
        }
    }

    fn factor(&mut self) -> Result<Quantity, String> {
        self.depth += 1;
        if self.depth > 200 {
            return Err("too many brackets or signs".into());
        }
        let value = self.plain_factor();
        self.depth -= 1;
        value
    }

    fn plain_factor(&mut self) -> Result<Quantity, String> {
        if self.eat('-') {
            let q = self.factor()?;
            return Ok(Quantity { value: -q.value, ..q });
        }
        if self.eat('(') {
            let q = self.sum()?;
            return if self.eat(')') { Ok(q) } else { Err("`)` is missing".into()) };
        }
        if self.eat('$') {
            let name = self.word(|c| c.is_alphanumeric() || c == '_');
            let element = self.element()?;
            return (self.lookup)(name, element);
        }
        match self.rest.chars().next() {
            Some(c) if c.is_ascii_digit() || c == '.' => self.number(),
            Some(c) if c.is_alphabetic() => self.function(),
            Some(c) => Err(format!("`{c}` is not expected here")),
            None => Err("a number or a $name is missing at the end".into()),
        }
    }

    /// Reads `[2]` after a name.
    fn element(&mut self) -> Result<Option<usize>, String> {
        let Some(rest) = self.rest.strip_prefix('[') else { return Ok(None) };
        let (index, rest) = rest.split_once(']').ok_or("`]` is missing")?;
        self.rest = rest;
        let number = index.trim().parse();
        number.map(Some).map_err(|_| format!("`[{index}]` is not an element: indices begin at [0]"))
    }

    fn number(&mut self) -> Result<Quantity, String> {
        let text = self.rest;
        let mut end = text.find(|c: char| !(c.is_ascii_digit() || c == '.')).unwrap_or(text.len());
        if let Some(exponent) = text[end..].strip_prefix(['e', 'E']) {
            let sign = usize::from(exponent.starts_with(['+', '-']));
            let digits = exponent[sign..].chars().take_while(char::is_ascii_digit).count();
            end += if digits > 0 { 1 + sign + digits } else { 0 };
        }
        let (number, rest) = text.split_at(end);
        self.rest = rest;
        let value: f64 = number.parse().map_err(|_| format!("`{number}` is not a number"))?;
        self.blank();
        let unit = self.word(|c| c.is_alphanumeric() || "°µΩ^".contains(c));
        if unit.is_empty() {
            return Ok(Quantity::bare(value));
        }
        let parsed = Unit::parse(unit).map_err(|e| e.to_string())?;
        Ok(Quantity { value: parsed.to_si(value), exponents: parsed.exponents, bare: false })
    }

    fn function(&mut self) -> Result<Quantity, String> {
        let name = self.word(char::is_alphanumeric);
        if name == "pi" {
            return Ok(Quantity::bare(std::f64::consts::PI));
        }
        if !self.eat('(') {
            return Err(format!("`{name}` is not a number; a parameter is written `${name}`"));
        }
        let q = self.sum()?;
        if !self.eat(')') {
            return Err("`)` is missing".into());
        }
        let angle = q.exponents == [0, 0, 0, 0, 0, 0, 0, 1] || q.exponents == [0; 8];
        let ratio = |value: f64| Quantity { value, exponents: [0; 8], bare: q.bare };
        match name {
            "abs" => Ok(Quantity { value: q.value.abs(), ..q }),
            "sqrt" if q.exponents.iter().all(|e| e % 2 == 0) => {
                Ok(Quantity { value: q.value.sqrt(), exponents: q.exponents.map(|e| e / 2), ..q })
            }
            "sin" if angle => Ok(ratio(q.value.sin())),
            "cos" if angle => Ok(ratio(q.value.cos())),
            "tan" if angle => Ok(ratio(q.value.tan())),
            "sqrt" | "sin" | "cos" | "tan" => {
                Err(format!("`{name}` is not defined for a quantity in {}", q.unit()))
            }
            _ => Err(format!("there is no function `{name}`: abs, sqrt, sin, cos, tan")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(text: &str) -> Result<(f64, String), String> {
        let lookup = |name: &str, element: Option<usize>| match name {
            "corner" => Ok(Quantity::bare([3.0, 4.0][element.ok_or("a list")?])),
            "track" => Ok(Quantity {
                value: 1.2,
                exponents: Unit::parse("m").unwrap().exponents,
                bare: false,
            }),
            "mass" => Ok(Quantity {
                value: 3.0,
                exponents: Unit::parse("kg").unwrap().exponents,
                bare: false,
            }),
            _ => Err(format!("no `{name}`")),
        };
        evaluate(text, &lookup).map(|q| (q.value, q.unit().to_string()))
    }

    #[test]
    fn arithmetic_carries_units() {
        assert_eq!(value("-$track / 2"), Ok((-0.6, "m".into())));
        assert_eq!(value("$track + 0.05"), Ok((1.25, "m".into())));
        assert_eq!(value("$track + 5 cm"), Ok((1.25, "m".into())));
        assert_eq!(value("$mass * $track * $track"), Ok((3.0 * 1.2 * 1.2, "kg m^2".into())));
        assert_eq!(value("2*(1+3) - 1e1"), Ok((-2.0, "1".into())));
        assert_eq!(value("sqrt($track*$track)"), Ok((1.2, "m".into())));
        assert_eq!(value("cos(180 deg)"), Ok((-1.0, "1".into())));
        assert_eq!(value("2 - 3 - 4"), Ok((-5.0, "1".into())));
        assert_eq!(value("$corner[0] * $corner[ 1 ] - 1"), Ok((11.0, "1".into())));
    }

    #[test]
    fn mistakes_are_named() {
        for (text, part) in [
            ("$track + $mass", "m and kg cannot be added"),
            ("$track + ", "is missing at the end"),
            ("$nose", "no `nose`"),
            ("$track / 0", "the result is inf"),
            ("track / 2", "a parameter is written `$track`"),
            ("($track", "`)` is missing"),
            ("$corner[0", "`]` is missing"),
            ("$corner[-1]", "`[-1]` is not an element: indices begin at [0]"),
            ("sin($mass)", "is not defined for a quantity in kg"),
            ("$track $mass", "`$mass` is unexpected at the end"),
        ] {
            let error = value(text).unwrap_err();
            assert!(error.contains(part), "{text}: {error}");
        }
    }
}
