#include "tick.h"

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>
#include <stddef.h>
#include <util/atomic.h>

#include "serial.h"

/* Timer 1 counts 4 us ticks to the period (compare A). Compare B comes 64 us before that, interrupts whatever runs,
 * masks the other interrupts and sleeps. The compare A that wakes it is then alone, and waking takes the same number of
 * cycles every time: no jitter. After the first round over the sensors the masks fall. */
#define GUARD_TICKS 16
#define TIMSK_ALL (_BV(OCIE1A) | _BV(OCIE1B) | _BV(OCIE0))

/* The interrupt fills one, the main loop works on the other. */
static struct raw raws[2];
static volatile uint8_t filling;
static volatile bool ready;
static volatile bool passed; /* a period without a sample */
static volatile uint8_t missed_ticks, missed_before, milliseconds;
static uint8_t counted; /* of the milliseconds, by the main loop; both wrap */
static volatile bool ticked;
static uint32_t t_ticks;
static uint16_t period, next_period;
static uint8_t skip, next_every;
static uint8_t masked_ucsrb;

/* Milliseconds that the motor may still turn without a word from the host. */
#define KEEP_ALIVE_MS 200
static volatile uint8_t alive_ms;
/* The motor's stop was pressed since a nonce was told last. */
static volatile bool stopped;
/* INT0 at a falling edge, in the register that has the sleep's bits, too. */
#define AWAKE _BV(ISC01)

enum slot { FREE, POSTED, DONE };
static volatile uint8_t slot;
static struct gyro_job job;

static void set_compare(uint16_t ticks)
{
    uint16_t last = ticks - 1;
    OCR1A = last;
    OCR1B = last - GUARD_TICKS;
}

/* Timer 0: CTC, clock / 64: 1 kHz. Said again before each tick: the motor's keep-alive is counted by it. */
static inline void run_milliseconds(void)
{
    OCR0 = 249;
    TCCR0 = _BV(WGM01) | _BV(CS01) | _BV(CS00);
}

void tick_start(void)
{
    period = next_period;
    skip = next_every - 1;
    set_compare(period);
    wdt_enable(WDTO_1S); /* longer than the slowest tick */
    run_milliseconds();
    MCUCR = AWAKE;
    GICR = _BV(INT0);
    TCNT1 = 0;
    TCCR1B = _BV(WGM12) | _BV(CS11) | _BV(CS10);
    TIMSK = TIMSK_ALL;
}

void tick_stop(void)
{
    TIMSK = 0;
}

void tick_set_period(uint16_t ticks, uint8_t every)
{
    ATOMIC_BLOCK(ATOMIC_RESTORESTATE)
    {
        next_period = ticks;
        next_every = every;
    }
}

const struct raw *tick_take(uint8_t *missed)
{
    const struct raw *taken = NULL;
    ATOMIC_BLOCK(ATOMIC_FORCEON)
    {
        if (ready) {
            ready = false;
            *missed = missed_before;
            missed_ticks -= missed_before;
            taken = &raws[filling];
            filling ^= 1;
        }
    }
    return taken;
}

bool tick_take_passed(void)
{
    bool any = passed;
    passed = false;
    return any;
}

bool tick_take_millisecond(void)
{
    if (milliseconds == counted)
        return false;
    counted++;
    return true;
}

uint16_t tick_since(void)
{
    uint16_t ticks;
    ATOMIC_BLOCK(ATOMIC_FORCEON)
    {
        ticks = TCNT1;
    }
    return ticks;
}

bool tick_post(uint8_t what, uint8_t axis, uint8_t address, uint16_t value)
{
    if (slot != FREE)
        return false;
    job.what = what;
    job.axis = axis;
    job.address = address;
    job.value = value;
    __asm__ volatile("" ::: "memory");
    slot = POSTED;
    return true;
}

const struct gyro_job *tick_fetch_done(void)
{
    if (slot != DONE)
        return NULL;
    slot = FREE;
    __asm__ volatile("" ::: "memory");
    return &job;
}

/* sei takes effect after the next instruction, so no interrupt slips in before the sleep. */
static inline void sleep_now(void)
{
    MCUCR = _BV(SE) | AWAKE; /* idle */
    sei();
    sleep_cpu();
    MCUCR = AWAKE;
}

/* A transmitted byte wakes the processor, and is no work. */
void tick_sleep_until_work(bool listens)
{
    for (;;) {
        cli();
        if (ready || milliseconds != counted || (listens && serial_has_received())) {
            sei();
            return;
        }
        sleep_now();
    }
}

static void unmask(void)
{
    serial_unmask(masked_ucsrb);
    GICR = _BV(INT0);
    TIMSK = _BV(OCIE1A) | _BV(OCIE0);
}

/* Cuts the motor until it is armed anew. */
static inline void stop(void)
{
    TCCR2 = 0;
    stopped = true;
}

/* The pin itself is looked at, too: its edge may have been missed. */
bool tick_is_stopped(void)
{
    if (!(PIND & _BV(PD2)))
        stop();
    return stopped;
}

/* And what keep-alive there was; what is pressed meanwhile finds nobody there. */
void tick_forget_stop(void)
{
    if (stopped) {
        alive_ms = 0;
        stopped = false;
    }
}

void tick_keep_alive(void)
{
    alive_ms = KEEP_ALIVE_MS + 1; /* a millisecond is under way */
}

bool tick_host_is_there(void)
{
    return !tick_is_stopped() && alive_ms != 0;
}

/* The motor's stop: at once, whatever goes on. In the guard and the first round tick_cut_if_pressed
 * stands for it, or it would move the sample. */
ISR(INT0_vect)
{
    stop();
}

ISR(TIMER0_COMP_vect)
{
    milliseconds++;
    /* The motor is cut here, whatever the main loop is busy with. */
    uint8_t left = alive_ms;
    if (left) {
        alive_ms = --left;
        if (left == 0)
            TCCR2 = 0;
    }
}

ISR(TIMER1_COMPA_vect)
{
    ticked = true;
}

ISR(TIMER1_COMPB_vect)
{
    TIMSK = _BV(OCIE1A);
    run_milliseconds();
    t_ticks += period;
    if (skip) {
        skip--;
        passed = true;
        TIMSK = TIMSK_ALL;
        return;
    }
    if (TCNT1 <= OCR1B) {
        /* Compare A has gone by: the main loop gets the time until the next guard. */
        if (missed_ticks != UINT8_MAX)
            missed_ticks++;
        skip = next_every - 1;
        TIMSK = TIMSK_ALL;
        return;
    }
    masked_ucsrb = serial_mask();
    GICR = 0;
    ticked = false;
    struct raw *raw = &raws[filling];
    /* INT0 is masked now: what it would have seen is looked at until 4 us before compare A. */
    uint16_t until = OCR1B + (GUARD_TICKS - 1);
    for (uint8_t left = 250; left; left--) {
        tick_cut_if_pressed();
        if (TCNT1 >= until)
            break;
    }
    /* Only compare A is left to wake it; the bound is for a wake-up that nobody explains. */
    for (uint8_t left = 4; left && !ticked; left--)
        sleep_now();
    sensors_acquire(raw, unmask);
    raw->t_ticks = t_ticks;
    if (slot == POSTED) {
        gyro_work(&job);
        slot = DONE;
    }
    cli();
    if (ready && missed_ticks != UINT8_MAX)
        missed_ticks++;
    missed_before = missed_ticks;
    ready = true;
    if (period != next_period) {
        period = next_period;
        set_compare(period);
    }
    skip = next_every - 1;
    TIMSK = TIMSK_ALL;
}
