//! Converts units of DAVE-ML (`slugft2`, `ft_s`, `_rad`) to `slug ft^2`, `ft/s`, `1/rad`.
//!
//! Symbols follow each other directly, each with its power; `_` divides by the following ones.

/// Symbols of AIAA S-119 and common ones; the longest match is used.
const SYMBOLS: [(&str, &str); 39] = [
    ("slug", "slug"),
    ("fract", "1"),
    ("frac", "1"),
    ("sec", "s"),
    ("hour", "h"),
    ("min", "min"),
    ("deg", "deg"),
    ("rad", "rad"),
    ("rpm", "rpm"),
    ("lbm", "lb"),
    ("lbf", "lbf"),
    ("psf", "lbf ft^-2"),
    ("pct", "%"),
    ("nmi", "1852 m"),
    ("nd", "1"),
    ("ND", "1"),
    ("ft", "ft"),
    ("in", "in"),
    ("kg", "kg"),
    ("kPa", "kPa"),
    ("kN", "kN"),
    ("kW", "kW"),
    ("km", "km"),
    ("cm", "cm"),
    ("mm", "mm"),
    ("hr", "h"),
    ("Pa", "Pa"),
    ("pa", "Pa"),
    ("Hz", "Hz"),
    ("dK", "K"),
    ("N", "N"),
    ("n", "N"),
    ("m", "m"),
    ("s", "s"),
    ("k", "K"),
    ("K", "K"),
    ("g", "g0"),
    ("J", "J"),
    ("W", "W"),
];

/// Returns the unit in the usual notation, or `None` if it is unknown.
pub fn unit_text(units: &str) -> Option<String> {
    let units = units.trim();
    if units.is_empty() || units == "-" {
        return Some("1".into());
    }
    let mut out = Vec::new();
    for (k, side) in units.split('_').enumerate() {
        let mut rest = side;
        if k > 1 || (k == 1 && rest.is_empty()) {
            return None;
        }
        while !rest.is_empty() {
            let (symbol, text) = SYMBOLS.iter().find(|(s, _)| rest.starts_with(s))?;
            rest = &rest[symbol.len()..];
            let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
            let power: i32 = if digits == 0 { 1 } else { rest[..digits].parse().ok()? };
            rest = &rest[digits..];
            let power = if k == 1 { -power } else { power };
            match (*text, power) {
                ("1" | "%" | "1852 m" | "lbf ft^-2", p) if p != 1 => return None,
                ("1852 m", _) => return None,
                ("1", _) => {}
                (text, 1) => out.push(text.to_string()),
                (text, p) => out.push(format!("{text}^{p}")),
            }
        }
    }
    Some(if out.is_empty() { "1".into() } else { out.join(" ") })
}

#[cfg(test)]
mod tests {
    use super::unit_text;

    #[test]
    fn units_of_the_standard_are_read() {
        for (dave, want) in [
            ("nd", "1"),
            ("ft_s", "ft s^-1"),
            ("rad_s", "rad s^-1"),
            ("ft2", "ft^2"),
            ("slugft2", "slug ft^2"),
            ("kgm2", "kg m^2"),
            ("_rad", "rad^-1"),
            ("_deg", "deg^-1"),
            ("lbf_ft2", "lbf ft^-2"),
            ("slug_ft3", "slug ft^-3"),
            ("m_s2", "m s^-2"),
            ("pct", "%"),
            ("psf", "lbf ft^-2"),
            ("frac", "1"),
            ("kg_sec", "kg s^-1"),
        ] {
            assert_eq!(unit_text(dave).as_deref(), Some(want), "{dave}");
        }
        for none in ["furlong", "ft_s_s", "ft_", "kgx", "psf2"] {
            assert_eq!(unit_text(none), None, "{none}");
        }
    }
}
