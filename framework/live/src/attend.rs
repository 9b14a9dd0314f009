//! Processing of client requests between two ticks of the run.
//!
//! ```text
//! step → requests, client by client in the order of their arrival → samples of the tick → step
//! ```
//! Requests of one client are processed in their order. A changed variable is in the samples of its tick. The log contains the change before these
//! samples, so a replay repeats it.
use crate::protocol::{Amount, Reply, ReplyKind, Request, RequestKind};
use crate::server::{Guest, Row, Server};
use linkwork_assembly::Text;
use linkwork_assembly::patterns::match_patterns;
use linkwork_runner::{Runner, Watch, time_name};
use linkwork_runtime::{Change, Origin, Place, Value, Variable};
use std::time::{Duration, Instant};

/// Largest number of requests of one client between two ticks.
const AT_ONCE: usize = 16;
/// Interval between two checks for requests while the run is paused.
const NAP: Duration = Duration::from_millis(2);
/// Largest and smallest sample rate of a watch, Hz.
const FASTEST: f64 = 1000.0;
const SLOWEST: f64 = 1e-4;
/// Largest number of patterns of a list, and of bytes of a pattern, because matching delays the run.
const MOST_PATTERNS: usize = 64;
const LONGEST_PATTERN: usize = 256;
/// Largest number of steps in one request.
const MOST_STEPS: u64 = 1_000_000_000;

/// A served run: its clients, and whether it is paused.
pub struct Live {
    server: Server,
    clients: Vec<Served>,
    paused: bool,
    /// Remaining steps until it pauses again.
    steps: u64,
}

/// State of a client.
struct Served {
    guest: Guest,
    watch: Option<Rows>,
    /// A pending request for steps.
    stepping: Option<u64>,
    gone: bool,
}

/// The variables that a client watches.
struct Rows {
    id: u64,
    places: Vec<Place>,
    period: Duration,
    next: Instant,
    lost: u64,
}

/// A rejected request: reason and remedy.
struct No {
    message: String,
    help: String,
}

fn no<T>(message: impl Into<String>, help: impl Into<String>) -> Result<T, No> {
    Err(No { message: message.into(), help: help.into() })
}

/// The wall clock determines when samples are sent to clients, never their content.
#[allow(clippy::disallowed_methods)]
fn now() -> Instant {
    Instant::now()
}

impl Live {
    /// Begins to serve a run.
    pub fn new(server: Server) -> Live {
        Live { server, clients: Vec::new(), paused: false, steps: 0 }
    }

    /// Returns the socket.
    pub fn server(&self) -> &Server {
        &self.server
    }

    /// Returns whether a client is connected, so that the run must be attended often.
    pub fn is_attended(&self) -> bool {
        !self.clients.is_empty()
    }

    /// Processes the requests of clients at the present tick, before its samples are taken. Waits while the run is paused. Returns the number of
    /// steps to make now, at most `most`, and whether the run was paused before.
    pub fn attend<W: Watch>(&mut self, runner: &mut Runner<W>, most: u64) -> (u64, bool) {
        let stop = runner.stop();
        let mut stood = false;
        loop {
            while let Ok(guest) = self.server.fresh.try_recv() {
                self.clients.push(Served { guest, watch: None, stepping: None, gone: false });
            }
            if self.steps == 0 {
                self.answer_steps(runner.sim().time());
            }
            for k in 0..self.clients.len() {
                self.requests(k, runner);
            }
            self.rows(runner);
            self.clients.retain(|c| !c.gone);
            if stop.is_set() {
                return (most.min(1), stood);
            }
            if !self.paused {
                return (most, stood);
            }
            if self.steps > 0 {
                let n = self.steps.min(most);
                self.steps -= n;
                return (n, stood);
            }
            stood = true;
            std::thread::sleep(NAP);
        }
    }

    fn answer_steps(&mut self, time: f64) {
        for client in &mut self.clients {
            if let Some(id) = client.stepping.take() {
                client.answer(id, ReplyKind::Done { time });
            }
        }
    }

