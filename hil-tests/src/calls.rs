//! Who calls whom in an image, read off its instructions.

use std::collections::{BTreeMap, BTreeSet};

/// What one instruction does to the flow; addresses are those of words.
pub(crate) enum Flow {
    /// To the next instruction.
    On,
    /// To the next one or the one after it.
    Skip,
    /// To the next one or there.
    Branch(usize),
    /// There.
    Jump(usize),
    /// There, and back to the next one.
    Call(usize),
    /// Out of the function.
    Return,
    /// To an address that only the running program knows.
    Indirect,
}

pub(crate) fn word(flash: &[u8], at: usize) -> u16 {
    let byte = |at: usize| flash.get(at).copied().unwrap_or(0xff);
    u16::from_le_bytes([byte(2 * at), byte(2 * at + 1)])
}

/// Length of the instruction, words, and what it does to the flow (instruction set manual).
pub(crate) fn decode(flash: &[u8], at: usize) -> (usize, Flow) {
    let code = word(flash, at);
    let near = |bits: u32| {
        // Sign extended; from the next word.
        let offset = (i32::from(code) << (32 - bits) >> (32 - bits)) as isize;
        (at + 1).wrapping_add_signed(offset)
    };
    let far = usize::from(word(flash, at + 1));
    match code {
        0x9508 | 0x9518 => (1, Flow::Return),
        0x9409 | 0x9509 => (1, Flow::Indirect),
        _ if code & 0xfe0e == 0x940c => (2, Flow::Jump(far)),
        _ if code & 0xfe0e == 0x940e => (2, Flow::Call(far)),
        _ if code & 0xfc0f == 0x9000 => (2, Flow::On),
        _ if code & 0xf000 == 0xc000 => (1, Flow::Jump(near(12))),
        _ if code & 0xf000 == 0xd000 => (1, Flow::Call(near(12))),
        _ if code & 0xf800 == 0xf000 => {
            let offset = (i32::from(code) << 22 >> 25) as isize;
            (1, Flow::Branch((at + 1).wrapping_add_signed(offset)))
        }
        _ if code & 0xfc00 == 0x1000 || code & 0xfc00 == 0xfc00 || code & 0xfd00 == 0x9900 => {
            (1, Flow::Skip)
        }
        _ => (1, Flow::On),
    }
}

/// The functions that one calls; what it jumps to is a part of it.
///
/// # Errors
/// The address of a call or jump whose target is not in the instruction.
fn called(flash: &[u8], function: usize) -> Result<BTreeSet<usize>, usize> {
    let (mut seen, mut open) = (BTreeSet::new(), vec![function]);
    let mut calls = BTreeSet::new();
    while let Some(at) = open.pop() {
        if at >= flash.len() / 2 || !seen.insert(at) {
            continue;
        }
        let (length, flow) = decode(flash, at);
        let next = at + length;
        match flow {
            Flow::On => open.push(next),
            Flow::Skip => open.extend([next, next + decode(flash, next).0]),
            Flow::Branch(there) => open.extend([next, there]),
            Flow::Jump(there) => open.push(there),
            // The AVR's way to make room on the stack: a call to the next instruction.
            Flow::Call(there) if there == next => open.push(next),
            Flow::Call(there) => {
                calls.insert(there);
                open.push(next);
            }
            Flow::Return => {}
            Flow::Indirect => return Err(2 * at),
        }
    }
    Ok(calls)
}

/// A function that calls itself, by whatever way: the byte addresses of the functions on the way. Begins at the reset and
/// at each interrupt.
///
/// # Errors
/// The byte address of a call or jump whose target is not in the instruction.
pub fn recursion(flash: &[u8], vectors: usize) -> Result<Option<Vec<usize>>, usize> {
    let mut graph = BTreeMap::new();
    let mut open: Vec<usize> = (0..vectors).map(|vector| 2 * vector).collect();
    while let Some(function) = open.pop() {
        if graph.contains_key(&function) {
            continue;
        }
        let calls = called(flash, function)?;
        open.extend(&calls);
        graph.insert(function, calls);
    }
    // What is left when everything that calls nothing that is left has gone lies on a cycle, or leads to one.
    loop {
        let left: BTreeSet<usize> = graph.keys().copied().collect();
        let before = graph.len();
        graph.retain(|_, calls| calls.iter().any(|call| left.contains(call)));
        if graph.is_empty() {
            return Ok(None);
        }
        if graph.len() == before {
            return Ok(Some(left.into_iter().map(|at| 2 * at).collect()));
        }
    }
}

/// What an instruction does to the stack's depth, bytes.
enum Depth {
    /// Nothing, or what the flow says.
    Same,
    /// So many more, or less.
    By(i32),
    /// The pointer to the frame moves by so many; the stack pointer follows where it is written.
    Frame(i32),
    /// The stack pointer is set to the pointer to the frame.
    Set,
}

