//! The line to a board: frames in, numbered requests out, and what to do when nothing comes back.

mod error;
mod feed;
mod heard;
mod motor;
mod patience;
mod port;

use std::collections::VecDeque;
use std::io::ErrorKind;
use std::time::{Duration, Instant};

use wire::link::LinkStats;
use wire::{
    Command, Decoder, Frame, Health, Hello, Reply, Request, Sample, Status, encode_request,
};

pub use error::{LinkError, name, words};
pub use feed::{Change, Feed};
pub use heard::Heard;
pub use motor::{KEEP_ALIVE, Motor};
pub use patience::Patience;
use patience::{REPLY_WAIT, TRIES};
pub use port::Port;
use port::Serial;

/// Speed of the line after a reset, baud.
pub const DEFAULT_BAUD: u32 = 38_400;
/// Crystal of the board, Hz: the speeds that it can have are this over 16 (divisor + 1).
const CLOCK_HZ: f64 = 16e6;
/// How long a board may say that it is busy: with a self-test, at the most.
const BUSY_FOR: Duration = Duration::from_secs(12);

/// A board on a line.
pub struct Link {
    /// `None` while it is gone.
    port: Option<Box<dyn Port>>,
    /// When it was opened first.
    since: Instant,
    name: String,
    baud: u32,
    decoder: Decoder,
    stats: LinkStats,
    bytes: u64,
    number: u16,
    /// Frames, and how many bytes had come by the end of each.
    frames: VecDeque<(Frame, u64)>,
    /// Bytes by the end of the frame that was taken last.
    taken: u64,
    buffer: Vec<u8>,
    /// The last hello frame.
    pub hello: Option<Hello>,
    /// The last health frame.
    pub health: Option<Health>,
    /// The last sample.
    pub sample: Option<Sample>,
}

impl Link {
    /// Opens a port by its name, `/dev/ttyUSB0` or `COM3`, and forgets what had been received before.
    ///
    /// # Errors
    /// [`LinkError::Open`], which names the ports that there are.
    pub fn open(name: &str, baud: u32) -> Result<Self, LinkError> {
        let since = Instant::now();
        let port = Serial::open(name, baud, since)?;
        // Another program may have asked a moment ago: its replies must not look like ours.
        let number = (std::process::id() as u16).wrapping_mul(257);
        Ok(Self {
            number,
            since,
            ..Self::over(Box::new(port), name, baud)
        })
    }

    /// A board on a line that is open.
    #[must_use]
    pub fn over(port: Box<dyn Port>, name: &str, baud: u32) -> Self {
        Self {
            port: Some(port),
            since: Instant::now(),
            name: name.to_owned(),
            baud,
            decoder: Decoder::new(),
            stats: LinkStats::new(),
            bytes: 0,
            number: 0,
            frames: VecDeque::new(),
            taken: 0,
            buffer: vec![0; 4096],
            hello: None,
            health: None,
            sample: None,
        }
    }

    /// Opens the port again, after it was gone or to get rid of what waits in its buffers. A frame that was cut in two is
    /// dropped and counted.
    ///
    /// # Errors
    /// [`LinkError::Open`].
    pub fn reopen(&mut self) -> Result<(), LinkError> {
        // Closed first: a port may be open once only.
        self.port = None;
        let port = Serial::open(&self.name, self.baud, self.since)?;
        self.port = Some(Box::new(port));
        let _cut = self.decoder.push(0);
        self.stats.interrupted();
        Ok(())
    }

    /// Name of the port.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Speed of the line, baud.
    #[must_use]
    pub fn baud(&self) -> u32 {
        self.baud
    }

    /// The line's time: that of the last byte where the line brings it, else of this computer. While the port is gone, the
    /// latter.
    #[must_use]
    pub fn now(&self) -> Duration {
        let of_port = self.port.as_ref().map(|port| port.now());
        of_port.unwrap_or_else(|| self.since.elapsed())
    }

    /// What came so far.
    #[must_use]
    pub fn heard(&self) -> Heard {
        Heard {
            bytes: self.bytes,
            counts: *self.decoder.counts(),
            losses: self.stats.losses(),
        }
    }

