//! The `colluvium` command.

use clap::Parser;
use colluvium::command_line::{CommandLine, execute};
use std::process::ExitCode;

fn main() -> ExitCode {
    match execute(CommandLine::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            eprintln!("colluvium: {failure}");
            ExitCode::from(failure.exit_status())
        }
    }
}
