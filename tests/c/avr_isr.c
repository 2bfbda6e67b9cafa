/* A chart that runs in a timer's interrupt of an ATmega1284P, beside a main program that writes inputs, posts events and reads outputs at random phases. GPIOR2 tells
 * it to stop; then it sends its counts to GPIOR0, four bytes each, low byte first. */
#include "avr_main.h"

#ifndef NO_LOCK
#define HANDED_ENTER_CRITICAL() const uint8_t sreg = SREG; cli()
#define HANDED_EXIT_CRITICAL() SREG = sreg
#endif
#include "handed_port.h"

static handed_ring_t ring;
static volatile handed_in_t pins;
static handed_t chart;
static handed_out_t out;
static volatile uint32_t n_scans;
static volatile uint16_t noise;

ISR(TIMER0_COMPA_vect)
{
    handed_scan_isr(&chart, &ring, &pins, &out);
    ++n_scans;
}

/* Its only effect is to shift the phases. */
ISR(PCINT3_vect)
{
    noise = (uint16_t)(noise * 25173U + 13849U);
}

int main(void)
{
    uint32_t posted = 0U;
    uint32_t lost = 0U;
    uint32_t reads = 0U;
    uint32_t torn_out = 0U;
    uint32_t torn_self = 0U;
    uint16_t level = 0U;
    start(250U, _BV(CS01));
    handed_init(&chart, &out);
    sei();
    while (GPIOR2 == 0U) {
        handed_in_t in = { 0 };
        handed_out_t seen;
        handed_t copy;
        level = (uint16_t)(level + 0x0101U);
        in.n = level;
        in.m = level;
        handed_write_in(&pins, &in);
        if ((level & 7U) == 0U) {
            ++posted;
            if (!handed_post(&ring, HANDED_EVENT_go)) {
                ++lost;
            }
        }
        handed_read_out(&seen, &out);
        ++reads;
        if (seen.a != seen.b) {
            ++torn_out;
        }
        handed_read_self(&copy, &chart);
        if (handed_var_c(&copy) != handed_var_d(&copy)) {
            ++torn_self;
        }
    }
    cli();
    while (ring.head != ring.tail) {
        handed_scan_isr(&chart, &ring, &pins, &out);
    }
    send((uint32_t)handed_var_goes(&chart));
    send((uint32_t)handed_var_torn(&chart));
    send(posted);
    send(lost);
    send(reads);
    send(torn_out);
    send(torn_self);
    send(n_scans);
    end();
}
