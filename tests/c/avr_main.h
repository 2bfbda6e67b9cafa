/* Common code of the firmwares on an ATmega1284P: timer 0 and a change of PD2 cause interrupts; eight counts are sent to GPIOR0, four bytes each, low byte
 * first. */
#ifndef AVR_MAIN_H
#define AVR_MAIN_H

#include <avr/interrupt.h>
#include <avr/io.h>
#include <avr/sleep.h>

/* The timer counts to `top` with the clock selection `clock` of its TCCR0B. */
static void start(uint8_t top, uint8_t clock)
{
    TCCR0A = _BV(WGM01);
    OCR0A = top;
    TIMSK0 = _BV(OCIE0A);
    TCCR0B = clock;
    PCMSK3 = _BV(PCINT26);
    PCICR = _BV(PCIE3);
}

static void send(uint32_t value)
{
    for (uint8_t i = 0U; i < 4U; ++i) {
        GPIOR0 = (uint8_t)value;
        value >>= 8;
    }
}

/* Sleeps with interrupts off, which ends the run. */
static void end(void)
{
    sleep_enable();
    for (;;) {
        sleep_cpu();
    }
}

#endif
