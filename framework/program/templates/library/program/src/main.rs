//! The command line of `@name@`.
use linkwork_program::Program;
use std::process::ExitCode;

fn main() -> ExitCode {
    Program {
        name: "@name@",
        version: env!("CARGO_PKG_VERSION"),
        about: "Simulate machines made of the parts of @name@ and of Linkwork.",
        examples: "Examples:\n  @name@ run sims/spin_up\n  @name@ list '@name@.*'\n  @name@ describe @name@.@model@",
        library: @name@::library,
        unit: "@name@-unit",
        tools: &[],
    }
    .main()
}
