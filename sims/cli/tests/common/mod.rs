//! Common code of the tests of the command line: the program, run in a temporary folder.
#![allow(clippy::unwrap_used)]
#![allow(dead_code)] // Each test file uses only some of the functions.
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};

static COUNT: AtomicU32 = AtomicU32::new(0);

/// A temporary folder for a run, removed at the end. It does not use a crate: a dependency of the tests alone changes the features of others, and
/// Rerun would be built twice.
pub struct Lab(PathBuf);

impl Drop for Lab {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Exit code and output of a command.
#[derive(Debug)]
pub struct Said {
    pub code: i32,
    pub out: String,
    pub err: String,
}

impl From<Output> for Said {
    fn from(o: Output) -> Said {
        Said {
            code: o.status.code().unwrap_or(-1),
            out: String::from_utf8_lossy(&o.stdout).into_owned(),
            err: String::from_utf8_lossy(&o.stderr).into_owned(),
        }
    }
}

impl Said {
    /// Asserts the exit code.
    #[track_caller]
    pub fn code(self, wanted: i32) -> Said {
        assert_eq!(self.code, wanted, "{}\n{}", self.out, self.err);
        self
    }
    /// Asserts that standard error contains all of these.
    #[track_caller]
    pub fn tells(self, wanted: &[&str]) -> Said {
        for w in wanted {
            assert!(self.err.contains(w), "`{w}` is not said:\n{}", self.err);
        }
        self
    }
}

impl Lab {
    pub fn new() -> Lab {
        let name =
            format!("linkwork-{}-{}", std::process::id(), COUNT.fetch_add(1, Ordering::Relaxed));
        let folder = std::env::temp_dir().join(name);
        std::fs::create_dir_all(&folder).unwrap();
        Lab(folder)
    }
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.join(name)
    }
    pub fn write(&self, name: &str, text: &str) -> String {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(&path, text).unwrap();
        name.to_string()
    }
    pub fn command(&self, args: &[&str]) -> Command {
        let mut c = Command::new(env!("CARGO_BIN_EXE_linkwork"));
        c.args(args).current_dir(&self.0).stdin(Stdio::null());
        c
    }
    pub fn linkwork(&self, args: &[&str]) -> Said {
        self.command(args).output().unwrap().into()
    }
    /// Runs `run sim --out out --save-rrd off` with more arguments.
    pub fn run(&self, sim: &str, out: &str, more: &[&str]) -> Said {
        let head = ["run", sim, "--out", out, "--save-rrd", "off"];
        self.linkwork(&[&head, more].concat())
    }
    /// Runs `resume` in the same way.
    pub fn resume(&self, from: &str, out: &str, more: &[&str]) -> Said {
        let head = ["resume", from, "--out", out, "--save-rrd", "off"];
        self.linkwork(&[&head, more].concat())
    }
    pub fn spawn(&self, args: &[&str]) -> Child {
        self.command(args).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
    }
    /// Returns the summary.json of a run.
    pub fn summary(&self, out: &str) -> serde_json::Value {
        let text = std::fs::read_to_string(self.path(out).join("summary.json")).unwrap();
        serde_json::from_str(&text).unwrap()
    }
    pub fn hash(&self, out: &str) -> String {
        self.summary(out)["state_hash"].as_str().unwrap().to_string()
    }
    /// Returns the files and folders here, sorted.
    pub fn files(&self) -> Vec<String> {
        names(&self.0)
    }
}

/// A small file system in memory.
pub struct Small(PathBuf);

impl Small {
    /// Returns `None` if this process does not have the right to mount one.
    pub fn mount(at: PathBuf, size: &str) -> Option<Small> {
        std::fs::create_dir_all(&at).unwrap();
        let options = format!("size={size}");
        let done =
            Command::new("mount").args(["-t", "tmpfs", "-o", &options, "small"]).arg(&at).output();
        done.is_ok_and(|o| o.status.success()).then_some(Small(at))
    }
}

impl Drop for Small {
    fn drop(&mut self) {
        let _ = Command::new("umount").arg(&self.0).output();
    }
}

/// Sends a signal by its name.
pub fn signal(child: &Child, name: &str) {
    let sent = Command::new("kill").args([&format!("-{name}"), &child.id().to_string()]).status();
    assert!(sent.unwrap().success());
}

/// Returns the number of kills in a test: `least`, or 100 where `.ci/verify kills` runs it.
pub fn kills(least: usize) -> usize {
    size(least, 100)
}

/// Returns the size of a test: `short`, or `long` where `.ci/verify` runs it (`LINKWORK_VERIFY`).
pub fn size(short: usize, long: usize) -> usize {
    if std::env::var_os("LINKWORK_VERIFY").is_some() { long } else { short }
}

/// `kill -9`.
pub fn killed(child: &mut Child) {
    child.kill().unwrap();
    child.wait().unwrap();
}

/// Waits until a file exists.
#[track_caller]
pub fn wait_for(path: &Path) {
    for _ in 0..1500 {
        if path.exists() {
            return;
        }
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    panic!("`{}` does not come", path.display());
}

/// Returns the names in a folder, sorted.
pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut all: Vec<String> =
        entries.map(|e| e.unwrap().file_name().to_string_lossy().into_owned()).collect();
    all.sort();
    all
}

/// The repository.
pub fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Returns the path of a simulation of the repository.
pub fn sim(name: &str) -> String {
    root().join("sims").join(name).display().to_string()
}

/// A pendulum and a chain of signals. Tests assert lines and columns: keep the layout.
pub const BASE: &str = r#"Simulation(
    bodies: {
        "bob": (
            parent: "world", hinge: Pin([0, 1, 0]), initial: (angle: "60 deg"),
            mass: "1 kg", com: [0, 0, -1], inertia: Sphere(0.1),
        ),
    },
    parts: {
        "Gravity": (model: "environment.uniform_gravity", params: { "acceleration": [0, 0, -9.80665] }),
        "Friction": (model: "actuators.spring_damper", params: { "damping": 0.05 }, bind: { "shaft": "hinge:bob" }),
        "Source": (model: "basics.constant", params: { "value": 1 }),
        "Gain": (model: "basics.gain", params: { "k": 2 }),
        "Lag": (model: "basics.lag", params: { "time_constant": "1 s" }),
    },
    wires: ["Source.y -> Gain.u", "Gain.y -> Lag.u"],
    until: "1 s",
    log: [(channels: ["**"], rate: "100 Hz")],
    metrics: { "largest speed": (of: "bob.rate", take: "max", unit: "rad/s") },
    plots: [(title: "Angle", of: ["bob.angle"], unit: "deg")],
    view: (follow: "bob", rate: "20 Hz"),
)
"#;

/// Returns [`BASE`] with some pieces replaced; each piece must exist.
#[track_caller]
pub fn edited(edits: &[(&str, &str)]) -> String {
    edits.iter().fold(BASE.to_string(), |text, (from, to)| {
        assert!(text.contains(from), "`{from}` is not in the base text");
        text.replacen(from, to, 1)
    })
}
