//! The loader of RON assemblies and the reader of companion files must not panic.
#![no_main]

use libfuzzer_sys::fuzz_target;
use linkwork_assembly::{Options, load_text};
use linkwork_assembly::machine::apply_companion;
use linkwork_formats::{ReadOptions, read_urdf};
use linkwork_runtime::Catalogue;

/// A machine to import and to stand beside.
const ROVER: &str = include_str!("../corpus/rover.urdf");

fuzz_target!(|text: &str| {
    if text.contains("Companion") {
        if let Ok(mut d) = read_urdf(ROVER, &ReadOptions::default())
            && apply_companion("fuzz.ron", text, &mut d).is_ok()
        {
            assert!(d.builder.build().is_ok(), "a companion file spoiled the mechanism");
        }
        return;
    }
    let catalogue = Catalogue::default();
    let options = Options::new(&catalogue).embed("r.urdf", ROVER);
    let _ = load_text("fuzz.ron", text, &options);
});
