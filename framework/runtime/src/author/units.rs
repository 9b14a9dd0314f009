//! Units: exponent vectors of (kg m s A K mol cd rad) with a factor and an offset to SI.
use std::fmt;

/// Astronomical unit (m, exact).
pub const AU: f64 = 149_597_870_700.0;

/// A unit: SI value = `scale` × number + `offset`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unit {
    /// Exponents of kg, m, s, A, K, mol, cd, rad (as in FMI).
    pub exponents: [i8; 8],
    /// Factor to SI.
    pub scale: f64,
    /// Offset to SI (only degrees Celsius have one).
    pub offset: f64,
}

/// Error of a unit text.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{text}` is not a unit: {why}")]
pub struct UnitError {
    /// The text.
    pub text: String,
    /// Error message.
    pub why: String,
}

const BASE: [&str; 8] = ["kg", "m", "s", "A", "K", "mol", "cd", "rad"];
const PI: f64 = std::f64::consts::PI;

/// Symbol, exponents, factor, and whether prefixes are permitted.
#[rustfmt::skip]
const TABLE: &[(&str, [i8; 8], f64, bool)] = &[
    ("1",    [0, 0, 0, 0, 0, 0, 0, 0], 1.0, false),
    ("m",    [0, 1, 0, 0, 0, 0, 0, 0], 1.0, true),
    ("g",    [1, 0, 0, 0, 0, 0, 0, 0], 1e-3, true),
    ("s",    [0, 0, 1, 0, 0, 0, 0, 0], 1.0, true),
    ("A",    [0, 0, 0, 1, 0, 0, 0, 0], 1.0, true),
    ("K",    [0, 0, 0, 0, 1, 0, 0, 0], 1.0, true),
    ("mol",  [0, 0, 0, 0, 0, 1, 0, 0], 1.0, true),
    ("cd",   [0, 0, 0, 0, 0, 0, 1, 0], 1.0, true),
    ("rad",  [0, 0, 0, 0, 0, 0, 0, 1], 1.0, true),
    ("deg",  [0, 0, 0, 0, 0, 0, 0, 1], PI / 180.0, false),
    ("°",    [0, 0, 0, 0, 0, 0, 0, 1], PI / 180.0, false),
    ("arcsec", [0, 0, 0, 0, 0, 0, 0, 1], PI / 648_000.0, false),
    ("arcmin", [0, 0, 0, 0, 0, 0, 0, 1], PI / 10_800.0, false),
    ("rev",  [0, 0, 0, 0, 0, 0, 0, 1], 2.0 * PI, false),
    ("rpm",  [0, 0, -1, 0, 0, 0, 0, 1], PI / 30.0, false),
    ("Hz",   [0, 0, -1, 0, 0, 0, 0, 0], 1.0, true),
    ("N",    [1, 1, -2, 0, 0, 0, 0, 0], 1.0, true),
    ("Pa",   [1, -1, -2, 0, 0, 0, 0, 0], 1.0, true),
    ("bar",  [1, -1, -2, 0, 0, 0, 0, 0], 1e5, true),
    ("psi",  [1, -1, -2, 0, 0, 0, 0, 0], 0.453_592_37 * 9.806_65 / (0.0254 * 0.0254), false),
    ("atm",  [1, -1, -2, 0, 0, 0, 0, 0], 101_325.0, false),
    ("J",    [1, 2, -2, 0, 0, 0, 0, 0], 1.0, true),
    ("W",    [1, 2, -3, 0, 0, 0, 0, 0], 1.0, true),
    ("Wh",   [1, 2, -2, 0, 0, 0, 0, 0], 3600.0, true),
    ("C",    [0, 0, 1, 1, 0, 0, 0, 0], 1.0, true),
    ("Ah",   [0, 0, 1, 1, 0, 0, 0, 0], 3600.0, true),
    ("V",    [1, 2, -3, -1, 0, 0, 0, 0], 1.0, true),
    ("ohm",  [1, 2, -3, -2, 0, 0, 0, 0], 1.0, true),
    ("Ω",    [1, 2, -3, -2, 0, 0, 0, 0], 1.0, true),
    ("F",    [-1, -2, 4, 2, 0, 0, 0, 0], 1.0, true),
    ("H",    [1, 2, -2, -2, 0, 0, 0, 0], 1.0, true),
    ("T",    [1, 0, -2, -1, 0, 0, 0, 0], 1.0, true),
    ("Wb",   [1, 2, -2, -1, 0, 0, 0, 0], 1.0, true),
    ("L",    [0, 3, 0, 0, 0, 0, 0, 0], 1e-3, true),
    ("min",  [0, 0, 1, 0, 0, 0, 0, 0], 60.0, false),
    ("h",    [0, 0, 1, 0, 0, 0, 0, 0], 3600.0, false),
    ("d",    [0, 0, 1, 0, 0, 0, 0, 0], 86_400.0, false),
    ("day",  [0, 0, 1, 0, 0, 0, 0, 0], 86_400.0, false),
    ("sol",  [0, 0, 1, 0, 0, 0, 0, 0], 88_775.244, false),
    ("AU",   [0, 1, 0, 0, 0, 0, 0, 0], AU, false),
    ("mi",   [0, 1, 0, 0, 0, 0, 0, 0], 1609.344, false),
    ("nmi",  [0, 1, 0, 0, 0, 0, 0, 0], 1852.0, false),
    ("mph",  [0, 1, -1, 0, 0, 0, 0, 0], 1609.344 / 3600.0, false),
    ("kn",   [0, 1, -1, 0, 0, 0, 0, 0], 1852.0 / 3600.0, false),
    ("ft",   [0, 1, 0, 0, 0, 0, 0, 0], 0.3048, false),
    ("in",   [0, 1, 0, 0, 0, 0, 0, 0], 0.0254, false),
    ("lb",   [1, 0, 0, 0, 0, 0, 0, 0], 0.453_592_37, false),
    ("lbf",  [1, 1, -2, 0, 0, 0, 0, 0], 4.448_221_615_260_5, false),
    ("slug", [1, 0, 0, 0, 0, 0, 0, 0], 14.593_902_937_206_36, false),
    ("t",    [1, 0, 0, 0, 0, 0, 0, 0], 1e3, false),
    ("%",    [0, 0, 0, 0, 0, 0, 0, 0], 0.01, false),
    ("g0",   [0, 1, -2, 0, 0, 0, 0, 0], 9.806_65, false),
];
const PREFIXES: &[(&str, f64)] = &[
    ("n", 1e-9),
    // The two characters are the micro sign, and the Greek letter that looks like it.
    ("\u{b5}", 1e-6),
    ("\u{3bc}", 1e-6),
    ("u", 1e-6),
    ("m", 1e-3),
    ("c", 1e-2),
    ("d", 1e-1),
    ("h", 1e2),
    ("k", 1e3),
    ("M", 1e6),
    ("G", 1e9),
];

