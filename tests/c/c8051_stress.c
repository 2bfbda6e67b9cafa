/* A chart beside interrupts on an 8052: timer 0 writes a number of two bytes and posts an event; the pin P3.2 posts another. Timer 1 is the environment: it pulses that
 * pin at random times. The counts are written to the simulator's output port, four bytes each, low byte first. */
#include <8052.h>
#include <stdint.h>

#ifndef NO_LOCK
#define STRESS_ENTER_CRITICAL() const uint8_t enabled = EA; EA = 0
#define STRESS_EXIT_CRITICAL() EA = enabled
#endif
#ifndef ROUNDS
#define ROUNDS 250U
#endif
/* The minimum number of machine cycles between two interrupts of a timer; up to 500 more are added. */
#ifndef GAP
#define GAP 4000U
#endif
static uint32_t watchdog;
#define STRESS_WATCHDOG() (++watchdog)
#include "stress_port.h"

static volatile __xdata uint8_t __at(0xffff) door;
static stress_ring_t ring;
static volatile stress_in_t pins;
static stress_t chart;
static stress_out_t out;
static volatile uint16_t level;
static volatile uint16_t n_ticks;
static volatile uint16_t n_edges;
static volatile uint16_t n_pulses;
static volatile uint16_t n_lost;
static volatile uint16_t random = 0xACE1U;

/* All three interrupts have the same priority, so none interrupts another, and the ring has one writer at a time. */
void on_pin(void) __interrupt(0)
{
    ++n_edges;
    if (!stress_post(&ring, STRESS_EVENT_edge)) {
        ++n_lost;
    }
}

void on_timer0(void) __interrupt(1)
{
    const uint16_t next = (uint16_t)(0U - GAP - (random & 0xffU));
    TH0 = (uint8_t)(next >> 8);
    TL0 = (uint8_t)next;
    /* Both numbers are always equal. */
    level = (uint16_t)(level + 0x0101U);
    pins.n = level;
    pins.m = level;
    ++n_ticks;
    if (!stress_post(&ring, STRESS_EVENT_tick)) {
        ++n_lost;
    }
}

void on_timer1(void) __interrupt(3)
{
    uint16_t next;
    random = (uint16_t)((random >> 1) ^ (((random & 1U) != 0U) ? 0xB400U : 0U));
    next = (uint16_t)(0U - GAP - (random & 0x1ffU));
    TH1 = (uint8_t)(next >> 8);
    TL1 = (uint8_t)next;
    P3_2 = 0;
    P3_2 = 1;
    ++n_pulses;
}

static void send(uint32_t value)
{
    for (uint8_t i = 0U; i < 4U; ++i) {
        door = 'w';
        door = (uint8_t)value;
        value >>= 8;
    }
}

void main(void)
{
    ring.head = 0U;
    ring.tail = 0U;
    ring.lost = 0U;
    TMOD = 0x11;
    IT0 = 1;
    EX0 = 1;
    ET0 = 1;
    ET1 = 1;
    TR0 = 1;
    TR1 = 1;
    stress_init(&chart, &out);
    EA = 1;
    for (;;) {
        uint16_t so_far;
        stress_scan(&chart, &ring, &pins, &out);
        EA = 0;
        so_far = n_ticks;
        EA = 1;
        if (so_far >= ROUNDS) {
            break;
        }
    }
    /* The environment stops; pending interrupts still occur. */
    TR1 = 0;
    TR0 = 0;
    ET1 = 0;
    ET0 = 0;
    EX0 = 0;
    EA = 0;
    if (TF1) {
        TF1 = 0;
    }
    if (IE0) {
        ++n_edges;
        if (!stress_post(&ring, STRESS_EVENT_edge)) {
            ++n_lost;
        }
    }
    while (ring.head != ring.tail) {
        stress_scan(&chart, &ring, &pins, &out);
    }
    send((uint32_t)stress_var_ticks(&chart));
    send((uint32_t)stress_var_edges(&chart));
    send((uint32_t)stress_var_torn(&chart));
    send(n_ticks);
    send(n_edges);
    send(n_pulses);
    send(n_lost);
    send(ring.lost);
    send(watchdog);
    door = 's';
    for (;;) {
    }
}