    /// Reads what has arrived, waiting for some milliseconds if nothing has; frames are then at [`next`](Self::next).
    /// Returns the bytes.
    ///
    /// # Errors
    /// [`LinkError::Gone`].
    pub fn read(&mut self) -> Result<&[u8], LinkError> {
        let read = match &mut self.port {
            Some(port) => port.read(&mut self.buffer),
            None => Ok(0),
        };
        let count = match read {
            Ok(0) => {
                return Err(LinkError::Gone {
                    port: self.name.clone(),
                    why: "the other end has hung up".to_owned(),
                });
            }
            Ok(count) => count,
            Err(error)
                if matches!(
                    error.kind(),
                    ErrorKind::TimedOut | ErrorKind::Interrupted | ErrorKind::WouldBlock
                ) =>
            {
                0
            }
            Err(error) => return Err(self.gone(&error)),
        };
        let bytes = self.buffer.get(..count).unwrap_or_default();
        for &byte in bytes {
            self.bytes += 1;
            if let Some(Ok(frame)) = self.decoder.push(byte) {
                self.stats.push(&frame);
                match frame {
                    Frame::Hello(hello) => self.hello = Some(hello),
                    Frame::Health(health) => self.health = Some(health),
                    Frame::Sample(sample) => self.sample = Some(sample),
                    Frame::Reply(_) | Frame::Corrected(_) => {}
                }
                self.frames.push_back((frame, self.bytes));
            }
        }
        Ok(bytes)
    }

    /// The next frame that was read.
    #[allow(clippy::should_implement_trait)]
    pub fn next(&mut self) -> Option<Frame> {
        let (frame, end) = self.frames.pop_front()?;
        self.taken = end;
        Some(frame)
    }

    /// How many bytes had come by the end of the frame that [`next`](Self::next) gave last.
    #[must_use]
    pub fn taken(&self) -> u64 {
        self.taken
    }

    fn gone(&self, error: &std::io::Error) -> LinkError {
        LinkError::Gone {
            port: self.name.clone(),
            why: error.to_string(),
        }
    }

    /// Sends a request and returns its number; the reply is whoever reads' to look for.
    ///
    /// # Errors
    /// [`LinkError::Gone`].
    pub fn send(&mut self, command: Command) -> Result<u16, LinkError> {
        self.number = self.number.wrapping_add(1);
        self.send_as(self.number, command)?;
        Ok(self.number)
    }

    fn send_as(&mut self, number: u16, command: Command) -> Result<(), LinkError> {
        let mut line = [0; Request::FRAME_LEN];
        let encoded = encode_request(&Request { number, command }, &mut line);
        debug_assert!(encoded.is_ok(), "the buffer has the length of a request");
        let sent = match &mut self.port {
            Some(port) => port.write_all(&line),
            None => Err(ErrorKind::NotConnected.into()),
        };
        sent.map_err(|error| self.gone(&error))
    }

    /// Asks, waits, asks again where that does no harm ([`Patience::of`]), and gives back the reply, whatever its status
    /// but [`Status::Busy`], which is waited out.
    ///
    /// # Errors
    /// [`LinkError::NoReply`], [`LinkError::Unknown`], [`LinkError::Gone`].
    pub fn ask_any(
        &mut self,
        command: Command,
        mut watch: impl FnMut(&Frame),
    ) -> Result<Reply, LinkError> {
        let patience = Patience::of(&command);
        let (began, before) = (self.now(), self.heard());
        let mut number = self.send(command)?;
        let mut tries = 1;
        let mut sent = self.now();
        loop {
            while let Some(frame) = self.next() {
                watch(&frame);
                let Frame::Reply(reply) = frame else { continue };
                if reply.number != number || reply.command != command.code() {
                    continue;
                }
                if reply.status != Status::Busy || self.now().saturating_sub(began) > BUSY_FOR {
                    return Ok(reply);
                }
                let again = self.now() + Duration::from_millis(100);
                while self.now() < again {
                    self.read()?;
                }
                number = self.send(command)?;
                sent = self.now();
            }
            if self.now().saturating_sub(sent) > patience.wait {
                if tries >= patience.tries {
                    let heard = self.heard().since(&before);
                    return Err(self.no_reply(&command, patience, heard));
                }
                tries += 1;
                // The same number: the late reply to the last try is as good as one to this.
                self.send_as(number, command)?;
                sent = self.now();
            }
            self.read()?;
        }
    }

    /// As [`ask_any`](Self::ask_any), where anything but done is an error.
    ///
    /// # Errors
    /// [`LinkError::Refused`] and those of [`ask_any`](Self::ask_any).
    pub fn ask(&mut self, command: Command) -> Result<Reply, LinkError> {
        done(&command, self.ask_any(command, |_| {})?)
    }

    /// Arms the motor: asks for a nonce and gives it back. From then on keep-alives are due.
    ///
    /// # Errors
    /// As [`ask`](Self::ask).
    pub fn arm(&mut self) -> Result<(), LinkError> {
        let mut tried = 0;
        loop {
            tried += 1;
            let armed = self.ask(Command::Arm { nonce: 0 }).and_then(|told| {
                let nonce = told.value as u16;
                self.ask(Command::Arm { nonce })
            });
            match armed {
                Ok(_) => return Ok(()),
                // A request or a reply was lost: both are asked anew, as the nonce may be spent.
                Err(LinkError::NoReply { .. } | LinkError::Unknown { .. }) if tried < TRIES => {}
                Err(error) => return Err(error),
            }
        }
    }

