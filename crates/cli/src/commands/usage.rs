//! Wrong usage: what is wrong with a command line whatever its files hold and whatever is connected. It ends the program with 2,
//! every other failure with 1.

use std::process::ExitCode;

use miette::{Diagnostic, Report, Result};

/// Marks an error as one of wrong usage. It is not shown.
pub const CODE: &str = "usage";
/// Exit code of wrong usage, which is clap's, too.
const WRONG_USAGE: u8 = 2;

/// An error of the command line that the library found.
pub fn misuse(error: &dyn Diagnostic) -> Report {
    match error.help() {
        Some(help) => miette::miette!(code = CODE, help = help.to_string(), "{error}"),
        None => miette::miette!(code = CODE, "{error}"),
    }
}

/// Whether an error is one of wrong usage.
pub fn is_misuse(error: &dyn Diagnostic) -> bool {
    error.code().is_some_and(|code| code.to_string() == CODE)
}

/// Says what went wrong, and ends with what the contract has for it.
pub fn exit_code(done: Result<()>) -> ExitCode {
    let Err(report) = done else {
        return ExitCode::SUCCESS;
    };
    eprintln!("Error: {report:?}");
    match is_misuse(report.as_ref()) {
        true => ExitCode::from(WRONG_USAGE),
        false => ExitCode::FAILURE,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wrong_usage_is_told_from_other_failures_through_what_is_said_around_it() {
        let wrong = miette::miette!(code = CODE, help = "write it", "nothing to write");
        assert!(is_misuse(wrong.as_ref()));
        assert!(is_misuse(misuse(wrong.as_ref()).as_ref()));
        assert!(is_misuse(wrong.wrap_err("x.csv").as_ref()));
        let other = miette::miette!(help = "is it there?", "no such file");
        assert!(!is_misuse(other.as_ref()));
    }
}
