//! `linkwork campaign`: many runs with drawn values, progress on the terminal, tables and a report; repetition of any single run.
use crate::options::RunOptions;
use crate::voice::report;
use crate::{exit, load, run};
use clap::Args;
use indicatif::{ProgressBar, ProgressStyle};
use linkwork_campaign::{
    Campaign, Cause, Folder, Journal, JournalError, LoadError, Orders, Outcome, Progress, Results,
    end, execute, few,
};
use linkwork_runner::Stop;
use linkwork_runtime::doc::number;
use std::io::IsTerminal;
use std::path::{Path, PathBuf};

/// Options of a campaign.
#[derive(Args, Clone, Debug, Default)]
pub struct CampaignOptions {
    /// Folder for the files (default: `runs/NAME`). Runs in it that have ended are not repeated.
    #[arg(long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Number of threads (default: one per core).
    #[arg(long, value_name = "N")]
    pub threads: Option<usize>,
    /// Repeat only this run, bit-identically; its files are written into OUT/run_N.
    #[arg(long, value_name = "N")]
    pub run: Option<u64>,
    /// With --run: write its log and recording.
    #[arg(long, requires = "run")]
    pub log: bool,
    /// No progress bar and no summary on the terminal.
    #[arg(long, short)]
    pub quiet: bool,
}

/// `linkwork campaign FILE`.
pub fn campaign(file: &Path, options: &CampaignOptions) -> u8 {
    let library = load::library();
    let campaign = match Campaign::read(file, &library) {
        Ok(campaign) => campaign,
        Err(failure) => return report(&failure),
    };
    let (warnings, sources) = campaign.warnings();
    load::warn_of(warnings, sources);
    let out = options.out.clone();
    let out = out.unwrap_or_else(|| PathBuf::from("runs").join(&campaign.form().name));
    if let Some(run) = options.run {
        return again(&campaign, run, &out, options);
    }
    if options.threads == Some(0) {
        tell!("error: --threads is 0\n  help: write 1 or more, or omit it");
        return exit::INPUT;
    }
    let mut folder = match Folder::open(&out, &campaign) {
        Ok(folder) => folder,
        Err(e) => {
            tell!("error: {e}");
            return exit::INPUT;
        }
    };
    for (line, why) in &folder.journal.damaged {
        tell!(
            "warning: the journal `{}`, line {line}: {why}\n  help: this run is repeated, and all others are kept",
            Folder::journal_in(&out).display()
        );
    }
    let stop = Stop::default();
    let asked = stop.clone();
    // This fails only if a handler is already set (several campaigns in one process).
    let _ = ctrlc::set_handler(move || {
        if asked.set() {
            std::process::exit(i32::from(exit::STOPPED));
        }
    });
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let orders =
        Orders { library: &library, threads: options.threads.unwrap_or(cores), stop: stop.clone() };
    let bar = bar(campaign.form().runs, options.quiet);
    let mut before = None;
    let ended = execute(&campaign, &orders, &mut folder, |p| {
        if before.is_none() && p.done > 0 && !options.quiet {
            let journal = Folder::journal_in(&out);
            bar.suspend(|| say!("{} runs have ended already, in `{}`", p.done, journal.display()));
        }
        before.get_or_insert(p.done);
        show(&bar, p);
    });
    bar.finish_and_clear();
    // The results are written even if the campaign cannot continue.
    let (results, written) = folder.write(&campaign, orders.threads);
    if !options.quiet {
        let files = written.as_deref().unwrap_or_default();
        summary(&campaign, &folder.journal, &results, files);
    }
    if let Err(e) = &written {
        tell!("error: {e}\n  help: correct this and repeat the command; completed runs are kept");
    }
    match ended {
        Err(e) => {
            tell!("error: {e}");
            exit::FAILED
        }
        _ if written.is_err() => exit::FAILED,
        Ok(false) => {
            let file = file.display();
            tell!("stopped; continue with: linkwork campaign {file} --out {}", out.display());
            exit::STOPPED
        }
        Ok(true) if results.failures.is_empty() => exit::OK,
        Ok(true) => exit::FAILED,
    }
}

fn bar(runs: u64, quiet: bool) -> ProgressBar {
    if quiet || !std::io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let bar = ProgressBar::new(runs);
    // The template is a valid constant.
    if let Ok(style) = ProgressStyle::with_template("{bar:40} {pos}/{len} runs  {msg}") {
        bar.set_style(style);
    }
    bar
}

fn show(bar: &ProgressBar, p: &Progress) {
    bar.set_position(p.done);
    let left = p.left.map_or(String::new(), |left| {
        let s = left.as_secs();
        format!("  {}:{:02}:{:02} left", s / 3600, s / 60 % 60, s % 60)
    });
    bar.set_message(format!("{} failed{left}", p.failed));
}

