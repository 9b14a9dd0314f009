//! `linkwork doctor`: relevant properties of this machine and this build, and what could be improved.
use crate::exit;
use std::process::{Command, Stdio};

/// The version of Rerun that can read the recordings.
const VIEWER: &str = "0.36.3";

/// A line of the report: subject, state, and a remedy if there is one.
struct Finding {
    what: &'static str,
    is: String,
    help: Option<String>,
}

impl Finding {
    fn of(what: &'static str, is: impl Into<String>) -> Finding {
        Finding { what, is: is.into(), help: None }
    }
    fn help(mut self, help: impl Into<String>) -> Finding {
        self.help = Some(help.into());
        self
    }
}

/// Reports on processor, memory, build, viewer and Python.
pub fn doctor() -> u8 {
    let findings = [
        processor(),
        instructions(),
        cores(),
        memory(),
        build(),
        features(),
        rust(),
        viewer(),
        python(),
    ];
    for Finding { what, is, help } in findings {
        say!("{what:<14} {is}");
        if let Some(help) = help {
            say!("{:<14}   help: {help}", "");
        }
    }
    exit::OK
}

/// Returns the value in the first line of a system file that begins with `key`.
fn line_of(file: &str, key: &str) -> Option<String> {
    let text = std::fs::read_to_string(file).ok()?;
    let line = text.lines().find(|l| l.starts_with(key))?;
    Some(line.split_once(':')?.1.trim().to_string())
}

fn processor() -> Finding {
    let name = line_of("/proc/cpuinfo", "model name");
    Finding::of("processor", name.unwrap_or_else(|| std::env::consts::ARCH.to_string()))
}

/// Compares the instructions of the build with those of the processor.
fn instructions() -> Finding {
    let built = if cfg!(target_feature = "avx2") {
        "AVX2 and FMA"
    } else {
        "any processor of this architecture"
    };
    let is = format!("built for {built}");
    #[cfg(target_arch = "x86_64")]
    if !cfg!(target_feature = "avx2") && std::arch::is_x86_feature_detected!("avx2") {
        return Finding::of("instructions", format!("{is}; this one has AVX2"))
            .help("build without your own RUSTFLAGS: `.cargo/config.toml` enables AVX2");
    }
    Finding::of("instructions", is)
}

fn cores() -> Finding {
    match std::thread::available_parallelism() {
        Ok(n) if n.get() == 1 => Finding::of("cores", "1").help(
            "logs, recordings and campaigns run in parallel to a simulation: two cores are faster",
        ),
        Ok(n) => Finding::of("cores", n.to_string()),
        Err(e) => Finding::of("cores", format!("unknown: {e}")),
    }
}

fn memory() -> Finding {
    let free = line_of("/proc/meminfo", "MemAvailable");
    let kib = free.and_then(|text| text.trim_end_matches(" kB").trim().parse::<f64>().ok());
    Finding::of(
        "memory",
        match kib {
            Some(kib) => format!("{:.1} GiB free", kib / (1024.0 * 1024.0)),
            None => "unknown".into(),
        },
    )
}

fn build() -> Finding {
    let version = env!("CARGO_PKG_VERSION");
    if cfg!(debug_assertions) {
        Finding::of("build", format!("linkwork {version}, for development"))
            .help("`cargo run --release` simulates faster")
    } else {
        Finding::of("build", format!("linkwork {version}, release"))
    }
}

fn features() -> Finding {
    if cfg!(feature = "viewer") {
        Finding::of("recordings", format!("for Rerun {VIEWER}"))
    } else {
        Finding::of("recordings", "none: built without the feature `viewer`")
            .help("build without `--no-default-features`, or open the log in Rerun or Foxglove")
    }
}

/// Returns the first line that a program prints, if the program exists.
fn says(program: &str, arguments: &[&str]) -> Option<String> {
    let run = Command::new(program)
        .args(arguments)
        .stdin(Stdio::null())
        .stderr(Stdio::null())
        .output()
        .ok()
        .filter(|out| out.status.success())?;
    let text = String::from_utf8_lossy(&run.stdout);
    text.lines().next().map(|line| line.trim().to_string())
}

fn rust() -> Finding {
    let wanted = env!("CARGO_PKG_RUST_VERSION");
    match says("rustc", &["--version"]) {
        Some(version) => Finding::of("Rust", format!("{version}; {wanted} or newer is needed")),
        None => Finding::of("Rust", "not found").help("only needed to build; rustup installs it"),
    }
}

fn viewer() -> Finding {
    let help = format!("pip install rerun-sdk=={VIEWER}");
    match says("rerun", &["--version"]) {
        Some(version) if version.contains(VIEWER) => Finding::of("viewer", version),
        Some(version) => {
            Finding::of("viewer", format!("{version}; recordings are for {VIEWER}")).help(help)
        }
        None => Finding::of("viewer", "Rerun not found").help(help),
    }
}

fn python() -> Finding {
    let Some(version) = says("python3", &["--version"]) else {
        return Finding::of("Python", "not found").help("only needed for the Python package");
    };
    let asked = "import linkwork; print(linkwork.__version__)";
    match says("python3", &["-c", asked]) {
        Some(package) => Finding::of("Python", format!("{version}, with linkwork {package}")),
        None => Finding::of("Python", format!("{version}, without linkwork"))
            .help("in a virtual environment: pip install ./sims/python"),
    }
}
