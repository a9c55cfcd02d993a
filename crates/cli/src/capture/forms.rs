//! What a text is besides a table of decimal numbers, all of which is made one on the way.

use std::cell::RefCell;
use std::io::{BufRead, Result};
use std::rc::Rc;

use super::CaptureError;
use super::carried::{self, Carried};
use super::hexadecimal::{self, Hexadecimal};
use super::layout::Layout;
use super::lvm::{self, Lvm};
use super::utf16::utf8;

/// What was made of a text.
pub(super) struct Forms {
    lvm: Option<Rc<RefCell<Lvm>>>,
    carried: Option<Rc<RefCell<Carried>>>,
    hexadecimal: Option<Rc<RefCell<Hexadecimal>>>,
}

/// The text as a table, and what it was.
///
/// # Errors
/// The stream's.
pub(super) fn as_table<'a>(input: impl BufRead + 'a) -> Result<(Box<dyn BufRead + 'a>, Forms)> {
    let (input, lvm) = utf8(input).and_then(lvm::as_table)?;
    let (input, carried) = carried::as_table(input)?;
    let (input, hexadecimal) = hexadecimal::decimal(input)?;
    let forms = Forms {
        lvm,
        carried,
        hexadecimal,
    };
    Ok((input, forms))
}

impl Forms {
    /// Takes what the rows carried into the layout.
    ///
    /// # Errors
    /// Channels that are no one record.
    pub fn take(&self, layout: &mut Layout) -> std::result::Result<(), CaptureError> {
        if let Some(carried) = &self.carried {
            let carried = carried.borrow();
            layout.take_names(&carried.names, &carried.units);
        }
        let Some(lvm) = &self.lvm else { return Ok(()) };
        lvm.borrow().take(layout);
        lvm.borrow().together()
    }

    /// An error that asks, with what is known.
    pub fn mention(&self, error: CaptureError) -> CaptureError {
        let error = match &self.lvm {
            Some(lvm) => lvm.borrow().mention(error),
            None => error,
        };
        match &self.hexadecimal {
            Some(hexadecimal) => hexadecimal.borrow().mention(error),
            None => error,
        }
    }

    /// What to tell, the rows being read.
    pub fn notes(&self) -> Vec<String> {
        let carried = self.carried.iter();
        let mut notes: Vec<String> = carried.flat_map(|of| of.borrow().notes()).collect();
        notes.extend(self.lvm.iter().flat_map(|of| of.borrow().notes()));
        notes.extend(self.hexadecimal.iter().filter_map(|of| of.borrow().notes()));
        notes
    }
}
