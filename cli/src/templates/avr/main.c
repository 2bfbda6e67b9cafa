/* The pins and the clock of NAME on an ATmega328P (Arduino Uno). Each input is a contact to ground, and a closed contact reads as true.
 * This file is yours. If you rename the chart, an input or an output, change the names here too: pins_init, read_inputs and write_outputs. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

#include "NAME.h"

static NAME_t chart;
static NAME_in_t in;
static NAME_out_t out;

/* D8 to D10 are inputs with pull-ups; D11 and D12 are outputs. */
static void pins_init(void)
{
    PORTB |= (1 << PB0) | (1 << PB1) | (1 << PB2);
    DDRB |= (1 << PB3) | (1 << PB4);
}

static void read_inputs(void)
{
    const uint8_t closed = (uint8_t)~PINB;
    in.start = (closed & (1 << PB0)) != 0;
    in.stop = (closed & (1 << PB1)) != 0;
    in.hot = (closed & (1 << PB2)) != 0;
}

static void write_outputs(void)
{
    uint8_t pins = PORTB & (uint8_t)~((1 << PB3) | (1 << PB4));
    if (out.motor) {
        pins |= 1 << PB3;
    }
    if (out.alarm) {
        pins |= 1 << PB4;
    }
    PORTB = pins;
}

/* Timer 1 counts F_CPU / 64 and starts again every PERIOD_MS. */
#define PERIOD_MS 10ULL
#define TICK_MS (UPPER_TICK_NS / 1000000ULL)
#if UPPER_TICK_NS % 1000000ULL != 0
#error "the tick of the chart must be a whole number of milliseconds"
#endif

static void timer_init(void)
{
    TCCR1B = (1 << WGM12) | (1 << CS11) | (1 << CS10);
    OCR1A = (uint16_t)(F_CPU / 64ULL * PERIOD_MS / 1000ULL - 1ULL);
    TIMSK1 = 1 << OCIE1A;
}

/* Runs a reaction every PERIOD_MS, so that no press of a button is missed. The time of the chart advances by one tick every TICK_MS. */
ISR(TIMER1_COMPA_vect)
{
    static uint32_t ms;
    ms += PERIOD_MS;
    const uint32_t ticks = ms / (uint32_t)TICK_MS;
    ms %= (uint32_t)TICK_MS;
    read_inputs();
    NAME_step(&chart, &in, ticks, &out);
    write_outputs();
}

int main(void)
{
    pins_init();
    NAME_init(&chart, &out);
    write_outputs();
    timer_init();
    sei();
    for (;;) {
        sleep_mode();
    }
}
