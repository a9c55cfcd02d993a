//! Reads an image: flash, start values, EEPROM, fuses, and for which chip it was linked.

use object::elf::{EF_AVR_ARCH_AVR5, EM_AVR, FileHeader32};
use object::read::elf::{ElfFile32, FileHeader, ProgramHeader};
use object::{LittleEndian, Object, ObjectSection, ObjectSymbol};

/// Size of the flash, bytes.
pub const FLASH: usize = 16 * 1024;
const EEPROM: usize = 512;
/// Where the linker puts RAM (which no programmer fills), EEPROM and fuses.
const RAM_ADDRESS: u32 = 0x80_0000;
const EEPROM_ADDRESS: u32 = 0x81_0000;
const FUSE_ADDRESS: u32 = 0x82_0000;
const LOCK_ADDRESS: u32 = 0x83_0000;
/// A note of avr-libc's start-up code, which names the chip.
const DEVICE_NOTE: &str = ".note.gnu.avr.deviceinfo";
const CHIP: &str = "atmega16";

/// Why an image cannot be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// Not an ELF file, or a damaged one.
    #[error("the image is no ELF file of 32 bits, little endian")]
    NotElf(#[source] object::Error),
    /// The file ends before what it announces.
    #[error("the image ends before its bytes for {address:#x}: was it copied whole?")]
    Truncated {
        /// Where the missing bytes belong.
        address: u32,
    },
    /// For another processor.
    #[error("the image is for machine {found}, not for the AVR (83)")]
    NotAvr {
        /// e_machine.
        found: u16,
    },
    /// For another AVR.
    #[error("the image is for {found}, not for the atmega16: link it with -mmcu=atmega16")]
    OtherChip {
        /// What it says.
        found: String,
    },
    /// Something lies where this chip has nothing.
    #[error("{len} bytes at {address:#x} of the image do not fit: {memory} ends at {end:#x}")]
    DoesNotFit {
        /// Start.
        address: u32,
        /// Length.
        len: usize,
        /// Which memory.
        memory: &'static str,
        /// Its end.
        end: u32,
    },
    /// No code.
    #[error("the image holds no code: is it linked?")]
    Empty,
}

/// What an image holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Image {
    /// Flash from 0 on, start values of RAM behind the code.
    pub flash: Vec<u8>,
    /// EEPROM, where the image brings one.
    pub eeprom: Option<Vec<u8>>,
    /// Low and high fuse, where the image brings them.
    pub fuses: Option<[u8; 2]>,
    /// Symbols with their addresses; RAM from 0x800000 on.
    pub symbols: Vec<(String, u32)>,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// [`LoadError`] for what is no image of an ATmega16.
    pub fn read(elf: &[u8]) -> Result<Self, LoadError> {
        let file = ElfFile32::<LittleEndian>::parse(elf).map_err(LoadError::NotElf)?;
        let header: &FileHeader32<LittleEndian> = file.elf_header();
        let machine = header.e_machine(LittleEndian);
        if machine != EM_AVR {
            return Err(LoadError::NotAvr { found: machine });
        }
        check_chip(&file, header.e_flags(LittleEndian))?;
        let mut image = Image {
            flash: Vec::new(),
            eeprom: None,
            fuses: None,
            symbols: Vec::new(),
        };
        let segments = header
            .program_headers(LittleEndian, elf)
            .map_err(LoadError::NotElf)?;
        for segment in segments {
            if segment.p_type(LittleEndian) != object::elf::PT_LOAD {
                continue;
            }
            let address = segment.p_paddr(LittleEndian);
            let bytes = segment
                .data(LittleEndian, elf)
                .map_err(|()| LoadError::Truncated { address })?;
            if !bytes.is_empty() {
                image.place(address, bytes)?;
            }
        }
        if image.flash.is_empty() {
            return Err(LoadError::Empty);
        }
        image.symbols = file
            .symbols()
            .filter_map(|s| Some((s.name().ok()?.to_owned(), s.address() as u32)))
            .filter(|(name, _)| !name.is_empty())
            .collect();
        Ok(image)
    }

    fn place(&mut self, address: u32, bytes: &[u8]) -> Result<(), LoadError> {
        let does_not_fit = |memory, end: usize| LoadError::DoesNotFit {
            address,
            len: bytes.len(),
            memory,
            end: end as u32,
        };
        match address {
            RAM_ADDRESS..EEPROM_ADDRESS => {}
            0..RAM_ADDRESS => {
                let end = address as usize + bytes.len();
                if end > FLASH {
                    return Err(does_not_fit("flash", FLASH));
                }
                if self.flash.len() < end {
                    self.flash.resize(end, 0xff);
                }
                self.flash[address as usize..end].copy_from_slice(bytes);
            }
            EEPROM_ADDRESS..FUSE_ADDRESS => {
                let from = (address - EEPROM_ADDRESS) as usize;
                let end = from + bytes.len();
                if end > EEPROM {
                    return Err(does_not_fit("EEPROM", EEPROM_ADDRESS as usize + EEPROM));
                }
                let eeprom = self.eeprom.get_or_insert_with(|| vec![0xff; EEPROM]);
                eeprom[from..end].copy_from_slice(bytes);
            }
            FUSE_ADDRESS..LOCK_ADDRESS => match *bytes {
                [low, high] if address == FUSE_ADDRESS => self.fuses = Some([low, high]),
                _ => return Err(does_not_fit("fuses", FUSE_ADDRESS as usize + 2)),
            },
            // Lock bits and signature say nothing to a simulation.
            _ => {}
        }
        Ok(())
    }

    /// The address of a symbol; RAM from 0x800000 on.
    #[must_use]
    pub fn symbol(&self, name: &str) -> Option<u32> {
        let found = self.symbols.iter().find(|(own, _)| own == name)?;
        Some(found.1)
    }
}

/// The note of the start-up code names the chip; without one, the architecture of its family has to do.
fn check_chip(file: &ElfFile32<'_, LittleEndian>, flags: u32) -> Result<(), LoadError> {
    let note = file
        .section_by_name(DEVICE_NOTE)
        .and_then(|section| section.data().ok());
    if let Some(note) = note {
        let names: Vec<&str> = note
            .split(|&byte| byte == 0)
            .filter_map(|word| std::str::from_utf8(word).ok())
            .filter(|word| word.len() > 3 && word.bytes().all(|b| b.is_ascii_alphanumeric()))
            .collect();
        return if names.contains(&CHIP) {
            Ok(())
        } else {
            Err(LoadError::OtherChip {
                found: names.join(" "),
            })
        };
    }
    match flags & 0x7f {
        EF_AVR_ARCH_AVR5 => Ok(()),
        other => Err(LoadError::OtherChip {
            found: format!("AVR architecture {other}"),
        }),
    }
}
