//! The sample clock. Nothing may move the instant at which a sample is taken, whatever else goes on:
//!
//! timer 1 counts 4 us ticks to the period (compare A). 64 us before that, compare B interrupts whatever runs, masks
//! the other interrupts and sleeps. The compare A that wakes it is then alone, and the wake-up from sleep takes the
//! same number of cycles every time. Once the first round over the sensors is done, the masks fall and the rest of
//! the acquisition shares the processor with the serial line again.

use core::ptr::addr_of_mut;

use avr_device::atmega16::{CPU, EXINT, PORTD, TC0, TC1};
use avr_device::{asm, interrupt};
use firmware::acquire::work;
use firmware::math::{count_up, known};
use firmware::motor::KEEP_ALIVE_MS;
use firmware::{Job, Raw, Task, acquire};

use super::board::STOP;
use super::{board, sensors, serial};

/// Compare B comes this many ticks of 4 us before compare A: 1024 cycles, more than the longest section with
/// interrupts off and the longest interrupt together (hil-tests/tests/timing.rs measures the jitter).
const GUARD_TICKS: u16 = 16;
const OCIE1A: u8 = 1 << 4;
const OCIE1B: u8 = 1 << 3;
const OCIE0: u8 = 1 << 1;
/// INT0 at a falling edge (ISC0 = 10), in the register that has the sleep's bits, too.
const FALLING: u8 = 1 << 1;
/// Sleep enable, mode idle (SM = 000).
const SLEEP_IDLE: u8 = 1 << 6 | FALLING;
const AWAKE: u8 = FALLING;
/// Of GICR.
const INT0_ON: u8 = 1 << 6;

/// All zeros at first, which costs no flash.
struct Shared {
    /// One is written by the tick while the main loop reads the other.
    ticks: [Raw; 2],
    /// Which of them is the main loop's: 0, 1.
    reading: u8,
    /// [`Task::None`]: the slot is free.
    job: Job,
    t_ticks: u32,
    /// Period in force, and the one to change to at the next sample.
    period: u16,
    next_period: u16,
    /// Periods without a sample that are left, and the n, of which every n-th has one.
    skip: u8,
    next_every: u8,
    masked_ucsrb: u8,
    /// Ticks lost that the main loop does not know of, and how many of them are before the sample that waits.
    missed: u8,
    before: u8,
    /// Whether a sample waits: 0, 1. The main loop compares a byte in less than it takes to mask a `bool`.
    ready: u8,
    /// A period without a sample has passed.
    passed: bool,
    ticked: bool,
}

static mut SHARED: Shared = Shared {
    ticks: [Raw::new(); 2],
    reading: 0,
    job: Job {
        task: Task::None,
        axis: 0,
        address: 0,
        value: 0,
    },
    t_ticks: 0,
    period: 0,
    next_period: 0,
    skip: 0,
    next_every: 0,
    masked_ucsrb: 0,
    missed: 0,
    before: 0,
    ready: 0,
    passed: false,
    ticked: false,
};

/// Milliseconds that have passed, and those that the main loop has taken; both wrap.
static mut MILLISECONDS: u8 = 0;
static mut TAKEN: u8 = 0;
/// Milliseconds that the motor may still turn without a word from the host.
static mut ALIVE: u8 = 0;
/// The motor's stop was pressed since a nonce was told last: 0, 1.
static mut STOPPED: u8 = 0;

fn shared() -> *mut Shared {
    addr_of_mut!(SHARED)
}

fn timer0() -> &'static avr_device::atmega16::tc0::RegisterBlock {
    // SAFETY: timer 0 and TIMSK are this module's.
    unsafe { &*TC0::ptr() }
}

fn timer1() -> &'static avr_device::atmega16::tc1::RegisterBlock {
    // SAFETY: timer 1 is this module's.
    unsafe { &*TC1::ptr() }
}

