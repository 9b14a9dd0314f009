//! `linkwork completions` and `linkwork man`: shell completions and manual pages, generated from the declaration of the command line.
use crate::exit;
use crate::voice::say_text;
use clap::Command;
use clap_complete::Shell;
use std::path::Path;

/// Prints the completion script for a shell.
pub fn completions(shell: Shell, command: &mut Command) -> u8 {
    let (name, mut script) = (command.get_name().to_string(), Vec::new());
    clap_complete::generate(shell, command, name, &mut script);
    say_text(format_args!("{}", String::from_utf8_lossy(&script)));
    exit::OK
}

/// Writes a page for the program and one for each command.
pub fn man(folder: &Path, command: Command) -> u8 {
    let name = command.get_name().to_string();
    let made = std::fs::create_dir_all(folder);
    if let Err(e) = made.and_then(|()| clap_mangen::generate_to(command, folder)) {
        let folder = folder.display();
        tell!("error: `{folder}` cannot be written: {e}\n  help: choose a writable folder");
        return exit::FAILED;
    }
    say!("{}", folder.join(format!("{name}.1")).display());
    exit::OK
}
