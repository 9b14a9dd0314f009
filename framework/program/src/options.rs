//! Options of a run, and parsing of times.
use crate::exit;
use clap::Args;
use linkwork_runtime::{Seconds, Value};
use std::path::PathBuf;

/// Options of a run.
#[derive(Args, Clone, Debug, Default)]
pub struct RunOptions {
    /// Simulated time at which to stop, e.g. 20, "20 s", "2 min".
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub until: Option<String>,
    /// Folder for the files (default: `runs/NAME`).
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Write a checkpoint at this interval of simulated time, e.g. "10 s", 1/3.
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    pub checkpoint_every: Option<String>,
    /// Keep only the last N periodic checkpoints.
    #[arg(long, value_name = "N", requires = "checkpoint_every", value_parser = clap::value_parser!(u32).range(1..))]
    pub keep: Option<u32>,
    /// Also stream to a running Rerun viewer (default address: that of a local viewer).
    #[arg(long, value_name = "URL", num_args = 0..=1, default_missing_value = "")]
    pub rerun: Option<String>,
    /// File of the Rerun recording; `off` disables it.
    #[arg(long, value_name = "FILE|off")]
    pub save_rrd: Option<String>,
    /// Pin a variable to a value (default: its present value) from the first tick on and for every reader (repeatable; patterns with a star): --pin
    /// Motor.current="2 A" --pin 'Wheel*.rate'. `linkwork attach` can unpin it.
    #[arg(long = "pin", value_name = "PATH[=VALUE]")]
    pub pin: Vec<String>,
    /// Unpin variables that are pinned in the checkpoint (repeatable; patterns with a star), before --pin.
    #[arg(long = "unpin", value_name = "PATH")]
    pub unpin: Vec<String>,
    /// Do not write an MCAP log.
    #[arg(long)]
    pub no_log: bool,
    /// Let `linkwork attach` and Python watch and control the run through a socket (default: 127.0.0.1 and any free port). Address and token are
    /// written to live.json in the folder of the run.
    #[arg(long, value_name = "HOST:PORT", num_args = 0..=1, default_missing_value = "127.0.0.1:0")]
    pub serve: Option<String>,
    /// Print the wall time by part and operation, and write it as folded stacks for flame graphs. The run is slower, but its results are
    /// bit-identical.
    #[arg(long)]
    pub profile: bool,
    /// Limit the run to real time, or to this number of simulated seconds per second: 0.5, 10. The summary reports the lateness of ticks.
    #[arg(long, value_name = "FACTOR", num_args = 0..=1, default_missing_value = "1", value_parser = factor)]
    pub realtime: Option<f64>,
    /// No progress bar and no summary on the terminal.
    #[arg(long, short)]
    pub quiet: bool,
    /// Print for each transition the parts and bodies that change, and momentum and energy before and after.
    #[arg(long, short)]
    pub verbose: bool,
}

/// Slowest and fastest pace.
const FACTORS: std::ops::RangeInclusive<f64> = 1e-6..=1e6;

/// Parses a multiple of real time.
fn factor(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|f| FACTORS.contains(f)).ok_or_else(|| {
        let (least, most) = (FACTORS.start(), FACTORS.end());
        format!("write a number from {least} to {most}, or no value for 1")
    })
}

/// Parses a time of an option. Prints an error and returns the exit code if it is wrong.
pub fn time(text: &str, what: &str) -> Result<Seconds, u8> {
    let read = fraction(text).or_else(|| {
        let number = text.parse::<f64>();
        let value = number.map_or_else(|_| Value::Text(text.to_string()), Value::Number);
        match &value {
            Value::Number(x) => (*x >= 0.0).then(|| Seconds::from_decimal(*x)).flatten(),
            // Reject a rate, because as a time "2 Hz" would mean half a second.
            text => Seconds::period(text).ok().filter(|_| !value.to_string().contains("Hz")),
        }
    });
    read.ok_or_else(|| {
        tell!("error: {what} `{text}` is not a time\n  help: write 20, \"20 s\", \"2 min\" or 1/3");
        exit::INPUT
    })
}

/// `1/3`, `1/3 s`.
fn fraction(text: &str) -> Option<Seconds> {
    let (num, den) = text.trim().trim_end_matches('s').trim_end().split_once('/')?;
    Seconds::new(num.trim().parse::<u64>().ok()?.into(), den.trim().parse::<u64>().ok()?.into())
}

/// Parses a period of checkpoints: a positive time.
pub fn period(text: &str, what: &str) -> Result<Seconds, u8> {
    let period = time(text, what)?;
    if period.num == 0 {
        tell!("error: {what} is zero\n  help: write 10, \"10 s\" or \"2 min\"");
        return Err(exit::INPUT);
    }
    Ok(period)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn factors_are_numbers_above_zero() {
        assert_eq!((factor("0.5"), factor("1e6")), (Ok(0.5), Ok(1e6)));
        for wrong in ["0", "-1", "nan", "inf", "1e7", "sims/pendulum", ""] {
            assert!(factor(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn times_are_exact() {
        let third = Ok(Seconds { num: 1, den: 3 });
        assert_eq!(
            (time("1/3", "x"), time("1/3 s", "x"), time("2 / 6", "x")),
            (third, third, third)
        );
        assert_eq!(time("0.1", "x"), Ok(Seconds { num: 1, den: 10 }));
        assert_eq!(time("2 min", "x"), Ok(Seconds { num: 120, den: 1 }));
        for wrong in ["1/0", "2 Hz", "-1", "nan", "1/3 m", "/", "1/-3", ""] {
            assert_eq!(time(wrong, "x"), Err(exit::INPUT), "{wrong}");
        }
        assert_eq!(period("0", "x"), Err(exit::INPUT));
    }
}
