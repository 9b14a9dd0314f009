//! `linkwork view`: a recording from a log, without simulating, or from a table of external telemetry.
//!
//! The configuration in the log defines the scene; the poses and numbers of its samples move it. A table is drawn alone, or together with a log, with
//! the differences as curves (`telemetry`).
#[cfg(feature = "viewer")]
use crate::exit;
use std::path::{Path, PathBuf};

/// Options of a view.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct ViewOptions {
    /// File of the recording (default: next to the log, with the suffix .rrd).
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
    /// Also show flight data of a telemetry file (`Telemetry(..)`, RON), and their differences from the log.
    #[arg(long, value_name = "FILE")]
    pub flown: Option<PathBuf>,
}

/// `linkwork view LOG [--flown FILE] [--out FILE]`, `linkwork view TELEMETRY [--out FILE]`.
#[cfg(feature = "viewer")]
pub fn view(log: &Path, options: &ViewOptions) -> u8 {
    match drawn::draw(log, options) {
        Ok(code) | Err(code) => code,
    }
}

/// Without the feature, recordings cannot be drawn.
#[cfg(not(feature = "viewer"))]
pub fn view(_: &Path, _: &ViewOptions) -> u8 {
    crate::recorders::without_viewer("view")
}

#[cfg(feature = "viewer")]
mod drawn {
    use super::{Path, PathBuf, ViewOptions, exit};
    use crate::load::Ready;
    use crate::run::{self, Looked};
    use crate::telemetry::{self, Beside, Telemetry};
    use crate::voice::report;
    use crate::{load, recorders};
    use linkwork_record::{End, Entry, LogError, walk_log};
    use linkwork_viz::{NotShown, Player, View, VizError};

    /// Reason for which there is no recording.
    enum Fault {
        Log(LogError),
        Recording(VizError),
        /// The error has been printed.
        Said(u8),
    }

    impl From<LogError> for Fault {
        fn from(e: LogError) -> Fault {
            Fault::Log(e)
        }
    }
    impl From<VizError> for Fault {
        fn from(e: VizError) -> Fault {
            Fault::Recording(e)
        }
    }

    /// A recording in progress.
    struct Drawing {
        player: Player,
        /// The flight data.
        beside: Option<Beside>,
        rows: u64,
    }

    /// Returns the path of the recording; an existing file is only overwritten if it was given explicitly.
    fn place(log: &Path, options: &ViewOptions) -> Result<PathBuf, u8> {
        let Some(out) = &options.out else {
            let beside = log.with_extension("rrd");
            if beside.exists() {
                tell!(
                    "error: `{}` already exists: possibly the recording of the run itself\n  help: give \
                     another file, or the same, with --out",
                    beside.display()
                );
                return Err(exit::INPUT);
            }
            return Ok(beside);
        };
        if recorders::same(out, log) {
            tell!(
                "error: --out `{}` is the log itself\n  help: choose another file",
                out.display()
            );
            return Err(exit::INPUT);
        }
        Ok(out.clone())
    }

    fn open(
        configuration: &str,
        name: &str,
        out: &Path,
        (flown, instants): (Option<&Telemetry>, &[u64]),
    ) -> Result<Drawing, Fault> {
        let ready: Ready =
            load::ready_text(&format!("{name}.ron"), configuration).map_err(Fault::Said)?;
        let Looked { scene: (mut scene, period), .. } =
            run::prepare(&ready).map_err(Fault::Said)?;
        let beside =
            flown.map(|f| telemetry::beside(f, &ready.program, (&mut scene, instants))).transpose();
        let beside = beside.map_err(|failure| Fault::Said(report(&failure)))?;
        let (mut view, _) = View::new(&ready.program, &scene, period)?;
        if let Some(beside) = &beside {
            view = view.with(&beside.told);
        }
        Ok(Drawing { player: Player::open(view, out)?, beside, rows: 0 })
    }

    impl Drawing {
        fn take(&mut self, entry: Entry<'_>) -> Result<(), VizError> {
            match entry {
                Entry::Numbers { ns, values } => {
                    for (variable, value) in values {
                        self.player.value(ns, &variable.path, value)?;
                        if let Some(beside) = &mut self.beside {
                            beside.value(ns, &variable.path, value, &mut self.player)?;
                        }
                    }
                }
                Entry::Poses { ns, bodies } => {
                    match &mut self.beside {
                        Some(beside) => beside.poses(ns, &bodies, &mut self.player)?,
                        None => self.player.poses(ns, &bodies)?,
                    }
                    self.rows += 1;
                }
                Entry::Picture { ns, camera, png } => self.player.picture(ns, &camera, png)?,
                Entry::Tile { ns, part, tile } => self.player.tile(ns, part, tile)?,
                Entry::Way { ns, part, corners } => self.player.way(ns, part, &corners)?,
                Entry::Configuration(_) | Entry::Start(_) | Entry::About(_) | Entry::Set(_) => {}
            }
            Ok(())
        }
    }

