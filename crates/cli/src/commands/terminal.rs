//! What goes to a terminal: words of ours with names from files in them, which a terminal could take for commands.

use std::borrow::Cow;
use std::error::Error;
use std::fmt;

use miette::{Diagnostic, MietteHandler, MietteHandlerOpts, ReportHandler, Severity};

/// Stands where a character was that a terminal would obey.
const SHOWN: char = '\u{fffd}';

/// A text without characters that a terminal obeys, but for the end of a line and the tabulator.
pub fn harmless(text: &str) -> Cow<'_, str> {
    let obeyed = |c: char| c.is_control() && !matches!(c, '\n' | '\t');
    if text.contains(obeyed) {
        text.replace(obeyed, SHOWN.encode_utf8(&mut [0; 4])).into()
    } else {
        text.into()
    }
}

/// Shows errors as miette does, without what a terminal would obey.
pub struct Handler(MietteHandler);

impl Handler {
    /// A command that a help proposes is to be copied whole: the terminal may wrap it, the text does not.
    pub fn new() -> Self {
        Self(MietteHandlerOpts::new().wrap_lines(false).build())
    }
}

impl ReportHandler for Handler {
    fn debug(&self, error: &dyn Diagnostic, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.debug(&Shown::diagnostic(error), f)
    }
}

/// An error with its causes, as it is shown.
#[derive(Debug)]
struct Shown {
    message: String,
    code: Option<String>,
    help: Option<String>,
    severity: Option<Severity>,
    cause: Option<Box<Shown>>,
    /// Whether its cause has a help of its own.
    is_cause_diagnostic: bool,
}

impl Shown {
    fn diagnostic(error: &dyn Diagnostic) -> Self {
        let owned = |text: Option<Box<dyn fmt::Display + '_>>| {
            text.map(|text| harmless(&text.to_string()).into_owned())
        };
        let inner = error.diagnostic_source();
        let cause = match inner {
            Some(inner) => Some(Self::diagnostic(inner)),
            None => error.source().map(Self::error),
        };
        Self {
            message: harmless(&error.to_string()).into_owned(),
            code: owned(error.code()).filter(|code| code != super::usage::CODE),
            help: owned(error.help()),
            severity: error.severity(),
            cause: cause.map(Box::new),
            is_cause_diagnostic: inner.is_some(),
        }
    }

    fn error(error: &(dyn Error + 'static)) -> Self {
        Self {
            message: harmless(&error.to_string()).into_owned(),
            code: None,
            help: None,
            severity: None,
            cause: error.source().map(|cause| Box::new(Self::error(cause))),
            is_cause_diagnostic: false,
        }
    }
}

impl fmt::Display for Shown {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl Error for Shown {
    fn source(&self) -> Option<&(dyn Error + 'static)> {
        self.cause.as_deref().map(|cause| cause as _)
    }
}

impl Diagnostic for Shown {
    fn code<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.code.as_ref().map(|code| Box::new(code) as _)
    }

    fn severity(&self) -> Option<Severity> {
        self.severity
    }

    fn help<'a>(&'a self) -> Option<Box<dyn fmt::Display + 'a>> {
        self.help.as_ref().map(|help| Box::new(help) as _)
    }

    fn diagnostic_source(&self) -> Option<&dyn Diagnostic> {
        let cause = self.cause.as_deref().filter(|_| self.is_cause_diagnostic);
        cause.map(|cause| cause as _)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_terminal_obeys_is_shown_and_not_sent() {
        assert_eq!(harmless("a\tb\n"), "a\tb\n");
        assert_eq!(
            harmless("\x1b[2Jx\r\u{9b}1m\x07"),
            "\u{fffd}[2Jx\u{fffd}\u{fffd}1m\u{fffd}"
        );
    }

    #[test]
    fn an_error_keeps_its_causes_and_its_help() {
        let report = miette::miette!(help = "rename \x1b it", "no \x1b[2J").wrap_err("cannot read");
        let shown = format!("{:?}", Shown::diagnostic(report.as_ref()));
        assert!(shown.contains("rename \u{fffd} it") && shown.contains("no \u{fffd}[2J"));
        assert!(!shown.contains('\x1b'), "{shown}");
    }
}
