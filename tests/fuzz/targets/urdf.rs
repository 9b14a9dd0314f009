//! The urdf reader must not panic, and what it accepts must build.
#![no_main]

use libfuzzer_sys::fuzz_target;
use linkwork_formats::{ReadOptions, read_urdf};

fuzz_target!(|text: &str| {
    if let Ok(d) = read_urdf(text, &ReadOptions::default()) {
        assert!(d.builder.build().is_ok());
    }
});
