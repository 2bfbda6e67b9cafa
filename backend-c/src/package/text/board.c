/* The machine: a millisecond clock, pins that are read and written. AVR, Cortex-M and 8051 are defined here;
   for any other machine, fill in the functions at the end. For a Cortex-M other than the STM32F103, fill in the pins. */
#if defined(__AVR__)

/* Pins 0 to 7 are port D, 8 to 15 port B, 16 to 23 port C: the numbers of an Arduino Uno up to 13. */
#include <avr/interrupt.h>
#include <avr/io.h>

static volatile uint16_t board_time = 0U;

ISR(TIMER0_COMPA_vect)
{
    board_time = (uint16_t)(board_time + 1U);
}

static void board_init(void)
{
    TCCR0A = (uint8_t)(1U << WGM01);
#if defined(CS00) && (F_CPU / 64UL / 1000UL) <= 256UL
    OCR0A = (uint8_t)((F_CPU / 64UL / 1000UL) - 1UL);
    TCCR0B = (uint8_t)((1U << CS01) | (1U << CS00));
#else
    OCR0A = (uint8_t)((F_CPU / 256UL / 1000UL) - 1UL);
    TCCR0B = (uint8_t)(1U << CS02);
#endif
#if defined(TIMSK0)
    TIMSK0 = (uint8_t)(1U << OCIE0A);
#else
    TIMSK = (uint8_t)(1U << OCIE0A);
#endif
    sei();
}

static uint16_t board_ms(void)
{
    const uint8_t before = SREG;
    uint16_t now;

    cli();
    now = board_time;
    SREG = before;
    return now;
}

/* The output register of a pin; its direction register is one below, its input register two below. */
static volatile uint8_t *board_port(uint8_t pin)
{
    switch (pin / 8U) {
#if defined(PORTD)
    case 0: return &PORTD;
#endif
#if defined(PORTB)
    case 1: return &PORTB;
#endif
#if defined(PORTC)
    case 2: return &PORTC;
#endif
    default: return NULL;
    }
}

static bool pin_read(uint8_t pin)
{
    volatile uint8_t *const port = board_port(pin);

    return (port != NULL) && ((port[-2] & (1U << (pin % 8U))) != 0U);
}

static void pin_write(uint8_t pin, bool on)
{
    volatile uint8_t *const port = board_port(pin);
    const uint8_t mask = (uint8_t)(1U << (pin % 8U));

    if (port != NULL) {
        port[-1] = (uint8_t)(port[-1] | mask);
        *port = (uint8_t)(on ? (*port | mask) : (*port & (uint8_t)~mask));
    }
}

#elif defined(__arm__)

/* The vector table, and the code before `main`. Pins 0 to 15 are port A, 16 to 31 port B. */
extern uint32_t board_data_from, board_data, board_data_end, board_bss, board_bss_end, board_stack;
int main(void);
void board_reset(void);
void board_tick(void);

static volatile uint16_t board_time = 0U;

void board_reset(void)
{
    const uint32_t *from = &board_data_from;
    uint32_t *to;

    for (to = &board_data; to < &board_data_end; ++to) {
        *to = *from;
        ++from;
    }
    for (to = &board_bss; to < &board_bss_end; ++to) {
        *to = 0U;
    }
    (void)main();
    for (;;) {
    }
}

void board_tick(void)
{
    board_time = (uint16_t)(board_time + 1U);
}

static void board_stop(void)
{
    for (;;) {
    }
}

typedef union {
    void (*service)(void);
    const void *stack;
} board_vector_t;

__attribute__((section(".vectors"), used)) static const board_vector_t board_vectors[16] = {
    { .stack = &board_stack }, { board_reset }, { board_stop }, { board_stop }, { board_stop }, { board_stop },
    { board_stop }, { NULL }, { NULL }, { NULL }, { NULL }, { board_stop }, { board_stop }, { NULL },
    { board_stop }, { board_tick }
};

#define BOARD_REGISTER(address) (*(volatile uint32_t *)(address))