fn summary(campaign: &Campaign, journal: &Journal, results: &Results, files: &[PathBuf]) {
    let (form, done) = (campaign.form(), journal.outcomes.len());
    say!("{}: {done} of {} runs have ended", form.name, form.runs);
    for (cause, n) in &results.causes {
        say!("  {n:8} {}", cause.name());
    }
    let width = results.metrics.iter().map(|f| f.0.chars().count()).max().unwrap_or(0);
    for ((metric, unit, _), s) in results.metrics.iter().zip(&results.summaries) {
        if s.n == 0 {
            say!("  {metric:width$}  no run has a value");
            continue;
        }
        let [_, _, p5, _, median, _, p95, _, _] = s.percentiles;
        say!(
            "  {metric:width$}  {:.6} ± {:.3} {unit}   5 %: {p5:.6}   50 %: {median:.6}   95 %: {p95:.6}",
            s.mean,
            s.deviation
        );
    }
    for f in &results.ellipses {
        let [(a, unit, _), (b, ..)] = f.of.map(|k| &results.metrics[k]);
        let ((long, short), (inside, n)) = (f.half_axes(), f.within);
        let unit = if unit.is_empty() { String::new() } else { format!(" {unit}") };
        say!(
            "  99 % ellipse of {a}, {b}: half axes {} and {}{unit}; it contains {inside} of {n} runs",
            number(long),
            number(short)
        );
    }
    if !results.missed.is_empty() {
        let (share, interval) = results.success();
        let interval = interval.map_or_else(String::new, |[from, to]| {
            format!(" ({:.1} to {:.1} % with 95 % confidence)", 100.0 * from, 100.0 * to)
        });
        say!(
            "  {} of {done} satisfied all requirements: {:.1} %{interval}",
            results.kept,
            100.0 * share
        );
    }
    for m in results.missed.iter().filter(|m| !m.runs.is_empty()) {
        let share = 100.0 * results.share(m);
        let required = match results.required(m) {
            words if words.is_empty() => words,
            words => format!(" ({words})"),
        };
        let (n, cause) = (m.runs.len(), &m.cause);
        say!("  {n} ({share:.1} %) violated: {cause}{required}\n    runs {}", few(&m.runs, 5));
    }
    for (kind, runs) in &results.failures {
        say!("  {} failed by: {kind}\n    runs {}", runs.len(), few(runs, 5));
    }
    if !files.is_empty() {
        say!("files:");
    }
    for file in files {
        let hint = match file.extension().and_then(|e| e.to_str()) {
            Some("html") => "   open with a browser",
            _ => "",
        };
        say!("  {}{hint}", file.display());
    }
}

/// `--run N`: makes the run like `linkwork run`, with the values that the campaign drew. If the campaign has already made it, the two last states are
/// compared.
fn again(campaign: &Campaign, run: u64, out: &Path, options: &CampaignOptions) -> u8 {
    let runs = campaign.form().runs;
    if run >= runs {
        tell!(
            "error: there is no run {run}\n  help: the runs of this campaign are 0 to {}",
            runs - 1
        );
        return exit::INPUT;
    }
    let ready = match campaign.load(run, &load::library()) {
        Ok(ready) => ready,
        Err(LoadError::Refused(failure)) => return report(&failure),
        Err(LoadError::Changed(file)) => {
            tell!("error: `{file}` has changed\n  help: repeat the command");
            return exit::INPUT;
        }
    };
    let known = match known(campaign, out, run) {
        Ok(known) => known,
        Err(e) => {
            tell!("error: {e}");
            return exit::INPUT;
        }
    };
    let (until, _) = end(ready.loaded.simulation.until, campaign.until());
    let folder = out.join(format!("run_{run}"));
    let told = RunOptions {
        until: until.map(|u| format!("{}/{}", u.num, u.den)),
        out: Some(folder.clone()),
        save_rrd: (!options.log).then(|| "off".into()),
        no_log: !options.log,
        quiet: options.quiet,
        ..RunOptions::default()
    };
    let code = run::run_ready(ready, campaign.simulation(), &format!("run_{run}"), &told);
    let Some(known) = known.filter(|k| k.ended != Cause::WallLimit) else { return code };
    if code == exit::INPUT || code == exit::STOPPED {
        return code;
    }
    compare(&folder, &known, code)
}

/// Returns the outcome of the campaign's own run, if it has ended.
fn known(campaign: &Campaign, out: &Path, run: u64) -> Result<Option<Outcome>, String> {
    let path = Folder::journal_in(out);
    if !path.exists() {
        return Ok(None);
    }
    match Journal::open(&path, campaign.identity(), campaign.form().runs) {
        Ok(mut journal) => Ok(journal.outcomes.remove(&run)),
        Err(JournalError::Taken { .. }) => {
            tell!(
                "note: the campaign is running, so the last state is not compared with its result"
            );
            Ok(None)
        }
        Err(e) => Err(e.to_string()),
    }
}

fn compare(folder: &Path, known: &Outcome, code: u8) -> u8 {
    let path = folder.join("summary.json");
    let hash = std::fs::read_to_string(&path)
        .ok()
        .and_then(|t| serde_json::from_str::<serde_json::Value>(&t).ok())
        .and_then(|v| v["state_hash"].as_str().map(str::to_string));
    let was = format!("{:016x}", known.hash);
    match hash {
        Some(now) if now == was => {
            say!("the same last state as in the campaign: {was}");
            code
        }
        Some(now) => {
            tell!(
                "error: the last state is {now}, but in the campaign it was {was}\n  help: this is a bug in a model or \
                 in Linkwork: repeated runs must be bit-identical"
            );
            exit::FAILED
        }
        None => {
            tell!("error: `{}` does not contain the last state", path.display());
            exit::FAILED
        }
    }
}