    /// Reports the end of the run to clients that wait for steps.
    pub fn finish(&mut self, time: f64) {
        let message = format!("the run has ended at {time} s");
        self.not_stepped(&message, "its results are in its folder");
    }

    /// Rejects the pending steps because of a request of another client.
    fn overridden(&mut self, by: &str) {
        if self.steps > 0 {
            let message = format!("`{by}` of another client interrupted the steps");
            self.not_stepped(&message, "ask again");
        }
    }

    /// Rejects the pending requests for steps.
    fn not_stepped(&mut self, message: &str, help: &str) {
        for client in &mut self.clients {
            if let Some(id) = client.stepping.take() {
                let (message, help) = (message.to_string(), help.to_string());
                client.answer(id, ReplyKind::Refused { message, help });
            }
        }
    }

    fn requests<W: Watch>(&mut self, k: usize, runner: &mut Runner<W>) {
        for _ in 0..AT_ONCE {
            let client = &mut self.clients[k];
            if client.gone || client.stepping.is_some() {
                return;
            }
            match client.guest.next() {
                Ok(Some(request)) => self.request(k, request, runner),
                Ok(None) => return,
                Err(()) => {
                    self.clients[k].gone = true;
                    return;
                }
            }
        }
    }

    fn request<W: Watch>(&mut self, k: usize, request: Request, runner: &mut Runner<W>) {
        let Request { id, ask } = request;
        let time = runner.sim().time();
        let said = match ask {
            RequestKind::Pause => {
                self.overridden("pause");
                (self.paused, self.steps) = (true, 0);
                Ok(ReplyKind::Done { time })
            }
            RequestKind::Go => {
                self.overridden("go");
                (self.paused, self.steps) = (false, 0);
                Ok(ReplyKind::Done { time })
            }
            RequestKind::Step { steps } if steps <= MOST_STEPS => {
                self.overridden("step");
                (self.paused, self.steps) = (true, steps);
                self.clients[k].stepping = Some(id);
                return;
            }
            RequestKind::Step { steps } => {
                no(format!("{steps} steps are too many"), format!("request at most {MOST_STEPS}"))
            }
            RequestKind::Quit => {
                runner.stop().set();
                Ok(ReplyKind::Done { time })
            }
            RequestKind::Watch { paths, rate } => self.watch(k, id, &paths, rate, runner),
            ask => answer(ask, runner),
        };
        let said = said.unwrap_or_else(|No { message, help }| ReplyKind::Refused { message, help });
        self.clients[k].answer(id, said);
    }

    fn watch<W: Watch>(
        &mut self,
        k: usize,
        id: u64,
        paths: &[String],
        rate: f64,
        runner: &Runner<W>,
    ) -> Result<ReplyKind, No> {
        if !(SLOWEST..=FASTEST).contains(&rate) {
            let help = format!("give one from {SLOWEST} to {FASTEST} Hz");
            return no(format!("the rate is {rate} Hz"), help);
        }
        let places = places(paths, runner)?;
        let rows =
            Rows { id, places, period: Duration::from_secs_f64(1.0 / rate), next: now(), lost: 0 };
        self.clients[k].watch = (!rows.places.is_empty()).then_some(rows);
        Ok(ReplyKind::Done { time: runner.sim().time() })
    }

    /// Sends the samples that are due at the present tick.
    fn rows<W: Watch>(&mut self, runner: &Runner<W>) {
        if self.clients.iter().all(|c| c.watch.is_none()) {
            return;
        }
        let at = now();
        for client in &mut self.clients {
            let Some(rows) = client.watch.as_mut().filter(|rows| at >= rows.next) else { continue };
            // Missed samples are not repeated.
            rows.next = (rows.next + rows.period).max(at);
            let sent = client.guest.row(rows.id, row(&rows.places, rows.lost, runner));
            rows.lost += u64::from(!sent);
        }
    }
}

impl Served {
    /// An answer that does not fit into the queue ends the connection, because the client does not read.
    fn answer(&mut self, id: u64, said: ReplyKind) {
        self.gone |= !self.guest.send(&Reply { id, said });
    }
}

