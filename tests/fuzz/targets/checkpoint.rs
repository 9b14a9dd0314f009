//! The reader of checkpoints must not panic, whatever is under a checksum that fits.
#![no_main]

use libfuzzer_sys::fuzz_target;
use linkwork_runtime::{Checkpoint, noise};

fuzz_target!(|bytes: &[u8]| {
    let mut bytes = bytes.to_vec();
    if bytes.len() >= 16 {
        let sum = noise::hash(bytes[16..].iter().copied()).to_le_bytes();
        bytes[8..16].copy_from_slice(&sum);
    }
    if let Ok(checkpoint) = Checkpoint::from_bytes(&bytes) {
        assert!(checkpoint.to_bytes().is_ok());
    }
});