impl Unit {
    /// No unit.
    pub const ONE: Unit = Unit { exponents: [0; 8], scale: 1.0, offset: 0.0 };

    /// Any unit, written `*`: for sources, gains and other parts whose unit follows from their wires.
    pub const ANY: Unit = Unit { exponents: [i8::MAX; 8], scale: 1.0, offset: 0.0 };

    /// Reads `N m/A`, `kg m^2`, `rad/s`, `1/(V s)`, `deg`, `km`. A division applies to the next factor only.
    pub fn parse(text: &str) -> Result<Unit, UnitError> {
        if matches!(text.trim(), "degC" | "°C") {
            return Ok(Unit { exponents: [0, 0, 0, 0, 1, 0, 0, 0], scale: 1.0, offset: 273.15 });
        }
        if text.trim() == "*" {
            return Ok(Unit::ANY);
        }
        let mut reader = Reader { text, at: 0, open: 0 };
        let unit = reader.product()?;
        if reader.at < text.len() {
            return Err(reader.error("unexpected `)`"));
        }
        Ok(unit)
    }

    /// True when a number in `self` may be wired to a port in `other` without conversion.
    pub fn same_quantity(&self, other: &Unit) -> bool {
        self.exponents == other.exponents || *self == Unit::ANY || *other == Unit::ANY
    }

    /// The number in SI.
    pub fn to_si(&self, number: f64) -> f64 {
        // Adding an offset of 0 would turn −0 into 0.
        if self.offset == 0.0 { self.scale * number } else { self.scale * number + self.offset }
    }