/// Starts both timers and the watchdog.
///
/// # Safety
/// Once, before interrupts are on.
pub unsafe fn start() {
    // SAFETY: interrupts are off.
    unsafe {
        set_compare((*shared()).next_period);
        (*shared()).period = (*shared()).next_period;
        (*shared()).skip = (*shared()).next_every.wrapping_sub(1);
        // Watchdog: 1 s, longer than the slowest tick.
        let watchdog = &*avr_device::atmega16::WDT::ptr();
        asm::wdr();
        watchdog.wdtcr.write(|w| bits!(w, 1 << 3 | 6));
    }
    run_milliseconds();
    // SAFETY: the CPU's control register is touched in this module alone.
    unsafe { (*CPU::ptr()).mcucr.write(|w| bits!(w, AWAKE)) };
    sense_stop(INT0_ON);
    // Timer 1: CTC with OCR1A (mode 4), clock / 64: 4 us.
    timer1().tcnt1.write(|w| bits!(w, 0));
    timer1().tccr1b.write(|w| bits!(w, 1 << 3 | 3));
    timer1().timsk.write(|w| bits!(w, OCIE1A | OCIE1B | OCIE0));
}

/// Timer 0: CTC, clock / 64, 250 counts: 1 kHz. Said again before each tick: the motor's keep-alive is counted by it.
#[inline(always)]
fn run_milliseconds() {
    timer0().ocr0.write(|w| bits!(w, 249));
    timer0().tccr0.write(|w| bits!(w, 1 << 3 | 3));
}

#[inline(never)]
fn set_compare(period: u16) {
    let last = period.wrapping_sub(1);
    timer1().ocr1a.write(|w| bits!(w, last));
    timer1()
        .ocr1b
        .write(|w| bits!(w, last.wrapping_sub(GUARD_TICKS)));
}

/// The period of the timer, and that every n-th has a sample: from the next sample on.
#[inline(never)]
pub fn set_period(ticks: u16, every: u8) {
    interrupt::free(|_| {
        // SAFETY: interrupts are off.
        let shared = unsafe { &mut *shared() };
        (shared.next_period, shared.next_every) = (ticks, every);
    });
}

/// Posts a job for the slot after the next sample; false while one waits.
pub fn post(job: Job) -> bool {
    put(job.task, job.axis, job.address, job.value)
}

#[inline(never)]
fn put(task: Task, axis: u8, address: u8, value: u16) -> bool {
    interrupt::free(|_| {
        // SAFETY: interrupts are off.
        let waiting = unsafe { &mut (*shared()).job };
        let free = matches!(waiting.task, Task::None);
        if free {
            *waiting = Job {
                task,
                axis,
                address,
                value,
            };
        }
        free
    })
}

/// Timer ticks since the tick.
pub fn ticks_since() -> u16 {
    interrupt::free(|_| timer1().tcnt1.read().bits())
}

/// The sample that waits, if one does, and how many ticks before it are lost. It is the caller's until the next call.
pub fn take() -> Option<(&'static Raw, u8)> {
    // SAFETY: a byte, which only the tick sets.
    if unsafe { core::ptr::read_volatile(&raw const (*shared()).ready) } == 0 {
        return None;
    }
    interrupt::free(|_| {
        // SAFETY: interrupts are off.
        let shared = unsafe { &mut *shared() };
        shared.ready = 0;
        shared.reading ^= 1;
        let missed = shared.before;
        shared.missed = shared.missed.wrapping_sub(missed);
        // SAFETY: the tick writes to the other one, until this function turns them round.
        Some((unsafe { &*place(shared.reading) }, missed))
    })
}

fn place(which: u8) -> *mut Raw {
    // SAFETY: a static. (An index would be a multiplication.)
    unsafe {
        let [first, second] = &mut (*shared()).ticks;
        if which == 0 { first } else { second }
    }
}

/// Whether a period without a sample has passed that nobody has taken yet.
pub fn take_passed() -> bool {
    // SAFETY: a byte, which the tick only ever sets; one that is set in between is of the same second.
    unsafe {
        let passed = &raw mut (*shared()).passed;
        let any = core::ptr::read_volatile(passed);
        if any {
            core::ptr::write_volatile(passed, false);
        }
        any
    }
}

