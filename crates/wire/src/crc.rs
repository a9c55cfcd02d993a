//! CRC-32C (Castagnoli): reflected, polynomial 0x1EDC6F41, initial value and final exclusive-or 0xFFFFFFFF.
//!
//! The check value of `b"123456789"` is 0xE3069283 (RFC 3720, B.4 uses the same code).

/// The register's value before the first byte.
pub const INIT: u32 = 0xFFFF_FFFF;

/// The register's value after a message and its own CRC, little endian, have passed: the same for every message.
pub const RESIDUE: u32 = 0xB798_B438;

/// The CRC that a register stands for, once all bytes have passed.
#[must_use]
pub const fn finish(register: u32) -> u32 {
    !register
}

/// The CRC-32C of `bytes`.
#[must_use]
pub fn crc32c(bytes: &[u8]) -> u32 {
    let mut register = INIT;
    for &byte in bytes {
        register = update(register, byte);
    }
    finish(register)
}

/// The register after one more byte.
#[cfg(not(target_arch = "avr"))]
#[must_use]
#[inline]
pub fn update(register: u32, byte: u8) -> u32 {
    // The index has eight bits and the table 256 entries, so the fallback is never taken and the compiler drops it.
    let entry = TABLE
        .get(usize::from(register as u8 ^ byte))
        .copied()
        .unwrap_or(0);
    (register >> 8) ^ entry
}

/// The register after one more byte.
#[cfg(target_arch = "avr")]
#[must_use]
#[inline(never)]
pub fn update(register: u32, byte: u8) -> u32 {
    update_without_table(register, byte)
}

/// One byte without a table, which on the AVR would occupy SRAM: a CRC is linear, so the table's entry is the
/// exclusive-or of the entries of the single bits. Shifting by whole bytes costs register moves only.
#[cfg(any(test, target_arch = "avr"))]
#[inline(always)]
const fn update_without_table(register: u32, byte: u8) -> u32 {
    let index = register as u8 ^ byte;
    let mut next = register >> 8;
    if index & 0x01 != 0 {
        next ^= entry(0x01);
    }
    if index & 0x02 != 0 {
        next ^= entry(0x02);
    }
    if index & 0x04 != 0 {
        next ^= entry(0x04);
    }
    if index & 0x08 != 0 {
        next ^= entry(0x08);
    }
    if index & 0x10 != 0 {
        next ^= entry(0x10);
    }
    if index & 0x20 != 0 {
        next ^= entry(0x20);
    }
    if index & 0x40 != 0 {
        next ^= entry(0x40);
    }
    if index & 0x80 != 0 {
        next ^= entry(0x80);
    }
    next
}

/// What eight zero bits shifted in make of the register value `index`: the definition, bit by bit.
const fn entry(index: u8) -> u32 {
    const POLYNOMIAL_REFLECTED: u32 = 0x82F6_3B78;
    let mut register = index as u32;
    let mut bit = 0;
    while bit < 8 {
        register = if register & 1 == 0 {
            register >> 1
        } else {
            (register >> 1) ^ POLYNOMIAL_REFLECTED
        };
        bit += 1;
    }
    register
}

#[cfg(not(target_arch = "avr"))]
static TABLE: [u32; 256] = {
    let mut table = [0; 256];
    let mut index = 0;
    while index < 256 {
        table[index] = entry(index as u8);
        index += 1;
    }
    table
};

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ref_check_values_of_rfc_3720() {
        // RFC 3720, appendix B.4: the iSCSI test vectors, as the CRC's 32-bit value.
        assert_eq!(crc32c(b"123456789"), 0xE306_9283);
        assert_eq!(crc32c(&[0; 32]), 0x8A91_36AA);
        assert_eq!(crc32c(&[0xFF; 32]), 0x62A8_AB43);
        let ascending: std::vec::Vec<u8> = (0..32).collect();
        assert_eq!(crc32c(&ascending), 0x46DD_794E);
    }

    #[test]
    fn the_board_and_the_host_compute_the_same() {
        let mut register = INIT;
        for step in 0..100_000_u32 {
            let byte = (step.wrapping_mul(2_654_435_761) >> 24) as u8;
            assert_eq!(update_without_table(register, byte), update(register, byte));
            register = update(register, byte);
        }
    }

    #[test]
    fn a_message_followed_by_its_crc_leaves_the_residue() {
        for message in [&b""[..], b"1", b"a message"] {
            let tail = crc32c(message).to_le_bytes();
            let register = message
                .iter()
                .chain(&tail)
                .fold(INIT, |register, &byte| update(register, byte));
            assert_eq!(register, RESIDUE);
        }
    }
}