    fn times(self, other: Unit, power: i8) -> Unit {
        let mut exponents = self.exponents;
        for (e, o) in exponents.iter_mut().zip(other.exponents) {
            *e = e.saturating_add(o.saturating_mul(power));
        }
        Unit { exponents, scale: self.scale * other.scale.powi(power.into()), offset: 0.0 }
    }
}

impl fmt::Display for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if *self == Unit::ANY {
            return f.write_str("*");
        }
        let mut parts = Vec::new();
        for (name, &e) in BASE.iter().zip(&self.exponents) {
            match e {
                0 => {}
                1 => parts.push((*name).to_string()),
                e => parts.push(format!("{name}^{e}")),
            }
        }
        if parts.is_empty() { f.write_str("1") } else { f.write_str(&parts.join(" ")) }
    }
}

struct Reader<'a> {
    text: &'a str,
    /// The next byte.
    at: usize,
    /// Brackets that are open.
    open: usize,
}

/// Maximum number of nested brackets.
const OPEN_MAX: usize = 16;

impl<'a> Reader<'a> {
    fn error(&self, why: &str) -> UnitError {
        UnitError { text: self.text.to_string(), why: why.to_string() }
    }

    fn next(&self) -> Option<char> {
        self.text[self.at..].chars().next()
    }

    /// Skips the characters of a kind and returns them.
    fn skip(&mut self, of: impl Fn(char) -> bool) -> &'a str {
        let rest = &self.text[self.at..];
        let end = rest.find(|c| !of(c)).unwrap_or(rest.len());
        self.at += end;
        &rest[..end]
    }

    fn product(&mut self) -> Result<Unit, UnitError> {
        let mut unit = Unit::ONE;
        let mut sign = 1;
        let mut factors = 0;
        while let Some(c) = self.next() {
            match c {
                ' ' | '*' | '·' => self.at += c.len_utf8(),
                '/' => {
                    if sign < 0 {
                        return Err(self.error("two divisions in a row"));
                    }
                    sign = -1;
                    self.at += 1;
                }
                ')' => break,
                _ => {
                    let factor = self.factor()?;
                    unit = unit.times(factor, sign);
                    sign = 1;
                    factors += 1;
                }
            }
        }
        if sign < 0 || factors == 0 {
            return Err(self.error("a factor is missing"));
        }
        Ok(unit)
    }

    fn factor(&mut self) -> Result<Unit, UnitError> {
        let unit = if self.next() == Some('(') {
            self.at += 1;
            self.open += 1;
            if self.open > OPEN_MAX {
                return Err(self.error("too many brackets"));
            }
            let inner = self.product()?;
            self.open -= 1;
            if self.next() != Some(')') {
                return Err(self.error("`)` is missing"));
            }
            self.at += 1;
            inner
        } else {
            let symbol = self.skip(|c| !" *·/()^²³".contains(c));
            match lookup(symbol) {
                Some(unit) => unit,
                None if symbol == self.text => {
                    return Err(self.error("there is no such symbol"));
                }
                None => return Err(self.error(&format!("there is no symbol `{symbol}`"))),
            }
        };
        let power = self.power()?;
        Ok(Unit::ONE.times(unit, power))
    }

    fn power(&mut self) -> Result<i8, UnitError> {
        let power = match self.next() {
            Some('²') => 2,
            Some('³') => 3,
            Some('^') => {
                self.at += 1;
                let start = self.at;
                if self.next() == Some('-') {
                    self.at += 1;
                }
                self.skip(|c| c.is_ascii_digit());
                let digits = &self.text[start..self.at];
                return digits.parse().map_err(|_| self.error("a power must be a small integer"));
            }
            _ => return Ok(1),
        };
        self.at += '²'.len_utf8();
        Ok(power)
    }
}

fn lookup(symbol: &str) -> Option<Unit> {
    let exact = |s: &str| TABLE.iter().find(|row| row.0 == s);
    if let Some(&(_, exponents, scale, _)) = exact(symbol) {
        return Some(Unit { exponents, scale, offset: 0.0 });
    }
    PREFIXES.iter().find_map(|(prefix, factor)| {
        let rest = symbol.strip_prefix(prefix)?;
        let &(_, exponents, scale, prefixed) = exact(rest)?;
        prefixed.then_some(Unit { exponents, scale: scale * factor, offset: 0.0 })
    })
}

