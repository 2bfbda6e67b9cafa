/* Tasks with budgets in clock cycles on an ATmega1284P, beside a timer and a pin change. GPIOR1 tells the host what runs: 0x10 + k if task k begins, 0x20 + k if it ends,
 * 1 or 2 if an interrupt of the timer or pin begins, 3 if one ends, 0x40 if a reaction's tasks are over. GPIOR2 tells it to stop; then it sends its counts to GPIOR0. */
#include "avr_main.h"

#define WORK_ENTER_CRITICAL() const uint8_t sreg = SREG; cli()
#define WORK_EXIT_CRITICAL() SREG = sreg
static volatile uint32_t watchdog;
#define WORK_WATCHDOG() (++watchdog)
#include "work_port.h"
#include "work_user.h"

static work_ring_t ring;
static volatile work_in_t pins;
static work_t chart;
static work_out_t out;
static volatile uint16_t level;
static volatile uint32_t n_ticks;
static volatile uint32_t n_edges;
static volatile uint32_t n_lost;
static volatile uint16_t filtered;

ISR(TIMER0_COMPA_vect)
{
    GPIOR1 = 1U;
    level = (level == 0xffffU) ? 0U : (uint16_t)(level + 0x0101U);
    pins.n = level;
    ++n_ticks;
    if (!work_post(&ring, WORK_EVENT_tick)) {
        ++n_lost;
    }
    GPIOR1 = 3U;
}

ISR(PCINT3_vect)
{
    GPIOR1 = 2U;
    ++n_edges;
    if (!work_post(&ring, WORK_EVENT_edge)) {
        ++n_lost;
    }
    GPIOR1 = 3U;
}

void begin(uint8_t task)
{
    GPIOR1 = (uint8_t)(0x10U + task);
}

void done(uint8_t task)
{
    GPIOR1 = (uint8_t)(0x20U + task);
}

void reacted(void)
{
    GPIOR1 = 0x40U;
}

void filter(uint16_t value)
{
    for (uint8_t i = 0U; i < 40U; ++i) {
        filtered = (uint16_t)(filtered + value);
    }
}

int main(void)
{
    start(60U, _BV(CS01) | _BV(CS00));
    work_init(&chart, &out);
    sei();
    while (GPIOR2 == 0U) {
        work_scan(&chart, &ring, &pins, &out);
    }
    cli();
    while (ring.head != ring.tail) {
        work_scan(&chart, &ring, &pins, &out);
    }
    send((uint32_t)work_var_ticks(&chart));
    send((uint32_t)work_var_edges(&chart));
    send((uint32_t)work_var_torn(&chart));
    send((uint32_t)work_var_rounds(&chart));
    send(n_ticks);
    send(n_edges);
    send(n_lost);
    send(watchdog);
    end();
}
