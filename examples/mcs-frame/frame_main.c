/* The frame on an ATmega1284P: the timer posts `tis` and moves the axes, the emergency button on PD2 posts `eis`, and the loop runs the task that the
 * chart selects. PB0: the drives are on. PB1: alarm. PB2 toggles in each pass of the loop. PD3 low: something is wrong. PD4 low: the operator acknowledges.
 * PD5, PD6: the mode. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>
#include <avr/wdt.h>

#define FRAME_ENTER_CRITICAL() const uint8_t sreg = SREG; cli()
#define FRAME_EXIT_CRITICAL() SREG = sreg
#define FRAME_WATCHDOG() wdt_reset()
#define FRAME_BAD_STATE(self) for (;;) { } /* the watchdog restarts the machine */
#include "frame_port.h"

static frame_ring_t ring;
static volatile frame_in_t pins;
static frame_t frame;
static frame_out_t out;

/* TIS: once per millisecond. The axes are moved here, independently of the background; the chart only counts the periods. */
static volatile uint16_t axis;
ISR(TIMER0_COMPA_vect)
{
    ++axis;
    (void)frame_post(&ring, FRAME_EVENT_tis);
}

/* EIS: the drives go off at once; the chart keeps them off until the restart. */
static volatile bool stopped;
ISR(INT0_vect)
{
    PORTB &= (uint8_t)~_BV(PB0);
    stopped = true;
    (void)frame_post(&ring, FRAME_EVENT_eis);
}

/* The tasks of the background: each returns whether it is done. Their contents depend on the machine. */
static bool initialise(void)
{
    FRAME_ENTER_CRITICAL();
    axis = 0U;
    ring.lost = 0U;
    FRAME_EXIT_CRITICAL();
    return true;
}

static bool diagnose(void)
{
    const uint8_t wires = PIND;
    /* A lost event is as serious as a broken wire. */
    pins.fault = (wires & _BV(PD3)) == 0U || ring.lost != 0U;
    return true;
}

static bool handle_error(void)
{
    pins.cleared = (PIND & _BV(PD4)) == 0U;
    return true;
}

static bool choose_mode(void)
{
    pins.mode = (uint8_t)((PIND >> PD5) & 3U);
    return true;
}

static bool refresh(void)
{
    PINB = _BV(PB2);
    return true;
}

static bool idle_task(void)
{
    return true;
}

static bool run_task(void)
{
    if (out.run_inz) {
        return initialise();
    }
    if (out.run_dig) {
        return diagnose();
    }
    if (out.run_erh) {
        return handle_error();
    }
    if (out.run_mcs) {
        return choose_mode();
    }
    if (out.run_ocs) {
        return refresh();
    }
    return idle_task(); /* SSC and the four modes depend on the machine */
}

int main(void)
{
    DDRB = _BV(PB0) | _BV(PB1) | _BV(PB2);
    PORTD = _BV(PD2) | _BV(PD3) | _BV(PD4);
    EICRA = _BV(ISC01); /* INT0 on the falling edge */
    EIMSK = _BV(INT0);
    TCCR0A = _BV(WGM01);
    OCR0A = 249U; /* 16 MHz / 64 / 250 */
    TIMSK0 = _BV(OCIE0A);
    TCCR0B = _BV(CS01) | _BV(CS00);
    wdt_enable(WDTO_120MS);
    frame_init(&frame, &out);
    sei();
    for (;;) {
        frame_scan(&frame, &ring, &pins, &out);
        {
            FRAME_ENTER_CRITICAL();
            /* Between the interrupt and the reaction to its event, the chart does not yet know that the event occurred. */
            if (frame_active_halted(&frame)) {
                stopped = false;
            }
            const bool drives = out.drives && !stopped;
            PORTB = (uint8_t)((PORTB & ~(_BV(PB0) | _BV(PB1))) | (drives ? _BV(PB0) : 0U) | (out.alarm ? _BV(PB1) : 0U));
            FRAME_EXIT_CRITICAL();
        }
        if (run_task()) {
            FRAME_ENTER_CRITICAL();
            (void)frame_post(&ring, FRAME_EVENT_done);
            FRAME_EXIT_CRITICAL();
        }
    }
}