/// Splits `"12 deg"` into the number and the unit text; `"12"` has no unit.
pub fn split_quantity(text: &str) -> Option<(f64, &str)> {
    let text = text.trim();
    let end = text
        .char_indices()
        .find(|&(k, c)| {
            !(c.is_ascii_digit()
                || matches!(c, '+' | '-' | '.' | '_')
                || (matches!(c, 'e' | 'E')
                    && text[k + 1..].starts_with(|d: char| d.is_ascii_digit() || d == '-')))
        })
        .map_or(text.len(), |(k, _)| k);
    let number: f64 = text[..end].replace('_', "").parse().ok()?;
    Some((number, text[end..].trim()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn products_powers_prefixes_and_divisions() {
        let torque_constant = Unit::parse("N m/A").unwrap();
        assert_eq!(torque_constant.exponents, [1, 2, -2, -1, 0, 0, 0, 0]);
        assert_eq!(Unit::parse("mm").unwrap().scale, 1e-3);
        assert_eq!(Unit::parse("min").unwrap().scale, 60.0);
        assert_eq!(Unit::parse("km/h").unwrap().scale, 1e3 / 3600.0);
        // The values are from NIST SP 811, appendix B.8; psi has the seven digits given there.
        for (text, si, value) in [
            ("kn", "m/s", 1852.0 / 3600.0),
            ("nmi", "m", 1852.0),
            ("mi", "m", 1609.344),
            ("mph", "m/s", 0.44704),
            ("atm", "Pa", 101_325.0),
            ("arcmin", "rad", 2.908_882e-4),
            ("psi", "Pa", 6.894_757e3),
            ("d", "s", 86_400.0),
            ("\u{3bc}m", "m", 1e-6),
            ("\u{b5}m", "m", 1e-6),
        ] {
            let unit = Unit::parse(text).unwrap();
            assert!((unit.scale / value - 1.0).abs() < 1e-7, "{text}: {}", unit.scale);
            assert_eq!(unit.exponents, Unit::parse(si).unwrap().exponents, "{text}");
        }
        assert_eq!(Unit::parse("kg m^2").unwrap(), Unit::parse("kg m²").unwrap());
        assert_eq!(Unit::parse("1/(V s)").unwrap().exponents, [-1, -2, 2, 1, 0, 0, 0, 0]);
        assert_eq!(Unit::parse("N/m/s").unwrap().exponents, [1, 0, -3, 0, 0, 0, 0, 0]);
        assert_eq!(Unit::parse("degC").unwrap().to_si(20.0), 293.15);
        assert_eq!(Unit::parse("rad/s").unwrap().to_string(), "s^-1 rad");
    }

    #[test]
    fn a_star_goes_with_every_unit() {
        let any = Unit::parse("*").unwrap();
        for unit in ["V", "rad/s", "1", "*"] {
            let unit = Unit::parse(unit).unwrap();
            assert!(any.same_quantity(&unit) && unit.same_quantity(&any));
        }
        assert_eq!(any.to_string(), "*");
        assert!(Unit::parse("N *").unwrap() != any, "only alone");
    }

    #[test]
    fn refusals_name_the_text() {
        for bad in ["metre", "N m/", "", "/s/", "m^x", "(m", "m)"] {
            let error = Unit::parse(bad).unwrap_err().to_string();
            assert!(error.contains(&format!("`{bad}`")), "{error}");
        }
        // The depth of brackets is limited, and large powers must not wrap around.
        let deep = "(".repeat(1_000_000);
        assert!(Unit::parse(&deep).unwrap_err().to_string().contains("too many brackets"));
        assert!(Unit::parse("m^100 m^100").unwrap() != Unit::parse("m").unwrap());
        assert!(Unit::parse("(m^100)^3").unwrap() != Unit::parse("m").unwrap());
    }

    #[test]
    fn quantities() {
        assert_eq!(split_quantity("12 deg"), Some((12.0, "deg")));
        assert_eq!(split_quantity("-1.5e-3 ohm"), Some((-1.5e-3, "ohm")));
        assert_eq!(split_quantity("5e3"), Some((5e3, "")));
        assert_eq!(split_quantity("3 eV"), Some((3.0, "eV")));
        assert_eq!(split_quantity("deg"), None);
    }
}