    /// Returns the increasing instants (ns) at which a log has poses.
    fn instants(log: &Path) -> Result<Vec<u64>, LogError> {
        let mut all = Vec::new();
        walk_log(log, |entry| {
            if let Entry::Poses { ns, .. } = entry {
                all.push(ns);
            }
            Ok::<(), LogError>(())
        })?;
        all.sort_unstable();
        all.dedup();
        Ok(all)
    }

    pub fn draw(log: &Path, options: &ViewOptions) -> Result<u8, u8> {
        let out = place(log, options)?;
        let read = |file: &Path| Telemetry::read(file).map_err(|failure| report(&failure));
        if log.extension().is_some_and(|e| e == "ron") {
            if options.flown.is_some() {
                tell!(
                    "error: --flown requires a log, but `{}` is not one\n  help: give the .mcap file of a run, or omit \
                    --flown",
                    log.display()
                );
                return Err(exit::INPUT);
            }
            let instants = telemetry::alone(&read(log)?, &out)?;
            say!("`{}`: {instants} instants", out.display());
            return Ok(exit::OK);
        }
        let flown = options.flown.as_deref().map(read).transpose()?;
        // Both files must be read to determine whether the table has rows at instants of the log.
        let instants = match &flown {
            Some(_) => instants(log).map_err(|e| told(e.into()))?,
            None => Vec::new(),
        };
        let mut drawing: Option<Drawing> = None;
        let mut opened = false;
        let mut name = "log".to_string();
        let walked = walk_log(log, |entry| {
            match entry {
                Entry::About(about) => {
                    if let Some(simulation) = about.get("simulation") {
                        name.clone_from(simulation);
                    }
                }
                Entry::Configuration(text) if !text.is_empty() => {
                    opened = true;
                    drawing = Some(open(&text, &name, &out, (flown.as_ref(), &instants))?);
                }
                entry => {
                    if let Some(drawing) = &mut drawing {
                        drawing.take(entry)?;
                    }
                }
            }
            Ok::<(), Fault>(())
        });
        let finished = walked.and_then(|end| {
            let Some(drawing) = drawing.take() else { return Ok(None) };
            let Drawing { player, beside, rows, .. } = drawing;
            Ok(Some((end, rows, player.finish()?, beside)))
        });
        match finished {
            Ok(Some((end, rows, missing, beside))) => {
                say!("`{}`: {rows} instants", out.display());
                if let End::Cut { at } = end {
                    say!("    the log is truncated after {at} bytes");
                }
                if let Some(beside) = &beside {
                    beside.tell();
                }
                not_shown(&missing);
                Ok(exit::OK)
            }
            Ok(None) => {
                tell!(
                    "error: log `{}` does not contain a configuration\n  help: give a .mcap file that `linkwork run` wrote",
                    log.display()
                );
                Err(exit::INPUT)
            }
            Err(fault) => {
                // Remove an incomplete recording, because it would look complete.
                drop(drawing);
                if opened {
                    let _ = std::fs::remove_file(&out);
                }
                Err(told(fault))
            }
        }
    }

    fn told(fault: Fault) -> u8 {
        match fault {
            Fault::Log(e) => tell!("error: {e}"),
            Fault::Recording(e) => {
                tell!("error: {e}\n  help: choose another file with --out, or free disk space");
                return exit::FAILED;
            }
            Fault::Said(code) => return code,
        }
        exit::INPUT
    }

    /// Largest number of names in a list.
    const MOST: usize = 5;

    fn not_shown(missing: &NotShown) {
        // The message about a table names the table instead of the log.
        let of_log = |name: &&String| !name.starts_with(telemetry::FLOWN);
        let variables: Vec<String> = missing.variables.iter().filter(of_log).cloned().collect();
        let list = |names: &[String]| {
            let more = names.len().saturating_sub(MOST);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            format!("{}{more}", names[..names.len().min(MOST)].join(", "))
        };
        if !variables.is_empty() {
            tell!(
                "warning: not shown, because the log has no samples of them: {}\n  help: add them to `log` of the \
                 simulation",
                list(&variables)
            );
        }
        if !missing.nodes.is_empty() {
            tell!(
                "warning: the axes of {} are not shown: the log does not contain modes of flexible bodies, or on which body \
                 a node of several phases is\n  help: use the recording that the run itself wrote",
                list(&missing.nodes)
            );
        }
    }
}
