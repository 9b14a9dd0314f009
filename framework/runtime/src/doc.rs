//! Documentation texts of models, parameters and ports: the parts of them that lists and messages show.

/// The first paragraph of a text in one line.
#[must_use]
pub fn first_paragraph(doc: &str) -> String {
    let lines = doc.lines().map(str::trim).skip_while(|line| line.is_empty());
    lines.take_while(|line| !line.is_empty()).collect::<Vec<_>>().join(" ")
}

/// The first sentence of a text in one line: up to a full stop before a space and a capital letter.
#[must_use]
pub fn first_sentence(doc: &str) -> String {
    let text = first_paragraph(doc);
    let end = text.match_indices(". ").find_map(|(at, _)| {
        let next = text[at + 2..].chars().next()?;
        (next.is_uppercase() || next == '`').then_some(at + 1)
    });
    text[..end.unwrap_or(text.len())].to_string()
}

#[cfg(test)]
mod tests {
    use super::*;

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