fn depth(flash: &[u8], at: usize) -> Depth {
    /// The frame's pointer is Y = r29:r28.
    const LOW_OF_Y: u16 = 0xc;
    let code = word(flash, at);
    let small = i32::from(code & 0xf | code >> 2 & 0x30);
    let byte = |code: u16| i32::from(code & 0xf | code >> 4 & 0xf0);
    match code {
        _ if code & 0xfe0f == 0x920f => Depth::By(1),
        _ if code & 0xfe0f == 0x900f => Depth::By(-1),
        // sbiw and adiw of Y.
        _ if code & 0xff30 == 0x9720 => Depth::Frame(small),
        _ if code & 0xff30 == 0x9620 => Depth::Frame(-small),
        // subi r28 and sbci r29 behind it: 16 bits, negative where the frame is given back.
        _ if code & 0xf0f0 == 0x5000 | LOW_OF_Y << 4 => {
            let high = byte(word(flash, at + 1));
            Depth::Frame(i32::from((high << 8 | byte(code)) as i16))
        }
        // out SPL, r28.
        0xbfcd => Depth::Set,
        _ => Depth::Same,
    }
}

/// Most bytes that a function and all it calls put on the stack, its own return address not counted.
///
/// # Errors
/// The byte address of a call or jump whose target is not in the instruction, or of a function that calls itself.
pub fn stack_bound(flash: &[u8], function: usize) -> Result<u32, usize> {
    bound(flash, function, &mut BTreeMap::new(), &mut Vec::new())
}

fn bound(
    flash: &[u8],
    function: usize,
    known: &mut BTreeMap<usize, u32>,
    path: &mut Vec<usize>,
) -> Result<u32, usize> {
    /// A return address.
    const ADDRESS: i32 = 2;
    if let Some(&deepest) = known.get(&function) {
        return Ok(deepest);
    }
    if path.contains(&function) {
        return Err(2 * function);
    }
    path.push(function);
    let mut seen = BTreeSet::new();
    // Address, depth there, and what Y is below where the stack pointer was when it was read.
    let mut open = vec![(function, 0i32, 0i32)];
    let mut deepest = 0;
    while let Some((at, before, moved)) = open.pop() {
        if at >= flash.len() / 2 || !seen.insert(at) {
            continue;
        }
        let (now, moved) = match depth(flash, at) {
            Depth::Same => (before, moved),
            Depth::By(by) => (before + by, moved),
            Depth::Frame(by) => (before, moved + by),
            Depth::Set => (before + moved, 0),
        };
        deepest = deepest.max(now);
        let (length, flow) = decode(flash, at);
        let next = at + length;
        match flow {
            Flow::On => open.push((next, now, moved)),
            Flow::Skip => {
                let beyond = next + decode(flash, next).0;
                open.extend([(next, now, moved), (beyond, now, moved)]);
            }
            Flow::Branch(there) => open.extend([(next, now, moved), (there, now, moved)]),
            Flow::Jump(there) => open.push((there, now, moved)),
            Flow::Call(there) if there == next => {
                deepest = deepest.max(now + ADDRESS);
                open.push((next, now + ADDRESS, moved));
            }
            Flow::Call(there) => {
                let below = bound(flash, there, known, path)?.cast_signed();
                deepest = deepest.max(now + ADDRESS + below);
                open.push((next, now, moved));
            }
            Flow::Return => {}
            Flow::Indirect => return Err(2 * at),
        }
    }
    path.pop();
    let deepest = deepest.max(0).cast_unsigned();
    known.insert(function, deepest);
    Ok(deepest)
}

#[cfg(test)]
mod tests {
    use super::{recursion, stack_bound};

    fn flash(words: &[u16]) -> Vec<u8> {
        words.iter().flat_map(|word| word.to_le_bytes()).collect()
    }

    #[test]
    fn a_function_that_calls_itself_through_another_is_found() {
        // 0: rjmp 2; 2: rcall 4, ret; 4: sbrc, rcall 2, ret.
        let image = flash(&[0xc001, 0, 0xd001, 0x9508, 0xfd80, 0xdffc, 0x9508]);
        assert_eq!(recursion(&image, 1), Ok(Some(vec![0, 4, 8])));
        // The same without the way back.
        let image = flash(&[0xc001, 0, 0xd001, 0x9508, 0xfd80, 0x0000, 0x9508]);
        assert_eq!(recursion(&image, 1), Ok(None));
    }

    #[test]
    fn a_call_that_nobody_can_follow_is_an_error() {
        assert_eq!(recursion(&flash(&[0xc001, 0, 0x9509, 0x9508]), 1), Err(4));
    }

    #[test]
    fn the_bound_counts_pushes_frames_and_the_deepest_call() {
        // 0: push r28, push r29, in r28 SPL, in r29 SPH, sbiw r28 20, out SPH, out SPL, rcall 10, adiw r28 20, out SPH,
        // out SPL, pop r29, pop r28, ret; 14: push r1, rcall 17, pop r1, 17 (also): ret.
        let image = flash(&[
            0x93cf, 0x93df, 0xb7cd, 0xb7de, 0x9764, 0xbfde, 0xbfcd, 0xd006, 0x9664, 0xbfde, 0xbfcd,
            0x91df, 0x91cf, 0x9508, 0x921f, 0xd001, 0x901f, 0x9508,
        ]);
        // Two pushes, 20 of frame, a return address, a push, a return address.
        assert_eq!(stack_bound(&image, 0), Ok(27));
        assert_eq!(stack_bound(&image, 14), Ok(3));
    }
}
