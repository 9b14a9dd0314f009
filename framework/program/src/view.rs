//! `linkwork view`: a recording from a log, without simulating.
//!
//! The configuration inside the log says what is shown; the poses and numbers of its rows drive it.
#[cfg(feature = "viewer")]
use crate::exit;
use std::path::{Path, PathBuf};

/// What a view may be told.
#[derive(clap::Args, Clone, Debug, Default)]
pub struct ViewOptions {
    /// Where the recording goes; beside the log, with the ending .rrd, unless given.
    #[arg(long, value_name = "FILE")]
    pub out: Option<PathBuf>,
}

/// `linkwork view LOG [--out FILE]`.
#[cfg(feature = "viewer")]
pub fn view(log: &Path, options: &ViewOptions) -> u8 {
    match drawn::draw(log, options) {
        Ok(code) | Err(code) => code,
    }
}

/// Without the feature there is nothing to draw with.
#[cfg(not(feature = "viewer"))]
pub fn view(_: &Path, _: &ViewOptions) -> u8 {
    crate::taps::without_viewer("view")
}

#[cfg(feature = "viewer")]
mod drawn {
    use super::{Path, PathBuf, ViewOptions, exit};
    use crate::load::Ready;
    use crate::run::{self, Looked};
    use crate::{load, taps};
    use linkwork_record::{End, Entry, LogError, logged_names, walk_log};
    use linkwork_viz::{NotShown, Player, View, VizError};
    use std::collections::BTreeMap;

    /// Why there is no recording.
    enum Fault {
        Log(LogError),
        Recording(VizError),
        /// It is said already.
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

    /// A recording under way.
    struct Drawing {
        player: Player,
        /// Path of the variable for each name of the log.
        names: BTreeMap<String, String>,
        rows: u64,
    }

    /// Where the recording goes: no file that is there already, unless it is named.
    fn place(log: &Path, options: &ViewOptions) -> Result<PathBuf, u8> {
        let Some(out) = &options.out else {
            let beside = log.with_extension("rrd");
            if beside.exists() {
                tell!(
                    "error: `{}` is there already: perhaps the recording that the run itself wrote\n  help: name \
                     another file, or the same, with --out",
                    beside.display()
                );
                return Err(exit::INPUT);
            }
            return Ok(beside);
        };
        if taps::same(out, log) {
            tell!(
                "error: --out `{}` is the log itself\n  help: choose another file",
                out.display()
            );
            return Err(exit::INPUT);
        }
        Ok(out.clone())
    }

    fn open(configuration: &str, name: &str, out: &Path) -> Result<Drawing, Fault> {
        let ready: Ready =
            load::ready_text(&format!("{name}.ron"), configuration).map_err(Fault::Said)?;
        let Looked { scene: (scene, period), prepared } =
            run::prepare(&ready).map_err(Fault::Said)?;
        let names = logged_names(ready.plan(), &prepared.groups);
        let (view, _) = View::new(&ready.program, &scene, period)?;
        Ok(Drawing { player: Player::open(view, out)?, names, rows: 0 })
    }

    impl Drawing {
        fn take(&mut self, entry: Entry<'_>) -> Result<(), VizError> {
            match entry {
                Entry::Numbers { part, ns, fields, .. } => {
                    for (field, value) in fields {
                        if let Some(path) = self.names.get(&format!("{part}.{field}")) {
                            self.player.value(ns, path, value)?;
                        }
                    }
                }
                Entry::Poses { ns, bodies } => {
                    self.player.poses(ns, &bodies)?;
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

    pub fn draw(log: &Path, options: &ViewOptions) -> Result<u8, u8> {
        let out = place(log, options)?;
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
                    drawing = Some(open(&text, &name, &out)?);
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
            let rows = drawing.rows;
            Ok(Some((end, rows, drawing.player.finish()?)))
        });
        match finished {
            Ok(Some((end, rows, missing))) => {
                say!("`{}`: {rows} instants", out.display());
                if let End::Cut { at } = end {
                    say!("    the log has no end: it was cut after {at} bytes");
                }
                not_shown(&missing);
                Ok(exit::OK)
            }
            Ok(None) => {
                tell!(
                    "error: log `{}` carries no configuration\n  help: give a .mcap file that `linkwork run` wrote",
                    log.display()
                );
                Err(exit::INPUT)
            }
            Err(fault) => {
                // Half a recording would look whole.
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
                tell!("error: {e}\n  help: choose another file with --out, or make room");
                return exit::FAILED;
            }
            Fault::Said(code) => return code,
        }
        exit::INPUT
    }

    /// Names of a list that are told one by one.
    const MOST: usize = 5;

    fn not_shown(missing: &NotShown) {
        let list = |names: &[String]| {
            let more = names.len().saturating_sub(MOST);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            format!("{}{more}", names[..names.len().min(MOST)].join(", "))
        };
        if !missing.variables.is_empty() {
            tell!(
                "warning: not shown, because the log has no rows of them: {}\n  help: name them in `log` of the \
                 simulation",
                list(&missing.variables)
            );
        }
        if !missing.nodes.is_empty() {
            tell!(
                "warning: the axes of {} are not shown: the log has no modes of flexible bodies, nor says on which body \
                 a node of several phases is\n  help: look at the recording that the run itself wrote",
                list(&missing.nodes)
            );
        }
    }
}
