/* A chart beside interrupts on an ATmega1284P: a timer writes a number of two bytes and posts an event; a pin change posts another.
 * GPIOR2 tells it to stop; then it empties the ring and sends its counts to GPIOR0, four bytes each, low byte first. */
#include "avr_main.h"

#ifndef NO_LOCK
#define STRESS_ENTER_CRITICAL() const uint8_t sreg = SREG; cli()
#define STRESS_EXIT_CRITICAL() SREG = sreg
#endif
static volatile uint32_t watchdog;
#define STRESS_WATCHDOG() (++watchdog)
#include "stress_port.h"

static stress_ring_t ring;
static volatile stress_in_t pins;
static stress_t chart;
static stress_out_t out;
static volatile uint16_t level;
static uint32_t lost;
static volatile uint32_t n_ticks;
static volatile uint32_t n_edges;
static volatile uint32_t n_lost;

ISR(TIMER0_COMPA_vect)
{
    /* Both bytes are always equal, so a number with different bytes was torn. */
    level = (level == 0xffffU) ? 0U : (uint16_t)(level + 0x0101U);
    pins.n = level;
    ++n_ticks;
    if (!stress_post(&ring, STRESS_EVENT_tick)) {
        ++n_lost;
    }
}

ISR(PCINT3_vect)
{
    ++n_edges;
    if (!stress_post(&ring, STRESS_EVENT_edge)) {
        ++n_lost;
    }
}

int main(void)
{
    start(100U, _BV(CS01));
    stress_init(&chart, &out);
    sei();
    while (GPIOR2 == 0U) {
        stress_scan(&chart, &ring, &pins, &out);
    }
    cli();
    while (ring.head != ring.tail) {
        stress_scan(&chart, &ring, &pins, &out);
    }
    lost = ring.lost;
    send((uint32_t)stress_var_ticks(&chart));
    send((uint32_t)stress_var_edges(&chart));
    send((uint32_t)stress_var_torn(&chart));
    send(n_ticks);
    send(n_edges);
    send(n_lost);
    send(lost);
    send(watchdog);
    end();
}
