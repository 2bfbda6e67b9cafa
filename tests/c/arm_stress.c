/* A chart beside interrupts on a Cortex-M3 (board mps2-an385): SysTick writes two numbers and posts an event. Timer 0 of the board posts another at random times and
 * may interrupt SysTick. The counts are written to `answer.bin` by semihosting, four bytes each, low byte first. */
#include <stdint.h>

#ifndef NO_LOCK
#define STRESS_ENTER_CRITICAL() uint32_t primask; __asm__ volatile("mrs %0, primask\n cpsid i" : "=r"(primask) : : "memory")
#define STRESS_EXIT_CRITICAL() __asm__ volatile("msr primask, %0" : : "r"(primask) : "memory")
#endif
#ifndef ROUNDS
#define ROUNDS 10000U
#endif
/* The minimum number of ticks (of 40 instructions) between two interrupts of a timer, and the maximum number of additional ticks. */
#ifndef GAP
#define GAP 20U
#endif
#ifndef SPREAD
#define SPREAD 31U
#endif
static uint32_t watchdog;
#define STRESS_WATCHDOG() (++watchdog)
#include "stress_port.h"

#define REGISTER(address) (*(volatile uint32_t *)(address))
#define SYST_CSR REGISTER(0xe000e010UL)
#define SYST_RVR REGISTER(0xe000e014UL)
#define SYST_CVR REGISTER(0xe000e018UL)
#define SHPR3 REGISTER(0xe000ed20UL)
#define NVIC_ISER0 REGISTER(0xe000e100UL)
#define NVIC_IPR2 REGISTER(0xe000e408UL)
#define TIMER0_CTRL REGISTER(0x40000000UL)
#define TIMER0_VALUE REGISTER(0x40000004UL)
#define TIMER0_RELOAD REGISTER(0x40000008UL)
#define TIMER0_CLEAR REGISTER(0x4000000cUL)

static stress_ring_t ring;
static volatile stress_in_t pins;
static stress_t chart;
static stress_out_t out;
static volatile uint16_t level;
static volatile uint32_t n_ticks;
static volatile uint32_t n_edges;
static volatile uint32_t n_nested;
static volatile uint32_t n_lost;
static volatile uint32_t in_tick;
static volatile uint32_t random = 2463534242U;

/* Interrupts of two priorities: the ring has two writers, so each puts its event in within a critical section. */
static void post(stress_event_t event)
{
#ifndef NO_LOCK
    STRESS_ENTER_CRITICAL();
#endif
    if (!stress_post(&ring, event)) {
        ++n_lost;
    }
#ifndef NO_LOCK
    STRESS_EXIT_CRITICAL();
#endif
}

static void on_tick(void)
{
    in_tick = 1U;
    /* Both numbers are always equal. */
    level = (uint16_t)(level + 0x0101U);
    pins.n = level;
    pins.m = level;
    ++n_ticks;
    post(STRESS_EVENT_tick);
    in_tick = 0U;
}

static void on_timer0(void)
{
    TIMER0_CLEAR = 1U;
    random ^= random << 13;
    random ^= random >> 17;
    random ^= random << 5;
    TIMER0_RELOAD = GAP + (random & SPREAD);
    ++n_edges;
    n_nested += in_tick;
    post(STRESS_EVENT_edge);
}

static uint32_t call(uint32_t operation, const volatile void *argument)
{
    register uint32_t r0 __asm__("r0") = operation;
    register const volatile void *r1 __asm__("r1") = argument;
    __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
    return r0;
}

static int work(void)
{
    stress_init(&chart, &out);
    SHPR3 = 0x80000000UL;
    NVIC_IPR2 = 0x40UL;
    NVIC_ISER0 = 1UL << 8;
    SYST_RVR = GAP + 9U;
    SYST_CVR = 0U;
    SYST_CSR = 7U;
    TIMER0_RELOAD = GAP;
    TIMER0_VALUE = GAP;
    TIMER0_CTRL = 9U;
    while (n_ticks < ROUNDS) {
        stress_scan(&chart, &ring, &pins, &out);
    }
    SYST_CSR = 0U;
    TIMER0_CTRL = 0U;
    __asm__ volatile("cpsid i" : : : "memory");
    while (ring.head != ring.tail) {
        stress_scan(&chart, &ring, &pins, &out);
    }
    const uint32_t counts[9] = {
        (uint32_t)stress_var_ticks(&chart), (uint32_t)stress_var_edges(&chart), (uint32_t)stress_var_torn(&chart),
        n_ticks, n_edges, n_nested, n_lost, ring.lost, watchdog,
    };
    const volatile uint32_t open[3] = { (uint32_t)(uintptr_t)"answer.bin", 5U, 10U };
    const volatile uint32_t file = call(1U, open);
    const volatile uint32_t write[3] = { file, (uint32_t)(uintptr_t)counts, sizeof counts };
    (void)call(5U, write);
    (void)call(2U, &file);
    (void)call(0x18U, (const volatile void *)0x20026);
    return 0;
}

extern uint32_t _stack[];
extern uint32_t _bss[];
extern uint32_t _ebss[];

static void start(void)
{
    uint32_t *at = _bss;
    while (at != _ebss) {
        *at++ = 0U;
    }
    (void)work();
    for (;;) {
    }
}

static void fault(void)
{
    __asm__ volatile("mov r0, #0x18\n mov r1, #0\n bkpt 0xab");
    for (;;) {
    }
}

__attribute__((section(".vectors"), used)) static const void *const vectors[25] = {
    _stack, (const void *)start, (const void *)fault, (const void *)fault, (const void *)fault, (const void *)fault, (const void *)fault,
    [15] = (const void *)on_tick, [24] = (const void *)on_timer0,
};
