//! A board that is listened to for hours: its port may vanish and come back.

use std::time::{Duration, Instant};

use wire::Command;

use super::{Link, LinkError};

/// From try to try to open a port that is gone.
const RETRY: Duration = Duration::from_millis(500);

/// Silence after which a port is opened again.
const QUIET: Duration = Duration::from_secs(5);

/// What happened to the port.
#[derive(Clone, Debug, PartialEq)]
pub enum Change {
    /// It is gone.
    Gone {
        /// What the system says.
        why: String,
    },
    /// It is there again.
    Back {
        /// After how long.
        after: Duration,
    },
}

/// A link that waits for its port.
pub struct Feed {
    /// The link.
    pub link: Link,
    /// Since when nothing comes, and that has been told.
    gone: Option<Instant>,
    /// When a byte came last, or the port was last opened.
    heard: Instant,
    /// Whether the port is open.
    open: bool,
}

impl Feed {
    /// From a link that is open.
    #[must_use]
    pub fn new(link: Link) -> Self {
        Self {
            link,
            gone: None,
            heard: Instant::now(),
            open: true,
        }
    }

    /// Reads what has arrived, or tries to open the port again; takes some milliseconds where there is nothing. Bytes go
    /// to `raw`, frames are at [`Link::next`].
    ///
    /// Not every system tells that an adapter was unplugged; some go on reading nothing. So a port that has been silent
    /// for 5 s, which a board is never, is closed and opened again. It counts as back when a byte comes.
    pub fn poll(&mut self, mut raw: impl FnMut(&[u8])) -> Option<Change> {
        if !self.open {
            if self.heard.elapsed() < RETRY {
                std::thread::sleep(Duration::from_millis(20));
                return None;
            }
            self.heard = Instant::now();
            self.open = self.link.reopen().is_ok() && self.ask().is_ok();
            return None;
        }
        let why = match self.link.read() {
            Ok([]) if self.heard.elapsed() < QUIET => return None,
            Ok([]) => format!("not a byte for {} s", QUIET.as_secs()),
            Ok(bytes) => {
                raw(bytes);
                self.heard = Instant::now();
                let after = self.gone.take()?.elapsed();
                return Some(Change::Back { after });
            }
            Err(LinkError::Gone { why, .. }) => why,
            Err(other) => other.to_string(),
        };
        let last = self.heard;
        (self.open, self.heard) = (false, Instant::now());
        if self.gone.is_some() {
            return None;
        }
        self.gone = Some(last);
        Some(Change::Gone { why })
    }

    /// Asks the board whether it corrects its rates, then how it is set; the hello frame comes with the others.
    ///
    /// # Errors
    /// [`LinkError::Gone`].
    pub fn ask(&mut self) -> Result<(), LinkError> {
        self.link.send(Command::GetCorrection {
            other: false,
            row: 0,
        })?;
        self.link.send(Command::GetHello).map(drop)
    }

    /// Whether the port is gone.
    #[must_use]
    pub fn is_gone(&self) -> bool {
        self.gone.is_some()
    }
}
