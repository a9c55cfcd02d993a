// What a session showed.

use wire::{Decoder, Frame, Health};

use super::Script;

/// Peak-to-peak jitter of the sampling instants, cycles: every period is a multiple of timer 1's 64 cycles.
pub fn jitter(script: &Script) -> u64 {
    let Some(&first) = script.instants.first() else {
        return u64::MAX;
    };
    let late: Vec<i64> = script
        .instants
        .iter()
        .map(|&at| ((at - first) as i64 + 32).rem_euclid(64) - 32)
        .collect();
    late.iter()
        .max()
        .unwrap_or(&0)
        .abs_diff(*late.iter().min().unwrap_or(&0))
}

/// The longest work of a tick that a health frame told of, timer ticks.
pub fn busy_max(script: &Script) -> u16 {
    let mut decoder = Decoder::new();
    let frames = script.line.iter().filter_map(|&byte| decoder.push(byte));
    let healths = frames.filter_map(|frame| match frame {
        Ok(Frame::Health(health)) => Some(health.tick_busy_max),
        _ => None,
    });
    healths.max().unwrap_or(0)
}

/// The nonce that the board told last; 0 before it has told one.
pub fn nonce(line: &[u8]) -> u16 {
    let mut decoder = Decoder::new();
    let frames = line.iter().filter_map(|&byte| decoder.push(byte));
    let told = frames.filter_map(|frame| match frame {
        Ok(Frame::Reply(reply)) if reply.command == wire::code::ARM => Some(reply.value as u16),
        _ => None,
    });
    told.last().unwrap_or(0)
}

/// What came over the line, frame by frame, without what depends on the image's speed and stack.
pub fn frames(line: &[u8]) -> Vec<String> {
    let whole = line.split_inclusive(|&byte| byte == 0);
    whole
        .filter(|bytes| bytes.ends_with(&[0]))
        .map(|bytes| {
            let mut decoder = Decoder::new();
            let frame = bytes.iter().find_map(|&byte| decoder.push(byte));
            match (frame, bytes) {
                (Some(Ok(Frame::Health(health))), _) => {
                    let health = Health {
                        tick_busy_max: 0,
                        stack_free: 0,
                        ..health
                    };
                    format!("{health:?}")
                }
                (Some(Ok(frame)), _) => format!("{bytes:02x?} {frame:?}"),
                // The console's last number is the free stack.
                (_, [b'v', ..]) => {
                    let text = String::from_utf8_lossy(bytes);
                    text.split(" z").next().unwrap_or_default().to_owned()
                }
                (frame, _) => format!("{bytes:02x?} {frame:?}"),
            }
        })
        .collect()
}