/// Whether a millisecond has passed that nobody has taken yet.
pub fn take_millisecond() -> bool {
    // SAFETY: a byte that the interrupt counts, and one that is touched here alone.
    unsafe {
        let waits = milliseconds_wait();
        if waits {
            TAKEN = TAKEN.wrapping_add(1);
        }
        waits
    }
}

fn milliseconds_wait() -> bool {
    // SAFETY: as above.
    unsafe { core::ptr::read_volatile(&raw const MILLISECONDS) != TAKEN }
}

/// The host is there: the motor may turn for [`KEEP_ALIVE_MS`], unless its stop was pressed.
pub fn keep_alive() {
    // SAFETY: a byte. A millisecond is under way: one more makes it whole.
    unsafe { core::ptr::write_volatile(&raw mut ALIVE, KEEP_ALIVE_MS.wrapping_add(1)) };
}

/// Whether the host was heard in time, and the motor's stop is not pressed.
#[inline(never)]
pub fn host_is_there() -> bool {
    // SAFETY: a byte.
    !is_stopped() && unsafe { core::ptr::read_volatile(&raw const ALIVE) != 0 }
}

/// Whether the motor's stop is pressed, or was since [`forget_stop`]. The pin itself is looked at, too: its edge may have been
/// missed.
#[inline(never)]
pub fn is_stopped() -> bool {
    // SAFETY: a pin is read; a byte is.
    unsafe {
        if (*PORTD::ptr()).pind.read().bits() & STOP == 0 {
            stop();
        }
        core::ptr::read_volatile(&raw const STOPPED) != 0
    }
}

/// What was pressed before is over, and so is what keep-alive there was.
pub fn forget_stop() {
    // SAFETY: a byte each. What is pressed meanwhile finds nobody there.
    unsafe {
        if core::ptr::read_volatile(&raw const STOPPED) != 0 {
            core::ptr::write_volatile(&raw mut ALIVE, 0);
            core::ptr::write_volatile(&raw mut STOPPED, 0);
        }
    }
}

/// Cuts the motor until it is armed anew.
#[inline(always)]
fn stop() {
    board::cut_motor();
    // SAFETY: a byte.
    unsafe { core::ptr::write_volatile(&raw mut STOPPED, 1) };
}

/// The interrupts of the pins: [`INT0_ON`] or none.
#[inline(always)]
fn sense_stop(enabled: u8) {
    // SAFETY: the register is this module's.
    unsafe { (*EXINT::ptr()).gicr.write(|w| bits!(w, enabled)) };
}

/// Sleeps until there is work: a transmitted byte wakes the processor, and is none; nor are received bytes while nobody
/// `listens`.
pub fn sleep_until_work(listens: bool) {
    loop {
        interrupt::disable();
        // SAFETY: interrupts are off.
        let sampled = unsafe { core::ptr::read_volatile(&raw const (*shared()).ready) };
        if sampled != 0 || milliseconds_wait() || listens && serial::has_received() {
            // SAFETY: they were on.
            unsafe { interrupt::enable() };
            return;
        }
        sleep_now();
    }
}

/// Sleeps in idle mode; `sei` takes effect after the next instruction, so no interrupt slips in before the `sleep`.
#[inline(always)]
fn sleep_now() {
    // SAFETY: the CPU's control register is touched here alone.
    let cpu = unsafe { &*CPU::ptr() };
    cpu.mcucr.write(|w| bits!(w, SLEEP_IDLE));
    // SAFETY: called with interrupts off where they were on before.
    unsafe { interrupt::enable() };
    asm::sleep();
    cpu.mcucr.write(|w| bits!(w, AWAKE));
}

/// The sampling instants have passed: the other interrupts come back.
pub fn unmask() {
    // SAFETY: the masks are the tick's own; a single byte is read.
    serial::unmask(unsafe { (*shared()).masked_ucsrb });
    sense_stop(INT0_ON);
    timer1().timsk.write(|w| bits!(w, OCIE1A | OCIE0));
}

/// The motor's stop: at once, whatever goes on and whether the clocks run. In the guard and the first round over the sensors
/// [`board::cut_motor_if_pressed`] stands for it, or it would move the sample; it comes behind that, and notes the stop.
#[avr_device::interrupt(atmega16)]
fn INT0() {
    stop();
}