static void board_init(void)
{
    /* SysTick, part of every Cortex-M3 and larger: F_CPU / 1000 clocks, interrupt, run. */
    BOARD_REGISTER(0xE000E014UL) = (F_CPU / 1000UL) - 1UL;
    BOARD_REGISTER(0xE000E018UL) = 0U;
    BOARD_REGISTER(0xE000E010UL) = 7U;
#if defined(CHIP_STM32F103)
    BOARD_REGISTER(0x40021018UL) |= (1UL << 2) | (1UL << 3); /* clocks of ports A and B */
#endif
}

static uint16_t board_ms(void)
{
    return board_time;
}

#if defined(CHIP_STM32F103)
static bool pin_read(uint8_t pin)
{
    const uint32_t port = 0x40010800UL + ((uint32_t)(pin / 16U) * 0x400UL);
    return (pin < 32U) && (((BOARD_REGISTER(port + 8UL) >> (pin % 16U)) & 1U) != 0U);
}

static void pin_write(uint8_t pin, bool on)
{
    const uint32_t port = 0x40010800UL + ((uint32_t)(pin / 16U) * 0x400UL);
    const uint32_t bit = pin % 16U;
    const uint32_t mode = port + ((bit / 8U) * 4U);

    if (pin < 32U) {
        /* Output, 2 MHz, push-pull. */
        BOARD_REGISTER(mode) = (BOARD_REGISTER(mode) & ~(0xFUL << ((bit % 8U) * 4U))) | (2UL << ((bit % 8U) * 4U));
        BOARD_REGISTER(port + 0x10UL) = on ? (1UL << bit) : (1UL << (bit + 16U));
    }
}
#else
/* FILL IN: the pins of your chip. */
static bool pin_read(uint8_t pin)
{
    (void)pin;
    return false;
}

static void pin_write(uint8_t pin, bool on)
{
    (void)pin;
    (void)on;
}
#endif

#elif defined(__SDCC_mcs51)

/* Pins 0 to 7 are P1, 8 to 15 P2, 16 to 23 P3, 24 to 31 P0. Timer 0 counts milliseconds, 12 clocks per cycle. */
#include <8052.h>
#define BOARD_RELOAD (65536UL - (F_CPU / 12UL / 1000UL))

static volatile uint16_t board_time = 0U;

void board_tick(void) __interrupt(1)
{
    TH0 = (uint8_t)(BOARD_RELOAD >> 8);
    TL0 = (uint8_t)(BOARD_RELOAD & 0xFFUL);
    board_time = (uint16_t)(board_time + 1U);
}

static void board_init(void)
{
    TMOD = 0x01U;
    TH0 = (uint8_t)(BOARD_RELOAD >> 8);
    TL0 = (uint8_t)(BOARD_RELOAD & 0xFFUL);
    ET0 = 1;
    EA = 1;
    TR0 = 1;
}

static uint16_t board_ms(void)
{
    uint16_t now;

    ET0 = 0;
    now = board_time;
    ET0 = 1;
    return now;
}

static bool pin_read(uint8_t pin)
{
    uint8_t level = 0U;

    switch (pin / 8U) {
    case 0: level = P1; break;
    case 1: level = P2; break;
    case 2: level = P3; break;
    case 3: level = P0; break;
    default: break;
    }
    return ((level >> (pin % 8U)) & 1U) != 0U;
}

static void pin_write(uint8_t pin, bool on)
{
    const uint8_t mask = (uint8_t)(1U << (pin % 8U));

    switch (pin / 8U) {
    case 0: P1 = (uint8_t)(on ? (P1 | mask) : (P1 & (uint8_t)~mask)); break;
    case 1: P2 = (uint8_t)(on ? (P2 | mask) : (P2 & (uint8_t)~mask)); break;
    case 2: P3 = (uint8_t)(on ? (P3 | mask) : (P3 & (uint8_t)~mask)); break;
    case 3: P0 = (uint8_t)(on ? (P0 | mask) : (P0 & (uint8_t)~mask)); break;
    default: break;
    }
}

#else

/* FILL IN: a millisecond clock that wraps, and the pins. */
static void board_init(void)
{
}

static uint16_t board_ms(void)
{
    return 0U;
}

static bool pin_read(uint8_t pin)
{
    (void)pin;
    return false;
}

static void pin_write(uint8_t pin, bool on)
{
    (void)pin;
    (void)on;
}

#endif
