//! `--profile`: the wall time of a run by operation, as a table and as folded stacks.
use linkwork_runtime::{Profile, Spent};
use std::fmt::Write;
use std::path::Path;

/// Name of the file, in the folder of the summary.
pub const FILE: &str = "profile.folded";

/// Number of lines of the table; the rest is summed up in one line.
const LINES: usize = 30;

/// Time in the operations of parts, and in everything else, for a run of `wall` seconds.
struct Times {
    spent: Vec<Spent>,
    /// Integrator, sums at inputs, solved loops, samples of logs, metrics, and reading the clock.
    rest: f64,
    /// Estimated time for reading the clock.
    clock: f64,
}

impl Times {
    fn of(profile: &Profile, wall: f64) -> Times {
        let spent = profile.spent();
        let parts: f64 = spent.iter().map(|s| s.seconds).sum();
        let calls: u64 = spent.iter().map(|s| s.calls).sum();
        Times { spent, rest: (wall - parts).max(0.0), clock: calls as f64 * Profile::clock() }
    }
}

/// Prints the table.
pub fn print(profile: &Profile, wall: f64) {
    let Times { spent, rest, clock } = Times::of(profile, wall);
    let line = |seconds: f64, calls: &str, each: &str, what: &str| {
        let share = 100.0 * seconds / wall.max(1e-9);
        say!("  {share:>5.1} % {seconds:>10.4} s {calls:>12} {each:>10}  {what}");
    };
    say!("distribution of {wall:.2} s of wall time:");
    say!("    share       time        calls    ns each  part, operation");
    let each = |s: &Spent| format!("{:.0}", s.seconds * 1e9 / s.calls as f64);
    for s in spent.iter().take(LINES) {
        let what = format!("{} {}", s.part, s.operation);
        line(s.seconds, &s.calls.to_string(), &each(s), &what);
    }
    if let Some(more) = spent.get(LINES..).filter(|m| !m.is_empty()) {
        let (seconds, calls) = (more.iter().map(|s| s.seconds).sum(), more.iter().map(|s| s.calls));
        line(seconds, &calls.sum::<u64>().to_string(), "", &format!("{} more", more.len()));
    }
    line(
        rest,
        "",
        "",
        "everything else: integrator, sums, solved loops, samples, metrics, and reading the clock",
    );
    line(clock, "", "", "  of which about this for reading the clock");
}

/// Writes the stacks: a line `SIMULATION;ASSEMBLY;..;PART;OPERATION MICROSECONDS` each, as flame graph tools read them.
///
/// # Errors
/// A message with the path.
pub fn write(profile: &Profile, wall: f64, name: &str, path: &Path) -> Result<(), String> {
    let times = Times::of(profile, wall);
    // In this format, a semicolon separates frames, and the last space precedes the number.
    let frame = |text: &str| text.replace([';', '\n'], "_");
    let mut text = String::new();
    let micro = |s: f64| (s * 1e6).round() as u64;
    for s in &times.spent {
        let part: Vec<String> = s.part.split('.').map(frame).collect();
        let stack = format!("{};{};{}", frame(name), part.join(";"), s.operation);
        let _ = writeln!(text, "{stack} {}", micro(s.seconds));
    }
    let _ = writeln!(text, "{};(rest) {}", frame(name), micro(times.rest));
    linkwork_record::replace(path, text.as_bytes(), linkwork_record::Durable::Now)
}
