//! The sdf reader must not panic, and what it accepts must build.
#![no_main]

use libfuzzer_sys::fuzz_target;
use linkwork_formats::{ReadOptions, read_sdf};

fuzz_target!(|text: &str| {
    if let Ok(d) = read_sdf(text, &ReadOptions::default()) {
        assert!(d.builder.build().is_ok());
    }
});
