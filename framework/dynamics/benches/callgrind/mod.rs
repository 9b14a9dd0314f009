//! Counting instructions: a program runs itself, or a peer, under callgrind.
//!
//! Both call each algorithm [`CALLS`] times to warm up, then as often inside a function `counted`;
//! callgrind collects only in there, and dumps its sum after each. The loop and the indirect call in
//! it, some ten instructions, are counted too.
//!
//! Callgrind counts each byte that `rep stosb` fills as an instruction. So the C library is told to
//! fill and copy by vector instructions, as it does below two thousand bytes anyway.
//!
//! valgrind 3.19 does not know the short form of `vmovq` between two registers. The profile `counts`
//! keeps it out of what sets mechanisms up; should a kernel contain it, the error says so.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Calls that are counted.
pub const CALLS: usize = 16;

/// The word that makes a program the one that is counted.
pub const CHILD: &str = "--child";

/// Filling and copying without string instructions, whatever the length.
const NO_REP: &str = "glibc.cpu.x86_rep_stosb_threshold=1000000000:\
                      glibc.cpu.x86_rep_movsb_threshold=1000000000";

/// Counts by name, or why there are none.
pub type Counts = Result<BTreeMap<String, f64>, String>;

/// Whether valgrind is here; else a line that says what is skipped.
pub fn is_here() -> bool {
    let found = Command::new("valgrind").arg("--version").output();
    if let Err(e) = &found {
        println!("instructions are not counted: valgrind does not run ({e})");
    }
    found.is_ok()
}

/// In the child: warms up, lets itself be counted and prints the name.
pub fn run(key: &str, call: &mut dyn FnMut(usize)) {
    count(call);
    println!("{key}");
}

/// Callgrind dumps what it collected at each return.
#[inline(never)]
fn count(call: &mut dyn FnMut(usize)) {
    (0..CALLS).for_each(&mut *call);
    counted(call);
}

/// What callgrind collects.
#[inline(never)]
fn counted(call: &mut dyn FnMut(usize)) {
    (0..CALLS).for_each(call);
}

/// A file of this process.
pub fn temporary(what: &str) -> PathBuf {
    std::env::temp_dir().join(format!("linkwork_counts_{}_{what}.txt", std::process::id()))
}

/// Runs a program under callgrind: instructions per call for each name that it prints, the fewest
/// where a name comes again.
pub fn callgrind(program: &Path, args: &[&str]) -> Counts {
    let path = temporary("callgrind");
    let out = Command::new("valgrind")
        .args(["--tool=callgrind", "--combine-dumps=yes"])
        .args(["--toggle-collect=*::callgrind::counted", "--dump-after=*::callgrind::count"])
        .args(["--toggle-collect=counted(*", "--dump-after=Measure::count(*"])
        .arg(format!("--callgrind-out-file={}", path.display()))
        .env("GLIBC_TUNABLES", NO_REP)
        .arg(program)
        .args(args)
        .output()
        .expect("valgrind runs");
    let found = std::fs::read_to_string(&path);
    std::fs::remove_file(&path).ok();
    let errors = String::from_utf8_lossy(&out.stderr);
    if !out.status.success() {
        let why = errors.lines().find(|l| l.contains("Unrecognised") || l.contains("unhandled"));
        return Err(why.unwrap_or("valgrind failed").to_owned());
    }
    let found = found.map_err(|e| e.to_string())?;
    let sums: Vec<f64> = found
        .lines()
        .filter_map(|l| l.strip_prefix("summary: "))
        .map(|x| x.trim().parse().expect("number"))
        .collect();
    let text = String::from_utf8_lossy(&out.stdout);
    let names = text.lines().filter(|l| !l.starts_with("dof "));
    let names: Vec<&str> = names.map(|l| l.split(' ').next().unwrap_or(l)).collect();
    if sums.len() < names.len() || sums[..names.len()].iter().any(|x| *x <= 0.0) {
        return Err(format!("{} sums for {} names: {sums:?}", sums.len(), names.len()));
    }
    let mut counts = BTreeMap::new();
    for (name, sum) in names.iter().zip(sums) {
        let count = sum / CALLS as f64;
        let best = counts.entry((*name).to_owned()).or_insert(count);
        *best = count.min(*best);
    }
    Ok(counts)
}
