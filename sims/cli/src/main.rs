//! The command line of Linkwork.
use std::process::ExitCode;

fn main() -> ExitCode {
    linkwork_cli::LINKWORK.main()
}
