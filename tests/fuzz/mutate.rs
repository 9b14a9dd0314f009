//! Mutations of sound inputs, for normal tests: the n-th of some seeds is the same bytes on every machine.
//!
//! ```text
//! one to four of: a bit flipped, bytes as no length should be, a piece cut out, doubled or put in from another seed,
//! the end cut off, noise put in
//! ```
#![allow(dead_code)] // Each test uses only some of the functions.
#[path = "../common/splitmix.rs"]
mod splitmix;
use splitmix::splitmix;

/// Numbers of a counter, as of a key.
pub struct Dice(u64);

impl Dice {
    pub fn new(key: u64) -> Dice {
        Dice(key.wrapping_mul(0x9e37_79b9_7f4a_7c15))
    }
    pub fn next(&mut self) -> u64 {
        splitmix(&mut self.0)
    }
    /// Below `n`; zero of nothing.
    pub fn below(&mut self, n: usize) -> usize {
        if n == 0 { 0 } else { (self.next() % n as u64) as usize }
    }
}

/// What a length, a count or a time should not be.
const ODD: [u64; 10] =
    [0, 1, 0x7f, 0xff, 0xffff, 1 << 20, 0x7fff_ffff, 0xffff_ffff, 1 << 40, u64::MAX];

/// The n-th mutation of some seeds.
pub fn mutated(seeds: &[Vec<u8>], n: u64) -> Vec<u8> {
    let mut dice = Dice::new(n);
    let mut bytes = seeds[dice.below(seeds.len())].clone();
    for _ in 0..=dice.below(4) {
        let at = dice.below(bytes.len());
        let end = (at + 1 + dice.below(64)).min(bytes.len());
        match dice.below(8) {
            0 | 1 => {
                if let Some(byte) = bytes.get_mut(at) {
                    *byte ^= 1 << dice.below(8);
                }
            }
            2 => {
                let odd = ODD[dice.below(ODD.len())];
                let width = 1 << dice.below(4);
                let both = [odd.to_le_bytes(), odd.to_be_bytes()];
                let odd =
                    if dice.below(2) == 0 { &both[0][..width] } else { &both[1][8 - width..] };
                bytes.iter_mut().skip(at).zip(odd).for_each(|(byte, odd)| *byte = *odd);
            }
            3 => drop(bytes.drain(at..end)),
            4 => {
                let piece = bytes[at..end].to_vec();
                bytes.splice(at..at, piece);
            }
            5 => {
                let other = &seeds[dice.below(seeds.len())];
                let from = dice.below(other.len());
                let to = (from + 1 + dice.below(256)).min(other.len());
                bytes.splice(at..end, other[from..to].iter().copied());
            }
            6 => bytes.truncate(at),
            _ => {
                let noise: Vec<u8> = (0..dice.below(16)).map(|_| dice.next() as u8).collect();
                bytes.splice(at..at, noise);
            }
        }
    }
    bytes
}

/// What fuzzing kept and what it found, of `tests/fuzz/corpus/TARGET` and `tests/fuzz/crashes/TARGET`.
pub fn kept(target: &str) -> Vec<Vec<u8>> {
    let top = std::path::Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/fuzz"));
    let mut files = Vec::new();
    for folder in ["corpus", "crashes"] {
        let Ok(found) = std::fs::read_dir(top.join(folder).join(target)) else { continue };
        files.extend(
            found
                .filter_map(|f| Some(f.ok()?.path()))
                .filter(|p| p.is_file() && !p.ends_with(".gitkeep")),
        );
    }
    files.sort();
    files.iter().map(|f| std::fs::read(f).expect("a file of the corpus")).collect()
}

/// The most memory that this process has had so far (bytes), where the system tells.
pub fn most_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find(|l| l.starts_with("VmHWM:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok().map(|kib| kib << 10)
}

/// Reads many mutations, a fifth of `count` unless `.ci/verify damage` runs it (`LINKWORK_VERIFY`): `read` says whether one was accepted. No panic, no more than 64 MiB more than before, each
/// within two seconds; and most are refused, though not all, or what is read is not what is meant.
pub fn survives(seeds: &[Vec<u8>], count: u64, mut read: impl FnMut(&[u8]) -> bool) {
    let count = if std::env::var_os("LINKWORK_VERIFY").is_some() { count } else { count / 5 };
    for (k, seed) in seeds.iter().enumerate() {
        read(seed);
        assert!(!seed.is_empty(), "seed {k} is empty");
    }
    let before = most_memory();
    let mut accepted = 0;
    for n in 0..count {
        let bytes = mutated(seeds, n);
        #[allow(clippy::disallowed_methods)] // The test measures how long a call takes.
        let clock = std::time::Instant::now();
        let ok = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| read(&bytes)));
        accepted += u64::from(ok.unwrap_or_else(|_| panic!("mutation {n} panics")));
        assert!(clock.elapsed().as_secs() < 2, "mutation {n} takes {:?}", clock.elapsed());
    }
    if let (Some(before), Some(after)) = (before, most_memory()) {
        assert!(after - before < 64 << 20, "{} MiB more", (after - before) >> 20);
    }
    println!("{accepted} of {count} are accepted");
    assert!(accepted < count, "everything is accepted");
}
