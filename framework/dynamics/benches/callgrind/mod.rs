//! Instruction counts: a program runs itself, or the other library's benchmark, under callgrind.
//!
//! Both call each algorithm [`CALLS`] times to warm up, and then the same number of times inside a function `counted`. Callgrind collects only inside
//! this function and dumps its sum after each algorithm. The loop and its indirect call, about ten instructions, are included.
//!
//! Callgrind counts each byte that `rep stosb` fills as one instruction. Therefore the C library is configured to fill and copy with vector
//! instructions, which it does below two thousand bytes anyway.
//!
//! Valgrind 3.19 does not support the short form of `vmovq` between two registers. The profile `counts` avoids it in the code that builds mechanisms.
//! If a kernel contains it, the error message reports it.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Number of counted calls.
pub const CALLS: usize = 16;

/// Argument that makes a program the counted child process.
pub const CHILD: &str = "--child";

/// Settings that make the C library fill and copy without string instructions, for all lengths.
const NO_REP: &str = "glibc.cpu.x86_rep_stosb_threshold=1000000000:\
                      glibc.cpu.x86_rep_movsb_threshold=1000000000";

/// Counts by name, or the reason why there are none.
pub type Counts = Result<BTreeMap<String, f64>, String>;

/// Returns true if valgrind runs; otherwise prints what is skipped.
pub fn is_here() -> bool {
    let found = Command::new("valgrind").arg("--version").output();
    if let Err(e) = &found {
        println!("instructions are not counted: valgrind does not run ({e})");
    }
    found.is_ok()
}

/// In the child process: warms up, runs the counted calls and prints the name.
pub fn run(key: &str, call: &mut dyn FnMut(usize)) {
    count(call);
    println!("{key}");
}

/// Callgrind dumps its sum at each return of this function.
#[inline(never)]
fn count(call: &mut dyn FnMut(usize)) {
    (0..CALLS).for_each(&mut *call);
    counted(call);
}

/// Callgrind collects only inside this function.
#[inline(never)]
fn counted(call: &mut dyn FnMut(usize)) {
    (0..CALLS).for_each(call);
}

/// Returns the path of a temporary file of this process.
pub fn temporary(what: &str) -> PathBuf {
    std::env::temp_dir().join(format!("linkwork_counts_{}_{what}.txt", std::process::id()))
}

/// Runs a program under callgrind. Returns the instructions per call for each name that it prints, the smallest value if a name occurs again.
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
