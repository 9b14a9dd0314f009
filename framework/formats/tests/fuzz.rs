//! The corpus and the findings of fuzzing, and randomly damaged files, do not cause a panic in the readers, and every accepted file builds.

use linkwork_formats::{
    Description, FormatError, ReadOptions, read_mjcf, read_sdf, read_urdf, write_urdf,
};
use std::path::PathBuf;

type Reader = fn(&str, &ReadOptions) -> Result<Description, FormatError>;

const READERS: [(&str, Reader); 3] = [("urdf", read_urdf), ("mjcf", read_mjcf), ("sdf", read_sdf)];

fn texts(folder: &str) -> Vec<String> {
    let top = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/fuzz"));
    let files = std::fs::read_dir(top.join(folder)).expect("the folder is committed");
    let mut paths: Vec<PathBuf> = files.map(|f| f.expect("entry").path()).collect();
    paths.sort();
    let read = |p: &PathBuf| std::fs::read(p).expect("a file");
    paths.iter().map(|p| String::from_utf8_lossy(&read(p)).into_owned()).collect()
}

/// Returns whether the reader accepts it.
fn check(name: &str, reader: Reader, text: &str) -> bool {
    match reader(text, &ReadOptions::default()) {
        Ok(d) => {
            d.builder.build().unwrap_or_else(|e| panic!("{name} accepted\n{text}\n{e}"));
            // The written file must be readable.
            if let Ok(urdf) = write_urdf(&d) {
                let back = read_urdf(&urdf.text, &ReadOptions::default());
                if let Err(e) = back {
                    panic!("{name}: {e}\n{text}\n{}", urdf.text);
                }
            }
            true
        }
        Err(e) => {
            assert!(!e.faults.is_empty() && !e.to_string().is_empty());
            false
        }
    }
}

#[test]
fn corpus_and_crashes_are_replayed() {
    for (name, reader) in READERS {
        let mut accepted = 0;
        let all = [texts(&format!("corpus/{name}")), texts(&format!("crashes/{name}"))].concat();
        for text in &all {
            accepted += usize::from(check(name, reader, text));
        }
        println!("{name}: {} files, {accepted} accepted", all.len());
        assert!(all.len() > 3 && accepted > 1, "{name}: {} files, {accepted} accepted", all.len());
    }
}

#[test]
fn files_damaged_at_random_never_panic() {
    let mut seed = 0x5eed_u64;
    let mut below = |n: usize| {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (seed >> 33) as usize % n.max(1)
    };
    let words = ["1e308", "-1", "nan", "0", "\"", ">", "<a/>", "world", "", "${x}", "-0", "1e-320"];
    for (name, reader) in READERS {
        let seeds = texts(&format!("corpus/{name}"));
        let mut accepted = 0;
        for _ in 0..3000 {
            let mut chars: Vec<char> = seeds[below(seeds.len())].chars().collect();
            for _ in 0..=below(3) {
                let at = below(chars.len());
                let end = (at + below(12)).min(chars.len());
                let word = words[below(words.len())].chars();
                chars.splice(at..end, word);
            }
            accepted += usize::from(check(name, reader, &chars.into_iter().collect::<String>()));
        }
        println!("{name}: {accepted} of 3000 accepted");
    }
}
