//! Texts for users: the parts of documentation that lists and messages show, and formatting of numbers.

/// Returns the first paragraph of a text in one line.
#[must_use]
pub fn first_paragraph(doc: &str) -> String {
    let lines = doc.lines().map(str::trim).skip_while(|line| line.is_empty());
    lines.take_while(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

/// Returns the first sentence of a text in one line: up to a full stop before a space and a capital letter.
#[must_use]
pub fn first_sentence(doc: &str) -> String {
    let text = first_paragraph(doc);
    let end = text.match_indices(". ").find_map(|(at, _)| {
        let next = text[at + 2..].chars().next()?;
        (next.is_uppercase() || next == '`').then_some(at + 1)
    });
    text[..end.unwrap_or(text.len())].to_string()
}

/// Formats a number with six digits and without trailing zeros: `-33.1549`, `0.00900651`, with a power of ten below 1e-3 and from 1e6.
#[must_use]
pub fn number(v: f64) -> String {
    if v != 0.0 && !(1e-3..1e6).contains(&v.abs()) {
        return format!("{v:.4e}");
    }
    let digits = (5 - v.abs().max(1e-3).log10().floor() as i32).clamp(0, 8) as usize;
    let text = format!("{v:.digits$}");
    match text.contains('.') {
        true => text.trim_end_matches('0').trim_end_matches('.').to_string(),
        false => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short() {
        for (v, text) in [
            (0.0, "0"),
            (1.5, "1.5"),
            (123.456_789, "123.457"),
            (1e9, "1.0000e9"),
            (-0.25, "-0.25"),
            (f64::NAN, "NaN"),
        ] {
            assert_eq!(number(v), text);
        }
    }

    #[test]
    fn sentences_and_paragraphs_go_over_lines_and_end() {
        let doc = "Heights of a file: GeoTIFF (.tif, .asc),\n PDS3. Needs\na map.\n\nMore.";
        assert_eq!(
            first_paragraph(doc),
            "Heights of a file: GeoTIFF (.tif, .asc), PDS3. Needs a map."
        );
        assert_eq!(first_sentence(doc), "Heights of a file: GeoTIFF (.tif, .asc), PDS3.");
        assert_eq!(
            first_sentence("Force, e.g. of a spring. `k` is its rate."),
            "Force, e.g. of a spring."
        );
        assert_eq!(first_sentence(""), "");
    }
}
