/* A stub of the Arduino core, for tests only: it has only what the sketches of packages use. Pins are numbers in an array, and time is a counter. */
#ifndef ARDUINO_H
#define ARDUINO_H

#include <stdbool.h>
#include <stdint.h>

#define HIGH 0x1
#define LOW 0x0
#define INPUT 0x0
#define OUTPUT 0x1
#define A0 54

#ifdef __cplusplus
extern "C" {
#endif

extern uint8_t stub_levels[256];
extern uint8_t stub_modes[256];
extern unsigned long stub_time;

static inline void pinMode(uint8_t pin, uint8_t mode)
{
    stub_modes[pin] = (uint8_t)(mode + 1U);
}

static inline int digitalRead(uint8_t pin)
{
    return stub_levels[pin] != 0 ? HIGH : LOW;
}

static inline void digitalWrite(uint8_t pin, uint8_t value)
{
    stub_levels[pin] = value;
}

static inline int analogRead(uint8_t pin)
{
    return stub_levels[pin] * 4;
}

static inline void analogWrite(uint8_t pin, int value)
{
    stub_levels[pin] = (uint8_t)value;
}

static inline unsigned long millis(void)
{
    return stub_time;
}

static inline unsigned long micros(void)
{
    return stub_time * 1000UL;
}

#ifdef __cplusplus
}
#endif

void setup(void);
void loop(void);

#endif
