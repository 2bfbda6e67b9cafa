/* Marks reactions in GPIOR0: 1 begins a reaction, 2 ends it, 4 ends a series, 3 ends the program. Define REACT(inputs) to measure something other than a plain
 * reaction. */
#include <avr/interrupt.h>
#include <avr/io.h>
#include HEADER

#ifndef REACT
#define REACT(inputs) TYPE(step)(&self, inputs, &out)
#endif

static TYPE(t) self;
static TYPE(in_t) in;
static TYPE(out_t) out;
#ifdef WITH_RING
static TYPE(ring_t) ring;
#endif
static uint32_t seed = 12345;

int main(void)
{
    uint16_t k;
    uint8_t i;
    TYPE(init)(&self, &out);
    for (k = 0; k < 1000; k++) {
        for (i = 0; i < sizeof in.bits; i++) {
            seed = seed * 1664525UL + 1013904223UL;
            in.bits[i] = (uint8_t)(seed >> 24);
        }
        GPIOR0 = 1;
        REACT(&in);
        GPIOR0 = 2;
    }
    GPIOR0 = 4;
    for (i = 0; i < sizeof in.bits; i++) {
        in.bits[i] = 0;
    }
    REACT(&in);
    REACT(&in);
    for (k = 0; k < 1000; k++) {
        GPIOR0 = 1;
        REACT(&in);
        GPIOR0 = 2;
    }
    GPIOR0 = 4;
#ifdef LARGEST
    /* Each row of inputs twice, so that code that compares the inputs with those of the previous scan takes both branches. */
    for (k = 0; k < 2000; k++) {
        if ((k & 1U) == 0U) {
            for (i = 0; i < sizeof in.bits; i++) {
                seed = seed * 1664525UL + 1013904223UL;
                in.bits[i] = (uint8_t)(seed >> 24);
            }
        }
        GPIOR0 = 1;
        REACT(&in);
        GPIOR0 = 2;
    }
    GPIOR0 = 4;
#endif
    GPIOR0 = 3;
    for (;;) {
    }
}