    fn no_reply(&self, command: &Command, patience: Patience, heard: Heard) -> LinkError {
        let remedy = heard.remedy(self.baud);
        if patience.tries == 1 && heard.counts.frames > 0 {
            return LinkError::Unknown {
                command: name(command),
                heard: Box::new(heard),
                help: "the request or its reply was lost on the line: look with `imu-stand board info` and `board health`, then \
                       repeat it"
                    .to_owned(),
            };
        }
        LinkError::NoReply {
            command: name(command),
            tries: patience.tries,
            wait_ms: patience.wait.as_millis(),
            heard: Box::new(heard),
            help: remedy,
        }
    }

    /// Asks the board who it is and how it is set.
    ///
    /// # Errors
    /// As [`ask`](Self::ask); [`LinkError::NotAsAsked`] where the reply came and the frame did not.
    pub fn ask_hello(&mut self) -> Result<Hello, LinkError> {
        for _ in 0..TRIES {
            self.hello = None;
            self.ask(Command::GetHello)?;
            if let Some(hello) = self.wait_for(|link| link.hello)? {
                return Ok(hello);
            }
        }
        Err(self.frame_lost("hello"))
    }

    /// Asks the board for its counters; with `clear` they start anew.
    ///
    /// # Errors
    /// As [`ask_hello`](Self::ask_hello).
    pub fn ask_health(&mut self, clear: bool) -> Result<Health, LinkError> {
        for _ in 0..TRIES {
            self.health = None;
            self.ask(Command::Counters)?;
            let Some(health) = self.wait_for(|link| link.health)? else {
                continue;
            };
            if clear {
                // What came with the reply is lost with a line that loses; what is shown was read before.
                self.ask(Command::ClearCounters)?;
                return Ok(self.health.unwrap_or(health));
            }
            return Ok(health);
        }
        Err(self.frame_lost("health"))
    }

    /// A frame that a request brings: before its reply, or on a full line after it, as soon as there is room. It may be lost.
    fn wait_for<T>(&mut self, frame: impl Fn(&Self) -> Option<T>) -> Result<Option<T>, LinkError> {
        let since = self.now();
        loop {
            let found = frame(self);
            if found.is_some() || self.now().saturating_sub(since) > REPLY_WAIT {
                return Ok(found);
            }
            self.read()?;
        }
    }

    fn frame_lost(&self, what: &str) -> LinkError {
        LinkError::NotAsAsked {
            what: format!(
                "the board replied {TRIES} times, and its {what} frame never arrived; heard so far: {}",
                self.heard()
            ),
            help: "the line loses frames: a shorter cable, a common ground, or a slower speed"
                .to_owned(),
        }
    }

    /// Reads for a time and hands over each frame.
    ///
    /// # Errors
    /// [`LinkError::Gone`].
    pub fn watch(
        &mut self,
        duration: Duration,
        mut each: impl FnMut(&Frame),
    ) -> Result<(), LinkError> {
        let end = self.now() + duration;
        while self.now() < end {
            self.read()?;
            while let Some(frame) = self.next() {
                each(&frame);
            }
        }
        Ok(())
    }

    /// Sets the speed of this end of the line; what was received at the old one is forgotten.
    ///
    /// # Errors
    /// [`LinkError::Gone`].
    pub fn set_own_baud(&mut self, baud: u32) -> Result<(), LinkError> {
        if let Some(port) = &mut self.port {
            let set = port.set_baud(baud);
            set.map_err(|error| self.gone(&error))?;
        }
        self.baud = baud;
        self.frames.clear();
        Ok(())
    }
}

/// A reply that says done, or the error that it is.
///
/// # Errors
/// [`LinkError::Refused`].
pub fn done(command: &Command, reply: Reply) -> Result<Reply, LinkError> {
    if reply.status == Status::Ok {
        return Ok(reply);
    }
    Err(LinkError::Refused {
        command: name(command),
        code: command.code(),
        status: reply.status,
    })
}

/// The divisor whose speed is nearest to `baud`, if within the 2 % that an 8N1 receiver forgives.
#[must_use]
pub fn divisor(baud: u32) -> Option<u16> {
    let exact = CLOCK_HZ / 16.0 / f64::from(baud.max(1)) - 1.0;
    let rounded = exact.round();
    let error = (exact + 1.0) / (rounded + 1.0) - 1.0;
    ((0.0..4096.0).contains(&rounded) && error.abs() <= 0.02).then_some(rounded as u16)
}

/// The speed that a divisor gives, baud.
#[must_use]
pub fn baud_of(divisor: u16) -> f64 {
    CLOCK_HZ / 16.0 / (f64::from(divisor) + 1.0)
}

#[cfg(test)]
mod tests;
