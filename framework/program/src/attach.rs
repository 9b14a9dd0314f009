//! `linkwork attach`: the client of a run that was started with `--serve`.
use crate::exit;
use clap::Subcommand;
use linkwork_live::{Amount, Client, ClientError, FrameError, ReplyKind, RequestKind, Ticket};
use linkwork_runner::assignment;
use linkwork_runtime::Value;
use std::path::Path;

/// A request to the run.
#[derive(Subcommand, Clone, Debug)]
pub enum AttachCommand {
    /// List names and units of variables.
    List {
        /// Patterns: `Rover.**.torque`.
        #[arg(default_value = "**")]
        patterns: Vec<String>,
    },
    /// Print present values, in SI.
    Get {
        /// Variables, by pattern.
        #[arg(required = true)]
        patterns: Vec<String>,
    },
    /// Print values while the run continues, one line per instant: the time and the values.
    Watch {
        /// Variables, by pattern.
        #[arg(required = true)]
        patterns: Vec<String>,
        /// Largest number of lines per second.
        #[arg(long, default_value_t = 10.0)]
        rate: f64,
        /// Stop after this number of lines.
        #[arg(long)]
        count: Option<u64>,
    },
    /// Set states and unconnected inputs: bob.rate=0.5, "bob.angle=30 deg", 'Wheel*.rate=0'. Changes act from the present tick on, in this order, and
    /// are recorded in the log.
    Set {
        /// PATH=VALUE; the path of a variable, or a pattern with a star.
        #[arg(required = true, value_name = "PATH=VALUE")]
        values: Vec<String>,
    },
    /// Pin states, outputs and unconnected inputs: they keep the value (default: the present value) for every reader until they are unpinned. Pins
    /// are recorded in the log and in checkpoints.
    Pin {
        /// PATH=VALUE or PATH; the path of a variable, or a pattern with a star.
        #[arg(required = true, value_name = "PATH[=VALUE]")]
        values: Vec<String>,
    },
    /// Release pinned variables.
    Unpin {
        /// Variables, or patterns with a star.
        #[arg(required = true, value_name = "PATH")]
        paths: Vec<String>,
    },
    /// Print the pinned variables, in SI.
    Pins,
    /// Pause the run.
    Pause,
    /// Make a number of steps, then pause the run.
    Step {
        /// Number of steps.
        #[arg(default_value_t = 1)]
        steps: u64,
    },
    /// Continue the run.
    Go,
    /// Write a checkpoint into the folder of the run.
    Checkpoint,
    /// Stop the run like Ctrl-C, with a checkpoint.
    Quit,
}

/// `linkwork attach RUN COMMAND`.
pub fn attach(folder: &Path, command: AttachCommand) -> u8 {
    let file = folder.join(Ticket::FILE);
    let ticket = match Ticket::read(&file) {
        Ok(ticket) => ticket,
        Err(e) => {
            tell!(
                "error: `{}`: {e}\n  help: give the folder of a run that was started with --serve and has not ended",
                file.display()
            );
            return exit::INPUT;
        }
    };
    match Client::connect(&ticket).and_then(|mut client| done(&mut client, command)) {
        Ok(()) => exit::OK,
        Err(e) => {
            tell!("error: {e}");
            exit::FAILED
        }
    }
}

fn names(client: &mut Client, patterns: Vec<String>) -> Result<Vec<(String, String)>, ClientError> {
    match client.ask(RequestKind::List { patterns })? {
        ReplyKind::Names { names } => Ok(names),
        other => Err(odd(&other)),
    }
}

fn odd(said: &ReplyKind) -> ClientError {
    let message = format!("unexpected answer of the run: {said:?}");
    ClientError::Refused { message, help: "use the same version of the program for both".into() }
}

