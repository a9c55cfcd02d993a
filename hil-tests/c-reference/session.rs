// A session that any image of the board can be put through: sensors that answer by a script, a host that sends
// everything there is to send. Included by tests/c_reference.rs and examples/cost.rs.
//
// The sensors answer by how often they were asked, not by when, and the host counts from the image's first tick. So two
// images that do the same work at different speeds have to say the same.

use atmega16_sim::{CLOCK_HZ, Mcu, Port, Stop};
use wire::{Command, Shape, code, encode_request, kind};

#[path = "chance.rs"]
mod chance;
#[path = "corrected.rs"]
mod corrected;
#[path = "deeds.rs"]
mod deeds;
#[path = "hearing.rs"]
mod hearing;
#[path = "script.rs"]
mod script;
use chance::chance;
use corrected::correct;
pub use corrected::start_corrected;
use deeds::deeds;
use hearing::nonce;
pub use hearing::{busy_max, frames, jitter};
pub use script::Script;
use script::spread;

const MILLISECOND: u64 = CLOCK_HZ as u64 / 1_000;

/// What the host does, and when: ms after the first tick.
enum Deed {
    Send(Vec<u8>),
    SendWithoutStopBit(u8),
    /// The answer with the nonce that the board has told, under this number.
    Arm(u16),
    /// The stand comes to rest, or moves again.
    Quiet(bool),
    /// The motor's stop is pressed, or let go.
    Press(bool),
    /// From here on the ticks' phase means nothing: a reset comes.
    LastTick,
    /// A bit of the EEPROM's byte at an address flips.
    Flip(usize),
}

fn request(number: u16, command: Command) -> Deed {
    let mut line = [0; wire::MAX_FRAME];
    let len = encode_request(&wire::Request { number, command }, &mut line).expect("there is room");
    Deed::Send(line[..len].to_vec())
}

fn raw_request(number: u16, code: u8, arguments: [u8; 8]) -> Deed {
    let mut fields = number.to_le_bytes().to_vec();
    fields.push(code);
    fields.extend(arguments);
    let mut line = [0; wire::MAX_FRAME];
    let len = wire::fields::encode(kind::REQUEST, &fields, &mut line);
    Deed::Send(line[..len].to_vec())
}

/// How many undamaged requests the session has.
pub fn requests() -> usize {
    deeds()
        .iter()
        .filter(|(_, deed)| match deed {
            Deed::Send(bytes) => bytes.len() == wire::Request::FRAME_LEN,
            Deed::Arm(_) => true,
            _ => false,
        })
        .count()
}

/// Runs until `until`, and says what is wrong where the image stops.
///
/// # Errors
/// An image that stops.
pub fn run(mcu: &mut Mcu, script: &mut Script, until: u64) -> Result<(), String> {
    match mcu.run_until(until, script) {
        Stop::Reached => Ok(()),
        stop => Err(format!(
            "stopped at {:#06x} after {} cycles: {stop:?}",
            mcu.program_counter(),
            mcu.cycle()
        )),
    }
}

/// Power on, until the first tick; its cycle.
///
/// # Errors
/// An image that stops, or does not tick within a second.
pub fn start(mcu: &mut Mcu, script: &mut Script) -> Result<u64, String> {
    for millisecond in 1..1_000 {
        run(mcu, script, millisecond * MILLISECOND)?;
        if let Some(first) = script.first_tick {
            return Ok(first);
        }
    }
    Err("no tick within a second".to_owned())
}

/// Puts an image through the session.
///
/// # Errors
/// An image that stops.
pub fn play(mcu: &mut Mcu) -> Result<Script, String> {
    act(mcu, deeds())
}

/// Puts an image through requests by chance.
///
/// # Errors
/// An image that stops.
pub fn play_by_chance(mcu: &mut Mcu, seed: u64) -> Result<Script, String> {
    act(mcu, chance(seed))
}

/// Requests end 25.3 ms after a tick, not when a millisecond ends.
const OFF_THE_EDGE: u64 = MILLISECOND * 2 / 5;

fn act(mcu: &mut Mcu, deeds: Vec<(u64, Deed)>) -> Result<Script, String> {
    let mut script = Script::default();
    let first = start(mcu, &mut script)?;
    for (ms, deed) in deeds {
        run(mcu, &mut script, first + ms * MILLISECOND + OFF_THE_EDGE)?;
        match deed {
            Deed::Send(bytes) => bytes.into_iter().for_each(|byte| mcu.send(byte)),
            Deed::Arm(number) => {
                let nonce = nonce(&script.line);
                if let Deed::Send(bytes) = request(number, Command::Arm { nonce }) {
                    bytes.into_iter().for_each(|byte| mcu.send(byte));
                }
            }
            Deed::LastTick => script.reset = true,
            Deed::SendWithoutStopBit(byte) => mcu.send_without_stop_bit(byte),
            Deed::Quiet(quiet) => script.quiet = quiet,
            // PD2.
            Deed::Press(true) => mcu.drive(Port::D, 1 << 2, 0),
            Deed::Press(false) => mcu.release(Port::D, 1 << 2),
            Deed::Flip(address) => {
                let mut bytes = mcu.eeprom().to_vec();
                bytes[address] ^= 1;
                mcu.set_eeprom(&bytes);
            }
        }
    }
    script.eeprom = mcu.eeprom().to_vec();
    Ok(script)
}
