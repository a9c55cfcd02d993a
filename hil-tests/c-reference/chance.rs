//! Requests by chance.

use super::*;

/// Requests by chance, one after each tick: commands that there are, with arguments that are small, extreme or anything,
/// and codes that no command has. Without a reboot, and at the rate and speed of the start: at others, what comes first
/// is a matter of the image's speed.
pub(super) fn chance(seed: u64) -> Vec<(u64, Deed)> {
    const CODES: [u8; 24] = [
        code::ARM,
        code::ARM,
        code::ARM,
        code::PING,
        code::GET_HELLO,
        code::KEEP_ALIVE,
        code::COUNTERS,
        code::CLEAR_COUNTERS,
        code::SET_GYRO,
        code::SET_ACC_RANGE,
        code::BIAS_NULL,
        code::SET_BIAS,
        code::SET_SCALE,
        code::MOTOR_DUTY,
        code::MOTOR_PROFILE,
        code::MOTOR_LIMITS,
        code::READ_REGISTER,
        code::WRITE_REGISTER,
        code::SELF_TEST,
        code::STORE_CONFIG,
        code::LOAD_CONFIG,
        code::DEFAULT_CONFIG,
        code::SET_BOARD_ID,
        code::KEEP_ALIVE,
    ];
    let mut all = vec![(1, Deed::Quiet(seed.is_multiple_of(2)))];
    let mut asked_for_nonce = false;
    let mut let_go = None;
    // When the set-up was last stored; at the start nothing is.
    let mut stored = 0;
    for n in 0..CHANCE_REQUESTS {
        let bits = |salt: u64| spread(seed ^ spread(n << 8 | salt));
        // The motor's stop, for a millisecond or for some requests.
        if let_go == Some(n) {
            all.push((20 + 50 * n, Deed::Press(false)));
            let_go = None;
            continue;
        }
        if let_go.is_none() && bits(4) % 24 == 0 {
            all.push((20 + 50 * n, Deed::Press(true)));
            match bits(5) % 6 {
                0 => let_go = Some(n + 4),
                _ => all.push((21 + 50 * n, Deed::Press(false))),
            }
            continue;
        }
        let code = match bits(0) % 16 {
            0 => (bits(1) % 13 * 7) as u8,
            _ => CODES[(bits(1) % CODES.len() as u64) as usize],
        };
        if matches!(code, code::REBOOT | code::SET_RATE | code::SET_BAUD) {
            continue;
        }
        // Both write where the newest copy is not; what they make of chance is in the other session.
        if matches!(code, code::SET_CORRECTION..=code::GET_CORRECTION) {
            continue;
        }
        // The reference writes the set-up as it was when it was asked to, the image tells of one that was changed meanwhile.
        if n < stored + 20
            && matches!(
                code,
                code::SET_GYRO
                    | code::SET_ACC_RANGE
                    | code::BIAS_NULL
                    | code::SET_BIAS
                    | code::SET_SCALE
                    | code::MOTOR_LIMITS
                    | code::DEFAULT_CONFIG
                    | code::SET_BOARD_ID
            )
        {
            continue;
        }
        // The second's health frame comes at the same moment as this request: with a long answer beside it, a byte that
        // has left or not decides whether the reply fits.
        if n % 20 == 19
            && matches!(
                code,
                code::GET_HELLO | code::COUNTERS | code::CLEAR_COUNTERS
            )
        {
            continue;
        }
        // A copy takes 0.6 s to write: the last one is to be whole when the EEPROMs are compared.
        if code == code::STORE_CONFIG && n + 20 > CHANCE_REQUESTS {
            continue;
        }
        if code == code::STORE_CONFIG {
            stored = n;
        }
        // Asked for a nonce, the board is given it in the next slot, seven times of eight.
        if asked_for_nonce && bits(3) % 8 != 0 {
            all.push((20 + 50 * n, Deed::Arm(n as u16)));
            asked_for_nonce = false;
            continue;
        }
        if code == code::ARM {
            all.push((20 + 50 * n, raw_request(n as u16, code, [0; 8])));
            asked_for_nonce = true;
            continue;
        }
        // As many bytes as the command has, more often than not.
        let used = wire::Asked {
            number: 0,
            code,
            arguments: [1; 8],
        };
        let mut arguments = [0; 8];
        for (place, byte) in (0..).zip(&mut arguments) {
            let mut unused = used;
            unused.arguments = [0; 8];
            unused.arguments[place] = 1;
            if unused.refusal().is_some() && bits(2) % 8 != 0 {
                break;
            }
            let any = bits(10 + place as u64);
            *byte = match any % 4 {
                0 => (any >> 8) as u8 % 5,
                1 => 0,
                2 => 0xFF,
                _ => (any >> 8) as u8,
            };
        }
        all.push((20 + 50 * n, raw_request(n as u16, code, arguments)));
    }
    all.push((20 + 50 * CHANCE_REQUESTS + 40, Deed::LastTick));
    all
}

/// Requests in [`chance`], at most.
const CHANCE_REQUESTS: u64 = 400;