fn done(client: &mut Client, command: AttachCommand) -> Result<(), ClientError> {
    let ask = match command {
        AttachCommand::List { patterns } => {
            names(client, patterns)?.iter().for_each(|(name, unit)| say!("{name:64} {unit}"));
            return Ok(());
        }
        AttachCommand::Get { patterns } => {
            let names = names(client, patterns)?;
            let paths = names.iter().map(|(name, _)| name.clone()).collect();
            let (time, values) = match client.ask(RequestKind::Get { paths })? {
                ReplyKind::Values { time, values, .. } => (time, values),
                other => return Err(odd(&other)),
            };
            say!("{:64} {time} s", "time");
            for ((name, unit), value) in names.iter().zip(values) {
                say!("{name:64} {} {unit}", number(value));
            }
            return Ok(());
        }
        AttachCommand::Watch { patterns, rate, count } => {
            return watch(client, patterns, rate, count);
        }
        AttachCommand::Set { values } => {
            let asks = values.iter().map(|written| match assignment(written) {
                (path, Some(value)) => Ok(RequestKind::Set { path, value: value.into() }),
                (_, None) => {
                    let message = format!("`{written}` lacks a `=`");
                    Err(ClientError::Refused { message, help: "write PATH=VALUE".into() })
                }
            });
            return asks.collect::<Result<Vec<_>, _>>().and_then(|asks| change(client, asks));
        }
        AttachCommand::Pin { values } => {
            let pin = |(path, value): (String, Option<Value>)| RequestKind::Pin {
                path,
                value: value.map(Amount::from),
            };
            return change(client, values.iter().map(|v| pin(assignment(v))).collect());
        }
        AttachCommand::Unpin { paths } => {
            return change(
                client,
                paths.into_iter().map(|path| RequestKind::Unpin { path }).collect(),
            );
        }
        AttachCommand::Pins => {
            match client.ask(RequestKind::Pins)? {
                ReplyKind::Pins { time, values } => {
                    say!("{:64} {time} s", "time");
                    values.iter().for_each(|(path, value)| say!("{path:64} {value}"));
                }
                other => return Err(odd(&other)),
            }
            return Ok(());
        }
        AttachCommand::Pause => RequestKind::Pause,
        AttachCommand::Step { steps } => RequestKind::Step { steps },
        AttachCommand::Go => RequestKind::Go,
        AttachCommand::Checkpoint => RequestKind::Checkpoint,
        AttachCommand::Quit => RequestKind::Quit,
    };
    match client.ask(ask)? {
        ReplyKind::Done { time } => say!("t = {time} s"),
        ReplyKind::Checkpoint { file } => say!("{file}"),
        other => return Err(odd(&other)),
    }
    Ok(())
}

fn number(value: Option<f64>) -> String {
    value.map_or_else(|| "no number".into(), |x| x.to_string())
}

fn watch(
    client: &mut Client,
    patterns: Vec<String>,
    rate: f64,
    count: Option<u64>,
) -> Result<(), ClientError> {
    let paths: Vec<String> = names(client, patterns)?.into_iter().map(|(name, _)| name).collect();
    say!("time {}", paths.join(" "));
    let id = client.send(RequestKind::Watch { paths, rate })?;
    let mut lines = 0;
    while count != Some(lines) {
        let reply = match client.receive() {
            // The end of the stream means that the run has ended.
            Err(ClientError::Frame(FrameError::Ended)) => return Ok(()),
            reply => reply?,
        };
        match reply.said {
            ReplyKind::Values { time, values, .. } if reply.id == id => {
                let values: Vec<String> = values.into_iter().map(number).collect();
                say!("{time} {}", values.join(" "));
                lines += 1;
            }
            ReplyKind::Refused { message, help } => {
                return Err(ClientError::Refused { message, help });
            }
            _ => {}
        }
    }
    Ok(())
}

/// Sends requests in this order, and prints what each has changed.
fn change(client: &mut Client, asks: Vec<RequestKind>) -> Result<(), ClientError> {
    for ask in asks {
        match client.ask(ask)? {
            ReplyKind::Changed { time, values } => {
                values.iter().for_each(|(path, value)| say!("{path} = {value} at t = {time} s"));
            }
            other => return Err(odd(&other)),
        }
    }
    Ok(())
}
