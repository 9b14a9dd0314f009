//! Text inside XML and HTML.

/// Escapes text for XML and HTML, between tags and in attributes with quotes of either kind. Characters that XML does not allow (control characters,
/// U+FFFE, U+FFFF) become spaces, and so do tabs and line ends.
///
/// ```
/// use linkwork_formats::escaped;
/// assert_eq!(escaped("a<b> & \"c\'\n"), "a&lt;b&gt; &amp; &quot;c&#39; ");
/// ```
#[must_use]
pub fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            '\'' => out += "&#39;",
            '\u{fffe}' | '\u{ffff}' => out.push(' '),
            c if c.is_control() => out.push(' '),
            c => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::escaped;

    /// A reader returns every text unchanged, except for characters that XML does not allow.
    #[test]
    fn a_reader_of_xml_gets_the_text_back() {
        let all: String = (0..=0x2_ffff_u32).filter_map(char::from_u32).collect();
        let kept = |c: char| match c {
            '\u{fffe}' | '\u{ffff}' => ' ',
            c if c.is_control() => ' ',
            c => c,
        };
        let wanted: String = all.chars().map(kept).collect();
        for quote in ["'", "\""] {
            let xml = format!("<a b={quote}{0}{quote}>{0}</a>", escaped(&all));
            let read = roxmltree::Document::parse(&xml).expect("XML");
            let root = read.root_element();
            assert_eq!(root.text(), Some(&*wanted));
            assert_eq!(root.attribute("b"), Some(&*wanted));
        }
    }
}
