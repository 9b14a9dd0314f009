//! The corpus and the findings of fuzzing do not cause a panic in the loader and the reader of companion files.
use linkwork_assembly::machine::apply_companion;
use linkwork_assembly::{Options, load_text};
use linkwork_formats::{ReadOptions, read_urdf};
use linkwork_runtime::Catalogue;
use std::path::PathBuf;

#[test]
fn corpus_and_crashes_are_replayed() {
    let top = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/fuzz"));
    let rover = include_str!("../../../tests/fuzz/corpus/rover.urdf");
    let catalogue = Catalogue::default();
    let options = Options::new(&catalogue).embed("r.urdf", rover);
    let (mut read, mut accepted) = (0, 0);
    for folder in ["corpus/ron", "crashes/ron"] {
        let files = std::fs::read_dir(top.join(folder)).expect("the folder is committed");
        for file in files {
            let bytes = std::fs::read(file.expect("entry").path()).expect("a file");
            let text = String::from_utf8_lossy(&bytes);
            read += 1;
            if text.contains("Companion") {
                let mut d = read_urdf(rover, &ReadOptions::default()).expect("sound");
                if apply_companion("fuzz.ron", &text, &mut d).is_ok() {
                    d.builder.build().expect("a companion file leaves the mechanism sound");
                    accepted += 1;
                }
            } else {
                accepted += usize::from(load_text("fuzz.ron", &text, &options).is_ok());
            }
        }
    }
    assert!(read > 5 && accepted > 1, "{read} files, {accepted} accepted");
}
