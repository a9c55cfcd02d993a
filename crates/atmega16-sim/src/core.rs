//! simavr's part: it executes the instructions. All registers are answered by [`Chip`], none of simavr's peripherals
//! runs, and its clock, interrupts and sleep are driven from here.

use std::ffi::{CStr, c_int, c_void};
use std::ptr::{NonNull, null_mut};

use simavr_ffi as ffi;

use crate::chip::Chip;
use crate::elf::FLASH;
use crate::register as r;

unsafe extern "C" {
    /// Runs instructions until `run_cycle_count` is used up or the interrupt flag rises; returns the next address.
    /// simavr's sim_core.h, which the bindings leave out.
    fn avr_run_one(avr: *mut ffi::avr_t) -> u32;
}

/// General registers, I/O, SRAM.
pub const DATA: usize = 0x460;
/// Where SRAM begins.
pub const SRAM: usize = 0x60;
const SLEEPING: c_int = ffi::cpu_Sleeping as c_int;
const RUNNING: c_int = ffi::cpu_Running as c_int;
/// Index of the interrupt flag.
const I: usize = ffi::S_I as usize;

/// A processor with its registers answered by a [`Chip`].
pub struct Core {
    avr: NonNull<ffi::avr_t>,
    shared: NonNull<Shared>,
    /// simavr's own peripherals, unhooked; its clean-up wants them back.
    theirs: *mut ffi::avr_io_t,
}

/// What the callbacks reach. `io` comes first: simavr hands back its address.
#[repr(C)]
struct Shared {
    io: ffi::avr_io_t,
    chip: Chip,
    returned: bool,
}

/// How instructions stopped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ran {
    /// Its cycles are used up, or something changed.
    On,
    /// The interrupt flag rose, or an interrupt returned: one more instruction runs before the next interrupt.
    Enabled,
    /// `sleep`.
    Sleep,
    /// No instruction of this chip.
    Crash,
}

// SAFETY: nothing of it is tied to a thread; simavr keeps no state outside avr_t but its logger.
unsafe impl Send for Core {}

impl Core {
    pub fn new(flash: &[u8]) -> Self {
        // SAFETY: makes, fills and initialises an avr_t of simavr's own; every pointer written lives as long as it.
        unsafe {
            let name: &CStr = c"atmega16";
            let avr = NonNull::new(ffi::avr_make_mcu_by_name(name.as_ptr()))
                .expect("simavr has the atmega16");
            let p = avr.as_ptr();
            ffi::avr_init(p);
            (*p).set_log(ffi::LOG_NONE as u8);
            (*p).frequency = crate::CLOCK_HZ;
            std::slice::from_raw_parts_mut((*p).flash, FLASH).fill(0xff);
            let len = flash.len().min(FLASH);
            std::ptr::copy_nonoverlapping(flash.as_ptr(), (*p).flash, len);
            let theirs = (*p).io_port;
            let shared = Box::new(Shared {
                io: std::mem::zeroed(),
                chip: Chip::new(),
                returned: false,
            });
            let shared = NonNull::from(Box::leak(shared));
            (*shared.as_ptr()).io.kind = c"chip".as_ptr();
            (*shared.as_ptr()).io.avr = p;
            (*shared.as_ptr()).io.ioctl = Some(on_command);
            (*p).io_port = &raw mut (*shared.as_ptr()).io;
            let param = shared.as_ptr().cast::<c_void>();
            for address in 0..r::SPL {
                let slot = &mut (*p).io[usize::from(address)];
                slot.r.c = Some(on_read);
                slot.r.param = param;
                slot.w.c = Some(on_write);
                slot.w.param = param;
            }
            // `sbi` and `cbi` of this chip read and write the whole register.
            for slot in &mut (*p).bit_io {
                slot.c = None;
                slot.param = null_mut();
            }
            let running = &raw mut (*p).interrupts.irq[ffi::AVR_INT_IRQ_RUNNING as usize];
            ffi::avr_irq_register_notify(running, Some(on_return), param);
            let mut core = Core {
                avr,
                shared,
                theirs,
            };
            core.restart();
            core
        }
    }

    fn avr(&self) -> &ffi::avr_t {
        // SAFETY: made in `new`, freed in `drop`; no callback runs while the reference lives.
        unsafe { self.avr.as_ref() }
    }

    fn avr_mut(&mut self) -> &mut ffi::avr_t {
        // SAFETY: as above.
        unsafe { self.avr.as_mut() }
    }

    pub fn chip(&self) -> &Chip {
        // SAFETY: as above.
        unsafe { &self.shared.as_ref().chip }
    }

    pub fn chip_mut(&mut self) -> &mut Chip {
        // SAFETY: as above.
        unsafe { &mut self.shared.as_mut().chip }
    }

    pub fn data(&self) -> &[u8] {
        // SAFETY: simavr allocates so many bytes for this chip.
        unsafe { std::slice::from_raw_parts(self.avr().data, DATA) }
    }

    pub fn data_mut(&mut self) -> &mut [u8] {
        // SAFETY: as above.
        unsafe { std::slice::from_raw_parts_mut(self.avr_mut().data, DATA) }
    }