/// Answers requests other than pause and watch.
fn answer<W: Watch>(ask: RequestKind, runner: &mut Runner<W>) -> Result<ReplyKind, No> {
    match ask {
        RequestKind::List { patterns } => list(&patterns, runner),
        RequestKind::Get { paths } => Ok(row(&places(&paths, runner)?, 0, runner).said()),
        RequestKind::Set { path, value } => change(runner, &path, Change::Set, Some(value)),
        RequestKind::Pin { path, value } => change(runner, &path, Change::Pin, value),
        RequestKind::Unpin { path } => change(runner, &path, Change::Unpin, None),
        RequestKind::Pins => {
            let sim = runner.sim();
            let values = sim.pins().map(|(path, value)| (path.to_string(), value)).collect();
            Ok(ReplyKind::Pins { time: sim.time(), values })
        }
        RequestKind::Checkpoint => checkpoint(runner),
        _ => no("hello is only allowed as the first message", "send hello once, at the start"),
    }
}

fn change<W: Watch>(
    runner: &mut Runner<W>,
    pattern: &str,
    change: Change,
    value: Option<Amount>,
) -> Result<ReplyKind, No> {
    if pattern.len() > LONGEST_PATTERN {
        return no("the pattern is too long", format!("give at most {LONGEST_PATTERN} bytes"));
    }
    let value = value.map(Value::from);
    let values = runner
        .change(pattern, change, value.as_ref())
        .map_err(|e| No { message: e.message, help: e.help })?;
    Ok(ReplyKind::Changed { time: runner.sim().time(), values })
}

fn variable<'a, W: Watch>(path: &str, runner: &'a Runner<W>) -> Result<&'a Variable, No> {
    runner.sim().variable(path).map_err(|e| No { message: e.message, help: e.help })
}

fn places<W: Watch>(paths: &[String], runner: &Runner<W>) -> Result<Vec<Place>, No> {
    paths.iter().map(|path| Ok(variable(path, runner)?.place)).collect()
}

fn row<W: Watch>(places: &[Place], lost: u64, runner: &Runner<W>) -> Row {
    let sim = runner.sim();
    let values = places.iter().map(|place| sim.value(*place)).collect();
    Row { time: sim.time(), values, lost }
}

fn list<W: Watch>(patterns: &[String], runner: &Runner<W>) -> Result<ReplyKind, No> {
    let long = patterns.iter().any(|p| p.len() > LONGEST_PATTERN);
    if patterns.len() > MOST_PATTERNS || long {
        let fact = "there are too many patterns, or a pattern is too long";
        return no(
            fact,
            format!("give at most {MOST_PATTERNS} of at most {LONGEST_PATTERN} bytes"),
        );
    }
    let known = &runner.sim().plan().variables;
    let names: Vec<&String> = known.keys().collect();
    let text = |p: &String| Text { text: p.clone(), origin: Origin::NONE };
    let texts: Vec<Text> = patterns.iter().map(text).collect();
    let found = match_patterns(&texts, &names).map_err(|faults| {
        let first = faults.into_iter().next();
        let (message, help) = first.map_or_else(Default::default, |f| (f.message, f.help));
        No { message, help: help.unwrap_or_default() }
    })?;
    let one = |k: usize| (names[k].clone(), known[names[k]].unit.to_string());
    Ok(ReplyKind::Names { names: found.into_iter().map(one).collect() })
}

fn checkpoint<W: Watch>(runner: &mut Runner<W>) -> Result<ReplyKind, No> {
    let name = format!("checkpoint_{}.lwck", time_name(runner.sim().time()));
    let before = runner.saves().map_or(0, |s| s.failed);
    runner.save(&name);
    let Some(saves) = runner.saves() else {
        return no("this run does not write checkpoints", "start it with `linkwork run`");
    };
    match saves.written.last() {
        Some(file) if saves.failed == before => {
            Ok(ReplyKind::Checkpoint { file: file.display().to_string() })
        }
        _ => no("the checkpoint cannot be written", "see the output of the run; free disk space"),
    }
}
