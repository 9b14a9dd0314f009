//! The reader accepts every text that ships, and nothing that `ron` rejects.
use super::parse::parse;
use crate::text::report::Cx;
use std::path::{Path, PathBuf};

fn files(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap().flatten() {
        let path = entry.path();
        if path.is_dir() && !path.ends_with("target") {
            files(&path, out);
        } else if path.extension().is_some_and(|e| e == "ron") {
            out.push(path);
        }
    }
}

/// The texts of the repository's assemblies and simulations.
fn texts() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut all = Vec::new();
    ["assemblies", "sims", "framework/book"].iter().for_each(|f| files(&root.join(f), &mut all));
    all.sort();
    let text =
        |path: PathBuf| Some((path.display().to_string(), std::fs::read_to_string(path).ok()?));
    all.into_iter().filter_map(text).collect()
}

/// Whether a text is read. Then `ron` accepts it too, and what is printed of its value reads back as the same value. Else there is a fault.
fn is_read(name: &str, text: &str) -> bool {
    let read = |text: &str| {
        let mut cx = Cx::default();
        let file = cx.sources.add("t", text);
        (parse(&mut cx, file), cx.faults)
    };
    let (value, faults) = read(text);
    let Some(value) = value else {
        assert!(!faults.is_empty(), "{name}: no value and no fault\n{text}");
        return false;
    };
    assert!(faults.is_empty(), "{name}: {faults:?}\n{text}");
    // The text ends with a line break, because `ron` requires one after a comment at the end.
    let other = ron::from_str::<&ron::value::RawValue>(&format!("{text}\n")).map(|_| ());
    assert!(other.is_ok(), "{name}: {other:?}\n{text}");
    let shown = value.value.to_string();
    let (again, _) = read(&shown);
    assert_eq!(again.map(|v| v.value.to_string()), Some(shown), "{name}\n{text}");
    true
}

#[test]
fn every_text_that_ships_is_read() {
    let all = texts();
    assert!(all.len() > 50);
    let unread: Vec<&str> =
        all.iter().filter(|(name, text)| !is_read(name, text)).map(|(name, _)| &**name).collect();
    assert!(unread.is_empty(), "{unread:?}");
}

const SCRAPS: &[&str] = &[
    "(",
    ")",
    "[",
    "]",
    "{",
    "}",
    ",",
    ":",
    "\"",
    "\\",
    "/",
    "//",
    "/*",
    "*/",
    " ",
    "\n",
    "\u{a0}",
    "\u{85}",
    "é",
    "0",
    "-0",
    "007",
    "1e5",
    "1e",
    "1.",
    ".5",
    "-.5e-3",
    "+1",
    "+1.5",
    "1_0",
    "1..2",
    "..",
    "0x1F",
    "5f32",
    "3u8",
    "99999999999999999999",
    "inf",
    "-inf",
    "NaN",
    "true",
    "None",
    "Some",
    "Some(1)",
    "()",
    "( )",
    "(1)",
    "(a: 1)",
    "(a: 1, a: 2)",
    "A",
    "A()",
    "A (1)",
    "r\"x\"",
    "b\"x\"",
    "'c'",
    "r#a",
    "\"a\\n\": 1",
    "\"a\": 1",
    "a: 1",
    "#![enable(implicit_some)]",
    "_",
    "a1",
    "1a",
    "é: 1",
];

#[test]
fn damaged_texts_are_read_as_ron_reads_them_or_rejected() {
    let all = texts();
    // The numbers are from a linear congruential generator with a fixed seed.
    let mut seed = 20_261_126_u64;
    let mut below = |n: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % n
    };
    let small: Vec<&String> = all.iter().map(|(_, text)| text).filter(|t| t.len() < 2000).collect();
    let mut read = 0;
    for round in 0..20_000 {
        // Start from a text of the repository or from an empty text.
        let mut text = match round % 2 {
            0 => small[below(small.len())].clone(),
            _ => "A([])".to_string(),
        };
        for _ in 0..1 + below(4) {
            let ends: Vec<usize> =
                text.char_indices().map(|(k, _)| k).chain([text.len()]).collect();
            let at = ends[below(ends.len())];
            match below(3) {
                0 => text.truncate(at),
                1 if at < text.len() => drop(text.remove(at)),
                _ => text.insert_str(at, SCRAPS[below(SCRAPS.len())]),
            }
        }
        read += usize::from(is_read("damaged", &text));
    }
    assert!(read > 1000, "{read}");
}