    pub fn cycle(&self) -> u64 {
        self.avr().cycle
    }

    pub fn set_cycle(&mut self, cycle: u64) {
        self.avr_mut().cycle = cycle;
    }

    pub fn program_counter(&self) -> u32 {
        self.avr().pc
    }

    pub fn set_program_counter(&mut self, to: u32) {
        self.avr_mut().pc = to;
    }

    pub fn stack_pointer(&self) -> u16 {
        let at = 0x20 + usize::from(r::SPL);
        u16::from_le_bytes([self.data()[at], self.data()[at + 1]])
    }

    fn set_stack_pointer(&mut self, to: u16) {
        let at = 0x20 + usize::from(r::SPL);
        self.data_mut()[at..at + 2].copy_from_slice(&to.to_le_bytes());
    }

    pub fn interrupts_enabled(&self) -> bool {
        self.avr().sreg[I] != 0
    }

    /// Program counter, status and stack pointer as after a reset; general registers and SRAM stay.
    pub fn restart(&mut self) {
        let avr = self.avr_mut();
        avr.pc = 0;
        avr.sreg = [0; 8];
        avr.interrupt_state = 0;
        avr.state = RUNNING;
        self.set_stack_pointer(0);
    }

    /// Runs for `cycles` or a little longer: until the instruction that passes them has ended.
    pub fn run(&mut self, cycles: u64) -> Ran {
        let p = self.avr.as_ptr();
        // SAFETY: avr_run_one is what simavr's own loop calls; its callbacks get raw pointers, and no reference of
        // ours lives meanwhile.
        unsafe {
            (*p).run_cycle_count = cycles;
            (*p).interrupt_state = 0;
            (*p).state = RUNNING;
            (*self.shared.as_ptr()).returned = false;
            (*p).pc = avr_run_one(p);
            if (*p).state == SLEEPING {
                (*p).state = RUNNING;
                return Ran::Sleep;
            }
            if (*p).state != RUNNING {
                return Ran::Crash;
            }
            let enabled = (*p).interrupt_state < 0 || (*self.shared.as_ptr()).returned;
            (*p).interrupt_state = 0;
            if enabled { Ran::Enabled } else { Ran::On }
        }
    }

    /// Calls a vector: pushes the program counter, clears the interrupt flag.
    pub fn call(&mut self, vector: u8) {
        let words = self.avr().pc / 2;
        let pointer = self.stack_pointer();
        for (n, byte) in (0..).zip([words as u8, (words >> 8) as u8]) {
            let at = usize::from(pointer.wrapping_sub(n));
            if let Some(place) = self.data_mut().get_mut(at).filter(|_| at >= SRAM) {
                *place = byte;
            }
        }
        self.set_stack_pointer(pointer.wrapping_sub(2));
        let avr = self.avr_mut();
        avr.sreg[I] = 0;
        avr.pc = u32::from(vector) * 4;
    }
}

impl Drop for Core {
    fn drop(&mut self) {
        // SAFETY: made in `new`; simavr frees its own parts, then nothing refers to ours.
        unsafe {
            let p = self.avr.as_ptr();
            (*p).io_port = self.theirs;
            ffi::avr_terminate(p);
            drop(Box::from_raw(self.shared.as_ptr()));
            libc::free(p.cast());
        }
    }
}

unsafe extern "C" fn on_read(
    avr: *mut ffi::avr_t,
    address: ffi::avr_io_addr_t,
    param: *mut c_void,
) -> u8 {
    // SAFETY: simavr calls with its own avr_t and the parameter given in `new`.
    unsafe {
        let shared = &mut *param.cast::<Shared>();
        shared.chip.read((address - 0x20) as u8, (*avr).cycle)
    }
}

unsafe extern "C" fn on_write(
    avr: *mut ffi::avr_t,
    address: ffi::avr_io_addr_t,
    value: u8,
    param: *mut c_void,
) {
    // SAFETY: as above.
    unsafe {
        let shared = &mut *param.cast::<Shared>();
        let effect = shared
            .chip
            .write((address - 0x20) as u8, value, (*avr).cycle);
        (*avr).cycle += effect.halt;
        if effect.look {
            (*avr).run_cycle_count = 0;
        }
    }
}

/// `wdr`, and what simavr asks of its flash at `lpm`, which is answered by the flash itself.
unsafe extern "C" fn on_command(io: *mut ffi::avr_io_t, command: u32, _: *mut c_void) -> c_int {
    // AVR_IOCTL_WATCHDOG_RESET: "wdtr".
    if command != u32::from_be_bytes(*b"wdtr") {
        return -1;
    }
    // SAFETY: `io` is the first field of `Shared`.
    unsafe {
        let shared = &mut *io.cast::<Shared>();
        let avr = shared.io.avr;
        shared.chip.watchdog.fed((*avr).cycle);
        (*avr).run_cycle_count = 0;
    }
    0
}

/// `reti`.
unsafe extern "C" fn on_return(_: *mut ffi::avr_irq_t, _: u32, param: *mut c_void) {
    // SAFETY: as above.
    unsafe {
        let shared = &mut *param.cast::<Shared>();
        shared.returned = true;
        (*shared.io.avr).run_cycle_count = 0;
    }
}
