//! CRC-32C (Castagnoli): reflected, polynomial 0x1EDC6F41, initial value and final exclusive-or 0xFFFFFFFF.
//!
//! The check value of `b"123456789"` is 0xE3069283 (RFC 3720, B.4 uses the same code).

/// The register's value before the first byte.
pub const INIT: u32 = 0xFFFF_FFFF;

/// The register's value after a message and its own CRC, little endian, have passed: the same for every message.
pub const RESIDUE: u32 = 0xB798_B438;

/// Whether a register has passed a message and its own CRC.
#[must_use]
#[cfg_attr(target_arch = "avr", inline(never))]
pub const fn is_whole(register: u32) -> bool {
    register == RESIDUE
}

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

const POLYNOMIAL_REFLECTED: u32 = 0x82F6_3B78;

/// The register after one more byte, bit by bit: a table would occupy SRAM. In Rust the compiler unrolls it to 244 bytes
/// of flash, or makes a loop that takes twice as long; the carry flag is what it lacks.
#[cfg(target_arch = "avr")]
#[must_use]
#[inline(never)]
#[allow(unsafe_code)]
pub fn update(register: u32, byte: u8) -> u32 {
    let (mut low, mut high) = (register as u16 ^ byte as u16, (register >> 16) as u16);
    // SAFETY: registers and flags alone.
    unsafe {
        core::arch::asm!(
            "2:",
            "lsr {high:h}",
            "ror {high:l}",
            "ror {low:h}",
            "ror {low:l}",
            "brcc 3f",
            "eor {low:l}, {poly_low:l}",
            "eor {low:h}, {poly_low:h}",
            "eor {high:l}, {poly_high:l}",
            "eor {high:h}, {poly_high:h}",
            "3:",
            "dec {left}",
            "brne 2b",
            left = inout(reg) 8_u8 => _,
            low = inout(reg_pair) low,
            high = inout(reg_pair) high,
            poly_low = in(reg_pair) POLYNOMIAL_REFLECTED as u16,
            poly_high = in(reg_pair) (POLYNOMIAL_REFLECTED >> 16) as u16,
            options(pure, nomem, nostack),
        );
    }
    (high as u32) << 16 | low as u32
}

/// What eight zero bits shifted in make of the register value `index`: the definition, bit by bit.
#[cfg(not(target_arch = "avr"))]
const fn entry(index: u8) -> u32 {
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