#[avr_device::interrupt(atmega16)]
fn TIMER0_COMP() {
    // SAFETY: counted here, compared by the main loop: a byte is read at once. Should the main loop be late by 256 ms, it
    // loses them; by a second, the watchdog has it.
    unsafe {
        MILLISECONDS = MILLISECONDS.wrapping_add(1);
        // The motor is cut here, whatever the main loop is busy with.
        if ALIVE != 0 {
            ALIVE = ALIVE.wrapping_sub(1);
            if ALIVE == 0 {
                board::cut_motor();
            }
        }
    }
}

#[avr_device::interrupt(atmega16)]
fn TIMER1_COMPA() {
    // SAFETY: the guard waits for this, the main loop reads with interrupts off.
    unsafe { (*shared()).ticked = true };
}

#[avr_device::interrupt(atmega16)]
fn TIMER1_COMPB() {
    timer1().timsk.write(|w| bits!(w, OCIE1A));
    run_milliseconds();
    // SAFETY: this interrupt is off until it ends, so it never meets itself; the main loop looks with interrupts off.
    let shared = unsafe { &mut *shared() };
    shared.t_ticks = shared.t_ticks.wrapping_add(u32::from(shared.period));
    if shared.skip > 0 {
        shared.skip = shared.skip.wrapping_sub(1);
        shared.passed = true;
        timer1().timsk.write(|w| bits!(w, OCIE1A | OCIE1B | OCIE0));
        return;
    }
    if timer1().tcnt1.read().bits() <= timer1().ocr1b.read().bits() {
        // Compare A has gone by: something held this up for longer than the guard. Waiting for the next one would make
        // that late too, and so on for ever; the main loop gets the time until then.
        count_up(&mut shared.missed);
        shared.skip = shared.next_every.wrapping_sub(1);
        timer1().timsk.write(|w| bits!(w, OCIE1A | OCIE1B | OCIE0));
        return;
    }
    shared.masked_ucsrb = serial::mask();
    sense_stop(0);
    shared.ticked = false;
    // Chosen before the sleep, and the compiler kept from moving it: the choice takes longer for one place than for the
    // other, and after the wake-up that is jitter.
    let free = known(place(shared.reading ^ 1));
    // The motor's stop has no interrupt now: its edge is looked for, until 4 us before compare A, which the sleep must not miss.
    let until = timer1().ocr1b.read().bits().wrapping_add(GUARD_TICKS - 1);
    for _ in 0..250u8 {
        board::cut_motor_if_pressed();
        if timer1().tcnt1.read().bits() >= until {
            break;
        }
    }
    // Only compare A is left to wake it; the bound is for a wake-up that nobody explains.
    for _ in 0..4u8 {
        sleep_now();
        // SAFETY: a byte that the compare A interrupt sets.
        if unsafe { core::ptr::read_volatile(&raw const shared.ticked) } {
            break;
        }
    }
    // SAFETY: the sensors are the tick's from its start on, the place is the one that the main loop does not read.
    let (sensors, raw) = unsafe { (sensors::all(), &mut *free) };
    acquire(sensors, raw);
    sensors::adc_off();
    raw.t_ticks = shared.t_ticks;
    // One that nobody took is overwritten; the end of a job stays, or it would never be answered.
    let lost = shared.ready != 0;
    if !matches!(shared.job.task, Task::None) {
        work(sensors, &shared.job, &mut raw.done);
        shared.job.task = Task::None;
    } else if !lost {
        raw.done.task = Task::None;
    }
    // Until the return, so that a tick that is late already does not come in on top of this one.
    interrupt::disable();
    if lost {
        count_up(&mut shared.missed);
    }
    shared.before = shared.missed;
    shared.ready = 1;
    if shared.period != shared.next_period {
        shared.period = shared.next_period;
        set_compare(shared.period);
    }
    shared.skip = shared.next_every.wrapping_sub(1);
    timer1().timsk.write(|w| bits!(w, OCIE1A | OCIE1B | OCIE0));
}
